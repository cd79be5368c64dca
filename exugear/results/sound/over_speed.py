"""Sound power in the file of a steady-state response: over speed, by order and in third octaves."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.units import RPM
from exugear.results.sound.levels import a_weighted, nominal_frequency, power_level, third_octave_powers
from exugear.results.sound.radiated_power import RadiatedPower, equivalent_power
from fe_ste.tools.arrays import Floats

if TYPE_CHECKING:
    import xarray as xr

WEIGHTINGS = ("Z", "A")
"""Unweighted and A-weighted, in this order in all arrays."""
SHOWN_ORDERS = 10
"""Loudest orders in a summary."""


def sound_variables(
    radiated: RadiatedPower, velocity: Floats, speed: Floats, orders: Floats
) -> tuple[dict[str, tuple[tuple[str, ...], Any, dict[str, str]]], dict[str, Any]]:
    """Variables and coordinates of a dataset.

    Parameters
    ----------
    radiated : surface that radiates
    velocity : (points, lines) amplitude, m/s, as `RadiatedPower.surface_velocity` gives it
    speed, orders : (points,) rad/s of the overall input, and (lines,) periods per revolution
    """
    frequency = line_frequencies(speed, orders)
    power = equivalent_power(velocity, radiated.area)
    power[frequency > radiated.limit] = np.nan
    numbers, bands = third_octave_powers(power, frequency)
    _, weighted_bands = third_octave_powers(a_weighted(power, frequency), frequency)
    totals = np.stack([own.sum(axis=1) for own in (bands, weighted_bands)], axis=-1)
    words = {"units": "dB", "long_name": "sound power level re 1 pW (equivalent radiated power)"}
    variables: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {
        "sound_power": (
            ("point", "line"),
            power,
            {"units": "W", "long_name": "equivalent radiated power; not a number above the band of the housing"},
        ),
        "sound_level": (("point", "weighting"), power_level(totals), words),
        "third_octave_level": (
            ("point", "third_octave", "weighting"),
            power_level(np.stack([bands, weighted_bands], axis=-1)),
            words,
        ),
    }
    coordinates = {"weighting": np.array(WEIGHTINGS, dtype=object), "third_octave": nominal_frequency(numbers)}
    return variables, coordinates


def surface_words(radiated: RadiatedPower) -> str:
    """Return the attribute of a dataset with the surface that radiates."""
    return json.dumps(
        {
            "bodies": radiated.bodies,
            "outer_surface_m2": radiated.area,
            "whole_surface_m2": radiated.whole_area,
            "limit_Hz": radiated.limit,
        }
    )


def line_frequencies(speed: Floats, orders: Floats) -> Floats:
    """Frequencies (points, lines) of orders (lines,) at input speeds (points,) in rad/s, Hz."""
    return np.asarray(np.abs(np.outer(speed, orders)) / (2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class SoundOverSpeed:
    """Sound power of a steady-state response."""

    speed: Floats
    """(points,) absolute speed of the overall input, rad/s."""
    orders: Floats
    """(lines,) periods per revolution of the input."""
    names: tuple[str, ...]
    """Of the orders."""
    power: Floats
    """(points, lines) W; not a number above the limit."""
    surface: Mapping[str, Any]
    """Bodies, areas and limit, as `surface_words` has them."""
    contributions: tuple[Mapping[str, Any], ...] = ()
    """What makes the loudest orders at the loudest speed: `exugear.steady.crossings.Contributions` with their line."""

    @property
    def frequency(self) -> Floats:
        """Frequencies of the orders, (points, lines), Hz."""
        return line_frequencies(self.speed, self.orders)

    @property
    def weighted(self) -> Floats:
        """A-weighted power (points, lines), W."""
        return a_weighted(self.power, self.frequency)

    def inside(self, speeds: tuple[float, float]) -> SoundOverSpeed:
        """Return the part between two absolute speeds, rad/s."""
        chosen = (self.speed >= speeds[0]) & (self.speed <= speeds[1])
        return replace(self, speed=self.speed[chosen], power=self.power[chosen])

    def orders_left_out(self) -> tuple[tuple[str, float], ...]:
        """Orders that exceed the limit at the highest speed, by name, and their frequency there (Hz), lowest first."""
        point = int(np.argmax(self.speed))
        beyond = np.flatnonzero(np.isnan(self.power[point]))
        found = sorted((float(self.frequency[point, line]), self.names[line]) for line in beyond)
        return tuple((name, frequency) for frequency, name in found)

    def summary(self) -> dict[str, Any]:
        """Return the loudest speed for ``--json``, with its loudest orders and its third octaves; units in the keys."""
        weighted = self.weighted
        point = int(np.argmax(np.nansum(weighted, axis=1)))
        powers = np.stack([self.power[point], weighted[point]])
        levels = power_level(np.nan_to_num(powers))
        speed = float(self.speed[point])
        frequency = self.frequency[point]
        loudest = np.argsort(-levels[1], kind="stable")[:SHOWN_ORDERS]
        numbers, bands = third_octave_powers(powers, np.stack([frequency] * 2))
        return {
            **self.surface,
            "speed_rpm": speed / RPM,
            **_levels(power_level(np.nansum(powers, axis=1))),
            "orders": [
                {"line": self.names[line], "frequency_Hz": float(frequency[line]), **_levels(levels[:, line])}
                for line in loudest
                if np.nan_to_num(powers[0, line]) > 0.0
            ],
            "third_octaves": [
                {"centre_Hz": float(centre), **_levels(own)}
                for centre, own in zip(nominal_frequency(numbers), power_level(bands).T, strict=True)
                if own[0] > power_level(np.zeros(1))[0]
            ],
            # What makes the loudest orders, if they are explained at this speed.
            "contributions": [
                {
                    "line": self.names[own["line"]],
                    "frequency_Hz": float(speed * self.orders[own["line"]] / (2.0 * np.pi)),
                    "meshes": own["meshes"],
                    "modes": own["modes"],
                    "supports": own["supports"],
                }
                for own in self.contributions
                if math.isclose(abs(own["speed"]), speed, rel_tol=1e-9)
            ],
            "left_out": [{"line": name, "frequency_Hz": frequency} for name, frequency in self.orders_left_out()],
        }


def _levels(levels: Floats) -> dict[str, float]:
    return {"level_dB": float(levels[0]), "level_dBA": float(levels[1])}


def sound_over_speed(data: xr.Dataset) -> SoundOverSpeed | None:
    """Return the sound power of a response from `load_response`; None without a flexible housing."""
    if "sound_power" not in data:
        return None
    return SoundOverSpeed(
        speed=np.abs(data["speed"].to_numpy()),
        orders=data["order"].to_numpy(),
        names=tuple(str(name) for name in data["line"].to_numpy()),
        power=data["sound_power"].to_numpy(),
        surface=json.loads(str(data.attrs["radiating_surface"])),
        contributions=tuple(json.loads(str(data.attrs["sound_contributions"]))),
    )
