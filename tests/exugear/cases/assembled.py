"""Assembly, modes and runs of a choice with its elastic bodies, which are reduced first where the variant has any."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.modes import Modes, eigenmodes
from exugear.system.system import Assembly
from exugear.transient.outcome import Run
from exugear.transient.runup import simulate


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
