"""Contact of elastic bodies by itself: patch test, Hertz, what is refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fe_ste.elasticity.gear_mesh import HEXAHEDRON_FACES
from fe_ste.geometry.gears import Material
from fe_ste.reference.finite_deformation import Bricks
from fe_ste.reference.mortar import Surface
from fe_ste.reference.newton import (
    ContactModel,
    EquilibriumError,
    NewtonSettings,
    TurningHub,
    convergence_table,
    solve_contact,
)

STEEL = Material()
ALUMINIUM = Material(youngs_modulus=70e9, poissons_ratio=0.33)
HEIGHT = 10e-3


def boundary(hexahedra: np.ndarray, on: np.ndarray) -> Surface:
    """Facets whose four nodes are all in the mask `on`."""
    facets = hexahedra[:, HEXAHEDRON_FACES].reshape(-1, 4)
    return Surface(facets[on[facets].all(axis=1)])


def graded(length: float, first: float, count: int) -> np.ndarray:
    """Coordinates from 0 to `length` whose steps grow geometrically from `first`."""
    low, high = 1.0, 10.0
    for _ in range(100):
        ratio = (low + high) / 2
        low, high = (ratio, high) if first * np.sum(ratio ** np.arange(count)) < length else (low, ratio)
    places = np.concatenate([[0.0], np.cumsum(low ** np.arange(count))])
    return places * length / places[-1]


def stacked_blocks(block, finite: bool, lift: float = 0.0) -> ContactModel:
    """Two blocks of 10 mm with meshes that do not match, one on the other, under 100 MPa; symmetry on three sides."""
    axes = [np.linspace(0, HEIGHT, count) for count in (4, 5, 3)]
    lower, lower_bricks = block(*axes)
    upper, upper_bricks = block(*(np.linspace(0, HEIGHT, count) for count in (5, 4, 4)))
    upper += [0, 0, HEIGHT + lift]
    points = np.concatenate([lower, upper])
    hexahedra = np.concatenate([lower_bricks, upper_bricks + len(lower)])
    is_upper = np.arange(len(points)) >= len(lower)
    top = boundary(hexahedra, is_upper & np.isclose(points[:, 2], 2 * HEIGHT + lift))
    forces = np.zeros_like(points)
    forces[top.nodes, 2] = -100e6 * top.areas(points)
    return ContactModel(
        bricks=Bricks.from_mesh(points, hexahedra, [STEEL], finite=finite),
        first=boundary(hexahedra, ~is_upper & np.isclose(points[:, 2], HEIGHT)),
        second=boundary(hexahedra, is_upper & np.isclose(points[:, 2], HEIGHT + lift)),
        held=np.isclose(points, 0.0) & [True, True, True],
        forces=forces,
        modulus=STEEL.youngs_modulus,
        search=0.2 * HEIGHT,
        reach=1e-6,
        allowed_overlap=1e-12,
    )


@pytest.mark.parametrize("finite", [False, True])
def test_a_uniform_pressure_passes_between_meshes_that_do_not_match(block, finite):
    model = stacked_blocks(block, finite)
    found = solve_contact(model)
    # The upper block is held against falling by the contact alone.
    assert np.ptp(found.pressure) < 1e-8 * found.pressure.mean()
    assert np.allclose(found.mean_pressure, found.pressure, rtol=1e-8)
    stress = model.bricks.nodal_stress(found.displacement, found.modes)
    assert np.allclose(stress[:, 2, 2], -found.pressure.mean(), rtol=1e-8)
    # Under finite deformation the same forces act on an area that has grown by 2 nu p / E.
    growth = 2 * STEEL.poissons_ratio * 100e6 / STEEL.youngs_modulus if finite else 0.0
    assert found.pressure.mean() == pytest.approx(100e6 * (1 - growth), rel=1e-8 if not finite else 1e-6)


def test_forces_do_not_depend_on_the_stiffness_added_to_the_gaps(block, monkeypatch):
    # The less is added, the slower the gaps close: the iterations end where what is left of them is below 1e-9.
    exact = NewtonSettings(force_tolerance=1e-11, gap_tolerance=1e-11)
    usual = solve_contact(stacked_blocks(block, True), exact)
    monkeypatch.setattr("fe_ste.reference.newton._AUGMENTATION", 5.0)
    other = solve_contact(stacked_blocks(block, True), exact)
    assert np.allclose(other.displacement, usual.displacement, rtol=0, atol=1e-9 * np.abs(usual.displacement).max())


def test_results_do_not_depend_on_the_load_steps(block):
    one = solve_contact(stacked_blocks(block, True))
    three = solve_contact(stacked_blocks(block, True), NewtonSettings(load_steps=3))
    assert [row.load for row in three.iterations if row.number == 1] == pytest.approx([1 / 3, 2 / 3, 1])
    assert np.allclose(three.displacement, one.displacement, rtol=0, atol=1e-8 * np.abs(one.displacement).max())


def test_a_blunt_body_turned_by_a_torque_is_in_balance(block):
    # A lever between a hub and a stop: a force of torque over arm at the stop, whatever deforms.
    lever, lever_bricks = block(np.linspace(20e-3, 60e-3, 9), np.linspace(-5e-3, 5e-3, 4), np.linspace(0, 5e-3, 2))
    stop, stop_bricks = block(np.linspace(50e-3, 55e-3, 4), np.linspace(5e-3, 15e-3, 5), np.linspace(0, 5e-3, 3))
    points = np.concatenate([lever, stop])
    hexahedra = np.concatenate([lever_bricks, stop_bricks + len(lever)])
    on_lever = np.arange(len(points)) < len(lever)
    held = np.zeros_like(points, dtype=bool)
    held[~on_lever & np.isclose(points[:, 1], 15e-3)] = True
    model = ContactModel(
        bricks=Bricks.from_mesh(points, hexahedra, [STEEL]),
        first=boundary(hexahedra, ~on_lever & np.isclose(points[:, 1], 5e-3)),
        second=boundary(hexahedra, on_lever & np.isclose(points[:, 1], 5e-3)),
        held=held,
        forces=np.zeros_like(points),
        modulus=STEEL.youngs_modulus,
        search=1e-3,
        reach=1e-6,
        allowed_overlap=1e-9,
        hub=TurningHub(np.flatnonzero(on_lever & np.isclose(points[:, 0], 20e-3)), np.zeros(2), 50e-3, 400.0),
    )
    found = solve_contact(model)
    deformed = points + found.displacement
    moment = np.cross(deformed, found.contact_force)[: len(lever), 2].sum()
    assert moment == pytest.approx(-400.0 * 50e-3, rel=1e-7)
    assert found.hub > 0
    assert found.pressure.min() >= 0


def hertz_peak(place: np.ndarray, pressure: np.ndarray) -> float:
    """Peak of the ellipse through nodal pressures: p^2 is linear in the square of the place."""
    inside = pressure > 0.2 * pressure.max()
    return float(np.sqrt(np.polyfit(place[inside] ** 2, pressure[inside] ** 2, 1)[1]))


@pytest.mark.parametrize("finite", [False, True])
def test_a_cylinder_on_a_block_has_the_half_width_and_peak_of_hertz(block, finite):
    # Steel cylinder of 50 mm radius on aluminium as in NAFEMS benchmark CGS-1, at a load whose contact is narrow
    # against the bodies, as Hertz assumes: half width 1 mm, bodies of 40 mm. Plane strain, half by symmetry.
    radius, half_width, size, thickness = 50e-3, 1e-3, 40e-3, 0.2e-3
    across_fine, across_other = graded(size, half_width / 8, 26), graded(size, half_width / 7, 25)
    down, through = graded(size, half_width / 8, 24), np.array([0.0, thickness])
    plate, plate_bricks = block(across_fine, -down[::-1], through)
    cylinder, cylinder_bricks = block(across_other, down, through)
    surface = radius - np.sqrt(radius**2 - cylinder[:, 0] ** 2)
    cylinder[:, 1] = surface + cylinder[:, 1] / size * (1.2 * size - surface)
    points = np.concatenate([plate, cylinder])
    hexahedra = np.concatenate([plate_bricks, cylinder_bricks + len(plate)])
    on_cylinder = np.arange(len(points)) >= len(plate)
    top = boundary(hexahedra, on_cylinder & np.isclose(points[:, 1], 1.2 * size))
    compliance = sum((1 - m.poissons_ratio**2) / m.youngs_modulus for m in (STEEL, ALUMINIUM))
    peak = half_width / (2 * radius * compliance)
    load = np.pi * half_width * peak / 2  # per thickness
    forces = np.zeros_like(points)
    forces[top.nodes, 1] = -load / 2 * thickness * top.areas(points) / top.areas(points).sum()
    low_face = on_cylinder & np.isin(
        np.arange(len(points)) - len(plate),
        np.flatnonzero(np.isclose(cylinder[:, 1], radius - np.sqrt(radius**2 - cylinder[:, 0] ** 2))),
    )
    held = np.zeros_like(points, dtype=bool)
    held[:, 2] = True
    held[np.isclose(points[:, 0], 0.0), 0] = True
    held[np.isclose(points[:, 1], -size), 1] = True
    model = ContactModel(
        bricks=Bricks.from_mesh(
            points,
            hexahedra,
            (ALUMINIUM, STEEL),
            np.repeat([0, 1], [len(plate_bricks), len(cylinder_bricks)]),
            finite=finite,
        ),
        first=boundary(hexahedra, ~on_cylinder & np.isclose(points[:, 1], 0.0)),
        second=boundary(hexahedra, low_face),
        held=held,
        forces=forces,
        modulus=STEEL.youngs_modulus,
        search=0.5e-3,
        reach=half_width**2 / (2 * radius),
        allowed_overlap=1e-12,
    )
    found = solve_contact(model)
    place, force = points[model.first.nodes, 0], -found.contact_force[model.first.nodes, 1]
    # Half an ellipse of half width b has the mean square distance b^2 / 4.
    assert 2 * np.sqrt(place**2 @ force / force.sum()) == pytest.approx(half_width, rel=0.03)
    assert hertz_peak(place, found.pressure) == pytest.approx(peak, rel=0.03)


@pytest.mark.validation
def test_two_spheres_have_the_radius_and_peak_of_hertz(block):
    # A quarter of two steel spheres by symmetry, the upper half as large again as the lower.
    radii, contact_radius, size = (40e-3, 60e-3), 1e-3, 12e-3
    effective = 1 / sum(1 / radius for radius in radii)
    compliance = 2 * (1 - STEEL.poissons_ratio**2) / STEEL.youngs_modulus
    force = 4 * contact_radius**3 / (3 * effective * compliance)
    peak = 3 * force / (2 * np.pi * contact_radius**2)
    parts, faces = [], []
    for radius, sense, share, count in zip(radii, (-1.0, 1.0), (4.0, 3.5), (13, 12), strict=True):
        across = graded(size, contact_radius / share, count)
        body, bricks = block(across, across, graded(size, contact_radius / share, 11))
        surface = radius - np.sqrt(radius**2 - body[:, 0] ** 2 - body[:, 1] ** 2)
        faces.append(np.isclose(body[:, 2], 0.0))
        body[:, 2] = sense * (surface + body[:, 2] / size * (1.5 * size - surface))
        parts.append((body, bricks[:, [0, 3, 2, 1, 4, 7, 6, 5]] if sense < 0 else bricks))
    points = np.concatenate([body for body, _ in parts])
    shift = len(parts[0][0])
    hexahedra = np.concatenate([parts[0][1], parts[1][1] + shift])
    upper = np.arange(len(points)) >= shift
    touching = np.concatenate(faces)
    top = boundary(hexahedra, upper & np.isclose(points[:, 2], 1.5 * size))
    forces = np.zeros_like(points)
    forces[top.nodes, 2] = -force / 4 * top.areas(points) / top.areas(points).sum()
    held = np.isclose(points, 0.0) & [True, True, False]
    held[np.isclose(points[:, 2], -1.5 * size), 2] = True
    model = ContactModel(
        bricks=Bricks.from_mesh(points, hexahedra, [STEEL]),
        first=boundary(hexahedra, ~upper & touching),
        second=boundary(hexahedra, upper & touching),
        held=held,
        forces=forces,
        modulus=STEEL.youngs_modulus,
        search=0.1e-3,
        reach=contact_radius**2 / (2 * effective),
        allowed_overlap=1e-9,
    )
    found = solve_contact(model)
    place, carried = np.hypot(*points[model.first.nodes, :2].T), -found.contact_force[model.first.nodes, 2]
    # Half an ellipsoid of radius a has the mean square distance 2 a^2 / 5.
    assert np.sqrt(2.5 * (place**2 @ carried) / carried.sum()) == pytest.approx(contact_radius, rel=0.03)
    assert hertz_peak(place, found.mean_pressure) == pytest.approx(peak, rel=0.03)
    assert 4 * carried.sum() == pytest.approx(force, rel=1e-6)


def test_a_body_that_nothing_holds_is_named_with_load_step_and_iteration(block):
    model = stacked_blocks(block, True)
    with pytest.raises(EquilibriumError, match=r"load step 1 .*, iteration 1: a rigid-body motion is left free"):
        solve_contact(dataclasses.replace(model, held=model.held & [True, False, True]))


def test_overlap_at_the_start_is_refused_with_its_place(block):
    with pytest.raises(EquilibriumError, match=r"overlap by 50 µm at the start, near \(.*\) mm"):
        solve_contact(stacked_blocks(block, True, lift=-50e-6))


def test_surfaces_that_cannot_touch_are_refused(block):
    with pytest.raises(EquilibriumError, match="nothing can touch"):
        solve_contact(stacked_blocks(block, True, lift=5e-3))


def test_a_load_that_crushes_the_bodies_names_load_step_and_what_was_reached(block):
    model = stacked_blocks(block, True)
    with pytest.raises(EquilibriumError, match=r"load step \d+ .* iteration \d+: .*% of the load was reached"):
        solve_contact(dataclasses.replace(model, forces=1e4 * model.forces))


def test_a_gap_closes_before_the_load_passes(block):
    found = solve_contact(dataclasses.replace(stacked_blocks(block, True, lift=20e-6), search=1e-3))
    assert np.ptp(found.pressure) < 1e-8 * found.pressure.mean()


def test_convergence_table_has_a_line_for_each_iteration(block):
    found = solve_contact(stacked_blocks(block, True))
    assert len(convergence_table(found.iterations).splitlines()) == 1 + len(found.iterations)


@pytest.mark.parametrize("wrong", [{"load_steps": 0}, {"most_iterations": 1}, {"force_tolerance": 0.0}])
def test_settings_that_cannot_converge_are_refused(wrong):
    with pytest.raises(ValueError, match="must be"):
        NewtonSettings(**wrong)
