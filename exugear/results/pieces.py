"""A run in progress, or one that was stopped: a folder of pieces, each with the state to go on from.

The pieces ``000001.npz``, ``000002.npz``, ... hold a stretch of time each. A piece is written whole or not at all and
names the checksum of the one before it, so that pieces of different runs never mix and a kill costs one piece at most.
They are no netCDF, because making some 30 variables anew takes 60 ms, and a piece is due after 100 ms of a fast run.
"""

from __future__ import annotations

import itertools
import json
import logging
import os
import re
import zipfile
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.results.variables import GROWING, VARIABLES
from exugear.system.signals import BALANCE_TERMS, MESH_TIMES, SignalLayout
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import FileError
from fe_ste.tools.sealed import open_sealed, write_arrays

_PIECE_NAME = re.compile(r"\d{6}\.npz")
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Checkpoint:
    """State from which a run goes on."""

    step: int
    """Number of the step that led to it."""
    q: Floats
    v: Floats
    """(size,) coordinates and velocities."""
    past: Floats
    """(n, size) accelerations at the last steps, the latest last, as far as a method of integration goes back."""
    pending: Floats
    """(n, columns) samples that the filter still holds."""
    pending_first: int
    """Number of the first of them."""
    balance: Floats
    """(terms,) account of energy, J, as in `exugear.system.signals.BALANCE_TERMS`."""
    powers: Floats
    """(powers,) powers, W, as in `exugear.system.signals.POWERS`."""
    start_angle: float
    """Angle that a drive started ahead by, rad."""
    mesh_times: Floats
    """(times, meshes) s, as in `exugear.system.signals.MESH_TIMES`."""
    judgement: Floats
    """Running figures of an `exugear.transient.trust.Judge`."""


@dataclass(frozen=True)
class Piece:
    """A stretch of a run."""

    arrays: Mapping[str, NDArray[Any]]
    """Variables by name, see `exugear.results.variables.VARIABLES`."""
    attributes: Mapping[str, Any]
    """Of the run, and of the state at the end of the piece."""
    names: Mapping[str, list[str]]
    """Of meshes and supports."""
    follows: str
    """Checksum of the piece before, empty for the first."""

    def write(self, path: Path) -> str:
        """Write it whole or not at all; return its checksum."""
        words = {"attributes": self.attributes, "names": self.names, "follows": self.follows}
        return write_arrays(path, {"words": np.array(json.dumps(words)), **self.arrays})

    @classmethod
    def read(cls, path: Path, names: Collection[str] | None = None) -> tuple[Piece, str]:
        """Read it, or only the arrays of these names, and its checksum.

        Raises
        ------
        FileError
            It is missing, damaged, or no piece of a run.
        """
        with open_sealed(path) as (file, checksum):
            try:
                with np.load(file, allow_pickle=False) as stored:
                    words = json.loads(str(stored["words"]))
                    held = [name for name in stored.files if name != "words"]
                    arrays = {name: stored[name] for name in held if names is None or name in names}
                return cls(arrays, words["attributes"], words["names"], words["follows"]), checksum
            except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
                raise FileError(f"{path}: is no piece of a run ({error})") from error


