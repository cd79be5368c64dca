"""GRC 750 kW: planet carrier, rim of the ring gear and housing as elastic solids, reduced to their seats.

    python cases/grc750/shapes.py [results folder]

Needs the extra `mesh` (gmsh). Prints mass, unknowns, seconds and first free vibrations, draws the first of each into
results/grc750/bodies by default, and keeps the reductions there.

What is printed or follows from printed numbers: bores, widths and places of bearings, orbit of the planets, flange and
root of the ring, places of the axes, masses. All other dimensions are invented, because the drawings are not published
in numbers: plate and wall thicknesses, webs, ribs, the torque arm. They are chosen so that the masses come out near the
printed ones. Letters as in gearbox.toml: P1, P2 printed, D derived, A assumed.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

from exugear.reduction import ReducedBody
from exugear.solid_mesh import tetrahedra
from exugear.solid_scene import draw_free_vibration
from exugear.solids import SolidModel, SolidSeat, load_or_reduce_solid
from fe_ste.gears import Material

STEEL = Material(206e9, 0.3, 7850.0)  # A   as the gears
CAST_IRON = Material(169e9, 0.275, 7200.0)  # P2 ductile iron of a published housing analysis; 66 GPa by another source

ORBIT = 0.308  # P2
PLANETS = (0.0, 120.0, 240.0)  # P1 equally spaced; first at +x A
MIDDLE = -0.1045  # D   middle of the ring's face
RING = (MIDDLE - 0.115, MIDDLE + 0.115)  # P1 face 230 mm
RING_OUTER, RING_ROOT = 0.595, 0.5235  # D, P1

BAND = {"carrier": 2000.0, "ring_rim": 2000.0, "housing": 600.0}
"""Free vibrations up to here are kept, Hz; the first two of each are well inside."""
LIMIT = 12000.0


def cylinder(occ: Any, x: float, y: float, low: float, high: float, radius: float) -> tuple[int, int]:
    """Cylinder along z."""
    return 3, occ.addCylinder(x, y, low, 0.0, 0.0, high - low, radius)


def tube(occ: Any, x: float, y: float, low: float, high: float, outer: float, inner: float) -> tuple[int, int]:
    """Tube along z."""
    cut, _ = occ.cut([cylinder(occ, x, y, low, high, outer)], [cylinder(occ, x, y, low - 0.01, high + 0.01, inner)])
    return 3, cut[0][1]


def bands(occ: Any, x: float, y: float, places: tuple[float, ...], radius: float) -> list[tuple[int, int]]:
    """Cylinder cut across at places along z, so that bands of seats end on edges."""
    return [cylinder(occ, x, y, low, high, radius) for low, high in zip(places[:-1], places[1:], strict=True)]


def pin(angle: float) -> tuple[float, float]:
    """Place of a planet's pin."""
    return ORBIT * math.cos(math.radians(angle)), ORBIT * math.sin(math.radians(angle))


# ------------------------------------------------------------------------------------------------- carrier
UPWIND, DOWNWIND = (-0.281, -0.229), (0.02, 0.062)  # A   plates, clear of the planets' faces (227.5 mm, P1)
PLATE = 0.43  # A   radius, as the estimate of its inertia


def carrier(occ: Any) -> None:
    """Two plates with three webs between the planets, journals of both bearings, three pins."""
    journal_a = bands(occ, 0.0, 0.0, (-0.45, -0.338, -0.282, UPWIND[0] + 0.01), 0.23)  # D bore of PLC-A 460; end A
    journal_b = bands(occ, 0.0, 0.0, (DOWNWIND[1] - 0.01, 0.0745, 0.1205), 0.20)  # D bore of PLC-B 400
    body = [cylinder(occ, 0.0, 0.0, UPWIND[0], DOWNWIND[1], PLATE)]
    gaps = [cylinder(occ, *pin(a), UPWIND[1], DOWNWIND[0], 0.222) for a in PLANETS]  # D tips 421.3 / 2 with clearance
    gaps.append(cylinder(occ, 0.0, 0.0, UPWIND[1], DOWNWIND[0], 0.26))  # A   webs no deeper than the planets' bores
    body, _ = occ.cut(body, gaps)
    pins = [
        p
        for a in PLANETS
        for p in bands(occ, *pin(a), (UPWIND[1], -0.1945, -0.1145, -0.0945, -0.0145, DOWNWIND[0]), 0.08)
    ]
    body, _ = occ.fuse(body, journal_a + journal_b + pins)
    bores = [cylinder(occ, 0.0, 0.0, -0.46, UPWIND[1] + 0.001, 0.18)]  # A   main shaft 360
    bores.append(cylinder(occ, 0.0, 0.0, DOWNWIND[0] - 0.001, 0.13, 0.175))  # D   outer ring of LSS-A 350
    occ.cut(body, bores)


