"""Command line of the scripts in this folder: a results folder, and --help."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def results_folder(default: str) -> Path:
    """Return the folder that the command line names, or the default; refuse any other argument.

    The text of --help is the docstring of the script.
    """
    script = sys.modules["__main__"]
    parser = argparse.ArgumentParser(
        description=script.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    parser.add_argument(
        "folder", nargs="?", type=Path, default=Path(default), help=f"folder to write (default: {default})"
    )
    return Path(parser.parse_args().folder)
