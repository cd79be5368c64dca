"""Shafts with gyroscopic forces, and rings with sectors, from matrices."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.steady.balance.response import signals
from exugear.steady.mean_system.mean_system import unsuitable
from exugear.system.bodies.external import interface_of
from exugear.system.bodies.external_of_gearbox import check_external, external_warnings
from exugear.system.bodies.matrix_files.files import MatrixFiles, MatrixFormat, file_contents, keys_of, read_matrices
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices
from exugear.system.bodies.matrix_files.plain import csv_matrix_content
from exugear.system.bodies.reduction import ReducedBody

from .....optional_libraries import needs_meshio
from ....cases.assembled import assembled, bodies_of
from ....cases.beams import STEEL, beam_matrices, beams_between
from ....cases.case_mutations import shaped_shafts
from ....cases.ring import FACE, MIDDLE, OUTER, ring_content
from ....cases.steady_runs import solver_of
from .shared import STIFFNESS, largest_change, write

pytestmark = needs_meshio


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


@pytest.mark.parametrize("form", get_args(MatrixFormat))
def test_a_shaft_is_written_with_its_gyroscopic_matrix_and_a_housing_without(
    tmp_path: Path, shaft: tuple[dict[str, Any], ReducedBody], box: InterfaceMatrices, form: MatrixFormat
) -> None:
    """In mm, t and s, and read back in SI units."""
    body = shaft[1]
    for name, written in file_contents(interface_of(body).from_si("mm-t-s"), "shaft", form).items():
        (tmp_path / name).write_bytes(written)
    keys = keys_of("shaft", form, with_gyroscopic=True)
    content = copy.deepcopy(dict(shaft_of(tmp_path, shaft).content))
    external = content["bodies"]["shaft_1"]["external"]
    content["bodies"]["shaft_1"]["external"] = {
        **keys, "units": "mm-t-s", "torque_seat": external["torque_seat"], "seats": external["seats"]
    }  # fmt: skip
    gearbox = Gearbox.from_dict(content, str(tmp_path / "case.toml"))
    found = bodies_of(gearbox, Choice("flexible"))["shaft_1"].reduced
    names = [seat.name for seat in found.seats]
    seats = [names.index(seat.name) for seat in body.seats]
    own = np.arange(len(body.mass))
    own[: 6 * len(seats)] = (6 * np.array(seats)[:, None] + np.arange(6)).ravel()
    largest = np.abs(body.gyroscopic).max()
    np.testing.assert_allclose(found.gyroscopic[np.ix_(own, own)], body.gyroscopic, rtol=0.0, atol=1e-9 * largest)
    assert box.gyroscopic is None


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


@pytest.mark.validation
def test_a_ring_written_and_read_back_is_the_same_with_its_planets(
    tmp_path: Path, grc: Gearbox, stiffness: dict[str, np.ndarray]
) -> None:
    """Modes and static state of the planetary stage, and its steady response with planets that pass the sectors."""
    content = ring_content(grc, tmp_path)
    wanted = assembled(Gearbox.from_dict(content, str(tmp_path / "case.toml")), Choice("flexible"), stiffness)
    body = wanted.elastic_bodies["housing"]
    numbers = {seat.name: number for number, seat in enumerate(body.reduced.seats, start=1)}
    seats: dict[str, Any] = {"ring": {"sector_nodes": [numbers.pop(seat) for seat in body.sectors["ring"]]}}
    seats |= {name: {"node": number} for name, number in numbers.items()}
    del content["bodies"]["housing"]["solid"]
    external = {**write(tmp_path, interface_of(body.reduced)), "units": "SI", "seats": seats}
    content["bodies"]["housing"]["external"] = external
    found = assembled(Gearbox.from_dict(content, str(tmp_path / "case.toml")), Choice("flexible"), stiffness)
    assert largest_change(found, wanted) < 1e-9
    solvers = [solver_of(assembly, (7.0, 9.0), "parametric", 4, 2) for assembly in (found, wanted)]
    one, two = (signals(solver.model, solver.response(8.0)) for solver in solvers)
    names = [name.name for name in solvers[0].model.signal_names]
    assert names == [name.name for name in solvers[1].model.signal_names if name.name != "surface_velocity"]
    change = np.abs(one - two[:, : len(names)])[1:].max(axis=0)
    size = np.abs(two[1:, : len(names)]).max(axis=0)
    quantities = np.array([name.split()[0] for name in names])
    for quantity in np.unique(quantities):
        own = quantities == quantity
        # Some components are zero by symmetry, and so are all moments of these bearings.
        assert change[own].max() < 1e-6 * size[own].max() + 1e-9 * size.max(), quantity


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
