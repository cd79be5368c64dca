"""Diagrams of transmission error tables."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.tools.arrays import Booleans, Floats
from fe_ste.tools.drawing import COLOURS, WARNING_COLOUR, axes_or_new, drawing_style, finish_figure, new_figure
from fe_ste.transmission_error.contact_stress import load_along_face

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def single_load_case(dataset: xr.Dataset) -> xr.Dataset:
    """Reduce a table to the mesh cycle.

    Parameters
    ----------
    dataset : with the dimension ``pmc``; torque, centre distance and misalignment may be there with length one

    Returns
    -------
    without the dimensions of length one, `tooth` apart, ordered by ``pmc``

    Raises
    ------
    ValueError
        If a dimension but ``pmc`` has several values: a curve belongs to one state.
    """
    if "pmc" not in dataset.dims:
        raise ValueError(f"dataset: no dimension 'pmc' among {sorted(map(str, dataset.dims))}")
    conditions = {"torque", "centre_distance", "misalignment"}.intersection(map(str, dataset.dims))
    several = [name for name in sorted(conditions) if dataset.sizes[name] > 1]
    if several:
        name = several[0]
        raise ValueError(
            f"dataset: {name} has {dataset.sizes[name]} values; choose one, such as dataset.isel({name}=0)"
        )
    return dataset.isel(dict.fromkeys(conditions, 0)).sortby("pmc")


def plot_ste_curves(datasets: Mapping[str, xr.Dataset], path: str | Path | None = None) -> Figure:
    """Draw the static transmission error of several pairs over the mesh cycle.

    Parameters
    ----------
    datasets : title of the panel and table: ``ste`` (m) over ``pmc``, optionally ``converged``
    path : where to write the picture

    Returns
    -------
    matplotlib.figure.Figure
        One panel per pair, in micrometres. All panels have the same range, so that peak-to-peak values can be compared;
        the titles give the means. Positions that have not converged are crossed out in red.

    Raises
    ------
    ValueError
        If there is nothing to draw or a table has further dimensions than the mesh cycle.
    """
    if not datasets:
        raise ValueError("plot_ste_curves: no dataset given")
    curves = {name: _cycle(single_load_case(dataset), "ste", 1e6) for name, dataset in datasets.items()}
    # A constant curve still needs an axis.
    span = 1.15 * max([1e-3, *(curve.peak_to_peak for curve in curves.values())])
    columns = 1 if len(curves) == 1 else 2
    rows = math.ceil(len(curves) / columns)
    with drawing_style():
        figure = new_figure(3.4 * columns + 0.4, 2.4 * rows + 0.3)
        panels = figure.subplots(rows, columns, squeeze=False)
        for panel, (name, curve), colour in zip(panels.flat, curves.items(), itertools.cycle(COLOURS), strict=False):
            _draw_cycle(panel, curve, colour, span)
            panel.set_title(f"{name}\n{curve.summary}", loc="left")
        for panel in panels.flat[len(curves) :]:
            panel.set_visible(False)
        for panel in panels[:, 0]:
            panel.set_ylabel("STE / µm")
        for panel in panels.flat[max(0, len(curves) - columns) : len(curves)]:
            panel.set_xlabel("Position in mesh cycle")
        return finish_figure(figure, path)


def plot_ripple(
    datasets: Mapping[str, xr.Dataset], path: str | Path | None = None, design: Mapping[str, float] | None = None
) -> Figure:
    """Draw the peak-to-peak transmission error of one or several tables over the load.

    Parameters
    ----------
    datasets : title of the curve and table: ``ste`` (m) over ``pmc`` and ``torque``
    path : where to write the picture
    design : torque (N m) for which a curve's flanks were designed: marked on it

    Raises
    ------
    ValueError
        If there is nothing to draw, or a table has further dimensions than position and load.
    """
    if not datasets:
        raise ValueError("plot_ripple: no dataset given")
    with drawing_style():
        figure = new_figure(5.0, 3.2)
        panel = figure.subplots()
        for (name, dataset), colour in zip(datasets.items(), itertools.cycle(COLOURS), strict=False):
            torque = dataset["torque"].to_numpy().astype(np.float64)
            loads = [single_load_case(dataset.isel(torque=[number])) for number in range(len(torque))]
            ripple = np.array([_cycle(load, "ste", 1e6).peak_to_peak for load in loads])
            panel.plot(torque, ripple, color=colour, label=name)
            if design and name in design:
                panel.plot(design[name], np.interp(design[name], torque, ripple), "o", color=colour)
        panel.set_xlabel("torque on gear 1 / N m")
        panel.set_ylabel("peak-to-peak STE / µm")
        panel.set_ylim(bottom=0.0)
        panel.set_xlim(left=0.0)
        panel.legend()
        return finish_figure(figure, path)


@dataclass(frozen=True)
class _Cycle:
    """A quantity over the mesh cycle, in the unit of the picture."""

    pmc: Floats
    values: Floats
    converged: Booleans

    @property
    def valid(self) -> Booleans:
        """Where there is a number that can be relied on."""
        return self.converged & np.isfinite(self.values)

    @property
    def middle(self) -> float:
        """Middle between the extremes of what converged."""
        shown = self.values[self.valid]
        if shown.size:
            return 0.5 * float(shown.max() + shown.min())
        return 0.0

    @property
    def peak_to_peak(self) -> float:
        """Difference of the extremes of what converged."""
        shown = self.values[self.valid]
        if shown.size:
            return float(np.ptp(shown))
        return 0.0

    @property
    def summary(self) -> str:
        """Mean and peak-to-peak value as text."""
        if not self.valid.any():
            return "no converged position"
        mean = float(self.values[self.valid].mean())
        return f"mean {mean:.1f} µm, peak-to-peak {self.peak_to_peak:.2f} µm"


def _cycle(dataset: xr.Dataset, name: str, factor: float) -> _Cycle:
    values = factor * dataset[name].to_numpy().astype(np.float64)
    converged = dataset["converged"].to_numpy() if "converged" in dataset else np.ones(values.shape)
    return _Cycle(dataset["pmc"].to_numpy().astype(np.float64), values, converged.astype(bool))


def _draw_cycle(panel: Axes, curve: _Cycle, colour: str, span: float | None = None) -> None:
    """Draw a curve with a range of values; without one, the range is 1.15 times its own."""
    span = span or 1.15 * max(1e-3, curve.peak_to_peak)
    # The first position again at the end: it is the same state one pitch on.
    pmc = np.append(curve.pmc, curve.pmc[0] + 1.0)
    shown = np.where(curve.valid, curve.values, np.nan)
    panel.plot(pmc, np.append(shown, shown[0]), color=colour, marker="o", markersize=2.2)
    lowest = curve.middle - 0.5 * span
    highest = curve.middle + 0.5 * span
    # What has not converged may be anything: keep its mark inside the panel.
    inside = np.clip(np.where(np.isfinite(curve.values), curve.values, curve.middle), lowest, highest)
    mark_not_converged(panel, curve.pmc[~curve.valid], inside[~curve.valid])
    panel.set(xlim=(0.0, 1.0), ylim=(lowest, highest))


def mark_not_converged(panel: Axes, pmc: Floats, height: Floats) -> None:
    """Cross out positions in red and count them in the legend; without positions do nothing."""
    if not pmc.size:
        return
    label = f"{pmc.size} not converged"
    (crosses,) = panel.plot(pmc, height, "x", color=WARNING_COLOUR, zorder=5, label=label)
    crosses.set(markersize=6.0, markeredgewidth=1.6, clip_on=False)
    for value in pmc:
        panel.axvline(value, color=WARNING_COLOUR, linewidth=0.6, alpha=0.4)
    panel.legend(loc="best")


# One quantity of a table on given axes, for `MeshTable.plot`

KINDS = {
    "ste": ("ste", "Static transmission error / µm", 1e6),
    "stiffness": ("mesh_stiffness", "Mesh stiffness / (N/µm)", 1e-6),
    "load_share": ("load_share", "Load share / %", 100.0),
    "contact": ("line_load", "Line load, mean of the mesh cycle / (N/mm)", 1e-3),
}
"""Variable of each kind of diagram, label of its axis, and factor from SI units."""


def draw_table(dataset: xr.Dataset, kind: str, ax: Axes | None = None) -> Axes:
    """Draw one quantity of a table at one load, see `fe_ste.transmission_error.table.MeshTable.plot`."""
    if kind not in KINDS:
        raise ValueError(f"kind = {kind!r}: must be one of {', '.join(KINDS)}")
    variable, label, factor = KINDS[kind]
    if variable not in dataset:
        raise ValueError(f"dataset: no variable {variable!r} among {sorted(map(str, dataset.data_vars))}")
    cycle = single_load_case(dataset)
    with axes_or_new(ax) as panel:
        if kind == "load_share":
            _draw_shares(panel, _shares(cycle))
        elif kind == "contact":
            along = load_along_face(cycle)
            position = 1e3 * along["axial_position"].to_numpy()
            panel.plot(position, factor * along.to_numpy(), color=COLOURS[0], marker="o", markersize=2.2)
            panel.set(xlabel="Position along the face / mm", ylabel=label)
            panel.set_ylim(bottom=0.0)
        else:
            _draw_cycle(panel, _cycle(cycle, variable, factor), COLOURS[0])
            panel.set(xlabel="Position in mesh cycle", ylabel=label)
        return panel


@dataclass(frozen=True)
class _Shares:
    """Shares of the load over the mesh cycle."""

    pmc: Floats
    teeth: list[int]
    """Tooth pairs that carry load."""
    share: Floats
    """(teeth, n) per cent; NaN where nothing converged."""
    missing: Floats
    """Positions without a converged state."""


def _shares(cycle: xr.Dataset) -> _Shares:
    share = 100.0 * cycle["load_share"].transpose("tooth", "pmc").to_numpy().astype(np.float64)
    teeth = cycle["tooth"].to_numpy() if "tooth" in cycle.coords else np.arange(share.shape[0])
    total = _cycle(cycle.assign(total=cycle["load_share"].sum("tooth")), "total", 100.0)
    share[:, ~total.valid] = np.nan
    carrying = np.nanmax(share, axis=1, initial=0.0) > 0.0
    return _Shares(total.pmc, teeth[carrying].tolist(), share[carrying], total.pmc[~total.valid])


def _draw_shares(panel: Axes, shares: _Shares) -> None:
    for row in _order_along_way(shares.share):
        tooth = shares.teeth[row]
        label = f"tooth pair {tooth:+d}" if tooth else "tooth pair 0"
        colour = COLOURS[row % len(COLOURS)]
        panel.plot(shares.pmc, _carried(shares.share[row]), color=colour, marker="o", markersize=2.2, label=label)
    panel.set(xlim=(0.0, 1.0), ylim=(0.0, 1.12 * float(np.nanmax(shares.share, initial=1.0))))
    panel.set(xlabel="Position in mesh cycle", ylabel=KINDS["load_share"][1])
    panel.legend(loc="best")
    mark_not_converged(panel, shares.missing, np.zeros(shares.missing.size))


def plot_load_share(dataset: xr.Dataset, path: str | Path | None = None, title: str = "") -> Figure:
    """Draw the share of the load that each tooth pair carries over the mesh cycle.

    Parameters
    ----------
    dataset : table with ``load_share`` over ``pmc`` and ``tooth``, optionally ``converged``
    path : where to write the picture
    title : name of the pair and its load

    Returns
    -------
    matplotlib.figure.Figure
        Left the shares over one mesh cycle, right one tooth pair from the start to the end of its contact, which is the
        left panel unrolled.

    Raises
    ------
    ValueError
        If the table has no load shares or further dimensions than the mesh cycle.
    """
    if "load_share" not in dataset:
        raise ValueError(f"dataset: no variable 'load_share' among {sorted(map(str, dataset.data_vars))}")
    shares = _shares(single_load_case(dataset))
    with drawing_style():
        figure = new_figure(7.2, 2.9)
        over_cycle, over_way = figure.subplots(1, 2, sharey=True, width_ratios=(1.0, 1.4))
        _draw_shares(over_cycle, shares)
        order = _order_along_way(shares.share)
        for step, row in enumerate(order):
            shown = _carried(shares.share[row])
            over_way.plot(shares.pmc + step, shown, color=COLOURS[row % len(COLOURS)], marker="o", markersize=2.2)
        over_way.set(xlim=(0.0, max(1, len(order))), xlabel="Way of one tooth pair in mesh cycles")
        figure.suptitle(title, fontsize=9.5)
        return finish_figure(figure, path)


def _carried(share: Floats) -> Floats:
    """Blank the positions at which a tooth pair and both its neighbours in time carry nothing."""
    loaded = share > 0.0
    return np.where(loaded | np.roll(loaded, 1) | np.roll(loaded, -1), share, np.nan)


def _order_along_way(share: Floats) -> list[int]:
    """Order of the teeth in which the end of each one's cycle fits the beginning of the next one's."""
    last = np.nan_to_num(share[:, -1])
    first = np.nan_to_num(share[:, 0])
    ascending = float(np.abs(last[:-1] - first[1:]).sum())
    descending = float(np.abs(last[1:] - first[:-1]).sum())
    rows = list(range(share.shape[0]))
    return rows if ascending <= descending else rows[::-1]
