"""Campbell diagram of a mean system: eigenfrequencies and damping over speed, each mode named, and read from a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.steady.campbell.mode_kinds import ModeNamer
from exugear.steady.campbell.mode_tracks import Found, ModeTracks, mode_tracks
from exugear.steady.mean_system.mean_modes import mean_modes
from exugear.steady.mean_system.mean_system import MeanSystem
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import Displayed

if TYPE_CHECKING:
    import xarray as xr

LAYOUT: dict[str, tuple[str, ...]] = {
    "campbell_speed": ("campbell_point",),
    "mode_frequency": ("campbell_point", "mode"),
    "mode_damping": ("campbell_point", "mode"),
    "mode_whirl": ("campbell_point", "mode"),
    "mode_kind": ("mode",),
    "mode_name": ("mode",),
}
"""Variables of a file that holds a diagram."""
SAME_FREQUENCY = 0.02
"""Share of a frequency within which a mode is the one that a crossing was found at."""


@dataclass(frozen=True, eq=False)
class Campbell(Displayed, line=": {names!n} modes at {speeds!n} speeds"):
    """Modes over speed; n speeds, m modes."""

    speeds: Floats
    """(n,) of the overall input, ascending, rad/s."""
    frequency: Floats
    damping: Floats
    whirl: Floats
    """(n, m) Hz as seen from the housing, share of critical damping, and sense of the whirl as `NamedMode` has it;
    NaN where a mode is none."""
    kinds: tuple[str, ...]
    names: tuple[str, ...]
    """As `NamedMode` has them, at the fastest speed."""

    def mode_at(self, speed: float, frequency: float) -> int | None:
        """Find the mode that has a frequency (Hz) at a speed (rad/s), None where none is near."""
        if not len(self.names):
            return None
        own = np.array([np.interp(speed, self.speeds, column) for column in self.frequency.T])
        apart = np.where(np.isnan(own), np.inf, np.abs(own - frequency))
        nearest = int(np.argmin(apart))
        if apart[nearest] <= SAME_FREQUENCY * frequency:
            return nearest
        return None

    def variables(self) -> dict[str, tuple[tuple[str, ...], Any, dict[str, str]]]:
        """Arrays with dimensions and units, as files hold them."""
        values = {
            "campbell_speed": (self.speeds, {"units": "rad/s", "long_name": "speed of the overall input"}),
            "mode_frequency": (self.frequency, {"units": "Hz", "long_name": "as seen from the housing"}),
            "mode_damping": (self.damping, {"units": "1", "long_name": "share of critical damping"}),
            "mode_whirl": (self.whirl, {"units": "1", "long_name": "1 with the turn of the body, -1 against it"}),
            "mode_kind": (np.array(self.kinds, dtype=object), {}),
            "mode_name": (np.array(self.names, dtype=object), {}),
        }
        return {name: (LAYOUT[name], own, attributes) for name, (own, attributes) in values.items()}


def modes_over_speed(system: MeanSystem, low: float, high: float, highest: float) -> ModeTracks:
    """Follow the modes of a mean system between two speeds of the input (rad/s), up to a frequency (Hz)."""

    def modes_at(speed: float) -> Found:
        values, right, left = mean_modes(system, speed)
        kept = values.imag <= 2.0 * np.pi * highest
        return values[kept], right[kept], left[kept]

    return mode_tracks(modes_at, low, high)


def campbell_of(system: MeanSystem, tracks: ModeTracks) -> Campbell:
    """Campbell diagram of the modes of a mean system, followed over speed."""
    low = tracks.speeds[0]
    high = tracks.speeds[-1]
    namer = ModeNamer(system, high if abs(high) > abs(low) else low)
    whirl = np.full(tracks.frequency.shape, np.nan)
    for n, m in zip(*np.nonzero(~np.isnan(tracks.frequency)), strict=True):
        whirl[n, m] = namer.whirl(tracks.shapes[n, m])
    named = [namer.named(tracks.shapes[_fastest(tracks, m), m]) for m in range(tracks.frequency.shape[1])]
    return Campbell(
        tracks.speeds,
        tracks.frequency,
        tracks.damping,
        whirl,
        tuple(own.kind for own in named),
        tuple(own.name for own in named),
    )


def campbell_from(data: xr.Dataset) -> Campbell:
    """Read a diagram from the dataset of a file that holds one."""
    values = {name: data[name].to_numpy() for name in LAYOUT}
    kinds, names = (tuple(str(value) for value in values[name]) for name in ("mode_kind", "mode_name"))
    speeds, frequency, damping, whirl = (values[name] for name in list(LAYOUT)[:4])
    return Campbell(speeds, frequency, damping, whirl, kinds, names)


def _fastest(tracks: ModeTracks, mode: int) -> int:
    """Place of the fastest speed at which a mode is one."""
    known = np.flatnonzero(~np.isnan(tracks.frequency[:, mode]))
    return int(known[np.argmax(np.abs(tracks.speeds[known]))])
