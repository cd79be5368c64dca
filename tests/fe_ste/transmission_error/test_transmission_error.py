"""Static transmission error: balances, periodicity, load sharing, effects of load, position and modification."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import xarray as xr

import fe_ste.transmission_error.transmission_error
from fe_ste.contact.kinematics import ContactError, ContactSettings
from fe_ste.elasticity.flank import FlankCompliance, flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flanks import FlankModification, Relief, radius_at_roll_length_from_tip
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.search import contact_state, hertz_half_width, least_contact_length
from fe_ste.transmission_error.states import ContactState
from fe_ste.transmission_error.transmission_error import static_transmission_error

from ..cases.gears import HELICAL_PAIR

COARSE = MeshSettings(layers=6, flank=10, thickness=8, fillet=2, root=2, rim=6)
FEW_SLICES = ContactSettings(slices=16)
SPUR_GEAR = Gear(name="gear", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)
SPUR = GearPair(name="spur", pinion=SPUR_GEAR, gear=SPUR_GEAR, centre_distance=150e-3)
INTERNAL = GearPair(
    name="internal",
    pinion=Gear(
        name="planet",
        teeth=24,
        normal_module=3e-3,
        helix_angle=math.radians(-10.0),
        face_width=25e-3,
        held_diameter=40e-3,
    ),
    gear=Gear(
        name="ring",
        teeth=60,
        normal_module=3e-3,
        helix_angle=math.radians(-10.0),
        face_width=25e-3,
        held_diameter=215e-3,
        tip_diameter=178e-3,
        internal=True,
    ),
    centre_distance=54.7e-3,
)
TORQUE = {"spur": 300.0, "helical": 250.0, "internal": 250.0}


def prepared(pair: GearPair, contact: ContactSettings = FEW_SLICES, **settings: Any) -> PairCompliance:
    """Compliance of a pair; equal gears are computed once."""
    one = flank_compliance(pair.pinion, 1, COARSE, **settings)
    if pair.gear == pair.pinion:
        return PairCompliance.from_flanks(pair, (one, one), contact)
    other = flank_compliance(pair.gear, -1 if pair.gear.internal else 1, COARSE, **settings)
    return PairCompliance.from_flanks(pair, (one, other), contact)


@pytest.fixture(scope="module")
def spur() -> PairCompliance:
    return prepared(SPUR)


@pytest.fixture(scope="module")
def helical() -> PairCompliance:
    return prepared(HELICAL_PAIR)


@pytest.fixture(scope="module")
def internal() -> PairCompliance:
    return prepared(INTERNAL)


@pytest.fixture(params=["spur", "helical", "internal"])
def compliance(request: pytest.FixtureRequest) -> PairCompliance:
    result: PairCompliance = request.getfixturevalue(str(request.param))
    return result


def torque_of(compliance: PairCompliance) -> float:
    return TORQUE[compliance.pair.name]


def mean(curve: xr.Dataset) -> float:
    return float(curve.ste.mean())


def ripple(curve: xr.Dataset) -> float:
    return float(curve.ste.max() - curve.ste.min())


@pytest.mark.sample
def test_curve_is_periodic(compliance: PairCompliance) -> None:
    start, end = (contact_state(compliance, torque_of(compliance), pmc) for pmc in (0.0, 1.0))
    assert end.solution.approach == pytest.approx(start.solution.approach, rel=1e-8)
    # One tooth pair on: pair j has become pair j - 1.
    for tooth in range(-1, 2):
        share = [state.solution.force[state.cells.tooth == t].sum() for state, t in ((start, tooth), (end, tooth - 1))]
        assert share[1] == pytest.approx(share[0], rel=1e-7, abs=1e-8 * start.normal_load)


def test_spur_pair_of_equal_gears_has_a_symmetric_curve(spur: PairCompliance) -> None:
    """Exchanging the gears runs the mesh cycle backwards."""
    for pmc in (0.1, 0.25, 0.4):
        here, there = (contact_state(spur, 300.0, p).solution.approach for p in (pmc, 1 - pmc))
        # The cells are laid along gear 1's flank: not symmetric themselves.
        assert here == pytest.approx(there, rel=1e-3)


def test_mirrored_pair_has_the_same_curve_and_the_opposite_misalignment(helical: PairCompliance) -> None:
    """z -> -z exchanges the hands and the ends."""
    mirrored = prepared(HELICAL_PAIR.mirrored())
    for tilt in (0.0, 2e-4):
        one = static_transmission_error(helical, 250.0, 3, misalignment=tilt)
        other = static_transmission_error(mirrored, 250.0, 3, misalignment=-tilt)
        assert other.ste.values == pytest.approx(one.ste.values, rel=1e-8)
        flipped = other.line_load.values[..., ::-1]
        assert flipped == pytest.approx(one.line_load.values, abs=1e-6 * float(one.line_load.max()))


def test_result_of_a_position_does_not_depend_on_those_before(helical: PairCompliance) -> None:
    """A window so narrow that contact fills it: it grows, but the cells keep their width."""
    narrow = PairCompliance.from_flanks(HELICAL_PAIR, helical.flanks, ContactSettings(slices=16, window=1.0))
    curve = static_transmission_error(narrow, 250.0, 10).ste.values.ravel()
    alone = [contact_state(narrow, 250.0, p / 10).solution.approach for p in range(10)]
    assert curve * math.cos(HELICAL_PAIR.pinion.base_helix_angle) == pytest.approx(np.array(alone), rel=1e-12)


def test_forces_balance_the_torques_on_both_gears(compliance: PairCompliance) -> None:
    torque = torque_of(compliance)
    pair = compliance.pair
    for pmc in (0.0, 0.37, 0.8):
        state = contact_state(compliance, torque, pmc)
        force = state.solution.force
        assert (force >= 0).all()
        levers = [gear.base_radius * math.cos(gear.base_helix_angle) for gear in (pair.pinion, pair.gear)]
        assert force.sum() * levers[0] == pytest.approx(torque, rel=1e-9)
        assert force.sum() * levers[1] == pytest.approx(torque * pair.ratio, rel=1e-9)


def test_held_surfaces_of_the_finite_elements_react_with_the_torques(compliance: PairCompliance) -> None:
    """The cells' forces, put on the flank nodes of each gear, meet its held surface with T_1 and T_2."""
    torque, pair = torque_of(compliance), compliance.pair
    state = contact_state(compliance, torque, 0.37)
    for flank, roll, expected in zip(
        compliance.flanks, (state.cells.roll, state.cells.gear_roll), (torque, torque * pair.ratio), strict=True
    ):
        axial = compliance.axial[state.cells.layer]
        nodal = state.solution.force @ _bilinear(flank, roll, axial)
        assert abs(flank.hub_torque @ nodal) == pytest.approx(expected, rel=1e-9)


