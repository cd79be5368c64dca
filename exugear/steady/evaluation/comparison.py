"""Comparison of a measured run-up with the steady-state response: order cuts, their differences, and paired peaks.

The steady-state response is swept along the measured speed and averaged under the same windows
(`exugear.steady.evaluation.swept`) before it is compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.results.order_tracking.angle_cuts import BANDWIDTH, STEPS, angle_cuts
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.evaluation.run_up import MeasuredChannel, MeasuredRunUp
from exugear.steady.evaluation.swept import swept_cut
from exugear.steady.mean_system.planet_sets import SteadyError
from exugear.steady.peaks import line_name, tensile_fractions
from exugear.steady.steady_file import complex_amplitudes
from exugear.system.tooth_mesh.laws.registry import LAWS
from fe_ste.tools.arrays import Booleans, Complexes, Floats, Integers, SingleComplexes
from fe_ste.tools.display import ReprMixin

if TYPE_CHECKING:
    import xarray as xr

COMPARED_RANGE = 20.0
"""Levels down to this far below the highest of a channel are compared, dB."""
ABOVE_BACKGROUND = 10.0
"""Level above the background from which a measured amplitude counts, dB; noise alone exceeds it in one window of 200.
"""
FEWEST_PHASES = 50
"""Number of phases below which no error of the speed is determined."""
SMOOTHED = 41
"""Number of windows over which the median of the background is taken: five window lengths."""
BACKGROUND_AT = 3.5
"""Distance of the background from an order, in one over the revolutions of a window: beyond the main lobe."""
PROMINENCE = 3.0
"""Prominence of a peak, dB."""
FAINT = 1.0
"""Prominence from which a peak is the partner of a prominent one, dB."""
PEAK_RANGE = 30.0
"""Peaks down to this far below the highest amplitude of a channel are listed, dB."""
STRETCHES = np.exp(np.linspace(math.log(0.8), math.log(1.25), 179))
"""Factors on the computed speeds among which the best is looked for; one of them is 1."""
PAIRED = 0.04
"""Relative difference of speeds, after the stretch, up to which a measured and a computed peak are a pair."""


@dataclass(frozen=True)
class PeakPair:
    """A peak of a measured cut, and that of the computed one."""

    channel: int
    line: int
    """Places among channels and orders."""
    measured_speed: float
    computed_speed: float
    """Speed of the input, rad/s; NaN where there is no such peak."""
    measured: float
    computed: float
    """Amplitude, zero-to-peak, SI; of a peak without a partner the amplitude of the other at the same speed."""
    contact_loss: bool = False
    """Whether teeth lose contact at this speed: the response jumps there, at another speed in a run-down."""

    @property
    def paired(self) -> bool:
        """Whether both sides have the peak."""
        return not math.isnan(self.measured_speed + self.computed_speed)

    @property
    def difference(self) -> float:
        """Computed over measured amplitude, dB."""
        return 20.0 * math.log10(self.computed / self.measured) if self.computed * self.measured > 0.0 else math.nan

    @property
    def speed_difference(self) -> float:
        """Computed over measured speed minus 1; NaN without a pair."""
        return self.computed_speed / self.measured_speed - 1.0


@dataclass(frozen=True, eq=False)
class ComparedCuts(ReprMixin, line=" of {run_up.name!r}: {shape}"):
    """Measured and computed order cuts in the same frames; SI, zero-to-peak."""

    run_up: MeasuredRunUp
    lines: tuple[OrderLine, ...]
    """Orders per revolution of the input."""
    time: Floats
    speed: Floats
    """(frames,) centre of each window, s, and speed of the input there, rad/s, without sign."""
    measured: Complexes
    """(channels, lines, frames); NaN above the usable band."""
    background: Floats
    """(channels, lines, frames) amplitude beside each order: noise, and leakage of other orders."""
    computed: Complexes
    """(channels, lines, frames) steady-state response, swept and averaged likewise; NaN outside its speeds."""
    steady: Floats
    """(channels, lines, frames) amplitude of the steady-state response at the speeds, neither swept nor averaged."""
    contact_loss: Booleans
    """(frames,) whether teeth lose contact in the computed response at the speed."""
    limits: Floats | None = None
    """(2, channels, lines, frames) computed amplitude with the lowest and the highest plausible damping."""

    @property
    def shape(self) -> str:
        """Numbers of channels, orders and windows as text."""
        return "{} channels, {} orders, {} windows".format(*self.measured.shape)

    @property
    def difference(self) -> Floats:
        """Computed over measured amplitude, (channels, lines, frames), dB."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(20.0 * np.log10(np.abs(self.computed) / np.abs(self.measured)))

    @property
    def compared(self) -> Booleans:
        """Amplitudes that count, (channels, lines, frames): above background, and near the highest of the channel."""
        return self.within(COMPARED_RANGE)

    @property
    def fitted(self) -> Booleans:
        """Amplitudes that count and from which a fit or a shift of resonances may follow: where teeth stay in contact.

        Where they lose contact, a resonance bends and the response jumps, at other speeds in a run-up and a run-down.
        """
        return self.compared & ~self.contact_loss

    def within(self, levels: float) -> Booleans:
        """Amplitudes above background, and down to so many dB below the highest of the channel."""
        known = np.isfinite(self.difference)
        amplitude = np.where(known, np.abs(self.measured), 0.0)
        top = amplitude.max(axis=(1, 2), keepdims=True)
        above = amplitude > self.background * 10.0 ** (ABOVE_BACKGROUND / 20.0)
        return np.asarray(known & above & (amplitude > top * 10.0 ** (-levels / 20.0)))

    def deviation(self, channel: int | None = None, line: int | None = None) -> float:
        """Root mean square of the differences that count, dB; of all channels or orders by default, NaN for none."""
        chosen = self.compared
        part = (slice(None) if channel is None else channel, slice(None) if line is None else line)
        found = self.difference[part][chosen[part]]
        return float(np.sqrt(np.mean(found**2))) if found.size else math.nan

    @property
    def deviation_of_shapes(self) -> float:
        """Root mean square of the differences that count without the mean of each channel, dB, as a fit states it."""
        differences = zip(self.difference, self.compared, strict=True)
        found = [own[chosen] - own[chosen].mean() for own, chosen in differences if chosen.any()]
        return float(np.sqrt(np.mean(np.concatenate(found) ** 2))) if found else math.nan

    @property
    def speed_error(self) -> float:
        """True over measured speed minus 1, by the phases of the orders; NaN if too few amplitudes count.

        At a speed that is wrong by e, the phase of order n drifts by n e per radian. Phases of resonances that are
        crossed leave the median as it is.
        """
        step = 2.0 * math.pi * self.run_up.window.revolutions / STEPS / self.run_up.per
        turned = np.angle(self.measured[..., 1:] * self.measured[..., :-1].conj())
        order = np.array([line.order for line in self.lines])[:, None]
        known = self.compared[..., 1:] & self.compared[..., :-1]
        found = (turned / (order * step))[known]
        return float(np.median(found)) if found.size >= FEWEST_PHASES else math.nan

    def offset(self, channel: int) -> float:
        """Median of computed over measured amplitude of a channel, dB; NaN where nothing counts."""
        found = self.difference[channel][self.compared[channel]]
        return float(np.median(found)) if found.size else math.nan


