"""Design changes that may reduce a resonance: proposals, and how much each changes the peaks.

Each proposal is a set of keys of the gearbox file. The changed gearbox passes the full check, and its tables and its
steady-state response are recomputed (`exugear.project.Project.design_changes`). Two results are compared with those
of the unchanged gearbox: the highest amplitude of the same order near the same speed, and the highest amplitude of any
order in the operating range, because a change may only move a peak. Assumptions form a group of their own: they are not
changes of the design, but show how much the answer depends on what is not known.
"""

from __future__ import annotations

import cmath
import json
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.connections import CONTACT_ANGLES_DEG
from exugear.gearbox.sections.gears import ModificationSection
from exugear.gearbox.units import MM, UM
from exugear.steady.mean_system.signals import SIGNALS, quantities_of
from exugear.steady.settings import SteadySettings, operating_speeds
from fe_ste.geometry.gears import GearPair
from fe_ste.geometry.involute import involute
from fe_ste.standards.pitting import nominal_contact_stress
from fe_ste.tools.arrays import Floats, Integers
from fe_ste.tools.drawing import COLOURS, axes_or_new, drawable
from fe_ste.tools.files import FileError, write_file

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

NEAR = 0.05
"""Relative speed difference within which a peak counts as the same one."""
WHOLE = 0.05
"""Difference of an overlap ratio from a whole number below which no change of the overlap ratio is proposed."""
AMOUNTS = (0.5, 1.0)
"""Tip relief and crowning in units of the mean static deflection of the teeth."""
STEEPER_DEG = 5.0
PRELOAD_UM = 20.0
STIFFER = 1.3
"""Changes of a bearing: contact angle, axial preload of a pair, factor of a stated stiffness and of its inverse."""
SAME_PHASING = 0.1
"""Difference of the resultant of planet phases, 1 for meshes in phase, below which the phasing counts as the same."""
LEAST_DB = -60.0
"""Smallest effect that is distinguished: amplitudes may vanish except for round-off if planets mesh out of phase."""
STEEL = 7850.0
"""Density for the mass of wider gears, kg/m3."""
ASSUMPTION = "assumption"
GROUPS = ("gear", "modification", "bearing", ASSUMPTION)
"""Groups of changes, in the order of the table."""


@dataclass(frozen=True)
class DesignChange:
    """A proposal."""

    name: str
    """Short name, of letters, digits and hyphens."""
    words: str
    """What changes, as text."""
    group: str
    """One of `GROUPS`."""
    keys: Mapping[str, Any]
    """New values by key of the gearbox file."""


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
    """By quantity; empty if the change cannot be made."""
    price: str
    """What the change costs: mass, axial force, contact stress, bearing life."""
    refusal: str = ""
    """Reason why the change cannot be made."""


@dataclass(frozen=True)
class DesignStudy:
    """Results of all design changes of a gearbox."""

    model: Mapping[str, str]
    """Model settings as in the attributes of a steady-state response: ``variant``, ``mesh_model``, ``inertias``."""
    input_hash: str
    """Of the steady-state response without changes."""
    line: str
    frequency: float
    speed: float
    """Order, frequency (Hz) and input speed (rad/s) of the resonance that the changes are to reduce: the first of the
    ranking in the operating range."""
    amplitudes: Mapping[str, float]
    """Its amplitudes by quantity, SI units."""
    results: Sequence[ChangeResult]
    """Changes of the design by their effect, then assumptions, then changes that cannot be made."""

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw what each change does to the three quantities, in dB, as `exugear report --levers` lists it.

        Narrow dark bars: this peak; wide pale bars: highest amplitude of any order in the operating range. Changes that
        cannot be made are left out.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Examples
        --------
        >>> wider = DesignChange("wider", "face width 40 to 48 mm", "gear", {})
        >>> results = (ChangeResult(wider, {"error": Effect(-6.0, -3.5)}, "+2 kg"),)
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
        results = [_result_from(one) for one in content.pop("results")]
        study = DesignStudy(**content, results=results)
        if not all(math.isfinite(value) for value in (study.frequency, study.speed, *study.amplitudes.values())):
            raise ValueError("numbers are not finite")
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise FileError(f"{path}: cannot be read as design changes ({error}); run `exugear report --levers`") from None
    return study


