"""Elastic bodies and eigenmodes, computed behind a progress bar."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from exugear.cli.console import note, progress_bar
from exugear.cli.errors import BadInputError, FailedError, model_errors
from exugear.cli.options import Variant

if TYPE_CHECKING:
    from exugear.bodies.elastic_body import ElasticBody
    from exugear.dynamics.modes import Modes
    from exugear.model.gearbox import Gearbox


def reduce_elastic_bodies(gearbox: Gearbox, folder: Path, variant: str, inertias: str | None) -> dict[str, ElasticBody]:
    """Reduce the elastic bodies of a variant behind a progress bar, or find those that are kept."""
    if variant != Variant.flexible:
        return {}
    from exugear.bearings.supports import elastic_names
    from exugear.bodies.of_gearbox.elastic_bodies import reduced_bodies
    from exugear.results.folder import bodies_folder

    with progress_bar() as bar:
        task = bar.add_task("", total=len(elastic_names(gearbox)))

        def begin(name: str) -> None:
            done = bar.tasks[task].completed + (bar.tasks[task].description != "")
            bar.update(task, completed=done, description=f"{name}: finite elements, reduced to its seats")

        try:
            with model_errors():
                inertia_set = inertias or gearbox.case.default_inertias
                bodies = reduced_bodies(gearbox, inertia_set, bodies_folder(folder), begin)
        except BadInputError as error:  # a mesh that only reading shows to be none: the work has begun
            raise FailedError(error) from error
        bar.update(task, completed=bar.tasks[task].total)
        return bodies


def compute_modes(gearbox: Gearbox, folder: Path, variant: str, law: str, inertias: str | None) -> tuple[Modes, Path]:
    """Compute the eigenmodes of a variant and store them; elastic bodies come first."""
    from exugear.dynamics.modes import eigenmodes
    from exugear.model.choice import Choice
    from exugear.results.folder import modes_path
    from exugear.tooth_mesh.laws.stiffness import mesh_stiffness

    bodies = reduce_elastic_bodies(gearbox, folder, variant, inertias)
    with model_errors():
        found = eigenmodes(gearbox, Choice(variant, law, inertias), mesh_stiffness(gearbox, law, folder), bodies)
    for name, body in found.assembly.elastic_bodies.items():
        figures = body.reduced.summary
        unknowns, took = sum(figures.unknowns.values()), figures.seconds
        note(f"{name}: {unknowns} unknowns reduced to {body.reduced.size} coordinates in {took:.1f} s")
    return found, found.save(modes_path(folder, found.assembly.choice))


def label_of(found: Modes) -> str:
    """Return what modes belong to: variant, mesh law, inertia set and housing factor."""
    assembly = found.assembly
    law = f"law {assembly.law}, inertias {assembly.inertias}"
    return f"{assembly.variant}, {law}, housing factor {assembly.housing_factor:g}"
