"""Root stress of a gear under loads on its flanks: stress at the gauges in the closed ring, tooth by tooth.

Open sectors overestimate it: with free cut faces a tooth's root carries what the ring would share. With three, five,
seven and nine teeth the result for a high-speed pinion is 473, 218, 200 and 196 MPa, for the ring 188 MPa.

A gauge lies on each edge of the section's surface between flank and root land, on both sides of the tooth, at each
layer of nodes. It reads the strains of the surface there along the section, along the face, and the shear between them.
Edges at the corner where the blocks of tooth and rim meet are omitted: the mesh is most distorted there.

Line loads act along the contact lines. Hertzian stress follows from the line load and the curvature there, inside the
path of contact: tip-edge contact on unmodified flanks has no Hertzian stress, and the load carried outside the path is
reported as a share of the load. Roots feel line loads as forces, whatever their width.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse

from fe_ste.elasticity.condensation import Chain, flank_functionals, ring_faces, sector_halves, turn_signs
from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, sector_mesh
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats, Integers, SparseMatrix
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.threads import one_dense_thread
from fe_ste.transmission_error.contact_stress import PATH_MARGIN

if TYPE_CHECKING:
    import xarray as xr

COMPONENTS = 3
"""Strains of a gauge: along the section, along the face, shear."""


@dataclass(frozen=True)
class GaugePlaces(ReprMixin, line=": {edges!n} edges"):
    """Where gauges lie."""

    edges: Integers
    """(g, 2) section nodes of each edge."""
    side: Integers
    """(g,) +1 on the counter-clockwise side of the tooth, -1 on the clockwise one."""
    depth: Floats
    """(g,) distance along the surface from the end of the flank to the middle of the edge, m."""
    radius: Floats
    """(g,) of the middle of the edge, m."""


def gauge_places(mesh: SectorMesh) -> GaugePlaces:
    """Find the edges of the root's surface, from the end of each flank to the cut face."""
    section = mesh.section
    # The outline of the section consists of the edges that belong to one quadrilateral alone.
    pairs = np.sort(np.stack([section.quads, np.roll(section.quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    unique, counts = np.unique(pairs, axis=0, return_counts=True)
    loose: dict[int, list[int]] = {}
    for one, other in unique[counts == 1].tolist():
        loose.setdefault(one, []).append(other)
        loose.setdefault(other, []).append(one)
    corners = np.bincount(section.quads.ravel(), minlength=len(section.points))
    edges = []
    sides = []
    depths = []
    for side, flank in ((1, section.plus_flank), (-1, section.minus_flank)):
        cut = section.plus_cut if side > 0 else section.minus_cut
        # Nodes of the outline from the end of the flank, away from it, to the first node of the cut face.
        chain = [int(flank[0 if not mesh.gear.internal else -1])]
        before = set(flank.tolist())
        while chain[-1] not in cut:
            before.add(chain[-1])
            chain.append(next(node for node in loose[chain[-1]] if node not in before))
        points = section.points[chain]
        along = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
        for place, (first, second) in enumerate(itertools.pairwise(chain)):
            if max(corners[first], corners[second]) <= 2:
                edges.append((first, second))
                sides.append(side)
                depths.append(0.5 * (along[place] + along[place + 1]))
    found = np.array(edges)
    middles = section.points[found].mean(axis=1)
    return GaugePlaces(found, np.array(sides), np.array(depths), np.hypot(*middles.T))


def gauge_columns(mesh: SectorMesh, places: GaugePlaces) -> SparseMatrix:
    """Columns (3 nodes, g 3 layers) that read strains; those of one gauge and component follow each other by layer."""
    layers = len(mesh.axial_positions)
    count = len(mesh.section.points)
    points = mesh.points.reshape(layers, count, 3)
    before = np.maximum(np.arange(layers) - 1, 0)
    after = np.minimum(np.arange(layers) + 1, layers - 1)
    span = (mesh.axial_positions[after] - mesh.axial_positions[before])[:, None]
    matrix = scipy.sparse.lil_matrix((3 * layers * count, COMPONENTS * len(places.edges) * layers))
    for gauge, (first, second) in enumerate(places.edges.tolist()):
        step = points[:, second] - points[:, first]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        along = step / length
        middle = 0.5 * (points[:, first] + points[:, second])
        lead = (middle[after] - middle[before]) / span
        lean = np.sum(lead * along, axis=1, keepdims=True)
        across = lead - lean * along
        size = np.linalg.norm(across, axis=1, keepdims=True)
        across = across / size
        # Derivative of the displacement across: along the generator, less its part along the section.
        for component in range(COMPONENTS):
            by_along = {0: along, 1: -lean / size * across, 2: across - lean / size * along}[component]
            by_across = {0: np.zeros_like(along), 1: across / size, 2: along / size}[component]
            for layer in range(layers):
                column = (COMPONENTS * gauge + component) * layers + layer
                parts = {
                    (layer, second): by_along[layer] / length[layer],
                    (layer, first): -by_along[layer] / length[layer],
                }
                for node in (first, second):
                    for end, sign in ((after[layer], 1.0), (before[layer], -1.0)):
                        part = 0.5 * sign * by_across[layer] / span[layer]
                        parts[end, node] = parts.get((end, node), 0.0) + part
                for (end, node), part in parts.items():
                    row = 3 * (int(end) * count + node)
                    matrix[row : row + 3, column] = np.asarray(part)[:, None]
    return matrix.tocsr()


REACH = 3
"""Teeth on either side of the loaded one whose roots are read: beyond, less than a hundredth is felt."""


@dataclass(frozen=True)
class RootGauges(ReprMixin, line=" of {gear.name!r}: {places.edges!n} edges, {axial!n} layers"):
    """Stress at the root of the teeth of a gear under loads on the flank of one tooth."""

    gear: Gear
    side: int
    """Loaded flank: +1 counter-clockwise, -1 clockwise."""
    places: GaugePlaces
    roll: Floats
    axial: Floats
    """(f,), (l,) flank grid of the loads: roll angles (rad) and axial positions (m)."""
    stress: dict[int, Floats]
    """Tooth read less tooth loaded -> ndarray (g, 3, l, f l): stress along the section, along the face and shear
    (plane stress on the surface) per unit load into the flank at each node, Pa/N."""

    def node_loads(self, roll: Floats, axial: Floats, force: Floats) -> Floats:
        """Share forces (N) at places of a flank among its nodes, bilinear, (f l,); places off the flank at its edge."""
        first, along = _place(self.roll, roll)
        layer, across = _place(self.axial, axial)
        loads = np.zeros((len(self.roll), len(self.axial)))
        for step, share in ((0, 1.0 - along), (1, along)):
            for up, width in ((0, 1.0 - across), (1, across)):
                np.add.at(loads, (first + step, layer + up), force * share * width)
        return loads.ravel()

    def principal(self, loads: dict[int, Floats]) -> tuple[Floats, Floats]:
        """Largest and smallest principal stress, (teeth, g, l), Pa, of all teeth that the loaded ones affect.

        Parameters
        ----------
        loads : number of a tooth, counter-clockwise -> its node loads (f l,), N
        """
        reach = max(self.stress)
        teeth = range(min(loads) - reach, max(loads) + reach + 1)
        layers = len(self.axial)
        total = np.zeros((len(teeth), len(self.places.edges), COMPONENTS, layers))
        for loaded, forces in loads.items():
            for read, block in self.stress.items():
                total[loaded + read - teeth[0]] += block @ forces
        mean = 0.5 * (total[:, :, 0] + total[:, :, 1])
        radius = np.hypot(0.5 * (total[:, :, 0] - total[:, :, 1]), total[:, :, 2])
        return mean + radius, mean - radius


def root_gauges(gear: Gear, side: int, settings: MeshSettings | None = None) -> RootGauges:
    """Compute the root stress of a gear under loads on one flank by finite elements of the closed ring.

    Parameters
    ----------
    gear : held at ``gear.held_diameter``
    side : loaded flank: +1 counter-clockwise, -1 clockwise
    settings : the fillet's elements rule the error: see the tests
    """
    mesh = sector_mesh(gear, settings)
    places = gauge_places(mesh)
    flank = -flank_functionals(mesh, side)
    strains = gauge_columns(mesh, places)
    count = flank.shape[1]
    with one_dense_thread():
        even, odd = sector_halves(mesh, [flank, strains], True)
        signs = turn_signs(mesh)
        load = Chain(even.face_reading[:count].T, odd.face_reading[:count].T)
        reach = min(REACH, (gear.teeth - 2) // 2)
        faces = ring_faces(Chain(even.stiffness, odd.stiffness), load, signs, gear.teeth, reach)
    fixed = 0.5 * (even.fixed_reading + odd.fixed_reading)[count:, :count]
    gauges = {}
    for read in range(-reach, reach + 1):
        minus = signs[:, None] * faces[read]
        plus = faces[read + 1]
        strain = even.face_reading[count:] @ (0.5 * (plus + minus)) + odd.face_reading[count:] @ (0.5 * (plus - minus))
        strain = strain + fixed if read == 0 else strain
        gauges[read] = _stress(gear, strain.reshape(len(places.edges), COMPONENTS, -1, count))
    return RootGauges(gear, side, places, mesh.section.flank_roll, mesh.axial_positions, gauges)


def _stress(gear: Gear, strain: Floats) -> Floats:
    """Plane stress of surface strains; the shear strain is the whole change of the angle."""
    modulus = gear.material.youngs_modulus
    ratio = gear.material.poissons_ratio
    stiff = modulus / (1.0 - ratio**2)
    return np.stack(
        [
            stiff * (strain[:, 0] + ratio * strain[:, 1]),
            stiff * (strain[:, 1] + ratio * strain[:, 0]),
            0.5 * modulus / (1.0 + ratio) * strain[:, 2],
        ],
        axis=1,
    )


CLEAR_OF_FILLET = 0.5
"""Modules along the flank from its end above the fillet within which a load acts no nearer to the gauges."""
PITCH_ZONE = 0.05
"""Part of the path on either side of the pitch point whose stress is reported in addition to the largest."""


@dataclass(frozen=True)
class MeshCycleStress(ReprMixin, line=": {torque!n} torques, {misalignment!n} misalignments"):
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
    """(k, m, 2) largest principal stress at the roots of gear 1 and 2, and the smallest one, Pa."""

    def at(self, values: Floats, power: float, torque: Floats, misalignment: Floats) -> Floats:
        """One of the stresses at torques (N m) and misalignments (rad), broadcast against each other.

        Parameters
        ----------
        values : (k, m, ...) of these fields
        power
            Exponent of torque in the stress at constant load sharing: 1/2 for Hertz, 1 for bending. The remaining
            factor is linear between the torques and misalignments of the table, and constant outside them.
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
    length = pair.path_end - pair.path_start
    margin = PATH_MARGIN * length
    reach = PITCH_ZONE * length
    inside = (path > pair.path_start + margin) & (path < pair.path_end - margin)
    inside, near = inside, np.abs(path - pair.path_pitch_point) < reach
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


def _root_extremes(
    pair: GearPair, gauges: tuple[RootGauges, RootGauges], loads: Floats, path: Floats, tooth: Floats, axial: Floats
) -> tuple[Floats, Floats]:
    """Largest and smallest principal stress at the roots of both gears, (k, m, 2) each."""
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
    """Return roll angles limited to a distance `CLEAR_OF_FILLET` from the end of the flank at the fillet.

    Gauges next to a load also measure its local indentation, three times the bending under tip-edge contact there. The
    shift of the load lengthens its lever arm: slightly too much bending for the loads with the smallest bending moment.
    """
    gear = gauges.gear
    flank = gauges.roll
    step = (
        2.0 * CLEAR_OF_FILLET * gear.normal_module / gear.base_radius
    )  # the arc of an involute: base radius roll^2 / 2
    if gear.internal:
        return np.minimum(roll, math.sqrt(max(flank[-1] ** 2 - step, flank[0] ** 2)))
    return np.maximum(roll, math.sqrt(min(flank[0] ** 2 + step, flank[-1] ** 2)))
