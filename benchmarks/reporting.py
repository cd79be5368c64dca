"""The page of results and what documents quote of it, made of the stored figures; nothing is measured here."""

from __future__ import annotations

import re

from result_dynamics import AMPLITUDES, amplitude_table, dynamics_section, errors_of, run_up_of, way_of
from result_gears import grids_section, start_of, startup_section, tables_section
from result_models import (
    bearings_section,
    elastic_section,
    loads_section,
    report_section,
    steady_section,
    studies_section,
)
from result_text import HERE, RESULTS, Results, duration, number, stored, table, wrapped

__all__ = ["PAGE", "QUOTED", "QUOTES", "RESULTS", "page", "stored", "with_quotes"]

PAGE = HERE / "results.md"
QUOTE = re.compile(r"(<!-- figures of benchmarks/run_all.py: (\w+) -->\n).*?(<!-- end of figures -->)", re.DOTALL)
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
    "report": report_section,
}


def page(results: Results) -> str:
    """All tables as one page."""
    head = (
        "# What it costs\n\nWritten by `make benchmarks` (`python benchmarks/run_all.py`) from `results.json`; "
        "no figure here is written by hand.\n"
    )
    return "\n".join([head, *(SECTIONS[name](results[name]) for name in SECTIONS if name in results)])


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