def _result_from(content: Mapping[str, Any]) -> ChangeResult:
    effects = {str(name): Effect(*map(_number, effect.values())) for name, effect in content["effects"].items()}
    change = DesignChange(**content["change"])
    if change.group not in GROUPS:
        raise ValueError(f"no group {change.group!r}")
    return ChangeResult(change, effects, str(content["price"]), str(content["refusal"]))


def _number(value: float | None) -> float | None:
    if value is None:
        return None
    return float(value)


# Proposals


def propose_changes(
    gearbox: Gearbox,
    multiples: Mapping[str, int],
    deflections: Mapping[str, float],
    bearings: Sequence[str],
) -> list[DesignChange]:
    """Propose changes for a resonance.

    Parameters
    ----------
    multiples : of the mesh frequency that excite it, by the family of meshes
    deflections : mean static transmission error of each pair, m
    bearings : families of the bearings that have most of its strain energy
    """
    pairs = {mesh.pair.name: mesh.pair for mesh in gearbox.meshes if mesh.family in multiples}
    changes: list[DesignChange] = []
    for name, pair in pairs.items():
        changes += _overlap_changes(gearbox, name, pair)
        changes += _modification_changes(gearbox, name, pair, deflections.get(name, 0.0))
    changes += _phasing_changes(gearbox, multiples)
    for name in bearings:
        changes += _bearing_changes(gearbox, name)
    changes += _assumptions(gearbox)
    return changes


def _gear_names(gearbox: Gearbox, pair: str) -> tuple[str, str]:
    section = gearbox.case.pairs[pair]
    return section.pinion, section.gear


def _overlap_changes(gearbox: Gearbox, name: str, pair: GearPair) -> Iterator[DesignChange]:
    """Bring the overlap ratio to the next whole number, by the face width or by the helix angle."""
    overlap = pair.overlap_ratio
    target = math.ceil(overlap - WHOLE)
    if overlap == 0.0 or abs(overlap - target) <= WHOLE:
        return
    factor = target / overlap
    both = _gear_names(gearbox, name)
    widths = {f"gears.{gear}.face_width_mm": factor * gearbox.case.gears[gear].face_width_mm for gear in both}
    if (common := gearbox.case.pairs[name].common_face_width_mm) is not None:
        widths[f"pairs.{name}.common_face_width_mm"] = factor * common
    wide = factor * pair.face_width / MM
    words = f"{name}: face width {pair.face_width / MM:.4g} to {wide:.4g} mm (overlap ratio {target})"
    yield DesignChange(f"{name}-face-width", words, "gear", widths)
    helix = gearbox.gears[both[0]].helix_angle
    turned = abs(math.atan(factor * math.tan(helix)))
    words = (
        f"{name}: helix angle {abs(math.degrees(helix)):.4g} to {math.degrees(turned):.4g} deg, with module and "
        f"profile shift for the same centre distance (overlap ratio {target})"
    )
    yield DesignChange(f"{name}-helix-angle", words, "gear", helix_change(gearbox, name, turned))


def helix_change(gearbox: Gearbox, name: str, helix: float) -> dict[str, float]:
    """Keys for another helix angle (rad) of all gears that mesh with those of a pair, directly or through others.

    The transverse module stays, and with it all reference and centre distances. Profile shifts keep the circumferential
    backlash: inv(alpha_wt) = inv(alpha_t) + 2 tan(alpha_n) sum x / sum z (ISO 21771) for each pair in turn.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> changed = gearbox.varied(helix_change(gearbox, "intermediate", math.radians(17.4)))
    >>> pairs = [one.gear_pairs["intermediate"] for one in (gearbox, changed)]
    >>> [(round(pair.overlap_ratio, 2), round(1e6 * pair.circumferential_backlash, 1)) for pair in pairs]
    [(1.59, 332.8), (1.99, 332.8)]
    """
    sections = gearbox.case.gears
    keys: dict[str, float] = {}
    shifts: dict[str, float] = {}
    waiting = [name]
    seen: set[str] = set()
    while waiting:
        current = waiting.pop(0)
        seen.add(current)
        both = _gear_names(gearbox, current)
        pair = gearbox.gear_pairs[current]
        for gear in both:
            own = gearbox.gears[gear]
            scale = math.cos(helix) / math.cos(own.helix_angle)
            keys[f"gears.{gear}.helix_angle_deg"] = math.copysign(math.degrees(helix), own.helix_angle)
            keys[f"gears.{gear}.normal_module_mm"] = scale * sections[gear].normal_module_mm
        known = next((gear for gear in both if gear in shifts), both[0])
        other = both[known == both[0]]
        first = gearbox.gears[known]
        scale = math.cos(helix) / math.cos(first.helix_angle)
        shifts.setdefault(known, first.profile_shift / scale)
        if other not in shifts:
            shifts[other] = _shift_of_mate(gearbox, pair, known, other, shifts[known], helix)
        waiting += [
            near for near in gearbox.gear_pairs if near not in seen and set(_gear_names(gearbox, near)) & set(both)
        ]
    for gear, shift in shifts.items():
        keys[f"gears.{gear}.profile_shift"] = shift
        if sections[gear].profile_shift_from_centre_distance:
            del keys[f"gears.{gear}.profile_shift"]
    return keys


