"""Static transmission error of a gear pair over the mesh cycle.

Signs. Gear 1 is held, gear 2 turns about its axis under a torque that presses its flank on gear 1. The static
transmission error is the rotation of gear 2 as a length on the transverse line of action, from the position in which
the unmodified rigid flanks would roll: positive, the loaded gear yields. ``pmc`` is the part of a mesh cycle by which
gear 1 has turned in its driving sense from where tooth pair 0 touches at the pitch point in the middle of the common
face width.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fe_ste.contact import (
    Cells,
    ContactError,
    ContactSettings,
    ContactSolution,
    FlankPair,
    SlicedCompliance,
    compliance_matrix,
    lay_cells,
    solve_complementarity,
)
from fe_ste.elasticity import FlankCompliance, flank_compliance
from fe_ste.gears import Gear, GearPair
from fe_ste.hexmesh import MeshSettings
from fe_ste.modifications import FlankModification
from fe_ste.sparse import Backend
from fe_ste.threads import one_dense_thread

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

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
#: Places across the window that an address tells apart.
_PLACES = 64


@dataclass(frozen=True)
class PairCompliance:
    """A gear pair with the compliance of both loaded flanks: all that does not depend on position or load.

    Attributes
    ----------
    pair : GearPair
    flanks : tuple of FlankCompliance
        Gear 1, gear 2.
    contact : ContactSettings
    axial : ndarray (slices,)
        Middle of the contact slices, m.
    teeth : ndarray
        Tooth pairs that may touch.
    reach : int
        Largest difference of tooth pairs in contact at once.
    sliced : tuple of SlicedCompliance
    modifications : tuple of FlankModification
        Gear 1, gear 2.
    tooth_gap : ndarray, optional
        Gap of each of `teeth` on the transverse line of action, m.
    """

    pair: GearPair
    flanks: tuple[FlankCompliance, FlankCompliance]
    contact: ContactSettings
    axial: FloatArray
    teeth: IntArray
    reach: int
    sliced: tuple[SlicedCompliance, SlicedCompliance]
    modifications: tuple[FlankModification, FlankModification] = (FlankModification(), FlankModification())
    tooth_gap: FloatArray | None = None

    @classmethod
    def from_flanks(
        cls,
        pair: GearPair,
        flanks: tuple[FlankCompliance, FlankCompliance],
        contact: ContactSettings | None = None,
    ) -> PairCompliance:
        """Prepare `pair` for contact with flanks computed before."""
        contact = contact or ContactSettings()
        edges = np.linspace(-pair.face_width / 2, pair.face_width / 2, contact.slices + 1)
        axial = (edges[1:] + edges[:-1]) / 2
        reach, outermost = _teeth_in_contact(pair, flanks)
        teeth = np.arange(-outermost, outermost + 1)
        senses = (1, 1 if pair.gear.internal else -1)
        one, two = (
            SlicedCompliance.from_flank(flank, axial, sense, teeth, reach)
            for flank, sense in zip(flanks, senses, strict=True)
        )
        return cls(pair, flanks, contact, axial, teeth, reach, (one, two))

    def at_centre_distance(self, centre_distance: float) -> PairCompliance:
        """Return the same gears at another operating centre distance."""
        return replace(self, pair=self.pair.with_centre_distance(centre_distance))

    def with_modifications(self, pinion: FlankModification, gear: FlankModification) -> PairCompliance:
        """Return the same gears with modified flanks."""
        return replace(self, modifications=(pinion, gear))

    def with_tooth_gaps(self, gaps: Mapping[int, float]) -> PairCompliance:
        """Return the same gears with some tooth pairs out of place.

        Parameters
        ----------
        gaps : mapping of int to float
            Number of the tooth pair, counted ahead of the one that touches at the pitch point at pmc 0 -> gap of its
            flanks, m on the transverse line of action, negative where they touch before the others; see
            `fe_ste.deviations`.

        Raises
        ------
        ValueError
            If a pair cannot touch in the mesh cycle.
        """
        unknown = sorted(set(gaps) - set(self.teeth.tolist()))
        if unknown:
            raise ValueError(
                f"tooth pair {unknown[0]}: only pairs {self.teeth[0]} to {self.teeth[-1]} may touch in the mesh cycle"
            )
        return replace(self, tooth_gap=np.array([gaps.get(tooth, 0.0) for tooth in self.teeth.tolist()]))

    @property
    def slice_width(self) -> float:
        """Axial width of a contact slice, m."""
        return self.pair.face_width / len(self.axial)


def _teeth_in_contact(pair: GearPair, flanks: tuple[FlankCompliance, FlankCompliance]) -> tuple[int, int]:
    """Largest difference of tooth pairs in contact at once, and outermost tooth pair that may touch.

    In a closed ring every tooth is there, and contact needs one tooth pair more on either side than the contact ratio;
    an open sector has its own teeth and no others.
    """
    reach = min([math.ceil(pair.total_contact_ratio)] + [flank.tooth_reach for flank in flanks if flank.closed])
    open_reach = [flank.tooth_reach for flank in flanks if not flank.closed]
    if open_reach:
        return min([reach, 2 * min(open_reach)]), min(open_reach)
    return reach, reach + 1


def pair_compliance(
    pair: GearPair,
    mesh: MeshSettings | None = None,
    contact: ContactSettings | None = None,
    *,
    open_teeth: int | None = None,
    incompatible_modes: bool = True,
    backend: Backend | None = None,
) -> PairCompliance:
    """Compute the compliance of both gears of `pair` by finite elements.

    Parameters
    ----------
    pair : GearPair
    mesh : MeshSettings, optional
    contact : ContactSettings, optional
    open_teeth : int, optional
        Odd number of teeth of open sectors; without it closed rings.
    incompatible_modes : bool
    backend : {"pardiso", "superlu"}, optional

    Returns
    -------
    PairCompliance
    """
    one, two = (
        flank_compliance(
            gear, side, mesh, open_teeth=open_teeth, incompatible_modes=incompatible_modes, backend=backend
        )
        for gear, side in ((pair.pinion, 1), (pair.gear, -1 if pair.gear.internal else 1))
    )
    return PairCompliance.from_flanks(pair, (one, two), contact)


@dataclass(frozen=True)
class ContactState:
    """Solved contact at one position.

    Attributes
    ----------
    pmc : float
    normal_load : float
        Sum of the normal forces, N.
    cells : Cells
    solution : ContactSolution
    pressure : ndarray (n,)
        Pa.
    """

    pmc: float
    normal_load: float
    cells: Cells
    solution: ContactSolution
    pressure: FloatArray


@dataclass
class SearchStart:
    """Where the search for a state begins: what solved states hand on. It never changes what is found.

    A window that contact fills gets more cells of the same width, cells too far apart to touch are left out only if
    they are, and the complementarity problem has one solution: so a state is the same whichever were solved before.

    Attributes
    ----------
    cells : int
        Cells of a slice across the window.
    depth : float
        Reckoned approach beyond the first touch, m.
    touching : ndarray, optional
        Addresses, relative to the contact lines, of the cells that carried load.
    """

    cells: int
    depth: float
    touching: IntArray | None = None

    def scaled(self, factor: float) -> SearchStart:
        """Return the start for `factor` times the load; the cells grow with the contact, so their addresses stay."""
        return replace(self, depth=self.depth * factor)


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
def least_contact_length(pair: GearPair, samples: int = 100) -> float:
    """Least total length of the contact lines over the mesh cycle, m."""
    axial = np.linspace(-0.5, 0.5, 401) * pair.face_width
    pitch = pair.transverse_base_pitch
    lines = pair.path_pitch_point + math.tan(pair.pinion.base_helix_angle) * axial
    reach = math.ceil(pair.total_contact_ratio) + 1
    lines = lines + pitch * np.arange(-reach, reach + 1)[:, None]
    shift = np.arange(samples)[:, None, None] / samples * pitch
    inside = (lines + shift > pair.path_start) & (lines + shift < pair.path_end)
    length = inside.mean(axis=2).sum(axis=1) * pair.face_width / math.cos(pair.pinion.base_helix_angle)
    return float(length.min())


def contact_state(compliance: PairCompliance, torque: float, pmc: float, misalignment: float = 0.0) -> ContactState:
    """Solve the contact of one position.

    Parameters
    ----------
    compliance : PairCompliance
    torque : float
        Static torque on gear 1, N m, positive.
    pmc : float
        Position in the mesh cycle.
    misalignment : float
        Relative rotation of the axes in the plane of action, rad, positive where it opens the gap at the +z end.

    Returns
    -------
    ContactState

    Raises
    ------
    ContactError
        If the contact does not settle, or leaves the flank.
    """
    (state,) = contact_states(compliance, torque, pmc, np.array([misalignment]), [new_start(compliance, torque)])
    if isinstance(state, ContactError):
        raise state
    return state


def contact_states(
    compliance: PairCompliance, torque: float, pmc: float, misalignments: FloatArray, starts: list[SearchStart]
) -> list[ContactState | ContactError]:
    """Solve the contact of one position under several misalignments, which share the compliance of the cells.

    Parameters
    ----------
    compliance : PairCompliance
    torque : float
        Static torque on gear 1, N m, positive.
    pmc : float
        Position in the mesh cycle.
    misalignments : ndarray (m,)
        rad.
    starts : list of SearchStart
        One for each misalignment; replaced in place by what was found.

    Returns
    -------
    list of ContactState or ContactError
        For each misalignment the state, or why there is none.
    """
    search = _Search(compliance, torque, pmc, misalignments, starts)
    for _ in range(_WINDOW_ATTEMPTS):
        pending = search.pending()
        if not pending:
            break
        window = search.window(pending)
        for group in window.groups(compliance.reach):
            search.solve(window, group)
    for index in search.pending():
        message = f"the contact is wider than the flanks, or found no approach, at torque {torque:g} N m"
        search.found[index] = ContactError(message)
    return [search.found[index] for index in range(len(starts))]


@dataclass(frozen=True)
class _Window:
    """Cells laid at one position, with the gaps of several misalignments over them.

    Attributes
    ----------
    cells : Cells
    end : ndarray (n,)
        Whether a cell ends the window where no tip edge does.
    address : ndarray (n,)
        Tooth pair, slice and place relative to the contact line in one number.
    gap, near : dict
        Misalignment's index -> gap (n,), m, and which cells are near enough to touch.
    """

    cells: Cells
    end: BoolArray
    address: IntArray
    gap: dict[int, FloatArray]
    near: dict[int, BoolArray]

    def groups(self, reach: int) -> list[list[int]]:
        """Misalignments whose cells are few enough tooth pairs to share a compliance matrix."""
        if not self.near:
            return []
        together = np.any(list(self.near.values()), axis=0)
        if np.ptp(self.cells.tooth[together]) <= reach:
            return [list(self.near)]
        return [[index] for index in self.near]


class _Search:
    """The search for the contact of one position under several misalignments."""

    def __init__(
        self,
        compliance: PairCompliance,
        torque: float,
        pmc: float,
        misalignments: FloatArray,
        starts: list[SearchStart],
    ) -> None:
        self.compliance, self.pmc, self.misalignments, self.starts = compliance, pmc, misalignments, starts
        pair, roll = compliance.pair, compliance.flanks[0].roll
        self.load = _normal_load(pair, torque)
        self.kinematics = FlankPair.from_pair(pair, roll[0], roll[-1])
        self.rotation = pmc * pair.pinion.angular_pitch
        self.cell_width = _cell_width(compliance, self.load)
        self.too_deep = [math.inf] * len(starts)
        self.found: dict[int, ContactState | ContactError] = {}

    def pending(self) -> list[int]:
        """Misalignments whose state is not found yet."""
        return [index for index in range(len(self.starts)) if index not in self.found]

    def window(self, pending: list[int]) -> _Window:
        """Lay the cells that the states of `pending` need."""
        count = max(self.starts[index].cells for index in pending)
        one, axial = self.compliance, self.compliance.axial
        cells = lay_cells(self.kinematics, self.rotation, one.teeth, axial, count * self.cell_width / 2, count)
        if not cells.tooth.size:  # wider than the flanks
            return _Window(cells, cells.cut, cells.tooth, {}, {})
        removed = cells.gap + _modification_gap(one, cells)
        wedge = axial[cells.layer] * math.cos(one.pair.pinion.base_helix_angle)
        gap = {index: removed + self.misalignments[index] * wedge for index in pending}
        near = {index: g - g.min() < _GAP_REACH * self.starts[index].depth for index, g in gap.items()}
        return _Window(cells, _window_ends(cells), self._addresses(cells), gap, near)

    def _addresses(self, cells: Cells) -> IntArray:
        pair, radius = self.kinematics, self.kinematics.base_radius_1
        axial = self.compliance.axial[cells.layer]
        line = pair.working_roll + self.rotation + cells.tooth * pair.pitch_1 + pair.twist_1 * axial
        from_line = 0.5 * radius * (cells.roll**2 - line * np.abs(line)) / self.cell_width
        place = np.clip(np.rint(from_line) + _PLACES // 2, 0, _PLACES - 1).astype(np.int64)
        row = (cells.tooth - self.compliance.teeth[0]) * len(self.compliance.axial) + cells.layer
        return np.asarray(row * _PLACES + place, dtype=np.int64)

    def solve(self, window: _Window, group: list[int]) -> None:
        """Solve the states of `group`; one that needs other cells stays pending, with a start that asks for them."""
        near = np.any([window.near[index] for index in group], axis=0)
        if np.ptp(window.cells.tooth[near]) > self.compliance.reach:
            self._come_nearer(group[0])
            return
        cells, address, end = window.cells.select(near), window.address[near], window.end[near]
        one = self.compliance
        matrix = compliance_matrix(cells, self.kinematics, one.axial, one.flanks, one.sliced)
        for index in group:
            gap = window.gap[index][near]
            try:
                solution = solve_complementarity(matrix, gap, self.load, self._guess(index, gap, address))
                if self._settled(index, solution, gap, end):
                    self.found[index] = self._state(cells, solution)
                    carrying = address[solution.force > 0]
                    self.starts[index] = replace(self.starts[index], touching=carrying)
            except ContactError as error:
                self.found[index] = error

    def _guess(self, index: int, gap: FloatArray, address: IntArray) -> BoolArray:
        start = self.starts[index]
        if start.touching is None:
            return np.asarray(gap - gap.min() < 0.7 * start.depth)
        return np.isin(address, start.touching)

    def _come_nearer(self, index: int) -> None:
        """Leave out cells further apart: more tooth pairs than can touch at once were reckoned to be near."""
        start = self.starts[index]
        self.too_deep[index] = start.depth
        self.starts[index] = replace(start, depth=0.7 * start.depth)

    def _settled(self, index: int, solution: ContactSolution, gap: FloatArray, end: BoolArray) -> bool:
        """Whether all cells that may touch were there; else change the start."""
        start = self.starts[index]
        depth = solution.approach - gap.min()
        if depth > 0.95 * _GAP_REACH * start.depth:
            if depth >= self.too_deep[index]:
                most = self.compliance.reach + 1
                raise ContactError(f"contact spreads over more than {most} tooth pairs: the torque is too large")
            self.starts[index] = replace(start, depth=min(1.2 * depth, 0.5 * (depth + self.too_deep[index])))
            return False
        if (solution.force[end] > 0).any():
            self.starts[index] = replace(start, cells=start.cells + 2 * math.ceil(_WINDOW_GROWTH * start.cells))
            return False
        self.starts[index] = replace(start, depth=depth)
        return True

    def _state(self, cells: Cells, solution: ContactSolution) -> ContactState:
        _check_on_flanks(self.compliance, cells, solution.force)
        half_along = 0.5 * self.compliance.slice_width / self.kinematics.base_helix_cosine
        return ContactState(
            self.pmc, self.load, cells, solution, solution.force / (4.0 * cells.half_across * half_along)
        )


def _modification_gap(compliance: PairCompliance, cells: Cells) -> FloatArray:
    """Gap over the cells, along the normal, that modifications and deviations add to the conjugate flanks."""
    axial = compliance.axial[cells.layer]
    gap = np.zeros(len(axial))
    if compliance.tooth_gap is not None:
        cosine = math.cos(compliance.pair.pinion.base_helix_angle)
        gap = gap + cosine * compliance.tooth_gap[cells.tooth - compliance.teeth[0]]
    gears = (compliance.pair.pinion, compliance.pair.gear)
    for gear, roll, modification in zip(gears, (cells.roll, cells.gear_roll), compliance.modifications, strict=True):
        radius = gear.base_radius * np.sqrt(1.0 + roll**2)
        gap = gap + modification.gap(gear, np.clip(radius, *_flank_radii(gear)), axial)
    return gap


def unloaded_states(compliance: PairCompliance, axes: StateAxes) -> xr.Dataset:
    """Compute where the rigid flanks first touch, the limit of the transmission error at no load.

    Returns
    -------
    xarray.Dataset
        Over (pmc, centre_distance, misalignment): unloaded_ste (m) and unloaded_centre (m, axial position).
    """
    shape = (axes.positions, len(axes.centre_distance), len(axes.misalignment))
    ste, centre = np.empty(shape), np.empty(shape)
    pair, roll = compliance.pair, compliance.flanks[0].roll
    cosine = math.cos(pair.pinion.base_helix_angle)
    width = _UNLOADED_CELLS * _UNLOADED_WIDTH * pair.pinion.normal_module
    for c, distance in enumerate(axes.centre_distance):
        placed = compliance.at_centre_distance(float(distance))
        kinematics = FlankPair.from_pair(placed.pair, roll[0], roll[-1])
        for p in range(axes.positions):
            rotation = p / axes.positions * pair.pinion.angular_pitch
            cells = lay_cells(kinematics, rotation, placed.teeth, placed.axial, width / 2, _UNLOADED_CELLS)
            removed = cells.gap + _modification_gap(placed, cells)
            place = placed.axial[cells.layer]
            for m, misalignment in enumerate(axes.misalignment):
                gap = removed + misalignment * place * cosine
                ste[p, c, m] = gap.min() / cosine
                centre[p, c, m] = place[gap < gap.min() + _TOUCHING].mean()
    names = ("pmc", "centre_distance", "misalignment")
    meaning = {
        "unloaded_ste": "transmission error at which the flanks first touch, on the transverse line of action",
        "unloaded_centre": "axial position of the first touch: derivative of unloaded_ste by misalignment",
    }
    values = {"unloaded_ste": ste, "unloaded_centre": centre}
    return xr.Dataset({n: (names, v, {"units": "m", "long_name": meaning[n]}) for n, v in values.items()})


def _flank_radii(gear: Gear) -> tuple[float, float]:
    return min(gear.form_radius, gear.tip_radius), max(gear.form_radius, gear.tip_radius)


def _check_on_flanks(compliance: PairCompliance, cells: Cells, force: FloatArray) -> None:
    """Refuse contact at a form circle, where the involute ends and the fillet begins."""
    touching = force > 0
    for flank, roll in zip(compliance.flanks, (cells.roll, cells.gear_roll), strict=True):
        margin = (roll - flank.roll[0]) if not flank.gear.internal else (flank.roll[-1] - roll)
        if (margin[touching] < 0.01 * np.ptp(flank.roll)).any():
            raise ContactError(f"gear {flank.gear.name}: contact reaches the form circle, where the involute ends")


def _cell_width(compliance: PairCompliance, load: float) -> float:
    """Width of the contact cells along the profile under a normal load, m."""
    pair, contact = compliance.pair, compliance.contact
    half_width = hertz_half_width(pair, load / least_contact_length(pair))
    return 2 * contact.window * half_width / contact.cells


def new_start(compliance: PairCompliance, torque: float) -> SearchStart:
    """Start of a search that knows no other state."""
    stiffness = 10e9 * compliance.pair.face_width  # two thirds of a usual mesh stiffness: may be too deep
    return SearchStart(compliance.contact.cells, _normal_load(compliance.pair, torque) / stiffness)


def _window_ends(cells: Cells) -> BoolArray:
    """Cells at either side of the window, but for those that a tip edge cuts."""
    group = cells.tooth * (cells.layer.max() + 1) + cells.layer
    first = np.diff(group, prepend=group[0] - 1) != 0
    last = np.append(first[1:], True)
    return np.asarray((first | last) & ~cells.cut)


def static_transmission_error(
    pair: GearPair | PairCompliance,
    torque: float | Sequence[float],
    positions: int = 50,
    *,
    centre_distance: float | Sequence[float] | None = None,
    misalignment: float | Sequence[float] = 0.0,
    mesh: MeshSettings | None = None,
    contact: ContactSettings | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Compute the static transmission error over the mesh cycle.

    Parameters
    ----------
    pair : GearPair or PairCompliance
        A prepared `PairCompliance` saves the finite-element part.
    torque : float or sequence
        Static torque on gear 1, N m, positive.
    positions : int
        Equally spaced positions of the mesh cycle.
    centre_distance : float or sequence, optional
        Operating centre distances, m; the pair's own unless given.
    misalignment : float or sequence
        Relative rotation of the axes in the plane of action, rad, positive where it opens the gap at the +z end.
    mesh, contact : optional
        Discretisation, if `pair` is a `GearPair`.
    progress : callable, optional
        Called with the number of finished positions and of all positions.

    Returns
    -------
    xarray.Dataset
        Over (pmc, torque, centre_distance, misalignment): ste (m), mesh_stiffness and tangent_stiffness (N/m),
        line_of_action_force (N), load_centre and tangent_load_centre (m), load_share and tangent_load_share by
        ``tooth``, line_load (N/m of contact line) by ``tooth`` and ``axial_position``, max_pressure and edge_pressure
        (Pa; inside the flank, and in cells at a tip edge, where it depends on the cells), iterations, converged.
        What is tangent belongs to a little more load, and is the derivative of ste by misalignment or by a gap of one
        tooth pair under constant load. Positions that failed are not a number; ``failures`` says why.

    Raises
    ------
    ValueError
        If a torque is not positive, a misalignment not finite, or fewer than one position is asked for.
    GeometryError
        If the gears cannot run at a centre distance.

    Examples
    --------
    >>> from fe_ste.gears import Gear, GearPair
    >>> gear = Gear(name="gear", teeth=30, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3)
    >>> pair = GearPair(name="pair", pinion=gear, gear=gear, centre_distance=90e-3)
    >>> coarse = MeshSettings(layers=4, flank=8, thickness=6)
    >>> curve = static_transmission_error(pair, 100.0, positions=2, mesh=coarse, contact=ContactSettings(slices=8))
    >>> bool((curve.ste > 5e-6).all() and (curve.ste < 20e-6).all())
    True
    """
    geometry = pair.pair if isinstance(pair, PairCompliance) else pair
    axes = StateAxes.checked(geometry, torque, positions, centre_distance, misalignment)
    compliance = pair if isinstance(pair, PairCompliance) else pair_compliance(pair, mesh, contact)
    total = math.prod(axes.shape)
    tell = (lambda done: progress(done, total)) if progress is not None else None
    return solve_positions(compliance, axes, range(positions), tell).dataset(axes)


