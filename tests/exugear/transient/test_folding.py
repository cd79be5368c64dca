"""Harmonics of the meshes above the rate of the steps: which lines they would make, and the steps that avoid them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import summarise_loads
from exugear.results.findings import run_findings
from exugear.results.run_file import load_run
from exugear.system.build import assemble
from exugear.system.tooth_mesh.element import MeshCurve
from exugear.transient.compiled.integrator import choose_integration
from exugear.transient.folding import (
    HIGHEST_FOLDED,
    MOST_REDUCTION,
    choose_against_folding,
    force_harmonics,
    highest_folded_line,
    mesh_lines,
)
from exugear.transient.outcome import Run
from exugear.transient.plan import rate_for
from exugear.transient.runup import simulate

from ..cases.gear_trains import pair
from ..cases.table import surface_of

BAND = 6.4e3
MESH = 6.3e3
"""Mesh frequency, Hz."""
RIGID = Choice("rigid")
GRC_TABLE = [
    100,
    47.2,
    5.4,
    3.5,
    6.2,
    2.1,
    1.3,
    1.0,
    1.1,
    0.75,
    0.5,
    0.66,
    0.18,
    0.62,
    0.19,
    0.48,
    0.24,
    0.29,
    0.42,
    0.05,
]
"""Harmonics of the stiffness by the table of the high-speed pair of the GRC, % of the first, but for two high ones."""
GRC_TABLE_HIGH = {22: 1.29, 28: 0.73}


def rectangle(positions: int = 40, duration: float = 0.3) -> tuple[Gearbox, dict[str, NDArray[np.float64]]]:
    """Spur pair at constant speed, its stiffness constant with two pairs of teeth and with one."""
    content = pair(helix_deg=0.0)
    content["load_cases"]["steady"] |= {"start_speed_rpm": 60.0 * MESH / 24.0, "duration_s": duration}
    two = np.arange(positions) < 0.6 * positions
    return Gearbox.from_dict(content), {"helical": np.where(two, 4e8, 2.4e8)}


def line_at(run: Run, *frequencies: float) -> list[float]:
    """Amplitudes of the overall transmission error (m) near frequencies (Hz), once the start has decayed."""
    data = load_run(run.path)
    late = data.overall_dte[data.time > 0.4 * data.time[-1]].to_numpy()
    window = np.blackman(late.size)
    levels = np.abs(np.fft.rfft(window * (late - np.average(late, weights=window)))) * 2.0 / window.sum()
    found = np.fft.rfftfreq(late.size, float(data.time[1] - data.time[0]))
    return [float(levels[np.abs(found - frequency) < 30.0].max()) for frequency in frequencies]


def test_no_line_of_the_chosen_step_is_one_of_folded_harmonics(tmp_path: Path) -> None:
    """Steps by band and stability alone, 80 kHz, make lines of 26 and 23 % of the mesh line at 3800 and 4400 Hz."""
    gearbox, stiffness = rectangle()
    chosen = simulate(gearbox, RIGID, stiffness, tmp_path / "chosen")
    step = load_run(chosen.path).attrs["step"]
    finer = simulate(gearbox, RIGID, stiffness, tmp_path / "finer", step=step / 4)
    true_line, *others = line_at(chosen, MESH, 3800.0, 4400.0)
    finer_line, *finer_others = line_at(finer, MESH, 3800.0, 4400.0)
    assert true_line == pytest.approx(finer_line, rel=2e-3)
    assert max(*others, *finer_others) < 0.01 * true_line
    assert load_run(chosen.path).attrs["folding_doubt"] == ""


def test_the_estimated_line_is_that_of_a_run(tmp_path: Path) -> None:
    gearbox, stiffness = rectangle()
    assembly, case = assemble(gearbox, RIGID, stiffness), gearbox.load_cases["steady"]
    usual = choose_integration(assembly, 20e3, BAND).step
    expected = highest_folded_line(mesh_lines(assembly, case, summarise_loads(gearbox, case), BAND), 1.0 / usual, BAND)
    assert (expected.mesh, expected.harmonic) == ("helical", 12)  # 75.6 kHz by 80 kHz steps
    run = simulate(gearbox, RIGID, stiffness, tmp_path, step=usual)
    true_line, folded = line_at(run, MESH, 4400.0)
    # The estimate has the response at the nearest resonance within 0.1 % of the speed.
    assert 0.5 * expected.height < folded / true_line < expected.height


def grc_stiffness(stiffness: dict[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """Stiffness of the GRC in which the fastest mesh has the harmonics of its table."""
    shares = {**dict(enumerate(GRC_TABLE, 1)), **GRC_TABLE_HIGH}
    angle = 2.0 * np.pi * np.arange(100) / 100
    wave = sum(0.01 * share * np.cos(n * angle) for n, share in shares.items())
    return {**stiffness, "high_speed": float(np.mean(stiffness["high_speed"])) * (1.0 + 0.017 * wave)}


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize("load_case", ["reference", "generating"])
def test_run_ups_of_the_grc_keep_their_step(grc: Gearbox, stiffness: dict, variant: str, load_case: str) -> None:
    assembly = assemble(grc, Choice(variant, load_case=load_case), grc_stiffness(stiffness))
    chosen, line = choose_against_folding(assembly, grc.load_cases[load_case], 30.0, 20e3, BAND)
    usual = choose_integration(assembly, 20e3, BAND)
    assert chosen.step == usual.step == pytest.approx(1.0 / 60e3)
    assert chosen.method.name == usual.method.name
    assert (line.mesh, line.harmonic) == ("high_speed", 22)
    assert line.height == pytest.approx(0.0125, rel=0.05)  # 0.0132 with the table


def test_a_line_that_no_permitted_step_avoids_is_told_with_a_band_that_does(tmp_path: Path) -> None:
    gearbox, stiffness = rectangle(positions=100, duration=0.15)
    first = load_run(simulate(gearbox, RIGID, stiffness, tmp_path / "first").path).attrs
    usual = choose_integration(assemble(gearbox, RIGID, stiffness), 20e3, BAND).step
    assert first["step"] >= usual / MOST_REDUCTION * (1.0 - 1e-9)
    times = {"tensile_time": 0.0, "contact_loss_time": 0.0, "extrapolation_time": 0.0}
    (text,) = [found.text for found in run_findings(first, 0.0, times) if found.level == "warning"]
    assert text.startswith("folded harmonics: harmonic 51 of the mesh frequency of helical, 321300 Hz at the highest ")
    assert text.endswith("use exugear run --band 12800, which has shorter steps")
    wider = simulate(gearbox, RIGID, stiffness, tmp_path / "wider", band=12.8e3, sample_rate=rate_for(12.8e3))
    assert load_run(wider.path).attrs["folding_doubt"] == ""
    true_line, folded = line_at(wider, MESH, 1300.0)
    assert folded < HIGHEST_FOLDED * true_line


def test_the_step_is_the_same_for_any_simulated_time() -> None:
    """A run that is resumed for longer keeps its step; what it folds at the higher speeds is told."""
    gearbox, stiffness = rectangle()
    slow = gearbox.varied({"load_cases.steady.start_speed_rpm": 100.0, "load_cases.steady.torques_N_m.output": 140.0})
    assembly, case = assemble(slow, RIGID, stiffness), slow.load_cases["steady"]
    short, of_short = choose_against_folding(assembly, case, 0.1, 20e3, BAND)
    long, of_long = choose_against_folding(assembly, case, 1e3 * case.duration, 20e3, BAND)
    assert short.step == long.step
    assert of_short.is_low and not of_long.is_low


def test_constant_stiffness_folds_nothing(grc: Gearbox, stiffness: dict) -> None:
    constant = {name: np.full(50, np.mean(values)) for name, values in stiffness.items()}
    assembly, case = assemble(grc, RIGID, constant), grc.load_cases["reference"]
    assert mesh_lines(assembly, case, summarise_loads(grc, case), BAND) == ()


def test_harmonics_are_those_of_force_for_each_kind_of_mesh(grc: Gearbox, stiffness: dict) -> None:
    straight, curved = (
        next(e for e in assemble(grc, RIGID, data).elements if e.mesh.name == "high_speed")
        for data in (stiffness, {name: MeshCurve(k, 1.2 * k, 40e3) for name, k in stiffness.items()})
    )
    assert force_harmonics(straight)[:3] == pytest.approx([0.05, 0.02, 0.01], rel=1e-2)
    # Force goes with the 1.2th power of stiffness at constant deflection.
    assert force_harmonics(curved)[:3] == pytest.approx(1.2 * force_harmonics(straight)[:3], rel=3e-2)
    tables = {name: surface_of(grc, name) for name in stiffness}
    tabled = assemble(grc, Choice("bushing", "table"), tables).elements[-1]
    assert force_harmonics(tabled)[:2] == pytest.approx([0.05, 0.02], rel=0.1)
