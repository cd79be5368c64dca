"""STEP files of the GRC's solids from the gmsh scripts beside this file; needed only after a change of a script.

    python cases/grc750/write_step.py [folder]

A gmsh script can run any command of the system, so a gearbox file may name one only with permission; STEP files need
none, and gearbox.toml names these. Edges between fused pieces stay, for seats end on them. The files say nothing of
when and where they were written: the same script gives the same file.
"""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any

SOLIDS = ("carrier", "ring_rim", "housing")
HERE = Path(__file__).parent


def write_step(script: Path, target: Path) -> None:
    """Run a script in gmsh and write its volumes as STEP."""
    gmsh: Any = importlib.import_module("gmsh")
    gmsh.initialize(["write_step", "-nopopup"], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(script))
        gmsh.write(str(target))
    finally:
        gmsh.finalize()
    text = target.read_text(encoding="ascii")
    text = re.sub(r"FILE_NAME\('[^']*','[^']*'", f"FILE_NAME('{target.name}','1970-01-01T00:00:00'", text, count=1)
    # The writer numbers the files of a process.
    text = re.sub(r"Open CASCADE STEP translator [\d.]+ \d+", f"{script.stem} of the GRC", text)
    target.write_text(text, encoding="ascii")


def main(folder: Path) -> None:
    """Write the STEP files of all scripts into a folder."""
    for name in SOLIDS:
        write_step(HERE / f"{name}.geo", folder / f"{name}.step")
        print(folder / f"{name}.step")


if __name__ == "__main__":
    from arguments import results_folder

    main(results_folder(str(HERE)))
