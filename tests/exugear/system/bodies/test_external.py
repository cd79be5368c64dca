"""Bodies from matrices of other programs in the gearbox file and in the variant `flexible`."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import scipy.linalg
from typer.testing import CliRunner

from exugear.cli.app import app
from exugear.cli.tasks.export import write_together
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.variant import Variant
from exugear.report.pictures.scene import elastic_scene
from exugear.results.sound.radiated_power import radiated_power, radiating_names
from exugear.steady.mean_system.mean_system import unsuitable
from exugear.system.bodies.external import interface_of
from exugear.system.bodies.external_of_gearbox import check_external, external_warnings
from exugear.system.bodies.matrix_files.files import MatrixFiles, MatrixFormat, file_contents, keys_of, read_matrices
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices
from exugear.system.bodies.matrix_files.plain import csv_matrix_content
from exugear.system.bodies.matrix_files.recovery import read_recovery
from exugear.system.bodies.of_gearbox import node_numbers
from exugear.system.bodies.reduction import ReducedBody, selective_mass_scaling
from exugear.system.loads import LoadTable
from exugear.system.modes import modes_of
from exugear.system.statics import accelerating_start, linearise, static_state
from exugear.system.system import Assembly, input_hash
from exugear.transient.compiled.solver import CompiledSystem

from ....optional_libraries import needs_gmsh, needs_meshio
from ...cases.assembled import assembled, bodies_of
from ...cases.beams import STEEL, beam_matrices, beams_between
from ...cases.both_ways import assert_matrices_of_exudyn_are_those_of, compiled_states, exudyn_states, relative_error
from ...cases.box import box_content
from ...cases.case_mutations import shaped_shafts
from ...cases.plain_motion import accelerations_of
from ...cases.plain_signals import sampled
from ...cases.ring import FACE, MIDDLE, OUTER, ring_content

pytestmark = needs_meshio

STIFFNESS = {"spur": 2e8 * (1.0 + 0.1 * np.cos(2.0 * np.pi * np.arange(16) / 16))}
LOAD = {"shaft_1": 100.0, "shaft_2": 140.0}
FOOT = {"foot": {"position_mm": [50.0, 0.0, -12.0]}}
"""The mount stands below its node."""
TOLERANCE = {"dmig": 1e-8}
"""Largest relative change of modes and static state by a file: 1e-9, but for the digits of a punch file."""


def box_of(folder: Path, external: Mapping[str, Any], solid: bool = False) -> Gearbox:
    """The spur pair in a box from matrices."""
    content = box_content(folder)
    if not solid:
        del content["bodies"]["box"]["solid"]
    content["bodies"]["box"]["external"] = {"units": "SI", "seats": FOOT, **external}
    return Gearbox.from_dict(content, str(folder / "case.toml"))


def write(folder: Path, body: InterfaceMatrices, form: MatrixFormat = "npz") -> dict[str, str]:
    for name, content in file_contents(body, "box", form).items():
        (folder / name).write_bytes(content)
    return keys_of("box", form)


@pytest.fixture(scope="module")
def housed(tmp_path_factory: pytest.TempPathFactory) -> Assembly:
    """With the box reduced here."""
    folder = tmp_path_factory.mktemp("box")
    return assembled(Gearbox.from_dict(box_content(folder), str(folder / "case.toml")), Choice("flexible"), STIFFNESS)


@pytest.fixture(scope="module")
def box(housed: Assembly) -> InterfaceMatrices:
    return interface_of(housed.elastic_bodies["box"].reduced)


def largest_change(found: Assembly, wanted: Assembly) -> float:
    """Largest relative change of the elastic modes' frequencies and of the static state."""
    one, two = (modes_of(assembly).frequency for assembly in (found, wanted))
    moving = two > 1.0
    static = [static_state(assembly).q for assembly in (found, wanted)]
    return max(
        float(np.abs(one[moving] / two[moving] - 1.0).max()),
        float(np.abs(static[0] - static[1]).max() / np.abs(static[1]).max()),
    )


@pytest.mark.parametrize("form", get_args(MatrixFormat))
@pytest.mark.parametrize("units", ["SI", "mm-t-s"])
def test_a_box_written_and_read_back_is_the_same_in_the_gearbox(
    tmp_path: Path, housed: Assembly, box: InterfaceMatrices, form: MatrixFormat, units: str
) -> None:
    keys = write(tmp_path, box.from_si(units), form)
    found = assembled(box_of(tmp_path, {**keys, "units": units}), Choice("flexible"), STIFFNESS)
    assert largest_change(found, housed) < TOLERANCE.get(form, 1e-9)


def test_a_box_in_other_axes_is_turned_and_shifted_back(
    tmp_path: Path, housed: Assembly, box: InterfaceMatrices
) -> None:
    # The other program's axes: rotated by 90 degrees about x, then by 30 about z, and shifted.
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turn, shift = about_z @ about_x, np.array([0.3, -0.2, 0.1])
    elsewhere = box.moved(turn.T, -turn.T @ shift)
    external = {**write(tmp_path, elsewhere), "turn_deg": [90.0, 0.0, 30.0], "shift_mm": [300.0, -200.0, 100.0]}
    found = assembled(box_of(tmp_path, external), Choice("flexible"), STIFFNESS)
    assert largest_change(found, housed) < 1e-9


@pytest.mark.validation
@pytest.mark.long
def test_runs_by_both_solvers_of_a_box_from_matrices(tmp_path: Path, box: InterfaceMatrices) -> None:
    assembly = assembled(box_of(tmp_path, write(tmp_path, box)), Choice("flexible"), STIFFNESS)
    start = accelerating_start(assembly, LOAD, 5.0)
    system = CompiledSystem(assembly, start.q, start.v, LoadTable(LOAD), 5e-6)
    plain = accelerations_of(assembly, start.q, start.v, assembly.torque_vector(LOAD))
    assert np.abs(system.accelerations() - plain).max() < 1e-9 * np.abs(plain).max()
    found, expected = (
        sampled(assembly, *states(assembly, start.q, start.v, LOAD, 200, 5e-6))
        for states in (compiled_states, exudyn_states)
    )
    assert relative_error(found, expected) < 1e-5


