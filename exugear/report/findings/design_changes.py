"""Effects of design changes on a resonance: how much each changes the peaks, what it costs, and whether it is advised.

The changed gearbox passes the full check, and its tables and its steady-state response are recomputed
(`exugear.project.Project.design_changes`). Two results are compared with those of the unchanged gearbox: the highest
amplitude of the same order near the same speed, and the highest amplitude of any order in the operating range, because
a change may only move a peak. Of several loads the least favourable effect counts.

A change is recommended if it lowers the highest amplitude of the deciding quantity in the operating range, raises no
other quantity there by more than `MOST_RAISED`, and fails no requirement of the rating that the unchanged gearbox
meets, nor falls further below one.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.report.findings.proposals import ASSUMPTION, GROUPS, DesignChange
from exugear.report.findings.ranking import DECIDING, dynamic_orders
from exugear.steady.mean_system.signals import SIGNALS
from exugear.steady.settings import SteadySettings, operating_speeds
from exugear.steady.steady_file import complex_amplitudes, response_quantities
from fe_ste.standards.pitting import nominal_contact_stress
from fe_ste.tools.arrays import Integers
from fe_ste.tools.drawing import COLOURS, axes_or_new, drawable
from fe_ste.tools.files import FileError, write_file

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

NEAR = 0.05
"""Relative speed difference within which a peak counts as the same one."""
LEAST_DB = -60.0
"""Smallest effect that is distinguished: amplitudes may vanish except for round-off if planets mesh out of phase."""
STEEL = 7850.0
"""Density for the mass of wider gears, kg/m3."""
MOST_RAISED = 1.0
"""Increase of another quantity in the operating range up to which a change is recommended, dB."""
LEAST_LOWERED = 0.1
"""Decrease of the deciding quantity in the operating range from which a change is recommended, dB."""


@dataclass(frozen=True)
class Effect:
    """Effect of a change on one quantity, dB; negative: lower; at least `LEAST_DB`."""

    this_peak: float | None
    highest: float | None
    """None where there is no amplitude to compare."""


@dataclass(frozen=True)
class ChangeResult:
    """What a change does, or why it cannot be made."""

    change: DesignChange
    effects: Mapping[str, Effect]
    """By quantity, at the least favourable load; empty if the change cannot be made."""
    price: str = ""
    """What the change costs, as text."""
    objection: str = ""
    """Why the change is not recommended; empty if it is."""
    refusal: str = ""
    """Reason why the change cannot be made."""
    remedy: str = ""
    """How it raises the margin that it is to raise; empty if it does not.

    A requirement that it fails, or meets by less than before, is named behind.
    """

    @property
    def recommended(self) -> bool:
        """Whether the change is advised."""
        return not self.refusal and not self.objection and self.change.group != ASSUMPTION


@dataclass(frozen=True)
class DesignStudy:
    """Results of all design changes of a gearbox."""

    model: Mapping[str, str]
    """Model settings as in the attributes of a steady-state response: ``variant``, ``mesh_model``, ``inertias``."""
    input_hash: str
    """Of the steady-state response without changes at the static load."""
    line: str
    frequency: float
    speed: float
    """Order, frequency (Hz) and input speed (rad/s) of the resonance that the changes are to reduce."""
    amplitudes: Mapping[str, float]
    """Its amplitudes by quantity, SI units."""
    results: Sequence[ChangeResult]
    """Changes of the design by their effect, then assumptions, then changes that cannot be made."""
    quantity: str = "error"
    """Quantity that decides, as in `exugear.report.findings.ranking.Ranking`."""
    number: int = 1
    loads: Sequence[str] = field(default=("static load",))
    """Loads at which each change is computed."""
    requirements: Sequence[str] = ()
    """Requirements that the unchanged gearbox fails."""

    @property
    def wanted(self) -> str:
        """Name of the deciding quantity in a gearbox file."""
        return next(name for name, own in DECIDING.items() if self.quantity in own)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw what each change does to each quantity, in dB, as `exugear report --levers` lists it.

        Narrow dark bars: this peak; wide pale bars: highest amplitude of any order in the operating range. Changes that
        cannot be made are left out.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Examples
        --------
        >>> wider = DesignChange("wider", "face width 40 to 48 mm", "gear", {})
        >>> results = [ChangeResult(wider, {"error": Effect(-6.0, -3.5)}, "+2 kg")]
        >>> ax = DesignStudy({}, "", "stage_1", 334.0, 100.0, {"error": 1e-6}, results).plot()
        >>> [label.get_text() for label in ax.get_yticklabels()], [float(bar.get_width()) for bar in ax.patches]
        (['face width 40 to 48 mm'], [-3.5, -6.0])
        """
        made = [result for result in self.results if not result.refusal]
        names = [name for name in SIGNALS if any(name in result.effects for result in made)]
        height = 0.8 / max(1, len(names))
        with axes_or_new(ax, 8.0, 1.2 + 0.45 * len(made)) as panel:
            for number, name in enumerate(names):
                at = np.arange(len(made)) + (number - 0.5 * (len(names) - 1)) * height
                effects = [result.effects.get(name, Effect(None, None)) for result in made]
                here = np.array([effect.this_peak for effect in effects], dtype=np.float64)
                highest = np.array([effect.highest for effect in effects], dtype=np.float64)
                colour = COLOURS[number]
                panel.barh(at, highest, 0.95 * height, color=colour, alpha=0.35, label=f"{name}, highest in range")
                panel.barh(at, here, 0.4 * height, color=colour, label=f"{name}, this peak")
            labels = [drawable(result.change.words) for result in made]
            panel.set_yticks(range(len(made)), labels, parse_math=False)
            panel.invert_yaxis()
            panel.axvline(0.0, color="black", linewidth=0.8)
            panel.set_xlabel("Change of the amplitude / dB")
            if names:
                panel.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(names))
            return panel


