"""What bearings and meshes leave free: a body without stiffness in some direction has no static state.

Small motions of rigid bodies about the reference state. Every support holds the directions in which its stiffness
acts, every mesh its line of action, every coupling a difference of spins; how stiff they are does not matter here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body
from exugear.gearbox.variant import Variant
from exugear.system.bearings.support_laws import linear_law
from exugear.system.bearings.supports import elastic_names, mounts_at_work
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.tooth_mesh.placement import line_of_action_row, loaded_flanks
from fe_ste.tools.arrays import Floats

TILT_LENGTH = 0.1
"""Length (m) that turns a tilt into a displacement, so that both are compared."""
HOLDING_SHARE = 1e-10
"""Least stiffness of a support in a direction over its largest that counts as holding."""
FREE_STRETCH = 1e-8
"""Largest stretch of all springs, per unit of motion, that counts as none."""
ROLLING_TOLERANCE = 1e-3
"""Share of a free motion beside rolling up to which it counts as rolling."""
_SCALE = np.array([1.0, 1.0, 1.0, 1.0 / TILT_LENGTH, 1.0 / TILT_LENGTH, 1.0 / TILT_LENGTH])
"""Rows are over displacements and over rotations times `TILT_LENGTH`."""
DIRECTIONS = ("move along x", "move along y", "move along z", "tilt about x", "tilt about y", "turn about z")


def free_motion(gearbox: Gearbox, variant: str) -> str:
    """Say which body of a variant on bearings can move without resistance, and how; empty if none can.

    Rolling, in which meshes and couplings do not deflect, is what a gearbox is for and does not count.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> free_motion(gearbox, "bushing")
    ''
    >>> pair = {"type": "cylindrical_roller", "contact_angle_deg": 0.0}
    >>> floating = {f"bearings.lss_bc.catalogue.{key}": value for key, value in pair.items()}
    >>> free_motion(gearbox.varied({**floating, "bearings.lss_a.stiffness": {}}), "bushing")
    'body lss can move along z without resistance; add or stiffen a bearing'
    """
    elastic = elastic_names(gearbox) if Variant.of(variant).is_elastic else ()
    moving = [body for body in gearbox.bodies() if not body.fixed or body.name in elastic]
    starts = {body.name: 6 * number for number, body in enumerate(moving)}
    rows = np.array([row for row in _held_directions(gearbox, Variant.of(variant), starts) if row.any()])
    if not rows.size:
        return "no bearing holds anything"
    # Each row of one length: how stiff a support is does not matter, only that it holds.
    _, singular, basis = np.linalg.svd(rows / np.linalg.norm(rows, axis=1, keepdims=True))
    free = basis[int(np.sum(singular > FREE_STRETCH * singular[0])) :]
    rolling = _rolling_motions(gearbox, moving, starts)
    beyond = free - free @ rolling.T @ rolling
    amount = np.linalg.norm(beyond, axis=1)
    if not amount.size or amount.max() < ROLLING_TOLERANCE:
        return ""
    body, direction = divmod(int(np.argmax(np.abs(beyond[np.argmax(amount)]))), BODY_SIZE)
    return f"body {moving[body].name} can {DIRECTIONS[direction]} without resistance; add or stiffen a bearing"


def _held_directions(gearbox: Gearbox, variant: Variant, starts: Mapping[str, int]) -> Iterator[Floats]:
    """Rows over all coordinates, rotations times `TILT_LENGTH`, of what supports, meshes and couplings hold."""
    bodies = {body.name: body for body in gearbox.bodies()}
    size = 6 * len(starts)
    for support in (*gearbox.bearings, *(mounts_at_work(gearbox) if variant.is_elastic else ())):
        motion = np.zeros((6, size))
        for name, sense in ((support.body, 1.0), (support.on, -1.0)):
            if name in starts:
                motion[:, starts[name] : starts[name] + 6] += sense * _motion_at(
                    bodies[name], np.array(support.position)
                )
        stiffness = linear_law(support, 0.0).stiffness
        values, vectors = np.linalg.eigh(_SCALE * stiffness * _SCALE[:, None])
        yield from (vectors[:, values > HOLDING_SHARE * values[-1]].T / _SCALE) @ motion * np.tile(_SCALE, len(starts))
    flanks = loaded_flanks(gearbox)
    for mesh in gearbox.meshes:
        nodes = (_node(bodies[mesh.pinion]), _node(bodies[mesh.gear]))
        row = np.zeros(size)
        ends = np.split(line_of_action_row(mesh, flanks[mesh.name], nodes), 2)
        for name, part in zip((mesh.pinion, mesh.gear), ends, strict=True):
            if name in starts:
                row[starts[name] : starts[name] + 6] += part * _SCALE
        yield row
    for coupling in gearbox.couplings:
        row = np.zeros(size)
        row[starts[coupling.first] + SPIN], row[starts[coupling.second] + SPIN] = 1.0, -1.0
        yield row
    for body in bodies.values():
        if body.spin_only:  # it has no other coordinate
            yield from np.eye(size)[starts[body.name] : starts[body.name] + SPIN]


def _node(body: Body) -> Floats:
    return np.array([*body.axis, body.centre_of_mass_z])


def _motion_at(body: Body, position: Floats) -> Floats:
    """Motion (6, 6) at a position for unit coordinates of a body."""
    x, y, z = position - _node(body)
    motion = np.eye(6)
    motion[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return motion


def _rolling_motions(gearbox: Gearbox, moving: list[Body], starts: Mapping[str, int]) -> Floats:
    """Orthonormal rolling motions (n, size): spins, and the orbit of planets with their carrier."""
    motions = np.zeros((gearbox.train.degrees_of_freedom, 6 * len(moving)))
    spins = dict(zip(gearbox.spinning, gearbox.train.kinematic_modes, strict=True))
    for body in moving:
        begin = starts[body.name]
        motions[:, begin + SPIN] = TILT_LENGTH * spins.get(body.name, 0.0)
        if body.carrier is not None:
            x, y = np.array(body.axis) - gearbox.body(body.carrier).axis
            motions[:, begin : begin + 2] = np.outer(spins[body.carrier], [-y, x])
    return np.asarray(np.linalg.qr(motions.T)[0].T)
