"""Whole gears in the non-linear analysis: condensed teeth, agreement with the tables, thin rims, modifications."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import KINDS, template
from exugear.system.tooth_mesh.reference_tables import requested_references
from fe_ste.elasticity.gear_mesh import ContactMesh, meshed_teeth, placed_gears, refined_gears, whole_ring
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.flanks import FlankModification, Relief
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.reference.newton import solve_contact
from fe_ste.reference.position import NonlinearSettings, gear_model, nonlinear_position, stress_of_position
from fe_ste.root_stress import root_gauges
from fe_ste.transmission_error.compliance import pair_compliance
from fe_ste.transmission_error.contact_stress import mean_contact_stress
from fe_ste.transmission_error.search import pitch_point_pressure
from fe_ste.transmission_error.transmission_error import static_transmission_error

HELIX = 0.2
PINION = Gear(name="pinion", teeth=17, normal_module=3e-3, face_width=12e-3, held_diameter=20e-3, helix_angle=HELIX)
WHEEL = replace(PINION, name="wheel", teeth=23, helix_angle=-HELIX)
PAIR = GearPair(name="deep", pinion=PINION, gear=WHEEL, centre_distance=61.25e-3)
RING = replace(PINION, name="ring", teeth=51, internal=True, held_diameter=175e-3, tip_diameter=151.5e-3)
INTERNAL = GearPair(name="internal", pinion=PINION, gear=RING, centre_distance=52.0e-3)
UNIFORM = MeshSettings(layers=3, flank=6, thickness=4, fillet=2, root=2, rim=4)
COARSE = ContactMesh(layers=3, contact_elements=3, growth=1.0, thickness=5, fillet=2, root=2, rim=4, far_flank=4)


@pytest.mark.parametrize(
    "pair", [pytest.param(PAIR, id="external"), pytest.param(INTERNAL, id="internal", marks=pytest.mark.validation)]
)
def test_condensed_teeth_do_what_meshed_ones_do(pair):
    """Small strains: to rounding. A third way to the closed ring, beside that of the tables and an ordinary mesh."""
    gears = placed_gears(pair, UNIFORM, 3, 0.2)
    meshed = tuple(whole_ring(gear) for gear in gears)
    assert [len(gear.hexahedra) for gear in meshed] == [
        len(gear.hexahedra) * teeth // 3
        for gear, teeth in zip(gears, (pair.pinion.teeth, pair.gear.teeth), strict=True)
    ]
    condensed, ordinary = (solve_contact(gear_model(pair, 50.0, given, False)) for given in (gears, meshed))
    assert condensed.hub == pytest.approx(ordinary.hub, rel=1e-10)


@pytest.mark.validation
@pytest.mark.long
def test_condensed_teeth_turn_with_the_hub():
    """Finite deformation: they are linear in what they take up beyond the rigid turn of their hub, which is all."""
    gears = placed_gears(PAIR, UNIFORM, 3, 0.2)
    meshed = tuple(whole_ring(gear) for gear in gears)
    condensed, ordinary = (solve_contact(gear_model(PAIR, 50.0, given)) for given in (gears, meshed))
    assert condensed.hub == pytest.approx(ordinary.hub, rel=2e-6)
    small = solve_contact(gear_model(PAIR, 50.0, gears, False))
    assert abs(small.hub / ordinary.hub - 1.0) > 1e-3  # what is told apart here


def test_the_teeth_that_touch_are_meshed_and_the_others_condensed():
    # Contact lasts half the contact ratio on either side of the pitch point; lines within 15 % of a flank count.
    assert 1.6 < PAIR.total_contact_ratio < 2.0
    assert list(meshed_teeth(PAIR, 0.0)) == [-1, 0, 1]
    assert list(meshed_teeth(PAIR, 0.5)) == [-1, 0]
    wide = replace(PAIR, pinion=replace(PINION, face_width=60e-3))
    wide = replace(wide, gear=replace(WHEEL, face_width=60e-3))
    assert wide.total_contact_ratio > 2.5
    assert len(meshed_teeth(wide, 0.5)) == 4
    one, two = refined_gears(PAIR, COARSE, 0.5, 0.1e-3)
    assert one.others is not None and one.others.count == PINION.teeth - 2
    assert two.others is not None and two.others.count == WHEEL.teeth - 2


def mean_and_curve(pair: GearPair, torque: float, positions: int, settings: NonlinearSettings | None = None, **given):
    """Transmission errors (m) of both methods at equally spaced positions, the tables' method first."""
    modifications = given.get("modifications", (FlankModification(), FlankModification()))
    compliance = pair_compliance(pair).with_modifications(*modifications)
    table = static_transmission_error(compliance, torque, positions=positions)
    table = table.squeeze(("torque", "centre_distance", "misalignment"))
    table["contact_stress"] = mean_contact_stress(pair, table)
    found = [nonlinear_position(pair, torque, number / positions, settings, **given) for number in range(positions)]
    return table, found


