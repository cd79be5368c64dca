"""Root fillets of internal gears by their cutter: against the cutter rolled step by step, and what it spoils."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from fe_ste.elasticity.hexmesh import MeshSettings, sector_mesh
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gear_relations import GearInputs
from fe_ste.geometry.gears import BasicRack, Gear, GearPair, PinionCutter
from fe_ste.geometry.involute import involute
from fe_ste.geometry.profile import tooth_profile
from fe_ste.tools.arrays import Booleans, Floats

MODULE = 10e-3
DEPTH = 1e-4 * MODULE
"""Offset of points that must and must not be cut: the cutter moves 3e-3 modules a step past a curve of 0.2 modules
radius, and so leaves ridges of less than 1e-5 modules."""


def ring(cutter: PinionCutter | None, **changes: Any) -> Gear:
    values: dict[str, Any] = {
        "name": "ring",
        "teeth": 99,
        "normal_module": MODULE,
        "face_width": 0.2,
        "held_diameter": 1.166,
        "internal": True,
        "cutter": cutter,
    }
    return Gear(**(values | changes))


RINGS = [
    ring(PinionCutter(40, 0.2), profile_shift=0.974, helix_angle=math.radians(-7.495), tooth_thinning=2e-4),
    ring(PinionCutter(25, 0.3, 0.1)),
    ring(PinionCutter(60, 0.15, -0.2), profile_shift=0.3, helix_angle=math.radians(15.0), tooth_thinning=1e-4),
    ring(PinionCutter(38, 0.25, 0.0, 402e-3), teeth=90, held_diameter=1.1),
]


class RolledCutter:
    """The cutter as a polygon in polar coordinates, its rounding found by distances alone, rolled step by step.

    Nothing here knows of the law of gearing but the ratio of the teeth: the centre distance is the one at which the
    involutes of both just touch.
    """

    def __init__(self, gear: GearInputs, reach: float | None = None) -> None:
        assert gear.cutter is not None
        self.reach = 5.0 * gear.normal_module / gear.reference_radius if reach is None else reach  # rad
        self.gear, self.ratio = gear, gear.cutter.teeth / gear.teeth
        self.base = gear.base_radius * self.ratio
        shift = 2.0 * gear.cutter.profile_shift * math.tan(gear.normal_pressure_angle)
        self.base_half = (0.5 * math.pi + shift) / gear.cutter.teeth + involute(gear.transverse_pressure_angle)
        self.distance = gear.cutting_distance
        self.tip = gear.root_radius - self.distance
        self.rounding = gear.cutter.tip_radius * gear.normal_module
        flank = np.linspace(self.base, 1.2 * self.tip, 200_001)
        points = flank * np.exp(1j * self._involute_half(flank))
        low, high = -0.5, self._involute_half(np.array([self.tip - self.rounding]))[0]
        for _ in range(60):  # the centre moves towards the flank until it is one radius off
            middle = 0.5 * (low + high)
            off = np.abs(points - (self.tip - self.rounding) * np.exp(1j * middle)).min()
            low, high = (middle, high) if off > self.rounding else (low, middle)
        self.centre = (self.tip - self.rounding) * np.exp(1j * low)
        self.form = np.abs(points[np.abs(points - self.centre).argmin()])

    def _involute_half(self, radius: Floats) -> Floats:
        return np.asarray(self.base_half - involute(np.arccos(self.base / radius)))

    def cuts(self, points: Floats) -> Booleans:
        """Whether the cutter is at any of its positions where complex points of the gear's tooth space are."""
        removed = np.zeros(points.shape, dtype=bool)
        for turn in np.linspace(-self.reach, self.reach, 6001):
            seen = (points * np.exp(1j * turn) - self.distance) * np.exp(-1j * turn / self.ratio)
            radius, angle = np.abs(seen), np.abs(np.angle(seen))
            below = radius <= self.form
            flank = below & (radius > self.base) & (angle < self._involute_half(np.maximum(radius, self.base)))
            arc = np.abs(radius * np.exp(1j * angle) - self.centre) < self.rounding
            land = (radius < self.tip) & ~below & (angle < np.angle(self.centre))
            removed |= flank | arc | land
        return removed


