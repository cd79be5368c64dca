"""Pictures of the contact stress on the ring, the sun and the high-speed pair of the GRC 750 gearbox, and of a mesh.

Run ``python benchmarks/nonlinear/pictures.py [superelement|nonlinear]``; it writes into docs/images.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.system.tooth_mesh.tables import requested_tables
from fe_ste.elasticity.gear_mesh import ContactMesh, refined_gears
from fe_ste.pictures.teeth import draw_contact_stress, draw_gear_meshes
from fe_ste.reference.position import StressField, nonlinear_position, stress_of_position, stress_of_state
from fe_ste.transmission_error.search import contact_state, hertz_half_width, least_contact_length, normal_load
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


def draw_meshes(path: Path) -> None:
    """Draw the meshes of the first stage of the template `parallel`, whose wheel has a deep body."""
    gearbox = Gearbox.from_dict(tomllib.loads(template("parallel")))
    (request,) = requested_tables(gearbox, Path("nowhere"), ["stage_1"])
    pair = request.wanted.pair
    half_width = hertz_half_width(pair, normal_load(pair, request.wanted.torque[0]) / least_contact_length(pair))
    gears = refined_gears(pair, ContactMesh(), 0.0, half_width)
    draw_gear_meshes(gears, path, title="stage_1 of the template parallel", size=(800, 800))


def main() -> None:
    """Draw all pictures by one method."""
    method = sys.argv[1] if len(sys.argv) > 1 else "superelement"
    gearbox = Gearbox.from_toml(CASE)
    draw_meshes(ROOT / "docs" / "images" / "mesh-whole-gears.png")
    for pair, (name, gear) in PICTURES.items():
        path = ROOT / "docs" / "images" / f"stress-{name}-{method}.png"
        draw_contact_stress(stress(gearbox, pair, method), path, title=pair.replace("_", "-"), flank_of=gear)
        sys.stdout.write(f"{path}\n")


if __name__ == "__main__":
    main()
