"""The edited gearbox file on disk, and the pages of its results folder."""

from __future__ import annotations

import hashlib
import os
import threading
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from exugear.gearbox.named_files import LARGEST_CASE, LARGEST_MATRICES, NamedFileError, check_regular
from exugear.gearbox.reading import GearboxFileError, plain_lines, read_text
from exugear.results.folder import REPORT_FILE, content_digest, times_spent
from fe_ste.tools.files import write_file

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

STEPS_OF_RESULTS = {
    "tables": ("tables", "steady"),
    "steady": ("steady",),
    "report": ("report",),
    "changes": ("design changes",),
}
"""Beginnings of the steps, as the commands note them, after which each kind of results is complete.

A steady-state response reads tables that fit, and computes the others."""
UNSAVED_FILE = "unsaved.toml"
"""Text of the page that was not saved when the server ended, in the results folder."""


class FileConflictError(Exception):
    """The file was changed by another program or page after it was read."""


class EditedFile:
    """A gearbox file that a page edits and that other programs may change."""

    def __init__(self, case: Path, folder: Path) -> None:
        self.case = case
        self.folder = folder
        self.latest: str | None = None
        """Last text that a page sent for its check."""
        self._saving = threading.Lock()

    def text(self) -> str:
        """Read the file with line ends of the page; empty if it is empty or cannot be read."""
        try:
            return plain_lines(read_text(self.case))
        except GearboxFileError:
            return ""

    def told(self) -> dict[str, Any]:
        """Return digest and state of the file, and of what kinds of results its folder has those of which state."""
        text = self.text()
        # "current" results were completed for this text, "old" are others that exist.
        try:
            content = content_digest(tomllib.loads(text))
        except (ValueError, TypeError, RecursionError):  # no TOML, or a date
            content = ""
        spent = times_spent(self.folder)
        states: dict[str, str] = {}
        for kind, steps in STEPS_OF_RESULTS.items():
            digests = [own.content for own in spent if own.step.startswith(steps)]
            if digests and (kind != "report" or (self.folder / REPORT_FILE).is_file()):
                states[kind] = "current" if content and content in digests else "old"
        return {"digest": digest_of(text), "missing": not self.case.is_file(), "results": states}

    def save(self, text: str, digest: str) -> None:
        """Write the file, whose content the page knows by its digest; line ends stay those of the file.

        Raises
        ------
        FileConflictError
            The file has another content.
        """
        content = text.encode("utf-8", "surrogatepass")
        if len(content) > LARGEST_CASE:
            raise GearboxFileError(f"{self.case}: at most {1e-6 * LARGEST_CASE:.0f} MB can be saved")
        with self._saving, _locked(self.case):
            if digest != digest_of(self.text()):
                raise FileConflictError(
                    f"{self.case.name} was changed by another program or page after it was read here"
                )
            if self.case.is_file() and b"\r\n" in self.case.read_bytes():
                content = content.replace(b"\n", b"\r\n")
            write_file(self.case, content)

    def keep_unsaved(self) -> Path | None:
        """Write the last text of a page into the results folder if it is not that of the file; return its path.

        Saving that has begun is completed before.
        """
        with self._saving:
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


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Let one server at a time compare and replace a file; a later one then finds the new content."""
    if fcntl is None or not path.is_file():
        yield
        return
    while True:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            # A file that was replaced while this one waited has another lock.
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                yield
                return


def digest_of(text: str) -> str:
    """Return a digest of a text."""
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
