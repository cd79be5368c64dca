"""GRC 750 kW: where the sets of `search_3215.py` lie that bring the reference's peak at 3215 Hz, and the nearest ones.

    python cases/grc750/draw_3215.py [results folder]

Draws search-3215-map.png, and of the sets with a peak that are nearest to the file and loudest, waterfalls of the
steady response of both variants and the mode at the peak (the latter with the extra `pictures`), beside the lines of
the search.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import search_3215 as search
from published import published_project

from exugear import Choice, Gearbox, Project, SpeedRange, SteadySettings, eigenmodes, steady_response
from exugear.gearbox.units import RPM
from exugear.report.pictures.scene import draw_mode
from exugear.report.pictures.shapes import bodies_of, mode_scene, motions_of
from fe_ste.tools.drawing import WARNING_COLOUR, drawing_style, finish_figure, new_figure

NAMES = {"planet_bearings": "Planet bearings", "all_bearings": "All bearings"}
HIGHEST_HZ, LOWEST_DB = 4000.0, -70.0
"""Frequency and level at which waterfalls end."""
GEARS_SHARE = 0.148
"""Axial inertia of the high-speed shaft in the set `gears` over that in `assemblies`."""


def draw_map(found: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draw every set over bearing stiffness and brake coupling, the rise in colours, a ring where it is 6 dB."""
    with drawing_style():
        figure = new_figure(9.5, 4.0)
        panels = figure.subplots(1, 2, sharey=True)
        shades = None
        for panel, (kind, title) in zip(panels, NAMES.items(), strict=True):
            own = sorted((one for one in found if one["kind"] == kind), key=lambda one: one["rise_dB"])
            x = [one["radial_N_per_m"] for one in own]
            # Sets that differ in the shaft's inertia or the housing factor would hide each other.
            places = {key: n for n, key in enumerate(sorted({_rest(one) for one in own}))}
            y = [one["coupling"] * 10.0 ** (0.6 * places[_rest(one)] / max(1, len(places) - 1) - 0.3) for one in own]
            shades = panel.scatter(x, y, c=[one["rise_dB"] for one in own], s=12, vmin=0.0, vmax=10.0, cmap="viridis")
            met = [n for n, one in enumerate(own) if one["met"]]
            ring = {"facecolors": "none", "edgecolors": WARNING_COLOUR, "linewidths": 0.8}
            panel.scatter([x[n] for n in met], [y[n] for n in met], s=36, **ring)
            panel.set(xscale="log", yscale="log", xlim=search.RANGES[kind], title=title)
            panel.set_xlabel("Radial stiffness / N/m")
            panel.xaxis.set_major_formatter(lambda value, _: f"{value:.0e}")
            panel.xaxis.set_minor_formatter(lambda value, _: "")
            panel.yaxis.set_major_formatter(lambda value, _: f"{value:.0e}")
        panels[0].set_ylabel("Brake coupling / N m/rad")
        if shades is not None:
            figure.colorbar(shades, ax=list(panels), label="Rise of the peak at 3215 Hz / dB")
        finish_figure(figure, path)


def _rest(one: Mapping[str, Any]) -> tuple[float, str, float, float]:
    return one["housing_factor"], one["inertias"], one["spin"], one["mass"]


def distance(one: Mapping[str, Any]) -> float:
    """How far a set is from the file: decades of its shaft's inertia and mass and, at a quarter, of its coupling.

    The inertia set counts as what it makes of the shaft's inertia.
    """
    spin = one["spin"] * (1.0 if one["inertias"] == "assemblies" else GEARS_SHARE)
    shaft = abs(math.log10(spin)) + abs(math.log10(one["mass"]))
    return shaft + 0.25 * abs(math.log10(one["coupling"] / 1e6))


def chosen(found: Sequence[Mapping[str, Any]]) -> dict[str, Mapping[str, Any]]:
    """Of the sets that meet what is wanted, the nearest to the file, on any and on a first order, and the loudest.

    Nothing where none does.
    """
    met = [one for one in found if one["met"]]
    first = [one for one in met if one["line"].startswith("1 x ")]
    return {
        which: min(own, key=rank)
        for which, own, rank in (
            ("nearest", met, _near),
            ("first-order", first, lambda one: (distance(one), -one["rise_dB"])),
            ("loudest", met, lambda one: -one["m"]),
        )
        if own
    }


