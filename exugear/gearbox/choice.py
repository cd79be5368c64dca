"""What a user chooses of a gearbox: variant, mesh law, inertia set, load case."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

from exugear.gearbox.gearbox import Gearbox

Variant = Literal["rigid", "bushing", "flexible", "jointed"]
VARIANTS: tuple[str, ...] = get_args(Variant)
"""How bodies are held: on ideal joints in minimal coordinates, on bearings, on these with elastic bodies, on joints."""
USER_VARIANTS = ("rigid", "bushing", "flexible")
"""Those that the command line offers; `jointed` is what `rigid` is checked against."""


@dataclass(frozen=True)
class Choice:
    """One way to compute a gearbox; what is None is chosen by the gearbox file.

    Attributes
    ----------
    variant : {"rigid", "bushing", "flexible", "jointed"}
        How bodies are held.
    mesh_law : str
        How teeth in mesh push each other; `exugear.tooth_mesh.laws.registry` lists the laws.
    inertias : str, optional
        Inertia set.
    load_case : str, optional
        Load case of a run.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> Choice("bushing").of(gearbox)
    Choice(variant='bushing', mesh_law='line_of_action', inertias='assemblies', load_case='reference')
    """

    variant: str = "bushing"
    mesh_law: str = "line_of_action"
    inertias: str | None = None
    load_case: str | None = None

    def of(self, gearbox: Gearbox) -> Choice:
        """Return the same choice with what it leaves open filled in: default inertia set, first load case."""
        load_case = self.load_case or next(iter(gearbox.load_cases), None)
        return replace(self, inertias=self.inertia_set(gearbox), load_case=load_case)

    def inertia_set(self, gearbox: Gearbox) -> str:
        """Name of the inertia set, the default one of the gearbox file if none was chosen."""
        return self.inertias or gearbox.case.default_inertias
