"""Elasticity of shafts over the half-section, against beam theory, exact waves and solid elements."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
import scipy.sparse
import scipy.sparse.linalg
import skfem

from exugear.system.bodies.shaft_sections import MeshSize, SeatBand, ShaftError, ShaftSection
from exugear.system.bodies.turned_section import Shaft
from fe_ste.geometry.gears import Material

STEEL = Material(210e9, 0.3, 7850.0)
STEPPED = (ShaftSection(0.2, 0.06), ShaftSection(0.3, 0.1), ShaftSection(0.2, 0.08), ShaftSection(0.2, 0.05))


def elastic_frequencies(shaft: Shaft, motion: str, count: int) -> np.ndarray:
    """Free vibrations without the rigid motions, Hz."""
    h = shaft.harmonic(motion)
    rigid = h.rigid.shape[1]
    values = scipy.sparse.linalg.eigsh(
        h.stiffness, count + rigid, h.mass, sigma=-1e6, return_eigenvectors=False, v0=np.ones(h.mass.shape[0])
    )
    return np.sqrt(np.sort(values)[rigid:]) / (2.0 * np.pi)


def timoshenko_free_free(length: float, outer: float, inner: float, material: Material, count: int) -> list[float]:
    """Frequencies (Hz) of a free beam by the transfer matrix of the four beam equations.

    Shear coefficient of solid and hollow circles: Hutchinson, J. Appl. Mech. 68 (2001) 87-92.
    """
    e, nu, rho = material.youngs_modulus, material.poissons_ratio, material.density
    a, b = outer / 2.0, inner / 2.0
    area, second = math.pi * (a**2 - b**2), math.pi / 4.0 * (a**4 - b**4)
    below = 7 * a**4 + 34 * a**2 * b**2 + 7 * b**4 + nu * (12 * a**4 + 48 * a**2 * b**2 + 12 * b**4)
    below += nu**2 * (4 * a**4 + 16 * a**2 * b**2 + 4 * b**4)
    shear = 6 * (a**2 + b**2) ** 2 * (1 + nu) ** 2 / below * e / (2 * (1 + nu)) * area

    def ends(frequency: float) -> float:
        w2 = (2 * math.pi * frequency) ** 2
        equations = np.zeros((4, 4))  # deflection, rotation, moment, shear force
        equations[0, 1], equations[0, 3] = 1.0, 1.0 / shear
        equations[1, 2] = 1.0 / (e * second)
        equations[2, 1], equations[2, 3] = -rho * second * w2, -1.0
        equations[3, 0] = -rho * area * w2
        return float(np.linalg.det(scipy.linalg.expm(equations * length)[2:, :2]))

    slender = [4.73004, 7.85320, 10.99561]
    guesses = [k**2 / (2 * math.pi * length**2) * math.sqrt(e * second / (rho * area)) for k in slender]
    grid = np.linspace(0.3 * guesses[0], guesses[count - 1], 200)
    signs = [ends(f) for f in grid]
    found = [
        scipy.optimize.brentq(ends, low, high, rtol=1e-12)
        for low, high, one, two in zip(grid[:-1], grid[1:], signs[:-1], signs[1:], strict=True)
        if one * two < 0.0
    ]
    return found[:count]


@pytest.mark.parametrize(("length", "outer", "inner"), [(1.2, 0.08, 0.0), (1.5, 0.05, 0.0), (1.2, 0.08, 0.04)])
def test_plain_shafts_bend_as_timoshenko_says(length, outer, inner):
    # Beam theory itself is an approximation: in the second mode it has a share of about (d / L)^4.
    shaft = Shaft([ShaftSection(length, outer, inner)], STEEL, [])
    expected = timoshenko_free_free(length, outer, inner, STEEL, 2)
    assert elastic_frequencies(shaft, "bending", 2) == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize("inner", [0.0, 0.04, 0.06])
def test_plain_shafts_twist_as_the_wave_equation_says(inner):
    shaft = Shaft([ShaftSection(1.2, 0.08, inner)], STEEL, [])
    speed = math.sqrt(STEEL.youngs_modulus / (2 * 1.3) / STEEL.density)
    assert elastic_frequencies(shaft, "torsion", 2) == pytest.approx([speed / 2.4, speed / 1.2], rel=1e-5)


def test_a_plain_bar_stretches_as_bar_theory_with_lateral_inertia_says():
    shaft = Shaft([ShaftSection(1.2, 0.08)], STEEL, [])
    plain = math.sqrt(STEEL.youngs_modulus / STEEL.density) / 2.4
    # Rayleigh's correction for the inertia of the cross-contraction: 1 - (n pi nu a)^2 / (4 L^2)
    corrected = plain * (1 - (math.pi * 0.3 * 0.04) ** 2 / (4 * 1.2**2))
    assert elastic_frequencies(shaft, "stretching", 1) == pytest.approx([corrected], rel=1e-5)


@pytest.mark.parametrize("motion", ["bending", "torsion", "stretching"])
def test_rigid_motions_store_no_energy_and_have_the_inertia_of_the_solid(motion):
    shaft = Shaft(STEPPED, STEEL, [])
    h = shaft.harmonic(motion)
    inertia = h.rigid.T @ h.mass @ h.rigid
    assert np.abs(h.stiffness @ h.rigid).max() < 1e-13 * np.abs(h.stiffness).max()
    mass = sum(math.pi / 4 * s.outer_diameter**2 * s.length * STEEL.density for s in STEPPED)
    polar = sum(math.pi / 32 * s.outer_diameter**4 * s.length * STEEL.density for s in STEPPED)
    assert inertia[0, 0] == pytest.approx(polar if motion == "torsion" else mass, rel=1e-10)


def test_a_rigid_tilt_has_the_polar_inertia_in_its_gyroscopic_term():
    h = Shaft(STEPPED, STEEL, []).harmonic("bending")
    polar = sum(math.pi / 32 * s.outer_diameter**4 * s.length * STEEL.density for s in STEPPED)
    gyroscopic = 2.0 * h.rigid.T @ h.gyroscopic @ h.rigid
    assert gyroscopic[1, 1] == pytest.approx(polar, rel=1e-10)
    assert np.abs(gyroscopic[0]).max() < 1e-12 * polar


@pytest.mark.parametrize("motion", ["bending", "torsion", "stretching"])
@pytest.mark.parametrize("width", [0.0, 0.04])
def test_seats_see_rigid_motions_as_they_are(motion, width):
    shaft = Shaft(STEPPED, STEEL, [SeatBand("seat", 0.35, width)])
    h = shaft.harmonic(motion)
    expected = [[1.0, 0.35], [0.0, 1.0]] if motion == "bending" else [[1.0]]
    assert h.seats @ h.rigid == pytest.approx(np.array(expected), abs=1e-12)


@pytest.mark.validation
def test_graded_shoulders_converge():
    # The re-entrant corners set the error: standard grading against twice as many lines.
    seats: list[SeatBand] = []
    standard = Shaft(STEPPED, STEEL, seats)
    finer = Shaft(STEPPED, STEEL, seats, MeshSize(grading=6))
    for motion, count in (("bending", 3), ("torsion", 1)):
        ratio = elastic_frequencies(standard, motion, count) / elastic_frequencies(finer, motion, count)
        assert np.all(ratio > 1.0)  # from above, as a displacement method must
        assert np.all(ratio < 1.0015)


@pytest.mark.validation
def test_solid_elements_on_the_same_lines_vibrate_alike():
    # Second method: 27-node hexahedra around the same half-section. Twelve of them around the axis hold a
    # circle to 4e-5 of its radius and cos(phi) to 1e-4.
    sections = (ShaftSection(0.15, 0.08, 0.04), ShaftSection(0.15, 0.12, 0.04))
    shaft = Shaft(sections, STEEL, [], MeshSize(0.05, 0.02, 1))
    solid = _solid_frequencies(shaft, segments=12, count=3)
    bending = elastic_frequencies(shaft, "bending", 1)[0]
    torsion = elastic_frequencies(shaft, "torsion", 1)[0]
    assert solid == pytest.approx(sorted([bending, bending, torsion]), rel=1e-3)


def _solid_frequencies(shaft: Shaft, segments: int, count: int) -> np.ndarray:
    """Elastic frequencies (Hz) of the half-section turned around the axis, hexahedra of second order."""
    r, z = shaft.mesh.p
    quads, nodes = shaft.mesh.t, r.size
    angles = np.linspace(0.0, 2.0 * np.pi, segments + 1)
    points = np.stack([np.tile(r, angles.size), np.repeat(angles, nodes), np.tile(z, angles.size)])
    layers = [quads + nodes * k for k in range(segments + 1)]
    a = [np.vstack([layers[k], layers[k + 1]]) for k in range(segments)]
    # scikit-fem's order of corners: 000 001 010 100 011 101 110 111 in (angle, side, side)
    corners = np.hstack(a)[[0, 1, 3, 4, 2, 5, 7, 6]]
    flat = skfem.MeshHex2.from_mesh(skfem.MeshHex(points, corners))
    logical = flat.doflocs
    turned = np.stack([logical[0] * np.cos(logical[1]), logical[0] * np.sin(logical[1]), logical[2]])
    mesh = skfem.MeshHex2(turned, flat.t)
    basis = skfem.Basis(mesh, skfem.ElementHex2(), intorder=5)
    values = np.stack([np.broadcast_to(b[0], basis.dx.shape) for b in basis.basis], axis=-1)
    slopes = np.stack([b[0].grad for b in basis.basis], axis=-1)  # (3, elements, points, 27)
    weight = basis.dx[..., None]
    e, nu = STEEL.youngs_modulus, STEEL.poissons_ratio
    shear, lame = e / (2 * (1 + nu)), e * nu / ((1 + nu) * (1 - 2 * nu))
    h = np.einsum("aepi,bepj->eijab", slopes, slopes * weight, optimize=True)
    trace = np.trace(h, axis1=3, axis2=4)
    stiffness = lame * h + shear * h.swapaxes(3, 4) + shear * trace[..., None, None] * np.eye(3)
    mass = STEEL.density * np.einsum("epi,epj->eij", values, values * weight)[..., None, None] * np.eye(3)
    _, same = np.unique(np.round(basis.doflocs, 9), axis=1, return_inverse=True)  # both sides of the seam
    dofs = (same.ravel()[basis.element_dofs.T][..., None] * 3 + np.arange(3)).reshape(len(mass), -1)
    size = 3 * (int(same.max()) + 1)

    def gather(blocks: np.ndarray) -> scipy.sparse.csc_array:
        blocks = blocks.swapaxes(2, 3).reshape(len(blocks), dofs.shape[1], -1)
        rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
        return scipy.sparse.csc_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))

    found = scipy.sparse.linalg.eigsh(
        gather(stiffness), 6 + count, gather(mass), sigma=-1e6, return_eigenvectors=False, v0=np.ones(size)
    )
    return np.sqrt(np.sort(found)[6:]) / (2.0 * np.pi)


@pytest.mark.parametrize(
    ("sections", "seat", "message"),
    [
        (
            (ShaftSection(0.2, 0.06),),
            SeatBand("bearing", 0.19, 0.04),
            "z = 170 to 210 mm, the shaft from 0 to 200 mm",
        ),
        (STEPPED, SeatBand("bearing", 0.2, 0.04), "bearing: a shoulder lies between z = 180 and 220 mm"),
        (
            (ShaftSection(0.2, 0.06), ShaftSection(0.2, 0.1, 0.07)),
            SeatBand("a", 0.1),
            "are not connected: one fits into the bore of the other",
        ),
        ((), SeatBand("a", 0.1), "at least one section"),
    ],
)
def test_impossible_shafts_are_refused_by_name(sections, seat, message):
    with pytest.raises(ShaftError, match=message):
        Shaft(sections, STEEL, [seat])


@pytest.mark.parametrize("values", [(0.0, 0.1, 0.0), (0.1, 0.1, 0.1), (0.1, -0.1, 0.0)])
def test_sections_without_a_wall_are_refused(values):
    with pytest.raises(ShaftError, match="m: a positive length and wall thickness are required"):
        ShaftSection(*values)
