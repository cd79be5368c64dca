"""Mesh model `line_of_action`: load over deflection along the line of action, varying over the mesh cycle.

A table of one load F0 contains the deflection s(pmc) and the tangent stiffness. The curve through both that passes the
origin is a power of the deflection d::

    F = F0 sgn(d) x^m,  x = |d| / s,  m = tangent stiffness / (F0 / s),  tangent m F / d,  U = |F d| / (m + 1).

Teeth of a stated stiffness k have m = 1, a straight line. While s and m change with pmc the teeth absorb or supply the
power dU/dpmc dpmc/dt, which is taken from the rotation of the gear train. Below x = `LINEAR_BELOW` the curve is
extrapolated linearly, because it has no tangent at the origin. The tilting stiffness of a mesh is described in
`exugear.system.tooth_mesh.contact_state`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import ClassVar

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh
from exugear.system.kernels.cubics import cubic, periodic_cubic, piece_of, stiffness_at
from exugear.system.tooth_mesh.element import Law, MeshCurve, MeshData
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import fitting_table, table_path, wanted_table
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.transmission_error.surface import GapError, SteSurface, complete_cycle
from fe_ste.transmission_error.table import TableError

STIFFNESS_FORM = 0
CURVE_FORM = 2
LINEAR_BELOW = 0.05
"""Deflection over that of the table's load below which the curve is a straight line."""
_LOG_LINEAR_BELOW = math.log(LINEAR_BELOW)
_CENTRES = ("load_centroid", "tangent_load_centroid")
EXPONENT, PER_LOAD = 4, 8
"""Columns of a curve's coefficients behind the four of F0 / s: four of m - 1, and 1 / F0 (1/N)."""


class LineOfAction(Law):
    """Curve of load over deflection from the pair's table; force and deflection share one row."""

    form = STIFFNESS_FORM
    curved: ClassVar[bool] = True
    """Whether load over deflection is curved as the table's tangent says, or a straight line."""

    def read(self, gearbox: Gearbox, pair: str, directory: Path) -> Floats | MeshCurve | SteSurface:
        """Curve of a pair from its table, computed from exactly this case; or the stiffness that the file states."""
        if pair in gearbox.stated_stiffness:
            return np.array(gearbox.stated_stiffness[pair])
        try:
            table = fitting_table(gearbox, pair, directory)
            point = complete_cycle(table.static_state)
        except TableError as error:
            raise MeshError(f"pair {pair}: {error} (exugear ste)") from None
        except GapError as error:
            raise MeshError(f"pair {pair}: {table_path(directory, pair)}: {error}") from None
        stiffness = np.asarray(point["mesh_stiffness"].to_numpy(), dtype=np.float64)
        if not self.curved:
            return stiffness
        tangent = np.asarray(point["tangent_stiffness"].to_numpy(), dtype=np.float64)
        computed_from = wanted_table(gearbox, pair, len(stiffness))
        force = float(point["line_of_action_force"].mean())
        centres = {name: np.asarray(point[name].to_numpy(), dtype=np.float64) for name in _CENTRES}
        from fe_ste.transmission_error.sliding import friction_over_cycle  # loads xarray, which only tables need

        friction = friction_over_cycle(computed_from.pair, table.static_state)
        return MeshCurve(stiffness, tangent, force, computed_from, friction=friction, **centres)

    def samples(self, data: MeshData, mesh: Mesh, static_force: float) -> tuple[Floats, Floats]:
        """Secant and tangent stiffness along the line of action, as `Law.samples`."""
        if self.curved and isinstance(data, MeshCurve):
            curve = data.at(static_force)
            return curve.stiffness, curve.tangent
        return super().samples(data, mesh, static_force)

    def load_ways(self, data: MeshData) -> Floats:
        """Ways of the table's load, as `Law.load_ways`; none of a stiffness alone."""
        if not self.curved or not isinstance(data, MeshCurve) or data.load_centroid is None:
            return super().load_ways(data)
        added = data.load_centroid if data.tangent_load_centroid is None else data.tangent_load_centroid
        centres = np.array([data.load_centroid, added])
        return np.asarray(centres - centres.mean(axis=1, keepdims=True))


