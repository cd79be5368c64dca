"""Solved angles of a static balance, kept until the life is there: what was stopped goes on with the same bits."""

from __future__ import annotations

from exugear.life.static_balance import States
from fe_ste.tools.display import Displayed
from fe_ste.tools.stores.store import Arrays, Store


class KeptAngles(Displayed):
    """Solved angles in one file, written anew with each.

    Parameters
    ----------
    store : of all that the life rests on

    Examples
    --------
    >>> from pathlib import Path
    >>> KeptAngles(Store(Path("nowhere/life.partial.npz"), key="this input"))
    <KeptAngles: 0 in nowhere/life.partial.npz>
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._angles = store.read(_unpacked) or {}

    def _line(self) -> str:
        return f": {len(self._angles)} in {self._store.path.as_posix()}"

    def stored(self, number: int) -> States | None:
        """States of an angle by its number, None where they are not there."""
        return self._angles.get(number)

    def store(self, number: int, states: States) -> None:
        """Keep the states of an angle."""
        self._angles[number] = states
        self._store.write(
            {f"{name}_{angle}": array for angle, kept in self._angles.items() for name, array in kept._asdict().items()}
        )


def _unpacked(arrays: Arrays) -> dict[int, States]:
    numbers = [int(name.removeprefix("force_")) for name in arrays if name.startswith("force_")]
    return {number: States(*(arrays[f"{name}_{number}"] for name in States._fields)) for number in numbers}
