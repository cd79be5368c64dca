"""Errors of pitch, run-out and planet pins: what each does to deflection, forces and spectra."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.statics import accelerating_start, locked_equilibrium
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.stiffness import pack
from exugear.system.tooth_mesh.placement import MeshGeometry, contact_line_shares, loaded_flanks, tooth_places
from exugear.transient.compiled.solver import CompiledSystem
from exugear.transient.runup import simulate

from ...cases.assembled import assembled
from ...cases.plain_motion import accelerations_of
from ...cases.table import surfaces

LOAD = {"carrier": 240e3}


@pytest.fixture(scope="module")
def pitched(grc: Gearbox) -> Gearbox:
    """Random cumulative pitch deviations on both gears of the high-speed pair, run-out on the sun."""
    random = np.random.default_rng(8)
    deviations = {
        name: {"body": body, "gear": gear, "cumulative_pitch_um": (10.0 * random.normal(size=teeth)).tolist()}
        for name, body, gear, teeth in (
            ("pinion", "hss", "hs_pinion", grc.gears["hs_pinion"].teeth),
            ("wheel", "ims", "hs_gear", grc.gears["hs_gear"].teeth),
        )
    }
    deviations["sun"] = {"body": "lss", "gear": "sun", "runout_um": 60.0, "runout_angle_deg": 30.0}
    return grc.varied({"deviations": deviations})


def high_speed(assembly: Assembly) -> int:
    return assembly.mesh_names.index("high_speed")


def deflection_at(assembly: Assembly, mesh: int, angle: float) -> float:
    """Deflection of a mesh when the train has rolled through an angle of the mesh's gear 1."""
    element = assembly.elements[mesh]
    spins = assembly.gearbox.train.rolling_speeds(element.mesh.pinion, angle)
    q = np.zeros(assembly.size)
    for name, spin in spins.items():
        q[assembly.spin[name]] = spin
    return float(assembly.mesh_states(q, 0 * q)[mesh, 0])


def test_contact_line_shares_are_the_lengths_of_the_lines(grc: Gearbox) -> None:
    """Lengths by counting points of the face; transitions where the contact ratio says."""
    for pair in grc.gear_pairs.values():
        pmc = np.linspace(0.0, 1.0, 41)[:-1]
        teeth, shares = contact_line_shares(pair, pmc)
        assert shares.sum(axis=1) == pytest.approx(1.0, rel=1e-12)
        mean_pairs = (shares > 0.0).sum(axis=1).mean()
        # A pair is in contact for the total contact ratio, in cycles; 40 positions resolve each end to one of them.
        assert mean_pairs == pytest.approx(pair.total_contact_ratio, abs=0.06)
        assert 0 in teeth


def test_a_tooth_standing_back_shows_once_a_revolution(grc: Gearbox, stiffness: dict) -> None:
    """One tooth of the pinion: its pitch deviation acts while it is in mesh, as long as the contact ratio says."""
    teeth = grc.gears["hs_pinion"].teeth
    one = [0.0] * teeth
    one[5] = 10.0
    case = grc.varied({"deviations": {"pinion": {"body": "hss", "gear": "hs_pinion", "cumulative_pitch_um": one}}})
    assembly = assemble(case, Choice("rigid"), stiffness)
    mesh = high_speed(assembly)
    angles = 2.0 * math.pi * np.arange(teeth * 40) / (teeth * 40)
    error = -np.array([deflection_at(assembly, mesh, angle) for angle in angles])
    gear, pair = grc.gears["hs_pinion"], assembly.elements[mesh].mesh.pair
    full = 10e-6 * gear.base_radius / gear.reference_radius
    assert error.max() < full
    # Over the cycles in which the tooth touches, its shares add up to those of one pair of teeth in every position.
    assert error.mean() == pytest.approx(full / teeth, rel=1e-3)
    assert np.mean(error > 1e-9) == pytest.approx(pair.total_contact_ratio / teeth, rel=0.03)
    # It acts while tooth 5 faces the wheel: the flank is a quarter of a pitch from its middle, the path of contact a
    # little to one side of the pitch point; the next tooth would be a whole pitch off.
    pitch = 2.0 * math.pi / teeth
    orientation = tooth_places(case, loaded_flanks(case))[1]["hss", "hs_pinion"]
    middle = orientation % pitch + 5 * pitch + float(np.angle(error @ np.exp(1j * angles)))
    towards = MeshGeometry.of(assembly.elements[mesh].mesh).polar_angle
    assert abs(math.remainder(middle - towards, 2.0 * math.pi)) < 0.5 * pitch


