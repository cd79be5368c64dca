"""Static transmission error of a gear pair over the mesh cycle.

Signs. Gear 1 is held, gear 2 turns about its axis under a torque that presses its flank on gear 1. The static
transmission error is the rotation of gear 2 as a length on the transverse line of action, from the position in which
the unmodified rigid flanks would roll: positive, the loaded gear yields. ``pmc`` is the part of a mesh cycle by which
gear 1 has turned in its driving sense from where tooth pair 0 touches at the pitch point in the middle of the common
face width.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

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
IntArray = NDArray[np.int64]

#: Cells further apart than this many approaches in the unloaded position cannot touch.
_GAP_REACH = 1.3
#: Part of its cells by which a window that contact fills grows at either side.
_WINDOW_GROWTH = 0.2
_WINDOW_ATTEMPTS = 6


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
    """

    pair: GearPair
    flanks: tuple[FlankCompliance, FlankCompliance]
    contact: ContactSettings
    axial: FloatArray
    teeth: IntArray
    reach: int
    sliced: tuple[SlicedCompliance, SlicedCompliance]
    modifications: tuple[FlankModification, FlankModification] = (FlankModification(), FlankModification())

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
class _Search:
    """What one position hands on to the next: where the search starts, not the size of the cells.

    A window that contact fills gets more cells of the same width, so that the result of a position does not depend
    on the positions solved before.
    """

    cell_width: float
    cells: int
    approach: float


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


def contact_state(
    compliance: PairCompliance,
    torque: float,
    pmc: float,
    search: _Search | None = None,
    misalignment: float = 0.0,
) -> ContactState:
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
    pair = compliance.pair
    load = _normal_load(pair, torque)
    search = search or _new_search(compliance, load)
    kinematics = FlankPair.from_pair(pair, compliance.flanks[0].roll[0], compliance.flanks[0].roll[-1])
    rotation = pmc * pair.pinion.angular_pitch
    reach, teeth = compliance.reach, compliance.teeth
    count, reckoned = search.cells, search.approach
    for _ in range(_WINDOW_ATTEMPTS):
        cells = lay_cells(kinematics, rotation, teeth, compliance.axial, count * search.cell_width / 2, count)
        if not cells.tooth.size:
            break
        gap = cells.gap + _extra_gap(compliance, cells, misalignment)
        near = gap - gap.min() < _GAP_REACH * reckoned
        cells, gap = cells.select(near), gap[near]
        if np.ptp(cells.tooth) > reach:
            raise ContactError(f"contact spreads over more than {reach + 1} tooth pairs: the torque is too large")
        matrix = compliance_matrix(cells, kinematics, compliance.axial, compliance.flanks, compliance.sliced)
        solution = solve_complementarity(matrix, gap, load, gap - gap.min() < 0.7 * reckoned)
        depth = solution.approach - gap.min()
        if depth > 0.95 * _GAP_REACH * reckoned:
            reckoned = 1.2 * depth
        elif _touches_window(cells, solution.force):
            count += 2 * math.ceil(_WINDOW_GROWTH * count)
        else:
            search.cells, search.approach = count, depth
            _check_on_flanks(compliance, cells, solution.force)
            area = 4.0 * cells.half_across * (0.5 * compliance.slice_width / kinematics.base_helix_cosine)
            return ContactState(pmc, load, cells, solution, solution.force / area)
    raise ContactError(f"the contact is wider than the flanks, or found no approach, at torque {torque:g} N m")


def _extra_gap(compliance: PairCompliance, cells: Cells, misalignment: float) -> FloatArray:
    """Gap over the cells, along the normal, that modifications and misalignment add to the conjugate flanks."""
    axial = compliance.axial[cells.layer]
    gap = misalignment * axial * math.cos(compliance.pair.pinion.base_helix_angle)
    gears = (compliance.pair.pinion, compliance.pair.gear)
    for gear, roll, modification in zip(gears, (cells.roll, cells.gear_roll), compliance.modifications, strict=True):
        radius = gear.base_radius * np.sqrt(1.0 + roll**2)
        gap = gap + modification.gap(gear, np.clip(radius, *_flank_radii(gear)), axial)
    return gap


def _flank_radii(gear: Gear) -> tuple[float, float]:
    return min(gear.form_radius, gear.tip_radius), max(gear.form_radius, gear.tip_radius)


def _check_on_flanks(compliance: PairCompliance, cells: Cells, force: FloatArray) -> None:
    """Refuse contact at a form circle, where the involute ends and the fillet begins."""
    touching = force > 0
    for flank, roll in zip(compliance.flanks, (cells.roll, cells.gear_roll), strict=True):
        margin = (roll - flank.roll[0]) if not flank.gear.internal else (flank.roll[-1] - roll)
        if (margin[touching] < 0.01 * np.ptp(flank.roll)).any():
            raise ContactError(f"gear {flank.gear.name}: contact reaches the form circle, where the involute ends")


def _new_search(compliance: PairCompliance, load: float) -> _Search:
    pair = compliance.pair
    half_width = hertz_half_width(pair, load / least_contact_length(pair))
    stiffness = 10e9 * pair.face_width  # two thirds of a usual mesh stiffness: the first guess may be too large
    contact = compliance.contact
    return _Search(2 * contact.window * half_width / contact.cells, contact.cells, load / stiffness)


