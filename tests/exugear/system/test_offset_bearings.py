"""Linear catalogue bearings pass the point that their rows are in under the static load: F0 + K (u - u0).

Static states have the rows of all catalogue bearings, whatever their law in motion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.static_balance import is_linear
from exugear.system.bearings.stiffness import (
    SupportLaw,
    law_in_words,
    law_through_point,
    load_stands_still,
    planet_families,
    planet_supports,
)
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.modes import modes_of
from exugear.system.sensitivity import planet_bearings, scaled_bearings
from exugear.system.statics import accelerating_start, locked_equilibrium, static_state
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem
from exugear.transient.exudyn_model.system import ExudynSystem

from ..cases.bearing import NON_LINEAR, STIFFNESS, bearing_gearbox

BUSHING = Choice("bushing")


def on_bearings(gearbox: Gearbox, law: str = "constant") -> Assembly:
    return assemble(gearbox, Choice("bushing", law), {name: np.array([k]) for name, k in STIFFNESS.items()})


def rolling(grc: Gearbox) -> Gearbox:
    """The GRC with the rows of all bearings that take their stiffness from the static load, in motion as well."""
    names = [
        name
        for name, bearing in grc.case.bearings.items()
        if bearing.catalogue is not None and bearing.catalogue.radial_load_kN is None
    ]
    return grc.varied({f"bearings.{name}.model": "iso16281" for name in names})


@pytest.fixture(scope="module")
def assembly(grc, stiffness) -> Assembly:
    return assemble(grc, BUSHING, stiffness)


def loaded(assembly: Assembly, share: float = 1.0) -> np.ndarray:
    """Coordinates under a share of the static load, by the laws of motion."""
    load = assembly.gearbox.case.static_load
    torques = {name: share * torque for name, torque in load.torques_N_m.items()}
    return locked_equilibrium(assembly, torques, load.locked, assembly.mean_meshes)


def misalignment(assembly: Assembly, q: np.ndarray) -> np.ndarray:
    return assembly.gear_positions(q)[:, 1]


def test_static_states_have_the_rows_whatever_the_law_in_motion(grc, stiffness, assembly):
    linear, rows = static_state(assembly), static_state(assemble(rolling(grc), BUSHING, stiffness))
    assert linear.misalignment == pytest.approx(rows.misalignment, rel=1e-6, abs=1e-9)
    assert linear.assembly.bearing_loads(linear.q, 0 * linear.q) == pytest.approx(
        rows.assembly.bearing_loads(rows.q, 0 * rows.q), rel=1e-6, abs=1.0
    )
    assert not assembly.has_rows
    assert static_state(assembly).assembly.has_rows


def test_linear_bearings_stand_as_their_rows_do(assembly):
    """Misalignments that the tangent through the origin leaves 19 to 40 % too small."""
    expected = static_state(assembly).misalignment
    assert misalignment(assembly, loaded(assembly)) == pytest.approx(expected, rel=1e-2)
    through_origin = misalignment(assembly.unloaded, loaded(assembly.unloaded))
    assert np.all(np.abs(through_origin) < 0.9 * np.abs(expected))


@pytest.mark.parametrize("share", [0.5, 1.5])
def test_at_other_loads_displacements_are_those_of_the_rows_within_eight_per_cent(assembly, share):
    """A row without clearance yields with the power 0.7 of its load: at half of it 6 % more than by the tangent."""
    rows = assembly.at_rest
    expected = rows.support_strains(loaded(rows, share))[:, :2]
    found = assembly.support_strains(loaded(assembly, share))[:, :2]
    size = np.linalg.norm(expected, axis=1)
    counted = size > 0.1 * size.max()
    assert counted.sum() > 5
    assert (np.linalg.norm(found - expected, axis=1) / size)[counted].max() < 0.08


def test_modes_are_those_of_the_tangent_through_the_origin(assembly):
    """The stiffness is the same; what the loads do by their levers is of second order."""
    known = modes_of(replace(assembly, connectors=assembly.unloaded.connectors))
    found = modes_of(assembly)
    assert found.frequency[1:] == pytest.approx(known.frequency[1:], rel=1e-3)


@pytest.mark.parametrize("solver", [CompiledSystem, ExudynSystem])
def test_a_run_from_rest_stays_at_rest(tmp_path, solver):
    """Balanced torques on a train that stands: what the start leaves is round-off of its deflections."""
    gearbox = bearing_gearbox(tmp_path)
    assembly = on_bearings(gearbox)
    torques = {"shaft_1": 100.0, "shaft_2": -100.0 / gearbox.train.ratio}
    start = accelerating_start(assembly, torques, 0.0)
    assert np.abs(start.q).max() > 1e-6
    assert max(map(abs, start.rates.values())) < 1e-3  # moments of bearings on tilted shafts have a little along them
    states = np.empty((200, assembly.size))
    if solver is CompiledSystem:
        assert CompiledSystem(assembly, start.q, start.v, LoadTable(torques), 2e-6).advance(
            0, states, np.empty_like(states)
        ) == len(states)
    else:
        kept = []

        def keep(t: float, q: np.ndarray, v: np.ndarray) -> bool:
            kept.append(q.copy())
            return True

        ExudynSystem(assembly, start.q, start.v, LoadTable(torques)).run(0.0, 200, 2e-6, keep)
        states = np.array(kept)
    assert np.abs(states - start.q).max() < 1e-7 * np.abs(start.q).max()


def test_a_factor_on_planets_bearings_turns_their_law_about_its_point(grc, assembly):
    """Half or twice as stiff, they still stand where the static load has them, but for what planets share unevenly."""
    numbers, q = planet_bearings(grc, assembly), loaded(assembly)
    for factor in (0.5, 2.0):
        scaled = scaled_bearings(assembly, numbers, factor)
        assert np.abs(loaded(scaled) - q).max() < 3e-2 * np.abs(q).max()
        own = list(numbers)
        assert scaled.connectors.stiffness[own] == pytest.approx(factor * assembly.connectors.stiffness[own])


@pytest.mark.parametrize("factor", [0.2, 0.6])
def test_a_housing_factor_moves_the_point_along(grc, stiffness, factor):
    varied = assemble(grc.varied({"housing.factor": factor}), BUSHING, stiffness)
    expected = static_state(varied).misalignment
    assert misalignment(varied, loaded(varied)) == pytest.approx(expected, rel=1e-2)


def families(assembly: Assembly) -> list:
    (planets,) = planet_families(assembly.bodies)
    angles = np.array([planet.orbit_angle for planet in planets])
    return planet_supports(assembly.supports, [planet.name for planet in planets], angles)


def along_radii(vectors: np.ndarray, angles: np.ndarray) -> np.ndarray:
    c, s = np.cos(angles), np.sin(angles)
    out = vectors.copy()
    for first in (0, 3):
        x, y = vectors[:, first], vectors[:, first + 1]
        out[:, first], out[:, first + 1] = c * x + s * y, c * y - s * x
    return out


def test_equal_planets_stand_on_equal_bearings(assembly):
    """Stiffness, damping and offset along radius and tangent; no mesh force and hardly a misalignment changes."""
    arrays = assembly.connectors
    for numbers, angles in families(assembly):
        for values in (arrays.offset, arrays.point_strain, arrays.point_load):
            turned = along_radii(values[numbers], angles)
            assert np.abs(turned - turned[0]).max() < 1e-9 * np.abs(turned).max()
        for matrices in (arrays.stiffness, arrays.damping):
            ways = [
                along_radii(along_radii(m, np.full(6, a)).T, np.full(6, a))
                for m, a in zip(matrices[numbers], angles, strict=True)
            ]
            assert np.abs(np.array(ways) - ways[0]).max() < 1e-9 * np.abs(ways[0]).max()
    assert misalignment(assembly, loaded(assembly)) == pytest.approx(static_state(assembly).misalignment, abs=1e-6)


def test_unequal_planets_are_averaged_over_the_turn_of_their_carrier(grc, stiffness, assembly):
    """A pin off by a nanometre makes planets unequal: the mean over angles is that over equal planets at one angle."""
    off = {"pins": {"first": {"body": "planet_1", "tangential_um": 1e-3}}}
    turned = assemble(grc.varied(off), BUSHING, stiffness)
    for name in ("stiffness", "point_load", "point_strain"):
        one, other = (getattr(own.connectors, name) for own in (assembly, turned))
        size = np.abs(one).max(axis=tuple(range(1, one.ndim)), keepdims=True)
        assert (np.abs(one - other) / np.where(size, size, 1.0)).max() < 5e-3, name


def test_a_pin_that_takes_more_load_keeps_it_in_motion(grc, stiffness):
    """In motion each planet's bearings stand at the mean over the turn of what they carry, not at that of the set."""
    off = {"pins": {"first": {"body": "planet_1", "tangential_um": 20.0}}}
    turned = assemble(grc.varied(off), BUSHING, stiffness)
    numbers, _ = next(own for own in families(turned) if turned.supports[own.numbers[0]].family == "pl_a")
    radial = np.linalg.norm(turned.connectors.point_load[numbers, :2], axis=1)
    assert abs(radial[0] / radial[1:].mean() - 1.0) > 0.02
    assert radial[1] == pytest.approx(radial[2], rel=1e-2)


