"""A project does what the command line does, from the same folder, and says what it is in a line."""

from __future__ import annotations

import tomllib
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from exugear import Choice, Gearbox, GearboxFileError, Modes, Project, Run
from exugear.gearbox.variant import VariantError
from exugear.project import default_folder
from exugear.results.run_file import load_run
from exugear.system.build import assemble
from exugear.system.modes import load_modes

from .cases.command import exugear
from .cases.spur import SPUR_CASE

SPUR = Choice("bushing", "iso6336", load_case="run_up")


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "spur" / "gearbox.toml"
    path.parent.mkdir()
    path.write_text(SPUR_CASE, encoding="utf-8")
    return path


@pytest.fixture
def project(case: Path, tmp_path: Path) -> Project:
    return Project.from_toml(case, tmp_path / "results", SPUR)


def test_a_choice_left_open_is_filled_in_by_the_gearbox_file(case: Path) -> None:
    project = Project.from_toml(case)
    assert project.choice == Choice("bushing", "line_of_action", "disc", "run_up")
    assert project.folder == default_folder(case) == Path("results/spur")


def test_other_choices_leave_gearbox_and_folder_alone(project: Project) -> None:
    other = project.chosen(variant="rigid", mesh_model="constant")
    assert (other.gearbox, other.folder) == (project.gearbox, project.folder)
    assert other.choice == Choice("rigid", "constant", "disc", "run_up")
    assert other.modes_path != project.modes_path and other.run_directory != project.run_directory


def test_its_modes_are_those_of_the_command_line(project: Project, case: Path, tmp_path: Path) -> None:
    modes = project.modes()
    assert isinstance(modes, Modes)
    out = tmp_path / "by-command"
    options = ["--variant", "bushing", "--mesh-model", "iso6336", "--out", str(out)]
    assert exugear("modes", case, *options).exit_code == 0
    theirs = load_modes(out / project.modes_path.relative_to(project.folder))
    ours = load_modes(project.modes_path)
    assert ours.identical(theirs)
    assert np.array_equal(ours["frequency"], modes.frequency)


def test_modes_that_are_there_are_taken_to_the_bit_and_those_of_another_input_are_not(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = project.modes()
    with monkeypatch.context() as patched:
        patched.setattr("exugear.project.modes_of", None)
        again = project.modes()
    for field in fields(Modes):
        if field.name != "assembly":
            one, other = getattr(first, field.name), getattr(again, field.name)
            assert np.array_equal(one, other) and np.asarray(one).dtype == np.asarray(other).dtype, field.name
    assert again.to_dataset().identical(first.to_dataset())
    softer = replace(project, gearbox=project.gearbox.varied({"housing.factor": 0.2}))
    assert not np.array_equal(softer.modes().frequency, first.frequency)
    project.modes_path.write_bytes(project.modes_path.read_bytes()[:-100])
    assert np.array_equal(project.modes().frequency, first.frequency)


@pytest.mark.validation
def test_its_run_is_that_of_the_command_line(project: Project, case: Path, tmp_path: Path) -> None:
    run = project.run(duration=0.02)
    assert isinstance(run, Run) and run.complete and run.path == project.run_path
    out = tmp_path / "by-command"
    options = ["--variant", "bushing", "--mesh-model", "iso6336", "--duration", "0.02", "--out", str(out)]
    assert exugear("run", case, *options).exit_code == 0
    assert load_run(run.path).identical(load_run(out / run.path.relative_to(project.folder)))


def test_its_folder_can_be_taken_up_again_and_reported(project: Project) -> None:
    project.modes()
    again = Project.from_folder(project.folder, SPUR)
    assert again.gearbox.content == project.gearbox.content and again.choice == project.choice
    assert again.report().path.read_text(encoding="utf-8").count("<html") == 1


def test_a_folder_without_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(GearboxFileError, match=": contains no results"):
        Project.from_folder(tmp_path)


def test_an_unknown_load_case_is_refused_and_nothing_is_written(project: Project) -> None:
    with pytest.raises(GearboxFileError, match="no load case 'storm'"):
        project.chosen(load_case="storm").run()
    assert not project.chosen(load_case="storm").run_directory.exists()


def test_it_is_one_line(project: Project) -> None:
    assert repr(project).startswith("<Project '") and "\n" not in repr(project) and len(repr(project)) < 300
    assert "bushing, iso6336, disc, run_up" in repr(project)


def test_an_elastic_variant_without_its_bodies_is_refused_by_name(grc_shafts: Gearbox, stiffness: dict) -> None:
    with pytest.raises(VariantError, match=r"no reduced body for lss.*reduced_bodies"):
        assemble(grc_shafts, Choice("flexible"), stiffness)


def test_gearbox_and_choice_are_frozen(project: Project) -> None:
    with pytest.raises(AttributeError):
        project.choice.variant = "rigid"  # type: ignore[misc]
    with pytest.raises(AttributeError):
        project.folder = Path()  # type: ignore[misc]


def test_a_choice_is_the_same_for_every_gearbox_that_has_it() -> None:
    spur = Gearbox.from_dict(tomllib.loads(SPUR_CASE), "spur.toml")
    assert SPUR.of(spur) == SPUR.of(spur).of(spur)
    assert hash(SPUR.of(spur)) == hash(Choice("bushing", "iso6336", "disc", "run_up"))
