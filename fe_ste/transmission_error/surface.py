"""Static transmission error between the nodes of a table: one smooth surface over load, position and gear position.

The surface is a cubic in each axis, so that it and its slopes are continuous, and goes through every node. Position is
periodic. The load axis is the root of the line-of-action force: a flank in line contact deflects in proportion to the
force, one in point contact more than that at small force, and both are smooth in the root. Slopes along it are the
table's own tangent stiffness, limited where needed so that more load never means less deflection (Fritsch and Carlson,
SIAM J. Numer. Anal. 17 (1980) 238-246); along misalignment they are the axial position of an increment of load, which
is exactly the derivative of s; the other axes take their slopes from parabolas through three nodes.

Interpolated states are estimates, and results that use them report this: a table keeps its gaps, and an interpolation
is marked there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fe_ste.tools.arrays import Booleans, Floats, Integers
from fe_ste.tools.display import ReprMixin, TitledRows, value_range

if TYPE_CHECKING:
    import xarray as xr

MOST_MISSING = 0.1
"""Part of the positions of a mesh cycle, or of the states of a table, that may be missing."""
DOUBTFUL_CUT_OFF = 0.01
"""Truncated share of the load at a form diameter that causes a warning: a tenth of it changes the transmission error by
a few millionths, but contact of a tip in a fillet is not modelled."""


class GapError(ValueError):
    """Too many states are missing to be interpolated from their neighbours; the message gives their number."""


def complete_cycle(state: xr.Dataset) -> xr.Dataset:
    """Interpolate the positions of a mesh cycle that have not converged, by cubics without overshoot.

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
    """Interpolate the states of a grid that have not converged; more load always means more deflection.

    Between converged loads a cubic without overshoot, beyond the last one extrapolated linearly along its tangent;
    where no load has converged, the growth at the nearest converged place.

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
            f"{missing} of {count} {what} not converged ({100.0 * missing / count:.3g} %); at most "
            f"{100.0 * MOST_MISSING:g} % can be interpolated"
        )


STENCIL = 4
"""Nodes of an axis that act between two of them."""
_ROUND_OFF = 1e-9
"""Slopes of this part of a piece's mean slope are none."""
_CHECKS = np.linspace(0.0, 1.0, 9)
"""Places within a piece at which the surface is checked to rise with the load."""


class InterpolationError(ValueError):
    """A table that no surface can be laid through."""


def axis_weights(knots: ArrayLike) -> tuple[Integers, Floats]:
    """Weights of the nodes in each interval of an axis, continuous with their first derivative.

    Parameters
    ----------
    knots : (k,) increasing; a single knot means that nothing depends on the axis

    Returns
    -------
    first : (n,) first node that acts in each of the n = max(1, k - 1) intervals
    weights : (n, 4, 4)
        Coefficients c of the weight sum_j c[i, a, j] t^j of node first[i] + a in interval i, t from 0 to 1.

    Raises
    ------
    InterpolationError
        If the knots do not increase.

    Examples
    --------
    >>> first, weights = axis_weights([0.0, 1.0, 2.0])
    >>> nodes = np.array([0.0, 1.0, 4.0])  # a parabola comes back exactly
    >>> float(nodes @ (weights[1, :3] @ 0.5 ** np.arange(4)))
    2.25
    """
    x = np.atleast_1d(np.asarray(knots, dtype=np.float64))
    count = x.size
    if count == 1:
        constant = np.zeros((1, STENCIL, 4))
        constant[0, 0, 0] = 1.0
        return np.zeros(1, dtype=np.int64), constant
    if not np.all(np.diff(x) > 0.0):
        raise InterpolationError(f"the values of an axis must increase: {x.tolist()}")
    slopes: Floats = _slope_matrix(x)
    first = np.clip(np.arange(count - 1) - 1, 0, max(0, count - STENCIL)).astype(np.int64)
    weights = np.zeros((count - 1, STENCIL, 4))
    unit = np.eye(count)
    for i, start in enumerate(first):
        step = x[i + 1] - x[i]
        a = unit[i]
        b = unit[i + 1]
        da = step * slopes[i]
        db = step * slopes[i + 1]
        cubic = np.stack([a, da, 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db], axis=1)
        width = min(STENCIL, count)
        weights[i, :width] = cubic[start : start + width]
    return first, weights


