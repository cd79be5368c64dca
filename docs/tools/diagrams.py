"""Explanatory diagrams of the documentation: ``python docs/tools/diagrams.py`` writes them into ``docs/images``.

They are SVG on a white background, so that they are readable in light and dark themes. Equal input gives equal bytes.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, FancyArrowPatch, FancyBboxPatch, Polygon, Rectangle

IMAGES = Path(__file__).parent.parent / "images"
DARK, BLUE, RED, GREEN, GREY = "#222222", "#1f5fa8", "#b3261e", "#2e7d32", "#8a8a8a"
STYLE = {"svg.hashsalt": "exugear", "svg.fonttype": "path", "font.size": 10.0, "text.color": DARK}


def main() -> None:
    """Write all diagrams."""
    with mpl.rc_context(STYLE):
        for name, draw in {
            "workflow": workflow,
            "mesh_frame": mesh_frame,
            "planets": planets,
            "bearing_axes": bearing_axes,
            "permissions": permissions,
        }.items():
            figure = draw()
            figure.savefig(IMAGES / f"{name}.svg", metadata={"Date": None}, facecolor="white")


def _figure(width: float, height: float, panels: int = 1, ratios: list[float] | None = None) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(1, panels, squeeze=False, gridspec_kw={"width_ratios": ratios})[0]
    for axis in axes:
        axis.set_aspect("equal")
        axis.axis("off")
    return figure, axes


def _arrow(axis: Any, start: tuple[float, float], end: tuple[float, float], colour: str = DARK, **more: Any) -> None:
    settings = {"arrowstyle": "-|>", "mutation_scale": 13.0, "linewidth": 1.6, "shrinkA": 0.0, "shrinkB": 0.0}
    axis.add_patch(FancyArrowPatch(start, end, color=colour, **{**settings, **more}))


def _turn(axis: Any, centre: tuple[float, float], radius: float, first: float, last: float, colour: str) -> None:
    """Draw an arc with an arrow head at its last angle (deg)."""
    low, high = min(first, last), max(first, last)
    axis.add_patch(Arc(centre, 2 * radius, 2 * radius, theta1=low, theta2=high, color=colour, linewidth=1.6))
    sense = math.copysign(1.0, last - first)
    points = [
        (
            centre[0] + radius * math.cos(math.radians(angle)),
            centre[1] + radius * math.sin(math.radians(angle)),
        )
        for angle in (last - 4.0 * sense, last + 4.0 * sense)
    ]
    _arrow(axis, points[0], points[1], colour)


def workflow() -> Figure:
    """From the gearbox file to the report."""
    figure, (axis,) = _figure(9.0, 3.5)
    boxes = {
        "file": (0.0, 1.5, "gearbox file\ngears, shafts,\nbearings, loads", GREY),
        "tables": (2.6, 2.7, "TE tables\nexugear ste", BLUE),
        "static": (2.6, 1.5, "static state\nexugear check, bearings", BLUE),
        "bodies": (2.6, 0.3, "flexible bodies\nreduction", BLUE),
        "model": (5.2, 1.5, "multibody model\nrigid, bushing,\nflexible", DARK),
        "modes": (7.8, 3.1, "modes\nexugear modes", GREEN),
        "steady": (7.8, 2.1, "constant speed\nexugear steady", GREEN),
        "run": (7.8, 1.1, "time simulation\nexugear run", GREEN),
        "life": (7.8, 0.1, "spectrum, life\nexugear loads, life", GREEN),
        "report": (10.3, 1.6, "report\nexugear\nreport", RED),
    }
    width = 1.95
    for x, y, text, colour in boxes.values():
        high = 0.86 if text.count("\n") > 1 else 0.66
        broad = 1.3 if "report" in text else width
        shape = FancyBboxPatch((x, y - high / 2), broad, high, boxstyle="round,pad=0.05", fc="white", ec=colour, lw=1.6)
        axis.add_patch(shape)
        axis.text(x + broad / 2, y, text, ha="center", va="center", fontsize=8.2)
    for start, end in (
        ("file", "tables"),
        ("file", "static"),
        ("file", "bodies"),
        ("tables", "model"),
        ("static", "model"),
        ("bodies", "model"),
        ("model", "modes"),
        ("model", "steady"),
        ("model", "run"),
        ("model", "life"),
        ("modes", "report"),
        ("steady", "report"),
        ("run", "report"),
        ("life", "report"),
    ):
        _arrow(axis, (boxes[start][0] + width + 0.07, boxes[start][1]), (boxes[end][0] - 0.07, boxes[end][1]), GREY)
    axis.text(5.7, -0.55, "exugear study repeats any of these steps for varied inputs", ha="center", fontsize=8.2)
    axis.set(xlim=(-0.15, 11.8), ylim=(-0.75, 3.6))
    return figure


def permissions() -> Figure:
    """Draw what a gearbox file from elsewhere may read and run."""
    figure, (axis,) = _figure(8.0, 2.7)
    boxes = {
        (0.0, 1.0, "gearbox file\nof somebody else"): GREY,
        (3.2, 2.0, "files below its folder: read"): GREEN,
        (3.2, 1.0, "files elsewhere: refused,\nbelow DIR with --allow-dir DIR"): BLUE,
        (3.2, 0.0, "gmsh scripts: not run,\nexcept with --allow-scripts"): RED,
    }
    for (x, y, text), colour in boxes.items():
        broad = 3.2 if x else 1.9
        axis.add_patch(
            FancyBboxPatch((x, y - 0.33), broad, 0.66, boxstyle="round,pad=0.05", fc="white", ec=colour, lw=1.6)
        )
        axis.text(x + broad / 2, y, text, ha="center", va="center", fontsize=9.0)
        if x:
            _arrow(axis, (1.97, 1.0), (x - 0.07, y), GREY)
    axis.set(xlim=(-0.15, 6.6), ylim=(-0.5, 2.5))
    return figure


def mesh_frame() -> Figure:
    """Line of centres, line of action, loaded flank; sense of rotation and of the helix."""
    figure, (axis, side) = _figure(9.0, 4.6, 2, [2.6, 1.0])
    first, second, alpha = 1.0, 1.5, math.radians(22.0)
    distance = first + second
    for centre, radius, name in (((0.0, 0.0), first, "gear 1"), ((distance, 0.0), second, "gear 2")):
        axis.add_patch(Circle(centre, radius, fill=False, ec=GREY, lw=1.2, ls="--"))
        axis.add_patch(Circle(centre, radius * math.cos(alpha), fill=False, ec=DARK, lw=1.2))
        axis.plot(*centre, "+", color=DARK)
        axis.text(centre[0] - 0.2, centre[1] - 0.72 * radius, name, ha="center", va="center")
    direction = (math.sin(alpha), math.cos(alpha))
    ends = [(first - f * direction[0], -f * direction[1]) for f in (first * math.sin(alpha), -second * math.sin(alpha))]
    axis.plot(*zip(*ends, strict=True), color=BLUE, lw=1.8)
    axis.text(ends[0][0] - 0.05, ends[0][1] - 0.12, "line of action", color=BLUE, ha="right", va="top")
    pitch = (first, 0.0)
    _arrow(axis, (0.0, 0.0), (0.55, 0.0), DARK)
    axis.text(0.5, 0.06, "u", fontstyle="italic")
    _arrow(axis, pitch, (first, 1.25), DARK)
    axis.text(first - 0.13, 1.18, "t", fontstyle="italic")
    _arrow(axis, pitch, (first + 1.5 * direction[0], 1.5 * direction[1]), RED)
    axis.text(first + 1.5 * direction[0], 1.56, "force of gear 1 on gear 2", color=RED, va="bottom")
    axis.add_patch(Arc(pitch, 1.5, 1.5, theta1=68.0, theta2=90.0, color=DARK))
    axis.text(first + 0.15, 0.83, "α", ha="center")
    axis.plot(*pitch, "o", color=DARK, ms=4)
    axis.text(first + 0.08, -0.16, "pitch point")
    _turn(axis, (0.0, 0.0), 0.42, 100.0, 190.0, GREEN)
    axis.text(0.0, 0.6, "+ rotation", color=GREEN, ha="center", va="center")
    _turn(axis, (distance, 0.0), 0.5, 80.0, -10.0, GREEN)
    axis.add_patch(Circle((-1.15, -1.3), 0.09, fill=False, ec=DARK, lw=1.4))
    axis.plot(-1.15, -1.3, ".", color=DARK)
    axis.text(-1.0, -1.3, "+z towards the reader", va="center")
    axis.text(-1.4, 1.95, "loaded flank s = +1: gear 1 drives in + rotation", ha="left")
    axis.set(xlim=(-1.45, 4.1), ylim=(-1.6, 2.2))
    side.add_patch(Rectangle((0.0, 0.0), 1.2, 1.6, fill=False, ec=DARK, lw=1.4))
    for offset in range(-2, 7):
        low, high = 0.25 * offset, 0.25 * offset + 0.45
        line = [(x, (x - low) / (high - low) * 1.6) for x in (max(low, 0.0), min(high, 1.2))]
        if line[0][0] < line[1][0]:
            side.plot(*zip(*line, strict=True), color=BLUE, lw=1.4)
    _arrow(side, (-0.3, -0.1), (-0.3, 1.9), DARK)
    side.text(-0.3, 1.95, "+z", ha="center", va="bottom")
    side.text(0.6, -0.15, "right-hand helix,\nhelix angle positive", ha="center", va="top")
    side.set(xlim=(-0.6, 1.5), ylim=(-0.9, 2.3))
    return figure


def planets() -> Figure:
    """Numbering of planets and the sense of pin position errors."""
    figure, (axis,) = _figure(6.4, 4.6)
    orbit, size = 1.15, 0.5
    axis.add_patch(Circle((0.0, 0.0), orbit + size, fill=False, ec=DARK, lw=1.4))
    axis.add_patch(Circle((0.0, 0.0), orbit - size, fill=False, ec=DARK, lw=1.4))
    axis.text(0.0, -0.1, "sun", ha="center", va="top")
    axis.text(0.0, -orbit - size - 0.05, "ring", ha="center", va="top")
    for number, degrees in enumerate((0.0, 120.0, 240.0), 1):
        angle = math.radians(degrees)
        place = (orbit * math.cos(angle), orbit * math.sin(angle))
        axis.add_patch(Circle(place, size, fill=False, ec=BLUE, lw=1.6))
        axis.plot([0.0, place[0]], [0.0, place[1]], color=GREY, lw=1.0, ls=":")
        if number > 1:
            axis.text(*place, f"planet_{number}", ha="center", va="center", color=BLUE)
    axis.text(orbit - 0.05, -0.2, "planet_1", ha="center", va="center", color=BLUE)
    _arrow(axis, (orbit, 0.0), (orbit + 0.42, 0.0), RED)
    axis.text(orbit + 0.58, 0.0, "radial_um > 0", color=RED, va="center")
    _arrow(axis, (orbit, 0.0), (orbit, 0.42), RED)
    axis.text(orbit + 0.62, 0.52, "tangential_um > 0", color=RED, va="bottom")
    axis.plot([orbit + 0.02, orbit + 0.6], [0.42, 0.56], color=RED, lw=0.7)
    _turn(axis, (0.0, 0.0), 0.42, 10.0, 110.0, GREEN)
    axis.text(0.2, 0.72, "carrier angle,\nplanet_angles_deg", color=GREEN, va="bottom", fontsize=8.0)
    _arrow(axis, (-2.2, -1.6), (-1.7, -1.6), DARK)
    _arrow(axis, (-2.2, -1.6), (-2.2, -1.1), DARK)
    axis.text(-1.66, -1.6, "x", va="center")
    axis.text(-2.2, -1.06, "y", ha="center", va="bottom")
    axis.text(-2.25, 1.75, "carrier at zero angle, +z towards the reader")
    axis.set(xlim=(-2.4, 3.3), ylim=(-1.95, 2.0))
    return figure


def bearing_axes() -> Figure:
    """Axes of a bearing, positive axial load, locating directions and arrangements."""
    figure, (axis, pairs) = _figure(9.0, 3.8, 2, [1.3, 1.0])
    axis.add_patch(Rectangle((0.0, -0.25), 3.4, 0.5, fc="#eeeeee", ec=DARK))
    axis.plot([-0.25, 3.7], [0.0, 0.0], color=GREY, lw=1.0, ls="-.")
    for sign in (1.0, -1.0):
        for low, high in ((0.25, 0.38), (0.72, 0.85)):
            axis.add_patch(Rectangle((1.4, min(sign * low, sign * high)), 0.5, high - low, fc="white", ec=DARK))
        axis.add_patch(Circle((1.65, sign * 0.55), 0.165, fc="white", ec=DARK))
    _arrow(axis, (2.0, 0.315), (2.65, 0.315), RED)
    axis.text(2.0, 0.42, "axial load of the shaft\non the inner ring > 0", color=RED, va="bottom", fontsize=9.0)
    _arrow(axis, (1.3, -0.315), (0.65, -0.315), BLUE)
    axis.text(
        0.0,
        -0.92,
        "support_force: force on the body\n(opposite sign)",
        color=BLUE,
        va="top",
        fontsize=9.0,
    )
    _arrow(axis, (3.4, 0.0), (3.95, 0.0), DARK)
    axis.text(4.0, 0.0, "+z", va="center")
    _arrow(axis, (0.2, 0.3), (0.2, 0.95), DARK)
    axis.text(0.2, 1.0, "x", ha="center", va="bottom")
    axis.text(1.65, 1.0, "outer ring", ha="center", va="bottom", fontsize=9.0)
    axis.set(xlim=(-0.4, 4.4), ylim=(-1.5, 1.4))
    for place, name, inward in ((0.0, "O", -1.0), (2.0, "X", 1.0)):
        pairs.plot([place - 0.85, place + 0.85], [0.0, 0.0], color=GREY, lw=1.0, ls="-.")
        for side in (-1.0, 1.0):
            for sign in (1.0, -1.0):
                centre = (place + 0.25 * side, 0.7 * sign)
                apex = (centre[0] - side * inward * 0.45, 0.0)
                pairs.plot([centre[0], apex[0]], [centre[1], apex[1]], color=BLUE, lw=1.0)
                tilt = math.atan2(apex[1] - centre[1], apex[0] - centre[0])
                pairs.add_patch(Polygon(_roller(centre, tilt), closed=True, fc="white", ec=DARK))
        pairs.text(place, -1.15, f'arrangement = "{name}"', ha="center", va="top", fontsize=9.0)
    pairs.text(1.0, 1.2, "lines of contact meet the axis apart (O) or together (X)", ha="center", fontsize=8.5)
    pairs.set(xlim=(-1.0, 3.0), ylim=(-1.5, 1.45))
    return figure


def _roller(centre: tuple[float, float], tilt: float) -> list[tuple[float, float]]:
    """Corners of a roller whose line of contact has the direction `tilt` (rad)."""
    along, across = (math.cos(tilt), math.sin(tilt)), (-math.sin(tilt), math.cos(tilt))
    corners = ((-0.13, -0.17), (-0.13, 0.17), (0.13, 0.17), (0.13, -0.17))
    return [(centre[0] + a * along[0] + b * across[0], centre[1] + a * along[1] + b * across[1]) for a, b in corners]


if __name__ == "__main__":
    main()
