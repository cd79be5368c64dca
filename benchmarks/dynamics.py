"""What a second of gearbox costs: ways to solve the same equations, run-ups, accuracy, growth with the model.

Measured by ``python benchmarks/run_all.py``. All ways take their turns in one process, round by round; a ratio is that
of one round, the tables have medians. Memory and run-ups have a process each.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from timing import CASE, Cost, median, median_row, peak_memory, result, say, start, timed

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.project import Project
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.transient.compiled.integrator import RUNGE_KUTTA as RK4
from exugear.transient.compiled.integrator import Method, adams, choose_integration, methods_of
from exugear.transient.compiled.solver import CompiledSystem, Observer
from exugear.transient.plan import SAMPLE_RATE
from exugear.transient.runup import BAND, simulate

LOAD = {"carrier": 240e3, "hss": -3000.0}
RATED = {"carrier": 240e3, "hss": -2945.12}
START_SPEED = -4.8
STEP = 1.0 / 60e3
FREQUENCIES = (1e3, 3e3, 6.4e3)
FULL_NEWTON = "generalized-alpha, full Newton"
MODIFIED_NEWTON = "generalized-alpha, modified Newton"
RUNGE_KUTTA = "RK44 of Exudyn"
ADAMS = adams(5)
MULTISTEP = methods_of("adams")
OWN_METHODS = {method.name: method for method in (RK4, *MULTISTEP)}
"""Methods of the compiled solver by name."""


def stiffness_of(gearbox: Gearbox) -> dict[str, np.ndarray]:
    """Mesh stiffness of 50 positions with harmonics as strong as tables have them, N/m; cost does not depend on it."""
    cycle = 2.0 * np.pi * np.arange(50) / 50
    shape = 1.0 + 0.05 * np.cos(cycle + 0.3) + 0.02 * np.cos(2 * cycle + 1.1) + 0.01 * np.cos(3 * cycle)
    mean = {"sun_planet": 3.77e9, "ring_planet": 4.85e9, "intermediate": 3.07e9, "high_speed": 1.93e9}
    return {name: mean.get(name, 3e9) * shape for name in gearbox.pairs}


# -- ways to solve the bushing variant -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """One way to solve the same equations: its name, cost of some steps, their number, and its time integration."""

    name: str
    cost_of: Callable[[int], Cost]
    steps: int
    method: str


def in_exudyn(
    assembly: Assembly, method: str, model: Literal["element", "loads", "python", "bare"]
) -> Callable[[int], Cost]:
    """Cost of steps of a model of Exudyn; it is imported when the first step is asked for."""
    begin = accelerating_start(assembly, LOAD, START_SPEED)

    def cost(steps: int) -> Cost:
        import exudyn_ways

        if model == "python":
            system = exudyn_ways.with_python_meshes(assembly, begin.q, begin.v, LOAD)
        elif model == "bare":
            system = exudyn_ways.without_meshes(assembly, begin.q, begin.v)
        else:
            system = exudyn_ways.system_of(assembly, begin.q, begin.v, LOAD, model)
        return exudyn_ways.integrate(system, steps, STEP, method)

    return cost


def by_compiled_solver(assembly: Assembly, method: Method) -> Callable[[int], Cost]:
    """Cost of steps of the compiled solver by a method, states kept."""
    begin = accelerating_start(assembly, LOAD, START_SPEED)

    def cost(steps: int) -> Cost:
        system = CompiledSystem(assembly, begin.q, begin.v, LoadTable(LOAD), STEP, method)
        q, v = np.zeros((2, steps, assembly.size))
        return timed(lambda: system.advance(0, q, v))

    return cost


def ways(assembly: Assembly, quick: bool) -> list[Way]:
    """All ways, slowest first."""
    share = 4 if quick else 1
    full, modified, runge = FULL_NEWTON, MODIFIED_NEWTON, RK4.name
    python = "Python function per mesh, numerical jacobian, generalized-alpha"
    return [
        Way(f"{python}, full Newton", in_exudyn(assembly, "full", "python"), 80 // share, full),
        Way(f"{python}, modified Newton", in_exudyn(assembly, "modified", "python"), 400 // share, modified),
        Way("user-function loads, RK44", in_exudyn(assembly, "RK44", "loads"), 400 // share, runge),
        Way(
            "one GenericODE2, compiled, generalized-alpha, modified Newton",
            in_exudyn(assembly, "modified", "element"),
            4000 // share,
            modified,
        ),
        Way("one GenericODE2, compiled, RK44", in_exudyn(assembly, "RK44", "element"), 2000 // share, runge),
        Way("no meshes at all, Exudyn RK44", in_exudyn(assembly, "RK44", "bare"), 2000 // share, ""),
        Way("compiled solver, RK4", by_compiled_solver(assembly, RK4), 60000 // share, runge),
        Way(f"compiled solver, {ADAMS.name}", by_compiled_solver(assembly, ADAMS), 60000 // share, ADAMS.name),
    ]


def compare_ways(assembly: Assembly, rounds: int, quick: bool) -> list[dict[str, Any]]:
    """Cost per step of each way, median of rounds, and how many times the compiled solver is faster."""
    found = ways(assembly, quick)
    for way in found:
        way.cost_of(2)  # compiles and warms up
    costs: dict[str, list[Cost]] = {way.name: [] for way in found}
    for number in range(rounds):
        for way in found:
            costs[way.name].append(way.cost_of(way.steps))
        say(f"ways: round {number + 1} of {rounds}")
    per_step = {way.name: [1e6 * cost.processor / way.steps for cost in costs[way.name]] for way in found}
    fastest = per_step[found[-1].name]
    return [
        {
            "way": way.name,
            "method": way.method,
            **size_of(assembly),
            "steps": way.steps,
            "simulated_s": way.steps * STEP,
            "wall_s": median(cost.wall for cost in costs[way.name]),
            "microseconds_per_step": median(per_step[way.name]),
            "ratio": median(c / f for c, f in zip(per_step[way.name], fastest, strict=True)),
            "run_up_s": median(per_step[way.name]) * 30.0 / STEP * 1e-6,
            "peak_memory_MB": result(start("dynamics.py", "--way", str(place)))["peak_memory_MB"],
        }
        for place, way in enumerate(found)
    ]


def shares_of_a_step(assembly: Assembly, rounds: int) -> dict[str, float]:
    """Share of a compiled step that goes when bearings, or meshes, are left out; gears rolling without load."""
    speeds = assembly.gearbox.train.rolling_speeds("carrier", START_SPEED)
    q = np.zeros(assembly.size)
    v = assembly.rolling_velocity(q, speeds)
    bare = {
        "all": assembly,
        "bearings": replace(assembly, connectors=assembly.connectors._replace(bodies=assembly.connectors.bodies[:0])),
        "meshes": replace(assembly, meshes=assembly.meshes.one(len(assembly.elements))),
    }
    costs: dict[str, list[float]] = {name: [] for name in bare}
    for _ in range(rounds):
        for name, one in bare.items():
            system = CompiledSystem(one, q, v, LoadTable(), STEP, ADAMS)
            out_q, out_v = np.zeros((2, 20000, one.size))
            costs[name].append(timed(lambda s=system, a=out_q, b=out_v: s.advance(0, a, b)).processor)
    return {
        name: median(1.0 - part / whole for part, whole in zip(costs[name], costs["all"], strict=True))
        for name in ("bearings", "meshes")
    }


# -- accuracy ------------------------------------------------------------------------------------------------------


def states(assembly: Assembly, rpm: float, step: float, method: str) -> tuple[np.ndarray, np.ndarray] | None:
    """States over 0.4 s at constant speed (rpm); None where Exudyn cut the step."""
    begin = accelerating_start(assembly, RATED, rpm * math.pi / 30.0)
    steps = round(0.4 / step)
    if method in OWN_METHODS:
        q, v = np.empty((2, steps, assembly.size))
        CompiledSystem(assembly, begin.q, begin.v, LoadTable(RATED), step, OWN_METHODS[method]).advance(0, q, v)
        return q, v
    import exudyn_ways

    system = exudyn_ways.system_of(assembly, begin.q, begin.v, RATED)
    solver = {FULL_NEWTON: "full", MODIFIED_NEWTON: "modified", RUNGE_KUTTA: "RK44"}[method]
    return exudyn_ways.trajectory(system, steps, step, solver)


def excitation_amplitudes(assembly: Assembly, rpm: float, step: float, method: str) -> np.ndarray:
    """Amplitudes of overall and high-speed DTE at the high-speed mesh frequency; NaN where Exudyn cut the step."""
    found = states(assembly, rpm, step, method)
    if found is None:
        return np.full(2, np.nan)
    every, half = max(1, round(1.25e-5 / step)), len(found[0]) // 2
    q, v = (np.ascontiguousarray(values[half::every]) for values in found)
    element = assembly.elements[assembly.mesh_names.index("high_speed")]
    cycle = element.cycles * q[:, assembly.spin[element.mesh.pinion]]
    window = np.hanning(len(q))
    observer = Observer(assembly, LoadTable(RATED))
    signals, _, _ = observer.observe(np.zeros(len(q)), q, v)
    high_speed = observer.layout["mesh_dte"].start + assembly.mesh_names.index("high_speed")
    values = signals[:, [observer.layout["overall_dte_angle"].start, high_speed]]
    values = values - window @ values / window.sum()
    return np.abs(2.0 * (window * np.exp(-2j * np.pi * cycle)) @ values) / window.sum()


def amplitude_errors(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Error of the overall and of the high-speed DTE at 1, 3 and 6.4 kHz against RK4 at 2.5 us."""
    order = gearbox.train.mesh_frequencies(math.pi / 30.0)["high_speed"]
    rows = []
    for variant in ("rigid", "bushing"):
        assembly = assemble(gearbox, Choice(variant), stiffness_of(gearbox))
        exact = {f: excitation_amplitudes(assembly, f / order, 2.5e-6, RK4.name) for f in FREQUENCIES}
        chosen = choose_integration(assembly, SAMPLE_RATE, BAND)
        kinds = [(RK4.name, step) for step in (5e-5, 2.5e-5, STEP, 1.25e-5)]
        kinds += [(method.name, step) for method in MULTISTEP for step in (2.5e-5, STEP, 1.25e-5)]
        others = [(method, STEP) for method in (RUNGE_KUTTA, FULL_NEWTON, MODIFIED_NEWTON)]
        for method, step in [*kinds, *others]:
            errors = [excitation_amplitudes(assembly, f / order, step, method) / exact[f] - 1.0 for f in FREQUENCIES]
            say(f"amplitudes: {variant}, {method} {1e6 * step:.4g} us")
            rows.append(
                {
                    "variant": variant,
                    "method": method,
                    "step": step,
                    "chosen": method == chosen.method.name and math.isclose(step, chosen.step),
                    "overall": [None if np.isnan(e[0]) else float(e[0]) for e in errors],
                    "high_speed": [None if np.isnan(e[1]) else float(e[1]) for e in errors],
                }
            )
    return rows


