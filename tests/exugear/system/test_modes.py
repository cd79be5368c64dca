"""Eigenmodes against an independent lumped model, phasing, and a single pair against SciPy."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import scipy.integrate
import scipy.linalg
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.modes import FREE_ROTATION, eigenmodes, modes_of
from exugear.system.statics import linearise, locked_equilibrium, static_state
from exugear.transient.exudyn_model.system import ExudynSystem

from ..cases.assembled import modes_with_bodies

STIFFNESS = {"sun_planet": np.array([3e8]), "ring_planet": np.array([4e8])}


def inertia(mass: float, axial: float, transverse: float) -> dict:
    """One inertia set `test` with the centre of mass at z = 0."""
    values = {"mass_kg": mass, "axial_kg_m2": axial, "transverse_kg_m2": transverse, "centre_of_mass_z_mm": 0.0}
    return {"test": values}


def spur(teeth: int, internal: bool = False) -> dict:
    """A spur gear of module 3."""
    held = 3.0 * teeth + 40.0 if internal else 1.5 * teeth
    return {
        "teeth": teeth, "normal_module_mm": 3.0, "face_width_mm": 30.0, "held_diameter_mm": held,
        "internal": internal,
        "rack": {"addendum": 0.75 if internal else 1.0},
    }  # fmt: skip


def planetary(sun: int, planet: int, planets: int) -> Gearbox:
    """A spur planetary stage alone: sun, carrier and turning ring on isotropic supports with torsional springs."""
    ring = sun + 2 * planet
    centre = 1.5 * (sun + planet)
    support = {"axial_N_per_m": 3e8, "tilt_N_m_per_rad": 2e6}
    content = {
        "name": "planetary stage",
        "default_inertias": "test",
        "overall": {"input": "sun", "output": "carrier", "output_gear": "sun"},
        "static_load": {"torques_N_m": {"sun": 500.0}, "locked": ["carrier", "ring"]},
        "gears": {"sun": spur(sun), "planet": spur(planet), "ring": spur(ring, internal=True)},
        "pairs": {
            "sun_planet": {"pinion": "sun", "gear": "planet", "centre_distance_mm": centre},
            "ring_planet": {"pinion": "planet", "gear": "ring", "centre_distance_mm": centre},
        },
        "bodies": {
            "sun": {"axis_position_mm": [0, 0], "gears_z_mm": {"sun": 0}, "inertia": inertia(1.4, 1e-3, 8e-4)},
            "carrier": {"axis_position_mm": [0, 0], "inertia": inertia(9.0, 3e-2, 2e-2)},
            "ring": {"axis_position_mm": [0, 0], "gears_z_mm": {"ring": 0}, "inertia": inertia(6.0, 9e-2, 5e-2)},
            "planet": {
                "carrier": "carrier",
                "orbit_radius_mm": centre,
                "planet_angles_deg": [360.0 * n / planets for n in range(planets)],
                "gears_z_mm": {"planet": 0},
                "inertia": inertia(1.1, 9e-4, 7e-4),
            },
        },
        "meshes": {
            "sun_planet": {"pair": "sun_planet", "pinion_body": "sun", "gear_body": "planet"},
            "ring_planet": {"pair": "ring_planet", "pinion_body": "planet", "gear_body": "ring"},
        },
        "bearings": {
            "sun": {"body": "sun", "z_mm": 0, "stiffness": {"radial_N_per_m": 1.1e8, **support}},
            "carrier": {
                "body": "carrier",
                "z_mm": 0,
                "stiffness": {"radial_N_per_m": 1.7e8, "torsion_N_m_per_rad": 3e5, **support},
            },
            "ring": {
                "body": "ring",
                "z_mm": 0,
                "stiffness": {"radial_N_per_m": 2.3e8, "torsion_N_m_per_rad": 7e6, **support},
            },
            "pin": {"body": "planet", "on": "carrier", "z_mm": 0, "stiffness": {"radial_N_per_m": 4e8, **support}},
        },
        "load_cases": {"load": {"torques_N_m": {"sun": 500.0}}},
    }  # fmt: skip
    return Gearbox.from_dict(content, "planetary")


def lumped_frequencies(gearbox: Gearbox, planets: int) -> np.ndarray:
    """Frequencies (Hz) of the two-dimensional model of Lin and Parker (1999): x, y, u = r theta per body.

    Deflections as they print them, planets in radial and tangential coordinates; carrier at rest.
    """
    pair = gearbox.gear_pairs
    alpha_s = pair["sun_planet"].working_pressure_angle
    alpha_r = pair["ring_planet"].working_pressure_angle
    size = 3 * (3 + planets)
    carrier, ring, sun = 0, 3, 6
    k = np.zeros((size, size))
    mass = np.zeros(size)

    def add(value: float, entries: dict[int, float]) -> None:
        row = np.zeros(size)
        for index, factor in entries.items():
            row[index] = factor
        k[:] += value * np.outer(row, row)

    radius = {
        carrier: pair["sun_planet"].centre_distance,
        ring: gearbox.gears["ring"].base_radius,
        sun: gearbox.gears["sun"].base_radius,
    }
    values = {body.name: body for body in gearbox.bodies()}
    supports = {carrier: (1.7e8, 3e5), ring: (2.3e8, 7e6), sun: (1.1e8, 0.0)}
    for start, name in ((carrier, "carrier"), (ring, "ring"), (sun, "sun")):
        mass[start : start + 3] = values[name].mass, values[name].mass, values[name].axial / radius[start] ** 2
        radial, torsion = supports[start]
        add(radial, {start: 1.0})
        add(radial, {start + 1: 1.0})
        add(torsion / radius[start] ** 2, {start + 2: 1.0})
    planet_radius = gearbox.gears["planet"].base_radius
    for n in range(planets):
        p, psi = 9 + 3 * n, 2 * math.pi * n / planets
        body = values[f"planet_{n + 1}"]
        mass[p : p + 3] = body.mass, body.mass, body.axial / planet_radius**2
        s, r = psi - alpha_s, psi + alpha_r
        add(3e8, {sun: -math.sin(s), sun + 1: math.cos(s), sun + 2: 1.0,
                  p: -math.sin(alpha_s), p + 1: -math.cos(alpha_s), p + 2: 1.0})  # fmt: skip
        add(4e8, {ring: -math.sin(r), ring + 1: math.cos(r), ring + 2: 1.0,
                  p: math.sin(alpha_r), p + 1: -math.cos(alpha_r), p + 2: -1.0})  # fmt: skip
        add(4e8, {carrier: math.cos(psi), carrier + 1: math.sin(psi), p: -1.0})
        add(4e8, {carrier: -math.sin(psi), carrier + 1: math.cos(psi), carrier + 2: 1.0, p + 1: -1.0})
    squares = scipy.linalg.eigh(k, np.diag(mass), eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * math.pi)


@pytest.mark.parametrize("planets", [3, 4])
def test_planetary_frequencies_equal_the_lumped_model(planets: int) -> None:
    gearbox = planetary(24, 24, planets)
    modes = modes_of(assemble(gearbox, Choice("bushing"), STIFFNESS), preload=False)
    in_plane = modes.kinetic[:, :, :2].sum(axis=(1, 2)) > 0.5
    expected = lumped_frequencies(gearbox, planets)
    found = np.sort(modes.frequency[in_plane])
    assert found.size == 3 * (planets + 3)
    # 0.01 % is asked for; both are exact, difference quotients of the bearings remain.
    assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("planets", [3, 4])
def test_multiplicities_of_planetary_modes(planets: int) -> None:
    """Rotational modes are single, translational ones double, planet modes (N > 3) of multiplicity N - 3."""
    frequency = lumped_frequencies(planetary(24, 24, planets), planets)
    modes = modes_of(assemble(planetary(24, 24, planets), Choice("bushing"), STIFFNESS), preload=False)
    in_plane = modes.kinetic[:, :, :2].sum(axis=(1, 2)) > 0.5
    found = modes.frequency[in_plane]
    count = [int(np.sum(np.abs(found - f) < 1e-5 * f)) for f in frequency]
    assert count.count(2) == 12  # six pairs
    assert count.count(1) == 6 + 3 * (planets - 3)


def test_damping_ratio_of_proportional_damping_is_pi_f_times_its_time(grc: Gearbox, stiffness: dict) -> None:
    modes = eigenmodes(grc, Choice("bushing"), stiffness)
    # The preload makes K unsymmetric by 0.1 %, c is proportional to the symmetric unloaded tangent.
    assert modes.damping_ratio == pytest.approx(math.pi * 4e-6 * modes.frequency, rel=5e-3, abs=1e-9)


def test_train_has_one_free_rotation(grc: Gearbox, stiffness: dict) -> None:
    for variant in ("rigid", "bushing"):
        modes = modes_with_bodies(grc, Choice(variant), stiffness)
        assert modes.names.count(FREE_ROTATION) == 1
        assert modes.frequency[0] == 0.0
        assert modes.frequency[1] > 10.0
        spin = [modes.shapes[modes.assembly.spin[name], 0] for name in ("carrier", "hss")]
        assert spin[1] / spin[0] == pytest.approx(grc.train.ratio, rel=1e-6)


def test_energy_shares_sum_to_one(grc: Gearbox, stiffness: dict) -> None:
    modes = eigenmodes(grc, Choice("bushing"), stiffness)
    assert modes.strain[1:].sum(axis=1) == pytest.approx(np.ones(len(modes.frequency) - 1), rel=1e-12)
    assert modes.kinetic.sum(axis=(1, 2)) == pytest.approx(np.ones(len(modes.frequency)), rel=1e-12)


def test_exudyn_finds_the_same_frequencies(grc: Gearbox, stiffness: dict) -> None:
    assembly = assemble(grc, Choice("bushing"), stiffness)
    load = grc.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked, assembly.mean_meshes)
    system = ExudynSystem(
        assembly, q, np.zeros(assembly.size), LoadTable(load.torques_N_m), meshes=assembly.mean_meshes
    )
    mass, stiff, _ = system.linearised()
    values = scipy.linalg.eigvals(stiff, mass)
    exudyn = np.sort(np.sqrt(np.abs(values.real))) / (2 * math.pi)
    own = np.sort(modes_of(assembly).frequency)
    assert own[1:] == pytest.approx(exudyn[1:], rel=1e-4)  # geometric terms of tilted bodies differ slightly


def test_inertia_sets_move_the_upper_modes(grc: Gearbox, stiffness: dict) -> None:
    light = eigenmodes(grc, Choice("rigid", inertias="gears"), stiffness)
    heavy = eigenmodes(grc, Choice("rigid", inertias="assemblies"), stiffness)
    assert light.frequency[-1] > 2.0 * heavy.frequency[-1]
    assert "hss torsion" in light.names[-1]


@pytest.mark.validation
def test_seed_law_flutters_on_soft_bearings_unless_damped(grc: Gearbox, stiffness: dict) -> None:
    """Its force has parts that its deflection does not see: the tangent is unsymmetric."""
    light = eigenmodes(grc, Choice("bushing", "tangential"), stiffness)
    assert light.growth_rate > 1.0
    damped = grc.varied({"damping.bearing_time_s": 4e-5, "damping.mesh_time_s": 4e-5})
    assert eigenmodes(damped, Choice("bushing", "tangential"), stiffness).growth_rate < 1e-3
    assert eigenmodes(grc, Choice("bushing"), stiffness).growth_rate < 1e-3


def test_modes_file_is_readable_by_xarray_alone(grc: Gearbox, stiffness: dict, tmp_path: Path) -> None:
    modes = eigenmodes(grc, Choice("rigid"), stiffness)
    data = xr.load_dataset(modes.save(tmp_path / "modes.nc"), engine="h5netcdf")
    assert np.array_equal(data.frequency.to_numpy(), modes.frequency)
    assert data.attrs["inertias"] == "assemblies"
    assert data["frequency"].attrs["units"] == "Hz"


def sun_force(gearbox: Gearbox, speed: float) -> tuple[np.ndarray, float]:
    """Radial force on the sun (samples, 2) in a steady run, in the carrier's frame, and the mean mesh force."""
    cycle = 2 * np.pi * np.arange(50) / 50
    shape = 1 + 0.1 * np.cos(cycle) + 0.05 * np.cos(2 * cycle) + 0.03 * np.cos(3 * cycle) + 0.02 * np.cos(4 * cycle)
    assembly = assemble(gearbox, Choice("bushing"), {"sun_planet": 3e8 * shape, "ring_planet": 4e8 * shape})
    q = locked_equilibrium(assembly, {"sun": 500.0}, ["carrier", "ring"])
    v = np.zeros(assembly.size)
    # The carrier stands, the sun turns: planets and ring roll with it, all as deflected by the load.
    states: list[np.ndarray] = []
    for step in range(600):
        angle = speed * step * 2e-5
        at = q.copy()
        modes = gearbox.train.kinematic_modes
        roll = np.linalg.lstsq(
            modes[[gearbox.spinning.index(name) for name in ("sun", "carrier")]],
            np.array([angle, 0.0]), rcond=None,
        )[0]  # fmt: skip
        for name, value in zip(gearbox.spinning, modes @ roll, strict=True):
            at[assembly.spin[name]] += value
        states.append(assembly.mesh_states(at, v)[:, 4])
    forces = np.array(states)
    suns = [n for n, element in enumerate(assembly.elements) if element.mesh.family == "sun_planet"]
    total = sum(-forces[:, [n]] * assembly.elements[n].force[:2] for n in suns)
    return np.asarray(total), float(forces[:, suns].mean())