def carrier_seats() -> tuple[SolidSeat, ...]:
    """Bearings by their names in gearbox.toml, those of the planets on their pins, and the main shaft."""
    planets = tuple(
        SolidSeat(f"{name}_{number}", (*pin(angle), z), 0.08, 0.08)
        for number, angle in enumerate(PLANETS, start=1)
        for name, z in (("pl_a", -0.1545), ("pl_b", -0.0545))
    )
    return (
        SolidSeat("plc_a", (0.0, 0.0, -0.310), 0.23, 0.056),
        SolidSeat("plc_b", (0.0, 0.0, 0.0975), 0.20, 0.046),
        SolidSeat("main_shaft", (0.0, 0.0, -0.394), 0.18, 0.112),
        *planets,
    )


# -------------------------------------------------------------------------------------------------- ring rim
SECTORS = 6
"""Parts of the toothed surface, each a seat: a planet loads the one it passes."""


def ring_rim(occ: Any) -> None:
    """Make the ring below its teeth, without bolt holes."""
    tube(occ, 0.0, 0.0, *RING, RING_OUTER, RING_ROOT)


def ring_seats() -> tuple[SolidSeat, ...]:
    """Both flanges, and sectors of the toothed surface."""
    part = 2.0 * math.pi / SECTORS
    toothed = tuple(
        SolidSeat(f"teeth_{n + 1}", (0.0, 0.0, MIDDLE), RING_ROOT, RING[1] - RING[0], sector=(n * part, part))
        for n in range(SECTORS)
    )
    flanges = ((RING[0], "front"), (RING[1], "rear"))
    return (*(SolidSeat(name, (0.0, 0.0, z), RING_OUTER, inner_radius=RING_ROOT) for z, name in flanges), *toothed)


# -------------------------------------------------------------------------------------------------- housing
WALL = 0.028  # A
PARALLEL = (0.13, 0.40)  # A   middle of the chamber about both parallel shafts
CHAMBER = (0.56, 0.36)  # A   outer radii about the main axis and about that middle
IMS, HSS = (0.246302, 0.376611), (0.0, 0.520)  # P2
BORES = (  # name, axis, radius, from, to (all P2 but PLC-A: D, A), outer radius of the boss (A)
    ("plc_a", (0.0, 0.0), 0.290, -0.338, -0.282, 0.345),
    ("plc_b", (0.0, 0.0), 0.2705, 0.0705, 0.1248, 0.310),
    ("lss_bc", (0.0, 0.0), 0.180, 0.555, 0.659, 0.225),
    ("ims_a", IMS, 0.090, 0.114, 0.170, 0.120),
    ("ims_bc", IMS, 0.136, 0.555, 0.670, 0.165),
    ("hss_a", HSS, 0.090, 0.114, 0.170, 0.120),
    ("hss_bc", HSS, 0.1055, 0.560, 0.680, 0.135),  # P2 seats of 426 to 680: the rear one alone
)
ARM = 0.9  # A   half of the trunnions' spacing


def chamber(occ: Any, low: float, high: float, inset: float) -> list[tuple[int, int]]:
    """Room about the main axis and the parallel shafts, its wall `inset` inside the outer one."""
    rooms = [cylinder(occ, 0.0, 0.0, low, high, CHAMBER[0] - inset)]
    fused, _ = occ.fuse(rooms, [cylinder(occ, *PARALLEL, low, high, CHAMBER[1] - inset)])
    return list(fused)


