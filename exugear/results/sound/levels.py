"""Levels of sound power: dB re 1 pW, A-weighting (IEC 61672-1) and third octaves (IEC 61260-1, base 10)."""

from __future__ import annotations

import numpy as np

from fe_ste.tools.arrays import Floats, Integers

REFERENCE_POWER = 1e-12
"""Sound power of 0 dB, W (ISO 3744)."""
SILENCE = 1e-24
"""Sound power below which nothing radiates, W: -120 dB."""
POLES = (20.60, 107.7, 737.9, 12194.0)
"""Pole frequencies of the A-weighting, Hz (IEC 61672-1:2013, annex E)."""
A_OFFSET = 2.00
"""What makes the A-weighting zero at 1 kHz, dB."""
BANDS_PER_DECADE = 10
BASE_FREQUENCY = 1000.0
"""Centre of the third octave with the number 0, Hz."""
NOMINAL = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
"""Nominal centres over a decade (IEC 61260-1)."""


def power_level(power: Floats) -> Floats:
    """Level (...) of sound powers (...) in W, dB re 1 pW; -120 dB for silence.

    Examples
    --------
    >>> power_level(np.array([1e-12, 1e-3, 0.0]))
    array([   0.,   90., -120.])
    """
    return np.asarray(10.0 * np.log10(np.maximum(power, SILENCE) / REFERENCE_POWER))


def a_weighting(frequency: Floats) -> Floats:
    """A-weighting (...) at frequencies (...) in Hz, dB (IEC 61672-1:2013, annex E).

    Examples
    --------
    >>> a_weighting(np.array([100.0, 1000.0, 4000.0])).round(1) + 0.0
    array([-19.1,   0. ,   1. ])
    """
    square = np.square(np.asarray(frequency, dtype=np.float64))
    first, second, third, fourth = (pole**2 for pole in POLES)
    gain = fourth * square**2 / ((square + first) * (square + fourth) * np.sqrt((square + second) * (square + third)))
    return np.asarray(20.0 * np.log10(np.maximum(gain, 1e-30)) + A_OFFSET)


def a_weighted(power: Floats, frequency: Floats) -> Floats:
    """Sound powers (...) in W at frequencies (...) in Hz, weighted by A."""
    return np.asarray(power * 10.0 ** (0.1 * a_weighting(frequency)))


def third_octave(frequency: Floats) -> Integers:
    """Return the number (...) of the third octave of frequencies (...) in Hz, 0 for that about 1 kHz.

    The edges are those of IEC 61260-1: 10^(-1/20) and 10^(1/20) times the centre 1000 Hz x 10^(n/10). The lower edge
    belongs to it.

    Examples
    --------
    >>> third_octave(np.array([100.0, 890.0, 892.0, 1122.0, 1123.0]))
    array([-10,  -1,   0,   0,   1])
    """
    # What rounds to the edge is on it.
    position = np.round(BANDS_PER_DECADE * np.log10(np.maximum(frequency, 1e-9) / BASE_FREQUENCY), 9)
    return np.asarray(np.floor(position + 0.5), dtype=np.int64)


def nominal_frequency(number: Integers) -> Floats:
    """Nominal centre (...) of third octaves by their numbers (...), Hz.

    Examples
    --------
    >>> nominal_frequency(np.array([-10, -5, 0, 1]))
    array([ 100.,  315., 1000., 1250.])
    """
    decade, place = np.divmod(number, BANDS_PER_DECADE)
    return np.asarray(np.round(BASE_FREQUENCY * 10.0**decade * np.array(NOMINAL)[place], 6))


def third_octave_powers(power: Floats, frequency: Floats) -> tuple[Integers, Floats]:
    """Add the powers of lines by third octaves; return their numbers (bands,) and powers (points, bands), W.

    Parameters
    ----------
    power, frequency : (points, lines) W and Hz; powers that are not a number do not count

    Examples
    --------
    >>> numbers, powers = third_octave_powers(np.array([[1.0, 2.0, 4.0]]), np.array([[990.0, 1010.0, 1600.0]]))
    >>> numbers, powers
    (array([0, 1, 2]), array([[3., 0., 4.]]))
    """
    counted = np.isfinite(power) & (frequency > 0.0)
    if not counted.any():
        return np.zeros(0, dtype=np.int64), np.zeros((len(power), 0))
    band = third_octave(frequency)
    first = int(band[counted].min())
    numbers = np.arange(first, int(band[counted].max()) + 1)
    found = np.zeros((len(power), len(numbers)))
    point, line = np.nonzero(counted)
    np.add.at(found, (point, band[point, line] - first), power[point, line])
    return numbers, found
