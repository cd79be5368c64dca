"""What a user chooses of a gearbox: variant, mesh law, inertia set, load case."""

from __future__ import annotations

from dataclasses import dataclass, replace

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.variant import Variant


@dataclass(frozen=True, init=False)
class Choice:
    """One way to compute a gearbox; what is None is chosen by the gearbox file.

    Raises
    ------
    VariantError
        No variant has this name.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> Choice("bushing").of(gearbox)
    Choice(variant='bushing', mesh_model='line_of_action', inertias='assemblies', load_case='reference')
    """

    variant: Variant
    """How bodies are held; chosen by its name."""
    mesh_model: str
    """How teeth in mesh push each other; `exugear.system.tooth_mesh.laws.registry` lists the laws."""
    inertias: str | None
    """Inertia set."""
    load_case: str | None
    """Load case of a run."""

    def __init__(
        self,
        variant: str = Variant.bushing,
        mesh_model: str = "line_of_action",
        inertias: str | None = None,
        load_case: str | None = None,
    ) -> None:
        """Take the variant by its name."""
        values = {
            "variant": Variant.of(variant),
            "mesh_model": mesh_model,
            "inertias": inertias,
            "load_case": load_case,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def of(self, gearbox: Gearbox) -> Choice:
        """Return the same choice with what it leaves open filled in: default inertia set, first load case."""
        load_case = self.load_case or next(iter(gearbox.load_cases), None)
        return replace(self, inertias=self.inertia_set(gearbox), load_case=load_case)

    def inertia_set(self, gearbox: Gearbox) -> str:
        """Name of the inertia set, the default one of the gearbox file if none was chosen."""
        return self.inertias or gearbox.case.default_inertias
