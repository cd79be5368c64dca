"""What a steady response over speed costs, by level and by number of lines, and beside a run-up.

Measured by ``python benchmarks/run_all.py --part steady``.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from dynamics import stiffness_of
from elastic import SHAFTS, assembled, with_elastic
from timing import CASE, say, timed

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.units import RPM
from exugear.steady.balance.model import HarmonicBalanceModel
from exugear.steady.balance.neighbours import judged_speeds, with_needed_neighbours
from exugear.steady.balance.response import signals
from exugear.steady.point_solver import PointSolver, harmonic_balance_model
from exugear.steady.settings import METHODS, Method, SpeedRange, SteadySettings
from exugear.steady.steady_response import response_of
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.system import Assembly
from exugear.system.tooth_mesh.element import MeshCurve, MeshData
from exugear.transient.runup import simulate
from fe_ste.tools.arrays import Floats
from fe_ste.tools.threads import one_dense_thread

SPEEDS = "0:215:400"
DISSIPATION = {
    "damping times": {},
    "modal damping": {"modal_percent": 2.0},
    "modal damping, friction of teeth": {"modal_percent": 2.0, "tooth_friction": 0.05},
}
"""Keys of the section on damping by what they add."""
EXCITATIONS = (0, 1, 3, 10)
"""Numbers of stated excitations."""
AT_SPEEDS = 8
"""Speeds at which the gearbox with all bodies flexible is solved."""
LINES = ((10, 3), (10, 5), (16, 4), (20, 3))
"""Harmonics, and largest sum of multiples of combinations."""


def cost_of(assembly: Assembly, settings: SteadySettings) -> dict[str, Any]:
    """Cost of a response, and what it solved: once, for it takes seconds."""
    found: list[Any] = []
    cost = timed(lambda: found.append(response_of(assembly, settings)))
    return {
        "method": settings.method,
        "lines": len(found[0].lines.orders),
        "speeds": len(found[0].solved.speed),
        "processor_s": cost.processor,
        "wall_s": cost.wall,
    }


def curves_of(gearbox: Gearbox) -> dict[str, MeshCurve]:
    """Mesh stiffness of a gearbox with friction of the teeth of realistic size."""
    cycle = 2.0 * np.pi * np.arange(50) / 50
    friction = np.array([0.3 * np.cos(cycle), 0.01 + 0.002 * np.cos(cycle + 1.0), 1e-3 * np.sin(cycle)])
    return {
        name: MeshCurve(np.asarray(values), np.asarray(values), 1e5, friction=friction)
        for name, values in stiffness_of(gearbox).items()
    }


def dissipation_of(gearbox: Gearbox, speeds: SpeedRange, duration: float) -> dict[str, Any]:
    """Processor time of a response and of a run-up, variant bushing."""
    choice = Choice("bushing")
    curves = curves_of(gearbox)
    response = cost_of(assemble(gearbox, choice, curves), SteadySettings(speeds, at_resonances=False))
    return {**response, "run_up_s": run_up_of(gearbox, choice, curves, {}, duration)}


@one_dense_thread()
def excitations_of(gearbox: Gearbox, method: Method, count: int, speeds: Floats, rounds: int) -> dict[str, Any]:
    """Time per speed with torques on shafts and carrier, each of one order, variant bushing; the best of some rounds.

    Signals are included; the averaged system, which is found once, is not.
    """
    bodies = ("hss", "lss", "carrier", "ims")
    torques = {
        f"torque_{n}": {"body": bodies[n % len(bodies)], "orders": [7 + 3 * n], "torque_N_m": [20.0]}
        for n in range(count)
    }
    assembly = assemble(gearbox.varied({"excitations": torques}), Choice("bushing"), stiffness_of(gearbox))
    model = harmonic_balance_model(assembly, speeds, method=method)
    best = np.full(len(speeds), np.inf)
    for _ in range(rounds):
        solver = PointSolver(model, method)
        for n, speed in enumerate(speeds):
            begin = time.thread_time()
            signals(solver.model, solver.response(float(speed)))
            best[n] = min(best[n], time.thread_time() - begin)
    lines = len(model.lines.orders)
    return {"excitations": count, "method": method, "lines": lines, "speed_s": float(best.mean())}


def measure_excitations(quick: bool) -> dict[str, Any]:
    """Cost of stated excitations by method, from 30 to 215 rpm of the carrier."""
    gearbox = Gearbox.from_toml(CASE)
    rows = []
    for method in METHODS:
        slow = method == "nonlinear"
        speeds = np.linspace(30.0, 215.0, (2 if quick else 3) if slow else 20) * RPM
        for count in EXCITATIONS:
            rows.append(excitations_of(gearbox, method, count, speeds, 2 if slow or quick else 8))
            say(f"excitations: {method}, {count}")
    return {"rows": rows}


def whole_of(gearbox: Gearbox, speeds: SpeedRange) -> dict[str, Any]:
    """Processor time of the response of the gearbox with all its bodies flexible, at a few speeds.

    The averaged system comes first, then the choice of the orders that the flexible ring gear couples.
    """
    assembly = assembled(gearbox, "flexible")
    at = np.linspace(0.4, 1.0, AT_SPEEDS) * speeds.values[-1]
    models: list[HarmonicBalanceModel] = []
    prepared = timed(lambda: models.append(harmonic_balance_model(assembly, at)))
    chosen = timed(lambda: models.append(with_needed_neighbours(models[0], judged_speeds(at, ()))[0]))
    solver = PointSolver(models[1], "parametric")
    solver.response(float(at[0]))  # loads the compiled code
    solved = timed(lambda: [signals(solver.model, solver.response(float(speed))) for speed in at])
    return {
        "coordinates": assembly.size,
        "lines_at_most": len(models[0].lines.orders),
        "lines": len(models[1].lines.orders),
        "prepared_s": prepared.processor,
        "chosen_s": chosen.processor,
        "speed_s": solved.processor / len(at),
    }


def run_up_of(
    gearbox: Gearbox, choice: Choice, stiffness: Mapping[str, MeshData], bodies: dict[str, ElasticBody], duration: float
) -> float:
    """Processor time of a run-up with its results stored, s."""
    given = gearbox, choice, stiffness
    with tempfile.TemporaryDirectory() as folder:
        simulate(*given, folder, bodies=bodies, duration=0.01)  # loads the compiled code
        return timed(lambda: simulate(*given, folder, bodies=bodies, duration=duration)).processor


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    gearbox = Gearbox.from_toml(CASE)
    on_shafts = with_elastic(gearbox, SHAFTS)
    elastic = reduced_bodies(on_shafts, gearbox.case.default_inertias)
    cases = {"rigid": (gearbox, {}), "bushing": (gearbox, {}), "flexible": (on_shafts, elastic)}
    assemblies = {
        variant: assemble(case, Choice(variant), stiffness_of(gearbox), bodies)
        for variant, (case, bodies) in cases.items()
    }
    speeds = SpeedRange.from_text("0:215:20" if quick else SPEEDS)
    for level in METHODS:  # loads the compiled code
        response_of(assemblies["bushing"], SteadySettings(SpeedRange.from_text("10:20:2"), level, at_resonances=False))
    rows = []
    for variant, assembly in assemblies.items():
        for level in METHODS:
            for refined in (False, True):
                settings = SteadySettings(speeds, level, at_resonances=refined)
                rows.append({"variant": variant, "refined": refined, **cost_of(assembly, settings)})
        say(f"steady: {variant}")
    growth = [
        {"harmonics": h, "combinations": c}
        | cost_of(assemblies["bushing"], SteadySettings(speeds, "parametric", h, c, at_resonances=False))
        for h, c in LINES
    ]
    duration = 1.0 if quick else 30.0
    run_ups = {
        variant: run_up_of(case, Choice(variant), stiffness_of(case), bodies, duration)
        for variant, (case, bodies) in cases.items()
    }
    dissipation = [
        {"what": what, **dissipation_of(gearbox.varied({"damping": keys}), speeds, duration)}
        for what, keys in DISSIPATION.items()
    ]
    coordinates = {variant: assembly.size for variant, assembly in assemblies.items()}
    return {
        "responses": rows,
        "growth": growth,
        "run_ups": run_ups,
        "dissipation": dissipation,
        "coordinates": coordinates,
        "whole": whole_of(gearbox, speeds),
    }
