"""The command `report`: bad options are refused before anything is computed; a gearbox file names its results."""

from __future__ import annotations

from pathlib import Path

import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.results.folder import keep_case

from ..cases.command import exugear
from .test_two_designs import case_in


@pytest.fixture
def folder(grc: Gearbox, tmp_path: Path) -> Path:
    """Results folder of the GRC without results."""
    keep_case(grc, tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--resonance", "2"], "--resonance and --load are for design changes: add --levers"),
        (["--load", "50%"], "--resonance and --load are for design changes: add --levers"),
        (["--levers", "--load", "half"], "no load 'half'; specify a load case (reference, generating,"),
        (["--levers", "--load", "50%", "--load", "0%"], "no load '0%'"),
        (["--levers", "--load", "../../etc"], "no load '../../etc'"),
        (["--levers", "--resonance", "0"], "--resonance"),
        (["--quantity", "noise"], "--quantity"),
    ],
)
def test_bad_options_end_with_one_message_and_write_nothing(folder: Path, options: list[str], message: str) -> None:
    before = sorted(folder.rglob("*"))
    outcome = exugear("report", folder, *options)
    assert outcome.exit_code == 2
    assert message in " ".join(outcome.stderr.split())
    assert "Traceback" not in outcome.stderr and sorted(folder.rglob("*")) == before


def test_an_unknown_quantity_in_a_file_is_one_message(grc: Gearbox) -> None:
    with pytest.raises(Exception, match=r"report\.quantity") as caught:
        grc.varied({"report.quantity": "noise"})
    assert "transmission_error" in str(caught.value) and len(str(caught.value)) < 500


@pytest.mark.validation
def test_a_gearbox_file_stands_for_its_results_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    case = case_in(tmp_path)
    modes = exugear("modes", case, "--variant", "rigid", "--mesh-model", "iso6336")
    assert modes.exit_code == 0, modes.stderr
    report = exugear("report", case)
    assert report.exit_code == 0, report.stderr
    assert (tmp_path / "results" / "my" / "report.html").is_file()
