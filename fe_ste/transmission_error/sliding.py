"""Sliding of the teeth over the mesh cycle, from the line loads of a transmission error table.

Where a tooth pair touches at a distance x along the line of action from the pitch point, its flanks slide on each other
with the speed abs(omega_1 (1 + 1/u) x), omega_1 that of gear 1 relative to the frame of the mesh.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.geometry.gears import GearPair
from fe_ste.standards.mesh_loss import friction_xu_kahraman
from fe_ste.tools.arrays import Floats
from fe_ste.transmission_error.contact_stress import contact_line_stress, contact_path

if TYPE_CHECKING:
    import xarray as xr


def table_loss_factor(pair: GearPair, state: xr.Dataset) -> float:
    """Gear loss factor H_V from the line loads of one load of a table.

    Parameters
    ----------
    state : with ``line_load`` (N/m) over ``pmc``, ``tooth`` and ``axial_position``, such as `MeshTable.static_state`

    Notes
    -----
    H_V is the mean over the mesh cycle of the normal load times the sliding speed, over the power that the tangential
    force at the base circles transmits. With equal load on all pairs in contact it is that of Ohlendorf.
    """
    load, along = _loads_along_path(pair, state)
    ratio = abs(1.0 + pair.gear.outward * pair.pinion.teeth / pair.gear.teeth)
    sliding = float((load * np.abs(along)).sum()) * ratio / pair.pinion.base_radius
    return sliding / (float(load.sum()) * math.cos(pair.pinion.base_helix_angle))


def table_friction(pair: GearPair, state: xr.Dataset, speed: float, viscosity: float, roughness: float) -> float:
    """Mean coefficient of friction by Xu and Kahraman, weighted by load and sliding speed over the mesh cycle.

    Parameters
    ----------
    state : as in `table_loss_factor`
    speed : of gear 1 relative to the frame of the mesh, rad/s
    viscosity : Pa s
    roughness : root mean square roughness of both flanks, m
    """
    load, along = _loads_along_path(pair, state)
    line_load = _line_load(state)
    axial = np.asarray(state["axial_position"].to_numpy())
    pmc = state["pmc"].to_numpy()[:, None, None]
    tooth = state["tooth"].to_numpy()[None, :, None]
    pressure = contact_line_stress(pair, pmc, tooth, axial, line_load)
    # Radii of curvature of both flanks in the transverse section.
    tangent = math.tan(pair.working_pressure_angle)
    first, second = (
        pair.pinion.base_radius * tangent + along,
        pair.gear.base_radius * tangent - pair.gear.outward * along,
    )
    ratio = pair.pinion.teeth / pair.gear.teeth
    surface_speeds = abs(speed) * first, abs(speed) * ratio * second
    mean = 0.5 * (surface_speeds[0] + surface_speeds[1])
    slide = (surface_speeds[0] - surface_speeds[1]) / mean
    radius = 1.0 / ((1.0 / first + pair.gear.outward / second) * math.cos(pair.pinion.base_helix_angle))
    touching = line_load > 0.0
    local = np.zeros_like(line_load)
    local[touching] = friction_xu_kahraman(
        pressure[touching], slide[touching], mean[touching], radius[touching], viscosity, roughness
    )
    weight = load * np.abs(along)
    return float((local * weight).sum() / weight.sum())


def friction_over_cycle(pair: GearPair, state: xr.Dataset) -> Floats:
    """Force and moments of friction over the mesh cycle, per unit coefficient of friction and unit mesh force, (3, n).

    The mesh force is that on the transverse line of action. The force of friction acts across the line of action in
    the transverse plane; the moments are those about the gear axes and about the line of action, m, of this force at
    the pitch point in the middle of the face. All are positive where gear 1 turns faster about +z than gear 2.

    Parameters
    ----------
    state : as in `table_loss_factor`

    Notes
    -----
    A contact line reverses its friction where it crosses the pitch point: over the width of one position here, which a
    table does not resolve.
    """
    load, along = _loads_along_path(pair, state)
    axial = state["axial_position"].to_numpy()
    pmc = state["pmc"].to_numpy()
    unresolved = 0.5 * pair.transverse_base_pitch / len(pmc)
    sense = np.clip(along / unresolved, -1.0, 1.0)
    parts = np.array([(load * part).sum(axis=(1, 2)) for part in (sense, np.abs(along), sense * axial)])
    total = load.sum(axis=(1, 2))
    known = total > 0.0
    found = parts[:, known] / (total[known] * math.cos(pair.pinion.base_helix_angle))
    return np.array([np.interp(pmc, pmc[known], row, period=1.0) for row in found])


def _line_load(state: xr.Dataset) -> Floats:
    """Line load (pmc, tooth, axial position), N/m; positions that have not converged count as unloaded."""
    return np.asarray(np.nan_to_num(state["line_load"].transpose("pmc", "tooth", "axial_position").to_numpy()))


def _loads_along_path(pair: GearPair, state: xr.Dataset) -> tuple[Floats, Floats]:
    """Line loads (pmc, tooth, axial position), N/m, and where they act along the line of action, m from pitch point."""
    load = _line_load(state)
    pmc = state["pmc"].to_numpy()[:, None, None]
    tooth = state["tooth"].to_numpy()[None, :, None]
    base_point, along, _ = contact_path(pair, pmc, tooth, state["axial_position"].to_numpy())
    return load, np.broadcast_to(along - base_point, load.shape)
