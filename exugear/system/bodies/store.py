"""Reductions of elastic bodies, stored in files by the hash of their input."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.system.bodies.reduced_body import ReducedBody, ReductionSummary, Seat, Surface
from fe_ste.tools.stores.store import Store


def load_or_reduce(path: Path, key: str, reduce: Callable[[], ReducedBody]) -> ReducedBody:
    """Body from a file, or reduced and stored there if the file is missing, damaged or of another key.

    Parameters
    ----------
    key : hash of all that the reduction depends on
    reduce : called only where the file does not serve
    """
    store = Store(path, key)
    body = store.read(_from_arrays)
    if body is None:
        body = reduce()
        store.write(_arrays_of(body), compressed=True)
    return body


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
        "seats": [[seat.name, seat.position] for seat in body.seats],
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
        seats=tuple(Seat(name, (x, y, z)) for name, (x, y, z) in words["seats"]),
        **{name: arrays[name] for name in _MATRICES},
        frame=words["frame"],
        modal_groups=tuple(words["groups"]),
        surface=Surface(**{name: arrays[name] for name in _SURFACE}),
        summary=ReductionSummary(**summary),
    )