def curve_coefficients(stiffness: Floats, tangent: Floats, force: float) -> Floats:
    """Coefficients (n, 9) of `curve_law` from secant and tangent stiffness (n,) over the mesh cycle, under a load (N).

    Examples
    --------
    >>> curve_coefficients(np.array([2e9]), np.array([2.2e9]), 4e4)[0, [0, EXPONENT]].round(12).tolist()
    [2000000000.0, 0.1]
    """
    exponent = periodic_cubic(tangent / stiffness - 1.0)
    return np.hstack([periodic_cubic(stiffness), exponent, np.full((len(stiffness), 1), 1.0 / force)])


@kernel
def stiffness_law(
    coefficients: Floats, pieces: int, delta: float, pmc: float, cycling: float
) -> tuple[float, float, float, float, float]:
    """Elastic force of a deflection delta (m) at pmc, which changes by `cycling` (1/s); coefficients (n, 4).

    Returns
    -------
    force, tangent, force_by_pmc, energy, cycle_power : float
        N, N/m, N per cycle, J; W that the changing stiffness gives to the rest.
    """
    k, k_slope = stiffness_at(coefficients, pieces, pmc)
    return k * delta, k, delta * k_slope, 0.5 * k * delta * delta, -0.5 * k_slope * cycling * delta * delta


@kernel
def curve_law(
    coefficients: Floats, pieces: int, delta: float, pmc: float, cycling: float
) -> tuple[float, float, float, float, float]:
    """Do as `stiffness_law` for the curve of coefficients (n, 9)."""
    piece, t = piece_of(pmc, pieces)
    c = coefficients[piece]
    k, k_slope, _ = cubic(c[0], c[1], c[2], c[3], t)
    e = c[EXPONENT:]
    n, n_slope, _ = cubic(e[0], e[1], e[2], e[3], t)
    force, tangent, force_by_pmc, energy, energy_by_pmc = curve_of(
        k, k_slope * pieces, n, n_slope * pieces, c[PER_LOAD], delta
    )
    return force, tangent, force_by_pmc, energy, -energy_by_pmc * cycling


@kernel
def curve_of(
    k: float, k_slope: float, n: float, n_slope: float, per_load: float, delta: float
) -> tuple[float, float, float, float, float]:
    """Elastic force of a deflection (m) by a curve of load over deflection at one position in the mesh cycle.

    Parameters
    ----------
    k, k_slope : load over deflection at the load of the table, N/m, and its slope per cycle
    n, n_slope : exponent of the curve less one, and its slope per cycle
    per_load : 1 over that load, 1/N

    Returns
    -------
    force, tangent, force_by_pmc, energy, energy_by_pmc : float
        N, N/m, N per cycle, J, J per cycle.
    """
    k_rate = k_slope / k
    x = k * abs(delta) * per_load
    if x > LINEAR_BELOW:
        level = math.log(x)
        force = k * math.exp(n * level) * delta
        # Of the logarithm of the force and of the energy per cycle; both at the same deflection.
        rate = n_slope * level + (1.0 + n) * k_rate
        energy = force * delta / (2.0 + n)
        by_pmc = energy * (rate - n_slope / (2.0 + n))
        tangent = (1.0 + n) * force / delta
    else:
        chord = k * math.exp(n * _LOG_LINEAR_BELOW)
        force = chord * delta
        tangent = chord
        rate = n_slope * _LOG_LINEAR_BELOW + k_rate
        energy = 0.5 * chord * delta * delta
        by_pmc = energy * rate
        # Where the line meets the curve, both have the same energy: it is less at the origin by this.
        depth = 0.5 * chord / (2.0 + n) * (LINEAR_BELOW / (k * per_load)) ** 2
        energy -= n * depth
        by_pmc -= depth * (n * (rate - 2.0 * k_rate) + 2.0 * n_slope / (2.0 + n))
    return force, tangent, force * rate, energy, by_pmc


LAW = LineOfAction()