def _bilinear(flank: FlankCompliance, roll: np.ndarray, axial: np.ndarray) -> np.ndarray:
    along, across = (
        np.stack([np.interp(at, nodes, row) for row in np.eye(len(nodes))], axis=1)
        for at, nodes in ((roll, flank.roll), (axial, flank.axial))
    )
    return np.einsum("nf,nl->nfl", along, across).reshape(len(roll), -1)


def test_shares_add_up_and_line_loads_integrate_to_the_load(compliance: PairCompliance) -> None:
    curve = static_transmission_error(compliance, torque_of(compliance), 5)
    assert curve.load_share.sum("tooth").values == pytest.approx(1.0, rel=1e-9)
    cosine = math.cos(compliance.pair.pinion.base_helix_angle)
    total = curve.line_load.sum(("tooth", "axial_position")) * compliance.slice_width / cosine
    normal = curve.line_of_action_force / cosine
    assert total.values == pytest.approx(normal.values, rel=1e-9)
    assert bool(curve.converged.all())
    assert (curve.mesh_stiffness * curve.ste).values == pytest.approx(curve.line_of_action_force.values, rel=1e-12)


def test_tangent_stiffness_is_the_slope_over_the_load(compliance: PairCompliance) -> None:
    torque, step = torque_of(compliance), 1e-3
    curve = static_transmission_error(compliance, [torque * (1 - step), torque, torque * (1 + step)], 2)
    slope = curve.line_of_action_force.diff("torque").sum("torque") / curve.ste.diff("torque").sum("torque")
    # The window of cells grows with the root of the load: 1e-3 of a discretisation error enters the difference.
    assert curve.tangent_stiffness.isel(torque=1).values == pytest.approx(slope.values, rel=2e-2)
    assert (curve.tangent_stiffness > curve.mesh_stiffness).all()  # Hertzian contact stiffens


