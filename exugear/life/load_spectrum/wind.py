"""Hours of files by the wind that they were simulated in: a Weibull distribution over bins of wind speed."""

from __future__ import annotations

import math
from collections.abc import Iterable

from exugear.gearbox.sections.loads import WindSection


def bin_of_wind(wind: WindSection, speed: float) -> float:
    """Middle (m/s) of the bin of a wind speed (m/s): multiples of the width.

    Examples
    --------
    >>> bin_of_wind(WindSection(mean_m_per_s=8.5), 8.93)
    8.0
    """
    width = wind.bin_m_per_s
    return width * math.floor(max(speed, 0.0) / width + 0.5)


def hours_of_bins(wind: WindSection, middles: Iterable[float]) -> list[float]:
    """Hours in a year of bins by their middles (m/s).

    Notes
    -----
    ``F(v) = 1 - exp(-(v / A)^k)``, ``A = mean / Gamma(1 + 1 / k)`` (IEC 61400-1, 6.3.1.1, with k = 2).

    Examples
    --------
    Wind of 8.5 m/s on average blows at 7 to 9 m/s for 1,512 hours:

    >>> [round(hours) for hours in hours_of_bins(WindSection(mean_m_per_s=8.5), [8.0])]
    [1512]
    """
    scale = wind.mean_m_per_s / math.gamma(1.0 + 1.0 / wind.shape)

    def above(speed: float) -> float:
        return math.exp(-((max(speed, 0.0) / scale) ** wind.shape))

    half = 0.5 * wind.bin_m_per_s
    return [wind.hours_per_year * (above(middle - half) - above(middle + half)) for middle in middles]
