"""Result of a comparison with a measured run-up: cuts, peaks and findings; its files and its diagram."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.measurements import MeasurementSection
from exugear.gearbox.units import RPM
from exugear.gearbox.versions import MEASURED
from exugear.results.findings import Finding
from exugear.results.order_tracking.foreign_orders import OrderInSpectrum
from exugear.results.spectra.diagrams import draw_waterfall
from exugear.results.spectra.waterfall import sweep_matched_window, waterfall
from exugear.steady.evaluation.comparison import (
    ComparedCuts,
    PeakPair,
    best_stretch,
    compared_cuts,
    paired_peaks,
    resolution_text,
    resonance_shift,
)
from exugear.steady.evaluation.mistakes import noticed_mistakes
from exugear.steady.evaluation.run_up import MeasuredRunUp
from exugear.steady.steady_file import settings_of
from fe_ste.tools.arrays import SingleComplexes
from fe_ste.tools.display import ReprMixin, TitledRows
from fe_ste.tools.drawing import (
    COLOURS,
    COLUMN_WIDTHS,
    axes_or_new,
    drawable,
    drawing_style,
    finish_figure,
    new_figure,
)
from fe_ste.tools.files import write_table
from fe_ste.tools.stores import Layout, Store, load_dataset

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

DRAWN_RANGE = 60.0
"""Range of levels that a diagram shows, dB."""
MOST_DRAWN_ORDERS = 4
"""Maximum number of orders in a diagram: those with the highest measured amplitudes."""
DRAWN_UNITS = {"m": ("µm", 1e6), "N": ("N", 1.0), "m/s": ("mm/s", 1e3), "m/s2": ("m/s²", 1.0)}
"""Unit of diagrams and tables, and its factor, by SI unit."""


_LAYOUT = Layout(
    "comparison with a measured run-up",
    MEASURED,
    dict.fromkeys(("measured", "background", "computed", "steady"), ("channel", "line", "window"))
    | {"time": ("window",), "speed": ("window",), "order": ("line",), "line": ("line",)}
    | dict.fromkeys(("channel", "quantity", "where", "unit"), ("channel",)),
    ("measurement", "recording_sha256", "input_hash", "window", "verdict", "peaks", "foreign_orders", "warnings"),
)


@dataclass(frozen=True, eq=False)
class MeasuredComparison(ReprMixin):
    """A measured run-up next to the steady-state response of the same gearbox."""

    cuts: ComparedCuts
    stretch: float
    """Factor on the computed speeds with which the cuts agree best: 1.05 if computed resonances are 5 % too low."""
    peaks: tuple[PeakPair, ...]
    """Peaks, highest first relative to the highest amplitude of the channel."""
    foreign: tuple[OrderInSpectrum, ...]
    """Orders that carry power and belong to no shaft or mesh of the gearbox."""
    findings: tuple[Finding, ...]
    harmonics: int
    """Harmonics of each mesh frequency in the response."""
    input_hash: str
    """SHA-256 of the recording, the section of the gearbox file and the input of the response."""

    def _line(self) -> str:
        return f" of {self.cuts.run_up.name!r}: {self.cuts.shape}, {self.cuts.deviation():.2f} dB (rms)"

    def _table(self) -> TitledRows:
        names = [channel.name for channel in self.cuts.run_up.channels]
        rows = {name: f"{self.cuts.deviation(place):.2f} dB (rms)" for place, name in enumerate(names)}
        return f"Comparison with {self.cuts.run_up.name}", {**rows, "peaks": str(len(self.peaks))}

    @property
    def verdict(self) -> str:
        """How well levels and peaks agree, in one line."""
        deviation = self.cuts.deviation()
        if math.isnan(deviation):
            return f"{self.cuts.run_up.name}: no measured order is above its background"
        text = f"{self.cuts.run_up.name}: computed levels within {deviation:.2f} dB (rms)"
        measured_peaks = sum(not math.isnan(peak.measured_speed) for peak in self.peaks)
        if measured_peaks:
            text += f", {self.paired} of {measured_peaks} measured peaks found"
            text += f", speeds {100.0 * self.speed_shift:+.1f} %" if abs(self.speed_shift) > 0.0005 else ""
        return text

    @property
    def paired(self) -> int:
        """Number of peaks that both sides have."""
        return sum(peak.paired for peak in self.peaks)

    @property
    def speed_shift(self) -> float:
        """Computed over measured speed of resonances minus 1: see `resonance_shift`."""
        return resonance_shift(self.peaks, self.stretch)

    def plot(
        self, channel: str | None = None, kind: Literal["cuts", "waterfall"] = "cuts", ax: Axes | None = None
    ) -> Axes:
        """Draw a channel: measured and computed order cuts over the speed, or the waterfall of the measurement.

        Cuts are those of the orders with the highest measured amplitudes, with the band of plausible damping. The
        steady-state response, neither swept nor averaged, is dotted. The waterfall has the axes and order lines of that
        of a run (`exugear.transient.outcome.Run.plot`).

        Parameters
        ----------
        channel : name of the channel; the first one by default
        kind : ``cuts`` or ``waterfall``
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Raises
        ------
        ValueError
            There is no such channel or kind.
        """
        if kind not in ("cuts", "waterfall"):
            raise ValueError(f"kind = {kind!r}: must be one of cuts, waterfall")
        names = [own.name for own in self.cuts.run_up.channels]
        if channel is not None and channel not in names:
            raise ValueError(f"channel = {channel!r}: must be one of {', '.join(names)}")
        place = 0 if channel is None else names.index(channel)
        if kind == "waterfall":
            return _draw_waterfall(self.cuts, place, ax)
        with axes_or_new(ax, COLUMN_WIDTHS[2], 4.0) as panel:
            _draw_channel(panel, self.cuts, place)
            panel.set_xlabel("Input speed / rpm")
            panel.legend(ncols=2)
            return panel

    def summary(self) -> dict[str, Any]:
        """All results, with units in the keys, for JSON; amplitudes are zero-to-peak, in SI units."""
        cuts = self.cuts
        return {
            "measurement": cuts.run_up.name,
            "recording": str(cuts.run_up.path),
            "input_hash": self.input_hash,
            "window": resolution_text(cuts.run_up),
            "speeds_rpm": [float(cuts.speed.min()) / RPM, float(cuts.speed.max()) / RPM],
            "deviation_dB": _known(cuts.deviation()),
            "deviation_without_means_dB": _known(cuts.deviation_of_shapes),
            "speed_stretch": self.stretch,
            "speed_shift_percent": _known(100.0 * self.speed_shift),
            "channels": [
                {
                    "channel": channel.name,
                    "quantity": channel.quantity,
                    "where": channel.where,
                    "unit": channel.unit,
                    "deviation_dB": _known(cuts.deviation(place)),
                    "offset_dB": _known(cuts.offset(place)),
                }
                for place, channel in enumerate(cuts.run_up.channels)
            ],
            "orders": [
                {"name": line.name, "order": line.order, "deviation_dB": _known(cuts.deviation(line=place))}
                for place, line in enumerate(cuts.lines)
            ],
            "peaks": [self.peak_summary(peak) for peak in self.peaks],
            "foreign_orders": [
                {"order": own.order, "amplitude": own.amplitude, "above_neighbours_dB": own.prominence}
                for own in self.foreign
            ],
        }

    def peak_summary(self, peak: PeakPair) -> dict[str, Any]:
        """One peak, with units in the keys."""
        line = self.cuts.lines[peak.line]
        channel = self.cuts.run_up.channels[peak.channel]
        return {
            "order": line.name,
            "periods_per_revolution": line.order,
            "channel": channel.name,
            "unit": channel.unit,
            "measured_speed_rpm": _known(peak.measured_speed / RPM),
            "computed_speed_rpm": _known(peak.computed_speed / RPM),
            "speed_difference_percent": _known(100.0 * peak.speed_difference),
            "measured_amplitude": peak.measured,
            "computed_amplitude": peak.computed,
            "difference_dB": _known(peak.difference),
            "contact_loss": peak.contact_loss,
        }

    def write(self, path: Path) -> tuple[Path, ...]:
        """Write the comparison: netCDF at `path`, and tables and a diagram next to it; return their paths.

        The tables are ``...-cuts.csv``, ``...-peaks.csv`` and ``...-foreign.csv``, in SI units.
        """
        Store(path, self.input_hash).write_dataset(self._dataset())
        cuts = write_table(path.with_name(f"{path.stem}-cuts.csv"), CUT_HEADINGS, self._cut_rows())
        peaks = [["" if value is None else value for value in self.peak_summary(peak).values()] for peak in self.peaks]
        table = write_table(path.with_name(f"{path.stem}-peaks.csv"), PEAK_HEADINGS, peaks)
        foreign = [[own.order, own.amplitude, own.prominence] for own in self.foreign]
        headings = ("order", "amplitude", "above_neighbours_dB")
        others = write_table(path.with_name(f"{path.stem}-foreign.csv"), headings, foreign)
        picture = path.with_suffix(".png")
        count = len(self.cuts.run_up.channels)
        with drawing_style():
            figure = new_figure(COLUMN_WIDTHS[2], 1.0 + 2.6 * count)
            panels = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
            for channel, panel in enumerate(panels):
                _draw_channel(panel, self.cuts, channel)
                panel.legend(ncols=2, fontsize=6.5)
            panels[-1].set_xlabel("Input speed / rpm")
            words = f"{resolution_text(self.cuts.run_up)}; amplitudes zero-to-peak"
            figure.supxlabel(words, fontsize=7.0, color="#555555")
            finish_figure(figure, picture)
        return path, cuts, table, others, picture

    def _cut_rows(self) -> Iterator[list[float | str]]:
        cuts = self.cuts
        at = [(f"{time:.9g}", f"{speed:.9g}") for time, speed in zip(cuts.time, cuts.speed / RPM, strict=True)]
        amplitudes = np.stack([np.abs(cuts.measured), np.abs(cuts.computed), cuts.steady, cuts.background], axis=-1)
        for channel, of_channel in zip(cuts.run_up.channels, amplitudes, strict=True):
            for line, own in zip(cuts.lines, of_channel.tolist(), strict=True):
                order = f"{line.order:.9g}"
                for (time, speed), values in zip(at, own, strict=True):
                    yield [channel.name, line.name, order, time, speed, *values]

    def _dataset(self) -> xr.Dataset:
        """Labelled arrays with units."""
        import xarray as xr

        cuts = self.cuts
        over = ("channel", "line", "window")
        kinds: dict[str, tuple[Any, str]] = {
            "measured": (np.abs(cuts.measured), "measured order cut, zero-to-peak"),
            "background": (cuts.background, "measured amplitude beside the order, zero-to-peak"),
            "computed": (np.abs(cuts.computed), "computed order cut, swept and averaged as the measured one"),
            "steady": (cuts.steady, "steady-state response at constant speed, zero-to-peak"),
        }
        if cuts.limits is not None:
            kinds["lowest_damping"] = cuts.limits[0], "computed order cut with the lowest plausible damping"
            kinds["highest_damping"] = cuts.limits[1], "computed order cut with the highest plausible damping"
        units = {"units": "see unit"}
        variables: dict[str, Any] = {
            name: (over, array, {**units, "long_name": words}) for name, (array, words) in kinds.items()
        }
        variables |= {
            "time": (("window",), cuts.time, {"units": "s", "long_name": "centre of the window in the recording"}),
            "speed": (("window",), cuts.speed, {"units": "rad/s", "long_name": "speed of the overall input"}),
            "order": (("line",), [line.order for line in cuts.lines], {"units": "1"}),
        }
        variables |= {
            name: (("channel",), np.array([getattr(own, name) for own in cuts.run_up.channels], dtype=object), {})
            for name in ("quantity", "where", "unit")
        }
        names = {
            "channel": [own.name for own in cuts.run_up.channels],
            "line": [line.name for line in cuts.lines],
        }
        summary = self.summary()
        attributes = {
            "method_version": MEASURED,
            "measurement": cuts.run_up.name,
            "recording_sha256": cuts.run_up.digest,
            "window": summary["window"],
            "speed_stretch": self.stretch,
            "verdict": self.verdict,
            "warnings": json.dumps([own.text for own in self.findings if own.level == "warning"]),
            "peaks": json.dumps(summary["peaks"]),
            "foreign_orders": json.dumps(summary["foreign_orders"]),
        }
        return xr.Dataset(variables, {key: np.array(own, dtype=object) for key, own in names.items()}, attributes)


CUT_HEADINGS = (
    "channel",
    "order_name",
    "order",
    "time_s",
    "speed_rpm",
    "measured_amplitude",
    "computed_amplitude",
    "steady_amplitude",
    "background_amplitude",
)
PEAK_HEADINGS = (
    "order_name",
    "order",
    "channel",
    "unit",
    "measured_speed_rpm",
    "computed_speed_rpm",
    "speed_difference_percent",
    "measured_amplitude",
    "computed_amplitude",
    "difference_dB",
    "contact_loss",
)


def compare_run_up(
    gearbox: Gearbox,
    run_up: MeasuredRunUp,
    response: xr.Dataset,
    limits: SingleComplexes | None = None,
) -> MeasuredComparison:
    """Compare a measured run-up with a steady-state response over its speeds.

    Parameters
    ----------
    response : as of `exugear.steady.steady_file.stored_or_computed`
    limits : as of `exugear.steady.evaluation.load_over_speed.damping_extremes`

    Raises
    ------
    SteadyError
        The response has no signal at the place of a channel.
    TooShortError
        The run-up is shorter than a window.
    """
    cuts = compared_cuts(run_up, response, limits)
    stretch = best_stretch(cuts)
    peaks = paired_peaks(cuts, stretch)
    shift = resonance_shift(peaks, stretch)
    foreign, findings = noticed_mistakes(gearbox, cuts, peaks, shift, settings_of(response.attrs).method)
    return MeasuredComparison(
        cuts=cuts,
        stretch=stretch,
        peaks=peaks,
        foreign=foreign,
        findings=findings,
        harmonics=int(response.attrs["harmonics"]),
        input_hash=comparison_hash(run_up.digest, run_up.section, str(response.attrs["input_hash"])),
    )


def comparison_hash(digest: str, section: MeasurementSection, response_hash: str) -> str:
    """SHA-256 of all that a comparison depends on: recording (its SHA-256), section, and input of the response."""
    key = [MEASURED, digest, section.model_dump(mode="json"), response_hash]
    return hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()


def load_comparison(path: Path) -> xr.Dataset:
    """Read what `MeasuredComparison.write` wrote.

    Raises
    ------
    FileError
        The file is missing, damaged, or of another version.
    """
    return load_dataset(path, _LAYOUT)


def _draw_channel(panel: Axes, cuts: ComparedCuts, channel: int) -> None:
    """Draw the cuts of a channel: measured in black tones, computed in colours with their band."""
    own = cuts.run_up.channels[channel]
    unit, factor = DRAWN_UNITS[own.unit]
    measured = factor * np.abs(cuts.measured[channel])
    highest = np.nan_to_num(measured).max(axis=1)
    shown = sorted(np.argsort(-highest)[:MOST_DRAWN_ORDERS])
    speed = cuts.speed / RPM
    for number, line in enumerate(shown):
        colour = COLOURS[number]
        name = drawable(cuts.lines[line].name)
        if cuts.limits is not None:
            ends = factor * cuts.limits[:, channel, line]
            panel.fill_between(speed, ends.min(axis=0), ends.max(axis=0), color=colour, alpha=0.15, linewidth=0.0)
        panel.plot(speed, factor * np.abs(cuts.computed[channel, line]), color=colour, linewidth=0.9, linestyle="--")
        panel.plot(speed, measured[line], color=colour, linewidth=1.4, label=name)
        panel.plot(speed, factor * cuts.steady[channel, line], color=colour, linewidth=0.6, linestyle=":")
    top = float(highest.max())
    panel.set(yscale="log", ylim=(top * 10.0 ** (-DRAWN_RANGE / 20.0), 2.0 * top), xlim=(speed.min(), speed.max()))
    panel.yaxis.set_major_formatter("{x:g}")
    panel.set_ylabel(drawable(f"{own.name}: {own.quantity.replace('_', ' ')}, ± {unit}"))
    panel.set_title("solid: measured; dashed: computed, swept; dotted: steady; band: damping", loc="left", fontsize=7.0)


def _draw_waterfall(cuts: ComparedCuts, channel: int, ax: Axes | None) -> Axes:
    """Draw the waterfall of a channel up to 1.1 times the frequency of the highest order, with the compared orders."""
    run_up = cuts.run_up
    own, shaft = run_up.channels[channel], run_up.shaft
    top = max(float(line.frequency(float(shaft.speed.max()))) for line in cuts.lines)
    span = shaft.angle.size / shaft.rate
    spectra = waterfall(
        run_up.values[channel],
        shaft.speed,
        shaft.rate,
        window_length=min(sweep_matched_window(top * (1.0 - shaft.speed.min() / shaft.speed.max()) / span), 0.1 * span),
        reference=1e-6 if own.unit == "m" else 1.0,
        unit=own.unit,
    )
    quantity = f"{own.name}: {own.quantity.replace('_', ' ')}"
    return draw_waterfall(spectra, cuts.lines, ax, highest_frequency=1.1 * top, quantity=quantity)


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
