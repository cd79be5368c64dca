"""Trains of every kind against what tooth numbers, levers and springs say by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import summarise_loads
from exugear.gearbox.reading import GearboxFileError
from exugear.results.run_file import load_run
from exugear.system.build import assemble
from exugear.system.modes import modes_of
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.transient.runup import simulate

from ...cases.gear_trains import (
    KINDS,
    SPEED_RPM,
    STIFFNESS,
    TORQUE,
    differential,
    meshing_planets,
    pair,
    planetary,
    rotor,
)

MEAN = 4e8
"""Mean stiffness of every mesh, N/m."""
BASE_RADIUS = 1.5e-3 * math.cos(math.radians(20.0))
"""Base radius of a spur wheel per tooth, m."""
RATIOS = {
    "single pair": -24 / 36,
    "larger wheel as pinion": -24 / 36,
    "reversed torque": -24 / 36,
    "wide face": -24 / 36,
    "internal pair": 24 / 72,
    "two stages": 21 / 42 * 24 / 60,
    "idler": 24 / 36,
    "power split": 24 / 48 * 24 / 96,
    "planetary, ring held": 24 / (24 + 72),
    "planetary, sun held": 72 / (24 + 72),
    "planetary, carrier held": -24 / 72,
    "planetary, reversed torque": 24 / (24 + 72),
    "one planet": 24 / (24 + 72),
    "two planets": 24 / (24 + 72),
    "planets, unevenly spaced": 24 / (24 + 72),
    "differential": 24 / (24 + 72),  # while the ring stands
    "stepped planets": 1.0 / (1.0 + 42 * 90 / (24 * 24)),
    "meshing planets": (24 / 72 + 24 / 30) / (1.0 + 24 / 30),
    "wind turbine": -4.0 * 4.0 * 60 / 24,
    "rotor without gears": 1.0,
}
"""Speed of the output over that of the input: Willis (1841) and products of tooth numbers."""


def gearbox_of(kind: str) -> Gearbox:
    return Gearbox.from_dict(KINDS[kind](), kind)


def constant(gearbox: Gearbox) -> dict[str, np.ndarray]:
    return dict(mesh_stiffness(gearbox, "constant", "nowhere"))


@pytest.mark.parametrize("kind", KINDS)
def test_speeds_are_those_of_tooth_numbers(kind: str) -> None:
    assert gearbox_of(kind).train.ratio == pytest.approx(RATIOS[kind], rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_torques_of_a_steady_load_do_no_work_and_leave_the_speed_as_it_is(kind: str) -> None:
    gearbox = gearbox_of(kind)
    case = gearbox.load_cases["steady"]
    speeds = gearbox.start_speeds(case)
    powers = [torque * speeds[body] for body, torque in case.torques.items()]
    assert sum(powers) == pytest.approx(0.0, abs=1e-9 * max(map(abs, powers)))
    loads = summarise_loads(gearbox, case)
    assert loads.net_torque == 0.0 and loads.end_speed == pytest.approx(loads.start_speed, rel=1e-9)


def test_both_inputs_of_a_differential_add_up_by_willis() -> None:
    gearbox = Gearbox.from_dict(differential())
    speeds = gearbox.start_speeds(gearbox.load_cases["steady"])
    rpm = math.pi / 30.0
    sun, ring, carrier = (speeds[name] / rpm for name in ("sun", "ring", "carrier"))
    assert (sun, ring) == pytest.approx((SPEED_RPM, -0.5 * SPEED_RPM))
    assert (sun - carrier) / (ring - carrier) == pytest.approx(-72 / 24)
    assert speeds["planet_1"] / rpm - carrier == pytest.approx(-(sun - carrier))


def test_speeds_that_contradict_each_other_are_refused() -> None:
    content = planetary("ring")
    content["load_cases"]["steady"]["start_speeds_rpm"] = {"carrier": 1.0}
    with pytest.raises(GearboxFileError, match=r"contradict.*load_cases.steady.start_speeds_rpm"):
        Gearbox.from_dict(content)


@pytest.mark.parametrize(
    ("kind", "mesh", "force"),
    [
        ("planetary, ring held", "sun_planet_1", TORQUE / (3 * 24 * BASE_RADIUS)),
        ("planetary, carrier held", "planet_ring_2", -TORQUE / (3 * 24 * BASE_RADIUS)),
        ("planetary, reversed torque", "sun_planet_1", -TORQUE / (3 * 24 * BASE_RADIUS)),
        ("one planet", "sun_planet_1", TORQUE / (24 * BASE_RADIUS)),
        ("two planets", "sun_planet_2", TORQUE / (2 * 24 * BASE_RADIUS)),
        ("idler", "idler_last", -TORQUE / (24 * BASE_RADIUS)),
        ("power split", "out_left", TORQUE * 48 / 24 / (2 * 24 * BASE_RADIUS)),
        ("stepped planets", "small_ring_1", -TORQUE * 42 / 24 / (3 * 24 * BASE_RADIUS)),
        ("meshing planets", "short_long_1", -TORQUE / (3 * 24 * BASE_RADIUS)),
    ],
)
def test_mesh_forces_at_rest_are_torques_over_base_radii(kind: str, mesh: str, force: float) -> None:
    forces = gearbox_of(kind).train.static_mesh_forces()
    assert abs(forces[mesh]) == pytest.approx(abs(force), rel=1e-9)
    if kind != "power split":
        assert math.copysign(1.0, forces[mesh]) == math.copysign(1.0, force)


def test_either_wheel_may_be_called_the_pinion() -> None:
    usual, swapped = (Gearbox.from_dict(pair(swapped=value)) for value in (False, True))
    assert usual.meshes == swapped.meshes
    assert usual.train.static_mesh_forces() == swapped.train.static_mesh_forces()


# -- runs -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize(
    "kind", ["planetary, carrier held", "differential", "meshing planets", "power split", "rotor without gears"]
)
def test_a_run_in_balance_keeps_its_speed_and_its_static_mesh_forces(kind: str, variant: str, tmp_path) -> None:
    """With constant stiffness nothing excites the train: what it starts with lasts, up to single precision."""
    gearbox = gearbox_of(kind)
    run = simulate(gearbox, Choice(variant, "constant"), constant(gearbox), tmp_path)
    assert run.complete and not run.reasons
    data = load_run(run.path)
    assert data["input_speed"].to_numpy() == pytest.approx(SPEED_RPM * math.pi / 30.0, rel=1e-6)
    # A second input turns by 1.6 rad, of which nothing is left in the transmission error.
    assert np.ptp(data["overall_dte_angle"].to_numpy()) < 1e-7
    expected = np.abs(list(gearbox.train.static_mesh_forces().values()))
    forces = data["mesh_force"].to_numpy()
    assert (np.ptp(forces, axis=0) < 1e-3 * np.max(expected, initial=1.0)).all()
    found = forces.mean(axis=0)
    if kind == "power split":  # bearings share the torque unevenly between both ways; together they carry it
        expected, found = expected.reshape(2, 2).sum(axis=0), found.reshape(2, 2).sum(axis=0)
    # Bearings let planets give way outward by 0.8 kg r w^2 over their stiffness, and centre distances by as much.
    assert found == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    "kind", ["differential", pytest.param("planetary, carrier held", marks=pytest.mark.validation)]
)
def test_exudyn_runs_held_carriers_and_two_inputs_as_the_compiled_solver_does(kind: str, tmp_path) -> None:
    """Both integrate the same equations with RK4, in other steps: 5e-8 apart was found, over 4 ms."""
    gearbox, choice = gearbox_of(kind), Choice("bushing")
    stiffness = mesh_stiffness(gearbox, "line_of_action", tmp_path)
    runs = [
        load_run(simulate(gearbox, choice, stiffness, tmp_path / solver, solver=solver, duration=4e-3).path)
        for solver in ("compiled", "exudyn")
    ]
    angles = [run["overall_dte_angle"].to_numpy() for run in runs]
    assert np.abs(angles[0] - angles[1]).max() < 1e-5 * np.abs(angles[0]).max()


def test_two_inputs_accelerate_as_their_inertias_say(tmp_path) -> None:
    """Lagrange's equations of sun and ring with Willis' carrier and planets, by hand; the run follows them."""
    content = differential()
    content["load_cases"]["steady"] |= {"torques_N_m": {"sun": 5.0, "ring": 30.0, "carrier": 0.0}}
    gearbox = Gearbox.from_dict(content)
    # Rows: sun, ring, carrier, planets (3); columns: share of the sun's and of the ring's speed.
    shares = np.array([[1.0, 0.0], [0.0, 1.0], [0.25, 0.75], [-0.5, 1.5]])
    orbit = 3 * 0.8 * 0.072**2
    inertias = np.array([2e-3, 2e-3, 2e-2 + orbit, 3 * 5e-4])
    rates = np.linalg.solve(shares.T @ (inertias[:, None] * shares), [5.0, 30.0])
    loads = summarise_loads(gearbox, gearbox.load_cases["steady"])
    start = SPEED_RPM * math.pi / 30.0
    assert loads.end_speed == pytest.approx(start + 0.05 * rates[0], rel=1e-9)
    run = simulate(gearbox, Choice("rigid", "constant"), constant(gearbox), tmp_path)
    data = load_run(run.path)
    slope = np.polyfit(data["time"].to_numpy(), data["input_speed"].to_numpy(), 1)[0]
    assert slope == pytest.approx(rates[0], rel=1e-6)


# -- modes ------------------------------------------------------------------------------------------------------------


def frequencies(gearbox: Gearbox, variant: str) -> np.ndarray:
    return modes_of(assemble(gearbox, Choice(variant, "constant"), constant(gearbox)), preload=False).frequency


def test_torsion_of_a_pair_and_of_a_rotor_is_that_of_two_masses_on_a_spring() -> None:
    gearbox = Gearbox.from_dict(pair(helix_deg=0.0))
    small, large = 24 * BASE_RADIUS, 36 * BASE_RADIUS
    expected = math.sqrt(MEAN * (small**2 + large**2) / 2e-3) / (2 * math.pi)
    assert frequencies(gearbox, "rigid").max() == pytest.approx(expected, rel=1e-9)
    shaft = math.sqrt(1e4 * (1 / 2e-3 + 1 / 8e-3)) / (2 * math.pi)
    assert frequencies(Gearbox.from_dict(rotor()), "rigid").max() == pytest.approx(shaft, rel=1e-9)


@pytest.mark.parametrize(("held", "count"), [("ring", 3), ("ring", 2), ("sun", 3), ("carrier", 3)])
def test_torsional_modes_of_planetary_sets_are_those_of_kahraman(held: str, count: int) -> None:
    """Kahraman (1994), purely torsional: n - 1 modes of the planets alone, the rest from a matrix of four masses."""
    found = frequencies(Gearbox.from_dict(planetary(held, count)), "rigid")
    wheel, ring = 24 * BASE_RADIUS, 72 * BASE_RADIUS
    alone = math.sqrt(2 * MEAN * wheel**2 / 5e-4) / (2 * math.pi)
    assert np.isclose(found, alone, rtol=1e-9).sum() >= count - 1
    # Sun, ring, carrier and all planets together: how the two meshes of a planet close per unit angle of each.
    closing = np.array([[wheel, 0.0, -2 * wheel, wheel], [0.0, -ring, ring - wheel, wheel]])
    inertia = np.diag([2e-3, 2e-3, 2e-2 + count * 0.8 * 0.072**2, count * 5e-4])
    free = [number for number, name in enumerate(("sun", "ring", "carrier", "planets")) if name != held]
    stiffness = (count * MEAN * closing.T @ closing)[np.ix_(free, free)]
    squares = np.linalg.eigvals(np.linalg.solve(inertia[np.ix_(free, free)], stiffness)).real
    together = np.sqrt(np.sort(squares)[1:]) / (2 * math.pi)
    assert sorted([*together, *[alone] * (count - 1)]) == pytest.approx(sorted(found[found > 1.0]), rel=1e-6)


def test_a_planetary_set_on_bearings_has_the_modes_of_lin_and_parker() -> None:
    """Lin and Parker (1999), J. Vib. Acoust. 121: planar lumped model, here with four planets and the ring turning.

    Energy of springs written out in their coordinates: radial and tangential planets, translations along the base
    circles. Their model has no tilt and no axial motion, which decouple in a spur set whose planes coincide.
    """
    content = planetary("carrier", 4)
    content["bodies"]["carrier"] = {
        "axis_position_mm": [0.0, 0.0],
        "inertia": {
            "discs": {"mass_kg": 5.0, "axial_kg_m2": 2e-2, "transverse_kg_m2": 2e-2, "centre_of_mass_z_mm": 0.0}
        },
    }
    for table in ("joints", "bearings"):
        content[table]["carrier"] = {**content[table]["ring"], "body": "carrier"}
    content["static_load"]["locked"] = ["ring", "carrier"]
    found = frequencies(Gearbox.from_dict(content), "bushing")
    expected = _lin_and_parker(planets=4)
    gaps = [np.abs(found - frequency).min() / frequency for frequency in expected if frequency > 1.0]
    assert len(gaps) == 3 * 3 + 3 * 4 - 2  # two ways to roll
    assert max(gaps) < 1e-9


def _lin_and_parker(planets: int) -> np.ndarray:
    """Eigenfrequencies, Hz: carrier, ring and sun (x, y, u), then each planet (radial, tangential, u)."""
    pressure, support = math.radians(20.0), 2e8
    size = 9 + 3 * planets
    stiffness, mass = np.zeros((size, size)), np.zeros(size)
    radii = {"carrier": 0.072, "ring": 72 * BASE_RADIUS, "sun": 24 * BASE_RADIUS}
    for start, (name, body_mass, inertia) in zip(
        (0, 3, 6), (("carrier", 5.0, 2e-2), ("ring", 2.0, 2e-3), ("sun", 2.0, 2e-3)), strict=True
    ):
        mass[start : start + 3] = body_mass, body_mass, inertia / radii[name] ** 2
        held = 2 * support if name == "sun" else support  # the sun's shaft has a bearing on either side
        stiffness[[start, start + 1], [start, start + 1]] += held
    for number in range(planets):
        at, psi = 9 + 3 * number, 2.0 * math.pi * number / planets
        mass[at : at + 3] = 0.8, 0.8, 5e-4 / (24 * BASE_RADIUS) ** 2
        rows = np.zeros((4, size))
        sun, ring = psi - pressure, psi + pressure
        rows[0, [6, 7, 8, at, at + 1, at + 2]] = (
            *(-math.sin(sun), math.cos(sun), 1.0),
            *(-math.sin(pressure), -math.cos(pressure), 1.0),
        )
        rows[1, [3, 4, 5, at, at + 1, at + 2]] = (
            *(-math.sin(ring), math.cos(ring), 1.0),
            *(math.sin(pressure), -math.cos(pressure), -1.0),
        )
        rows[2, [0, 1, at]] = math.cos(psi), math.sin(psi), -1.0
        rows[3, [0, 1, 2, at + 1]] = -math.sin(psi), math.cos(psi), 1.0, -1.0
        springs = np.array([MEAN, MEAN, support, support])
        stiffness += rows.T @ (springs[:, None] * rows)
    squares = np.linalg.eigvals(stiffness / mass[:, None]).real
    return np.sqrt(np.maximum(np.sort(squares), 0.0)) / (2 * math.pi)


# -- stated stiffness -------------------------------------------------------------------------------------------------


def test_waves_of_a_stated_stiffness_and_their_values_are_one_law() -> None:
    values = Gearbox.from_dict(pair()).stated_stiffness["helical"]
    angle = 2.0 * np.pi * np.arange(len(values)) / len(values)
    first, second = STIFFNESS["cosine_N_per_m"]
    assert values == pytest.approx(MEAN + first * np.cos(angle) + second * np.cos(2 * angle), rel=1e-12)
    content = pair()
    content["pairs"]["helical"]["stiffness"] = {"over_cycle_N_per_m": list(values)}
    assert Gearbox.from_dict(content).stated_stiffness["helical"] == values


def test_the_mean_of_a_stated_stiffness_is_that_of_the_law_constant() -> None:
    gearbox = Gearbox.from_dict(pair())
    (element,) = assemble(gearbox, Choice("bushing", "constant"), constant(gearbox)).elements
    assert element.stiffness == pytest.approx([MEAN], rel=1e-12)


def test_a_law_that_needs_a_table_refuses_a_stated_stiffness() -> None:
    with pytest.raises(
        MeshError, match="pairs.helical.stiffness: is specified, so the pair has no table; remove it to compute one, or"
    ):
        mesh_stiffness(Gearbox.from_dict(pair()), "table", "nowhere")


@pytest.mark.parametrize(
    ("keys", "error"),
    [
        ({"mean_N_per_m": 4e8, "cosine_N_per_m": [5e8]}, "falls to -1e\\+08 N/m"),
        (
            {"mean_N_per_m": 4e8, "over_cycle_N_per_m": [4e8, 3e8]},
            "set mean_N_per_m, with or without harmonics, or over_cycle_N_per_m",
        ),
        ({"over_cycle_N_per_m": [4e8, 3e8], "sine_N_per_m": [1e7]}, "cannot be combined with sine_N_per_m"),
        ({}, "set mean_N_per_m, with or without harmonics, or over_cycle_N_per_m"),
    ],
)
def test_a_stated_stiffness_is_one_positive_thing(keys: dict[str, object], error: str) -> None:
    content = pair()
    content["pairs"]["helical"]["stiffness"] = keys
    with pytest.raises(GearboxFileError, match=error):
        Gearbox.from_dict(content)


def test_a_pair_has_a_table_or_a_stated_stiffness() -> None:
    content = pair()
    content["pairs"]["helical"]["table"] = True
    with pytest.raises(
        GearboxFileError, match="table = true cannot be combined with a specified stiffness; remove one of them"
    ):
        Gearbox.from_dict(content)
    assert not Gearbox.from_dict(pair()).pairs["helical"].table


def test_planets_that_mesh_are_told_when_they_do_not_fit() -> None:
    from exugear.system.gearbox_checks import check_parts

    content = meshing_planets()
    content["bodies"]["short"]["planet_angles_deg"] = [angle + 2.0 for angle in (0.0, 120.0, 240.0)]
    with pytest.raises(GearboxFileError, match=r"pairs.short_long.centre_distance_mm|do not fit"):
        check_parts(Gearbox.from_dict(content))