def slope_axis_weights(knots: ArrayLike) -> tuple[Integers, Floats]:
    """Weights in each interval of an axis whose nodes have a value and a slope each, one after the other.

    As `axis_weights`: the four weights of an interval belong to value and slope at its start and at its end.

    Examples
    --------
    >>> first, weights = slope_axis_weights([0.0, 2.0])
    >>> nodes = np.array([0.0, 0.0, 4.0, 4.0])  # x^2 with its slope
    >>> float(nodes @ (weights[0] @ 0.5 ** np.arange(4)))
    1.0
    """
    x = np.atleast_1d(np.asarray(knots, dtype=np.float64))
    if x.size == 1:
        return axis_weights(x)
    if not np.all(np.diff(x) > 0.0):
        raise InterpolationError(f"the values of an axis must increase: {x.tolist()}")
    step = np.diff(x)[:, None]
    none = np.zeros((x.size - 1, 4))
    value = none + [1.0, 0.0, -3.0, 2.0]
    rise = none + [0.0, 0.0, 3.0, -2.0]
    start = step * [0.0, 1.0, -2.0, 1.0]
    end = step * [0.0, 0.0, -1.0, 1.0]
    return 2 * np.arange(x.size - 1), np.stack([value, start, rise, end], axis=1)


def _slope_matrix(x: Floats) -> Floats:
    """Slope at each node as a combination of the nodal values: of the parabola through three neighbours."""
    count = x.size
    if count == 2:
        return np.full((2, 2), [-1.0, 1.0]) / float(x[1] - x[0])
    matrix = np.zeros((count, count))
    for i in range(count):
        start = min(max(i - 1, 0), count - 3)
        near = x[start : start + 3]
        for j in range(3):
            others = np.delete(near, j)
            matrix[i, start + j] = (2.0 * x[i] - others.sum()) / np.prod(near[j] - others)
    return matrix


