"""Catalogue bearings have the stiffness of their rows at the load that they really carry, or follow the rows."""

from __future__ import annotations

import math
import re
import tomllib
from importlib.resources import files

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bearings.duty import OperatingPoint
from exugear.system.bearings.rolling.contact import (
    bearing_load,
    equilibrium,
    pitch_averaged_tangent,
    row_contacts,
)
from exugear.system.bearings.rolling.rows import BearingError, BearingOfRows
from exugear.system.bearings.stiffness import LEAST_LOAD, catalogue_stiffness
from exugear.system.build import assemble
from exugear.system.gearbox_checks import lacking
from exugear.system.loads import LoadTable
from exugear.system.modes import modes_of
from exugear.system.operating_points import opposed_bearings
from exugear.system.statics import BalanceError, static_state
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem

from ..cases.bearing import NON_LINEAR, STIFFNESS, bearing_gearbox

# Along the line of action at 20 deg: 100 N m on a base radius of 28.19 mm.
MESH_FORCE = 100.0 / (0.03 * math.cos(math.radians(20.0)))


def on_bearings(gearbox: Gearbox) -> Assembly:
    return assemble(gearbox, Choice("bushing", "constant"), {name: np.array([k]) for name, k in STIFFNESS.items()})


def points_of(assembly: Assembly) -> dict[str, OperatingPoint]:
    return {point.bearing.name: point for point in assembly.operating_points if point is not None}


def test_loads_are_those_of_the_lever(tmp_path):
    """30 and 45 mm from the gear.

    Bearings resist tilting a little, and tapered rollers press beside their middle: some per cent.
    """
    points = points_of(on_bearings(bearing_gearbox(tmp_path)))
    shares = {name: point.radial_load / MESH_FORCE for name, point in points.items()}
    expected = {"ball": 0.6, "roller": 0.4, "taper_1": 0.6, "taper_2": 0.4}
    assert shares == pytest.approx(expected, rel=0.05)
    assert shares["ball"] + shares["roller"] == pytest.approx(1.0, rel=1e-3)


def test_tapered_rollers_push_each_other_along_the_axis(tmp_path):
    """No axial load from a spur gear: what one radial load drives apart, the other bearing holds."""
    points = points_of(on_bearings(bearing_gearbox(tmp_path)))
    pushed = points["taper_1"].load[2], points["taper_2"].load[2]
    assert pushed[0] == pytest.approx(-pushed[1], rel=1e-3)
    # Harris: a row that half of its rollers carry needs 1.216 F_r tan(angle); fewer carry in the one that has less.
    least = 1.216 * min(points[name].radial_load for name in ("taper_1", "taper_2")) * math.tan(math.radians(14.0))
    most = 1.216 * max(points[name].radial_load for name in ("taper_1", "taper_2")) * math.tan(math.radians(14.0))
    assert 0.9 * least < abs(pushed[0]) < 1.1 * most


@pytest.mark.parametrize("name", ["ball", "roller", "taper_1", "taper_2"])
def test_the_stiffness_is_the_tangent_under_the_load(tmp_path, name):
    point = points_of(on_bearings(bearing_gearbox(tmp_path)))[name]
    rows = BearingOfRows(point.rows)
    state = equilibrium(rows, point.load[:3], tilt=point.displacement[3:5])
    assert point.radial_stiffness == pytest.approx(state.radial_stiffness, rel=0.05)  # one position of the cage
    mean = pitch_averaged_tangent(rows, point.load[:3])
    assert point.radial_stiffness == pytest.approx(
        float(np.array([math.cos(point.direction), math.sin(point.direction)]) @ mean[:2, :2]
              @ [math.cos(point.direction), math.sin(point.direction)]), rel=0.02
    )  # fmt: skip


def test_a_linear_assembly_has_that_stiffness(tmp_path):
    assembly = on_bearings(bearing_gearbox(tmp_path))
    factor = assembly.gearbox.case.housing.factor
    for n, point in enumerate(assembly.operating_points):
        np.testing.assert_allclose(assembly.connectors.stiffness[n], factor * point.stiffness)
    assert not assembly.has_rows


