"""Section "Modes and orders": Campbell diagram and list of modes of each model, and the bodies that move in them."""

from __future__ import annotations

from typing import Any

import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.parts import RPM
from exugear.report.findings.context import VISIBLE_SHARE, words_of
from exugear.report.findings.words import percentages
from exugear.report.parts.material import Material, Part, model_name
from exugear.report.web import pieces
from exugear.report.web.arrays import rounded
from exugear.report.web.pieces import Cell
from exugear.report.web.stage import stage_data
from exugear.report.web.stage_figure import stage_figure
from exugear.results.spectra.mode_report import report_mode
from exugear.results.spectra.run_spectra import LEAST_SHARE

DEFORMED = 32
"""Modes in which elastic bodies deform in the page: those of resonances, and those that are seen most."""


def modes_section(material: Material) -> Part:
    """Show the modes of all models."""
    modes = material.results.modes
    if not modes:
        return Part("")
    for model, data in modes.items():
        growth = float(data.attrs["growth_rate"])
        if growth > 0.0:
            unstable = f"{words_of(model)}: unstable, disturbances grow by up to {growth:.3g} 1/s."
            material.context.notes.statements.append(unstable)
    models = {model_name(model): _model(material, model, data) for model, data in modes.items()}
    campbell = pieces.figure(
        "campbell",
        "Campbell diagram",
        "Lines across: modes that the transmission error sees. Dots: an order meets a mode; the larger, the more it is "
        "amplified. Click a dot to see the mode move.",
        "The list of modes below names each with its frequency, damping and amplification.",
    )
    chooser = pieces.element(
        "div",
        pieces.element("label", "Model " + pieces.element("select", "", id="model")),
        class_="controls scripts-only",
    )
    # Without run-ups nothing else shows the modes in motion.
    stage = "" if material.groups else _stage_alone()
    lists = [_all_modes(material, model, data) for model, data in modes.items()]
    framed = pieces.element("div", campbell, class_="scripts-only")
    html = pieces.section("Modes and orders", chooser, framed, stage, *lists, name="modes")
    return Part(html, {"models": models}, "Modes and orders", "modes")


def _stage_alone() -> str:
    return pieces.element("div", stage_figure(), class_="scripts-only")


def _model(material: Material, model: Choice, data: xr.Dataset) -> dict[str, Any]:
    material.context.tell(f"bodies and modes of {words_of(model)}")
    assembly = material.context.assembled(model)
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    labels = material.words.labels
    return {
        "words": words_of(model),
        "variant": model.variant,
        "stage": stage_data(
            assembly, data["shape"].to_numpy(), labels, material.arrays, _deformed(material, model, data)
        ),
        "modes": [
            {
                "frequency": rounded(report.frequency, 6),
                "damping": rounded(report.damping_ratio, 4),
                "words": material.words.moves(data, report.index),
                "seen": report.share >= LEAST_SHARE,
                "amplification": rounded(report.amplification, 4),
                "mesh": material.words.of(report.mesh),
            }
            for report in reports
        ],
        "fastest": rounded(_fastest(material, model), 5),
    }


def _fastest(material: Material, model: Choice) -> float:
    """Highest speed (rpm) of the run-ups of a model, or of the load cases."""
    speeds = [
        float(group.runs[model.variant].spectra.speed.max())
        for group in material.groups
        if model.variant in group.runs and group.choice(model.variant) == model
    ]
    if speeds:
        return max(speeds) / RPM
    cases = material.context.gearbox.load_cases.values()
    ends = [abs(speed) for case in cases for speed in (case.start_speed, case.end_speed or 0.0)]
    return max([*ends, RPM]) / RPM


def _deformed(material: Material, model: Choice, data: xr.Dataset) -> set[int]:
    if not model.variant.is_elastic:
        return set()
    matched = {
        own.finding.mode
        for group in material.groups
        if model.variant in group.runs and group.choice(model.variant) == model
        for own in group.ranked[model.variant]
        if own.finding.mode is not None
    }
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    seen = sorted((report for report in reports if report.share >= VISIBLE_SHARE), key=lambda one: -one.amplification)
    most = [*sorted(matched), *(one.index for one in seen if one.index not in matched)]
    return set(most[: max(DEFORMED, len(matched))])


def _all_modes(material: Material, model: Choice, data: xr.Dataset) -> str:
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    rows = [
        {
            "No.": Cell(str(mode.index + 1), mode.index),
            "Frequency / Hz": Cell(f"{mode.frequency:.1f}", mode.frequency, f"mode:{model_name(model)}:{mode.index}"),
            "Damping / %": Cell(f"{100 * mode.damping_ratio:.2f}", mode.damping_ratio),
            "Share / %": Cell(f"{100 * mode.share:.2f}", mode.share),
            "Amplification": Cell(f"{mode.amplification:.2f}", mode.amplification),
            "by mesh": material.words.of(mode.mesh) if mode.amplification >= 0.01 else "–",
            "What moves": material.words.moves(data, mode.index),
            "What gives": percentages(material.words.gives(data, mode.index)),
        }
        for mode in reports
    ]
    title = f"All {len(rows)} modes of {words_of(model)}"
    table = pieces.table(
        rows,
        ("by mesh", "What moves", "What gives"),
        caption=title,
        name=f"modes-{model_name(model)}",
        hidden=("Share / %", "by mesh"),
        sortable=True,
    )
    note = (
        "Share: of the mode in the mobility of the overall transmission error; amplification: overall transmission "
        "error at resonance per transmission error of the mesh named."
    )
    return pieces.folded(title, pieces.paragraph(note, "note") + table)
