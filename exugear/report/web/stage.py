"""Bodies and modes as data for the stage of a page, where a mode moves in three dimensions."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from exugear.report.pictures.scene import DISPLACEMENT_COLOURS
from exugear.report.web.arrays import ArrayStore, rounded, rounded_list
from exugear.report.web.drawn_bodies import DrawnBody, drawn_bodies, drawn_mode, turn_between
from exugear.system.assembly import Assembly
from fe_ste.tools.arrays import Floats

LARGEST = 0.035
"""Largest displacement drawn, over the diagonal of the scene, as in pictures."""
_U16 = 65535


def stage_data(
    assembly: Assembly, shapes: Floats, labels: Mapping[str, str], arrays: ArrayStore, deformed: Collection[int]
) -> dict[str, Any]:
    """Gather what the stage needs of a model.

    Parameters
    ----------
    shapes : (size, modes) mode shapes
    labels : mapping of name to words
        Of bodies and gears.
    arrays : takes the points, triangles and motions
    deformed : modes in which elastic bodies deform; in the others they move as a whole, which takes less room
    """
    bodies = drawn_bodies(assembly)
    # A rotor of stated inertias has no shape to draw: the stage is empty then.
    points = np.concatenate([np.zeros((0, 3)), *(body.shape.surface.points for body in bodies)])
    low, high = (points.min(axis=0), points.max(axis=0)) if bodies else (np.zeros(3), np.ones(3))
    modes = [drawn_mode(assembly, bodies, shapes[:, n], n in deformed) for n in range(shapes.shape[1])]
    fields = {place: n for n, place in enumerate(p for p, body in enumerate(bodies) if body.field is not None)}
    return {
        "bodies": _bodies(bodies, labels, arrays),
        "centre": rounded_list(0.5 * (low + high), 6),
        "diagonal": rounded(float(np.linalg.norm(high - low)), 6),
        "amplitude": LARGEST,
        "motions": arrays.add(np.array([mode.motions for mode in modes], dtype="f4")),
        "deformed": {
            str(n): {
                str(place): arrays.add(np.round(127.0 * modes[n].fields[place]).astype("i1").T.copy())
                for place in fields
            }
            for n in sorted(deformed)
            if fields
        },
        "colours": list(DISPLACEMENT_COLOURS),
    }


def _bodies(bodies: tuple[DrawnBody, ...], labels: Mapping[str, str], arrays: ArrayStore) -> list[dict[str, Any]]:
    """Each shape once, its points in 16 bits of its box: 15 µm of a metre."""
    firsts: dict[str, DrawnBody] = {}
    listed = []
    for body in bodies:
        first = firsts.setdefault(body.shape.family, body)
        turn = turn_between(first.shape, body.shape)
        drawn = body if turn is None else first
        local = drawn.shape.surface.points - drawn.shape.reference
        low = local.min(axis=0)
        span = np.maximum(np.ptp(local, axis=0), 1e-9)
        triangles = drawn.shape.surface.triangles
        kind = "u2" if len(local) <= _U16 else "u4"
        listed.append(
            {
                "name": body.shape.name,
                "label": labels.get(body.shape.name, body.shape.name),
                "owner": body.owner,
                "fixed": body.shape.fixed,
                "elastic": body.field is not None,
                "colour": body.colour,
                "reference": rounded_list(body.shape.reference, 7),
                "turn": rounded(turn or 0.0, 8),
                "low": rounded_list(low, 7),
                "span": rounded_list(span, 7),
                "points": arrays.add(np.round((local - low) / span * _U16).astype("u2"), differences=True),
                "triangles": arrays.add(triangles.astype(kind), differences=True),
            }
        )
    return listed
