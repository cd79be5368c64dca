"""The edited gearbox file on disk, and the pages of its results folder."""

from __future__ import annotations

import hashlib
import json
import tomllib
from pathlib import Path
from typing import Any

from exugear.gearbox.named_files import LARGEST_CASE, LARGEST_MATRICES, NamedFileError, check_regular
from exugear.gearbox.reading import GearboxFileError, read_text
from exugear.results.folder import CASE_FILE, REPORT_FILE
from fe_ste.tools.files import write_file

UNSAVED_FILE = "unsaved.toml"
"""Text of the page that was not saved when the server ended, in the results folder."""


class FileConflictError(Exception):
    """The file was changed by another program or page after it was read."""


class EditedFile:
    """A gearbox file that a page edits and that other programs may change.

    Parameters
    ----------
    case, folder : gearbox file and results folder
    """

    def __init__(self, case: Path, folder: Path) -> None:
        self.case = case
        self.folder = folder
        self.latest: str | None = None
        """Last text that a page sent for its check."""

    def text(self) -> str:
        """Read the file with line ends of the page; empty if it is empty or cannot be read."""
        try:
            return read_text(self.case).replace("\r\n", "\n").replace("\r", "\n")
        except GearboxFileError:
            return ""

    def told(self) -> dict[str, Any]:
        """Return digest and state of the file, and what its results folder has: a report, and whether it is current."""
        text = self.text()
        return {"digest": digest_of(text), "missing": not self.case.is_file(), "report": self._report_state(text)}

    def save(self, text: str, digest: str) -> None:
        """Write the file, whose content the page knows by its digest; line ends stay those of the file.

        Raises
        ------
        FileConflictError
            The file has another content.
        """
        if digest != digest_of(self.text()):
            raise FileConflictError(f"{self.case.name} was changed by another program or page after it was read here")
        content = text.encode("utf-8", "surrogatepass")
        if len(content) > LARGEST_CASE:
            raise GearboxFileError(f"{self.case}: at most {1e-6 * LARGEST_CASE:.0f} MB can be saved")
        if self.case.is_file() and b"\r\n" in self.case.read_bytes():
            content = content.replace(b"\n", b"\r\n")
        write_file(self.case, content)

    def keep_unsaved(self) -> Path | None:
        """Write the last text of a page into the results folder if it is not that of the file; return its path."""
        if self.latest is None or self.latest == self.text():
            return None
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / UNSAVED_FILE
        write_file(path, self.latest.encode("utf-8", "replace"))
        return path

    def page(self, name: str) -> bytes | None:
        """Return the content of a page of the results folder; None if there is no such page."""
        path = self.folder / name
        try:
            check_regular(path, LARGEST_MATRICES)
            if path.resolve().parent != self.folder.resolve():  # a link to a file elsewhere
                return None
            return path.read_bytes()
        except (NamedFileError, OSError):
            return None

    def _report_state(self, text: str) -> str:
        """Return "none", "current" for a report of results of this text, or "old"."""
        report = self.folder / REPORT_FILE
        try:
            written = report.stat().st_mtime
        except OSError:
            return "none"
        try:
            kept = self.folder / CASE_FILE
            same = json.loads(kept.read_text(encoding="utf-8"))["content"] == json.loads(
                json.dumps(tomllib.loads(text), default=str)
            )
            return "current" if same and written >= kept.stat().st_mtime else "old"
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return "old"


def digest_of(text: str) -> str:
    """Return a digest of a text."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
