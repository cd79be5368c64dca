"""Solved angles of a static balance, kept until the life is there: what was stopped goes on with the same bits."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from exugear.life.static_balance import States
from fe_ste.tools.display import Displayed
from fe_ste.tools.files import FileError
from fe_ste.tools.sealed import read_sealed, write_sealed


class KeptAngles(Displayed):
    """Solved angles in one sealed file, written anew with each.

    Parameters
    ----------
    path : Path
    input_hash : str
        Of all that the life rests on; angles of another input are not taken.

    Examples
    --------
    >>> KeptAngles(Path("nowhere/life.partial.npz"), "")
    <KeptAngles: 0 in nowhere/life.partial.npz>
    """

    def __init__(self, path: Path, input_hash: str) -> None:
        self._path, self._hash = path, input_hash
        self._angles = _read(path, input_hash)

    def _line(self) -> str:
        return f": {len(self._angles)} in {self._path.as_posix()}"

    def stored(self, number: int) -> States | None:
        """States of an angle by its number, None where they are not there."""
        return self._angles.get(number)

    def store(self, number: int, states: States) -> None:
        """Keep the states of an angle."""
        self._angles[number] = states
        arrays = {
            f"{name}_{place}": part
            for place, one in self._angles.items()
            for name, part in zip(States._fields, one, strict=True)
        }
        content = io.BytesIO()
        np.savez(content, allow_pickle=False, input_hash=np.array(self._hash), **arrays)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        write_sealed(self._path, content.getbuffer())

    def discard(self) -> None:
        """Remove the file: the life is written."""
        self._path.unlink(missing_ok=True)


def _read(path: Path, input_hash: str) -> dict[int, States]:
    """Angles of a file that belong to this input; none of a file that is missing, damaged, or of another one."""
    try:
        with np.load(io.BytesIO(read_sealed(path)), allow_pickle=False) as data:
            if str(data["input_hash"]) != input_hash:
                return {}
            numbers = [int(name.removeprefix("force_")) for name in data.files if name.startswith("force_")]
            return {number: States(*(data[f"{name}_{number}"] for name in States._fields)) for number in numbers}
    except (FileError, KeyError, ValueError):
        return {}