def _touches_window(cells: Cells, force: FloatArray) -> bool:
    """Whether contact reaches a side of the window that is no tip edge."""
    group = cells.tooth * (cells.layer.max() + 1) + cells.layer
    first = np.flatnonzero(np.diff(group, prepend=group[0] - 1))
    last = np.append(first[1:], len(group)) - 1
    ends = np.concatenate([first, last])
    return bool((force[ends][~cells.cut[ends]] > 0).any())


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
        line_of_action_force (N), load_share by ``tooth``, line_load (N/m of contact line) by ``tooth`` and
        ``axial_position``, max_pressure and edge_pressure (Pa; inside the flank, and in cells at a tip edge, where it
        depends on the cells), iterations, converged. Positions that failed are not a number; ``failures`` says why.

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
    if positions < 1:
        raise ValueError(f"positions = {positions}: at least 1 is needed")
    torques = np.atleast_1d(np.asarray(torque, dtype=float))
    if not (np.isfinite(torques) & (torques > 0)).all():
        raise ValueError(f"torque = {torque}: must be positive torques on gear 1; a table belongs to one loaded flank")
    misalignments = np.atleast_1d(np.asarray(misalignment, dtype=float))
    if not np.isfinite(misalignments).all():
        raise ValueError(f"misalignment = {misalignment}: must be finite angles in rad")
    geometry = pair.pair if isinstance(pair, PairCompliance) else pair
    distances = np.atleast_1d(geometry.centre_distance if centre_distance is None else centre_distance)
    for distance in distances:
        geometry.with_centre_distance(float(distance))  # refuses before the finite elements, not after
    compliance = pair if isinstance(pair, PairCompliance) else pair_compliance(pair, mesh, contact)
    shape = (positions, len(torques), len(distances), len(misalignments))
    result = _Collector(compliance, shape)
    with one_dense_thread():
        for c, distance in enumerate(distances):
            placed = compliance.at_centre_distance(float(distance))
            for t, load_torque in enumerate(torques):
                for m, tilt in enumerate(misalignments):
                    search = _new_search(placed, _normal_load(placed.pair, load_torque))
                    for p in range(positions):
                        result.solve((p, t, c, m), placed, float(load_torque), p / positions, search, float(tilt))
                        if progress is not None:
                            progress(result.finished, int(np.prod(shape)))
    axes = {
        "pmc": np.arange(positions) / positions,
        "torque": torques,
        "centre_distance": distances,
        "misalignment": misalignments,
    }
    return result.dataset(axes)


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
    "max_pressure": ("Pa", "largest contact pressure away from tip edges"),
    "edge_pressure": ("Pa", "largest contact pressure in cells at a tip edge; depends on their size"),
    "iterations": ("1", "active-set iterations"),
    "converged": ("1", "whether the position was solved"),
}


class _Collector:
    """Gathers the results of all positions and marks those that failed."""

    def __init__(self, compliance: PairCompliance, shape: tuple[int, int, int, int]) -> None:
        self.teeth = compliance.teeth
        self.axial = compliance.axial
        self.finished = 0
        self.failures: list[str] = []
        self.values = {
            name: np.full(shape, np.nan) for name in ("ste", "tangent_stiffness", "max_pressure", "edge_pressure")
        }
        self.line_load = np.full((*shape, len(self.teeth), len(self.axial)), np.nan)
        self.load_share = np.full((*shape, len(self.teeth)), np.nan)
        self.iterations = np.zeros(shape, dtype=np.int32)
        self.base_radius = compliance.pair.pinion.base_radius

    def solve(
        self,
        index: tuple[int, int, int, int],
        compliance: PairCompliance,
        torque: float,
        pmc: float,
        search: _Search,
        misalignment: float,
    ) -> None:
        """Solve one state and keep its results, or why there are none."""
        self.finished += 1
        try:
            state = contact_state(compliance, torque, pmc, search, misalignment)
        except ContactError as error:
            self.failures.append(f"pmc {pmc:.3f}, torque {torque:g} N m: {error}")
            return
        cosine = math.cos(compliance.pair.pinion.base_helix_angle)
        cells, solution = state.cells, state.solution
        self.values["ste"][index] = solution.approach / cosine
        self.values["tangent_stiffness"][index] = cosine**2 / solution.approach_per_load
        self.values["max_pressure"][index] = state.pressure[~cells.cut].max(initial=0.0)
        self.values["edge_pressure"][index] = state.pressure[cells.cut].max(initial=0.0)
        loads = np.zeros((len(self.teeth), len(self.axial)))
        np.add.at(loads, (cells.tooth - self.teeth[0], cells.layer), solution.force)
        self.line_load[index] = loads * cosine / compliance.slice_width
        self.load_share[index] = loads.sum(axis=1) / state.normal_load
        self.iterations[index] = solution.iterations

    def dataset(self, axes: dict[str, FloatArray]) -> xr.Dataset:
        """Label the results."""
        names = tuple(axes)
        force = np.broadcast_to(axes["torque"][:, None, None] / self.base_radius, self.iterations.shape)
        carries = np.nan_to_num(self.load_share).max(axis=(0, 1, 2, 3)) > 0
        variables = {name: (names, values) for name, values in self.values.items()}
        variables |= {
            "mesh_stiffness": (names, force / self.values["ste"]),
            "line_of_action_force": (names, force),
            "load_share": ((*names, "tooth"), self.load_share[..., carries]),
            "line_load": ((*names, "tooth", "axial_position"), self.line_load[..., carries, :]),
            "iterations": (names, self.iterations),
            "converged": (names, np.isfinite(self.values["ste"])),
        }
        coordinates = axes | {"tooth": self.teeth[carries], "axial_position": self.axial}
        dataset = xr.Dataset(variables, coordinates)
        for name, (unit, meaning) in _UNITS.items():
            dataset[name].attrs = {"units": unit, "long_name": meaning}
        dataset.attrs["failures"] = "\n".join(self.failures)
        return dataset
