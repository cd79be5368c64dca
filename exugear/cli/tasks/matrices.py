"""The command `export --matrices`: a flexible body as mass and stiffness on its seats, for other programs."""

from __future__ import annotations

from pathlib import Path

from exugear.cli.case import open_project
from exugear.cli.console import BadInputError
from exugear.cli.tables import Column, Outcome, Table
from exugear.gearbox.variant import Variant
from exugear.results.findings import Finding
from exugear.system.bearings.stiffness import elastic_names
from exugear.system.bodies.external import interface_of
from exugear.system.bodies.matrix_files.files import MatrixFormat, file_contents, keys_of
from exugear.system.bodies.matrix_files.interface import UnitSystemName
from fe_ste.tools.files import write_file

FOLDER = "matrices"
"""Folder of the files in a results folder."""
LEGEND = "Node: number in the files; components 1 to 3 are displacements along x, y, z, 4 to 6 rotations about them."


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
    keys = keys_of(body, form)
    existing = next((target / name for name in keys.values() if (target / name).exists()), None)
    if existing is not None:
        raise BadInputError(f"{existing}: exists already; specify another folder with --to")
    project.begin()
    reduced = project.bodies()[body].reduced
    matrices = interface_of(reduced)
    contents = file_contents(matrices.from_si(units), body, form)
    for name, content in contents.items():
        write_file(target / name, content)
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
