"""Flanks computed once: both flanks of a gear from one, kept in memory and in files for the next process.

The key is a hash of all that its numbers follow from: the gear but for its name, the mesh, and the sources of the
method.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fe_ste.elasticity.flank import TOOTH_REACH, FlankCompliance, flank_compliance
from fe_ste.elasticity.hexmesh import MeshSettings
from fe_ste.geometry.gears import Gear
from fe_ste.tools.stores.cache import Cache
from fe_ste.tools.stores.store import Arrays
from fe_ste.tools.threads import one_dense_thread, side_by_side

#: Rooms whose sources make the numbers.
_ROOMS = ("tools", "geometry", "elimination", "elasticity")

#: Of the default mesh each takes 5 MB.
_flanks = Cache[FlankCompliance]("flank", in_memory=16, in_files=300_000_000)


def known_flanks(
    wanted: Sequence[tuple[Gear, int]],
    settings: MeshSettings | None = None,
    *,
    open_teeth: int | None = None,
    tooth_reach: int = TOOTH_REACH,
    incompatible_modes: bool = True,
) -> list[FlankCompliance]:
    """Return flanks as `fe_ste.elasticity.flank.flank_compliance` does, each gear computed at most once.

    Files are kept in the folder ``flanks`` of exugear's user cache, those used least lately removed, or in the folder
    that ``EXUGEAR_FLANKS`` names; ``EXUGEAR_FLANKS=off`` neither reads nor writes any. Gears that have to be computed
    are so two at a time.

    Parameters
    ----------
    wanted : gears and sides: +1 counter-clockwise, -1 clockwise
    incompatible_modes : as in `fe_ste.elasticity.flank.flank_compliance`, all three

    Raises
    ------
    ValueError
        As in `fe_ste.elasticity.flank.flank_compliance`.
    """
    options: dict[str, Any] = {
        "open_teeth": open_teeth,
        "tooth_reach": tooth_reach,
        "incompatible_modes": incompatible_modes,
    }
    settings = settings or MeshSettings()
    keys = [_key(gear, settings, options) for gear, _ in wanted]
    gears: dict[str, Gear] = {}
    for key, (gear, _) in zip(keys, wanted, strict=True):
        gears.setdefault(key, gear)

    stored = {key: _flanks.get(key, functools.partial(_unpacked, gear)) for key, gear in gears.items()}
    flanks = {key: flank for key, flank in stored.items() if flank is not None}
    missing = [key for key in gears if key not in flanks]
    with one_dense_thread():
        computed = side_by_side(lambda key: flank_compliance(gears[key], 1, settings, **options), missing)
    for key, flank in zip(missing, computed, strict=True):
        flanks[key] = flank
        _flanks.keep(key, flank, _packed(flank))
    return [
        dataclasses.replace(flanks[key] if side > 0 else flanks[key].turned(), gear=gear)
        for key, (gear, side) in zip(keys, wanted, strict=True)
    ]


def forget_flanks() -> None:
    """Drop all flanks from memory."""
    _flanks.forget()


def _key(gear: Gear, settings: MeshSettings, options: dict[str, Any]) -> str:
    known_by = dataclasses.asdict(gear)
    del known_by["name"]
    given = {"gear": known_by, "mesh": dataclasses.asdict(settings), "options": options, "method": _method()}
    return hashlib.sha256(json.dumps(given, sort_keys=True).encode()).hexdigest()


@functools.cache
def _method() -> str:
    """Digest of the sources that make the numbers: no version has to be kept in mind."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[1]
    for source in sorted(file for room in _ROOMS for file in (package / room).rglob("*.py")):
        content = source.read_bytes()
        digest.update(f"{source.relative_to(package)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _unpacked(gear: Gear, arrays: Arrays) -> FlankCompliance:
    """Flank of a gear from what `_packed` made of it."""
    values: dict[str, Any] = json.loads(str(arrays.pop("values")))
    names = [tuple(name) for name in values.pop("regular")]
    values["regular"] = dict(zip(names, arrays.pop("regular"), strict=True))
    return FlankCompliance(gear=gear, **values | arrays)


def _packed(flank: FlankCompliance) -> dict[str, Any]:
    """Arrays of a flank, and what is none as one text; without its gear."""
    values: dict[str, Any] = {"regular": list(flank.regular)}
    arrays: dict[str, Any] = {"regular": np.stack(list(flank.regular.values()))}
    for field in dataclasses.fields(flank):
        value = getattr(flank, field.name)
        if isinstance(value, np.ndarray):
            arrays[field.name] = value
        elif field.name not in ("gear", "regular"):
            values[field.name] = value
    return {"values": np.array(json.dumps(values)), **arrays}
