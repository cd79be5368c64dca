"""All benchmarks by one command, and the tables made of them.

    make benchmarks                              # all, about fifteen minutes on two free cores
    python benchmarks/run_all.py --quick         # shows in two minutes that everything runs; writes nothing
    python benchmarks/run_all.py --part startup  # measures one part again, keeps the others
    python benchmarks/run_all.py --render        # makes the tables anew of what is stored

Writes ``results.json`` and ``results.md`` beside this file, and the figures that docs/reference/computing_time.md and
docs/validation/dynamics.md quote. No figure in these is written by hand. A part that fails is named, the others are
measured and kept, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import reporting
from timing import ROOT, cores_busy, load, machine, say


def measure_dynamics(quick: bool) -> dict[str, Any]:
    """See `dynamics`."""
    import dynamics

    return dynamics.measure(quick)


def measure_tables(quick: bool) -> dict[str, Any]:
    """See `ste`."""
    import ste

    return ste.measure(quick)


def measure_grids(quick: bool) -> dict[str, Any]:
    """See `grid`."""
    import grid

    return grid.measure_all(quick)


def measure_elastic(quick: bool) -> dict[str, Any]:
    """See `elastic`."""
    import elastic

    return elastic.measure(quick)


def measure_bearings(quick: bool) -> dict[str, Any]:
    """See `bearings`."""
    import bearings

    return bearings.measure(quick)


def measure_startup(quick: bool) -> dict[str, Any]:
    """See `startup`."""
    import startup

    return startup.measure(quick)


def measure_steady(quick: bool) -> dict[str, Any]:
    """See `steady`."""
    import steady

    return steady.measure(quick)


def measure_excitations(quick: bool) -> dict[str, Any]:
    """See `steady`."""
    import steady

    return steady.measure_excitations(quick)


def measure_loads(quick: bool) -> dict[str, Any]:
    """See `loads`."""
    import loads

    return loads.measure(quick)


def measure_studies(quick: bool) -> dict[str, Any]:
    """See `studies`."""
    import studies

    return studies.measure(quick)


def measure_report(quick: bool) -> dict[str, Any]:
    """See `report_page`."""
    import report_page

    return report_page.measure(quick)


PARTS: dict[str, Callable[[bool], dict[str, Any]]] = {
    "startup": measure_startup,
    "tables": measure_tables,
    "dynamics": measure_dynamics,
    "grids": measure_grids,
    "elastic": measure_elastic,
    "bearings": measure_bearings,
    "steady": measure_steady,
    "excitations": measure_excitations,
    "loads": measure_loads,
    "studies": measure_studies,
    "report": measure_report,
}


def measure(name: str, quick: bool, at_start: float) -> dict[str, Any]:
    """Measure one part, with what else the machine did before it and what it took."""
    busy, begin = cores_busy(), time.perf_counter()
    found = PARTS[name](quick)
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return {
        "measured": now,
        "load_at_start": at_start,
        "cores_busy_before": busy,
        "took_s": round(time.perf_counter() - begin, 1),
        "machine": machine(),
        **found,
    }


def write(results: dict[str, Any]) -> None:
    """Write the figures and everything made of them."""
    text = json.dumps(results, indent=1, allow_nan=False) + "\n"
    reporting.RESULTS.write_text(text, encoding="utf-8")
    render()


def render() -> None:
    """Make the tables of the stored figures."""
    stored = reporting.stored()
    reporting.PAGE.write_text(reporting.page(stored), encoding="utf-8")
    for name in reporting.QUOTED:
        path = ROOT / name
        path.write_text(reporting.with_quotes(path.read_text(encoding="utf-8"), stored), encoding="utf-8")


def main() -> int:
    """Measure what is asked for, write it, and tell the exit code."""
    parser = argparse.ArgumentParser(
        description=str(__doc__).splitlines()[0], epilog="Results go to benchmarks/results.json and results.md."
    )
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--quick", action="store_true", help="one short round of everything; writes nothing")
    choice.add_argument("--part", choices=PARTS, help="measure this part only and keep the others")
    choice.add_argument("--render", action="store_true", help="measure nothing, make the tables anew")
    options = parser.parse_args()
    if options.render:
        render()
        return 0
    results, failed, at_start = ({} if options.quick else reporting.stored()), [], load()
    for name in [options.part] if options.part else PARTS:
        try:
            results[name] = measure(name, options.quick, at_start)
        except Exception as error:  # whatever stops one part must not lose the others
            say(f"{name} failed: {type(error).__name__}: {error}")
            failed.append(name)
            continue
        if not options.quick:
            write({part: results[part] for part in PARTS if part in results})
    if options.quick and not failed:
        sys.stdout.write(reporting.page(results))
    elif not failed:
        say(f"written {reporting.RESULTS.relative_to(ROOT)}, {reporting.PAGE.relative_to(ROOT)} and what is quoted")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
