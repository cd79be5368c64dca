"""GRC 750 kW: where misalignment puts the load along the face of each mesh, by variant, under 240 kN m.

    python cases/grc750/load_along_face.py [results folder]

Gears stand where the static load with locked output puts them by the mesh law `table`, whose teeth resist the tilt. The
load along the face follows from the finite-element contact at that place. Results go to results/grc750 by default;
tables over load, centre distance and misalignment are computed there first, some minutes, and used again.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

from exugear.dynamics.assemble import assemble
from exugear.dynamics.assembly import Assembly
from exugear.dynamics.statics import locked_equilibrium
from exugear.model.gearbox import Gearbox
from exugear.results.folder import bodies_folder
from exugear.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.tooth_mesh.tables import requested_tables, wanted_table
from fe_ste.transmission_error.compliance import PairCompliance
from fe_ste.transmission_error.face_load import face_load_factor
from fe_ste.transmission_error.table import prepared_compliance
from fe_ste.transmission_error.transmission_error import static_transmission_error

POSITIONS = 10
"""Positions of the mesh cycle; 50 change the factor by less than 0.01."""
RIGID_BODIES = ("carrier", "housing")
"""Bodies that the third line keeps rigid."""


def main(out: Path) -> None:
    """Compute tables that are missing, then print a line for each variant."""
    gearbox = Gearbox.from_toml(Path(__file__).with_name("gearbox.toml"))
    for request in requested_tables(gearbox, out, grid=True):
        _ = request.stored or request.compute()
    surfaces = mesh_stiffness(gearbox, "table", out)
    compliance = lru_cache(lambda pair: prepared_compliance(wanted_table(gearbox, pair, POSITIONS)))
    shafts = gearbox.varied({f"bodies.{name}.flexibility": "none" for name in RIGID_BODIES})
    cases = {
        "rigid": (gearbox, "rigid"),
        "bushing": (gearbox, "bushing"),
        "flexible, shafts alone": (shafts, "flexible"),
        "flexible": (gearbox, "flexible"),
    }
    for name, (case, variant) in cases.items():
        assembly = assemble(case, variant, surfaces, "table", folder=bodies_folder(out))
        print(f"{name}: mesh, opening over the face in um, highest over mean line load")
        for mesh, opening, factor in loads_of_meshes(assembly, compliance):
            print(f"  {mesh:15s} {1e6 * opening:6.1f}  {factor:5.2f}", flush=True)


def loads_of_meshes(
    assembly: Assembly, compliance: Callable[[str], PairCompliance]
) -> Iterator[tuple[str, float, float]]:
    """Name, opening of the gap over the face (m) and face load factor of each mesh under the static load."""
    load = assembly.gearbox.case.static_load
    q = locked_equilibrium(assembly, load.torques_N_m, load.locked, assembly.mean_meshes)
    places, states = assembly.gear_positions(q), assembly.mesh_states(q, 0.0 * q, assembly.mean_meshes)
    for element, (distance, misalignment), state in zip(assembly.elements, places, states, strict=True):
        pair = element.mesh.pair
        found = static_transmission_error(
            compliance(pair.name),
            abs(state[4]) * pair.pinion.base_radius,
            POSITIONS,
            centre_distance=distance,
            misalignment=element.flank * misalignment,  # tables are those of the flank +1
        )
        yield element.mesh.name, misalignment * pair.face_width, float(face_load_factor(found).item())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("results/grc750"))