@pytest.mark.validation
def test_a_gear_with_a_deep_body_has_the_transmission_error_of_the_tables():
    """A wheel held at a tenth of its diameter, coarse: an open sector of it is softer by far."""
    wheel = replace(WHEEL, teeth=60, held_diameter=20e-3, helix_angle=0.0)
    pinion = replace(PINION, helix_angle=0.0, profile_shift=0.1)
    pair = GearPair(name="deep", pinion=pinion, gear=wheel, centre_distance=115.9e-3)
    settings = NonlinearSettings(mesh=ContactMesh(layers=4, thickness=8, rim=8), finite_deformation=False)
    table, (found,) = mean_and_curve(pair, 60.0, 1, settings)
    assert found.ste == pytest.approx(float(table["ste"].mean()), rel=0.02)
    sector = nonlinear_position(pair, 60.0, 0.0, replace(settings, teeth=5, closed=False))
    assert sector.ste > 2.0 * found.ste
    assert_the_same_contact(table, [found])


def assert_the_same_contact(table, found):
    """Load shares within 5 % of the load, contact stress of the most loaded tooth pair within 5 %."""
    for number, position in enumerate(found):
        at = table.isel(pmc=number)
        for tooth, share in position.load_share.items():
            assert share == pytest.approx(float(at["load_share"].reindex(tooth=[tooth], fill_value=0.0)[0]), abs=0.05)
        most = max(position.load_share, key=position.load_share.get)
        assert position.contact_stress[most] == pytest.approx(float(at["contact_stress"].sel(tooth=most)), rel=0.05)


@pytest.mark.validation
def test_pressure_at_the_nodes_converges_to_that_of_hertz():
    """A spur pair with ten elements across the contact: at mid-face, where a long cylinder has the same pressure."""
    pinion = replace(PINION, teeth=24, face_width=6e-3, helix_angle=0.0, held_diameter=40e-3)
    wheel = replace(pinion, name="wheel", teeth=36, held_diameter=60e-3)
    pair = GearPair(name="spur", pinion=pinion, gear=wheel, centre_distance=90e-3)
    mesh = ContactMesh(layers=4, contact_elements=10.0)
    found = nonlinear_position(pair, 60.0, 0.0, NonlinearSettings(mesh=mesh, finite_deformation=False))
    axial = found.model.bricks.points[found.model.first.nodes, 2]
    at_mid_face = found.equilibrium.pressure[np.abs(axial) < 1e-8].max()
    assert found.load_share[0] == pytest.approx(1.0)
    assert at_mid_face == pytest.approx(pitch_point_pressure(pair, 60.0), rel=0.03)
    assert found.contact_stress[0] == pytest.approx(pitch_point_pressure(pair, 60.0), rel=0.03)


@pytest.mark.validation
@pytest.mark.long
def test_relief_takes_as_much_of_the_load_as_by_the_tables():
    """Tip relief and crowning: their gaps are added to those of the meshes."""
    relief = Relief(12e-6, 0.97 * PINION.tip_radius)
    modifications = (FlankModification(tip_relief=relief, lead_crowning=6e-6), FlankModification(helix_slope=8e-6))
    mesh = replace(COARSE, layers=8, contact_elements=4.0, thickness=8)
    settings = NonlinearSettings(mesh=mesh, finite_deformation=False)
    table, (found,) = mean_and_curve(PAIR, 60.0, 1, settings, modifications=modifications)
    plain = nonlinear_position(PAIR, 60.0, 0.0, settings)
    added = found.ste - plain.ste
    unmodified = static_transmission_error(pair_compliance(PAIR), 60.0, positions=1).squeeze()
    assert added == pytest.approx(float((table["ste"] - unmodified["ste"]).mean()), rel=0.05)