def test_statically_condensed_matrices_have_no_modal_coordinates_in_both_models(
    tmp_path: Path, box: InterfaceMatrices
) -> None:
    count = 6 * len(box.nodes)
    condensed = InterfaceMatrices(box.nodes, box.positions, (), box.mass[:count, :count], box.stiffness[:count, :count])
    assembly = assembled(box_of(tmp_path, write(tmp_path, condensed, "op4")), Choice("flexible"), STIFFNESS)
    assert assembly.elastic_bodies["box"].reduced.modal_groups == ()
    assert_matrices_of_exudyn_are_those_of(assembly, np.zeros(assembly.size), 1e-9)


def test_rigid_motions_of_few_digits_store_no_energy(tmp_path: Path, box: InterfaceMatrices) -> None:
    single = InterfaceMatrices(
        box.nodes,
        box.positions,
        box.modal,
        box.mass.astype(np.float32).astype(np.float64),
        box.stiffness.astype(np.float32).astype(np.float64),
    )
    assembly = assembled(box_of(tmp_path, write(tmp_path, single)), Choice("flexible"), STIFFNESS)
    body = assembly.elastic_bodies["box"].reduced
    motions = body.rigid_motions((0.0, 0.0, 0.0))
    energy = np.diag(motions.T @ body.stiffness @ motions)
    one_by_one = np.sum(motions**2 * np.diag(body.stiffness)[:, None], axis=0)
    assert np.abs(energy / one_by_one).max() < 1e-15
    assert np.abs(np.diag(motions.T @ single.stiffness @ motions) / one_by_one).max() > 1e-12  # as it was in the file


def test_motions_without_mass_get_that_of_the_limit() -> None:
    """A spring of 9 between a mass of 1 and a massless end; w = sqrt(9 / m) of the added mass m is the limit, 2."""
    stiffness = np.diag([0.0, 9.0])
    mass, scaled = selective_mass_scaling(np.diag([1.0, 0.0]), stiffness, 2.0 / (2.0 * np.pi))
    assert mass == pytest.approx(np.diag([1.0, 2.25]))
    assert scaled == (np.inf,)


def test_a_body_of_lumped_masses_moves_with_the_gearbox(tmp_path: Path) -> None:
    places = np.array([[0.0, 0.0, 0.0], [0.075, 0.0, 0.0], [0.05, 0.0, -0.012]])
    beams = beams_between(places, (1, 2, 3), 0.01)
    lumped = InterfaceMatrices(
        beams.nodes, places, (), np.diag(np.tile([0.2, 0.2, 0.2, 0.0, 0.0, 0.0], 3)), beams.stiffness
    )
    gearbox = box_of(tmp_path, write(tmp_path, lumped))
    assert any("some motions have none" in line for line in external_warnings(gearbox, "box"))
    assembly = assembled(gearbox, Choice("flexible"), STIFFNESS)
    frequencies = modes_of(assembly).frequency
    assert np.isfinite(frequencies).all()
    assert frequencies.max() < 12000.0 * 1.01 + 1e4


@pytest.mark.validation
@pytest.mark.long
@needs_gmsh
@pytest.mark.parametrize("form", ["npz", "dmig"])
def test_the_housing_of_the_grc_written_and_read_back_is_the_same_in_the_gearbox(
    tmp_path: Path, grc: Gearbox, stiffness: dict[str, np.ndarray], form: MatrixFormat
) -> None:
    rigid = {f"bodies.{name}.flexibility": "none" for name in ("carrier", "lss", "ims", "hss")}
    wanted = assembled(grc.varied(rigid), Choice("flexible"), stiffness)
    body = wanted.elastic_bodies["housing"]
    numbers = {seat.name: number for number, seat in enumerate(body.reduced.seats, start=1)}
    sectors = {gear: {"sector_nodes": [numbers.pop(seat) for seat in seats]} for gear, seats in body.sectors.items()}
    shared = {name: {"same_as": other} for name, other in body.shared_seats.items()}
    content = copy.deepcopy(dict(grc.varied(rigid).content))
    del content["bodies"]["housing"]["solid"]
    content["bodies"]["housing"]["external"] = {
        **write(tmp_path, interface_of(body.reduced), form),
        "units": "SI",
        "seats": {**sectors, **shared, **{name: {"node": number} for name, number in numbers.items()}},
    }
    content["bodies"]["housing"]["external"]["recovery"] = "box-surface.npz"
    found = assembled(Gearbox.from_dict(content, str(tmp_path / "case.toml")), Choice("flexible"), stiffness)
    assert largest_change(found, wanted) < TOLERANCE.get(form, 1e-9)
    assert_sound_is_that_of(found, wanted)


# Sound


def assert_sound_is_that_of(found: Assembly, wanted: Assembly) -> None:
    """Area and normal velocity of the outer surface within 1e-6, in motions with all coordinates."""
    motion = np.random.default_rng(5).normal(size=(8, 2, wanted.size)) @ np.diag(1e-6 * np.ones(wanted.size))
    frequencies = 2.0 * np.pi * np.linspace(50.0, 2000.0, 8)
    (one, area), (two, wanted_area) = (
        (own.surface_velocity(motion[:, 0] + 1j * motion[:, 1], frequencies), own.area)
        for own in map(radiated_power, (found, wanted))
        if own is not None
    )
    assert area == pytest.approx(wanted_area, rel=1e-6)
    assert one == pytest.approx(two, rel=1e-6)


