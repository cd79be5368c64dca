"""Diagrams of modes and of the static state, drawn on axes of the caller or new ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.units import RPM
from fe_ste.tools.arrays import Floats
from fe_ste.tools.drawing import COLOURS, axes_or_new, drawable, order_styles

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_campbell(
    panel: Axes, modes: Floats, orders: Mapping[str, float], fastest: float, top: float, weights: Floats
) -> None:
    """Draw natural frequencies and orders over speed, and mark their crossings.

    Parameters
    ----------
    modes : (n,) natural frequencies, Hz
    orders : periods per revolution of the input, by name
    fastest, top : ends of the axes, rad/s and Hz
    weights : (n,) size of the marks at the crossings of each mode, 0 to 1
    """
    end_speed = fastest / RPM
    panel.grid(False)
    for mode in modes[modes <= top]:
        panel.axhline(1e-3 * mode, color="#BBBBBB", linewidth=0.8, zorder=1)
    for name, style in order_styles(list(orders)).items():
        order = orders[name]
        end = order * fastest / (2.0 * np.pi)
        reach = min(1.0, top / end)
        label = drawable(name)
        panel.plot([0.0, reach * end_speed], [0.0, 1e-3 * reach * end], label=label, zorder=2, **style)
        crossed = (modes <= reach * end) & (modes > 0.0)
        speeds = end_speed * modes[crossed] / end
        panel.scatter(speeds, 1e-3 * modes[crossed], s=8.0 + 60.0 * weights[crossed], color=style["color"], zorder=3)
    panel.set(xlim=(0.0, end_speed), ylim=(0.0, 1e-3 * top))
    panel.set(xlabel="Input speed / rpm", ylabel="Frequency / kHz")


def draw_energies(shares: Mapping[str, Floats], ax: Axes | None = None) -> Axes:
    """Draw shares of the energy by name, each over all modes (n,), as a map."""
    values = 100.0 * np.array(list(shares.values()))
    with axes_or_new(ax, 7.2, 1.2 + 0.2 * len(shares)) as panel:
        image = panel.imshow(
            values, aspect="auto", cmap="Blues", clim=(0.0, 100.0), extent=(0.5, values.shape[1] + 0.5, len(shares), 0)
        )
        panel.grid(False)
        panel.set_xlabel("Mode number")
        panel.set_yticks(0.5 + np.arange(len(shares)), [drawable(name) for name in shares], parse_math=False)
        panel.figure.colorbar(image, ax=panel, label="Share of the energy / %")
        return panel


def draw_misalignment(names: Sequence[str], misalignment: Floats, ax: Axes | None = None) -> Axes:
    """Draw the misalignment (rad) of meshes as bars."""
    with axes_or_new(ax, 5.0, 1.0 + 0.3 * len(names)) as panel:
        panel.barh(range(len(names)), 1e3 * misalignment, color=COLOURS[0])
        panel.set_yticks(range(len(names)), [drawable(name) for name in names], parse_math=False)
        panel.invert_yaxis()
        panel.axvline(0.0, color="black", linewidth=0.8)
        panel.set_xlabel("Misalignment / mrad")
        return panel
