"""Section of the results on dynamics: ways, run-ups, amplitudes, growth."""

from __future__ import annotations

from result_text import Results, circumstances, duration, items, number, percent, table


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
                    f"{stages:.2f} µs for a stage (a body, a mesh, two bearings). It is limited by arithmetic, body "
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
            "### Solvers of the same equations\n",
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
                    "The step is limited by the excitation at the top of the band. At twice that frequency, 12.8 kHz, "
                    "every method here has fewer than five steps a cycle.",
                ]
            ),
            growth_section(part),
        ]
    )
