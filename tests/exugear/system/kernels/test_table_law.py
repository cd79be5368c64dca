"""Law `table`: one potential gives force, push between the axes and moment; contact, loss of it, the other flank."""

from __future__ import annotations

import copy
import math
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.kernels.meshes import DAMPED_POWER
from exugear.system.kernels.table_law import (
    ENERGY_DERIVATIVES,
    GUESSED,
    LAW_FORCE,
    LAW_OUTSIDE,
    NOMINAL_DISTANCE,
    scratch_memory,
    surface_law,
)
from exugear.system.loads import LoadTable
from exugear.system.statics import locked_equilibrium
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.mesh_forces import add_mesh_forces
from exugear.system.tooth_mesh.laws.stiffness import pack
from exugear.transient.compiled.solver import CompiledSystem, Observer
from exugear.transient.runup import simulate
from fe_ste.transmission_error.surface import SteSurface

from ...cases.assembled import assembled, modes_with_bodies, simulated
from ...cases.plain_motion import accelerations_of
from ...cases.plain_signals import energies_of, sampled
from ...cases.spur import SPUR_CASE
from ...cases.table import STIFFNESS, surface_of, surfaces

VARIANTS = ["rigid", "bushing"]


@pytest.fixture(scope="module")
def tables(grc: Gearbox) -> dict:
    return surfaces(grc)