def compared_cuts(run_up: MeasuredRunUp, response: xr.Dataset, limits: SingleComplexes | None = None) -> ComparedCuts:
    """Cut the mesh orders out of a measured run-up, and compute the same cuts of a steady-state response.

    Parameters
    ----------
    response : as of `exugear.steady.steady_file.stored_or_computed`, over the speeds of the run-up
    limits : (2, points, lines, signals) amplitudes with the lowest and the highest plausible damping

    Raises
    ------
    SteadyError
        The response has no signal at the place of a channel.
    TooShortError
        The run-up is shorter than a window.
    """
    rows = mesh_lines(response, run_up.section.harmonics)
    orders = response["order"].to_numpy()
    lines = tuple(OrderLine(name, float(orders[row])) for name, row in rows.items())
    window, per = run_up.window, run_up.per
    beside = [OrderLine("", line.order + BACKGROUND_AT * per / window.revolutions) for line in lines]
    cuts = angle_cuts(run_up.values, run_up.shaft, [*lines, *beside], window, per)
    found = np.array([[cut.amplitude for cut in own] for own in cuts])
    frames = cuts[0][0]
    from scipy.ndimage import median_filter  # a tenth of a second that other commands need not wait

    places = np.array([*rows.values()])
    amplitudes = [complex_amplitudes(response)[:, places], *(() if limits is None else limits[:, :, places])]
    names = [str(name) for name in response["signal"].to_numpy()]
    speed, *transfers = transfers_of(run_up, names, response["speed"].to_numpy(), lines, amplitudes)
    swept = swept_lines(speed, np.concatenate(transfers), lines, run_up, frames.speed.size)
    swept = swept.reshape(len(transfers), -1, *swept.shape[1:])
    if not np.abs(transfers[0]).max() > 0.0:
        raise SteadyError(
            f"mesh model {response.attrs['mesh_model']}: its mesh stiffness is constant and excites no vibration to "
            "compare with; use --mesh-model line_of_action"
        )
    inside = (frames.speed >= speed[0]) & (frames.speed <= speed[-1])
    swept[..., ~inside] = np.nan
    steady = np.apply_along_axis(lambda own: np.interp(frames.speed, speed, own), 2, np.abs(transfers[0]))
    return ComparedCuts(
        run_up=run_up,
        lines=lines,
        time=frames.time,
        speed=frames.speed,
        measured=found[:, : len(lines)],
        background=median_filter(np.abs(found[:, len(lines) :]), (1, 1, SMOOTHED), mode="nearest"),
        computed=swept[0],
        steady=np.where(inside, steady, np.nan),
        contact_loss=np.interp(frames.speed, *_contact_loss(response)) > 0.0,
        limits=None if limits is None else np.abs(swept[1:]),
    )


