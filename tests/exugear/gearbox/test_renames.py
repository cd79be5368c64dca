"""Files of earlier versions: old names are refused with the new ones, and `migrate` rewrites them."""

from __future__ import annotations

import os
import random
import tomllib
from pathlib import Path

import pytest

from exugear.cli.app import old_name
from exugear.gearbox.reading import GearboxFileError, parse_case
from exugear.gearbox.renames import GEARBOX_RENAMES, STUDY_RENAMES, MigrationError, Rename, migrated, new_name
from exugear.studies.sections import StudyError, parse_study

from ..cases.command import exugear

GEARBOX = """# A comment with law = "stiffness"
name = "old # names"
[bearings.left]
law = "stiffness"          # linear
damping = { radial_N_per_m = 5e4, tilt_N_m_per_rad = 1.0 }   # law
stiffness.radial_N_per_m = 1e8
[bearings."right"]
"law" = 'iso16281'
[bearings.right.damping]
axial_N_per_m = 2.0
[bodies.law]
wheels_z_mm = { wheels_z_mm = 3.0 }
description = \"\"\"
law = "stiffness" \\"\"\" quoted
\"\"\"
[[lists]]
law = [1, { law = "stiffness" }, "a]b"]
[rating]
least_S_H = 1.2
"""
NEW_GEARBOX = """# A comment with law = "stiffness"
name = "old # names"
[bearings.left]
model = "linear"          # linear
damping = { radial_N_s_per_m = 5e4, tilt_N_m_s_per_rad = 1.0 }   # law
stiffness.radial_N_per_m = 1e8
[bearings."right"]
model = 'iso16281'
[bearings.right.damping]
axial_N_s_per_m = 2.0
[bodies.law]
gears_z_mm = { wheels_z_mm = 3.0 }
description = \"\"\"
law = "stiffness" \\"\"\" quoted
\"\"\"
[[lists]]
law = [1, { law = "stiffness" }, "a]b"]
[rating]
minimum_S_H = 1.2
"""
STUDY = """name = "s"
case = "my.toml"
changes = { "bearings.left.law" = "iso16281" }
choice = { mesh_law = "seed" }
[parameters.a]
paths = ["bearings.left.damping.radial_N_per_m", "housing.factor"]
uniform = { least = 1.0, most = 2.0 }
[figures.least]
figure = "bearing_life"
by = "least"
[steady]
level = "linear"
[optimise.limits.least]
least = 1.0
"""
NEW_STUDY = """name = "s"
case = "my.toml"
changes = { "bearings.left.model" = "iso16281" }
choice = { mesh_model = "tangential" }
[parameters.a]
paths = ["bearings.left.damping.radial_N_s_per_m", "housing.factor"]
uniform = { min = 1.0, max = 2.0 }
[outputs.least]
quantity = "bearing_life"
by = "minimum"
[steady]
method = "linear"
[optimise.limits.least]
min = 1.0
"""


@pytest.mark.parametrize(("old", "new"), [(GEARBOX, NEW_GEARBOX), (STUDY, NEW_STUDY)], ids=["gearbox", "study"])
def test_old_names_are_replaced_and_nothing_else(old, new):
    text, changes = migrated(old)
    assert text == new
    assert len(changes) == sum(a != b for a, b in zip(old.split(), new.split(), strict=True))
    assert migrated(text) == (text, [])


def _example(rename: Rename) -> dict:
    content: dict = {rename.old: "x"}
    for table in reversed(rename.table.split(".") if rename.table else []):
        content = {"name" if table == "*" else table: content}
    return content


@pytest.mark.parametrize("rename", GEARBOX_RENAMES, ids=lambda rename: f"{rename.table}.{rename.old}")
def test_an_old_key_of_a_gearbox_is_refused_with_the_new_one(rename):
    with pytest.raises(GearboxFileError, match=rf"{rename.old}.*was renamed to {rename.new}; exugear migrate FILE"):
        parse_case(_example(rename), "my.toml")


@pytest.mark.parametrize(
    "rename", [one for one in STUDY_RENAMES if one.old != one.new and "figures." not in one.table], ids=str
)
def test_an_old_key_of_a_study_is_refused_with_the_new_one(rename):
    if rename.table == "outputs.*":
        pytest.skip("options of outputs are checked when the study is read")
    with pytest.raises(StudyError, match=rf"{rename.old}: was renamed to {rename.new}"):
        parse_study({"name": "a", "case": "b.toml", **_example(rename)}, "my.study.toml")


