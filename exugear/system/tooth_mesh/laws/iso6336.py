"""Mesh model `iso6336`: as `constant` with the mean mesh stiffness of ISO 6336-1 method B; needs no tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import PairSpec
from exugear.system.tooth_mesh.laws.constant import Constant
from fe_ste.standards.iso6336 import mesh_stiffness as iso_stiffness
from fe_ste.tools.arrays import Floats


class Iso6336(Constant):
    """Mean stiffness by the standard."""

    def read(self, gearbox: Gearbox, pair: str, directory: Path) -> Floats:
        """Mean mesh stiffness (1,), N/m; nothing is read."""
        return np.array([iso6336_stiffness(gearbox.pairs[pair])])


def iso6336_stiffness(spec: PairSpec) -> float:
    """Mean mesh stiffness of a pair according to ISO 6336-1 method B at its static load, N/m."""
    force = spec.static_torque / spec.pair.pinion.reference_radius
    return iso_stiffness(spec.pair, tangential_force=force or None).stiffness


LAW = Iso6336()