@pytest.mark.parametrize("form", ["npz", "dmig", "csv"])
def test_a_box_with_its_surface_radiates_as_it_does_when_reduced_here(
    tmp_path: Path, housed: Assembly, box: InterfaceMatrices, form: MatrixFormat
) -> None:
    moved = box.moved(np.diag([-1.0, -1.0, 1.0]), (0.1, 0.0, 0.0)).from_si("mm-t-s")
    keys = write(tmp_path, moved, form)
    gearbox = box_of(tmp_path, {**keys, "units": "mm-t-s", "recovery": "box-surface.npz", "band_Hz": 6000.0,
                                "turn_deg": [0.0, 0.0, 180.0], "shift_mm": [100.0, 0.0, 0.0]})  # fmt: skip
    check_external(gearbox, "box")
    assert radiating_names(gearbox, Variant.flexible) == ("box",)
    found = assembled(gearbox, Choice("flexible"), STIFFNESS)
    assert_sound_is_that_of(found, housed)
    sound = radiated_power(found)
    assert sound is not None
    assert sound.limit == pytest.approx(4000.0)
    without = box_of(tmp_path, {**keys, "units": "mm-t-s", "turn_deg": [0.0, 0.0, 180.0], "shift_mm": [100.0, 0, 0]})
    assert radiating_names(without, Variant.flexible) == ()
    assert radiated_power(assembled(without, Choice("flexible"), STIFFNESS)) is None


def sphere(body: InterfaceMatrices, radius: float = 0.05) -> dict[str, np.ndarray]:
    """Arrays of a sphere around the first node, whose 400 points move with it and with a mode by its normal."""
    cosine = -1.0 + (2.0 * np.arange(400) + 1.0) / 400
    angle = np.pi * (1.0 + 5.0**0.5) * np.arange(400)
    sine = np.sqrt(1.0 - cosine**2)
    normals = np.column_stack([sine * np.cos(angle), sine * np.sin(angle), cosine])
    displacement = np.zeros((400, 3, body.size))
    displacement[:, :, :3] = np.eye(3)
    for n, (x, y, z) in enumerate(radius * normals):
        displacement[n, :, 3:6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    displacement[:, :, -1] = normals
    return {
        "nodes": np.array(body.nodes), "modal": np.array(body.modal), "normals": normals,
        "points": body.positions[0] + radius * normals, "areas": np.full(400, np.pi * radius**2 / 100.0),
        "displacement": displacement.reshape(1200, -1),
    }  # fmt: skip


def test_a_sphere_from_points_has_the_power_of_a_piston_and_of_breathing(
    tmp_path: Path, box: InterfaceMatrices
) -> None:
    """Mean square of the normal along an axis 1/3, of breathing 1, and none of turning."""
    arrays = sphere(box)
    np.savez(tmp_path / "sphere.npz", **arrays)
    found = read_recovery(tmp_path / "sphere.npz")
    assert found.area == pytest.approx(4.0 * np.pi * 0.05**2)
    motion = found.normal_motion.values / found.area
    assert motion[:3, :3] == pytest.approx(np.eye(3) / 3.0, abs=2e-3)
    assert np.trace(motion[:3, :3]) == pytest.approx(1.0, rel=1e-12)
    assert motion[-1, -1] == pytest.approx(1.0, rel=1e-12)
    assert np.abs(motion[3:6, 3:6]).max() < 1e-15
    gearbox = box_of(tmp_path, {**write(tmp_path, box), "recovery": "sphere.npz"})
    check_external(gearbox, "box")
    assert radiated_power(assembled(gearbox, Choice("flexible"), STIFFNESS)) is not None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"normals": lambda a: 2.0 * a}, r"point 1 has a normal of length 2 and the area .*; expected unit normals"),
        ({"areas": lambda a: -a}, "expected unit normals and positive areas"),
        ({"areas": lambda a: a[:-1]}, r"array points has the shape \(400, 3\); expected \(399, 3\) for 399 areas"),
        ({"displacement": lambda a: a[:, :-1]}, r"array displacement has the shape .* expected \(1200, 26\)"),
        (
            {"displacement": lambda a: 1e3 * a},
            r"not move with the nodes as a rigid body [(]translations by 1e[+]06",
        ),
        ({"displacement": lambda a: a[:, ::-1]}, "check order of coordinates, units"),
        ({"points": lambda a: 1e3 * a}, r"[(]translations by 1 of its area[)]; check order of coordinates"),
        ({"points": None}, "no array 'points'; write points, normals, areas, displacement, and nodes"),
        ({"nodes": None}, "no array 'nodes'"),
        ({"nodes": lambda a: a[[0, 0, 2]]}, "arrays nodes and modal have a number twice"),
        ({"displacement": lambda a: a * np.nan}, "array displacement has values that are not finite"),
    ],
)
def test_a_surface_that_does_not_fit_is_one_error(
    tmp_path: Path, box: InterfaceMatrices, change: Mapping[str, Any], message: str
) -> None:
    arrays = sphere(box)
    for name, function in change.items():
        value = arrays.pop(name)
        if function is not None:
            arrays[name] = function(value)
    np.savez(tmp_path / "sphere.npz", **arrays)
    gearbox = box_of(tmp_path, {**write(tmp_path, box), "recovery": "sphere.npz"})
    with pytest.raises(GearboxFileError, match=message) as refused:
        check_external(gearbox, "box")
    assert len(refused.value.errors) == 1


# Damping


def damped_box(folder: Path, box: InterfaceMatrices, external: Mapping[str, Any], **more: Any) -> Assembly:
    """The spur pair in the box on supports that are 10,000 times softer and have no damping."""
    content = dict(box_of(folder, {**write(folder, box), **external}).content)
    content = copy.deepcopy(content)
    for part in (*content["bearings"].values(), *content["mounts"].values()):
        part["stiffness"] = {key: 1e-4 * value for key, value in part["stiffness"].items()}
    content["static_load"]["torques_N_m"] = {key: 1e-4 * value for key, value in LOAD.items() if key == "shaft_1"}
    content["damping"] = {"bearing_time_s": 0.0, "mesh_time_s": 0.0, **more}
    gearbox = Gearbox.from_dict(content, str(folder / "case.toml"))
    return assembled(gearbox, Choice("flexible"), {"spur": 1e-4 * STIFFNESS["spur"]})