def test_transmission_error_vanishes_with_the_load(compliance: PairCompliance) -> None:
    torque = torque_of(compliance)
    curve = static_transmission_error(compliance, [1e-5 * torque, 1e-3 * torque, torque], 2)
    small, light, full = (curve.ste.isel(torque=t) for t in range(3))
    # A line contact gains less than twice the compliance over five decades of load.
    assert (light < 2e-3 * full).all()
    assert (small < 2e-5 * full).all()
    assert (small > 0).all()


def test_contact_zones_at_vanishing_load_are_those_of_the_contact_ratio(spur: PairCompliance) -> None:
    """Teeth in contact at each of 50 positions against the path of contact; under load the zones widen."""
    positions = 50
    curve = static_transmission_error(spur, [0.01, 300.0], positions)
    touching = (curve.load_share > 0).sum("tooth").isel(centre_distance=0, misalignment=0)
    assert SPUR.transverse_contact_ratio == pytest.approx(1.755, abs=1e-3)
    path = SPUR.path_pitch_point + SPUR.transverse_base_pitch * np.add.outer(
        np.arange(positions) / positions, range(-3, 4)
    )
    rigid = ((path > SPUR.path_start) & (path < SPUR.path_end)).sum(axis=1)
    light, loaded = touching.isel(torque=0).values, touching.isel(torque=1).values
    neighbourhood = np.stack([np.roll(rigid, step) for step in (-1, 0, 1)])
    assert ((light == neighbourhood).any(axis=0)).all()
    assert {1, 2} == set(light)
    assert abs((light == 1).sum() - (rigid == 1).sum()) <= 2
    assert (loaded >= light).all()
    assert (loaded == 2).sum() > (light == 2).sum() + 4


