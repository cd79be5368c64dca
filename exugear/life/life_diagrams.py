"""Pictures of a life: what limits it, and which torques do the damage."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.life.life_file import DAMAGES, limits
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import COLOURS, WARNING_COLOUR, drawing_style, finish_figure, new_figure

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SHOWN = 16
"""Most parts that are drawn."""
LEAST_DAMAGE = 1e-6
"""Smaller damages are not drawn."""
LARGEST_DAMAGE = 1e6
"""Length of the bar of a larger one, infinite ones among them."""


def draw_life(data: xr.Dataset, path: str | Path | None = None) -> Figure:
    """Draw the damages of the parts that limit a life, and over torque where they come from.

    Parameters
    ----------
    data : as `exugear.life.life_file.read_life` gives it
    path : where to write the picture
    """
    shown = [limit for limit in limits(data) if limit[2] > LEAST_DAMAGE][:SHOWN]
    with drawing_style():
        figure = new_figure(8.5, max(2.2, 0.8 + 0.24 * len(shown)))
        bars, matrix = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.3))
        names = [f"{part}, {kind}" + (": infinite" if np.isinf(damage) else "") for part, kind, damage in shown]
        values = [min(damage, LARGEST_DAMAGE) for _, _, damage in shown]
        colours = [COLOURS[list(DAMAGES).index(kind)] for _, kind, _ in shown]
        bars.barh(range(len(shown)), values, color=colours)
        bars.axvline(1.0, color=WARNING_COLOUR)
        bars.set(xscale="log", xlabel="damage in the life (1: worn out)", yticks=range(len(shown)), yticklabels=names)
        bars.xaxis.set_major_formatter("{x:g}")
        bars.set_title("what limits")
        bars.invert_yaxis()
        edges, shares = damage_matrix(data, shown)
        if shares.size:
            drawn = matrix.pcolormesh(1e-3 * edges, np.arange(len(shown) + 1) - 0.5, 100.0 * shares, cmap="viridis")
            figure.colorbar(drawn, ax=matrix, label="share of the part's damage / %")
        matrix.set(xlabel=f"torque on {data.attrs['body']} / kN m", title="which torques do it")
        matrix.grid(False)
        return finish_figure(figure, path)


def damage_matrix(data: xr.Dataset, parts: list[tuple[str, str, float]]) -> tuple[Floats, Floats]:
    """Edges of the bins (bins + 1,), N m, and the share of each bin in the damage of each part (parts, bins).

    Parameters
    ----------
    parts : (part, kind, damage) as `exugear.life.life_file.limits` gives them
    """
    torque = data["torque"].to_numpy()
    order = np.argsort(torque)
    rows = []
    for part, kind, damage in parts:
        name, _, by_bin = DAMAGES[kind]
        index = data[name].to_numpy().tolist().index(part)
        values = data[f"{name}_{by_bin}"].to_numpy()[index][order]
        endless = np.isinf(values)
        rows.append(endless / endless.sum() if endless.any() else values / damage)
    middles = 0.5 * (torque[order][1:] + torque[order][:-1])
    ends = torque[order][[0, -1]]
    return np.concatenate([ends[:1], middles, ends[1:]]), np.array(rows).reshape(len(parts), -1)