# -- growth --------------------------------------------------------------------------------------------------------


def synthetic(planets: int, stages: int) -> Gearbox:
    """Build a planetary stage with 3 to 8 planets followed by parallel stages, spur gears of module 8."""
    module = 8.0
    sun = 102 if planets == 7 else 96  # equal spacing: the teeth of sun and ring add up to a multiple of the planets
    ring = sun + 48
    body = {"mass_kg": 200.0, "axial_kg_m2": 5.0, "transverse_kg_m2": 4.0, "centre_of_mass_z_mm": 0.0}
    planet = {"mass_kg": 30.0, "axial_kg_m2": 0.2, "transverse_kg_m2": 0.15, "centre_of_mass_z_mm": 0.0}
    wheel = {"normal_module_mm": module, "face_width_mm": 100.0, "held_diameter_mm": 80.0}
    orbit = module * (sun + 24) / 2
    gears: dict[str, Any] = {
        "sun": {**wheel, "teeth": sun, "held_diameter_mm": 300.0},
        "planet": {**wheel, "teeth": 24},
        "ring": {
            **wheel,
            "teeth": ring,
            "internal": True,
            "held_diameter_mm": module * ring + 148.0,
            "tip_diameter_mm": module * (ring - 1.5),
        },
    }
    pairs: dict[str, Any] = {
        "sun_planet": {"pinion": "planet", "gear": "sun", "centre_distance_mm": orbit},
        "ring_planet": {"pinion": "planet", "gear": "ring", "centre_distance_mm": orbit},
    }
    angles = [360.0 * n / planets for n in range(planets)]
    bodies: dict[str, Any] = {
        "housing": {"fixed": True, "axis_position_mm": [0.0, 0.0], "gears_z_mm": {"ring": 0.0}},
        "carrier": {"axis_position_mm": [0.0, 0.0], "inertia": {"own": {**body, "axial_kg_m2": 8.0}}},
        "planet": {
            "carrier": "carrier",
            "orbit_radius_mm": orbit,
            "planet_angles_deg": angles,
            "gears_z_mm": {"planet": 0.0},
            "inertia": {"own": planet},
        },
        "shaft_1": {"axis_position_mm": [0.0, 0.0], "gears_z_mm": {"sun": 0.0}, "inertia": {"own": body}},
    }
    meshes: dict[str, Any] = {
        "sun_planet": {"pair": "sun_planet", "pinion_body": "planet", "gear_body": "shaft_1"},
        "ring_planet": {"pair": "ring_planet", "pinion_body": "planet", "gear_body": "housing"},
    }
    for n in range(2, stages + 1):
        z = 300.0 * (n - 1)
        gears[f"wheel_{n}"] = {**wheel, "teeth": 81}
        gears[f"pinion_{n}"] = {**wheel, "teeth": 25}
        pairs[f"stage_{n}"] = {"pinion": f"pinion_{n}", "gear": f"wheel_{n}", "centre_distance_mm": module * 53.0}
        bodies[f"shaft_{n - 1}"]["gears_z_mm"][f"wheel_{n}"] = z
        bodies[f"shaft_{n}"] = {
            "axis_position_mm": [module * 53.0 * (n - 1), 0.0],
            "gears_z_mm": {f"pinion_{n}": z},
            "inertia": {"own": {**body, "centre_of_mass_z_mm": z}},
        }
        meshes[f"stage_{n}"] = {"pair": f"stage_{n}", "pinion_body": f"shaft_{n}", "gear_body": f"shaft_{n - 1}"}
    support = {"radial_N_per_m": 1e9, "axial_N_per_m": 5e8, "tilt_N_m_per_rad": 1e6}
    bearings: dict[str, Any] = {}
    for name in bodies:
        on = {"on": "carrier"} if name == "planet" else {}
        if name != "housing":
            middle = 300.0 * (int(name[-1]) - 1) if name.startswith("shaft") else 0.0
            for end, offset in (("a", -100.0), ("b", 100.0)):
                bearings[f"{name}_{end}"] = {"body": name, "z_mm": middle + offset, "stiffness": support, **on}
    last = f"shaft_{stages}"
    return Gearbox.from_dict(
        {
            "name": f"{planets} planets, {stages} stages",
            "default_inertias": "own",
            "overall": {
                "input": "carrier",
                "output": last,
                "output_gear": f"pinion_{stages}" if stages > 1 else "sun",
            },
            "static_load": {"torques_N_m": {"carrier": 50e3}, "locked": [last]},
            "gears": gears,
            "pairs": pairs,
            "bodies": bodies,
            "meshes": meshes,
            "bearings": bearings,
            "load_cases": {"run_up": {"torques_N_m": {"carrier": 50e3}}},
        }
    )


