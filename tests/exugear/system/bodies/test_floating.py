"""Bodies in floating frames: their integrals, their coordinates, and a gearbox that has one in Exudyn."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import skfem
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.system.bodies.elastic_body import FloatingCoordinates
from exugear.system.bodies.of_gearbox import shaft_model, solid_of_shaft
from exugear.system.bodies.reduction import Blank, ReductionError
from exugear.system.bodies.shaft_sections import MeshSize
from exugear.system.bodies.solid_elements import SolidSeat
from exugear.system.bodies.solids import (
    SolidModel,
    floating_body,
    load_or_reduce_floating,
    reduce_matrices,
    reduce_solid,
)
from exugear.system.loads import Drive, LoadTable
from exugear.system.signals import energy_residual
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import unsupported_reason
from exugear.transient.exudyn_model.bodies import frame_integrals
from exugear.transient.exudyn_model.library import elements, exudyn
from exugear.transient.exudyn_model.system import ExudynSystem
from exugear.transient.outcome import RunError
from fe_ste.geometry.gears import Material

from ...cases.assembled import assembled, simulated
from ...cases.floating import FLOATING_CASE, without_floating_frames

LOAD = {"shaft": 6.0, "wheel": 9.0}
SPEED = 420.0


@pytest.fixture(scope="module")
def gearbox(tmp_path_factory: pytest.TempPathFactory) -> Gearbox:
    path = tmp_path_factory.mktemp("floating") / "case.toml"
    path.write_text(FLOATING_CASE, encoding="utf-8")
    return Gearbox.from_toml(path)


@pytest.fixture(scope="module")
def stiffness() -> dict[str, np.ndarray]:
    cycle = 2.0 * np.pi * np.arange(50) / 50
    return {"pair": 2e8 * (1.0 + 0.1 * np.cos(cycle) + 0.03 * np.cos(2.0 * cycle))}


@pytest.fixture(scope="module")
def model(gearbox: Gearbox) -> SolidModel:
    return solid_of_shaft(shaft_model(gearbox, "shaft"), MeshSize(0.1, 0.05, 0))


@pytest.fixture(scope="module")
def floating(gearbox: Gearbox, stiffness: dict) -> Assembly:
    return assembled(gearbox, Choice("flexible"), stiffness)


def test_integrals_are_those_that_exudyn_computes_from_the_mesh(model: SolidModel) -> None:
    # Second way: Exudyn's own products of the mesh's matrices.
    bare = replace(model, blanks={})
    matrices = reduce_matrices(bare)
    body = floating_body(bare, matrices)
    mesh = elements.FEMinterface()
    mesh.nodes = {"Position": matrices.solid.nodes - body.centre}
    mesh.massMatrix, mesh.stiffnessMatrix = matrices.solid.mass, matrices.solid.stiffness
    mesh.modeBasis = {"matrix": matrices.component.component_modes @ body.mode_coordinates, "type": "NormalModes"}
    kind = exudyn.NodeType.RotationEulerParameters
    expected = elements.ObjectFFRFreducedOrderInterface(mesh, rigidBodyNodeType=kind)
    found = frame_integrals(body, kind)
    for name in ("inertiaLocal", "mPsiTildePsi", "mPsiTildePsiTilde", "mXRefTildePsi", "mXRefTildePsiTilde"):
        wanted = np.asarray(getattr(expected, name))
        assert np.abs(getattr(found, name) - wanted).max() < 1e-12 * max(1.0, np.abs(wanted).max())
    for name in ("chiU", "mPhitTPsi", "mPhitTPsiTilde"):  # zero: the frame is at the mass centre
        assert np.abs(getattr(found, name)).max() < 1e-10
        assert np.abs(getattr(expected, name)).max() < 1e-10
    assert found.totalMass == pytest.approx(expected.totalMass, rel=1e-12)
    assert found.massMatrixReduced == pytest.approx(np.eye(len(body.stiffness)), abs=1e-10)


def test_a_blank_adds_its_own_rigid_inertia(model: SolidModel) -> None:
    bare = floating_body(replace(model, blanks={}))
    ring = Blank(1.2, 5e-4, 8e-4)
    ringed = floating_body(replace(model, blanks={"pinion": ring}))
    seat = ringed.places[ringed.seats.index("pinion")]
    assert ringed.mass == pytest.approx(bare.mass + ring.mass, rel=1e-12)
    assert ringed.mass * ringed.centre == pytest.approx(bare.mass * bare.centre + ring.mass * seat, abs=1e-12)

    def inertia(body, about: np.ndarray) -> np.ndarray:
        """Of int rho x x' about a point, by the parallel axes."""
        second = body.second_moments[:, :, 0, 0] + body.mass * np.outer(body.centre - about, body.centre - about)
        return np.trace(second) * np.eye(3) - second

    added = inertia(ringed, seat) - inertia(bare, seat)
    assert added == pytest.approx(np.diag([ring.transverse, ring.transverse, ring.axial]), abs=1e-12)