def test_names_of_today_are_no_old_names():
    for renames in (GEARBOX_RENAMES, STUDY_RENAMES):
        for rename in renames:
            tables = rename.table.replace("*", "name").split(".") if rename.table else []
            assert new_name([*tables, rename.new], renames) is None


@pytest.mark.parametrize("text", ["a = ", "[bearings.a]\nlaw = 1\nmodel = 2\n", "\x00", "[a\n"])
def test_what_cannot_be_rewritten_is_one_sentence_and_stays_as_it_is(tmp_path, text):
    file = tmp_path / "my.toml"
    file.write_text(text, encoding="utf-8")
    outcome = exugear("migrate", file)
    assert outcome.exit_code == 2
    assert "my.toml: " in outcome.stderr.replace("\n", "")
    assert file.read_text(encoding="utf-8") == text


def test_the_command_rewrites_the_file_or_another_one(tmp_path):
    file = tmp_path / "my.toml"
    file.write_text(GEARBOX, encoding="utf-8")
    other = tmp_path / "new.toml"
    assert exugear("migrate", file, "--out", other).exit_code == 0
    assert (file.read_text(encoding="utf-8"), other.read_text(encoding="utf-8")) == (GEARBOX, NEW_GEARBOX)
    outcome = exugear("migrate", file)
    assert outcome.exit_code == 0 and "line 4: law -> model" in outcome.stdout
    assert file.read_text(encoding="utf-8") == NEW_GEARBOX
    assert "no old names" in exugear("migrate", file).stdout


def test_what_is_no_gearbox_file_is_refused_before_it_is_read(tmp_path):
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    (tmp_path / "empty.toml").write_bytes(b"")
    (tmp_path / "deep.toml").write_text(f"a = {20_000 * '['}", encoding="utf-8")
    for name in ("nothing.toml", "bytes.toml", "empty.toml", "deep.toml", ".", "/dev/zero"):
        outcome = exugear("migrate", tmp_path / name)
        assert outcome.exit_code == 2, name
        assert "Traceback" not in outcome.stderr


def test_a_file_that_cannot_be_written_stays_as_it_is(tmp_path):
    file = tmp_path / "my.toml"
    file.write_text(GEARBOX, encoding="utf-8")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for target in (pipe, tmp_path, file / "below.toml"):
        assert exugear("migrate", file, "--out", target).exit_code == 2
    assert pipe.is_fifo()
    assert file.read_text(encoding="utf-8") == GEARBOX


def test_line_ends_are_kept(tmp_path):
    file = tmp_path / "my.toml"
    file.write_bytes(GEARBOX.replace("\n", "\r\n").encode())
    assert exugear("migrate", file).exit_code == 0
    assert file.read_bytes() == NEW_GEARBOX.replace("\n", "\r\n").encode()


def test_old_names_on_the_command_line_are_refused_with_the_new_ones():
    for arguments in (["sweep", "a.toml"], ["run", "a.toml", "--mesh-law", "seed"], ["steady", "--level=linear"]):
        assert "was renamed to" in old_name(arguments)
    assert old_name(["study", "sweep", "--method", "linear"]) == ""


def test_damaged_files_are_rewritten_right_or_refused():
    """Characters removed, doubled or swapped: what is still TOML keeps all its values."""
    drawn = random.Random(5)
    passed = 0
    for _ in range(2000):
        text = list(GEARBOX)
        for _ in range(drawn.randint(1, 4)):
            place = drawn.randrange(len(text))
            text[place] = drawn.choice(["", text[place] * 2, drawn.choice("[]{}\"'#=.,\n\\ a")])
        damaged = "".join(text)
        try:
            new, _ = migrated(damaged)
        except MigrationError:
            continue
        passed += 1
        tomllib.loads(new)
        assert migrated(new)[0] == new
    assert passed > 300


def test_files_of_this_project_hold_no_old_names():
    root = Path(__file__).parents[3]
    files = [*(root / "cases").rglob("*.toml"), *(root / "exugear/gearbox/templates").glob("*.toml")]
    assert len(files) > 8
    for file in files:
        text = file.read_text(encoding="utf-8")
        assert migrated(text) == (text, []), file
