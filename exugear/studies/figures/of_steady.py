"""Figures of steady responses over speed."""

from __future__ import annotations

import numpy as np

from exugear.gearbox.parts import RPM
from exugear.steady.peaks import line_name, peaks
from exugear.studies.figures.point_results import PointError, PointResults
from fe_ste.tools.arrays import Floats

OVERALL = "overall_dte"


def _amplitudes(results: PointResults, signal: str) -> Floats:
    """Amplitudes (points, lines) of a signal."""
    names = [str(name) for name in results.steady["signal"].to_numpy()]
    if signal not in names:
        raise PointError(f"no signal {signal!r}; signals are {', '.join(names)}")
    return np.asarray(results.steady["amplitude"].to_numpy()[:, :, names.index(signal)], dtype=np.float64)


def _line(results: PointResults, name: str) -> int:
    """Place of a line by its name, such as ``2 x sun_planet``."""
    bases = tuple(str(base) for base in results.steady["base"].to_numpy())
    names = [line_name(tuple(int(n) for n in row), bases) for row in results.steady["index"].to_numpy()]
    if name not in names:
        raise PointError(f"no line {name!r}; lines are {', '.join(names[1:8])} and so on")
    return names.index(name)


def largest_line(results: PointResults, *, line: str, signal: str = OVERALL) -> float:
    """Largest amplitude over speed of a line of a signal, such as the line ``2 x sun_planet``."""
    return float(_amplitudes(results, signal)[:, _line(results, line)].max())


def loudest_peak(results: PointResults, *, signal: str = OVERALL) -> float:
    """Amplitude of the loudest line of a signal over all speeds."""
    return float(_amplitudes(results, signal)[:, 1:].max())


def loudest_speed(results: PointResults, *, signal: str = OVERALL) -> float:
    """Speed of the input at which a line of a signal is loudest."""
    found = peaks(results.steady, signal)
    if found:
        return float(abs(found[0].speed))
    return float("nan")


def harmonics(
    results: PointResults, *, mesh: str, speed_rpm: float, count: int = 6, signal: str = OVERALL
) -> dict[str, float]:
    """Amplitudes of the harmonics of a mesh in a signal, at the speed nearest to one."""
    speeds = np.abs(results.steady["speed"].to_numpy())
    at = int(np.argmin(np.abs(speeds - abs(speed_rpm) * RPM)))
    values = _amplitudes(results, signal)[at]
    lines = {n: _line(results, mesh if n == 1 else f"{n} x {mesh}") for n in range(1, count + 1)}
    return {str(n): float(values[line]) for n, line in lines.items()}
