"""What a transmission error table costs: each GRC pair from nothing, in a process of its own.

    python benchmarks/ste.py [--rounds N]

Writes ``ste.json`` and ``ste.md`` beside this file. Compiled kernels are in their cache on disk, as after any first
use; no superelement and no table is. Medians of the rounds; beside wall time stands processor time, which other
programs on the machine do not change much.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
CASE = HERE.parent / "cases" / "grc750" / "gearbox.toml"
PAIRS = ("sun_planet", "ring_planet", "intermediate", "high_speed")


def measure(name: str) -> dict[str, float | int | str]:
    """Compute one pair's table from nothing in this process, imports included."""
    started, processor = time.perf_counter(), time.process_time()
    from exugear.gearbox import Gearbox
    from fe_ste.ste import pair_compliance, static_transmission_error

    spec = Gearbox.from_toml(CASE).pairs[name]
    imported = time.perf_counter()
    compliance = pair_compliance(spec.pair)
    offline = time.perf_counter()
    curve = static_transmission_error(compliance, spec.static_torque, 50)
    finished = time.perf_counter()
    return {
        "pair": name,
        "imports_s": imported - started,
        "offline_s": offline - imported,
        "position_ms": 1e3 * (finished - offline) / 50,
        "total_s": finished - started,
        "processor_s": time.process_time() - processor,
        "peak_memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "unknowns": sum(int(flank.figures["unknowns"]) for flank in compliance.flanks),
        "sparse_solver": str(compliance.flanks[0].figures["sparse_solver"]),
        "ste_mean_um": 1e6 * float(curve["ste"].mean()),
    }


def median_of(rounds: list[dict[str, float | int | str]]) -> dict[str, float | int | str]:
    """Median of each figure over the rounds of one pair."""
    first = rounds[0]
    return {
        key: statistics.median(float(entry[key]) for entry in rounds) if isinstance(value, float) else value
        for key, value in first.items()
    }


def as_markdown(results: dict[str, object]) -> str:
    """Table of the results."""
    rows = [
        "# Cost of the transmission error tables",
        "",
        f"Written by `python benchmarks/ste.py`. {results['machine']}; load average at the start "
        f"{results['load_average']:.1f}. 50 positions at the default mesh, from nothing (imports included, kernels "
        f"compiled before); medians of {results['rounds']} rounds.",
        "",
        "| pair | unknowns of both sectors | imports s | both gears once s | per position ms | all s | processor s | "
        "peak memory MB |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    pairs = results["pairs"]
    assert isinstance(pairs, list)
    for entry in pairs:
        rows.append(
            "| {pair} | {unknowns} | {imports_s:.1f} | {offline_s:.1f} | {position_ms:.0f} | {total_s:.1f} | "
            "{processor_s:.1f} | {peak_memory_MB:.0f} |".format(**entry)
        )
    rows += [
        "",
        "What bounds it: once per gear, the right-hand sides of the sector (its cut faces and flank nodes) take most; "
        "per position, the Cholesky factors of the cells in contact (five iterations of some 700 cells) take "
        "two thirds, filling their compliance the rest. The time of the same position in CalculiX stands in "
        "[calculix/README.md](calculix/README.md).",
        "",
    ]
    return "\n".join(rows)


def main() -> None:
    """Run all pairs and write the results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pair", choices=PAIRS, help="measure one pair in this process and print it")
    arguments = parser.parse_args()
    if arguments.pair:
        sys.stdout.write(json.dumps(measure(arguments.pair)))
        return
    load = os.getloadavg()[0]
    command = [sys.executable, __file__, "--pair"]
    pairs = []
    for name in PAIRS:
        rounds = [
            json.loads(subprocess.run([*command, name], check=True, capture_output=True, text=True).stdout)
            for _ in range(arguments.rounds)
        ]
        pairs.append(median_of(rounds))
    results = {
        "machine": f"{os.cpu_count()} cores ({platform.machine()}), Python {platform.python_version()}",
        "load_average": load,
        "rounds": arguments.rounds,
        "pairs": pairs,
    }
    (HERE / "ste.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    (HERE / "ste.md").write_text(as_markdown(results), encoding="utf-8")


if __name__ == "__main__":
    main()