def test_meshes_in_phase_leave_no_radial_force_on_the_sun() -> None:
    total, mean = sun_force(planetary(24, 24, 3), 200.0)
    spectrum = np.abs(np.fft.rfft(total, axis=0)) / len(total)
    assert spectrum.max() < 1e-6 * mean


def test_meshes_in_sequential_phase_shake_the_sun() -> None:
    # 22 teeth and three planets: phases 0, 1/3, 2/3; the stage can be assembled, (22 + 74) / 3 = 32.
    total, mean = sun_force(planetary(22, 26, 3), 200.0)
    spectrum = np.abs(np.fft.rfft(total - total.mean(axis=0), axis=0)) / len(total)
    assert spectrum.max() > 1e-3 * mean


def single_pair() -> Gearbox:
    """Two equal gears on ideal joints."""
    content = {
        "name": "pair",
        "default_inertias": "test",
        "overall": {"input": "one", "output": "two", "output_gear": "second"},
        "static_load": {"torques_N_m": {"one": 100.0}, "locked": ["two"]},
        "damping": {"mesh_time_s": 1e-5},
        "gears": {"first": spur(50), "second": spur(50)},
        "pairs": {"pair": {"pinion": "first", "gear": "second", "centre_distance_mm": 150.0}},
        "bodies": {
            "one": {"axis_position_mm": [0, 0], "gears_z_mm": {"first": 0}, "inertia": inertia(5.0, 1e-2, 6e-3)},
            "two": {"axis_position_mm": [150, 0], "gears_z_mm": {"second": 0}, "inertia": inertia(5.0, 2e-2, 1.1e-2)},
        },
        "joints": {"one": {"body": "one", "z_mm": 0}, "two": {"body": "two", "z_mm": 0}},
        "meshes": {"pair": {"pair": "pair", "pinion_body": "one", "gear_body": "two"}},
        "load_cases": {"load": {"torques_N_m": {"one": 100.0, "two": 100.0}}},
    }
    return Gearbox.from_dict(content, "pair")


