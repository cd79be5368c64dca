"""Stress of a pair over its mesh cycle from the line loads of a table: Hertz at the flanks, bending at the roots.

Line loads act along the contact lines. Hertzian stress is that of the line load and the curvature there, inside the
path of contact: tip edges that dig into unmodified flanks have no Hertzian stress, and what they carry outside the path
is told as a share of the load. Roots feel line loads as forces, whatever their width.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from fe_ste.geometry.gears import GearPair
from fe_ste.root_stress.root import RootGauges
from fe_ste.tools.arrays import Booleans, Floats
from fe_ste.tools.display import Displayed

PATH_MARGIN = 0.05
"""Part of the path of contact at either end that counts as its edge."""
CLEAR_OF_FILLET = 0.5
"""Modules along the flank from its end above the fillet within which a load acts no nearer to the gauges."""
PITCH_ZONE = 0.05
"""Part of the path on either side of the pitch point whose stress is told beside the largest."""


@dataclass(frozen=True)
class MeshCycleStress(Displayed, line=": {torque!n} torques, {misalignment!n} misalignments"):
    """Largest stresses of a pair over the mesh cycle, by torque and misalignment."""

    torque: Floats
    misalignment: Floats
    """(k,), (m,) N m on gear 1, rad."""
    hertz: Floats
    pitch_hertz: Floats
    """(k, m) largest Hertzian stress inside the path and near the pitch point, Pa."""
    outside: Floats
    """(k, m) largest share of the load outside the path of contact."""
    face_load: Floats
    """(k, m) highest over mean line load along the face."""
    root: Floats
    compression: Floats
    """(k, m, 2) largest principal stress at the roots of gear 1 and 2, and the least one, Pa."""

    def at(self, values: Floats, power: float, torque: Floats, misalignment: Floats) -> Floats:
        """One of the stresses at torques (N m) and misalignments (rad), broadcast against each other.

        Parameters
        ----------
        values : (k, m, ...) of these fields
        power
            With which the stress grows with torque at constant load sharing: 1/2 of Hertz, 1 of bending. What is left
            is linear between the torques and misalignments of the table, and constant beyond them.
        """
        torque, misalignment = np.broadcast_arrays(np.abs(torque), misalignment)
        scaled = values / (self.torque**power).reshape(-1, *(1,) * (values.ndim - 1))
        low, up = _place(self.torque, torque)
        left, right = _place(self.misalignment, misalignment)
        last_torque = len(self.torque) - 1
        last_tilt = len(self.misalignment) - 1
        extra = (...,) + (None,) * (values.ndim - 2)
        up = up[extra]
        right = right[extra]
        next_low = np.minimum(low + 1, last_torque)
        next_left = np.minimum(left + 1, last_tilt)
        lower = (1.0 - right) * scaled[low, left] + right * scaled[low, next_left]
        upper = (1.0 - right) * scaled[next_low, left] + right * scaled[next_low, next_left]
        return np.asarray(((1.0 - up) * lower + up * upper) * (torque**power)[extra])


def _place(grid: Floats, values: Floats) -> tuple[np.ndarray, Floats]:
    """Interval of a rising grid and the place in it, from 0 to 1; of a single value the first and 0."""
    if len(grid) == 1:
        return np.zeros(values.shape, dtype=np.int64), np.zeros(values.shape)
    at = np.clip(values, grid[0], grid[-1])
    first = np.clip(np.searchsorted(grid, at, side="right") - 1, 0, len(grid) - 2)
    return first, (at - grid[first]) / (grid[first + 1] - grid[first])


def mesh_cycle_stress(pair: GearPair, states: xr.Dataset, gauges: tuple[RootGauges, RootGauges]) -> MeshCycleStress:
    """Take the stresses of a pair from the states of its table.

    Parameters
    ----------
    states : of a `fe_ste.transmission_error.table.MeshTable`; of several centre distances that of the pair counts
    gauges : gear 1 with its flank +1, gear 2 with that which meets it: +1, or -1 of an internal gear
    """
    distance = int(np.abs(states["centre_distance"].to_numpy() - pair.centre_distance).argmin())
    chosen = states.isel(centre_distance=distance)
    loads = np.nan_to_num(chosen["line_load"].transpose("pmc", "torque", "misalignment", "tooth", ...).to_numpy())
    pmc, tooth, axial = (chosen[name].to_numpy() for name in ("pmc", "tooth", "axial_position"))
    pinion = pair.pinion
    # The path of contact as a length on the transverse line of action from gear 1's base point.
    twist = math.tan(pinion.base_helix_angle)
    path = pair.path_pitch_point + pair.transverse_base_pitch * (pmc[:, None, None] + tooth[:, None]) + twist * axial
    hertz = hertz_stress(pair, loads, path[:, None, None])
    inside, near = _zones(pair, path)
    force = loads.sum(axis=(3, 4))
    beyond = (path < pair.path_start) | (path > pair.path_end)
    face = loads.sum(axis=3).mean(axis=0)
    root, compression = _root_extremes(pair, gauges, loads, path, tooth, axial)
    return MeshCycleStress(
        torque=chosen["torque"].to_numpy(),
        misalignment=chosen["misalignment"].to_numpy(),
        hertz=np.where(inside[:, None, None], hertz, 0.0).max(axis=(0, 3, 4)),
        pitch_hertz=np.where(near[:, None, None], hertz, 0.0).max(axis=(0, 3, 4)),
        outside=((loads * beyond[:, None, None]).sum(axis=(3, 4)) / force).max(axis=0),
        face_load=face.max(axis=-1) / face.mean(axis=-1),
        root=root,
        compression=compression,
    )


def hertz_stress(pair: GearPair, line_load: Floats, path: Floats) -> Floats:
    """Hertzian stress of line loads, Pa.

    Parameters
    ----------
    line_load : normal load per length of the contact line, N/m
    path : place on the transverse line of action from gear 1's base point, m; broadcast against the loads

    Notes
    -----
    ``sqrt(w E* / (pi R))``, 1/E* the sum of (1 - nu^2)/E, 1/R the sum of the normal curvatures (Johnson, Contact
    Mechanics, equation 4.45).
    """
    gears = (pair.pinion, pair.gear)
    give = sum((1.0 - gear.material.poissons_ratio**2) / gear.material.youngs_modulus for gear in gears)
    other = _path_of_gear(pair, path)
    cosine = math.cos(pair.pinion.base_helix_angle)
    sign = -1.0 if pair.gear.internal else 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        curvature = cosine * (1.0 / path + sign / other)
        stress = np.sqrt(line_load * curvature / (math.pi * give))
    return np.where((path > 0.0) & (other > 0.0) & (line_load > 0.0), stress, 0.0)


def _path_of_gear(pair: GearPair, path: Floats) -> Floats:
    """Length from gear 2's base point, the radius of curvature of its flank in the transverse section, m."""
    slope = math.tan(pair.working_pressure_angle)
    if pair.gear.internal:
        return np.asarray(path + (pair.gear.base_radius - pair.pinion.base_radius) * slope)
    return np.asarray((pair.gear.base_radius + pair.pinion.base_radius) * slope - path)


