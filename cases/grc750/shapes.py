"""Planet carrier, ring rim and housing of the GRC by themselves: reduced to their seats, and how they vibrate.

    python cases/grc750/shapes.py [results folder]

Solids come from the STEP files beside this file as gearbox.toml names them; gmsh (extra `mesh`) meshes them. The rim
is part of the housing there, and is taken here by itself as well. Reductions are kept in the results folder, where
`exugear run` finds them; pictures of the first normal modes go beside them. `write_step.py` makes the STEP files
from scripts.
"""

from __future__ import annotations

from pathlib import Path

from exugear import Gearbox, SolidModel
from exugear.report.pictures.scene import draw_free_vibration
from exugear.system.bodies.of_gearbox import solid_body
from exugear.system.bodies.reduction import ReducedBody
from exugear.system.bodies.solids import load_or_reduce_solid

RIM = {
    "file": "ring_rim.step",
    "element_size_mm": 60.0,
    "elements_around": 36,
    "band_Hz": 2000.0,
    "seats": {
        "ring": {"diameter_mm": 1047.0, "sectors": 9},
        "front": {"diameter_mm": 1190.0, "inner_diameter_mm": 1047.0, "position_mm": [0.0, 0.0, -219.5]},
        "rear": {"diameter_mm": 1190.0, "inner_diameter_mm": 1047.0, "position_mm": [0.0, 0.0, 10.5]},
    },
}
"""The ring below its teeth alone: seats on the toothed surface and on both flanges."""


def solid_models() -> dict[str, SolidModel]:
    """Everything that the reductions depend on, by what they are of."""
    gearbox = Gearbox.from_toml(Path(__file__).with_name("gearbox.toml"))
    alone = {key: {} for key in ("bearings", "mounts", "joints")}
    rim = gearbox.varied({"bodies.housing.solid": RIM, "elasticity.limit_Hz": 12e3, **alone})
    return {
        "carrier": solid_body(gearbox, "carrier").model,
        "ring_rim": solid_body(rim, "housing").model,
        "housing": solid_body(gearbox, "housing").model,
    }


def described(name: str, body: ReducedBody) -> str:
    """Mass, unknowns, seconds and first normal modes in one line."""
    summary = body.summary
    first = ", ".join(f"{f:.0f}" for f in summary.free_interface_frequencies["whole"][:4])
    return (
        f"{name:9s} {body.rigid_inertia.mass:7.0f} kg {summary.unknowns['whole']:7d} unknowns "
        f"{body.size:4d} coordinates {summary.seconds:5.1f} s   {first} Hz"
    )


def main(out: Path) -> None:
    """Reduce what is not there yet, print and draw."""
    for name, model in solid_models().items():
        body = load_or_reduce_solid(model, out)
        print(described(name, body))
        draw_free_vibration(body, 0, out / f"{name}.png")
    print(f"pictures and reductions in {out}")


if __name__ == "__main__":
    from arguments import results_folder

    main(results_folder("results/grc750/bodies"))
