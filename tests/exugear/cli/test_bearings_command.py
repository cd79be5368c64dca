"""The verb `bearings`, what `check` says of bearings, and runs and modes of non-linear ones."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.results.run_file import load_run
from exugear.system.modes import load_modes
from exugear.system.signals import energy_residual
from exugear.system.statics import BalanceError

from ..cases.bearing import BEARING_CASE, NAMES
from ..cases.command import exugear

FIGURES = {"radial_load_kN", "radial_stiffness_N_per_m", "contact_pressure_MPa", "L10_Mrev", "L10r_Mrev", "remarks"}


@pytest.fixture
def case(tmp_path: Path) -> Path:
    path = tmp_path / "bearing_case.toml"
    path.write_text(BEARING_CASE, encoding="utf-8")
    return path


def rewritten(case: Path, *changes: tuple[str, str]) -> Path:
    content = case.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in content
        content = content.replace(old, new)
    case.write_text(content, encoding="utf-8")
    return case


def non_linear(case: Path) -> Path:
    for name in NAMES:
        rewritten(case, (f"[bearings.{name}]\n", f'[bearings.{name}]\nmodel = "iso16281"\ncage = "turning"\n'))
    return case


@pytest.mark.validation
def test_bearings_prints_a_table_and_writes_the_same_figures(case: Path) -> None:
    out = case.parent / "out"
    printed = exugear("bearings", case, "--out", out)
    assert printed.exit_code == 0, printed.stderr
    assert all(name in printed.stdout for name in NAMES)
    told = json.loads(exugear("bearings", case, "--out", out, "--json").stdout)
    written = json.loads(Path(told["file"]).read_text(encoding="utf-8"))
    assert written["bearings"] == told["bearings"]
    assert [bearing["bearing"] for bearing in told["bearings"]] == list(NAMES)
    assert all(bearing.keys() >= FIGURES for bearing in told["bearings"])
    assert len(written["input_hash"]) == 64


@pytest.mark.validation
def test_a_given_rating_replaces_the_estimated_one(case: Path) -> None:
    section, ratings = "[bearings.ball.catalogue]\n", "dynamic_rating_kN = 14.0\nstatic_rating_kN = 7.8\n"
    rated = rewritten(case, (section, section + ratings))
    ball, roller, *_ = json.loads(exugear("bearings", rated, "--out", case.parent / "out", "--json").stdout)["bearings"]
    assert (ball["dynamic_rating_kN"], ball["static_rating_kN"]) == (14.0, 7.8)
    assert not ball["ratings_estimated"]
    assert roller["ratings_estimated"]
    # ISO 281: a pure radial load, so that P is F_r.
    assert ball["L10_Mrev"] == pytest.approx((14.0 / ball["radial_load_kN"]) ** 3, rel=0.02)


def test_check_tells_load_and_range_of_what_is_estimated_and_writes_nothing(case: Path) -> None:
    summary = json.loads(exugear("check", case, "--json").stdout)
    ball = summary["bearings"][0]
    assert {"element_diameter_mm", "element_count", "radial_clearance_mm"} <= ball["estimated"].keys()
    with_little, with_much = ball["estimated"]["radial_clearance_mm"]["radial_stiffness_N_per_m"]
    assert with_little == pytest.approx(ball["radial_stiffness_N_per_m"])  # none is what is taken
    assert with_much < with_little
    assert [path.name for path in case.parent.iterdir()] == [case.name]


def test_check_notes_opposed_tapered_bearings_in_one_line_and_warns_of_a_single_one(case: Path) -> None:
    findings = json.loads(exugear("check", case, "--json").stdout)["findings"]
    notes = [own["text"] for own in findings if own["level"] == "note"]
    assert notes == [
        "bearings.taper_1, taper_2: locate in one axial direction each, opposed to each other; with model = 'linear' "
        "their axial stiffness acts in both directions"
    ]
    one_way = "locates its inner ring axially in one direction only"
    assert not any(one_way in own["text"] for own in findings)
    # The ball bearing of the other shaft, as an angular contact bearing: nothing holds that shaft the other way.
    single = rewritten(case, ('type = "deep_groove_ball"', 'type = "angular_contact_ball"\ncontact_angle_deg = 40.0'))
    push = '[forces.axial]\nbody = "shaft_1"\nz_mm = 0.0\nforce_N = [1.0, 0.0, 2000.0]\n'
    single.write_text(single.read_text("utf-8") + push, encoding="utf-8")
    warnings = json.loads(exugear("check", single, "--json").stdout)["warnings"]
    assert any(
        f"bearings.ball: {one_way}, against a load towards +z; no other bearing of its body carries a load towards -z"
        == line
        for line in warnings
    ), warnings


def test_check_puts_the_sign_of_a_torque_before_warnings_that_follow_from_it(tmp_path: Path) -> None:
    text = (files("exugear.gearbox.templates") / "parallel.toml").read_text("utf-8")
    assert "output = -" in text
    wrong = tmp_path / "gearbox.toml"
    wrong.write_text(text.replace("output = -", "output = "), encoding="utf-8")
    findings = json.loads(exugear("check", wrong, "--json").stdout)["findings"]
    warnings = [own["text"] for own in findings if own["level"] == "warning"]
    assert warnings[0].startswith("load_cases.")
    assert any(line.startswith("seals.") for line in warnings[1:])


def test_check_compares_a_stated_load_with_the_reaction(case: Path) -> None:
    stated = rewritten(case, ("[bearings.ball.catalogue]\n", "[bearings.ball.catalogue]\nradial_load_kN = 9.0\n"))
    warnings = json.loads(exugear("check", stated, "--json").stdout)["warnings"]
    assert any(
        "bearings.ball: radial_load_kN = 9 is specified; the static load results in 2." in line for line in warnings
    )


def test_a_load_beyond_the_static_rating_is_told(case: Path) -> None:
    heavy = rewritten(case, ("torques_N_m = { shaft_1 = 100.0 }, locked", "torques_N_m = { shaft_1 = 1200.0 }, locked"))
    warnings = json.loads(exugear("check", heavy, "--json").stdout)["warnings"]
    assert any(
        "ball: equivalent static load" in line and "kN exceeds its estimated static rating" in line for line in warnings
    )


@pytest.mark.validation
def test_what_holds_no_axial_load_fails_with_the_bearings_named(case: Path) -> None:
    loose = rewritten(case, ('locates_towards = "-z"', 'locates_towards = "+z"'))
    failed = exugear("bearings", loose, "--out", case.parent / "out")
    assert failed.exit_code == 1
    assert (
        "taper_1, taper_2: located axially in one direction only; check arrangements and `locates_towards`"
        in failed.stderr
    )
    said = json.loads(exugear("check", loose, "--json").stdout)
    assert any("taper_1, taper_2" in line for line in said["warnings"])


@pytest.mark.parametrize(("options", "words"), [(["--variant", "rigid"], "ideal joints instead of bearings")])
def test_bearings_refuses_what_has_none(case: Path, options: list[str], words: str) -> None:
    refused = exugear("bearings", case, "--out", case.parent / "out", *options)
    assert refused.exit_code == 2
    assert words in refused.stderr
    assert not (case.parent / "out").exists()


@pytest.mark.validation
def test_non_linear_bearings_go_through_modes_run_and_file(case: Path) -> None:
    """By the compiled solver, cages turning: energy closes, and the files say what the bearings follow."""
    out = case.parent / "out"
    common = [non_linear(case), "--variant", "bushing", "--mesh-model", "iso6336", "--out", out]
    assert exugear("modes", *common).exit_code == 0
    ran = exugear("run", *common, "--duration", 0.2)
    assert ran.exit_code == 0, ran.stderr
    run = load_run(next(out.rglob("run.nc")))
    modes = load_modes(next(out.rglob("modes.nc")))
    words = "; ".join(f"{name}: rolling elements to ISO/TS 16281, cage turning" for name in NAMES)
    assert run.attrs["bearing_laws"] == modes.attrs["bearing_laws"] == words
    assert abs(energy_residual(run)) < 1e-5
    force = np.linalg.norm(run["support_force"].to_numpy()[:, :, :2], axis=2)
    assert isinstance(run, xr.Dataset)
    assert np.all(force[len(force) // 2 :].mean(axis=0) > 100.0)


@pytest.mark.sample
@pytest.mark.parametrize(
    ("place", "code"),
    [
        ("exugear.report.findings.parameter_variations.vary_parameter", 0),
        ("exugear.report.findings.context.assemble", 2),
    ],
)
def test_a_report_leaves_out_what_no_longer_balances(
    case: Path, monkeypatch: pytest.MonkeyPatch, place: str, code: int
) -> None:
    """An assumption that is varied too far, and a model that has no static state: a line each, no more."""
    out = case.parent / "out"
    assert exugear("modes", case, "--variant", "bushing", "--mesh-model", "iso6336", "--out", out).exit_code == 0

    def unbalanced(*arguments: object) -> None:
        raise BalanceError("static state: static equilibrium not found, the residual remains at")

    monkeypatch.setattr(place, unbalanced)
    reported = exugear("report", out, "--near", 500.0)
    assert isinstance(reported.exception, SystemExit | None)
    assert ": static equilibrium not found, the residual remains at" in reported.stderr
    assert "Traceback" not in reported.stderr
    assert reported.exit_code == code
