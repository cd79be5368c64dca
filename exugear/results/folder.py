"""The results folder: its case, whether a file fits it, its studies, what its bearings and meshes bear."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.named_files import NOTHING_MORE, Permissions
from exugear.gearbox.reading import GearboxFileError, parsed
from exugear.gearbox.versions import MODES, STUDY
from exugear.system.bearings.duty import BearingLoadState
from exugear.system.tooth_mesh.contact_state import MeshLoadState
from fe_ste.tools.files import FileError, append_line, read_text, write_file
from fe_ste.tools.stores import Layout, open_dataset

# The results folder: the case it belongs to, whether a file fits that case, and where the time went

CASE_FILE = "case.json"
TIMES_FILE = "times.jsonl"
REPORT_FILE = "report.html"
_log = logging.getLogger(__name__)


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
    permissions : where else files that the gearbox file names may lie

    Raises
    ------
    GearboxFileError
        The folder holds no results, or what it says of its case cannot be used.
    """
    path = folder / CASE_FILE
    if not path.is_file():
        raise GearboxFileError(
            f"{folder}: contains no results (no {CASE_FILE}); specify the results folder of `exugear run`"
        )
    try:
        kept = parsed(lambda: json.loads(read_text(path)), str(path), "JSON")
        if not isinstance(kept, dict):
            raise ValueError("it contains no gearbox file")
        if "checksum" not in kept:
            raise ValueError("it was written by an earlier version")
        if kept["checksum"] != _checksum(kept):
            raise ValueError("it was changed since it was written")
        content = kept["content"]
        source = kept["source"]
    # Whoever makes up a file with its checksum may write into it what he likes.
    except (FileError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise GearboxFileError(
            f"{path}: cannot be used ({error}); run `exugear modes` into this folder again"
        ) from error
    return Gearbox.from_dict(content, source, permissions)


def modes_path(folder: str | Path, choice: Choice) -> Path:
    """Place of the modes of a choice that names its inertia set: ``<variant>/<law>-<inertias>/modes.nc``."""
    return Path(folder) / choice.variant / f"{choice.mesh_model}-{choice.inertias}" / "modes.nc"


def bearings_path(folder: str | Path, choice: Choice) -> Path:
    """Place of what the bearings of a choice bear: beside its modes."""
    return modes_path(folder, choice).with_name("bearings.json")


def bodies_folder(folder: Path) -> Path:
    """Place of the reductions of elastic bodies: ``bodies``."""
    return folder / "bodies"


@dataclass(frozen=True)
class StepTiming:
    """What a step of the work took."""

    step: str
    """What was done."""
    seconds: float
    """Wall time."""
    memory: float
    """Peak of the process's memory, bytes."""


def peak_memory() -> float:
    """Highest memory of this process so far, bytes; NaN on Windows."""
    if sys.platform == "win32":
        return math.nan  # no such account without a further library
    import resource

    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak if sys.platform == "darwin" else 1024.0 * peak  # Linux counts in KiB


def note_time(folder: Path, step: str, seconds: float) -> None:
    """Add a line to the folder's account of time; processes may do so at once."""
    append_line(folder / TIMES_FILE, json.dumps(asdict(StepTiming(step, round(seconds, 2), peak_memory()))))


@contextmanager
def time_noted(folder: Path, step: str) -> Iterator[None]:
    """Note how long a step took, if it ended well; a folder that cannot be written then costs the note alone."""
    start = time.perf_counter()
    yield
    try:
        note_time(folder, step, time.perf_counter() - start)
    except OSError as error:  # the work itself is done
        _log.warning("The run time could not be recorded: %s", error)


def times_spent(folder: Path) -> tuple[StepTiming, ...]:
    """Last account of each step, in the order in which the steps were last done."""
    last: dict[str, StepTiming] = {}
    for entry in _lines(folder / TIMES_FILE):
        last.pop(entry.step, None)
        last[entry.step] = entry
    return tuple(last.values())


def _lines(path: Path) -> Iterator[StepTiming]:
    try:
        lines = read_text(path).splitlines()
    except FileError:
        return  # an account that is missing or is none
    for line in lines:
        try:
            values: dict[str, Any] = json.loads(line)
            spent = StepTiming(str(values["step"]), float(values["seconds"]), float(values["memory"]))
        except (ValueError, KeyError, TypeError, RecursionError, OverflowError):
            continue  # a line cut short by a kill says nothing
        if math.isfinite(spent.seconds):
            yield spent


def run_directory(out: str | Path, choice: Choice) -> Path:
    """Directory of a run: ``<variant>/<load case>-<law>-<inertias>`` in the results directory.

    Nothing in the choice is left open (`Choice.of`).
    """
    return Path(out) / choice.variant / f"{choice.load_case}-{choice.mesh_model}-{choice.inertias}"


# Studies in a results folder: their datasets and pictures, as a report finds them

STUDIES, DATASET, PICTURES = "studies", "study.nc", "pictures"
"""Folder of all studies in a results folder; file of one, and folder of its pictures."""
STUDY_LAYOUT = Layout(
    "study", STUDY, {}, ("title", "study", "case", "case_digest", "input_hash", "points", "failed", "missing")
)
WORDS = ("labels", "report")
"""Tables of a gearbox file that no figure of a study reads."""
OF_LIFE = ("loads", "operation", "rating")
"""Tables that figures of lives read, and no other."""


@dataclass(frozen=True)
class StoredStudy:
    """A study that was put together."""

    path: Path
    """Its dataset."""
    title: str
    description: str
    points: int
    failed: int
    missing: int
    fits: bool
    """Whether the case is the one that it varied."""
    pictures: tuple[Path, ...]


def read_content(gearbox: Gearbox, of_life: bool) -> dict[str, Any]:
    """Tables of a gearbox file that figures of a study read, those of lives among them or not."""
    unread = WORDS if of_life else (*WORDS, *OF_LIFE)
    return {key: value for key, value in gearbox.content.items() if key not in unread}


def case_digest(gearbox: Gearbox, of_life: bool = False) -> str:
    """Hash of all that the figures of a study depend on in a case."""
    content = read_content(gearbox, of_life)
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def stored_studies(folder: Path, gearbox: Gearbox) -> Iterator[StoredStudy]:
    """Find the studies in a results folder; what is no study of this version is left out.

    Parameters
    ----------
    folder : results folder
    gearbox : its case
    """
    for path in sorted((folder / STUDIES).glob(f"*/{DATASET}")):
        try:
            with open_dataset(path, STUDY_LAYOUT) as data:
                attributes = dict(data.attrs)
        except FileError:
            continue
        yield StoredStudy(
            path=path,
            title=str(attributes["title"]),
            description=str(attributes.get("description", "")),
            points=int(attributes["points"]),
            failed=int(attributes["failed"]),
            missing=int(attributes["missing"]),
            fits=attributes["case_digest"] in (case_digest(gearbox), case_digest(gearbox, of_life=True)),
            pictures=tuple(sorted((path.parent / PICTURES).glob("*.png"))),
        )


# The file of what bearings and meshes bear: JSON, units in the keys, hash of its input, version of its method


def duty_summary(duty: BearingLoadState) -> dict[str, Any]:
    """Figures of a bearing by key, in the units that catalogues use; lives without end are None."""
    return {
        "bearing": duty.name,
        "type": duty.kind,
        "model": duty.model,
        "radial_load_kN": 1e-3 * duty.radial_load,
        "axial_load_kN": 1e-3 * duty.axial_load,
        "reaction_kN": None if duty.reaction is None else 1e-3 * duty.reaction,
        "radial_stiffness_N_per_m": duty.radial_stiffness,
        "axial_stiffness_N_per_m": float(duty.stiffness[2, 2]),
        "stiffness_matrix_N_m_rad": duty.stiffness.tolist(),
        "tilt_stiffness_N_m_per_rad": 0.5 * float(duty.stiffness[3, 3] + duty.stiffness[4, 4]),
        "misalignment_mrad": 1e3 * duty.misalignment,
        "most_loaded_element_kN": 1e-3 * duty.element_load,
        "contact_pressure_MPa": 1e-6 * duty.pressure,
        "dynamic_rating_kN": 1e-3 * duty.ratings.dynamic,
        "static_rating_kN": 1e-3 * duty.ratings.static,
        "ratings_estimated": duty.ratings.estimated,
        "ratings_of_makers": list(duty.ratings.makers),
        "two_designs": duty.ratings.two_designs,
        "L10_Mrev": _finite(duty.basic_life),
        "L10r_Mrev": _finite(duty.reference_life),
        "remarks": list(duty.remarks),
    }


def mesh_summary(duty: MeshLoadState) -> dict[str, Any]:
    """Figures of a mesh by key; what no contact was solved for is None."""
    return {
        "mesh": duty.name,
        "force_kN": 1e-3 * duty.force,
        "misalignment_mrad": 1e3 * duty.misalignment,
        "opening_um": 1e6 * duty.opening,
        "centre_distance_change_um": 1e6 * duty.centre_distance_change,
        "load_centroid_mm": _finite(1e3 * duty.load_centroid),
        "K_Hbeta": _finite(duty.face_load_factor),
        "contact_pressure_MPa": _finite(1e-6 * duty.pressure),
        "remark": duty.remark,
    }


def duties_summary(duties: Iterable[BearingLoadState], meshes: Iterable[MeshLoadState]) -> dict[str, Any]:
    """Figures of all bearings and of all meshes."""
    return {"bearings": [*map(duty_summary, duties)], "meshes": [*map(mesh_summary, meshes)]}


def read_duties(path: Path) -> dict[str, Any]:
    """Read what `write_duties` wrote.

    Raises
    ------
    FileError
        The file is missing, damaged, or of another version.
    """
    try:
        content = json.loads(read_text(path))
        if content["method_version"] == MODES and isinstance(content["bearings"], list):
            return dict(content)
    except (ValueError, KeyError, TypeError):
        raise FileError(f"{path}: is damaged; run `exugear bearings` again") from None
    raise FileError(f"{path}: was written by another version; run `exugear bearings` again")


def _finite(value: float) -> float | None:
    if math.isfinite(value):
        return value
    return None


def write_duties(
    path: Path, duties: Iterable[BearingLoadState], meshes: Iterable[MeshLoadState], input_hash: str
) -> Path:
    """Write what bearings and meshes bear (atomically) and return the path."""
    content = {
        "input_hash": input_hash,
        "method_version": MODES,
        "life": "basic: to ISO 281 and ISO/TS 16281 without lubricant and cleanliness; ribs and cages neglected",
        **duties_summary(duties, meshes),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())
    return path