def housing(occ: Any) -> None:
    """Torque arm, ring and rear housing in one piece, walls closed by two plates that carry the bearings."""
    ring = tube(occ, 0.0, 0.0, *RING, RING_OUTER, RING_ROOT)
    front = [tube(occ, 0.0, 0.0, -0.338, RING[0], RING_OUTER, RING_OUTER - 0.035)]  # A
    front.append(cylinder(occ, 0.0, 0.0, -0.338, -0.338 + WALL, RING_OUTER))
    for side in (-1.0, 1.0):
        start, end = RING_OUTER - 0.03, ARM + 0.06
        front.append((3, occ.addBox(min(side * start, side * end), -0.09, -0.338, end - start, 0.18, 0.10)))  # A
    shell, _ = occ.cut(chamber(occ, 0.0, 0.64, 0.0), chamber(occ, 0.12, 0.60, WALL))
    shell, _ = occ.cut(shell, [cylinder(occ, 0.0, 0.0, -0.01, 0.085, 0.50)])  # room of the planets' carrier
    flange = tube(occ, 0.0, 0.0, RING[1], 0.05, RING_OUTER, 0.50)
    bosses = [cylinder(occ, *axis, low, high, boss) for _, axis, _, low, high, boss in BORES]
    body, _ = occ.fuse([ring], [*front, *shell, flange, *bosses])
    holes = [cylinder(occ, *axis, low, high, radius) for _, axis, radius, low, high, _ in BORES]
    through = [cylinder(occ, *axis, low - 0.06, high + 0.06, 0.8 * radius) for _, axis, radius, low, high, _ in BORES]
    trunnions = [cylinder(occ, side * ARM, 0.0, -0.338, -0.238, 0.04) for side in (-1.0, 1.0)]
    occ.cut(body, [*holes, *through, *trunnions])


def housing_seats() -> tuple[SolidSeat, ...]:
    """Bearings by their names in gearbox.toml, the toothed surface, both trunnions."""
    bearings = tuple(
        SolidSeat(name, (*axis, (low + high) / 2.0), radius, high - low) for name, axis, radius, low, high, _ in BORES
    )
    trunnions = tuple(
        SolidSeat(name, (side * ARM, 0.0, -0.288), 0.04, 0.10)
        for name, side in (("arm_left", -1.0), ("arm_right", 1.0))
    )
    ring = SolidSeat("ring", (0.0, 0.0, MIDDLE), RING_ROOT, RING[1] - RING[0])
    return (*bearings, ring, *trunnions)


def solid_models() -> tuple[SolidModel, ...]:
    """Mesh all three."""
    made = (
        ("carrier", tetrahedra(carrier, 0.045, 24), STEEL, carrier_seats(), "carrier"),
        ("ring_rim", tetrahedra(ring_rim, 0.06, 36), STEEL, ring_seats(), "ground"),
        ("housing", tetrahedra(housing, 0.06, 16), CAST_IRON, housing_seats(), "ground"),
    )
    return tuple(SolidModel(name, *parts, BAND[name], LIMIT) for name, *parts in made)


def described(body: ReducedBody) -> str:
    """Mass, unknowns, seconds and first free vibrations in one line."""
    rigid = body.rigid_motions((0.0, 0.0, 0.0))
    mass = float((rigid.T @ body.mass @ rigid)[0, 0])
    found = body.figures
    first = ", ".join(f"{f:.0f}" for f in found.free_frequencies["whole"][:4])
    return (
        f"{body.name:9s} {mass:7.0f} kg {found.unknowns['whole']:7d} unknowns {body.size:4d} coordinates "
        f"{found.seconds:5.1f} s   {first} Hz"
    )


def main(out: Path) -> None:
    """Reduce what is not there yet, print and draw."""
    for model in solid_models():
        body = load_or_reduce_solid(model, out)
        print(described(body))
        draw_free_vibration(body, 0, out / f"{body.name}.png")
    print(f"pictures and reductions in {out}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("results/grc750/bodies"))
