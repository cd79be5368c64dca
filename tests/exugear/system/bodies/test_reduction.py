"""Reduced shafts against published rotors, the full finite-element model and the rigid body."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse.linalg

from exugear.system.bodies.reduction import (
    Blank,
    ReducedBody,
    ReductionError,
    RigidInertia,
    with_rigid_inertia,
)
from exugear.system.bodies.shaft_sections import MeshSize, SeatBand, ShaftSection
from exugear.system.bodies.turned_section import Shaft
from exugear.system.bodies.turned_shaft import ShaftModel, load_or_reduce_shaft, reduce_shaft
from fe_ste.geometry.gears import Material
from fe_ste.tools.stores import Store

from ....fe_ste.damage import damages
from ...cases.reduced import first_coordinate

STEEL = Material(210e9, 0.3, 7850.0)
STEPPED = ShaftModel(
    name="stepped",
    sections=(ShaftSection(0.2, 0.06), ShaftSection(0.3, 0.1), ShaftSection(0.2, 0.08, 0.02), ShaftSection(0.2, 0.05)),
    material=STEEL,
    origin=(0.1, -0.2, 0.3),
    seats=(SeatBand("left", 0.03, 0.03), SeatBand("gear", 0.35, 0.06), SeatBand("right", 0.87, 0.03)),
    blanks={"gear": Blank(12.0, 0.08, 0.15)},
    band=3000.0,
    limit=30e3,
    size=MeshSize(0.03, 0.02, 1),  # what is checked here holds on any mesh
)


@pytest.fixture(scope="module")
def stepped() -> ReducedBody:
    return reduce_shaft(STEPPED)


def disc(outer: float, thickness: float, material: Material, bore: float = 0.05) -> Blank:
    """Disc on a shaft."""
    mass = material.density * math.pi / 4 * (outer**2 - bore**2) * thickness
    squares = (outer**2 + bore**2) / 4
    return Blank(mass, mass * (squares / 4 + thickness**2 / 12), mass * squares / 2)


@pytest.fixture(scope="module")
def two_discs() -> ReducedBody:
    """Friswell, Penny, Garvey, Lees, Dynamics of Rotating Machines (2010), example 5.9.1, without its bearings."""
    steel = Material(211e9, 211.0 / (2 * 81.2) - 1.0, 7810.0)
    return reduce_shaft(
        ShaftModel(
            name="rotor",
            sections=(ShaftSection(1.5, 0.05),),
            material=steel,
            origin=(0.0, 0.0, 0.0),
            seats=tuple(SeatBand(name, z) for name, z in (("a", 0.0), ("one", 0.5), ("two", 1.0), ("b", 1.5))),
            blanks={"one": disc(0.28, 0.07, steel), "two": disc(0.35, 0.07, steel)},
            band=3000.0,
            limit=22e3,
            size=MeshSize(0.0125, 0.00625),
        )
    )


def whirl(body: ReducedBody, speed: float) -> np.ndarray:
    """Whirl frequencies (rad/s) on bearings of 1 MN/m at both ends, spin and thrust held softly."""
    stiffness = body.stiffness.copy()
    for seat in ("a", "b"):
        first = first_coordinate(body, seat)
        stiffness[[first, first + 1], [first, first + 1]] += 1e6
    across = [i for i in range(body.size) if i >= 24 or i % 6 in (0, 1, 3, 4)]
    across = [i for i in across if i < 24 or body.modal_groups[i - 24].startswith("bending")]
    m, k, g = (matrix[np.ix_(across, across)] for matrix in (body.mass, stiffness, speed * body.gyroscopic))
    n = len(m)
    state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(m, k), -np.linalg.solve(m, g)]])
    values = np.linalg.eigvals(state)
    assert np.abs(values.real).max() < 1e-6 * np.abs(values).max()  # gyroscopic forces neither damp nor drive
    return np.sort(values.imag[values.imag > 1.0])


def test_the_two_disc_rotor_whirls_as_published(two_discs):
    # 0.1 %: the published values come from six Timoshenko elements and rigid discs.
    assert whirl(two_discs, 0.0)[[0, 2, 4]] == pytest.approx([86.66, 274.31, 716.78], rel=1e-3)
    at_speed = whirl(two_discs, 4000 * math.pi / 30)[:5]
    assert at_speed == pytest.approx([85.39, 87.80, 251.78, 294.71, 600.18], rel=1e-3)


def test_forward_whirl_rises_with_speed_and_turns_with_the_shaft(two_discs):
    # In y' = i w y the forward mode has y = -i x: a quarter turn behind x. Swapping the sign of G would swap them.
    speed = 4000 * math.pi / 30
    body = two_discs
    first = first_coordinate(body, "two")
    assert body.gyroscopic[first + 3, first + 4] > 0.0  # row thx, column thy: + polar inertia
    slow, fast = whirl(body, 0.2 * speed), whirl(body, speed)
    assert fast[0] < slow[0] < slow[1] < fast[1]


def test_rigid_motion_stores_no_energy(stepped):
    rigid = stepped.rigid_motions((0.3, 0.1, -0.4))
    assert np.abs(stepped.stiffness @ rigid).max() < 1e-10 * np.abs(stepped.stiffness).max()


def test_rigid_inertia_is_that_of_shaft_and_blank(stepped):
    pieces = []
    begin = 0.3
    for s in STEPPED.sections:
        mass = STEEL.density * math.pi / 4 * (s.outer_diameter**2 - s.inner_diameter**2) * s.length
        squares = (s.outer_diameter**2 + s.inner_diameter**2) / 4
        pieces.append((mass, begin + s.length / 2, mass * (squares / 4 + s.length**2 / 12), mass * squares / 2))
        begin += s.length
    pieces.append((12.0, 0.65, 0.08, 0.15))
    masses, places, transverse, axial = np.array(pieces).T
    centre = masses @ places / masses.sum()
    found = stepped.rigid_inertia
    assert found.mass == pytest.approx(masses.sum(), rel=1e-10)
    assert found.centre == pytest.approx((0.1, -0.2, centre), rel=1e-10)
    assert found.axial == pytest.approx(axial.sum(), rel=1e-10)
    assert found.transverse == pytest.approx((transverse + masses * (places - centre) ** 2).sum(), rel=1e-10)


def test_a_rigid_tilt_has_the_polar_inertia_in_the_gyroscopic_matrix(stepped):
    inertia = stepped.rigid_inertia
    rigid = stepped.rigid_motions(inertia.centre)
    expected = np.zeros((6, 6))
    expected[3, 4], expected[4, 3] = inertia.axial, -inertia.axial
    assert rigid.T @ stepped.gyroscopic @ rigid == pytest.approx(expected, abs=1e-10 * inertia.axial)
    assert np.array_equal(stepped.gyroscopic, -stepped.gyroscopic.T)


def test_the_spin_is_the_common_part_of_the_seats_turning(stepped):
    spin = stepped.spin
    assert spin @ stepped.mass @ spin == pytest.approx(stepped.rigid_inertia.axial, rel=1e-10)
    momentum = stepped.mass @ spin / stepped.rigid_inertia.axial
    others = stepped.rigid_motions(stepped.rigid_inertia.centre)[:, :5]
    assert momentum @ spin == pytest.approx(1.0, abs=1e-12)
    assert np.abs(momentum @ others).max() < 1e-12


def test_both_bending_planes_are_alike(stepped):
    n = 6 * len(stepped.seats)
    x = [i for i in range(n) if i % 6 in (0, 4)]
    y = [i for i in range(n) if i % 6 in (1, 3)]
    sign = np.array([-1.0 if i % 6 == 3 else 1.0 for i in y])
    for matrix in (stepped.mass, stepped.stiffness):
        assert np.array_equal(matrix[np.ix_(x, x)], matrix[np.ix_(y, y)] * np.outer(sign, sign))


@pytest.mark.parametrize("bearing", [0.0, 2e8, 1e9])
def test_reduced_vibrations_are_those_of_the_full_model(bearing):
    # Free ones to round-off up to the band; on bearings, which no kept vibration has seen, up to two thirds of it.
    model = replace(STEPPED, blanks={}, band=5000.0)
    body = reduce_shaft(model)
    full = Shaft(model.sections, model.material, model.seats, model.size).harmonic("bending")
    seats = scipy.sparse.csr_array(full.seats)
    springs = np.diag([bearing, 0.0, 0.0, 0.0, bearing, 0.0])
    held = full.stiffness + seats.T @ scipy.sparse.csr_array(springs) @ seats
    values = scipy.sparse.linalg.eigsh(
        held, 7, full.mass, sigma=-1e6, return_eigenvectors=False, v0=np.ones(full.mass.shape[0])
    )
    expected = np.sqrt(np.maximum(np.sort(values), 0.0)) / (2 * np.pi)
    inner = [i for i in range(18, body.size) if body.modal_groups[i - 18] == "bending x"]
    index = [i for i in range(18) if i % 6 in (0, 4)] + inner
    k, m = body.stiffness[np.ix_(index, index)].copy(), body.mass[np.ix_(index, index)]
    k[:6, :6] += springs
    found = np.sqrt(np.maximum(scipy.linalg.eigh(k, m, eigvals_only=True), 0.0)) / (2 * np.pi)
    inside = (expected > 1.0) & (expected < (model.band if bearing == 0.0 else model.band / 1.5))
    assert inside.sum() >= 4
    assert found[: len(expected)][inside] == pytest.approx(expected[inside], rel=1e-4 if bearing else 1e-8)


def test_static_deflections_are_those_of_the_full_model(stepped):
    full = Shaft(STEPPED.sections, STEPPED.material, STEPPED.seats, STEPPED.size).harmonic("torsion")
    held = full.stiffness + 1e6 * scipy.sparse.csr_array(full.seats[:1].T @ full.seats[:1])
    twist = full.seats @ scipy.sparse.linalg.spsolve(held.tocsc(), full.seats[2])
    k = stepped.stiffness.copy()
    k[5, 5] += 1e6
    load = np.zeros(stepped.size)
    load[17] = 1.0
    others = [i for i in range(stepped.size) if i not in range(6)] + [5]
    own = [i for i in others if i in (5, 11, 17) or (i >= 18 and stepped.modal_groups[i - 18] == "torsion")]
    reduced = np.linalg.solve(k[np.ix_(own, own)], load[own])
    assert [reduced[own.index(i)] for i in (5, 11, 17)] == pytest.approx(twist, rel=1e-7)


def test_mass_scaling_brings_modes_above_the_limit_to_it_and_moves_no_other():
    high, low = reduce_shaft(replace(STEPPED, limit=1e6)), reduce_shaft(replace(STEPPED, limit=12e3))
    assert sum(len(found) for found in low.summary.mass_scaled_frequencies.values()) > 0
    assert high.free_frequencies.max() > 12e3
    assert low.free_frequencies.max() == pytest.approx(12e3, rel=1e-6)
    kept = high.free_frequencies < 12e3
    assert low.free_frequencies[kept] == pytest.approx(high.free_frequencies[kept], rel=1e-9)
    assert np.array_equal(low.stiffness, high.stiffness)
    assert low.rigid_inertia.axial == pytest.approx(high.rigid_inertia.axial, rel=1e-10)


def test_rigid_inertia_can_be_given_without_touching_elastic_vibrations(stepped):
    present = stepped.rigid_inertia
    x, y, z = present.centre
    wanted = RigidInertia(1.1 * present.mass, (x, y, z + 0.03), 0.8 * present.transverse, 1.3 * present.axial)
    changed = with_rigid_inertia(stepped, wanted)
    found = changed.rigid_inertia
    assert [found.mass, found.transverse, found.axial] == pytest.approx(
        [wanted.mass, wanted.transverse, wanted.axial], rel=1e-9
    )
    assert found.centre == pytest.approx(wanted.centre, rel=1e-9)
    assert changed.free_frequencies == pytest.approx(stepped.free_frequencies, rel=1e-9)
    rigid = changed.rigid_motions(wanted.centre)
    assert (rigid.T @ changed.gyroscopic @ rigid)[3, 4] == pytest.approx(wanted.axial, rel=1e-9)
    assert np.linalg.eigvalsh(changed.mass).min() > 0.0


def test_stiffer_shafts_tend_to_the_rigid_body(stepped):
    # Two bearings hold it: the first frequency nears that of the rigid body, the gap as one over the stiffness.
    inertia = stepped.rigid_inertia
    seats = [0, 12]
    z = np.array([stepped.seats[n // 6].position[2] for n in seats]) - inertia.centre[2]
    bearing = 1e6
    rigid_k = bearing * np.array([[2.0, z.sum()], [z.sum(), z @ z]])
    rigid = np.sqrt(scipy.linalg.eigh(rigid_k, np.diag([inertia.mass, inertia.transverse]), eigvals_only=True)[0])
    gaps = []
    for factor in (1.0, 10.0, 100.0):
        k = factor * stepped.stiffness
        for n in seats:
            k[[n, n + 1], [n, n + 1]] += bearing
        values = scipy.linalg.eigh(k, stepped.mass, eigvals_only=True)
        first = np.sqrt(values[values > 1.0][0])
        gaps.append(1.0 - first / rigid)
    assert gaps[0] > 0.005
    assert gaps[1] == pytest.approx(gaps[0] / 10, rel=0.1)
    assert gaps[2] == pytest.approx(gaps[1] / 10, rel=0.02)


def test_the_surface_moves_rigidly_with_the_seats_and_strains_where_it_bends(stepped):
    surface = stepped.surface
    rigid = stepped.rigid_motions((0.0, 0.0, 0.0))
    moved = surface.displacement @ rigid
    for axis in range(3):
        unit = np.eye(3)[axis]
        assert np.allclose(moved[:, :, axis], unit, atol=1e-6)
        assert np.allclose(
            moved[:, :, 3 + axis], np.cross(unit, surface.points), atol=1e-6
        )  # stored in single precision
    assert surface.energy_density(rigid[:, 3]).max() < 1.0
    bend = np.zeros(stepped.size)
    bend[6] = 1e-3
    assert surface.energy_density(bend).max() > 1e3


def test_a_reduction_is_kept_and_found_again(stepped, tmp_path):
    first = load_or_reduce_shaft(STEPPED, tmp_path)
    files = list(tmp_path.iterdir())
    assert [file.name for file in files] == [f"stepped-{STEPPED.key[:16]}.npz"]
    stamp = files[0].stat().st_mtime_ns
    again = load_or_reduce_shaft(STEPPED, tmp_path)
    assert files[0].stat().st_mtime_ns == stamp
    for one, two in ((first, again), (first, stepped)):
        assert np.array_equal(one.mass, two.mass)
        assert np.array_equal(one.gyroscopic, two.gyroscopic)
        assert one.seats == two.seats
        assert one.modal_groups == two.modal_groups
        assert one.summary.free_interface_frequencies == two.summary.free_interface_frequencies
        assert np.array_equal(one.surface.strain, two.surface.strain)


@pytest.mark.validation
def test_a_damaged_file_is_computed_again_with_a_word(tmp_path, caplog):
    first = load_or_reduce_shaft(STEPPED, tmp_path)
    file = next(tmp_path.iterdir())
    content = file.read_bytes()
    for damaged in damages(content, 100):
        file.write_bytes(damaged)
        assert Store(file, STEPPED.key).read(dict) is None
        assert "it is computed again" in caplog.messages[-1]
    assert np.array_equal(load_or_reduce_shaft(STEPPED, tmp_path).mass, first.mass)
    assert Store(file, STEPPED.key).read(dict) is not None


def test_a_reduction_of_another_body_under_this_name_is_not_used(tmp_path):
    load_or_reduce_shaft(replace(STEPPED, band=2000.0), tmp_path)
    next(tmp_path.iterdir()).rename(tmp_path / f"stepped-{STEPPED.key[:16]}.npz")
    again = load_or_reduce_shaft(STEPPED, tmp_path)
    assert np.array_equal(again.mass, reduce_shaft(STEPPED).mass)


def test_the_version_of_the_method_and_no_comment_decides_on_the_key(monkeypatch):
    before = STEPPED.key
    monkeypatch.setattr("exugear.system.bodies.turned_shaft.REDUCTION", 1000)
    assert STEPPED.key != before


def test_every_input_has_its_own_key():
    others = [
        replace(STEPPED, band=2000.0),
        replace(STEPPED, limit=20e3),
        replace(STEPPED, material=replace(STEEL, density=7800.0)),
        replace(STEPPED, size=MeshSize()),
        replace(STEPPED, blanks={}),
        replace(STEPPED, origin=(0.0, 0.0, 0.0)),
    ]
    assert len({model.key for model in (STEPPED, *others)}) == len(others) + 1


def test_faults_name_body_and_seat():
    with pytest.raises(ReductionError, match="shaft stepped: blank on 'gaer', but the seats are left, gear, right"):
        reduce_shaft(replace(STEPPED, blanks={"gaer": Blank(1.0, 1.0, 1.0)}))
