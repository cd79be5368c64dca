"""What a steady response over speed costs, by level and by number of lines, and beside a run-up.

Measured by ``python benchmarks/run_all.py --part steady``.
"""

from __future__ import annotations

from typing import Any

from dynamics import run_up, stiffness_of
from timing import CASE, say, timed

from exugear.dynamics.assemble import assemble
from exugear.dynamics.assembly import Assembly
from exugear.model.choice import Choice
from exugear.model.gearbox import Gearbox
from exugear.steady.settings import LEVELS, SpeedRange, SteadySettings
from exugear.steady.steady_response import response_of

SPEEDS = "0:215:400"
LINES = ((10, 3), (10, 5), (16, 4), (20, 3))
"""Harmonics, and largest sum of multiples of combinations."""


def cost_of(assembly: Assembly, settings: SteadySettings) -> dict[str, Any]:
    """Processor time of a response, and what it solved: once, for it takes seconds."""
    found: list[Any] = []
    cost = timed(lambda: found.append(response_of(assembly, settings)))
    return {
        "level": settings.level,
        "lines": len(found[0].lines.orders),
        "speeds": len(found[0].solved.speed),
        "processor_s": cost.processor,
    }


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    gearbox = Gearbox.from_toml(CASE)
    assemblies = {
        variant: assemble(gearbox, Choice(variant), stiffness_of(gearbox)) for variant in ("rigid", "bushing")
    }
    speeds = SpeedRange.from_text("0:215:20" if quick else SPEEDS)
    for level in LEVELS:  # loads the compiled code
        response_of(assemblies["bushing"], SteadySettings(SpeedRange.from_text("10:20:2"), level, at_resonances=False))
    rows = []
    for variant, assembly in assemblies.items():
        for level in LEVELS:
            for refined in (False, True):
                settings = SteadySettings(speeds, level, at_resonances=refined)
                rows.append({"variant": variant, "refined": refined, **cost_of(assembly, settings)})
        say(f"steady: {variant}")
    growth = [
        {"harmonics": h, "combinations": c}
        | cost_of(assemblies["bushing"], SteadySettings(speeds, "parametric", h, c, at_resonances=False))
        for h, c in LINES
    ]
    run_ups = {variant: run_up(variant, 1.0 if quick else 30.0)["processor_s"] for variant in assemblies}
    return {"responses": rows, "growth": growth, "run_ups": run_ups}
