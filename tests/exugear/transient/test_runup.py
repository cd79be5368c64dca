"""Runs in time: energy, files, interruption, errors."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import GearboxFileError
from exugear.results.run_file import load_run
from exugear.system.signals import BALANCE_TERMS
from exugear.transient.exudyn_model.system import ExudynSystem
from exugear.transient.outcome import Progress, RunError
from exugear.transient.runup import simulate

from ..cases.assembled import simulated


def balance_residual(data: xr.Dataset) -> float:
    """Residual of the energy account over the run, as a share of the change of kinetic energy."""
    change = {term: float(data[term][-1] - data[term][0]) for term in BALANCE_TERMS}
    kinetic = change["kinetic_energy"]
    return (2 * change["work_of_loads"] - sum(change.values())) / kinetic


@pytest.mark.sample
@pytest.mark.parametrize("variant", ["rigid", "bushing", "flexible"])
@pytest.mark.parametrize("case", ["reference", "generating"])
def test_work_of_the_loads_is_accounted_for(
    grc_shafts: Gearbox, stiffness: dict, tmp_path: Path, variant: str, case: str
) -> None:
    run = simulated(grc_shafts, Choice(variant, load_case=case), stiffness, tmp_path, duration=0.3)
    data = load_run(run.path)
    # 0.1 % is asked for. Everything is accounted for, so only the quadrature of the powers is left.
    assert abs(balance_residual(data)) < 1e-6
    sense = -1 if case == "reference" else 1
    assert float(data.input_speed[-1]) == pytest.approx(sense * 0.75 * 0.3, rel=2e-2)


@pytest.mark.validation
def test_seed_law_shows_its_non_conservative_work(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    # With the light damping of the case the law's unsymmetric tangent makes a bearing mode flutter.
    damped = grc.varied({"damping.bearing_time_s": 2.5e-5, "damping.mesh_time_s": 2.5e-5})
    data = load_run(simulate(damped, Choice("bushing", "tangential"), stiffness, tmp_path, duration=0.3).path)
    assert abs(balance_residual(data)) < 1e-6
    assert abs(float(data.non_conservative_work[-1])) > 1e-3
    conservative = load_run(simulate(damped, Choice("bushing"), stiffness, tmp_path, duration=0.3).path)
    assert abs(float(conservative.non_conservative_work[-1])) < 1e-9


def test_run_starts_without_a_shock(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    """Mesh forces stay at their static value while the mesh cycle hardly moves."""
    data = load_run(simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.05).path)
    force = data.mesh_force.sel(mesh="high_speed")
    # 30 ms at 0.75 rad/s2 turn the high-speed mesh by 0.1 of a cycle; a step of load would ring by 100 %.
    assert float(np.ptp(force.to_numpy())) < 0.01 * float(force.mean())


def test_file_carries_what_was_run_and_units(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    run = simulate(grc, Choice("bushing"), stiffness, tmp_path, duration=0.01)
    assert run.path == tmp_path / "bushing" / "reference-line_of_action-assemblies" / "run.nc"
    data = load_run(run.path)
    assert data.attrs["inertias"] == "assemblies"
    assert data.attrs["complete"] == 1
    assert data["mesh_force"].attrs["units"] == "N"
    assert data["mesh_force"].attrs["sign_convention"] == "positive: compression of the loaded flank"
    assert list(data.mesh.values[:2]) == ["sun_planet_1", "sun_planet_2"]
    assert data.sizes["support"] == 14
    assert np.diff(data.time) == pytest.approx(5e-5, rel=1e-9)
    angle = data.overall_dte_angle.to_numpy() * data.attrs["output_base_radius"]
    assert np.array_equal(data.overall_dte.to_numpy(), angle)


def test_joint_forces_of_the_rigid_variant_balance_the_torque(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    data = load_run(simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.005).path)
    pin = data.support_force.sel(support="pin_1").isel(time=0)
    # First planet at +x: the pin pushes it in +y with 240 kNm / 3 / 0.308 m; 0.5 % goes into acceleration.
    assert float(pin[1]) == pytest.approx(240e3 / 3 / 0.308, rel=0.02)
    carrier = data.support_force.sel(support="carrier").isel(time=0)
    assert float(np.abs(carrier[:2]).max()) < 1.0  # N; three equal planets pull evenly


@pytest.mark.validation
@pytest.mark.usefixtures("terminal_signals")
def test_stopped_run_resumes_where_it_was(
    grc: Gearbox, stiffness: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("exugear.transient.recorder.FLUSH_INTERVAL", 0.0025)
    whole = load_run(simulate(grc, Choice("rigid"), stiffness, tmp_path / "whole", duration=0.05).path)

    def press_ctrl_c(progress: Progress) -> None:
        if 0.019 < progress.simulated < 0.021:  # once: what was in memory then is written as well
            os.kill(os.getpid(), signal.SIGINT)

    stopped = simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.05, progress=press_ctrl_c)
    assert not stopped.complete
    assert stopped.path.name == "run.partial"
    assert 0.019 < float(load_run(stopped.path).time[-1]) < 0.03
    resumed = simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.05, resume=True)
    assert resumed.complete
    assert not stopped.path.exists()
    data = load_run(resumed.path)
    assert np.allclose(data.time, whole.time, rtol=0, atol=1e-12)
    # Exudyn's clock starts anew from a rounded time: the same states to round-off.
    for name in ("overall_dte", "mesh_force", "input_speed"):
        scale = float(np.abs(whole[name]).max())
        assert np.abs(data[name].to_numpy() - whole[name].to_numpy()).max() < 1e-9 * scale
    assert float(data.work_of_loads[-1]) == pytest.approx(float(whole.work_of_loads[-1]), rel=1e-9)


KILLED = """
import os, signal, sys
import numpy as np
from exugear.transient import recorder, runup
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox

