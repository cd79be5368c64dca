"""The command `export` for other programs: matrices of a body, loads on the housing, velocities of its surface."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.cli.case import read_gearbox
from exugear.cli.console import BadInputError
from exugear.cli.tables import Column, Outcome, Table
from exugear.cli.watched import open_project
from exugear.gearbox.choice import choice_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.results.findings import Finding
from exugear.results.interface_loads import interface_loads, loaded_seats, loads_csv, nastran_loads
from exugear.results.sound.radiated_power import radiating_names
from exugear.results.sound.surface_velocity import surface_velocities, vtk_file
from exugear.steady.evaluation.deflection_shapes import motion_at
from exugear.steady.harmonics.linear_solvers import HarmonicBalanceError
from exugear.steady.steady_file import load_response, settings_of
from exugear.system.bearings.stiffness import elastic_names
from exugear.system.bodies.external import interface_of
from exugear.system.bodies.matrix_files.files import MatrixFormat, file_contents, keys_of
from exugear.system.bodies.matrix_files.interface import UnitSystemName
from exugear.system.bodies.of_gearbox import node_numbers
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.files import FileError, write_file

if TYPE_CHECKING:
    import xarray as xr

FOLDER = "matrices"
"""Folder of the files in a results folder."""
LEGEND = "Node: number in the files; components 1 to 3 are displacements along x, y, z, 4 to 6 rotations about them."
SPEED_TOLERANCE = 0.01
"""Largest relative difference of a computed speed from the one that is asked for."""


def export_matrices(
    case: Path,
    body: str,
    form: MatrixFormat,
    units: UnitSystemName,
    to: Path | None,
    out: Path | None,
    allow_dir: Path | None,
    scripts: bool,
    as_json: bool,
    whole: bool,
) -> None:
    """Write the matrices of a flexible body of the variant `flexible`."""
    project = open_project(case, out, allow_dir, scripts, Variant.flexible)
    flexible = elastic_names(project.gearbox)
    if body not in flexible:
        raise BadInputError(f"--matrices {body}: no such flexible body; flexible bodies are {', '.join(flexible)}")
    target = to or project.folder / FOLDER
    radiates = body in radiating_names(project.gearbox, Variant.flexible)
    _refuse_existing(target, keys_of(body, form, radiates, with_gyroscopic=True).values())
    project.begin()
    reduced = project.bodies()[body].reduced
    matrices = interface_of(reduced)
    keys = keys_of(body, form, radiates, matrices.gyroscopic is not None)
    contents = file_contents(matrices.from_si(units), body, form)
    write_together(target, contents)
    places = (1e3 * matrices.positions).tolist()
    seats = [
        {"node": node, "seat": seat.name, "x_mm": x, "y_mm": y, "z_mm": z}
        for node, seat, (x, y, z) in zip(matrices.nodes, reduced.seats, places, strict=True)
    ]
    Outcome(
        verdict=f"{body}: {len(seats)} interface nodes, {len(matrices.modal)} modal coordinates, "
        f"{reduced.rigid_inertia.mass:.5g} kg; units {units}",
        summary={
            "case": project.gearbox.source,
            "body": body,
            "format": form,
            "units": units,
            "files": [str(target / name) for name in contents],
            "keys": keys,
            "mass_kg": reduced.rigid_inertia.mass,
            "modal_coordinates": len(matrices.modal),
            "seats": seats,
        },
        tables=[
            Table(
                f"Interface nodes of {body}",
                seats,
                [
                    Column("seat", "seat", is_text=True),
                    Column("node", "node"),
                    *(Column(f"{axis}\nmm", f"{axis}_mm", ".3f") for axis in "xyz"),
                ],
                LEGEND,
                noun="nodes",
            )
        ],
        findings=[
            Finding(
                "note",
                f"modes above elasticity.limit_Hz = {project.gearbox.case.elasticity.limit_Hz:g} are at this frequency",
            )
        ],
        remarks=[
            f"As [bodies.{body}.external]: "
            + ", ".join(f'{key} = "{value}"' for key, value in {**keys, "units": units}.items())
        ],
        path=target,
    ).show(as_json, whole)


def export_loads(
    case: Path,
    response: Path,
    speed: float | None,
    units: UnitSystemName,
    to: Path | None,
    allow_dir: Path | None,
    as_json: bool,
    whole: bool,
) -> None:
    """Write the loads on the housing; with a speed also as Nastran load cards."""
    folder = to or response.parent
    stem = f"{response.stem}-loads"
    names = [f"{stem}.csv", *([] if speed is None else [f"{stem}.bdf"])]
    _refuse_existing(folder, names)
    gearbox = read_gearbox(case, allow_dir, tell=not as_json)
    data = _response("--loads", response)
    speeds = data["speed"].to_numpy()
    points = range(len(speeds)) if speed is None else [_nearest(speeds, speed)]
    is_flexible = choice_of(data.attrs).variant == Variant.flexible
    numbers = _numbers(gearbox, loaded_seats(gearbox, data), is_flexible)
    try:
        loads = list(interface_loads(gearbox, data, points, numbers))
    except ValueError as error:
        raise BadInputError(f"--loads {response}: {error}") from error
    contents = [loads_csv(loads), *([] if speed is None else [nastran_loads(loads[0], units)])]
    write_together(folder, dict(zip(names, contents, strict=True)))
    rows = [{"seat": name, "node": numbers[name]} for name in loads[0].seats]
    Outcome(
        verdict=f"{len(rows)} seats, {len(loads[0].frequency)} frequencies, {len(loads)} speeds",
        summary={
            "case": gearbox.source,
            "response": str(response),
            "speeds_rpm": [own.speed / RPM for own in loads],
            "files": [str(folder / name) for name in names],
            "seats": rows,
        },
        findings=list(_left_out(gearbox, str(data.attrs["mesh_model"]), numbers)),
        path=folder / names[-1],
    ).show(as_json, whole)


def export_surface(
    case: Path,
    response: Path,
    speed: float | None,
    to: Path | None,
    out: Path | None,
    allow_dir: Path | None,
    scripts: bool,
    as_json: bool,
    whole: bool,
) -> None:
    """Write the velocities on the surface of flexible housings at a speed, as netCDF and as VTK file."""
    if speed is None:
        raise BadInputError("--surface: name a computed speed with --speed RPM")
    if find_spec("meshio") is None:
        raise BadInputError("--surface: meshio is not installed: pip install 'exugear[mesh]'")
    folder = to or response.parent
    names = [f"{response.stem}-surface.{ending}" for ending in ("nc", "vtu")]
    _refuse_existing(folder, names)
    data = _response("--surface", response)
    choice = choice_of(data.attrs)
    point = _nearest(data["speed"].to_numpy(), speed)
    variant = Variant.of(choice.variant)
    project = open_project(case, out, allow_dir, scripts, variant, choice.mesh_model, choice.inertias)
    if not radiating_names(project.gearbox, variant):
        raise BadInputError(f"--surface {response}: no flexible housing; compute the response with --variant flexible")
    project.begin()
    assembly = project.assembly()
    if settings_of(data.attrs).hash_with(assembly) != data.attrs["input_hash"]:
        raise BadInputError(f"--surface {response}: computed from another gearbox file or tables; compute it again")
    at = float(data["speed"].to_numpy()[point])
    try:
        motion = motion_at(assembly, data, at)
    except HarmonicBalanceError as error:
        raise BadInputError(f"--surface {response}: at {at / RPM:.6g} rpm {error}; choose another --speed") from error
    bodies = {name: body.reduced for name, body in assembly.elastic_bodies.items()}
    surfaces = {name: body.surface for name, body in bodies.items() if body.radiating is not None}
    orders = data["order"].to_numpy()
    heard = np.flatnonzero(orders > 0.0)
    velocities = surface_velocities(
        surfaces,
        {name: motion[heard][:, assembly.elastic_slices[name]] for name in surfaces},
        np.abs(at * orders[heard]) / (2.0 * np.pi),
        [str(data["line"].to_numpy()[line]) for line in heard],
        at,
    )
    content = io.BytesIO()
    velocities.to_netcdf(content, engine="h5netcdf")
    write_together(folder, dict(zip(names, (content.getvalue(), vtk_file(velocities)), strict=True)))
    points = velocities.sizes["point"]
    Outcome(
        verdict=f"{points} points of {', '.join(surfaces)}, {len(heard)} orders at {at / RPM:.6g} rpm",
        summary={
            "case": project.gearbox.source,
            "response": str(response),
            "speed_rpm": at / RPM,
            "bodies": list(surfaces),
            "points": points,
            "orders": len(heard),
            "files": [str(folder / name) for name in names],
        },
        path=folder / names[-1],
    ).show(as_json, whole)


def _response(option: str, path: Path) -> xr.Dataset:
    """Read the steady-state response that an option names."""
    try:
        return load_response(path)
    except FileError as error:
        raise BadInputError(f"{option} {error}; specify a file that exugear steady has written") from error


def write_together(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write all files or none, so that the command can be called again."""
    written = []
    try:
        for name, content in contents.items():
            write_file(folder / name, content)
            written.append(folder / name)
    except BaseException:
        for path in written:
            path.unlink(missing_ok=True)
        raise


