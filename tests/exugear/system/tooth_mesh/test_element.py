"""The mesh force element: signs, phases, rolling, exact gradients."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.cubics import periodic_cubic, stiffness_at
from exugear.system.kernels.meshes import ENERGY, STATE_SIZE
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import mesh_elements
from exugear.system.tooth_mesh.laws.mesh_forces import add_mesh_forces, mesh_state
from exugear.system.tooth_mesh.laws.registry import LAWS as ALL_LAWS
from exugear.system.tooth_mesh.laws.registry import law_of
from exugear.system.tooth_mesh.placement import MeshError, MeshGeometry, loaded_flanks, tooth_places

from ...cases.assembled import assembled

LAWS = [name for name, law in ALL_LAWS.items() if law.has_force and not law.needs_axes]
RATED = 22.1 * math.pi / 30


def rolled(assembly: Assembly, angle: float) -> np.ndarray:
    """Coordinates after the carrier has rolled through an angle, nothing deflected."""
    spins = assembly.gearbox.train.rolling_speeds("carrier", angle)
    q = np.zeros(assembly.size)
    c, s = math.cos(angle), math.sin(angle)
    for body in assembly.bodies:
        q[assembly.spin[body.name]] = spins[body.name]
        if body.carrier and assembly.has_six(body):
            x, y = body.axis
            o = assembly.coordinates[body.name][0]
            q[o], q[o + 1] = c * x - s * y - x, s * x + c * y - y
    return q


def random_state(assembly: Assembly, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A rolled state with deflections of 0.1 mm and mrad on top, and unrelated velocities."""
    random = np.random.default_rng(seed)
    q = rolled(assembly, 0.7) + 1e-4 * random.normal(size=assembly.size)
    return q, 0.1 * random.normal(size=assembly.size)


