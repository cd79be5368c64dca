"""Results folders as verbs ask for them before they work."""

from __future__ import annotations

import os
from pathlib import Path

from exugear.cli.errors import BadInputError


def check_results_folder(folder: Path) -> None:
    """Refuse a folder that a verb could not write into, before it works, and make none."""
    there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not there.is_dir():
        raise BadInputError(f"--out {folder}: {there} is no folder; name one that can be made")
    if not os.access(there, os.W_OK):
        raise BadInputError(f"--out {folder}: {there} is not writable; name another folder")


def make_results_folder(folder: Path) -> None:
    """Make the folder that a verb writes into, so that a wrong one shows before the work, not after."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"--out {folder}: {error.strerror}; name a folder that can be made") from error
    if not os.access(folder, os.W_OK):
        raise BadInputError(f"--out {folder}: not writable; name another folder")