def test_a_turn_takes_the_modes_of_a_turned_shaft_into_each_other(model: SolidModel) -> None:
    # Eigenvalues of S: torsion and stretching 0, each pair of bending +-1; 8 elements around are what is left.
    orders = np.linalg.eigvalsh(1j * floating_body(model).turning)
    assert np.abs(orders - np.round(orders)).max() < 1e-4
    assert set(np.round(orders)) == {-1.0, 0.0, 1.0}


def test_states_go_to_the_floating_frame_and_back_at_any_angle(model: SolidModel) -> None:
    body = floating_body(model)
    frame = FloatingCoordinates(body)
    random = np.random.default_rng(3)
    for turns in (0.0, 1.5, -40.2):
        angle = 2.0 * math.pi * turns
        inner = np.arange(frame.size) >= 6 * len(body.seats)
        state = np.where(inner, 1e-6, 1e-4) * random.normal(size=frame.size)
        rates = np.where(inner, 1e-4, 1e-2) * random.normal(size=frame.size)
        state[5 : 6 * len(body.seats) : 6] += angle
        rates[5 : 6 * len(body.seats) : 6] += SPEED
        q, v = frame.of(state, rates)
        found = frame.motion(q, v, angle)
        assert found.coordinates == pytest.approx(state, abs=1e-12)
        assert found.velocities == pytest.approx(rates, abs=1e-9)
        # The rates are the derivative of the motion: what deforms by 1e-4 is right to its third power times the speed.
        step = 1e-7
        ahead, behind = (frame.motion(q + sign * step * v, v, angle).coordinates for sign in (1.0, -1.0))
        assert (ahead - behind) / (2.0 * step) == pytest.approx(rates, abs=2e-6)


def test_what_a_turn_changes_has_no_such_frame() -> None:
    lines = [np.linspace(-s / 2, s / 2, 3) for s in (0.02, 0.04)]
    mesh = skfem.MeshHex2.from_mesh(skfem.MeshHex.init_tensor(*lines, np.linspace(0.0, 0.3, 4)))
    seats = tuple(SolidSeat(name, (0.0, 0.0, z), 0.03) for name, z in (("left", 0.0), ("right", 0.3)))
    bar = floating_body(SolidModel("bar", mesh, Material(), seats, "carrier", 2000.0, 4000.0))
    with pytest.raises(
        ReductionError, match="body bar: rotation changes its modes by .* it must be a body of revolution"
    ):
        FloatingCoordinates(bar)


def test_the_spin_of_a_solid_alone_has_no_coriolis_forces(model: SolidModel) -> None:
    # They would be twice the centrifugal force, which the frame that does not turn leaves out.
    body = reduce_solid(model)
    turning = body.gyroscopic @ body.spin
    assert np.abs(turning).max() < 1e-12 * np.abs(body.gyroscopic).max()
    tilts = body.rigid_motions(body.rigid_inertia.centre)[:, 3:5]
    assert tilts[:, 0] @ body.gyroscopic @ tilts[:, 1] == pytest.approx(body.rigid_inertia.axial, rel=1e-6)


