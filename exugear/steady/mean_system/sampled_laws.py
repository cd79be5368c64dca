"""Mesh models on many samples at once: forces and their derivatives by the inputs, in compiled loops.

A model along a row has the inputs deflection and position, and the misalignment between them where its load shuttles,
with a moment along it (`exugear.system.tooth_mesh.contact_state`); the model `table` both flanks, the centre distance,
both misalignments and the position (`exugear.steady.mean_system.mesh_places`). Loops are compiled by
`fe_ste.tools.compilation`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exugear.steady.mean_system.mesh_places import (
    BACK,
    BACK_TILT,
    CENTRE,
    DEFLECTION,
    FRONT,
    MISALIGNMENT,
    POSITION,
    TILT,
)
from exugear.system.kernels.meshes import MeshArrays
from exugear.system.kernels.rolling import (
    ELASTIC_PART,
    RollingArrays,
    rolling_memory,
    rolling_tangent,
    set_force,
    sum_rows,
)
from exugear.system.kernels.table_law import (
    BY_DISTANCE,
    BY_MISALIGNMENT,
    DAMPING_SIZE,
    LAW_BY_DISTANCE,
    LAW_BY_MISALIGNMENT,
    LAW_FORCE,
    LAW_STIFFNESS,
    ORDERS,
    TableArrays,
    scratch_memory,
    surface_damping,
    surface_law,
    surface_tangent,
)
from exugear.system.tooth_mesh.laws.line_of_action import curve_of
from exugear.system.tooth_mesh.laws.table import damped_forces, flank_tangent
from fe_ste.tools.arrays import Floats
from fe_ste.tools.bundles import cached_bundle
from fe_ste.tools.compilation import compiled, kernel

TOUCHING = 0.25e-6
"""Approach over which the damping of teeth that touch sets in, m.