@pytest.mark.sample
@pytest.mark.parametrize("gear", RINGS, ids=lambda gear: f"z0 {gear.cutter.teeth}")
def test_the_fillet_is_what_no_position_of_the_cutter_goes_beyond(gear: Gear) -> None:
    """On the tooth's side of the fillet nothing is cut at any position, on the other side all is at some."""
    fillet = tooth_profile(gear).fillet[::4]
    curve = (fillet[:, 0] + 1j * fillet[:, 1]) * np.exp(-0.5j * gear.angular_pitch)  # space on the line of centres
    along = np.gradient(curve)
    into_tooth = -1j * along / np.abs(along)  # the curve runs outwards with the space to its left
    rolled = RolledCutter(gear)
    kept, taken = curve + DEPTH * into_tooth, curve - DEPTH * into_tooth
    # The ends of the polygon have no neighbours on both sides.
    assert not rolled.cuts(np.conj(kept[1:-1])).any()
    assert rolled.cuts(np.conj(taken[1:-1])).all()


@pytest.mark.parametrize("gear", RINGS, ids=lambda gear: f"z0 {gear.cutter.teeth}")
def test_the_fillet_begins_on_the_involute_without_a_corner_and_ends_on_the_root_circle(gear: Gear) -> None:
    profile = tooth_profile(gear)
    first, last = (complex(*profile.fillet[end]) for end in (0, -1))
    assert np.angle(first) == pytest.approx(gear.half_angle(gear.form_radius), abs=1e-13)
    assert abs(last) == pytest.approx(gear.root_radius, abs=1e-13)
    assert np.angle(last) < 0.5 * gear.angular_pitch
    flank = profile.flank(gear.form_radius - np.array([1e-7, 0.0]))
    before, after = np.diff(flank, axis=0)[0], np.diff(profile.fillet[:2], axis=0)[0]
    turn = np.angle(complex(*after) / complex(*before))
    assert abs(turn) < 0.1  # one of 200 chords over a turn of a right angle, of which the first are the shortest


def test_a_cutter_of_many_teeth_reaches_the_form_circle_of_a_rack_by_hand() -> None:
    """Spur, x = x_0 = 0: a_0 = (z - z_0) m / 2; with a sharp tip xi_F = sqrt(r_a0^2 - r_b0^2) + a_0 sin(alpha)."""
    gear = ring(PinionCutter(40, 0.0))
    distance, tip = 0.5 * 59 * MODULE, 0.5 * 99 * MODULE + 1.25 * MODULE - 0.5 * 59 * MODULE
    assert gear.cutting_distance == pytest.approx(distance, rel=1e-12)
    base = 0.5 * 40 * MODULE * math.cos(math.radians(20.0))
    expected = math.sqrt(tip**2 - base**2) + distance * math.sin(math.radians(20.0))
    assert gear.form_roll_length == pytest.approx(expected, rel=1e-12)


