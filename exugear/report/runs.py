"""Section of the report on run-ups: waterfalls, order levels, and the resonances that only one variant shows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from exugear.dynamics.signals import BALANCE_TERMS, MESH_TIMES, energy_residual
from exugear.model.parts import RPM
from exugear.pictures.run_diagrams import plot_order_levels, plot_waterfalls
from exugear.report import page
from exugear.report.context import REFERENCE_VARIANT, Context
from exugear.report.stored import StoredResults, run_key
from exugear.results.run_file import load_run
from exugear.runs.trust import verdict_of
from exugear.spectra.comparison import Comparison, compare
from exugear.spectra.orders import order_lines
from exugear.spectra.run_spectra import Finding, VariantRun

MESH_TIME_LABELS = ("longest pull of a mesh", "longest time teeth are apart", "longest time outside a table")
"""Labels of `exugear.dynamics.signals.MESH_TIMES`, in their order."""


def runs_section(context: Context, results: StoredResults) -> str:
    """Show the run-ups, those of one load case, law and inertia set beside each other, the default set first."""
    groups: dict[tuple[str, str, str], list[VariantRun]] = {}
    for run in results.runs:
        groups.setdefault(run_key(run.attributes), []).append(run)
    default = context.gearbox.case.default_inertias
    keys = sorted(groups, key=lambda key: (key[2] != default, key))
    return page.section("Run-ups", *(_group(context, key, groups[key]) for key in keys))


def _group(context: Context, key: tuple[str, str, str], runs: Sequence[VariantRun]) -> str:
    """Section of the runs of one load case, law and inertia set."""
    load_case, law, inertias = key
    label = f"load case {load_case}, law {law}, inertias {inertias}, housing factor " + ", ".join(
        sorted({f"{float(run.attributes['housing_factor']):g}" for run in runs})
    )
    context.tell(f"waterfalls, {label}")
    reference = [run for run in runs if run.variant == REFERENCE_VARIANT]
    others = [run for run in runs if run.variant != REFERENCE_VARIANT]
    comparisons = [compare(other, reference[0]) for other in others] if reference else []
    shown = reference + others
    file_part = f"{load_case}-{law}-{inertias}"
    content = [
        _distrust_alert(runs),
        _waterfall_picture(context, shown, comparisons, label, file_part),
        *(_comparison_part(context, comparison, label) for comparison in comparisons),
        _levels_picture(context, shown, label, file_part),
        *(_all_resonances(run) for run in shown),
        page.section("What was run", page.table([_run_row(run) for run in runs], ("solver",)), level=4),
    ]
    return page.section(label[0].upper() + label[1:], *content, level=3)


def _distrust_alert(runs: Sequence[VariantRun]) -> str:
    doubtful = [f"{run.variant}: {verdict}" for run in runs if (verdict := verdict_of(run.attributes))]
    return page.alert("Not to be trusted", doubtful) if doubtful else ""


def _waterfall_picture(
    context: Context, runs: Sequence[VariantRun], comparisons: Sequence[Comparison], label: str, file_part: str
) -> str:
    lines = order_lines(context.gearbox)
    tops = [float(run.spectra.frequency[-1]) for run in runs]
    if lines:
        fundamental = max(context.gearbox.train.mesh_frequencies(2.0 * math.pi).values())
        fastest = max(float(run.spectra.speed.max()) for run in runs)
        tops.append(1.1 * fundamental * fastest / (2.0 * math.pi))
    top = min(tops)
    marks = {c.first.variant: [finding.strongest for finding in c.only_first] for c in comparisons}
    path = context.picture_path(f"waterfall-{file_part}")
    spectra = {run.variant: run.spectra for run in runs}
    plot_waterfalls(spectra, lines, path, marks=marks, highest_frequency=top)
    caption = f"Overall transmission error over speed; {label}. {runs[0].spectra.description}."
    if comparisons:
        caption += (
            f" Circles: resonances that variant {REFERENCE_VARIANT} does not show, numbered as in the table below."
        )
    return page.picture(path, caption)


def _comparison_part(context: Context, comparison: Comparison, label: str) -> str:
    """Table of the resonances that the reference variant does not show, and those of the reference alone in words."""
    name = comparison.first.variant
    rows = [{"no.": number, **_finding_row(finding)} for number, finding in enumerate(comparison.only_first, start=1)]
    here, reverse = _frequency_list(comparison.only_first), _frequency_list(comparison.only_second)
    title = f"Resonances in {name} and not in {REFERENCE_VARIANT}"
    context.notes.statements.append(f"{title} ({label}): {here}. In {REFERENCE_VARIANT} and not in {name}: {reverse}.")
    return page.section(
        title,
        page.table(rows, ("order", "mode")) or page.paragraph("None."),
        page.paragraph(
            f"Rule: {comparison.rule.description}. Frequencies agree with eigenfrequencies within the resolution of "
            f"the sweep. The other way round, in {REFERENCE_VARIANT} and not in {name}: {reverse}."
        ),
        level=4,
    )


def _frequency_list(findings: Sequence[Finding]) -> str:
    return ", ".join(f"{finding.resonance.frequency:.0f}" for finding in findings) + " Hz" if findings else "none"


def _all_resonances(run: VariantRun) -> str:
    rows = [_finding_row(finding) for finding in run.findings()]
    title = f"All resonances of variant {run.variant}: {len(rows)}"
    return page.folded(title, page.table(rows, ("order", "mode")))


def _finding_row(finding: Finding) -> dict[str, object]:
    pick = finding.strongest
    matched = finding.mode is not None
    return {
        "frequency / Hz": f"{finding.resonance.frequency:.0f} ± {finding.resonance.resolution:.0f}",
        "speed / rpm": f"{finding.speed:.1f}",
        "order": f"{pick.line.name} ({pick.line.order:.2f})",
        "orders that show it": len({other.line for other in finding.resonance.picks}),
        "level / dB": f"{pick.level:.1f}",
        "prominence / dB": f"{pick.prominence:.1f}",
        "eigenfrequency / Hz": f"{finding.mode_frequency:.1f}" if matched else "–",
        "mode": finding.mode_name if matched else "none within the resolution",
    }


def _levels_picture(context: Context, runs: Sequence[VariantRun], label: str, file_part: str) -> str:
    lines = order_lines(context.gearbox, 1)
    reached = [line for line in lines if any(np.isfinite(line.frequency(run.spectra.speed)).any() for run in runs)]
    if not reached:
        return ""
    path = context.picture_path(f"orders-{file_part}")
    plot_order_levels(
        {run.variant: run.spectra for run in runs}, reached, path, marks={run.variant: run.picks for run in runs}
    )
    return page.picture(path, f"Level of the overall transmission error along the mesh orders; {label}.")


def _run_row(run: VariantRun) -> dict[str, object]:
    data = load_run(run.path, ("time", *MESH_TIMES, *BALANCE_TERMS))
    times = [float(np.max(data[name].to_numpy(), initial=0.0)) for name in MESH_TIMES]
    residual = energy_residual(data)
    end = float(data["time"][-1])
    return {
        "variant": run.variant,
        "to be trusted": "NO, see above" if verdict_of(run.attributes) else "yes",
        "solver": run.attributes["solver"],
        "step / µs": f"{1e6 * float(run.attributes['step']):g}",
        "simulated / s": f"{end:.2f}" + ("" if int(run.attributes["complete"]) else " (stopped)"),
        "fastest / rpm": f"{float(run.spectra.speed.max()) / RPM:.1f}",
        "energy not accounted for": f"{residual:.1e}",
        **{f"{what} / s": f"{time:.3g}" for what, time in zip(MESH_TIME_LABELS, times, strict=True)},
    }
