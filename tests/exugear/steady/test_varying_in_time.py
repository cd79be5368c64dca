"""The method `nonlinear` where stiffness varies with the carrier's angle, against runs in time."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.steady.balance.response import dissipated_and_given, signals
from exugear.system.build import assemble

from ...optional_libraries import needs_meshio
from ..cases import gear_trains
from ..cases.assembled import assembled
from ..cases.ring import drum_content
from ..cases.steady_runs import apart, apart_over_time, solver_of
from ..cases.table import surface_of
from .test_unlike_planets import OTHER_EXCITATIONS, TRAINS, on_unlike_bearings, train

RANGE = (45.0, 180.0)


def with_tables(content):
    """Train with tables of stated shape in all meshes, so that teeth may part."""
    gearbox = Gearbox.from_dict(on_unlike_bearings(content))
    tables = {name: surface_of(gearbox, name, stiffness=4e8) for name in gearbox.pairs}
    return assemble(gearbox, Choice("bushing", mesh_model="table"), tables)


@pytest.mark.validation
@pytest.mark.parametrize("kind", TRAINS)
def test_trains_with_unlike_planets_stay_on_their_steady_state(kind):
    """Constant speed, RK4 at 1/60 kHz, the last 0.8 of 1.6 s; bearings of sun and carrier are stiffer along y.

    Stepped planets are 4e-3 off, with ten harmonics as with six.
    """
    content, speed = TRAINS[kind]
    assembly = train(on_unlike_bearings(content))
    solver = solver_of(assembly, tuple(sorted((0.5 * speed, 2.0 * speed))), "nonlinear", 6)
    most = 5e-3 if kind.startswith("stepped") else 1e-3
    assert apart(solver, speed, 1.6, 1.0 / 60e3, 0.8, assembly)[1] < most


@pytest.mark.validation
@pytest.mark.parametrize("more", OTHER_EXCITATIONS.values(), ids=OTHER_EXCITATIONS)
def test_other_excitations_stay_on_the_steady_state_of_two_planets(more):
    assembly = train(on_unlike_bearings(gear_trains.planetary("ring", 2)), **more)
    solver = solver_of(assembly, RANGE, "nonlinear", 6)
    assert apart_over_time(solver, 90.0, 1.6, 1.0 / 60e3, 0.8, assembly) < 2e-3


@pytest.mark.validation
@pytest.mark.parametrize("planets", [2, 3])
def test_both_methods_agree_on_tangents(planets):
    """With a constant stiffness over the load: what is left is of second order in the vibration."""
    content = gear_trains.planetary("ring", 2) if planets == 2 else gear_trains.unevenly_spaced()
    assembly = train(on_unlike_bearings(content))
    found = []
    for method in ("parametric", "nonlinear"):
        solver = solver_of(assembly, RANGE, method, 3)
        response = solver.response(90.0)
        taken, given = dissipated_and_given(solver.model, response)
        assert taken == pytest.approx(given, rel=1e-6)
        found.append(signals(solver.model, response)[1:, 0])
    assert np.linalg.norm(found[1] - found[0]) < 1e-3 * np.linalg.norm(found[0])


@pytest.mark.validation
def test_tables_of_two_planets_stay_on_their_steady_state():
    assembly = with_tables(gear_trains.planetary("ring", 2))
    solver = solver_of(assembly, RANGE, "nonlinear", None)
    assert apart(solver, 90.0, 1.6, 1.0 / 60e3, 0.8, assembly)[1] < 1e-4


@needs_meshio
@pytest.mark.validation
@pytest.mark.parametrize(("variation", "speed", "least"), [(1.0, 8.0, 0.0), (12.0, 17.5, 0.1)])
def test_tables_at_a_flexible_ring_gear_stay_on_their_steady_state(grc, tmp_path, variation, speed, least):
    """Planetary stage of the GRC with flexible ring gear and carrier; RK4 at 1/200 kHz, the last 0.6 of 0.9 s.

    With twelve times the variation of deflection over the cycle, teeth of one mesh are apart for 15 % of the time.
    """
    gearbox = Gearbox.from_dict(drum_content(grc, tmp_path), str(tmp_path / "drum.toml"))
    damping = {"damping.mesh_time_s": 2e-5, "damping.bearing_time_s": 2e-5}
    tables = {name: surface_of(gearbox, name, variation=variation) for name in gearbox.pairs}
    assembly = assembled(gearbox.varied(damping), Choice("flexible", mesh_model="table"), tables)
    solver = solver_of(assembly, (4.0, 22.0), "nonlinear", None)
    assert solver.response(speed).apart.max() >= least
    assert apart(solver, speed, 0.9, 5e-6, 0.6, assembly)[1] < 1e-3
