"""Mesh elements as arrays for the kernels."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from exugear.kernels.coordinates import BODY_SIZE, SPIN
from exugear.kernels.meshes import FRAME, ROW_SIZE, MeshArrays, periodic_cubic
from exugear.model.seats import seat_key
from exugear.tooth_mesh.element import MeshElement
from exugear.tooth_mesh.laws.line_of_action import STIFFNESS_FORM
from exugear.tooth_mesh.laws.table import pack_tables
from fe_ste.tools.arrays import Floats, Integers

_NO_COORDINATES = (-1,) * BODY_SIZE


def pack(
    elements: tuple[MeshElement, ...],
    coordinates: Mapping[str, tuple[int, ...]],
    averaged: bool = False,
    linear: bool = False,
) -> MeshArrays:
    """Arrays for the kernel.

    Parameters
    ----------
    elements : tuple of MeshElement
    coordinates : mapping of body name, or of `seat_key`, to six state indices (-1 where there is none)
    averaged : bool
        Replace stiffness and tables by their mean over the cycle, as eigenmodes need it.
    linear : bool
        Replace laws that are no stiffness, such as tables, by the stiffness they have at the static load.
    """
    count = len(elements)
    samples = [np.array([np.mean(e.stiffness)]) if averaged else e.stiffness for e in elements]
    coefficients = [
        periodic_cubic(values) if linear else e.law.coefficients(values)
        for e, values in zip(elements, samples, strict=True)
    ]
    width = max((len(values) for values in coefficients), default=1)
    stiffness = np.zeros((count, width, 4))
    for block, values in zip(stiffness, coefficients, strict=True):
        block[: len(values)] = values
    index = _indices(elements, coordinates)
    return MeshArrays(
        coordinates=index,
        axis=np.array([e.axis for e in elements]).reshape(count, 2, 2),
        form=np.array([STIFFNESS_FORM if linear else e.law.form for e in elements], dtype=np.int64),
        deflection=np.array([e.deflection for e in elements]).reshape(count, FRAME),
        force=np.array([e.force for e in elements]).reshape(count, FRAME),
        cycles=np.array([e.cycles for e in elements]),
        phase=np.array([e.phase for e in elements]),
        pieces=np.array([len(values) for values in coefficients], dtype=np.int64),
        stiffness=stiffness,
        damping=np.array([e.damping for e in elements]),
        line_of_action=np.array([e.line_of_action for e in elements]),
        error_pieces=np.array([[len(error) for error in e.errors] for e in elements], dtype=np.int64).reshape(count, 2),
        error=_pack_errors(elements),
        table=pack_tables(elements, index, averaged, linear),
    )


def _indices(elements: tuple[MeshElement, ...], coordinates: Mapping[str, tuple[int, ...]]) -> Integers:
    """Position of each local coordinate of each mesh in the state, (m, 13)."""
    index = np.full((len(elements), ROW_SIZE), -1, dtype=np.int64)
    for row, element in zip(index, elements, strict=True):
        mesh = element.mesh
        for start, body, gear in ((0, mesh.pinion, mesh.pair.pinion), (BODY_SIZE, mesh.gear, mesh.pair.gear)):
            keys = (seat_key(body, mesh.name), seat_key(body, gear.name), body)  # a travelling seat, a seat, the body
            carrying = (coordinates[key] for key in keys if key in coordinates)
            row[start : start + BODY_SIZE] = next(carrying, _NO_COORDINATES)
        row[FRAME] = coordinates.get(mesh.frame, _NO_COORDINATES)[SPIN]
    return index


def _pack_errors(elements: tuple[MeshElement, ...]) -> Floats:
    longest = max((len(error) for element in elements for error in element.errors), default=0)
    coefficients = np.zeros((len(elements), 2, longest, 4))
    for block, element in zip(coefficients, elements, strict=True):
        for end, error in enumerate(element.errors):
            if len(error):
                block[end, : len(error)] = periodic_cubic(error)
    return coefficients
