"""Run-ups and steady-state responses as data of the page: waterfalls and order cuts of all channels, resonances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.gearbox.variant import Variant
from exugear.report.findings.groups import Channel, RankedResonance, RunGroup, channels_of, dominant_order
from exugear.report.findings.ranking import TOP, ConstantSpeed
from exugear.report.findings.words import figure_text, percentages
from exugear.report.sections.material import ReportData, group_words, model_name
from exugear.report.web.document import rounded
from exugear.results.spectra.resonances import Pick
from exugear.results.spectra.run_spectra import VariantRun
from exugear.results.spectra.waterfall import OrderLine, Waterfall
from fe_ste.tools.arrays import Floats

# Waterfalls reduced for the page: levels in bytes, the maximum of each cell, so that no peak is lost

NO_LEVEL = -32768
"""Value in a cut where the order has no level."""


def pooled(level: Floats, speed: Floats, columns: int, lines: int) -> Floats:
    """Return the highest level in cells of equal speed range and several spectral lines; peaks widen to their cell.

    Parameters
    ----------
    level : (n, m) dB
    speed : (n,) rad/s
    columns : cells over the speed
    lines : spectral lines per cell; an incomplete cell at the top is dropped

    Returns
    -------
    (columns, m // lines); cells without a frame take the nearest frame
    """
    count = level.shape[1] // lines * lines
    narrow = level[:, :count:lines].copy()
    for line in range(1, lines):
        np.maximum(narrow, level[:, line:count:lines], out=narrow)
    low = float(speed.min())
    span = max(float(np.ptp(speed)), 1e-12)
    cell = np.minimum(((speed - low) / span * columns).astype(np.int64), columns - 1)
    whole = np.full((columns, narrow.shape[1]), -np.inf)
    order = np.argsort(cell, kind="stable")
    filled, starts = np.unique(cell[order], return_index=True)
    whole[filled] = np.maximum.reduceat(narrow[order], starts, axis=0)
    empty = np.flatnonzero(~np.isfinite(whole[:, 0]))
    middle = low + (empty + 0.5) * span / columns
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

SPEEDS, CHANNEL_SPEEDS = 400, 140
"""Columns of the waterfalls of the transmission error and of the other channels."""
STEP, CHANNEL_STEP = 0.5, 1.5
"""Level difference per byte step, dB; for the transmission error and the other channels."""
SPAN = 80.0
"""Minimum stored span below the highest level, dB."""
CHANNEL_LINES = 3
"""Number of spectral lines of another channel that are drawn as one."""
CUTS_EVERY = 2
"""Stride of the frames in order cuts of other channels."""
ALSO = 4
"""Maximum number of further orders listed for a resonance."""


def run_data(material: ReportData) -> dict[str, Any]:
    """Return the script data of all run-ups and steady-state responses: ``lines`` and ``groups``."""
    return {
        "lines": [_line(material, line) for line in material.lines],
        "groups": [_group(material, group) for group in material.groups],
    }


def _line(material: ReportData, line: OrderLine) -> dict[str, Any]:
    number, _, family = line.name.rpartition(" × ")
    return {
        "name": line.name,
        "short": material.words.line(line),
        "sentence": material.words.line_sentence(line),
        "order": line.order,
        "harmonic": int(number) if number else 1,
        "family": family,
    }


def _group(material: ReportData, group: RunGroup) -> dict[str, Any]:
    return {
        "name": group.name,
        "title": group.title,
        "words": group_words(material.groups, group),
        "source": group.source,
        "main": group.main,
        "variants": {variant: _variant(material, group, run) for variant, run in group.runs.items()},
    }


def _variant(material: ReportData, group: RunGroup, run: VariantRun) -> dict[str, Any]:
    material.context.tell(f"channels of {run.variant}, {group.source}, {group.inertias}")
    channels = [_overall(material, run.spectra)]
    loudest: dict[str, dict[str, Any] | None] = {}
    # One channel at a time, as spectra are large.
    for channel in channels_of(run, material.words, group.responses.get(run.variant)):
        channels.append(_channel(material, channel))
        if channel.kind == "support":
            loudest[channel.name] = _loudest(material, channel)
    return {
        "words": Variant.of(run.variant).label,
        "model": model_name(group.choice(run.variant)),
        "window": run.spectra.description,
        "channels": channels,
        "loudest": loudest,
        "constant": _constant(material, group.constant.get(run.variant)),
        "resonances": [_resonance(material, group, run, own) for own in group.ranked[run.variant]],
        "first": _first(group, run.variant),
        "leading": _leading(material, group, run.variant),
    }


def _first(group: RunGroup, variant: str) -> int:
    """Return the place of the resonance that is chosen first: that of the ranking, or else the highest steady one.

    It is -1 where the first resonance of the ranking is no peak of the transmission error.
    """
    ranked = group.ranked[variant]
    if variant == group.main and group.response is not None and group.in_operation.resonances:
        return next((number for number, own in enumerate(ranked) if group.is_leading(group.shown_peak(own))), -1)
    leading = (number for number, own in enumerate(ranked) if group.is_leading(group.shown_peak(own)))
    steady = (number for number, own in enumerate(ranked) if own.steady)
    return next(leading, next(steady, 0))


def _leading(material: ReportData, group: RunGroup, variant: str) -> dict[str, int] | None:
    """Return mode and order of the first resonance of the ranking; None if the group does not lead the page."""
    headline = material.headline
    if headline is None or headline.group is not group or headline.top is None or variant != group.main:
        return None
    mode = headline.mode_of(headline.top)
    lines = [n for n, line in enumerate(material.lines) if math.isclose(line.order, headline.top.order, rel_tol=1e-6)]
    if mode is None or not lines:
        return None
    return {"mode": mode.index, "line": lines[0]}


def _highest(material: ReportData, spectra: Waterfall) -> int:
    """Return the number of spectral lines that are drawn."""
    fundamental = max(material.context.gearbox.train.mesh_frequencies(2.0 * math.pi).values(), default=math.inf)
    top = TOP * fundamental * float(spectra.speed.max()) / (2.0 * math.pi)
    return max(4, int(np.searchsorted(spectra.frequency, min(top, float(spectra.frequency[-1])))))


def _overall(material: ReportData, spectra: Waterfall) -> dict[str, Any]:
    count = _highest(material, spectra)
    level = pooled(spectra.level[:, :count], spectra.speed, SPEEDS, 1)
    return {
        "name": "overall",
        "words": "Overall transmission error",
        "unit": "µm",
        **_cells(material, level, spectra, _floor(spectra, count), STEP, 1),
        **_cuts(material, spectra, 1),
    }


def _channel(material: ReportData, channel: Channel) -> dict[str, Any]:
    spectra = channel.spectra
    count = _highest(material, spectra)
    level = pooled(spectra.level[:, :count], spectra.speed, CHANNEL_SPEEDS, CHANNEL_LINES)
    copies = f", 1 of {channel.copies}" if channel.copies > 1 else ""
    return {
        "name": channel.name,
        "words": f"Force: {channel.words}{copies}",
        "unit": "N",
        **_cells(material, level, spectra, _floor(spectra, count), CHANNEL_STEP, CHANNEL_LINES),
        **_cuts(material, spectra, CUTS_EVERY),
    }


def _floor(spectra: Waterfall, count: int) -> float:
    """Return the lowest level of the scale (dB), a multiple of ten."""
    return 10.0 * math.floor((float(spectra.level[:, 2:count].max()) - SPAN) / 10.0)


def _cells(
    material: ReportData, level: Floats, spectra: Waterfall, floor: float, step: float, lines: int
) -> dict[str, Any]:
    span = [float(spectra.speed.min()) / RPM, float(spectra.speed.max()) / RPM]
    return {
        "cells": material.arrays.add(level_bytes(level, floor, step)),
        "floor": floor,
        "step": step,
        "spacing": rounded(lines * float(spectra.frequency[1]), 9),
        "first": rounded(0.5 * (lines - 1) * float(spectra.frequency[1]), 9),
        "span": span,
    }


def _cuts(material: ReportData, spectra: Waterfall, every: int) -> dict[str, Any]:
    speeds = (spectra.speed[::every] / RPM).astype("f4")
    levels = np.array([spectra.along(line) for line in material.lines])
    cuts = tenths(levels.reshape(len(material.lines), spectra.time.size).T)
    return {
        "cuts": material.arrays.add(cuts[::every].copy(), differences=True),
        "speeds": material.arrays.add(speeds),
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
    """Return the values of a bearing for its table."""
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


def _resonance(material: ReportData, group: RunGroup, run: VariantRun, own: RankedResonance) -> dict[str, Any]:
    peak = group.shown_peak(own)
    resonance = own.finding.resonance
    return {
        "frequency": rounded(resonance.frequency, 6),
        "tolerance": rounded(resonance.resolution, 3),
        "speed": rounded(peak.speed / RPM, 5),
        "peak": rounded(peak.frequency, 6),
        "line": [line.name for line in material.lines].index(peak.line.name),
        "level": rounded(peak.level, 4),
        "steady": own.steady,
        "mode": own.finding.mode,
        "facts": _facts(material, group, run, own, peak),
    }


def _facts(
    material: ReportData, group: RunGroup, run: VariantRun, resonance: RankedResonance, peak: Pick
) -> list[list[str]]:
    """Return headings and text on a peak of a resonance for the panel next to the waterfall."""
    words = material.words
    others = list(dict.fromkeys(p.line for p in resonance.finding.resonance.picks if p.line != peak.line))[:ALSO]
    at = resonance.constant if peak is resonance.peak else None
    at_constant = "" if at is None else f"; at constant speed {figure_text(at.level)} dB at {at.frequency:.1f} Hz"
    facts = [
        [
            "Level",
            f"{figure_text(peak.level)} dB = ±{figure_text(10.0 ** (peak.level / 20.0), 2)} µm zero-to-peak, "
            f"prominence {figure_text(peak.prominence, 2)} dB{at_constant}",
        ],
        ["Excited by", f"{words.line_sentence(peak.line)} (order {figure_text(peak.line.order, 4)})"],
    ]
    if others:
        facts.append(["Shown by", ", ".join(words.line(line) for line in others)])
    for variant, level in resonance.elsewhere.items():
        lacks = "not resolved, " if variant in resonance.lacking else ""
        there = f"{figure_text(level)} dB there" if math.isfinite(level) else "outside its range"
        facts.append([Variant.of(variant).label.capitalize(), f"{lacks}{there}"])
    facts += _mode_facts(material, group, run, resonance)
    if not resonance.steady:
        facts.append(["Warning", "not found with all window lengths; possibly not a resonance"])
    return facts


def _mode_facts(material: ReportData, group: RunGroup, run: VariantRun, resonance: RankedResonance) -> list[list[str]]:
    mode = resonance.finding.mode
    modes = run.modes
    if resonance.finding.mode_name and modes is None:
        moves = material.words.labelled(resonance.finding.mode_name)
        return [["Mode", f"{resonance.finding.mode_frequency:.1f} Hz at this speed"], ["Mode shape", moves]]
    if modes is None and not group.responses:
        return [["Mode", "no modes computed; run exugear modes"]]
    if mode is None or modes is None:
        return [["Mode", "none near"]]
    damping = 100.0 * float(modes["damping_ratio"][mode])
    return [
        ["Mode", f"{resonance.finding.mode_frequency:.1f} Hz, damping {figure_text(damping, 2)} %"],
        ["Mode shape", material.words.moves(modes, mode)],
        ["Strain energy", percentages(material.words.strain_energy(modes, mode))],
    ]