def _shift_of_mate(gearbox: Gearbox, pair: GearPair, known: str, other: str, shift: float, helix: float) -> float:
    """Profile shift of a gear that keeps the backlash at another helix angle, given that of the mating gear."""
    first = gearbox.gears[known]
    second = gearbox.gears[other]
    signs = [gear.teeth * gear.outward for gear in (first, second)]
    total = sum(signs)
    normal = first.normal_pressure_angle

    def without_backlash(angle: float) -> float:
        """Sum of the shifts, that of a ring negative, for contact on both flanks at the centre distance."""
        transverse = math.atan(math.tan(normal) / math.cos(angle))
        reference = 0.5 * abs(total) * first.normal_module / math.cos(first.helix_angle)
        working = math.acos(reference * math.cos(transverse) / pair.centre_distance)
        return total * (involute(working) - involute(transverse)) / (2.0 * math.tan(normal))

    now = first.outward * first.profile_shift + second.outward * second.profile_shift
    scale = math.cos(helix) / math.cos(first.helix_angle)
    # What the shifts leave for backlash is a length: in modules it grows as the module falls.
    wanted = without_backlash(helix) + (now - without_backlash(first.helix_angle)) / scale
    return second.outward * (wanted - first.outward * shift)


def _modification_changes(gearbox: Gearbox, name: str, pair: GearPair, deflection: float) -> Iterator[DesignChange]:
    """Tip relief of both gears and lead crowning of gear 1, in units of the deflection of the teeth."""
    both = _gear_names(gearbox, name)
    # Half of the path with two tooth pairs in contact; teeth with a contact ratio near 1 or below get a short one.
    length = 0.5 * max(pair.transverse_contact_ratio - 1.0, 0.1) * pair.transverse_base_pitch / MM
    for share in AMOUNTS:
        amount = max(1.0, round(share * deflection / UM))
        relief: dict[str, Any] = {}
        for gear in both:
            section = gearbox.case.gears[gear].modification
            place = f"gears.{gear}.modification"
            if section is None or section.tip_relief_um == 0.0:
                relief[f"{place}.tip_relief_length_mm"] = length
                relief[f"{place}.tip_relief_um"] = amount
            else:
                relief[f"{place}.tip_relief_um"] = section.tip_relief_um + amount
        words = f"{name}: tip relief {amount:g} µm more on both gears"
        yield DesignChange(f"{name}-tip-relief-{amount:g}", words, "modification", relief)
        section = gearbox.case.gears[both[0]].modification or ModificationSection()
        crowned = section.lead_crowning_um + amount
        words = f"{name}: lead crowning {amount:g} µm more on {both[0]}"
        key = f"gears.{both[0]}.modification.lead_crowning_um"
        yield DesignChange(f"{name}-crowning-{amount:g}", words, "modification", {key: crowned})


