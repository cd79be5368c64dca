"""Contact at one position in the mesh cycle (pmc) under one load: search window and solution.

The contact area is not known in advance. So cells are placed in a window around each contact line, cells too far apart
to touch are omitted, and the problem is solved; if contact then fills the window, or omitted cells would touch, the
start is corrected and the search continues. Frame and signs as in `fe_ste.contact.kinematics`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.contact.complementarity import ContactSolution, solve_complementarity
from fe_ste.contact.compliance import compliance_matrix
from fe_ste.contact.kinematics import (
    Cells,
    ContactError,
    FlankPair,
    continued_involutes,
    cut_at_form_circles,
    lay_cells,
    reaches_form_circle,
    share_beyond,
)
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.states import ContactState, SearchStart, StateAxes

if TYPE_CHECKING:
    import xarray as xr

#: Cells further apart than this many approaches in the unloaded position cannot touch.
_GAP_REACH = 1.3

#: Part of its cells by which a window that contact fills grows at either side.
_WINDOW_GROWTH = 0.2

#: Cells across a contact line among which the first touch is looked for, odd: the middle one is on the line; and their
#: width in normal modules, which misses the first touch of modified flanks by some nanometres.
_UNLOADED_CELLS = 101
_UNLOADED_WIDTH = 3e-3

#: Gaps this close to the least one touch at the same time, m.
_TOUCHING = 1e-12
_WINDOW_ATTEMPTS = 20

#: Distances from the contact line, in cells, that an address tells apart.
_DISTANCES = 64


def hertz_half_width(pair: GearPair, line_load: float) -> float:
    """Half width of the contact of the two flanks at the pitch point under a line load (N/m), m.

    Notes
    -----
    b = sqrt(4 w R / (pi E*)), 1/R the sum of the normal curvatures, 1/E* the sum of (1 - nu^2)/E (Johnson, Contact
    Mechanics, eq. 4.43).
    """
    roll = math.tan(pair.working_pressure_angle)
    cosine = math.cos(pair.pinion.base_helix_angle)
    sign = -1.0 if pair.gear.internal else 1.0
    curvature = cosine / roll * (1.0 / pair.pinion.base_radius + sign / pair.gear.base_radius)
    compliance = sum((1 - g.material.poissons_ratio**2) / g.material.youngs_modulus for g in (pair.pinion, pair.gear))
    return math.sqrt(4.0 * line_load * compliance / (math.pi * curvature))


@lru_cache(maxsize=64)
def least_contact_length(pair: GearPair) -> float:
    """Minimum total length of the contact lines over the mesh cycle, m."""
    axial = np.linspace(-0.5, 0.5, 401) * pair.face_width
    pitch = pair.transverse_base_pitch
    # A helix shifts the contact along the path by tan(beta_b) times the axial position; a tooth more by a base pitch.
    lines = pair.path_pitch_point + math.tan(pair.pinion.base_helix_angle) * axial
    reach = math.ceil(pair.total_contact_ratio) + 1
    lines = lines + pitch * np.arange(-reach, reach + 1)[:, None]
    shift = np.arange(100)[:, None, None] / 100 * pitch
    inside = (lines + shift > pair.path_start) & (lines + shift < pair.path_end)
    length = inside.mean(axis=2).sum(axis=1) * pair.face_width / math.cos(pair.pinion.base_helix_angle)
    return float(length.min())


def contact_state(compliance: PairCompliance, torque: float, pmc: float, misalignment: float = 0.0) -> ContactState:
    """Solve the contact of one position.

    Parameters
    ----------
    torque : static torque on gear 1, N m, positive
    pmc : position in the mesh cycle
    misalignment
        Relative rotation of the axes in the plane of action, rad, positive where it opens the gap at the +z end.

    Raises
    ------
    ContactError
        If the contact does not settle.
    """
    (state,) = contact_states(compliance, torque, pmc, np.array([misalignment]), [new_start(compliance, torque)])
    if isinstance(state, ContactError):
        raise state
    return state


def contact_states(
    compliance: PairCompliance, torque: float, pmc: float, misalignments: Floats, starts: list[SearchStart]
) -> list[ContactState | ContactError]:
    """Solve the contact of one position under several misalignments, which share the compliance of the cells.

    Parameters
    ----------
    torque : static torque on gear 1, N m, positive
    pmc : position in the mesh cycle
    misalignments : (m,) rad
    starts : one for each misalignment; replaced in place by what was found

    Returns
    -------
    for each misalignment the state, or the reason of the failure

    Notes
    -----
    Contact that reaches a form diameter is solved again, truncated there, and once more on extended involutes: see
    `fe_ste.contact.kinematics`.
    """
    pair = compliance.pair
    roll = compliance.flanks[0].roll
    kinematics = FlankPair.from_pair(pair, roll[0], roll[-1])
    states = _searched(compliance, kinematics, torque, pmc, misalignments, starts)
    at_ends = [
        index
        for index, state in enumerate(states)
        if isinstance(state, ContactState) and reaches_form_circle(compliance.flanks, state.cells, state.solution.force)
    ]
    if at_ends:
        ends = (cut_at_form_circles(kinematics, compliance.flanks), continued_involutes(kinematics, compliance.flanks))
        cut, whole = (
            _searched(compliance, end, torque, pmc, misalignments[at_ends], [starts[index] for index in at_ends])
            for end in ends
        )
        for index, cut_state, whole_state in zip(at_ends, cut, whole, strict=True):
            states[index] = _counted(compliance, cut_state, whole_state)
    return states


def _counted(
    compliance: PairCompliance, cut: ContactState | ContactError, whole: ContactState | ContactError
) -> ContactState | ContactError:
    """State truncated at the form diameters, with the share of the load beyond them on extended involutes."""
    for state in (cut, whole):
        if isinstance(state, ContactError):
            return ContactError(f"contact extends beyond the form diameter, where the involute ends: {state}")
    assert isinstance(cut, ContactState) and isinstance(whole, ContactState)
    return replace(cut, truncated_load=share_beyond(compliance.flanks, whole.cells, whole.solution.force))


def _searched(
    compliance: PairCompliance,
    kinematics: FlankPair,
    torque: float,
    pmc: float,
    misalignments: Floats,
    starts: list[SearchStart],
) -> list[ContactState | ContactError]:
    """Search the contact of one position on flanks that end as `kinematics` has it; parameters of `contact_states`."""
    search = _ContactSearch(compliance, kinematics, torque, pmc, misalignments, starts)
    for attempt in range(_WINDOW_ATTEMPTS):
        pending = search.pending()
        if not pending:
            break
        window = search.window(pending, margin=1 + 2 * attempt)
        for group in window.groups(compliance.reach):
            search.solve(window, group)
    for index in search.pending():
        message = f"the contact is wider than the flanks, or found no approach, at torque {torque:g} N m"
        search.states[index] = ContactError(message)
    return [search.states[index] for index in range(len(starts))]


@dataclass(frozen=True)
class _Window:
    """Cells laid at one position, with the gaps of several misalignments over them."""

    cells: Cells
    address: Integers
    """(n,) tooth pair, slice and distance from the contact line, in cells, in one number."""
    gap: dict[int, Floats]
    near: dict[int, Booleans]
    """Misalignment's index -> gap (n,), m, and which cells are near enough to touch."""
    expected: Booleans
    """(n,) where contact is looked for under any misalignment: around that of a state nearby."""

    def groups(self, reach: int) -> list[list[int]]:
        """Misalignments whose cells are few enough tooth pairs to share a compliance matrix."""
        if not self.near:
            return []
        together = np.any(list(self.near.values()), axis=0)
        if np.ptp(self.cells.tooth[together]) <= reach:
            return [list(self.near)]
        return [[index] for index in self.near]