By the law itself it jumps at first touch, by 4 % of the load in the GRC: no balance of smooth lines ends there. The
ramp costs a thousandth of the response, mostly in its phase.
"""
TABLE_READINGS = 6
TABLE_FORCES = 5


class LawSamples(NamedTuple):
    """A law on s samples, with r readings and f forces."""

    force: Floats
    """(s, f) elastic and damped parts together, N and N m."""
    slope: Floats
    """(s, f, r) derivatives by the readings."""
    damping: Floats
    """(s, f, r) derivatives by their rates."""


def widened(samples: LawSamples, forces: int, readings: int) -> LawSamples:
    """Return samples with as many forces and readings as asked for: zeros where the law has none.

    The last reading, the position in the cycle, stays the last.
    """
    force, slope, damping = samples
    if slope.shape[1:] == (forces, readings):
        return samples
    wide = np.zeros((len(force), forces))
    wide[:, : force.shape[1]] = force
    slopes = []
    for own in (slope, damping):
        found = np.zeros((len(force), forces, readings))
        found[:, : own.shape[1], : own.shape[2] - 1] = own[..., :-1]
        found[:, : own.shape[1], -1] = own[..., -1]
        slopes.append(found)
    return LawSamples(wide, *slopes)


def sample_line(stiffness: Floats, readings: Floats) -> LawSamples:
    """Sample a linear model along a row without its damper, which is in the averaged system.

    Parameters
    ----------
    stiffness : (6, s)
        Stiffness at the mesh position of the mean speed, N/m, and its two derivatives per cycle; the same of the force
        to be subtracted, N.
    readings : (s, 2)
        Deflection, m, and shift of the position by the vibration, cycles. It is a thousandth of a cycle or less, so
        that a parabola is sufficient.
    """
    deflection, moved = readings.T
    value, by_position = _moved(stiffness[:3], moved)
    pull, pull_by_position = _moved(stiffness[3:], moved)
    slope = np.stack([value, by_position * deflection - pull_by_position], axis=1)[:, None]
    return LawSamples((value * deflection - pull)[:, None], slope, np.zeros_like(slope))


def sample_curve(curve: Floats, readings: Floats, load: float) -> LawSamples:
    """Sample a curve of load over deflection (`exugear.system.tooth_mesh.laws.line_of_action`), as `sample_line`.

    Parameters
    ----------
    curve : (6, s) load over deflection at a load, N/m, and its exponent less one; each with two derivatives per cycle
    readings : (s, 2)
    load : N
    """
    force = np.empty((len(readings), 1))
    slope = np.zeros((len(readings), 1, 2))
    _fill_curve(curve, readings, 1.0 / load, force[:, 0], slope[:, 0])
    return LawSamples(force, slope, np.zeros_like(slope))


@compiled
def _fill_curve(curve: Floats, readings: Floats, per_load: float, force: Floats, slope: Floats) -> None:
    for s in range(readings.shape[0]):
        moved = readings[s, 1]
        k = curve[0, s] + moved * (curve[1, s] + 0.5 * moved * curve[2, s])
        n = curve[3, s] + moved * (curve[4, s] + 0.5 * moved * curve[5, s])
        k_slope = curve[1, s] + moved * curve[2, s]
        n_slope = curve[4, s] + moved * curve[5, s]
        force[s], slope[s, 0], slope[s, 1], _, _ = curve_of(k, k_slope, n, n_slope, per_load, readings[s, 0])


def sample_wandering_line(tangents: Floats, readings: Floats) -> LawSamples:
    """Sample a linear model whose load shuttles, as `sample_line`.

    Parameters
    ----------
    tangents : (18, s)
        Stiffness k (N/m), force to be subtracted p (N), with the axial shift w of the load k w, p w and k w^2, and the
        additional moment (N m); each with two derivatives per cycle.
    readings : (s, 3)
        Deflection (m), misalignment relative to that of the contact's state (rad), and position as in `sample_line`.
    """
    deflection, tilt, moved = readings.T
    (k, k_slope), (p, p_slope), (kw, kw_slope), (pw, pw_slope), (kww, kww_slope), (beyond, beyond_slope) = (
        _moved(own, moved) for own in tangents.reshape(6, 3, -1)
    )
    force = k * deflection - kw * tilt - p
    moment = kww * tilt - kw * deflection + pw - beyond
    by_position = k_slope * deflection - kw_slope * tilt - p_slope
    turning = kww_slope * tilt - kw_slope * deflection + pw_slope - beyond_slope
    slope = np.stack([np.stack([k, -kw, by_position], axis=1), np.stack([-kw, kww, turning], axis=1)], axis=1)
    return LawSamples(np.stack([force, moment], axis=1), slope, np.zeros_like(slope))


def sample_wandering_curve(curve: Floats, readings: Floats, load: float) -> LawSamples:
    """Sample a curve whose load shuttles, as `sample_curve`.

    The axial shift and the additional moment (6, s) follow the curve's parameters. Readings (s, 3) are those of
    `sample_wandering_line`.
    """
    deflection, tilt, moved = readings.T
    (way, way_slope), (beyond, beyond_slope) = _moved(curve[6:9], moved), _moved(curve[9:], moved)
    own = sample_curve(curve[:6], np.stack([deflection - way * tilt, moved], axis=1), load)
    force = own.force[:, 0]
    k = own.slope[:, 0, 0]
    by_position = own.slope[:, 0, 1] - k * way_slope * tilt
    along = np.stack([k, -way * k, by_position], axis=1)
    across = -way[:, None] * along
    across[:, POSITION] -= way_slope * force + beyond_slope
    slope = np.stack([along, across], axis=1)
    return LawSamples(np.stack([force, -way * force - beyond], axis=1), slope, np.zeros_like(slope))


def add_resistance(
    samples: LawSamples,
    readings: Floats,
    rates: Floats,
    damping: float,
    tilt_stiffness: float,
    tilt_damping: float,
    moment: float,
) -> None:
    """Add the damper of a model along a row, and its resistance to misalignment where it has a moment along it.

    Parameters
    ----------
    readings, rates : (s, r) with the misalignment (rad) behind the deflection (m); rates per second
    damping : N s/m
    tilt_stiffness, tilt_damping, moment : N m/rad, N m s/rad and N m, as `MeshWaves.tilting` has them
    """
    force, slope, damper = samples
    force[:, DEFLECTION] += damping * rates[:, DEFLECTION]
    damper[:, DEFLECTION, DEFLECTION] += damping
    if force.shape[1] > MISALIGNMENT:
        force[:, MISALIGNMENT] += tilt_stiffness * readings[:, MISALIGNMENT] - moment
        force[:, MISALIGNMENT] += tilt_damping * rates[:, MISALIGNMENT]
        slope[:, MISALIGNMENT, MISALIGNMENT] += tilt_stiffness
        damper[:, MISALIGNMENT, MISALIGNMENT] += tilt_damping


def _moved(values: Floats, moved: Floats) -> tuple[Floats, Floats]:
    """Value and slope of a function (3, s) with two derivatives, at an offset `moved` (s,)."""
    return values[0] + moved * (values[1] + 0.5 * moved * values[2]), values[1] + moved * values[2]


def sample_table(meshes: MeshArrays, mesh: int, readings: Floats, rates: Floats) -> LawSamples:
    """Sample the law `table`; readings and their rates (s, 6), the position in the cycle among them as a whole."""
    shape = len(readings), TABLE_FORCES
    out = LawSamples(np.zeros(shape), np.zeros((*shape, TABLE_READINGS)), np.zeros((*shape, TABLE_READINGS)))
    # The other flank runs backwards through its cycle.
    turned = meshes.table.back_phase[mesh] + meshes.phase[mesh]
    _fill_flank(1.0, mesh, readings, rates, turned, meshes.table, *out)
    _fill_flank(-1.0, mesh, readings, rates, turned, meshes.table, *out)
    return out


@compiled
def _fill_flank(
    side: float,
    m: int,
    readings: Floats,
    rates: Floats,
    turned: float,
    tables: TableArrays,
    force: Floats,
    slope: Floats,
    damping: Floats,
) -> None:
    """Add one flank (1, -1) to forces and slopes; `turned` is the sum of both flanks' positions."""
    own = FRONT if side > 0.0 else BACK
    tilt = TILT if side > 0.0 else BACK_TILT
    position = readings.shape[1] - 1
    sense = side * tables.sense[m]
    time = tables.damping_time[m]
    memory = scratch_memory()
    second = np.empty((4, 4))
    sizes = np.empty(DAMPING_SIZE)
    slopes = np.empty((3, 4))
    by_rates = np.empty((3, 3))
    places = np.array([own, CENTRE, tilt, position])
    signs = np.array([1.0, 1.0, sense, side])
    piece = 0
    for s in range(readings.shape[0]):
        delta = readings[s, own]
        if delta <= tables.lowest[m]:
            continue
        pmc = readings[s, position] if side > 0.0 else turned - readings[s, position]
        centre = readings[s, CENTRE]
        misalignment = sense * readings[s, tilt]
        piece, t = surface_law(delta, pmc, centre, misalignment, m, tables, piece, ORDERS.shape[0], memory)
        if t < 0.0:
            continue
        surface_tangent(t, piece, m, tables, memory, second)
        law = memory.law
        cubic = memory.cubic
        stiffness = law[LAW_STIFFNESS]
        # Damping fades in over the approach after first touch; a piece beyond the first is well behind it.
        ramp = 1.0
        ramp_slope = 0.0
        if piece == 0:
            whole = min(TOUCHING, cubic[0, 1] + cubic[0, 2] + cubic[0, 3])
            x = (delta - cubic[0, 0]) / whole
            if x < 1.0:
                ramp = x * x * (3.0 - 2.0 * x)
                ramp_slope = 6.0 * x * (1.0 - x) / whole
        surface_damping(t, piece, m, tables, memory, sizes)
        damped, along_centre, along_tilt, _ = damped_forces(
            ramp * time, stiffness, sizes, rates[s, own], rates[s, CENTRE], sense * rates[s, tilt]
        )
        force[s, own] += law[LAW_FORCE] + damped
        force[s, CENTRE] += law[LAW_BY_DISTANCE] + along_centre
        force[s, tilt] += sense * (law[LAW_BY_MISALIGNMENT] + along_tilt)
        flank_tangent(ramp * time, stiffness, damped, sizes, second, slopes, by_rates)
        if ramp_slope > 0.0:
            # First touch itself moves with centre distance, misalignment and position.
            fading = damped * ramp_slope / ramp
            for b in range(4):
                touch = 1.0 if b == 0 else -cubic[b, 0]
                slopes[0, b] += fading * touch
                slopes[1, b] -= sizes[BY_DISTANCE] * fading * touch
                slopes[2, b] -= sizes[BY_MISALIGNMENT] * fading * touch
        for a in range(3):
            for b in range(3):
                damping[s, places[a], places[b]] += signs[a] * signs[b] * by_rates[a, b]
            for b in range(4):
                slope[s, places[a], places[b]] += signs[a] * signs[b] * slopes[a, b]