def _phasing_changes(gearbox: Gearbox, multiples: Mapping[str, int]) -> Iterator[DesignChange]:
    """Add or remove a planet tooth, and change the mating gears so that all centre distances remain.

    With z teeth on a central gear, a planet at the angle psi meshes z psi / (2 pi) mesh cycles later than one at zero.
    The forces of a multiple n of the mesh frequency add up in torque if n z psi / (2 pi) are whole numbers, as at all
    multiples for planets in phase. Otherwise their sum across the axis remains, or none (R. G. Parker, A physical
    explanation for the effectiveness of planet phasing to suppress planetary gear vibration, Journal of Sound and
    Vibration 236, 2000, 561-573). Sets with several gears on a planet, with phases in the file, or with mating gears
    that have other meshes are left out.
    """
    sections = gearbox.case.gears
    if any(section.phase is not None for section in gearbox.case.meshes.values()):
        return
    gears_of_pairs = [_gear_names(gearbox, name) for name in gearbox.gear_pairs]
    for (body, planet), multiple in _planet_gears(gearbox, multiples).items():
        mating = sorted({gear for both in gears_of_pairs if planet in both for gear in both} - {planet})
        branches = any(planet not in both and set(both) & set(mating) for both in gears_of_pairs)
        if branches or len(gearbox.case.bodies[body].gears_z_mm) > 1:
            continue
        angles = [math.radians(angle) for angle in gearbox.case.bodies[body].planet_angles_deg]
        for more in (-1, 1):
            teeth = {planet: sections[planet].teeth + more}
            teeth |= {gear: sections[gear].teeth - more * gearbox.gears[gear].outward for gear in mating}
            now, then = (
                abs(sum(cmath.exp(1j * multiple * count * angle) for angle in angles)) / len(angles)
                for count in (sections[mating[0]].teeth, teeth[mating[0]])
            )
            if abs(then - now) < SAME_PHASING:
                continue
            keys: dict[str, Any] = {f"gears.{gear}.teeth": count for gear, count in teeth.items()}
            for gear, count in teeth.items():
                if (tip := sections[gear].tip_diameter_mm) is not None:
                    module = 2.0 * gearbox.gears[gear].reference_radius / (gearbox.gears[gear].teeth * MM)
                    keys[f"gears.{gear}.tip_diameter_mm"] = tip + module * (count - sections[gear].teeth)
            phasing = "in phase" if then > now else "out of phase"
            counts = ", ".join(f"{gear} {sections[gear].teeth} to {count}" for gear, count in sorted(teeth.items()))
            text = f"planets mesh {phasing}: teeth of {counts}; same centre distances"
            yield DesignChange(f"{body}-{teeth[planet]}-teeth", text, "gear", keys)


def _planet_gears(gearbox: Gearbox, multiples: Mapping[str, int]) -> dict[tuple[str, str], int]:
    """Multiples of the mesh frequency by planet section and gear of the planet."""
    bodies = gearbox.named_bodies
    return {
        (bodies[body].family, gear.name): multiples[mesh.family]
        for mesh in gearbox.meshes
        if mesh.family in multiples
        for body, gear in ((mesh.pinion, mesh.pair.pinion), (mesh.gear, mesh.pair.gear))
        if bodies[body].planet_of is not None
    }


def _bearing_changes(gearbox: Gearbox, family: str) -> Iterator[DesignChange]:
    """Contact angle and preload of a bearing with a catalogue; factors of a stated stiffness."""
    section = gearbox.case.bearings.get(family)
    if section is None:
        return
    place = f"bearings.{family}"
    catalogue = section.catalogue
    if catalogue is not None:
        limits = CONTACT_ANGLES_DEG.get(catalogue.type)
        angle = catalogue.contact_angle_deg
        if limits and angle is not None and catalogue.type in ("tapered_roller", "angular_contact_ball"):
            steeper = min(angle + STEEPER_DEG, limits[1])
            words = f"{family}: contact angle {angle:g} to {steeper:g} deg"
            key = f"{place}.catalogue.contact_angle_deg"
            yield DesignChange(f"{family}-contact-angle", words, "bearing", {key: steeper})
        if catalogue.arrangement in ("X", "O"):
            words = f"{family}: axial preload {PRELOAD_UM:g} µm more"
            key = f"{place}.catalogue.axial_preload_um"
            yield DesignChange(f"{family}-preload", words, "bearing", {key: catalogue.axial_preload_um + PRELOAD_UM})
        elif catalogue.radial_clearance_mm > 0.0:
            words = f"{family}: no radial clearance"
            yield DesignChange(f"{family}-clearance", words, "bearing", {f"{place}.catalogue.radial_clearance_mm": 0.0})
    elif section.stiffness is not None:
        stated = {key: value for key, value in section.stiffness if key.endswith(("N_per_m", "m_per_rad")) and value}
        for factor, words in ((STIFFER, "stiffer"), (1.0 / STIFFER, "softer")):
            keys = {f"{place}.stiffness.{key}": factor * value for key, value in stated.items()}
            if keys:
                share = f"{100.0 * abs(factor - 1.0):.0f} %"
                yield DesignChange(f"{family}-{words}", f"{family}: {share} {words}", "bearing", keys)


