"""Results as data of the page: waterfalls and order cuts of all channels, resonances, modes with moving bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.context import VISIBLE_SHARE, model_label
from exugear.report.findings.groups import Channel, RunGroup, channels_of, dominant_order
from exugear.report.findings.ranking import TOP, ConstantSpeed
from exugear.report.findings.resonance_list import ListedResonance
from exugear.report.findings.words import QUANTITIES, figure_text, percentages, rounded_text
from exugear.report.sections.material import ReportData, model_name, source_words
from exugear.report.web.document import rounded
from exugear.report.web.stage import stage_data
from exugear.results.spectra.run_spectra import ModeReport, VariantRun, report_mode
from exugear.results.spectra.waterfall import Waterfall
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

# Waterfalls reduced for the page: levels in bytes, the maximum of each cell, so that no peak is lost

NO_LEVEL = -32768
"""Value in a cut where the order has no level."""


Knots = tuple[list[float], list[int]]
"""Axis of the columns of a waterfall: speeds (rad/s), and the columns that begin there; linear between them."""


def knots_of(low: float, high: float, within: tuple[float, float] | None, columns: int) -> Knots:
    """Return an axis from `low` to `high` (rad/s) with most of its columns for the speeds `within`.

    Examples
    --------
    >>> knots_of(0.0, 100.0, (8.0, 16.0), 100)
    ([0.0, 8.0, 16.0, 100.0], [0, 3, 73, 100])
    >>> knots_of(0.0, 100.0, (0.0, 100.0), 100)
    ([0.0, 100.0], [0, 100])
    """
    if within is not None and within[1] - within[0] < WITHIN * (high - low):
        ends = [low, max(within[0], low), min(within[1], high), high]
        outside = high - low - (ends[2] - ends[1])
        before = round((1.0 - WITHIN) * columns * (ends[1] - low) / outside)
        middle = before + round(WITHIN * columns) if ends[2] < high else columns
        knots = dict(zip(ends, (0, before, middle, columns), strict=True))
        if len(knots) > 2 and all(np.diff(list(knots.values())) > 0):
            return list(knots), list(knots.values())
    return [low, high], [0, columns]


def pooled(amplitude: Floats, speed: Floats, knots: Knots, lines: int) -> Floats:
    """Return the highest amplitude in cells of a range of speeds and several spectral lines; peaks widen to their cell.

    Parameters
    ----------
    amplitude : (n, m)
    speed : (n,) rad/s
    knots : columns of cells over the speed
    lines : spectral lines per cell; an incomplete cell at the top is dropped

    Returns
    -------
    (columns, m // lines); cells without a frame take the nearest frame
    """
    count = amplitude.shape[1] // lines * lines
    narrow = amplitude[:, :count:lines].copy()
    for line in range(1, lines):
        np.maximum(narrow, amplitude[:, line:count:lines], out=narrow)
    columns = knots[1][-1]
    cell = np.minimum(np.interp(speed, *knots).astype(np.int64), columns - 1)
    whole = np.full((columns, narrow.shape[1]), -np.inf)
    order = np.argsort(cell, kind="stable")
    filled, starts = np.unique(cell[order], return_index=True)
    whole[filled] = np.maximum.reduceat(narrow[order], starts, axis=0)
    empty = np.flatnonzero(~np.isfinite(whole[:, 0]))
    middle = np.interp(empty + 0.5, knots[1], knots[0])
    whole[empty] = narrow[np.argmin(np.abs(speed[:, None] - middle), axis=0)]
    return whole


def level_bytes(level: Floats, floor: float, step: float) -> NDArray[np.uint8]:
    """Return levels (dB) as numbers of steps above a floor.

    Examples
    --------
    >>> level_bytes(np.array([-80.0, -60.0, -59.6, 10.0]), -60.0, 0.5).tolist()
    [0, 0, 1, 140]
    """
    steps: NDArray[np.uint8] = np.clip(np.round((level - floor) / step), 0, 255).astype("u1")
    return steps


def tenths(levels: Floats) -> NDArray[Any]:
    """Return levels (dB) as tenths of a dB; `NO_LEVEL` where there is none.

    Examples
    --------
    >>> tenths(np.array([-3.21, np.nan])).tolist()
    [-32, -32768]
    """
    return np.where(np.isfinite(levels), np.round(10.0 * levels), NO_LEVEL).astype("i2")


# Run-ups and steady-state responses as data of the page

WITHIN = 0.7
"""Fraction of the columns for speeds around the operating range, and of the speeds from which that is not needed."""
SPEEDS, CHANNEL_SPEEDS = 400, 140
"""Columns of the waterfalls of the transmission error and of the other channels."""
STEP, CHANNEL_STEP = 0.5, 1.5
"""Level difference per byte step, dB; for the transmission error and the other channels."""
SPAN = 80.0
"""Minimum stored span below the highest level, dB."""
CHANNEL_LINES = 3
"""Number of spectral lines of another channel that are drawn as one."""
QUANTITY = {"coupling": "Torque", "body": "Speed"}
"""Quantities of channels; of all others the force."""
CUTS_EVERY = 2
"""Stride of the frames in order cuts of other channels."""
ALSO = 4
"""Maximum number of further orders listed for a resonance."""


def run_data(material: ReportData) -> dict[str, Any]:
    """Return the script data of all run-ups, steady-state responses and modes: ``lines``, ``groups``, ``models``."""
    modes = material.results.modes
    lines = []
    for line in material.lines:
        number, _, family = line.name.rpartition(" × ")
        lines.append(
            {
                "name": line.name,
                "short": material.words.line(line),
                "sentence": material.words.line_sentence(line),
                "order": line.order,
                "harmonic": int(number) if number else 1,
                "family": family,
            }
        )
    return {
        "lines": lines,
        "groups": [_group(material, group) for group in material.groups],
        "models": {model_name(model): _model(material, model, data) for model, data in modes.items()},
    }


def _group(material: ReportData, group: RunGroup) -> dict[str, Any]:
    ranking = group.rankings[group.main]
    low, high = (speed / RPM for speed in ranking.speeds)
    return {
        "name": group.name,
        "title": group.title,
        "words": source_words(material, group),
        "inertias": group.inertias,
        "source": group.source,
        "main": group.main,
        "range": None if ranking.whole else [rounded(low, 6), rounded(high, 6)],
        "variants": {variant: _variant(material, group, run) for variant, run in group.runs.items()},
    }


def _variant(material: ReportData, group: RunGroup, run: VariantRun) -> dict[str, Any]:
    material.context.tell(f"channels of {run.variant}, {group.source}, {group.inertias}")
    levels = partial(_levels, material, group, run.variant)
    overall = {"name": "overall", "words": "Overall transmission error", "unit": "µm"}
    channels = [overall | levels(run.spectra, SPEEDS, STEP, 1, 1)]
    loudest: dict[str, dict[str, Any] | None] = {}
    # One channel at a time, as spectra are large.
    for channel in channels_of(run, material.words, group.responses.get(run.variant)):
        copies = f", 1 of {channel.copies}" if channel.copies > 1 else ""
        words = f"{QUANTITY.get(channel.kind, 'Force')}: {channel.words}{copies}"
        own = {"name": channel.name, "words": words, "unit": channel.spectra.unit}
        channels.append(own | levels(channel.spectra, CHANNEL_SPEEDS, CHANNEL_STEP, CHANNEL_LINES, CUTS_EVERY))
        if channel.kind == "support":
            loudest[channel.name] = _loudest(material, channel)
    listed = material.lists[group.name, run.variant]
    steady = (number for number, own in enumerate(listed) if own.resonance is not None or is_found_always(own))
    return {
        "words": Variant.of(run.variant).label,
        "model": model_name(group.choice(run.variant)),
        "window": run.spectra.description,
        "channels": channels,
        "loudest": loudest,
        "constant": _constant(material, group.constant.get(run.variant)),
        "resonances": [_resonance(material, group, run, own) for own in listed],
        "first": next(steady, 0),
    }


def is_found_always(own: ListedResonance) -> bool:
    """Return whether a resonance is found with all window lengths; at constant speed there are no windows."""
    return own.peak is None or own.peak.steady


def _levels(
    material: ReportData,
    group: RunGroup,
    variant: str,
    spectra: Waterfall,
    columns: int,
    step: float,
    lines: int,
    every: int,
) -> dict[str, Any]:
    """Return the waterfall of a channel and its order cuts.

    Parameters
    ----------
    columns : over the speed
    step : level difference per byte step, dB
    lines : spectral lines that are drawn as one
    every : stride of the frames in the order cuts
    """
    count = len(spectra.frequency)
    if variant not in group.responses:  # a response has only lines that are drawn
        fundamental = max(material.context.gearbox.train.mesh_frequencies(2.0 * math.pi).values(), default=math.inf)
        top = TOP * fundamental * float(spectra.speed.max()) / (2.0 * math.pi)
        count = max(4, int(np.searchsorted(spectra.frequency, min(top, float(spectra.frequency[-1])))))
    around = group.rankings[variant].around
    knots = knots_of(float(spectra.speed.min()), float(spectra.speed.max()), around, columns)
    floor = 10.0 * math.floor((float(spectra.level_of(spectra.amplitude[:, 2:count].max())) - SPAN) / 10.0)
    spacing = float(spectra.frequency[1])
    highest = spectra.level_of(pooled(spectra.amplitude[:, :count], spectra.speed, knots, lines))
    cells = level_bytes(highest, floor, step)
    along = np.array([spectra.along(line) for line in material.lines])
    cuts = tenths(along.reshape(len(material.lines), spectra.time.size).T)
    return {
        "cells": material.arrays.add(cells),
        "floor": floor,
        "step": step,
        "spacing": rounded(lines * spacing, 9),
        "first": rounded(0.5 * (lines - 1) * spacing, 9),
        "knots": [[speed / RPM for speed in knots[0]], knots[1]],
        "cuts": material.arrays.add(cuts[::every].copy(), differences=True),
        "speeds": material.arrays.add((spectra.speed[::every] / RPM).astype("f4")),
    }


def _constant(material: ReportData, speed: ConstantSpeed | None) -> dict[str, Any] | None:
    """Return the levels along the orders at constant speed, for the order cuts of the overall transmission error."""
    if speed is None:
        return None
    along = [speed.along(line) for line in material.lines]
    nothing = np.full(speed.speed.size, np.nan)
    levels = np.array([nothing if one is None else one for one in along]).reshape(len(along), speed.speed.size).T
    return {
        "cuts": material.arrays.add(tenths(levels), differences=True),
        "speeds": material.arrays.add((speed.speed / RPM).astype("f4")),
    }


def axial_of_shaft(gearbox: Gearbox, channel: Channel) -> float:
    """Return the mean axial force of a shaft on a bearing's inner ring, as `exugear bearings` prints it, or on a joint.

    A run records the force on the body, which in most bearings is on the inner ring. Only where the body carries the
    outer ring does the recorded sign already apply.
    """
    if any(bearing.name == channel.name and bearing.carries_outer_ring for bearing in gearbox.bearings):
        return channel.axial
    return 0.0 - channel.axial


def _loudest(material: ReportData, channel: Channel) -> dict[str, Any] | None:
    order = dominant_order(channel.spectra, material.lines)
    return {
        "words": channel.words,
        "copies": channel.copies,
        "mean": rounded(channel.mean, 4),
        "axial": rounded(axial_of_shaft(material.context.gearbox, channel), 4),
        "amplitude": rounded(order.amplitude, 4) if order else None,
        "line": material.words.line(order.line) if order else "",
        "speed": rounded(order.speed / RPM, 5) if order else None,
        "frequency": rounded(order.frequency, 5) if order else None,
    }


def _resonance(material: ReportData, group: RunGroup, run: VariantRun, own: ListedResonance) -> dict[str, Any]:
    orders = [line.order for line in material.lines]
    line = next((n for n, order in enumerate(orders) if math.isclose(order, own.line.order, rel_tol=1e-6)), -1)
    tolerance = own.peak.finding.resonance.resolution if own.peak is not None and not group.responses else None
    return {
        "frequency": rounded(own.frequency, 6),
        "tolerance": None if tolerance is None else rounded(tolerance, 3),
        "speed": rounded(own.speed / RPM, 5),
        "peak": rounded(own.line.order * own.speed / (2.0 * math.pi), 6),
        "line": line,
        "short": material.words.line(own.line),
        "level": rounded(own.level, 4),
        "steady": is_found_always(own),
        "inside": own.inside,
        "mode": own.mode,
        "facts": [*_amplitudes(material, own), *_facts(material, group, own), *_mode_facts(material, group, run, own)],
        "caveats": [material.words.labelled(text) for text in own.caveats],
    }


def _amplitudes(material: ReportData, own: ListedResonance) -> list[list[str]]:
    """Return the amplitudes of a resonance as headings and text, for the panel next to the waterfall."""
    if own.resonance is None:
        return []
    facts = []
    for name, amplitude in own.resonance.amplitudes.items():
        label = QUANTITIES[name]
        text = f"±{rounded_text(label.factor * amplitude.amplitude)} {label.unit}"
        if amplitude.limits is not None:
            ends = [rounded_text(label.factor * limit.amplitude) for limit in reversed(amplitude.limits)]
            text += f" ({' to '.join(ends)} with damping)"
        text += f", {material.words.of(amplitude.at)}" if amplitude.at else ""
        text += f", rank {amplitude.place}" if amplitude.place else ""
        facts.append([label.title, text])
    return facts


def _facts(material: ReportData, group: RunGroup, own: ListedResonance) -> list[list[str]]:
    """Return what excites a resonance, what a run-up shows of it, and how high other variants are there."""
    words = material.words
    facts = [["Excited by", f"{words.line_sentence(own.line)} (order {figure_text(own.line.order, 4)})"]]
    found = own.peak
    if found is None:
        return facts
    if not group.responses:
        peak = group.shown_peak(found)
        at = found.constant if peak is found.peak else None
        at_constant = "" if at is None else f"; at constant speed {figure_text(at.level)} dB at {at.frequency:.1f} Hz"
        amplitude = figure_text(10.0 ** (peak.level / 20.0), 2)
        level = f"{figure_text(peak.level)} dB = ±{amplitude} µm zero-to-peak, prominence "
        facts.insert(0, ["Level", f"{level}{figure_text(peak.prominence, 2)} dB{at_constant}"])
        picks = (pick.line for pick in found.finding.resonance.picks if pick.line != peak.line)
        if others := list(dict.fromkeys(picks))[:ALSO]:
            facts.append(["Shown by", ", ".join(words.line(line) for line in others)])
    for variant, level_there in found.elsewhere.items():
        lacks = "not resolved, " if variant in found.lacking else ""
        there = f"TE {figure_text(level_there)} dB there" if math.isfinite(level_there) else "outside its range"
        facts.append([Variant.of(variant).label.capitalize(), f"{lacks}{there}"])
    if not found.steady:
        facts.append(["Warning", "not found with all window lengths; possibly not a resonance"])
    return facts


def _mode_facts(material: ReportData, group: RunGroup, run: VariantRun, own: ListedResonance) -> list[list[str]]:
    modes = run.modes
    if modes is None:
        name = own.peak.finding.mode_name if own.peak is not None else ""
        text = material.words.labelled(name) or ("none near" if group.responses else "none computed; run exugear modes")
        return [["Mode", text]]
    if own.mode is None:
        return [["Mode", "none near"]]
    damping = 100.0 * float(modes["damping_ratio"][own.mode])
    frequency = float(modes["frequency"][own.mode])
    return [
        ["Mode", f"{own.mode + 1} at {frequency:.1f} Hz, damping {figure_text(damping, 2)} %"],
        ["Mode shape", material.words.moves(modes, own.mode)],
        ["Strain energy", percentages(material.words.strain_energy(modes, own.mode))],
    ]


# Modes with the bodies that move in them

DEFORMED = 32
"""Number of modes in which flexible bodies deform on the page: those of resonances, and the most visible ones."""


def _model(material: ReportData, model: Choice, data: xr.Dataset) -> dict[str, Any]:
    material.context.tell(f"bodies and modes of {model_label(model)}")
    assembly = material.context.assembled(model)
    reports = [report_mode(data, index) for index in range(data.sizes["mode"])]
    labels = material.words.labels
    return {
        "words": model_label(model),
        "variant": model.variant,
        "stage": stage_data(
            assembly, data["shape"].to_numpy(), labels, material.arrays, _deformed(material, model, reports)
        ),
        "modes": [
            {
                "frequency": rounded(report.frequency, 6),
                "damping": rounded(report.damping_ratio, 4),
                "words": material.words.moves(data, report.index),
            }
            for report in reports
        ],
    }


def _deformed(material: ReportData, model: Choice, reports: Sequence[ModeReport]) -> set[int]:
    """Return the modes in which flexible bodies deform."""
    if not model.variant.is_elastic:
        return set()
    matched = {
        own.mode
        for group in material.groups
        if model.variant in group.runs and group.choice(model.variant) == model
        for own in material.lists[group.name, model.variant]
        if own.mode is not None
    }
    seen = sorted((report for report in reports if report.share >= VISIBLE_SHARE), key=lambda one: -one.amplification)
    most = [*sorted(matched), *(one.index for one in seen if one.index not in matched)]
    return set(most[: max(DEFORMED, len(matched))])
