"""Stresses in meshing teeth, by both methods, and their pictures."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fe_ste.contact.kinematics import ContactSettings
from fe_ste.elasticity.gear_mesh import ContactMesh
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.pictures.teeth import draw_contact_stress
from fe_ste.reference.position import NonlinearSettings, nonlinear_position, stress_of_position, stress_of_state
from fe_ste.transmission_error.compliance import pair_compliance
from fe_ste.transmission_error.search import contact_state, hertz_half_width, normal_load

from ...optional_libraries import needs_rendering
from ..cases.gears import SPUR_PAIR

TORQUE = 100.0  # little enough for one tooth pair alone to touch at the pitch point
SETTINGS = NonlinearSettings(
    teeth=3,
    mesh=ContactMesh(layers=3, contact_elements=5, growth=0.7, thickness=8, fillet=3, root=2, rim=6, far_flank=4),
)


@pytest.fixture(scope="module")
def fields():
    mesh = MeshSettings(layers=4, flank=14, thickness=8, fillet=3, root=2, rim=6)
    compliance = pair_compliance(SPUR_PAIR, mesh, ContactSettings(slices=12), open_teeth=3)
    return {
        "non-linear": stress_of_position(nonlinear_position(SPUR_PAIR, TORQUE, 0.0, SETTINGS)),
        "superelement": stress_of_state(compliance, contact_state(compliance, TORQUE, 0.0), TORQUE, SETTINGS),
    }


@pytest.mark.validation
@pytest.mark.parametrize("method", ["non-linear", "superelement"])
def test_pressure_and_equivalent_stress_are_those_of_hertz(fields, method):
    field = fields[method]
    line_load = normal_load(SPUR_PAIR, TORQUE) / SPUR_PAIR.face_width
    peak = 2 * line_load / (np.pi * hertz_half_width(SPUR_PAIR, line_load))
    middle = np.abs(field.sectors[0].points[:, 2]) < 5e-3
    own = field.nodes_of(0)
    # Nodal means over five elements across the contact lower the peak; the slices' pressure varies along the width.
    assert field.pressure[own][middle].max() == pytest.approx(peak, rel=0.08)
    # Line contact in plane strain, nu = 0.3: 0.557 p0 below the surface (Johnson, Contact Mechanics, sec. 4.2); the
    # extrapolation to nodes overshoots with elements as large as its depth.
    assert field.von_mises[own][middle].max() == pytest.approx(0.557 * peak, rel=0.2)


def test_both_methods_stress_the_teeth_alike(fields):
    one, two = fields["non-linear"], fields["superelement"]
    height = np.concatenate([sector.points[:, 2] for sector in one.sectors])
    # Where the contact is; at the end faces the half-space of the superelement is only mirrored.
    high = (one.von_mises > 0.3 * one.von_mises.max()) & (np.abs(height) < 5e-3)
    apart = np.abs(one.von_mises - two.von_mises)[high]
    assert np.sqrt(np.mean(apart**2)) < 0.05 * one.von_mises.max()
    # Gear 2 turns alike, as far as the coarse mesh of the superelement and that of the stresses go.
    apart = np.abs(one.displacement - two.displacement).max()
    assert apart < 0.05 * np.abs(one.displacement).max()


def test_no_pressure_strays_from_the_contact_line(fields):
    field = fields["superelement"]
    own = field.sectors[0].points[field.pressure[field.nodes_of(0)] > 0.0]
    # The pitch point of equal gears: half the centre distance; the tents of the elements reach a little further.
    assert np.abs(np.hypot(own[:, 0], own[:, 1]) - 75e-3).max() < 0.3e-3


def test_pressures_of_both_gears_carry_the_same_load(fields):
    field = fields["non-linear"]
    totals = []
    for number, sector in enumerate(field.sectors):
        corners = sector.points[sector.facets]
        area = np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1) / 2
        totals.append(float((field.pressure[field.nodes_of(number)][sector.facets].mean(axis=1) * area).sum()))
    assert totals == pytest.approx([normal_load(SPUR_PAIR, TORQUE)] * 2, rel=0.01)


@pytest.mark.sample
@needs_rendering
@pytest.mark.parametrize("flank_of", [1, 2])
def test_the_picture_shows_both_views_and_names_load_and_method(fields, tmp_path, flank_of):
    path = tmp_path / "stress.png"
    figure = draw_contact_stress(fields["superelement"], path, title="spur pair", flank_of=flank_of, size=(300, 220))
    assert path.stat().st_size > 10_000
    said = figure._suptitle.get_text()
    assert "spur pair: 100 N m on gear 1" in said and "superelement" in said and "20 times" in said
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[0].startswith("flank of the spur") and titles[1].startswith("section at z")
    images = [axes.images[0].get_array() for axes in figure.axes[:2]]
    # Neither view is empty: colours beside white.
    assert all(len(np.unique(np.asarray(image).reshape(-1, 3), axis=0)) > 100 for image in images)


def test_pictures_without_pressure_or_of_a_third_gear_are_refused(fields):
    field = fields["non-linear"]
    with pytest.raises(ValueError, match="no node carries pressure"):
        draw_contact_stress(dataclasses.replace(field, pressure=0 * field.pressure))
    with pytest.raises(ValueError, match="must be 1 or 2"):
        draw_contact_stress(field, flank_of=3)