def test_run_out_is_the_way_of_the_axis_along_the_line_of_action(grc: Gearbox, stiffness: dict) -> None:
    """Against a body whose axis is really displaced: the bushing variant's own translations."""
    case = grc.varied(
        {"deviations": {"sun": {"body": "lss", "gear": "sun", "runout_um": 60.0, "runout_angle_deg": 30.0}}}
    )
    plain, bent = assemble(grc, Choice("bushing"), stiffness), assemble(case, Choice("bushing"), stiffness)
    o = plain.coordinates["lss"][0]
    for angle in (0.0, 0.7, 2.0):
        q = np.zeros(plain.size)
        q[plain.spin["lss"]] = angle
        moved = q.copy()
        moved[o : o + 2] = 30e-6 * math.cos(angle + math.pi / 6), 30e-6 * math.sin(angle + math.pi / 6)
        sun = [n for n, name in enumerate(plain.mesh_names) if name.startswith("sun_planet")]
        one, two = bent.mesh_states(q, 0 * q)[sun, 0], plain.mesh_states(moved, 0 * q)[sun, 0]
        # 32 samples a tooth represent a sine of one period a revolution to round-off.
        assert one == pytest.approx(two, abs=1e-10)


@pytest.mark.sample
@pytest.mark.parametrize("law", ["line_of_action", "table"])
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_compiled_solver_and_tangent_know_the_errors(pitched: Gearbox, stiffness: dict, law: str, variant: str) -> None:
    data = surfaces(pitched) if law == "table" else stiffness
    assembly = assembled(pitched, Choice(variant, law), data)
    load = pitched.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked)
    random = np.random.default_rng(2)
    q, v = q + 1e-6 * random.normal(size=q.size), 1e-2 * random.normal(size=q.size)
    found = CompiledSystem(assembly, q, v, LoadTable(LOAD), 1e-5).accelerations()
    expected = accelerations_of(assembly, q, v, assembly.torque_vector(LOAD))
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    jq, _ = assembly.mesh_jacobians(q, v)
    bare = assembled(pitched, Choice(variant, law), data)

    def force(at: np.ndarray) -> np.ndarray:
        return np.asarray(bare.forces(at, v))

    rest = jq.copy()
    step = 2e-8
    for j in (assembly.spin["hss"], assembly.spin["ims"], assembly.spin["lss"]):
        column = (force(q + step * np.eye(q.size)[j]) - force(q - step * np.eye(q.size)[j])) / (2.0 * step)
        mine = rest[:, j] + _other_elements(assembly, q, v, j, step)
        # Of a table's damping the tangent leaves out how its direction turns with the state.
        assert np.abs(column - mine).max() < (1e-5 if law == "table" else 2e-6) * np.abs(jq).max()


def _other_elements(assembly: Assembly, q: np.ndarray, v: np.ndarray, j: int, step: float) -> np.ndarray:
    """Column of the stiffness of bearings and couplings by differences."""
    none = pack((), assembly.coordinates)
    unit = step * np.eye(q.size)[j]
    return np.asarray((assembly.forces(q + unit, v, none) - assembly.forces(q - unit, v, none)) / (2.0 * step))


def test_planets_with_a_pin_out_of_place_share_as_by_hand(grc: Gearbox, stiffness: dict) -> None:
    """Three planets between a sun and a ring that cannot move: springs in parallel with unequal play.

    On planet i both meshes carry F_i (its moment balance); their deflections add up to what sun and carrier close,
    the same for all, plus what its pin gives: F_i = F + k (o_i - mean o), 1 / k = 1 / k_sun + 1 / k_ring.
    """
    case = grc.varied({"pins": {"late": {"body": "planet_1", "tangential_um": 25.0, "radial_um": 10.0}}})
    constant = {name: np.array([values.mean()]) for name, values in stiffness.items()}
    load = grc.case.static_load
    forces = []
    for gearbox in (grc, case):
        assembly = assemble(gearbox, Choice("rigid", "constant"), constant)
        q = locked_equilibrium(assembly, load.torques_N_m, load.locked)
        states = dict(zip(assembly.mesh_names, assembly.mesh_states(q, 0 * q), strict=True))
        forces.append(np.array([states[f"sun_planet_{n}"][4] for n in (1, 2, 3)]))
        assert forces[-1] == pytest.approx([states[f"ring_planet_{n}"][4] for n in (1, 2, 3)], rel=1e-9)
    elements = {e.mesh.name: e for e in assembly.elements}
    offset = sum(elements[f"{name}_planet_1"].offset[0] for name in ("sun", "ring"))
    series = 1.0 / sum(1.0 / float(constant[name][0]) for name in ("sun_planet", "ring_planet"))
    expected = forces[0] + series * (np.array([offset, 0.0, 0.0]) - offset / 3.0)
    assert forces[1] == pytest.approx(expected, rel=1e-6)
    # By hand: the tangential way counts with cos(alpha) in both meshes, the radial way with sin(alpha) against each
    # other but for the two working pressure angles.
    angles = [e.mesh.pair.working_pressure_angle for e in (elements["sun_planet_1"], elements["ring_planet_1"])]
    size = 25e-6 * (math.cos(angles[0]) + math.cos(angles[1]))
    spread = 10e-6 * abs(math.sin(angles[0]) - math.sin(angles[1]))
    assert abs(offset) == pytest.approx(size, abs=spread + 1e-9)