def _near(one: Mapping[str, Any]) -> tuple[float, float]:
    return distance(one), -one["m"]


def draw_waterfalls(project: Project, gearbox: Gearbox, inertias: str, path: Path) -> None:
    """Draw all lines of the overall transmission error of both variants of a gearbox, as they stand over speed."""
    settings = SteadySettings(SpeedRange.from_text("1:215:429"), at_resonances=False)
    with drawing_style():
        figure = new_figure(9.5, 4.6)
        panels = figure.subplots(1, 2, sharey=True)
        shades = None
        for panel, variant in zip(panels, ("rigid", "bushing"), strict=True):
            choice = Choice(variant, inertias=inertias)
            response = steady_response(gearbox, choice, project.stiffness(), settings=settings)
            lines = response["amplitude"].sel(signal="overall_dte").drop_sel(line="mean").to_numpy()
            speed = np.abs(response["speed"].to_numpy())[:, None] + 0.0 * lines
            frequency = speed * response["order"].to_numpy()[1:] / (2.0 * np.pi)
            level = 20.0 * np.log10(np.maximum(lines, 1e-15) / 1e-6)
            shown = np.flatnonzero((frequency <= HIGHEST_HZ) & (level > LOWEST_DB))
            shown = shown[np.argsort(level.ravel()[shown])]
            points = speed.ravel()[shown] / RPM, frequency.ravel()[shown] / 1e3
            style = {"s": 2.0, "vmin": LOWEST_DB, "vmax": 50.0, "cmap": "inferno", "linewidths": 0.0}
            shades = panel.scatter(*points, c=level.ravel()[shown], **style)
            panel.axhline(search.TARGET_HZ / 1e3, color=WARNING_COLOUR, linewidth=0.8, linestyle=":")
            panel.set(xlabel="Input speed / rpm", title=variant, xlim=(0.0, 215.0), ylim=(0.0, HIGHEST_HZ / 1e3))
            panel.set_facecolor("black")
            panel.grid(False)
        panels[0].set_ylabel("Frequency / kHz")
        if shades is not None:
            figure.colorbar(shades, ax=list(panels), label="Overall transmission error, level / dB re 1 µm")
        finish_figure(figure, path)


def draw_nearest_mode(project: Project, gearbox: Gearbox, inertias: str, frequency: float, path: Path) -> str:
    """Draw the mode of `bushing` nearest to a frequency (Hz), and tell its name."""
    modes = eigenmodes(gearbox, Choice("bushing", inertias=inertias), project.stiffness())
    number = int(np.argmin(np.abs(modes.frequency - frequency)))
    title = f"{modes.frequency[number]:.0f} Hz: {modes.names[number]}"
    shapes = bodies_of(gearbox)
    drawn = {body.name for body in shapes}
    assembly = modes.assembly
    motions = motions_of(assembly.bodies, assembly.coordinates, assembly.rigid_part(modes.shapes[:, number]))
    draw_mode(mode_scene(shapes, {name: own for name, own in motions.items() if name in drawn}, title=title), path)
    return title


def main() -> None:
    """Draw what was found."""
    project = published_project(Choice("bushing"))
    project.tables()
    found = search.candidates(search.search(project))
    draw_map(found, project.folder / "search-3215-map.png")
    for kind, name in NAMES.items():
        picked = chosen([candidate for candidate in found if candidate["kind"] == kind])
        if not picked:
            print(f"{name}: no set has the peak")
        for which, one in picked.items():
            print(f"{name}, {which}: {one}")
            gearbox, stem = search.varied(project.gearbox, one, float(one["radial_N_per_m"])), f"search-3215-{which}"
            inertias = str(one["inertias"])
            draw_waterfalls(project, gearbox, inertias, project.folder / f"{stem}.png")
            print(draw_nearest_mode(project, gearbox, inertias, float(one["Hz"]), project.folder / f"{stem}-mode.png"))


if __name__ == "__main__":
    main()
