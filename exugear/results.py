"""The results folder: the case it belongs to, whether a file fits that case, and where the time went."""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exugear.assembly import Assembly
from exugear.casefile import parsed
from exugear.elastic_bodies import solid_body
from exugear.gearbox import CaseError, Gearbox
from exugear.named_files import NOTHING_MORE, Permissions
from exugear.versions import MODES, REDUCTION, RUN
from fe_ste.files import FileError, append_line, read_text, write_file
from fe_ste.interpolation import SteSurface

CASE_FILE = "case.json"
TIMES_FILE = "times.jsonl"
REPORT_FILE = "report.html"


def input_hash(assembly: Assembly, load_case: str | None = None) -> str:
    """SHA-256 of all that the equations of a variant depend on: gearbox file with its solids, choices, mesh stiffness.

    The versions of the methods are part of it.

    Parameters
    ----------
    assembly : Assembly
    load_case : str, optional
        For a run: its load case, with the content of its torque series.

    Examples
    --------
    >>> from exugear.assembly import assemble
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> softer = gearbox.varied({"housing.factor": 0.2})
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> input_hash(assemble(gearbox, "bushing", stiffness)) == input_hash(assemble(softer, "bushing", stiffness))
    False
    """
    gearbox = assembly.gearbox
    series = gearbox.load_cases[load_case].torque_series if load_case else None
    content = {
        "method_version": RUN if load_case else MODES,
        "reduction_version": REDUCTION if assembly.elastic_bodies else None,
        "gearbox": gearbox.content,
        "variant": assembly.variant,
        "law": assembly.law,
        "inertias": assembly.inertias,
        "load_case": load_case,
        "torque_series": hashlib.sha256(series.read_bytes()).hexdigest() if series else None,
        "solids": {
            name: hashlib.sha256(solid_body(gearbox, name).model.mesh.path.read_bytes()).hexdigest()
            for name in assembly.elastic_bodies
            if gearbox.case.bodies[name].solid is not None
        },
        # Rounded: another machine's last digits must not make another hash.
        "stiffness": {
            element.mesh.name: [f"{value:.9g}" for value in np.atleast_1d(element.stiffness)]
            for element in assembly.elements
        },
        "tables": {
            element.mesh.name: _digest(element.table.surface)
            for element in assembly.elements
            if element.table is not None
        },
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _digest(surface: SteSurface) -> str:
    """Hash of a table's surface, rounded likewise."""
    arrays = (surface.centre_distance, surface.misalignment, surface.root_force, surface.coefficients)
    text = ",".join(f"{value:.9g}" for values in arrays for value in values.ravel())
    return hashlib.sha256(text.encode()).hexdigest()


def keep_case(gearbox: Gearbox, folder: Path) -> None:
    """Write the content of the gearbox file into the results folder, so that a report needs nothing else."""
    kept = {"source": str(Path(gearbox.source).resolve()), "content": gearbox.content}
    write_file(folder / CASE_FILE, json.dumps({**kept, "checksum": _checksum(kept)}, indent=1).encode("utf-8"))


def _checksum(kept: dict[str, Any]) -> str:
    """Checksum of a case as it is kept, however it is set out."""
    text = json.dumps([kept["source"], kept["content"]], sort_keys=True)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def kept_case(folder: Path, permissions: Permissions = NOTHING_MORE) -> Gearbox:
    """Read the gearbox that the results of a folder belong to.

    Parameters
    ----------
    folder : Path
    permissions : Permissions
        Where else files that the gearbox file names may lie.

    Raises
    ------
    CaseError
        The folder holds no results, or what it says of its case cannot be used.
    """
    path = folder / CASE_FILE
    if not path.is_file():
        raise CaseError(f"{folder}: holds no results (no {CASE_FILE}); name the folder that `exugear run` wrote into")
    try:
        kept = parsed(lambda: json.loads(read_text(path)), str(path), "JSON")
        if not isinstance(kept, dict):
            raise ValueError("it holds no case")
        if "checksum" not in kept:
            raise ValueError("it was written by an earlier version")
        if kept["checksum"] != _checksum(kept):
            raise ValueError("it was changed since it was written")
        content, source = kept["content"], kept["source"]
    # Whoever makes up a file with its checksum may write into it what he likes.
    except (FileError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise CaseError(f"{path}: cannot be used ({error}); run `exugear modes` into this folder again") from error
    return Gearbox.from_dict(content, source, permissions)


def modes_path(folder: str | Path, variant: str, law: str, inertias: str) -> Path:
    """Place of the modes of a variant: ``<variant>/<law>-<inertias>/modes.nc``."""
    return Path(folder) / variant / f"{law}-{inertias}" / "modes.nc"


def bodies_folder(folder: Path) -> Path:
    """Place of the reductions of elastic bodies: ``bodies``."""
    return folder / "bodies"


@dataclass(frozen=True)
class Spent:
    """What a step of the work took.

    Attributes
    ----------
    step : what was done
    seconds : wall time
    memory : peak of the process's memory, bytes
    """

    step: str
    seconds: float
    memory: float


def peak_memory() -> float:
    """Highest memory of this process so far, bytes; NaN on Windows."""
    if sys.platform == "win32":
        return math.nan  # no such account without a further library
    import resource

    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak if sys.platform == "darwin" else 1024.0 * peak  # Linux counts in KiB


def note_time(folder: Path, step: str, seconds: float) -> None:
    """Add a line to the folder's account of time; processes may do so at once."""
    append_line(folder / TIMES_FILE, json.dumps(asdict(Spent(step, round(seconds, 2), peak_memory()))))


def times_spent(folder: Path) -> tuple[Spent, ...]:
    """Last account of each step, in the order in which the steps were last done."""
    last: dict[str, Spent] = {}
    for entry in _lines(folder / TIMES_FILE):
        last.pop(entry.step, None)
        last[entry.step] = entry
    return tuple(last.values())


def _lines(path: Path) -> Iterator[Spent]:
    try:
        lines = read_text(path).splitlines()
    except FileError:
        return  # an account that is missing or is none
    for line in lines:
        try:
            values: dict[str, Any] = json.loads(line)
            spent = Spent(str(values["step"]), float(values["seconds"]), float(values["memory"]))
        except (ValueError, KeyError, TypeError, RecursionError, OverflowError):
            continue  # a line cut short by a kill says nothing
        if math.isfinite(spent.seconds):
            yield spent
