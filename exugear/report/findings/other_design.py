"""Comparison with the results of another design: amplitudes over the same operating range, and keys that differ."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import operating_range
from exugear.gearbox.named_files import Permissions
from exugear.gearbox.reading import flattened
from exugear.gearbox.units import RPM
from exugear.report.findings.context import Context, ReportError, model_label, stored_models, with_responses
from exugear.report.findings.groups import groups_of
from exugear.report.findings.headline import Headline, headline_of
from exugear.report.findings.ranking import Envelope
from exugear.results.folder import read_stored_gearbox
from exugear.results.spectra.waterfall import OrderLine, order_lines
from exugear.system.modal_damping import damping_in_words

SAME_RANGE = 1e-3
"""Relative difference of the ends of two operating ranges that counts as none."""
DETAILS = ("name", "labels", "report")
"""Sections of the file that change no result."""


@dataclass(frozen=True)
class Difference:
    """Key of the gearbox file with its values in both designs; None where a file does not have it."""

    key: str
    own: Any
    other: Any


@dataclass(frozen=True)
class OtherDesign:
    """Results of another design that are compared with those of the page."""

    name: str
    """Name of its folder, not that of the folder of the page."""
    headline: Headline
    lines: Sequence[OrderLine]
    differences: Sequence[Difference]
    cautions: Sequence[str]
    """Differences of model, load or damping, which change the amplitudes as well."""


@dataclass(frozen=True)
class HighestAmplitude:
    """Highest amplitude of any order in the operating range."""

    amplitude: float
    """In the unit of the quantity."""
    speed: float
    """Input speed, rad/s."""


def read_other_design(context: Context, headline: Headline | None, folder: Path) -> OtherDesign:
    """Read the results of another design.

    Raises
    ------
    GearboxFileError
        The folder holds no results.
    ReportError
        One of both has no ranked resonances, or the operating ranges differ.
    """
    gearbox = read_stored_gearbox(folder, Permissions(below=context.gearbox.permissions.below))
    if headline is not None:
        gearbox = gearbox.varied({"report.quantity": headline.ranking.wanted})
    found = Context(folder, gearbox, None, context.tell)
    results = with_responses(found, stored_models(found))
    other = headline_of(found, results, groups_of(found, results))
    for notes, place, own in ((context.notes, context.folder, headline), (found.notes, folder, other)):
        if own is None or own.group is None:
            reason = f"{place}: no amplitudes to compare; run exugear steady with this results folder"
            raise ReportError("\n".join([reason, *notes.left_out]))
    assert headline is not None and other is not None
    both = (other.ranking.speeds, headline.ranking.speeds)
    if not np.allclose(*both, rtol=SAME_RANGE):
        ranges = [" to ".join(f"{speed / RPM:.5g}" for speed in ends) for ends in both]
        raise ReportError(
            f"{folder}: amplitudes are for {ranges[0]} rpm, those of {context.folder} for {ranges[1]} rpm; compute "
            "both for the same speeds ([operation] speed_range_rpm)"
        )
    cautions = [
        f"{what}: {first}; other design: {second}."
        for what, first, second in (
            ("Model", model_label(headline.choice), model_label(other.choice)),
            ("Results", headline.source, other.source),
            ("Load", headline.load, other.load),
            ("Damping", *(damping_in_words(one.case.damping) for one in (context.gearbox, gearbox))),
        )
        if first != second
    ]
    differences = tuple(differing_keys(context.gearbox, gearbox))
    name = folder.resolve().name
    if name == context.folder.resolve().name:
        name = f"{name} (other)"
    return OtherDesign(name, other, order_lines(gearbox), differences, cautions)


def check_ranges(own: Gearbox, other: Gearbox) -> None:
    """Refuse designs with different operating ranges, before anything is computed.

    Raises
    ------
    ReportError
        The ranges differ.
    """
    ranges = [ends for gearbox in (own, other) if (ends := operating_range(gearbox)) is not None]
    if len(ranges) < 2 or np.allclose(ranges[0], ranges[1], rtol=SAME_RANGE):
        return
    texts = [" to ".join(f"{speed / RPM:.5g}" for speed in ends) for ends in ranges]
    raise ReportError(
        f"{other.source}: operating range {texts[1]} rpm; that of {own.source} is {texts[0]} rpm; designs are compared "
        "in the same range ([operation] speed_range_rpm)"
    )


def differing_keys(own: Gearbox, other: Gearbox) -> Iterator[Difference]:
    """Yield the keys of two gearbox files that differ and may change results."""
    first, second = (flattened(gearbox.case.model_dump(mode="json", exclude_defaults=True)) for gearbox in (own, other))
    for key in sorted(first.keys() | second.keys()):
        if first.get(key) != second.get(key) and key.split(".")[0] not in DETAILS:
            yield Difference(key, first.get(key), second.get(key))


def highest_within(curve: Envelope, speeds: tuple[float, float]) -> HighestAmplitude | None:
    """Return the highest amplitude of a curve within a range of speeds (rad/s); None if it has no speed there."""
    inside = (curve.speed >= speeds[0] * (1.0 - SAME_RANGE)) & (curve.speed <= speeds[1] * (1.0 + SAME_RANGE))
    if not inside.any():
        return None
    place = int(np.argmax(np.where(inside, curve.amplitude, -np.inf)))
    return HighestAmplitude(float(curve.amplitude[place]), float(curve.speed[place]))


def change_in_decibels(own: HighestAmplitude, other: HighestAmplitude) -> float:
    """Return how much higher the amplitude of the other design is, dB; NaN where one is zero."""
    if own.amplitude <= 0.0 or other.amplitude <= 0.0:
        return math.nan
    return 20.0 * math.log10(other.amplitude / own.amplitude)
