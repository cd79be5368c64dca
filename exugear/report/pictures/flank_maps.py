"""Contact pressure over a flank as a picture with the line load along the face below it, for SVG templates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from exugear.report.pictures.png import png, png_address
from exugear.report.pictures.scene import DISPLACEMENT_COLOURS
from exugear.report.pictures.speed_diagrams import Mark, round_ticks
from fe_ste.flank_pressure import FlankPressure

WIDTH, HEIGHT = 400.0, 262.0
LEFT, RIGHT = 60.0, 336.0
BAR = (350.0, 362.0)
"""Left and right edge of the colour bar."""
MAP = (18.0, 138.0)
"""Upper and lower edge of the pressure map."""
SHADES = 64
"""Number of colours of the bar."""
LOAD = (150.0, 226.0)
"""Upper and lower edge of the diagram of the line load."""


@dataclass(frozen=True)
class FlankMap:
    """Drawing of one state; coordinates are those of the drawing, y down."""

    width: float
    height: float
    left: float
    right: float
    map: tuple[float, float]
    load: tuple[float, float]
    picture: str
    """Address that contains the pressure map as PNG; it has a row a place on the path of contact."""
    curve: str
    """Line load as path data."""
    mean: float
    """Height of the mean line load."""
    ticks: tuple[Mark, ...]
    """Of the position along the face, mm."""
    loads: tuple[Mark, ...]
    """Of the line load, N/mm."""
    words: str
    bar: tuple[float, float]
    colours: str
    """Edges of the colour bar, and the address that contains its colours as PNG."""
    pressures: tuple[Mark, ...]
    """Of the colour bar, MPa."""


def flank_map(flank: FlankPressure, highest: float, heaviest: float, words: str) -> FlankMap:
    """Draw the pressure over a flank and the line load along its face.

    Parameters
    ----------
    highest, heaviest : pressure (Pa) of the last colour, and line load (N/m) at the upper edge
    """
    colours = LinearSegmentedColormap.from_list("pressure", DISPLACEMENT_COLOURS)
    shares = np.clip(flank.pressure / highest, 0.0, 1.0)
    half = 0.5 * len(flank.axial) * float(flank.axial[1] - flank.axial[0])
    middle = 0.5 * float(flank.axial[0] + flank.axial[-1])
    low, high = middle - half, middle + half

    def across(axial: float) -> float:
        return LEFT + (axial - low) / (high - low) * (RIGHT - LEFT)

    def upward(load: float) -> float:
        return LOAD[1] - load / heaviest * (LOAD[1] - LOAD[0])

    points = zip(flank.axial.tolist(), flank.line_load.tolist(), strict=True)
    curve = " L".join(f"{across(axial):.1f} {upward(load):.1f}" for axial, load in points)
    places = round_ticks(1e3 * low, 1e3 * high, 5)
    ticks = tuple(Mark(across(1e-3 * value), LOAD[1] + 14.0, f"{value:g}".replace("-", "−")) for value in places)
    heights = round_ticks(0.0, 1e-3 * heaviest, 3)
    loads = tuple(Mark(LEFT - 5.0, upward(1e3 * value) + 3.5, f"{value:g}") for value in heights)
    values = [value for value in round_ticks(0.0, 1e-6 * highest, 4) if value < 0.9e-6 * highest] + [1e-6 * highest]
    bar_height = MAP[1] - MAP[0]
    pressures = tuple(
        Mark(BAR[1] + 4.0, MAP[1] - 1e6 * value / highest * bar_height + 3.5, f"{value:.0f}") for value in values
    )
    return FlankMap(
        WIDTH,
        HEIGHT,
        LEFT,
        RIGHT,
        MAP,
        LOAD,
        picture=png_address(png(colours(shares)[::-1])),
        curve=f"M{curve}",
        mean=upward(float(flank.line_load.mean())),
        ticks=ticks,
        loads=loads,
        words=words,
        bar=BAR,
        colours=png_address(png(colours(np.linspace(1.0, 0.0, SHADES)[:, None]))),
        pressures=pressures,
    )