def test_elements_next_to_the_load_do_not_matter() -> None:
    """Their own error is taken out with the near field: half as many again, 0.3 %."""
    finer = dataclasses.replace(COARSE, flank=COARSE.flank * 3 // 2, thickness=COARSE.thickness * 3 // 2)
    one, other = (flank_compliance(SPUR_GEAR, 1, mesh) for mesh in (COARSE, finer))
    means = [
        mean(static_transmission_error(PairCompliance.from_flanks(SPUR, (flank, flank), FEW_SLICES), 300.0, 4))
        for flank in (one, other)
    ]
    assert means[0] == pytest.approx(means[1], rel=3e-3)


def test_plain_bricks_are_too_stiff(spur: PairCompliance) -> None:
    """Locking of the plain brick: a few per mille to per cent of the error on this mesh."""
    plain = static_transmission_error(prepared(SPUR, incompatible_modes=False), 300.0, 4)
    full = static_transmission_error(spur, 300.0, 4)
    assert 0.9 < mean(plain) / mean(full) < 0.998


def test_open_sector_is_softer_than_the_ring(spur: PairCompliance) -> None:
    closed = mean(static_transmission_error(spur, 300.0, 2))
    opened = [mean(static_transmission_error(prepared(SPUR, open_teeth=teeth), 300.0, 2)) for teeth in (5, 9)]
    assert opened[0] > opened[1] > closed


def test_tip_relief_takes_ripple_and_gives_mean() -> None:
    """A short relief of about the deflection of a pair of teeth smooths the change from two pairs to one."""
    spur = prepared(SPUR)
    start = radius_at_roll_length_from_tip(
        SPUR_GEAR, 0.6 * (SPUR.transverse_contact_ratio - 1) * SPUR.transverse_base_pitch
    )
    relief = FlankModification(tip_relief=Relief(12e-6, start))
    plain, relieved = (
        static_transmission_error(compliance, 300.0, 12)
        for compliance in (spur, spur.with_modifications(relief, relief))
    )
    assert ripple(relieved) < 0.8 * ripple(plain)
    assert mean(relieved) > mean(plain)


def test_uniform_removal_shifts_the_curve(helical: PairCompliance) -> None:
    """Equal amounts everywhere are a rotation: with opposite helix slopes the gears stay as they were."""
    slope = FlankModification(helix_slope=10e-6)
    # Same +z end removed on both gears by slopes over their own face widths.
    tilted = static_transmission_error(helical.with_modifications(slope, FlankModification()), 250.0, 3)
    face = HELICAL_PAIR.pinion.face_width
    cosine = math.cos(HELICAL_PAIR.pinion.base_helix_angle)
    angle = 10e-6 / face / cosine
    turned = static_transmission_error(helical, 250.0, 3, misalignment=angle)
    # The slope's gap is 5 um at mid-face where the misalignment's is zero: the rest is the same wedge.
    shift = 5e-6 / cosine
    assert tilted.ste.values == pytest.approx(turned.ste.values + shift, rel=1e-9)


def test_misalignment_raises_the_load_at_the_end_it_closes(helical: PairCompliance) -> None:
    curve = static_transmission_error(helical, 250.0, 4, misalignment=[-3e-4, 0.0, 3e-4])
    load = curve.line_load.max("tooth").mean("pmc").isel(torque=0, centre_distance=0)
    low, high = (
        load.isel(axial_position=slice(0, 3)).mean("axial_position"),
        load.isel(axial_position=slice(-3, None)).mean("axial_position"),
    )
    assert low[2] > 1.2 * low[1]  # positive opens +z
    assert high[2] < 0.8 * high[1]
    assert high[0] > 1.2 * high[1]
    assert (curve.max_pressure.max("pmc")[0, 0, [0, 2]] > curve.max_pressure.max("pmc")[0, 0, 1]).all()


def test_larger_centre_distance_makes_an_external_mesh_softer(helical: PairCompliance) -> None:
    distance = HELICAL_PAIR.centre_distance
    curve = static_transmission_error(helical, 250.0, 4, centre_distance=[distance, distance + 0.3e-3])
    means = curve.ste.mean("pmc").values.ravel()
    assert 1.001 < means[1] / means[0] < 1.1
    assert curve.centre_distance.values.tolist() == [distance, distance + 0.3e-3]


def test_too_large_a_torque_is_not_a_number_and_is_reported(spur: PairCompliance) -> None:
    curve = static_transmission_error(spur, [300.0, 1e7], 2)
    assert curve.converged.values[:, :, 0, 0].tolist() == [[True, False], [True, False]]
    failed = curve.isel(torque=1)
    for name in ("ste", "mesh_stiffness", "tangent_stiffness", "max_pressure", "load_share", "line_load"):
        assert bool(np.isnan(failed[name]).all())
    failures = curve.attrs["failures"].splitlines()
    assert len(failures) == 2
    assert all("1e+07" in line for line in failures)
    with pytest.raises(ContactError):
        contact_state(spur, 1e7, 0.0)


def test_a_failed_position_leaves_its_neighbours_as_they_are(
    spur: PairCompliance, monkeypatch: pytest.MonkeyPatch
) -> None:
    reference = static_transmission_error(spur, 300.0, 4)
    solve = fe_ste.transmission_error.search.contact_states

    def failing(
        compliance: PairCompliance, torque: float, pmc: float, *rest: Any
    ) -> Sequence[ContactState | ContactError]:
        return [ContactError("made to fail")] if pmc == 0.25 else solve(compliance, torque, pmc, *rest)

    monkeypatch.setattr(fe_ste.transmission_error.transmission_error, "contact_states", failing)
    curve = static_transmission_error(spur, 300.0, 4)
    assert curve.converged.values.ravel().tolist() == [True, False, True, True]
    assert curve.ste.values.ravel()[[0, 2, 3]] == pytest.approx(reference.ste.values.ravel()[[0, 2, 3]], rel=1e-12)
    assert "made to fail" in curve.attrs["failures"]


@pytest.mark.parametrize("torque", [0.0, -5.0, float("nan"), float("inf"), [100.0, -1.0]])
def test_torques_that_load_the_other_flank_or_none_are_refused(torque: float) -> None:
    with pytest.raises(ValueError, match="torque"):
        static_transmission_error(SPUR, torque)


def test_impossible_requests_are_refused_before_any_finite_elements(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fe_ste.transmission_error.transmission_error, "pair_compliance", None)
    with pytest.raises(ValueError, match="positions"):
        static_transmission_error(SPUR, 100.0, 0)
    with pytest.raises(ValueError, match="misalignment"):
        static_transmission_error(SPUR, 100.0, misalignment=float("nan"))
    with pytest.raises(GeometryError, match="centre_distance"):
        static_transmission_error(SPUR, 100.0, centre_distance=0.140)


def test_progress_counts_every_state(spur: PairCompliance) -> None:
    seen: list[tuple[int, int]] = []
    static_transmission_error(spur, [100.0, 200.0], 3, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(n, 6) for n in range(1, 7)]


def test_results_are_labelled_with_units(spur: PairCompliance) -> None:
    curve = static_transmission_error(spur, 100.0, 2)
    assert curve.ste.dims == ("pmc", "torque", "centre_distance", "misalignment")
    for name in (*curve.data_vars, *curve.coords):
        assert curve[name].attrs["units"]
        assert curve[name].attrs["long_name"]


def stub_pair(overlap: float) -> GearPair:
    """Helical teeth half as high as usual, with a transverse contact ratio of 0.777, and a stated overlap ratio."""
    helix = math.radians(25.0)
    width = overlap * math.pi * 3e-3 / math.sin(helix)
    rack = BasicRack(addendum=0.5, dedendum=0.75, tip_radius=0.38)
    teeth = {"normal_module": 3e-3, "face_width": width, "rack": rack, "tooth_thinning": 5e-5}
    pinion = Gear(name="pinion", teeth=30, helix_angle=helix, held_diameter=15e-3, **teeth)
    gear = Gear(name="gear", teeth=40, helix_angle=-helix, held_diameter=30e-3, **teeth)
    return GearPair(name="stub", pinion=pinion, gear=gear, centre_distance=35 * 3e-3 / math.cos(helix))


@pytest.mark.parametrize(("overlap", "largest_ripple"), [(1.0, 0.03), (0.6, 0.08)])
def test_overlapping_teeth_below_a_transverse_contact_ratio_of_one_carry_the_load_throughout(
    overlap: float, largest_ripple: float
) -> None:
    """Contact lines are nowhere absent; for a whole overlap ratio their length, and so the deflection, is constant."""
    compliance = prepared(stub_pair(overlap))
    pair = compliance.pair
    assert pair.transverse_contact_ratio == pytest.approx(0.7766, abs=1e-4)
    curve = static_transmission_error(compliance, 50.0, 12)
    assert curve.converged.all()
    assert curve.load_share.sum("tooth").values == pytest.approx(1.0, rel=1e-9)
    cosine = math.cos(pair.pinion.base_helix_angle)
    total = curve.line_load.sum(("tooth", "axial_position")) * compliance.slice_width / cosine
    assert total.values == pytest.approx(50.0 / (pair.pinion.base_radius * cosine), rel=1e-9)
    values = curve.ste.values.ravel()
    assert np.ptp(values) < largest_ripple * values.mean()
    # Continuous: between neighbours of twelve positions, the first behind the last, there is a part of the ripple.
    assert np.abs(np.diff(np.append(values, values[0]))).max() < 0.5 * largest_ripple * values.mean()
    start, end = (contact_state(compliance, 50.0, pmc).solution.approach for pmc in (0.0, 1.0))
    assert end == pytest.approx(start, rel=1e-8)


def test_least_contact_length_of_whole_overlaps() -> None:
    """A spur pair has one or two pairs of full width; a whole overlap ratio makes the length constant."""
    assert least_contact_length(SPUR) == pytest.approx(SPUR.face_width, rel=1e-12)
    width = math.pi * 3e-3 / math.sin(math.radians(14.0))
    wide = dataclasses.replace(
        HELICAL_PAIR,
        pinion=dataclasses.replace(HELICAL_PAIR.pinion, face_width=width),
        gear=dataclasses.replace(HELICAL_PAIR.gear, face_width=width),
    )
    assert wide.overlap_ratio == pytest.approx(1.0, rel=1e-12)
    constant = wide.transverse_contact_ratio * width / math.cos(wide.pinion.base_helix_angle)
    # Counted on 401 stations along the face.
    assert least_contact_length(wide) == pytest.approx(constant, rel=5e-3)


def test_hertz_half_width_of_the_pitch_point() -> None:
    """Johnson's formula by hand: R = r_b tan(alpha)/2 = 12.826 mm, E* = 113.19 GPa, 250 N/mm -> 0.1899 mm."""
    radius = SPUR_GEAR.base_radius * math.tan(SPUR.working_pressure_angle) / 2
    assert radius == pytest.approx(12.8257e-3, rel=1e-4)
    reduced = 206e9 / (2 * (1 - 0.09))
    assert hertz_half_width(SPUR, 250e3) == pytest.approx(
        math.sqrt(4 * 250e3 * radius / (math.pi * reduced)), rel=1e-12
    )


def test_pressure_of_a_single_contact_is_hertz_s() -> None:
    """One pair of teeth at the pitch point: pressure and width at mid-face from the local line load."""
    slices = 20
    spur = prepared(SPUR, ContactSettings(slices=slices, cells=61))
    state = contact_state(spur, 60.0, 0.0)
    assert set(state.cells.tooth[state.solution.force > 0]) == {0}
    middle = state.cells.layer == slices // 2
    pressure, across = state.pressure[middle], 2 * state.cells.half_across[middle]
    line_load = float((pressure * across).sum())
    half_width = hertz_half_width(SPUR, line_load)
    assert pressure.max() == pytest.approx(2 * line_load / (math.pi * half_width), rel=0.02)
    # Hertz: p^2 falls linearly with the square of the distance; the fit sees between the cells.
    arc = SPUR_GEAR.base_radius * state.cells.roll[middle] ** 2 / 2
    touching = pressure > 0
    curve = np.polyfit(arc[touching] - arc[touching].mean(), pressure[touching] ** 2, 2)
    fitted = math.sqrt((curve[1] / (2 * curve[0])) ** 2 - curve[2] / curve[0])
    assert fitted == pytest.approx(half_width, rel=0.05)
    assert across[touching].sum() / 2 == pytest.approx(half_width, rel=0.05)


def test_pair_compliance_computes_both_gears() -> None:
    compliance = pair_compliance(
        SPUR, MeshSettings(layers=3, flank=5, thickness=4, fillet=1, root=1, rim=2), FEW_SLICES
    )
    assert [flank.side for flank in compliance.flanks] == [1, 1]
    assert np.isfinite(static_transmission_error(compliance, 100.0, 1).ste).all()
