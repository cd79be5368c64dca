"""Diagrams over speed for the page as drawings for SVG templates: amplitudes in strips, and the Campbell diagram.

Coordinates are those of the drawing, x to the right and y down, in units of about one pixel.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from exugear.gearbox.units import RPM
from exugear.report.findings.ranking import AROUND, Envelope, Ranking
from exugear.results.spectra.waterfall import OrderLine
from fe_ste.tools.arrays import Floats

NUMBERED = 10
"""Number of resonances in the Campbell diagram."""
DECADES = 3.0
"""Maximum range of a logarithmic axis."""
CIRCLED = 6
"""Number of resonances that are circled, and the worst rank in a quantity with a circle there."""
HEADING = 28.0
"""Height that the title of a strip and the circles above the curve need."""
RADIUS = 8.0
"""Radius of a circle with a number."""
NARROWEST = 1e-3
"""Minimum length of an axis of speeds, relative to its beginning or in rpm."""
MOST_DECADES = 4
"""Most ticks of a logarithmic axis with powers of ten."""
TICKS = 7
"""Approximate number of ticks of an axis."""
HEADROOM = 1.3
"""Highest frequency of the Campbell diagram over that of the highest ranked resonance."""
BETWEEN_LABELS = 13.0
"""Minimum distance of labels."""


@dataclass(frozen=True)
class Mark:
    """Text or number at a point; with an angle for text along a line."""

    x: float
    y: float
    text: str
    angle: float = 0.0
    first: bool = False
    """Whether it is the first resonance of the ranking."""


@dataclass(frozen=True)
class Frame:
    """Common parts of a diagram over speed."""

    width: float
    height: float
    left: float
    right: float
    bottom: float
    """Edges of the drawing area; it begins at `TOP`."""
    speeds: tuple[float, float]
    """Ends of the axis, rpm."""
    ticks: tuple[Mark, ...]
    span: tuple[float, float] | None
    """Edges of the operating range within the axis; None if all speeds are evaluated."""
    rated: float | None
    """Place of the rated speed; None if it is not given or outside the axis."""

    def x(self, rpm: float) -> float:
        """Return the place of a speed."""
        low, high = self.speeds
        return self.left + (rpm - low) / (high - low) * (self.right - self.left)


TOP = 22.0
"""Upper edge of the drawing area, below the labels of range and rated speed."""


def round_ticks(low: float, high: float, count: int = TICKS) -> list[float]:
    """Return round numbers in a range, about as many as wanted.

    Examples
    --------
    >>> round_ticks(9.3, 28.2)
    [12.0, 15.0, 18.0, 21.0, 24.0, 27.0]
    """
    rough = (high - low) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1.0, 2.0, 3.0, 5.0, 10.0) if power * factor >= rough)
    return [step * n for n in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _frame(
    size: tuple[float, float],
    sides: tuple[float, float],
    speeds: tuple[float, float],
    ranking: Ranking,
    rated: float | None,
) -> Frame:
    width, height = size
    # A run at constant speed has no range.
    speeds = (speeds[0], max(speeds[1], speeds[0] * (1.0 + NARROWEST), NARROWEST))
    frame = Frame(width, height, sides[0], width - sides[1], height - 32.0, speeds, (), None, None)
    count = max(3, int(width / 90.0))
    ticks = tuple(Mark(frame.x(rpm), frame.bottom + 14.0, f"{rpm:g}") for rpm in round_ticks(*speeds, count))
    low, high = (min(max(speed / RPM, speeds[0]), speeds[1]) for speed in ranking.speeds)
    span = None if ranking.whole else (frame.x(low), frame.x(high))
    at_rated = frame.x(rated) if rated is not None and speeds[0] <= rated <= speeds[1] else None
    return replace(frame, ticks=ticks, span=span, rated=at_rated)


# Amplitudes over speed: one strip a quantity


@dataclass(frozen=True)
class Strip:
    """Strip of one quantity."""

    name: str
    title: str
    top: float
    bottom: float
    path: str
    bands: tuple[tuple[float, float, float], ...]
    """Place, and ends of the range of damping, of each circled peak."""
    ticks: tuple[Mark, ...]
    circles: tuple[Mark, ...]


@dataclass(frozen=True)
class Strips:
    """Amplitudes of all quantities over speed."""

    frame: Frame
    strips: tuple[Strip, ...]
    words: str


def strips_of(
    ranking: Ranking,
    curves: Mapping[str, Envelope],
    titles: Mapping[str, tuple[str, float]],
    rated: float | None,
    size: tuple[float, float],
    words: str,
) -> Strips:
    """Draw the largest order of each quantity over speed, with the resonances of a ranking.

    Parameters
    ----------
    titles : title with unit, and factor from SI units, by quantity
    rated : rated speed, rpm
    """
    fastest = max(float(curve.speed[-1]) for curve in curves.values())
    low, high = ranking.speeds
    speeds = (AROUND[0] * low / RPM, min(AROUND[1] * high, fastest) / RPM)
    if ranking.whole:
        speeds = (low / RPM, high / RPM)
    frame = _frame(size, (46.0, 8.0), speeds, ranking, rated)
    gap = 8.0
    height = (frame.bottom - TOP + gap) / len(curves)
    strips = []
    for number, (name, curve) in enumerate(curves.items()):
        top = TOP + number * height
        strips.append(_strip(frame, ranking, name, curve, titles[name], (top, top + height - gap)))
    return Strips(frame, tuple(strips), words)


def _strip(
    frame: Frame, ranking: Ranking, name: str, curve: Envelope, title: tuple[str, float], edges: tuple[float, float]
) -> Strip:
    top, bottom = edges
    label, factor = title
    rpm = curve.speed / RPM
    shown = (rpm >= frame.speeds[0]) & (rpm <= frame.speeds[1])
    rpm = rpm[shown]
    value = np.nan_to_num(factor * curve.amplitude[shown], posinf=0.0)
    marked = []
    for number, own in enumerate(ranking.resonances[:CIRCLED], start=1):
        amplitude = own.amplitudes.get(name)
        if amplitude and amplitude.place and amplitude.place <= CIRCLED:  # among the highest in this quantity
            marked.append((number, own))
    limits = {number: own.amplitudes[name].limits for number, own in marked}
    ends = [factor * limit.amplitude for pair in limits.values() for limit in pair or ()]
    peak = max(size for size in (*map(float, value), *ends, 1e-300) if math.isfinite(size))
    lowest = max(float(value.min(initial=peak)) / 1.3, peak / 10.0**DECADES)
    highest = lowest * (peak / lowest) ** ((bottom - top) / (bottom - top - HEADING))

    def y(amplitude: float) -> float:
        share = math.log(max(amplitude, lowest) / lowest) / math.log(highest / lowest)
        return bottom - min(share, 1.0) * (bottom - top)

    bands = []
    circles: list[Mark] = []
    for number, own in marked:
        x = frame.x(abs(own.speed) / RPM)
        pair = limits[number]
        above = y(factor * own.amplitudes[name].amplitude)
        if pair is not None:
            low, high = (y(factor * limit.amplitude) for limit in pair)
            bands.append((x, low, high))
        circles.append(_free(x, max(above - RADIUS - 2.0, top + RADIUS), str(number), circles))
    points = " L".join(f"{frame.x(at):.1f} {y(size):.1f}" for at, size in zip(rpm, value, strict=True))
    ticks = tuple(Mark(frame.left - 5.0, y(tick) + 3.5, f"{tick:g}") for tick in _decades(lowest, highest))
    return Strip(name, label, top, bottom, f"M{points}" if points else "", tuple(bands), ticks, tuple(circles))


def _free(x: float, y: float, text: str, taken: Sequence[Mark]) -> Mark:
    """Return a circle that does not cover others."""
    while any(math.hypot(x - other.x, y - other.y) < 1.7 * RADIUS for other in taken):
        x += RADIUS
    return Mark(x, y, text, first=text == "1")


def _decades(low: float, high: float) -> list[float]:
    """Return the ticks of a logarithmic axis: powers of ten, and if these are few, also 2 and 5 times them.

    Examples
    --------
    >>> _decades(0.3, 30.0), _decades(1e-3, 1e7)
    ([0.5, 1.0, 2.0, 5.0, 10.0, 20.0], [0.001, 1.0, 1000.0, 1000000.0])
    """
    powers = [10.0**n for n in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)]
    ticks = [power for power in powers if low <= power <= high]
    if len(ticks) > 2:
        return ticks[:: -(-len(ticks) // MOST_DECADES)]
    return [factor * power for power in powers for factor in (1.0, 2.0, 5.0) if low <= factor * power <= high]


# Campbell diagram: orders, modes, and the resonances of the ranking where they meet


@dataclass(frozen=True)
class OrderRay:
    """Order in the Campbell diagram: a line through the origin."""

    x: float
    y: float
    """End; it begins at the origin of the axes."""
    family: int
    harmonic: int
    label: Mark


@dataclass(frozen=True)
class CampbellDrawing:
    """Campbell diagram."""

    frame: Frame
    rays: tuple[OrderRay, ...]
    ticks: tuple[Mark, ...]
    modes: tuple[tuple[float, bool], ...]
    """Height of the line of each mode, and whether a ranked resonance excites it."""
    labels: tuple[Mark, ...]
    """Numbers and frequencies of these modes, at the right edge."""
    circles: tuple[Mark, ...]
    words: str


def campbell_drawing(
    ranking: Ranking,
    lines: Iterable[tuple[OrderLine, str]],
    frequencies: Floats,
    matched: Mapping[int, int],
    rated: float | None,
    size: tuple[float, float],
    words: str,
) -> CampbellDrawing:
    """Draw orders and modes over speed, from standstill to the end of the evaluated speeds.

    Parameters
    ----------
    ranking : its first resonances are circled; the highest of them sets the frequency axis
    lines : orders with their labels
    frequencies : (n,) of the modes, Hz
    matched : index of the mode by number of the resonance in the ranking, from 1
    rated : rated speed, rpm
    """
    shown = ranking.resonances[:NUMBERED]
    highest = HEADROOM * max(own.frequency for own in shown)
    frame = _frame(size, (50.0, 88.0), (0.0, 1.08 * ranking.speeds[1] / RPM), ranking, rated)

    def y(frequency: float) -> float:
        return frame.bottom - frequency / highest * (frame.bottom - TOP)

    circles: list[Mark] = []
    for number, own in enumerate(shown, start=1):
        circles.append(_free(frame.x(abs(own.speed) / RPM), y(own.frequency), str(number), circles))
    rung = set(matched.values())
    labels: list[Mark] = []
    for index in sorted(rung, key=lambda one: frequencies[one]):
        place = y(float(frequencies[index])) + 4.0
        if labels:
            place = min(place, labels[-1].y - BETWEEN_LABELS)
        labels.append(Mark(frame.right + 6.0, place, f"{index + 1}: {frequencies[index]:.0f} Hz"))
    return CampbellDrawing(
        frame,
        tuple(_rays(frame, lines, highest, y(0.0) - TOP)),
        tuple(Mark(frame.left - 6.0, y(tick) + 4.0, f"{tick:g}") for tick in round_ticks(0.0, highest)),
        tuple((y(float(f)), n in rung) for n, f in enumerate(frequencies) if 0.0 < f <= highest),
        tuple(labels),
        tuple(reversed(circles)),
        words,
    )


def _rays(frame: Frame, lines: Iterable[tuple[OrderLine, str]], highest: float, height: float) -> list[OrderRay]:
    rays: list[OrderRay] = []
    families: dict[str, int] = {}
    for line, label in lines:
        number, family = _split(line.name)
        end = frame.speeds[1]
        reach = min(1.0, highest / float(line.frequency(end * RPM)))
        x = frame.x(reach * end)
        y = frame.bottom - float(line.frequency(reach * end * RPM)) / highest * height
        angle = -math.degrees(math.atan2(frame.bottom - y, x - frame.left))
        length = math.hypot(x - frame.left, frame.bottom - y)
        along = 0.97 - 3.6 * len(label) / length
        mark = Mark(
            frame.left + along * (x - frame.left), frame.bottom + along * (y - frame.bottom) - 4.0, label, angle
        )
        # Rays part from each other with the distance from the origin.
        apart = min((abs(math.radians(angle - other.label.angle)) for other in rays if other.label.text), default=1.0)
        if apart * along * length < BETWEEN_LABELS:
            mark = Mark(0.0, 0.0, "")
        rays.append(OrderRay(x, y, families.setdefault(family, len(families)), number, mark))
    return rays


def _split(name: str) -> tuple[int, str]:
    """Split the name of an order into the leading multiple and what follows it.

    Examples
    --------
    >>> _split("2 × high_speed"), _split("spur - 12 × rotation of rotor")
    ((2, 'high_speed'), (1, 'spur - 12 × rotation of rotor'))
    """
    multiple, times, family = name.partition(" × ")
    if times and multiple.isdecimal():
        return int(multiple), family
    return 1, name
