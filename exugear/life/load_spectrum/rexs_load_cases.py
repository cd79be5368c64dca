"""Load cases of a REXS file as a table of loads: torque and speed of a body, and the share of the time of each."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from exugear.exchange.rexs.containers import read_rexs
from exugear.exchange.rexs.faults import RexsError
from exugear.exchange.rexs.to_case.bodies import find_bodies
from exugear.exchange.rexs.to_case.loads import Loads, loads_of
from exugear.exchange.rexs.to_case.notes import Notes
from exugear.exchange.rexs.to_case.places import Places
from exugear.exchange.rexs.tree import LoadCase, Model
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import RPM
from fe_ste.tools.arrays import Floats


def rexs_load_cases(gearbox: Gearbox, path: Path, body: str) -> tuple[Floats, Floats, Floats]:
    """Torques (N m), speeds (rad/s) and shares of the time, each (load cases,), on a body of the gearbox file.

    Parameters
    ----------
    gearbox : as `exugear import` makes it of the same REXS file: it gives bodies their names

    Raises
    ------
    RexsError
        No load cases, or one without torque on the body, a speed, or its share of the time.
    """
    model = read_rexs(path)
    notes = Notes()
    if not model.load_cases:
        raise RexsError(f"{path}: holds no load spectrum; expected load cases with their share of the time")
    places = Places(model)
    bodies = find_bodies(model, places, notes)
    notes.faults.tell()
    rows = []
    for case, loads in zip(model.load_cases, loads_of(model, places, bodies, notes), strict=True):
        where = f"{path}: load case {case.number}"
        if body not in loads.torques:
            known = ", ".join(loads.torques) or "no body"
            raise RexsError(f"{where}: no torque on {body!r}; it loads {known}")
        rows.append((loads.torques[body], _speed(gearbox, loads, body, where), _share(model, case, where)))
    torques, speeds, shares = np.array(rows).T
    return torques, speeds, shares / shares.sum()


def _speed(gearbox: Gearbox, loads: Loads, body: str, where: str) -> float:
    """Speed of the body, rad/s, from that of any body of the train."""
    for name, speed in loads.speeds.items():
        if name == body or name in gearbox.spinning:
            return gearbox.train.rolling_speeds(name, speed * RPM)[body]
    raise RexsError(f"{where}: no rotational_speed of a shaft")


def _share(model: Model, case: LoadCase, where: str) -> float:
    """Share of the time in percent; the old and the new name of the attribute are one here."""
    for unit in model.of_type("gear_unit"):
        share = unit.with_attributes(case.changes.get(unit.number, {})).quantity("operating_time_fraction", "%")
        if share is not None and share >= 0.0:
            return share
    raise RexsError(f"{where}: no operating_time_fraction of the gear_unit")
