"""Levels of a steady-state response for a fit: computed at fixed speeds, swept and averaged as the measurement."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.entries import quantities
from exugear.steady.evaluation.comparison import ComparedCuts, swept_lines, transfers_of
from exugear.steady.evaluation.fit import MOST_PARAMETERS
from exugear.steady.evaluation.load_over_speed import LoadedModels
from exugear.steady.settings import SteadySettings
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Floats

FITTED_TABLES = ("bearings", "couplings", "damping", "housing", "mounts")
"""Tables of the gearbox file on which no table of transmission errors and no reduced body depends."""
SPEEDS = 240
"""Number of equidistant speeds of a response; they resolve half-power widths of 1 % of the speed."""


def start_of_fit(gearbox: Gearbox, keys: Sequence[str]) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Values and possible ranges of keys of the gearbox file, such as ``housing.factor``.

    Raises
    ------
    GearboxFileError
        There are too many keys, or one has no single number above zero that can be fitted.

    Examples
    --------
    >>> start_of_fit(Gearbox.from_toml("cases/grc750/gearbox.toml"), ["damping.modal_percent"])[1]
    {'damping.modal_percent': (0.01, 20.0)}
    """
    if not 1 <= len(set(keys)) <= MOST_PARAMETERS or len(set(keys)) < len(keys):
        raise gearbox.error(
            f"fit of {', '.join(keys) or 'nothing'}: one to {MOST_PARAMETERS} different keys can be fitted"
        )
    known = {
        key: (value, (limits.least, limits.most))
        for key, value, limits in quantities(gearbox.case)
        if key.split(".")[0] in FITTED_TABLES and value > 0.0 and not key.rpartition(".")[2].isdigit()
    }
    for key in keys:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            tables = ", ".join(f"[{table}]" for table in FITTED_TABLES)
            remedy = (
                f"did you mean {near[0]!r}?" if near else f"single numbers of {tables} that it states can be fitted"
            )
            raise gearbox.error(f"fit of {key}: the file has no such number above zero; {remedy}")
    return {key: known[key][0] for key in keys}, {key: known[key][1] for key in keys}


def response_levels(
    assembly_at: Callable[[float], Assembly], cuts: ComparedCuts, settings: SteadySettings, harmonics: int
) -> Floats:
    """Levels (channels, lines, windows), dB re 1 SI unit, that the measurement would show of a gearbox.

    Parameters
    ----------
    assembly_at : gearbox at a torque over the mean torque of the run-up
    cuts : comparison with the response at the start, whose orders and windows are used
    settings : of that response; its range of speeds is used with fewer speeds
    harmonics : of that response
    """
    speeds = np.linspace(settings.speeds.first, settings.speeds.last, SPEEDS)
    models = LoadedModels.of(assembly_at, cuts.run_up.torque, speeds, harmonics, settings)
    names = [line.name for line in cuts.lines]
    amplitude = models.amplitudes(speeds, settings, cuts.run_up.section.harmonics, names).astype(np.complex64)
    speed, transfer = transfers_of(cuts.run_up, models.signal_names, speeds, cuts.lines, [amplitude])
    swept = swept_lines(speed, transfer, cuts.lines, cuts.run_up, cuts.speed.size)
    return np.asarray(20.0 * np.log10(np.abs(swept)))
