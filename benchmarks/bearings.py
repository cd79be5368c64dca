"""What non-linear bearings cost: a row of rollers or balls beside a linear connector, and runs of the GRC with them.

Measured by ``python benchmarks/run_all.py``. All take their turns in one process, round by round; a ratio is that of
one round, the tables have medians.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from dynamics import stiffness_of
from timing import CASE, median, say, timed

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bearings.rolling.point_contact import rolling_arrays
from exugear.system.bearings.rolling.rows import BallRow, RollerRow, RollingRow
from exugear.system.build import assemble
from exugear.system.kernels.rolling import (
    RollingArrays,
    rolling_force,
    rolling_memory,
    rolling_tangent,
)
from exugear.system.loads import LoadTable
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.transient.compiled.equations import add_connectors, gather_places, place_bodies
from exugear.transient.compiled.integrator import adams
from exugear.transient.compiled.packing import Equations, Work, equations_of, work_for
from exugear.transient.compiled.solver import CompiledSystem
from fe_ste.tools.arrays import Floats
from fe_ste.tools.compilation import kernel

LOAD = {"carrier": 240e3, "hss": -3000.0}
STEP = 1.0 / 60e3
RUN_UP = 30.0
FEW = ("ims_a", "ims_bc", "hss_a", "hss_bc")
"""Bearings of the two fastest shafts."""
ROWS: dict[str, RollingRow] = {
    "20 cylindrical rollers": RollerRow(
        element_diameter=0.030,
        pitch_diameter=0.225,
        element_count=20,
        effective_length=0.060,
        profile_factor=0.00035,
        radial_clearance=40e-6,
    ),
    "16 balls": BallRow(element_diameter=0.030, pitch_diameter=0.225, element_count=16, radial_clearance=10e-6),
}


@kernel
def linear_connectors(count: int, q: Floats, v: Floats, equations: Equations, work: Work) -> None:
    """Move all connectors and take their forces, so many times."""
    place_bodies(q, v, equations.bodies, work)
    gather_places(q, v, equations.places, work)
    for _ in range(count):
        add_connectors(q, equations.bodies, equations.connectors, equations.pairs, work)


@kernel
def rows_forces(count: int, strains: Floats, rate: Floats, rolling: RollingArrays, out: Floats) -> None:
    """Take forces, damping and energy of a row, so many times, while the cage turns."""
    for n in range(count):
        rolling_force(0, strains[n % len(strains)], rate, 1e-3 * n, rolling, out)


@kernel
def rows_tangents(count: int, strains: Floats, rolling: RollingArrays, out: Floats) -> None:
    """Take the tangent of a row, so many times."""
    for n in range(count):
        rolling_tangent(0, strains[n % len(strains)], 1e-3 * n, rolling, out)


def loaded_strains() -> Floats:
    """Displacements (64, 6) about a radial load that half of the elements carry, with some tilt."""
    random = np.random.default_rng(0)
    strains = random.normal(size=(64, 6)) * [1e-6, 3e-6, 0.0, 1e-4, 1e-4, 0.0]
    strains[:, 0] += 65e-6
    return strains


def compare_rows(assembly: Assembly, rounds: int) -> list[dict[str, Any]]:
    """Microseconds of a linear connector, and of forces and tangent of each kind of row."""
    equations = equations_of(assembly, LoadTable(LOAD))
    start = accelerating_start(assembly, LOAD)
    work = work_for(equations, start.q, start.v)
    strains, rate, tangent = loaded_strains(), np.full(6, 1e-3), np.empty((6, 6))
    count, connectors = 20000, len(assembly.connector_names)
    works: dict[str, tuple[Callable[[], None], int]] = {
        "linear connector": (lambda: linear_connectors(count, work.q, work.v, equations, work), count * connectors)
    }
    for name, row in ROWS.items():
        arrays = rolling_arrays([(row,)], [1.0], [4e-6], [0.43], [0.1])
        works[f"{name}, forces"] = (
            lambda arrays=arrays: rows_forces(count, strains, rate, arrays, rolling_memory(arrays)),
            count,
        )
        works[f"{name}, tangent"] = lambda arrays=arrays: rows_tangents(count, strains, arrays, tangent), count
    found = [
        {name: 1e6 * timed(work).processor / times for name, (work, times) in works.items()} for _ in range(rounds + 1)
    ][1:]
    say("bearings: rows")
    linear = "linear connector"
    return [
        {
            "row": name,
            "microseconds": median(one[name] for one in found),
            "ratio": median(one[name] / one[linear] for one in found),
        }
        for name in works
    ]


def nonlinear(gearbox: Gearbox, names: tuple[str, ...]) -> Gearbox:
    """Let some bearings follow their rollers, with turning cages; their loads are no longer stated."""
    changes: dict[str, Any] = {}
    for name in names:
        catalogue = gearbox.case.bearings[name].catalogue
        assert catalogue is not None
        stated = catalogue.model_dump(exclude_unset=True, exclude={"radial_load_kN", "axial_load_kN"})
        changes |= {f"bearings.{name}.catalogue": stated}
        changes |= {f"bearings.{name}.model": "iso16281", f"bearings.{name}.cage": "turning"}
    return gearbox.varied(changes)


def compare_runs(gearbox: Gearbox, rounds: int, steps: int) -> list[dict[str, Any]]:
    """Microseconds of a step with no, some and all bearings of the variant bushing non-linear."""
    every = tuple(name for name, section in gearbox.case.bearings.items() if section.catalogue is not None)
    rows, systems = [], []
    for names in ((), FEW, every):
        assembly = assemble(nonlinear(gearbox, names), Choice("bushing"), stiffness_of(gearbox))
        start = accelerating_start(assembly, LOAD)
        rolling = assembly.connectors.rolling
        systems.append((assembly, start))
        rows.append(
            {
                "bearings": int(np.count_nonzero(np.diff(rolling.first))),
                "rows": len(rolling.layout),
                "elements": int(rolling.layout[:, 1].sum()),
                "table_MB": rolling.tables.nbytes / 1e6,
            }
        )
    q, v = np.zeros((2, steps, systems[0][0].size))

    def cost(assembly: Assembly, start: Any) -> float:
        system = CompiledSystem(assembly, start.q, start.v, LoadTable(LOAD), STEP, adams(5))
        return 1e6 * timed(lambda: system.advance(0, q, v)).processor / steps

    found = [[cost(*system) for system in systems] for _ in range(rounds + 1)][1:]
    for n, row in enumerate(rows):
        row["microseconds_per_step"] = median(one[n] for one in found)
        row["ratio"] = median(one[n] / one[0] for one in found)
        row["run_up_s"] = row["microseconds_per_step"] * 1e-6 * RUN_UP / STEP
        added = median(one[n] - one[0] for one in found)
        row["added_per_row"] = added / row["rows"] if row["rows"] else 0.0
    say("bearings: runs")
    return rows


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    gearbox = Gearbox.from_toml(CASE)
    rounds = 1 if quick else 7
    linear = assemble(gearbox, Choice("bushing"), stiffness_of(gearbox))
    return {
        "rounds": rounds,
        "step": STEP,
        "run_up": RUN_UP,
        "rows": compare_rows(linear, rounds),
        "runs": compare_runs(gearbox, rounds, 500 if quick else 6000),
    }
