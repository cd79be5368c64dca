"""Kinematics of meshing flanks: frame, signs and the gap between rigid flanks over the plane of action.

Frame. Gear 1 turns counter-clockwise and drives. The x axis runs from its centre to the pitch point, z along the axes,
z = 0 in the middle of the common face width. An external gear 2 lies at +x, an internal one at -x. The flanks in
contact are the counter-clockwise flanks of gear 1 and of an external gear 2, and the clockwise flanks of an internal
gear 2's teeth. Tooth pair 0 touches at the pitch point for rotation 0; pair j is j base pitches ahead on the path of
contact.

Signs. The position in the mesh cycle (pmc) is the part of a pitch by which gear 1 has turned in its driving sense from
rotation 0. Gear 1 is fixed, gear 2 turns about its axis under a torque that presses its flank on gear 1. The approach
and the static transmission error are that rotation as a length, from the position in which the unmodified rigid flanks
would roll: positive where the loaded gear deflects. Approach and gap are lengths on the contact normal, the
transmission error on the transverse line of action, which is longer by 1 / cos(beta_b). A gap is positive where the
flanks are separated. Misalignment (rad) is the relative rotation of the axes in the plane of action, positive for a gap
at the +z end.

Involutes. A point of a flank is described by its roll angle tan(alpha), alpha the profile angle at its radius r:
r = r_b sqrt(1 + tan(alpha)^2), and its polar angle falls with inv(alpha) = tan(alpha) - alpha (ISO 21771).

Each slice of the face width has a window of cells around its contact line. Cells are equal in arc length along the
involute, in which the contact of two flanks is nearly that of two parabolas.

Below its root form diameter a tooth continues as a fillet, which comes closer to the mating gear than the involute
would. The rigid gap is computed from involutes only, so contact is truncated at the form diameter as at an edge. The
load neglected by this is estimated from the same state with involutes extended to the base circles: the share of the
load beyond the form diameter. In a gearbox the tip corner contacts the fillet there, so this share measures the
uncertainty of the results.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from fe_ste.geometry.gears import GearPair
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.compilation import compiled
from fe_ste.tools.display import ReprMixin

if TYPE_CHECKING:
    from fe_ste.elasticity.flank import FlankCompliance


class ContactError(RuntimeError):
    """A contact position that could not be solved; the message says why."""


class FlankPair(NamedTuple):
    """Numbers of the rigid kinematics of two conjugate flanks; lengths in m, angles in rad."""

    base_radius_1: float
    base_radius_2: float
    centre_distance: float
    working_involute: float
    working_roll: float
    pitch_1: float
    pitch_2: float
    twist_1: float
    twist_2: float
    base_helix_cosine: float
    kind: float  # +1 external pair, -1 internal pair
    form_roll_1: float
    tip_roll_1: float
    tip_radius_2: float
    root_radius_2: float  # of the circle that ends contact towards the root of gear 2; 0 or infinite for none

    @classmethod
    def from_pair(cls, pair: GearPair, form_roll: float, tip_roll: float) -> FlankPair:
        """Collect the numbers of `pair`; `form_roll` and `tip_roll` bound the flank of gear 1.

        Where a flank ends in an edge, at a chamfer of the tip or at a relieved root, contact ends there as well.
        """
        pinion = pair.pinion
        gear = pair.gear
        working_angle = pair.working_pressure_angle
        inner_radius_2 = math.inf if gear.internal else 0.0
        return cls(
            base_radius_1=pinion.base_radius,
            base_radius_2=gear.base_radius,
            centre_distance=pair.centre_distance,
            working_involute=math.tan(working_angle) - working_angle,
            working_roll=math.tan(working_angle),
            pitch_1=pinion.angular_pitch,
            pitch_2=gear.angular_pitch,
            twist_1=math.tan(pinion.base_helix_angle) / pinion.base_radius,
            twist_2=math.tan(gear.base_helix_angle) / gear.base_radius,
            base_helix_cosine=math.cos(pinion.base_helix_angle),
            kind=-1.0 if gear.internal else 1.0,
            form_roll_1=max(form_roll, pinion.root_form_roll_length / pinion.base_radius)
            if pinion.has_relieved_root
            else form_roll,
            tip_roll_1=min(tip_roll, pinion.tip_form_roll_length / pinion.base_radius)
            if pinion.tip_form_diameter is not None
            else tip_roll,
            tip_radius_2=gear.tip_form_radius,
            root_radius_2=gear.root_form_radius if gear.has_relieved_root else inner_radius_2,
        )


@compiled
def _polar_on_gear_2(pair: FlankPair, roll: float, axial: float, tooth: int, rotation: float) -> tuple[float, float]:
    """Radius and polar angle, about the axis of gear 2, of a flank point of gear 1."""
    radius = pair.base_radius_1 * math.sqrt(1.0 + roll * roll)
    # Polar angle on gear 1: zero at the pitch point, inv(alpha_w) - inv(alpha) along the involute, with the helix.
    angle = pair.working_involute - (roll - math.atan(roll)) + rotation + tooth * pair.pitch_1 + pair.twist_1 * axial
    # Gear 2's own frame has its x axis towards the pitch point: for an external gear it is turned by pi.
    x = pair.centre_distance - pair.kind * radius * math.cos(angle)
    y = -pair.kind * radius * math.sin(angle)
    return math.sqrt(x * x + y * y), math.atan2(y, x)


@compiled
def rigid_gap(pair: FlankPair, roll: float, axial: float, tooth: int, rotation: float) -> tuple[float, float]:
    """Gap between a flank point of gear 1 and the unmodified flank of gear 2, along the contact normal.

    The gap is the arc by which gear 2 would have to turn to touch the point, as a length on the normal: exact, with
    the sides of the teeth, tip corners and centre distance as they are.

    Parameters
    ----------
    roll : roll angle of the point on gear 1, rad
    axial : its axial position, m
    tooth : tooth pair
    rotation : rotation of gear 1, rad; gear 2 is where it rolls with it

    Returns
    -------
    gap : m; infinite inside the base circle of gear 2
    gear_roll : roll angle on gear 2 at the point's radius, rad
    """
    radius, angle = _polar_on_gear_2(pair, roll, axial, tooth, rotation)
    # r = r_b sqrt(1 + roll^2), solved for the roll angle.
    square = (radius / pair.base_radius_2) ** 2 - 1.0
    if square <= 0.0:
        return math.inf, 0.0
    gear_roll = math.sqrt(square)
    # External gears turn against each other, an internal one with its pinion, in the ratio of the pitches.
    rolled = -pair.kind * (rotation * pair.pitch_2 / pair.pitch_1 + tooth * pair.pitch_2)
    flank = pair.working_involute - (gear_roll - math.atan(gear_roll)) + rolled + pair.twist_2 * axial
    # An angle times the base radius is a length on the transverse line of action; the normal leans by beta_b from it.
    return pair.kind * pair.base_radius_2 * (angle - flank) * pair.base_helix_cosine, gear_roll


@compiled
def circle_limit(pair: FlankPair, radius: float, axial: float, tooth: int, rotation: float) -> float:
    """Return the roll angle on gear 1 at a circle of gear 2, by bisection within the flank of gear 1.

    At the tip circle this is the smallest roll angle that gear 2 reaches, at the circle where its flank ends at the
    root the largest.
    """
    low = pair.form_roll_1
    high = pair.tip_roll_1
    if pair.kind * (_polar_on_gear_2(pair, low, axial, tooth, rotation)[0] - radius) <= 0.0:
        return low
    if pair.kind * (_polar_on_gear_2(pair, high, axial, tooth, rotation)[0] - radius) >= 0.0:
        return high
    for _ in range(60):  # halves the interval down to rounding
        middle = 0.5 * (low + high)
        if pair.kind * (_polar_on_gear_2(pair, middle, axial, tooth, rotation)[0] - radius) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def pinion_flank_points(pair: GearPair, roll: Floats, tooth: Integers, axial: Floats, rotation: float) -> Floats:
    """Points (..., 3) on the flanks of gear 1, m, from its axis; arguments as of `rigid_gap`, which broadcast."""
    pinion = pair.pinion
    working = pair.working_pressure_angle
    twist = math.tan(pinion.base_helix_angle) / pinion.base_radius
    turned = rotation + tooth * pinion.angular_pitch + twist * axial
    polar = (math.tan(working) - working) - (roll - np.arctan(roll)) + turned
    radius = pinion.base_radius * np.sqrt(1.0 + roll**2)
    return np.stack([radius * np.cos(polar), radius * np.sin(polar), np.broadcast_to(axial, radius.shape)], axis=-1)


#: A cell cut by a tip edge to less than this part of its width is joined to its neighbour: so narrow a cell would
#: have a pressure of its own that is all rounding.
_LEAST_CELL = 0.2


@dataclass(frozen=True)
class ContactSettings:
    """Discretisation of the contact."""

    slices: int = 48
    """Slices along the common face width."""
    cells: int = 9
    """Cells of a slice across the window that travels with the contact line."""
    window: float = 1.8
    """Half width of that window in Hertzian half widths at the largest mean line load."""

    def __post_init__(self) -> None:
        """Refuse what cannot resolve a contact."""
        for key, least in (("slices", 3), ("cells", 3), ("window", 1.0)):
            if not getattr(self, key) >= least:
                raise ValueError(f"contact setting {key} = {getattr(self, key)}: must be at least {least}")


@compiled
def _lay_cells(
    pair: FlankPair, rotation: float, teeth: Integers, axial: Floats, half_window: float, count: int
) -> tuple[Integers, Integers, Floats, Floats, Floats, Floats, Booleans, Floats]:
    """Cells around the contact lines, in the order of the attributes of `Cells`; arc lengths for rolls on gear 1.

    Arc lengths u = r_b roll^2 / 2 run along the transverse involute of gear 1.
    """
    most = len(teeth) * len(axial) * count
    tooth_of = np.empty(most, np.int64)
    slice_of = np.empty(most, np.int64)
    middle = np.empty(most)
    half = np.empty(most)
    gap = np.empty(most)
    gear_roll = np.empty(most)
    offset = np.empty(most)
    cut = np.zeros(most, np.bool_)
    edges = np.empty(count + 1)
    step = 2.0 * half_window / count
    used = 0
    for tooth in teeth:
        for layer in range(len(axial)):
            # The contact line: roll grows with the rotation, by a pitch from tooth to tooth and along the helix.
            line = pair.working_roll + rotation + tooth * pair.pitch_1 + pair.twist_1 * axial[layer]
            # Gear 1's own tip bounds the window above, the tip of gear 2 below; where a flank ends in an edge towards
            # its root, this bounds it likewise.
            lowest_roll = circle_limit(pair, pair.tip_radius_2, axial[layer], tooth, rotation)
            highest_roll = pair.tip_roll_1
            if 0.0 < pair.root_radius_2 < math.inf:
                highest_roll = circle_limit(pair, pair.root_radius_2, axial[layer], tooth, rotation)
            bottom = 0.5 * pair.base_radius_1 * lowest_roll**2
            top = 0.5 * pair.base_radius_1 * highest_roll**2
            if top - bottom < step:
                continue
            # Elastic teeth touch a little before and after the path of contact: the window then stays at the edge.
            line = min(max(line, lowest_roll), highest_roll)
            centre = 0.5 * pair.base_radius_1 * line**2
            number = 0
            for edge in range(count + 1):
                at = centre - half_window + edge * step
                at = min(max(at, bottom), top)
                if number == 0 or at > edges[number - 1]:
                    edges[number] = at
                    number += 1
            if number > 2 and edges[1] - edges[0] < _LEAST_CELL * step:
                for edge in range(1, number - 1):
                    edges[edge] = edges[edge + 1]
                number -= 1
            if number > 2 and edges[number - 1] - edges[number - 2] < _LEAST_CELL * step:
                edges[number - 2] = edges[number - 1]
                number -= 1
            for cell in range(number - 1):
                mean = 0.5 * (edges[cell] + edges[cell + 1])
                roll = math.sqrt(2.0 * mean / pair.base_radius_1)
                distance, other = rigid_gap(pair, roll, axial[layer], tooth, rotation)
                tooth_of[used], slice_of[used] = tooth, layer
                middle[used], half[used] = mean, 0.5 * (edges[cell + 1] - edges[cell])
                gap[used], gear_roll[used] = distance, other
                cut[used] = edges[cell] == bottom or edges[cell + 1] == top
                offset[used] = (mean - centre) / step
                used += 1
    return (
        tooth_of[:used], slice_of[:used], middle[:used], gear_roll[:used], half[:used], gap[:used], cut[:used],
        offset[:used],
    )  # fmt: skip


@dataclass(frozen=True)
class Cells(ReprMixin):
    """Contact cells of one position."""

    tooth: Integers
    layer: Integers
    """(n,) tooth pair and slice."""
    roll: Floats
    gear_roll: Floats
    """(n,) roll angles of the middle on both gears, rad."""
    half_across: Floats
    """(n,) half width along the profile, m."""
    gap: Floats
    """(n,) rigid gap of the unmodified flanks, m."""
    cut: Booleans
    """(n,) whether a tip edge bounds the cell."""
    offset: Floats
    """(n,) distance of the middle from the contact line, or from the tip edge where that line is off the flanks, in
    cells."""

    def select(self, keep: Booleans) -> Cells:
        """Return the cells for which `keep` holds."""
        return Cells(*(getattr(self, name)[keep] for name in self.__dataclass_fields__))

    def _line(self) -> str:
        tooth_pairs = np.unique(self.tooth)
        cut = np.count_nonzero(self.cut)
        return f": {len(self.tooth)} on {len(tooth_pairs)} tooth pairs, {cut} cut by a tip edge"


def lay_cells(
    pair: FlankPair, rotation: float, teeth: Integers, axial: Floats, half_window: float, count: int
) -> Cells:
    """Lay the cells of all `teeth` around their contact lines at one rotation of gear 1."""
    cells = _lay_cells(pair, rotation, teeth, axial, half_window, count)
    tooth, layer, middle, gear_roll, half, gap, cut, offset = cells
    return Cells(tooth, layer, np.sqrt(2.0 * middle / pair.base_radius_1), gear_roll, half, gap, cut, offset)


Flanks: TypeAlias = "tuple[FlankCompliance, FlankCompliance]"
"""Loaded flanks of gear 1 and gear 2."""

#: Part of a flank, in roll, within which contact counts as being at the form circle.
_AT_FORM_CIRCLE = 0.01


def reaches_form_circle(flanks: Flanks, cells: Cells, force: Floats) -> bool:
    """Whether loaded cells lie at or beyond a form diameter, where the involute ends and the fillet begins."""
    touching = force > 0.0
    for flank, roll in _flanks_with_fillets(flanks, cells):
        # How far points lie on the flank's side of the form diameter.
        form = _form_roll(flank)
        margin = form - roll[touching] if flank.gear.internal else roll[touching] - form
        if (margin < _AT_FORM_CIRCLE * np.ptp(flank.roll)).any():
            return True
    return bool((_parts_beyond(flanks, cells)[touching] > 0.0).any())


def share_beyond(flanks: Flanks, cells: Cells, force: Floats) -> float:
    """Share of the load on cells beyond the form diameters; of a cell divided by one of them, the part beyond."""
    return float(_parts_beyond(flanks, cells) @ force / force.sum())


def cut_at_form_circles(kinematics: FlankPair, flanks: Flanks) -> FlankPair:
    """Return the kinematics of flanks with contact truncated at both form diameters; on gear 1 it always is."""
    gear = flanks[1].gear
    if gear.has_relieved_root:
        return kinematics
    return kinematics._replace(root_radius_2=gear.base_radius * math.hypot(1.0, _form_roll(flanks[1])))


def continued_involutes(kinematics: FlankPair, flanks: Flanks) -> FlankPair:
    """Return the kinematics of involutes extended beyond their form diameters, on gear 1 to its base circle.

    With root relief the flank, and contact with it, ends at an edge.
    """
    if flanks[0].gear.has_relieved_root:
        return kinematics
    return kinematics._replace(form_roll_1=0.0)


def _flanks_with_fillets(flanks: Flanks, cells: Cells) -> list[tuple[FlankCompliance, Floats]]:
    """Flanks that go over into a fillet, with the roll angles of the cells on them."""
    both = zip(flanks, (cells.roll, cells.gear_roll), strict=True)
    return [(flank, roll) for flank, roll in both if not flank.gear.has_relieved_root]


def _form_roll(flank: FlankCompliance) -> float:
    return float(flank.roll[-1] if flank.gear.internal else flank.roll[0])


def _parts_beyond(flanks: Flanks, cells: Cells) -> Floats:
    """Part of each cell beyond a form diameter.

    A cell has the same width on both flanks; arc lengths are r_b roll^2 / 2.
    """
    beyond = np.zeros(len(cells.roll))
    for flank, roll in _flanks_with_fillets(flanks, cells):
        outward = -1.0 if flank.gear.internal else 1.0
        depth = outward * 0.5 * flank.gear.base_radius * (_form_roll(flank) ** 2 - roll**2)
        beyond = np.maximum(beyond, np.clip(0.5 * (1.0 + depth / cells.half_across), 0.0, 1.0))
    return beyond
