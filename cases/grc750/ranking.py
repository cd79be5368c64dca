"""GRC 750 kW: resonances at steady speed beside what the run-up of the reference shows of them, for both variants.

    python cases/grc750/ranking.py [results folder]

A sweep through a lightly damped resonance does not build up: where its severity f' / (2 pi zeta^2 f^2) is above 0.3
the run-up ranks it too low. Tables, run-ups and steady responses that are there already are used again.
"""

from __future__ import annotations

import math

from one_variant import grc_project, show

from exugear import Choice, load_run
from exugear.gearbox.units import RPM
from exugear.results.spectra.resonances import OrderCut, run_up_cut, sweep_rate
from exugear.results.spectra.waterfall import OrderLine
from exugear.steady.peaks import ComparedPeak, compared_peaks


def compared(variant: str) -> tuple[ComparedPeak, ...]:
    """Peaks of a variant."""
    project = grc_project(Choice(variant))
    project.tables()
    stored = load_run(project.run(progress=show).path, ("time", "overall_dte", "input_speed"))
    time, values, speed = (stored[name].to_numpy() for name in ("time", "overall_dte", "input_speed"))

    def cut(line: OrderLine) -> OrderCut:
        return run_up_cut(time, values, speed, line)

    return compared_peaks(project.steady(), cut, sweep_rate(time, speed, 1.0))


def main() -> None:
    """Print a table of each variant."""
    for variant in ("rigid", "bushing"):
        rows = compared(variant)
        print(f"\n{variant}: loudest peaks at steady speed, and in the run-up")
        print("| rank | in the run-up | order | rpm | Hz | damping % | steady µm | run-up µm | dB | severity |")
        for rank, own in enumerate(rows, start=1):
            damping = "" if own.damping is None else f"{100.0 * own.damping:.2f}"
            severity = "" if own.severity is None else f"{own.severity:.2g}"
            change = 20.0 * math.log10(max(own.run_amplitude, 1e-12) / own.peak.amplitude)
            print(
                f"| {rank} | {own.run_rank} | {own.peak.line} | {abs(own.peak.speed) / RPM:.1f} | "
                f"{own.peak.frequency:.0f} | {damping} | {1e6 * own.peak.amplitude:.2f} | "
                f"{1e6 * own.run_amplitude:.2f} | {change:+.1f} | {severity} |"
            )


if __name__ == "__main__":
    main()
