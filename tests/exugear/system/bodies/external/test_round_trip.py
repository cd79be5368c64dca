"""Housings from matrices of other programs in a gearbox: modes, static state, and runs as before they were written."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bodies.external import interface_of
from exugear.system.bodies.external_of_gearbox import external_warnings
from exugear.system.bodies.matrix_files.files import MatrixFormat
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices
from exugear.system.bodies.reduction import selective_mass_scaling
from exugear.system.loads import LoadTable
from exugear.system.modes import modes_of
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem

from .....optional_libraries import needs_gmsh, needs_meshio
from ....cases.assembled import assembled
from ....cases.beams import beams_between
from ....cases.both_ways import assert_matrices_of_exudyn_are_those_of, compiled_states, exudyn_states, relative_error
from ....cases.plain_motion import accelerations_of
from ....cases.plain_signals import sampled
from .shared import LOAD, STIFFNESS, TOLERANCE, assert_sound_is_that_of, box_of, largest_change, write

pytestmark = needs_meshio


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


@pytest.mark.validation
@needs_gmsh
def test_the_carrier_of_the_grc_has_the_same_modes_through_every_form(
    tmp_path: Path, grc: Gearbox, stiffness: dict[str, np.ndarray]
) -> None:
    """Planets on its pins, bearings and output: eigenfrequencies as before it was written, in the gearbox at rest."""
    rigid = {f"bodies.{name}.flexibility": "none" for name in ("housing", "lss", "ims", "hss")}
    wanted = assembled(grc.varied(rigid), Choice("flexible"), stiffness)
    body = wanted.elastic_bodies["carrier"]
    seats: dict[str, Any] = {seat.name: {"node": number} for number, seat in enumerate(body.reduced.seats, start=1)}
    seats |= {name: {"same_as": other} for name, other in body.shared_seats.items()}
    content = copy.deepcopy(dict(grc.varied(rigid).content))
    torque_seat = content["bodies"]["carrier"].pop("solid").get("torque_seat")
    frequency = modes_of(wanted).frequency
    moving = frequency > 1.0
    for form in get_args(MatrixFormat):
        (tmp_path / form).mkdir()
        keys = write(tmp_path / form, interface_of(body.reduced), form)
        external = {**keys, "units": "SI", "seats": seats} | ({"torque_seat": torque_seat} if torque_seat else {})
        content["bodies"]["carrier"]["external"] = external
        gearbox = Gearbox.from_dict(content, str(tmp_path / form / "case.toml"))
        found = modes_of(assembled(gearbox, Choice("flexible"), stiffness)).frequency
        np.testing.assert_allclose(found[moving], frequency[moving], rtol=TOLERANCE.get(form, 1e-9), err_msg=form)
