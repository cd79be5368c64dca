"""Cones of turned shafts: exact mass, stiffness of tapered bars in closed form, the same shaft as a solid."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.sparse
import skfem

from exugear.system.bodies.shaft_sections import MeshSize, SeatBand, ShaftError, ShaftSection
from exugear.system.bodies.turned_section import HarmonicName, Shaft, Tapers, turned_hexahedra
from fe_ste.geometry.cylinders import MassProperties, Tube, mass_properties
from fe_ste.geometry.gears import Material

STEEL = Material()
SHEAR = STEEL.youngs_modulus / (2.0 * (1.0 + STEEL.poissons_ratio))
SHAPES = {
    "solid": (ShaftSection(0.1, 0.06), ShaftSection(0.2, 0.06, 0.0, 0.1), ShaftSection(0.1, 0.12)),
    "bored": (ShaftSection(0.1, 0.1, 0.04), ShaftSection(0.2, 0.1, 0.04, 0.08, 0.06), ShaftSection(0.1, 0.08, 0.06)),
    "two cones": (
        ShaftSection(0.1, 0.1, 0.02, 0.06, 0.02),
        ShaftSection(0.05, 0.12, 0.03),
        ShaftSection(0.1, 0.09, 0.03, 0.05, 0.01),
        ShaftSection(0.1, 0.05, 0.01, 0.07, 0.04),
    ),
}


def closed_form(sections: tuple[ShaftSection, ...]) -> MassProperties:
    """Frusta in closed form."""
    tubes, start = [], 0.0
    for one in sections:
        ends = {"outer_end": one.outer_end, "inner_end": one.inner_end}
        tube = Tube(start=start, length=one.length, outer=one.outer_diameter, inner=one.inner_diameter,
                    density=STEEL.density, **ends)  # fmt: skip
        tubes.append(tube)
        start += one.length
    return mass_properties(tubes)


@pytest.mark.parametrize("name", SHAPES)
def test_mass_and_inertia_are_those_of_frusta(name: str) -> None:
    """Elements have straight edges and follow a cone exactly; what they integrate is a polynomial."""
    shaft, expected = Shaft(SHAPES[name], STEEL, ()), closed_form(SHAPES[name])
    bending, torsion = shaft.harmonic("bending"), shaft.harmonic("torsion")
    whole = bending.rigid.T @ bending.mass @ bending.rigid
    assert whole[0, 0] == pytest.approx(expected.mass, rel=1e-11)
    assert whole[0, 1] == pytest.approx(expected.mass * expected.centre, rel=1e-11)
    assert whole[1, 1] == pytest.approx(expected.transverse + expected.mass * expected.centre**2, rel=1e-11)
    assert (torsion.rigid.T @ torsion.mass @ torsion.rigid).item() == pytest.approx(expected.axial, rel=1e-11)


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("harmonic", ["bending", "torsion", "stretching"])
def test_rigid_motions_strain_no_cone(name: str, harmonic: HarmonicName) -> None:
    found = Shaft(SHAPES[name], STEEL, ()).harmonic(harmonic)
    force = found.stiffness @ found.rigid
    assert np.abs(force).max() < 1e-9 * np.abs(found.stiffness.data).max()


def stiffness_between_ends(shaft: Shaft, harmonic: HarmonicName) -> float:
    """Moment or force over the motion of one end against the other, both seats of their averages."""
    found = shaft.harmonic(harmonic)
    seats = scipy.sparse.csr_array(found.seats)
    system = scipy.sparse.block_array([[found.stiffness, seats.T], [seats, None]], format="csc")
    load = np.concatenate([np.zeros(found.stiffness.shape[0]), [0.0, 1.0]])
    return float(abs(scipy.sparse.linalg.spsolve(system, load)[-1]))


def test_torsion_and_stretching_are_those_of_tapered_bars() -> None:
    """k_t = 3 pi G (d2 - d1) / (32 L (d1^-3 - d2^-3)), k = pi E d1 d2 / (4 L): plane sections, slope 1 in 40.

    Sections of a cone stay plane but for the square of its slope, 6e-4; the ends add as much as their seats average.
    """
    length, first, second = 0.8, 0.06, 0.1
    shaft = Shaft([ShaftSection(length, first, 0.0, second)], STEEL, [SeatBand("a", 0.0), SeatBand("b", length)])
    torsion = 3.0 * math.pi * SHEAR * (second - first) / (32.0 * length * (first**-3 - second**-3))
    stretching = math.pi * STEEL.youngs_modulus * first * second / (4.0 * length)
    assert stiffness_between_ends(shaft, "torsion") == pytest.approx(torsion, rel=1e-3)
    assert stiffness_between_ends(shaft, "stretching") == pytest.approx(stretching, rel=1e-3)


def test_many_short_cylinders_come_near_the_cone_from_below() -> None:
    """Steps leave corners that carry nothing: 8 are softer in torsion than the cone, 32 less so."""
    cone = ShaftSection(0.2, 0.06, 0.0, 0.1)
    seats = [SeatBand("a", 0.0), SeatBand("b", 0.2)]
    whole = stiffness_between_ends(Shaft([cone], STEEL, seats), "torsion")
    lacking = []
    for count in (8, 32):
        steps = [ShaftSection(0.2 / count, 0.06 + 0.04 * (n + 0.5) / count) for n in range(count)]
        stepped = Shaft(steps, STEEL, seats, MeshSize(grading=1))
        lacking.append(1.0 - stiffness_between_ends(stepped, "torsion") / whole)
    assert 0.0 < lacking[1] < lacking[0] < 0.02


def test_cylinders_are_meshed_as_before() -> None:
    """A cone whose ends are equal is a cylinder, and nothing is moved."""
    plain = Shaft([ShaftSection(0.1, 0.06), ShaftSection(0.1, 0.08, 0.02)], STEEL, ())
    assert plain.mesh is plain.lines
    same = Shaft([ShaftSection(0.1, 0.06, 0.0, 0.06), ShaftSection(0.1, 0.08, 0.02)], STEEL, ())
    np.testing.assert_array_equal(same.mesh.p, plain.mesh.p)


def test_radii_change_evenly_along_a_cone_and_stay_apart() -> None:
    tapers = Tapers(SHAPES["two cones"])
    z = np.linspace(0.0, 0.35, 701)
    outer = tapers.radius(np.full(z.shape, tapers.outer[0]), z)[z <= 0.1]
    np.testing.assert_allclose(outer, 0.05 - 0.2 * z[z <= 0.1], rtol=0.0, atol=1e-15)
    radii = np.stack([tapers.radius(np.full(z.shape, r), z) for r in np.linspace(0.0, 0.08, 33)])
    assert np.diff(radii, axis=0).min() > 0.0


def test_a_seat_on_a_cone_follows_it() -> None:
    """Its averages of rigid motions are these motions, about the middle of the seat."""
    shaft = Shaft(SHAPES["solid"], STEEL, [SeatBand("cone", 0.2, 0.04)])
    torsion = shaft.harmonic("torsion")
    assert (torsion.seats @ torsion.rigid).item() == pytest.approx(1.0, rel=1e-12)
    bending = shaft.harmonic("bending")
    np.testing.assert_allclose(bending.seats @ bending.rigid, [[1.0, 0.2], [0.0, 1.0]], rtol=1e-12, atol=1e-12)


def test_the_same_cone_as_a_solid_has_its_mass() -> None:
    """16 elements around are 0.005 % short."""
    mesh = turned_hexahedra(Shaft(SHAPES["solid"], STEEL, (), MeshSize(0.05, 0.05, 1)), 16)
    basis = skfem.Basis(mesh, skfem.ElementHex1(), intorder=4)
    assert basis.dx.sum() * STEEL.density == pytest.approx(closed_form(SHAPES["solid"]).mass, rel=2e-4)


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            (0.1, 0.06, 0.02, 0.01, 0.02),
            "section that ends with diameters 0.01 over 0.02 m: a positive wall thickness is required there",
        ),
        (
            (0.1, 0.06, 0.0, 0.06, 0.02),
            "m at its end: a cone tip cannot be meshed; set a bore diameter at both ends, or split the section",
        ),
    ],
)
def test_cones_that_cannot_be_are_refused(section: tuple[float, ...], message: str) -> None:
    with pytest.raises(ShaftError, match=message):
        ShaftSection(*section)