class _ContactSearch:
    """The search for the contact of one position under several misalignments."""

    def __init__(
        self,
        compliance: PairCompliance,
        kinematics: FlankPair,
        torque: float,
        pmc: float,
        misalignments: Floats,
        starts: list[SearchStart],
    ) -> None:
        self.compliance, self.pmc, self.misalignments, self.starts = compliance, pmc, misalignments, starts
        pair = compliance.pair
        self.load = normal_load(pair, torque)
        self.kinematics = kinematics
        self.rotation = pmc * pair.pinion.angular_pitch
        contact = compliance.contact
        half_width = hertz_half_width(pair, self.load / least_contact_length(pair))
        self.cell_width = 2 * contact.window * half_width / contact.cells
        self.too_deep = [math.inf] * len(starts)
        self.states: dict[int, ContactState | ContactError] = {}

    def pending(self) -> list[int]:
        """Misalignments whose state is not found yet."""
        return [index for index in range(len(self.starts)) if index not in self.states]

    def window(self, pending: list[int], margin: int) -> _Window:
        """Lay the cells that the states of `pending` need, `margin` around the contact that is expected."""
        count = max(self.starts[index].cells for index in pending)
        compliance = self.compliance
        axial = self.compliance.axial
        cells = lay_cells(self.kinematics, self.rotation, compliance.teeth, axial, count * self.cell_width / 2, count)
        if not cells.tooth.size:  # wider than the flanks
            return _Window(cells, cells.tooth, {}, {}, cells.cut)
        removed = cells.gap + _modification_gap(compliance, cells)
        gap_per_misalignment = axial[cells.layer] * math.cos(compliance.pair.pinion.base_helix_angle)
        gap = {index: removed + self.misalignments[index] * gap_per_misalignment for index in pending}
        near = {index: g - g.min() < _GAP_REACH * self.starts[index].depth for index, g in gap.items()}
        row = (cells.tooth - self.compliance.teeth[0]) * len(self.compliance.axial) + cells.layer
        place = np.clip(np.floor(cells.offset + 0.25) + _DISTANCES // 2, 0, _DISTANCES - 1).astype(np.int64)
        address = np.asarray(row * _DISTANCES + place, dtype=np.int64)
        expected = self._expected(pending, margin)[address] | _smallest_gap_cells(cells, removed)
        return _Window(cells, address, gap, near, expected)

    def _expected(self, pending: list[int], margin: int) -> Booleans:
        """Whether contact is looked for at each address: around where the states began from have it."""
        shape = (len(self.compliance.teeth), len(self.compliance.axial), _DISTANCES)
        expected = np.zeros(shape, dtype=np.bool_)
        for index in pending:
            touching = self.starts[index].touching
            if touching is None:
                return np.ones(expected.size, dtype=np.bool_)
            expected.reshape(-1)[touching] = True
        margin += max(self.starts[index].moved for index in pending)
        _widen(expected, axis=1, steps=margin)
        _widen(expected, axis=2, steps=margin + 1)
        return expected.reshape(-1)

    def solve(self, window: _Window, group: list[int]) -> None:
        """Solve the states of `group`; one that needs other cells stays pending, with a start that asks for them."""
        near = np.any([window.near[index] for index in group], axis=0)
        if np.ptp(window.cells.tooth[near]) > self.compliance.reach:
            # More tooth pairs than can touch at once were reckoned to be near: cells further apart are left out.
            index = group[0]
            start = self.starts[index]
            self.too_deep[index] = start.depth
            self.starts[index] = replace(start, depth=0.7 * start.depth)
            return
        near &= window.expected
        end, border = (marked[near] for marked in _ends(window.cells, near))
        cells = window.cells.select(near)
        address = window.address[near]
        compliance = self.compliance
        matrix = compliance_matrix(cells, self.kinematics, compliance.axial, compliance.flanks, compliance.regular)
        for index in group:
            gap = window.gap[index][near]
            try:
                solution = solve_complementarity(matrix, gap, self.load, self._guess(index, gap, address))
                carrying = solution.force > 0
                if self._settled(index, solution, gap, end) and not carrying[border].any():
                    half_along = 0.5 * self.compliance.slice_width / self.kinematics.base_helix_cosine
                    self.states[index] = ContactState(
                        self.pmc, self.load, cells, solution, solution.force / (4.0 * cells.half_across * half_along)
                    )
                self.starts[index] = replace(self.starts[index], touching=address[carrying])
            except ContactError as error:
                self.states[index] = error

    def _guess(self, index: int, gap: Floats, address: Integers) -> Booleans:
        start = self.starts[index]
        if start.touching is None:
            return np.asarray(gap - gap.min() < 0.7 * start.depth)
        return np.isin(address, start.touching)

    def _settled(self, index: int, solution: ContactSolution, gap: Floats, end: Booleans) -> bool:
        """Whether all cells that may touch were there; else change the start."""
        start = self.starts[index]
        depth = solution.approach - gap.min()
        if depth > 0.95 * _GAP_REACH * start.depth:
            # Cells were left out that touch at this approach: look deeper, but not to where too many teeth took part.
            if depth >= self.too_deep[index]:
                most = self.compliance.reach + 1
                raise ContactError(f"contact spreads over more than {most} tooth pairs: the torque is too large")
            self.starts[index] = replace(start, depth=min(1.2 * depth, 0.5 * (depth + self.too_deep[index])))
            return False
        # Load at the end of the window would go on beyond it.
        if (solution.force[end] > 0).any():
            self.starts[index] = replace(start, cells=start.cells + 2 * math.ceil(_WINDOW_GROWTH * start.cells))
            return False
        self.starts[index] = replace(start, depth=depth)
        return True


def _modification_gap(compliance: PairCompliance, cells: Cells) -> Floats:
    """Gap over the cells, along the normal, that modifications and deviations add to the conjugate flanks."""
    axial = compliance.axial[cells.layer]
    gap = np.zeros(len(axial))
    if compliance.tooth_gap is not None:
        cosine = math.cos(compliance.pair.pinion.base_helix_angle)
        gap = gap + cosine * compliance.tooth_gap[cells.tooth - compliance.teeth[0]]
    gears = (compliance.pair.pinion, compliance.pair.gear)
    for gear, roll, modification in zip(gears, (cells.roll, cells.gear_roll), compliance.modifications, strict=True):
        radius = gear.base_radius * np.sqrt(1.0 + roll**2)
        gap = gap + modification.gap(gear, np.clip(radius, *flank_radii(gear)), axial)
    return gap


def unloaded_states(compliance: PairCompliance, axes: StateAxes) -> xr.Dataset:
    """Compute where the rigid flanks first touch, the limit of the transmission error at no load.

    Returns
    -------
    over (pmc, centre_distance, misalignment): unloaded_ste (m) and unloaded_centre (m, axial position)
    """
    import xarray as xr

    shape = (axes.positions, len(axes.centre_distance), len(axes.misalignment))
    ste = np.empty(shape)
    centre = np.empty(shape)
    pair = compliance.pair
    roll = compliance.flanks[0].roll
    cosine = math.cos(pair.pinion.base_helix_angle)
    width = _UNLOADED_CELLS * _UNLOADED_WIDTH * pair.pinion.normal_module
    for c, distance in enumerate(axes.centre_distance):
        at_distance = compliance.at_centre_distance(float(distance))
        kinematics = FlankPair.from_pair(at_distance.pair, roll[0], roll[-1])
        for p in range(axes.positions):
            rotation = p / axes.positions * pair.pinion.angular_pitch
            cells = lay_cells(kinematics, rotation, at_distance.teeth, at_distance.axial, width / 2, _UNLOADED_CELLS)
            removed = cells.gap + _modification_gap(at_distance, cells)
            axial = at_distance.axial[cells.layer]
            for m, misalignment in enumerate(axes.misalignment):
                gap = removed + misalignment * axial * cosine
                ste[p, c, m] = gap.min() / cosine
                centre[p, c, m] = axial[gap < gap.min() + _TOUCHING].mean()
    names = ("pmc", "centre_distance", "misalignment")
    meaning = {
        "unloaded_ste": "transmission error at which the flanks first touch, on the transverse line of action",
        "unloaded_centre": "axial position of the first touch: derivative of unloaded_ste by misalignment",
    }
    values = {"unloaded_ste": ste, "unloaded_centre": centre}
    return xr.Dataset({n: (names, v, {"units": "m", "long_name": meaning[n]}) for n, v in values.items()})


def flank_radii(gear: Gear) -> tuple[float, float]:
    """Return the smallest and the largest radius of a gear's flank, m."""
    return min(gear.form_radius, gear.tip_radius), max(gear.form_radius, gear.tip_radius)


def new_start(compliance: PairCompliance, torque: float) -> SearchStart:
    """Start of a search that knows no other state."""
    stiffness = 10e9 * compliance.pair.face_width  # two thirds of a usual mesh stiffness: may be too deep
    return SearchStart(compliance.contact.cells, normal_load(compliance.pair, torque) / stiffness)


def _ends(cells: Cells, looked: Booleans) -> tuple[Booleans, Booleans]:
    """Cells next to which contact could continue undetected: at the window's end, or next to one not in `looked`."""
    group = cells.tooth * (cells.layer.max() + 1) + cells.layer
    first = np.diff(group, prepend=group[0] - 1) != 0
    last = np.append(first[1:], True)
    before = np.append(True, looked[:-1])
    after = np.append(looked[1:], True)
    return np.asarray((first | last) & ~cells.cut), np.asarray((~first & ~before) | (~last & ~after))


def _smallest_gap_cells(cells: Cells, gap: Floats) -> Booleans:
    """In each slice the cell of the smallest gap, where contact begins under any misalignment, and its neighbours."""
    group = cells.tooth * (cells.layer.max() + 1) + cells.layer
    starts = np.flatnonzero(np.diff(group, prepend=group[0] - 1))
    least = np.repeat(np.minimum.reduceat(gap, starts), np.diff(starts, append=len(gap))) == gap
    around = least.copy()
    around[1:] |= least[:-1]
    around[:-1] |= least[1:]
    return np.asarray(around)


def _widen(chosen: Booleans, axis: int, steps: int) -> None:
    """Choose the neighbours along an axis, too, up to some steps away."""
    moved = np.moveaxis(chosen, axis, 0)
    for _ in range(steps):
        ahead = moved[:-1].copy()
        behind = moved[1:].copy()
        moved[1:] |= ahead
        moved[:-1] |= behind


def normal_load(pair: GearPair, torque: float) -> float:
    """Sum of the normal contact forces under a torque on gear 1, N: all contacts have the lever r_b cos(beta_b)."""
    return torque / (pair.pinion.base_radius * math.cos(pair.pinion.base_helix_angle))


# Hertzian pressure at the pitch point, the reference for the maximum pressure of a table


def pitch_point_pressure(pair: GearPair, torque: float) -> float:
    """Return the maximum pressure at the pitch point with even load over the shortest contact lines, Pa.

    Parameters
    ----------
    torque : on gear 1, N m, positive

    Notes
    -----
    p = 2 w / (pi b) with the line load w and the half width b of two cylinders (Johnson, Contact Mechanics, eqs. 4.43
    and 4.45). ISO 6336-2 spreads the load likewise, by its contact ratio factor. Tip edges and uneven loads come on
    top.

    Examples
    --------
    A tenth of the load, a third of the pressure:

    >>> from fe_ste.geometry.gears import Gear
    >>> size = {"normal_module": 0.003, "face_width": 0.03, "held_diameter": 0.03}
    >>> pinion, gear = Gear(name="one", teeth=24, **size), Gear(name="other", teeth=36, **size)
    >>> pair = GearPair(name="pair", pinion=pinion, gear=gear, centre_distance=0.09)
    >>> round(pitch_point_pressure(pair, 100.0) / pitch_point_pressure(pair, 10.0), 6)
    3.162278
    """
    line_load = normal_load(pair, torque) / least_contact_length(pair)
    return 2.0 * line_load / (math.pi * hertz_half_width(pair, line_load))
