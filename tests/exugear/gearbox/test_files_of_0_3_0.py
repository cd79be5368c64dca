"""Every file and key that version 0.3.0 came with is read today after `exugear migrate`.

The folder `version_0_3_0` has them as they were: templates, the GRC with its studies, and `keys.toml`, which has an
example of each key of that version.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import exugear.gearbox.sections.schema
from exugear.gearbox.reading import GearboxFileError, parse_case
from exugear.gearbox.renames import migrated
from exugear.studies.sections import parse_study

from ..cases.command import exugear as command

FILES = Path(__file__).parent.parent / "cases" / "version_0_3_0"
STUDIES = sorted(path.name for path in FILES.glob("*.study.toml"))
TEMPLATES = ("pair", "parallel", "planetary", "wind")
TODAY = Path(exugear.gearbox.sections.schema.__file__).parent / "examples.toml"


def text_of(name: str) -> str:
    return (FILES / name).read_text(encoding="utf-8")


def leaves(content: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Paths and values of all keys, in their order."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield from leaves(value, (*path, key))
    else:
        yield path, content


def test_the_files_are_those_of_0_3_0() -> None:
    assert len(STUDIES) == 5
    assert len(list(leaves(tomllib.loads(text_of("keys.toml"))))) == 241


@pytest.mark.parametrize("name", [*(f"{kind}.toml" for kind in TEMPLATES), "grc750.toml"])
def test_a_gearbox_file_is_refused_with_the_command_and_read_after_it(name: str) -> None:
    old = text_of(name)
    with pytest.raises(GearboxFileError, match="was renamed to .*; exugear migrate FILE.toml"):
        parse_case(tomllib.loads(old), name)
    new, _ = migrated(old)
    parse_case(tomllib.loads(new), name)


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_is_read_after_the_command(name: str) -> None:
    new, changes = migrated(text_of(name))
    assert changes
    parse_study(tomllib.loads(new), name)


@pytest.mark.parametrize("name", [f"{kind}.toml" for kind in TEMPLATES] + ["grc750.toml", "keys.toml", *STUDIES])
def test_values_stay_but_for_words_with_new_names(name: str) -> None:
    old, new = (list(leaves(tomllib.loads(text))) for text in (text_of(name), migrated(text_of(name))[0]))
    assert len(old) == len(new)
    for (_, before), (path, after) in zip(old, new, strict=True):
        assert before == after or (isinstance(before, str) and isinstance(after, str)) or path[-1] == "paths", path


def test_every_key_of_0_3_0_has_its_place_today() -> None:
    today = {path for path, _ in leaves(tomllib.loads(TODAY.read_text(encoding="utf-8")))}
    migrated_keys = {path for path, _ in leaves(tomllib.loads(migrated(text_of("keys.toml"))[0]))}
    assert migrated_keys - today == set()


@pytest.mark.parametrize(
    "kind", ["pair", "parallel", *(pytest.param(name, marks=pytest.mark.validation) for name in ("planetary", "wind"))]
)
def test_a_template_of_0_3_0_passes_the_checks_after_the_command(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "my.toml"
    file.write_text(text_of(f"{kind}.toml"), encoding="utf-8")
    assert command("migrate", file).exit_code == 0
    outcome = command("check", file)
    assert outcome.exit_code == 0, outcome.stderr
