"""GRC 750 kW: how evenly the planets share the load, by clearance of the carrier's and the planets' bearings.

    python cases/grc750/load_sharing.py [results folder]

Under 240 kN m, weight included, at carrier angles over a third of a turn: bearings of the carrier and of the planets
follow the law of their rollers, all others are linear. A share is that of a planet's torque on sun and ring. The
clearances of the built gearbox are not public: they are varied over what ISO 5753 lets such bearings have, and beyond.
Mesh stiffness by ISO 6336, so that no tables are needed. Writes nothing.
"""

from __future__ import annotations

import numpy as np
from one_variant import grc_project

from exugear import Choice, Project, static_state

CLEARANCES_MM = (0.0, 0.05, 0.1, 0.2, 0.3)
"""Diametral, mounted: none, then from the least that the normal class has to more than class C3."""
WEIGHT = [0.0, -9.773, -0.855]
"""Gravity with the main shaft tilted by 5 degrees, m/s2."""
ANGLES_DEG = np.arange(0.0, 120.0, 12.0)
"""Angles of the carrier. Planets can be put in at multiples of 3 degrees."""


def main() -> None:
    """Print a line for each pair of clearances."""
    project = grc_project(Choice("bushing", "iso6336"))
    print("clearance of bearings, mm    largest share of a planet over a third (K_gamma)")
    print("carrier  planets")
    for carrier in CLEARANCES_MM:
        for planets in CLEARANCES_MM:
            factor = load_sharing_factor(project, carrier, planets)
            print(f"{carrier:6.2f}  {planets:6.2f}              {factor:8.3f}", flush=True)


def load_sharing_factor(project: Project, carrier: float, planets: float) -> float:
    """Largest share of a planet, times their number, over all angles of the carrier."""
    changes: dict[str, object] = {"gravity.acceleration_m_per_s2": WEIGHT}
    for bearing, clearance in (("plc_a", carrier), ("plc_b", carrier), ("pl_a", planets), ("pl_b", planets)):
        changes[f"bearings.{bearing}.model"] = "iso16281"
        changes[f"bearings.{bearing}.catalogue.radial_clearance_mm"] = clearance
    for bearing in ("plc_a", "plc_b"):
        changes[f"bearings.{bearing}.catalogue.radial_load_kN"] = None
        changes[f"bearings.{bearing}.housing_factor_applies"] = False
    largest = 0.0
    for angle in ANGLES_DEG:
        places = [angle, angle + 120.0, angle + 240.0]
        turned = project.gearbox.varied({**changes, "bodies.planet.planet_angles_deg": places})
        state = static_state(Project(turned, project.folder, project.choice).assembly())
        torque = np.zeros(3)
        for element, force in zip(state.assembly.elements, state.mesh_force, strict=True):
            mesh = element.mesh
            if mesh.family in ("sun_planet", "ring_planet"):
                torque[int(mesh.name[-1]) - 1] += force
        largest = max(largest, 3.0 * float(torque.max() / torque.sum()))
    return largest


if __name__ == "__main__":
    main()
