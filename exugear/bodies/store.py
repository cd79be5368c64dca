"""Reductions of elastic bodies, stored in files by the hash of their input."""

from __future__ import annotations

import io
import json
import logging
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.bodies.reduced_body import ReducedBody, ReductionSummary, Seat, Surface
from fe_ste.tools.files import FileError
from fe_ste.tools.sealed import read_sealed, write_sealed

_log = logging.getLogger(__name__)


def load_or_reduce(path: Path, key: str, reduce: Callable[[], ReducedBody]) -> ReducedBody:
    """Body from a file, or reduced and stored there if the file is missing, damaged or of another key.

    Parameters
    ----------
    path : Path
    key : str
        Hash of all that the reduction depends on.
    reduce : callable
        Called only where the file does not serve.
    """
    arrays = stored_arrays(path, key)
    if arrays is not None:
        return _from_arrays(arrays)
    body = reduce()
    store_arrays(path, key, _arrays_of(body))
    return body


def store_arrays(path: Path, key: str, arrays: Mapping[str, Any]) -> None:
    """Write arrays into a sealed file of a key."""
    content = io.BytesIO()
    np.savez_compressed(content, key=np.array(key), **arrays)
    write_sealed(path, content.getvalue())


def stored_arrays(path: Path, key: str) -> dict[str, NDArray[Any]] | None:
    """Read what `store_arrays` wrote; nothing if the file is missing, damaged or of another key."""
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
_SUMMARY = {
    "unknowns": "unknowns",
    "seconds": "seconds",
    "free_frequencies": "free_interface_frequencies",
    "lowered": "mass_scaled_frequencies",
}
"""Names in files, which stay so that old files are found again, and in `ReductionSummary`."""


def _arrays_of(body: ReducedBody) -> dict[str, NDArray[Any]]:
    words = {
        "name": body.name,
        "seats": [[seat.name, seat.place] for seat in body.seats],
        "frame": body.frame,
        "groups": body.modal_groups,
        "figures": {stored: getattr(body.summary, name) for stored, name in _SUMMARY.items()},
    }
    arrays = {name: getattr(body, name) for name in _MATRICES}
    arrays |= {name: getattr(body.surface, name) for name in _SURFACE}
    return {"words": np.array(json.dumps(words)), **arrays}


def _from_arrays(arrays: Mapping[str, NDArray[Any]]) -> ReducedBody:
    words = json.loads(str(arrays["words"]))
    summary = {name: words["figures"][stored] for stored, name in _SUMMARY.items()}
    for name in ("free_interface_frequencies", "mass_scaled_frequencies"):
        summary[name] = {harmonic: tuple(values) for harmonic, values in summary[name].items()}
    return ReducedBody(
        name=words["name"],
        seats=tuple(Seat(name, (place[0], place[1], place[2])) for name, place in words["seats"]),
        **{name: arrays[name] for name in _MATRICES},
        frame=words["frame"],
        modal_groups=tuple(words["groups"]),
        surface=Surface(**{name: arrays[name] for name in _SURFACE}),
        summary=ReductionSummary(**summary),
    )
