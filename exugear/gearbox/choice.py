"""Model settings that a user chooses for a gearbox: variant, mesh model, inertia set, load case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import Variant


@dataclass(frozen=True, init=False)
class Choice:
    """Model settings of one computation; values of None are taken from the gearbox file.

    Raises
    ------
    VariantError
        No such variant exists.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> Choice("bushing").of(gearbox)
    Choice(variant='bushing', mesh_model='line_of_action', inertias='assemblies', load_case='reference')
    """

    variant: Variant
    """Variant, which defines how bodies are supported; selected by its name."""
    mesh_model: str
    """Name of the mesh model, which computes the mesh forces; `exugear.system.tooth_mesh.laws.registry` lists the
    models.
    """
    inertias: str | None
    load_case: str | None

    def __init__(
        self,
        variant: str = Variant.bushing,
        mesh_model: str = "line_of_action",
        inertias: str | None = None,
        load_case: str | None = None,
    ) -> None:
        """Look up the variant by its name and store the settings."""
        values = {
            "variant": Variant.of(variant),
            "mesh_model": mesh_model,
            "inertias": inertias,
            "load_case": load_case,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def of(self, gearbox: Gearbox) -> Choice:
        """Return the settings with open values filled in: default inertia set, first load case."""
        load_case = self.load_case or next(iter(gearbox.load_cases), None)
        return replace(self, inertias=self.inertia_set(gearbox), load_case=load_case)

    def inertia_set(self, gearbox: Gearbox) -> str:
        """Name of the chosen inertia set, or else of the default set of the gearbox file."""
        return self.inertias or gearbox.case.default_inertias


def choice_of(attributes: Mapping[str, Any]) -> Choice:
    """Return the model settings that a stored result was computed with, from its attributes, without load case."""
    return Choice(*(str(attributes[key]) for key in ("variant", "mesh_model", "inertias")))
