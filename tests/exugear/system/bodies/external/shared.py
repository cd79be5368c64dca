"""A spur pair in a box from matrices."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.results.sound.radiated_power import radiated_power
from exugear.system.bodies.matrix_files.files import MatrixFormat, file_contents, keys_of
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices
from exugear.system.modes import modes_of
from exugear.system.statics import static_state
from exugear.system.system import Assembly

from ....cases.box import box_content

STIFFNESS = {"spur": 2e8 * (1.0 + 0.1 * np.cos(2.0 * np.pi * np.arange(16) / 16))}
LOAD = {"shaft_1": 100.0, "shaft_2": 140.0}
FOOT = {"foot": {"position_mm": [50.0, 0.0, -12.0]}}
"""The mount stands below its node."""
TOLERANCE = {"dmig": 1e-8}
"""Largest relative change of modes and static state by a file: 1e-9, but for the digits of a punch file."""


def box_of(folder: Path, external: Mapping[str, Any], solid: bool = False) -> Gearbox:
    """The spur pair in a box from matrices."""
    content = box_content(folder)
    if not solid:
        del content["bodies"]["box"]["solid"]
    content["bodies"]["box"]["external"] = {"units": "SI", "seats": FOOT, **external}
    return Gearbox.from_dict(content, str(folder / "case.toml"))


def write(folder: Path, body: InterfaceMatrices, form: MatrixFormat = "npz") -> dict[str, str]:
    for name, content in file_contents(body, "box", form).items():
        (folder / name).write_bytes(content)
    return keys_of("box", form)


def largest_change(found: Assembly, wanted: Assembly) -> float:
    """Largest relative change of the elastic modes' frequencies and of the static state."""
    one, two = (modes_of(assembly).frequency for assembly in (found, wanted))
    moving = two > 1.0
    static = [static_state(assembly).q for assembly in (found, wanted)]
    return max(
        float(np.abs(one[moving] / two[moving] - 1.0).max()),
        float(np.abs(static[0] - static[1]).max() / np.abs(static[1]).max()),
    )


def assert_sound_is_that_of(found: Assembly, wanted: Assembly) -> None:
    """Area and normal velocity of the outer surface within 1e-6, in motions with all coordinates."""
    motion = np.random.default_rng(5).normal(size=(8, 2, wanted.size)) @ np.diag(1e-6 * np.ones(wanted.size))
    frequencies = 2.0 * np.pi * np.linspace(50.0, 2000.0, 8)
    (one, area), (two, wanted_area) = (
        (own.surface_velocity(motion[:, 0] + 1j * motion[:, 1], frequencies), own.area)
        for own in map(radiated_power, (found, wanted))
        if own is not None
    )
    assert area == pytest.approx(wanted_area, rel=1e-6)
    assert one == pytest.approx(two, rel=1e-6)