@pytest.mark.validation
def test_root_stress_is_that_of_the_closed_ring():
    """Tension in the fillet at mid-face: nodal stress of the full analysis, strain gauges of the condensed ring."""
    pinion = replace(PINION, teeth=19, helix_angle=0.0, held_diameter=16e-3, profile_shift=0.2)
    wheel = replace(pinion, name="wheel", teeth=37, held_diameter=30e-3)
    pair = GearPair(name="deep", pinion=pinion, gear=wheel, centre_distance=85.2e-3)
    mesh = ContactMesh(layers=4, fillet=8, root=4, rim=10)
    settings = NonlinearSettings(mesh=mesh, finite_deformation=False)
    found = nonlinear_position(pair, 60.0, 0.0, settings)
    assert found.load_share[0] == pytest.approx(1.0)
    field = stress_of_position(found)
    gear = found.sectors[0]
    x, y, z = gear.points.T
    radius = np.hypot(x, y)
    own = np.isin(np.arange(len(x)), gear.hexahedra[gear.brick_tooth == 0])
    root = own & (radius < pinion.form_radius) & (radius > 0.98 * pinion.root_radius) & (np.abs(z) < 1e-6)
    # The flank on the counter-clockwise side is pressed: the root on that side is in tension.
    tension = root & (np.arctan2(y, x) > np.median(np.arctan2(y, x)[own]))
    # Plane strain at the surface of mid-face: stress along the face is nu times that along the section.
    nu = pinion.material.poissons_ratio
    stress = field.von_mises[field.nodes_of(0)][tension].max() / math.sqrt(1.0 - nu + nu**2)
    load = found.equilibrium.pressure * found.equilibrium.weight
    flank_x, flank_y, flank_z = found.model.bricks.points[found.model.first.nodes].T
    roll = np.sqrt((np.hypot(flank_x, flank_y) / pinion.base_radius) ** 2 - 1.0)
    gauges = root_gauges(pinion, 1)
    largest, _ = gauges.principal({0: gauges.node_loads(roll, flank_z, load)})
    assert stress == pytest.approx(float(largest[..., len(gauges.axial) // 2].max()), rel=0.03)


def pairs_of_gearboxes(folder: Path) -> dict[str, tuple[GearPair, float]]:
    """All pairs of the templates and of the reference gearbox, with their static torques (N m).

    Two more have gears whose bodies matter: an internal gear with a rim of 0.65 mm, and 150 teeth on a bore of 430 mm.
    """
    files = {"grc": Path(__file__).parents[3] / "cases" / "grc750" / "gearbox.toml"}
    for kind in KINDS:
        files[kind] = folder / f"{kind}.toml"
        files[kind].write_text(template(kind), encoding="utf-8")
    found = {}
    for kind, path in files.items():
        for request in requested_references(Gearbox.from_toml(path), folder):
            found[f"{kind} {request.name}"] = request.wanted.pair, request.wanted.torque
    pinion = Gear(name="pinion", teeth=24, normal_module=3e-3, face_width=20e-3, held_diameter=50e-3, profile_shift=0.2)
    ring = replace(pinion, name="ring", teeth=75, internal=True, held_diameter=235e-3, tip_diameter=220.5e-3)
    helical = replace(pinion, helix_angle=HELIX)
    large = replace(pinion, name="large", teeth=150, held_diameter=430e-3, profile_shift=-0.2, helix_angle=-HELIX)
    distance = 87 * 3e-3 / math.cos(HELIX) + 0.1e-3
    found["thin rim"] = GearPair(name="thin rim", pinion=pinion, gear=ring, centre_distance=76.4e-3), 200.0
    found["large bore"] = GearPair(name="large bore", pinion=helical, gear=large, centre_distance=distance), 200.0
    return found


PAIRS = [
    "parallel stage_1",
    "parallel stage_2",
    "pair helical",
    "planetary sun_planet",
    "planetary ring_planet",
    "wind sun_planet",
    "wind ring_planet",
    "wind intermediate",
    "wind high_speed",
    "grc sun_planet",
    "grc ring_planet",
    "grc intermediate",
    "grc high_speed",
    "thin rim",
    "large bore",
]


@pytest.mark.validation
@pytest.mark.long
@pytest.mark.parametrize("name", PAIRS)
def test_both_methods_agree_within_two_per_cent_over_the_mesh_cycle(name, tmp_path):
    """Five positions of each pair: mean, curve, load shares and contact stress."""
    pair, torque = pairs_of_gearboxes(tmp_path)[name]
    table, found = mean_and_curve(pair, torque, 5, NonlinearSettings(finite_deformation=False))
    ste = np.array([position.ste for position in found])
    assert ste.mean() == pytest.approx(float(table["ste"].mean()), rel=0.02)
    assert np.abs(ste / ste.mean() - table["ste"] / table["ste"].mean()).max() < 0.02
    assert_the_same_contact(table, found)
