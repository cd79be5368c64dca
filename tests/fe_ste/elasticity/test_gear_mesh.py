"""Both gears in their places, uniform and refined about the contact lines."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fe_ste.elasticity.bricks import brick_gradients
from fe_ste.elasticity.gear_mesh import ContactMesh, GearMesh, contact_line_rolls, placed_gears, refined_gears
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair

UNIFORM = MeshSettings(layers=3, flank=6, thickness=2, fillet=1, root=1, rim=6)
COARSE = ContactMesh(layers=4, contact_elements=3, growth=0.8, thickness=5, fillet=2, root=2, rim=4, far_flank=4)
HALF_WIDTH = 0.3e-3


def roll_on_gear_2(pair: GearPair, sector: GearMesh, pmc: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roll angle and axial place of the flank nodes of gear 2, and which tooth's involute they lie on."""
    x, y, z = sector.points[np.unique(sector.facets)].T
    sense = -1 if pair.gear.internal else 1
    turned = np.arctan2(-sense * y, pair.centre_distance - sense * x)
    roll = np.sqrt((np.hypot(pair.centre_distance - sense * x, y) / pair.gear.base_radius) ** 2 - 1)
    working = np.tan(pair.working_pressure_angle) - pair.working_pressure_angle
    flank = working - (roll - np.arctan(roll)) + np.tan(pair.gear.base_helix_angle) / pair.gear.base_radius * z
    return roll, z, (turned - flank) / pair.gear.angular_pitch + sense * pmc


@pytest.mark.parametrize("refined", [False, True])
def test_flanks_stand_in_the_conjugate_position(any_grc_pair, refined):
    pmc = 0.3
    if refined:
        _, two = refined_gears(any_grc_pair, COARSE, pmc, HALF_WIDTH, 3, closed=False)
    else:
        _, two = placed_gears(any_grc_pair, UNIFORM, 3, pmc, closed=False)
    _, _, teeth = roll_on_gear_2(any_grc_pair, two, pmc)
    # Nodes lie on the involutes to rounding: three teeth, whole pitches apart.
    assert np.abs(teeth - np.round(teeth)).max() < 1e-9
    assert sorted(set(np.round(teeth))) == [-1, 0, 1]


def test_contact_lines_of_both_gears_meet_in_the_line_of_action(any_grc_pair):
    pair, axial = any_grc_pair, np.linspace(-0.05, 0.05, 5)
    one, two = contact_line_rolls(pair, 1, 0.2, axial)
    # In the frame of the line of action: the distance of the two tangent points is a sin(alpha_w).
    sign = -1 if pair.gear.internal else 1
    total = one * pair.pinion.base_radius + sign * two * pair.gear.base_radius
    assert np.allclose(total, sign**2 * pair.centre_distance * math.sin(pair.working_pressure_angle) * sign)


TWIN = Gear(name="twin", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=100e-3)


@pytest.mark.parametrize("name", ["sun_planet", "ring_planet", "twins"])
def test_flank_nodes_of_gear_2_gather_about_the_contact_line_of_each_layer(name, request):
    # A gear that meshes with its like must not be taken for gear 1.
    twins = GearPair(name="twins", pinion=TWIN, gear=TWIN, centre_distance=150e-3)
    pair = twins if name == "twins" else request.getfixturevalue(name)
    pmc, base, checked = 0.2, pair.gear.base_radius, 0
    sector = refined_gears(pair, COARSE, pmc, HALF_WIDTH, 3, closed=False)[1]
    roll, axial, tooth = roll_on_gear_2(pair, sector, pmc)
    tooth = np.round(tooth) * (1 if pair.gear.internal else -1)  # teeth of an external gear 2 count backwards
    for number in (-1, 0):
        for z in np.unique(np.round(axial, 9)):
            arc = np.sort(base * roll[(tooth == number) & (np.abs(axial - z) < 1e-8)] ** 2 / 2)
            line = base * contact_line_rolls(pair, number, pmc, np.array([z]))[1][0] ** 2 / 2
            steps, middles = np.diff(arc), (arc[1:] + arc[:-1]) / 2
            near = np.abs(middles - line) < 1.3 * HALF_WIDTH
            if not arc[0] + 2 * HALF_WIDTH < line < arc[-1] - 2 * HALF_WIDTH:
                continue
            checked += 1
            # Three elements across the contact width of twice the half width, and no larger ones nearby.
            assert near.sum() >= 3
            assert steps[near].max() < 1.3 * 2 * HALF_WIDTH / 3
            assert steps.max() > 3 * steps[near].max()
    assert checked >= 5


def test_refined_gears_are_one_sound_mesh(any_grc_pair):
    for sector in refined_gears(any_grc_pair, COARSE, 0.6, HALF_WIDTH, 3, closed=False):
        # Raises where an element folds; a crack between sectors would leave two nodes at one place.
        brick_gradients(sector.points, sector.hexahedra)
        assert len(np.unique(np.round(sector.points, 10), axis=0)) == len(sector.points)
        assert len(np.unique(sector.hexahedra)) == len(sector.points)
        assert sorted(set(sector.tooth)) == [-1, 0, 1]


def test_flank_facets_face_outward(any_grc_pair):
    for sector in refined_gears(any_grc_pair, COARSE, 0.0, HALF_WIDTH, 3, closed=False):
        corners = sector.points[sector.facets]
        normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        inward = sector.points[sector.hexahedra[sector.contact_faces[:, 0]]].mean(axis=1) - corners.mean(axis=1)
        assert (np.einsum("ij,ij->i", normal, inward) < 0).all()


def test_refining_shrinks_every_element():
    finer = COARSE.refined(2)
    assert (finer.layers, finer.contact_elements, finer.growth) == (8, 6, 0.4)


@pytest.mark.parametrize("wrong", [{"contact_elements": 0.5}, {"band": 0.5}, {"growth": 0.0}])
def test_settings_without_a_contact_are_refused(wrong):
    with pytest.raises(ValueError, match="at least 1"):
        ContactMesh(**wrong)