def test_a_life_solves_its_loads_one_by_one(tmp_path, assembly):
    """Rows are not in proportion to their load; given stiffness is."""
    assert not is_linear(assembly)
    assert not is_linear(on_bearings(bearing_gearbox(tmp_path)))
    assert not is_linear(replace(on_bearings(bearing_gearbox(tmp_path)), connectors_at_rest=None))
    assert is_linear(replace(assembly.unloaded, connectors_at_rest=None))


def test_a_stated_load_has_no_direction_and_its_law_passes_the_origin(tmp_path):
    stated = {"bearings__ball__catalogue__radial_load_kN": 5.0}
    assembly = on_bearings(bearing_gearbox(tmp_path, **stated))
    n = assembly.connector_names.index("ball")
    assert not assembly.connectors.offset[n].any()
    assert assembly.connectors.offset[assembly.connector_names.index("taper_1")].any()
    assert "ball: linear, at a specified load, through the origin" in assembly.bearing_laws
    assert "taper_1: linear, at the static load" in assembly.bearing_laws


def test_a_load_that_turns_keeps_the_part_along_the_axis(grc):
    """A shaft in a shaft: across the axis its law passes the origin, and says so."""
    strain, load = np.arange(1.0, 7.0), 1e3 * np.arange(1.0, 7.0)
    law = law_through_point(SupportLaw(np.eye(6), np.eye(6)), strain, load, stands_still=False)
    assert law.point_strain.tolist() == [0.0, 0.0, 3.0, 0.0, 0.0, 0.0]
    assert law.point_load.tolist() == [0.0, 0.0, 3e3, 0.0, 0.0, 0.0]
    bodies = {body.name: body for body in grc.bodies()}
    bearings = {bearing.name: bearing for bearing in grc.bearings}
    assert load_stands_still(bearings["pl_a_1"], bodies)
    assert load_stands_still(bearings["hss_a"], bodies)
    inside = replace(bearings["hss_a"], on="ims")
    assert not load_stands_still(inside, bodies)
    assert law_in_words(inside, False) == "linear, at the static load, across the axis through the origin"


def test_non_linear_bearings_have_no_offset(tmp_path):
    assembly = on_bearings(bearing_gearbox(tmp_path).varied(NON_LINEAR))
    assert not assembly.connectors.offset.any()
