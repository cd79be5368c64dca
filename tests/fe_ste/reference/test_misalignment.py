"""Load along the face under misalignment: full contact of finite elements, contact of a table, what a rating reads."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.gear_mesh import ContactMesh, refined_gears
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.reference.newton import NewtonSettings, solve_contact
from fe_ste.reference.position import gear_model
from fe_ste.root_stress import mesh_cycle_stress, root_gauges
from fe_ste.transmission_error.compliance import pair_compliance
from fe_ste.transmission_error.contact_stress import face_load_factor
from fe_ste.transmission_error.search import hertz_half_width, least_contact_length, normal_load
from fe_ste.transmission_error.transmission_error import static_transmission_error

SPUR = Gear(name="spur", teeth=50, normal_module=3e-3, face_width=20e-3, held_diameter=134e-3)
PAIR = GearPair(name="spur", pinion=SPUR, gear=SPUR, centre_distance=150e-3)
TORQUE = 340.0
OPENING = 10e-6
"""At the +z end over the face width, m: half of what the teeth approach under the torque."""
MESH = ContactMesh(layers=6, contact_elements=3, growth=1.0, thickness=4, fillet=2, root=1, rim=3, far_flank=4)


@pytest.fixture(scope="module")
def compliance():
    return pair_compliance(PAIR, MeshSettings(layers=12), ContactSettings(slices=24))


def load_by_full_contact(misalignment: float) -> tuple[np.ndarray, np.ndarray]:
    """Places along the face (m) and normal loads there (N) at the pitch point, gear 2 tilted in the plane of action."""
    half_width = hertz_half_width(PAIR, normal_load(PAIR, TORQUE) / least_contact_length(PAIR))
    one, two = refined_gears(PAIR, MESH, 0.0, half_width, 3)
    pitch = np.array([PAIR.pinion.reference_radius, 0.0, 0.0])
    # The normal of flank 1 at its contact says which way opens the gap.
    facet = one.points[one.facets].mean(axis=1)
    near = one.facets[np.argmin(np.linalg.norm((facet - pitch)[:, :2], axis=1))]
    corners = one.points[near]
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    normal /= np.linalg.norm(normal)
    turn = misalignment * np.cross([0.0, 0.0, 1.0], normal)
    apart = 0.5 * misalignment * PAIR.face_width * normal  # so that nothing overlaps before the load comes
    tilted = dataclasses.replace(two, points=two.points + np.cross(turn, two.points - pitch) + apart)
    model = gear_model(PAIR, TORQUE, (one, tilted))
    found = solve_contact(model, NewtonSettings())
    return model.bricks.points[model.first.nodes, 2], found.pressure * found.weight


@pytest.mark.validation
def test_load_along_the_face_is_that_of_the_full_contact_of_tilted_gears(compliance):
    """Where the load sits, and how much of it in the half that comes nearer, of two methods that share no contact."""
    misalignment = OPENING / PAIR.face_width
    z, load = load_by_full_contact(misalignment)
    states = static_transmission_error(compliance, TORQUE, positions=1, misalignment=[misalignment]).squeeze()
    width = PAIR.face_width
    centre = float(z @ load / load.sum())
    assert centre < -0.1 * width
    assert float(states["load_centroid"]) == pytest.approx(centre, abs=0.01 * width)
    axial, line = states["axial_position"].to_numpy(), states["line_load"].sum("tooth").to_numpy()
    nearer = load[z < -1e-9].sum() + 0.5 * load[np.abs(z) <= 1e-9].sum()
    assert line[axial < 0.0].sum() / line.sum() == pytest.approx(nearer / load.sum(), abs=0.02)


def test_what_a_rating_reads_between_misalignments_is_the_contact_there(compliance):
    """Interpolated from a table with five misalignments, and solved at one between two of them, within 3 %."""
    tilts = np.array([-30e-6, -15e-6, 0.0, 15e-6, 30e-6]) / PAIR.face_width
    between = 10e-6 / PAIR.face_width
    gauges = root_gauges(PAIR.pinion, 1)
    of_table, direct = (
        static_transmission_error(compliance, TORQUE, positions=4, misalignment=list(chosen))
        for chosen in (tilts, [between])
    )
    table, there = (mesh_cycle_stress(PAIR, states, (gauges, gauges)) for states in (of_table, direct))
    torque, tilt = np.array(TORQUE), np.array(between)
    for values, power, known in (
        (table.face_load, 0.0, there.face_load),
        (table.hertz, 0.5, there.hertz),
        (table.root[..., 0], 1.0, there.root[..., 0]),
    ):
        assert float(table.at(values, power, torque, tilt)) == pytest.approx(float(known[0, 0]), rel=0.03)
    assert there.face_load[0, 0] == pytest.approx(float(face_load_factor(direct).squeeze()), rel=1e-9)
    aligned = float(table.face_load[0, 2])
    assert float(there.face_load[0, 0]) > 1.2 * aligned