@dataclass(frozen=True)
class StateAxes:
    """Axes of a grid of states.

    Attributes
    ----------
    positions : int
        Equally spaced positions of the mesh cycle.
    torque, centre_distance, misalignment : ndarray
        N m, m, rad.
    """

    positions: int
    torque: FloatArray
    centre_distance: FloatArray
    misalignment: FloatArray

    @classmethod
    def checked(
        cls,
        pair: GearPair,
        torque: float | Sequence[float],
        positions: int = 50,
        centre_distance: float | Sequence[float] | None = None,
        misalignment: float | Sequence[float] = 0.0,
    ) -> StateAxes:
        """Return the axes after checking each value; for the errors see `static_transmission_error`."""
        if positions < 1:
            raise ValueError(f"positions = {positions}: at least 1 is needed")
        torques = np.atleast_1d(np.asarray(torque, dtype=float))
        if not (np.isfinite(torques) & (torques > 0)).all():
            raise ValueError(
                f"torque = {torque}: must be positive torques on gear 1; a table belongs to one loaded flank"
            )
        misalignments = np.atleast_1d(np.asarray(misalignment, dtype=float))
        if not np.isfinite(misalignments).all():
            raise ValueError(f"misalignment = {misalignment}: must be finite angles in rad")
        own = pair.centre_distance if centre_distance is None else centre_distance
        distances = np.atleast_1d(np.asarray(own, dtype=float))
        for distance in distances:
            pair.with_centre_distance(float(distance))  # refuses before the finite elements, not after
        return cls(positions, torques, distances, misalignments)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Number of states along each axis, positions first."""
        return self.positions, len(self.torque), len(self.centre_distance), len(self.misalignment)

    def coordinates(self) -> dict[str, FloatArray]:
        """Return the values along each axis under its name."""
        return {
            "pmc": np.arange(self.positions) / self.positions,
            "torque": self.torque,
            "centre_distance": self.centre_distance,
            "misalignment": self.misalignment,
        }


def solve_positions(
    compliance: PairCompliance,
    axes: StateAxes,
    positions: Iterable[int],
    progress: Callable[[int], None] | None = None,
) -> StateResults:
    """Solve all states of some positions of a grid.

    Misalignments share the compliance of the contact cells; a solved position hands its contact on to the next, and a
    torque to the next smaller one at the first position.

    Parameters
    ----------
    compliance : PairCompliance
    axes : StateAxes
    positions : iterable of int
        Numbers of the positions; in a row they are solved fastest.
    progress : callable, optional
        Called with the number of finished states.

    Returns
    -------
    StateResults
        Of these positions alone.
    """
    chosen = list(positions)
    results = StateResults.empty(compliance, (len(chosen), *axes.shape[1:]))
    finished = 0
    with one_dense_thread():
        for c, distance in enumerate(axes.centre_distance):
            placed = compliance.at_centre_distance(float(distance))
            descending = np.argsort(-axes.torque, kind="stable")  # contact that shrinks is found in fewer steps
            known = float(axes.torque[descending[0]])
            first = [new_start(placed, known) for _ in axes.misalignment]
            for t in descending:
                torque = axes.torque[t]
                starts = [start.scaled(float(torque) / known) for start in first]
                known = float(torque)
                for p, position in enumerate(chosen):
                    pmc = position / axes.positions
                    states = contact_states(placed, float(torque), pmc, axes.misalignment, starts)
                    first = list(starts) if p == 0 else first
                    for m, state in enumerate(states):
                        results.put((p, int(t), c, m), placed, float(torque), pmc, float(axes.misalignment[m]), state)
                        finished += 1
                        if progress is not None:
                            progress(finished)
    return results


def _normal_load(pair: GearPair, torque: float) -> float:
    """Sum of the normal contact forces: every involute contact has the same lever arm r_b cos(beta_b)."""
    return torque / (pair.pinion.base_radius * math.cos(pair.pinion.base_helix_angle))


_UNITS = {
    "pmc": ("1", "position in the mesh cycle"),
    "torque": ("N m", "static torque on gear 1"),
    "centre_distance": ("m", "operating centre distance"),
    "misalignment": ("rad", "rotation of the axes in the plane of action, opening the +z end"),
    "tooth": ("1", "tooth pair, counted ahead of pair 0, which touches at the pitch point at pmc 0"),
    "axial_position": ("m", "from the middle of the common face width"),
    "ste": ("m", "static transmission error on the transverse line of action"),
    "mesh_stiffness": ("N/m", "secant stiffness on the transverse line of action"),
    "tangent_stiffness": ("N/m", "tangent stiffness on the transverse line of action"),
    "line_of_action_force": ("N", "torque on gear 1 over its base radius"),
    "load_share": ("1", "part of the normal load that a tooth pair carries"),
    "line_load": ("N/m", "normal load per length of contact line"),
    "load_centre": ("m", "axial position of the resultant normal load"),
    "tangent_load_centre": ("m", "axial position of the resultant of a little more load: slope of ste by misalignment"),
    "tangent_load_share": ("1", "part of a little more load that a tooth pair carries: slope of ste by a gap there"),
    "max_pressure": ("Pa", "largest contact pressure away from tip edges"),
    "edge_pressure": ("Pa", "largest contact pressure in cells at a tip edge; depends on their size"),
    "iterations": ("1", "active-set iterations"),
    "converged": ("1", "whether the position was solved"),
}


#: Axes of a table beside the position in the mesh cycle, ``pmc``.
STATE_AXES = ("torque", "centre_distance", "misalignment")
#: Results of a state that are numbers by themselves.
RESULTS = ("ste", "tangent_stiffness", "load_centre", "tangent_load_centre", "max_pressure", "edge_pressure")


@dataclass
class StateResults:
    """Results of states over (pmc, torque, centre_distance, misalignment); those that failed are not a number.

    Attributes
    ----------
    teeth : ndarray (t,)
        Tooth pairs that may touch.
    axial : ndarray (k,)
        Middle of the contact slices, m.
    base_radius : float
        Of gear 1, m.
    values : dict
        Name of a result -> ndarray over the axes.
    line_load : ndarray (..., t, k)
    load_share, tangent_load_share : ndarray (..., t)
    iterations : ndarray
    failures : list of str
        Why states failed.
    """

    teeth: IntArray
    axial: FloatArray
    base_radius: float
    values: dict[str, FloatArray]
    line_load: FloatArray
    load_share: FloatArray
    tangent_load_share: FloatArray
    iterations: NDArray[np.int32]
    failures: list[str] = field(default_factory=list)

    @classmethod
    def empty(cls, compliance: PairCompliance, shape: tuple[int, int, int, int]) -> StateResults:
        """Results of `shape` of which none is there yet."""
        teeth, axial = compliance.teeth, compliance.axial
        return cls(
            teeth,
            axial,
            compliance.pair.pinion.base_radius,
            {name: np.full(shape, np.nan) for name in RESULTS},
            np.full((*shape, len(teeth), len(axial)), np.nan),
            np.full((*shape, len(teeth)), np.nan),
            np.full((*shape, len(teeth)), np.nan),
            np.zeros(shape, dtype=np.int32),
        )

    @classmethod
    def from_dataset(cls, like: StateResults, dataset: xr.Dataset) -> StateResults:
        """Read back a dataset with all tooth pairs; its teeth, slices and base radius are those of `like`."""
        return cls(
            like.teeth,
            like.axial,
            like.base_radius,
            {name: dataset[name].to_numpy() for name in RESULTS},
            dataset["line_load"].to_numpy(),
            dataset["load_share"].to_numpy(),
            dataset["tangent_load_share"].to_numpy(),
            dataset["iterations"].to_numpy(),
            [line for line in str(dataset.attrs["failures"]).splitlines() if line],
        )

    def put(
        self,
        index: tuple[int, int, int, int],
        compliance: PairCompliance,
        torque: float,
        pmc: float,
        misalignment: float,
        state: ContactState | ContactError,
    ) -> None:
        """Keep the results of one state, or why there are none."""
        if isinstance(state, ContactError):
            distance = compliance.pair.centre_distance
            self.failures.append(
                f"pmc {pmc:.3f}, torque {torque:g} N m, centre distance {1e3 * distance:.7g} mm, "
                f"misalignment {1e6 * misalignment:.4g} urad: {state}"
            )
            return
        cosine = math.cos(compliance.pair.pinion.base_helix_angle)
        cells, solution = state.cells, state.solution
        self.values["ste"][index] = solution.approach / cosine
        self.values["tangent_stiffness"][index] = cosine**2 / solution.approach_per_load
        axial = compliance.axial[cells.layer]
        self.values["load_centre"][index] = solution.force @ axial / state.normal_load
        self.values["tangent_load_centre"][index] = solution.force_per_load @ axial
        self.values["max_pressure"][index] = state.pressure[~cells.cut].max(initial=0.0)
        self.values["edge_pressure"][index] = state.pressure[cells.cut].max(initial=0.0)
        loads = np.zeros((len(self.teeth), len(self.axial)))
        np.add.at(loads, (cells.tooth - self.teeth[0], cells.layer), solution.force)
        self.line_load[index] = loads * cosine / compliance.slice_width
        self.load_share[index] = loads.sum(axis=1) / state.normal_load
        pair_number = cells.tooth - self.teeth[0]
        self.tangent_load_share[index] = np.bincount(pair_number, solution.force_per_load, len(self.teeth))
        self.iterations[index] = solution.iterations

    def insert(self, positions: Sequence[int], part: StateResults) -> None:
        """Take over the results of some positions."""
        rows = np.asarray(positions)
        for name, values in part.values.items():
            self.values[name][rows] = values
        for name in ("line_load", "load_share", "tangent_load_share", "iterations"):
            getattr(self, name)[rows] = getattr(part, name)
        self.failures += part.failures

    def dataset(self, axes: StateAxes, all_teeth: bool = False) -> xr.Dataset:
        """Label the results; tooth pairs that never carry load are left out unless `all_teeth` asks for them."""
        coordinates = axes.coordinates()
        names = tuple(coordinates)
        force = np.broadcast_to(axes.torque[:, None, None] / self.base_radius, self.iterations.shape)
        carries = np.nan_to_num(self.load_share).max(axis=(0, 1, 2, 3)) > 0
        shown = carries | all_teeth
        variables: dict[str, tuple[tuple[str, ...], NDArray[Any]]]
        variables = {name: (names, values) for name, values in self.values.items()}
        variables |= {
            "mesh_stiffness": (names, force / self.values["ste"]),
            "line_of_action_force": (names, force),
            "load_share": ((*names, "tooth"), self.load_share[..., shown]),
            "tangent_load_share": ((*names, "tooth"), self.tangent_load_share[..., shown]),
            "line_load": ((*names, "tooth", "axial_position"), self.line_load[..., shown, :]),
            "iterations": (names, self.iterations),
            "converged": (names, np.isfinite(self.values["ste"])),
        }
        coordinates |= {"tooth": self.teeth[shown], "axial_position": self.axial}
        dataset = xr.Dataset(variables, coordinates)
        for name, (unit, meaning) in _UNITS.items():
            dataset[name].attrs = {"units": unit, "long_name": meaning}
        dataset.attrs["failures"] = "\n".join(self.failures)
        return dataset