def test_a_stated_load_stands_for_the_reaction(tmp_path):
    stated = {"bearings__ball__catalogue__radial_load_kN": 5.0, "bearings__roller__catalogue__radial_load_kN": 5.0}
    assembly = on_bearings(bearing_gearbox(tmp_path, **stated))
    assert set(points_of(assembly)) == {"taper_1", "taper_2"}
    n = assembly.connector_names.index("ball")
    of_rows = catalogue_stiffness(assembly.supports[n].catalogue)
    np.testing.assert_array_equal(assembly.connectors.stiffness[n], assembly.supports[n].factor * of_rows)


def test_a_bearing_without_load_has_the_stiffness_at_the_least_one(tmp_path):
    points = points_of(on_bearings(bearing_gearbox(tmp_path, static_load__torques_N_m={"shaft_1": 0.1})))
    assert all(point.is_unloaded for point in points.values())
    assert all(np.linalg.eigvalsh(point.stiffness[:2, :2]).min() > 1e7 for point in points.values())
    assert LEAST_LOAD == 0.01


def test_preload_keeps_a_bearing_stiff_without_load(tmp_path):
    keys = {"static_load__torques_N_m": {"shaft_1": 0.1}}
    preloaded = {**keys, "bearings__roller__catalogue__radial_clearance_mm": -0.02}
    plain, tight = (points_of(on_bearings(bearing_gearbox(tmp_path, **each)))["roller"] for each in (keys, preloaded))
    assert (plain.is_unloaded, tight.is_unloaded) == (True, False)
    assert tight.radial_stiffness > 1.5 * plain.radial_stiffness


def test_clearance_makes_a_linear_bearing_softer_and_its_seat_takes_no_share_of_it(tmp_path):
    """The same load, fewer rollers: with a housing factor and without one."""
    keys = {"bearings__roller__catalogue__radial_clearance_mm": 0.04}
    for more in ({}, {"housing__factor": 1.0}):
        with_play = points_of(on_bearings(bearing_gearbox(tmp_path, **keys, **more)))["roller"]
        without = points_of(on_bearings(bearing_gearbox(tmp_path, **more)))["roller"]
        assert with_play.radial_stiffness < 0.9 * without.radial_stiffness
        assert with_play.radial_load == pytest.approx(without.radial_load, rel=0.05)
        beyond = np.linalg.norm(with_play.displacement[:2]) - 20e-6
        assert 0.0 < beyond < 2.0 * np.linalg.norm(without.displacement[:2])


def test_a_non_linear_bearing_with_clearance_and_a_housing_factor_is_refused_by_name(tmp_path):
    keys = {"bearings.roller.model": "iso16281", "bearings.roller.catalogue.radial_clearance_mm": 0.04}
    said = r"bearings\.roller: model.*housing_factor_applies = false"
    refused = bearing_gearbox(tmp_path).varied(keys)
    assert re.match(said, lacking(refused, "bushing"))
    with pytest.raises(BearingError, match=said):
        on_bearings(refused)
    free = bearing_gearbox(tmp_path).varied({**keys, "bearings.roller.housing_factor_applies": False})
    assert lacking(free, "bushing") == ""


def test_an_elastic_housing_takes_non_linear_bearings_with_clearance(grc):
    keys = {"bearings.hss_a.model": "iso16281", "bearings.hss_a.catalogue.radial_clearance_mm": 0.05}
    assert lacking(grc.varied(keys), "flexible") == ""
    assert "bearings.hss_a" in lacking(grc.varied(keys), "bushing")


def test_a_shaft_that_is_held_one_way_only_is_named_with_its_bearings(tmp_path):
    loose = bearing_gearbox(tmp_path, bearings__taper_1__catalogue__locates_towards="+z")
    with pytest.raises(
        BalanceError,
        match="taper_1, taper_2: located axially in one direction only; check arrangements and `locates_towards`",
    ):
        on_bearings(loose)


