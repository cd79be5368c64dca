"""The elastic bodies of a gearbox: shapes from the gearbox file, seats where gears and bearings sit.

A shaft's mass comes from its shape and the blanks on it. What the body's inertia set says beyond that (or short of
it) is spread over the rigid part of the motion, so that an elastic body accelerates and orbits exactly as the rigid
one does and only its deformation is new.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from exugear.casefile import ShapeSection
from exugear.gearbox import Bearing, Body, Gearbox
from exugear.meridian import SeatBand, ShaftError, ShaftSection
from exugear.reduction import (
    Blank,
    ReducedBody,
    ReductionError,
    RigidInertia,
    ShaftModel,
    load_or_reduce,
    reduce_shaft,
    with_rigid_inertia,
)
from fe_ste.gears import Material

TORQUE_SEAT = "torque"
"""Name of the seat where torques and couplings act."""


@dataclass(frozen=True)
class ElasticBody:
    """A reduced shaft of a gearbox.

    Attributes
    ----------
    reduced : with the rigid inertia of the body's inertia set
    own : rigid inertia of shape and blanks by themselves
    main : seat whose spin stands for the body: where torques act, else the first gear
    sectors : seats on equal sectors by internal gear, an odd number, the first about +x, then on towards +y
    """

    reduced: ReducedBody
    own: RigidInertia
    main: str
    sectors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def shaft_model(gearbox: Gearbox, name: str) -> ShaftModel:
    """All that the reduction of a body's shaft depends on.

    Raises
    ------
    CaseError
        The body has no shape, or a shape that its gears and bearings do not fit on.
    """
    body = gearbox.body(name)
    shape = gearbox.case.bodies[body.family].shape
    if shape is None:
        raise gearbox.fault(f"bodies.{body.family}: no shape; give a [bodies.{body.family}.shape] table")
    start = shape.start_z_mm * 1e-3
    seats = tuple(SeatBand(seat, z - start, width) for seat, z, width in _seats(gearbox, body, shape))
    names = [seat.name for seat in seats]
    doubled = next((seat for seat in names if names.count(seat) > 1), None)
    if doubled is not None:
        raise gearbox.fault(f"bodies.{body.family}: a gear and a bearing on it are both named {doubled!r}; rename one")
    key = f"bodies.{body.family}.shape"
    unknown = next((blank for blank in shape.blanks if blank not in names), None)
    if unknown is not None:
        raise gearbox.fault(f"{key}.blanks.{unknown}: no such seat; seats are {', '.join(names)}")
    material = shape.material
    return ShaftModel(
        name=name,
        sections=tuple(
            ShaftSection(s.length_mm * 1e-3, s.outer_diameter_mm * 1e-3, s.inner_diameter_mm * 1e-3)
            for s in shape.sections
        ),
        material=Material(
            youngs_modulus=material.youngs_modulus_GPa * 1e9,
            poissons_ratio=material.poissons_ratio,
            density=material.density_kg_per_m3,
        ),
        origin=(*body.axis, start),
        seats=seats,
        blanks={
            seat: Blank(blank.mass_kg, blank.transverse_kg_m2, blank.axial_kg_m2)
            for seat, blank in shape.blanks.items()
        },
        band=gearbox.case.elasticity.band_Hz,
        limit=gearbox.case.elasticity.limit_Hz,
    )


def _seats(gearbox: Gearbox, body: Body, shape: ShapeSection) -> Iterator[tuple[str, float, float]]:
    """Name, z and width (m) of each seat."""
    for gear, z in body.wheels.items():
        yield gear, z, gearbox.gears[gear].face_width
    for bearing in gearbox.bearings:
        if body.name in (bearing.body, bearing.on):
            yield bearing.name, bearing.place[2], _width(bearing)
    if shape.torque_z_mm is not None:
        yield TORQUE_SEAT, shape.torque_z_mm * 1e-3, 0.0


def _width(bearing: Bearing) -> float:
    """Width of a bearing's seat (m): that of its rows; a plane where only a stiffness is given."""
    if bearing.catalogue is None:
        return 0.0
    rows = 1 if bearing.catalogue.arrangement == "single" else 2
    return rows * bearing.catalogue.width_mm * 1e-3


def elastic_names(gearbox: Gearbox) -> tuple[str, ...]:
    """Names of the bodies that the variant `flexible` takes as elastic."""
    return tuple(
        body.name for body in gearbox.bodies() if gearbox.case.bodies[body.family].flexibility == "nonrotating"
    )


def reduced_bodies(gearbox: Gearbox, inertias: str, folder: Path | None = None) -> dict[str, ElasticBody]:
    """Reduce all elastic shafts of a gearbox, or take them from where they were kept.

    Parameters
    ----------
    gearbox : Gearbox
    inertias : str
        Inertia set whose rigid inertias the shafts get.
    folder : Path, optional
        Folder of a results folder in which reductions are kept; only the process remembers them otherwise.

    Raises
    ------
    CaseError
        A shape that cannot be, or that its gears and bearings do not fit on.
    """
    found = {}
    for name in elastic_names(gearbox):
        body = gearbox.body(name, inertias)
        try:
            plain = _reduced(_Hashed(shaft_model(gearbox, name)), folder)
        except (ShaftError, ReductionError) as error:
            raise gearbox.fault(f"bodies.{body.family}.shape: {error}") from None
        wanted = RigidInertia(body.mass, (*body.axis, body.centre_of_mass_z), body.transverse, body.axial)
        seats = [seat.name for seat in plain.seats]
        main = TORQUE_SEAT if TORQUE_SEAT in seats else seats[0]
        found[name] = ElasticBody(with_rigid_inertia(plain, wanted), plain.rigid_inertia, main)
    return found


class _Hashed:
    """A shaft model by its key, so that it can be looked up."""

    def __init__(self, model: ShaftModel) -> None:
        self.model = model

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hashed) and self.model.key == other.model.key

    def __hash__(self) -> int:
        return hash(self.model.key)


@lru_cache(maxsize=64)
def _reduced(hashed: _Hashed, folder: Path | None) -> ReducedBody:
    return reduce_shaft(hashed.model) if folder is None else load_or_reduce(hashed.model, folder)
