"""Compliance of a gear's flank: scikit-fem hexahedra of one tooth sector, condensed and closed to the full ring.

The sector's stiffness matrix is condensed onto its two cut faces. The ring of z equal sectors is then closed exactly
(`fe_ste.elasticity.condensation`). The stored result of a gear is the normal displacement of the flank of each tooth
under unit normal loads on the flank of one tooth. The near field of the loaded tooth depends on the mesh, so the near
field of the bricks is removed (`fe_ste.elasticity.bricks`); the contact calculation adds the half-space solution
instead (`fe_ste.contact.compliance`).

Each gear has its own frame: tooth 0 lies on the x axis, z = 0 is the middle of its face width. Loads and displacements
of a flank are positive into the material, as a pressing load acts.

The key is a hash of all inputs: the gear without its name, the mesh, and the sources of the method.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fe_ste.elasticity.bricks import END_LAYERS, ERROR_REACH, WAVES, brick_error, end_errors
from fe_ste.elasticity.condensation import CondensedSector
from fe_ste.elasticity.halfspace import tent_integrals, tent_means, wedge_images
from fe_ste.elasticity.hexmesh import MeshSettings, SectorMesh, sector_mesh
from fe_ste.geometry.gears import Gear
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin, TitledRows
from fe_ste.tools.stores import Arrays, Cache
from fe_ste.tools.threads import both, one_dense_thread, side_by_side

#: Teeth on either side of the loaded one whose displacement is kept, unless more may touch at once.
TOOTH_REACH = 4


@dataclass(frozen=True)
class FlankCompliance(ReprMixin):
    """Compliance of one flank of every tooth of a gear whose hub (or outer rim) is held.

    Attributes
    ----------
    mirror : float
        Strength of the image loads behind the free end faces taken out with the near field.
    """

    gear: Gear
    side: int
    """+1: the counter-clockwise flank of the teeth, -1: the clockwise one."""
    images: Floats
    roll: Floats
    axial: Floats
    """(f,), (l,) flank grid: roll angles (rad) and axial positions (m)."""
    regular: dict[tuple[int, int], Floats]
    """(tooth read, tooth loaded) -> ndarray (f l, f l), m/N. For the closed ring the key is (difference, 0)."""
    closed: bool
    """Whether the ring has all its teeth; else an open sector."""
    hub_torque: Floats
    """(f l,) torque of the reaction at the held surface about the axis per unit load on each flank node, m."""
    figures: dict[str, float | int | str]
    """Number of unknowns, number of elements, minimum scaled Jacobian."""

    def between(self, read: int, loaded: int) -> Floats:
        """Return the compliance of tooth `read` under loads on tooth `loaded`.

        Raises
        ------
        ValueError
            If the teeth are further apart than was computed, or outside the open sector.
        """
        return self.regular[self.key(read, loaded)]

    def key(self, read: int, loaded: int) -> tuple[int, int]:
        """Return the key of two teeth in `regular`; raises as `between` does."""
        key = (read - loaded, 0) if self.closed else (read, loaded)
        if key not in self.regular:
            raise ValueError(f"gear {self.gear.name}: no compliance between teeth {read} and {loaded}")
        return key

    def turned(self) -> FlankCompliance:
        """Return the other flank of the same gear.

        A gear is equal to itself turned by 180 degrees about the middle of a tooth: that brings one flank to the other,
        reverses the axis and the order of the teeth, and the torque about the axis.
        """
        nodes = np.arange(len(self.hub_torque)).reshape(len(self.roll), -1)[:, ::-1].ravel()
        return replace(
            self,
            side=-self.side,
            axial=-self.axial[::-1],
            images=self.images[::-1],
            regular={
                (-read, -loaded): np.ascontiguousarray(block[np.ix_(nodes, nodes)])
                for (read, loaded), block in self.regular.items()
            },
            hub_torque=-self.hub_torque[nodes],
        )

    @property
    def tooth_reach(self) -> int:
        """Largest number of a tooth, on either side of tooth 0, whose compliance is known."""
        return max(read for read, _ in self.regular)

    @property
    def lead(self) -> float:
        """Slope d phi / d z of a generator in flank coordinates, rad/m."""
        return _flank_lead(self.gear, self.side)

    def _line(self) -> str:
        flank = "counter-clockwise" if self.side > 0 else "clockwise"
        extent = "closed ring" if self.closed else f"open sector of {2 * self.tooth_reach + 1} teeth"
        return f" of {self.gear.name!r}: {flank} flank, {len(self.roll)} x {len(self.axial)} nodes, {extent}"

    def _table(self) -> TitledRows:
        return f"compliance of a flank of gear {self.gear.name}", {
            "flank": "counter-clockwise" if self.side > 0 else "clockwise",
            "teeth": "closed ring" if self.closed else f"open sector of {2 * self.tooth_reach + 1}",
            "nodes along the profile": str(len(self.roll)),
            "nodes along the face": str(len(self.axial)),
            **{name.replace("_", " "): f"{value}" for name, value in self.figures.items()},
        }


def _flank_lead(gear: Gear, side: int) -> float:
    # The roll angle grows towards the tip; whether the generator leans to tip or root at +z depends on hand and side.
    handed = side * (-1 if gear.internal else 1)
    return float(handed * np.tan(gear.base_helix_angle) / gear.base_radius)


def flank_compliance(
    gear: Gear,
    side: int = 1,
    settings: MeshSettings | None = None,
    *,
    open_teeth: int | None = None,
    tooth_reach: int = TOOTH_REACH,
    incompatible_modes: bool = True,
) -> FlankCompliance:
    """Compute the compliance of one flank of `gear` by finite elements.

    Parameters
    ----------
    gear : held at ``gear.held_diameter``
    side : loaded flank: +1 counter-clockwise, -1 clockwise
    open_teeth : odd number of teeth of an open sector with free cut faces; without it the closed ring
    tooth_reach : teeth on either side of the loaded one whose displacement is kept, of a closed ring that has as many
    incompatible_modes : see `fe_ste.elasticity.bricks.stiffness_matrix`

    Raises
    ------
    ValueError
        If `open_teeth` is even, less than 1 or more than the gear has.
    """
    if open_teeth is not None and not (1 <= open_teeth <= gear.teeth and open_teeth % 2 == 1):
        raise ValueError(f"open_teeth = {open_teeth}: must be an odd number from 1 to {gear.teeth}")
    with one_dense_thread():
        mesh = sector_mesh(gear, settings)
        images = flank_images(gear, side)
        sector, near = both(
            lambda: CondensedSector.from_mesh(mesh, side, incompatible_modes),
            lambda: flank_near_field(mesh, side, images, incompatible_modes),
        )
        if open_teeth is None:
            faces = sector.ring_faces(gear.teeth, min(tooth_reach, (gear.teeth - 2) // 2))
            torque = sector.ring_torque()
        else:
            faces, torque = sector.open_faces(open_teeth)
        regular = {}
        for (read, loaded), cut_faces in faces.items():
            regular[read, loaded] = sector.displacement(read == loaded, *cut_faces)
            if read == loaded:
                regular[read, loaded] = regular_part(mesh, regular[read, loaded], near)
        return FlankCompliance(
            gear=gear,
            side=side,
            images=images,
            roll=mesh.section.flank_roll,
            axial=mesh.axial_positions,
            regular=regular,
            closed=open_teeth is None,
            hub_torque=torque,
            figures={
                "unknowns": 3 * len(mesh.points),
                "elements": len(mesh.hexahedra),
                "least_scaled_jacobian": float(mesh.scaled_jacobian.min()),
            },
        )


def regular_part(mesh: SectorMesh, displacement: Floats, near: Floats) -> Floats:
    """Remove the near field from the displacement of the loaded tooth.

    The remainder is smooth, and symmetric except for the discretisation (Maxwell and Betti). It is an average over
    tents. Along the profile it is converted to values at the nodes, because a tent at the tip or the form diameter lies
    inwards of its node. Along the face width the averages are kept: a wide gear has too few layers for the conversion.

    Parameters
    ----------
    displacement : (f l, f l) of the flank nodes under tent loads, m/N
    near : (f l, f l) see `flank_near_field`

    Returns
    -------
    (f l, f l) of the flank nodes under loads at the flank nodes, m/N
    """
    roll = mesh.section.flank_roll
    means = tent_means(roll, mesh.gear.base_radius * roll**2 / 2.0)
    by_profile = (displacement - near).reshape(len(near), len(roll), -1)
    at_nodes = (np.linalg.inv(means).T @ by_profile).reshape(near.shape)
    return np.asarray((at_nodes + at_nodes.T) / 2)


def flank_near_field(mesh: SectorMesh, side: int, images: Floats, incompatible_modes: bool = True) -> Floats:
    """Near field of the flank's tent loads as the bricks hold it: half-space with images, and the bricks' own error.

    Parameters
    ----------
    images : (2, n, 3)
        Image loads behind the lower and the upper end face, see `fe_ste.elasticity.halfspace.wedge_images`.

    Returns
    -------
    (f l, f l) normal displacement of the flank nodes per unit tent load, m/N
    """
    gear = mesh.gear
    material = mesh.gear.material
    roll = mesh.section.flank_roll
    axial = mesh.axial_positions
    lead = _flank_lead(gear, side)
    cosine = float(np.cos(gear.base_helix_angle))
    field = tent_integrals(roll, axial, gear.base_radius, lead, cosine, images)
    field *= (1 - material.poissons_ratio**2) / (np.pi * material.youngs_modulus)
    by_node = field.reshape(len(roll), len(axial), len(roll), len(axial))
    error = brick_error(mesh, side, incompatible_modes)
    last = len(axial) - 1
    for loaded in range(last + 1):
        for read in range(max(0, loaded - ERROR_REACH), min(last, loaded + ERROR_REACH) + 1):
            by_node[:, read, :, loaded] += error[:, read - loaded + ERROR_REACH]
    away = np.subtract.outer(np.arange(len(roll)), np.arange(len(roll)))
    near_by = np.abs(away) < WAVES
    count = min(END_LAYERS, len(axial))
    for end, at_end in zip((0, last), end_errors(mesh, side, images, incompatible_modes), strict=True):
        for read, loaded in np.ndindex(count, count):
            added = np.where(near_by, at_end[np.clip(away, 1 - WAVES, WAVES - 1) + WAVES - 1, read, loaded], 0.0)
            by_node[:, abs(end - read), :, abs(end - loaded)] += added
    return field


def flank_images(gear: Gear, side: int) -> Floats:
    """Return the image loads (2, n, 3) behind both ends: a helical flank meets one under an acute angle."""
    lean = side * gear.base_helix_angle
    ratio = gear.material.poissons_ratio
    return np.stack([wedge_images(np.pi / 2 + lean, ratio), wedge_images(np.pi / 2 - lean, ratio)])


# Stored flanks: both flanks of a gear are computed once

#: Packages whose sources determine the results.
_ROOMS = ("tools", "geometry", "elimination", "elasticity")

#: Of the default mesh each takes 5 MB.
_flanks = Cache[FlankCompliance]("flank", in_memory=16, in_files=300_000_000)


def known_flanks(
    wanted: Sequence[tuple[Gear, int]],
    settings: MeshSettings | None = None,
    *,
    open_teeth: int | None = None,
    tooth_reach: int = TOOTH_REACH,
    incompatible_modes: bool = True,
) -> list[FlankCompliance]:
    """Return flanks as `fe_ste.elasticity.flank.flank_compliance` does, each gear computed at most once.

    Files are kept in the folder ``flanks`` of exugear's user cache, those unused for longest removed, or in the folder
    that ``EXUGEAR_FLANKS`` names; ``EXUGEAR_FLANKS=off`` neither reads nor writes any. Gears that have to be computed
    are computed two at a time.

    Parameters
    ----------
    wanted : gears and sides: +1 counter-clockwise, -1 clockwise
    incompatible_modes : as in `fe_ste.elasticity.flank.flank_compliance`, all three

    Raises
    ------
    ValueError
        As in `fe_ste.elasticity.flank.flank_compliance`.
    """
    options: dict[str, Any] = {
        "open_teeth": open_teeth,
        "tooth_reach": tooth_reach,
        "incompatible_modes": incompatible_modes,
    }
    settings = settings or MeshSettings()
    keys = [_key(gear, settings, options) for gear, _ in wanted]
    gears: dict[str, Gear] = {}
    for key, (gear, _) in zip(keys, wanted, strict=True):
        gears.setdefault(key, gear)

    stored = {key: _flanks.get(key, functools.partial(_unpacked, gear)) for key, gear in gears.items()}
    flanks = {key: flank for key, flank in stored.items() if flank is not None}
    missing = [key for key in gears if key not in flanks]
    with one_dense_thread():
        computed = side_by_side(lambda key: flank_compliance(gears[key], 1, settings, **options), missing)
    for key, flank in zip(missing, computed, strict=True):
        flanks[key] = flank
        _flanks.keep(key, flank, _packed(flank))
    return [
        dataclasses.replace(flanks[key] if side > 0 else flanks[key].turned(), gear=gear)
        for key, (gear, side) in zip(keys, wanted, strict=True)
    ]


def forget_flanks() -> None:
    """Drop all flanks from memory."""
    _flanks.forget()


def _key(gear: Gear, settings: MeshSettings, options: dict[str, Any]) -> str:
    known_by = dataclasses.asdict(gear)
    del known_by["name"]
    given = {"gear": known_by, "mesh": dataclasses.asdict(settings), "options": options, "method": _method()}
    return hashlib.sha256(json.dumps(given, sort_keys=True).encode()).hexdigest()


@functools.cache
def _method() -> str:
    """Digest of the sources that make the numbers: no version has to be kept in mind."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[1]
    for source in sorted(file for room in _ROOMS for file in (package / room).rglob("*.py")):
        content = source.read_bytes()
        digest.update(f"{source.relative_to(package)} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _unpacked(gear: Gear, arrays: Arrays) -> FlankCompliance:
    """Flank of a gear from what `_packed` made of it."""
    values: dict[str, Any] = json.loads(str(arrays.pop("values")))
    names = [tuple(name) for name in values.pop("regular")]
    values["regular"] = dict(zip(names, arrays.pop("regular"), strict=True))
    return FlankCompliance(gear=gear, **values | arrays)


def _packed(flank: FlankCompliance) -> dict[str, Any]:
    """Arrays of a flank, and what is none as one text; without its gear."""
    values: dict[str, Any] = {"regular": list(flank.regular)}
    arrays: dict[str, Any] = {"regular": np.stack(list(flank.regular.values()))}
    for field in dataclasses.fields(flank):
        value = getattr(flank, field.name)
        if isinstance(value, np.ndarray):
            arrays[field.name] = value
        elif field.name not in ("gear", "regular"):
            values[field.name] = value
    return {"values": np.array(json.dumps(values)), **arrays}
