"""What a steady response over speed costs, by level and by number of lines.

Measured by ``python benchmarks/run_all.py --part steady``.
"""

from __future__ import annotations

from typing import Any

from dynamics import stiffness_of
from timing import CASE, median, say, timed

from exugear.dynamics.assemble import assemble
from exugear.dynamics.assembly import Assembly
from exugear.model.choice import Choice
from exugear.model.gearbox import Gearbox
from exugear.steady.settings import LEVELS, SpeedRange, SteadySettings
from exugear.steady.steady_response import response_of

SPEEDS = "0:215:400"
LINES = ((10, 3), (10, 5), (16, 4), (20, 3))
"""Harmonics, and largest sum of multiples of combinations."""


def cost_of(assembly: Assembly, settings: SteadySettings, rounds: int) -> dict[str, Any]:
    """Processor time of a response, and what it solved."""
    found = [response_of(assembly, settings)]
    costs = [timed(lambda: found.append(response_of(assembly, settings))) for _ in range(rounds)]
    return {
        "level": settings.level,
        "lines": len(found[0].lines.orders),
        "speeds": len(found[0].solved.speed),
        "processor_s": median(cost.processor for cost in costs),
    }


def measure(quick: bool) -> dict[str, Any]:
    """Everything."""
    gearbox, rounds = Gearbox.from_toml(CASE), 1 if quick else 3
    assemblies = {
        variant: assemble(gearbox, Choice(variant), stiffness_of(gearbox)) for variant in ("rigid", "bushing")
    }
    speeds = SpeedRange.from_text("0:215:20" if quick else SPEEDS)
    rows = []
    for variant, assembly in assemblies.items():
        for level in LEVELS:
            for refined in (False, True):
                settings = SteadySettings(speeds, level, at_resonances=refined)
                rows.append({"variant": variant, "refined": refined, **cost_of(assembly, settings, rounds)})
        say(f"steady: {variant}")
    growth = [
        {"harmonics": h, "combinations": c}
        | cost_of(assemblies["bushing"], SteadySettings(speeds, "parametric", h, c, at_resonances=False), rounds)
        for h, c in LINES
    ]
    return {"rounds": rounds, "responses": rows, "growth": growth}