@pytest.mark.validation
def test_bearings_carry_a_displaced_planet_along(grc: Gearbox, stiffness: dict) -> None:
    """Unloaded and out of mesh the planet stands where its pin is."""
    case = grc.varied({"pins": {"late": {"body": "planet_2", "tangential_um": 25.0}}})
    assembly = assemble(case, Choice("bushing"), stiffness).unloaded
    x, y = case.pin_offsets["planet_2"]
    assert math.hypot(x, y) == pytest.approx(25e-6, rel=1e-12)
    q = np.zeros(assembly.size)
    o = assembly.coordinates["planet_2"][0]
    q[o : o + 2] = x, y
    loads = assembly.bearing_loads(q, 0 * q)
    assert np.abs(loads).max() < 1e-3  # N, of 1e9 N/m
    found = CompiledSystem(assembly, q, 0 * q, LoadTable({}), 1e-5).accelerations()
    expected = accelerations_of(assembly, q, 0 * q, np.zeros(q.size))
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.validation
def test_exudyn_has_the_same_pins_and_errors(pitched: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    case = pitched.varied({"pins": {"late": {"body": "planet_2", "tangential_um": 25.0, "radial_um": -5.0}}})
    one, two = (
        xr.load_dataset(
            simulate(case, Choice("bushing"), stiffness, tmp_path / solver, duration=0.01, solver=solver).path,
            engine="h5netcdf",
        )
        for solver in ("compiled", "exudyn")
    )
    for name in ("overall_dte", "mesh_force", "support_force", "elastic_energy"):
        expected = two[name].to_numpy()
        # Stored signals have seven digits.
        assert np.abs(one[name].to_numpy() - expected).max() < 1e-6 * np.abs(expected).max(), name
    shares = two["mesh_force"].sel(mesh=[f"sun_planet_{n}" for n in (1, 2, 3)]).mean("time").to_numpy()
    assert np.ptp(shares) > 0.1 * shares.mean()


@pytest.mark.validation
def test_a_displaced_planet_gives_the_sidebands_of_its_orbit(grc: Gearbox, stiffness: dict) -> None:
    """Equally loaded planets hold the carrier's bearings still; one out of place leaves a force that turns with it."""
    case = grc.varied({"pins": {"late": {"body": "planet_1", "tangential_um": 25.0}}})
    speed = 20.0
    levels = []
    for gearbox in (grc, case):
        assembly = assemble(
            gearbox, Choice("bushing", "constant"), {n: np.array([v.mean()]) for n, v in stiffness.items()}
        )
        balanced = {"carrier": 240e3, "hss": -240e3 / gearbox.train.ratio}
        start = accelerating_start(assembly, balanced, speed)
        step = 2.0 * math.pi / speed / 16384
        q, v = np.empty((2, 16384, assembly.size))
        CompiledSystem(assembly, start.q, start.v, LoadTable(balanced), step).advance(0, q, v)
        bearing = assembly.connector_names.index("plc_a")
        force = np.array([assembly.bearing_loads(*state)[bearing, 0] for state in zip(q[::64], v[::64], strict=True)])
        levels.append(abs(np.fft.rfft(force - force.mean())[1]) * 2.0 / len(force))
    assert levels[1] > 20.0 * levels[0]


def test_pitch_errors_put_sidebands_of_the_shaft_beside_the_mesh(pitched: Gearbox, stiffness: dict) -> None:
    """Constant speed, one revolution of the high-speed wheel: orders of the shafts where without errors is nothing."""
    clean = pitched.varied({"deviations": {}})
    spectra = []
    for gearbox in (clean, pitched):
        assembly = assemble(gearbox, Choice("rigid"), stiffness)
        element = assembly.elements[high_speed(assembly)]
        teeth = element.mesh.pair.pinion.teeth
        angles = 2.0 * math.pi * np.arange(teeth * 32) / (teeth * 32)
        k = []
        for angle in angles:
            k.append(deflection_at(assembly, high_speed(assembly), float(angle)))
        spectra.append(np.abs(np.fft.rfft(k)) / len(angles))
    orders = np.arange(1, 22)
    assert spectra[0][orders].max() < 1e-12
    assert spectra[1][orders].max() > 1e-7


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"deviations": {"a": {"body": "hss", "cumulative_pitch_um": [1.0, 2.0]}}}, "2 values; hs_pinion has 22 teeth"),
        ({"deviations": {"a": {"body": "nowhere", "runout_um": 3.0}}}, "no such body"),
        ({"deviations": {"a": {"body": "ims", "runout_um": 3.0}}}, ": choose one of"),
        ({"deviations": {"a": {"body": "hss"}}}, "cumulative_pitch_um, one number for each tooth, or runout_um"),
        ({"pins": {"a": {"body": "hss", "radial_um": 3.0}}}, ": not a planet; planets are planet_1"),
    ],
)
def test_impossible_errors_are_refused(grc: Gearbox, changes: dict, message: str) -> None:
    with pytest.raises(GearboxFileError, match=message):
        grc.varied(changes)
