"""The gears of the GRC 750 kW gearbox, as the tests use them.

Teeth, modules, helix angles, hands, face widths and centre distances are the printed values of the GB2 build.
Profile shifts and dedendum are derived from printed root diameters and centre distances; unit addendum, held
diameters and a backlash of 0.04 normal modules, shared by both gears, are assumptions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from fe_ste.geometry.gears import BasicRack, Gear, GearPair
from fe_ste.tools.arrays import Floats, Integers

DEEP_RACK = BasicRack(addendum=1.0, dedendum=1.46, tip_radius=0.36)
DEEPEST_RACK = BasicRack(addendum=1.0, dedendum=1.50, tip_radius=0.34)

THINNING = 0.02
"""Reduction of tooth thickness per gear, in normal modules."""


@dataclass(frozen=True)
class Row:
    """One column of the published table: lengths in mm, angles in degrees."""

    teeth: int
    module: float
    helix: float
    shift: float
    width: float
    held: float
    rack: BasicRack = DEEP_RACK
    internal: bool = False


GRC_ROWS = {
    "sun": Row(21, 10.0, 7.495, 0.176, 220.0, 120.0),
    "planet": Row(39, 10.0, -7.495, 0.399, 227.5, 290.0),
    "ring": Row(99, 10.0, -7.495, 0.974, 230.0, 1166.0, internal=True),
    "intermediate_gear": Row(82, 8.25, 14.0, 0.296, 170.0, 300.0),
    "intermediate_pinion": Row(23, 8.25, -14.0, 0.154, 186.0, 90.0),
    "high_speed_gear": Row(88, 5.0, -14.0, 0.156, 110.0, 200.0, rack=DEEPEST_RACK),
    "high_speed_pinion": Row(22, 5.0, 14.0, 0.166, 120.0, 55.0, rack=DEEPEST_RACK),
}

GRC_PAIRS = {
    "sun_planet": ("sun", "planet", 308.0),
    "ring_planet": ("planet", "ring", 308.0),
    "intermediate": ("intermediate_pinion", "intermediate_gear", 450.0),
    "high_speed": ("high_speed_pinion", "high_speed_gear", 285.0),
}


def grc_gear(name: str) -> Gear:
    """Gear of the GRC gearbox by its name in `GRC_ROWS`."""
    row = GRC_ROWS[name]
    return Gear(
        name=name,
        teeth=row.teeth,
        normal_module=1e-3 * row.module,
        helix_angle=math.radians(row.helix),
        profile_shift=row.shift,
        face_width=1e-3 * row.width,
        held_diameter=1e-3 * row.held,
        internal=row.internal,
        rack=row.rack,
        tooth_thinning=THINNING * 1e-3 * row.module,
    )


def grc_pair(name: str) -> GearPair:
    """Pair of the GRC gearbox by its name in `GRC_PAIRS`."""
    pinion, gear, centre_distance = GRC_PAIRS[name]
    return GearPair(name=name, pinion=grc_gear(pinion), gear=grc_gear(gear), centre_distance=1e-3 * centre_distance)


@pytest.fixture(params=tuple(GRC_ROWS))
def any_grc_gear(request: pytest.FixtureRequest) -> Gear:
    """Each of the seven gears in turn."""
    return grc_gear(str(request.param))


@pytest.fixture(params=tuple(name for name, row in GRC_ROWS.items() if not row.internal))
def any_external_grc_gear(request: pytest.FixtureRequest) -> Gear:
    """Each of the six external gears in turn."""
    return grc_gear(str(request.param))


@pytest.fixture(params=tuple(GRC_PAIRS))
def any_grc_pair(request: pytest.FixtureRequest) -> GearPair:
    """Each of the four pairs in turn."""
    return grc_pair(str(request.param))


@pytest.fixture
def sun_planet() -> GearPair:
    """Sun and planet."""
    return grc_pair("sun_planet")


@pytest.fixture
def ring_planet() -> GearPair:
    """Planet and ring, an internal pair."""
    return grc_pair("ring_planet")


@pytest.fixture
def intermediate() -> GearPair:
    """Intermediate stage, 23/82."""
    return grc_pair("intermediate")


@pytest.fixture
def high_speed() -> GearPair:
    """High-speed stage, 22/88."""
    return grc_pair("high_speed")


Block = tuple[Floats, Integers]


def _block(*axes: Sequence[float]) -> Block:
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    ids = np.arange(len(points)).reshape([len(axis) for axis in axes])
    near, far = ids[:-1], ids[1:]
    corners = [near[:, :-1], far[:, :-1], far[:, 1:], near[:, 1:]]
    bottom, top = [c[:, :, :-1] for c in corners], [c[:, :, 1:] for c in corners]
    return points, np.stack([*bottom, *top], axis=-1).reshape(-1, 8)


@pytest.fixture
def block() -> Callable[..., Block]:
    """Nodes and VTK hexahedra of a block from the coordinates along x, y and z."""
    return _block