def test_parametric_response_of_a_single_pair_equals_scipy() -> None:
    """k = k0 (1 + 0.2 cos) at a speed near the principal parametric resonance, from rest in balance."""
    gearbox = single_pair()
    mean, epsilon = 2e8, 0.2
    shape = 1 + epsilon * np.cos(2 * np.pi * np.arange(50) / 50)
    assembly = assemble(gearbox, Choice("rigid"), {"pair": mean * shape})
    radius = gearbox.gears["first"].base_radius
    inertias = np.array([1e-2, 2e-2])
    effective = 1.0 / np.sum(radius**2 / inertias)
    natural = math.sqrt(mean / effective)
    speed = 1.1 * natural / 50
    torques = np.array([100.0, 100.0])
    damping = 1e-5 * mean
    start = np.array([100.0 / radius / (mean * 1.2) / radius, 0.0, speed, -speed])

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        delta, closing = radius * (y[0] + y[1]), radius * (y[2] + y[3])
        force = mean * (1 + epsilon * math.cos(50 * y[0])) * delta + damping * closing
        return np.concatenate([y[2:], (torques - radius * force) / inertias])

    steps, step = 2000, 1e-5
    times = step * np.arange(steps + 1)
    exact = scipy.integrate.solve_ivp(
        rate, (0.0, times[-1]), start, method="DOP853", rtol=1e-12, atol=1e-13, t_eval=times
    ).y
    rows: list[np.ndarray] = []

    def keep(t: float, q: np.ndarray, v: np.ndarray) -> bool:
        rows.append(assembly.mesh_states(q, v)[0])
        return True

    loads = LoadTable({"one": 100.0, "two": 100.0})
    ExudynSystem(assembly, start[:2], start[2:], loads).run(0.0, steps, step, keep)
    delta = np.array(rows)[:, 0]
    expected = radius * (exact[0] + exact[1])
    assert np.ptp(expected) > 0.5 * expected.mean()  # the response is large: the test sees something
    # 0.1 % of the response is asked for; the cubic through 50 samples differs from the cosine by 2e-5.
    assert np.abs(delta - expected).max() < 1e-3 * np.abs(expected).max()


