"""Section "Studies": what variations of the gearbox showed, by the pictures of each."""

from __future__ import annotations

import base64
from pathlib import Path

from exugear.report.parts.material import Material, Part
from exugear.report.web import pieces
from exugear.results.study_files import StoredStudy, stored_studies

LARGEST_PICTURE = 2_000_000
"""Bytes of a picture that a page takes in."""
WIDTH = 640
"""Of a picture, pixels."""


def studies_section(material: Material) -> Part:
    """Show the pictures of the studies that the results folder holds."""
    found = list(stored_studies(material.context.folder, material.context.gearbox))
    if not found:
        return Part("")
    html = pieces.section("Studies", *map(_study, found), name="studies")
    return Part(html, title="Studies", name="studies")


def _study(study: StoredStudy) -> str:
    lost = "".join(
        f", {count} {word}" for count, word in ((study.failed, "failed"), (study.missing, "missing")) if count
    )
    old = "" if study.fits else pieces.paragraph("The case was changed since: sweep it again.", "warning")
    told = f"{study.points} points{lost}. {study.description[:1].upper()}{study.description[1:]}"
    shown = [_picture(path) for path in study.pictures if path.stat().st_size <= LARGEST_PICTURE]
    return pieces.section(study.title, pieces.paragraph(told), old, *shown, level=3)


def _picture(path: Path) -> str:
    content = base64.b64encode(path.read_bytes()).decode("ascii")
    words = path.stem.replace("_", " ")
    return pieces.picture(f"data:image/png;base64,{content}", words, WIDTH)
