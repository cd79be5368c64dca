"""Studies in a results folder: their datasets and pictures, as a report finds them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from exugear.model.gearbox import Gearbox
from exugear.model.versions import STUDY
from fe_ste.tools.files import FileError
from fe_ste.tools.sealed import Layout, open_dataset

STUDIES, DATASET, PICTURES = "studies", "study.nc", "pictures"
"""Folder of all studies in a results folder; file of one, and folder of its pictures."""
STUDY_LAYOUT = Layout(
    "study", STUDY, {}, ("title", "study", "case", "case_digest", "input_hash", "points", "failed", "missing")
)


@dataclass(frozen=True)
class StoredStudy:
    """A study that was put together.

    Attributes
    ----------
    path : Path
        Its dataset.
    title, description : str
    points, failed, missing : int
    fits : bool
        Whether the case is the one that it varied.
    pictures : tuple of Path
    """

    path: Path
    title: str
    description: str
    points: int
    failed: int
    missing: int
    fits: bool
    pictures: tuple[Path, ...]


def case_digest(gearbox: Gearbox) -> str:
    """Hash of all that computed numbers depend on in a case."""
    return hashlib.sha256(json.dumps(gearbox.computed_content, sort_keys=True).encode()).hexdigest()


def stored_studies(folder: Path, gearbox: Gearbox) -> Iterator[StoredStudy]:
    """Find the studies in a results folder; what is no study of this version is left out.

    Parameters
    ----------
    folder : Path
        Results folder.
    gearbox : Gearbox
        Its case.
    """
    for path in sorted((folder / STUDIES).glob(f"*/{DATASET}")):
        try:
            with open_dataset(path, STUDY_LAYOUT) as data:
                attributes = dict(data.attrs)
        except FileError:
            continue
        counts = (int(attributes[name]) for name in ("points", "failed", "missing"))
        pictures = tuple(sorted((path.parent / PICTURES).glob("*.png")))
        fits = attributes["case_digest"] == case_digest(gearbox)
        yield StoredStudy(
            path, str(attributes["title"]), str(attributes.get("description", "")), *counts, fits, pictures
        )