def mesh_forces(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    f = np.zeros(assembly.size)
    add_mesh_forces(q, v, assembly.meshes, f)
    return f


def states(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    out = np.zeros((len(assembly.elements), STATE_SIZE))
    mesh_state(q, v, assembly.meshes, out)
    return out


@pytest.mark.parametrize("law", ["line_of_action", "tangential"])
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_rolling_at_rated_speed_has_no_deflection_rate(grc: Gearbox, stiffness: dict, law: str, variant: str) -> None:
    assembly = assembled(grc, Choice(variant, law), stiffness)
    speeds = grc.train.rolling_speeds("carrier", RATED)
    for angle in (0.0, 0.4, 100.0):
        q = rolled(assembly, angle)
        found = states(assembly, q, assembly.rolling_velocity(q, speeds))
        assert np.abs(found[:, 1]).max() < 1e-12  # m/s, the bound of the specification
        # The spins are a null space, each known to some 1e-16 of the fastest: 8e3 rad, on base radii of up to 0.5 m.
        assert np.abs(found[:, 0]).max() < 1e-11


def test_mesh_cycle_runs_once_per_tooth(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    start = states(assembly, rolled(assembly, 0.0), np.zeros(assembly.size))[:, 2]
    # A carrier angle of one ring tooth turns sun and ring meshes by a whole cycle.
    later = states(assembly, rolled(assembly, 2 * math.pi / 99), np.zeros(assembly.size))[:, 2]
    change = np.abs(np.remainder(later - start + 0.5, 1.0) - 0.5)
    assert change[:6].max() < 1e-12


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("variant", ["rigid", "bushing"])
def test_jacobian_equals_finite_differences(grc: Gearbox, stiffness: dict, law: str, variant: str) -> None:
    assembly = assembled(grc, Choice(variant, law), stiffness)
    q, v = random_state(assembly)
    jq, jv = assembly.mesh_jacobians(q, v)
    step = 1e-6
    for found, wrt_q in ((jq, True), (jv, False)):
        columns = []
        # The force is linear in v: a long step there is exact and drowns round-off.
        h = step if wrt_q else 10.0
        for unit in np.eye(assembly.size):
            dq, dv = (h * unit, 0.0 * unit) if wrt_q else (0.0 * unit, h * unit)
            difference = mesh_forces(assembly, q + dq, v + dv) - mesh_forces(assembly, q - dq, v - dv)
            columns.append(difference / (2 * h))
        assert np.abs(found - np.array(columns).T).max() < 1e-6 * np.abs(found).max()


def test_force_is_the_gradient_of_the_mesh_energy(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("bushing", "constant"), stiffness)
    q, _ = random_state(assembly)
    rest = np.zeros(assembly.size)

    def energy(at: np.ndarray) -> float:
        return float(states(assembly, at, rest)[:, ENERGY].sum())

    h = 1e-6
    gradient = np.array([(energy(q + h * e) - energy(q - h * e)) / (2 * h) for e in np.eye(assembly.size)])
    force = mesh_forces(assembly, q, rest)
    assert np.abs(force + gradient).max() < 1e-6 * np.abs(force).max()


@pytest.mark.parametrize("law", ["line_of_action", "tangential"])
def test_power_into_the_bodies_is_the_mesh_power(grc: Gearbox, stiffness: dict, law: str) -> None:
    assembly = assemble(grc, Choice("bushing", law), stiffness)
    q, v = random_state(assembly)
    found = states(assembly, q, v)
    power = mesh_forces(assembly, q, v) @ v
    mesh_power = -np.sum(found[:, 4] / assembly.meshes.line_of_action * found[:, 1])
    if law == "line_of_action":
        # What tilts works as well: its energy over time, and its damper.
        without = assembly.meshes._replace(tilt=np.zeros_like(assembly.meshes.tilt))
        assert power != pytest.approx(mesh_power, rel=1e-6)
        power = assembly.mesh_forces(q, v, without) @ v
        assert power == pytest.approx(mesh_power, rel=1e-12)
    else:
        # The seed pushes radially and axially where its deflection sees nothing: it is not conservative.
        assert abs(power - mesh_power) > 1e-3 * abs(mesh_power)


@pytest.mark.parametrize("law", ["line_of_action", "tangential"])
def test_forces_and_moments_of_all_meshes_balance(grc: Gearbox, stiffness: dict, law: str) -> None:
    """Moved or turned as a whole with a turning ring, the gears gain nothing: forces are internal."""
    assembly = assemble(grc, Choice("bushing", law), stiffness)
    q = rolled(assembly, 0.7) + 1e-5 * np.random.default_rng(3).normal(size=assembly.size)
    f = mesh_forces(assembly, q, np.zeros(assembly.size))
    names = ["lss", "ims", "hss", "planet_1", "planet_2", "planet_3"]
    total = np.zeros(3)
    for name in names:
        o = assembly.coordinates[name][0]
        total += f[o : o + 3]
    ring = np.zeros(3)  # what the ring meshes give to the fixed housing
    found = states(assembly, q, np.zeros(assembly.size))
    psi = q[assembly.spin["carrier"]]
    turn = np.array([[math.cos(psi), -math.sin(psi), 0], [math.sin(psi), math.cos(psi), 0], [0, 0, 1]])
    for element, state in zip(assembly.elements, found, strict=True):
        if element.mesh.gear == "housing":
            scalar = state[4] / element.line_of_action
            ring -= scalar * turn @ element.force[6:9]
    assert np.abs(total + ring).max() < 1e-9 * np.abs(f).max()


@pytest.mark.parametrize("flank", [1, -1])
@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize("name", ["intermediate", "ring_planet_1"])
def test_force_directions_for_both_hands_and_flanks(
    grc: Gearbox, stiffness: dict, name: str, hand: int, flank: int
) -> None:
    """Against the textbook: the driver's torque opposes, radial parts separate, thrust follows the hand."""
    changes = {}
    for gear, section in grc.case.gears.items():
        changes[f"gears.{gear}.helix_angle_deg"] = hand * section.helix_angle_deg
    gearbox = grc.varied(changes)
    flanks = dict.fromkeys(loaded_flanks(gearbox), flank)
    elements = mesh_elements(gearbox, stiffness, law_of("line_of_action"), flanks=flanks)
    element = next(e for e in elements if e.mesh.name == name)
    geometry = MeshGeometry.of(element.mesh)
    on_first = -element.force[:6]  # a positive scalar force acts with minus the row
    assert on_first[5] == pytest.approx(-flank * element.mesh.pair.pinion.base_radius, rel=1e-12)
    towards_axis = on_first[:3] @ geometry.radial
    assert towards_axis == pytest.approx(-math.sin(geometry.pressure_angle), rel=1e-12)
    # A right-hand driver turning +z (flank +1) is pushed to +z; left hand or other sense the other way.
    pinion_hand = math.copysign(1.0, element.mesh.pair.pinion.helix_angle)
    assert math.copysign(1.0, on_first[2]) == pinion_hand * flank
    on_second = -element.force[6:12]
    sign = 1.0 if element.mesh.pair.gear.internal else -1.0
    assert on_second[5] == pytest.approx(sign * flank * element.mesh.pair.gear.base_radius, rel=1e-12)
    assert np.allclose(on_first[:3], -on_second[:3], rtol=1e-14)


def test_equally_spaced_planets_are_in_phase(grc: Gearbox) -> None:
    # 21 and 99 teeth are multiples of 3 (published: all planets in phase).
    phases = tooth_places(grc, loaded_flanks(grc))[0]
    for stage in ("sun_planet", "ring_planet"):
        values = [phases[f"{stage}_{number}"] for number in (1, 2, 3)]
        assert max(abs(math.remainder(value - values[0], 1.0)) for value in values) < 1e-12


def test_shifted_planet_is_shifted_in_phase_by_the_sun_teeth(grc: Gearbox) -> None:
    # Sequential positions of the published phasing study: multiples of 3 degrees at 0, 42 and 84.
    gearbox = grc.varied({"bodies.planet.planet_angles_deg": [0.0, 126.0, 252.0]})
    phases = tooth_places(gearbox, loaded_flanks(gearbox))[0]
    flank = loaded_flanks(gearbox)["sun_planet_1"]
    for number, angle in ((2, 126.0), (3, 252.0)):
        shift = phases[f"sun_planet_{number}"] - phases["sun_planet_1"]
        # Turning the line of centres by an angle is turning the sun back by it: z_s angle / 2 pi cycles.
        assert abs(math.remainder(shift + flank * 21 * angle / 360.0, 1.0)) < 1e-9


def test_phase_between_sun_and_ring_follows_from_the_planets_tooth_thickness(grc: Gearbox) -> None:
    """One planet tooth flank drives the sun, the other is driven by the ring, half a turn away."""
    phases = tooth_places(grc, loaded_flanks(grc))[0]
    planet, sun, ring = grc.gears["planet"], grc.gears["sun"], grc.gears["ring"]
    assert (sun.teeth, ring.teeth) == (21, 99)
    # 39 teeth: from the ring's pitch point to the sun's are 19.5 pitches; the tooth between the two flanks
    # takes its own thickness, all at the planet's working radius.
    radius = grc.gear_pairs["ring_planet"].pinion_working_radius
    thickness = 2.0 * float(planet.half_angle(radius)) / planet.angular_pitch
    shift = phases["ring_planet_1"] - phases["sun_planet_1"]
    assert abs(math.remainder(shift - (thickness - 19.5), 1.0)) < 1e-9


def test_phase_in_the_file_overrides_geometry(grc: Gearbox, stiffness: dict) -> None:
    gearbox = grc.varied({"meshes.ring_planet.phase": [0.1, 0.2, 0.3]})
    elements = mesh_elements(gearbox, stiffness, law_of("line_of_action"))
    assert [e.phase for e in elements if e.mesh.family == "ring_planet"] == pytest.approx([0.1, 0.2, 0.3])


def test_seed_stiffness_is_cos_squared_of_the_tables(grc: Gearbox, stiffness: dict) -> None:
    for element in mesh_elements(grc, stiffness, law_of("tangential")):
        angle = element.mesh.pair.pinion.transverse_pressure_angle
        expected = math.cos(angle) ** 2 * stiffness[element.mesh.pair.name]
        assert np.allclose(element.stiffness, expected, rtol=1e-14)


def test_seed_force_has_the_printed_direction(grc: Gearbox, stiffness: dict) -> None:
    # T = {1, tan(phi_n) / cos(beta), -tan(beta)}, reference angles, magnitudes.
    for element in mesh_elements(grc, stiffness, law_of("tangential")):
        geometry, pinion = MeshGeometry.of(element.mesh), element.mesh.pair.pinion
        force = element.force[:3]
        assert force @ geometry.tangential == pytest.approx(element.flank, rel=1e-12)
        radial = math.tan(pinion.normal_pressure_angle) / math.cos(pinion.helix_angle)
        assert force @ geometry.radial == pytest.approx(radial, rel=1e-12)
        assert abs(force[2]) == pytest.approx(abs(math.tan(pinion.helix_angle)), rel=1e-12)


def test_cubic_passes_through_its_samples_and_is_smooth() -> None:
    samples = 1.0 + 0.1 * np.cos(2 * np.pi * np.arange(50) / 50 + 0.4)
    pieces = periodic_cubic(samples)
    for n, sample in enumerate(samples):
        # Just left of every knot, the end of the cycle included, value and slope are those on the right.
        left, right = stiffness_at(pieces, 50, n / 50 - 1e-9), stiffness_at(pieces, 50, n / 50)
        assert right[0] == pytest.approx(sample, rel=1e-14)
        assert left[0] == pytest.approx(right[0], rel=1e-8)
        assert left[1] == pytest.approx(right[1], abs=1e-6)
    between = np.array([stiffness_at(pieces, 50, x)[0] for x in np.linspace(-1, 2, 997)])
    exact = 1.0 + 0.1 * np.cos(2 * np.pi * np.linspace(-1, 2, 997) + 0.4)
    # Slopes by central differences are off by (2 pi / 50)^2 / 6 of 0.1, the cubic damps that to 3e-6.
    assert np.abs(between - exact).max() < 5e-6


def test_missing_or_impossible_stiffness_is_refused(grc: Gearbox, stiffness: dict) -> None:
    with pytest.raises(MeshError, match="no stiffness for pair 'high_speed'"):
        mesh_elements(grc, {k: v for k, v in stiffness.items() if k != "high_speed"}, law_of("line_of_action"))
    with pytest.raises(MeshError, match="positive and finite"):
        mesh_elements(grc, {**stiffness, "high_speed": np.array([1e9, np.nan])}, law_of("line_of_action"))
    with pytest.raises(MeshError, match="'springs' has no force element"):
        law_of("springs")
