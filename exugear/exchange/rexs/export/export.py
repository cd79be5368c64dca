"""Results of a gearbox put back into the REXS file that it was imported from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import exugear
from exugear.exchange.rexs import synonyms
from exugear.exchange.rexs.additions import OWN
from exugear.exchange.rexs.containers import read_rexs, with_additions
from exugear.exchange.rexs.export.dynamics import put_bearings, put_modes, put_runs
from exugear.exchange.rexs.export.names import Results
from exugear.exchange.rexs.export.origins import origins_of
from exugear.exchange.rexs.export.shafts import put_displacements, put_speeds
from exugear.exchange.rexs.export.stored import StoredResults
from exugear.exchange.rexs.export.teeth import (
    Target,
    check_same_gears,
    put_gears,
    put_pairs,
    put_static_forces,
    put_tables,
)
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.to_case.notes import Rules
from exugear.exchange.rexs.tree import Model
from exugear.gearbox.gearbox import Gearbox
from fe_ste.tools.display import Displayed


@dataclass(frozen=True)
class Exported(Displayed, line=": {named} attributes of REXS, {own} of exugear"):
    """A REXS file with results."""

    content: bytes
    """The file, of the same kind, version and encoding as the one that was read."""
    own: int
    """Attributes that REXS has no name for; they begin with ``custom_exugear_``."""
    named: int
    """Attributes of REXS."""
    replaced: tuple[str, ...]
    """Results of another program that these have taken the place of."""
    left_out: tuple[str, ...]
    """Files in the results folder that do not belong to the gearbox."""


def with_results(gearbox: Gearbox, folder: Path, path: str | Path, rules: Rules | None = None) -> Exported:
    """Put what is known of a gearbox into the REXS file that it was imported from.

    What its geometry and statics give is always there; tables, modes, bearings and runs as far as the results
    folder holds them. What belongs to the static load goes into the load case of the file that has its torque.

    Parameters
    ----------
    gearbox : imported from the file; values may have been edited since, names may not
    folder : its results
    path : the REXS file; it is read only
    rules : those that it was imported with

    Raises
    ------
    RexsError
        The file cannot be read, or is one of another gearbox.
    """
    model = read_rexs(path)
    imported = to_case(model, Path(path).name, rules=rules)
    check_same_gears(gearbox, imported.gearbox)
    target = Target(model, origins_of(imported.found), _static_load_case(gearbox, model))
    stored = StoredResults(gearbox, folder)
    results = Results(_version(model))
    unit = next((part.number for part in model.of_type("gear_unit")), next(iter(model.components)))
    results.put_own(unit, "program", "none", f"exugear {exugear.__version__}")
    results.put_own(unit, "case", "none", gearbox.name)
    for body, torque in gearbox.case.static_load.torques_N_m.items():
        results.put_own(unit, f"static_torque_{body}", "N m", torque, target.load_case)
    put_gears(results, gearbox, target)
    put_pairs(results, gearbox, target)
    put_static_forces(results, gearbox, target)
    put_tables(results, gearbox, stored.tables(), target)
    put_speeds(results, gearbox, target)
    put_bearings(results, gearbox, stored.duties(), target)
    put_modes(results, stored.modes(), unit, target.load_case)
    put_runs(results, gearbox, stored.runs(), target)
    if stored.loaded is not None:
        put_displacements(results, stored.loaded, target)
    content = with_additions(path, results.additions)
    own = sum(addition.name.startswith(OWN) for addition in results.additions)
    return Exported(content, own, len(results.additions) - own, _replaced(model, results), tuple(stored.left_out))


def _version(model: Model) -> tuple[int, int]:
    major, minor = model.version.split(".")[:2]
    return int(major), int(minor)


def _static_load_case(gearbox: Gearbox, model: Model) -> int | None:
    """Load case of the file whose torque at the input is that of the static load."""
    body = gearbox.case.overall.input
    static = gearbox.case.static_load.torques_N_m.get(body)
    for case in model.load_cases:
        known = gearbox.load_cases.get(f"load_case_{case.number}")
        if known is not None and known.torques.get(body) == static:
            return case.number
    return None


def _replaced(model: Model, results: Results) -> tuple[str, ...]:
    """Results in the file that are replaced by others."""
    told = []
    for addition in results.additions:
        part = model.components[addition.component]
        cases = {case.number: case.changes.get(addition.component, {}) for case in model.load_cases}
        there = part.attributes if addition.load_case is None else cases[addition.load_case]
        if synonyms.ATTRIBUTES.get(addition.name, addition.name) in there and not addition.name.startswith(OWN):
            told.append(f"{part}: {addition.name}")
    return tuple(told)
