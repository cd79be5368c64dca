"""Channels of a steady response beside the overall transmission error: forces of bearings and joints, of meshes.

Of planets each wave around the carrier is a channel: mean, cosine, sine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from exugear.report.findings.channels import Channel
from exugear.report.findings.constant_speed import response_spectra
from exugear.report.findings.words import Words

if TYPE_CHECKING:
    import xarray as xr

AXIAL = "z"
"""Axis of a bearing's force that is not transverse."""


def channels_of_response(response: xr.Dataset, words: Words, highest: float) -> Iterator[Channel]:
    """Compute the channels of a steady response, bearings and joints first.

    Parameters
    ----------
    response : Dataset
        As `exugear.steady.steady_file.load_response` reads it, a function of speed.
    words : Words
    highest : float
        Highest frequency that is drawn, Hz.

    Yields
    ------
    Channel
        Its mean forces are unknown (NaN): a steady response has what vibrates.
    """
    names = [str(name) for name in response["signal"].to_numpy()]
    supports: dict[str, list[str]] = {}
    for name in names:
        quantity, _, rest = name.partition(" ")
        place, _, axis = rest.rpartition(" ")
        if quantity == "support_force" and axis != AXIAL:
            supports.setdefault(place, []).append(name)
    for place, signals in supports.items():
        yield _channel(response, words, "support", place, signals, highest)
    for name in names:
        if name.startswith("mesh_force "):
            yield _channel(response, words, "mesh", name.removeprefix("mesh_force "), [name], highest)


def _channel(
    response: xr.Dataset, words: Words, kind: str, place: str, signals: Sequence[str], highest: float
) -> Channel:
    spectra = response_spectra(response, signals, highest, 1.0, "N")
    name, *wave = place.split(" ")
    told = " ".join([words.of(name), *wave])
    said = told if kind == "support" else f"mesh {told}"
    return Channel(place, kind, said, 1, math.nan, math.nan, spectra)