def growth(rounds: int) -> list[dict[str, Any]]:
    """Microseconds per step of the compiled solver and of Exudyn over planets and stages."""
    import exudyn_ways

    models = [(planets, 1) for planets in range(3, 9)] + [(3, stages) for stages in (2, 3, 4)]
    rows, load = [], {"carrier": 50e3}
    for planets, stages in models:
        gearbox = synthetic(planets, stages)
        assembly = assemble(gearbox, Choice("bushing"), stiffness_of(gearbox))
        begin = accelerating_start(assembly, load)
        method = choose_integration(assembly, SAMPLE_RATE, BAND, step=STEP).method
        q, v = np.zeros((2, 10000, assembly.size))
        own, others = [], []
        for _ in range(rounds):
            system = CompiledSystem(assembly, begin.q, begin.v, LoadTable(load), STEP, method)
            own.append(1e2 * timed(lambda s=system, q=q, v=v: s.advance(0, q, v)).processor)
            other = exudyn_ways.system_of(assembly, begin.q, begin.v, load)
            others.append(5e3 * exudyn_ways.integrate(other, 200, STEP, "RK44").processor)
        rows.append(
            {
                "planets": planets,
                "stages": stages,
                **size_of(assembly),
                "compiled_microseconds_per_step": median(own),
                "exudyn_microseconds_per_step": median(others),
                "ratio": median(e / o for e, o in zip(others, own, strict=True)),
            }
        )
    say("growth with planets and stages: done")
    return rows


