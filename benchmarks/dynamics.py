"""What a second of gearbox costs: ways to put the meshes into Exudyn, the compiled solver, growth with the model.

    python benchmarks/dynamics.py            # all, four minutes on two free cores
    python benchmarks/dynamics.py --quick    # shorter stretches, two rounds, no run-ups

Writes ``dynamics.json`` and ``dynamics.md`` beside this file. All ways take their turns in one process, round by
round; a ratio is that of one round, the table has medians. The run-ups have a process each.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from exugear.assembly import Assembly, assemble
from exugear.channels import Channels
from exugear.compiled import CompiledSystem, LoadTable, Observer, choose_step
from exugear.gearbox import Gearbox
from exugear.kernels import stiffness_at
from exugear.mesh_element import MeshElement
from exugear.runup import BAND, SAMPLE_RATE, simulate
from exugear.statics import accelerating_start
from exugear.system import ExudynSystem, Loading, MeshRoute, exudyn, items

HERE = Path(__file__).parent
CASE = HERE.parent / "cases" / "grc750" / "gearbox.toml"
LOAD = {"carrier": 240e3, "hss": -3000.0}
RATED = {"carrier": 240e3, "hss": -2945.12}
STEP = 1.0 / 60e3
FREQUENCIES = (1e3, 3e3, 6.4e3)


def stiffness_of(gearbox: Gearbox) -> dict[str, np.ndarray]:
    """Mesh stiffness of 50 positions with harmonics as strong as tables have them, N/m; cost does not depend on it."""
    cycle = 2.0 * np.pi * np.arange(50) / 50
    shape = 1.0 + 0.05 * np.cos(cycle + 0.3) + 0.02 * np.cos(2 * cycle + 1.1) + 0.01 * np.cos(3 * cycle)
    mean = {"sun_planet": 3.77e9, "ring_planet": 4.85e9, "intermediate": 3.07e9, "high_speed": 1.93e9}
    return {name: mean.get(name, 3e9) * shape for name in gearbox.pairs}


# -- a mesh as a plain Python user function ------------------------------------------------------------------------


class PythonMesh:
    """One mesh as the textbook would write it: the law of `exugear.kernels` in plain Python on its own bodies."""

    def __init__(self, system: ExudynSystem, element: MeshElement) -> None:
        mesh = element.mesh
        names = dict.fromkeys(n for n in (mesh.pinion, mesh.gear, mesh.frame) if n in system.assembly.spin)
        start = {name: 6 * n for n, name in enumerate(names)}
        self.starts = [start.get(mesh.pinion), start.get(mesh.gear)]
        self.frame = start.get(mesh.frame)
        self.element, self.size = element, 6 * len(start)
        self.coefficients = system.assembly.meshes.stiffness[system.assembly.elements.index(element)]
        system.mbs.AddObject(
            items.ObjectGenericODE2(nodeNumbers=[system._nodes[n] for n in names], forceUserFunction=self.force)
        )

    def force(self, mbs: Any, t: float, item: int, q: Any, v: Any) -> list[float]:
        """Generalized force on the coordinates of the two gears and the frame."""
        e = self.element
        psi = q[self.frame + 5] if self.frame is not None else 0.0
        c, s = math.cos(psi), math.sin(psi)
        gradient, delta, rate = [0.0] * self.size, 0.0, 0.0
        for end, start in enumerate(self.starts):
            row = e.deflection[6 * end : 6 * end + 6]
            delta -= row[5] * psi
            if self.frame is not None:
                gradient[self.frame + 5] -= row[5]
            if start is None:
                continue
            for pair, place in ((0, e.place[end]), (3, (0.0, 0.0))):
                x, y = place[0] + q[start + pair], place[1] + q[start + pair + 1]
                lx, ly = c * x + s * y, c * y - s * x
                delta += row[pair] * (lx - place[0]) + row[pair + 1] * (ly - place[1])
                gradient[start + pair] += c * row[pair] - s * row[pair + 1]
                gradient[start + pair + 1] += s * row[pair] + c * row[pair + 1]
                if self.frame is not None:
                    gradient[self.frame + 5] += row[pair] * ly - row[pair + 1] * lx
            delta += row[2] * q[start + 2] + row[5] * q[start + 5]
            gradient[start + 2] += row[2]
            gradient[start + 5] += row[5]
        for i, entry in enumerate(gradient):
            rate += entry * v[i]
        pmc = e.phase + e.cycles * (q[self.starts[0] + 5] - psi)
        stiffness = stiffness_at.py_func(self.coefficients, len(e.stiffness), pmc)[0]
        scalar = stiffness * delta + e.damping * rate
        return [-scalar * entry for entry in gradient]


def with_python_meshes(assembly: Assembly, q: np.ndarray, v: np.ndarray) -> ExudynSystem:
    """Build the bushing variant with one plain Python object per mesh, without a jacobian of its own."""
    system = ExudynSystem(assembly, q, v, Loading(LOAD), with_meshes=False)
    for element in assembly.elements:
        PythonMesh(system, element)
    system.mbs.Assemble()
    return system


def integrate(system: ExudynSystem, steps: int, step: float, method: str) -> float:
    """Processor time (s) of some steps in Exudyn by RK44, or generalized-alpha with full or modified Newton."""
    settings = exudyn.SimulationSettings()
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps = steps * step, steps
    integration.verboseMode = 0
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.newton.useModifiedNewton = method == "modified"
    integration.explicitIntegration.dynamicSolverType = exudyn.DynamicSolverType.RK44
    settings.linearSolverType = exudyn.LinearSolverType.EigenSparse
    settings.solutionSettings.writeSolutionToFile = False
    explicit = method == "RK44"
    solver = exudyn.MainSolverExplicit() if explicit else exudyn.MainSolverImplicitSecondOrder()
    begin = time.process_time()
    solver.SolveSystem(system.mbs, settings)
    return time.process_time() - begin


# -- ways to solve the bushing variant -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Way:
    """One way to solve the same equations: its name, a function of the number of steps, and that number."""

    name: str
    time_of: Callable[[int], float]
    steps: int


def ways(assembly: Assembly, quick: bool) -> list[Way]:
    """All ways, slowest first."""
    start = accelerating_start(assembly, LOAD, -4.8)
    share = 4 if quick else 1

    def in_exudyn(method: str, route: MeshRoute = "element") -> Callable[[int], float]:
        return lambda steps: integrate(
            ExudynSystem(assembly, start.q, start.v, Loading(LOAD), route), steps, STEP, method
        )

    def python(method: str) -> Callable[[int], float]:
        return lambda steps: integrate(with_python_meshes(assembly, start.q, start.v), steps, STEP, method)

    def bare(steps: int) -> float:
        return integrate(ExudynSystem(assembly, start.q, start.v, Loading(), with_meshes=False), steps, STEP, "RK44")

    def compiled(steps: int) -> float:
        system = CompiledSystem(assembly, start.q, start.v, LoadTable(LOAD), STEP)
        q, v = np.empty((2, steps, assembly.size))
        begin = time.process_time()
        system.advance(0, q, v)
        return time.process_time() - begin

    return [
        Way("Python function per mesh, numerical jacobian, generalized-alpha, full Newton", python("full"), 80),
        Way("the same, modified Newton", python("modified"), 400 // share),
        Way("user-function loads, RK44", in_exudyn("RK44", "loads"), 400 // share),
        Way("one GenericODE2, compiled, generalized-alpha, modified Newton", in_exudyn("modified"), 4000 // share),
        Way("one GenericODE2, compiled, RK44", in_exudyn("RK44"), 2000 // share),
        Way("no meshes at all, Exudyn RK44", bare, 2000 // share),
        Way("compiled solver, RK4", compiled, 60000 // share),
    ]


def compare_ways(assembly: Assembly, rounds: int, quick: bool) -> list[dict[str, Any]]:
    """Microseconds per step of each way, median of rounds, and how many times the compiled solver is faster."""
    found = ways(assembly, quick)
    for way in found:
        way.time_of(2)  # compiles and warms up
    costs = {way.name: [] for way in found}
    for number in range(rounds):
        for way in found:
            costs[way.name].append(1e6 * way.time_of(way.steps) / way.steps)
            say(f"round {number + 1}: {way.name}: {costs[way.name][-1]:.4g} us per step")
    fastest = costs[found[-1].name]
    return [
        {
            "way": way.name,
            "steps": way.steps,
            "microseconds_per_step": statistics.median(costs[way.name]),
            "ratio": statistics.median(c / f for c, f in zip(costs[way.name], fastest, strict=True)),
            "seconds_for_30_s": statistics.median(costs[way.name]) * 30.0 / STEP * 1e-6,
        }
        for way in found
    ]


# -- accuracy ------------------------------------------------------------------------------------------------------


def excitation_amplitudes(assembly: Assembly, rpm: float, step: float, method: str) -> np.ndarray:
    """Amplitudes of overall and high-speed DTE at the high-speed mesh frequency, constant speed (rpm).

    NaN where Exudyn cut the step.
    """
    start = accelerating_start(assembly, RATED, rpm * math.pi / 30.0)
    steps = round(0.4 / step)
    q, v = np.empty((2, steps, assembly.size))
    if method == "RK4":
        CompiledSystem(assembly, start.q, start.v, LoadTable(RATED), step).advance(0, q, v)
    else:
        rows: list[np.ndarray] = []

        def keep(t: float, q: np.ndarray, v: np.ndarray) -> bool:
            rows.append(np.array([q, v]))
            return True

        ExudynSystem(assembly, start.q, start.v, Loading(RATED)).run(0.0, steps, step, keep, explicit=False)
        if len(rows) != steps + 1:  # Newton failed somewhere, and Exudyn went on with half the step
            return np.full(2, np.nan)
        q, v = np.array(rows[1:]).transpose(1, 0, 2)
    every = max(1, round(1.25e-5 / step))
    q, v = q[steps // 2 :: every], v[steps // 2 :: every]
    element = assembly.elements[assembly.mesh_names.index("high_speed")]
    cycle = element.cycles * q[:, assembly.spin[element.mesh.pinion]]
    window = np.hanning(len(q))
    channels = Channels(assembly)
    values = Observer(channels, LoadTable(RATED)).observe(np.zeros(len(q)), np.ascontiguousarray(q), v)[0]
    values = values[:, [1, 2 + assembly.mesh_names.index("high_speed")]]
    values = values - window @ values / window.sum()
    return np.abs(2.0 * (window * np.exp(-2j * np.pi * cycle)) @ values) / window.sum()


def amplitude_errors(gearbox: Gearbox, quick: bool) -> list[dict[str, Any]]:
    """Error of the overall and of the high-speed DTE at 1, 3 and 6.4 kHz against RK4 at 2.5 us."""
    order = gearbox.mesh_frequencies(math.pi / 30.0)["high_speed"]
    rows = []
    for variant in ("rigid", "bushing"):
        assembly = assemble(gearbox, variant, stiffness_of(gearbox))
        exact = {f: excitation_amplitudes(assembly, f / order, 2.5e-6, "RK4") for f in FREQUENCIES}
        kinds = [("RK4", step) for step in (5e-5, 2.5e-5, STEP, 1.25e-5)]
        for method, step in kinds if quick else [*kinds, ("generalized-alpha", STEP)]:
            errors = {f: excitation_amplitudes(assembly, f / order, step, method) / exact[f] - 1.0 for f in FREQUENCIES}
            say(f"{variant}, {method} {1e6 * step:.4g} us: {errors}")
            chosen = method == "RK4" and math.isclose(step, choose_step(assembly, SAMPLE_RATE, BAND))
            rows.append(
                {
                    "variant": variant,
                    "method": method,
                    "step": step,
                    "chosen": chosen,
                    "overall": [float(errors[f][0]) for f in FREQUENCIES],
                    "high_speed": [float(errors[f][1]) for f in FREQUENCIES],
                }
            )
    return rows


# -- growth --------------------------------------------------------------------------------------------------------


def synthetic(planets: int, stages: int) -> Gearbox:
    """Build a planetary stage with 3 to 8 planets followed by parallel stages, spur gears of module 8."""
    module = 8.0
    body = {"mass_kg": 200.0, "axial_kg_m2": 5.0, "transverse_kg_m2": 4.0, "centre_of_mass_z_mm": 0.0}
    planet = {"mass_kg": 30.0, "axial_kg_m2": 0.2, "transverse_kg_m2": 0.15, "centre_of_mass_z_mm": 0.0}
    wheel = {"normal_module_mm": module, "face_width_mm": 100.0, "held_diameter_mm": 80.0}
    orbit = module * 60.0
    gears: dict[str, Any] = {
        "sun": {**wheel, "teeth": 96, "held_diameter_mm": 300.0},
        "planet": {**wheel, "teeth": 24},
        "ring": {**wheel, "teeth": 144, "internal": True, "held_diameter_mm": 1300.0, "tip_diameter_mm": 1140.0},
    }
    pairs: dict[str, Any] = {
        "sun_planet": {"pinion": "planet", "gear": "sun", "centre_distance_mm": orbit},
        "ring_planet": {"pinion": "planet", "gear": "ring", "centre_distance_mm": orbit},
    }
    angles = [360.0 * n / planets for n in range(planets)]
    bodies: dict[str, Any] = {
        "housing": {"fixed": True, "axis_position_mm": [0.0, 0.0], "wheels_z_mm": {"ring": 0.0}},
        "carrier": {"axis_position_mm": [0.0, 0.0], "inertia": {"own": {**body, "axial_kg_m2": 8.0}}},
        "planet": {
            "carrier": "carrier",
            "orbit_radius_mm": orbit,
            "planet_angles_deg": angles,
            "wheels_z_mm": {"planet": 0.0},
            "inertia": {"own": planet},
        },
        "shaft_1": {"axis_position_mm": [0.0, 0.0], "wheels_z_mm": {"sun": 0.0}, "inertia": {"own": body}},
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
        bodies[f"shaft_{n - 1}"]["wheels_z_mm"][f"wheel_{n}"] = z
        bodies[f"shaft_{n}"] = {
            "axis_position_mm": [module * 53.0 * (n - 1), 0.0],
            "wheels_z_mm": {f"pinion_{n}": z},
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
    models = [(planets, 1) for planets in (3, 4, 5, 6, 8)] + [(3, stages) for stages in (2, 3, 4)]
    rows, load = [], {"carrier": 50e3}
    for planets, stages in models:
        gearbox = synthetic(planets, stages)
        assembly = assemble(gearbox, "bushing", stiffness_of(gearbox))
        start = accelerating_start(assembly, load)
        q, v = np.empty((2, 10000, assembly.size))
        own, exudyns = [], []
        for _ in range(rounds):
            system = CompiledSystem(assembly, start.q, start.v, LoadTable(load), STEP)
            begin = time.process_time()
            system.advance(0, q, v)
            own.append(1e6 * (time.process_time() - begin) / len(q))
            other = ExudynSystem(assembly, start.q, start.v, Loading(load))
            exudyns.append(1e6 * integrate(other, 200, STEP, "RK44") / 200)
        rows.append(
            {
                "planets": planets,
                "stages": stages,
                **size_of(assembly),
                "compiled_microseconds_per_step": statistics.median(own),
                "exudyn_microseconds_per_step": statistics.median(exudyns),
                "ratio": statistics.median(e / o for e, o in zip(exudyns, own, strict=True)),
            }
        )
        say(f"{planets} planets, {stages} stages: {rows[-1]['compiled_microseconds_per_step']:.3g} us per step")
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


def run_up(variant: str, duration: float) -> dict[str, Any]:
    """Run up with results stored, in this process."""
    gearbox = Gearbox.from_toml(CASE)
    with tempfile.TemporaryDirectory() as directory:
        simulate(gearbox, variant, stiffness_of(gearbox), directory, duration=0.01)  # loads the compiled code
        begin, busy = time.perf_counter(), time.process_time()
        run = simulate(gearbox, variant, stiffness_of(gearbox), directory, duration=duration)
        wall, busy = time.perf_counter() - begin, time.process_time() - busy
        assembly = assemble(gearbox, variant, stiffness_of(gearbox))
        step = choose_step(assembly, SAMPLE_RATE, BAND)
        return {
            "variant": variant,
            **size_of(assembly),
            "simulated": run.end,
            "wall": wall,
            "processor": busy,
            "step": step,
            "steps": round(duration / step),
            "microseconds_per_step": 1e6 * busy * step / duration,
            "file_MB": run.path.stat().st_size / 1e6,
            "peak_memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
        }


def run_ups_apart(variants: list[str], duration: float) -> list[dict[str, Any]]:
    """Run up in a process each, all at once."""
    command = [sys.executable, __file__, "--duration", str(duration), "--run-up"]
    running = [subprocess.Popen([*command, v], stdout=subprocess.PIPE, text=True) for v in variants]
    return [json.loads(process.communicate()[0]) for process in running]


def median_row(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Row of the median wall time."""
    return sorted(rows, key=lambda row: row["wall"])[len(rows) // 2]


def run_ups(rounds: int, duration: float) -> dict[str, Any]:
    """Run-ups of both variants alone, and two of the bushing variant at once."""
    alone = [median_row([run_ups_apart([v], duration)[0] for _ in range(rounds)]) for v in ("rigid", "bushing")]
    say(f"run-ups alone: {[row['wall'] for row in alone]} s")
    together = run_ups_apart(["bushing", "bushing"], duration)
    say(f"two bushing run-ups at once: {[row['wall'] for row in together]} s")
    return {"alone": alone, "two_at_once": together}


# -- report --------------------------------------------------------------------------------------------------------

BOUNDS = """What bounds each way, and what the bound would allow:

- Python function per mesh: full Newton differentiates each function numerically, two calls per coordinate and mesh in
  every step; modified Newton keeps the matrix, and what is left are the calls for the residual.
- User-function loads: nothing is shared between them, so a mesh reads its nodes and computes its force four to six
  times per stage.
- One GenericODE2: Exudyn's own right-hand side (the row without meshes) is most of it, the call into Python with lists
  of coordinates the rest. Meshes as a C++ object of Exudyn would save that rest.
- Compiled solver: bearings with the sines they need take 70 % of a step, meshes a quarter. No overhead is left;
  fewer operations need a linearised bearing law, more speed needs several runs side by side in vector units.
- Run-up: of the wall time of the bushing variant 70 % are steps, a fifth signals and energies of every raw sample, the
  rest filter and files. Signals in a second thread would save that fifth where a core is free.
"""


def table(head: list[str], rows: list[list[str]]) -> str:
    """Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def markdown(results: dict[str, Any]) -> str:
    """All tables."""
    machine = results["machine"]
    model = results["model"]
    parts = [
        "# Cost and accuracy of the dynamics\n",
        f"Written by `python benchmarks/dynamics.py`. {machine['cores']} cores ({machine['processor']}), Python "
        f"{machine['python']}, Exudyn {machine['exudyn']}, numba {machine['numba']}; load average at the start "
        f"{machine['load']:.1f}. GRC 750 kW, variant bushing: {model['bodies']} bodies, {model['meshes']} meshes, "
        f"{model['bearings']} bearings, {model['coordinates']} coordinates; step {1e6 * STEP:.2f} us for all. "
        f"Medians of {results['rounds']} rounds, ratios within a round. Costs per step are processor time of one core; "
        "the run-ups state wall time, too.\n",
        "## Ways to solve the same equations\n",
        table(
            ["way", "steps", "us per step", "times the compiled solver", "30 s would take"],
            [
                [
                    r["way"],
                    str(r["steps"]),
                    f"{r['microseconds_per_step']:.3g}",
                    f"{r['ratio']:.3g}",
                    f"{r['seconds_for_30_s']:.3g} s",
                ]
                for r in results["ways"]
            ],
        ),
        BOUNDS,
    ]
    if "run_ups" in results:
        rows = [("alone", r) for r in results["run_ups"]["alone"]]
        rows += [("two at once", r) for r in results["run_ups"]["two_at_once"]]
        parts += [
            "## Run-ups with results stored at 20 kHz\n",
            "Wall time above processor time is waiting for a core that others used.\n",
            table(
                [
                    "variant",
                    "",
                    "simulated",
                    "wall",
                    "processor time",
                    "step",
                    "steps",
                    "processor us per step",
                    "file",
                    "peak memory",
                ],
                [
                    [
                        r["variant"],
                        how,
                        f"{r['simulated']:g} s",
                        f"{r['wall']:.3g} s",
                        f"{r['processor']:.3g} s",
                        f"{1e6 * r['step']:.2f} us",
                        str(r["steps"]),
                        f"{r['microseconds_per_step']:.3g}",
                        f"{r['file_MB']:.0f} MB",
                        f"{r['peak_memory_MB']:.0f} MB",
                    ]
                    for how, r in rows
                ],
            ),
        ]
    parts += [
        "## Amplitude error at the high-speed mesh frequency\n",
        "Constant speed, against RK4 at 2.5 us; overall DTE and (in brackets) DTE of the high-speed mesh, percent. "
        "Step cut: Exudyn halved steps in which modified Newton failed, so it was no longer this step.\n",
        table(
            ["variant", "method", "step", *(f"{f / 1e3:g} kHz" for f in FREQUENCIES)],
            [
                [
                    r["variant"],
                    r["method"] + (" (chosen)" if r["chosen"] else ""),
                    f"{1e6 * r['step']:.2f} us",
                    *(percent(a, b) for a, b in zip(r["overall"], r["high_speed"], strict=True)),
                ]
                for r in results["amplitudes"]
            ],
        ),
        "## Growth with the model\n",
        "Spur gearboxes: a planetary stage, then parallel stages; variant bushing; us per step.\n",
        table(
            ["planets", "stages", "bodies", "meshes", "bearings", "compiled", "Exudyn RK44", "ratio"],
            [
                [
                    *(str(r[key]) for key in ("planets", "stages", "bodies", "meshes", "bearings")),
                    f"{r['compiled_microseconds_per_step']:.3g}",
                    f"{r['exudyn_microseconds_per_step']:.3g}",
                    f"{r['ratio']:.3g}",
                ]
                for r in results["growth"]
            ],
        ),
    ]
    return "\n".join(parts)


def percent(overall: float, mesh: float) -> str:
    """Two errors as shown."""
    return "step cut" if math.isnan(overall) else f"{100 * overall:.3f} ({100 * mesh:.3f})"


def say(text: str) -> None:
    """Tell on standard error how far it is."""
    sys.stderr.write(text + "\n")


def main() -> None:
    """Run all and write the tables."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="shorter stretches, two rounds, no run-ups")
    parser.add_argument("--duration", type=float, default=30.0, help="simulated time of the run-ups, s")
    parser.add_argument("--run-up", metavar="VARIANT", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run_up:
        sys.stdout.write(json.dumps(run_up(options.run_up, options.duration)))
        return
    gearbox = Gearbox.from_toml(CASE)
    assembly = assemble(gearbox, "bushing", stiffness_of(gearbox))
    rounds = 2 if options.quick else 5
    results: dict[str, Any] = {
        "machine": {
            "cores": os.cpu_count(),
            "processor": platform.processor() or platform.machine(),
            "python": platform.python_version(),
            "exudyn": version("exudyn"),
            "numba": version("numba"),
            "load": os.getloadavg()[0],
        },
        "rounds": rounds,
        "model": size_of(assembly),
        "ways": compare_ways(assembly, rounds, options.quick),
    }
    if not options.quick:
        results["run_ups"] = run_ups(3, options.duration)
    results["amplitudes"] = amplitude_errors(gearbox, options.quick)
    results["growth"] = growth(rounds)
    text = json.dumps(results, indent=1).replace("NaN", "null") + "\n"
    (HERE / "dynamics.json").write_text(text, encoding="utf-8")
    (HERE / "dynamics.md").write_text(markdown(results), encoding="utf-8")
    say(f"written {HERE / 'dynamics.md'}")


if __name__ == "__main__":
    main()
