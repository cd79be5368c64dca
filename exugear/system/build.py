"""A gearbox and choices to equations of motion: coordinates, arrays of all laws."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Bearing, Body, node_position, seat_key
from exugear.gearbox.variant import Variant, VariantError
from exugear.system.bearings.stiffness import elastic_names, linear_law, mounts_at_work, unsupported, with_laws
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.kernels.connectors import ConnectorArrays, no_connectors
from exugear.system.kernels.coordinates import InertiaArrays, SpringArrays
from exugear.system.kernels.elastic import ElasticArrays, no_elastic
from exugear.system.kernels.rolling import no_rolling
from exugear.system.kernels.turning import TravellingArrays, no_travelling
from exugear.system.modal_damping import with_damping_times, with_modal_damping
from exugear.system.operating_points import linearise_at_static_load
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.contact_state import MeshContactState
from exugear.system.tooth_mesh.element import Angles, MeshData, mesh_elements
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.laws.stiffness import pack
from fe_ste.tools.arrays import Floats


def assemble(
    gearbox: Gearbox,
    choice: Choice,
    stiffness: Mapping[str, MeshData],
    bodies: Mapping[str, ElasticBody] | None = None,
    *,
    flanks: Mapping[str, int] | None = None,
    angles: Angles = "reference",
    contact: Mapping[str, MeshContactState] | None = None,
    like: Assembly | None = None,
) -> Assembly:
    """Assemble the equations of motion of a gearbox.

    Parameters
    ----------
    choice : variant, mesh model and inertia set
    stiffness : mapping of pair name to (n,) array, or to the table's surface
        Mesh stiffness over the cycle, N/m: see `exugear.system.tooth_mesh.element.mesh_elements`.
    bodies : by body name
        Reduced flexible bodies, required by the variant `flexible`; `reduced_bodies` of
        `exugear.system.bodies.of_gearbox` gives them.
    flanks, angles, contact
        As in `exugear.system.tooth_mesh.element.mesh_elements`.
    like
        Assembly of a similar gearbox: if it has the same coordinates, the search for the static state begins at that
        of it.

    Raises
    ------
    VariantError
        Unknown variant, or supports or flexible bodies missing for it.
    BalanceError
        The static load, which determines the stiffness of catalogue bearings, has no equilibrium.
    MeshError
        Unknown mesh model, or no stiffness for an active pair.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> assemble(gearbox, Choice("rigid"), stiffness).size
    8
    """
    variant = choice.variant
    law = choice.mesh_model
    inertias = choice.inertia_set(gearbox)
    elastic = elastic_names(gearbox) if variant.is_elastic else ()
    moving = [body for body in gearbox.bodies(inertias) if not body.fixed or body.name in elastic]
    lacking = unsupported(gearbox, variant)
    if lacking:
        raise VariantError(f"variant {variant}: {lacking}")
    only_rolls = law in LAWS and not LAWS[law].has_force
    if only_rolls and not variant.spins_only:
        raise VariantError(f"mesh model {law}: a kinematic constraint, which requires the variant rigid, not {variant}")
    bodies = bodies or {}
    missing = [name for name in elastic if name not in bodies]
    if missing:
        raise VariantError(
            f"variant flexible: no reduced body for {', '.join(missing)}; pass the result of "
            "exugear.system.bodies.of_gearbox.reduced_bodies"
        )
    flexible = {name: bodies[name] for name in elastic}
    if any(body.reduced.frame == "carrier" for body in flexible.values()):
        gearbox = with_damping_times(gearbox)
    rigid = [body for body in moving if body.name not in flexible]
    six = [body for body in rigid if not (variant.spins_only or body.spin_only)]
    alone = [body for body in rigid if body not in six]
    # Indices of the six coordinates of each body; -1 for all but the spin of a body that only turns.
    coordinates = {body.name: tuple(range(6 * n, 6 * n + 6)) for n, body in enumerate(six)}
    coordinates |= {body.name: (-1, -1, -1, -1, -1, 6 * len(six) + n) for n, body in enumerate(alone)}
    nodes = {body.name: node_position(body) for body in moving}
    size = 6 * len(six) + len(alone)
    for name, shaft in flexible.items():
        size = _take_seats(name, shaft, size, coordinates, nodes)
    travelling = _travelling(gearbox, flexible, size, coordinates, nodes)
    supports = _supports(gearbox, flexible) if variant.has_bearings else ()
    displaced = gearbox.pin_offsets if not variant.has_bearings else {}  # bearings carry the planets along
    settings = (inertias, flanks, angles, displaced, nodes, contact)
    elements = () if only_rolls else mesh_elements(gearbox, stiffness, law_of(law), *settings)
    pairs = [
        [coordinates[_attached(coordinates, body, c.seat) or body][5] for body in (c.first, c.second)]
        for c in gearbox.couplings
    ]
    assembly = Assembly(
        gearbox=gearbox,
        choice=replace(choice, inertias=inertias),
        bodies=(*six, *alone, *(body for body in moving if body.name in flexible)),
        coordinates=coordinates,
        size=size,
        elements=elements,
        meshes=pack(elements, coordinates),
        travelling=travelling,
        supports=supports,
        connectors=_connectors(gearbox, supports, nodes, coordinates),
        spring_names=tuple(coupling.name for coupling in gearbox.couplings),
        springs=SpringArrays(
            coordinates=np.array(pairs, dtype=np.int64).reshape(-1, 2),
            stiffness=np.array([c.stiffness for c in gearbox.couplings]),
            damping=np.array([c.damping for c in gearbox.couplings]),
        ),
        inertia=_inertia(variant, six, alone),
        elastic_bodies=flexible,
        elastic=elastic_arrays(flexible, size, gearbox.case.damping.body_time_s),
        motions=_rolling_motions(gearbox, coordinates) if only_rolls else np.eye(size),
        rows_stiffness=np.zeros((len(supports), 6, 6)),
    )
    return with_modal_damping(linearise_at_static_load(assembly, like))


def _take_seats(
    name: str,
    body: ElasticBody,
    first: int,
    coordinates: dict[str, tuple[int, ...]],
    nodes: dict[str, Floats],
) -> int:
    """Enter the seats of an elastic body whose coordinates begin at `first`; return where the next one begins."""
    for n, seat in enumerate(body.reduced.seats):
        key = seat_key(name, seat.name)
        coordinates[key] = tuple(range(first + 6 * n, first + 6 * n + 6))
        nodes[key] = np.array(seat.position)
    for item, seat_name in body.shared_seats.items():
        key = seat_key(name, seat_name)
        coordinates[seat_key(name, item)], nodes[seat_key(name, item)] = coordinates[key], nodes[key]
    coordinates[name] = coordinates[seat_key(name, body.main_seat)]
    nodes[name] = nodes[seat_key(name, body.main_seat)]
    return first + body.reduced.size


def _travelling(
    gearbox: Gearbox,
    flexible: Mapping[str, ElasticBody],
    size: int,
    coordinates: dict[str, tuple[int, ...]],
    nodes: dict[str, Floats],
) -> TravellingArrays:
    """Enter a travelling seat, with coordinates after all `size` others, for each mesh of a gear with sectors."""
    seats: list[tuple[int, float, list[int]]] = []
    bodies = {body.name: body for body in gearbox.bodies()}
    for mesh in gearbox.meshes:
        sectors = flexible[mesh.gear].sectors.get(mesh.pair.gear.name, ()) if mesh.gear in flexible else ()
        if not sectors:
            continue
        keys = [seat_key(mesh.gear, sector) for sector in sectors]
        first = size + 6 * len(seats)
        coordinates[seat_key(mesh.gear, mesh.name)] = tuple(range(first, first + 6))
        nodes[seat_key(mesh.gear, mesh.pair.gear.name)] = nodes[keys[0]]
        x, y = np.array(bodies[mesh.pinion].axis) - bodies[mesh.gear].axis
        seats.append((coordinates.get(mesh.frame, (-1,) * 6)[5], math.atan2(y, x), [coordinates[k][0] for k in keys]))
    if not seats:
        return no_travelling()
    count = np.array([len(sectors) for _, _, sectors in seats], dtype=np.int64)
    most = int(count.max())
    middles = 2.0 * np.pi * np.arange(most) / count[:, None]
    return TravellingArrays(
        first=size + 6 * np.arange(len(seats), dtype=np.int64),
        frame=np.array([frame if frame >= 0 else size + 6 * len(seats) for frame, _, _ in seats], dtype=np.int64),
        angle=np.array([angle for _, angle, _ in seats]),
        number=count,
        sectors=np.array([starts + [-1] * (most - len(starts)) for _, _, starts in seats], dtype=np.int64),
        axes=np.stack([np.cos(middles), np.sin(middles)], axis=2),
    )


def elastic_arrays(flexible: Mapping[str, ElasticBody], size: int, damping_time: float) -> ElasticArrays:
    """Arrays of elastic bodies whose coordinates are the last of `size`.

    Damping is stiffness times the damping time of the body, by default `damping_time` (s).
    Those in turning frames are left out (`exugear.system.kernels.turning`). Each body falls into blocks that
    neither its mass nor its stiffness couples. Coordinates that turn with the body come first in their block; a body on
    the ground has no spin speed, and no gyroscopic forces.
    """
    blocks: list[NDArray[np.int64]] = []
    turning = []
    partner = []
    parts: dict[str, list[Floats]] = {"stiffness": [], "mass": [], "inverse": [], "gyroscopic": []}
    spin = []
    momentum = []
    times = []
    begin = size - sum(body.reduced.size for body in flexible.values())
    for flexible_body in flexible.values():
        body = flexible_body.reduced
        if body.frame == "carrier":
            begin += body.size
            continue
        sorted_blocks = [block[np.argsort(-body.spin[block], kind="stable")] for block in body.blocks]
        carried = body.mass @ body.spin
        spinning = next((n for n, block in enumerate(sorted_blocks) if body.spin[block].any()), 0)
        inertia = float(body.spin @ carried) or 1.0
        for block in sorted_blocks:
            others = [n for n, other in enumerate(sorted_blocks) if body.gyroscopic[np.ix_(block, other)].any()]
            if len(others) > 1:
                raise VariantError(f"body {body.name}: gyroscopic forces couple one block to {len(others)} others")
            turning.append(len(blocks) + spinning)
            times.append(damping_time if flexible_body.damping_time is None else flexible_body.damping_time)
            partner.append(len(blocks) + others[0] if others else -1)
            parts["stiffness"].append(body.stiffness[np.ix_(block, block)])
            parts["mass"].append(body.mass[np.ix_(block, block)])
            parts["inverse"].append(np.asarray(np.linalg.inv(body.mass[np.ix_(block, block)]), dtype=np.float64))
            parts["gyroscopic"].append(
                body.gyroscopic[np.ix_(block, sorted_blocks[others[0]])] if others else np.zeros((0, 0))
            )
            spin.append(body.spin[block])
            momentum.append(carried[block] / inertia)
        blocks += [block + begin for block in sorted_blocks]
        begin += body.size
    if not blocks:
        return no_elastic()
    flat = {name: np.concatenate([matrix.T.ravel() for matrix in values]) for name, values in parts.items()}
    return ElasticArrays(
        first=np.cumsum([0, *map(len, blocks)]).astype(np.int64),
        coordinate=np.concatenate(blocks).astype(np.int64),
        spin=np.concatenate(spin),
        momentum=np.concatenate(momentum),
        turning=np.array(turning, dtype=np.int64),
        partner=np.array(partner, dtype=np.int64),
        square=np.cumsum([0, *(m.size for m in parts["mass"][:-1])]).astype(np.int64),
        stiffness=flat["stiffness"],
        mass=flat["mass"],
        inverse=flat["inverse"],
        across=np.cumsum([0, *(m.size for m in parts["gyroscopic"][:-1])]).astype(np.int64),
        gyroscopic=flat["gyroscopic"],
        damping_time=np.array(times),
    )


def _inertia(variant: Variant, six: list[Body], alone: list[Body]) -> InertiaArrays:
    orbiting = {
        carrier.name: sum(
            body.mass * math.dist(body.axis, carrier.axis) ** 2
            for body in alone
            if body.carrier == carrier.name and variant.spins_only
        )
        for carrier in alone
    }
    return InertiaArrays(
        body=np.arange(len(six), dtype=np.int64) * 6,
        mass=np.array([body.mass for body in six]),
        transverse=np.array([body.transverse for body in six]),
        axial=np.array([body.axial for body in six]),
        spin=np.arange(len(alone), dtype=np.int64) + 6 * len(six),
        spin_inertia=np.array([body.axial + orbiting[body.name] for body in alone]),
    )


def _rolling_motions(gearbox: Gearbox, coordinates: Mapping[str, tuple[int, ...]]) -> Floats:
    """Motions of the spins (size, n) in which no mesh closes; couplings may twist."""
    rows = gearbox.train.spin_rows[: len(gearbox.meshes)]
    order = [coordinates[name][5] for name in gearbox.spinning]
    free = scipy.linalg.null_space(rows / np.abs(rows).max(axis=1, keepdims=True))
    motions = np.zeros((len(order), free.shape[1]))
    motions[order] = free
    return motions


def _supports(gearbox: Gearbox, flexible: Mapping[str, ElasticBody]) -> tuple[Bearing, ...]:
    """Bearings and the mounts at work; the housing factor stands for seats that no elastic body has."""
    fixed = {body.name for body in gearbox.bodies() if body.fixed and body.name in flexible}
    bearings = [
        replace(bearing, factor=1.0) if fixed & {bearing.on, bearing.body} else bearing for bearing in gearbox.bearings
    ]
    return (*bearings, *mounts_at_work(gearbox, bool(flexible)))


def _connectors(
    gearbox: Gearbox,
    supports: tuple[Bearing, ...],
    nodes: Mapping[str, Floats],
    coordinates: Mapping[str, tuple[int, ...]],
) -> ConnectorArrays:
    if not supports:
        return no_connectors()
    starts = []
    local = []
    places = []
    for bearing in supports:
        keys = [_attached(coordinates, body, bearing.name) for body in (bearing.on, bearing.body)]
        at = [np.zeros(3) if key is None else nodes[key] for key in keys]
        starts.append([-1 if key is None else coordinates[key][0] for key in keys])
        local.append([np.array(bearing.position) - node for node in at])
        if bearing.body in gearbox.pin_offsets:
            local[-1][0] = local[-1][0] + [*gearbox.pin_offsets[bearing.body], 0.0]
        places.append(at)
    connectors = ConnectorArrays(
        bodies=np.array(starts, dtype=np.int64),
        local=np.array(local),
        node=np.array(places),
        stiffness=np.zeros((0, 6, 6)),
        damping=np.zeros((0, 6, 6)),
        point_strain=np.zeros((len(supports), 6)),
        point_load=np.zeros((len(supports), 6)),
        rolling=no_rolling(0),
    )
    return with_laws(connectors, [linear_law(bearing, gearbox.damping_times.bearing) for bearing in supports])


def _attached(coordinates: Mapping[str, tuple[int, ...]], body: str, item: str | None) -> str | None:
    """Key of what carries an item on a body: its seat, else the rigid body, None for the ground."""
    key = seat_key(body, item or "")
    if key in coordinates:
        return key
    if body in coordinates:
        return body
    return None
