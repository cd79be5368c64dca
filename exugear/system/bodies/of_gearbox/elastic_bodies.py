"""The elastic bodies of a gearbox: all that are elastic, reduced, with the rigid inertia of an inertia set.

The mass of a body that turns comes from its shape and the blanks on it. What the body's inertia set says beyond that
(or short of it) is spread over the rigid part of the motion, so that an elastic body accelerates and orbits exactly as
the rigid one does and only its deformation is new. A fixed body has no inertia set: its mass is that of its solid.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body
from exugear.system.bearings.supports import elastic_names
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.finite_elements.second_order import SolidError
from exugear.system.bodies.finite_elements.shaft_sections import ShaftError, check_shaft
from exugear.system.bodies.floating import load_or_reduce_floating, with_inertia
from exugear.system.bodies.floating_body import FloatingBody
from exugear.system.bodies.of_gearbox.shafts import (
    TORQUE_SEAT,
    shaft_model,
    shared_seats,
    solid_of_shaft,
)
from exugear.system.bodies.of_gearbox.solids import solid_body
from exugear.system.bodies.reduced_body import ReducedBody, ReductionError, RigidInertia
from exugear.system.bodies.reduction import with_rigid_inertia
from exugear.system.bodies.solids import SolidModel, load_or_reduce_solid, reduce_solid
from exugear.system.bodies.turned_shaft import ShaftModel, load_or_reduce_shaft, reduce_shaft


def reduced_bodies(
    gearbox: Gearbox, inertias: str, folder: Path | None = None, begin: Callable[[str], None] | None = None
) -> dict[str, ElasticBody]:
    """Reduce all elastic bodies of a gearbox, or take them from where they are stored.

    Parameters
    ----------
    inertias : inertia set whose rigid inertias the bodies get that turn
    folder : folder of a results folder in which reductions are stored; only the process remembers them otherwise
    begin : called with the name of each body before it is reduced

    Raises
    ------
    CaseError
        A shape or solid that cannot be, or that its gears and bearings do not fit on.
    """
    bodies = {}
    for name in elastic_names(gearbox):
        if begin is not None:
            begin(name)
        bodies[name] = _elastic_body(gearbox, gearbox.body(name, inertias), folder)
    return bodies


def _elastic_body(gearbox: Gearbox, body: Body, folder: Path | None) -> ElasticBody:
    section = gearbox.case.bodies[body.family]
    solid = None if section.solid is None else solid_body(gearbox, body.name)
    key = "shape" if solid is None else "solid"
    model = shaft_model(gearbox, body.name) if solid is None else solid.model
    floating = None
    try:
        if section.flexibility == "ffrf":
            of_shape, floating = _floating(_Hashed(model), folder)
        else:
            of_shape = _reduced(_Hashed(model), folder)
    except (ShaftError, SolidError, ReductionError) as error:
        raise gearbox.fault(f"bodies.{body.family}.{key}: {error}") from None
    wanted = RigidInertia(body.mass, (*body.axis, body.centre_of_mass_z), body.transverse, body.axial)
    reduced = of_shape if body.fixed else with_rigid_inertia(of_shape, wanted)
    floating = None if floating is None else with_inertia(floating, wanted)
    inertia = of_shape.rigid_inertia
    if solid is not None:
        digest = hashlib.sha256(solid.model.mesh.path.read_bytes()).hexdigest()
        return ElasticBody(reduced, inertia, solid.main_seat, solid.sectors, solid.shared_seats, floating, digest)
    seats = [seat.name for seat in of_shape.seats]
    shared = shared_seats(gearbox, body.name)
    torque = shared.get(TORQUE_SEAT, TORQUE_SEAT)
    main = torque if torque in seats else seats[0]
    return ElasticBody(reduced, inertia, main, shared_seats=shared, floating=floating)


def check_elastic_body(gearbox: Gearbox, name: str) -> None:
    """Refuse an elastic body before its finite elements are made.

    Raises
    ------
    CaseError
        A shape or solid that cannot be, a solid whose file is not there, seats that do not fit.
    """
    family = gearbox.body(name).family
    if gearbox.case.bodies[family].solid is not None:
        solid_body(gearbox, name)
        return
    model = shaft_model(gearbox, name)
    if not model.seats:
        raise gearbox.fault(
            f"bodies.{family}.shape: nothing sits on the body; give it a gear, a bearing or torque_z_mm"
        )
    try:
        check_shaft(model.sections, model.seats)
    except ShaftError as error:
        raise gearbox.fault(f"bodies.{family}.shape: {error}") from None


class _Hashed:
    """A model of a body by its key, so that it can be looked up."""

    def __init__(self, model: ShaftModel | SolidModel) -> None:
        self.model = model
        self.key = model.key

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self.key == other.key

    def __hash__(self) -> int:
        return hash(self.key)


@lru_cache(maxsize=64)
def _reduced(hashed: _Hashed, folder: Path | None) -> ReducedBody:
    model = hashed.model
    if isinstance(model, SolidModel):
        if folder is None:
            return reduce_solid(model)
        return load_or_reduce_solid(model, folder)
    if folder is None:
        return reduce_shaft(model)
    return load_or_reduce_shaft(model, folder)


@lru_cache(maxsize=16)
def _floating(hashed: _Hashed, folder: Path | None) -> tuple[ReducedBody, FloatingBody]:
    model = hashed.model
    return load_or_reduce_floating(model if isinstance(model, SolidModel) else solid_of_shaft(model), folder)
