"""Tables and sentences made of the stored figures; nothing is measured here."""

from __future__ import annotations

import json
import re
import textwrap
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
RESULTS = HERE / "results.json"
PAGE = HERE / "results.md"
QUOTE = re.compile(r"(<!-- figures of benchmarks/run_all.py: (\w+) -->\n).*?(<!-- end of figures -->)", re.DOTALL)
QUIET = 0.1
"""Cores that others may use on a machine that counts as quiet."""

Results = dict[str, Any]


def stored() -> Results:
    """Figures by part; none before the first measurement."""
    return json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}


def table(head: list[str], rows: list[list[str]]) -> str:
    """Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def items(lines: list[str]) -> str:
    """Markdown list."""
    return "\n".join(f"- {line}" for line in lines) + "\n"


def number(value: float, digits: int = 3) -> str:
    """Figure with so many digits, without an exponent."""
    if value == 0.0:
        return "0"
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}" if "e" in text or abs(value) >= 10 ** (digits - 1) else text


def duration(seconds: float) -> str:
    """Time in the unit that suits it."""
    if seconds < 1.0:
        return f"{number(1e3 * seconds)} ms"
    if seconds < 120.0:
        return f"{number(seconds)} s"
    return f"{number(seconds / 60.0)} min" if seconds < 7200.0 else f"{number(seconds / 3600.0)} h"


def circumstances(part: Results) -> str:
    """When and on what a part was measured."""
    machine, busy = part["machine"], part["cores_busy_before"]
    others = "" if busy is None else f"; before this part others kept {busy:.2f} cores busy"
    if busy is not None and busy > QUIET:
        others += ", so that wall times are too long"
    return (
        f"Measured {part['measured'][:10]} on {machine['cores']} cores ({machine['processor']}), Python "
        f"{machine['python']}, Exudyn {machine['exudyn']}, numba {machine['numba']}, pypardiso {machine['pypardiso']}; "
        f"load average when the command began {part['load_at_start']:.2f}{others}."
    )


# -- start-up ------------------------------------------------------------------------------------------------------


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
                    "What bounds it: imports of numba, SciPy and the package itself are half of a warm start, reading "
                    "the kernels and looking for the static state the rest. xarray, finite elements, Exudyn and what "
                    "draws are not loaded. Several runs in one process would pay this once.",
                    f"The first run compiles for {duration(cold['processor_s'] - warm['processor_s'])} of processor "
                    "time; kernels compiled at installation would save it.",
                ]
            ),
        ]
    )


# -- transmission error tables -------------------------------------------------------------------------------------


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
            "## Tables of the transmission error\n",
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
                    f"What bounds it: both gears' compliance, up to {100 * share:.0f} % of a curve: right-hand sides "
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
                    f"{first['states']}, {duration(last['per_state_s'])} in one of {last['states']}. What bounds it: "
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
                    "Processor times. What bounds CalculiX: a factorisation of all unknowns in every contact "
                    "iteration of every position, where the superelement has one per gear. More cases: "
                    "[calculix/README.md](calculix/README.md).",
                ]
            ),
        ]
    )


# -- dynamics ------------------------------------------------------------------------------------------------------


def way_of(part: Results, name: str) -> Results:
    """Row of one way."""
    found: Results = next(row for row in part["ways"] if row["way"].startswith(name))
    return found


def errors_of(part: Results, method: str, step: float, variant: str = "bushing") -> list[float | None]:
    """Amplitude errors of the overall DTE at the three frequencies; None where Exudyn cut the step."""
    errors: list[float | None] = next(
        row["overall"]
        for row in part["amplitudes"]
        if row["variant"] == variant and row["method"] == method and abs(row["step"] / step - 1.0) < 1e-9
    )
    return errors


def percent(value: float | None) -> str:
    """Error as shown."""
    return "step cut" if value is None else f"{100 * value:.3f} %"


def ways_table(part: Results) -> str:
    """Table of the ways to solve the same equations."""
    rows = [
        [
            row["way"],
            str(row["bodies"]),
            str(row["meshes"] if "no meshes" not in row["way"] else 0),
            str(row["steps"]),
            duration(row["simulated_s"]),
            duration(row["wall_s"]),
            number(row["microseconds_per_step"]),
            number(row["ratio"]),
            duration(row["run_up_s"]),
            f"{row['peak_memory_MB']:.0f} MB",
            percent(errors_of(part, row["method"], part["step"])[-1]) if row["method"] else "-",
        ]
        for row in part["ways"]
    ]
    head = [
        "way",
        "bodies",
        "meshes",
        "steps",
        "simulated",
        "wall",
        "µs per step",
        "times the compiled solver",
        "30 s would take",
        "peak memory",
        "amplitude error at 6.4 kHz",
    ]
    return table(head, rows)


def ways_bounds(part: Results) -> str:
    """Tell what bounds each way."""
    bare, element = way_of(part, "no meshes at all"), way_of(part, "one GenericODE2, compiled, RK44")
    shares = part["shares"]
    own = bare["microseconds_per_step"] / element["microseconds_per_step"]
    rest = 1.0 - shares["bearings"] - shares["meshes"]
    return items(
        [
            "Python function per mesh: full Newton differentiates each function numerically, two calls per coordinate "
            "and mesh in every step; modified Newton keeps the matrix, and the calls for the residual are left. "
            "Compiling the functions would leave the calls themselves.",
            "User-function loads: nothing is shared between them, so a mesh reads its nodes and computes its force "
            "four to six times per stage. One function for all meshes, the next row, is what that allows.",
            f"One GenericODE2, RK44: {100 * own:.0f} % of a step is Exudyn's own right-hand side (the row without "
            "meshes), the rest the call into Python with lists of coordinates. Meshes as a C++ object of Exudyn "
            "would save that rest.",
            "Compiled solver: one evaluation of the equations a step by the multistep method, four by RK4. Without "
            f"bearings a step costs {100 * shares['bearings']:.0f} % less, without meshes "
            f"{100 * shares['meshes']:.0f} % less; {100 * rest:.0f} % are bodies and the method. It is arithmetic on "
            "one core; several runs side by side in vector units would share it.",
        ]
    )


def run_up_table(part: Results) -> str:
    """Table of the run-ups."""
    rows = [("alone", row) for row in part["run_ups"]["alone"]] + [("two at once", part["run_ups"]["two_at_once"])]
    if part.get("run_up_by_tables"):
        rows.append(("alone, law table", part["run_up_by_tables"]))
    return table(
        [
            "variant",
            "",
            "method",
            "simulated",
            "wall",
            "processor time",
            "step",
            "steps",
            "processor µs per step",
            "bodies",
            "meshes",
            "file",
            "peak memory",
        ],
        [
            [
                row["variant"],
                how,
                row["method"],
                duration(row["simulated_s"]),
                duration(row["wall_s"]),
                duration(row["processor_s"]),
                f"{1e6 * row['step']:.2f} µs",
                number(row["steps"], 8),
                number(row["microseconds_per_step"]),
                str(row["bodies"]),
                str(row["meshes"]),
                f"{row['file_MB']:.0f} MB",
                f"{row['peak_memory_MB']:.0f} MB",
            ]
            for how, row in rows
        ],
    )


def run_up_of(part: Results, variant: str) -> Results:
    """Run-up of a variant alone."""
    found: Results = next(row for row in part["run_ups"]["alone"] if row["variant"] == variant)
    return found


def run_up_bounds(part: Results) -> str:
    """Tell what bounds a run-up, alone and beside another."""
    steps = way_of(part, f"compiled solver, {run_up_of(part, 'bushing')['method']}")["microseconds_per_step"]
    share = steps / run_up_of(part, "bushing")["microseconds_per_step"]
    return items(
        [
            f"Of the processor time of the bushing variant {100 * share:.0f} % are steps, the rest signals and powers, "
            "filter and files.",
            f"Cores: two run-ups on two cores each take {part['run_ups']['slowdown_of_two_at_once']:.2f} times the "
            "wall time of one alone (1 where nothing is shared, 2 on one core); they share memory bandwidth and the "
            "processor's clock, no data.",
        ]
    )


def amplitude_table(part: Results) -> str:
    """Table of amplitude errors."""
    rows = []
    for row in part["amplitudes"]:
        cells = [
            "step cut" if a is None else f"{100 * a:.3f} ({100 * b:.3f})"
            for a, b in zip(row["overall"], row["high_speed"], strict=True)
        ]
        method = row["method"] + (" (chosen)" if row["chosen"] else "")
        rows.append([row["variant"], method, f"{1e6 * row['step']:.2f} µs", *cells])
    return table(["variant", "method", "step", "1 kHz", "3 kHz", "6.4 kHz"], rows)


AMPLITUDES = (
    "Error of amplitudes at the high-speed mesh frequency at constant speed, against RK4 at 2.5 µs: overall DTE and, "
    "in brackets, DTE of the high-speed mesh, percent."
)


def growth_section(part: Results) -> str:
    """Table of the growth with the model."""
    rows = part["growth"]
    first, last = rows[0], max(rows, key=lambda row: row["meshes"])
    planets = (last["compiled_microseconds_per_step"] - first["compiled_microseconds_per_step"]) / (
        last["planets"] - first["planets"]
    )
    most = max((row for row in rows), key=lambda row: row["stages"])
    stages = (most["compiled_microseconds_per_step"] - first["compiled_microseconds_per_step"]) / (
        most["stages"] - first["stages"]
    )
    return "\n".join(
        [
            "### Growth with planets and stages\n",
            "Spur gearboxes: a planetary stage, then parallel stages; variant bushing; µs per step.\n",
            table(
                ["planets", "stages", "bodies", "meshes", "bearings", "compiled", "Exudyn RK44", "ratio"],
                [
                    [
                        *(str(row[key]) for key in ("planets", "stages", "bodies", "meshes", "bearings")),
                        number(row["compiled_microseconds_per_step"]),
                        number(row["exudyn_microseconds_per_step"]),
                        number(row["ratio"]),
                    ]
                    for row in rows
                ],
            ),
            items(
                [
                    f"Linear in what is added: {planets:.2f} µs for a planet (a body, two meshes, two bearings), "
                    f"{stages:.2f} µs for a stage (a body, a mesh, two bearings). What bounds it is arithmetic, body "
                    "by body; equal planets side by side in vector units would make the next ones cheaper.",
                ]
            ),
        ]
    )


def dynamics_section(part: Results) -> str:
    """All tables of the dynamics."""
    way = part["ways"][-1]
    return "\n".join(
        [
            "## Dynamics\n",
            f"{circumstances(part)} GRC 750 kW, variant bushing: {way['bodies']} bodies, {way['meshes']} meshes, "
            f"{way['bearings']} bearings, {way['coordinates']} coordinates.\n",
            "### Ways to solve the same equations\n",
            f"Step {1e6 * part['step']:.2f} µs for all, in turns in one process; medians of {part['rounds']} rounds, "
            "ratios within a round, µs per step of processor time. Peak memory in a process of its own. Ways with the "
            "same time integration and step have its amplitude error, measured on one of them; "
            "step cut: Newton failed, and Exudyn went on with half the step.\n",
            ways_table(part),
            ways_bounds(part),
            "### Run-ups with results stored at 20 kHz\n",
            f"Medians of {part['run_up_rounds']} rounds, each run in a process of its own. Wall time above processor "
            "time is waiting for a core that others used.\n",
            run_up_table(part),
            run_up_bounds(part),
            "### Amplitude error\n",
            f"{AMPLITUDES}\n",
            amplitude_table(part),
            items(
                [
                    "What bounds the step: the excitation at the top of the band. At twice that frequency, 12.8 kHz, "
                    "every method here has fewer than five steps a cycle.",
                ]
            ),
            growth_section(part),
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


def elastic_section(part: Results) -> str:
    """Tables of the cost of elastic bodies."""
    *bodies, kept = part["reductions"]
    steps, frames = part["steps"], part["frames"]
    _, fixed, floating = frames
    return "\n".join(
        [
            "## Elastic bodies\n",
            f"{circumstances(part)} GRC 750 kW.\n",
            "### Reduction, once for a shape\n",
            table(
                ["body", "unknowns", "coordinates", "takes"],
                [
                    [row["body"], number(row["unknowns"], 6), str(row["coordinates"]), duration(row["seconds"])]
                    for row in bodies
                ],
            ),
            items(
                [
                    f"Kept on disk ({kept['file_MB']:.0f} MB), the whole assembly takes {duration(kept['seconds'])}.",
                    "What bounds it: factorisation of the solids, and the search for their free vibrations.",
                ]
            ),
            "### A step with more and more elastic bodies, compiled solver\n",
            f"In turns in one process, each at the step that its run chooses; medians of {part['rounds']} rounds, "
            "ratios to the variant bushing within a round. A run takes signals and energies of every step as well, "
            "files aside.\n",
            table(
                ["elastic", "coordinates", "step", "µs per step", "ratio", "run, per simulated second", "ratio"],
                [
                    [
                        row["elastic"],
                        str(row["coordinates"]),
                        f"{1e6 * row['step']:.2f} µs",
                        number(row["microseconds_per_step"]),
                        number(row["ratio_of_a_step"]),
                        duration(row["seconds_per_second"]),
                        number(row["ratio_of_a_run"]),
                    ]
                    for row in steps
                ],
            ),
            items(
                [
                    "What bounds it: matrices of the bodies, read once for each evaluation. Vibrations of "
                    "lightly damped bodies shorten the step; fewer seats on the housing would save most.",
                ]
            ),
            "### One shaft in a floating frame\n",
            f"Exudyn by generalized-alpha, high-speed shaft alone elastic, step {1e6 * part['exudyn_step']:.0f} µs; "
            "processor time.\n",
            table(
                ["shaft", "coordinates", "µs per step", "ratio"],
                [
                    [
                        row["shaft"],
                        str(row["coordinates"]),
                        number(row["microseconds_per_step"]),
                        number(row["ratio"]),
                    ]
                    for row in frames
                ],
            ),
            items(
                [
                    f"The floating frame costs {number(floating['ratio'] / fixed['ratio'], 2)} times the frame that "
                    "does not turn: its forces go through Python functions and its matrices depend on the state. It is "
                    "there to check the other by.",
                ]
            ),
        ]
    )


# -- non-linear bearings -------------------------------------------------------------------------------------------


def bearings_section(part: Results) -> str:
    """Tables of the cost of bearings that follow their rolling elements."""
    rows, runs = part["rows"], part["runs"]
    every = runs[-1]
    added = 1e-6 * every["added_per_row"] * every["rows"] * part["run_up"] / part["step"]
    return "\n".join(
        [
            "## Non-linear bearings\n",
            f"{circumstances(part)} In turns in one process, medians of {part['rounds']} rounds, ratios within a "
            "round; processor time.\n",
            "### One row, half of its elements loaded, the cage turning\n",
            table(
                ["row", "µs", "of a linear connector"],
                [[row["row"], number(row["microseconds"], 2), number(row["ratio"], 2)] for row in rows],
            ),
            "### A step of the GRC, variant bushing, compiled solver\n",
            f'`law = "iso16281"`, `cage = "turning"`; steps of {1e6 * part["step"]:.2f} µs with one evaluation each, '
            "signals and files aside.\n",
            table(
                [
                    "non-linear",
                    "rows",
                    "rolling elements",
                    "tables",
                    "µs per step",
                    "ratio",
                    f"run-up of {number(part['run_up'])} s",
                    "added per row and evaluation",
                ],
                [
                    [
                        str(row["bearings"]),
                        str(row["rows"]),
                        str(row["elements"]),
                        f"{number(row['table_MB'], 2)} MB",
                        number(row["microseconds_per_step"]),
                        number(row["ratio"]),
                        duration(row["run_up_s"]),
                        f"{number(row['added_per_row'], 2)} µs",
                    ]
                    for row in runs
                ],
            ),
            items(
                [
                    "What bounds it: each evaluation, one a step, follows every loaded element through its table; "
                    f"that adds {duration(added)} to the run-up for all {every['bearings']}.",
                ]
            ),
        ]
    )


def steady_section(part: Results) -> str:
    """Tables of steady responses over speed."""
    rows = [
        [
            row["variant"],
            row["level"],
            "yes" if row["refined"] else "no",
            str(row["speeds"]),
            duration(row["processor_s"]),
            duration(row["processor_s"] / row["speeds"]),
            f"{row['processor_s'] / part['run_ups'][row['variant']]:.2g}",
        ]
        for row in part["responses"]
    ]
    growth = [
        [str(row["harmonics"]), str(row["combinations"]), str(row["lines"]), duration(row["processor_s"])]
        for row in part["growth"]
    ]
    return "\n".join(
        [
            "## Steady response over speed\n",
            f"{circumstances(part)} GRC, 400 speeds of the carrier from 0 to 215 rpm, mean system and signals "
            f"included; processor time of one thread. The last column is over that of a run-up of 30 s.\n",
            table(["variant", "level", "speeds added at resonances", "speeds", "all", "a speed", "run-ups"], rows),
            "Lines, variant bushing, level parametric, no speeds added:\n",
            table(["harmonics", "sum of multiples of combinations", "lines", "all"], growth),
            items(
                [
                    "What bounds it: half of a speed is the compliance of each line, a dense solution of the mean "
                    "system. It grows with the number of lines and the third power of the coordinates.",
                ]
            ),
        ]
    )


def loads_section(part: Results) -> str:
    """Table of the cost of a life."""
    return "\n".join(
        [
            "## A life under turbine data\n",
            f"{circumstances(part)} {part['minutes']} minutes of turbine data, GRC, variant bushing, tables there "
            "before: "
            f"read, counted, static balance at 12 angles, gears, bearings. Processor time, medians of {part['rounds']} "
            f"rounds; stresses of the pairs, once: {number(part['stresses_s'])} s.\n",
            table(["loads", "s"], [[row["loads"], number(row["processor_s"])] for row in part["rows"]]),
        ]
    )


def studies_section(part: Results) -> str:
    """Tables of studies."""
    own = part["overhead"]
    rows = [
        [
            row["what"],
            str(row["points"]),
            duration(row["wall_here_s"]),
            duration(row["wall_1_s"]),
            duration(row["wall_2_s"]),
            f"{100 * row['efficiency']:.0f} %",
            f"{row['memory_MB']:.0f} MB",
        ]
        for row in part["efficiency"]
    ]
    return "\n".join(
        [
            "## Studies\n",
            f"{circumstances(part)} The same points without workers, by one worker and by two, started and warm; "
            "wall time, so that two free cores are needed. A worker uses one core, a study without workers may use "
            "a second one in part. Efficiency is the time of one worker over twice that of two.\n",
            table(["points with", "points", "no worker", "one", "two", "efficiency", "peak memory of a worker"], rows),
            items(
                [
                    f"{own['points']} modal points of a small gearbox: {number(own['in_study_ms'])} ms of processor "
                    f"time each in a study, {number(own['alone_ms'])} ms in a loop of one's own: "
                    f"{number(own['overhead_ms'])} ms for hash, journal and dataset. To find all of them finished "
                    f"takes {duration(own['restart_s'])}.",
                ]
            ),
        ]
    )


SECTIONS = {
    "startup": startup_section,
    "tables": tables_section,
    "dynamics": dynamics_section,
    "grids": grids_section,
    "elastic": elastic_section,
    "bearings": bearings_section,
    "steady": steady_section,
    "loads": loads_section,
    "studies": studies_section,
}


def page(results: Results) -> str:
    """All tables as one page."""
    head = (
        "# What it costs\n\nWritten by `make benchmarks` (`python benchmarks/run_all.py`) from `results.json`; "
        "no figure here is written by hand.\n"
    )
    return "\n".join([head, *(SECTIONS[name](results[name]) for name in SECTIONS if name in results)])


DOCUMENT_WIDTH = 100


# -- quoted elsewhere ----------------------------------------------------------------------------------------------


def wrapped(text: str) -> str:
    """Paragraph with lines as long as documents have them."""
    return textwrap.fill(text, DOCUMENT_WIDTH, break_long_words=False, break_on_hyphens=False)


def in_short(results: Results) -> str:
    """Lines for the README."""
    dynamics, tables, startup = results["dynamics"], results["tables"], results["startup"]
    rigid, bushing = (run_up_of(dynamics, variant) for variant in ("rigid", "bushing"))
    element, python = (
        way_of(dynamics, name) for name in ("one GenericODE2, compiled, RK44", "Python function per mesh")
    )
    curves = [row["curve_s"] for row in tables["pairs"]]
    calculix = tables["calculix"]
    errors = [errors_of(dynamics, row["method"], row["step"], row["variant"])[-1] or 0.0 for row in (rigid, bushing)]
    parts = startup, tables, dynamics
    load, busy = (max(part[key] or 0.0 for part in parts) for key in ("load_at_start", "cores_busy_before"))
    return "\n".join(
        [
            table(
                ["what", "takes"],
                [
                    [
                        f"run-up of {number(bushing['simulated_s'])} s, content to 6.4 kHz, results stored",
                        f"bushing {duration(bushing['wall_s'])}, rigid {duration(rigid['wall_s'])}; "
                        f"{bushing['peak_memory_MB']:.0f} MB; amplitude error at 6.4 kHz "
                        f"{100 * max(map(abs, errors)):.2f} % or less",
                    ],
                    [
                        "the same equations in Exudyn, 30 s of the variant bushing",
                        f"{duration(element['run_up_s'])} with all meshes as one compiled object "
                        f"({element['ratio']:.0f} times), {duration(python['run_up_s'])} with a Python function per "
                        "mesh and numerical jacobian",
                    ],
                    [
                        f"transmission error of a pair, {tables['pairs'][0]['positions']} positions, from nothing",
                        f"{duration(min(curves))} to {duration(max(curves))}; one position of CalculiX on a coarser "
                        f"mesh: {duration(calculix['calculix_s'])}, {number(calculix['ratio'], 2)} times what the same "
                        "takes here",
                    ],
                    ["`exugear --help`", duration(start_of(startup, "--help")["wall_s"])],
                ],
            ),
            wrapped(
                f"Two cores ({dynamics['machine']['processor']}), load average at the start {load:.2f}, others kept up "
                f"to {busy:.2f} cores busy. All of it, what bounds it, and growth with planets, stages and "
                "table size: [benchmarks/results.md](benchmarks/results.md)."
            )
            + "\n",
        ]
    )


def amplitudes(results: Results) -> str:
    """Lines for the validation page."""
    return f"{wrapped(AMPLITUDES)}\n\n{amplitude_table(results['dynamics'])}"


QUOTES = {"in_short": in_short, "amplitudes": amplitudes}
QUOTED = ("README.md", "docs/quality/dynamics.md")
"""Documents that have figures between marks."""


def with_quotes(text: str, results: Results) -> str:
    """Text of a document with the figures between its marks made anew; as it was while a part is missing."""
    if not {"startup", "tables", "dynamics"} <= set(results):
        return text
    return QUOTE.sub(lambda found: f"{found[1]}{QUOTES[found[2]](results)}{found[3]}", text)
