"""Sections of the results on start-up and on tables of the transmission error."""

from __future__ import annotations

from result_text import Results, circumstances, duration, items, number, table


def start_of(part: Results, command: str) -> Results:
    """Row of one command."""
    found: Results = next(row for row in part["starts"] if row["command"] == command)
    return found


def startup_section(part: Results) -> str:
    """Tables of the start."""
    rows = [
        [f"`exugear {row['command']}`", duration(row["wall_s"]), duration(row["processor_s"])] for row in part["starts"]
    ]
    warm, cold = start_of(part, "run, kernels cached"), start_of(part, "run, kernels compiled")
    return "\n".join(
        [
            "## Start-up\n",
            f"{circumstances(part)} Medians of {part['rounds']} starts; the run simulates 10 ms and stores them. "
            "Compiled kernels are kept on disk: compiling happens once per installation.\n",
            table(["command", "wall", "processor time"], rows),
            items(
                [
                    "Limited by: imports of numba, SciPy and the package itself are half of a warm start, reading "
                    "the kernels and looking for the static state the rest. xarray, finite elements, Exudyn and what "
                    "draws are not loaded. Several runs in one process would pay this once.",
                    f"The first run compiles for {duration(cold['processor_s'] - warm['processor_s'])} of processor "
                    "time; kernels compiled at installation would save it.",
                ]
            ),
        ]
    )


def tables_section(part: Results) -> str:
    """Tables of the transmission error's cost."""
    pairs, states, calculix = part["pairs"], part["states"], part["calculix"]
    known = (
        [{**part["known"], "pair": f"{part['known']['pair']} after {part['known_from']}"}] if "known" in part else []
    )
    pair_rows = [
        [
            row["pair"],
            number(row["unknowns"], 6),
            duration(row["imports_s"]),
            duration(row["once_s"]),
            duration(row["position_s"]),
            f"{row['positions']} in {duration(row['curve_s'])}",
            duration(row["processor_s"]),
            f"{row['peak_memory_MB']:.0f} MB",
        ]
        for row in (*pairs, *known)
    ]
    state_rows = [
        [
            str(row["positions"]),
            str(row["torques"]),
            str(row["states"]),
            duration(row["wall_s"]),
            duration(row["per_state_s"]),
        ]
        for row in states
    ]
    source = "measured here" if calculix["measured_now"] else "stored: `ccx` is not installed here"
    first, last = states[0], max(states, key=lambda row: row["states"])
    share = max(row["once_s"] / row["curve_s"] for row in pairs)
    return "\n".join(
        [
            "## Transmission error tables\n",
            f"{circumstances(part)} Default mesh, from nothing but compiled kernels; medians of {part['rounds']} "
            "rounds, each in a process of its own.\n",
            table(
                [
                    "pair",
                    "unknowns of both sectors",
                    "imports",
                    "both gears, once",
                    "per position",
                    "whole curve",
                    "its processor time",
                    "peak memory",
                ],
                pair_rows,
            ),
            items(
                [
                    f"Limited by: both gears' compliance, up to {100 * share:.0f} % of a curve: right-hand sides "
                    "of the sector (cut faces and flank nodes), each a solve with the factors. Fewer right-hand sides "
                    "would save in proportion; the curve itself is what would remain.",
                    "Per position: the compliance of the cells near the contact of the position before is half, the "
                    "rest one Cholesky factor of the cells in contact, which changes of the active set border.",
                ]
            ),
            f"### States of a table, {part['growing']}, gears prepared\n",
            table(["positions", "torques", "states", "wall", "per state"], state_rows),
            items(
                [
                    f"The cost grows with the number of states: {duration(first['per_state_s'])} each in a table of "
                    f"{first['states']}, {duration(last['per_state_s'])} in one of {last['states']}. Limited by: "
                    "every state is solved on its own; it begins with the contact of the position before.",
                ]
            ),
            f"### CalculiX {calculix['version']} on the same meshes ({source})\n",
            table(
                ["case", "unknowns", "CalculiX, one position", "superelement, once", "one position", "ratio", "STE"],
                [
                    [
                        calculix["case"],
                        number(calculix["unknowns"], 6),
                        duration(calculix["calculix_s"]),
                        duration(calculix["once_s"]),
                        duration(calculix["position_s"]),
                        number(calculix["ratio"]),
                        f"{calculix['difference_percent']:+.2f} %",
                    ]
                ],
            ),
            items(
                [
                    "Processor times. CalculiX is limited by a factorisation of all unknowns in every contact "
                    "iteration of every position, where the superelement has one per gear. More cases: "
                    "[calculix/README.md](calculix/README.md).",
                ]
            ),
        ]
    )


def grids_section(part: Results) -> str:
    """Table of the cost of tables over load, centre distance and misalignment."""
    pairs = part["pairs"]
    head = ["pair", "states", "both gears, once", "grid", "all", "processor time per state", "a state alone"]
    rows = [
        [
            row["pair"],
            str(row["states"]),
            duration(row["offline_s"]),
            duration(row["grid_s"]),
            duration(row["total_s"]),
            duration(1e-3 * row["state_processor_ms"]),
            duration(1e-3 * row["alone_ms"]),
            f"{row['largest_deviation']:.0e}",
            f"{row['worker_memory_MB']:.0f} MB",
        ]
        for row in pairs
    ]
    gain = min(row["alone_ms"] / row["state_processor_ms"] for row in pairs)
    return "\n".join(
        [
            "## Tables over load, centre distance and misalignment\n",
            f"{circumstances(part)} Default axes, two worker processes, kernels compiled before.\n",
            table([*head, "largest deviation from alone", "a worker's memory"], rows),
            "Bound: a third of a state's time fills the compliance of the cells, which its misalignments share, and "
            "half finds the cells in contact, in some three steps from those of the position before. Sharing makes a "
            f"state at least {number(gain, 2)} times cheaper than alone.\n",
        ]
    )
