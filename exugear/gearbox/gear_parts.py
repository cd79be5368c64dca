"""Gears, their modifications and deviations, pairs and meshes, built from the sections of a gearbox file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, replace
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exugear.gearbox.named_files import LARGEST_TABLE
from exugear.gearbox.parts import Body, Mesh, PairSpec, WheelDeviation
from exugear.gearbox.reading import Origin, known_names, part_of_each, parts_of_each
from exugear.gearbox.sections.connections import MeshSection
from exugear.gearbox.sections.entries import GROUND
from exugear.gearbox.sections.gears import (
    CutterSection,
    DeviationSection,
    GearSection,
    MeshStiffnessSection,
    ModificationSection,
    PairSection,
)
from exugear.gearbox.units import MM, UM, optional_si, si
from fe_ste.flanks import (
    FlankModification,
    FlankTopography,
    Relief,
    ReliefShape,
    radius_at_roll_length_from_root,
    radius_at_roll_length_from_tip,
)
from fe_ste.geometry.gear_relations import ROUNDING, GearInputs
from fe_ste.geometry.gears import BasicRack, Gear, GearPair, Material
from fe_ste.geometry.involute import PinionCutter
from fe_ste.geometry.pair_relations import (
    LEAST_ROOT_MARGIN,
    ROOT_MARGIN,
    UncheckedPair,
    clear_tip_diameter,
    fitted_tip_diameter,
    root_margin,
    shift_beside,
)
from fe_ste.tools.arrays import Floats

DEEPEST_REMOVAL = 0.5
"""Largest material removal of a modification or deviation in normal modules; a tooth is about 1.6 modules thick."""
SAMPLES_PER_WAVE = 64
"""Samples per period of a specified stiffness harmonic: cubic interpolation errs by 1e-5 of the amplitude."""
ANGLE_TOLERANCE = 1e-4
"""Allowed difference between a specified angle of the line of centres and the positions of the bodies, rad."""


def gears(origin: Origin) -> dict[str, Gear]:
    """All gears by name.

    Raises
    ------
    GearboxFileError
        A gear cannot be built; the message names its key.
    """
    plain = {name: _unchecked(name, section) for name, section in origin.case.gears.items()}
    unstated = _flagged(origin, "profile_shift_from_centre_distance")
    shifted = plain | part_of_each(partial(_with_shift, origin, plain), unstated)
    shifted = {name: with_usual_rounding(origin.case.gears[name], gear) for name, gear in shifted.items()}
    fitted = shifted | part_of_each(partial(_with_fitted_tip, origin, shifted), _flagged(origin, "fitted_tip"))
    fitted |= _without_rounded_overlaps(origin, fitted)

    def convert_section(name: str, section: GearSection) -> Gear:
        gear = fitted[name]
        if section.tip_chamfer_mm:
            height = gear.outward * section.tip_chamfer_mm * MM
            gear = replace(gear, tip_form_diameter=2.0 * (gear.tip_radius - height))
        return origin.guarded(
            f"gears.{name}", Gear, **{field.name: getattr(gear, field.name) for field in fields(gear)}
        )

    return part_of_each(convert_section, origin.case.gears)


def with_usual_rounding(section: GearSection, gear: GearInputs) -> GearInputs:
    """Gear with the tool tip radius limited to the largest possible one, if the file leaves the radius to the default.

    At 25 degrees and a dedendum of 1.25 the limit is 0.318 normal modules. A larger radius in the file is refused.
    """
    if "tip_radius" in section.rack.model_fields_set or gear.cutter is not None:
        return gear
    fits = gear.largest_rack_rounding
    if gear.internal:  # an arc that leaves half of the tooth depth to the flank
        fits = 0.5 * (gear.root_radius - gear.tip_radius) / gear.normal_module
        if 2.0 * fits > gear.rack.tip_radius:
            return gear
    largest = math.floor(1e4 * fits) / 1e4
    if not 0.0 <= largest < gear.rack.tip_radius:
        return gear
    return replace(gear, rack=replace(gear.rack, tip_radius=largest))


def smaller_roundings(origin: Origin, gears: Mapping[str, Gear]) -> Iterator[str]:
    """Yield notes on tool tip radii that were reduced below the usual default because it does not fit."""
    for name, section in origin.case.gears.items():
        usual = section.rack.tip_radius
        taken = gears[name].rack.tip_radius
        if taken != usual:
            yield (
                f"gears.{name}.rack.tip_radius: the default of {usual:g} does not fit the rack at "
                f"{section.normal_pressure_angle_deg:g} deg and its dedendum; {taken:g}, the largest possible value, "
                "is used"
            )


def _flagged(origin: Origin, key: str) -> dict[str, GearSection]:
    """Sections of gears whose profile shift or tip diameter follows from their mating gears, as a key says."""
    return {name: section for name, section in origin.case.gears.items() if getattr(section, key)}


def _pairs_of(origin: Origin, gears: Mapping[str, GearInputs], name: str) -> Iterator[tuple[str, UncheckedPair]]:
    """Yield the pairs of a gear with their names; gear 1 is the external or smaller gear."""
    for pair, section in origin.case.pairs.items():
        both = [gears[gear] for gear in (section.pinion, section.gear) if gear in gears]
        if name in (section.pinion, section.gear) and len(both) == 2:
            first, second = sorted(both, key=lambda gear: (gear.internal, gear.teeth))
            distance = si(section, "centre_distance_mm")
            yield pair, UncheckedPair(name=pair, pinion=first, gear=second, centre_distance=distance)


def _with_shift(origin: Origin, gears: Mapping[str, GearInputs], name: str, section: GearSection) -> GearInputs:
    """Gear with the profile shift that results in zero backlash at the centre distance of its first pair."""
    key = f"gears.{name}.profile_shift_from_centre_distance"
    for pair_name, pair in _pairs_of(origin, gears, name):
        mate = pair.gear if pair.pinion.name == name else pair.pinion
        if origin.case.gears[mate.name].profile_shift_from_centre_distance:
            raise origin.error(f"{key}: {mate.name} of pairs.{pair_name} has no profile_shift either; set one of them")
        shift = shift_beside(mate, gears[name], pair.centre_distance)
        if shift is None:
            raise origin.error(_no_line_of_action(pair))
        return replace(gears[name], profile_shift=shift)
    raise origin.error(f"{key}: the gear is in no pair whose centre distance defines it; set profile_shift")


def _no_line_of_action(pair: UncheckedPair) -> str:
    """Say that the base circles of a pair are too large for its centre distance, with the numbers that decide it."""
    pinion, gear = pair.pinion, pair.gear
    reference = 0.5 * abs(pinion.teeth + (-gear.teeth if gear.internal else gear.teeth)) * gear.transverse_module
    base = reference * math.cos(gear.transverse_pressure_angle)
    return (
        f"pairs.{pair.name}.centre_distance_mm = {1e3 * pair.centre_distance:g}: no line of action touches both base "
        f"circles below {1e3 * base:.4g} mm; the reference centre distance is {1e3 * reference:.5g} mm ({pinion.teeth} "
        f"and {gear.teeth} teeth, module {1e3 * gear.normal_module:g} mm, helix angle "
        f"{abs(math.degrees(gear.helix_angle)):g} deg); check them"
    )


LEAST_PLAY = 1e-12
"""Backlash that remains where teeth are thinned to zero backlash, m."""
FEWEST_DECIMALS = 3
"""Minimum number of decimals assumed for profile shifts and centre distances (mm) in tables: 0.5 is read as 0.500."""


def _rounding(value: float) -> float:
    """Half a unit of the last digit of a value in the file.

    Examples
    --------
    >>> _rounding(0.8532), _rounding(91.5)
    (5e-05, 0.0005)
    """
    exponent = Decimal(repr(value)).as_tuple().exponent
    return 0.5 * 10.0 ** min(int(exponent), -FEWEST_DECIMALS)


def _without_rounded_overlaps(origin: Origin, gears: Mapping[str, GearInputs]) -> dict[str, GearInputs]:
    """Gears with teeth thinned where rounded profile shifts and centre distances result in negative backlash.

    Published values are rounded in their last digit. Gears designed for zero backlash may therefore overlap by some
    nanometres. Such a pair gets zero backlash; larger overlaps are left to the checks.
    """
    changed = dict(gears)
    for pair_name, section in origin.case.pairs.items():
        for name, pair in _pairs_of(origin, changed, section.gear):
            if name != pair_name:
                continue
            try:
                overlap = -pair.circumferential_backlash
                across = math.cos(pair.working_pressure_angle) / math.cos(pair.gear.transverse_pressure_angle)
            except ValueError:
                continue  # an impossible pair is reported when it is built
            shifts = sum(_rounding(origin.case.gears[gear.name].profile_shift) for gear in (pair.pinion, pair.gear))
            shifts *= 2.0 * math.tan(pair.gear.normal_pressure_angle) * pair.gear.normal_module
            distance = 2.0 * math.tan(pair.working_pressure_angle) * MM * _rounding(section.centre_distance_mm)
            least = ROUNDING * pair.gear.normal_module  # tolerance of the checks
            if least < overlap <= shifts / (math.cos(pair.gear.helix_angle) * across) + distance:
                thinning = pair.gear.tooth_thinning + overlap * across + LEAST_PLAY
                changed[pair.gear.name] = replace(changed[pair.gear.name], tooth_thinning=thinning)
    return {name: gear for name, gear in changed.items() if gear is not gears[name]}


def rounded_overlaps(origin: Origin, gears: Mapping[str, Gear]) -> Iterator[str]:
    """Yield notes on teeth that were thinned because published values are rounded."""
    for name, section in origin.case.gears.items():
        thinned = gears[name].tooth_thinning - sum(thinning_range(section)) / 2.0
        if thinned > LEAST_PLAY / 2.0:
            yield (
                f"gears.{name}: profile shifts and centre distance result in a negative backlash of "
                f"{1e6 * thinned:.3g} µm, within the rounding of the input; zero backlash is used, with teeth thinner "
                "by that amount"
            )


def _with_fitted_tip(origin: Origin, gears: Mapping[str, GearInputs], name: str, section: GearSection) -> GearInputs:
    """Gear with its tip shortened as far as all of its mating gears require."""
    gear = gears[name]
    try:
        tips = [
            fitted_tip_diameter(pair, pair.gear if pair.gear.name == name else pair.pinion)
            for _, pair in _pairs_of(origin, gears, name)
        ]
    except ValueError:
        return gear  # an impossible pair is reported when it is built
    if not tips:
        raise origin.error(f"gears.{name}.fitted_tip: the gear is in no pair; remove the key")
    return replace(gear, tip_diameter=max(tips) if gear.internal else min(tips))


def _unchecked(name: str, section: GearSection) -> GearInputs:
    """Unchecked gear from its section, converted from millimetres to metres and from degrees to radians."""
    return GearInputs(
        name=name,
        teeth=section.teeth,
        normal_module=si(section, "normal_module_mm"),
        normal_pressure_angle=si(section, "normal_pressure_angle_deg"),
        helix_angle=si(section, "helix_angle_deg"),
        profile_shift=section.profile_shift,
        face_width=si(section, "face_width_mm"),
        held_diameter=si(section, "held_diameter_mm"),
        internal=section.internal,
        rack=BasicRack(section.rack.addendum, section.rack.dedendum, section.rack.tip_radius),
        tip_diameter=optional_si(section, "tip_diameter_mm"),
        root_diameter=optional_si(section, "root_diameter_mm"),
        tooth_thinning=sum(thinning_range(section)) / 2.0,
        material=Material(
            youngs_modulus=si(section.material, "youngs_modulus_GPa"),
            poissons_ratio=section.material.poissons_ratio,
            density=section.material.density_kg_per_m3,
        ),
        tip_form_diameter=optional_si(section, "tip_form_diameter_mm"),
        root_form_diameter=optional_si(section, "root_form_diameter_mm"),
        cutter=pinion_cutter(section.cutter, section.normal_module_mm, section.helix_angle_deg),
    )


def pinion_cutter(cutter: CutterSection | None, module_mm: float, helix_angle_deg: float) -> PinionCutter | None:
    """Pinion-type cutter of a ring gear; its addendum follows from d_a0 = m_n (z_0 / cos(beta) + 2 (x_0 + h_a0*))."""
    if cutter is None:
        return None
    tip_mm = cutter.tip_diameter_mm
    if cutter.addendum is not None:
        reference = cutter.teeth / math.cos(math.radians(helix_angle_deg))
        tip_mm = module_mm * (reference + 2.0 * (cutter.profile_shift + cutter.addendum))
    return PinionCutter(cutter.teeth, cutter.tip_radius, cutter.profile_shift, None if tip_mm is None else MM * tip_mm)


def thinning_range(section: GearSection) -> tuple[float, float]:
    """Minimum and maximum tooth thinning in the transverse section, m; both are equal without allowances."""
    allowances = section.tooth_thickness
    if allowances is None:
        thinning = si(section, "tooth_thinning_mm")
        return thinning, thinning
    upper = allowances.upper_allowance_um
    lower = allowances.lower_allowance_um
    if lower is None:
        lower = upper - (allowances.tolerance_um or 0.0)
    transverse = -UM / math.cos(si(section, "helix_angle_deg"))
    return transverse * upper, transverse * lower


def margins_of_roots(pairs: Iterable[GearPair]) -> Iterator[str]:
    """Yield warnings for tips too close to the fillet of the mating gear for contact under load, with the remedy."""
    for pair in pairs:
        for tip, mate in ((pair.pinion, pair.gear), (pair.gear, pair.pinion)):
            margin = root_margin(pair, tip)
            if margin < LEAST_ROOT_MARGIN * tip.normal_module:
                clear = 1e3 * clear_tip_diameter(pair, tip, ROOT_MARGIN * tip.normal_module)
                yield (
                    f"gears.{tip.name}: its tip meets {mate.name} {1e3 * margin:.3f} mm of roll length above the "
                    "fillet, which contact under load may reach, where it has no solution; set tip_diameter_mm = "
                    f"{clear:.3f}, or fitted_tip = true"
                )


def modifications(origin: Origin, gears: Mapping[str, Gear]) -> dict[str, FlankModification]:
    """Flank modifications of all gears by name.

    Raises
    ------
    GearboxFileError
        A modification does not fit its gear, or a topography cannot be read.
    """

    def convert_section(name: str, section: GearSection) -> FlankModification:
        key = f"gears.{name}.modification"
        amounts = {} if section.modification is None else dict(section.modification)
        _check_depth(origin, key, amounts, section.normal_module_mm)
        find = partial(origin.file, f"{key}.topography", largest=LARGEST_TABLE)
        modification = origin.guarded(key, _modification, gears[name], section, find)
        if modification.topography is not None:
            removed = 1e6 * max(abs(value) for row in modification.topography.removed for value in row)
            _check_depth(origin, key, {"topography, removed_um": removed}, section.normal_module_mm)
        return modification

    return part_of_each(convert_section, origin.case.gears)


def _modification(gear: Gear, section: GearSection, find: Callable[[str], Path]) -> FlankModification:
    """Modification of a gear from its section, checked on the gear; `find` returns the path of the topography file."""
    given = section.modification
    if given is None:
        return FlankModification()
    modification = FlankModification(
        tip_relief=_relief(gear, given, "tip", radius_at_roll_length_from_tip),
        root_relief=_relief(gear, given, "root", radius_at_roll_length_from_root),
        profile_crowning=si(given, "profile_crowning_um"),
        lead_crowning=si(given, "lead_crowning_um"),
        profile_slope=si(given, "profile_slope_um"),
        helix_slope=si(given, "helix_slope_um"),
        twist=si(given, "twist_um"),
        topography=None if given.topography is None else FlankTopography.from_csv(find(given.topography)),
    )
    modification.gap(gear, np.array(gear.tip_radius), np.array(0.0))  # refuses a relief that starts off the involute
    return modification


def _relief(
    gear: Gear, given: ModificationSection, kind: str, from_end: Callable[[Gear, float], float]
) -> Relief | None:
    amount = si(given, f"{kind}_relief_um")
    if amount == 0.0:
        return None
    start_roll = optional_si(given, f"{kind}_relief_start_roll_deg")
    if start_roll is None:
        radius = from_end(gear, si(given, f"{kind}_relief_length_mm"))
    else:
        radius = gear.base_radius * math.hypot(1.0, start_roll)
    return Relief(amount, radius, ReliefShape(getattr(given, f"{kind}_relief_shape")))


def _check_depth(origin: Origin, key: str, amounts: Mapping[str, Any], module_mm: float) -> None:
    """Raise an error if the removal exceeds the limit `DEEPEST_REMOVAL`."""
    deepest = 1e3 * DEEPEST_REMOVAL * module_mm
    for name, amount in amounts.items():
        if name.endswith("_um") and abs(amount) > deepest:
            raise origin.error(f"{key}.{name} = {amount:g}: must be at most {deepest:g}, half a normal module")


def gear_pairs(origin: Origin, gears: Mapping[str, Gear]) -> dict[str, GearPair]:
    """All gear pairs by name.

    Raises
    ------
    GearboxFileError
        The gears of a pair cannot run together.
    """

    def convert_section(name: str, section: PairSection) -> GearPair:
        first = gears[section.pinion]
        second = gears[section.gear]
        # A file may call the larger gear or the ring gear the pinion; gear 1 is then the other gear.
        if (first.internal, first.teeth) > (second.internal, second.teeth):
            first, second = second, first
        return origin.guarded(
            f"pairs.{name}",
            GearPair,
            name=name,
            pinion=first,
            gear=second,
            centre_distance=si(section, "centre_distance_mm"),
            common_face_width=optional_si(section, "common_face_width_mm"),
        )

    return part_of_each(convert_section, origin.case.pairs)


def pair_specs(
    sections: Mapping[str, PairSection],
    pairs: Mapping[str, GearPair],
    modifications: Mapping[str, FlankModification],
    mesh_forces: Mapping[str, list[float]],
    stated: Mapping[str, tuple[float, ...]],
) -> dict[str, PairSpec]:
    """Specifications of pairs from which STE tables are computed, by pair name.

    Parameters
    ----------
    modifications : by gear name
    mesh_forces : by pair name
        Static force F_bt of each enabled mesh, N; the force of the pair is the mean of their absolute values.
    stated : by pair name, mesh stiffness of pairs that need no table
    """
    specs = {}
    for name, pair in pairs.items():
        section = sections[name]
        forces = mesh_forces.get(name, [])
        force = sum(abs(force) for force in forces) / len(forces) if forces else 0.0
        specs[name] = PairSpec(
            name=name,
            pair=pair,
            static_torque=force * pair.pinion.base_radius,
            table=section.table and name not in stated and force > 0.0,
            flank=-1 if sum(forces) < 0.0 else 1,
            modifications=(modifications[pair.pinion.name], modifications[pair.gear.name]),
            stiffness=stated.get(name, ()),
        )
    return specs


def stated_stiffness(origin: Origin) -> dict[str, tuple[float, ...]]:
    """Mesh stiffness specified in the file, N/m at equal distances over the mesh cycle, by pair name.

    Raises
    ------
    GearboxFileError
        A stiffness is zero or negative somewhere in the cycle.
    """

    def convert_section(name: str, section: PairSection) -> tuple[float, ...]:
        assert section.stiffness is not None
        values = _stiffness_over_cycle(section.stiffness)
        if values.min() <= 0.0:
            raise origin.error(
                f"pairs.{name}.stiffness: falls to {values.min():g} N/m in the mesh cycle; reduce its harmonics, it "
                "must stay above zero"
            )
        return tuple(values.tolist())

    return part_of_each(
        convert_section, {name: pair for name, pair in origin.case.pairs.items() if pair.stiffness is not None}
    )


def _stiffness_over_cycle(section: MeshStiffnessSection) -> Floats:
    """Sample the stiffness over the mesh cycle, N/m: from the file, or a sum of harmonics for cubic interpolation."""
    if section.over_cycle_N_per_m is not None:
        return np.array(section.over_cycle_N_per_m)
    count = max(1, SAMPLES_PER_WAVE * len(section.cosine_N_per_m), SAMPLES_PER_WAVE * len(section.sine_N_per_m))
    angle = 2.0 * np.pi * np.arange(count) / count
    values = np.full(angle.shape, section.mean_N_per_m, dtype=np.float64)
    for waves, function in ((section.cosine_N_per_m, np.cos), (section.sine_N_per_m, np.sin)):
        for order, amplitude in enumerate(waves, start=1):
            values += amplitude * function(order * angle)
    return values


def meshes(origin: Origin, pairs: Mapping[str, GearPair], bodies: Mapping[str, Body]) -> tuple[Mesh, ...]:
    """All enabled meshes, one per planet.

    Raises
    ------
    GearboxFileError
        A pair or body is unknown, a body lacks the gear, faces do not overlap, or angles contradict positions.
    """

    def convert_section(name: str, section: MeshSection) -> tuple[Mesh, ...]:
        key = f"meshes.{name}"
        for end in ("pinion_body", "gear_body"):
            if getattr(section, end) == GROUND:
                raise origin.error(
                    f"{key}.{end} = {GROUND!r}: set a rotating body; a body with fixed = true does not rotate"
                )
        if not origin.are_enabled(key, section.pinion_body, section.gear_body):
            return ()
        if section.pair not in pairs:
            known = known_names("pairs", pairs, f"pairs.{section.pair}", section.pair)
            raise origin.error(f"{key}.pair = {section.pair!r}: no such pair; {known}")
        return tuple(_meshes_of_section(origin, name, section, pairs[section.pair], bodies))

    return parts_of_each(convert_section, origin.case.meshes)


def _meshes_of_section(
    origin: Origin, family: str, section: MeshSection, pair: GearPair, bodies: Mapping[str, Body]
) -> Iterator[Mesh]:
    key = f"meshes.{family}"
    ends = (section.pinion_body, section.gear_body)
    stated_deg = section.position_angle_deg
    if pair.pinion.name != origin.case.pairs[section.pair].pinion:
        ends = ends[::-1]
        stated_deg = None if stated_deg is None else stated_deg + 180.0
    instances = origin.instances(key, *ends)
    phases = section.phase if isinstance(section.phase, tuple) else (section.phase,) * len(instances)
    if len(phases) != len(instances):
        raise origin.error(f"{key}.phase = {list(phases)}: {len(instances)} meshes require {len(instances)} phases")
    for (suffix, pinion_name, gear_name), phase in zip(instances, phases, strict=True):
        pinion_body = bodies[pinion_name]
        gear_body = bodies[gear_name]
        frame = section.frame or pinion_body.carrier or gear_body.carrier or GROUND
        if frame != GROUND and frame not in bodies:
            raise origin.error(f"{key}.frame = {frame!r}: no such body; use a carrier's name or ground")
        dx = gear_body.axis[0] - pinion_body.axis[0]
        dy = gear_body.axis[1] - pinion_body.axis[1]
        angle = math.atan2(dy, dx)
        off = 0.0 if stated_deg is None else math.remainder(angle - math.radians(stated_deg), 2 * math.pi)
        if abs(off) > ANGLE_TOLERANCE:
            raise origin.error(
                f"{key}.position_angle_deg = {stated_deg}: the positions of the bodies result in "
                f"{math.degrees(angle):.4f} deg; remove the key or correct the positions"
            )
        z = _middle_of_faces(origin, key, pair, pinion_body, gear_body)
        yield Mesh(
            name=family + suffix,
            family=family,
            pair=pair,
            pinion=pinion_name,
            gear=gear_name,
            frame=frame,
            z=z,
            offsets=(z - pinion_body.wheels[pair.pinion.name], z - gear_body.wheels[pair.gear.name]),
            position_angle=angle,
            centre_distance=math.hypot(dx, dy),
            phase=phase,
        )


def _middle_of_faces(origin: Origin, key: str, pair: GearPair, pinion_body: Body, gear_body: Body) -> float:
    """Axial middle of the overlap of the two faces, m."""
    low = -math.inf
    high = math.inf
    for body, gear in ((pinion_body, pair.pinion), (gear_body, pair.gear)):
        if gear.name not in body.wheels:
            raise origin.error(
                f"{key}: body {body.family!r} carries no gear {gear.name!r}; set its position in bodies.{body.family}"
                ".gears_z_mm"
            )
        low = max(low, body.wheels[gear.name] - gear.face_width / 2)
        high = min(high, body.wheels[gear.name] + gear.face_width / 2)
    if high <= low:
        raise origin.error(f"{key}: the faces of {pair.pinion.name} and {pair.gear.name} do not overlap in z")
    return (low + high) / 2


def deviations(
    origin: Origin, gears: Mapping[str, Gear], bodies: Mapping[str, Body]
) -> dict[tuple[str, str], WheelDeviation]:
    """Deviations of gears by body and gear; pitch deviations are cumulative, positive into the tooth (ISO 1328-1).

    Raises
    ------
    GearboxFileError
        A body or gear is unknown, the number of values differs from the teeth, or values exceed the tooth depth.
    """

    def convert_section(name: str, section: DeviationSection) -> tuple[tuple[str, str], WheelDeviation]:
        key = f"deviations.{name}"
        if section.body not in bodies:
            raise origin.error(f"{key}.body = {section.body!r}: no such body; bodies are {', '.join(bodies)}")
        wheels = bodies[section.body].wheels
        gear = section.gear or next(iter(wheels), "")
        if gear not in wheels or (section.gear is None and len(wheels) > 1):
            if not wheels:
                raise origin.error(f"{key}.body = {section.body!r}: has no gears; set a body with gears")
            raise origin.error(f"{key}.gear = {section.gear!r}: choose one of {', '.join(wheels)}")
        return (section.body, gear), _deviation(origin, key, gears[gear], section)

    return dict(part_of_each(convert_section, origin.case.deviations).values())


def _deviation(origin: Origin, key: str, gear: Gear, section: DeviationSection) -> WheelDeviation:
    pitch = np.array(section.cumulative_pitch_um) * UM
    if len(pitch) not in (0, gear.teeth):
        raise origin.error(f"{key}.cumulative_pitch_um: {len(pitch)} values; {gear.name} has {gear.teeth} teeth")
    amounts = {"cumulative_pitch_um": max(map(abs, section.cumulative_pitch_um), default=0.0)}
    amounts["runout_um"] = section.runout_um
    _check_depth(origin, key, amounts, 1e3 * gear.normal_module)
    return WheelDeviation(
        teeth=gear.teeth,
        pitch=pitch * gear.base_radius / gear.reference_radius,
        eccentricity=0.5 * si(section, "runout_um"),
        eccentricity_angle=si(section, "runout_angle_deg"),
    )
