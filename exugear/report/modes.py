"""Section of the report on modes: those near the target frequency, where their energy sits, and all in a list."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import xarray as xr

from exugear.model.choice import Choice
from exugear.pictures.mode_diagrams import plot_mode_energies
from exugear.report import page
from exugear.report.context import VISIBLE_SHARE, Context, file_part, words_of
from exugear.report.mode_pictures import target_mode_pictures
from exugear.report.sensitivity import sensitivity_part
from exugear.report.stored import StoredResults
from exugear.spectra.mode_report import NEAR, ModeReport, nearest_mode, report_mode


def modes_section(context: Context, results: StoredResults) -> str:
    """Show the modes near the target frequency and what they depend on; without a target, list all modes."""
    modes = results.modes
    if not modes:
        return ""
    for model, data in modes.items():
        growth = float(data.attrs["growth_rate"])
        if growth > 0.0:
            unstable = f"{words_of(model)}: unstable, disturbances grow by up to {growth:.3g} 1/s."
            context.notes.statements.append(unstable)
    lists = [_all_modes(model, data) for model, data in modes.items()]
    if context.target is None:
        return page.section("Modes", *lists)
    return page.section(f"Modes near {context.target:.0f} Hz", *_modes_near(context, modes, context.target), *lists)


def _modes_near(context: Context, modes: Mapping[Choice, xr.Dataset], target: float) -> Iterator[str]:
    """Tell of the modes near the target (Hz), what they depend on, and what would bring one there."""
    rows, energies = [], []
    for model, data in modes.items():
        nearest = nearest_mode(data, target)
        visible = nearest_mode(data, target, VISIBLE_SHARE)
        if nearest is None or visible is None:
            continue
        rows.append(_nearest_row(model, nearest, target))
        if visible.index != nearest.index:
            rows.append(_nearest_row(model, visible, target))
        context.notes.statements.append(_nearest_statement(model, data, nearest, visible, target))
        energies.append(_energies_picture(context, model, visible))
    sensitivity, matches = sensitivity_part(context, modes, target)
    yield page.table(rows, ("inertias", "what moves"))
    yield page.paragraph(
        "Share: of the mode in the mobility of the overall transmission error; amplification: overall transmission "
        "error at resonance per transmission error of the mesh named. Where the nearest mode has a share under "
        f"{100 * VISIBLE_SHARE:g} %, the nearest that has more stands below it. Near means within {100 * NEAR:g} %."
    )
    yield target_mode_pictures(context, modes, matches, target)
    yield page.folded("Where the energy of these modes sits", "".join(energies))
    yield sensitivity


def _nearest_row(model: Choice, mode: ModeReport, target: float) -> dict[str, object]:
    return {
        "variant": model.variant,
        "inertias": f"{model.inertias} ({model.mesh_law})",
        "frequency / Hz": f"{mode.frequency:.1f}",
        "near": "yes" if mode.is_near(target) else "no",
        "damping / %": f"{100 * mode.damping_ratio:.2f}",
        "share / %": f"{100 * mode.share:.1f}",
        "amplification": f"{mode.amplification:.2f} ({mode.mesh})",
        "what moves": mode.name,
    }


def _nearest_statement(model: Choice, data: xr.Dataset, nearest: ModeReport, visible: ModeReport, target: float) -> str:
    factor = float(data.attrs["housing_factor"])
    subject = f"Variant {words_of(model)}, housing factor {factor:g}"
    if visible.is_near(target):
        return (
            f"{subject}: a mode at {visible.frequency:.0f} Hz, near {target:.0f} Hz, which the overall transmission "
            f"error sees with a share of {100 * visible.share:.0f} % ({visible.name})."
        )
    if nearest.is_near(target):
        return (
            f"{subject}: a mode at {nearest.frequency:.0f} Hz, near {target:.0f} Hz, but the overall transmission "
            f"error hardly sees it (share {100 * nearest.share:.2g} %; {nearest.name})."
        )
    return (
        f"{subject}: no mode within {100 * NEAR:g} % of {target:.0f} Hz; the nearest that the overall transmission "
        f"error sees is at {visible.frequency:.0f} Hz ({visible.name})."
    )


def _energies_picture(context: Context, model: Choice, mode: ModeReport) -> str:
    path = context.picture_path(f"energies-{file_part(model)}")
    title = f"{words_of(model)}: {mode.frequency:.0f} Hz, damping {100 * mode.damping_ratio:.1f} %"
    plot_mode_energies(mode.strain, mode.kinetic, path, title=title)
    return page.picture(path, title)


def _all_modes(model: Choice, data: xr.Dataset) -> str:
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    rows = [
        {
            "no.": mode.index + 1,
            "frequency / Hz": f"{mode.frequency:.1f}",
            "damping / %": f"{100 * mode.damping_ratio:.2f}",
            "share / %": f"{100 * mode.share:.2f}",
            "amplification": f"{mode.amplification:.2f}",
            "by mesh": mode.mesh if mode.amplification >= 0.01 else "–",
            "what moves": mode.name,
        }
        for mode in reports
    ]
    return page.folded(f"All {len(rows)} modes of {words_of(model)}", page.table(rows, ("what moves", "by mesh")))