def settings_of_study(gearbox: Gearbox) -> SteadySettings:
    """Return the settings of all steady-state responses of a study: the operating range."""
    return SteadySettings(operating_speeds(gearbox))


def write_design_study(path: Path, study: DesignStudy) -> None:
    """Write a study as JSON."""
    write_file(path, json.dumps(asdict(study), indent=1).encode("utf-8"))


def read_design_study(path: Path) -> DesignStudy:
    """Read a study that `write_design_study` wrote.

    Raises
    ------
    FileError
        The file cannot be read or is not such a study.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        results = []
        for one in content.pop("results"):
            effects = {str(name): Effect(*map(_number, effect.values())) for name, effect in one["effects"].items()}
            change = DesignChange(**one["change"])
            if change.group not in GROUPS:
                raise ValueError(f"no group {change.group!r}")
            texts = (str(one.get(key, "")) for key in ("price", "objection", "refusal", "remedy"))
            results.append(ChangeResult(change, effects, *texts))
        study = DesignStudy(**content, results=results)
        if study.quantity not in SIGNALS:
            raise ValueError(f"no quantity {study.quantity!r}")
        if not all(math.isfinite(value) for value in (study.frequency, study.speed, *study.amplitudes.values())):
            raise ValueError("numbers are not finite")
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise FileError(f"{path}: cannot be read as design changes ({error}); run exugear report --levers") from None
    return study


def _number(value: float | None) -> float | None:
    return None if value is None else float(value)


# Effects


def multiples_of(data: xr.Dataset, order: float, families: Collection[str]) -> dict[str, int]:
    """Return the multiples of mesh orders and rotations that make up an order, without sidebands of passing planets.

    Parameters
    ----------
    order : periods per revolution of the input

    Returns
    -------
    By the families of meshes that share a mesh order, separated by commas, and by rotations of bodies
    """
    line = int(np.argmin(np.abs(data["order"].to_numpy() - order)))
    return {base: int(counts[line]) for base, counts in _base_multiples(data, families).items() if counts[line]}


def _base_multiples(data: xr.Dataset, families: Collection[str]) -> dict[str, Integers]:
    """Multiples (line,) of each mesh order and of each rotation that stated loads or deviations have."""
    multiples = data["index"].to_numpy()
    bases = enumerate(str(base) for base in data["base"].to_numpy())
    return {
        base: multiples[:, place]
        for place, base in bases
        if set(base.split(", ")) <= set(families) or "rotation of " in base
    }


def peaks_of(
    data: xr.Dataset,
    multiples: Mapping[str, int],
    families: Collection[str],
    frequency: float,
    inside: tuple[float, float],
) -> dict[str, tuple[float, float]]:
    """Amplitude of an order near a frequency, and the highest amplitude of any order in a range of speeds, by quantity.

    Quasi-static orders do not count in the range, see `exugear.report.findings.ranking.dynamic_orders`.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` reads it
    multiples : as `multiples_of` returns them; they are the same with other numbers of teeth
    frequency : of the resonance, Hz
    inside : lowest and highest speed of the range, rad/s
    """
    speeds = np.abs(data["speed"].to_numpy())
    amplitude = complex_amplitudes(data)[:, 1:]
    bases = _base_multiples(data, families)
    of_order = np.full(data.sizes["line"], set(multiples) <= set(bases))
    for base, counts in bases.items():
        of_order &= counts == multiples.get(base, 0)
    frequencies = np.outer(speeds, data["order"].to_numpy()) / (2.0 * np.pi)
    near = (of_order & (np.abs(frequencies - frequency) <= NEAR * frequency))[:, 1:]
    within = (speeds >= inside[0]) & (speeds <= inside[1])
    found = {}
    for quantity in response_quantities(data):
        sizes = quantity.sizes(amplitude).max(axis=2, initial=0.0)
        highest = sizes[within][:, dynamic_orders(sizes, within)].max(initial=0.0)
        found[quantity.name] = float(sizes[near].max(initial=0.0)), float(highest)
    return found


def effects_of(
    before: Mapping[str, tuple[float, float]], after: Mapping[str, tuple[float, float]]
) -> dict[str, Effect]:
    """Return the changes in dB of the amplitudes of `peaks_of`.

    Examples
    --------
    >>> effects_of({"error": (2e-6, 4e-6)}, {"error": (1e-6, 4e-6)})
    {'error': Effect(this_peak=-6.0206, highest=0.0)}
    """
    return {
        name: Effect(*(_decibel(old, new) for old, new in zip(values, after[name], strict=True)))
        for name, values in before.items()
        if name in after
    }


def _decibel(before: float, after: float) -> float | None:
    if before <= 0.0 or after <= 0.0:
        return None
    return max(LEAST_DB, round(20.0 * math.log10(after / before), 4))


def least_favourable(effects: Sequence[Mapping[str, Effect]]) -> dict[str, Effect]:
    """Return the largest effects of a change over several loads.

    Examples
    --------
    >>> least_favourable([{"error": Effect(-6.0, -3.0)}, {"error": Effect(-2.0, -4.0)}])
    {'error': Effect(this_peak=-2.0, highest=-3.0)}
    """

    def largest(values: list[float | None]) -> float | None:
        return max((value for value in values if value is not None), default=None)

    return {
        name: Effect(
            largest([one[name].this_peak for one in effects if name in one]),
            largest([one[name].highest for one in effects if name in one]),
        )
        for name in effects[0]
    }


def objection_to(effects: Mapping[str, Effect], quantity: str, labels: Mapping[str, str]) -> str:
    """Say why effects speak against a change; empty if they do not.

    Examples
    --------
    >>> effects = {"error": Effect(-10.9, -10.9), "force": Effect(-10.9, 12.4)}
    >>> objection_to(effects, "error", {"force": "bearing force"})
    'raises bearing force by 12.4 dB'
    """
    decides = effects.get(quantity, Effect(None, None)).highest
    if decides is None or decides > -LEAST_LOWERED:
        return f"does not lower {labels[quantity]} in the range"
    raised = [
        f"{labels[name]} by {effect.highest:.1f} dB"
        for name, effect in effects.items()
        if effect.highest is not None and effect.highest > MOST_RAISED
    ]
    return f"raises {' and '.join(raised)}" if raised else ""


def price_of(before: Gearbox, after: Gearbox, nominal: bool = True) -> str:
    """Differences of ratio, mass, axial force and, if `nominal`, nominal contact stress of gears, as text."""
    costs = []
    if abs(after.train.ratio / before.train.ratio - 1.0) > 1e-6:
        costs.append(f"speed ratio {before.train.ratio:.4g} to {after.train.ratio:.4g}")
    mass = _gear_mass(after) - _gear_mass(before)
    if abs(mass) > 0.05:
        costs.append(f"mass {mass:+.3g} kg")
    forces = before.train.static_mesh_forces()
    for name, pair in before.gear_pairs.items():
        other = after.gear_pairs[name]
        force = max((abs(forces[mesh.name]) for mesh in before.meshes if mesh.pair.name == name), default=0.0)
        if force == 0.0:
            continue
        axial = [force * abs(math.tan(own.pinion.base_helix_angle)) for own in (pair, other)]
        if abs(axial[1] - axial[0]) > 0.01 * max(axial):
            costs.append(f"axial force of {name} {1e-3 * axial[0]:.3g} to {1e-3 * axial[1]:.3g} kN")
        stresses = [
            nominal_contact_stress(own, force * own.pinion.base_radius / own.pinion.reference_radius)
            for own in (pair, other)
        ]
        more = 100.0 * (stresses[1] / stresses[0] - 1.0)
        if nominal and abs(more) > 0.5:
            costs.append(f"nominal contact stress of {name} at the pitch point {more:+.1f} %")
    return "; ".join(costs)


def _gear_mass(gearbox: Gearbox) -> float:
    """Mass of the toothed rims from reference circle to what holds them, kg."""
    masses = [
        abs(gear.reference_radius**2 - (0.5 * gear.held_diameter) ** 2) * math.pi * gear.face_width * STEEL
        for gear in gearbox.gears.values()
    ]
    return sum(masses)


def ordered(results: Sequence[ChangeResult], quantity: str) -> list[ChangeResult]:
    """Sort by the effect on the highest amplitude of a quantity; assumptions, then refused changes, follow."""

    def key(result: ChangeResult) -> tuple[bool, bool, float]:
        effect = result.effects.get(quantity)
        size = math.inf
        if effect is not None and effect.highest is not None:
            size = effect.highest
        return bool(result.refusal), result.change.group == ASSUMPTION, size

    return sorted(results, key=key)