# The law of rolling bearings on many samples at once: forces and their slopes, by the kernel of runs in time


def sample_rolling(rolling: RollingArrays, law: int, readings: Floats) -> tuple[Floats, Floats]:
    """Sample the law of one bearing.

    Parameters
    ----------
    law : which of them
    readings : (s, 5) displacement and tilts, ahead by the time of the damping, m and rad

    Returns
    -------
    force : (s, 5) N and N m
    slope : (s, 5, 5) its derivatives by the readings
    """
    force = np.empty(readings.shape)
    slope = np.empty((*readings.shape, readings.shape[1]))
    _fill(
        law, np.ascontiguousarray(readings), np.zeros(6), cached_bundle(rolling), rolling_memory(rolling), force, slope
    )
    return force, slope


@kernel
def _fill(
    law: int, readings: Floats, still: Floats, rolling: RollingArrays, memory: Floats, force: Floats, slope: Floats
) -> None:
    for s in range(readings.shape[0]):
        about_axis = sum_rows(law, readings[s], still, 0.0, 0.0, rolling, memory)
        set_force(law, ELASTIC_PART, readings[s], about_axis, rolling, memory)
        for i in range(readings.shape[1]):
            force[s, i] = memory[ELASTIC_PART + i]
        rolling_tangent(law, readings[s], 0.0, rolling, slope[s])