def free_modes(body: ReducedBody) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies (rad/s) and shapes of unit modal mass of the elastic modes of a free body."""
    squares, shapes = scipy.linalg.eigh(body.stiffness, body.mass)
    return np.sqrt(squares[6:]), shapes[:, 6:]


@pytest.mark.parametrize(
    ("external", "ratio"),
    [
        ({"loss_factor": 0.04}, lambda w: 0.02),
        ({"damping_time_s": 2e-6}, lambda w: 1e-6 * w),
        ({}, lambda w: 2.5e-6 * w),
    ],
)
def test_a_nearly_free_box_has_the_damping_ratios_that_its_keys_state(
    tmp_path: Path, box: InterfaceMatrices, external: dict[str, float], ratio: Any
) -> None:
    """Eta / 2 for structural damping, beta w / 2 for C = beta K; supports have 0.2 % of the strain energy."""
    assembly = damped_box(tmp_path, box, external, body_time_s=5e-6)
    wanted = free_modes(assembly.elastic_bodies["box"].reduced)[0]
    modes = modes_of(assembly)
    for w in wanted[:2]:
        own = int(np.abs(modes.frequency - w / (2.0 * np.pi)).argmin())
        assert modes.frequency[own] == pytest.approx(w / (2.0 * np.pi), rel=2e-3)
        assert modes.damping_ratio[own] == pytest.approx(ratio(w), rel=1e-2)


def test_rigid_motions_of_a_box_with_a_loss_factor_are_undamped(tmp_path: Path, box: InterfaceMatrices) -> None:
    """The same matrix in the equations, their linearisation, and both solvers; C = eta w in each free mode."""
    assembly = damped_box(tmp_path, box, {"loss_factor": 0.04})
    body, at = assembly.elastic_bodies["box"].reduced, assembly.elastic_slices["box"]
    q = np.zeros(assembly.size)
    total = linearise(assembly, q).total_damping[at, at]
    frequencies, shapes = free_modes(body)
    assert shapes.T @ total @ shapes == pytest.approx(np.diag(0.04 * frequencies), abs=1e-9 * frequencies.max())
    rigid = body.rigid_motions((0.0, 0.0, 0.0))
    assert np.abs(total @ rigid).max() < 1e-9 * np.abs(total).max()
    rate = np.random.default_rng(2).normal(size=assembly.size)
    rate[[n for n in range(assembly.size) if n not in range(at.start, at.stop)]] = 0.0
    change = assembly.forces(q, 1e-3 * rate) - assembly.forces(q, np.zeros(assembly.size))
    assert change[at] == pytest.approx(-1e-3 * total @ rate[at], rel=1e-9, abs=1e-9 * np.abs(change).max())
    assert_matrices_of_exudyn_are_those_of(assembly, q, 1e-9)


def test_modal_damping_counts_a_loss_factor_towards_its_ratio(tmp_path: Path, box: InterfaceMatrices) -> None:
    """0.2 % of critical in every mode, or more where the strain energy is mostly in the box, which alone has 4 %."""
    content = copy.deepcopy(dict(box_of(tmp_path, {**write(tmp_path, box), "loss_factor": 0.08}).content))
    content["damping"] = {"modal_percent": 0.2}
    gearbox = Gearbox.from_dict(content, str(tmp_path / "case.toml"))
    modes = modes_of(assembled(gearbox, Choice("flexible"), STIFFNESS))
    moving = (modes.frequency > 1.0) & (modes.frequency < gearbox.case.elasticity.band_Hz)
    assert modes.damping_ratio[moving].min() == pytest.approx(0.002, rel=1e-3)
    assert 0.004 < modes.damping_ratio[moving].max() < 0.05


# Rotating bodies


def whirl_frequencies(body: ReducedBody, speed: float) -> np.ndarray:
    """Frequencies of a body on springs at its seats at a speed (rad/s), Hz."""
    stiffness = body.stiffness.copy()
    for seat in range(len(body.seats)):
        stiffness[6 * seat : 6 * seat + 6, 6 * seat : 6 * seat + 6] += np.diag([2e7, 2e7, 1e7, 1e3, 1e3, 1e3])
    inverse = np.linalg.inv(body.mass)
    size = body.size
    state = np.block(
        [[np.zeros((size, size)), np.eye(size)], [-inverse @ stiffness, -speed * inverse @ body.gyroscopic]]
    )
    found = np.linalg.eigvals(state).imag / (2.0 * np.pi)
    return np.sort(found[found > 1.0])


@pytest.fixture(scope="module")
def shaft() -> tuple[dict[str, Any], ReducedBody]:
    """A gearbox file with a shaft whose inertia is that of its shape, and this shaft reduced here."""
    content = shaped_shafts()
    body = assembled(Gearbox.from_dict(content, "case.toml"), Choice("flexible"), STIFFNESS).elastic_bodies["shaft_1"]
    inertia = body.shape_inertia
    content["bodies"]["shaft_1"]["inertia"]["disc"] = {
        "mass_kg": inertia.mass, "axial_kg_m2": inertia.axial, "transverse_kg_m2": inertia.transverse,
        "centre_of_mass_z_mm": 1e3 * inertia.centre[2],
    }  # fmt: skip
    exact = assembled(Gearbox.from_dict(content, "case.toml"), Choice("flexible"), STIFFNESS).elastic_bodies["shaft_1"]
    assert exact.main_seat == "torque"
    return content, exact.reduced


def shaft_of(folder: Path, shaft: tuple[dict[str, Any], ReducedBody], **external: Any) -> Gearbox:
    """The same gearbox with the shaft from matrices."""
    content, body = copy.deepcopy(shaft[0]), shaft[1]
    keys = write(folder, interface_of(body), "dmig")
    del content["bodies"]["shaft_1"]["shape"]
    numbers = {seat.name: number for number, seat in enumerate(body.seats, start=1)}
    seats = {name: {"node": numbers[name]} for name in ("torque", "belt")}
    content["bodies"]["shaft_1"]["external"] = {
        **keys, "units": "SI", "torque_seat": "torque", "seats": seats, **external
    }  # fmt: skip
    return Gearbox.from_dict(content, str(folder / "case.toml"))


def write_gyroscopic(folder: Path, body: ReducedBody, change: Any = lambda g: g) -> str:
    """CSV file of the gyroscopic matrix of a body."""
    written = replace(interface_of(body), mass=change(body.gyroscopic))
    (folder / "gyroscopic.csv").write_bytes(csv_matrix_content(written, "mass"))
    return "gyroscopic.csv"


SPEED = 12000.0 * np.pi / 30.0


def test_gyroscopic_forces_of_a_shaft_follow_from_its_torsional_inertia(
    tmp_path: Path, shaft: tuple[dict[str, Any], ReducedBody]
) -> None:
    """Against a shaft reduced here with the exact gyroscopic matrix, at 12000 rpm: gyroscopic splitting within 2 %."""
    gearbox, exact = shaft_of(tmp_path, shaft), shaft[1]
    found = assembled(gearbox, Choice("flexible"), STIFFNESS).elastic_bodies["shaft_1"]
    assert found.main_seat == "torque"
    one, two, rest = (
        whirl_frequencies(body, omega) for body, omega in ((found.reduced, SPEED), (exact, SPEED), (exact, 0.0))
    )
    below = two < 4000.0
    assert np.abs(one[below] / two[below] - 1.0).max() < 0.02 * np.abs(rest[below] / two[below] - 1.0).max()
    assert any("gyroscopic forces follow" in line for line in external_warnings(gearbox, "shaft_1"))


def test_a_shaft_with_its_gyroscopic_matrix_whirls_as_it_does_when_reduced_here(
    tmp_path: Path, shaft: tuple[dict[str, Any], ReducedBody]
) -> None:
    """All frequencies at 12000 rpm within the digits of the punch file."""
    gearbox = shaft_of(tmp_path, shaft, gyroscopic=write_gyroscopic(tmp_path, shaft[1]))
    check_external(gearbox, "shaft_1")
    found = assembled(gearbox, Choice("flexible"), STIFFNESS).elastic_bodies["shaft_1"].reduced
    wanted = whirl_frequencies(shaft[1], SPEED)
    assert whirl_frequencies(found, SPEED) == pytest.approx(wanted, rel=1e-7)
    assert np.abs(wanted / whirl_frequencies(shaft[1], 0.0) - 1.0).max() > 1e-3
    assert not any("gyroscopic" in line for line in external_warnings(gearbox, "shaft_1"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (np.tril, r"gyroscopic: not antisymmetric at node \d+, component \d and node \d+, component \d: 0 and"),
        (np.abs, "write both triangles, with opposite signs"),
        (np.transpose, "rigid tilts about x and y are coupled by -.* kg m2, but the polar inertia about z is"),
        (lambda g: SPEED * g, "write the matrix per rad/s"),
    ],
)
def test_a_gyroscopic_matrix_that_is_none_is_refused_with_the_place(
    tmp_path: Path, shaft: tuple[dict[str, Any], ReducedBody], change: Any, message: str
) -> None:
    gearbox = shaft_of(tmp_path, shaft, gyroscopic=write_gyroscopic(tmp_path, shaft[1], change))
    with pytest.raises(GearboxFileError, match=message) as refused:
        check_external(gearbox, "shaft_1")
    assert len(refused.value.errors) == 1


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_rotor_in_its_middle_tilts_at_the_frequencies_of_the_closed_form(tmp_path: Path, sense: float) -> None:
    """Disc of J_p and J_t in the middle of an elastic shaft: w = g +- sqrt(g^2 + k/J_t) with g = J_p Omega / (2 J_t).

    Equations of the rigid rotor J_t a'' + J_p Omega b' + k a = 0 and its counterpart (Genta, Dynamics of Rotating
    Systems, 2005, ch. 2); k = 2 x 4 E I / l of two beams whose far ends are held.
    """
    places = np.array([[0.0, 0.0, -0.1], [0.0, 0.0, 0.0], [0.0, 0.0, 0.1]])
    ends = [beam_matrices(places[n], places[n + 1], 0.02)[0] for n in range(2)]
    stiffness = np.zeros((18, 18))
    for n, matrix in enumerate(ends):
        stiffness[6 * n : 6 * n + 12, 6 * n : 6 * n + 12] += matrix
    polar, transverse = 0.02, 0.011
    mass = np.diag(np.concatenate([np.full(6, 1e-6), [8.0, 8.0, 8.0, transverse, transverse, polar], np.full(6, 1e-6)]))
    gyroscopic = np.zeros((18, 18))
    gyroscopic[9, 10], gyroscopic[10, 9] = polar, -polar
    body = InterfaceMatrices((1, 2, 3), places, (), mass, stiffness, gyroscopic)
    in_mm = body.from_si("mm-t-s")
    write(tmp_path, in_mm)
    (tmp_path / "g.csv").write_bytes(csv_matrix_content(replace(in_mm, mass=in_mm.gyroscopic), "mass"))
    files = MatrixFiles(file=tmp_path / "box.npz", gyroscopic=tmp_path / "g.csv")
    turned = read_matrices(files).to_si("mm-t-s").moved(np.diag([-1.0, -1.0, 1.0]), (0.0, 0.0, 0.3))
    held = np.arange(6, 12)
    inverse = np.linalg.inv(turned.mass[np.ix_(held, held)])
    k, g = turned.stiffness[np.ix_(held, held)], turned.gyroscopic[np.ix_(held, held)]
    speed = sense * 2000.0
    state = np.block([[np.zeros((6, 6)), np.eye(6)], [-inverse @ k, -speed * inverse @ g]])
    found = np.linalg.eigvals(state).imag
    tilt = 8.0 * STEEL * 0.02**4 / 12.0 / 0.1  # two beams with their far ends held: 4 E I / l each
    half = polar * 2000.0 / (2.0 * transverse)
    middle = np.hypot(half, np.sqrt(tilt / transverse))
    for wanted in (middle + half, middle - half):
        assert np.abs(found - wanted).min() < 1e-9 * wanted


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ([[0.0, 0.0, -0.04], [0.0, 0.0, 0.02], [0.1, 0.0, 0.0]], "a seat is 100 mm off the axis, but 'nonrotating'"),
        ([[0.0, 0.0, -0.04], [1e-7, 0.0, 0.02], [0.0, 1e-7, 0.06]], "a rotation by 90 degrees changes its stiffness"),
    ],
)
def test_a_shaft_that_is_no_body_of_revolution_is_refused(
    tmp_path: Path, places: list[list[float]], message: str
) -> None:
    beams = beams_between(np.array(places), (1, 2, 3), 0.03)
    stiffness = beams.stiffness.copy()
    if places[2][0] == 0.0:  # as if its cross-section was flat: bending is softer about one axis
        for bent in (1, 3):
            at = np.arange(bent, 18, 6)
            stiffness[at] *= 0.8
            stiffness[:, at] *= 0.8
    content = shaped_shafts()
    del content["bodies"]["shaft_1"]["shape"], content["forces"]
    body = InterfaceMatrices(beams.nodes, beams.positions, (), beams.mass, stiffness)
    content["bodies"]["shaft_1"]["external"] = {
        **write(tmp_path, body), "units": "SI", "seats": {"pinion": {"node": 2}, "bearing_1": {"node": 1}},
    }  # fmt: skip
    with pytest.raises(GearboxFileError, match=message):
        bodies_of(Gearbox.from_dict(content, str(tmp_path / "case.toml")), Choice("flexible"))


def ring_of_beams() -> InterfaceMatrices:
    """Nodes 101 to 109 around a ring, referred to its centre by rigid arms, and nodes 1 and 2 at its front and rear."""
    centre = np.array([0.0, 0.0, MIDDLE])
    angles = 2.0 * np.pi * np.arange(9) / 9
    around = centre + OUTER * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(9)])
    places = np.vstack([around, centre - (0.0, 0.0, FACE / 2.0), centre + (0.001, 0.0, FACE / 2.0)])
    beams = beams_between(places, (*range(101, 110), 1, 2), 0.05)
    arms = np.eye(beams.size)
    for n, (x, y, z) in enumerate(around - centre):
        arms[6 * n : 6 * n + 3, 6 * n + 3 : 6 * n + 6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    at_centre = np.vstack([np.tile(centre, (9, 1)), places[9:]])
    return InterfaceMatrices(beams.nodes, at_centre, (), arms.T @ beams.mass @ arms, arms.T @ beams.stiffness @ arms)


def test_a_ring_from_matrices_has_sectors(tmp_path: Path, grc: Gearbox, stiffness: dict[str, np.ndarray]) -> None:
    ring = ring_of_beams()
    content = ring_content(grc, tmp_path)
    del content["bodies"]["housing"]["solid"]
    external = {**write(tmp_path, ring), "units": "SI"}
    content["bodies"]["housing"]["external"] = external
    external["seats"] = {"ring": {"sector_nodes": list(range(101, 110))}, "front": {"node": 1}, "rear": {"node": 2}}
    gearbox = Gearbox.from_dict(content, str(tmp_path / "case.toml"))
    check_external(gearbox, "housing")
    found = bodies_of(gearbox, Choice("flexible"))["housing"]
    assert found.sectors == {"ring": tuple(f"ring_{n}" for n in range(1, 10))}
    assert [seat.name for seat in found.reduced.seats] == [*found.sectors["ring"], "front", "rear"]
    wanted = ring.stiffness
    scale = np.sqrt(np.diag(wanted))
    assert np.abs((found.reduced.stiffness - wanted) / np.outer(scale, scale)).max() < 1e-12
    bushing = assembled(gearbox, Choice("bushing"), stiffness)
    assert not unsuitable(bushing, ("housing",))


@pytest.mark.parametrize(
    ("seats", "message"),
    [
        ({"front": {"node": 1}, "rear": {"node": 2}}, r"seats.ring: nodes 101, 102, .* 109 are all at .* set node"),
        ({"ring": {"sector_nodes": [101, 102, 1]}, "front": {"node": 103}}, "sector node 1 is 115 mm from the centre"),
    ],
)
def test_sectors_that_are_not_named_or_not_at_the_centre_are_refused(
    tmp_path: Path, grc: Gearbox, seats: dict[str, Any], message: str
) -> None:
    content = ring_content(grc, tmp_path)
    del content["bodies"]["housing"]["solid"]
    content["bodies"]["housing"]["external"] = {**write(tmp_path, ring_of_beams()), "units": "SI", "seats": seats}
    content["bodies"]["housing"]["external"]["seats"].setdefault("rear", {"node": 2})
    with pytest.raises(GearboxFileError, match=message):
        check_external(Gearbox.from_dict(content, str(tmp_path / "case.toml")), "housing")


# What is refused


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"file": "missing.npz"}, r"bodies.box.external.file = 'missing.npz': no such file"),
        ({"file": "../box.npz"}, r"external.file = '../box.npz': is outside the folder"),
        ({"units": None}, r"bodies.box.external.units"),
        ({"units": "mm"}, r"bodies.box.external.units"),
        ({"file": None}, r"requires its matrices; set file, or stiffness and mass"),
        ({"stiffness": "box.npz"}, r"set either file, or stiffness and mass"),
        ({"nodes": "box.npz", "units": "mm-t-s"}, r"seats.bearing_1: no node at|nodes .* are all at"),
        ({"shift_mm": [1.0, 0.0, 0.0]}, r"external: seats.bearing_1: no node at \(0, 0, 0\) mm; the nearest is node 1"),
        ({"seats": {}}, r"seats.foot: no node at \(50, 0, -40\) mm; the nearest is node 3 at a distance of 28 mm"),
        ({"seats": {"foot": {"node": 9}}}, r"seats.foot.node = 9: no such node; nodes are 1, 2, 3"),
        ({"seats": {"foot": {"node": 1}}}, r"seats.foot: node 1 is also that of bearing_1; set same_as = 'bearing_1'"),
        ({"seats": {"foot": {"node": 3, "same_as": "bearing_1"}}}, r"set one of node, position_mm"),
        ({"seats": {"foot": {"same_as": "nothing"}}}, r"foot.same_as = 'nothing': no such seat; seats are bearing_1"),
        ({"seats": {"foot": {"sector_nodes": [1, 2, 3]}}}, r"foot.sector_nodes: only the seat of a gear has sectors"),
        ({"seats": {"foot": {"sector_nodes": [1, 2]}}}, r"sector_nodes must be an odd number"),
        ({"seats": {**FOOT, "other": {}}}, r"seats.other: no gear, bearing or mount of the body is named 'other'"),
        ({"torque_seat": "top"}, r"torque_seat = 'top': no such seat; seats are bearing_1, bearing_2, foot"),
        ({"stated_mass_kg": 0.6}, r"stated_mass_kg = 0.6: the matrices have 0.58875 kg; check units and model"),
        ({"stated_centre_mm": [40.0, 0.0, -6.0]}, r"the matrices have their centre at \(37.5, .*, -6\) mm"),
        ({"loss_factor": 0.02, "damping_time_s": 1e-6}, r"set either loss_factor or damping_time_s"),
        ({"loss_factor": 2.0}, r"bodies.box.external.loss_factor"),
        ({"stiffness_name": "KUUX"}, r"no stiffness matrix named KUUX; matrices are stiffness, mass"),
    ],
)  # fmt: skip
def test_a_body_that_cannot_be_is_one_error_with_its_key(
    tmp_path: Path, box: InterfaceMatrices, change: dict[str, Any], message: str
) -> None:
    keys = {"units": "SI", "seats": FOOT, **write(tmp_path, box), **change}
    content = box_content(tmp_path)
    del content["bodies"]["box"]["solid"]
    content["bodies"]["box"]["external"] = {key: value for key, value in keys.items() if value is not None}
    with pytest.raises(GearboxFileError, match=message) as refused:
        check_external(Gearbox.from_dict(content, str(tmp_path / "case.toml")), "box")
    assert len(refused.value.errors) == 1


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"flexibility": "ffrf", "fixed": False}, "flexibility 'ffrf' requires mass integrals"),
        ({"spin_only": True, "fixed": False}, "external matrices are for a body on a fixed axis or a fixed body"),
        ({"fixed": False, "external": {"file": "box.npz", "units": "SI", "loss_factor": 0.02}}, "set damping_time_s"),
        ({"solid": {"file": "plate.vtu"}}, "set one of shape, solid and external"),
    ],
)
def test_bodies_that_matrices_cannot_be_are_refused(
    tmp_path: Path, box: InterfaceMatrices, changes: dict[str, Any], message: str
) -> None:
    content = box_content(tmp_path)
    del content["bodies"]["box"]["solid"]
    content["bodies"]["box"] |= {"external": {**write(tmp_path, box), "units": "SI"}, **changes}
    with pytest.raises(GearboxFileError, match=message):
        Gearbox.from_dict(content, str(tmp_path / "case.toml"))


def test_matrices_that_fail_a_check_are_refused_before_anything_is_computed(
    tmp_path: Path, box: InterfaceMatrices
) -> None:
    stiffness = box.stiffness.copy()
    stiffness[:3, :3] += 1e7 * np.eye(3)
    keys = write(tmp_path, InterfaceMatrices(box.nodes, box.positions, box.modal, box.mass, stiffness))
    gearbox = box_of(tmp_path, keys)
    with pytest.raises(GearboxFileError, match="bodies.box.external: stiffness: 3 motions are free"):
        check_external(gearbox, "box")


def test_what_an_rbe2_does_and_what_is_unusual_is_said(tmp_path: Path, box: InterfaceMatrices) -> None:
    spare = beams_between(np.vstack([box.positions, [[0.02, 0.02, 0.0]]]), (1, 2, 3, 44), 0.02)
    gearbox = box_of(tmp_path, {**write(tmp_path, spare), "constraint": "rbe2"})
    check_external(gearbox, "box")
    said = list(external_warnings(gearbox, "box"))
    assert any("constraint = 'rbe2': RBE2 makes each seat rigid" in line for line in said)
    assert any("nodes 44 carry nothing and remain free" in line for line in said)
    wrong = box_of(tmp_path, {**write(tmp_path, box), "seats": {name: {"node": n} for n, name in
                                                             enumerate(("bearing_1", "bearing_2", "foot"), start=1)},
                              "units": "inch-lbf-s"})  # fmt: skip
    assert any("check units" in line for line in external_warnings(wrong, "box"))


def test_loads_and_matrices_have_the_same_node_numbers(tmp_path: Path, box: InterfaceMatrices) -> None:
    content = box_content(tmp_path)
    assert node_numbers(Gearbox.from_dict(content, str(tmp_path / "case.toml")), "box") == {
        "bearing_1": 1, "bearing_2": 2, "foot": 3,
    }  # fmt: skip
    renumbered = InterfaceMatrices((70, 8, 55), box.positions, box.modal, box.mass, box.stiffness)
    seats = {"bearing_1": {"node": 70}, "bearing_2": {"same_as": "bearing_1"}, "foot": {"node": 55}}
    gearbox = box_of(tmp_path, {**write(tmp_path, renumbered), "seats": seats})
    assert node_numbers(gearbox, "box") == {"bearing_1": 70, "bearing_2": 70, "foot": 55}


def test_other_files_are_other_results(tmp_path: Path, box: InterfaceMatrices) -> None:
    hashes = []
    for factor in (1.0, 1.01):
        keys = write(tmp_path, InterfaceMatrices(box.nodes, box.positions, box.modal, factor * box.mass, box.stiffness))
        hashes.append(input_hash(assembled(box_of(tmp_path, keys), Choice("flexible"), STIFFNESS)))
    assert hashes[0] != hashes[1]


def test_pictures_show_the_nodes(tmp_path: Path, box: InterfaceMatrices) -> None:
    assembly = assembled(box_of(tmp_path, write(tmp_path, box)), Choice("flexible"), STIFFNESS)
    surface = assembly.elastic_bodies["box"].reduced.surface
    assert surface.points[:18].reshape(3, 6, 3).mean(axis=1) == pytest.approx(box.positions)
    # Bars from the foot, at (50, 0, -12) mm, to both bearings: 51.4 and 27.7 mm are shorter than 75 mm.
    ends = surface.points[18:].reshape(2, 2, 4, 3).mean(axis=2)
    assert sorted(np.linalg.norm(np.diff(ends, axis=1)[:, 0], axis=1)) == pytest.approx([0.02773, 0.05142], abs=1e-5)
    rigid = surface.displacement @ assembly.elastic_bodies["box"].reduced.rigid_motions((0.0, 0.0, 0.0))
    assert rigid[:, :, 5] == pytest.approx(np.cross([0.0, 0.0, 1.0], surface.points), abs=1e-7)
    scene = elastic_scene(assembly, modes_of(assembly).shapes[:, 3])
    assert len(scene.bodies[0].quads) == 3 * 8 + 2 * 4  # seen from every side


# Command line


def exugear(*arguments: object) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def toml(content: Mapping[str, Any]) -> str:
    from ...cases.case_mutations import toml_text

    return toml_text(dict(content))


def test_export_writes_what_the_gearbox_file_reads(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    content = box_content(tmp_path)
    case.write_text(toml(content), encoding="utf-8")
    wanted = ("--matrices", "box", "--format", "dmig", "--units", "mm-t-s", "--to", tmp_path)
    out = exugear("export", case, *wanted, "--out", tmp_path / "results", "--json")
    assert out.exit_code == 0, out.stderr
    said = json.loads(out.stdout)
    assert said["mass_kg"] == pytest.approx(0.58875)
    assert [(seat["node"], seat["seat"]) for seat in said["seats"]] == [(1, "bearing_1"), (2, "bearing_2"), (3, "foot")]
    assert said["files"] == [str(tmp_path / "box.pch"), str(tmp_path / "box-surface.npz")]
    assert said["keys"]["recovery"] == "box-surface.npz"
    del content["bodies"]["box"]["solid"]
    content["bodies"]["box"]["external"] = {**said["keys"], "units": said["units"], "seats": FOOT}
    case.write_text(toml(content), encoding="utf-8")
    check = exugear("check", case, "--json")
    assert check.exit_code == 0, check.stderr
    summary = json.loads(check.stdout)
    assert summary["variants"]["flexible"] == ""
    assert "bodies.box.external: 3 nodes" in summary["matrices"][0]
    assert "0.58875 kg, centre of mass at (37.5, " in summary["matrices"][0]
    again = exugear("export", case, "--matrices", "box", "--format", "dmig", "--to", tmp_path)
    assert again.exit_code == 2
    assert "box.pch: exists already; specify another folder with --to" in again.stderr.replace("\n", " ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--matrices", "lid"), "--matrices lid: no such flexible body; flexible bodies are box"),
        (("--matrices", "box", "file.rexs"), "--matrices box: omit file.rexs"),
        ((), "nothing to export; name a REXS file, a body with --matrices BODY, --loads FILE.nc or --surface FILE.nc"),
    ],
)
def test_an_export_that_cannot_be_is_refused_and_writes_nothing(
    tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    case = tmp_path / "case.toml"
    case.write_text(toml(box_content(tmp_path)), encoding="utf-8")
    before = sorted(tmp_path.rglob("*"))
    out = exugear("export", case, *arguments, "--out", tmp_path / "results")
    assert out.exit_code == 2
    assert message in " ".join(out.stderr.split())
    assert sorted(tmp_path.rglob("*")) == before


def test_damaged_matrices_are_bad_input_of_every_command(tmp_path: Path, box: InterfaceMatrices) -> None:
    keys = write(tmp_path, box, "op4")
    file = tmp_path / "box.op4"
    file.write_bytes(file.read_bytes()[:2000])
    gearbox = box_of(tmp_path, keys)
    case = tmp_path / "case.toml"
    case.write_text(toml(gearbox.content), encoding="utf-8")
    for verb in (
        ("check",),
        ("modes", "--variant", "flexible", "--mesh-model", "iso6336", "--out", tmp_path / "results"),
    ):
        out = exugear(verb[0], case, *verb[1:])
        assert out.exit_code == 2, out.stdout
        assert "bodies.box.external" in out.stderr
        assert "it is truncated" in " ".join(out.stderr.split())
    assert not (tmp_path / "results").exists()


def test_an_export_that_fails_at_its_second_file_leaves_none_behind(tmp_path: Path) -> None:
    """A folder has the name of the second file, as any other reason for which it cannot be written."""
    (tmp_path / "second.csv").mkdir()
    with pytest.raises(OSError, match="second"):
        write_together(tmp_path, {"first.csv": b"1", "second.csv": b"2"})
    assert [path.name for path in tmp_path.iterdir()] == ["second.csv"]