def in_contact(assembly: Assembly, seed: int, flank: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Loaded state with the places of all gears disturbed; `flank` -1 takes the teeth to their other flanks."""
    load = assembly.gearbox.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked)
    random = np.random.default_rng(seed)
    if flank < 0:  # opposite torques at the same locks
        q = locked_equilibrium(assembly, {name: -value for name, value in load.torques_N_m.items()}, load.locked)
    return q + 1e-6 * random.normal(size=assembly.size), 1e-3 * random.normal(size=assembly.size)


def frozen(assembly: Assembly) -> Assembly:
    """The same with pmc frozen: the law is then conservative."""
    return replace(assembly, meshes=assembly.meshes._replace(cycles=np.zeros(len(assembly.elements))))


def without_meshes(assembly: Assembly) -> Assembly:
    """The same with its bearings and couplings only."""
    return replace(assembly, meshes=pack((), assembly.coordinates))


def cases(grc: Gearbox, tables: dict) -> Iterator[tuple[Assembly, np.ndarray, np.ndarray]]:
    for variant in VARIANTS:
        assembly = assembled(grc, Choice(variant, "table"), tables)
        for flank in (1, -1):
            yield assembly, *in_contact(assembly, 3, flank)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("flank", [1, -1])
def test_jacobian_equals_finite_differences(grc: Gearbox, tables: dict, variant: str, flank: int) -> None:
    assembly = assembled(grc, Choice(variant, "table"), tables)
    q, v = in_contact(assembly, 2, flank)
    assert np.all(flank * assembly.mesh_states(q, v)[:, 4] > 0.0)
    jq, jv = assembly.mesh_jacobians(q, v)

    bare = without_meshes(assembly)

    def force(at: np.ndarray, speed: np.ndarray) -> np.ndarray:
        return np.asarray(assembly.forces(at, speed) - bare.forces(at, speed))

    h = 2e-8  # of 50 um of deflection: the law bends within a micrometre
    found_q = np.array([(force(q + h * e, v) - force(q - h * e, v)) / (2 * h) for e in np.eye(assembly.size)]).T
    found_v = np.array([(force(q, v + e) - force(q, v - e)) / 2.0 for e in np.eye(assembly.size)]).T
    # The tangent leaves out how directions of the damping change with the place, which acts at speed alone.
    assert np.abs(jq - found_q).max() < 1e-5 * np.abs(jq).max()
    assert np.abs(jv - found_v).max() < 1e-6 * np.abs(jv).max()
    rest = np.zeros(assembly.size)
    found_q = np.array([(force(q + h * e, rest) - force(q - h * e, rest)) / (2 * h) for e in np.eye(assembly.size)]).T
    # Round-off of 1e5 N over 2e-8 m, against 1e10 N/m.
    still = assembly.mesh_jacobians(q, rest)[0]
    assert np.abs(still - found_q).max() < 1e-6 * np.abs(still).max()


@pytest.mark.parametrize("flank", [1, -1])
def test_damping_is_a_time_times_the_tangent_along_all_that_moves(grc: Gearbox, flank: int) -> None:
    """Of teeth that resist tilting; of others the part of the tangent that pushes the wrong way does not damp."""
    time = grc.case.damping.mesh_time_s
    for hollow, same in ((-0.2, True), (0.2, False)):
        given = {name: surface_of(grc, name, hollow=hollow) for name in STIFFNESS}
        assembly = frozen(assembled(grc, Choice("bushing", "table"), given))
        q, v = in_contact(assembly, 2, flank)
        # These tables have no stiffness between the axes, but a coupling to tilts, which no damper can have.
        meshes = assembly.meshes
        rigid = meshes._replace(table=meshes.table._replace(centre=np.zeros_like(meshes.table.centre)))
        assembly = replace(assembly, meshes=rigid)
        jq, jv = assembly.mesh_jacobians(q, np.zeros_like(v))
        found = np.linalg.eigvalsh(jv)
        assert found.max() < 1e-9 * -found.min()
        # Rows that turn with the carrier under load are no stiffness of the teeth: planets' spins and tilts alone.
        moved = [assembly.coordinates[body][i] for body in ("ims", "hss") for i in range(6)]
        place = np.ix_(moved, moved)
        apart = np.abs(jv[place] - time * jq[place]).max()
        assert (apart < 1e-9 * np.abs(jv[place]).max()) == same
        states = assembly.mesh_states(q, v)
        assert (states[:, DAMPED_POWER] >= 0.0).all()
        damped = assembly.mesh_forces(q, v, assembly.meshes) - assembly.mesh_forces(q, 0.0 * v, assembly.meshes)
        assert -damped @ v == pytest.approx(states[:, DAMPED_POWER].sum(), rel=1e-9)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("flank", [1, -1])
def test_force_is_the_gradient_of_the_potential_at_frozen_position(
    grc: Gearbox, tables: dict, variant: str, flank: int
) -> None:
    assembly = frozen(assembled(grc, Choice(variant, "table"), tables))
    bare = without_meshes(assembly)
    q, _ = in_contact(assembly, 2, flank)
    rest = np.zeros(assembly.size)

    def energy(at: np.ndarray) -> float:
        return float(assembly.mesh_states(at, rest)[:, 5].sum())

    h = 1e-7
    gradient = np.array([(energy(q + h * e) - energy(q - h * e)) / (2 * h) for e in np.eye(assembly.size)])
    force = assembly.forces(q, rest) - bare.forces(q, rest)
    # 1e-7 m of 50 um, squared, and the round-off of some joules over it.
    assert np.abs(force + gradient).max() < 2e-5 * np.abs(force).max()


@pytest.mark.validation
def test_compiled_solver_has_the_same_forces_signals_and_energies(grc: Gearbox, tables: dict) -> None:
    load = {"carrier": 2.4e5, "hss": -3.0e3}
    for assembly, q, v in cases(grc, tables):
        found = CompiledSystem(assembly, q, v, LoadTable(load), 1e-5).accelerations()
        expected = accelerations_of(assembly, q, v, assembly.torque_vector(load))
        assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
        signals, energies, powers = Observer(assembly, LoadTable(load)).observe(np.zeros(1), q[None], v[None])
        sample = sampled(assembly, q[None], v[None])
        assert np.abs(signals - sample).max() < 1e-9 * np.abs(sample).max()
        plain = energies_of(assembly, q[None], v[None])
        scale = np.abs(plain).max()
        assert np.abs(np.column_stack([energies, powers[:, 1:]]) - plain).max() < 1e-9 * scale


def test_flanks_apart_feel_nothing(grc: Gearbox, tables: dict) -> None:
    assembly = assemble(grc, Choice("bushing", "table"), tables)
    q = np.zeros(assembly.size)
    load = grc.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked)
    element = assembly.elements[-1]
    assert element.table is not None
    turn = -element.flank * 0.5 * element.table.backlash / element.mesh.pair.pinion.base_radius
    q[assembly.spin[element.mesh.pinion]] += turn
    found = assembly.mesh_states(q, np.ones(assembly.size))[-1]
    assert found[0] < 0.0
    assert not found[3:].any()


def test_other_flank_touches_after_the_backlash(grc: Gearbox, tables: dict) -> None:
    assembly = assemble(grc, Choice("rigid", "table"), tables)
    element = assembly.elements[-1]
    assert element.table is not None
    pair = element.mesh.pair.with_centre_distance(element.mesh.centre_distance)
    # Free angle of the pinion from tooth thicknesses and space width on its working circle.
    radius = pair.pinion_working_radius
    free = pair.circumferential_backlash / radius
    unloaded = element.table.surface.coefficients[..., 0, 0]
    for extra, touches in ((-2e-6, False), (unloaded.max() + 1e-6, True)):
        q = np.zeros(assembly.size)
        q[assembly.spin[element.mesh.pinion]] = -element.flank * (free + extra / pair.pinion.base_radius)
        force = assembly.mesh_states(q, 0 * q)[-1, 4]
        assert (force < 0.0) == touches


@pytest.mark.parametrize("variant", VARIANTS)
def test_static_deflection_is_the_tables(grc: Gearbox, tables: dict, variant: str) -> None:
    """Against the surface evaluated apart from the kernel, at the place where the gears really stand."""
    assembly = assembled(grc, Choice(variant, "table"), tables)
    load = grc.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked)
    found = assembly.mesh_states(q, 0 * q)
    places = assembly.gear_positions(q)
    for element, state, (centre, misalignment) in zip(assembly.elements, found, places, strict=True):
        assert element.table is not None
        ste = element.table.surface.ste(state[4], state[2], centre, element.flank * misalignment)
        assert state[0] == pytest.approx(ste, rel=1e-9)


def test_other_sense_of_load_is_the_same_pair_turned_about_the_line_of_centres() -> None:
    """Turned by pi about the line of centres (here x) a spur pair is itself, loaded on its other flanks."""
    content = tomllib.loads(SPUR_CASE)
    reversed_load = copy.deepcopy(content)
    reversed_load["static_load"]["torques_N_m"] = {"shaft_1": -100.0}
    forces = []
    random = np.random.default_rng(6)
    turn = np.tile([1.0, -1.0, -1.0, 1.0, -1.0, -1.0], 2)
    disturbance = random.normal(size=12) * np.tile([2e-6, 2e-6, 2e-6, 2e-4, 2e-4, 0.0], 2)
    for case, sign in ((content, np.ones(12)), (reversed_load, turn)):
        gearbox = Gearbox.from_dict(case)
        surface = asymmetric_surface(gearbox)
        assembly = assemble(gearbox, Choice("bushing", "table"), {"spur": surface})
        element = assembly.elements[0]
        assert element.flank == (1 if sign[1] > 0 else -1)
        q = disturbance.copy()
        q[5] = 30e-6 / element.mesh.pair.pinion.base_radius  # loaded deflection
        found = np.zeros(12)
        add_mesh_forces(sign * q, np.zeros(12), assembly.meshes, found)
        forces.append(sign * found)
        compiled = CompiledSystem(assembly, sign * q, np.zeros(12), LoadTable({}), 1e-5).accelerations()
        expected = accelerations_of(assembly, sign * q, np.zeros(12), np.zeros(12))
        assert np.abs(compiled - expected).max() < 1e-9 * np.abs(expected).max()
    assert np.abs(forces[0]).max() > 1e3
    assert np.abs(forces[1] - forces[0]).max() < 1e-9 * np.abs(forces[0]).max()


def asymmetric_surface(gearbox: Gearbox) -> SteSurface:
    """Softer the more the gap opens at the +z end."""
    force = gearbox.pairs["spur"].static_torque / gearbox.gears["pinion"].base_radius * np.array([0.5, 1.0, 2.0])
    tilts = np.array([-1e-3, 0.0, 1e-3])
    soft = 1.0 + 300.0 * tilts[None, None, :, None] + 0.1 * np.cos(2 * np.pi * np.arange(8) / 8)[:, None, None, None]
    per_load = soft / 2e8
    slopes = np.broadcast_to(300.0 / 2e8 * force, (*soft.shape[:3], 3))
    return SteSurface.from_nodes([0.075], tilts, force, per_load * force, 1.0 / per_load * np.ones(3), slopes)


@pytest.mark.parametrize(("size", "limit"), [(4e-6, 1e-8), (2e-5, 1e-7)], ids=["in contact", "through loss of contact"])
def test_no_energy_is_gained_on_a_closed_path_at_frozen_position(
    grc: Gearbox, tables: dict, size: float, limit: float
) -> None:
    """Work of the meshes along a closed path of all coordinates, integrated over its angle."""
    assembly = frozen(assemble(grc, Choice("bushing", "table"), tables))
    q, _ = in_contact(assembly, 5)
    one, two = size * np.random.default_rng(11).normal(size=(2, assembly.size))
    rest = np.zeros(assembly.size)
    work = []
    for angle in 2.0 * np.pi * np.arange(12000) / 12000:
        force = np.zeros(assembly.size)
        add_mesh_forces(q + math.cos(angle) * one + math.sin(angle) * two, rest, assembly.meshes, force)
        work.append(force @ (math.cos(angle) * two - math.sin(angle) * one))
    parted = [
        assembly.mesh_states(q + math.cos(angle) * one + math.sin(angle) * two, rest)[:, 4] == 0.0
        for angle in 2.0 * np.pi * np.arange(100) / 100
    ]
    assert np.any(parted) == (size > 1e-5)
    # Equal steps around a circle: what is left is the law's jump in curvature at its nodes and where teeth part.
    assert abs(np.sum(work)) < limit * np.sum(np.abs(work))


def test_misalignment_is_positive_where_it_opens_the_gap_at_the_plus_z_end(grc: Gearbox, tables: dict) -> None:
    """Against the flanks' approach computed at two planes of the gear."""
    assembly = assemble(grc, Choice("bushing", "table"), tables)
    random = np.random.default_rng(4)
    q = 1e-5 * random.normal(size=assembly.size)
    element = assembly.elements[-1]
    q[[assembly.spin[element.mesh.pinion], assembly.spin[element.mesh.gear]]] = 0.0
    first, second = (np.array(assembly.coordinates[name][:6]) for name in (element.mesh.pinion, element.mesh.gear))
    direction = element.deflection[:2] / math.hypot(*element.deflection[:2])

    def closing(z: float) -> float:
        moved = [q[c[:2]] + z * np.array([q[c[4]], -q[c[3]]]) for c in (first, second)]
        return float(direction @ (moved[0] - moved[1]))

    misalignment = assembly.gear_positions(q)[-1, 1]
    assert misalignment == pytest.approx(-(closing(0.1) - closing(0.0)) / 0.1, rel=1e-9)


@pytest.mark.validation
@pytest.mark.sample
@pytest.mark.parametrize("variant", VARIANTS)
def test_both_solvers_write_the_same_run(grc: Gearbox, tables: dict, tmp_path: Path, variant: str) -> None:
    one, two = (
        xr.load_dataset(
            simulated(grc, Choice(variant, "table"), tables, tmp_path / s, duration=0.02, solver=s).path,
            engine="h5netcdf",
        )
        for s in ("compiled", "exudyn")
    )
    names = ["time", "overall_dte", "mesh_force", "mesh_dte", "input_speed", "elastic_energy", "dissipated_energy"]
    if variant == "bushing":
        names += ["support_force", "centre_distance_change", "misalignment"]
    for name in names:
        expected = two[name].to_numpy()
        # Stored signals have seven digits.
        assert np.abs(one[name].to_numpy() - expected).max() < 1e-6 * np.abs(expected).max(), name
    assert not one["contact_loss_time"].any()
    assert not one["extrapolation_time"].any()


@pytest.mark.validation
def test_run_accounts_for_its_energy(grc: Gearbox, tables: dict, tmp_path: Path) -> None:
    run = simulate(grc, Choice("bushing", "table"), tables, tmp_path, duration=0.2)
    data = xr.load_dataset(run.path, engine="h5netcdf")
    stored = data.kinetic_energy + data.elastic_energy
    spent = data.dissipated_energy + data.work_of_varying_stiffness + data.non_conservative_work
    residual = data.work_of_loads - (stored - stored[0]) - spent - data.bearing_rate_work
    # Trapezoidal powers of a 16 us step: fractions of a joule beside what the loads do.
    assert float(np.abs(residual).max()) < 1e-4 * float(np.abs(data.work_of_loads).max())


@pytest.mark.validation
def test_teeth_apart_and_tables_left_are_counted(grc: Gearbox, tables: dict, tmp_path: Path) -> None:
    """At a hundredth of the static load a torque that reverses for a moment takes the teeth apart."""
    unloaded = grc.varied({"load_cases.reference.torques_N_m": {"carrier": 0.0, "hss": 0.0}})
    run = simulate(unloaded, Choice("rigid", "table"), tables, tmp_path, duration=0.01)
    data = xr.load_dataset(run.path, engine="h5netcdf")
    assert float(data["contact_loss_time"].min()) == pytest.approx(0.01, rel=0.05)
    heavy = grc.varied({"load_cases.reference.torques_N_m": {"carrier": 7.2e5, "hss": -7.2e5 / grc.train.ratio}})
    run = simulate(heavy, Choice("rigid", "table"), tables, tmp_path / "heavy", duration=0.01)
    data = xr.load_dataset(run.path, engine="h5netcdf")
    assert float(data["extrapolation_time"].min()) == pytest.approx(0.01, rel=0.05)


def marked_at(surface: SteSurface, load: int) -> SteSurface:
    """The same surface, whose states at one load and position count as not solved where gears stand."""
    guessed = np.zeros((*surface.coefficients.shape[:2], len(surface.misalignment), len(surface.root_force) - 1), bool)
    guessed[7, :, :, load] = True
    return replace(surface, guessed=guessed)


@pytest.mark.validation
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_run_beside_states_that_are_not_solved_says_so(
    grc: Gearbox, tables: dict, tmp_path: Path, variant: str
) -> None:
    """The fourth load is the static one; the fast pair passes one position of its cycle again and again."""
    marked = tables | {"high_speed": marked_at(tables["high_speed"], 3)}
    run = simulate(grc, Choice(variant, "table"), marked, tmp_path / variant, duration=0.1)
    data = xr.load_dataset(run.path, engine="h5netcdf")
    beside = dict(zip(data.mesh.values, data.interpolation_time.values, strict=True))
    # Three intervals of fifty, of a train that stands still at first.
    assert 0.0 < beside.pop("high_speed") < 0.1
    assert not any(beside.values())
    assert not run.trusted and not int(data.attrs["valid"])
    assert "high_speed read table states next to non-converged ones" in data.attrs["validity_message"]
    plain = simulate(grc, Choice(variant, "table"), tables, tmp_path / f"{variant}-plain", duration=0.1)
    assert plain.trusted
    other = xr.load_dataset(plain.path, engine="h5netcdf")
    assert np.array_equal(data["mesh_force"].to_numpy(), other["mesh_force"].to_numpy())  # a mark moves nothing


@pytest.mark.parametrize("load", [3, 5])
def test_modes_beside_states_that_are_not_solved_say_so(grc: Gearbox, tables: dict, load: int) -> None:
    """Pieces of load: the static one ends at the fourth load and lies before the sixth, at twice the static load."""
    marked = tables | {"high_speed": marked_at(tables["high_speed"], load)}
    found = modes_with_bodies(grc, Choice("rigid", "table"), marked)
    assert found.to_dataset().attrs["near_unconverged_states"] == ("high_speed" if load == 3 else "")


@pytest.mark.validation
def test_resumed_run_is_bitwise_the_whole_one(grc: Gearbox, tables: dict, tmp_path: Path) -> None:
    whole = simulate(grc, Choice("bushing", "table"), tables, tmp_path / "whole", duration=1.5)

    def stop(progress: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(grc, Choice("bushing", "table"), tables, tmp_path / "parts", duration=1.5, progress=stop)
    parts = simulate(grc, Choice("bushing", "table"), tables, tmp_path / "parts", duration=1.5, resume=True)
    one, two = (xr.load_dataset(run.path, engine="h5netcdf") for run in (whole, parts))
    for name in ("overall_dte", "mesh_force", "misalignment", "state_q"):
        assert np.array_equal(one[name].to_numpy(), two[name].to_numpy()), name


@pytest.mark.parametrize(
    ("load", "expected"), [(3, (True, True, True)), (5, (False, False, True)), (0, (True, True, True))]
)
def test_an_unsolved_state_counts_by_its_weight_and_not_by_the_rounding_of_the_force(
    grc: Gearbox, tables: dict, load: int, expected: tuple[bool, bool, bool]
) -> None:
    """Below, at and above the static load, which is the fourth load of the table to the last bits."""
    marked = tables | {"high_speed": marked_at(tables["high_speed"], load)}
    assembly = assembled(grc, Choice("rigid", "table"), marked)
    table, m = assembly.mean_meshes.table, assembly.mesh_names.index("high_speed")
    memory, centre = scratch_memory(), float(table.nominal[m, NOMINAL_DISTANCE])

    def law(delta: float) -> np.ndarray:
        surface_law(delta, 0.0, centre, 0.0, m, table, 0, ENERGY_DERIVATIVES, memory)
        return memory.law.copy()

    def counts(force: float, change: float = 0.0) -> bool:
        delta = scipy.optimize.brentq(lambda d: law(d)[LAW_FORCE] - force, 1e-6, 2e-4, xtol=1e-18, rtol=1e-14)
        return bool(law(delta * (1.0 + change))[LAW_OUTSIDE] == GUESSED)

    static = float(table.root[m, 4]) ** 2
    below, at, above = counts(0.99 * static), counts(static), counts(1.01 * static)
    assert (below, at, above) == expected
    for change in (-1e-9, -1e-15, 1e-15, 1e-9):
        assert counts(static, change) == at, change
