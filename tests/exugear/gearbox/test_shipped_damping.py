"""Gearbox files that come with the program state a damping that gearboxes have."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

import pytest

from exugear.gearbox.sections.case import DampingSection
from exugear.gearbox.templates.kinds import KINDS, template

ROOT = Path(__file__).parents[3]
MEASURED = (1.0, 4.0)
"""Range of the damping of gearboxes, percent of critical."""


def shipped() -> dict[str, str]:
    """Texts of the gearbox files in cases and templates, and of those written out in examples."""
    texts = {
        f"{path.relative_to(ROOT)}": path.read_text(encoding="utf-8") for path in ROOT.glob("cases/*/gearbox.toml")
    }
    texts |= {f"template {kind}": template(kind) for kind in KINDS}
    for path in sorted(ROOT.glob("examples/*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and "\n[gears." in node.value:
                texts[f"examples/{path.name}"] = node.value
    return texts


SHIPPED = shipped()


def test_files_are_found():
    assert {"cases/grc750/gearbox.toml", "template wind", "examples/steady_contact_loss.py"} <= SHIPPED.keys()


@pytest.mark.parametrize("name", SHIPPED)
def test_the_damping_band_of_a_shipped_file_includes_what_gearboxes_have(name):
    section = DampingSection(**tomllib.loads(SHIPPED[name])["damping"])
    assert isinstance(section.modal_percent, float)
    assert MEASURED[0] <= section.modal_percent <= MEASURED[1]
    assert section.modal_band_percent is not None
    assert section.modal_band_percent[0] <= MEASURED[0]
    assert section.modal_band_percent[1] >= MEASURED[1]
