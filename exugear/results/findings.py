"""Findings on results: what passed a validity check, what a user should know, and what makes a result invalid."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from exugear.gearbox.variant import Variant
from exugear.results.run_file import invalidity_of

MAX_ENERGY_RESIDUAL = 1e-3
"""Permissible relative residual of the energy balance of a run."""
DOUBTS = ("table_doubt", "band_doubt", "folding_doubt", "bearing_doubt")
"""Attributes of a run with warnings about its load case and its step."""


@dataclass(frozen=True)
class Finding:
    """A statement on a result.

    Examples
    --------
    >>> Finding("warning", "damping is assumed").line
    'Warning: damping is assumed'
    """

    level: Literal["passed", "note", "warning", "error"]
    """Passed check; information; result of limited validity; invalid result."""
    text: str
    value: float | None = None
    """Number that decides the level, in SI units; None if there is none."""

    @property
    def passed(self) -> bool:
        """Whether the result is valid in this respect."""
        return self.level in ("passed", "note")

    @property
    def line(self) -> str:
        """Finding as a line of text."""
        return f"{self.level.capitalize()}: {self.text}"


def percent_text(share: float, digits: int = 3) -> str:
    """Return a share in per cent with some significant digits, and without an exponent if it is large.

    Examples
    --------
    >>> percent_text(2e-5, 1), percent_text(0.2, 1), percent_text(195.0), percent_text(math.inf)
    ('0.002 %', '20 %', 'over 1000 %', 'over 1000 %')
    """
    text = f"{100.0 * share:.{digits}g}"
    if not float(text) <= 1000.0:
        return "over 1000 %"
    return f"{float(text):.0f} %" if "e+" in text else f"{text} %"


def check_finding(passed: bool, text: str, value: float | None = None) -> Finding:
    """Return the finding of a check: passed, or a warning."""
    return Finding("passed" if passed else "warning", text, value)


def run_findings(attributes: Mapping[str, Any], residual: float, times: Mapping[str, float]) -> tuple[Finding, ...]:
    """Check a run.

    Parameters
    ----------
    attributes : of its file
    residual : relative residual of the energy balance, as `exugear.system.signals.energy_residual`
    times : longest time (s) of a mesh in each of the states `exugear.system.signals.MESH_TIMES`

    Examples
    --------
    >>> times = {"tensile_time": 0.0, "contact_loss_time": 0.0, "extrapolation_time": 0.02}
    >>> for finding in run_findings({"variant": "bushing", "valid": 1}, 2e-5, times):
    ...     print(finding.line)
    Passed: energy balance closed to 0.002 %
    Passed: no tensile mesh force, on bearings
    Warning: a mesh was outside the range of its table for 0.02 s (extrapolated linearly); widen the axes of [ste]
    """
    found = []
    if not math.isnan(residual):
        text = f"energy balance closed to {percent_text(abs(residual), 1)}"
        found.append(check_finding(abs(residual) < MAX_ENERGY_RESIDUAL, text, residual))
    if reason := invalidity_of(attributes):
        found.append(Finding("error", f"the run is invalid: {reason}"))
    found += [Finding("warning", str(attributes[doubt])) for doubt in DOUBTS if attributes.get(doubt)]
    tensile, apart, outside = (times[name] for name in ("tensile_time", "contact_loss_time", "extrapolation_time"))
    if tensile > 0.0:
        found.append(Finding("warning", f"tensile mesh force for {tensile:.3g} s (contact loss neglected)", tensile))
    if apart > 0.0:
        found.append(Finding("passed", f"contact loss for {apart:.3g} s (included in the mesh model)", apart))
    if not tensile and not apart:
        found.append(Finding("passed", f"no tensile mesh force, {Variant.of(attributes['variant']).label}"))
    if outside > 0.0:
        text = f"a mesh was outside the range of its table for {outside:.3g} s (extrapolated linearly); widen the axes "
        found.append(Finding("warning", f"{text}of [ste]", outside))
    return tuple(found)
