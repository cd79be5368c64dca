"""Inputs of a mesh model for each pair of a gearbox: stiffness over the mesh cycle, or more of its table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import seat_key
from exugear.system.kernels.coordinates import BODY_SIZE, SPIN, TILT
from exugear.system.kernels.cubics import periodic_cubic
from exugear.system.kernels.meshes import (
    FRAME,
    ROW_SIZE,
    TILT_COLUMNS,
    TILT_STIFFNESS,
    WAY_COLUMNS,
    MeshArrays,
)
from exugear.system.kernels.table_law import NOMINAL_DEFLECTION
from exugear.system.tooth_mesh.element import MeshCurve, MeshElement
from exugear.system.tooth_mesh.laws.friction import FRICTION_PARTS, SLOW_SLIDING
from exugear.system.tooth_mesh.laws.line_of_action import CURVE_FORM, STIFFNESS_FORM, curve_coefficients
from exugear.system.tooth_mesh.laws.registry import LAWS, law_of
from exugear.system.tooth_mesh.laws.table import pack_tables
from exugear.system.tooth_mesh.placement import MeshError
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.transmission_error.surface import SteSurface


def mesh_stiffness(
    gearbox: Gearbox, law: str, directory: str | Path | None = None
) -> dict[str, Floats | MeshCurve | SteSurface]:
    """Return the stiffness F_bt / STE (N/m) at pmc = 0, 1/n, ... of each active pair, as its mesh model uses it.

    The model ``line_of_action`` uses the curve of load over deflection where a table exists, ``table`` its surface.

    Parameters
    ----------
    law : one of `exugear.system.tooth_mesh.laws.registry.MESH_MODELS`, which states whether it needs tables
    directory : results directory with ``tables/<pair>.nc``

    Raises
    ------
    MeshError
        Unknown model; or a table is missing, has positions that have not converged, or was computed from another input.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> stiffness = mesh_stiffness(gearbox, "iso6336")
    >>> [len(values) for values in stiffness.values()]
    [1, 1, 1, 1]
    """
    if law in LAWS and not LAWS[law].has_force:
        return {}
    reader = law_of(law)
    if LAWS[law].needs_tables and directory is None:
        raise MeshError(f"mesh model {law!r} requires transmission error tables; specify their folder")
    at_work = {mesh.pair.name for mesh in gearbox.meshes}
    return {name: reader.read(gearbox, name, Path(directory or ".")) for name in gearbox.pairs if name in at_work}


# Mesh elements as arrays for the kernels

_NO_COORDINATES = (-1,) * BODY_SIZE
_NO_FRICTION = np.zeros((FRICTION_PARTS, 0))


def pack(
    elements: tuple[MeshElement, ...],
    coordinates: Mapping[str, tuple[int, ...]],
    averaged: bool = False,
    linear: bool = False,
    tangent: bool = False,
) -> MeshArrays:
    """Arrays for the kernel.

    Parameters
    ----------
    coordinates : mapping of body name, or of `seat_key`, to six state indices (-1 where there is none)
    averaged : replace stiffness and tables by their mean over the cycle, as eigenmodes need it
    linear
        Replace laws that are no stiffness, such as tables, by the stiffness they have at the static load: force over
        deflection.
    tangent : replace curves by the straight line that touches them at the static load
    """
    count = len(elements)
    forms = [_form(element, averaged, linear, tangent) for element in elements]
    width = max((len(values) for _, values in forms), default=1)
    stiffness = np.zeros((count, width, max((values.shape[1] for _, values in forms), default=4)))
    for block, (_, values) in zip(stiffness, forms, strict=True):
        block[: len(values), : values.shape[1]] = values
    # Position of each local coordinate of each mesh in the state.
    index = np.full((len(elements), ROW_SIZE), -1, dtype=np.int64)
    for row, element in zip(index, elements, strict=True):
        mesh = element.mesh
        for start, body, gear in ((0, mesh.pinion, mesh.pair.pinion), (BODY_SIZE, mesh.gear, mesh.pair.gear)):
            keys = (seat_key(body, mesh.name), seat_key(body, gear.name), body)  # a travelling seat, a seat, the body
            carrying = (coordinates[key] for key in keys if key in coordinates)
            row[start : start + BODY_SIZE] = next(carrying, _NO_COORDINATES)
        row[FRAME] = coordinates.get(mesh.frame, _NO_COORDINATES)[SPIN]
    tilts = _pack_tilts(elements, index, linear)
    # Its mean is in the lever; of gears that do not tilt it does nothing.
    resists = tilts[:, TILT_STIFFNESS] > 0.0
    moves = resists & (not averaged)
    ways = [e.load_ways if move else np.zeros((2, 0)) for move, e in zip(moves, elements, strict=True)]
    friction = [_NO_FRICTION] * count
    for n, element in enumerate(elements):
        if element.friction is not None and element.friction_coefficient and not (averaged or linear or tangent):
            friction[n] = element.friction_coefficient * element.friction  # (3, n) per unit of the mesh force
    tables = pack_tables(elements, index, averaged, linear)
    if tangent:
        tables.nominal[:, NOMINAL_DEFLECTION] -= [element.rest for element in elements]
    return MeshArrays(
        coordinates=index,
        axis=np.array([e.axis for e in elements]).reshape(count, 2, 2),
        form=np.array([form for form, _ in forms], dtype=np.int64),
        deflection=np.array([e.deflection for e in elements]).reshape(count, FRAME),
        force=np.array([e.force for e in elements]).reshape(count, FRAME),
        cycles=np.array([e.cycles for e in elements]),
        phase=np.array([e.phase for e in elements]),
        pieces=np.array([len(values) for _, values in forms], dtype=np.int64),
        stiffness=stiffness,
        damping=np.array([e.damping for e in elements]),
        tilt=tilts,
        way_pieces=np.array([way.shape[1] for way in ways], dtype=np.int64),
        way=_pack_ways(elements, ways),
        line_of_action=np.array([e.line_of_action for e in elements]),
        error_pieces=np.array([[len(error) for error in e.errors] for e in elements], dtype=np.int64).reshape(count, 2),
        error=_pack_errors(elements),
        friction_pieces=np.array([part.shape[1] for part in friction], dtype=np.int64),
        friction=_pack_friction(friction),
        friction_rows=np.array([e.friction_rows for e in elements]).reshape(count, FRICTION_PARTS, FRAME),
        friction_speed=np.array([SLOW_SLIDING / e.mesh.pair.transverse_base_pitch for e in elements]),
        table=tables,
    )


def _form(element: MeshElement, averaged: bool, linear: bool, straight: bool) -> tuple[int, Floats]:
    """Choose the form that an element's law has, by its number, and its coefficients (n, c)."""
    secant = element.stiffness
    tangent = element.tangent
    if averaged:
        secant = np.array([np.mean(secant)])
        tangent = np.array([np.mean(tangent)])
    if linear:
        return STIFFNESS_FORM, periodic_cubic(secant)
    if element.is_curved and straight:
        return STIFFNESS_FORM, periodic_cubic(tangent)
    if element.is_curved:
        return CURVE_FORM, curve_coefficients(secant, tangent, element.load)
    return element.law.form, element.law.coefficients(secant)


