"""Static transmission error of a gear pair over the mesh cycle.

Frame and signs as in `fe_ste.contact.kinematics`: the static transmission error is positive where the loaded gear
yields; the position in the mesh cycle (pmc) is 0 where tooth pair 0 touches at the pitch point in the middle of the
common face width.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import count
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import GearPair
from fe_ste.tools.threads import one_dense_thread, side_by_side
from fe_ste.transmission_error.compliance import PairCompliance, pair_compliance
from fe_ste.transmission_error.cycle import DEFAULT_POSITIONS
from fe_ste.transmission_error.search import contact_states, new_start
from fe_ste.transmission_error.states import StateAxes, StateResults

if TYPE_CHECKING:
    import xarray as xr

#: Positions from which on contact moves by no more than a cell from one to the next.
_CLOSE_POSITIONS = 20


def static_transmission_error(
    pair: GearPair | PairCompliance,
    torque: float | Sequence[float],
    positions: int = DEFAULT_POSITIONS,
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
    pair : a prepared `PairCompliance` saves the finite-element part
    torque : static torque on gear 1, N m, positive
    positions : equally spaced positions of the mesh cycle
    centre_distance : operating centre distances, m; the pair's own unless given
    misalignment
        Relative rotation of the axes in the plane of action, rad, positive for a gap at the +z end.
    mesh, contact : discretisation, if `pair` is a `GearPair`
    progress : called with the number of finished positions and of all positions

    Returns
    -------
    xarray.Dataset
        Over (pmc, torque, centre_distance, misalignment): ste (m), mesh_stiffness and tangent_stiffness (N/m),
        line_of_action_force (N), load_centroid and tangent_load_centroid (m), load_share and tangent_load_share by
        ``tooth``, line_load (N/m of contact line) by ``tooth`` and ``axial_position``, max_pressure and edge_pressure
        (Pa; inside the flank, and in cells at a tip edge, where it depends on the cells), iterations, converged.
        Tangent quantities refer to an increment of load, and are the derivative of ste by misalignment or by a gap of
        one tooth pair under constant load. Positions that failed are NaN; ``failures`` gives the reason.

    Raises
    ------
    ValueError
        If a torque is not positive, a misalignment not finite, or fewer than one position is asked for.
    GeometryError
        If the gears cannot run at a centre distance.

    Examples
    --------
    >>> from fe_ste.geometry.gears import Gear, GearPair
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
    # Both halves of the positions at once: the contact lets go of Python's lock most of the time.
    total = math.prod(axes.shape)
    finished = count(1)
    telling = Lock()

    def tell(_: int) -> None:
        if progress is not None:
            with telling:
                progress(next(finished), total)

    halves = [half.tolist() for half in np.array_split(np.arange(axes.positions), 2) if half.size]
    results = StateResults.empty(compliance, axes.shape)
    with one_dense_thread():
        parts = side_by_side(lambda half: solve_positions(compliance, axes, half, tell), halves)
    for half, part in zip(halves, parts, strict=True):
        results.insert(half, slice(None), part)
    return results.dataset(axes)


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
    positions : numbers of the positions; in a row they are solved fastest
    progress : called with the number of finished states

    Returns
    -------
    of these positions alone
    """
    chosen = list(positions)
    moved = 0 if axes.positions >= _CLOSE_POSITIONS else 2
    results = StateResults.empty(compliance, (len(chosen), *axes.shape[1:]))
    finished = 0
    with one_dense_thread():
        for c, distance in enumerate(axes.centre_distance):
            at_distance = compliance.at_centre_distance(float(distance))
            descending = np.argsort(-axes.torque, kind="stable")  # contact that shrinks is found in fewer steps
            known_torque = float(axes.torque[descending[0]])
            starts_of_first = [replace(new_start(at_distance, known_torque), moved=moved) for _ in axes.misalignment]
            for t in descending:
                torque = axes.torque[t]
                starts = [start.scaled(float(torque) / known_torque) for start in starts_of_first]
                known_torque = float(torque)
                for p, position in enumerate(chosen):
                    pmc = position / axes.positions
                    states = contact_states(at_distance, float(torque), pmc, axes.misalignment, starts)
                    starts_of_first = list(starts) if p == 0 else starts_of_first
                    for m, state in enumerate(states):
                        results.put(
                            (p, int(t), c, m), at_distance, float(torque), pmc, float(axes.misalignment[m]), state
                        )
                        finished += 1
                        if progress is not None:
                            progress(finished)
    return results
