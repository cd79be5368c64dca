"""Channels beside the overall transmission error: forces of bearings and joints, and of meshes, whichever source.

In a run-up one copy of a planet set stands for all: the one whose force swings most. In a steady response each wave
around the carrier is a channel: mean, cosine, sine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from exugear.report.findings.constant_speed import response_spectra
from exugear.report.findings.words import Words
from exugear.results.run_file import read_run
from exugear.results.spectra.orders import OrderLine
from exugear.results.spectra.run_spectra import VariantRun
from exugear.results.spectra.waterfall import Waterfall, waterfall
from fe_ste.tools.arrays import Floats

OVERLAP = 0.5
"""Share of a window that the next one repeats: enough for what is drawn coarser than the transmission error."""
SAMPLED = 8
"""Every which sample tells how much a force swings."""
MEAN_PART = slice(1, 2)
"""Third of the run whose mean force is told: neither the start nor the fastest."""
AXIAL = "z"
"""Axis of a bearing's force that is not transverse."""

_Signals = Mapping[str, NDArray[Any]]
"""Variables of a run by their names."""


@dataclass(frozen=True)
class Channel:
    """A signal of a run-up or a steady response with its waterfall."""

    name: str
    """Of the bearing, joint or mesh."""
    kind: str
    """{"support", "mesh"}"""
    words: str
    """What it is."""
    copies: int
    """How many equal parts it stands for."""
    mean: float
    """Mean force over the middle third of the run, N; of bearings that go round with a carrier, of its magnitude.
    NaN of a steady response, which has what vibrates."""
    axial: float
    """Mean axial force of a bearing there, N; NaN for a mesh and of a steady response."""
    spectra: Waterfall
    """Of a support the root of the summed squares of both transverse forces."""


@dataclass(frozen=True)
class LoudestOrder:
    """Where a channel is loudest along the orders."""

    line: OrderLine
    amplitude: float
    """In the unit of the channel."""
    speed: float
    frequency: float
    """rad/s, Hz."""


def channels_of(run: VariantRun, words: Words, response: xr.Dataset | None) -> Iterator[Channel]:
    """Compute the channels of a run-up, or of the steady response that it was made of, bearings and joints first."""
    if response is not None:
        yield from _lines(response, words, float(run.spectra.frequency[-1]))
        return
    data, _ = read_run(run.path, ("time", "input_speed", "support", "mesh", "mesh_force", "support_force"))
    yield from _supports(data, run, words)
    yield from _meshes(data, run, words)


def _supports(data: _Signals, run: VariantRun, words: Words) -> Iterator[Channel]:
    force = data["support_force"]
    names = [str(name) for name in data["support"]]
    sample = force[::SAMPLED]
    swings = np.hypot(sample[..., 0], sample[..., 1]).std(axis=0)
    for place, copies in _standing_for(names, swings, words):
        own = np.ascontiguousarray(force[:, place].T)
        parts = [_waterfall(own[axis], data, run) for axis in (0, 1)]
        whole = replace(parts[0], amplitude=np.hypot(parts[0].amplitude, parts[1].amplitude))
        middle = _middle(own.T.astype(np.float64))
        # The force of a bearing that goes round has no mean in axes that stand still.
        mean = max(math.hypot(*middle[:, :2].mean(axis=0)), 0.0)
        if copies > 1:
            mean = float(np.hypot(middle[:, 0], middle[:, 1]).mean())
        told = words.of(words.family(names[place])) if copies > 1 else words.of(names[place])
        yield Channel(names[place], "support", told, copies, mean, float(middle[:, 2].mean()), whole)


def _meshes(data: _Signals, run: VariantRun, words: Words) -> Iterator[Channel]:
    force = data["mesh_force"]
    names = [str(name) for name in data["mesh"]]
    for place, copies in _standing_for(names, force[::SAMPLED].std(axis=0), words):
        own = np.ascontiguousarray(force[:, place])
        told = words.of(words.family(names[place])) if copies > 1 else words.of(names[place])
        mean = float(_middle(own).mean(dtype=np.float64))
        yield Channel(names[place], "mesh", f"mesh {told}", copies, mean, math.nan, _waterfall(own, data, run))


def _lines(response: xr.Dataset, words: Words, highest: float) -> Iterator[Channel]:
    supports: dict[str, list[str]] = {}
    meshes: dict[str, list[str]] = {}
    for name in map(str, response["signal"].to_numpy()):
        quantity, _, rest = name.partition(" ")
        place, _, axis = rest.rpartition(" ")
        if quantity == "support_force" and axis != AXIAL:
            supports.setdefault(place, []).append(name)
        elif quantity == "mesh_force":
            meshes[rest] = [name]
    for kind, before, places in (("support", "", supports), ("mesh", "mesh ", meshes)):
        for place, signals in places.items():
            spectra = response_spectra(response, signals, highest, 1.0, "N")
            name, *wave = place.split(" ")
            told = " ".join([before + words.of(name), *wave])
            yield Channel(place, kind, told, 1, math.nan, math.nan, spectra)


def _standing_for(names: Sequence[str], swings: Floats, words: Words) -> list[tuple[int, int]]:
    """Place of the channel that stands for each family, and how many there are."""
    families: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        families.setdefault(words.family(name), []).append(place)
    return [(max(family, key=lambda place: float(swings[place])), len(family)) for family in families.values()]


def _middle(values: Floats) -> Floats:
    third = len(values) // 3
    if third:
        return values[MEAN_PART.start * third : MEAN_PART.stop * third]
    return values


def _waterfall(values: Floats, data: _Signals, run: VariantRun) -> Waterfall:
    time = data["time"]
    speed = data["input_speed"]
    rate = (time.size - 1) / float(np.ptp(time))
    return waterfall(
        values, speed, rate, window_length=run.spectra.window_length, overlap=OVERLAP, reference=1.0, unit="N"
    )


def loudest_order(spectra: Waterfall, lines: Sequence[OrderLine]) -> LoudestOrder | None:
    """Find where a waterfall is loudest along its orders; None where no order lies in its band."""
    levels = np.array([spectra.along(line) for line in lines]).reshape(len(lines), spectra.time.size)
    if not np.isfinite(levels).any():
        return None
    line, frame = divmod(int(np.nanargmax(levels)), levels.shape[1])
    speed = float(spectra.speed[frame])
    return LoudestOrder(
        lines[line],
        spectra.reference * 10.0 ** (float(levels[line, frame]) / 20.0),
        speed,
        float(lines[line].frequency(speed)),
    )
