"""Modal damping: each mode has the share of critical damping that the file states, in every model and at any angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import VariantError
from exugear.results.run_file import load_run
from exugear.steady.mean_system.mean_system import mean_modes, mean_system
from exugear.steady.mean_system.planet_sets import planet_sets
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.system.build import assemble
from exugear.system.kernels.modal_damping import ModalArrays, modal_matrix, turn_planets
from exugear.system.kernels.products import symmetric_tiles
from exugear.system.loads import LoadTable
from exugear.system.modes import modes_of
from exugear.system.signals import POWERS, energy_residual
from exugear.system.statics import accelerating_start, linearise, static_state
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem, Observer

from ..cases.assembled import assembled, simulated
from ..cases.both_ways import compiled_states, errors_and_mesh_forces, exudyn_states, relative_error
from ..cases.plain_motion import accelerations_of
from ..cases.plain_signals import sampled

LOAD = {"carrier": 240e3, "hss": -3000.0}


@pytest.fixture(scope="module")
def modal(grc: Gearbox) -> Gearbox:
    return grc.varied({"damping": {"modal_percent": 2.0}})


@pytest.fixture(scope="module")
def bushing(modal: Gearbox, stiffness: dict) -> Assembly:
    return assemble(modal, Choice("bushing"), stiffness)


@pytest.mark.parametrize(("variant", "tolerance"), [("rigid", 1e-9), ("bushing", 1e-6)])
def test_every_mode_has_the_damping_that_the_file_states(
    modal: Gearbox, stiffness: dict, variant: str, tolerance: float
) -> None:
    """By the damping matrix in each mode, and by the eigenvalues of the damped system.

    Preloaded bearings make the stiffness slightly unsymmetric, which modal damping leaves out: 3e-4 in close pairs.
    """
    assembly = assemble(modal, Choice(variant), stiffness)
    modes = modes_of(assembly)
    elastic = modes.frequency > 0.0
    assert modes.damping_ratio[elastic] == pytest.approx(0.02, rel=tolerance)
    assert np.all(modes.damping_ratio[~elastic] == 0.0)
    linear = linearise(assembly, static_state(assembly).q)
    n = assembly.size
    lower = np.linalg.solve(linear.mass, np.hstack([-linear.total_stiffness, -linear.total_damping]))
    values = np.linalg.eigvals(np.vstack([np.eye(n, 2 * n, n), lower]))
    values = values[values.imag > 1.0]
    assert -values.real / np.abs(values) == pytest.approx(0.02, rel=max(1e3 * tolerance, 1e-8))


def test_a_table_over_frequency_and_single_modes_count(grc: Gearbox, stiffness: dict) -> None:
    points = ((100.0, 1.0), (3000.0, 4.0))
    section = {"modal_percent": points, "modal_modes": ((304.0, 0.5),)}
    modes = modes_of(assemble(grc.varied({"damping": section}), Choice("rigid"), stiffness))
    frequency, ratio = modes.frequency[1:], modes.damping_ratio[1:]
    expected = 0.01 * np.interp(frequency, *np.array(points).T)
    expected[np.argmin(np.abs(frequency - 304.0))] = 0.005
    assert ratio == pytest.approx(expected, rel=1e-9)


def test_dampers_with_stated_values_count_towards_the_share(modal: Gearbox, stiffness: dict) -> None:
    """A coupling damps its mode by less than 2 %, and another by more: the first is filled up, the second stays."""
    for damping, least in ((10.0, 0.02), (1e5, 0.05)):
        damped = modal.varied({"couplings.brake_coupling.damping_N_m_s_per_rad": damping})
        ratio = modes_of(assemble(damped, Choice("rigid"), stiffness)).damping_ratio[1:]
        assert ratio.min() == pytest.approx(0.02, rel=1e-9)
        assert ratio.max() >= least * (1.0 - 1e-9)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 7])
def test_turning_planets_is_orthogonal_and_carries_each_into_the_place_of_the_next(count: int) -> None:
    """After one pitch of the planets, planet i does what planet i + 1 did, turned by a pitch."""
    planets = np.arange(6 * count).reshape(count, 6) + 1
    size = 6 * count + 1
    pitch = 2.0 * np.pi / count
    place = 0.3 + pitch * np.arange(count)
    arrays = ModalArrays(
        tiles=symmetric_tiles(np.zeros((size, size))),
        frame=np.array([0]),
        first=np.array([0, count]),
        planets=planets,
        place=np.stack([np.cos(place), np.sin(place)], axis=1),
        equal=np.array([int(count > 2)]),
    )

    def turned(angle: float, *, back: bool) -> np.ndarray:
        cosine_and_sine = np.array([np.cos(angle), np.sin(angle)])
        columns = []
        for unit in np.eye(size):
            out = unit.copy()
            turn_planets(cosine_and_sine, arrays, -1.0 if back else 1.0, unit, out)
            columns.append(out)
        return np.array(columns).T

    for angle in (0.0, 0.4, 2.9):
        matrix = turned(angle, back=False)
        assert matrix @ matrix.T == pytest.approx(np.eye(size), abs=1e-12)
        assert turned(angle, back=True) == pytest.approx(matrix.T, abs=1e-12)
    assert turned(0.0, back=False) == pytest.approx(np.eye(size), abs=1e-12)
    if count % 2:
        moved = turned(pitch, back=False)[planets[1]][:, planets[2]]
        c, s = 1.0, 0.0  # planet 2 stands where planet 3 was, which moves as planet 2 does now
        assert moved[:2, :2] == pytest.approx(np.array([[c, -s], [s, c]]), abs=1e-12)


def test_free_rolling_is_not_damped_at_any_angle(bushing: Assembly) -> None:
    frame = RotatingFrame(bushing, planet_sets(bushing))
    for angle in (0.0, 0.7, 4.0):
        place, rate, _ = frame.rolling(angle)
        damping = modal_matrix(place, bushing.modal)
        assert np.abs(damping @ rate).max() < 1e-12 * (np.abs(damping) @ np.abs(rate)).max()


def test_damping_is_constant_in_the_rotating_frame(bushing: Assembly) -> None:
    system = mean_system(bushing, np.array([0.5, 2.2]))
    frame = system.frame
    matrices = []
    for psi in (0.0, 0.9, 2.0):
        t = frame.matrices(psi)[0]
        matrices.append(t.T @ modal_matrix(psi * frame.rolling(0.0)[1], bushing.modal) @ t)
    scale = np.abs(matrices[0]).max()
    assert np.abs(matrices[1] - matrices[0]).max() < 1e-9 * scale
    assert np.abs(matrices[2] - matrices[0]).max() < 1e-9 * scale
    values, _, _ = mean_modes(system, 0.5)
    # Gyroscopic moments turn pairs of modes into forward and backward whirling, which share their damping unevenly.
    ratio = -values.real / np.abs(values)
    assert ratio.mean() == pytest.approx(0.02, rel=1e-4)
    assert ratio == pytest.approx(0.02, rel=0.02)


def test_forces_and_losses_of_the_compiled_solver_are_those_of_the_matrix(bushing: Assembly) -> None:
    start = accelerating_start(bushing, LOAD, 22.5)
    random = np.random.default_rng(5)
    q = start.q + 1e-6 * random.normal(size=bushing.size)
    v = start.v + 1e-2 * random.normal(size=bushing.size)
    system = CompiledSystem(bushing, q, v, LoadTable(LOAD), 1e-5)
    expected = accelerations_of(bushing, q, v, bushing.torque_vector(LOAD))
    assert system.accelerations() == pytest.approx(expected, rel=1e-9, abs=1e-7 * np.abs(expected).max())
    _, _, powers = Observer(bushing, LoadTable(LOAD)).observe(np.zeros(1), q[None], v[None])
    dissipated = powers[0, POWERS.index("dissipated_energy")]
    assert dissipated == pytest.approx(v @ modal_matrix(q, bushing.modal) @ v, rel=1e-9)


def test_both_solvers_follow_the_same_course(bushing: Assembly) -> None:
    start = accelerating_start(bushing, LOAD, 22.5)
    random = np.random.default_rng(7)
    q = start.q + 1e-6 * random.normal(size=bushing.size)
    v = start.v + 1e-2 * random.normal(size=bushing.size)
    found = compiled_states(bushing, q, v, LOAD, 200, 1e-5)
    expected = exudyn_states(bushing, q, v, LOAD, 200, 1e-5)
    columns = errors_and_mesh_forces(bushing)
    one, two = (sampled(bushing, *states)[:, columns] for states in (found, expected))
    assert relative_error(one, two) < 1e-7


@pytest.mark.validation
def test_the_energy_of_a_run_closes(modal: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    run = simulated(modal, Choice("bushing"), stiffness, tmp_path, duration=0.5)
    data = load_run(run.path)
    assert abs(energy_residual(data)) < 1e-6
    assert float(data["dissipated_energy"][-1]) > 0.0


@pytest.mark.validation
def test_elastic_shafts_have_the_share_within_their_band(grc_shafts: Gearbox, stiffness: dict) -> None:
    assembly = assembled(grc_shafts.varied({"damping": {"modal_percent": 3.0}}), Choice("flexible"), stiffness)
    modes = modes_of(assembly)
    elastic = modes.frequency > 0.0
    assert modes.damping_ratio[elastic].min() == pytest.approx(0.03, rel=1e-3)
    assert np.median(modes.damping_ratio[elastic]) == pytest.approx(0.03, rel=1e-3)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"modal_percent": 0.0}, "modal_percent.*must lie between 0.01 and 20"),
        ({"modal_percent": 25.0}, "modal_percent.*must lie between 0.01 and 20"),
        ({"modal_percent": 2.0, "mesh_time_s": 4e-6}, "mesh_time_s has no effect where modal_percent"),
        ({"modal_percent": ((200.0, 1.0), (100.0, 2.0))}, "frequencies must increase"),
        ({"modal_percent": 2.0, "modal_band_percent": (4.0, 1.0)}, "the first value must be smaller"),
        ({"modal_band_percent": (1.0, 4.0)}, "modal_band_percent requires modal_percent"),
        ({"modal_modes": ((300.0, 1.0),)}, "modal_modes requires modal_percent"),
    ],
)
def test_damping_that_cannot_be_meant_is_refused(grc: Gearbox, section: dict, message: str) -> None:
    with pytest.raises(GearboxFileError, match=message):
        grc.varied({"damping": section})


def test_a_frequency_without_a_mode_is_refused(grc: Gearbox, stiffness: dict) -> None:
    other = grc.varied({"damping": {"modal_percent": 2.0, "modal_modes": ((2000.0, 1.0),)}})
    with pytest.raises(VariantError, match="no mode within 5 % of 2000 Hz; modes are at 1"):
        assemble(other, Choice("rigid"), stiffness)
