"""States of a table that are not solved: how many may be missing, and what stands in for them where they are few.

What stands in is a guess, and whoever uses it says so: a table keeps its gaps, and an interpolation is marked there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fe_ste.tools.arrays import Booleans, Floats

if TYPE_CHECKING:
    import xarray as xr


MOST_MISSING = 0.1
"""Part of the positions of a mesh cycle, or of the states of a table, that may be missing."""
DOUBTFUL_CUT_OFF = 0.01
"""Share of the load cut off at a form circle that raises a doubt: ten times less moves the transmission error by
a few millionths, but what a tip does in a fillet is not in the model."""


class GapError(ValueError):
    """More states are missing than others can stand in for; the message says how many."""


def complete_cycle(state: xr.Dataset) -> xr.Dataset:
    """Fill the positions of a mesh cycle that are not solved, by cubics between their neighbours without overshoot.

    Parameters
    ----------
    state : one load, centre distance and misalignment of a table; variables over ``pmc``

    Raises
    ------
    GapError
        More than a tenth of the positions are missing.
    """
    solved = state["converged"].to_numpy().astype(bool)
    if solved.all():
        return state
    _check(int(np.count_nonzero(~solved)), solved.size, "positions")
    from scipy.interpolate import PchipInterpolator  # which a table without gaps needs not

    pmc = state["pmc"].to_numpy()
    # The cycle closes: known positions of the cycles before and after stand at its ends.
    known = np.concatenate([pmc[solved] + turn for turn in (-1.0, 0.0, 1.0)])
    filled = state.copy()
    for name, variable in state.data_vars.items():
        if variable.dims == ("pmc",) and variable.dtype.kind == "f" and name != "unloaded_ste":
            values = variable.to_numpy().copy()
            values[~solved] = PchipInterpolator(known, np.tile(values[solved], 3))(pmc[~solved])
            filled[name] = variable.copy(data=values)
    filled["mesh_stiffness"] = state["mesh_stiffness"].copy(
        data=(filled["line_of_action_force"] / filled["ste"]).to_numpy()
    )
    return filled


def complete_loads(
    root: Floats, nodes: Floats, tangent: Floats, centre: Floats, solved: Booleans
) -> tuple[Floats, Floats, Floats]:
    """Fill the states of a grid that are not solved; more load always means more deflection.

    Between solved loads a cubic without overshoot, beyond the last a straight line along its tangent; where no load is
    solved, the growth of the nearest place at which one is.

    Parameters
    ----------
    root : (l + 1,) roots of the forces, sqrt(N), from zero
    nodes : (p, c, a, l + 1) transmission error, m, from no load on
    tangent, centre : (p, c, a, l) tangent stiffness, N/m, and slope of the transmission error by misalignment, m
    solved : (p, c, a, l)

    Returns
    -------
    nodes, tangent, centre

    Raises
    ------
    GapError
        More than a tenth of the states are missing.
    """
    _check(int(np.count_nonzero(~solved)), solved.size, "states")
    nodes = nodes.copy()
    tangent = tangent.copy()
    centre = centre.copy()
    known: Booleans = np.asarray(solved.any(axis=-1))
    for place in np.argwhere(known & ~solved.all(axis=-1)):
        at = tuple(place)
        _complete_line(root, nodes[at], tangent[at], centre[at], solved[at])
    if not known.all():
        from scipy.ndimage import distance_transform_edt  # likewise

        # Another position of the cycle is nearer than another misalignment.
        steps = [1.0, float(len(known)), float(len(known))]
        _, indices = distance_transform_edt(~known, sampling=steps, return_distances=True, return_indices=True)
        nearest = tuple(indices)
        growth = nodes - nodes[..., :1]
        nodes = nodes[..., :1] + growth[nearest]
        tangent = tangent[nearest]
        centre = centre[nearest]
    return nodes, tangent, centre


def _complete_line(root: Floats, nodes: Floats, tangent: Floats, centre: Floats, solved: Booleans) -> None:
    """Fill one line of loads in place."""
    from scipy.interpolate import PchipInterpolator  # likewise

    last = int(np.flatnonzero(solved)[-1])
    at = np.concatenate([[0], 1 + np.flatnonzero(solved)])
    curve = PchipInterpolator(root[at], nodes[at])
    for load in np.flatnonzero(~solved):
        r = root[load + 1]
        if load < last:
            nodes[load + 1], tangent[load] = curve(r), 2.0 * r / curve(r, 1)
        else:
            more = (r**2 - root[last + 1] ** 2) / tangent[last]
            nodes[load + 1], tangent[load] = nodes[last + 1] + more, tangent[last]
    centre[~solved] = np.interp(root[1:][~solved], root[1:][solved], centre[solved])


def _check(missing: int, count: int, what: str) -> None:
    if missing > MOST_MISSING * count:
        raise GapError(
            f"{missing} of {count} {what} are not solved ({100.0 * missing / count:.3g} %); "
            f"others can stand in for {100.0 * MOST_MISSING:g} % of them at most"
        )
