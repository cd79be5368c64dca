"""The command `export --loads`: forces of a steady-state response on the housing, for finite-element programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from exugear.cli.case import read_gearbox
from exugear.cli.console import BadInputError
from exugear.cli.tables import Outcome
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.results.findings import Finding
from exugear.results.interface_loads import interface_loads, loads_csv, nastran_loads, standing_supports
from exugear.steady.steady_file import load_response
from exugear.system.bodies.of_gearbox import node_numbers
from fe_ste.tools.files import FileError, write_file

SPEED_TOLERANCE = 0.01
"""Largest relative difference of a computed speed from the one that is asked for."""


def export_loads(
    case: Path, response: Path, speed: float | None, to: Path | None, allow_dir: Path | None, as_json: bool, whole: bool
) -> None:
    """Write the forces on the housing; with a speed also as Nastran load cards."""
    folder = to or response.parent
    stem = f"{response.stem}-loads"
    names = [f"{stem}.csv", *([] if speed is None else [f"{stem}.bdf"])]
    existing = next((folder / name for name in names if (folder / name).exists()), None)
    if existing is not None:
        raise BadInputError(f"{existing}: exists already; specify another folder with --to")
    gearbox = read_gearbox(case, allow_dir, tell=not as_json)
    try:
        data = load_response(response)
    except FileError as error:
        raise BadInputError(f"--loads {error}; name a file that exugear steady has written") from error
    speeds = data["speed"].to_numpy()
    points = range(len(speeds)) if speed is None else [_nearest(speeds, speed)]
    numbers = _numbers(gearbox)
    try:
        loads = list(interface_loads(gearbox, data, points, numbers))
    except ValueError as error:
        raise BadInputError(f"--loads {response}: {error}") from error
    write_file(folder / names[0], loads_csv(loads))
    if speed is not None:
        write_file(folder / names[1], nastran_loads(loads[0]))
    rows = [{"seat": name, "node": numbers[name]} for name in loads[0].seats]
    carrying = [body.name for body in gearbox.bodies() if body.fixed and body.wheels]
    Outcome(
        verdict=f"{len(rows)} seats, {len(loads[0].frequency)} frequencies, {len(loads)} speeds",
        summary={
            "case": gearbox.source,
            "response": str(response),
            "speeds_rpm": [own.speed / RPM for own in loads],
            "files": [str(folder / name) for name in names],
            "seats": rows,
        },
        findings=[
            Finding("note", "moments are not included; bearings that resist tilting also transmit moments"),
            *(
                Finding("warning", f"mesh forces on the gears of {name} are not included; apply them separately")
                for name in carrying
            ),
        ],
        path=folder / names[-1],
    ).show(as_json, whole)


def _nearest(speeds: np.ndarray, speed: float) -> int:
    """Index of the computed speed next to one in rpm."""
    nearest = int(np.abs(speeds - RPM * speed).argmin())
    if abs(speeds[nearest] - RPM * speed) > SPEED_TOLERANCE * abs(RPM * speed):
        raise BadInputError(
            f"--speed {speed:g}: not computed; the response has {len(speeds)} speeds, the nearest is "
            f"{speeds[nearest] / RPM:.6g} rpm"
        )
    return nearest


def _numbers(gearbox: Gearbox) -> dict[str, int]:
    """Node number of each bearing on what stands still: that of its seat on a flexible housing, or counted from 1."""
    supports = standing_supports(gearbox)
    numbers = {bearing.name: number for number, bearing in enumerate(supports, start=1)}
    for body in gearbox.bodies():
        section = gearbox.case.bodies[body.family]
        if body.fixed and (section.external is not None or section.solid is not None):
            at_seats = node_numbers(gearbox, body.name)
            numbers |= {bearing.name: at_seats[bearing.name] for bearing in supports if bearing.on == body.name}
    return numbers
