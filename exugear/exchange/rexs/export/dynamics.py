"""Results on bearings, modes and runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from exugear.exchange.rexs.additions import OWN
from exugear.exchange.rexs.export.names import Results, stiffness_names
from exugear.exchange.rexs.export.teeth import Target, instance_of
from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from fe_ste.tools.arrays import Floats


def put_bearings(results: Results, gearbox: Gearbox, duties: Sequence[Mapping[str, Any]], target: Target) -> None:
    """Put what catalogue bearings bear: loads, stiffness at the operating point, pressure and life."""
    families = {bearing.name: bearing.family for bearing in gearbox.bearings}
    case = target.load_case
    for duty in duties:
        name = str(duty["bearing"])
        family = families.get(name, name)
        numbers = target.origins.bearings.get(family, ())
        instance = instance_of(name, family)
        if instance >= len(numbers):
            continue
        number = numbers[instance]
        results.put_own(number, "radial_load", "kN", float(duty["radial_load_kN"]), case)
        results.put_own(number, "axial_load", "kN", float(duty["axial_load_kN"]), case)
        results.put(number, "contact_pressure", "MPa", duty["contact_pressure_MPa"], case)
        results.put(number, "basic_rating_life", "MRev", duty["L10_Mrev"], case)
        results.put(number, "reference_rating_life", "MRev", duty["L10r_Mrev"], case)
        stiffness = in_axes(np.array(duty["stiffness_matrix_N_m_rad"]), target.origins.axes[number])
        for key, row, column, unit, factor in stiffness_names(results.version):
            results.put_named(number, key, unit, factor * float(stiffness[row, column]), case)


def in_axes(stiffness: Floats, axes: Floats) -> Floats:
    """Return a stiffness (6, 6) over x, y, z and angles about them in a bearing's axes u, v, w, rows of a (3, 3)."""
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = axes
    return np.asarray(turn @ stiffness @ turn.T)


def words_of(choice: Choice) -> str:
    """Choice as part of an attribute's name."""
    return "_".join(str(part) for part in (choice.variant, choice.mesh_law, choice.inertias)).replace("-", "_")


def put_modes(results: Results, modes: Mapping[Choice, xr.Dataset], unit: int, load_case: int | None) -> None:
    """Put eigenfrequencies and damping of the variants on the gear unit."""
    for choice, data in modes.items():
        moving = data["frequency"].to_numpy() > 0.0
        for key, name, sign in (("eigenfrequencies", "frequency", "Hz"), ("damping_ratios", "damping_ratio", "none")):
            values = tuple(data[name].to_numpy()[moving].tolist())
            results.put_own(unit, f"{key}_{words_of(choice)}", sign, values, load_case)


def put_runs(results: Results, gearbox: Gearbox, runs: Mapping[Choice, xr.Dataset], target: Target) -> None:
    """Put the largest and the mean mesh forces of runs in time on the stages."""
    families = {mesh.name: mesh for mesh in gearbox.meshes}
    numbers = {f"load_case_{case.number}": case.number for case in target.model.load_cases}
    for choice, data in runs.items():
        case = numbers.get(str(choice.load_case))
        ending = words_of(choice) if case is not None else f"{words_of(choice)}_{choice.load_case}"
        for name in data["mesh"].to_numpy().tolist():
            mesh = families[str(name)]
            stage = target.origins.pairs[mesh.pair.name][instance_of(mesh.name, mesh.family)]
            force = data["mesh_force"].sel(mesh=name)
            for key, value in (("mesh_force_maximum", force.max()), ("mesh_force_mean", force.mean())):
                if math.isfinite(float(value)):
                    results.put_named(stage, f"{OWN}{key}_{ending}", "N", float(value), case)
