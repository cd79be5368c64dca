"""How often parts turn through their load: cycles of teeth, revolutions of bearings, per revolution of a body.

It follows from the rolling train alone. The two flanks of a gear are told apart: flank ``+`` faces the sense of +z
rotation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Mesh

FLANKS = {1: "+", -1: "-"}


@dataclass(frozen=True)
class ToothExposure:
    """What one tooth of a gear meets in one family of meshes."""

    gear: str
    family: str
    holder: str
    """Gear, the family of its meshes, and the body whose teeth these are: one of equal planets."""
    member: int
    """{0, 1}: whether it is gear 1 or gear 2 of the pair."""
    flank: int
    """Flank that a positive torque on the loaded body presses: +1 or -1; a negative one presses the other."""
    meshes: tuple[int, ...]
    """Numbers of the meshes that one tooth passes, one after the other."""
    cycles: float
    """Contacts of one flank per revolution of the loaded body, all these meshes together."""


def tooth_exposures(gearbox: Gearbox, body: str) -> tuple[ToothExposure, ...]:
    """Tell what the teeth of all gears meet per revolution of a body; of equal planets each by itself.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [round(one.cycles, 4) for one in tooth_exposures(gearbox, "carrier") if one.gear == "sun"]
    [14.1429]
    """
    spins = gearbox.train.rolling_speeds(body, 1.0)
    forces = gearbox.train.static_mesh_forces(_torque_on(gearbox, body))
    exposures: dict[tuple[str, str, str], ToothExposure] = {}
    for mesh in gearbox.meshes:
        for member, holder in enumerate((mesh.pinion, mesh.gear)):
            gear = (mesh.pair.pinion, mesh.pair.gear)[member]
            if (gear.name, mesh.family, holder) in exposures:
                continue
            passed = tuple(
                number
                for number, other in enumerate(gearbox.meshes)
                if other.family == mesh.family and (other.pinion, other.gear)[member] == holder
            )
            opposite = member == 1 and gear.internal
            sign = 1 if forces[mesh.name] >= 0.0 else -1
            exposures[gear.name, mesh.family, holder] = ToothExposure(
                gear=gear.name,
                family=mesh.family,
                holder=holder,
                member=member,
                flank=-sign if opposite else sign,
                meshes=passed,
                cycles=len(passed) * abs(_against_frame(spins, mesh, holder)),
            )
    return tuple(exposures.values())


def distinct(teeth: Iterable[ToothExposure]) -> tuple[ToothExposure, ...]:
    """One of equal planets for all of them: each gear in each family once."""
    found: dict[tuple[str, str], ToothExposure] = {}
    for one in teeth:
        found.setdefault((one.gear, one.family), one)
    return tuple(found.values())


def bearing_turns(gearbox: Gearbox, body: str) -> dict[str, float]:
    """Revolutions of the rings of each bearing against each other per revolution of a body, without sign.

    Examples
    --------
    A planet turns on its pin by the teeth of the ring over its own per turn of the carrier:

    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> round(bearing_turns(gearbox, "carrier")["pl_a_1"], 6), round(99 / 39, 6)
    (2.538462, 2.538462)
    """
    spins = gearbox.train.rolling_speeds(body, 1.0)
    return {
        bearing.name: abs(spins.get(bearing.body, 0.0) - spins.get(bearing.on, 0.0)) for bearing in gearbox.bearings
    }


def _against_frame(spins: Mapping[str, float], mesh: Mesh, holder: str) -> float:
    return spins.get(holder, 0.0) - spins.get(mesh.frame, 0.0)


def _torque_on(gearbox: Gearbox, body: str) -> dict[str, float]:
    """Torque of 1 N m on a body, held where the static load is held.

    Raises
    ------
    CaseError
        The body is one of those that hold the static load.
    """
    if body in gearbox.case.static_load.locked:
        held = ", ".join(gearbox.case.static_load.locked)
        raise gearbox.fault(f"loads.body = {body!r}: static_load.locked holds {held}; name the body at the other end")
    return {body: 1.0}