def size_of(assembly: Assembly) -> dict[str, int]:
    """Bodies, meshes, bearings, coordinates."""
    return {
        "bodies": len(assembly.bodies),
        "meshes": len(assembly.elements),
        "bearings": len(assembly.connector_names),
        "coordinates": assembly.size,
    }


# -- run-ups -------------------------------------------------------------------------------------------------------


def run_up(variant: str, duration: float, tables: Path | None = None) -> dict[str, Any]:
    """Run up with results stored, in this process; by the law `table` with the tables of a folder, if one is given."""
    gearbox = Gearbox.from_toml(CASE)
    choice, stiffness = Choice(variant), stiffness_of(gearbox)
    if tables is not None:
        choice = Choice(variant, "table")
        stiffness = Project(gearbox, tables, choice).stiffness()
    with tempfile.TemporaryDirectory() as directory:
        simulate(gearbox, choice, stiffness, directory, duration=0.01)  # loads the compiled code
        runs = []
        cost = timed(lambda: runs.append(simulate(gearbox, choice, stiffness, directory, duration=duration)))
        assembly = assemble(gearbox, choice, stiffness)
        chosen = choose_integration(assembly, SAMPLE_RATE, BAND)
        step = chosen.step
        return {
            "variant": variant,
            "law": choice.mesh_model,
            "method": chosen.method.name,
            **size_of(assembly),
            "simulated_s": runs[0].end,
            "wall_s": cost.wall,
            "processor_s": cost.processor,
            "step": step,
            "steps": round(duration / step),
            "microseconds_per_step": 1e6 * cost.processor * step / duration,
            "file_MB": runs[0].path.stat().st_size / 1e6,
            "peak_memory_MB": peak_memory(),
        }


