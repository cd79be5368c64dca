"""Sections of the report on what results rest on: assumptions, times of the steps, hashes and versions."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from exugear.report import page
from exugear.report.context import Context, words_of
from exugear.report.stored import StoredResults
from exugear.results.folder import times_spent

PACKAGES = ("exugear", "exudyn", "numpy", "scipy", "numba", "scikit-fem", "xarray", "h5netcdf", "matplotlib", "pyvista")
"""Packages whose versions a report names."""


def assumptions_section(context: Context) -> str:
    """List what was assumed in the case and in the models that were assembled."""
    gearbox, case = context.gearbox, context.gearbox.case
    acceleration = np.linalg.norm(case.gravity.acceleration_m_per_s2)
    return page.section(
        "Assumptions",
        page.bullets(
            [
                f"Inertia sets: {', '.join(gearbox.inertia_sets)}; default {case.default_inertias}.",
                f"Housing factor on the stiffness of bearings in the housing: {case.housing.factor:g}.",
                "Damping proportional to stiffness: bearings "
                f"{1e6 * case.damping.bearing_time_s:g} µs, meshes {1e6 * case.damping.mesh_time_s:g} µs, couplings "
                f"{1e6 * case.damping.coupling_time_s:g} µs times the stiffness.",
                f"Gravity {'off' if acceleration == 0.0 else f'{acceleration:.2f} m/s²'}.",
                "Mesh stiffness is that at the static load of the case; meshes are bilateral, and the time in which "
                "teeth would have to pull is counted.",
                "Modes: linearised at the static load, mesh stiffness averaged over the mesh cycle.",
                *_elastic_words(context),
            ]
        ),
        page.paragraph(f"Sources and confidence of all inputs: {gearbox.source} and the README beside it."),
    )


def _elastic_words(context: Context) -> Iterator[str]:
    """Say which bodies are elastic in the models of the report, and how finely."""
    assembly = next((assembly for assembly in context.assemblies.values() if assembly.elastic_bodies), None)
    if assembly is None:
        return
    case = context.gearbox.case
    parts = []
    for name, body in assembly.elastic_bodies.items():
        unknowns = sum(body.reduced.summary.unknowns.values())
        parts.append(f"{name} ({unknowns} unknowns reduced to {body.reduced.size} coordinates)")
    yield (
        f"Elastic in the variant {assembly.variant}: {', '.join(parts)}; damping {1e6 * case.damping.body_time_s:g} µs "
        f"times the stiffness, modes listed up to {case.elasticity.band_Hz:g} Hz."
    )
    if any(body.fixed for body in assembly.bodies):
        yield f"In the variant {assembly.variant} the elastic housing takes the place of the housing factor."


def times_section(context: Context, results: StoredResults) -> str:
    """List what each step took."""
    rows = [
        {"step": entry.step, "wall / s": f"{entry.seconds:.1f}", "peak memory / MB": f"{1e-6 * entry.memory:.0f}"}
        for entry in times_spent(context.folder)
    ]
    return page.section(
        "Where the time went",
        page.table(rows),
        page.paragraph("Each step was a process of its own; some ran side by side.") if rows else "",
    )


def provenance_section(context: Context, results: StoredResults) -> str:
    """Name the hash of the input of each result, and the versions of what computed here."""
    hashes = {f"table {name}": table.input_hash for name, table in results.tables.items()}
    hashes |= {str(context.name_of(run.path)): run.attributes["input_hash"] for run in results.runs}
    hashes |= {f"modes {words_of(model)}": data.attrs["input_hash"] for model, data in results.modes.items()}
    rows = [{"result": name, "SHA-256 of its input": sha256} for name, sha256 in hashes.items()]
    versions = [f"Python {platform.python_version()}", *(f"{name} {_version(name)}" for name in PACKAGES)]
    return page.section(
        "Provenance",
        page.table(rows, ("SHA-256 of its input",)),
        page.paragraph(f"{', '.join(versions)}; {platform.platform()}."),
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"
