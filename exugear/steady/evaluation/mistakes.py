"""Mistakes of measurements that the comparison notices: each is one sentence with what to do.

Levels between a measurement and a good model differ by -1.6 dB with a standard deviation of 2.1 dB (random gearboxes
with housing stiffness 0.3 to 0.8, damping 1 to 4 % and inertias off by 5 %); a measurement in g taken for m/s2 differs
by 20 dB. A peak taken for an rms value (3 dB) is within that scatter: where all levels of a channel differ by the same
3 dB it is mentioned as possible, without a correction.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM, STANDARD_GRAVITY
from exugear.results.findings import Finding
from exugear.results.order_tracking.angle_cuts import USABLE_BAND
from exugear.results.order_tracking.foreign_orders import (
    FEWEST_REVOLUTIONS,
    OrderInSpectrum,
    OrderSpectrum,
    foreign_orders,
    gearbox_orders,
    likely_speed,
    order_spectrum,
    standing_orders,
)
from exugear.steady.evaluation.comparison import ComparedCuts, PeakPair
from exugear.steady.evaluation.load_over_speed import loads_of
from exugear.steady.evaluation.run_up import INTEGRATIONS, MeasuredRunUp
from exugear.steady.settings import Method
from fe_ste.tools.arrays import Floats

CLIPPED = 1e-4
"""Fraction of samples at the limits from which a channel is clipped."""
GRAVITY_LEVEL = 20.0 * math.log10(STANDARD_GRAVITY)
"""Level of m/s2 over g, dB."""
LEVEL_ERROR = 10.0
"""Level difference to the model from which a unit is doubted, dB."""
ROOT_TWO_LEVEL = 20.0 * math.log10(math.sqrt(2.0))
"""Level of the peak of a harmonic signal over its rms value, dB."""
ROOT_TWO_RANGE = 0.5
"""Distance of the median difference from that level, and of half of the differences from their median, up to which
rms and peak values may have been confused, dB."""
SLOPE_ERROR = 10.0
"""Slope of the level difference over the frequency from which the quantity is doubted, dB per decade."""
FEWEST_VALUES = 50
"""Number of compared values below which a unit or quantity is not judged."""
SLOPE_RANGE = 40.0
"""Range of levels in which the slope is judged, dB: integration over time lowers high frequencies."""
LEAST_SPAN = 0.5
"""Decades of frequency below which the slope of a difference is not judged."""
HIGHEST_DRIFT = 0.18
"""Periods by which an order may drift within a window for an error of its level of 0.2 dB."""
SHIFTED = 0.01
"""Relative difference of the speeds of resonances from which it is reported."""
VARYING_LOAD = 1.0
"""Change of levels by a varying torque from which it is a warning, dB."""
MOST_NAMED = 5
"""Maximum number of foreign orders that a sentence names."""


def noticed_mistakes(
    gearbox: Gearbox, cuts: ComparedCuts, peaks: Sequence[PeakPair], shift: float, method: Method
) -> tuple[tuple[OrderInSpectrum, ...], tuple[Finding, ...]]:
    """Return orders that carry power and belong to no shaft, mesh or sideband of the gearbox, and all findings.

    Parameters
    ----------
    shift : computed over measured speed of resonances minus 1
    method : of the response
    """
    run_up = cuts.run_up
    spectra = [order_spectrum(values, run_up.shaft, run_up.per) for values in run_up.values]
    known = [spectrum for spectrum in spectra if spectrum is not None]
    # The channel with the highest order shows orders clearest.
    spectrum = max(known, key=lambda own: float(own.prominence.max()), default=None)
    foreign: tuple[OrderInSpectrum, ...] = ()
    if spectrum is not None:
        of_gearbox = gearbox_orders(gearbox, float(spectrum.order[-1]))
        foreign = foreign_orders(standing_orders(spectrum), of_gearbox, spectrum.resolution)
    return foreign, (
        *speed_finding(gearbox, run_up, spectrum),
        *length_finding(spectrum),
        *recording_findings(run_up),
        *load_finding(run_up, method),
        *band_findings(cuts),
        *drift_finding(cuts),
        *level_findings(cuts),
        *foreign_finding(foreign),
        *coverage_finding(cuts),
        *shift_finding(shift),
        *jump_finding(cuts, peaks),
    )


def length_finding(spectrum: OrderSpectrum | None) -> Iterator[Finding]:
    """Yield what is not looked for because the run-up has no spectrum over the angle."""
    if spectrum is None:
        yield Finding(
            "note",
            f"the faster half of the run-up has fewer than {FEWEST_REVOLUTIONS} revolutions: a wrong speed or shaft, "
            "wrong numbers of teeth and other machines are not noticed; record a slower run-up",
        )


def recording_findings(run_up: MeasuredRunUp) -> Iterator[Finding]:
    """Yield what is wrong with the recording itself: clipping, and corrected pulses."""
    for channel, share in run_up.clipped.items():
        if share > CLIPPED:
            text = (
                f"channel {channel} is clipped: {1e2 * share:.2g} % of its samples are at its limits; widen its range"
            )
            yield Finding("warning", text, share)
    for remark in run_up.shaft.remarks:
        yield Finding("warning", f"tacho: {remark}")


def band_findings(cuts: ComparedCuts) -> Iterator[Finding]:
    """Yield the orders that are above the usable band of the recording in a part of the run-up."""
    missing = np.isnan(cuts.measured[0])
    cut_off = [line.name for line, own in zip(cuts.lines, missing, strict=True) if own.any()]
    if cut_off:
        rate = cuts.run_up.shaft.rate
        fastest = max(line.order for line in cuts.lines) * float(cuts.speed.max()) / (2.0 * math.pi)
        yield Finding(
            "warning",
            f"sampling rate {rate:g} Hz: {', '.join(cut_off)} exceed {USABLE_BAND:g} of it and are omitted there; "
            f"sample at {fastest / USABLE_BAND:.3g} Hz or more",
            rate,
        )


def load_finding(run_up: MeasuredRunUp, method: Method = "parametric") -> Iterator[Finding]:
    """Yield the torque of the run-up, how much it varies, and how the computed side takes it.

    Forces of a varying mesh stiffness are proportional to the torque, thus levels to its logarithm.

    Parameters
    ----------
    method : of the response; states of `nonlinear` are those at the mean torque
    """
    if run_up.torque is None:
        return
    body, mean, (low, high) = run_up.torque.body, run_up.torque.mean, run_up.torque.ends
    text = f"torque of {body}: mean {mean:.4g} N m, {low:.4g} to {high:.4g} N m over the run-up"
    if not low * high > 0.0:
        remedy = "it changes its sign, so that teeth separate: measure at a steady load"
        yield Finding("warning", f"{text}; computed at the mean; {remedy}", mean)
        return
    if method != "nonlinear" and len(loads_of(run_up.torque)) > 1:
        yield Finding("note", f"{text}; computed at the torque of each speed", mean)
        return
    changes = sorted(20.0 * math.log10(end / mean) for end in (low, high))
    yield Finding(
        "warning" if max(map(abs, changes)) > VARYING_LOAD else "note",
        f"{text}; computed at the mean, which changes levels by {-changes[1]:+.2f} to {-changes[0]:+.2f} dB where "
        "vibration is proportional to the torque",
        mean,
    )


def speed_finding(gearbox: Gearbox, run_up: MeasuredRunUp, spectrum: OrderSpectrum | None) -> Iterator[Finding]:
    """Yield a mistake of the speed: another shaft, another number of pulses, Hz for rpm."""
    if spectrum is None:
        return
    orders = [order for order in gearbox.mesh_orders(run_up.section.harmonics).values() if order < spectrum.order[-1]]
    turns = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    candidates: dict[str, float] = {}
    if run_up.section.tacho is not None:
        per = run_up.section.tacho.pulses_per_revolution
        for number in (1, 2, 4):
            candidates[f"pulses_per_revolution = {per * number}"] = 1.0 / number
            if per % number == 0:
                candidates[f"pulses_per_revolution = {per // number}"] = float(number)
    else:
        candidates |= {'unit = "Hz"': 60.0, 'unit = "rpm"': 1.0 / 60.0}
    for name, speed in turns.items():
        if speed and abs(abs(speed) / run_up.per - 1.0) > 1e-6:
            candidates.setdefault(f'shaft = "{name}"', run_up.per / abs(speed))
    wrong = {remedy: factor for remedy, factor in candidates.items() if abs(factor - 1.0) > 1e-6}
    remedy = likely_speed(spectrum, orders, wrong)
    if remedy is not None:
        key = "tacho" if run_up.section.tacho is not None else "speed"
        yield Finding(
            "warning",
            f"the mesh orders stand out of the measurement at another speed: measurements.{run_up.name}.{key} is "
            f"probably {remedy}",
            wrong[remedy],
        )


def drift_finding(cuts: ComparedCuts) -> Iterator[Finding]:
    """Yield that the speed is too inaccurate for the highest order: within a window its phase drifts.

    Levels are within 0.2 dB under a Hann window of R revolutions if n R e < 0.18, for order n and relative error e.
    """
    error = cuts.speed_error
    revolutions = cuts.run_up.window.revolutions / cuts.run_up.per
    limit = HIGHEST_DRIFT / (revolutions * abs(error)) if error else math.inf
    blurred = [line.name for line in cuts.lines if line.order > limit]
    if blurred:
        kind = "speed" if cuts.run_up.section.tacho is None else "tacho"
        yield Finding(
            "warning",
            f"{kind}: by the phases of the mesh orders the true speed differs by {100.0 * error:+.2g} % (calibration "
            f"or delay of the signal); levels of {', '.join(blurred)} are too low: use a tacho, or fewer "
            "window_revolutions",
            error,
        )


def level_findings(cuts: ComparedCuts) -> Iterator[Finding]:
    """Yield channels whose levels or slope say that the unit or the quantity is another one."""
    for number, channel in enumerate(cuts.run_up.channels):
        compared = cuts.compared[number]
        if np.count_nonzero(compared) < FEWEST_VALUES:
            continue
        key = f"measurements.{cuts.run_up.name}.channels.{channel.name}"
        slope = _slope(cuts, number)
        likely = _likely_quantity(cuts, number) if channel.quantity in INTEGRATIONS else channel.quantity
        if likely != channel.quantity and abs(slope) > SLOPE_ERROR:
            yield Finding(
                "warning",
                f"channel {channel.name}: computed over measured levels rise by {slope:.0f} dB per decade of "
                f"frequency; {key}.quantity is probably {likely}",
                slope,
            )
            continue
        offset = cuts.offset(number)
        apart = f"{abs(offset):.1f} dB {'above' if offset > 0.0 else 'below'} the measured ones"
        spread = float(np.median(np.abs(cuts.difference[number][compared] - offset)))
        if channel.quantity == "acceleration" and abs(abs(offset) - GRAVITY_LEVEL) < LEVEL_ERROR:
            written, meant = ("m/s2", "g") if offset > 0.0 else ("g", "m/s2")
            yield Finding(
                "warning",
                f"channel {channel.name}: computed levels are {apart}, like values in "
                f'{meant} taken for {written}; check {key}.unit, probably "{meant}"',
                offset,
            )
        elif abs(offset) > LEVEL_ERROR:
            yield Finding(
                "warning",
                f"channel {channel.name}: computed levels are {apart}; check unit, "
                f"quantity, place and full scale of {key}",
                offset,
            )
        elif abs(abs(offset) - ROOT_TWO_LEVEL) < ROOT_TWO_RANGE and spread < ROOT_TWO_RANGE:
            taken, meant = ("peak", "rms") if offset > 0.0 else ("rms", "peak")
            yield Finding(
                "note",
                f"channel {channel.name}: computed levels are {apart} at all orders "
                f"and speeds, a factor near the square root of 2, as if {meant} values were taken for {taken} values; "
                f"damping and stiffness may have the same effect: check the calibration of {key}",
                offset,
            )


def _slope(cuts: ComparedCuts, channel: int) -> float:
    """Slope of the level difference over the frequency, dB per decade; 0 below half a decade of frequencies."""
    compared = cuts.within(SLOPE_RANGE)[channel]
    decades = np.log10(_frequencies(cuts)[compared])
    if np.ptp(decades) < LEAST_SPAN:
        return 0.0
    return float(np.polyfit(decades, cuts.difference[channel][compared], 1)[0])


def _frequencies(cuts: ComparedCuts) -> Floats:
    """Frequencies of all orders, (lines, frames), Hz."""
    return np.array([line.frequency(cuts.speed) for line in cuts.lines])


def _likely_quantity(cuts: ComparedCuts, channel: int) -> str:
    """Return the motion whose computed levels are nearest to the measured ones: each integration divides by 2 pi f."""
    compared = cuts.compared[channel]
    stated = INTEGRATIONS[cuts.run_up.channels[channel].quantity]
    level = 20.0 * np.log10(2.0 * np.pi * _frequencies(cuts)[compared])
    difference = cuts.difference[channel][compared]
    return min(INTEGRATIONS, key=lambda own: abs(np.median(difference - (INTEGRATIONS[own] - stated) * level)))


def shift_finding(shift: float) -> Iterator[Finding]:
    """Yield that computed resonances are at other speeds than the measured ones, by `shift`."""
    if abs(shift) > SHIFTED:
        yield Finding(
            "note",
            f"computed resonances are {100.0 * abs(shift):.1f} % too {'high' if shift > 0.0 else 'low'}: check "
            "stiffness, such as housing.factor, and inertias before damping",
            shift,
        )


def jump_finding(cuts: ComparedCuts, peaks: Sequence[PeakPair]) -> Iterator[Finding]:
    """Yield a warning if teeth lose contact at speeds of peaks: the response jumps there."""
    lost = [peak for peak in peaks if peak.contact_loss]
    if lost:
        first = lost[0]
        speed = first.measured_speed if math.isnan(first.computed_speed) else first.computed_speed
        yield Finding(
            "warning",
            f"teeth lose contact at {len(lost)} of {len(peaks)} peaks, first {cuts.lines[first.line].name} at "
            f"{speed / RPM:.0f} rpm: the response jumps there, at another speed in a run-up than in a run-down; such "
            "peaks do not count for the shift of resonances, and a fit omits these speeds",
            float(len(lost)),
        )


def foreign_finding(orders: Sequence[OrderInSpectrum]) -> Iterator[Finding]:
    """Yield the orders that belong to nothing of the gearbox."""
    if orders:
        shown = ", ".join(f"{own.order:.4g}" for own in orders[:MOST_NAMED])
        more = f" and {len(orders) - MOST_NAMED} more" if len(orders) > MOST_NAMED else ""
        yield Finding(
            "warning",
            f"orders {shown}{more} (per revolution of the input) carry power and belong to no shaft or mesh of the "
            "gearbox: check numbers of teeth and other machines",
            orders[0].order,
        )


def coverage_finding(cuts: ComparedCuts) -> Iterator[Finding]:
    """Yield a warning if the windows average over a large part of a speed decade at the lowest speed."""
    if cuts.speed.size < FEWEST_VALUES:
        first, last = cuts.speed[0] / RPM, cuts.speed[-1] / RPM
        yield Finding(
            "warning",
            f"only {cuts.speed.size} windows from {first:.4g} to {last:.4g} rpm: choose fewer window_revolutions or a "
            "slower run-up",
            float(cuts.speed.size),
        )
