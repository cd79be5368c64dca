"""GRC 750 kW: where misalignment puts the load along the face of each mesh, by variant, under 240 kN m.

    python cases/grc750/load_along_face.py [results folder]

Gears stand where the static load with locked output puts them by the mesh law `table`, whose teeth resist the tilt. The
load along the face follows from the finite-element contact at that place. Results go to results/grc750 by default;
tables over load, centre distance and misalignment are computed there first, some minutes, and used again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache

from one_variant import grc_project

from exugear import Choice, Project, static_state
from exugear.system.tooth_mesh.tables import wanted_table
from fe_ste import PairCompliance, static_transmission_error
from fe_ste.transmission_error.contact_stress import face_load_factor
from fe_ste.transmission_error.table import prepared_compliance

POSITIONS = 10
"""Positions of the mesh cycle; 50 change the factor by less than 0.01."""
RIGID_BODIES = ("carrier", "housing")
"""Bodies that the third line keeps rigid."""


def main() -> None:
    """Compute tables that are missing, then print a line for each variant."""
    project = grc_project(Choice("flexible", "table"))
    project.tables(grid=True)
    compliance = lru_cache(lambda pair: prepared_compliance(wanted_table(project.gearbox, pair, POSITIONS)))
    shafts = project.gearbox.varied({f"bodies.{name}.flexibility": "none" for name in RIGID_BODIES})
    projects = {
        "rigid": project.chosen(variant="rigid"),
        "bushing": project.chosen(variant="bushing"),
        "flexible, shafts alone": replace(project, gearbox=shafts),
        "flexible": project,
    }
    for name, chosen in projects.items():
        print(f"{name}: mesh, opening over the face in µm, highest over mean line load")
        for mesh, opening, factor in loads_of_meshes(chosen, compliance):
            print(f"  {mesh:15s} {1e6 * opening:6.1f}  {factor:5.2f}", flush=True)


def loads_of_meshes(
    project: Project, compliance: Callable[[str], PairCompliance]
) -> Iterator[tuple[str, float, float]]:
    """Name, opening of the gap over the face (m) and face load factor of each mesh under the static load."""
    state = static_state(project.assembly())
    elements, places = state.assembly.elements, zip(state.centre_distance, state.misalignment, strict=True)
    for element, (distance, misalignment), force in zip(elements, places, state.mesh_force, strict=True):
        pair = element.mesh.pair
        results = static_transmission_error(
            compliance(pair.name),
            abs(force) * pair.pinion.base_radius,
            POSITIONS,
            centre_distance=distance,
            misalignment=element.flank * misalignment,  # tables are those of the flank +1
        )
        yield element.mesh.name, misalignment * pair.face_width, float(face_load_factor(results).item())


if __name__ == "__main__":
    main()
