"""Sound power on the console: the loudest speed in a line, its orders, and its third octaves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from exugear.cli.resonances import FREQUENCY, ORDER
from exugear.cli.tables import Column, Table, significant
from exugear.results.causes import shares, strongest

LEVELS = (Column("dB", "level_dB", ".1f"), Column("dB(A)", "level_dBA", ".1f"))
LEGEND = "Equivalent radiated power of the outer surface, dB re 1 pW: an upper estimate."


def sound_line(sound: Mapping[str, Any]) -> str:
    """Return the loudest speed of a summary of `SoundOverSpeed` in one line.

    Examples
    --------
    >>> sound_line({"limit_Hz": 1000.0, "orders": []})
    'No sound power up to 1000 Hz'
    """
    if not sound["orders"]:
        return f"No sound power up to {significant(sound['limit_Hz'])} Hz"
    first = sound["orders"][0]
    return (
        f"Highest sound power {sound['level_dBA']:.1f} dB(A), upper estimate: {_speed(sound)} rpm, "
        f"{first['level_dBA']:.1f} dB(A) of it at {FREQUENCY.cell(first)} Hz, {ORDER.cell(first)}"
    )


def sound_tables(sound: Mapping[str, Any]) -> list[Table]:
    """Return the orders and the third octaves at the loudest speed, and what makes the loudest orders."""
    at = f"at {_speed(sound)} rpm, {sound['level_dB']:.1f} dB, {sound['level_dBA']:.1f} dB(A)"
    surface = (
        f"Outer surface {significant(sound['outer_surface_m2'], 3)} of {significant(sound['whole_surface_m2'], 3)}"
    )
    centre = Column("third octave\nHz", "centre_Hz", "g")
    return [
        Table(
            f"Sound power by order {at}",
            sound["orders"],
            [ORDER, FREQUENCY, *LEVELS],
            f"{LEGEND} {surface} m².",
            noun="orders",
        ),
        Table(f"Sound power in third octaves {at}", sound["third_octaves"], [centre, *LEVELS], LEGEND, noun="bands"),
        Table(
            f"Contributions to the sound power of the loudest orders {at}",
            sound["contributions"],
            [
                ORDER,
                FREQUENCY,
                Column("excited by", lambda own: shares(own["meshes"].items()), is_text=True),
                Column(
                    "modes",
                    lambda own: shares((f"{value:.0f} Hz", share) for value, share in own["modes"]),
                    is_text=True,
                ),
                Column("stiffness of", lambda own: strongest(own["supports"]), is_text=True),
            ],
            "Shares of the power of the linear response; stiffness: relative change of the surface velocity by it.",
            noun="orders",
        ),
    ]


def _speed(sound: Mapping[str, Any]) -> str:
    return significant(sound["speed_rpm"], 3)
