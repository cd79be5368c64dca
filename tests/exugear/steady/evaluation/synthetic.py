"""A gearbox with stated mesh stiffness, and recordings of a run-up as its response at constant speed makes them."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.gearbox.units import RPM
from exugear.steady.evaluation.comparison import mesh_lines
from exugear.steady.settings import SpeedRange, SteadySettings
from exugear.steady.steady_file import complex_amplitudes, steady_response
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness

from ...cases.case_mutations import toml_text
from ...exchange.recordings import written

RATE, SECONDS = 12000.0, 40.0
SPEEDS = 600.0, 2400.0
"""Speeds of the input at both ends, rpm."""
CHOICE = Choice("bushing", "line_of_action")
CHANNELS: dict[str, dict[str, Any]] = {
    "left": {"quantity": "acceleration", "place": "input_left", "direction": "x"},
    "right": {"quantity": "acceleration", "place": "middle_right", "direction": [0.0, 2.0, 0.0]},
    "te": {"quantity": "transmission_error", "unit": "um"},
}
TACHO = {"channel": "tacho", "shaft": "input"}


def content(**changes: Any) -> dict[str, Any]:
    """Two helical stages on elastic bearings whose mesh stiffness is stated, so that no table is needed."""
    found = tomllib.loads(template("parallel"))
    for pair, mean in (("stage_1", 4.5e8), ("stage_2", 8e8)):
        found["pairs"][pair]["stiffness"] = {
            "mean_N_per_m": mean,
            "cosine_N_per_m": [0.04 * mean, 0.02 * mean, 0.01 * mean],
        }
    if "load_case" in changes:
        found["load_cases"] = {"run_up": changes["load_case"]}
    return found


def measurement(file: str = "bench.h5", **changes: Any) -> dict[str, Any]:
    section = {"file": file, "tacho": TACHO, "channels": CHANNELS} | changes
    return {key: value for key, value in section.items() if value is not None}


def gearbox_file(folder: Path, *sections: Mapping[str, Any], **changes: Any) -> Path:
    """Gearbox file with the measurements ``bench``, ``bench_2``, ..."""
    path = folder / "gearbox.toml"
    named = {"bench" if not number else f"bench_{number + 1}": dict(own) for number, own in enumerate(sections)}
    path.write_text(toml_text({**content(**changes), "measurements": named}), encoding="utf-8")
    return path


def run_up(seconds: float = SECONDS, drift: float = 0.01) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, speed (rad/s) and angle (rad) of the input, with a speed that drifts by a slow sine."""
    time = np.arange(int(seconds * RATE)) / RATE
    low, rise = SPEEDS[0] * RPM, (SPEEDS[1] - SPEEDS[0]) * RPM / seconds
    swing, slow = drift * SPEEDS[1] * RPM, 2.0 * np.pi / (0.2 * seconds)
    speed = low + rise * time + swing * np.sin(slow * time)
    return time, speed, low * time + 0.5 * rise * time**2 + swing * (1.0 - np.cos(slow * time)) / slow


def response(gearbox: Gearbox) -> xr.Dataset:
    """Steady-state response over the speeds of the run-up and beyond."""
    settings = SteadySettings(SpeedRange(500.0 * RPM, 2600.0 * RPM, 300))
    return steady_response(gearbox, CHOICE, mesh_stiffness(gearbox, CHOICE.mesh_model, Path()), settings=settings)


def signals(
    data: xr.Dataset, speed: np.ndarray, angle: np.ndarray, noise: float = 0.0, seed: int = 0
) -> dict[str, np.ndarray]:
    """Signals of `CHANNELS` at each instant as at constant speed, which a slow run-up is; TE in um, run-out at order 1.

    The sweep-rate ratio is 0.03 at most, for which a resonance is lower by 0.01 dB than at constant speed.
    """
    names = [str(name) for name in data["signal"].to_numpy()]
    amplitude = complex_amplitudes(data).astype(np.complex128)
    known = data["speed"].to_numpy()
    rng = np.random.default_rng(seed)
    found = {}
    for channel, signal, factor in (
        ("left", "seat_acceleration input_left x", 1.0),
        ("right", "seat_acceleration middle_right y", 1.0),
        ("te", "overall_dte", 1e6),
    ):
        values = np.zeros(angle.size)
        for row in mesh_lines(data, 3).values():
            order = float(data["order"][row])
            own = factor * amplitude[:, row, names.index(signal)]
            turning = np.exp(1j * order * angle)
            values += (
                np.interp(speed, known, own.real) * turning.real - np.interp(speed, known, own.imag) * turning.imag
            )
        rms = values.std()
        values += 0.3 * rms * np.cos(angle + 0.7) + noise * rms * rng.standard_normal(angle.size)
        found[channel] = values
    return found


def recorded(path: Path, channels: Mapping[str, np.ndarray], angle: np.ndarray, pulses: int = 1) -> Path:
    """HDF5 file of the channels with a tacho of so many pulses per revolution."""
    tacho = np.clip(40.0 * (np.cos(pulses * angle) - 0.9), -1.0, 1.0)
    units = {"left": "m/s2", "right": "m/s2"}
    return written.hdf5(path, {**channels, "tacho": tacho}, RATE, units)


def integrated(values: np.ndarray) -> np.ndarray:
    """Integral over time without its mean, exact for every frequency."""
    frequency = np.fft.rfftfreq(values.size, 1.0 / RATE)
    spectrum = np.fft.rfft(values)
    spectrum[0] = 0.0
    spectrum[1:] /= 2j * np.pi * frequency[1:]
    return np.fft.irfft(spectrum, values.size)
