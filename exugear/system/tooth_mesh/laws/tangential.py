"""Mesh model `tangential`: the published tangential model, deflection along the pitch circle.

The deflection is tangential, at the pitch point; the force on gear 1 is T = (1, tan phi_n / cos beta, -tan beta) times
k delta, with radial and axial components not conjugate to the deflection. So it is not conservative.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from exugear.gearbox.parts import Mesh
from exugear.system.tooth_mesh.element import Angles
from exugear.system.tooth_mesh.laws.line_of_action import LineOfAction
from exugear.system.tooth_mesh.placement import MeshGeometry, pitch_point_of, wrench_row
from fe_ste.tools.arrays import Floats


class Tangential(LineOfAction):
    """Tangential deflection, force with radial and axial parts.

    As it was published, teeth do not resist misalignment, and load over deflection is a straight line.
    """

    curved: ClassVar[bool] = False
    tilts: ClassVar[bool] = False

    def rows(self, mesh: Mesh, flank: int, nodes: tuple[Floats, Floats], angles: Angles) -> tuple[Floats, Floats]:
        """Row of the tangential deflection at the pitch point, and of the force there."""
        geometry = MeshGeometry.of(mesh)
        axial = np.array([0.0, 0.0, 1.0])
        pitch_point = pitch_point_of(mesh, geometry, nodes)
        pressure, helix = tangential_angles(mesh, angles)
        tangent = flank * geometry.tangential
        pushing = tangent + math.tan(pressure) * geometry.radial - flank * math.tan(helix) * axial
        return wrench_row(tangent, pitch_point, nodes), wrench_row(pushing, pitch_point, nodes)

    def stiffness(self, mesh: Mesh, line_of_action: Floats, angles: Angles) -> tuple[Floats, float]:
        """Tangential stiffness from that along the line of action.

        k = F_tt / (STE / cos phi) with F_tt = F_bt cos phi, so it is cos^2 phi times the table's; the moment
        F_tt r_w is that of F_bt = F_tt / cos a with the operating angle a.
        """
        pressure, _ = tangential_angles(mesh, angles)
        return math.cos(pressure) ** 2 * line_of_action, 1.0 / math.cos(MeshGeometry.of(mesh).pressure_angle)


def tangential_angles(mesh: Mesh, angles: Angles) -> tuple[float, float]:
    """Transverse pressure angle and helix angle of gear 1 that the law uses, rad."""
    pinion = mesh.pair.pinion
    if angles == "reference":
        return pinion.transverse_pressure_angle, pinion.helix_angle
    pressure = MeshGeometry.of(mesh).pressure_angle
    return pressure, math.atan(math.tan(pinion.base_helix_angle) / math.cos(pressure))


LAW = Tangential()
