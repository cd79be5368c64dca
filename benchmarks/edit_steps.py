"""Processor time of the server of `exugear edit` from a change of a number until each step is known, by gearbox.

    python benchmarks/edit_steps.py                     # prints the table; half a minute
    python benchmarks/edit_steps.py --before FOLDER     # and the ratio to another copy of the sources

Each change adds a digit to a number that changes all modes. Both copies take turns, so that what else the machine does
slows down both.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import time
from pathlib import Path

from timing import CASE, ROOT, environment, median

STEPS = ("check", "picture", "dynamics", "loads", "shapes")
CHANGES = 9
TURNS = 3


def measure() -> dict[str, dict[str, float]]:
    """Return the median processor time of each step (ms) by gearbox."""
    from exugear.cli.edit.state import Analyst
    from exugear.gearbox.templates.kinds import KINDS, template

    texts = {kind: (f"{kind}.toml", template(kind)) for kind in KINDS}
    texts["GRC 750"] = (str(CASE), CASE.read_text(encoding="utf-8"))
    found = {}
    for name, (source, text) in texts.items():
        analyst = Analyst(source)
        geometry = next(step["geometry"] for step in list(analyst.steps(text)) if step["step"] == "picture")
        times: dict[str, list[float]] = {step: [] for step in STEPS}
        for change in range(1, 1 + CHANGES):
            changed = re.sub(r"(?m)^factor = [\d.]+", rf"\g<0>{change}", text, count=1)
            begin = time.process_time()
            for step in analyst.steps(changed, "", geometry):
                json.dumps(step)
                times[step["step"]].append(1e3 * (time.process_time() - begin))
        found[name] = {step: median(values) for step, values in times.items() if values}
    return found


def of_copy(folder: Path) -> dict[str, dict[str, float]]:
    """Measure a copy of the sources in a process of its own."""
    command = [sys.executable, __file__, "--json"]
    ended = subprocess.run(
        command, check=True, capture_output=True, text=True, env=environment(PYTHONPATH=str(folder.resolve()))
    )
    rows: dict[str, dict[str, float]] = json.loads(ended.stdout)
    return rows


def main() -> None:
    """Print the times of this copy, and their ratio to those of another one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", type=Path, help="folder of another copy of the sources")
    parser.add_argument("--json", action="store_true", help="measure once, and print JSON")
    wanted = parser.parse_args()
    if wanted.json:
        print(json.dumps(measure()))
        return
    print("| gearbox | " + " | ".join(f"{step} / ms" for step in STEPS) + " |")
    print("| --- |" + " --- |" * len(STEPS))
    turns = [(of_copy(ROOT), of_copy(wanted.before) if wanted.before else None) for _ in range(TURNS)]
    for name in turns[0][0]:
        cells = []
        for step in STEPS:
            own = min(mine[name][step] for mine, _ in turns)
            pairs = [(mine[name], other[name]) for mine, other in turns if other and name in other]
            ratios = [mine[step] / other[step] for mine, other in pairs if step in other]
            cells.append(f"{own:.0f}" + (f" ({median(ratios):.2f})" if ratios else ""))
        print(f"| {name} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
