"""Elastic bodies in a frame that floats with them: normal modes, and integrals over their mass.

All elastic normal modes of a reduced solid (`exugear.system.bodies.solids`) are modes, so that static deflections are
those of the reduced body; mass scaling brings those above the limit down to it. A floating frame knows the body by int
rho f_a g_b of its place and its modes f, g; rigid rings on seats (blanks) add theirs.

For a body of revolution a turn by psi takes the modes into each other, exp(psi S), with eigenvalues of S at whole
numbers: 0 for torsion and stretching, 1 for bending.

Nothing here knows a solver; Exudyn's floating frame is in `exugear.transient.exudyn_model.floating`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from exugear.system.bodies.finite_elements.solid_matrices import in_each_direction
from exugear.system.bodies.floating_body import FloatingBody
from exugear.system.bodies.reduced_body import ELASTIC, ReducedBody, RigidInertia
from exugear.system.bodies.rotations import skew
from exugear.system.bodies.solids import ReducedSolid, SolidModel, reduce_matrices, reduced_body
from exugear.system.bodies.store import load_or_reduce
from fe_ste.tools.stores.store import Store


def floating_body(model: SolidModel, matrices: ReducedSolid | None = None) -> FloatingBody:
    """Modes of a solid in its own frame, and its integrals; from its reduced matrices if they are at hand."""
    reduced = matrices or reduce_matrices(model)
    solid = reduced.solid
    component = reduced.component
    values, vectors = scipy.linalg.eigh(component.stiffness, component.mass)
    values = values[ELASTIC]
    by_mode = vectors[:, ELASTIC]
    modes = component.component_modes @ by_mode
    node_mass = np.asarray(solid.scalar_mass.sum(axis=0)).ravel()
    rings = [(n, model.blanks[seat.name]) for n, seat in enumerate(model.seats) if seat.name in model.blanks]
    places = np.array([seat.centre for seat in model.seats])
    mass = node_mass.sum() + sum(ring.mass for _, ring in rings)
    centre = (node_mass @ solid.nodes + sum(ring.mass * places[n] for n, ring in rings)) / mass
    # The place from the centre and the modes, as fields over the nodes.
    fields_at_nodes = np.concatenate([(solid.nodes - centre)[:, :, None], modes.reshape(-1, 3, len(values))], axis=2)
    count = fields_at_nodes.shape[2]
    flat = fields_at_nodes.reshape(len(fields_at_nodes), -1)
    moments = (flat.T @ (solid.scalar_mass @ flat)).reshape(3, count, 3, count).transpose(0, 2, 1, 3)
    first_moments = (node_mass @ flat).reshape(3, count)
    tension = modes.T @ (in_each_direction(solid.convection_square) @ modes)
    convection = modes.T @ (in_each_direction(solid.convection) @ modes)
    for n, ring in rings:
        moved = by_mode[6 * n : 6 * n + 3]
        turns = by_mode[6 * n + 3 : 6 * n + 6]
        field = np.zeros((3, 4, count))  # of 1, x, y, z from the seat's centre
        field[:, 0, 0], field[:, 1:, 0] = places[n] - centre, np.eye(3)
        field[:, 0, 1:] = moved
        field[:, 1:, 1:] = skew(turns.T).transpose(1, 2, 0)
        square = np.array([ring.mass, ring.axial / 2, ring.axial / 2, ring.transverse - ring.axial / 2])
        moments += np.einsum("acf,c,bcg->abfg", field, square, field)
        first_moments += ring.mass * field[:, 0]
        tension += turns.T @ (np.array([0.5, 0.5, 1.0])[:, None] * ring.axial * turns)
        across = ring.axial / 2 * np.outer(turns[0], turns[1])
        convection += across - across.T
    of_modes = moments[:, :, 1:, 1:]
    turning = of_modes[1, 0] - of_modes[0, 1] - convection
    return FloatingBody(
        name=model.name,
        seats=tuple(seat.name for seat in model.seats),
        places=places,
        centre=centre,
        mass=float(mass),
        mode_coordinates=by_mode,
        stiffness=values,
        added_mass=np.maximum(values / (2.0 * np.pi * model.limit) ** 2, 1.0) - 1.0,
        first_moments=first_moments,
        second_moments=moments,
        centrifugal_tension=0.5 * (tension + tension.T),
        turning=0.5 * (turning - turning.T),
    )


def with_inertia(body: FloatingBody, wanted: RigidInertia) -> FloatingBody:
    """Give a body the rigid inertia of another model of it; as `system.bodies.reduction.with_rigid_inertia` does.

    What is added or missing moves with the frame, that is with the rigid part of the motion.
    """
    offset = np.array(wanted.centre) - body.centre
    square = np.diag([wanted.axial / 2, wanted.axial / 2, wanted.transverse - wanted.axial / 2])
    second_moments = body.second_moments.copy()
    first_moments = body.first_moments.copy()
    second_moments[:, :, 0, 0] = square + wanted.mass * np.outer(offset, offset)
    first_moments[:, 0] = wanted.mass * offset
    return replace(body, mass=wanted.mass, second_moments=second_moments, first_moments=first_moments)


def load_or_reduce_floating(model: SolidModel, folder: Path | None) -> tuple[ReducedBody, FloatingBody]:
    """Both descriptions of a solid of revolution, from a folder if they are there for exactly these inputs.

    What is not there is reduced and stored.

    Raises
    ------
    exugear.system.bodies.finite_elements.second_order.SolidError, ReductionError
        As `exugear.system.bodies.solids.reduce_solid`.
    """
    matrices = cache(lambda: reduce_matrices(model))
    if folder is None:
        return reduced_body(model, matrices()), floating_body(model, matrices())
    name = f"{model.name}-{model.key[:16]}"
    reduced = load_or_reduce(folder / f"{name}.npz", model.key, lambda: reduced_body(model, matrices()))
    store = Store(folder / f"{name}-floating.npz", model.key)
    body = store.read(_from_arrays)
    if body is None:
        body = floating_body(model, matrices())
        store.write({stored: getattr(body, name) for stored, name in _STORED.items()}, compressed=True)
    return reduced, body


_STORED = {
    "name": "name",
    "seats": "seats",
    "places": "places",
    "centre": "centre",
    "mass": "mass",
    "coordinates": "mode_coordinates",
    "stiffness": "stiffness",
    "slowing": "added_mass",
    "first": "first_moments",
    "moments": "second_moments",
    "stretching": "centrifugal_tension",
    "turning": "turning",
}
"""Names in files, which stay so that old files are found again, and in `FloatingBody`."""


def _from_arrays(arrays: Mapping[str, NDArray[Any]]) -> FloatingBody:
    values: dict[str, Any] = {name: arrays[stored] for stored, name in _STORED.items()}
    values |= {"name": str(values["name"]), "mass": float(values["mass"]), "seats": tuple(values["seats"].tolist())}
    return FloatingBody(**values)
