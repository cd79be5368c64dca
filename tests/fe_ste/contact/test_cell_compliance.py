"""Compliance of contact cells: the arrays' way against the formulas, entry by entry."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from fe_ste.contact.compliance import add_near_field, compliance_matrix, mean_inverse_distance
from fe_ste.contact.kinematics import Cells, ContactSettings, FlankPair, lay_cells
from fe_ste.elasticity.flank import FlankCompliance, flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.compliance import PairCompliance

COARSE = MeshSettings(layers=6, flank=10, thickness=8, fillet=2, root=2, rim=6)


def external() -> GearPair:
    """Helical, the wheel narrower than the pinion."""
    helix = math.radians(14.0)
    pinion = Gear(name="pinion", teeth=22, normal_module=3e-3, helix_angle=helix, face_width=30e-3, held_diameter=32e-3)
    wheel = Gear(name="wheel", teeth=45, normal_module=3e-3, helix_angle=-helix, face_width=28e-3, held_diameter=80e-3)
    return GearPair(name="helical", pinion=pinion, gear=wheel, centre_distance=104.6e-3)


def internal() -> GearPair:
    pinion = Gear(name="pinion", teeth=25, normal_module=3e-3, face_width=24e-3, held_diameter=40e-3)
    ring = Gear(
        name="ring",
        teeth=70,
        normal_module=3e-3,
        face_width=24e-3,
        held_diameter=245e-3,
        tip_diameter=206e-3,
        internal=True,
    )
    return GearPair(name="internal", pinion=pinion, gear=ring, centre_distance=67.5e-3)


@pytest.fixture(scope="module", params=[external, internal], ids=["external", "internal"])
def compliance(request: pytest.FixtureRequest) -> PairCompliance:
    make: Callable[[], GearPair] = request.param
    pair = make()
    flanks = (
        flank_compliance(pair.pinion, 1, COARSE),
        flank_compliance(pair.gear, -1 if pair.gear.internal else 1, COARSE),
    )
    return PairCompliance.from_flanks(pair, flanks, ContactSettings(slices=17))


def kinematics_of(compliance: PairCompliance) -> FlankPair:
    roll = compliance.flanks[0].roll
    return FlankPair.from_pair(compliance.pair, roll[0], roll[-1])


def cells_of(compliance: PairCompliance, half_window: float) -> Cells:
    """Cells of two neighbouring tooth pairs, some of them cut by a tip edge."""
    teeth, axial = np.array([-1, 0]), compliance.axial
    return lay_cells(kinematics_of(compliance), 0.01, teeth, axial, half_window, 5)


def near_field(compliance: PairCompliance, cells: Cells) -> Floats:
    """Each load and its images behind the four end faces, cell by cell."""
    pair, flanks = kinematics_of(compliance), compliance.flanks
    cosine, axial = pair.base_helix_cosine, compliance.axial[cells.layer]
    half_along = 0.5 * compliance.slice_width / cosine
    result = np.zeros((len(axial), len(axial)))
    for i, j in np.ndindex(*result.shape):
        if cells.tooth[i] != cells.tooth[j]:
            continue
        apart = axial[i] - axial[j]
        mean_roll = 0.5 * (cells.roll[i] + cells.roll[j])
        across = pair.base_radius_1 * mean_roll * (cells.roll[i] - cells.roll[j] - pair.twist_1 * apart)
        half = 0.5 * (cells.half_across[i] + cells.half_across[j])
        for flank in flanks:
            material, end = flank.gear.material, flank.gear.face_width / 2
            surface = (1 - material.poissons_ratio**2) / (np.pi * material.youngs_modulus)
            result[i, j] += surface * mean_inverse_distance(across, apart / cosine, half, half_along)
            for face, images in zip((-end, end), flank.images, strict=True):
                read, loaded = axial[i] - face, axial[j] - face
                for strength, squares, product in images:
                    along = np.sqrt(squares * (read**2 + loaded**2) + product * read * loaded) / cosine
                    length = half_along * np.sqrt(squares / 2 + product / 4)  # as for a load as far from the face
                    result[i, j] += surface * strength * mean_inverse_distance(across, along, half, length)
    return result


def regular(flank: FlankCompliance, sense: int, cells: Cells, roll: Floats, axial: Floats) -> Floats:
    """Splines through all nodes of the flank, over the profile's arc length and the face width."""
    arc = flank.roll**2
    over_profile = make_interp_spline(arc, np.eye(len(arc)))(np.clip(roll**2, arc[0], arc[-1]))
    over_width = make_interp_spline(flank.axial, np.eye(len(flank.axial)))(axial[cells.layer])
    weights = np.einsum("np,nl->npl", over_profile, over_width).reshape(len(roll), -1)
    result = np.empty((len(roll), len(roll)))
    for read in np.unique(cells.tooth):
        for loaded in np.unique(cells.tooth):
            rows, columns = cells.tooth == read, cells.tooth == loaded
            block = flank.regular[flank.key(int(sense * read), int(sense * loaded))]
            result[np.ix_(rows, columns)] = weights[rows] @ block @ weights[columns].T
    return result


@pytest.mark.sample
def test_compliance_is_that_of_the_formulas_cell_by_cell(compliance: PairCompliance) -> None:
    """Series of far loads, sums over runs of cells, the lower triangle alone: 1e-12 of the largest entry."""
    cells, axial, flanks = cells_of(compliance, 0.3e-3), compliance.axial, compliance.flanks
    assert cells.cut.any()
    assert not cells.cut.all()
    plain = near_field(compliance, cells)
    senses = (1, 1 if compliance.pair.gear.internal else -1)
    for flank, sense, roll in zip(flanks, senses, (cells.roll, cells.gear_roll), strict=True):
        plain += regular(flank, sense, cells, roll, axial)
    matrix = compliance_matrix(cells, kinematics_of(compliance), axial, flanks, compliance.regular)
    assert np.abs(np.tril(matrix) - np.tril(plain)).max() < 1e-12 * np.abs(plain).max()
    assert np.abs(plain - plain.T).max() < 1e-6 * np.abs(plain).max()


def test_near_field_of_cells_too_wide_for_the_series(compliance: PairCompliance) -> None:
    """Windows as wide as the distances along the contact line."""
    cells = cells_of(compliance, 4e-3)
    groups = np.flatnonzero(np.diff(cells.tooth * 17 + cells.layer, prepend=-1000, append=1000))
    matrix, plain = np.zeros((len(cells.tooth),) * 2), near_field(compliance, cells)
    add_near_field(matrix, groups, cells, kinematics_of(compliance), compliance.axial, compliance.flanks)
    lower = np.tril_indices(len(matrix))
    assert matrix[lower] == pytest.approx(plain[lower], rel=1e-12)
    assert np.ptp(cells.roll**2) * kinematics_of(compliance).base_radius_1 / 2 > 2 * compliance.slice_width
