"""What a transmission error table costs: each GRC pair from nothing, growth with the states, CalculiX beside it.

Measured by ``python benchmarks/run_all.py``. Every table is computed in a fresh process; compiled kernels are in their
cache on disk, as after any first use, no superelement and no table is, but for the row of a pair with a known gear.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from timing import CASE, median, median_row, peak_memory, result, say, start, timed

CALCULIX = Path(__file__).with_name("calculix")
CALCULIX_CASE = "spur 0.5 coarse"
PAIRS = ("sun_planet", "ring_planet", "intermediate", "high_speed")
#: Pairs that share a gear, the first computed before the second.
KNOWN_FROM, KNOWN_IN = "sun_planet", "ring_planet"
GROWING = "high_speed"
POSITIONS = (10, 25, 50, 100)
TORQUES = (1, 2, 4)


def measure_pair(name: str, positions: int) -> dict[str, float | int | str]:
    """Compute one pair's table from nothing in this process, imports included."""
    started, processor = time.perf_counter(), time.process_time()
    from exugear.gearbox.gearbox import Gearbox
    from fe_ste.transmission_error.compliance import pair_compliance
    from fe_ste.transmission_error.transmission_error import static_transmission_error

    spec = Gearbox.from_toml(CASE).pairs[name]
    imported = time.perf_counter()
    compliance = pair_compliance(spec.pair)
    offline = time.perf_counter()
    static_transmission_error(compliance, spec.static_torque, positions)
    finished = time.perf_counter()
    return {
        "pair": name,
        "positions": positions,
        "unknowns": sum(int(flank.figures["unknowns"]) for flank in compliance.flanks),
        "imports_s": imported - started,
        "once_s": offline - imported,
        "position_s": (finished - offline) / positions,
        "curve_s": finished - started,
        "processor_s": time.process_time() - processor,
        "peak_memory_MB": peak_memory(),
    }


def measure_states(rounds: int) -> list[dict[str, float | int]]:
    """Cost of the states of a table, its gears prepared: over positions at one torque, over torques."""
    from exugear.gearbox.gearbox import Gearbox
    from fe_ste.transmission_error.compliance import pair_compliance
    from fe_ste.transmission_error.transmission_error import static_transmission_error

    spec = Gearbox.from_toml(CASE).pairs[GROWING]
    compliance = pair_compliance(spec.pair)
    static_transmission_error(compliance, spec.static_torque, 2)
    sizes = [(positions, 1) for positions in POSITIONS] + [(25, torques) for torques in TORQUES[1:]]
    costs: dict[tuple[int, int], list[float]] = {size: [] for size in sizes}
    for _ in range(rounds):
        for positions, torques in sizes:
            loads = [spec.static_torque * (n + 1) / torques for n in range(torques)]
            cost = timed(lambda p=positions, t=loads: static_transmission_error(compliance, t, p))
            costs[positions, torques].append(cost.wall)
    return [
        {
            "positions": positions,
            "torques": torques,
            "states": positions * torques,
            "wall_s": median(walls),
            "per_state_s": median(walls) / (positions * torques),
        }
        for (positions, torques), walls in costs.items()
    ]


def measure_calculix() -> dict[str, Any]:
    """One position by CalculiX and by the superelement; as stored where ``ccx`` is not installed."""
    sys.path.insert(0, str(CALCULIX))
    from ccx_model import find_calculix
    from cross_check import CASES, compare, stored

    installed = find_calculix() is not None
    entry = compare(CASES[CALCULIX_CASE]) if installed else stored()[CALCULIX_CASE]
    theirs, ours = entry["calculix"], entry["superelement"]
    return {
        "case": CALCULIX_CASE,
        "measured_now": installed,
        "version": theirs["version"],
        "unknowns": theirs["unknowns"],
        "calculix_s": theirs["position_cpu_s"],
        "once_s": ours["offline_cpu_s"],
        "position_s": ours["position_cpu_s"],
        "ratio": theirs["position_cpu_s"] / ours["position_cpu_s"],
        "difference_percent": entry["difference_percent"],
    }


def measure_known(positions: int) -> dict[str, Any]:
    """Curve of a pair one of whose gears is in the files of an earlier process."""
    with tempfile.TemporaryDirectory() as files:
        for name in (KNOWN_FROM, KNOWN_IN):
            found = result(start("ste.py", "--pair", name, "--positions", str(positions), EXUGEAR_FLANKS=files))
    return dict(found)


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    rounds, positions = (1, 10) if quick else (3, 50)
    pairs = []
    for name in PAIRS[-1:] if quick else PAIRS:
        found = [result(start("ste.py", "--pair", name, "--positions", str(positions))) for _ in range(rounds)]
        pairs.append(median_row(found, "curve_s"))
        say(f"tables: {name}")
    known = median_row([measure_known(positions) for _ in range(rounds)], "curve_s")
    say("a pair with a known gear: done")
    states = result(start("ste.py", "--states", str(rounds)))
    say("growth with the states of a table: done")
    calculix = result(start("ste.py", "--calculix"))
    tables = {"rounds": rounds, "pairs": pairs, "known_from": KNOWN_FROM, "known": known}
    return {**tables, "growing": GROWING, "states": states, "calculix": calculix}


def main() -> None:
    """Measure what needs a process of its own."""
    parser = argparse.ArgumentParser(description="Parts of run_all.py that need a process of their own.")
    parser.add_argument("--pair", choices=PAIRS)
    parser.add_argument("--positions", type=int, default=50)
    parser.add_argument("--states", type=int, metavar="ROUNDS")
    parser.add_argument("--calculix", action="store_true")
    options = parser.parse_args()
    found: object
    if options.pair:
        found = measure_pair(options.pair, options.positions)
    elif options.states:
        found = measure_states(options.states)
    else:
        found = measure_calculix()
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()
