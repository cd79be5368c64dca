"""The variant `flexible`: elastic shafts in the gearbox, in modes and in both solvers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import VariantError
from exugear.report.pictures.scene import (
    animate_elastic_bodies,
    draw_elastic_bodies,
    elastic_scene,
)
from exugear.system.bodies.of_gearbox import reduced_bodies, shaft_model, solid_body
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.modes import counterparts, eigenmodes, modes_of
from exugear.system.statics import accelerating_start, linearise, locked_equilibrium
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem

from ...cases.assembled import assembled, modes_with_bodies
from ...cases.both_ways import (
    assert_matrices_of_exudyn_are_those_of,
    assert_signals_are_those_of_the_plain_kernels,
    compiled_states,
    errors_and_mesh_forces,
    exudyn_states,
    relative_error,
)
from ...cases.limit import unchecked
from ...cases.plain_motion import accelerations_of
from ...cases.plain_signals import energies_of, sampled
from ...cases.stated_loads import STATED_LOADS

LOAD = {"carrier": 240e3, "hss": -3000.0}
STEP = 1e-5
SHAFTS = ("lss", "ims", "hss")


@pytest.fixture(scope="module")
def grc(grc_shafts: Gearbox) -> Gearbox:
    return grc_shafts


@pytest.fixture(scope="module")
def flexible(grc: Gearbox, stiffness: dict) -> Assembly:
    return assembled(grc, Choice("flexible"), stiffness)


def spinning(assembly: Assembly, angle: float = 0.7) -> tuple[np.ndarray, np.ndarray]:
    """Preloaded state at 215 rpm, turned by an angle of the carrier, all coordinates and rates moved at random."""
    start = accelerating_start(assembly, LOAD, 22.5)
    random = np.random.default_rng(7)
    q = start.q + 1e-6 * random.normal(size=assembly.size)
    v = start.v + 1e-2 * random.normal(size=assembly.size)
    turned = assembly.rolling_velocity(np.zeros(assembly.size), assembly.gearbox.train.rolling_speeds("carrier", angle))
    planets = [body for body in assembly.bodies if body.carrier is not None]
    for body in planets:  # their orbit is an arc
        o = assembly.coordinates[body.name][0]
        arm = complex(*body.axis) * (np.exp(1j * angle) - 1.0)
        turned[o : o + 2] = arm.real, arm.imag
    return q + turned, v


@pytest.mark.validation
def test_stiffer_shafts_tend_to_the_variant_bushing(grc: Gearbox, stiffness: dict) -> None:
    # Masses are the rigid bodies' by construction; what is left of the difference falls as one over the stiffness.
    held = grc.varied(STATED_LOADS)
    rigid = eigenmodes(held, Choice("bushing"), stiffness).frequency[1:]
    gaps = []
    for factor in (10.0, 100.0):
        moduli = {f"bodies.{name}.shape.material.youngs_modulus_GPa": 206.0 * factor for name in SHAFTS}
        case = unchecked(held, {**moduli, "elasticity.limit_Hz": 1e6})
        found = modes_with_bodies(case, Choice("flexible"), stiffness).frequency[1 : len(rigid) + 1]
        # Compliance can only lower; the loads of the bearings turn with what bends, and stiffen by 3e-5 at most.
        assert np.all(found < rigid * (1 + 5e-5))
        gaps.append((np.abs(found / rigid - 1).max(), np.abs(found / rigid - 1).mean()))
    assert gaps[1][0] < 0.015
    assert gaps[1][1] == pytest.approx(gaps[0][1] / 10, rel=0.1)


def test_a_shaft_has_the_rigid_inertia_of_its_body(flexible: Assembly, grc: Gearbox) -> None:
    for name, shaft in flexible.elastic_bodies.items():
        body, found = grc.body(name), shaft.reduced.rigid_inertia
        assert (found.mass, found.transverse, found.axial) == pytest.approx(
            (body.mass, body.transverse, body.axial), rel=1e-9
        )
        assert found.centre[2] == pytest.approx(body.centre_of_mass_z, rel=1e-9)


def test_shapes_of_the_grc_weigh_about_what_is_printed(flexible: Assembly, grc: Gearbox) -> None:
    # Without what bearings and couplings add: 30 % on the light high-speed shaft, 10 % on the others.
    for name, share in (("lss", 0.02), ("ims", 0.11), ("hss", 0.27)):
        assert flexible.elastic_bodies[name].shape_inertia.mass == pytest.approx(grc.body(name).mass, rel=share)
        assert flexible.elastic_bodies[name].shape_inertia.axial == pytest.approx(grc.body(name).axial, rel=0.15)


def test_turning_the_whole_train_stores_nothing(flexible: Assembly) -> None:
    flexible = flexible.unloaded
    turned = flexible.rolling_velocity(np.zeros(flexible.size), flexible.gearbox.train.rolling_speeds("carrier", 1e-8))
    forces = flexible.forces(turned, np.zeros(flexible.size), flexible.mean_meshes)
    one = np.zeros(flexible.size)
    one[flexible.coordinates["hss.hs_pinion"][5]] = 1e-8  # small enough for the planets' arcs
    wound = flexible.forces(one, np.zeros(flexible.size), flexible.mean_meshes)
    assert np.abs(forces).max() < 1e-6 * np.abs(wound).max()


def test_a_locked_output_winds_the_shafts_up_as_their_torsion_says(flexible: Assembly, grc: Gearbox) -> None:
    # Between pinion and coupling the high-speed shaft carries the whole torque: seats at 266.5 and 864 mm.
    q = locked_equilibrium(flexible, grc.case.static_load.torques_N_m, ["hss"], flexible.mean_meshes)
    torque = 240e3 / grc.train.ratio
    # 80 GPa; the pinion's seat feeds its torque in over its width, so its mean angle is that of its middle or less.
    shear = 206e9 / 2.6
    pieces = [(0.060, 0.100), (0.0655, 0.105), (0.112, 0.110), (0.360, 0.105)]
    twist = sum(torque * length / (shear * np.pi / 32 * d**4) for length, d in pieces)
    found = q[flexible.coordinates["hss.hs_pinion"][5]] - q[flexible.coordinates["hss.torque"][5]]
    assert abs(found) == pytest.approx(twist, rel=0.05)


def test_a_shaft_strains_most_in_modes_that_only_it_has(grc: Gearbox, flexible: Assembly, stiffness: dict) -> None:
    modes = modes_of(flexible)
    assert modes.frequency.max() <= grc.case.elasticity.band_Hz
    bending = [n for n, name in enumerate(modes.names) if name.startswith("lss bending 9")]
    assert bending
    assert modes.strain[bending, modes.element_names.index("lss_body")].min() > 0.5
    assert np.allclose(modes.kinetic.sum(axis=(1, 2)), 1.0)
    assert modes.kinetic.min() > -1e-9


def test_matrices_of_exudyn_are_those_of_the_assembly(flexible: Assembly) -> None:
    # The assembly differentiates its bearings numerically.
    assert_matrices_of_exudyn_are_those_of(flexible, np.zeros(flexible.size), 1e-9)


def test_accelerations_are_those_of_the_plain_kernels(flexible: Assembly, grc: Gearbox, stiffness: dict) -> None:
    heavy = assembled(grc.varied({"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0]}), Choice("flexible"), stiffness)
    for assembly in (flexible, heavy):
        q, v = spinning(assembly)
        found = CompiledSystem(assembly, q, v, LoadTable(LOAD), STEP).accelerations()
        expected = accelerations_of(assembly, q, v, assembly.torque_vector(LOAD))
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_gyroscopic_forces_follow_the_actual_speed(flexible: Assembly) -> None:
    flexible = flexible.unloaded
    rest = np.zeros(flexible.size)
    for name, place in flexible.elastic_slices.items():
        body = flexible.elastic_bodies[name].reduced
        tilting = np.zeros(flexible.size)
        tilting[place] = body.rigid_motions(body.rigid_inertia.centre)[:, 4]
        for speed in (0.0, 50.0, -120.0):
            v = tilting.copy()
            v[place] += speed * body.spin
            force = flexible.forces(rest, v) - flexible.forces(rest, tilting)
            moment = body.rigid_motions(body.rigid_inertia.centre)[:, 3] @ force[place]
            without = speed * body.rigid_inertia.axial
            dampers = flexible.forces(rest, v - tilting)  # bearings and meshes resist the spin alone, too
            moment -= body.rigid_motions(body.rigid_inertia.centre)[:, 3] @ dampers[place]
            assert moment == pytest.approx(-without, rel=1e-6, abs=1e-9)


def test_signals_and_energies_are_those_of_the_plain_kernels(flexible: Assembly) -> None:
    states = [spinning(flexible, angle) for angle in (0.0, 0.7)]
    assert_signals_are_those_of_the_plain_kernels(flexible, *map(np.array, zip(*states, strict=True)), LOAD)


def test_power_is_balanced_at_every_state(flexible: Assembly) -> None:
    # d/dt of kinetic and elastic energy = loads - damping - work of k(PMC) - other; central difference in time.
    q, v = spinning(flexible)
    applied = flexible.torque_vector(LOAD)
    a = accelerations_of(flexible, q, v, applied)
    h = 1e-8
    early, late = (energies_of(flexible, (q + s * h * v)[None], (v + s * h * a)[None])[0] for s in (-1.0, 1.0))
    change = (late[:2].sum() - early[:2].sum()) / (2.0 * h)
    powers = energies_of(flexible, q[None], v[None])[0, 2:]
    assert change == pytest.approx(v @ applied - powers.sum(), rel=1e-4)


def test_the_compiled_solver_follows_exudyn(flexible: Assembly) -> None:
    # From 46 rpm on.
    start = accelerating_start(flexible, LOAD, -4.8)
    columns = errors_and_mesh_forces(flexible)
    found, expected = (
        sampled(flexible, *states(flexible, start.q, start.v, LOAD, 500, STEP))[:, columns]
        for states in (compiled_states, exudyn_states)
    )
    assert relative_error(found, expected) < 1e-5


@pytest.mark.validation
def test_reductions_are_kept_in_a_folder(grc: Gearbox, tmp_path: Path) -> None:
    kept = reduced_bodies(grc, "assemblies", tmp_path)
    assert sorted(file.name.split("-")[0] for file in tmp_path.iterdir()) == sorted(SHAFTS)
    for name, shaft in reduced_bodies(grc, "assemblies").items():
        assert np.array_equal(shaft.reduced.stiffness, kept[name].reduced.stiffness)


def test_a_bearing_longer_than_its_seat_is_refused_by_name(grc: Gearbox, stiffness: dict) -> None:
    with pytest.raises(GearboxFileError, match=r"bodies\.ims\.shape: seat ims_a: a shoulder lies between"):
        assembled(grc.varied({"bearings.ims_a.z_mm": 160.0}), Choice("flexible"), stiffness)
    with pytest.raises(
        GearboxFileError, match=r"bodies\.hss\.shape\.blanks\.flange: no such seat; seats are hs_pinion"
    ):
        flange = {"mass_kg": 1.0, "axial_kg_m2": 1.0, "transverse_kg_m2": 1.0}
        shaft_model(grc.varied({"bodies.hss.shape.blanks.flange": flange}), "hss")
    with pytest.raises(GearboxFileError, match="requires a shape; add a"):
        grc.varied({"bodies.planet.flexibility": "elastic"})
    with pytest.raises(
        GearboxFileError, match=r"bodies\.carrier\.flexibility = 'nonrotating': the body carries planets"
    ):
        solid_body(grc.varied({"bodies.carrier.flexibility": "nonrotating"}), "carrier")
    with pytest.raises(VariantError, match="no flexible body is defined; add"):
        assembled(grc.varied({f"bodies.{name}.flexibility": "none" for name in SHAFTS}), Choice("flexible"), stiffness)


def test_weight_is_that_of_the_bodies(grc: Gearbox, stiffness: dict) -> None:
    heavy = assembled(grc.varied({"gravity.acceleration_m_per_s2": [0.0, -9.81, 0.0]}), Choice("flexible"), stiffness)
    for name, place in heavy.elastic_slices.items():
        down = heavy.elastic_bodies[name].reduced.rigid_motions((0.0, 0.0, 0.0))[:, 1]
        assert down @ heavy.constant_forces[place] == pytest.approx(-9.81 * grc.body(name).mass, rel=1e-9)


def test_damping_of_shafts_is_a_key_of_the_case(grc: Gearbox, stiffness: dict) -> None:
    quiet = grc.varied({"damping.body_time_s": 0.0})
    assembly = assembled(quiet, Choice("flexible"), stiffness)
    linear = linearise(assembly, np.zeros(assembly.size))
    assert not linear.damping["lss_body"].any()


@pytest.mark.validation
def test_modes_on_rigid_shafts_are_found_again_on_stiff_ones(grc: Gearbox, stiffness: dict) -> None:
    rigid = eigenmodes(grc, Choice("bushing"), stiffness)
    moduli = {f"bodies.{name}.shape.material.youngs_modulus_GPa": 206e3 for name in SHAFTS}
    stiff = modes_with_bodies(unchecked(grc, {**moduli, "elasticity.limit_Hz": 1e6}), Choice("flexible"), stiffness)
    place, share = counterparts(rigid, stiff)
    # Equal frequencies share a plane of shapes, in which overlaps are free to mix.
    gaps = np.diff(rigid.frequency) > 0.01 * rigid.frequency[1:]
    alone = np.append(True, gaps) & np.append(gaps, True)
    assert np.array_equal(place[alone], np.flatnonzero(alone))
    assert share[alone].min() > 0.99


def test_elastic_bodies_show_themselves_in_one_line(flexible: Assembly) -> None:
    for name, body in flexible.elastic_bodies.items():
        assert name in repr(body) and repr(body.reduced) in repr(body)
        assert f"{len(body.reduced.seats)} seats, {len(body.reduced.modal_groups)} modal coordinates" in repr(body)
        assert len(repr(body)) < 200


def test_modes_are_their_own_counterparts(flexible: Assembly) -> None:
    modes = modes_of(flexible)
    place, share = counterparts(modes, modes)
    assert np.array_equal(place, np.arange(len(modes.frequency)))
    assert share == pytest.approx(np.ones(len(share)), rel=1e-6)


def test_the_rigid_part_of_a_rigid_motion_is_that_of_the_centre(flexible: Assembly) -> None:
    vector = np.zeros(flexible.size)
    for name, place in flexible.elastic_slices.items():
        body = flexible.elastic_bodies[name].reduced
        vector[place] = body.rigid_motions(body.rigid_inertia.centre) @ np.arange(1.0, 7.0)
    found = flexible.rigid_part(vector)
    for name in SHAFTS:
        assert found[list(flexible.coordinates[name])] == pytest.approx(np.arange(1.0, 7.0), rel=1e-9)


@pytest.mark.validation
def test_a_scene_shows_every_shaft_with_its_gears(flexible: Assembly, tmp_path: Path) -> None:
    modes = modes_of(flexible)
    bending = next(n for n, name in enumerate(modes.names) if name.startswith("ims bending"))
    scene = elastic_scene(flexible, modes.shapes[:, bending], title="a mode", amplitude=0.05)
    gears = ["sun", "im_gear", "im_pinion", "hs_gear", "hs_pinion"]
    inner_rings = ["ims_a", "ims_bc", "hss_a", "hss_bc"]
    assert sorted(part.name for part in scene.gears) == sorted(gears + inner_rings)
    largest = max(np.linalg.norm(shaft.displacement, axis=1).max() for shaft in scene.bodies)
    assert largest == pytest.approx(0.05 * 0.8795, rel=1e-6)  # the low-speed shaft is the longest
    assert [shaft.energy.max() for shaft in scene.bodies].index(1.0) == 1
    draw_elastic_bodies(scene, tmp_path / "mode.png", size=(400, 300))
    animate_elastic_bodies(scene, tmp_path / "mode.gif", frames=4, size=(200, 150))
    assert {file.name for file in tmp_path.iterdir()} == {"mode.png", "mode.gif"}
    with pytest.raises(ValueError, match="suffix must be .gif"):
        animate_elastic_bodies(scene, tmp_path / "mode.png", frames=4, size=(200, 150))


@pytest.mark.validation
def test_a_disc_at_a_bearing_moves_with_its_seat_in_a_scene(flexible: Assembly) -> None:
    shape = np.random.default_rng(3).normal(size=flexible.size)
    scene = elastic_scene(flexible, shape)
    moved = dict(zip([part.name for part in scene.gears], scene.motions, strict=True))
    disc, pinion = (shape[list(flexible.coordinates[f"hss.{name}"])] for name in ("hss_bc", "hs_pinion"))
    scale = np.linalg.norm(moved["hs_pinion"]) / np.linalg.norm(pinion)
    assert moved["hs_pinion"] == pytest.approx(scale * pinion, rel=1e-12)
    assert moved["hss_bc"] == pytest.approx(scale * disc, rel=1e-12)


def test_a_variant_without_elastic_bodies_has_no_such_scene(grc: Gearbox, stiffness: dict) -> None:
    with pytest.raises(ValueError, match="variant bushing has no flexible bodies to draw; use the variant flexible"):
        elastic_scene(assemble(grc, Choice("bushing"), stiffness), np.zeros(43))


@pytest.mark.validation
def test_a_torque_in_the_plane_of_a_bearing_acts_on_its_seat(grc: Gearbox, stiffness: dict) -> None:
    """Two seats of no width in one place would move alike; the torque winds the shaft up as it does a micrometre on."""
    place = grc.content["bearings"]["hss_a"]["z_mm"]
    held = {"radial_N_per_m": 1e9, "axial_N_per_m": 1e9, "tilt_N_m_per_rad": 1e6}
    of_bearing = {"body": "hss", "on": "housing", "z_mm": place, "stiffness": held}
    spins = []
    for beside in (0.0, 2.0):
        varied = grc.varied({"bearings.hss_a": of_bearing, "bodies.hss.shape.torque_z_mm": place + beside})
        bodies = reduced_bodies(varied, "assemblies")
        assert bodies["hss"].shared_seats == ({} if beside else {"torque": "hss_a"})
        assert bodies["hss"].main_seat == ("torque" if beside else "hss_a")
        assembly = assemble(varied, Choice("flexible"), stiffness, bodies)
        spins.append(locked_equilibrium(assembly, {"carrier": 240e3}, ["hss"])[assembly.spin["carrier"]])
        assert assembly.coordinates["hss"] == assembly.coordinates["hss.hss_a"] or beside
    assert spins[0] == pytest.approx(spins[1], rel=5e-3)
