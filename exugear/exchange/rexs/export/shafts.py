"""Results on shafts: speeds under each load case, and how far they move under the static load."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from exugear.exchange.rexs.export.names import Results
from exugear.exchange.rexs.export.teeth import Target, instance_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import RPM, Body, seat_key
from exugear.system.assembly import Assembly
from exugear.system.statics import static_state
from fe_ste.tools.arrays import Floats

SPEED = "rotational_speed"


def put_speeds(results: Results, gearbox: Gearbox, target: Target) -> None:
    """Put the speeds of shafts and gears at which the train rolls, where the file leaves them out.

    Those of planets are left out: REXS does not say whether they count against the carrier.
    """
    for case in target.model.load_cases or (None,):
        name = "nominal" if case is None else f"load_case_{case.number}"
        known = gearbox.load_cases.get(name)
        if known is None or not known.start_speed:
            continue
        speeds = gearbox.train.rolling({gearbox.case.overall.input: known.start_speed, **known.start_speeds})
        for body, members in target.origins.bodies.items():
            for number in members[0] if body in speeds else ():
                part = target.model.components[number]
                stated = part.attributes if case is None else {**part.attributes, **case.changes.get(number, {})}
                if SPEED not in stated:
                    speed = _sense(target, number) * speeds[body] / RPM
                    results.put(number, SPEED, "1 / min", speed, None if case is None else case.number)


def put_displacements(results: Results, assembly: Assembly, target: Target) -> None:
    """Put how far shafts move under the static load, in their own axes, where gears and bearings sit on them."""
    q = static_state(assembly).q
    for body in assembly.bodies:
        members = target.origins.bodies.get(body.family, ())
        instance = instance_of(body.name, body.family)
        shafts = [n for n in (members[instance] if instance < len(members) else ()) if _is_shaft(target, n)]
        nodes = sorted(_nodes(assembly, q, body), key=lambda node: node[0])
        if len(shafts) != 1 or not nodes or body.fixed:
            continue
        number = shafts[0]
        nodes = nodes[:: _sense(target, number)]
        heights, moved = zip(*nodes, strict=True)
        along = _sense(target, number) * (np.array(heights) - target.origins.places[number])
        own = np.array(moved) @ target.origins.axes[number].T
        results.put(number, "node_positions", "mm", tuple((1e3 * along).tolist()), target.load_case)
        for axis, column in zip("uvw", own.T, strict=True):
            results.put(number, f"displacement_{axis}", "mum", tuple((1e6 * column).tolist()), target.load_case)


def _is_shaft(target: Target, number: int) -> bool:
    return target.model.components[number].type == "shaft" and number in target.origins.axes


def _sense(target: Target, number: int) -> int:
    """Sense of a component's u axis: 1 along +z, -1 against it."""
    axes = target.origins.axes.get(number)
    if axes is None or axes[0, 2] > 0.0:
        return 1
    return -1


def _nodes(assembly: Assembly, q: Floats, body: Body) -> Iterator[tuple[float, Floats]]:
    """Places (m) along a body with a place in space, and displacements (3,) in m of its axis there."""
    seats = dict(body.wheels)
    for support in assembly.supports:
        if body.name in (support.body, support.on):
            seats[support.name] = support.position[2]
    coordinates = list(assembly.coordinates[body.name])
    if coordinates[0] < 0:
        return
    for item, height in seats.items():
        own = assembly.coordinates.get(seat_key(body.name, item))
        if own is not None:
            yield height, q[list(own[:3])]
        elif body.name not in assembly.elastic_bodies:
            x, y, z, about_x, about_y = q[coordinates[:5]]
            arm = height - body.centre_of_mass_z
            yield height, np.array([x + about_y * arm, y - about_x * arm, z])
