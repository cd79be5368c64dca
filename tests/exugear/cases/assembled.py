"""Assembly, modes and runs of a choice with its elastic bodies, which are reduced first where the variant has any."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.results.folder import keep_case
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.modes import Modes, eigenmodes
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.tables import requested_tables
from exugear.transient.outcome import Run
from exugear.transient.runup import simulate

from .spur import SPUR_CASE


def bodies_of(gearbox: Gearbox, choice: Choice, folder: Path | None = None) -> dict[str, ElasticBody]:
    """Reduced bodies of the variant `flexible`, none of others."""
    return reduced_bodies(gearbox, choice.inertia_set(gearbox), folder) if choice.variant == "flexible" else {}


def assembled(
    gearbox: Gearbox, choice: Choice, stiffness: Mapping[str, Any], *, folder: Path | None = None, **options: Any
) -> Assembly:
    """Assemble a choice."""
    return assemble(gearbox, choice, stiffness, bodies_of(gearbox, choice, folder), **options)


def modes_with_bodies(
    gearbox: Gearbox, choice: Choice, stiffness: Mapping[str, Any], *, folder: Path | None = None, **options: Any
) -> Modes:
    """Eigenmodes of a choice."""
    return eigenmodes(gearbox, choice, stiffness, bodies_of(gearbox, choice, folder), **options)


def simulated(gearbox: Gearbox, choice: Choice, stiffness: Mapping[str, Any], out: Path, **options: Any) -> Run:
    """Run a choice."""
    return simulate(gearbox, choice, stiffness, out, bodies=bodies_of(gearbox, choice), **options)


def spur_with_tables(folder: Path, mesh_model: str) -> tuple[Gearbox, Mapping[str, Any]]:
    """The spur pair and its mesh stiffness by a law, its case and tables kept in a folder of results."""
    case = folder / "spur.toml"
    case.write_text(SPUR_CASE, encoding="utf-8")
    gearbox = Gearbox.from_toml(case)
    keep_case(gearbox, folder)
    for request in requested_tables(gearbox, folder):
        request.compute()
    return gearbox, mesh_stiffness(gearbox, mesh_model, folder)
