"""Rows of rolling bearings for tests, and assemblies whose supports follow them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from exugear.system.bearings.rolling.contact import bearing_load, row_contacts
from exugear.system.bearings.rolling.point_contact import ball_constant, rolling_arrays
from exugear.system.bearings.rolling.rows import BallRow, RollerRow, RollingRow
from exugear.system.kernels.rolling import ELASTIC_PART, rolling_forces, rolling_memory
from exugear.system.system import Assembly

CYLINDRICAL = RollerRow(
    element_diameter=0.030,
    pitch_diameter=0.225,
    element_count=20,
    effective_length=0.060,
    profile_factor=0.00035,
    radial_clearance=40e-6,
    laminae=240,
)
"""Rollers of a cylindrical roller bearing 160 x 290 x 80."""
TAPERED = replace(CYLINDRICAL, element_count=24, element_diameter=0.020, contact_angle=0.3, radial_clearance=0.0)
BALLS = BallRow(element_diameter=0.030, pitch_diameter=0.225, element_count=16, radial_clearance=10e-6)


def plain_energy_and_load(row: RollingRow, displacement: np.ndarray, phase: float) -> tuple[float, np.ndarray]:
    """Energy (J), force and moment (5,) of a row by plain sums over slices and balls, each moved with its ring."""
    energy, load = 0.0, np.zeros(6)
    for polar in phase + 2.0 * np.pi * np.arange(row.element_count) / row.element_count:
        outward, axis = np.array([np.cos(polar), np.sin(polar), 0.0]), np.array([0.0, 0.0, 1.0])
        normal = np.cos(row.contact_angle) * outward + np.sin(row.contact_angle) * axis
        place = 0.5 * row.pitch_diameter * outward + row.axial_position * axis
        sums = _balls if isinstance(row, BallRow) else _slices
        for stored, force, at in sums(row, displacement, place, normal, outward):
            energy += stored
            load += [*force, *np.cross(at, force)]
    return energy, load[:5]


Contact = tuple[float, np.ndarray, np.ndarray]
"""Energy, force on the inner ring, and where it acts."""


def _slices(
    row: RollerRow, displacement: np.ndarray, place: np.ndarray, normal: np.ndarray, outward: np.ndarray
) -> Iterator[Contact]:
    """Slices of a roller by ISO/TS 16281."""
    share = (np.arange(row.laminae) + 0.5) / row.laminae - 0.5
    along = np.cross(normal, np.cross(outward, [0.0, 0.0, 1.0]))
    gaps = 0.5 * row.radial_clearance * np.cos(row.contact_angle) + 2.0 * row.drop(share * row.effective_length)
    constant = 35948e6 * row.effective_length ** (8 / 9) / row.laminae
    for part, gap in zip(share * row.effective_length, gaps, strict=True):
        at = place + part * along
        moved = displacement[:3] + np.cross([*displacement[3:], 0.0], at)
        force = constant * max(0.0, moved @ normal - gap) ** (10 / 9)
        yield 9 / 19 * force * max(0.0, moved @ normal - gap), force * normal, at


def _balls(
    row: BallRow, displacement: np.ndarray, place: np.ndarray, normal: np.ndarray, outward: np.ndarray
) -> Iterator[Contact]:
    """One ball between the centres of both grooves, to the first order of their displacements."""
    at = place + (row.inner_conformity - 0.5) * row.element_diameter * normal
    span = (row.inner_conformity + row.outer_conformity - 1.0) * row.element_diameter
    moved = displacement[:3] + np.cross([*displacement[3:], 0.0], at)
    # What moves along the circle changes the distance in no first order.
    between = span * normal + (moved @ outward - 0.5 * row.radial_clearance) * outward + [0.0, 0.0, moved[2]]
    approach = max(0.0, np.linalg.norm(between) - span)
    force = ball_constant(row) * approach**1.5
    yield 0.4 * force * approach, force * between / np.linalg.norm(between), at


def on_rolling(
    assembly: Assembly, rows: Sequence[tuple[RollingRow, ...]], *, stiffness: float = 1.0, turning: bool = True
) -> Assembly:
    """Assembly whose supports have rows in turn, beside their matrices times a factor; cages turn or stand."""
    count = len(assembly.connector_names)
    rows = [rows[n % len(rows)] for n in range(count)]
    sense = np.where(np.arange(count) % 3 == 2, -1.0, 1.0)
    connectors = assembly.connectors
    return replace(
        assembly,
        connectors=connectors._replace(
            stiffness=stiffness * connectors.stiffness,
            damping=stiffness * connectors.damping,
            rolling=rolling_arrays(
                rows,
                scale=sense * np.linspace(1.0, 0.7, count),
                time=np.full(count, 4e-6),
                cage_ratio=np.full(count, 0.43 * turning),
                phase=np.linspace(0.0, 0.3, count),
            ),
        ),
    )


def assert_compiled_forces_are_those_of(rows: Sequence[RollingRow], state: Sequence[float]) -> None:
    """Forces of the compiled law at a displacement (5,), cages turned by 0.1 rad, against the contacts of the rows."""
    arrays = rolling_arrays([rows], [1.0], [0.0], [0.0], [0.1])
    out = rolling_memory(arrays)
    rolling_forces(0, np.array(state), np.zeros(6), 0.0, arrays, out)
    expected = bearing_load(row_contacts(rows, 0.1), np.append(state, 0.0))[:5]
    assert np.abs(out[ELASTIC_PART : ELASTIC_PART + 5] - expected).max() < 1e-3 * np.abs(expected).max()
