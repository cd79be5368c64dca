"""Hash of all that the equations of a variant depend on."""

from __future__ import annotations

import hashlib
import json
from dataclasses import astuple, replace

import numpy as np

from exugear.gearbox.versions import MODES, REDUCTION, RUN
from exugear.system.assembly import Assembly
from fe_ste.transmission_error.surface import SteSurface


def input_hash(assembly: Assembly, load_case: str | None = None) -> str:
    """SHA-256 of all that the equations of a variant depend on: gearbox file with its solids, choices, mesh stiffness.

    The versions of the methods are part of it. Load cases that are not run leave it as it is.

    Parameters
    ----------
    load_case : for a run: its load case, with the content of its torque series

    Examples
    --------
    >>> from exugear.system.assemble import assemble
    >>> from exugear.gearbox.choice import Choice
    >>> from exugear.gearbox.gearbox import Gearbox
    >>> gearbox, choice = Gearbox.from_toml("cases/grc750/gearbox.toml"), Choice("bushing")
    >>> softer = gearbox.varied({"housing.factor": 0.2})
    >>> stiffness = {"sun_planet": 3.8e9, "ring_planet": 4.9e9, "intermediate": 3.1e9, "high_speed": 1.9e9}
    >>> input_hash(assemble(gearbox, choice, stiffness)) == input_hash(assemble(softer, choice, stiffness))
    False
    """
    gearbox = assembly.gearbox
    series = gearbox.load_cases[load_case].torque_series if load_case else None
    content = {
        "method_version": RUN if load_case else MODES,
        "reduction_version": REDUCTION if assembly.elastic_bodies else None,
        "gearbox": gearbox.computed_content,
        "load": gearbox.content["load_cases"][load_case] if load_case else None,
        "variant": assembly.variant,
        "law": assembly.mesh_law,
        "inertias": assembly.inertias,
        "load_case": load_case,
        "torque_series": hashlib.sha256(series.read_bytes()).hexdigest() if series else None,
        "solids": {
            name: body.file_digest for name, body in assembly.elastic_bodies.items() if body.file_digest is not None
        },
        # Rounded: another machine's last digits must not make another hash.
        "stiffness": {
            element.mesh.name: [f"{value:.9g}" for value in np.atleast_1d(element.stiffness)]
            for element in assembly.elements
        },
        "mesh_tangents": {
            element.mesh.name: [f"{value:.9g}" for value in element.tangent]
            for element in assembly.elements
            if element.is_curved
        },
        "mesh_contact": {
            element.mesh.name: [f"{value:.9g}" for value in astuple(replace(element.contact, cycle=None))[:-1]]
            for element in assembly.elements
            if element.contact is not None
        },
        "load_ways": {
            element.mesh.name: [f"{value:.9g}" for value in element.load_ways.ravel()]
            for element in assembly.elements
            if element.load_ways.size
        },
        "tables": {
            element.mesh.name: _digest(element.table.surface)
            for element in assembly.elements
            if element.table is not None
        },
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _digest(surface: SteSurface) -> str:
    """Hash of a table's surface, rounded likewise."""
    arrays = (surface.centre_distance, surface.misalignment, surface.root_force, surface.coefficients)
    text = ",".join(f"{value:.9g}" for values in arrays for value in values.ravel())
    return hashlib.sha256(text.encode()).hexdigest()
