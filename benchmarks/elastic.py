"""What elastic bodies cost: their reduction, a step with more and more of them, the same shaft in a floating frame.

Measured by ``python benchmarks/run_all.py``. All variants take their turns in one process, round by round; a ratio is
that of one round.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from dynamics import LOAD, stiffness_of
from timing import CASE, median, say, timed

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.signals import ENERGIES, POWERS, signal_layout
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.transient.compiled.integrator import Integration, choose_integration
from exugear.transient.compiled.solver import CompiledSystem
from exugear.transient.plan import SAMPLE_RATE
from exugear.transient.runup import BAND

SHAFTS = ("lss", "ims", "hss")
CARRIER = (*SHAFTS, "carrier")
EVERYTHING = (*CARRIER, "housing")
FLOATING = "hss"
EXUDYN_STEP = 1e-5


def with_elastic(gearbox: Gearbox, names: tuple[str, ...], **flexibility: str) -> Gearbox:
    """Vary a case so that only some bodies are elastic, each as its file says or as given here."""
    changes = {f"bodies.{name}.flexibility": "none" for name in EVERYTHING if name not in names}
    return gearbox.varied({**changes, **{f"bodies.{name}.flexibility": word for name, word in flexibility.items()}})


def assembled(gearbox: Gearbox, variant: str) -> Assembly:
    """Equations of a variant, its elastic bodies reduced first."""
    bodies = reduced_bodies(gearbox, gearbox.case.default_inertias) if variant == "flexible" else {}
    return assemble(gearbox, Choice(variant), stiffness_of(gearbox), bodies)


def reductions(gearbox: Gearbox) -> list[dict[str, Any]]:
    """Unknowns, coordinates and seconds of every elastic body, reduced anew."""
    with tempfile.TemporaryDirectory() as folder:
        first, second = Path(folder) / "first", Path(folder) / "second"
        bodies = reduced_bodies(gearbox, gearbox.case.default_inertias, first)
        shutil.copytree(first, second)  # another folder, for the process remembers what it took from the first
        begin = time.perf_counter()
        reduced_bodies(gearbox, gearbox.case.default_inertias, second)
        again = time.perf_counter() - begin
        size = sum(file.stat().st_size for file in first.iterdir()) / 1e6
    rows = [
        {
            "body": name,
            "unknowns": sum(body.reduced.summary.unknowns.values()),
            "coordinates": body.reduced.size,
            "seconds": body.reduced.summary.seconds,
        }
        for name, body in bodies.items()
    ]
    say("elastic bodies: reduced")
    return [*rows, {"body": "all, kept on disk", "seconds": again, "file_MB": size}]


class _Steps:
    """An assembly that takes steps, with and without signals."""

    def __init__(self, assembly: Assembly, chosen: Integration) -> None:
        start = accelerating_start(assembly, LOAD)
        loads = LoadTable(LOAD)
        self.number = 2000
        self.q, self.v = np.zeros((2, self.number, assembly.size))
        self.signals = np.zeros((self.number, signal_layout(assembly).count))
        self.energies = np.zeros((self.number, len(ENERGIES) + len(POWERS)))
        self._system = CompiledSystem(assembly, start.q, start.v, loads, chosen.step, chosen.method)

    def costs(self) -> tuple[float, float]:
        """Microseconds of processor time for a step, and for a step with its signals and powers."""
        steps = timed(lambda: self._system.advance(0, self.q, self.v)).processor
        whole = timed(lambda: self._system.advance(0, self.q, self.v, self.signals, self.energies)).processor
        return 1e6 * steps / self.number, 1e6 * whole / self.number


def steps(gearbox: Gearbox, rounds: int) -> list[dict[str, Any]]:
    """Microseconds per step with more and more elastic bodies, by the compiled solver, each at its own step."""
    cases = {
        "none (variant bushing)": (gearbox, "bushing"),
        "shafts": (with_elastic(gearbox, SHAFTS), "flexible"),
        "shafts, carrier": (with_elastic(gearbox, CARRIER), "flexible"),
        "shafts, carrier, housing with ring": (gearbox, "flexible"),
    }
    rows, systems = [], []
    for name, (case, variant) in cases.items():
        assembly = assembled(case, variant)
        chosen = choose_integration(assembly, SAMPLE_RATE, BAND)
        systems.append(_Steps(assembly, chosen))
        rows.append({"elastic": name, "coordinates": assembly.size, "step": chosen.step, "method": chosen.method.name})
    found = [[system.costs() for system in systems] for _ in range(rounds + 1)][1:]
    for n, row in enumerate(rows):
        row["microseconds_per_step"] = median(one[n][0] for one in found)
        row["ratio_of_a_step"] = median(one[n][0] / one[0][0] for one in found)
        row["seconds_per_second"] = median(one[n][1] for one in found) * 1e-6 / row["step"]
        row["ratio_of_a_run"] = median(one[n][1] / one[0][1] for one in found) * rows[0]["step"] / row["step"]
    say("elastic bodies: steps")
    return rows


def frames(gearbox: Gearbox, rounds: int) -> list[dict[str, Any]]:
    """Microseconds per step in Exudyn with one shaft rigid, in the frame that does not turn, and in a floating one.

    By generalized-alpha: Euler parameters bring a constraint, which explicit methods do not take.
    """
    import exudyn_ways

    cases = {
        "rigid": (gearbox, "bushing"),
        "frame that does not turn": (with_elastic(gearbox, (FLOATING,)), "flexible"),
        "floating frame": (with_elastic(gearbox, (FLOATING,), **{FLOATING: "ffrf"}), "flexible"),
    }
    rows, systems = [], []
    for name, (case, variant) in cases.items():
        assembly = assembled(case, variant)
        start = accelerating_start(assembly, LOAD)
        systems.append(exudyn_ways.system_of(assembly, start.q, start.v, LOAD))
        rows.append({"shaft": name, "coordinates": assembly.size})
    number = 100
    found = [
        [1e6 / number * exudyn_ways.integrate(s, number, EXUDYN_STEP, "modified").processor for s in systems]
        for _ in range(rounds + 1)
    ][1:]
    for n, row in enumerate(rows):
        row["microseconds_per_step"] = median(one[n] for one in found)
        row["ratio"] = median(one[n] / one[0] for one in found)
    say("elastic bodies: frames")
    return rows


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    gearbox = Gearbox.from_toml(CASE)
    rounds = 1 if quick else 5
    return {
        "rounds": rounds,
        "reductions": reductions(gearbox),
        "steps": steps(gearbox, rounds),
        "exudyn_step": EXUDYN_STEP,
        "frames": frames(gearbox, rounds),
    }