def _contact_loss(response: xr.Dataset) -> tuple[Floats, Floats]:
    """Return ascending speeds of a response, rad/s without sign, and 1 where teeth lose contact or would have to pull.

    A bilateral mesh model transmits tension where teeth lose contact in reality.
    """
    lost = np.nan_to_num(response["contact_loss_fraction"].to_numpy()).max(axis=1, initial=0.0) > 0.0
    if not LAWS[str(response.attrs["mesh_model"])].loses_contact:
        for fraction in tensile_fractions(response).values():
            lost |= fraction > 0.0
    speed = np.abs(response["speed"].to_numpy())
    order = np.argsort(speed, kind="stable")
    return speed[order], lost[order].astype(np.float64)


def swept_lines(
    speed: Floats, transfer: Complexes, lines: Sequence[OrderLine], run_up: MeasuredRunUp, windows: int
) -> Complexes:
    """Order cuts (channels, lines, windows) that a run-up shows of transfers (channels, lines, points) at speeds."""
    found = np.full((*transfer.shape[:2], windows), np.nan, dtype=np.complex128)
    for place, line in enumerate(lines):
        own = swept_cut(speed, transfer[:, place], line.order, run_up.shaft, run_up.window, run_up.per)
        count = min(own.shape[1], windows)
        found[:, place, :count] = own[:, :count]
    return found


def transfers_of(
    run_up: MeasuredRunUp,
    names: Sequence[str],
    signed: Floats,
    lines: Sequence[OrderLine],
    amplitudes: Sequence[SingleComplexes],
) -> list[Any]:
    """Ascending speeds (points,), rad/s without sign, and of each response what the channels measure at them.

    Parameters
    ----------
    names : of the signals
    signed : (points,) speeds of the input, rad/s
    amplitudes : of each response (points, lines, signals)

    Returns
    -------
    speeds, and transfers (channels, lines, points); their phases are relative to the angle in the sense of rotation

    Raises
    ------
    SteadyError
        There is no signal at the place of a channel.
    """
    # Speeds without a steady state are interpolated: a single missing value would spread over the whole sweep.
    solved = np.flatnonzero(np.isfinite(np.sum(amplitudes, axis=(0, 2, 3))))
    speed, places = np.unique(np.abs(signed[solved]), return_index=True)
    ascending = solved[places]
    frequency = np.array([line.order for line in lines])[:, None] * speed / (2.0 * np.pi)
    found: list[Any] = [speed]
    for own in amplitudes:
        values = np.moveaxis(own[ascending].astype(np.complex128), 0, 1)
        of_channels = [channel.computed(names, values, frequency) for channel in run_up.channels]
        for channel, transfer in zip(run_up.channels, of_channels, strict=True):
            if transfer is None:
                raise SteadyError(_missing(run_up, channel, names))
        found.append(np.array(of_channels))
    return found


