"""Quick construction of all parts of a gearbox: errors of later steps are reported before these start.

`check_parts` builds the parts of tables, modes and runs without finite elements. `lacking` says why a variant cannot
be computed; one reason is a body that can move without resistance, which `free_motion` finds from small motions of
rigid bodies about the reference state. There every support constrains the directions in which its stiffness acts, every
mesh its line of action, every coupling a difference of spins; how stiff they are does not matter.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import torque_series
from exugear.gearbox.parts import Bearing, Body
from exugear.gearbox.reading import GearboxFileError, error_line, readable
from exugear.gearbox.variant import Variant
from exugear.system.bearings.rolling.catalogue import catalogue_rows
from exugear.system.bearings.rolling.friction import friction_series
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bearings.stiffness import elastic_names, linear_law, misplaced_factor, mounts_at_work, unsupported
from exugear.system.bodies.external_of_gearbox import external_warnings
from exugear.system.bodies.of_gearbox import check_elastic_body, check_shape, narrowed_seats
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN
from exugear.system.part_warnings import pair_warnings, part_warnings
from exugear.system.tooth_mesh.placement import MeshError, line_of_action_row, loaded_flanks, tooth_places
from fe_ste.tools.arrays import Floats

TILT_LENGTH = 0.1
"""Length (m) that turns a tilt into a displacement, so that both are compared."""
HOLDING_SHARE = 1e-10
"""Minimum stiffness of a support in a direction, over its largest, that constrains the direction."""
FREE_STRETCH = 1e-8
"""Largest stretch of all springs, per unit of motion, that counts as none."""
ROLLING_TOLERANCE = 1e-3
"""Share of a free motion other than kinematic rotation up to which it counts as rotation."""
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
    'body lss can move along z without resistance; add a bearing or increase its stiffness'
    """
    elastic = elastic_names(gearbox) if Variant.of(variant).is_elastic else ()
    moving = [body for body in gearbox.bodies() if not body.fixed or body.name in elastic]
    starts = {body.name: 6 * number for number, body in enumerate(moving)}
    rows = np.array([row for row in _held_directions(gearbox, Variant.of(variant), starts) if row.any()])
    if not rows.size:
        return "no bearing supports a body"
    # Each row of one length: how stiff a support is does not matter, only that it holds.
    # The triangle has the same singular values and right vectors as the rows, of which there are many more.
    triangle = np.asarray(np.linalg.qr(rows / np.linalg.norm(rows, axis=1, keepdims=True), mode="r"))
    rolling = _rolling_motions(gearbox, moving, starts)
    singular = np.linalg.svd(triangle, compute_uv=False)
    held = int(np.sum(singular > FREE_STRETCH * singular[0]))
    stretch = np.linalg.norm(triangle @ rolling.T, axis=0).max(initial=0.0)
    if held + len(rolling) == triangle.shape[1] and stretch <= FREE_STRETCH * singular[0]:
        return ""  # as many free motions as ways to roll, and these are free: there are no others
    free = np.linalg.svd(triangle)[2][held:]
    beyond = free - free @ rolling.T @ rolling
    amount = np.linalg.norm(beyond, axis=1)
    if not amount.size or amount.max() < ROLLING_TOLERANCE:
        return ""
    motion = np.abs(beyond[np.argmax(amount)])
    # A body that moves along helical teeth turns others: what nothing holds is the one that moves, not those that turn.
    other = np.where(np.arange(motion.size) % BODY_SIZE == SPIN, 0.0, motion)
    if other.max() > ROLLING_TOLERANCE:
        motion = other
    body, direction = divmod(int(np.argmax(motion)), BODY_SIZE)
    return (
        f"body {moving[body].name} can {DIRECTIONS[direction]} without resistance; add a bearing or increase its "
        "stiffness"
    )


