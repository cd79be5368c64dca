"""Reductions of elastic bodies, kept in files by the hash of their input."""

from __future__ import annotations

import io
import json
import logging
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.bodies.reduced_body import Figures, ReducedBody, Seat, Surface
from fe_ste.tools.files import FileError
from fe_ste.tools.sealed import read_sealed, write_sealed

_log = logging.getLogger(__name__)


def kept(path: Path, key: str, reduce: Callable[[], ReducedBody]) -> ReducedBody:
    """Body from a file, or reduced and kept there if the file is missing, damaged or of another key."""
    arrays = kept_arrays(path, key)
    if arrays is not None:
        return _from_arrays(arrays)
    body = reduce()
    keep_arrays(path, key, _arrays_of(body))
    return body


def keep_arrays(path: Path, key: str, arrays: Mapping[str, Any]) -> None:
    """Write arrays into a sealed file of a key."""
    content = io.BytesIO()
    np.savez_compressed(content, key=np.array(key), **arrays)
    write_sealed(path, content.getvalue())


def kept_arrays(path: Path, key: str) -> dict[str, NDArray[Any]] | None:
    """Read what `keep_arrays` wrote; nothing if the file is missing, damaged or of another key."""
    if not path.exists():
        return None
    try:
        with np.load(io.BytesIO(read_sealed(path)), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (FileError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        _log.warning("%s; the body is reduced again", error)
        return None
    return arrays if str(arrays.pop("key", "")) == key else None


_MATRICES = ("mass", "stiffness", "gyroscopic", "spin")
_SURFACE = ("points", "quads", "displacement", "strain", "elasticity")


def _arrays_of(body: ReducedBody) -> dict[str, NDArray[Any]]:
    words = {
        "name": body.name,
        "seats": [[seat.name, seat.place] for seat in body.seats],
        "frame": body.frame,
        "groups": body.groups,
        "figures": asdict(body.figures),
    }
    arrays = {name: getattr(body, name) for name in _MATRICES}
    arrays |= {name: getattr(body.surface, name) for name in _SURFACE}
    return {"words": np.array(json.dumps(words)), **arrays}


def _from_arrays(arrays: Mapping[str, NDArray[Any]]) -> ReducedBody:
    words = json.loads(str(arrays["words"]))
    figures = words["figures"]
    for key in ("free_frequencies", "lowered"):
        figures[key] = {motion: tuple(values) for motion, values in figures[key].items()}
    return ReducedBody(
        name=words["name"],
        seats=tuple(Seat(name, (place[0], place[1], place[2])) for name, place in words["seats"]),
        **{name: arrays[name] for name in _MATRICES},
        frame=words["frame"],
        groups=tuple(words["groups"]),
        surface=Surface(**{name: arrays[name] for name in _SURFACE}),
        figures=Figures(**figures),
    )
