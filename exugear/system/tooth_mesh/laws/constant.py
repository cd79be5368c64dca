"""Mesh model `constant`: as `line_of_action` with the mean of the table's stiffness."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from exugear.gearbox.parts import Mesh
from exugear.system.tooth_mesh.element import Angles
from exugear.system.tooth_mesh.laws.line_of_action import LineOfAction
from fe_ste.tools.arrays import Floats


class Constant(LineOfAction):
    """Mean stiffness over the mesh cycle, a straight line of load over deflection."""

    curved: ClassVar[bool] = False

    def stiffness(self, mesh: Mesh, line_of_action: Floats, angles: Angles) -> tuple[Floats, float]:
        """Mean of F_bt over STE, (1,), N/m."""
        return np.array([np.mean(line_of_action)]), 1.0


LAW = Constant()