def _held_directions(gearbox: Gearbox, variant: Variant, starts: Mapping[str, int]) -> Iterator[Floats]:
    """Rows over all coordinates, rotations times `TILT_LENGTH`, of what supports, meshes and couplings hold."""
    bodies = {body.name: body for body in gearbox.bodies()}
    size = 6 * len(starts)
    for support in (*gearbox.bearings, *mounts_at_work(gearbox, variant.is_elastic)):
        motion = np.zeros((6, size))
        for name, sense in ((support.body, 1.0), (support.on, -1.0)):
            if name in starts:
                # Motion at the support for unit coordinates of the body.
                x, y, z = np.array(support.position) - _node(bodies[name])
                moved = np.eye(6)
                moved[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
                motion[:, starts[name] : starts[name] + 6] += sense * moved
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


MOST_STATES = 200_000
"""Most states of one table: at 50 ms each, three hours."""
_FOLLOWING = range(5)
"""As many values as an axis usually has that follows from the static state."""


def check_parts(gearbox: Gearbox) -> None:
    """Build what tables, modes and runs are made of, but no mesh of finite elements.

    Raises
    ------
    GearboxFileError
        All that is wrong: bearings, teeth that do not fit, shapes and solids with their seats, axes of tables, series.
    """
    families = {bearing.family: bearing for bearing in gearbox.bearings}
    attempts: list[Callable[[], object]] = [partial(_build_bearing, gearbox, bearing) for bearing in families.values()]
    attempts += [partial(_place_teeth, gearbox), partial(_count_states, gearbox)]
    if gearbox.ste.centre_distance_offsets_um is not None:
        at_work = {mesh.pair.name for mesh in gearbox.meshes}
        tabled = [name for name, section in gearbox.case.pairs.items() if section.table or name in at_work]
        attempts += [partial(gearbox.table_distances, name) for name in tabled]
    attempts += [partial(torque_series, gearbox, case) for case in gearbox.load_cases.values()]
    attempts += [partial(check_elastic_body, gearbox, name) for name in elastic_names(gearbox)]
    elastic = {gearbox.body(name).family for name in elastic_names(gearbox)}
    attempts += [partial(check_shape, gearbox, name) for name in gearbox.case.bodies if name not in elastic]
    errors: list[str] = []
    for attempt in attempts:
        try:
            attempt()
        except GearboxFileError as error:
            errors += error.errors
    if errors:
        raise GearboxFileError(*errors)


def errors_of_bearings(content: Mapping[str, Any], source: str) -> Iterator[str]:
    """Return rolling bearings with inconsistent data, in content that may have other errors."""
    for name, section in readable(content).bearings.items():
        if section.catalogue is not None:
            try:
                catalogue_rows(section.catalogue)
            except BearingError as error:
                yield error_line(source, f"bearings.{name}.catalogue: {error}")


def lacking(gearbox: Gearbox, variant: str) -> str:
    """Say why a variant cannot be built or moves without resistance; empty if it can.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [lacking(gearbox, variant) for variant in ("rigid", "bushing", "flexible")]
    ['', '', '']
    """
    chosen = Variant.of(variant)
    lack = unsupported(gearbox, variant)
    if lack or not chosen.has_bearings:
        return lack
    elastic = elastic_names(gearbox) if chosen.is_elastic else ()
    # The first error that `check_parts` finds in flexible bodies: an impossible body, or a seat off the body.
    for name in elastic:
        try:
            check_elastic_body(gearbox, name)
        except GearboxFileError as error:
            return error.errors[0].removeprefix(f"{gearbox.source}: ")
    if unheld := free_motion(gearbox, variant):
        return unheld
    # A bearing's seat may be one that no factor can stand for; an elastic housing has seats of its own.
    seats = {body.name for body in gearbox.bodies() if body.fixed and body.name in elastic}
    reasons = (misplaced_factor(bearing) for bearing in gearbox.bearings if not seats & {bearing.on, bearing.body})
    return next(filter(None, reasons), "")


def usual_variant(gearbox: Gearbox) -> Variant:
    """Return the variant of computations for which the user names none: bushing, or rigid where bearings are missing.

    Examples
    --------
    >>> usual_variant(Gearbox.from_toml("cases/grc750/gearbox.toml"))
    'bushing'
    """
    return Variant.rigid if lacking(gearbox, Variant.bushing) else Variant.bushing


def gearbox_warnings(gearbox: Gearbox) -> tuple[str, ...]:
    """Return implausible inputs, and how they are interpreted; one line each, the same for every command."""
    lines = list(gearbox.warnings)
    lines += (
        f"pairs.{name}: no torque in [static_load], so no table is computed: mesh stiffness to ISO 6336-1, no "
        "excitation"
        for name in gearbox.idle_pairs
    )
    train = gearbox.train
    if train.degrees_of_freedom > 1:
        others = ", ".join(train.independent[1:])
        lines.append(
            f"meshes: the gear train has {train.degrees_of_freedom} degrees of freedom; ratio, orders and input "
            f"speeds apply while {others} do{'es' if len(train.independent) == 2 else ''} not rotate"
        )
    lines += pair_warnings(gearbox)
    lines += part_warnings(gearbox)
    for name in elastic_names(gearbox):
        section = gearbox.case.bodies[gearbox.body(name).family]
        if section.shape is not None:
            lines += narrowed_seats(gearbox, name)
        if section.external is not None:
            lines += external_warnings(gearbox, name)
        # For want of a seat of their own, reactions of stated loads act at the main seat of a flexible body.
        table, own = ("solid", section.solid) if section.solid is not None else ("external", section.external)
        for load in gearbox.varying_loads:
            if own is not None and load.reaction_on == name and load.excitation not in own.seats:
                lines.append(
                    f"excitations.{load.excitation}.reaction_on = {name!r}: the reaction acts at the seat of torques "
                    f"of this flexible body; add [bodies.{name}.{table}.seats.{load.excitation}] where the stator is "
                    "fastened"
                )
    return tuple(dict.fromkeys(lines))


def _build_bearing(gearbox: Gearbox, bearing: Bearing) -> None:
    try:
        stiffness = linear_law(bearing, 0.0).stiffness
        if bearing.catalogue is not None:
            friction_series(bearing.catalogue)
    except BearingError as error:
        raise gearbox.error(f"bearings.{bearing.family}.catalogue: {error}") from None
    if not np.all(np.isfinite(stiffness)):
        raise gearbox.error(f"bearings.{bearing.family}.catalogue: stiffness is not finite; check its dimensions")


def _place_teeth(gearbox: Gearbox) -> None:
    try:
        tooth_places(gearbox, loaded_flanks(gearbox))
    except MeshError as error:
        raise gearbox.error(str(error)) from None


def _count_states(gearbox: Gearbox) -> None:
    axes = gearbox.ste
    states = axes.positions * len(axes.torque_factors) * len(axes.centre_distance_offsets_um or _FOLLOWING)
    states *= len(axes.misalignment_um or _FOLLOWING)
    if states > MOST_STATES:
        raise gearbox.error(f"ste: the axes result in {states} table states; at most {MOST_STATES} are permitted")
