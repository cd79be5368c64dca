"""The command `measured`: a measured run-up next to the steady-state response."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from exugear.cli.case import assembled_by_iso, check_friction, steady_lack
from exugear.cli.console import BadInputError, FailedError
from exugear.cli.tables import Column, Outcome, Table, detail, significant
from exugear.cli.watched import WatchedProject
from exugear.gearbox.reading import GearboxFileError
from exugear.results.findings import Finding
from exugear.results.order_tracking.angle_cuts import TooShortError
from exugear.steady.evaluation.fit import FitError, ParameterFit, start_of_fit
from exugear.steady.evaluation.measured_comparison import DRAWN_UNITS
from exugear.steady.evaluation.run_up import read_run_up, response_settings
from exugear.steady.settings import Method, check_law


def measured(
    project: WatchedProject,
    name: str | None,
    method: Method,
    fitted: str | None,
    copy: Path | None,
    as_json: bool,
    whole: bool,
) -> None:
    """Compare, store and print a measured run-up of a project.

    Keys (comma-separated) are fitted to it, and a copy of the gearbox file with their values is written.
    """
    check_law(project.choice.mesh_model, method)
    run_up = read_run_up(project.gearbox, name)
    keys = [key.strip() for key in fitted.split(",")] if fitted is not None else []
    if keys:
        if method == "nonlinear":
            raise BadInputError("--fit with --method nonlinear: each value takes minutes; use --method parametric")
        start_of_fit(project.gearbox, keys)
    if copy is not None:
        if not keys:
            raise BadInputError(f"--write {copy}: requires --fit with the keys whose fitted values are written")
        project.gearbox.check_copy(copy)
    at_load = project.at_measured_load(run_up)
    response_settings(at_load.gearbox, run_up, method)
    with suppress(FailedError):  # such a failure does not apply to the selected mesh model
        if reason := steady_lack(assembled_by_iso(at_load.gearbox, at_load.choice.variant), at_load.choice.variant):
            raise BadInputError(reason)
    check_friction(at_load.gearbox, at_load.choice.mesh_model)
    at_load.begin()
    at_load.prepare()
    try:
        comparison = project.measured(run_up, method)
    except TooShortError as error:
        raise BadInputError(f"measurements.{run_up.name}.window_revolutions: {error}") from error
    fit, failure = None, ""
    if keys:
        try:
            fit = project.fit_measured(comparison, keys, method)
        except FitError as error:  # the comparison is valid without a fit
            failure = f"fit: {error}"
    lines = [
        f"Fit: {own.key} is not determined ({own.refusal})"
        if own.refusal
        else f"Fit: {own.key} = {own.value:.4g} ({own.low:.4g} to {own.high:.4g}, 95 %), {own.start:.4g} in the file"
        for own in (fit.parameters if fit is not None else ())
    ]
    if copy is not None and fit is not None:
        try:
            project.gearbox.write_copy(copy, fit.changes)
            lines.append(f"Gearbox file with the fitted numbers: {copy}")
        except (FitError, GearboxFileError) as error:
            failure = f"--write: nothing is written; {error}"
    path = at_load.measured_path(run_up.name)
    summary = {"case": project.gearbox.source, "variant": str(project.choice.variant), **comparison.summary()}
    if summary["foreign_orders"]:
        orders = ", ".join(f"{own['order']:.4g}" for own in summary["foreign_orders"][:5])
        lines.insert(0, f"Orders of no shaft or mesh: {orders}")
    fit_notes = []
    if fit is not None:
        text = f"fit: {fit.before:.2f} to {fit.after:.2f} dB (rms) without the mean of each channel, {fit.series} "
        text += "orders of channels; all other values are those of the file, such as inertias: "
        text += "errors of them shift the fit"
        fit_notes.append(Finding("note", text))
    Outcome(
        verdict=comparison.verdict,
        further=lines,
        summary={**summary, **({"fit": fitted_parameters(fit)} if fit else {}), "file": str(path)},
        tables=measured_tables(summary),
        findings=[
            *comparison.findings,
            *fit_notes,
            Finding(
                "note",
                "not noticeable: peak for rms (3 dB), an amplifier that clips before its anti-aliasing filter; an "
                "accelerometer on a cover is not the seat of a bearing",
            ),
        ],
        path=f"{path}, CSV tables, {path.with_suffix('.png').name}",
        failure=failure,
    ).show(as_json, whole)


def fitted_parameters(fit: ParameterFit) -> dict[str, Any]:
    """Summarise a fit."""
    return {
        "deviation_before_dB": fit.before,
        "deviation_dB": fit.after,
        "orders_of_channels": fit.series,
        "evaluations": fit.evaluations,
        "correlation": fit.correlation.tolist(),
        "parameters": [
            {"key": own.key, "start": own.start, "value": own.value, "interval_95_percent": [own.low, own.high],
             "refusal": own.refusal}
            for own in fit.parameters
        ],
    }  # fmt: skip


def _amplitude(key: str) -> Any:
    """Return a function that shows an amplitude in the unit of diagrams."""

    def shown(row: Mapping[str, Any]) -> str:
        unit, factor = DRAWN_UNITS[row["unit"]]
        return f"{significant(factor * row[key], 3)} {unit}"

    return shown


def _speed(row: Mapping[str, Any]) -> float | None:
    """Return the speed of a peak: measured, or else computed."""
    measured_speed: float | None = row["measured_speed_rpm"]
    return row["computed_speed_rpm"] if measured_speed is None else measured_speed


def _seen(row: Mapping[str, Any]) -> str:
    """Return the difference in speed, or which side has a peak that the other one lacks."""
    if row["measured_speed_rpm"] is None:
        return "computed only"
    if row["computed_speed_rpm"] is None:
        return "measured only"
    return "jump" if row["contact_loss"] else f"{row['speed_difference_percent']:+.2f}"


PEAKS = (
    Column("order", "order"),
    Column("channel", "channel", is_text=True),
    Column("speed\nrpm", _speed, ".0f"),
    Column("measured", _amplitude("measured_amplitude")),
    Column("computed", _amplitude("computed_amplitude")),
    Column("level dif-\nference dB", "difference_dB", "+.1f"),
    Column("speed dif-\nference %", _seen),
    detail("computed\nspeed rpm", "computed_speed_rpm", ".1f"),
)
CHANNELS = (
    Column("channel", "channel"),
    Column("quantity", lambda row: row["quantity"].replace("_", " "), is_text=True),
    Column("place", "where", is_text=True),
    Column("levels\ndB rms", "deviation_dB", ".2f"),
    Column("median dif-\nference dB", "offset_dB", "+.2f"),
)
ORDERS = (
    Column("order", "name"),
    Column("per\nrevolution", "order", ".4f"),
    Column("levels\ndB rms", "deviation_dB", ".2f"),
)
FOREIGN = (
    Column("order", lambda row: f"{row['order']:.3f}"),
    Column("amplitude\nSI", "amplitude", ".3g"),
    Column("above\nneighbours dB", "above_neighbours_dB", ".1f"),
)


def measured_tables(summary: Mapping[str, Any]) -> list[Table]:
    """Return the tables of peaks, channels, orders, and orders of no shaft or mesh."""
    low, high = summary["speeds_rpm"]
    legend = (
        f"Zero-to-peak; computed over measured. {summary['window']}; the computed order is swept along the measured "
        "speed and averaged in the same windows."
    )
    return [
        Table(f"Peaks, {low:.0f} to {high:.0f} rpm of the input", summary["peaks"], PEAKS, legend, noun="peaks"),
        Table("Channels", summary["channels"], CHANNELS, "Levels within 20 dB of the highest of the channel."),
        Table("Orders", summary["orders"], ORDERS),
        Table("Orders of no shaft or mesh, per revolution of the input", summary["foreign_orders"], FOREIGN),
    ]