recorder.FLUSH_INTERVAL = 0.005
gearbox = Gearbox.from_toml(sys.argv[1])
stiffness = {"sun_planet": 4e9, "ring_planet": 5e9, "intermediate": 3e9, "high_speed": 2e9}

def kill(progress):
    if progress.simulated > 0.012:
        os.kill(os.getpid(), signal.SIGKILL)

runup.simulate(gearbox, Choice("rigid"), stiffness, sys.argv[2], duration=0.05, progress=kill)
"""


@pytest.mark.validation
def test_a_killed_run_can_be_read(grc: Gearbox, tmp_path: Path) -> None:
    ended = subprocess.run([sys.executable, "-c", KILLED, grc.source, str(tmp_path)], check=False)
    assert ended.returncode == -signal.SIGKILL
    data = load_run(tmp_path / "rigid" / "reference-line_of_action-assemblies" / "run.partial")
    assert 0.008 < float(data.time[-1]) < 0.02
    assert data.attrs["complete"] == 0


def test_resuming_another_run_is_refused(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    with pytest.raises(RunError, match=": no interrupted run with these settings"):
        simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.01, resume=True)


def test_not_finite_state_stops_the_run_at_once(
    grc: Gearbox, stiffness: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = ExudynSystem.run

    def poisoned(self: ExudynSystem, start: float, steps: int, step: float, observe, explicit: bool) -> int:
        def poison(t: float, q: np.ndarray, v: np.ndarray) -> bool:
            return observe(t, q * np.nan if t > 0.004 else q, v)

        return plain(self, start, steps, step, poison, explicit)

    monkeypatch.setattr(ExudynSystem, "run", poisoned)
    with pytest.raises(RunError, match=r"not finite at t = 0.004.*results so far"):
        simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.01, solver="exudyn")
    partial = tmp_path / "rigid" / "reference-line_of_action-assemblies" / "run.partial"
    assert float(load_run(partial).time[-1]) > 0.002


def test_silently_cut_step_is_detected(
    grc: Gearbox, stiffness: dict, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = ExudynSystem.run

    def halving(self: ExudynSystem, start: float, steps: int, step: float, observe, explicit: bool) -> int:
        return plain(self, start, 2 * steps, step / 2, observe, explicit)

    monkeypatch.setattr(ExudynSystem, "run", halving)
    with pytest.raises(RunError, match="Exudyn reduced the step at t ="):
        simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.01, solver="exudyn")


def test_sample_rate_must_fit_the_step(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    with pytest.raises(RunError, match="does not fit the step"):
        simulate(grc, Choice("rigid"), stiffness, tmp_path, duration=0.01, step=2.5e-5, sample_rate=15e3)


def test_speed_driven_run_keeps_its_speed(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    run = simulate(grc, Choice("rigid", load_case="speed_driven"), stiffness, tmp_path, duration=0.2)
    speed = load_run(run.path).input_speed
    ramp = 1800 * np.pi / 30 / grc.train.ratio / 5.0
    # The drive's spring lets the train swing by a small part of the ramp.
    assert float(speed[-1]) == pytest.approx(ramp * float(speed.time[-1]), rel=2e-2)


def test_constant_speed_run_stays_at_rated_speed(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    run = simulate(grc, Choice("bushing", load_case="rated"), stiffness, tmp_path, duration=0.1)
    speed = load_run(run.path).input_speed.to_numpy()
    assert speed.mean() == pytest.approx(22.1 * np.pi / 30, rel=1e-3)  # the meshes make it sway by 0.4 %


def test_torque_series_from_a_file(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    table = tmp_path / "torque.csv"
    table.write_text("time_s,carrier_N_m,hss_N_m\n0,240e3,-2945.12\n0.02,240e3,-2945.12\n0.04,241e3,-2945.12\n")
    case = {"torque_series": str(table), "duration_s": 0.04}
    gearbox = replace(grc, permissions=Permissions(below=tmp_path)).varied({"load_cases.measured": case})
    data = load_run(simulate(gearbox, Choice("rigid", load_case="measured"), stiffness, tmp_path).path)
    assert abs(float(data.input_speed.sel(time=0.015, method="nearest"))) < 1e-5
    # The ramp of 1 kNm over 20 ms brings 10 Nm s on 5.97e3 kg m2.
    assert float(data.input_speed[-1]) == pytest.approx(10.0 / 5.97e3, rel=0.2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,carrier_N_m\n0,1\n1,1\n", "expected a header time_s"),
        ("time_s,carrier_N_m\n0,1\n0,1\n", "time_s must increase from line to line"),
        ("time_s,carrier_N_m\n0,x\n1,1\n", "could not convert"),
        ("time_s,nobody_N_m\n0,1\n1,1\n", "is not the torque of a body; columns are"),
    ],
)
def test_wrong_torque_series_is_named(grc: Gearbox, stiffness: dict, tmp_path: Path, text: str, words: str) -> None:
    table = tmp_path / "torque.csv"
    table.write_text(text)
    permitted = replace(grc, permissions=Permissions(below=tmp_path))
    gearbox = permitted.varied({"load_cases.measured": {"torque_series": str(table)}})
    with pytest.raises(GearboxFileError, match=words):
        simulate(gearbox, Choice("rigid", load_case="measured"), stiffness, tmp_path, duration=0.01)


def test_run_with_rigid_meshes(grc: Gearbox, tmp_path: Path) -> None:
    data = load_run(simulate(grc, Choice("rigid", "kinematic"), {}, tmp_path, duration=0.05).path)
    assert data.sizes["mesh"] == 0
    # Nothing yields between input and output but round-off of the angles.
    assert float(np.abs(data.overall_dte).max()) < 1e-12
    assert float(data.input_speed[-1]) == pytest.approx(-0.75 * 0.05, rel=2e-2)


def test_unknown_load_case_is_named(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    with pytest.raises(GearboxFileError, match="no load case 'storm'"):
        simulate(grc, Choice("rigid", load_case="storm"), stiffness, tmp_path)


def test_equal_planets_in_phase_load_the_sun_evenly(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    """Rigid variant at speed: equal forces 120 degrees apart leave nothing on the sun at any harmonic."""
    data = load_run(simulate(grc, Choice("rigid", load_case="rated"), stiffness, tmp_path, duration=0.1).path)
    force = data.mesh_force.to_numpy()[:, :3].astype(float)
    angles = 2 * np.pi * np.arange(3) / 3
    radial = np.hypot(force @ np.cos(angles), force @ np.sin(angles))
    assert np.ptp(force) > 1e-3 * force.mean()  # the meshes do vibrate
    assert radial.max() < 1e-6 * force.mean()  # forces are stored with seven digits
    assert float(data.tensile_time.max()) == 0.0


@pytest.mark.validation
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_mesh_frequencies_stand_out_of_the_spectrum(
    grc: Gearbox, stiffness: dict, tmp_path: Path, variant: str
) -> None:
    """Constant 22.1 rpm: peaks at 1.65000, 7.80952, 29.87992 Hz per rpm within the resolution of the run."""
    data = load_run(simulated(grc, Choice(variant, load_case="rated"), stiffness, tmp_path, duration=3.0).path)
    data = data.sel(time=slice(0.5, None))
    rpm = abs(float(data.input_speed.mean())) * 30 / np.pi
    values = scipy.signal.detrend(data.overall_dte.to_numpy(), type="linear") * np.hanning(data.sizes["time"])
    rate = 1.0 / float(data.time[1] - data.time[0])
    spectrum, frequency = np.abs(np.fft.rfft(values)), np.fft.rfftfreq(values.size, 1.0 / rate)
    width = 2.0 * rate / values.size  # of the Hann window
    for order in (1.65, 7.809524, 29.879917):
        near = np.abs(frequency - order * rpm) < 10 * width
        peak = frequency[near][np.argmax(spectrum[near])]
        assert abs(peak - order * rpm) < width
        assert spectrum[near].max() > 10 * np.median(spectrum[near])


@pytest.mark.validation
def test_halving_the_step_changes_6_khz_amplitudes_by_less_than_a_thousandth(
    grc: Gearbox, stiffness: dict, tmp_path: Path
) -> None:
    """High-speed mesh at 6.4 kHz: carrier at 215 rpm, the rated load case's loads."""
    case = {"torques_N_m": {"carrier": 240e3, "hss": -2945.12}, "start_speed_rpm": 215.0}
    gearbox = grc.varied({"load_cases.fast": case})
    amplitudes = []
    for step in (1.0 / 60e3, 1.0 / 120e3):
        choice, out = Choice("bushing", load_case="fast"), tmp_path / str(step)
        run = simulate(gearbox, choice, stiffness, out, duration=0.3, step=step)
        data = load_run(run.path).sel(time=slice(0.1, 0.29))
        values = data.mesh_dte.sel(mesh="high_speed").to_numpy()
        window = np.hanning(values.size)
        spectrum = np.abs(np.fft.rfft((values - values.mean()) * window)) / window.sum() * 2
        frequency = np.fft.rfftfreq(values.size, float(data.time[1] - data.time[0]))
        band = (frequency > 6.3e3) & (frequency < 6.55e3)
        amplitudes.append(spectrum[band].max())
    assert amplitudes[0] == pytest.approx(amplitudes[1], rel=1e-3)