def _assumptions(gearbox: Gearbox) -> Iterator[DesignChange]:
    """Half and twice the housing factor, where the housing is not flexible and the factor is used."""
    factor = gearbox.case.housing.factor
    for other in (0.5 * factor, min(2.0 * factor, 1.0)):
        if other != factor:
            words = f"housing stiffness factor {factor:g} to {other:g}"
            yield DesignChange(f"housing-{other:g}", words, ASSUMPTION, {"housing.factor": other})


# Effects


def multiples_of(data: xr.Dataset, order: float, families: Collection[str]) -> dict[str, int]:
    """Return the multiples of mesh orders that make up an order, without sidebands at the rotation of a carrier.

    Parameters
    ----------
    order : periods per revolution of the input
    families : families of meshes of the gearbox

    Returns
    -------
    By the families of meshes that share a mesh order, separated by commas
    """
    line = int(np.argmin(np.abs(data["order"].to_numpy() - order)))
    return {base: int(counts[line]) for base, counts in _mesh_multiples(data, families).items() if counts[line]}


def _mesh_multiples(data: xr.Dataset, families: Collection[str]) -> dict[str, Integers]:
    """Multiples (line,) of each mesh order."""
    multiples = data["index"].to_numpy()
    bases = enumerate(str(base) for base in data["base"].to_numpy())
    return {base: multiples[:, place] for place, base in bases if set(base.split(", ")) <= set(families)}


def peaks_of(
    data: xr.Dataset,
    multiples: Mapping[str, int],
    families: Collection[str],
    frequency: float,
    inside: tuple[float, float],
) -> dict[str, tuple[float, float]]:
    """Amplitude of an order near a frequency, and the highest amplitude of any order in a range of speeds, by quantity.

    Parameters
    ----------
    data : as `exugear.steady.steady_file.load_response` reads it
    multiples : of mesh orders, as `multiples_of` returns them; they are the same with other numbers of teeth
    families : families of meshes of the gearbox
    frequency : of the resonance, Hz
    inside : lowest and highest speed of the range, rad/s
    """
    speeds = np.abs(data["speed"].to_numpy())
    amplitude: Floats = data["amplitude"].to_numpy()[:, 1:].astype(np.float64)
    of_order = np.ones(data.sizes["line"], bool)
    for base, counts in _mesh_multiples(data, families).items():
        of_order &= counts == multiples.get(base, 0)
    frequencies = np.outer(speeds, data["order"].to_numpy()) / (2.0 * np.pi)
    near = (of_order & (np.abs(frequencies - frequency) <= NEAR * frequency))[:, 1:]
    within = (speeds >= inside[0]) & (speeds <= inside[1])
    found = {}
    for quantity in quantities_of([str(name) for name in data["signal"].to_numpy()]):
        sizes = quantity.sizes(amplitude).max(axis=2, initial=0.0)
        found[quantity.name] = float(sizes[near].max(initial=0.0)), float(sizes[within].max(initial=0.0))
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


def price_of(before: Gearbox, after: Gearbox, lives: tuple[float, float]) -> str:
    """Differences of mass, axial force and nominal contact stress of gears, and of the shortest bearing life, as text.

    Parameters
    ----------
    lives : shortest basic rating life of the bearings before and after, million revolutions; infinite if unknown
    """
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
        if abs(more) > 0.5:
            costs.append(f"nominal contact stress of {name} {more:+.1f} %")
    if all(map(math.isfinite, lives)) and abs(lives[1] / lives[0] - 1.0) > 0.01:
        costs.append(f"shortest bearing life {100.0 * (lives[1] / lives[0] - 1.0):+.0f} %")
    return "; ".join(costs)


def _gear_mass(gearbox: Gearbox) -> float:
    """Mass of the toothed rims from reference circle to what holds them, kg."""
    masses = [
        abs(gear.reference_radius**2 - (0.5 * gear.held_diameter) ** 2) * math.pi * gear.face_width * STEEL
        for gear in gearbox.gears.values()
    ]
    return sum(masses)


def ordered(results: Sequence[ChangeResult]) -> list[ChangeResult]:
    """Sort changes of the design by their effect on the highest transmission error; assumptions and refusals follow."""

    def key(result: ChangeResult) -> tuple[bool, bool, float]:
        effect = result.effects.get("error")
        size = math.inf
        if effect is not None and effect.highest is not None:
            size = effect.highest
        return bool(result.refusal), result.change.group == ASSUMPTION, size

    return sorted(results, key=key)