def test_a_shaft_on_one_bearing_without_equilibrium_is_named_instead_of_its_good_bearings():
    content = tomllib.loads((files("exugear.gearbox.templates") / "parallel.toml").read_text("utf-8"))
    del content["bearings"]["middle_left"], content["bearings"]["output_right"]
    sizes = {"bore_mm": 40.0, "outer_diameter_mm": 90.0, "width_mm": 35.25, "contact_angle_deg": 13.0}
    content["bearings"]["middle_right"]["catalogue"] = {"type": "tapered_roller", **sizes}
    gearbox = Gearbox.from_dict(content)
    with pytest.raises(BalanceError, match=r"bodies\.middle: supported by one bearing \(middle_right\) only"):
        assemble(gearbox, Choice("bushing", "constant"), {name: np.array([4e8]) for name in gearbox.pairs})


def test_single_bearings_are_opposed_where_another_one_of_the_body_carries_the_other_axial_load(tmp_path):
    gearbox = bearing_gearbox(tmp_path)
    assert opposed_bearings(gearbox) == ("taper_1", "taper_2")
    same = gearbox.varied({"bearings.taper_1.catalogue.locates_towards": "+z"})
    assert opposed_bearings(same) == ()
    angular = {"type": "angular_contact_ball", "contact_angle_deg": 40.0}
    alone = gearbox.varied({f"bearings.ball.catalogue.{key}": value for key, value in angular.items()})
    assert opposed_bearings(alone) == ("taper_1", "taper_2")  # the cylindrical rollers beside it carry no axial load


def test_a_non_linear_static_state_balances_what_plain_sums_over_the_rollers_give(tmp_path):
    """Compiled law with tables against sums over 240 slices, at the same displacement."""
    assembly = on_bearings(bearing_gearbox(tmp_path).varied({**NON_LINEAR, "housing.factor": 1.0}))
    q = static_state(assembly).q
    loads = assembly.bearing_loads(q, 0 * q)
    for n, (point, strain) in enumerate(zip(assembly.operating_points, assembly.support_strains(q), strict=True)):
        angle = assembly.connectors.rolling.phase[n]
        expected = bearing_load(row_contacts(point.rows, angle), strain)
        assert loads[n, :3] == pytest.approx(expected[:3], abs=1e-3 * np.linalg.norm(expected[:3]))


def test_the_share_of_the_housing_keeps_the_linear_stiffness(tmp_path):
    """Modes of non-linear bearings at their static load are those of linear ones, but for the place of the cage."""
    gearbox = bearing_gearbox(tmp_path)
    linear, rolling = (modes_of(on_bearings(gearbox.varied(keys))) for keys in ({}, NON_LINEAR))
    assert rolling.frequency[1:] == pytest.approx(linear.frequency[1:], rel=0.02)


@pytest.mark.parametrize("mode", [2, 5, 9])
def test_small_vibrations_have_the_frequencies_of_the_tangent(tmp_path, mode):
    """A run about the static state, the amplitude a millionth of the deflection."""
    undamped = {"damping.bearing_time_s": 0.0, "damping.mesh_time_s": 0.0}
    assembly = on_bearings(bearing_gearbox(tmp_path).varied({**NON_LINEAR, **undamped}))
    modes, q = modes_of(assembly), static_state(assembly).q
    torques = {"shaft_1": 100.0}
    held = assembly.forces(q, 0 * q) + assembly.torque_vector(torques)
    torques["shaft_2"] = -float(held[assembly.spin["shaft_2"]])
    shape, omega = modes.shapes[:, mode], 2.0 * math.pi * modes.frequency[mode]
    step, count = 0.02 / omega, 3000
    amplitude = 1e-10 / np.abs(shape).max()
    system = CompiledSystem(assembly, q + amplitude * shape, 0 * q, LoadTable(torques), step)
    states, rates = np.empty((2, count, assembly.size))
    assert system.advance(0, states, rates) == count
    along = (states - q) @ assembly.mass_matrix @ shape
    # Of a harmonic motion y(t + h) + y(t - h) is 2 cos(w h) y(t).
    cosine = 0.5 * np.dot(along[2:] + along[:-2], along[1:-1]) / np.dot(along[1:-1], along[1:-1])
    assert math.acos(cosine) / (omega * step) == pytest.approx(1.0, abs=1e-4)
