"""Registry of all mesh models: names, one-line descriptions, and properties used by the rest of the program.

To add a model: a file of its name in this folder, with a `LAW`, and a row here. Only a model whose force is not a
stiffness over the mesh cycle times the deflection also needs a branch in `exugear.system.tooth_mesh.laws.mesh_forces`.
No large library is imported here, because the command line reads its choices from this table.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from exugear.system.tooth_mesh.element import Law


@dataclass(frozen=True)
class LawProperties:
    """What the program must know of a law before it computes with it."""

    name: str
    """As on the command line; the law's file has the same name."""
    description: str
    """One line for the command line and the page of choices."""
    has_force: bool = True
    """False for a kinematic constraint, without mesh forces."""
    needs_tables: bool = True
    """Whether it reads tables of the static transmission error."""
    needs_axes: bool = False
    """Whether these are to be tables over load, centre distance and misalignment."""
    loses_contact: bool = False
    """Whether teeth can lose contact and touch on the other flank."""
    signals_positions: bool = False
    """Whether a run records the positions of the gears of each mesh."""
    moves_load: bool = False
    """Whether the load shuttles over the mesh cycle as in the table."""
    has_line_loads: bool = False
    """Whether it knows the line loads over the mesh cycle, which friction of the teeth needs."""

    @property
    def uses_single_load(self) -> bool:
        """Whether it reads tables over the mesh cycle at the static load alone."""
        return self.needs_tables and not self.needs_axes


_TABLE_OF_LAWS = (
    LawProperties("kinematic", "kinematic constraint; variant `rigid` only", has_force=False, needs_tables=False),
    LawProperties("constant", "as `line_of_action`, with the mean of load over deflection (linear)"),
    LawProperties("iso6336", "as `constant`, stiffness to ISO 6336-1 method B", needs_tables=False),
    LawProperties(
        "tangential",
        "tangential model as published: deflection along the pitch circle, force with radial and axial components; "
        "not conservative",
    ),
    LawProperties(
        "line_of_action",
        "load over deflection over the mesh cycle from secant and tangent of the table, stiffness against "
        "misalignment; all motions along the line of action",
        moves_load=True,
        has_line_loads=True,
    ),
    LawProperties(
        "table",
        "the whole table: force by load, position, centre distance and misalignment; contact loss and contact on the "
        "opposite flank",
        needs_axes=True,
        loses_contact=True,
        signals_positions=True,
        moves_load=True,
    ),
)
LAWS = {law.name: law for law in _TABLE_OF_LAWS}
MESH_MODELS = tuple(LAWS)


def law_of(name: str) -> Law:
    """Load what a law with a force computes with.

    Raises
    ------
    MeshError
        No such law, or one without a force.

    Examples
    --------
    >>> law_of("constant").coefficients([3.0])
    array([[3., 0., 0., 0.]])
    """
    if name not in LAWS or not LAWS[name].has_force:
        from exugear.system.tooth_mesh.placement import MeshError

        known = ", ".join(law.name for law in LAWS.values() if law.has_force)
        raise MeshError(f"mesh model {name!r} has no force element; choose one of {known}")
    return cast("Law", import_module(f"{__package__}.{name}").LAW)