def _pack_tilts(elements: tuple[MeshElement, ...], index: Integers, linear: bool) -> Floats:
    """Fill `MeshArrays.tilt`: not of gears that do not tilt, nor of tables, which have a potential of their own."""
    tilts = np.zeros((len(elements), TILT_COLUMNS))
    for row, element, own in zip(tilts, elements, index, strict=True):
        contact = element.contact
        still = bool((own[[TILT, BODY_SIZE + TILT]] < 0).all())
        if contact is None or still or (element.table is not None and not linear):
            continue
        stiffness = contact.tilt_stiffness
        lever = contact.tangent_load_centroid
        moment = contact.force * (contact.load_centroid - lever)
        row[:] = stiffness, element.damping_time * stiffness, lever, moment, contact.misalignment
    return tilts


def _pack_ways(elements: tuple[MeshElement, ...], ways: list[Floats]) -> Floats:
    """Fill `MeshArrays.way` from ways (2, n) of each mesh; zeros behind shorter ones."""
    coefficients = np.zeros((len(ways), max((way.shape[1] for way in ways), default=0), WAY_COLUMNS))
    for block, element, (of_load, added) in zip(coefficients, elements, ways, strict=True):
        if added.size:
            moment = element.load * (of_load - added)
            block[: added.size] = np.hstack([periodic_cubic(added), periodic_cubic(moment)])
    return coefficients


def _pack_friction(parts: Sequence[Floats]) -> Floats:
    """Fill `MeshArrays.friction` from the parts (3, n) of each mesh."""
    coefficients = np.zeros((len(parts), max((own.shape[1] for own in parts), default=0), 4 * FRICTION_PARTS))
    for block, own in zip(coefficients, parts, strict=True):
        if own.size:
            block[: own.shape[1]] = np.hstack([periodic_cubic(part) for part in own])
    return coefficients


def _pack_errors(elements: tuple[MeshElement, ...]) -> Floats:
    longest = max((len(error) for element in elements for error in element.errors), default=0)
    coefficients = np.zeros((len(elements), 2, longest, 4))
    for block, element in zip(coefficients, elements, strict=True):
        for end, error in enumerate(element.errors):
            if len(error):
                block[end, : len(error)] = periodic_cubic(error)
    return coefficients
