"""Order lines of a gearbox: what its meshes excite per turn of the overall input."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from exugear.model.gearbox import Gearbox
from exugear.results.run_file import load_run
from exugear.spectra.resampling import sweep_matched_window
from exugear.spectra.waterfall import OrderLine, Waterfall, harmonics, waterfall


def order_lines(gearbox: Gearbox, count: int = 3) -> tuple[OrderLine, ...]:
    """Mesh orders with harmonics; meshes of one frequency (sun and ring) share a line.

    Parameters
    ----------
    gearbox : Gearbox
    count : int
        Harmonics of each mesh, the first included.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [(line.name, round(line.order, 3)) for line in order_lines(gearbox, 1)]
    [('sun_planet', 99.0), ('intermediate', 468.571), ('high_speed', 1792.795)]
    """
    once = gearbox.train.mesh_frequencies(2.0 * math.pi)  # one turn per second
    lines: list[OrderLine] = []
    seen: list[float] = []
    for mesh in gearbox.meshes:
        order = once[mesh.name]
        if not any(abs(order - known) < 1e-6 * known for known in seen):
            seen.append(order)
            lines.extend(harmonics(mesh.family, order, count))
    return tuple(lines)


def run_waterfall(path: str | Path, window_length: float | None = None) -> Waterfall:
    """Waterfall of the overall DTE of a run-up.

    Parameters
    ----------
    path : path
        ``run.nc`` of a run-up, or ``run.partial``.
    window_length : float, optional
        s; what suits the fastest first-order sweep by default. Runs to be compared need the same.

    Raises
    ------
    ValueError
        The speed does not change, so that nothing says how long a window should be, or the run is too short.
    FileError
        The run is missing or damaged.
    """
    data = load_run(path, ("time", "input_speed", "overall_dte"))
    time = data["time"].to_numpy()
    speed = data["input_speed"].to_numpy()
    values = data["overall_dte"].to_numpy()
    highest_order = float(data.attrs["highest_order"])
    if time.size < 2:
        raise ValueError(f"{path}: holds {time.size} samples, too few for a spectrum; run for longer")
    if window_length is None:
        sweep = highest_order * abs(np.ptp(speed)) / (2.0 * math.pi * np.ptp(time))
        window_length = sweep_matched_window(sweep)
    rate = (time.size - 1) / float(np.ptp(time))
    return waterfall(values, speed, rate, window_length=window_length)
