"""Kills a life, or a count of loads, at its writes, and does it again: `python killed_lives.py WHAT FOLDER EVERY`.

The folder holds a gearbox file and, in `known`, what is there before: for a life tables and stresses of its pairs. As
`killed_runs` does it: forks of one process that end by SIGKILL at one of the calls that change the disk. Prints how
many kills there were, and what was wrong after which. An unfinished hidden file is left by a kill, and removed by the
next writing of that file after an hour.
"""

from __future__ import annotations

import json
import re
import shutil
import signal
import sys
from functools import partial
from pathlib import Path

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.load_spectrum.counted import count_loads, write_spectra
from exugear.project import Project

from .killed_runs import in_fork, kill_at

CHOICE = Choice("bushing", "iso6336")
NOTED = "times.jsonl"
"""Times of what was done: a line more for each call."""
UNFINISHED = re.compile(r"\..*\.[0-9a-f]{8}\.partial")


def files_of(folder: Path) -> dict[str, bytes]:
    """Content of all files by their names, those of what is noted of time and of unfinished writings aside."""
    found = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    kept = {name: path for name, path in found.items() if path.name != NOTED and not UNFINISHED.fullmatch(path.name)}
    return {name: path.read_bytes() for name, path in kept.items()}


def check(what: str, folder: Path, every: int) -> dict[str, object]:
    case = folder / "gearbox.toml"

    def work(name: str, number: int | None = None) -> None:
        if number is not None:
            kill_at(number)
        if what == "life":
            Project.from_toml(case, folder / name, CHOICE).life()
        else:
            write_spectra(count_loads(Gearbox.from_toml(case)), folder / name)

    def done_again(name: str) -> None:
        work(name)
        found = files_of(folder / name)
        assert found.keys() == whole.keys(), sorted(found.keys() ^ whole.keys())
        differing = [one for one, content in found.items() if content != whole[one]]
        assert not differing, differing

    shutil.copytree(folder / "known", folder / "whole")
    work("whole")
    whole = files_of(folder / "whole")
    kills, wrong, number = 0, [], 1
    while True:
        name = f"killed-{number}"
        shutil.copytree(folder / "known", folder / name)
        code = in_fork(partial(work, name, number))
        if code != -signal.SIGKILL:
            break
        kills += 1
        if in_fork(partial(done_again, name)):
            wrong.append(number)
        number += every
    return {"kills": kills, "undisturbed": code, "wrong": wrong}


if __name__ == "__main__":
    print(json.dumps(check(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))))
