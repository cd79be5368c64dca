"""Tables that stresses of a life are taken from: around the places where gears stand, where no grid of the file says.

A table of one load knows gears that stand straight. Where contact is solved at the static misalignment, stresses come
from tables of their own: over the loads of the life, and over misalignments from straight to beyond the static ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from exugear.life.load_spectrum.counted import CountedLoads
from exugear.system.assembly import Assembly
from exugear.system.operating_points import contact_places
from exugear.system.statics import static_state
from exugear.system.tooth_mesh.laws.registry import LAWS
from exugear.system.tooth_mesh.tables import TableRequest, requested_tables
from fe_ste.transmission_error.table import MeshTable, TableError, TableInput

TORQUE_SHARES = (0.35, 0.7, 1.0)
"""Torques over the static one; a larger one follows from the loads."""
REACH_STEP = 0.25
"""Step to which the largest of them is rounded up, so that loads that change a little leave tables as they are."""
ROOM = 1.25
"""How far misalignments reach beyond the static one at the largest torque: planets share loads unequally."""
LARGEST_STEP, ROUNDING = 15e-6, 2.5e-6
"""Largest step of misalignment as an opening over the face, and what its ends are rounded to, m."""
STRAIGHT = 1e-6
"""Opening over the face up to which gears stand straight, m."""


def life_requests(assembly: Assembly, counted: CountedLoads, folder: Path) -> list[TableRequest]:
    """Tables that stresses of a life come from, and those of them that are in a results folder.

    Of a law that reads grids these are its grids; else see `stress_requests`.
    """
    grid = LAWS[assembly.mesh_law].needs_axes
    requests = requested_tables(assembly.gearbox, folder, grid=grid)
    if grid:
        return requests
    return stress_requests(assembly, requests, counted, folder)


def stress_requests(
    assembly: Assembly, requests: Iterable[TableRequest], counted: CountedLoads, folder: Path
) -> list[TableRequest]:
    """Tables of a life: those that are wanted, or wider ones where gears stand off straight and contact can be solved.

    Parameters
    ----------
    requests : of the pairs; those with axes of the file stay as they are
    folder : results folder: wider tables are kept in ``stress/<pair>.states.nc``

    Raises
    ------
    BalanceError
        The static load cannot be held.
    """
    tilts = _misalignments(assembly)
    reaches = _reaches(assembly, counted)
    found = []
    for request in requests:
        wanted = request.wanted
        width = wanted.pair.face_width
        far = max(map(abs, tilts.get(request.name, (0.0,)))) * width
        if len(wanted.misalignment) > 1 or far < STRAIGHT:
            found.append(request)
            continue
        found.append(_wider(request, tilts[request.name], reaches.get(request.name, 1.0), folder))
    return found


def _misalignments(assembly: Assembly) -> dict[str, list[float]]:
    """Find the static misalignments of the meshes of each pair in the axes of its table, rad."""
    tilts: dict[str, list[float]] = {}
    if assembly.contacts.contacts:
        state = static_state(assembly)
        for contact_place in contact_places(state.assembly, state.q).values():
            tilts.setdefault(contact_place.table.pair.name, []).append(contact_place.misalignment)
    return tilts


def _reaches(assembly: Assembly, counted: CountedLoads) -> dict[str, float]:
    """Largest torque of the loads over the static one by pair, at least 1."""
    largest = max(float(abs(source.torque).max()) for source in counted.sources)
    found: dict[str, float] = {}
    for mesh in assembly.gearbox.meshes:
        static = assembly.gearbox.pairs[mesh.pair.name].static_torque
        if static > 0.0:
            torque = largest * counted.mesh_forces[mesh.family] * mesh.pair.pinion.base_radius
            found[mesh.pair.name] = max(1.0, torque / static, found.get(mesh.pair.name, 1.0))
    return found


def _wider(request: TableRequest, tilts: Iterable[float], reach: float, folder: Path) -> TableRequest:
    """Ask for a pair's table over load and misalignment, and find it where it is kept."""
    static = request.wanted
    width = request.wanted.pair.face_width
    highest = math.ceil(reach / REACH_STEP - 1e-6) * REACH_STEP
    shares = TORQUE_SHARES if highest <= 1.0 else (*TORQUE_SHARES, highest)
    openings = [ROOM * highest * tilt * width for tilt in tilts]
    low = math.floor(min(0.0, *openings) / ROUNDING) * ROUNDING
    high = math.ceil(max(0.0, *openings) / ROUNDING) * ROUNDING
    steps = max(1, math.ceil((high - low) / LARGEST_STEP - 1e-6))
    nodes = [low + (high - low) * step / steps for step in range(steps + 1)]
    wanted = replace(
        static,
        torque=tuple(_rounded(static.torque[0] * share) for share in shares),
        misalignment=tuple(_rounded(node / width) for node in nodes),
    )
    path = folder / "stress" / f"{request.name}.states.nc"
    return TableRequest(request.name, wanted, path, _stored(path, wanted))


def _stored(path: Path, wanted: TableInput) -> MeshTable | None:
    try:
        return MeshTable.open(path, wanted)
    except TableError:
        return None


def _rounded(value: float) -> float:
    return float(f"{value:.12g}")
