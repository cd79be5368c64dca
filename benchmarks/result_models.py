"""Sections of the results on elastic bodies, bearings, steady responses, lives and studies."""

from __future__ import annotations

from result_text import Results, circumstances, duration, items, number, table


def elastic_section(part: Results) -> str:
    """Tables of the cost of elastic bodies."""
    *bodies, kept = part["reductions"]
    steps, frames = part["steps"], part["frames"]
    _, fixed, floating = frames
    return "\n".join(
        [
            "## Flexible bodies\n",
            f"{circumstances(part)} GRC 750 kW.\n",
            "### Reduction\n",
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
                    "Limited by: factorisation of the solids, and the search for their free vibrations.",
                ]
            ),
            "### Steps with more flexible bodies, compiled solver\n",
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
                    "Limited by: matrices of the bodies, read once for each evaluation. Vibrations of "
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


def bearings_section(part: Results) -> str:
    """Tables of the cost of bearings that follow their rolling elements."""
    rows, runs = part["rows"], part["runs"]
    every = runs[-1]
    added = 1e-6 * every["added_per_row"] * every["rows"] * part["run_up"] / part["step"]
    return "\n".join(
        [
            "## Nonlinear bearings\n",
            f"{circumstances(part)} In turns in one process, medians of {part['rounds']} rounds, ratios within a "
            "round; processor time.\n",
            "### One row, half of its elements loaded, moving cage\n",
            table(
                ["row", "µs", "of a linear connector"],
                [[row["row"], number(row["microseconds"], 2), number(row["ratio"], 2)] for row in rows],
            ),
            "### A step of the GRC, variant bushing, compiled solver\n",
            f'`model = "iso16281"`, `cage = "turning"`; steps of {1e6 * part["step"]:.2f} µs with one evaluation each, '
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
                    "Limited by: each evaluation, one a step, follows every loaded element through its table; "
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
            str(part["coordinates"][row["variant"]]),
            row["method"],
            "yes" if row["refined"] else "no",
            str(row["speeds"]),
            duration(row["wall_s"]),
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
    first, *_ = part["dissipation"]
    dissipation = [
        [row["what"], *(f"{row[key] / first[key]:.2f}" for key in ("processor_s", "run_up_s"))]
        for row in part["dissipation"]
    ]
    return "\n".join(
        [
            "## Steady-state response\n",
            f"{circumstances(part)} GRC, 400 speeds of the carrier from 0 to 215 rpm, mean system and signals "
            f"included; wall time, and processor time of all processes; flexible is that with elastic shafts. The "
            f"last column is over the processor time of a run-up of 30 s.\n",
            table(
                ["variant", "coordinates", "method", "speeds added", "speeds", "wall", "all", "a speed", "run-ups"],
                rows,
            ),
            "Lines, variant bushing, method parametric, no speeds added:\n",
            table(["harmonics", "sum of multiples of combinations", "lines", "all"], growth),
            "Damping and friction over damping times alone, variant bushing:\n",
            table(["dissipation", "response, parametric", "run-up"], dissipation),
            *([whole_flexible(part["whole"])] if "whole" in part else ()),
            items(
                [
                    "Limited by: half of a speed is the compliance of each line, a dense solution of the mean "
                    "system. It grows with the number of lines and the third power of the coordinates.",
                ]
            ),
        ]
    )


def whole_flexible(row: Results) -> str:
    """Return the cost of the response with all bodies flexible as a sentence."""
    return (
        f"All bodies flexible ({row['coordinates']} coordinates), parametric: averaged system "
        f"{duration(row['prepared_s'])}; choice of {row['lines']} of {row['lines_at_most']} orders that the flexible "
        f"ring gear couples {duration(row['chosen_s'])}; a speed {duration(row['speed_s'])}.\n"
    )


def excitations_section(part: Results) -> str:
    """Table of the cost of stated excitations by method."""
    alone = {row["method"]: row["speed_s"] for row in part["rows"] if row["excitations"] == 0}
    rows = [
        [
            row["method"],
            str(row["excitations"]),
            str(row["lines"]),
            duration(row["speed_s"]),
            f"{row['speed_s'] / alone[row['method']]:.2g}",
        ]
        for row in part["rows"]
    ]
    return "\n".join(
        [
            "## Excitations beside the gears\n",
            f"{circumstances(part)} GRC, variant bushing; torques of one order each on four bodies; time of one thread "
            "per speed, the best of two to eight rounds, without the averaged system that is found once. The last "
            "column is over the time without excitations.\n",
            table(["method", "excitations", "lines", "a speed", "ratio"], rows),
            items(
                [
                    "Limited by: each line has a frequency of its own, and so a dense system of equations of its own, "
                    "which takes half of what an excitation adds with parametric; the rest is what reads and combines "
                    "the lines. Orders of different excitations share no line.",
                ]
            ),
        ]
    )


def loads_section(part: Results) -> str:
    """Table of the cost of a life."""
    return "\n".join(
        [
            "## Life with turbine data\n",
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


def report_section(part: Results) -> str:
    """Table of the making of the report and of its page."""
    shown = part["browser"]
    rows = [
        ["`exugear report`, wall", duration(part["wall_s"]), "20 s"],
        ["its processor time", duration(part["processor_s"]), ""],
        ["size of the page", f"{number(part['page_MB'])} MB", "6 MB"],
    ]
    if shown is not None:
        rows.append(["first paint in the browser", duration(shown["first_paint_s"]), "2 s"])
        rows.append(["all of it ready", duration(shown["ready_s"]), "5 s"])
    return "\n".join(
        [
            "## Report\n",
            f"{circumstances(part)} Results as `make demo` makes them: two variants, two inertia sets, run-ups of "
            f"30 s; medians of {part['rounds']} rounds. Chromium at the size of a desk, each time started afresh, "
            "drawn by the processor; times from when the page is asked for.\n",
            table(["what", "takes", "asked for: less than"], rows),
            items(
                [
                    "Limited by: spectra of some hundred signals in one process, variations of both compliant "
                    "models beside it in another. In the browser it is the drawing of solids without graphics.",
                ]
            ),
        ]
    )
