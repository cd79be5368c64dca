"""Run-ups whose spectra are known: signals of orders, swept oscillators, and files of runs made of resonators."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import scipy.signal
import xarray as xr

from exugear.gearbox.versions import RUN
from exugear.results.spectra.run_spectra import VariantRun, analysed, run_signals
from exugear.results.spectra.waterfall import OrderLine, waterfall
from fe_ste.tools.stores import write_dataset

RATE = 8192.0
MESH = OrderLine("mesh", 60.0)


def run_up(duration=20.0, end_frequency=2000.0, line=MESH):
    """Time, speed and shaft angle of a uniform run-up in which `line` reaches `end_frequency`."""
    time = np.arange(round(duration * RATE)) / RATE
    end_speed = 2.0 * math.pi * end_frequency / line.order
    return time, end_speed * time / duration, 0.5 * end_speed * time**2 / duration


def oscillator(excitation, frequency, damping):
    """Displacement times stiffness of x'' + 2 D w x' + w^2 x = w^2 f, exact for piecewise linear f."""
    omega = 2.0 * math.pi * frequency
    system = ([omega**2], [1.0, 2.0 * damping * omega, omega**2])
    numerator, denominator, _ = scipy.signal.cont2discrete(system, 1.0 / RATE, method="foh")
    return scipy.signal.lfilter(numerator.ravel(), denominator, excitation)


def swept_pair(frequencies):
    time, speed, angle = run_up(duration=20.0)
    force = np.sin(60 * angle)
    response = sum(oscillator(force, frequency, 0.02) for frequency in frequencies)
    return waterfall(response, speed, RATE, window_length=0.1, overlap=0.8, reference=1.0)


STORED_RATE = 8000.0
STORED_LINE = OrderLine("mesh", 100.0)
LABELS = {
    "gearbox": "synthetic",
    "load_case": "run_up",
    "mesh_model": "line_of_action",
    "inertias": "gears",
    "highest_order": 100.0,
    "method_version": RUN,
}


def write_run(path: Path, variant: str, resonances: list[float], **labels: str) -> Path:
    """A run of 8 s to 15 rev/s whose order 100 excites resonators of 1 % damping, quasi-statically."""
    time = np.arange(int(8 * STORED_RATE)) / STORED_RATE
    speed = 2 * np.pi * 15.0 * time / 8.0
    frequency = STORED_LINE.frequency(speed)
    phase = 2 * np.pi * np.cumsum(frequency) / STORED_RATE
    signal = 1e-7 * np.cos(phase)
    for resonance in resonances:
        answer = 1e-7 / (1 - (frequency / resonance) ** 2 + 0.02j * frequency / resonance)
        signal += (answer * np.exp(1j * phase)).real
    data = {"input_speed": ("time", speed), "overall_dte": ("time", signal)}
    attributes = {**LABELS, "variant": variant, **labels}
    write_dataset(path, xr.Dataset(data, {"time": time}, attributes))
    return path


def modes_dataset(frequencies: list[float], overall: list[float]) -> xr.Dataset:
    count = len(frequencies)
    return xr.Dataset(
        {
            "frequency": ("mode", np.array(frequencies)),
            "damping_ratio": ("mode", np.full(count, 0.01)),
            "overall_dte": ("mode", np.array(overall)),
            "amplification": (("mode", "mesh"), np.tile([1.0, 3.0], (count, 1))),
            "strain_energy_share": (("mode", "element"), np.tile([0.25, 0.75], (count, 1))),
            "kinetic_energy_share": (("mode", "body", "motion"), np.full((count, 2, 4), 0.125)),
            "name": ("mode", np.array([f"mode {n}" for n in range(count)], dtype=object)),
        },
        {"mesh": ["a", "b"], "element": ["a", "bearing"], "body": ["one", "two"]},
    )


def read_run(path, lines, modes=None, window_length=None) -> VariantRun:
    return analysed(run_signals(path), lines, modes, window_length)


def two_variants(folder: Path) -> tuple[VariantRun, VariantRun]:
    """Bushing resonates at 500, 800 and 1150 Hz, rigid at 500 Hz."""
    # The mode at 802 Hz lies nearer to the resonance, but nothing of it reaches the overall transmission error.
    modes = modes_dataset([0.0, 497.0, 801.0, 806.0, 1150.0], [0.0, 0.3, 0.0, 0.2, 0.2])
    bushing = read_run(write_run(folder / "b.nc", "bushing", [500.0, 800.0, 1150.0]), [STORED_LINE], modes)
    window = bushing.spectra.window_length
    return bushing, read_run(write_run(folder / "r.nc", "rigid", [500.0]), [STORED_LINE], None, window)
