"""What all that is told of results stands on: the case of the folder, its models, and notes for the top of a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import Variant
from exugear.results.folder import bodies_folder
from exugear.system.assemble import assemble
from exugear.system.assembly import Assembly
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox.elastic_bodies import reduced_bodies
from exugear.system.tooth_mesh.law import MeshCurve
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.surface import SteSurface

REFERENCE_VARIANT = Variant.rigid
"""Variant that others are compared with."""
VISIBLE_SHARE = 0.01
"""Least share of the overall transmission error's mobility for a mode to be called seen by it."""


def choice_of(attributes: Mapping[str, Any]) -> Choice:
    """Choice that a run or modes were computed of, from the attributes of the file; its load case is left out."""
    return Choice(*(str(attributes[key]) for key in ("variant", "mesh_law", "inertias")))


def words_of(choice: Choice) -> str:
    """Return a choice for headings."""
    return f"{choice.variant}, law {choice.mesh_law}, inertias {choice.inertias}"


def file_part(choice: Choice) -> str:
    """Return a choice for names of files."""
    return f"{choice.variant}-{choice.mesh_law}-{choice.inertias}"


@dataclass(frozen=True)
class Notes:
    """What is told at the top of the page; each list in the order in which it was noted."""

    statements: list[str] = field(default_factory=list)
    """What the page says in short."""
    distrusted: list[str] = field(default_factory=list)
    """Runs that are not to be trusted, with the reason."""
    left_out: list[str] = field(default_factory=list)
    """Files that do not belong to the case, and what could not be computed, with the reason."""


@dataclass(frozen=True)
class Context:
    """What the sections of one report share."""

    folder: Path
    """The results folder."""
    gearbox: Gearbox
    """The case that is kept in it."""
    target: float | None
    """Frequency (Hz) that modes are looked for at."""
    tell: Callable[[str], None]
    """Called with what is being done."""
    notes: Notes = field(default_factory=Notes)
    assemblies: dict[Choice, Assembly] = field(default_factory=dict)
    """Choices assembled so far."""
    stiffnesses: dict[str, dict[str, Floats | MeshCurve | SteSurface]] = field(default_factory=dict)
    """Dict of law to mesh stiffness. Mesh stiffness read so far."""

    def stiffness(self, law: str) -> dict[str, Floats | MeshCurve | SteSurface]:
        """Mesh stiffness of a law from the tables of the folder, read once."""
        if law not in self.stiffnesses:
            self.stiffnesses[law] = mesh_stiffness(self.gearbox, law, self.folder)
        return self.stiffnesses[law]

    def assembled(self, choice: Choice) -> Assembly:
        """Equations of a choice, with the tables of the folder, assembled once."""
        if choice not in self.assemblies:
            bodies = self.bodies_of(choice)(self.gearbox)
            self.assemblies[choice] = assemble(self.gearbox, choice, self.stiffness(choice.mesh_law), bodies)
        return self.assemblies[choice]

    def bodies_of(self, choice: Choice) -> Callable[[Gearbox], dict[str, ElasticBody]]:
        """Reduced elastic bodies of a gearbox, varied or not, as a choice has them."""
        if not choice.variant.is_elastic:
            return lambda gearbox: {}
        return lambda gearbox: reduced_bodies(gearbox, choice.inertia_set(gearbox), bodies_folder(self.folder))

    def name_of(self, path: Path) -> Path:
        """Path of a file as seen from the results folder."""
        return path.relative_to(self.folder)