def test_the_root_circle_follows_from_the_cutters_tip() -> None:
    """d_f = 2 a_0 + d_a0; thinner teeth are cut by a deeper feed."""
    plain, thin = (ring(PinionCutter(40, 0.2, 0.0, 425e-3), tooth_thinning=amount) for amount in (0.0, 2e-4))
    assert 2.0 * plain.root_radius == pytest.approx(59 * MODULE + 425e-3, rel=1e-12)
    # To first order the space widens by 2 tan(alpha) of the feed.
    fed = thin.root_radius - plain.root_radius
    assert fed == pytest.approx(1e-4 / math.tan(math.radians(20.0)), rel=1e-2)
    again = ring(PinionCutter(40, 0.2), root_diameter=2.0 * thin.root_radius, tooth_thinning=2e-4)
    np.testing.assert_allclose(tooth_profile(again).fillet, tooth_profile(thin).fillet, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("gear", RINGS, ids=lambda gear: f"z0 {gear.cutter.teeth}")
def test_teeth_with_cut_fillets_mesh_well(gear: Gear) -> None:
    mesh = sector_mesh(gear, MeshSettings(layers=4))
    assert mesh.scaled_jacobian.min() > 0.6  # as with arcs, 0.667 for the ring of the GRC


def test_a_cutter_that_is_not_given_leaves_the_arc() -> None:
    plain = ring(None, rack=BasicRack(tip_radius=0.2))
    assert plain.cutter is None
    assert plain.form_radius != ring(PinionCutter(40, 0.2)).form_radius


def test_a_pinions_tip_may_not_reach_the_fillet_of_the_cutter(ring_planet: GearPair) -> None:
    """A cutter that hardly cuts deeper than the planet's tip reaches leaves a fillet in its way."""
    gear, planet = ring_planet.gear, ring_planet.pinion
    fine = dataclasses.replace(ring_planet, gear=dataclasses.replace(gear, cutter=PinionCutter(50, 0.2)))
    assert fine.path_end == pytest.approx(ring_planet.path_end, rel=1e-12)
    shallow = 2.0 * (ring_planet.centre_distance + planet.tip_radius + 0.05 * MODULE)
    high = dataclasses.replace(gear, root_diameter=shallow, cutter=PinionCutter(50, 0.3))
    with pytest.raises(GeometryError, match="interferes with the root fillet of 'ring'"):
        dataclasses.replace(ring_planet, gear=high)


@pytest.mark.parametrize(
    ("cutter", "changes", "message"),
    [
        (PinionCutter(99, 0.2), {}, r"cutter\.teeth = 99 must be a whole number from 5 to 98"),
        (PinionCutter(40, -0.1), {}, r"cutter\.tip_radius = -0\.1 must be a finite number, zero or above"),
        (PinionCutter(40, 0.6), {}, r"cutter\.tip_radius = 0\.6 does not fit on the cutter's tip: at most 0\.\d+"),
        (PinionCutter(40, 0.2, 3.0), {}, r"cutter\.profile_shift = 3\.0 leaves no centre distance"),
        (PinionCutter(40, 0.2, 0.0, 0.425), {"root_diameter": 1.015}, "leave it or root_diameter out"),
        (PinionCutter(20, 0.2, 0.0, 0.187), {}, "without an involute there"),
        (PinionCutter(40, 0.0, 0.0, 0.46), {}, "pointed there"),
        (PinionCutter(12, 0.2), {}, "reaches below the involute of the cutter, whose 12 teeth then trim the tips"),
        (PinionCutter(94, 0.2), {}, r"cutter\.teeth = 94 trims the gear's tips by .* a cutter of fewer teeth"),
    ],
)
def test_cutters_that_cannot_make_the_gear_are_refused(
    cutter: PinionCutter, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(GeometryError, match=message):
        ring(cutter, **changes)


def test_a_cutter_of_an_external_gear_is_refused() -> None:
    with pytest.raises(GeometryError, match="cutter = .* is for internal gears"):
        ring(PinionCutter(40, 0.2), internal=False, held_diameter=0.5)


def test_tips_are_trimmed_as_rolling_says() -> None:
    """At the last number of teeth that passes no position cuts the tip's corner, two teeth further some do."""
    plain = dataclasses.replace(RINGS[1], cutter=None, tip_diameter=99 * MODULE - 1.6 * MODULE)
    given = {field.name: getattr(plain, field.name) for field in dataclasses.fields(plain)}
    for teeth in range(80, 98):
        cutter = PinionCutter(teeth, 0.2)
        try:
            Gear(**(given | {"cutter": cutter}))
        except GeometryError as error:
            assert "trims the gear's tips" in str(error)
            break
    assert 80 < teeth < 95
    for count, is_trimmed in ((teeth - 1, False), (teeth + 2, True)):
        gear = GearInputs(**(given | {"cutter": PinionCutter(count, 0.2)}))
        # Just inside the corner of the tooth, as the space beside it stands on the line of centres.
        radius = gear.tip_radius + 1e-3 * MODULE
        polar = 0.5 * gear.angular_pitch - gear.half_angle(radius) + 1e-3 * MODULE / radius
        corner = np.array([radius * np.exp(1j * polar)])
        assert RolledCutter(gear, reach=1.5).cuts(corner).any() == is_trimmed
