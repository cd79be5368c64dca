"""Pictures of the contact stress on the ring, the sun and the high-speed pair of the GRC 750 gearbox.

Run ``python benchmarks/nonlinear/pictures.py [superelement|nonlinear]``; it writes into docs/images.
"""

from __future__ import annotations

import sys
from pathlib import Path

from exugear.gearbox.gearbox import Gearbox
from exugear.system.tooth_mesh.tables import requested_tables
from fe_ste.pictures.teeth import draw_contact_stress
from fe_ste.reference.position import StressField, nonlinear_position, stress_of_position, stress_of_state
from fe_ste.transmission_error.search import contact_state
from fe_ste.transmission_error.table import prepared_compliance

ROOT = Path(__file__).parents[2]
CASE = ROOT / "cases" / "grc750" / "gearbox.toml"
#: Pair of the gearbox -> name of the picture, gear whose flank it shows.
PICTURES = {"ring_planet": ("ring", 2), "sun_planet": ("sun", 1), "high_speed": ("high-speed", 1)}


def stress(gearbox: Gearbox, pair: str, method: str) -> StressField:
    """Stresses of a pair under its static load at position 0 of the mesh cycle."""
    (request,) = requested_tables(gearbox, Path("nowhere"), [pair])
    torque = request.wanted.torque[0]
    if method == "nonlinear":
        return stress_of_position(nonlinear_position(request.wanted.pair, torque, 0.0))
    compliance = prepared_compliance(request.wanted)
    return stress_of_state(compliance, contact_state(compliance, torque, 0.0), torque)


def main() -> None:
    """Draw all pictures by one method."""
    method = sys.argv[1] if len(sys.argv) > 1 else "superelement"
    gearbox = Gearbox.from_toml(CASE)
    for pair, (name, gear) in PICTURES.items():
        path = ROOT / "docs" / "images" / f"stress-{name}-{method}.png"
        draw_contact_stress(stress(gearbox, pair, method), path, title=pair.replace("_", "-"), flank_of=gear)
        sys.stdout.write(f"{path}\n")


if __name__ == "__main__":
    main()