def _zones(pair: GearPair, path: Floats) -> tuple[Booleans, Booleans]:
    """Tell which places lie inside the path but for its margins, and which near the pitch point."""
    length = pair.path_end - pair.path_start
    margin = PATH_MARGIN * length
    reach = PITCH_ZONE * length
    inside = (path > pair.path_start + margin) & (path < pair.path_end - margin)
    return inside, np.abs(path - pair.path_pitch_point) < reach


def _root_extremes(
    pair: GearPair, gauges: tuple[RootGauges, RootGauges], loads: Floats, path: Floats, tooth: Floats, axial: Floats
) -> tuple[Floats, Floats]:
    """Largest and least principal stress at the roots of both gears, (k, m, 2) each."""
    width = pair.face_width / len(axial)
    length = width / math.cos(pair.pinion.base_helix_angle)
    rolls = (path / pair.pinion.base_radius, _path_of_gear(pair, path) / pair.gear.base_radius)
    senses = (1, 1 if pair.gear.internal else -1)
    high, low = np.zeros((2, *loads.shape[1:3], 2))
    for position, k, m in np.ndindex(*loads.shape[:3]):
        state = loads[position, k, m]
        acting = np.flatnonzero(state.max(axis=1) > 0.0)
        for member, (own, roll, sense) in enumerate(zip(gauges, rolls, senses, strict=True)):
            forces = {
                int(sense * tooth[number]): own.node_loads(
                    _clear_of_fillet(own, roll[position, number]), axial, state[number] * length
                )
                for number in acting
            }
            if forces:
                largest, least = own.principal(forces)
                high[k, m, member] = max(high[k, m, member], largest.max())
                low[k, m, member] = min(low[k, m, member], least.min())
    return high, low


def _clear_of_fillet(gauges: RootGauges, roll: Floats) -> Floats:
    """Roll angles no nearer to the end of the flank at the fillet than `CLEAR_OF_FILLET`.

    Gauges beside a load read what it presses in, three times what it bends where a mate's tip edge digs in there. As
    far as the load is moved its lever grows: a little too much bending under loads that bend least.
    """
    gear = gauges.gear
    flank = gauges.roll
    step = (
        2.0 * CLEAR_OF_FILLET * gear.normal_module / gear.base_radius
    )  # the arc of an involute: base radius roll^2 / 2
    if gear.internal:
        return np.minimum(roll, math.sqrt(max(flank[-1] ** 2 - step, flank[0] ** 2)))
    return np.maximum(roll, math.sqrt(min(flank[0] ** 2 + step, flank[-1] ** 2)))
