"""A planetary stage whose ring is elastic: planets load the sector where they are, in both solvers."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.loads import LoadTable
from exugear.system.signals import energy_residual
from exugear.system.statics import accelerating_start, locked_equilibrium
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem, Observer
from exugear.transient.exudyn_model.system import ExudynSystem

from ....optional_libraries import needs_meshio
from ...cases.assembled import assembled, simulated
from ...cases.plain_motion import accelerations_of
from ...cases.plain_signals import energies_of, sampled
from ...cases.reduced import first_coordinate
from ...cases.ring import ring_content
from ...cases.rounding import allowed_difference
from ...cases.stated_loads import STATED_LOADS

pytestmark = needs_meshio

LOAD = {"carrier": 240e3, "lss": -38e3}
STEP = 5e-6


@pytest.fixture(scope="module")
def stage(grc: Gearbox, tmp_path_factory: pytest.TempPathFactory) -> Gearbox:
    folder = tmp_path_factory.mktemp("ring")
    return Gearbox.from_dict(ring_content(grc, folder), str(folder / "case.toml"))


@pytest.fixture(scope="module")
def ringed(stage: Gearbox, stiffness: dict) -> Assembly:
    return assembled(stage, Choice("flexible"), stiffness)


def turned(assembly: Assembly, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Preloaded state at 20 rad/s, turned by an angle of the carrier, all coordinates and rates moved at random."""
    start = accelerating_start(assembly, LOAD, 20.0)
    random = np.random.default_rng(7)
    q = start.q + 1e-6 * random.normal(size=assembly.size)
    q += assembly.rolling_velocity(np.zeros(assembly.size), assembly.gearbox.train.rolling_speeds("carrier", angle))
    for body in assembly.bodies:
        if body.carrier is not None:  # their orbit is an arc
            o = assembly.coordinates[body.name][0]
            way = complex(*body.axis) * (np.exp(1j * angle) - 1.0)
            q[o : o + 2] = start.q[o : o + 2] + [way.real, way.imag]
    return q, start.v + 1e-2 * random.normal(size=assembly.size)


@pytest.mark.validation
def test_every_ring_mesh_has_a_seat_that_travels_with_the_carrier(ringed: Assembly) -> None:
    seats = ringed.travelling
    assert seats.first.tolist() == [ringed.size, ringed.size + 6, ringed.size + 12]
    assert np.all(seats.frame == ringed.spin["carrier"])
    assert seats.angle == pytest.approx([0.0, 2.0 * math.pi / 3.0, -2.0 * math.pi / 3.0])


def test_load_and_deflection_do_not_depend_on_where_the_planets_stand(stage: Gearbox, stiffness: dict) -> None:
    # Ring, bearings and mean meshes are round and nine sectors are three for each planet, so that only the choice of
    # seats could make a difference between places; forces and tilts are those of the first planet, seen from it.
    found = []
    loads = {key: load for key, load in STATED_LOADS.items() if ".pl_" in key}
    for first in (0.0, 13.0, 20.0):
        angles = {"bodies.planet.planet_angles_deg": [first, first + 120.0, first + 240.0]}
        assembly = assembled(stage.varied({**angles, **loads}), Choice("flexible"), stiffness)
        load = stage.case.static_load
        q = locked_equilibrium(assembly, load.torques_N_m, load.locked, assembly.mean_meshes)
        states = assembly.mesh_states(q, 0 * q, assembly.mean_meshes)
        found.append(np.concatenate([states[:, 0], assembly.gear_positions(q)[:, 1], [q[assembly.spin["carrier"]]]]))
    # The mesh of 54 flat sides looks the same every 6.7 deg only; a lopsided choice of seats would show in per cents.
    assert np.abs(np.array(found) / found[0] - 1.0).max() < 1e-3


def test_the_ring_winds_up_between_its_flanges(ringed: Assembly, stage: Gearbox) -> None:
    # By hand: half of the ring's torque on each flange, which yields by 1e-9 rad/(N m). Teeth that resist tilting
    # bear a little beside the middle of the face, so that the flanges share unequally.
    load = stage.case.static_load
    q = locked_equilibrium(ringed, load.torques_N_m, load.locked, ringed.mean_meshes)
    torque = 240e3 * 99.0 / 120.0  # z_ring / (z_sun + z_ring)
    place = ringed.elastic_slices["housing"].start
    reduced = ringed.elastic_bodies["housing"].reduced
    flanges = [q[place + first_coordinate(reduced, name) + 5] for name in ("front", "rear")]
    assert 1e9 * np.sum(flanges) == pytest.approx(torque, rel=1e-6)
    assert 1e9 * np.array(flanges) == pytest.approx([torque / 2.0, torque / 2.0], rel=2e-3)


def test_the_tangent_of_the_meshes_is_the_derivative_of_their_forces(ringed: Assembly) -> None:
    q, v = turned(ringed, 0.4)
    jq, jv = ringed.mesh_jacobians(q, v)
    step = 1e-7
    moves, rates = step * np.eye(ringed.size), np.eye(ringed.size)

    def forces(q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return ringed.mesh_forces(q, v, ringed.meshes)

    by_q = np.array([forces(q + e, v) - forces(q - e, v) for e in moves])
    by_v = np.array([forces(q, v + e) - forces(q, v - e) for e in rates])
    assert np.abs(by_q.T / (2.0 * step) - jq).max() < 2e-6 * np.abs(jq).max()
    assert np.abs(by_v.T / 2.0 - jv).max() < 1e-9 * np.abs(jv).max()


def test_compiled_right_hand_side_is_that_of_the_plain_kernels(ringed: Assembly) -> None:
    q, v = turned(ringed, 0.4)
    loads = LoadTable(LOAD)
    found = CompiledSystem(ringed, q, v, loads, STEP).accelerations()
    expected = accelerations_of(ringed, q, v, ringed.torque_vector(LOAD))
    # Rounding of places of 1 m, 1e-16 m each, of displacements of 1e-6 m.
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    signals, energies, _ = Observer(ringed, loads).observe(np.zeros(1), q[None], v[None])
    plain = sampled(ringed, q[None], v[None])
    assert np.all(np.abs(signals - plain) < allowed_difference(plain, len(ringed.mesh_names)))
    assert energies[0] == pytest.approx(energies_of(ringed, q[None], v[None])[0, :2], rel=1e-9)


def test_compiled_solver_and_exudyn_run_alike(ringed: Assembly) -> None:
    q, v = turned(ringed, 0.4)
    steps = 200
    states = np.empty((2, steps, ringed.size))
    system = CompiledSystem(ringed, q, v, LoadTable(LOAD), STEP)
    assert system.advance(0, states[0], states[1]) == steps
    exudyn = ExudynSystem(ringed, q, v, LoadTable(constant=LOAD))
    exudyn.run(0.0, steps, STEP)
    _, end, _ = exudyn.state()
    moved = states[0, -1] - q
    # Both take the same Runge-Kutta steps; Exudyn's bearings turn with finite rotations, as the compiled ones do.
    assert np.abs(end - states[0, -1]).max() < 1e-8 * np.abs(moved).max()


def test_the_account_of_energy_closes_on_an_elastic_ring(stage: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    # Loads' work = change of energies + dissipated + work of k(PMC): as asked of the other variants, through a third
    # of a revolution of the carrier, so that every planet crosses three sectors.
    case = stage.varied({"load_cases.run_up.start_speed_rpm": 200.0})
    run = simulated(case, Choice("flexible", load_case="run_up"), stiffness, tmp_path, duration=0.1)
    with xr.open_dataset(run.path) as data:
        assert abs(energy_residual(data)) < 1e-6
