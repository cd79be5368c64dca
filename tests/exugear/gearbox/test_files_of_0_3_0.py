"""Every file and key that version 0.3.0 came with is read today after `exugear migrate`.

The folder `version_0_3_0` has them as they were: templates, the GRC with its studies, and `keys.toml`, which has an
example of each key of that version.
"""

from __future__ import annotations

import hashlib
import json
import shutil
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


def test_a_results_folder_of_0_3_0_names_both_commands_once(tmp_path: Path) -> None:
    """Its copy of the gearbox file has the old names, whatever has become of the file since."""
    stored = {"source": str(tmp_path / "my.toml"), "content": tomllib.loads(text_of("pair.toml"))}
    text = json.dumps([stored["source"], stored["content"]], sort_keys=True)
    checksum = hashlib.sha256(text.encode()).hexdigest()
    (tmp_path / "case.json").write_text(json.dumps({**stored, "checksum": checksum}), encoding="utf-8")
    outcome = command("report", tmp_path, "--stored")
    assert outcome.exit_code == 2
    told = " ".join(outcome.stderr.split())
    assert "written by an earlier version, whose keys have other names; run exugear migrate" in told
    assert told.count("case.json") == 1
    assert not (tmp_path / "report.html").exists()


@pytest.mark.validation
def test_modes_of_0_3_0_are_named_and_computed_again(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """`parallel-modes.nc` is what `exugear modes` of 0.3.0 wrote for its template `parallel`."""
    file = tmp_path / "my.toml"
    file.write_text(migrated(text_of("parallel.toml"))[0], encoding="utf-8")
    stored = tmp_path / "results" / "bushing" / "line_of_action-discs" / "modes.nc"
    stored.parent.mkdir(parents=True)
    shutil.copy(FILES / "parallel-modes.nc", stored)
    outcome = command("modes", file, "--variant", "bushing", "--out", tmp_path / "results")
    assert outcome.exit_code == 0
    (told,) = (record.getMessage() for record in caplog.records if "modes.nc" in record.getMessage())
    assert told.endswith(
        "modes.nc: is not a file of eigenmodes: its attribute mesh_model is missing; it is computed again"
    )
    assert stored.read_bytes() != (FILES / "parallel-modes.nc").read_bytes()
    caplog.clear()
    again = command("modes", file, "--variant", "bushing", "--out", tmp_path / "results")
    assert again.exit_code == 0
    assert "modes.nc" not in caplog.text
