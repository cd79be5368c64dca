"""The results folder: its gearbox file, validity of stored files, studies, and loads of bearings and meshes."""

from __future__ import annotations

import hashlib
import json
import logging
import math
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
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

CASE_FILE = "case.json"
TIMES_FILE = "times.jsonl"
REPORT_FILE = "report.html"
DESIGN_CHANGES_FILE = "design_changes.json"
_log = logging.getLogger(__name__)


def keep_case(gearbox: Gearbox, folder: Path) -> None:
    """Write the content of the gearbox file into the results folder, so that a report needs no other file."""
    kept = {"source": str(Path(gearbox.source).resolve()), "content": gearbox.content}
    write_file(folder / CASE_FILE, json.dumps({**kept, "checksum": _checksum(kept)}, indent=1).encode("utf-8"))


def stored_source(folder: Path) -> Path | None:
    """Return the path of the gearbox file that the results in a folder belong to; None without one that can be read."""
    try:
        return Path(json.loads(read_text(folder / CASE_FILE))["source"])
    except (FileError, ValueError, KeyError, TypeError, RecursionError):
        return None


def content_digest(content: Mapping[str, Any] | Sequence[Any]) -> str:
    """Return the SHA-256 of content such as that of a gearbox file, independent of its formatting."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _checksum(kept: dict[str, Any]) -> str:
    """Checksum of the stored content of a gearbox file, independent of its formatting."""
    return content_digest([kept["source"], kept["content"]])


def read_stored_gearbox(folder: Path, permissions: Permissions = NOTHING_MORE) -> Gearbox:
    """Read the gearbox of the results in a folder; the permissions are for the files that it names.

    Raises
    ------
    GearboxFileError
        The folder contains no results, or its stored gearbox file cannot be used.
    """
    path = folder / CASE_FILE
    if not path.is_file():
        raise GearboxFileError(
            f"{folder}: contains no results (no {CASE_FILE}); specify the results folder of exugear run"
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
    # A file with a valid checksum may still be forged and have any content.
    except (FileError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise GearboxFileError(f"{path}: cannot be used ({error}); run exugear modes into this folder again") from error
    try:
        return Gearbox.from_dict(content, source, permissions)
    except GearboxFileError as error:
        if not any(" was renamed to " in line for line in error.errors):
            raise
        # The file itself may have been migrated since: its results have not.
        raise GearboxFileError(
            f"{path}: written by an earlier version, whose keys have other names; run exugear migrate {source}, then "
            f"exugear report {source}, which computes the results again"
        ) from error


def modes_path(folder: str | Path, choice: Choice) -> Path:
    """Path of the modes for model settings with an inertia set: ``<variant>/<law>-<inertias>/modes.nc``."""
    return Path(folder) / choice.variant / f"{choice.mesh_model}-{choice.inertias}" / "modes.nc"


def bearings_path(folder: str | Path, choice: Choice) -> Path:
    """Path of the bearing loads for model settings, in the folder of the modes."""
    return modes_path(folder, choice).with_name("bearings.json")


def bodies_folder(folder: Path) -> Path:
    """Folder of the reduced flexible bodies: ``bodies``."""
    return folder / "bodies"


@dataclass(frozen=True)
class StepTiming:
    """Run time and memory of a step of the computation."""

    step: str
    seconds: float
    """Wall-clock time, s."""
    memory: float
    """Peak memory of the process, bytes."""
    content: str = ""
    """Digest of the content of the gearbox file for which it was completed; empty if unknown."""


def peak_memory() -> float:
    """Peak memory of this process so far, bytes; NaN on Windows."""
    if sys.platform == "win32":
        return math.nan  # Windows provides no value without an additional library
    import resource

    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak if sys.platform == "darwin" else 1024.0 * peak  # Linux counts in KiB


def note_time(folder: Path, step: str, seconds: float) -> None:
    """Append a line to the list of run times in the folder; several processes may do so concurrently."""
    try:
        content = content_digest(json.loads(read_text(folder / CASE_FILE))["content"])
    except (FileError, ValueError, KeyError, TypeError, RecursionError):
        content = ""
    append_line(folder / TIMES_FILE, json.dumps(asdict(StepTiming(step, round(seconds, 2), peak_memory(), content))))


@contextmanager
def time_noted(folder: Path, step: str) -> Iterator[None]:
    """Store the run time of a step that succeeded; if the folder cannot be written, only this entry is lost."""
    start = time.perf_counter()
    yield
    try:
        note_time(folder, step, time.perf_counter() - start)
    except OSError as error:  # the result of the step is already stored
        _log.warning("The run time could not be recorded: %s", error)


def times_spent(folder: Path) -> tuple[StepTiming, ...]:
    """Last entry of each step, in the order in which the steps were last completed."""
    try:
        lines = read_text(folder / TIMES_FILE).splitlines()
    except FileError:
        return ()  # the list is missing or not readable
    last: dict[str, StepTiming] = {}
    for line in lines:
        try:
            values: dict[str, Any] = json.loads(line)
            numbers = (float(values["seconds"]), float(values["memory"]))
            spent = StepTiming(str(values["step"]), *numbers, str(values.get("content", "")))
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError):
            continue  # a line truncated by a killed process contains no entry
        if math.isfinite(spent.seconds):
            last.pop(spent.step, None)
            last[spent.step] = spent
    return tuple(last.values())


def run_directory(out: str | Path, choice: Choice) -> Path:
    """Directory of a run: ``<variant>/<load case>-<law>-<inertias>`` in the results directory.

    All model settings must be filled in (`Choice.of`).
    """
    return Path(out) / choice.variant / f"{choice.load_case}-{choice.mesh_model}-{choice.inertias}"


# Studies in a results folder: their datasets and pictures, as a report reads them

STUDIES, DATASET, PICTURES = "studies", "study.nc", "pictures"
"""Folder of all studies in a results folder; file of one study, and folder of its pictures."""
STUDY_LAYOUT = Layout(
    "study", STUDY, {}, ("title", "study", "case", "case_digest", "input_hash", "points", "failed", "missing")
)
WORDS = ("labels", "measurements", "report")
"""Tables of a gearbox file that no output of a study depends on."""
OF_LIFE = ("loads", "operation", "rating")
"""Tables on which only outputs on life depend."""


@dataclass(frozen=True)
class StoredStudy:
    """A study in a results folder with its combined dataset."""

    path: Path
    title: str
    description: str
    points: int
    failed: int
    missing: int
    fits: bool
    """Whether the study varied this gearbox file."""
    pictures: tuple[Path, ...]


def read_content(gearbox: Gearbox, of_life: bool) -> dict[str, Any]:
    """Tables of a gearbox file on which outputs of a study depend, with or without those of life."""
    unread = WORDS if of_life else (*WORDS, *OF_LIFE)
    return {key: value for key, value in gearbox.content.items() if key not in unread}


def case_digest(gearbox: Gearbox, of_life: bool = False) -> str:
    """Hash of all content of a gearbox file on which the outputs of a study depend."""
    return content_digest(read_content(gearbox, of_life))


def stored_studies(folder: Path, gearbox: Gearbox) -> Iterator[StoredStudy]:
    """Find the studies of a gearbox in a results folder, without files of other versions or other content."""
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


# The file of bearing and mesh loads: JSON, units in the keys, hash of its input, version of its method


def duty_summary(duty: BearingLoadState) -> dict[str, Any]:
    """Results of a bearing by key, in the units that catalogues use; an infinite life is None."""
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
        "L10_Mrev": finite_or_none(duty.basic_life),
        "L10r_Mrev": finite_or_none(duty.reference_life),
        "remarks": list(duty.remarks),
    }


def mesh_summary(duty: MeshLoadState) -> dict[str, Any]:
    """Results of a mesh by key; None for results of a contact that was not computed."""
    return {
        "mesh": duty.name,
        "force_kN": 1e-3 * duty.force,
        "misalignment_mrad": 1e3 * duty.misalignment,
        "opening_um": 1e6 * duty.opening,
        "centre_distance_change_um": 1e6 * duty.centre_distance_change,
        "load_centroid_mm": finite_or_none(1e3 * duty.load_centroid),
        "K_Hbeta": finite_or_none(duty.face_load_factor),
        "sigma_H_misaligned_MPa": finite_or_none(1e-6 * duty.pressure),
        "remark": duty.remark,
    }


def duties_summary(duties: Iterable[BearingLoadState], meshes: Iterable[MeshLoadState]) -> dict[str, Any]:
    """Results of all bearings and of all meshes."""
    return {"bearings": [*map(duty_summary, duties)], "meshes": [*map(mesh_summary, meshes)]}


def read_duties(path: Path) -> dict[str, Any]:
    """Read a file written by `write_duties`.

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
        raise FileError(f"{path}: is damaged; run exugear bearings again") from None
    raise FileError(f"{path}: was written by another version; run exugear bearings again")


def finite_or_none(value: float) -> float | None:
    """Return a number for JSON, which has none that is not finite."""
    return value if math.isfinite(value) else None


def write_duties(
    path: Path, duties: Iterable[BearingLoadState], meshes: Iterable[MeshLoadState], input_hash: str
) -> Path:
    """Write the loads of bearings and meshes (atomically) and return the path."""
    content = {
        "input_hash": input_hash,
        "method_version": MODES,
        "life": "basic: to ISO 281 and ISO/TS 16281 without lubricant and cleanliness; ribs and cages neglected",
        **duties_summary(duties, meshes),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())
    return path