def trajectories(
    assembly: Assembly, steps: int, step: float, load: dict[str, float] = LOAD, speed: float = SPEED
) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (steps + 1, size) and DTE of the meshes (steps + 1, meshes) by generalized-alpha."""
    start = accelerating_start(assembly, load, speed)
    found = []

    def observe(t: float, q: np.ndarray, v: np.ndarray) -> bool:
        found.append((q.copy(), assembly.mesh_states(q, v)[:, 0]))
        return True

    system = ExudynSystem(assembly, start.q, start.v, LoadTable(constant=load))
    assert system.run(0.0, steps, step, observe, explicit=False) == steps
    return np.array([q for q, _ in found]), np.array([dte for _, dte in found])


@pytest.mark.validation
def test_a_gearbox_runs_alike_in_both_frames(floating: Assembly) -> None:
    # 4000 rpm, equal steps. Asked: 0.2 % of the largest motion. What is left is of second order in tilts of 1.5e-4 rad:
    # forces across a tilted shaft push along it, which the frame that does not turn leaves out.
    expected, wanted_dte = trajectories(without_floating_frames(floating), 300, 1e-5)
    found, dte = trajectories(floating, 300, 1e-5)
    place = floating.elastic_slices["shaft"]
    seats = len(floating.elastic_bodies["shaft"].reduced.seats)
    for first in range(place.start, place.start + 6 * seats, 6):
        for own in (slice(first, first + 3), slice(first + 3, first + 5)):  # displacement, tilts
            largest = np.abs(expected[:, own]).max()
            assert np.abs(found[:, own] - expected[:, own]).max() < 1e-3 * largest
            assert largest > 1e-7
    inner = slice(place.start + 6 * seats, place.stop)  # nanometres: what vibrates between seats, none of it static
    assert np.abs(found[:, inner] - expected[:, inner]).max() < 5e-3 * np.abs(expected[:, inner]).max()
    pinion, torque = (floating.coordinates[f"shaft.{seat}"][5] for seat in ("pinion", "torque"))
    twist, wanted = (q[:, pinion] - q[:, torque] for q in (found, expected))
    assert np.abs(twist - wanted).max() < 1e-3 * np.abs(wanted).max()
    assert np.abs(dte - wanted_dte).max() < 1e-3 * np.abs(wanted_dte).max()
    turned = found[:, floating.spin["shaft"]]
    assert turned[-1] == pytest.approx(SPEED * 3e-3, rel=1e-3)


@pytest.mark.validation
@pytest.mark.long
def test_the_grc_runs_alike_in_both_frames(grc_shafts: Gearbox) -> None:
    # Rated torque and speed, ten milliseconds, equal steps. Asked: 0.2 % of the largest motion.
    mean = {"sun_planet": 3.77e9, "ring_planet": 4.85e9, "intermediate": 3.07e9, "high_speed": 1.93e9}
    shape = 1.0 + 0.05 * np.cos(2.0 * np.pi * np.arange(50) / 50)
    stiffness = {name: value * shape for name, value in mean.items()}
    both = assembled(grc_shafts.varied({"bodies.hss.flexibility": "ffrf"}), Choice("flexible"), stiffness)
    rated = (1000, 1e-5, {"carrier": 240e3, "hss": -3000.0}, 22.5 * math.pi / 30.0)
    expected, wanted_dte = trajectories(without_floating_frames(both), *rated)
    found, dte = trajectories(both, *rated)
    place = both.elastic_slices["hss"]
    seats = np.arange(place.start, place.start + 6 * len(both.elastic_bodies["hss"].reduced.seats), 6)
    # Of the shaft's largest: the pinion sits where it hardly tilts.
    for own in (seats[:, None] + [0, 1, 2], seats[:, None] + [3, 4]):
        assert np.abs(found[:, own] - expected[:, own]).max() < 2e-3 * np.abs(expected[:, own]).max()
    others = slice(0, place.start)
    assert np.abs(found[:, others] - expected[:, others]).max() < 1e-6
    assert np.all(np.abs(dte - wanted_dte).max(axis=0) < 5e-4 * np.abs(wanted_dte).max(axis=0))


def test_all_that_acts_on_a_floating_body_acts_as_in_the_other_frame(gearbox: Gearbox, stiffness: dict) -> None:
    # Weight, a coupling to another inertia, a torque that varies and a drive; each of them moves the shaft.
    heavy = gearbox.varied({"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0], "bodies.motor.enabled": True})
    floating = assembled(heavy, Choice("flexible"), stiffness)
    plain = without_floating_frames(floating)
    start = accelerating_start(floating, LOAD, SPEED)
    angle = float(start.q[floating.spin["shaft"]])
    times = np.linspace(0.0, 1e-3, 101)
    torques = 6.0 + 3.0 * np.sin(2000.0 * times)
    loads = LoadTable({"wheel": 9.0}, {"shaft": (times, torques)}, Drive("shaft", 5e3, 0.5, (angle, SPEED, 0.0)))
    ends = []
    for assembly in (floating, plain):
        system = ExudynSystem(assembly, start.q, start.v, loads)
        system.run(0.0, 100, 1e-5, explicit=False)
        ends.append(system.state()[1])
    moved = ends[1] - start.q - SPEED * 1e-3 * (floating.rolling_velocity(start.q, dict.fromkeys(floating.spin, 1.0)))
    place = floating.elastic_slices["shaft"]
    for motions in ((0, 1, 2), (3, 4), (5,)):
        own = [i for i in range(place.start, place.stop) if (i - place.start) % 6 in motions and i < place.start + 24]
        assert np.abs(ends[0] - ends[1])[own].max() < 2e-3 * np.abs(moved[own]).max()
    motor = floating.spin["motor"]
    assert abs(ends[0][motor] - ends[1][motor]) < 2e-3 * abs(moved[motor])


@pytest.mark.validation
def test_loads_over_the_angle_act_on_a_floating_body_as_in_the_other_frame(gearbox: Gearbox, stiffness: dict) -> None:
    # A torque with its reaction on the wheel, and an unbalance of 40 N; 0.6 rad of the shaft. What is left is of
    # second order.
    excitations = {
        "ripple": {"body": "shaft", "orders": [9], "torque_N_m": [2.0], "reaction_on": "wheel"},
        "balance": {"body": "shaft", "z_mm": 150.0, "unbalance_g_mm": 230.0, "phase_deg": [40.0]},
    }
    loaded = gearbox.varied({"excitations": excitations})
    floating = assembled(loaded, Choice("flexible"), stiffness)
    start = accelerating_start(floating, LOAD, SPEED)
    ends = {}
    for name, assembly, varying in (
        ("floating", floating, floating.varying_loads),
        ("plain", without_floating_frames(floating), floating.varying_loads),
        ("unloaded", without_floating_frames(floating), None),
    ):
        system = ExudynSystem(assembly, start.q, start.v, LoadTable(LOAD, varying=varying))
        system.run(0.0, 60, 2.4e-5, explicit=False)
        ends[name] = system.state()[1]
    moved = ends["plain"] - ends["unloaded"]
    place = floating.elastic_slices["shaft"]
    seats = 6 * len(floating.elastic_bodies["shaft"].reduced.seats)
    for motions in ((0, 1, 2), (3, 4), (5,)):
        own = [i for i in range(place.start, place.start + seats) if (i - place.start) % 6 in motions]
        assert np.abs(moved[own]).max() > 1e-7
        assert np.abs(ends["floating"] - ends["plain"])[own].max() < 1e-2 * np.abs(moved[own]).max()
    wheel = floating.spin["wheel"]
    assert abs(ends["floating"][wheel] - ends["plain"][wheel]) < 1e-2 * abs(moved[wheel])


@pytest.mark.validation
def test_spins_go_on_through_whole_turns(floating: Assembly) -> None:
    found, _ = trajectories(floating, 160, 1e-4)  # 16 ms at 420 rad/s: once around
    turned = found[:, floating.spin["shaft"]]
    assert turned[-1] > 2.0 * math.pi
    assert np.diff(turned) == pytest.approx(np.full(160, SPEED * 1e-4), rel=0.05)


@pytest.mark.validation
def test_a_run_goes_on_from_its_own_state(floating: Assembly) -> None:
    # What a resumed run starts from is the assembly's state; generalized-alpha forgets its accelerations, which
    # disturbs the motion by less than a thousandth.
    start = accelerating_start(floating, LOAD, SPEED)
    whole = ExudynSystem(floating, start.q, start.v, LoadTable(constant=LOAD))
    states = []

    def observe(t: float, q: np.ndarray, v: np.ndarray) -> bool:
        states.append((q.copy(), v.copy()))
        return True

    whole.run(0.0, 200, 1e-5, observe, explicit=False)
    rest = ExudynSystem(floating, *states[100], LoadTable(constant=LOAD))
    assert rest.state()[1] == pytest.approx(states[100][0], abs=1e-13)
    rest.run(1e-3, 100, 1e-5, explicit=False)
    place = floating.elastic_slices["shaft"]
    seats = [place.start + 6 * n + i for n in range(4) for i in range(3)]
    found, expected = rest.state()[1][seats], states[-1][0][seats]
    assert np.abs(found - expected).max() < 1e-3 * np.abs(expected).max()


def test_the_compiled_solver_leaves_floating_frames_to_exudyn(
    floating: Assembly, gearbox: Gearbox, stiffness: dict, tmp_path: Path
) -> None:
    told = "bodies.shaft.flexibility = 'ffrf' requires Exudyn, 'nonrotating' runs in both"
    assert unsupported_reason(floating) == told
    assert unsupported_reason(without_floating_frames(floating)) == ""
    with pytest.raises(RunError, match="flexibility = 'ffrf' requires Exudyn.*use --solver exudyn"):
        simulated(gearbox, Choice("flexible", load_case="steady"), stiffness, tmp_path, solver="compiled")


@pytest.mark.validation
def test_a_run_keeps_its_account_of_energy(gearbox: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    finished = simulated(
        gearbox, Choice("flexible", load_case="run_up"), stiffness, tmp_path, duration=0.004, step=1e-5, sample_rate=2e4
    )
    assert finished.complete
    with xr.open_dataset(finished.path, engine="h5netcdf") as data:
        assert data.attrs["solver"].endswith("generalized-alpha")
        # Kinetic energy counts as in the frame that does not turn. The rest, 2e-6 of its change in 10 ms, falls with
        # the square of the step: it is that of generalized-alpha.
        assert abs(energy_residual(data)) < 1e-5


def test_a_body_in_a_floating_frame_has_the_inertia_of_its_set(floating: Assembly, gearbox: Gearbox) -> None:
    # By the parallel axes; that it acts alike is what trajectories show.
    body, found = gearbox.body("shaft"), floating.floating["shaft"]
    reduced = floating.elastic_bodies["shaft"].reduced.rigid_inertia
    assert (found.mass, reduced.mass) == pytest.approx((body.mass, body.mass), rel=1e-9)
    centre = found.centre + found.first_moments[:, 0] / found.mass
    assert centre == pytest.approx([*body.axis, body.centre_of_mass_z], abs=1e-12)
    arm = centre - found.centre
    second = found.second_moments[:, :, 0, 0] - found.mass * np.outer(arm, arm)
    inertia = np.trace(second) * np.eye(3) - second
    assert inertia == pytest.approx(np.diag([body.transverse, body.transverse, body.axial]), abs=1e-12)
    assert found.centre[2] != pytest.approx(centre[2], abs=1e-3)  # the frame stays where shape and rings have theirs


def test_an_impossible_blank_is_refused(gearbox: Gearbox) -> None:
    with pytest.raises(GearboxFileError, match="shape.blanks.pinion.*axial 0.002 kg m2 exceeds twice the transverse"):
        gearbox.varied({"bodies.shaft.shape.blanks.pinion.axial_kg_m2": 2e-3})


def test_both_descriptions_are_kept_in_a_folder(model: SolidModel, tmp_path: Path) -> None:
    reduced, body = load_or_reduce_floating(model, tmp_path)
    kept = sorted(tmp_path.glob("*.npz"))
    assert len(kept) == 2
    before = [file.stat().st_mtime_ns for file in kept]
    again, same = load_or_reduce_floating(model, tmp_path)
    assert [file.stat().st_mtime_ns for file in kept] == before
    assert np.array_equal(again.stiffness, reduced.stiffness)
    assert np.array_equal(same.second_moments, body.second_moments)
    assert (same.name, same.seats, same.mass) == (body.name, body.seats, body.mass)
