"""Elastic bodies and eigenmodes, computed behind a progress bar."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from exugear.cli.console import note, progress_bar
from exugear.cli.errors import BadInputError, FailedError, interruption, model_errors

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from exugear.bodies.elastic_body import ElasticBody
    from exugear.dynamics.eigenmodes.modes import Modes
    from exugear.project import Project


def reduce_elastic_bodies(project: Project) -> dict[str, ElasticBody]:
    """Reduce the elastic bodies of the variant behind a progress bar, or find those that are kept."""
    if not project.choice.variant.is_elastic:
        return {}
    from exugear.bearings.supports import elastic_names

    with progress_bar() as bar:
        task = bar.add_task("", total=len(elastic_names(project.gearbox)))

        def begin(name: str) -> None:
            done = bar.tasks[task].completed + (bar.tasks[task].description != "")
            bar.update(task, completed=done, description=f"{name}: finite elements, reduced to its seats")

        try:
            with model_errors():
                bodies = project.bodies(begin)
        except BadInputError as error:  # a mesh that only reading shows to be none: the work has begun
            raise FailedError(error) from error
        bar.update(task, completed=bar.tasks[task].total)
        return bodies


@contextmanager
def contacts_shown(bar: Progress | None = None, task: TaskID | None = None) -> Iterator[None]:
    """Tell of contact that is solved where gears stand: in the words of a bar that is there, else by one of its own."""
    from fe_ste.transmission_error.known_contacts import contacts_told

    with ExitStack() as shown:
        own: list[tuple[Progress, TaskID]] = []

        def solved(done: int, of: int) -> None:
            interruption.check()
            words = f"contact of teeth where gears stand: {done} of {of}"
            if bar is not None and task is not None:
                bar.update(task, description=words)
                return
            if not own:
                mine = shown.enter_context(progress_bar())
                own.append((mine, mine.add_task("", total=of)))
            own[0][0].update(own[0][1], completed=done, total=of, description=words)

        shown.enter_context(contacts_told(solved))
        yield


def compute_modes(project: Project) -> Modes:
    """Compute the eigenmodes and store them; elastic bodies come first."""
    from exugear.dynamics.eigenmodes.modes import eigenmodes

    bodies = reduce_elastic_bodies(project)
    with model_errors(), contacts_shown():
        modes = eigenmodes(project.gearbox, project.choice, project.stiffness(), bodies)
    for name, body in modes.assembly.elastic_bodies.items():
        figures = body.reduced.summary
        unknowns, took = sum(figures.unknowns.values()), figures.seconds
        note(f"{name}: {unknowns} unknowns reduced to {body.reduced.size} coordinates in {took:.1f} s")
    modes.save(project.modes_path)
    return modes


def label_of(modes: Modes) -> str:
    """Return what modes belong to: variant, mesh law, inertia set and housing factor."""
    assembly = modes.assembly
    law = f"law {assembly.mesh_law}, inertias {assembly.inertias}"
    return f"{assembly.variant}, {law}, housing factor {assembly.housing_factor:g}"
