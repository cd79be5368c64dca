"""Studies in a results folder: their datasets and pictures, as a report finds them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.versions import STUDY
from fe_ste.tools.files import FileError
from fe_ste.tools.sealed import Layout, open_dataset

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