@dataclass(frozen=True)
class SteSurface(ReprMixin):
    """Static transmission error s(pmc, centre distance, misalignment, force) of one loaded flank."""

    centre_distance: Floats
    """(c,) knots, m."""
    misalignment: Floats
    """(a,) knots, rad."""
    root_force: Floats
    """(l + 1,) knots of the root of the line-of-action force, sqrt(N), from zero."""
    coefficients: Floats
    """(p, c, 2 a or 1, l, 5) at each node of the other axes, on each piece of the load axis: cubic of s in t from 0
    to 1 (m), and the integral of s over the force from zero to the start of the piece (J). Along misalignment the
    same of the slope follows each node, unless there is one node only."""
    guessed: Booleans | None = None
    """(p, c, a, l) nodes that have not converged and are interpolated; none if there are none."""

    @classmethod
    def from_table(cls, dataset: xr.Dataset) -> SteSurface:
        """Fit the surface to a table (see `fe_ste.static_transmission_error`).

        Raises
        ------
        InterpolationError
            If too many states have not converged to be interpolated, or more load gives less deflection.
        """
        axes = ("pmc", "centre_distance", "misalignment", "torque")
        table = dataset.transpose(*axes, ...)
        position_axes = axes[:3]
        return cls.from_nodes(
            table["centre_distance"].to_numpy(),
            table["misalignment"].to_numpy(),
            table["line_of_action_force"].to_numpy().reshape(-1, table.sizes["torque"])[0],
            table["ste"].to_numpy(),
            table["tangent_stiffness"].to_numpy(),
            table["tangent_load_centroid"].to_numpy(),
            table["unloaded_ste"].transpose(*position_axes).to_numpy(),
            table["unloaded_centre"].transpose(*position_axes).to_numpy(),
            table["converged"].to_numpy().astype(bool),
        )

    @classmethod
    def from_nodes(
        cls,
        centre_distance: ArrayLike,
        misalignment: ArrayLike,
        force: ArrayLike,
        ste: ArrayLike,
        tangent_stiffness: ArrayLike,
        tangent_load_centroid: ArrayLike = 0.0,
        unloaded: ArrayLike = 0.0,
        unloaded_centre: ArrayLike = 0.0,
        solved: ArrayLike = True,
    ) -> SteSurface:
        """Fit the surface to values at the nodes.

        Parameters
        ----------
        centre_distance, misalignment : (c,), (a,) m, rad
        force : (l,) line-of-action forces, N, positive and increasing
        ste, tangent_stiffness, tangent_load_centroid : (p, c, a, l)
            m, N/m, m: the last is the derivative of the first by misalignment.
        unloaded, unloaded_centre : (p, c, a) arrays or floats
            Transmission error at no load, and its derivative by misalignment, m.
        solved : (p, c, a, l) array or True
            Converged states; the rest is interpolated (`fe_ste.transmission_error.surface`).

        Raises
        ------
        InterpolationError
            If too many states have not converged, or more load gives less deflection.

        Examples
        --------
        >>> one = np.ones((1, 1, 1, 1))
        >>> surface = SteSurface.from_nodes([0.1], [0.0], [1e3], 1e-6 * one, 1e9 * one)
        >>> round(surface.ste(500.0, 0.3) * 1e6, 6)
        0.5
        """
        loads = np.atleast_1d(np.asarray(force, dtype=np.float64))
        if not (np.all(loads > 0.0) and np.all(np.diff(loads) > 0.0)):
            raise InterpolationError(f"the forces of the load axis must be positive and increase: {loads.tolist()}")
        values = np.asarray(ste, dtype=np.float64)
        root = np.concatenate([[0.0], np.sqrt(loads)])
        nodes = _from_no_load(unloaded, values)
        tangent = np.asarray(tangent_stiffness, dtype=np.float64)
        load_centroid: Floats = np.broadcast_to(np.asarray(tangent_load_centroid, dtype=np.float64), values.shape)
        known: Booleans = np.broadcast_to(np.asarray(solved, dtype=np.bool_), values.shape)
        if not known.all():
            try:
                nodes, tangent, load_centroid = complete_loads(root, nodes, tangent, load_centroid, known)
            except GapError as error:
                raise InterpolationError(str(error)) from None
        slopes = _load_slopes(root, nodes, tangent)
        pieces = _load_pieces(root, nodes, slopes)
        misalignments = np.atleast_1d(np.asarray(misalignment, dtype=np.float64))
        if misalignments.size > 1:
            centres = _from_no_load(unloaded_centre, load_centroid)
            by_misalignment = _load_pieces(root, centres, centres @ _slope_matrix(root).T)
            pieces = np.stack([pieces, by_misalignment], axis=3).reshape(*values.shape[:2], -1, *pieces.shape[3:])
        distances = np.atleast_1d(np.asarray(centre_distance, dtype=np.float64))
        surface = cls(distances, misalignments, root, pieces, None if known.all() else ~known)
        surface._check_rising()
        return surface

    def at_nominal(self, centre_distance: float, misalignment: float = 0.0) -> SteSurface:
        """Surface of gears that stay where they are: the same without the two axes of their position."""
        by_distance = _weights_at(self.centre_distance, centre_distance)
        by_misalignment = _slope_weights_at(self.misalignment, misalignment)
        values = np.einsum("pcalj,c->palj", self.coefficients, by_distance)
        values = np.einsum("palj,a->plj", values, by_misalignment)[:, None, None]
        guessed = self.guessed
        if guessed is not None:
            acting = by_misalignment.reshape(len(self.misalignment), -1).any(axis=1)
            guessed = np.asarray(guessed[:, by_distance != 0.0][:, :, acting].any(axis=(1, 2), keepdims=True))
        return SteSurface(np.array([centre_distance]), np.array([misalignment]), self.root_force, values, guessed)

    def averaged(self) -> SteSurface:
        """Surface of the mean over the mesh cycle at each load."""
        mean = self.coefficients.mean(axis=0, keepdims=True)
        guessed = None if self.guessed is None else np.asarray(self.guessed.any(axis=0, keepdims=True))
        return SteSurface(self.centre_distance, self.misalignment, self.root_force, mean, guessed)

    def interpolated_intervals(self) -> Booleans:
        """Return where interpolated nodes act: intervals of pmc, centre distance, misalignment, segments of load.

        Returns
        -------
        (p, max(1, c - 1), max(1, a - 1), l) array
        """
        positions, distances, misalignments, loads = self.coefficients.shape[:4]
        if self.guessed is None:
            shape = positions, max(1, distances - 1), max(1, len(self.misalignment) - 1), loads
            return np.zeros(shape, dtype=np.bool_)
        near = self.guessed
        if positions > 1:
            near = np.logical_or.reduce([np.roll(near, -step, axis=0) for step in (-1, 0, 1, 2)])
        first, _ = axis_weights(self.centre_distance)
        near = np.stack([near[:, i : i + STENCIL].any(axis=1) for i in first], axis=1)
        if len(self.misalignment) > 1:
            near = near[:, :, :-1] | near[:, :, 1:]
        # The energy of a piece of load holds all below it; its slopes are those of the next node, too.
        near = np.logical_or.accumulate(near, axis=-1)
        return np.concatenate([near[..., 1:], near[..., -1:]], axis=-1)

    def acting_guesses(self) -> Booleans:
        """Return the intervals, and the nodes between them, at which interpolated nodes have an effect.

        Nodes and intervals alternate along each axis: 2 n + 1 entries for n `interpolated_intervals`, node i at
        2 i, the interval behind it at 2 i + 1. Values and slopes are continuous at a node, so an interpolated node that
        acts on only one side of it has no weight there.

        Returns
        -------
        (2 p + 1, 2 max(1, c - 1) + 1, 2 max(1, a - 1) + 1, 2 l + 1) array
        """
        acting = self.interpolated_intervals()
        for axis in range(acting.ndim):
            intervals = np.moveaxis(acting, axis, 0)
            # The mesh cycle closes; beyond the ends of the other axes the surface goes on as beside them.
            padded = np.concatenate([intervals[:1], intervals, intervals[-1:]])
            if axis == 0:
                padded[0] = intervals[-1]
                padded[-1] = intervals[0]
            both = np.empty((2 * len(intervals) + 1, *intervals.shape[1:]), dtype=np.bool_)
            both[::2] = padded[:-1] & padded[1:]
            both[1::2] = intervals
            acting = np.moveaxis(both, 0, axis)
        return acting

    def ste(self, force: float, pmc: float, centre_distance: float | None = None, misalignment: float = 0.0) -> float:
        """Return the static transmission error (m) at a force (N, from zero to the last of the axis).

        Outside the axes of position it continues along its slope.
        """
        distance = self.centre_distance[0] if centre_distance is None else centre_distance
        cubic = self._cubics_at(pmc, float(distance), misalignment)
        root = np.sqrt(force)
        piece = int(np.clip(np.searchsorted(self.root_force, root, side="right") - 1, 0, len(cubic) - 1))
        start, end = self.root_force[piece : piece + 2]
        return float(cubic[piece, :4] @ ((root - start) / (end - start)) ** np.arange(4))

    def mean_stiffness(self, force: float, centre_distance: float) -> float:
        """Tangent stiffness dF/ds (N/m) of the mean over the mesh cycle, of aligned gears.

        It is that at a force, N; beyond the last node of the axis, that at the node.
        """
        surface = self.averaged()
        cubic = surface._cubics_at(0.0, centre_distance, 0.0)
        root = min(np.sqrt(force), self.root_force[-1])
        piece = int(np.clip(np.searchsorted(self.root_force, root, side="right") - 1, 0, len(cubic) - 1))
        step = self.root_force[piece + 1] - self.root_force[piece]
        t = (root - self.root_force[piece]) / step
        slope = cubic[piece, 1] + t * (2.0 * cubic[piece, 2] + t * 3.0 * cubic[piece, 3])
        return float(2.0 * root * step / slope)

    def _cubics_at(self, pmc: float, centre_distance: float, misalignment: float) -> Floats:
        """Coefficients (l, 5) at one place of the other axes."""
        values = np.tensordot(_periodic_weights(len(self.coefficients), pmc), self.coefficients, 1)
        values = np.tensordot(_weights_at(self.centre_distance, centre_distance), values, 1)
        return np.asarray(np.tensordot(_slope_weights_at(self.misalignment, misalignment), values, 1))

    def _check_rising(self) -> None:
        """Make sure that s rises with the load between the nodes too, where weights may be negative."""
        powers = np.arange(1, 4) * _CHECKS[:, None] ** np.arange(3)
        count = len(self.coefficients)
        pmc_weights = np.array([_periodic_weights(count, 0.5 * p / count) for p in range(2 * count)])
        distance_weights = np.array([_weights_at(self.centre_distance, x) for x in _halved(self.centre_distance)])
        misalignment_weights = np.array([_slope_weights_at(self.misalignment, x) for x in _halved(self.misalignment)])
        for rows in pmc_weights:  # a position at a time: the whole would be large
            values = np.tensordot(rows, self.coefficients, 1)
            values = np.tensordot(misalignment_weights, np.tensordot(distance_weights, values, 1), (1, 1))
            rise = values[..., 1:4].sum(axis=-1)
            falling = np.argwhere((values[..., 1:4] @ powers.T).min(axis=-1) < -_ROUND_OFF * rise)
            if falling.size:
                a, c, piece = falling[0]
                raise InterpolationError(
                    f"more load than {self.root_force[piece] ** 2:.6g} N gives less deflection at centre distance "
                    f"{_halved(self.centre_distance)[c]:.6g} m, misalignment {_halved(self.misalignment)[a]:.4g} rad, "
                    "between the nodes of the table: lay more of them"
                )

    def _line(self) -> str:
        return (
            f": {len(self.coefficients)} positions, {value_range(self.centre_distance, 'mm', 1e3)}, "
            f"{value_range(self.misalignment, 'µrad', 1e6)}, force up to {self.root_force[-1] ** 2:.5g} N"
        )

    def _table(self) -> TitledRows:
        return "surface of the static transmission error", {
            "position in the mesh cycle": f"{len(self.coefficients)} positions",
            "centre distance": value_range(self.centre_distance, "mm", 1e3),
            "misalignment": value_range(self.misalignment, "µrad", 1e6),
            "line-of-action force": value_range(self.root_force**2, "N"),
        }