def run_ups_apart(variants: list[str], duration: float, *options: str) -> list[dict[str, Any]]:
    """Run up in a process each, all at once."""
    running = [start("dynamics.py", "--duration", str(duration), "--run-up", name, *options) for name in variants]
    return [result(process) for process in running]


def run_ups(rounds: int, duration: float) -> dict[str, Any]:
    """Run-ups of both variants alone, and two of the bushing variant at once: medians of the wall time."""
    alone: dict[str, list[dict[str, Any]]] = {"rigid": [], "bushing": []}
    together, slowdowns = [], []
    for number in range(rounds):
        for variant, rows in alone.items():
            rows += run_ups_apart([variant], duration)
        pair = run_ups_apart(["bushing", "bushing"], duration)
        together.append(max(pair, key=lambda row: row["wall_s"]))
        slowdowns.append(together[-1]["wall_s"] / alone["bushing"][-1]["wall_s"])
        say(f"run-ups: round {number + 1} of {rounds}")
    return {
        "alone": [median_row(rows, "wall_s") for rows in alone.values()],
        "two_at_once": median_row(together, "wall_s"),
        "slowdown_of_two_at_once": median(slowdowns),
    }


def run_ups_by_tables(rounds: int, duration: float) -> dict[str, Any]:
    """Run-up of the bushing variant by the law `table`, its tables computed over all axes of the file before."""
    with tempfile.TemporaryDirectory() as folder:
        Project(Gearbox.from_toml(CASE), Path(folder)).tables(grid=True)
        say("run-ups: tables")
        rows = [run_ups_apart(["bushing"], duration, "--tables", folder)[0] for _ in range(rounds)]
    return median_row(rows, "wall_s")


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    gearbox = Gearbox.from_toml(CASE)
    assembly = assemble(gearbox, Choice("bushing"), stiffness_of(gearbox))
    rounds = 1 if quick else 5
    return {
        "rounds": rounds,
        "step": STEP,
        "ways": compare_ways(assembly, rounds, quick),
        "shares": shares_of_a_step(assembly, rounds),
        "run_up_rounds": 1 if quick else 3,
        "run_ups": run_ups(1, 1.0) if quick else run_ups(3, 30.0),
        "run_up_by_tables": None if quick else run_ups_by_tables(3, 30.0),
        "amplitudes": amplitude_errors(gearbox),
        "growth": growth(rounds),
    }


def main() -> None:
    """Measure what needs a process of its own: a run-up, or the memory of one way."""
    parser = argparse.ArgumentParser(description="Parts of run_all.py that need a process of their own.")
    parser.add_argument("--duration", type=float, default=30.0, help="simulated time of the run-up, s")
    parser.add_argument("--run-up", metavar="VARIANT")
    parser.add_argument("--tables", metavar="FOLDER", type=Path, help="results folder with tables of the law `table`")
    parser.add_argument("--way", type=int, metavar="NUMBER")
    options = parser.parse_args()
    if options.run_up:
        found = run_up(options.run_up, options.duration, options.tables)
    else:
        gearbox = Gearbox.from_toml(CASE)
        way = ways(assemble(gearbox, Choice("bushing"), stiffness_of(gearbox)), quick=True)[options.way]
        way.cost_of(way.steps)
        found = {"peak_memory_MB": peak_memory()}
    sys.stdout.write(json.dumps(found))


if __name__ == "__main__":
    main()
