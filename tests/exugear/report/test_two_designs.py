"""Two designs on one page: amplitudes of both, keys that differ, what else differs, refusals."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings.other_design import HighestAmplitude, change_in_decibels, differing_keys, highest_within
from exugear.report.findings.ranking import Envelope
from exugear.results.folder import keep_case
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import load_response, steady_path, stored_or_computed
from exugear.system.build import assemble

from ..cases.command import exugear
from ..cases.spur import SPUR_CASE

CHOICE = Choice("bushing", "line_of_action", "assemblies")
SETTINGS = SteadySettings(SpeedRange.from_text("-10:-35:60"), harmonics=3, at_resonances=False)
CHANGES = {"housing.factor": 0.5, "name": "stiff <b>housing</b>"}
FOLDERS = {"grc": "grc", "stiff": "<img src=x onerror=alert(1)> \x1b[1m [red]", "range": "grc"}
RANGE = {"operation.speed_range_rpm": [15.0, 20.0]}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory, stiffness: dict[str, np.ndarray]) -> Iterator[dict[str, Path]]:
    """Steady responses of the GRC, of one with a stiffer housing, and of one with another operating range."""
    gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exugear.report.findings.context.mesh_stiffness", lambda *arguments: stiffness)
        for name, changes in {"grc": {}, "stiff": CHANGES, "range": RANGE}.items():
            folder = tmp_path_factory.mktemp(name) / FOLDERS[name]
            folder.mkdir()
            changed = gearbox.varied(changes)
            keep_case(changed, folder)
            stored_or_computed(steady_path(folder, CHOICE, SETTINGS), assemble(changed, CHOICE, stiffness), SETTINGS)
            found[name] = folder
        yield found


def reported(folder: Path, other: Path) -> Any:
    return exugear("report", folder, "--stored", "--compare", other, "--json")


@pytest.mark.validation
def test_the_highest_amplitudes_are_those_of_both_responses(folders: dict[str, Path]) -> None:
    outcome = reported(folders["grc"], folders["stiff"])
    assert outcome.exit_code == 0, outcome.stderr
    page = (folders["grc"] / "report.html").read_text(encoding="utf-8")
    assert 'id="two-designs"' in page and "housing.factor" in page
    assert "<b>housing" not in page and "<img src=x" not in page
    highest = {}
    for name in ("grc", "stiff"):
        data = load_response(steady_path(folders[name], CHOICE, SETTINGS))
        low, high = json.loads(data.attrs["operating_range"])
        inside = (np.abs(data["speed"]) >= low) & (np.abs(data["speed"]) <= high)
        signal = list(data["signal"].to_numpy()).index("overall_dte")
        highest[name] = float(data["amplitude"][inside.to_numpy(), 1:, signal].max())
    decibels = 20.0 * math.log10(highest["stiff"] / highest["grc"])
    line = next(
        line for line in json.loads(outcome.stdout)["statements"] if line.startswith("Transmission error, highest")
    )
    assert f"({decibels:+.1f} dB)" in line


@pytest.mark.validation
def test_other_operating_ranges_and_folders_without_amplitudes_are_refused(folders: dict[str, Path], tmp_path) -> None:
    before = (folders["grc"] / "report.html").exists()
    outcome = reported(folders["grc"], folders["range"])
    assert outcome.exit_code == 2 and "15 to 20 rpm" in outcome.stderr and "speed_range_rpm" in outcome.stderr
    assert (folders["grc"] / "report.html").exists() == before
    missing = reported(folders["grc"], tmp_path / "none")
    assert missing.exit_code == 2 and "no such folder" in missing.stderr
    empty = reported(folders["grc"], tmp_path)
    assert empty.exit_code == 2 and str(tmp_path) in "".join(empty.stderr.split("\n"))
    keep_case(Gearbox.from_toml("cases/grc750/gearbox.toml"), tmp_path)
    nothing = reported(folders["grc"], tmp_path)
    assert nothing.exit_code == 2 and "exugear steady" in nothing.stderr


@pytest.mark.validation
def test_a_damaged_response_of_the_other_design_is_the_reason(folders: dict[str, Path], tmp_path: Path) -> None:
    keep_case(Gearbox.from_toml("cases/grc750/gearbox.toml"), tmp_path)
    path = steady_path(tmp_path, CHOICE, SETTINGS)
    path.parent.mkdir(parents=True)
    path.write_bytes(steady_path(folders["grc"], CHOICE, SETTINGS).read_bytes()[:-100])
    outcome = reported(folders["grc"], tmp_path)
    assert outcome.exit_code == 2
    assert "no amplitudes to compare" in outcome.stderr and path.name in "".join(outcome.stderr.split("\n"))


@pytest.mark.validation
def test_different_ranges_are_refused_before_anything_is_computed(folders: dict[str, Path], monkeypatch) -> None:
    monkeypatch.setattr("exugear.cli.tasks.report._compute_missing", lambda *arguments: pytest.fail("computed"))
    outcome = exugear("report", folders["grc"], "--levers", "--compare", folders["range"])
    assert outcome.exit_code == 2 and "15 to 20 rpm" in outcome.stderr


def test_differing_keys_are_those_that_change_results(grc: Gearbox) -> None:
    changed = grc.varied(CHANGES | {"gears.sun.face_width_mm": 221.0})
    found = {difference.key: (difference.own, difference.other) for difference in differing_keys(grc, changed)}
    assert found.pop("housing.factor")[1] == 0.5
    assert found.pop("gears.sun.face_width_mm") == (220.0, 221.0)
    assert not found
    assert not list(differing_keys(grc, grc))


def test_highest_amplitudes_are_of_the_range_and_zero_has_no_decibels() -> None:
    curve = Envelope(np.array([1.0, 2.0, 3.0]), np.array([9.0, 4.0, 5.0]))
    assert highest_within(curve, (1.5, 3.0)) == HighestAmplitude(5.0, 3.0)
    assert highest_within(curve, (4.0, 5.0)) is None
    assert change_in_decibels(HighestAmplitude(1.0, 1.0), HighestAmplitude(10.0, 2.0)) == pytest.approx(20.0)
    assert math.isnan(change_in_decibels(HighestAmplitude(0.0, 1.0), HighestAmplitude(1.0, 1.0)))


def case_in(folder: Path) -> Path:
    case = folder / "my" / "gearbox.toml"
    case.parent.mkdir()
    case.write_text(SPUR_CASE, encoding="utf-8")
    return case.relative_to(folder)


def test_a_gearbox_file_without_results_names_their_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    missing = exugear("report", case_in(tmp_path))
    assert missing.exit_code == 2
    assert "results/my: no such folder; specify the results folder of exugear run" in missing.stderr
