"""CalculiX model of a gear pair: open sectors of the meshes of `fe_ste`, contact, and the turning of gear 2.

The pose is that of `fe_ste.elasticity.hexmesh`, whose numbers of a brick's faces are those of CalculiX. Gear 1's hub
is held; gear 2's hub is a rigid body that turns about its axis under the torque.
Units in the input file: mm, N, MPa.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from fe_ste.elasticity.gear_mesh import GearMesh
from fe_ste.geometry.gears import GearPair

_M_TO_MM = 1e3
_PA_TO_MPA = 1e-6


class CalculixError(RuntimeError):
    """CalculiX is missing, stopped early or wrote no result."""


@dataclass(frozen=True)
class CalculixSettings:
    """How CalculiX treats the contact.

    Parameters
    ----------
    contact_stiffness : float
        Slope of the linear pressure-overclosure relation, in Young's moduli per mm.
    closing : float
        Prescribed approach of the first step that brings the flanks into contact, as part of `expected`.
    large_displacements : bool
        Whether geometric non-linearity is taken into account (NLGEOM).
    """

    contact_stiffness: float = 500.0
    closing: float = 0.9
    large_displacements: bool = False


@dataclass(frozen=True)
class CalculixResult:
    """What a run gave.

    Attributes
    ----------
    ste : float
        m.
    unknowns : int
        Three per node.
    wall_time, processor_time : float
        s.
    iterations : int
        Equilibrium iterations of all steps.
    version : str
    """

    ste: float
    unknowns: int
    wall_time: float
    processor_time: float
    iterations: int
    version: str


def write_input(
    path: Path,
    pair: GearPair,
    sectors: tuple[GearMesh, GearMesh],
    torque: float,
    expected: float,
    settings: CalculixSettings,
) -> None:
    """Write the input file of one position.

    Parameters
    ----------
    path : Path
    pair : GearPair
    sectors : tuple of GearMesh
    torque : float
        On gear 1, N m.
    expected : float
        Guess of the static transmission error, m: the first step turns gear 2 by a part of it.
    settings : CalculixSettings
    """
    one, two = sectors
    sense = -1.0 if pair.gear.internal else 1.0
    axis_x = (-1.0 if pair.gear.internal else 1.0) * pair.centre_distance * _M_TO_MM
    reference = len(one.points) + len(two.points) + 1
    material = pair.pinion.material
    modulus = material.youngs_modulus * _PA_TO_MPA
    large = ", NLGEOM" if settings.large_displacements else ""
    turn = sense * settings.closing * expected / pair.gear.base_radius
    moment = sense * torque * pair.ratio * _M_TO_MM
    lines = ["*NODE, NSET=ALL"]
    for start, sector in ((1, one), (1 + len(one.points), two)):
        lines += [
            f"{start + i},{x:.13e},{y:.13e},{z:.13e}" for i, (x, y, z) in enumerate((sector.points * _M_TO_MM).tolist())
        ]
    lines += [f"{reference},{axis_x:.13e},0.,0.", f"{reference + 1},{axis_x:.13e},0.,0."]
    lines.append("*ELEMENT, TYPE=C3D8I, ELSET=STEEL")
    for first, shift, sector in ((1, 1, one), (1 + len(one.hexahedra), 1 + len(one.points), two)):
        corners = (sector.hexahedra + shift).tolist()
        lines += [f"{first + i}," + ",".join(map(str, row)) for i, row in enumerate(corners)]
    for name, shift, sector in (("HUB1", 1, one), ("HUB2", 1 + len(one.points), two)):
        lines += [f"*NSET, NSET={name}", *(str(node) for node in sector.held + shift)]
    for name, first, sector in (("FLANK1", 1, one), ("FLANK2", 1 + len(one.hexahedra), two)):
        lines += [f"*SURFACE, NAME={name}", *(f"{first + e},S{face + 1}" for e, face in sector.contact_faces.tolist())]
    lines += [
        f"*NSET, NSET=TURN\n{reference + 1}",
        f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{modulus:.9e},{material.poissons_ratio}",
        "*SOLID SECTION, ELSET=STEEL, MATERIAL=STEEL",
        f"*RIGID BODY, NSET=HUB2, REF NODE={reference}, ROT NODE={reference + 1}",
        "*SURFACE INTERACTION, NAME=FRICTIONLESS\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{settings.contact_stiffness * modulus:.6e}",
        "*CONTACT PAIR, INTERACTION=FRICTIONLESS, TYPE=SURFACE TO SURFACE\nFLANK2,FLANK1",
        f"*BOUNDARY\nHUB1,1,3\n{reference},1,3\n{reference + 1},1,2",
        f"*STEP{large}\n*STATIC\n1.,1.",
        f"*BOUNDARY\n{reference + 1},3,3,{turn:.12e}",
        f"*NODE PRINT, NSET=TURN\nU\n*END STEP\n*STEP{large}\n*STATIC\n1.,1.",
        f"*BOUNDARY, OP=NEW\nHUB1,1,3\n{reference},1,3\n{reference + 1},1,2",
        f"*CLOAD\n{reference + 1},3,{moment:.12e}",
        "*NODE PRINT, NSET=TURN\nU\n*END STEP",
    ]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def find_calculix() -> str | None:
    """Path of the program ``ccx``, if it is installed."""
    return shutil.which("ccx")


def run_calculix(path: Path, pair: GearPair, unknowns: int, threads: int = 1, limit: float = 1200.0) -> CalculixResult:
    """Run CalculiX on an input file and read the static transmission error.

    Raises
    ------
    CalculixError
        If ccx is not installed, does not converge, or exceeds `limit` seconds.
    """
    program = find_calculix()
    if program is None:
        raise CalculixError("ccx is not installed; on Debian and Ubuntu it is in the package calculix-ccx")
    started, spent = time.perf_counter(), _children_time()
    try:
        outcome = subprocess.run(
            [program, path.stem],
            cwd=path.parent,
            env=os.environ | {"OMP_NUM_THREADS": str(threads)},
            capture_output=True,
            text=True,
            timeout=limit,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise CalculixError(f"{path.name}: ccx did not finish within {limit:g} s") from error
    wall_time = time.perf_counter() - started
    rotations = read_rotations(path.with_suffix(".dat"))
    if "Job finished" not in outcome.stdout or len(rotations) != 2:
        raise CalculixError(f"{path.name}: ccx stopped early: {outcome.stdout[-400:]}")
    version = re.search(r"Version ([\d.]+)", outcome.stdout)
    return CalculixResult(
        ste=abs(rotations[-1]) * pair.gear.base_radius,
        unknowns=unknowns,
        wall_time=wall_time,
        processor_time=_children_time() - spent,
        iterations=len(re.findall(r"^ iteration \d+", outcome.stdout, re.MULTILINE)),
        version=version.group(1) if version else "unknown",
    )


def _children_time() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def read_rotations(path: Path) -> list[float]:
    """Rotation about z of gear 2's hub at the end of each step, rad, from the printed results."""
    if not path.exists():
        return []
    rows = re.findall(r"^\s*\d+\s+\S+\s+\S+\s+(\S+)\s*$", path.read_text(encoding="ascii"), re.MULTILINE)
    return [float(row) for row in rows]