def test_linearisation_ignores_the_slope_of_the_stiffness(grc: Gearbox, stiffness: dict) -> None:
    """Otherwise k' times the deflection would hold the free rotation."""
    assembly = assemble(grc, Choice("rigid"), stiffness)
    load = grc.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked, assembly.mean_meshes)
    rolling = np.zeros(assembly.size)
    for name, value in grc.train.rolling_speeds("carrier", 1.0).items():
        rolling[assembly.spin[name]] = value
    stiff = linearise(assembly, q).total_stiffness
    assert np.abs(stiff @ rolling).max() < 1e-9 * np.abs(stiff).max()


def test_modes_show_themselves_in_one_line_and_as_a_table(grc: Gearbox, stiffness: dict) -> None:
    modes = eigenmodes(grc, Choice("bushing"), stiffness)
    assert repr(modes).startswith("<Modes of 'GRC") and "bushing" in repr(modes)
    assert f"{len(modes.frequency)} modes up to {modes.frequency[-1]:.5g} Hz" in repr(modes)
    table = modes._repr_html_()
    assert table.count("<tr>") == 12
    assert table.count("<img ") == static_state(modes.assembly)._repr_html_().count("<img ") == 1
    assert f"2: {modes.frequency[1]:.1f} Hz" in table and modes.names[1] in table
    linear = linearise(modes.assembly, np.zeros(modes.assembly.size))
    assert f"{modes.assembly.size} coordinates" in repr(linear)
    assert max(len(repr(shown)) for shown in (modes, linear)) < 200
