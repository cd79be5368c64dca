"""Settings of the gallery: examples run while the site is built, and a failing one stops the build.

Examples run again when they or any source of the packages changed; tables and other results that fit their input are
kept in ``examples/results``.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

ORDER = (
    "first_table",
    "tip_relief",
    "misalignment",
    "resonances",
    "bearing_stiffness",
    "planet_phasing",
    "elastic_shaft",
    "step_housing",
    "steady_contact_loss",
    "measured_run_up",
    "turbine_loads",
    "rexs_file",
    "compare_designs",
    "study",
)
"""Order of the examples, from first steps to special topics."""


def settings(root: Path) -> dict[str, Any]:
    """Return the settings of sphinx-gallery for the project in a folder."""
    return {
        "examples_dirs": [str(root / "examples")],
        "gallery_dirs": ["gallery"],
        "filename_pattern": r"\.py$",
        "within_subsection_order": "gallery.place",
        "abort_on_example_error": True,
        "only_warn_on_example_error": False,
        "run_stale_examples": sources_changed(root),
        "image_scrapers": ("gallery.figures_of_a_block",),
        "capture_repr": ("_repr_html_", "__repr__"),
        "ignore_repr_types": r"Figure|Axes",
        "write_computation_times": False,
        "show_signature": False,
        "download_all_examples": False,
        "reset_modules": (),
        "min_reported_time": 0.0,
    }


def figures_of_a_block(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the figures of an example block, also those without pyplot or of axes, and return their reST."""
    names, shown = block_vars["example_globals"], block_vars.setdefault("shown", [])
    values = [value.figure if isinstance(value, Axes) else value for value in names.values()]
    found = {id(value): value for value in values if isinstance(value, Figure)}
    new = [figure for key, figure in found.items() if key not in {id(old) for old in shown}]
    shown.extend(new)
    paths = []
    for figure, path in zip(new, block_vars["image_path_iterator"], strict=False):
        figure.savefig(path, dpi=130)
        paths.append(path)
    return figure_rst(paths, gallery_conf["src_dir"])


def sources_changed(root: Path) -> bool:
    """Return whether the packages changed since the examples ran, from a stored digest."""
    files = sorted(file for package in ("exugear", "fe_ste") for file in (root / package).rglob("*.py"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
    note = root / "docs" / "gallery" / "sources.sha256"
    changed = not note.is_file() or note.read_text(encoding="ascii") != digest
    for page in note.parent.glob("*.rst"):
        if page.stem not in ("index", *ORDER):  # its example is gone
            page.unlink()
    note.parent.mkdir(parents=True, exist_ok=True)
    note.write_text(digest, encoding="ascii")
    return changed


def place(file: str) -> int:
    """Return the position of an example."""
    return ORDER.index(Path(file).stem)