def mesh_lines(response: xr.Dataset, harmonics: int) -> dict[str, int]:
    """Places of the mesh frequencies and their harmonics among the orders of a steady-state response, by name."""
    return harmonic_rows(response["index"].to_numpy(), [str(name) for name in response["base"].to_numpy()], harmonics)


def harmonic_rows(indices: Integers, bases: Sequence[str], harmonics: int) -> dict[str, int]:
    """Rows with multiples of a single mesh frequency among multiples (lines, bases) of all of them, by name.

    Examples
    --------
    >>> harmonic_rows(np.array([[0, 0], [1, 0], [1, -1], [0, 2], [0, 3]]), ["one", "two"], 2)
    {'one': 1, '2 x two': 3}
    """
    found = {}
    for row, index in enumerate(indices):
        if np.count_nonzero(index) == 1 and 1 <= index[index != 0][0] <= harmonics:
            name = line_name(tuple(int(n) for n in index), tuple(bases))
            if "carrier" not in name.split():
                found[name] = row
    return found


def _missing(run_up: MeasuredRunUp, channel: MeasuredChannel, names: Sequence[str]) -> str:
    """Return why the response has no signal for a channel, and what to do."""
    key = f"measurements.{run_up.name}.channels.{channel.name}"
    places = sorted({own.split()[1] for own in names if own.startswith("seat_acceleration ") and own.endswith(" x")})
    if not channel.place:
        return f"{key}: the response has no overall transmission error"
    known = f"it has {', '.join(places)}" if places else "the variant has none: use --variant bushing or flexible"
    return (
        f"{key}.place = {channel.place!r}: the response has no {channel.quantity} there; {known}. Bearings of planets "
        "have no place that stands still"
    )


def best_stretch(cuts: ComparedCuts) -> float:
    """Factor on the computed speeds with which the cuts agree best.

    It is 1.05 if computed resonances are 5 % too low. Means of each channel are left out, since a wrong gain shifts all
    its levels.
    """
    order = np.argsort(cuts.speed)
    speed = cuts.speed[order]
    compared = cuts.fitted[:, :, order]
    with np.errstate(divide="ignore"):
        measured, computed = (20.0 * np.log10(np.abs(a))[:, :, order] for a in (cuts.measured, cuts.computed))
    best, least = 1.0, math.inf
    for stretch in sorted(STRETCHES, key=lambda own: abs(math.log(own))):
        squares, count = 0.0, 0
        for channel, of_channel in enumerate(compared):
            own = [
                np.interp(speed[chosen], stretch * speed, computed[channel, line]) - measured[channel, line, chosen]
                for line, chosen in enumerate(of_channel)
            ]
            values = np.concatenate(own)
            values = values[np.isfinite(values)]
            if values.size:
                squares += float(((values - values.mean()) ** 2).sum())
                count += values.size
        # A stretch moves the ends out of the run; what remains must still be most of it.
        if count > 0.5 * np.count_nonzero(compared) and squares / count < 0.98 * least:
            best, least = float(stretch), squares / count
    return best


@dataclass(frozen=True)
class _Peak:
    """A peak of a cut, by a parabola through the levels of three windows."""

    frame: int
    speed: float
    amplitude: float
    prominence: float


