"""Results of a gearbox file that has changed, or that shares its folder with another one."""

from __future__ import annotations

import json
import re

import pytest

from exugear.steady.steady_file import load_response

from ..cases.command import exugear

STIFFER = re.compile(r"radial_N_per_m = [\d.e]+")


def softened(case):
    text = case.read_text(encoding="utf-8")
    changed, count = STIFFER.subn("radial_N_per_m = 4e7", text)
    assert count and changed != text
    case.write_text(changed, encoding="utf-8")


@pytest.mark.validation
@pytest.mark.usefixtures("coarse_tables")
def test_a_report_of_a_changed_gearbox_computes_its_response_again(case):
    out = case.parent / "out"
    options = ("--variant", "bushing", "--speeds", "500:8000", "--points", "20")
    assert exugear("steady", case, "--out", out, *options).exit_code == 0
    path = out / "bushing" / "line_of_action-disc" / "steady-parametric.nc"
    kept = path.stat().st_mtime_ns
    assert exugear("report", out).exit_code == 0
    assert path.stat().st_mtime_ns == kept  # it fits, and stays
    softened(case)
    unchanged = exugear("report", out)
    assert "has changed since these results were computed" in " ".join(unchanged.output.split())
    before = load_response(path).attrs["input_hash"]
    assert exugear("modes", case, "--out", out, "--variant", "bushing").exit_code == 0
    written = json.loads(exugear("report", out, "--json").stdout)
    assert load_response(path).attrs["input_hash"] != before
    assert not [line for line in written["left_out"] if "steady" in line]
    fresh = case.parent / "fresh"
    assert exugear("modes", case, "--out", fresh, "--variant", "bushing").exit_code == 0
    assert json.loads(exugear("report", fresh, "--json").stdout)["resonances"] == written["resonances"]


def test_two_gearbox_files_in_one_folder_do_not_share_their_results(case, monkeypatch):
    monkeypatch.chdir(case.parent)
    other = case.with_name("other.toml")
    other.write_bytes(case.read_bytes())
    command = ("--variant", "rigid", "--mesh-model", "iso6336")
    assert exugear("modes", case, *command).exit_code == 0
    for verb in (("modes", other, *command), ("report", other)):
        refused = exugear(*verb)
        assert refused.exit_code == 2
        words = " ".join(refused.stderr.split())
        assert f"contains the results of another file, {case.name}" in words
        assert "--out results/" in words
    assert exugear("modes", other, *command, "--out", "own").exit_code == 0
    # A file that was renamed takes its results along.
    case.unlink()
    assert exugear("modes", other, *command).exit_code == 0