class RunPieces:
    """Writer of one run, piece by piece; no file is open between writes.

    Parameters
    ----------
    folder : where the pieces lie
    attributes
        What is run: begins anew with these attributes. Without them the pieces that are there are gone on with.

    Attributes
    ----------
    paths : files of the pieces
    lengths : length of each dimension in `exugear.results.variables.GROWING` and of what the filter holds, so far
    attributes : of the whole run

    Raises
    ------
    FileError
        There is nothing to go on with, or the folder is a link.
    """

    def __init__(self, folder: Path, layout: SignalLayout, attributes: Mapping[str, Any] | None = None) -> None:
        self.folder = folder
        self.paths: list[Path] = []
        self.lengths: dict[str, int] = dict.fromkeys(GROWING, 0)
        self._layout = layout
        self._checksum = ""
        if attributes is not None:
            discard_pieces(folder)
            self.attributes = dict(attributes)
            return
        for path, piece, checksum in whole_pieces(folder):
            self._count(path, piece, checksum)
        if not self.paths:
            raise FileError(f"{folder}: holds nothing to resume; run without resuming first")
        discard_pieces(folder, keep=self.paths)
        self.attributes = dict(piece.attributes)

    def _count(self, path: Path, piece: Piece, checksum: str) -> None:
        """Count a piece that is on the disk."""
        self.paths.append(path)
        self._checksum = checksum
        self.lengths = {name: self.lengths[name] + len(piece.arrays[name]) for name in GROWING}
        self.lengths["pending"] = len(piece.arrays["state_pending"])

    def append(self, times: Floats, rows: Floats, balance_times: Floats, balances: Floats, state: Checkpoint) -> Piece:
        """Write a piece and return it.

        Parameters
        ----------
        times, rows : (n,) (n, columns) decimated samples, s and as the layout says
        balance_times, balances : (k,) (k, terms) lines of the account of energy, s and J
        state : state to go on from
        """
        self.attributes |= {
            "state_step": state.step,
            "state_pending_first": state.pending_first,
            "start_angle": state.start_angle,
        }
        values = {
            **self._layout.stored_values(times, rows),
            "balance_time": balance_times,
            **dict(zip(BALANCE_TERMS, balances.T, strict=True)),
            **dict(zip(MESH_TIMES, state.mesh_times, strict=True)),
            "state_q": state.q,
            "state_v": state.v,
            "state_past": state.past,
            "state_balance": state.balance,
            "state_powers": state.powers,
            "state_judgement": state.judgement,
            "state_pending": state.pending,
        }
        with np.errstate(over="ignore"):  # a run that diverges
            arrays = {name: np.ascontiguousarray(value, VARIABLES[name].kind) for name, value in values.items()}
        names = {dimension: list(entries) for dimension, entries in self._layout.names.items()}
        piece = Piece(arrays, self.attributes, names, self._checksum)
        path = _piece_path(self.folder, len(self.paths) + 1)
        self._count(path, piece, piece.write(path))
        return piece

    def last_checkpoint(self) -> Checkpoint:
        """Read the state that the last piece was left with."""
        last, _ = Piece.read(self.paths[-1])
        arrays = last.arrays
        attributes = last.attributes
        return Checkpoint(
            step=int(attributes["state_step"]),
            q=arrays["state_q"],
            v=arrays["state_v"],
            past=arrays["state_past"],
            pending=arrays["state_pending"],
            pending_first=int(attributes["state_pending_first"]),
            balance=arrays["state_balance"],
            powers=arrays["state_powers"],
            start_angle=float(attributes["start_angle"]),
            mesh_times=np.array([arrays[name] for name in MESH_TIMES]),
            judgement=arrays["state_judgement"],
        )

    def note(self, key: str, value: Any) -> None:
        """Add an attribute to the pieces that follow and to the whole run."""
        self.attributes[key] = value

    def mark(self) -> None:
        """Write a piece without samples: it keeps what was noted since the last one."""
        nothing = np.zeros(0)
        rows = np.zeros((0, self._layout.count))
        lines = np.zeros((0, len(BALANCE_TERMS)))
        self.append(nothing, rows, nothing, lines, self.last_checkpoint())


def _piece_path(folder: Path, number: int) -> Path:
    return folder / f"{number:06d}.npz"


def whole_pieces(folder: Path) -> Iterator[tuple[Path, Piece, str]]:
    """Pieces from the first on with their checksums, as far as each is whole and follows the one before."""
    last = ""
    for number in itertools.count(1):
        path = _piece_path(folder, number)
        if not path.exists():
            return
        try:
            piece, checksum = Piece.read(path)
        except FileError as error:
            _log.warning("%s; the run goes on from before it", error)
            return
        if piece.follows != last:
            return  # of a run before: a kill fell between beginning anew and removing it
        yield path, piece, checksum
        last = checksum


def has_pieces(folder: Path) -> bool:
    """Tell whether a folder holds a run to go on with."""
    return _piece_path(folder, 1).is_file()


def discard_pieces(folder: Path, keep: Iterable[Path] = ()) -> None:
    """Remove the pieces of a run, the last first, and what a kill left unfinished; nothing else.

    Raises
    ------
    FileError
        The folder is a link: what it leads to may be anybody's.
    """
    if folder.is_symlink():
        raise FileError(f"{folder}: is a link; remove it, unfinished runs are kept in a folder of this name")
    if not folder.is_dir():
        return
    kept = {path.name for path in keep}
    for name in sorted(os.listdir(folder), reverse=True):
        if name not in kept and (_PIECE_NAME.fullmatch(name) or name.endswith(".partial")):
            os.unlink(folder / name)
    if not kept:
        with suppress(OSError):  # somebody keeps a file of his own there
            os.rmdir(folder)