def paired_peaks(cuts: ComparedCuts, stretch: float) -> tuple[PeakPair, ...]:
    """Peaks of measured and computed cuts, highest first relative to the highest amplitude of the channel.

    Peaks are paired one to one by their speeds, computed speeds being multiplied by the stretch. One of a pair must
    stand out by 3 dB, its partner by 1 dB.
    """
    found: list[tuple[float, PeakPair]] = []
    for channel in range(len(cuts.run_up.channels)):
        measured, computed = (np.nan_to_num(np.abs(a[channel])) for a in (cuts.measured, cuts.computed))
        top = float(np.where(computed > 0.0, measured, 0.0).max())
        own_top = float(computed.max())
        for line in range(len(cuts.lines)):
            background = cuts.background[channel, line] * 10.0 ** (ABOVE_BACKGROUND / 20.0)
            least = np.maximum(background, top * 10.0 ** (-PEAK_RANGE / 20.0))
            own = _peaks(cuts.speed, measured[line], least)
            other = _peaks(cuts.speed, computed[line], np.full(least.shape, own_top * 10.0 ** (-PEAK_RANGE / 20.0)))
            for here, there in _pairs([peak.speed for peak in own], [stretch * peak.speed for peak in other]):
                one, two = (None if here is None else own[here]), (None if there is None else other[there])
                known = [peak for peak in (one, two) if peak is not None]
                if max(peak.prominence for peak in known) < PROMINENCE:
                    continue
                at = known[0].frame
                pair = PeakPair(
                    channel,
                    line,
                    math.nan if one is None else one.speed,
                    math.nan if two is None else two.speed,
                    float(measured[line, at]) if one is None else one.amplitude,
                    float(computed[line, at]) if two is None else two.amplitude,
                    bool(cuts.contact_loss[known[-1].frame]),
                )
                if math.isfinite(pair.difference):
                    found.append((pair.computed / own_top if one is None else pair.measured / top, pair))
    return tuple(pair for _, pair in sorted(found, key=lambda own: -own[0]))


def resonance_shift(peaks: Sequence[PeakPair], stretch: float) -> float:
    """Return computed over measured speed of resonances minus 1: the median of three or more pairs, or of the stretch.

    Pairs at speeds where teeth lose contact do not count. Without any pair it is NaN.

    Examples
    --------
    >>> peaks = [PeakPair(0, 0, 100.0, speed, 1.0, 1.0) for speed in (104.0, 105.0, 109.0)]
    >>> round(resonance_shift(peaks, 1.0), 6), resonance_shift(peaks[:2], 0.8), resonance_shift([], 0.8)
    (0.05, 0.25, nan)
    """
    if not any(peak.paired for peak in peaks):
        return math.nan
    shifts = [peak.speed_difference for peak in peaks if peak.paired and not peak.contact_loss]
    return float(np.median(shifts)) if len(shifts) >= 3 else 1.0 / stretch - 1.0


def _peaks(speed: Floats, amplitude: Floats, least: Floats) -> list[_Peak]:
    """Peaks of an amplitude above a least one; unknown amplitudes are 0, and there is no peak next to them."""
    from scipy.signal import find_peaks

    level = 20.0 * np.log10(np.maximum(amplitude, 1e-300))
    frames, properties = find_peaks(level, prominence=FAINT)
    found = []
    for frame, prominence in zip(frames, properties["prominences"], strict=True):
        if not (amplitude[frame] > least[frame] and amplitude[frame - 1 : frame + 2].all()):
            continue
        before, middle, after = level[frame - 1 : frame + 2]
        shift = 0.5 * (before - after) / (before - 2.0 * middle + after)
        top = middle - 0.25 * (before - after) * shift
        at = float(np.interp(frame + shift, np.arange(speed.size), speed))
        found.append(_Peak(int(frame), at, 10.0 ** (top / 20.0), float(prominence)))
    return found


def _pairs(first: Sequence[float], second: Sequence[float]) -> list[tuple[int | None, int | None]]:
    """Pairs of speeds that are nearest to each other, one to one, and those without a partner."""
    apart = [
        (abs(math.log(a / b)), i, k) for i, a in enumerate(first) for k, b in enumerate(second) if a > 0.0 and b > 0.0
    ]
    pairs: list[tuple[int | None, int | None]] = []
    left, right = set(range(len(first))), set(range(len(second)))
    for distance, i, k in sorted(apart):
        if distance <= PAIRED and i in left and k in right:
            pairs.append((i, k))
            left.remove(i)
            right.remove(k)
    return [*pairs, *((i, None) for i in sorted(left)), *((None, k) for k in sorted(right))]


def resolution_text(run_up: MeasuredRunUp) -> str:
    """Window and bandwidth as text, for captions; the revolutions are those of the shaft with the speed signal."""
    bandwidth = BANDWIDTH * run_up.per / run_up.window.revolutions
    return (
        f"Hann window over {run_up.window.revolutions:g} revolutions of {run_up.speed_shaft}, bandwidth "
        f"{bandwidth:.3g} orders of the input"
    )
