"""Proposals of design changes that may reduce a resonance: sets of keys of the gearbox file.

Changes are proposed in both directions and within usual limits. What is not proposed for a pair or a bearing is listed
with the reason. Assumptions form a group of their own: they are no changes of the design, but show how much the answer
depends on what is not known.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.sections.connections import CONTACT_ANGLES_DEG
from exugear.gearbox.sections.gears import ModificationSection
from exugear.gearbox.units import MM, UM
from exugear.report.findings.margins import PITTING
from fe_ste.geometry.gears import GearPair
from fe_ste.geometry.involute import involute

WHOLE = 0.05
"""Difference of an overlap ratio from a whole number below which no change of the overlap ratio is proposed."""
STEEPEST_DEG = 30.0
"""Largest proposed helix angle."""
WIDER = 0.2
"""Largest proposed relative change of a face width."""
AMOUNTS = (0.5, 1.0)
"""Tip relief and crowning in units of the mean static deflection of the teeth."""
STEEPER_DEG = 5.0
PRELOAD_UM = 20.0
STIFFER = 1.3
"""Changes of a bearing: contact angle, axial preload of a pair, factor of a stated stiffness and of its inverse."""
SAME_PHASING = 0.1
"""Difference of the resultant of planet phases, 1 for meshes in phase, below which the phasing counts as the same."""
ASSUMPTION = "assumption"
GROUPS = ("gear", "modification", "bearing", "coupling", ASSUMPTION)
"""Groups of changes, in the order of the table."""


@dataclass(frozen=True)
class DesignChange:
    """A proposal."""

    name: str
    """Short name, of letters, digits and hyphens."""
    words: str
    group: str
    """One of `GROUPS`."""
    keys: Mapping[str, Any]
    """New values by key of the gearbox file; empty for what is not proposed."""
    reason: str = ""
    """Why it is not proposed."""
    requirement: str = ""
    """Margin of `exugear.report.findings.margins` that it is to raise; such a change is always rated."""


def propose_changes(
    gearbox: Gearbox,
    multiples: Mapping[str, int],
    deflections: Mapping[str, float],
    bearings: Sequence[str],
    couplings: Sequence[str] = (),
    excitations: Sequence[str] = (),
) -> list[DesignChange]:
    """Propose changes for a resonance.

    Parameters
    ----------
    multiples : of the mesh frequency that excite it, by the family of meshes
    deflections : mean static transmission error of each pair, m
    bearings, couplings : families of bearings, and couplings, that have a large fraction of its strain energy
    excitations : stated loads that have its order
    """
    pairs = {mesh.pair.name: mesh.pair for mesh in gearbox.meshes if mesh.family in multiples}
    changes: list[DesignChange] = []
    for name, pair in pairs.items():
        changes += _overlap_changes(gearbox, name, pair)
        changes += _modification_changes(gearbox, name, pair, deflections.get(name, 0.0))
    changes += _phasing_changes(gearbox, multiples)
    for name in bearings:
        changes += _bearing_changes(gearbox, name)
    for name in couplings:
        stiffness = gearbox.case.couplings[name].stiffness_N_m_per_rad
        changes += _scaled(name, "coupling", {f"couplings.{name}.stiffness_N_m_per_rad": stiffness})
    for name in excitations:
        words = f"without the excitation {name}"
        changes.append(DesignChange(f"{name}-none", words, ASSUMPTION, {f"excitations.{name}.enabled": False}))
    # Half and twice the housing factor
    factor = gearbox.case.housing.factor
    for other in (0.5 * factor, min(2.0 * factor, 1.0)):
        if other != factor:
            words = f"housing stiffness factor {factor:g} to {other:g}"
            changes.append(DesignChange(f"housing-{other:g}", words, ASSUMPTION, {"housing.factor": other}))
    return changes


def _scaled(name: str, group: str, stated: Mapping[str, float]) -> Iterator[DesignChange]:
    """Larger and smaller values of stated stiffnesses of a part, by their keys; none if nothing is stated."""
    for factor, words in ((STIFFER, "stiffer"), (1.0 / STIFFER, "softer")):
        keys = {key: factor * value for key, value in stated.items()}
        if keys:
            share = f"{100.0 * abs(factor - 1.0):.0f} %"
            yield DesignChange(f"{name}-{words}", f"{name}: {share} {words}", group, keys)


def _gear_names(gearbox: Gearbox, pair: str) -> tuple[str, str]:
    section = gearbox.case.pairs[pair]
    return section.pinion, section.gear


def _overlap_changes(gearbox: Gearbox, name: str, pair: GearPair) -> Iterator[DesignChange]:
    """Bring the overlap ratio to the whole numbers around it, by the face width or by the helix angle."""
    overlap = pair.overlap_ratio
    if overlap == 0.0 or abs(overlap - round(overlap)) <= WHOLE:
        return
    both = _gear_names(gearbox, name)
    helix = gearbox.gears[both[0]].helix_angle
    for target in range(max(1, math.floor(overlap)), math.ceil(overlap) + 1):
        factor = target / overlap
        widths = {f"gears.{gear}.face_width_mm": factor * gearbox.case.gears[gear].face_width_mm for gear in both}
        if (common := gearbox.case.pairs[name].common_face_width_mm) is not None:
            widths[f"pairs.{name}.common_face_width_mm"] = factor * common
        wide = factor * pair.face_width / MM
        reason = ""
        if abs(factor - 1.0) > WIDER:
            reason = f"the face width would change by {100.0 * (factor - 1.0):+.0f} %, more than {100.0 * WIDER:.0f} %"
        words = f"{name}: face width {pair.face_width / MM:.4g} to {wide:.4g} mm (overlap ratio {target})"
        yield DesignChange(f"{name}-face-width-{target}", words, "gear", {} if reason else widths, reason)
        turned = abs(math.atan(factor * math.tan(helix)))
        reason = ""
        if math.degrees(turned) > STEEPEST_DEG:
            reason = f"the helix angle would exceed {STEEPEST_DEG:g} deg"
        words = (
            f"{name}: helix angle {abs(math.degrees(helix)):.4g} to {math.degrees(turned):.4g} deg, with module and "
            f"profile shift for the same centre distance (overlap ratio {target})"
        )
        keys = {} if reason else helix_change(gearbox, name, turned)
        yield DesignChange(f"{name}-helix-angle-{target}", words, "gear", keys, reason)


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
    """More and less tip relief and lead crowning, in units of the deflection of the teeth."""
    both = _gear_names(gearbox, name)
    sections = {gear: gearbox.case.gears[gear].modification or ModificationSection() for gear in both}
    # Half of the path with two tooth pairs in contact; teeth with a contact ratio near 1 or below get a short one.
    length = round(0.5 * max(pair.transverse_contact_ratio - 1.0, 0.1) * pair.transverse_base_pitch / MM, 2)
    amounts = sorted({max(1.0, round(share * deflection / UM)) for share in AMOUNTS})
    for amount in amounts:
        relief: dict[str, Any] = {}
        for gear, section in sections.items():
            place = f"gears.{gear}.modification"
            if section.tip_relief_um == 0.0:
                relief[f"{place}.tip_relief_length_mm"] = length
            relief[f"{place}.tip_relief_um"] = section.tip_relief_um + amount
        words = f"{name}: tip relief {amount:g} µm more on both gears"
        if len(relief) > len(sections):  # a gear without relief gets its length, too
            words += f", {length:g} mm long"
        yield DesignChange(f"{name}-tip-relief-{amount:g}", words, "modification", relief)
        crowned = sections[both[0]].lead_crowning_um + amount
        words = f"{name}: lead crowning {amount:g} µm more on {both[0]}"
        keys = {f"gears.{both[0]}.modification.lead_crowning_um": crowned}
        yield DesignChange(f"{name}-crowning-{amount:g}", words, "modification", keys)
    # Less of what the gears have
    for key, short, label in (
        ("tip_relief_um", "tip-relief", "tip relief"),
        ("lead_crowning_um", "crowning", "lead crowning"),
    ):
        present = {gear: value for gear, section in sections.items() if (value := getattr(section, key)) > 0.0}
        for amount in amounts if present else ():
            keys = {f"gears.{gear}.modification.{key}": max(0.0, value - amount) for gear, value in present.items()}
            words = f"{name}: {label} {min(amount, max(present.values())):g} µm less on {' and '.join(present)}"
            yield DesignChange(f"{name}-less-{short}-{amount:g}", words, "modification", keys)
            if not any(keys.values()):
                break


def alignment_change(gearbox: Gearbox, family: str, opening: float) -> DesignChange | None:
    """Helix slope that closes the gap between the flanks of misaligned gears; None for less than half a micrometre.

    It is on the pinion, or on the other gear if only that one meshes in a single pair.

    Parameters
    ----------
    opening : gap at the +z end of the common face under the static load, m; negative if the teeth carry there

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> print(alignment_change(gearbox, "high_speed", -12e-6).words)
    high_speed: helix slope 12 µm on hs_pinion, which closes the gap under the static load
    """
    pair = next(mesh.pair.name for mesh in gearbox.meshes if mesh.family == family)
    both = _gear_names(gearbox, pair)
    pairs_of = {gear: sum(gear in _gear_names(gearbox, other) for other in gearbox.gear_pairs) for gear in both}
    gear = min(both, key=lambda name: pairs_of[name])
    present = (gearbox.case.gears[gear].modification or ModificationSection()).helix_slope_um
    slope = present - round(opening / UM)
    if slope == present:
        return None
    words = f"{pair}: helix slope {slope:g} µm on {gear}, which closes the gap under the static load"
    keys = {f"gears.{gear}.modification.helix_slope_um": slope}
    return DesignChange(f"{pair}-helix-slope", words, "modification", keys, requirement=PITTING)


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
    bodies = gearbox.named_bodies
    planet_gears = {
        (bodies[body].family, gear.name): multiples[mesh.family]
        for mesh in gearbox.meshes
        if mesh.family in multiples
        for body, gear in ((mesh.pinion, mesh.pair.pinion), (mesh.gear, mesh.pair.gear))
        if bodies[body].planet_of is not None
    }
    for (body, planet), multiple in planet_gears.items():
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


def _bearing_changes(gearbox: Gearbox, family: str) -> list[DesignChange]:
    """Contact angle, preload and clearance of a catalogue bearing; factors of a stated stiffness."""
    section = gearbox.case.bearings.get(family)
    if section is None:
        return []
    place = f"bearings.{family}"
    catalogue = section.catalogue
    changes = []
    if catalogue is not None:
        limits = CONTACT_ANGLES_DEG.get(catalogue.type)
        angle = catalogue.contact_angle_deg
        if limits and angle is not None and catalogue.type in ("tapered_roller", "angular_contact_ball"):
            for other in (max(angle - STEEPER_DEG, limits[0]), min(angle + STEEPER_DEG, limits[1])):
                if other != angle:
                    words = f"{family}: contact angle {angle:g} to {other:g} deg"
                    key = f"{place}.catalogue.contact_angle_deg"
                    changes.append(DesignChange(f"{family}-contact-angle-{other:g}", words, "bearing", {key: other}))
        if catalogue.arrangement in ("X", "O"):
            preload = catalogue.axial_preload_um
            for other in (max(0.0, preload - PRELOAD_UM), preload + PRELOAD_UM):
                if other != preload:
                    words = f"{family}: axial preload {preload:g} to {other:g} µm"
                    key = f"{place}.catalogue.axial_preload_um"
                    changes.append(DesignChange(f"{family}-preload-{other:g}", words, "bearing", {key: other}))
        elif catalogue.radial_clearance_mm > 0.0:
            words = f"{family}: no radial clearance"
            keys = {f"{place}.catalogue.radial_clearance_mm": 0.0}
            changes.append(DesignChange(f"{family}-clearance", words, "bearing", keys))
    elif section.stiffness is not None:
        stated = {key: value for key, value in section.stiffness if key.endswith(("N_per_m", "m_per_rad")) and value}
        changes += _scaled(family, "bearing", {f"{place}.stiffness.{key}": value for key, value in stated.items()})
    if changes:
        return changes
    kind = "bearing" if catalogue is None else f"{catalogue.type.replace('_', ' ')} bearing"
    reason = f"a {kind} without adjustable contact angle, preload, clearance or stated stiffness"
    return [DesignChange(f"{family}-none", f"{family}: stiffness", "bearing", {}, reason)]