def _load_slopes(root: Floats, nodes: Floats, tangent: Floats) -> Floats:
    """Slopes ds/d(root of force) at the load nodes, (..., l + 1), limited so that each piece rises throughout."""
    secants = np.diff(nodes, axis=-1) / np.diff(root)
    if not np.all(secants > 0.0):
        p, c, a, piece = np.argwhere(~(secants > 0.0))[0]
        raise InterpolationError(
            f"the deflection does not grow from {root[piece] ** 2:.6g} N to {root[piece + 1] ** 2:.6g} N at node "
            f"{p} of pmc, {c} of centre_distance, {a} of misalignment"
        )
    slopes = np.empty_like(nodes)
    slopes[..., 1:] = 2.0 * root[1:] / tangent
    slopes[..., 0] = 2.0 * secants[..., 0] - slopes[..., 1]  # a parabola on the first piece
    limit = np.full_like(nodes, np.inf)
    limit[..., :-1] = 3.0 * secants
    limit[..., 1:] = np.minimum(limit[..., 1:], 3.0 * secants)
    return np.clip(slopes, 0.0, limit)


def _load_pieces(root: Floats, nodes: Floats, slopes: Floats) -> Floats:
    """Cubics of the load axis and the energy before each, (..., l, 5)."""
    step = np.diff(root)
    start = nodes[..., :-1]
    rise = np.diff(nodes, axis=-1)
    a = step * slopes[..., :-1]
    b = step * slopes[..., 1:]
    cubic = np.stack([start, a, 3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise], axis=-1)
    powers = np.arange(4)
    # Integral over a piece of s(t) d(root^2), root = start + step t.
    moments = 2.0 * step[:, None] * (root[:-1, None] / (powers + 1.0) + step[:, None] / (powers + 2.0))
    pieces = np.einsum("...lj,lj->...l", cubic, moments)
    before = np.cumsum(pieces, axis=-1) - pieces
    return np.concatenate([cubic, before[..., None]], axis=-1)


