"""What bricks err by next to a load: small, local, and gone from the compliance when it is taken out."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fe_ste.elasticity.bricks import ERROR_REACH, brick_error
from fe_ste.elasticity.flank import flank_near_field
from fe_ste.elasticity.hexmesh import MeshSettings, sector_mesh
from fe_ste.geometry.gears import Gear

from ..cases.gears import HELICAL_20, SPUR_20

RING = Gear(name="ring", teeth=60, normal_module=3e-3, face_width=20e-3, held_diameter=210e-3, internal=True)
MESH = MeshSettings(layers=6, flank=12, thickness=8)


@pytest.mark.sample
@pytest.mark.parametrize("gear", [SPUR_20, HELICAL_20, RING], ids=lambda gear: gear.name)
def test_the_error_is_a_small_part_of_the_displacement_and_local(gear: Gear) -> None:
    mesh = sector_mesh(gear, MESH)
    error, shape = brick_error(mesh, 1), (len(mesh.section.flank_roll), len(mesh.axial_positions)) * 2
    own = flank_near_field(mesh, 1, np.zeros((2, 0, 3))).reshape(shape)[6, 3, 6, 3]
    assert 0.0 < error[6, ERROR_REACH, 6] < 0.1 * own
    # Three layers away less than a tenth of what it is under the load (seen: a twentieth or less).
    assert np.abs(error[:, [0, -1]]).max() < 0.2 * np.abs(error[:, ERROR_REACH]).max()


def test_both_flanks_err_alike_seen_from_the_other_end() -> None:
    mesh = sector_mesh(HELICAL_20, MESH)
    one, other = brick_error(mesh, 1), brick_error(mesh, -1)
    assert np.abs(one - other[:, ::-1]).max() < 1e-8 * np.abs(one).max()


def test_layers_of_unequal_thickness_are_refused() -> None:
    mesh = sector_mesh(SPUR_20, MESH)
    graded = dataclasses.replace(mesh, axial_positions=mesh.axial_positions * np.abs(mesh.axial_positions) / 10e-3)
    with pytest.raises(ValueError, match="layers from .* must be equal"):
        brick_error(graded, 1)
