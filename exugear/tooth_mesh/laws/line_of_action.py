"""Mesh law `line_of_action`: a stiffness over the mesh cycle on the deflection along the line of action.

Scalar force F = k(pmc) delta + c d delta/dt; its energy is k delta^2 / 2, and while k changes with pmc the teeth take
or give the power k' (d pmc/dt) delta^2 / 2, which comes from the rolling train.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from exugear.kernels.meshes import stiffness_at
from exugear.model.gearbox import Gearbox
from exugear.tooth_mesh.law import Law
from exugear.tooth_mesh.placement import MeshError
from exugear.tooth_mesh.tables import fitting_table, table_path
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel
from fe_ste.transmission_error.gaps import GapError, complete_cycle
from fe_ste.transmission_error.surface import SteSurface
from fe_ste.transmission_error.table import TableError

STIFFNESS_FORM = 0


class LineOfAction(Law):
    """Stiffness over the mesh cycle from the pair's table; force and deflection share one row."""

    form = STIFFNESS_FORM

    def read(self, gearbox: Gearbox, pair: str, directory: Path) -> Floats | SteSurface:
        """Stiffness samples of a pair: stated by the file, or from its table, computed from exactly this case."""
        if pair in gearbox.stated_stiffness:
            return np.array(gearbox.stated_stiffness[pair])
        try:
            point = complete_cycle(fitting_table(gearbox, pair, directory).static_state)
        except TableError as error:
            raise MeshError(f"pair {pair}: {error} (exugear ste)") from None
        except GapError as error:
            raise MeshError(f"pair {pair}: {table_path(directory, pair)}: {error}") from None
        return np.asarray(point["mesh_stiffness"].to_numpy(), dtype=np.float64)


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


LAW = LineOfAction()
