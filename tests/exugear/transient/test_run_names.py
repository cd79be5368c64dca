"""What the file of a run says of itself, and that a run is the same from Python and from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from exugear.gearbox.choice import Choice
from exugear.project import Project
from exugear.results.run_file import load_run

from ..cases.case_mutations import toml_text
from ..cases.command import exugear
from ..cases.gear_trains import planetary


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("planetary") / "gearbox.toml"
    file.write_text(toml_text(planetary("ring")), encoding="utf-8")
    return file


def test_every_variable_of_a_run_has_a_name_for_people_and_forces_name_their_bodies(case: Path) -> None:
    data = load_run(Project.from_toml(case, case.parent / "python", Choice("rigid")).run().path)
    signals = [name for name in data.data_vars if not str(name).startswith("state_")]
    assert len(signals) > 10
    assert all(data[name].attrs["long_name"] and data[name].attrs["units"] for name in signals)
    assert data["axis"].to_numpy().tolist() == ["x", "y", "z"]
    bodies = dict(entry.split(": ") for entry in data.attrs["mesh_bodies"].split("; "))
    assert bodies["sun_planet_2"] == "sun, planet_2" and bodies["planet_ring_1"] == "planet_1, housing"
    supports = dict(entry.split(": ") for entry in data.attrs["support_bodies"].split("; "))
    assert supports == {
        "sun": "sun, ground",
        "carrier": "carrier, ground",
        **{f"planet_{number}": f"planet_{number}, carrier" for number in (1, 2, 3)},
    }
    assert list(supports) == data["support"].to_numpy().tolist()


def test_python_and_the_command_line_run_the_same_by_default(case: Path) -> None:
    by_python = Project.from_toml(case, case.parent / "again", Choice("rigid")).run()
    outcome = exugear("run", case, "--variant", "rigid", "--out", case.parent / "line")
    assert outcome.exit_code == 0, outcome.output
    by_line = case.parent / "line" / by_python.path.relative_to(case.parent / "again")
    one, other = load_run(by_python.path), load_run(by_line)
    assert one.attrs == other.attrs
    assert one.equals(other)