def _refuse_existing(folder: Path, names: Iterable[str]) -> None:
    if existing := next((folder / name for name in names if (folder / name).exists()), None):
        raise BadInputError(f"{existing}: exists already; specify another folder with --to")


def _nearest(speeds: np.ndarray, speed: float) -> int:
    """Index of the computed speed next to one in rpm."""
    nearest = int(np.abs(speeds - RPM * speed).argmin())
    # Written so that a speed that is not a number is refused.
    if not abs(speeds[nearest] - RPM * speed) <= SPEED_TOLERANCE * abs(RPM * speed):
        raise BadInputError(
            f"--speed {speed:g}: not computed; the response has {len(speeds)} speeds, the nearest is "
            f"{speeds[nearest] / RPM:.6g} rpm"
        )
    return nearest


def _left_out(gearbox: Gearbox, mesh_model: str, numbers: Mapping[str, int]) -> Iterator[Finding]:
    """Say which loads on what stands still the files do not have."""
    for body in gearbox.bodies():
        for gear in body.wheels if body.fixed else ():
            if gear not in numbers:
                yield Finding(
                    "warning",
                    f"loads of meshes on {gear}, a gear of flexible sectors on {body.name}, are not included; apply "
                    "them separately",
                )
            elif LAWS[mesh_model].loses_contact:
                yield Finding(
                    "note",
                    f"loads on {gear} are those along the line of action; moments by uneven load along the face are "
                    f"not included with the mesh model {mesh_model}",
                )


def _numbers(gearbox: Gearbox, seats: Sequence[str], is_flexible: bool) -> dict[str, int]:
    """Node number of each seat: that on a flexible housing; others are counted from there, or from 1.

    Excitations have the node of their seat only if the response is flexible: else they are at another place.
    """
    numbers: dict[str, int] = {}
    on = {bearing.name: bearing.on for bearing in gearbox.standing_bearings}
    for body in gearbox.bodies():
        section = gearbox.case.bodies[body.family]
        if body.fixed and (section.external is not None or section.solid is not None):
            at_seats = node_numbers(gearbox, body.name)
            reacting = [load.excitation for load in gearbox.varying_loads if load.reaction_on == body.name]
            here = {*body.wheels, *(reacting if is_flexible else ())}
            own = (seat for seat in seats if seat in here or on.get(seat) == body.name)
            numbers |= {seat: at_seats[seat] for seat in own if seat in at_seats}
    others = (seat for seat in seats if seat not in numbers)
    return numbers | {seat: number for number, seat in enumerate(others, start=max(numbers.values(), default=0) + 1)}
