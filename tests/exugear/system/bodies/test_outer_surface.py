"""Outer surface of solids and the integral of their normal motion, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import skfem

from exugear.system.bodies.outer_surface import radiating_surface
from exugear.system.bodies.reduction import RadiatingSurface, load_or_reduce
from exugear.system.bodies.shaft_sections import MeshSize, ShaftSection
from exugear.system.bodies.solid_elements import SolidSeat
from exugear.system.bodies.solids import SolidModel, reduce_solid
from exugear.system.bodies.turned_section import Shaft, turned_hexahedra
from fe_ste.geometry.gears import Material

STEEL = Material(210e9, 0.3, 7850.0)
NECK = SolidSeat("neck", (0.0, 0.0, 0.13), 0.03, 0.02)


def translations(mesh) -> np.ndarray:
    """Displacement (3 nodes, 3) of a mesh that moves along x, y and z."""
    return np.tile(np.eye(3), (mesh.doflocs.shape[1], 1))


def box(*sides: float, parts: int = 2):
    """Box with a corner at the origin as hexahedra."""
    return skfem.MeshHex2.from_mesh(skfem.MeshHex.init_tensor(*(np.linspace(0.0, side, parts + 1) for side in sides)))


@pytest.fixture(scope="module")
def vessel():
    """Closed cylinder of 200 x 140 mm with walls of 20 mm and a bore of 60 mm in its upper end."""
    sections = (ShaftSection(0.02, 0.2), ShaftSection(0.1, 0.2, 0.16), ShaftSection(0.02, 0.2, 0.06))
    return turned_hexahedra(Shaft(sections, STEEL, (), MeshSize(0.02, 0.02, 0)), 24)


def test_a_moving_box_radiates_from_the_two_faces_across_its_motion():
    mesh = box(0.2, 0.3, 0.5)
    surface = radiating_surface(mesh, (), translations(mesh), 1000.0)
    assert surface.matrix == pytest.approx(np.diag([2 * 0.15, 2 * 0.10, 2 * 0.06]), abs=1e-12)
    assert surface.area == pytest.approx(2 * (0.15 + 0.10 + 0.06), rel=1e-12)


def test_a_moving_sphere_radiates_from_a_third_of_its_area_in_every_direction():
    mesh = skfem.MeshTet2.from_mesh(skfem.MeshTet.init_ball(2))
    surface = radiating_surface(mesh, (), translations(mesh), 1000.0)
    assert surface.area == surface.whole_area
    assert surface.matrix / surface.area == pytest.approx(np.eye(3) / 3.0, abs=1e-9)


def test_a_plate_in_half_waves_radiates_from_a_quarter_of_both_faces():
    # Mean square of sin(pi x / a) sin(pi y / b): 1/4. Elements of second order know the sine to 1e-3 of its square.
    a, b = 0.5, 0.4
    mesh = box(a, b, 0.01, parts=8)
    x, y, _ = mesh.doflocs
    motion = np.zeros((len(x), 3, 1))
    motion[:, 2, 0] = np.sin(math.pi * x / a) * np.sin(math.pi * y / b)
    surface = radiating_surface(mesh, (), motion.reshape(-1, 1), 1000.0)
    assert surface.matrix[0, 0] == pytest.approx(2 * a * b / 4, rel=1e-3)


def test_bending_of_a_box_without_volume_displacement_is_radiated_all_the_same():
    # u = z over a face x = const. has the integral of z^2; both faces, and nothing on the others.
    mesh = box(0.2, 0.3, 0.5)
    motion = np.zeros((mesh.doflocs.shape[1], 3, 1))
    motion[:, 0, 0] = mesh.doflocs[2]
    surface = radiating_surface(mesh, (), motion.reshape(-1, 1), 1000.0)
    assert surface.matrix[0, 0] == pytest.approx(2 * 0.3 * 0.5**3 / 3, rel=1e-12)


def test_a_capped_vessel_radiates_from_outside_alone(vessel):
    # Closed form of the cylinder; 24 segments are parabolas, 1e-5 short.
    modes = np.hstack([np.zeros((3 * vessel.doflocs.shape[1], 6)), translations(vessel)])
    capped = radiating_surface(vessel, [NECK], modes, 1000.0)
    assert capped.area == pytest.approx(math.pi * 0.2 * 0.14 + 2 * math.pi * 0.1**2, rel=2e-5)
    assert np.diag(capped.matrix)[6:8] == pytest.approx(math.pi * 0.1 * 0.14, rel=2e-5)
    # The cap moves with its seat: piston pi r^2, tilts pi r^4 / 4.
    own = np.diag(capped.matrix)[:6]
    assert own == pytest.approx([0, 0, math.pi * 0.03**2, math.pi * 0.03**4 / 4, math.pi * 0.03**4 / 4, 0], abs=1e-12)
    rigid = np.zeros(9)
    rigid[[2, 8]] = 1.0
    assert rigid @ capped.matrix @ rigid == pytest.approx(2 * math.pi * 0.1**2, rel=2e-5)


def test_an_open_bore_lets_the_inside_radiate(vessel):
    modes = np.hstack([np.zeros((3 * vessel.doflocs.shape[1], 6)), translations(vessel)])
    opened = radiating_surface(vessel, [NECK], modes, 1000.0, closed=False)
    capped = radiating_surface(vessel, [NECK], modes, 1000.0)
    assert opened.area == opened.whole_area == capped.whole_area
    assert 10 * math.log10(opened.area / capped.area) == pytest.approx(2.0, abs=0.01)


def test_sectors_of_a_ring_share_the_discs_over_its_opening():
    # Seats on the outside of a ring of 0.4 / 0.3 x 0.1 m: its bore and the annuli do not count twice.
    mesh = turned_hexahedra(Shaft((ShaftSection(0.1, 0.4, 0.3),), STEEL, (), MeshSize(0.05, 0.05, 0)), 24)
    sectors = [SolidSeat(f"ring_{n}", (0.0, 0.0, 0.05), 0.2, 0.1, 0.0, (0.0, 2.0)) for n in range(3)]
    modes = np.zeros((3 * mesh.doflocs.shape[1], 18))
    surface = radiating_surface(mesh, sectors, modes, 1000.0)
    assert surface.area == pytest.approx(math.pi * 0.4 * 0.1 + 2 * math.pi * 0.2**2, rel=0.02)
    together = np.zeros(18)
    together[2::6] = 1.0
    assert together @ surface.matrix @ together == pytest.approx(2 * math.pi * 0.15**2, rel=0.01)


def test_a_reduced_housing_keeps_its_outer_surface_on_disk(tmp_path):
    mesh = box(0.2, 0.3, 0.1)
    seats = tuple(SolidSeat(name, (0.1, 0.15, z), 0.3) for name, z in (("below", 0.0), ("above", 0.1)))
    body = reduce_solid(SolidModel("housing", mesh, STEEL, seats, "ground", 3000.0, 1e5))
    assert body.radiating is not None
    rigid = body.rigid_motions((0.0, 0.0, 0.0))[:, :3]
    assert rigid.T @ body.radiating.matrix @ rigid == pytest.approx(np.diag([0.06, 0.04, 0.12]), abs=1e-9)
    file = tmp_path / "housing.npz"
    load_or_reduce(file, "key", lambda: body)
    stored = load_or_reduce(file, "key", pytest.fail).radiating
    assert isinstance(stored, RadiatingSurface)
    assert (stored.area, stored.whole_area, stored.band) == (
        body.radiating.area,
        body.radiating.whole_area,
        3000.0,
    )
    assert np.array_equal(stored.matrix, body.radiating.matrix)


def test_a_turning_body_has_no_outer_surface():
    mesh = turned_hexahedra(Shaft((ShaftSection(0.1, 0.1),), STEEL, (), MeshSize(0.05, 0.05, 0)), 8)
    seats = tuple(SolidSeat(name, (0.0, 0.0, z), 0.05) for name, z in (("left", 0.0), ("right", 0.1)))
    assert reduce_solid(SolidModel("shaft", mesh, STEEL, seats, "nonrotating", 3000.0, 1e5)).radiating is None
