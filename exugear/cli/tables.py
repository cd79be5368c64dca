"""What is said of tables of transmission error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from exugear.cli.console import note
from exugear.cli.errors import FailedError

if TYPE_CHECKING:
    from fe_ste.transmission_error.table import MeshTable


def tell_of_tables(tables: Mapping[str, MeshTable]) -> list[str]:
    """Say what is missing or cut off in tables; return why they are not to be trusted, nothing if they are."""
    from exugear.system.tooth_mesh.table_remarks import doubts_about_table, remarks_about_table

    for name, table in tables.items():
        for remark in remarks_about_table(name, table):
            note(remark, style="yellow")
    return [doubt for name, table in tables.items() for doubt in doubts_about_table(name, table)]


def refuse_unsolved(meshes: Sequence[str]) -> None:
    """End with code 1 where meshes read their tables beside states that are not solved."""
    if meshes:
        raise FailedError(
            f"not to be trusted: at the static load {', '.join(meshes)} come beside states of their tables that are "
            "not solved, where others stand in; exugear ste says which states these are and why"
        )
