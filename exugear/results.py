"""The results folder: the case it belongs to, whether a file fits that case, and where the time went."""

from __future__ import annotations

import hashlib
import json
import math
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exugear.assembly import Assembly
from exugear.casefile import read_text
from exugear.gearbox import CaseError, Gearbox
from fe_ste.interpolation import SteSurface

CASE_FILE = "case.json"
TIMES_FILE = "times.jsonl"
REPORT_FILE = "report.html"


def input_hash(assembly: Assembly, load_case: str | None = None) -> str:
    """SHA-256 of all that the equations of a variant depend on: gearbox file with its solids, choices, mesh stiffness.

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
        "gearbox": gearbox.content,
        "variant": assembly.variant,
        "law": assembly.law,
        "inertias": assembly.inertias,
        "load_case": load_case,
        "torque_series": hashlib.sha256(series.read_bytes()).hexdigest() if series else None,
        "solids": {
            name: hashlib.sha256((Path(gearbox.source).parent / solid.file).read_bytes()).hexdigest()
            for name in assembly.elastic_bodies
            if (solid := gearbox.case.bodies[name].solid) is not None
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
    content = {"source": str(Path(gearbox.source).resolve()), "content": gearbox.content}
    _replace(folder / CASE_FILE, json.dumps(content, indent=1))


def kept_case(folder: Path) -> Gearbox:
    """Read the gearbox that the results of a folder belong to.

    Raises
    ------
    CaseError
        The folder holds no results, or what it says of its case cannot be used.
    """
    path = folder / CASE_FILE
    if not path.is_file():
        raise CaseError(f"{folder}: holds no results (no {CASE_FILE}); name the folder that `exugear run` wrote into")
    try:
        text = path.read_text(encoding="utf-8")
        kept = read_text(lambda: json.loads(text), str(path), "JSON")
        return Gearbox.from_dict(kept["content"], kept["source"])
    except (ValueError, KeyError, TypeError) as error:
        raise CaseError(f"{path}: cannot be used ({error}); run `exugear modes` into this folder again") from error


def _replace(path: Path, text: str) -> None:
    """Write a file so that others see the old one or the new one; two processes may do so at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        file.write(text)
    Path(temporary).chmod(0o644)
    os.replace(temporary, path)


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
    line = json.dumps(asdict(Spent(step, round(seconds, 2), peak_memory()))) + "\n"
    with (folder / TIMES_FILE).open("a", encoding="utf-8") as file:
        file.write(line)


def times_spent(folder: Path) -> tuple[Spent, ...]:
    """Last account of each step, in the order in which the steps were last done."""
    last: dict[str, Spent] = {}
    for entry in _lines(folder / TIMES_FILE):
        last.pop(entry.step, None)
        last[entry.step] = entry
    return tuple(last.values())


def _lines(path: Path) -> Iterator[Spent]:
    if not path.is_file():
        return
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            values: dict[str, Any] = json.loads(line)
            yield Spent(str(values["step"]), float(values["seconds"]), float(values["memory"]))
        except (ValueError, KeyError, TypeError):
            continue  # a line cut short by a kill says nothing