def _from_no_load(unloaded: ArrayLike, values: Floats) -> Floats:
    """Nodes of the load axis with the one at no load before them, (..., l + 1)."""
    start = np.broadcast_to(np.asarray(unloaded, dtype=np.float64), values.shape[:-1])
    return np.concatenate([start[..., None], values], axis=-1)


def _halved(knots: Floats) -> Floats:
    """Knots and the places half-way between them."""
    return np.sort(np.concatenate([knots, 0.5 * (knots[1:] + knots[:-1])]))


def _weights_at(knots: Floats, x: float) -> Floats:
    """Weight of every knot at x, continued along the slope outside."""
    if len(knots) == 1:
        return np.ones(1)
    return _weights_between(knots, x, *axis_weights(knots), len(knots))


def _slope_weights_at(knots: Floats, x: float) -> Floats:
    """Weights of value and slope of every knot at x, continued along the slope outside."""
    if len(knots) == 1:
        return np.ones(1)
    return _weights_between(knots, x, *slope_axis_weights(knots), 2 * len(knots))


def _weights_between(knots: Floats, x: float, first: Integers, weights: Floats, count: int) -> Floats:
    i = int(np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2))
    step = knots[i + 1] - knots[i]
    t = (x - knots[i]) / step
    inside = min(max(t, 0.0), 1.0)
    powers = np.arange(4)
    near = weights[i] @ inside**powers + (t - inside) * (weights[i, :, 1:] @ (powers[1:] * inside ** powers[:3]))
    full = np.zeros(count)
    width = min(STENCIL, count)
    full[first[i] : first[i] + width] = near[:width]
    return full


def _periodic_weights(count: int, pmc: float) -> Floats:
    """Weight of every position at pmc: cubic with central differences as slopes."""
    scaled = (pmc - np.floor(pmc)) * count
    piece = min(int(scaled), count - 1)
    t = scaled - piece
    square = t * t
    cube = t**3
    near = 0.5 * np.array(
        [2.0 * square - t - cube, 2.0 - 5.0 * square + 3.0 * cube, t + 4.0 * square - 3.0 * cube, cube - square]
    )
    full = np.zeros(count)
    np.add.at(full, (piece - 1 + np.arange(STENCIL)) % count, near)
    return full
