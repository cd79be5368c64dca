"""A flexible ring gear that is thinner at two places, under planets out of phase and an even number of planets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.balance import response as steady_balance
from exugear.steady.balance.response import dissipated_and_given, signals
from exugear.steady.mean_system.mean_system import mean_system, unsuitable
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_response import response_of
from exugear.system.build import elastic_arrays

from ...optional_libraries import needs_meshio
from ..cases.assembled import assembled
from ..cases.ring import ring_content, two_stage_content, write_rim
from ..cases.steady_runs import FOUR, planets_apart_over_time, solver_of
from .test_flexible_planetary_stage import by_order, rows_at

pytestmark = needs_meshio

SPEED = 8.0
RANGE = (7.0, 9.0)
STAGES = {
    "three out of phase": {
        "meshes.sun_planet.phase": [0.0, 1.0 / 3.0, 2.0 / 3.0],
        "meshes.ring_planet.phase": [1.0, 1.0 / 3.0, 2.0 / 3.0],
    },
    "four out of phase": FOUR,
    "four in phase": FOUR | {"meshes.sun_planet.phase": [0.0] * 4, "meshes.ring_planet.phase": [1.0] * 4},
}
"""Name, and the keys of the gearbox file. Stated phases change nothing else, as in `phasing.study.toml`."""
STATED = {"radial_N_per_m": 2e9, "axial_N_per_m": 1e9, "tilt_N_m_per_rad": 1e7}


def stage(grc, folder, name, stiffer=1.0, bearings=None):
    """Gearbox with a ring that is up to 10 mm thinner at two opposite places."""
    content = ring_content(grc, folder)
    write_rim(folder / "rim.vtu", oval=0.01)
    for mount in content["mounts"].values():
        mount["stiffness"] = {axis: stiffer * value for axis, value in mount["stiffness"].items()}
    for bearing in content["bearings"].values() if bearings else ():
        bearing.pop("catalogue", None)
        bearing["stiffness"] = bearings
    return Gearbox.from_dict(content, str(folder / "stage.toml")).varied(STAGES[name])


@pytest.fixture(scope="module", params=list(STAGES))
def solver(request, grc, stiffness, tmp_path_factory):
    gearbox = stage(grc, tmp_path_factory.mktemp("stage"), request.param)
    assert not unsuitable(assembled(gearbox, Choice("bushing"), stiffness), ("housing",))
    return solver_of(assembled(gearbox, Choice("flexible"), stiffness), RANGE, "parametric", 9)


def test_waves_of_the_meshes_are_exact_between_the_places_they_come_from(solver):
    waves = solver.model.waves
    gradients = waves.gradients(waves.assembly.meshes.deflection, SPEED)
    for psi in (0.1, 0.77, 2.9):
        turned = rows_at(waves, psi)
        for meshes, planets in waves.groups:
            own = [n for n, wave in enumerate(waves.waves) if wave.first == meshes[0]]
            expected = turned[list(meshes)]
            shapes = planets.values(np.array(planets.ratio * psi), len(own))
            np.testing.assert_allclose(shapes @ gradients[own], expected, atol=2e-3 * np.abs(expected).max())


def test_damping_takes_the_power_that_the_meshes_of_all_planets_give(solver):
    taken, given = dissipated_and_given(solver.model, solver.response(SPEED))
    assert taken > 0.0
    assert given == pytest.approx(taken, rel=1e-4)


@pytest.mark.validation
@pytest.mark.parametrize("speed", [7.3, SPEED])
def test_a_run_that_starts_on_the_steady_state_of_all_planets_stays_there(solver, speed):
    """RK4 at 1/200 kHz. Out of phase the planets leave 0.3 um of the overall transmission error; in phase 2 to 8 um.

    At 7.3 rad/s, order 285 of four planets in phase, twelve below a mesh order, is in resonance.
    """
    error, overall, forces = planets_apart_over_time(solver, speed, 0.8, 5e-6, 0.6)
    assert forces < 3e-3
    assert error < max(2e-9, 3e-3 * overall)


@pytest.mark.validation
def test_a_run_with_a_second_stage_behind_four_planets_stays_on_its_steady_state(grc, stiffness, tmp_path):
    """RK4 at 1/200 kHz. The second stage has a rigid ring and three planets in phase; 1.4 um overall."""
    content = two_stage_content(grc, tmp_path)
    write_rim(tmp_path / "rim.vtu", oval=0.01)
    gearbox = Gearbox.from_dict(content, str(tmp_path / "stages.toml")).varied(FOUR)
    both = stiffness | {f"{name}_2": stiffness[name] for name in ("sun_planet", "ring_planet")}
    solver = solver_of(assembled(gearbox, Choice("flexible"), both), RANGE, "parametric", 10)
    error, _, forces = planets_apart_over_time(solver, 7.4, 0.8, 5e-6, 0.5)
    assert forces < 3e-3
    assert error < 6e-9


@pytest.mark.validation
@pytest.mark.parametrize("name", list(STAGES))
def test_a_ring_of_vanishing_compliance_gives_the_response_of_a_rigid_one(grc, stiffness, tmp_path, monkeypatch, name):
    """Body and mounts 250 to 2000 times as stiff, extrapolated by a cubic polynomial in the compliance.

    Bearings are stated: those of catalogue bearings depend on how the load is shared. The positions in the mesh cycle
    are those of the mean speed, as they are with a rigid ring.
    """
    monkeypatch.setattr(steady_balance, "POSITIONS_REPEATED", 0)
    monkeypatch.setattr(steady_balance, "PASSING_TOLERANCE", 1e-10)
    stages = [lines_of(grc, stiffness, tmp_path, name, stiffer) for stiffer in (2000.0, 1000.0, 500.0, 250.0, None)]
    for quantity, known in stages[-1].items():
        orders = sorted({*known, *stages[0][quantity]})
        *found, rigid = (np.array([own[quantity].get(order, 0.0) for order in orders]) for own in stages)
        limit = (64.0 * found[0] - 56.0 * found[1] + 14.0 * found[2] - found[3]) / 21.0
        assert np.linalg.norm(limit - rigid) < 1e-6 * np.linalg.norm(rigid)


def lines_of(grc, stiffness, folder, name, stiffer):
    """Lines by order of overall transmission error and a force, with body and mounts so many times as stiff, or rigid.

    The force is that of a bearing of the sun shaft, which planets out of phase excite; of the suns in phase.
    """
    gearbox = stage(grc, folder, name, stiffer or 1.0, STATED)
    if stiffer is None:
        rigid = gearbox.varied({"bodies.housing.flexibility": "none"})
        assembly = assembled(rigid, Choice("bushing"), stiffness)
    else:
        assembly = assembled(gearbox, Choice("flexible"), stiffness)
        (body,) = assembly.elastic_bodies.values()
        bodies = {"housing": replace(body, reduced=replace(body.reduced, stiffness=stiffer * body.reduced.stiffness))}
        arrays = elastic_arrays(bodies, assembly.size, gearbox.case.damping.body_time_s)
        assembly = replace(assembly, elastic_bodies=bodies, elastic=arrays)
    solver = solver_of(assembly, RANGE, "parametric", 4, 2)
    lines = signals(solver.model, solver.response(SPEED))[1:]
    force = "support_force lss_a x" if "out of phase" in name else "mesh_force sun_planet"
    names = [own.name for own in solver.model.signal_names]
    return {quantity: by_order(solver.model, lines[:, names.index(quantity)]) for quantity in ("overall_dte", force)}


@pytest.mark.validation
def test_a_computation_can_be_stopped_while_the_orders_beside_others_are_chosen(grc, stiffness, tmp_path):
    """Every step of the preparation is reported; an exception at one of them, as of Ctrl-C, ends the computation."""
    assembly = assembled(stage(grc, tmp_path, "four out of phase"), Choice("flexible"), stiffness)
    seen = []

    def stop(step, done, total):
        seen.append((step, done, total))
        if step.startswith("choice"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        response_of(assembly, SteadySettings(SpeedRange(*RANGE, 2), harmonics=2, combinations=1), prepared=stop)
    total = 3 + len(mean_system(assembly, np.array(RANGE)).frame.places_of("carrier")) - 1
    assert seen[:-1] == [("linearisation", done, total) for done in range(1, total + 1)]
    assert seen[-1][0].startswith("choice of ")
    assert seen[-1][1] <= seen[-1][2]
