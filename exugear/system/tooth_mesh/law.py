"""What a mesh law has to say: the data it reads, its rows, its stiffness, and the numbers of its compiled form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh
from exugear.system.tooth_mesh.kernels.meshes import periodic_cubic
from exugear.system.tooth_mesh.placement import line_of_action_row
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.surface import SteSurface
from fe_ste.transmission_error.table import TableInput

Angles = Literal["reference", "operating"]


@dataclass(frozen=True)
class MeshCurve:
    """Curve of load over deflection of a pair, a power of the deflection at each position in the mesh cycle.

    Examples
    --------
    >>> half = MeshCurve(np.array([2e9]), np.array([2.5e9]), 40e3).at(20e3)
    >>> print(round(half.tangent[0] / half.stiffness[0], 9), round(1e-9 * half.stiffness[0], 4))
    1.25 1.7411
    """

    stiffness: Floats
    tangent: Floats
    """(n,) load over deflection, and the slope of the load, at pmc = 0, 1/n, ..., N/m."""
    force: float
    """Load on the transverse line of action at which they are, N."""
    table: TableInput | None = None
    """What they were computed from: contact at other loads and misalignments can be solved then."""
    load_centre: Floats | None = None
    tangent_load_centre: Floats | None = None
    """(n,) where the load bears along the face at the same positions, and what a little more deflection adds to it,
    m from its middle, in the axes of the table. The second is the first by default."""

    def at(self, force: float) -> MeshCurve:
        """Return the same curve by its stiffness at another load (N); without any, at that of the table."""
        if not force:
            return self
        exponent = self.tangent / self.stiffness
        stiffness = self.stiffness * (abs(force) / self.force) ** (1.0 - 1.0 / exponent)
        return replace(self, stiffness=stiffness, tangent=exponent * stiffness, force=abs(force))


MeshData = ArrayLike | MeshCurve | SteSurface
"""What a law knows of a pair: stiffness over the mesh cycle (N/m), load over deflection, or the table's surface."""


@dataclass(frozen=True)
class TableFlanks:
    """What the law `table` needs of a mesh beyond its rows."""

    surface: SteSurface
    """SteSurface of the loaded flank."""
    back: Floats
    back_misalignment: Floats
    """(12,) rows of the other flank's deflection and misalignment."""
    backlash: float
    """Approach from flank to flank along the transverse line of action, m."""
    back_phase: float
    """PMC of the other flank at zero angles."""
    damping_time: float
    """Damping over tangent stiffness, s."""


class Law:
    """A mesh law with a force; what it does not say otherwise is as along the line of action."""

    form: ClassVar[int]
    """Number of the law's compiled form in `exugear.system.tooth_mesh.laws.forms`."""
    tilts: ClassVar[bool] = True
    """Whether teeth resist misalignment by the state of their contact. (`system.tooth_mesh.contact_state`); a law
    that does not has no moment, or one of its own."""

    def read(self, gearbox: Gearbox, pair: str, directory: Path) -> Floats | MeshCurve | SteSurface:
        """Read or compute what the law knows of a pair.

        Parameters
        ----------
        directory : results folder with ``tables/<pair>.nc``, for laws that need tables

        Raises
        ------
        MeshError
            A table is missing, holds unsolved positions, or was computed from another input.
        """
        raise NotImplementedError

    def rows(self, mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], angles: Angles) -> tuple[Floats, Floats]:
        """Deflection row and force row (12,) about the two bodies' nodes."""
        row = line_of_action_row(mesh, flank, nodes)
        return row, row

    def samples(self, data: MeshData, mesh: Mesh, static_force: float) -> tuple[Floats, Floats]:
        """F_bt over STE and its slope along the line of action, each (n,), N/m, at the static force (N)."""
        values = data.stiffness if isinstance(data, MeshCurve) else np.atleast_1d(np.asarray(data, dtype=np.float64))
        return values, values

    def load_ways(self, data: MeshData) -> Floats:
        """Ways of the load, and of what is added to it, along the face (2, n), as `MeshElement.load_ways`."""
        return np.zeros((2, 0))

    def stiffness(self, mesh: Mesh, line_of_action: Floats, angles: Angles) -> tuple[Floats, float]:
        """Stiffness (n,) in the law's own coordinate, N/m, from that of `samples`; F_bt per scalar force of the law."""
        return line_of_action, 1.0

    def coefficients(self, stiffness: Floats) -> Floats:
        """Numbers (n, 4) that the compiled form reads over n equal pieces of the mesh cycle."""
        return periodic_cubic(stiffness)

    def table_flanks(
        self, mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], phase: float, data: MeshData, time: float
    ) -> TableFlanks | None:
        """Both flanks' tables of a law that follows one, with damping time (s) and PMC at zero angles."""
        return None
