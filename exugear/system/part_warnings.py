"""Plausibility checks: possible but implausible masses, bores, positions and centre distances for the gear dimensions.

Limits are wide: a wrong unit is a factor of ten or more, and an intended design must not cause a warning.

Only macro geometry and the static load are used, so that the checks run at negligible cost before any finite-element
work.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from exugear.gearbox.gear_parts import thinning_range
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.load_cases import inertia_at_input, operating_range, speeds_beyond_tables, summarise_loads
from exugear.gearbox.parts import Bearing, Body, PairSpec, VaryingLoad, connector_matrix
from exugear.gearbox.sections.designations import boundary_of
from exugear.gearbox.units import MM, RPM, si
from exugear.system.bearings.rolling.catalogue import similar_designation
from exugear.system.bodies.seated_items import seat_width
from fe_ste.geometry.checks import USUAL_TIP_THICKNESS
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.standards.pitting import nominal_contact_stress

LEAST_CLASH, CLASHING_SHARE = 1e-3, 0.15
"""Overlap of a gear and a bearing from which a warning is given: height (m), and part of the width of a row.

Rings of tapered bearings are narrower than the bearing, and face widths in files include chamfers.
"""
STEEL = 7850.0
"""Density that masses are compared by, kg/m3."""
MOST_MASS, LEAST_MASS = 50.0, 0.02
"""Mass of a body over that of the steel cylinder around its gears and bearings."""
MOST_GYRATION, LEAST_GYRATION = 8.0, 0.02
"""Maximum radius of gyration of a body over the reach of its gears and bearings: a disc next to gears may be large."""
LEAST_OVERLAP = 0.9
"""Part of the face of a pair on which both gears have teeth."""
MOST_BACKLASH = 3.0
"""Backlash over that of `usual_backlash`, above which a profile shift or centre distance looks wrong."""
LEAST_BORE, MOST_RIM = 0.02, 2.0
"""Bore of a gear, and outside of a ring's rim, over the root diameter."""
WHEEL, LEAST_SEAT, LEAST_OVER_SHAFT = 1.5, 0.98, 0.9
"""Root diameter over the adjacent shaft from which a gear is taken as mounted, not integral with the shaft; and minimum
bore of a mounted gear over the bores of the bearings on both sides, and over the shaft under it in the file."""
OTHER_SIZE, MOST_WALL = 0.01, 4.0
"""Difference of a diameter from that of the designation, and outer diameter of a bearing over its bore."""
MOST_TURNED = 0.02
"""Mesh cycles by which a stated torque may turn the gear train; more looks like a missing machine."""
BALANCE_GRADES = (0.4, 1.0, 2.5, 6.3, 16.0, 40.0)
"""Balance quality grades G of ISO 21940-11, mm/s, up to the largest of gearboxes and electric machines."""
LEAST_PER_GRADE = 3.0
"""Unbalance (g mm) that G 1 permits, above which the number of a grade is not taken for an unbalance."""
SELF_ALIGNING = ("self_aligning_ball", "spherical_roller", "thrust_spherical_roller")
"""Types of bearings that do not resist tilting with any number of rows; of the others, a single row barely does."""


def part_warnings(gearbox: Gearbox) -> Iterator[str]:
    """Say what looks like a mistake: key, value, and what it is compared with."""
    yield from _masses(gearbox)
    yield from _bores(gearbox)
    yield from _seats(gearbox)
    yield from _seats_beyond_shapes(gearbox)
    yield from _bearings(gearbox)
    yield from _faces(gearbox)
    yield from _backlashes(gearbox)
    yield from shafts_on_one_bearing(gearbox)
    yield from _faces_in_bearings(gearbox)
    yield from _speed_limits(gearbox)
    yield from excitation_warnings(gearbox)


def _speed_limits(gearbox: Gearbox) -> Iterator[str]:
    """Compare seals and bearings with their speed limits, at the highest speed of operation and of all load cases."""
    limited = [bearing for bearing in gearbox.bearings if bearing.catalogue and bearing.catalogue.speed_limit_rpm]
    if not gearbox.case.seals and not limited:
        return
    fastest = (operating_range(gearbox) or (0.0, 0.0))[1]
    for case in gearbox.load_cases.values():
        fastest = max(fastest, summarise_loads(gearbox, case).fastest_speed)
    speeds = gearbox.train.rolling_speeds(gearbox.case.overall.input, fastest)
    at = f"at {fastest / RPM:.4g} rpm of {gearbox.case.overall.input}"
    for name, seal in gearbox.case.seals.items():
        turns = abs(speeds.get(seal.body, 0.0) - speeds.get(seal.on, 0.0))
        speed = 0.5 * si(seal, "diameter_mm") * turns
        if speed > seal.speed_limit_m_per_s:
            usual = "" if "speed_limit_m_per_s" in seal.model_fields_set else " usual for nitrile rubber (NBR)"
            yield (
                f"seals.{name}: the lip slides at {speed:.3g} m/s {at}, above {seal.speed_limit_m_per_s:g} m/s{usual}; "
                "reduce the speed, or set speed_limit_m_per_s of its material"
            )
    for bearing in limited:
        assert bearing.catalogue is not None
        turns = abs(speeds.get(bearing.body, 0.0) - speeds.get(bearing.on, 0.0)) / RPM
        if turns > (bearing.catalogue.speed_limit_rpm or math.inf):
            yield (
                f"bearings.{bearing.family}: turns at {turns:.4g} rpm {at}, above speed_limit_rpm = "
                f"{bearing.catalogue.speed_limit_rpm:g}"
            )


def _masses(gearbox: Gearbox) -> Iterator[str]:
    """Compare mass and moments of inertia of bodies with gears with a steel cylinder around these."""
    reported = set()
    for inertias in gearbox.inertia_sets:
        for body in gearbox.bodies(inertias):
            reach = _reach(gearbox, body)
            key = f"bodies.{body.family}.inertia.{inertias}"
            if reach is None or body.fixed or key in reported:
                continue
            for doubt in _mass_warnings(body, *reach):
                reported.add(key)
                yield f"{key}.{doubt}"


def _reach(gearbox: Gearbox, body: Body) -> tuple[float, float] | None:
    """Largest tip radius of a body's gears, and length from the first to the last gear or bearing, m."""
    gears = {name: gearbox.gears[name] for name in body.wheels}
    if not gears or body.spin_only:
        return None
    ends = [body.wheels[name] + side * gear.face_width for name, gear in gears.items() for side in (-0.5, 0.5)]
    ends += [bearing.position[2] for bearing in gearbox.bearings if body.name in (bearing.body, bearing.on)]
    radius = max(gear.held_diameter / 2.0 if gear.internal else gear.tip_radius for gear in gears.values())
    return radius, max(ends) - min(ends)


def _mass_warnings(body: Body, radius: float, length: float) -> Iterator[str]:
    """Compare a body's mass and inertias with those of a cylinder of steel."""
    cylinder = STEEL * math.pi * radius**2 * length
    if not LEAST_MASS * cylinder < body.mass < MOST_MASS * cylinder:
        yield (
            f"mass_kg = {body.mass:g}: a steel cylinder around its gears and bearings, {2e3 * radius:.4g} by "
            f"{1e3 * length:.4g} mm, has {cylinder:.3g} kg; check the unit"
        )
        return  # radii of gyration would only repeat it
    across = math.hypot(radius, length)
    for key, inertia, size in (("axial_kg_m2", body.axial, radius), ("transverse_kg_m2", body.transverse, across)):
        gyration = math.sqrt(inertia / body.mass)
        if not LEAST_GYRATION * size < gyration < MOST_GYRATION * size:
            yield (
                f"{key} = {inertia:g}: with {body.mass:g} kg the radius of gyration is {1e3 * gyration:.3g} mm, but "
                f"its gears and bearings extend to {1e3 * size:.3g} mm; check the unit"
            )


def _bores(gearbox: Gearbox) -> Iterator[str]:
    """Yield implausible bores and rim diameters of gears, and bores smaller than the shaft."""
    for name, gear in gearbox.gears.items():
        key = f"gears.{name}.held_diameter_mm"
        held = gear.held_diameter
        root = 2.0 * gear.root_radius
        if gear.internal and held > MOST_RIM * root:
            yield (
                f"{key} = {1e3 * held:g}: rim thickness {500.0 * (held - root):.4g} mm with root diameter "
                f"{1e3 * root:.4g} mm; set the outside diameter of the rim"
            )
        elif not gear.internal and held < LEAST_BORE * root:
            yield (
                f"{key} = {1e3 * held:g}: implausible for a root diameter of {1e3 * root:.4g} mm; set the bore, or "
                "the shaft diameter under the teeth"
            )


def _seats(gearbox: Gearbox) -> Iterator[str]:
    """Yield bores of mounted gears narrower than the shaft on either side of them, or than the shaft under them."""
    reported = set()
    for body in gearbox.bodies():
        for name, wheel in body.wheels.items():
            gear = gearbox.gears[name]
            if gear.internal or body.planet_of is not None or name in reported:
                continue
            beside = _bores_beside(gearbox, body, wheel)
            under = _shaft_under(gearbox, body, gear, wheel)
            root = 2.0 * gear.root_radius
            key = f"gears.{name}.held_diameter_mm = {1e3 * gear.held_diameter:g}"
            if under is not None and root >= WHEEL * under and gear.held_diameter < LEAST_OVER_SHAFT * under:
                reported.add(name)
                yield (
                    f"{key}: the diameter of bodies.{body.family}.shape is {1e3 * under:g} mm there; set the bore of "
                    "the gear on that shaft"
                )
            elif beside and root >= WHEEL * max(beside) and gear.held_diameter < LEAST_SEAT * min(beside):
                reported.add(name)
                yield (
                    f"{key}: the bearings on both sides have bores of {1e3 * beside[0]:g} and {1e3 * beside[1]:g} mm; "
                    "the bore of a gear between them must pass the thinner end"
                )


def _bores_beside(gearbox: Gearbox, body: Body, place: float) -> tuple[float, float] | None:
    """Bores (m) of the nearest bearings of a body on both sides of a place on it; None without both."""
    known = [
        (bearing.position[2], si(bearing.catalogue, "bore_mm"))
        for bearing in gearbox.bearings
        if bearing.catalogue is not None and bearing.body == body.name
    ]
    before = [other for other in known if other[0] < place]
    behind = [other for other in known if other[0] > place]
    if before and behind:
        return (max(before)[1], min(behind)[1])
    return None


def _shaft_under(gearbox: Gearbox, body: Body, gear: Gear, place: float) -> float | None:
    """Minimum diameter (m) of the shape of a body under a gear; None without one."""
    section = gearbox.case.bodies.get(body.family)
    if section is None or section.shape is None:
        return None
    start = si(section.shape, "start_z_mm")
    found = []
    for piece in section.shape.sections:
        end = start + si(piece, "length_mm")
        if start < place + 0.5 * gear.face_width and end > place - 0.5 * gear.face_width:
            found.append(MM * min(piece.outer_diameter_mm, piece.outer_diameter_end_mm or piece.outer_diameter_mm))
        start = end
    return min(found, default=None)


def _seats_beyond_shapes(gearbox: Gearbox) -> Iterator[str]:
    """Yield bearings and gears whose middle is beyond the shape of their body, which then lacks mass and stiffness."""
    bodies = gearbox.named_bodies
    for family, section in gearbox.case.bodies.items():
        if section.shape is None:
            continue
        start = si(section.shape, "start_z_mm")
        end = start + sum(si(piece, "length_mm") for piece in section.shape.sections)
        places = {
            f"bearings.{bearing.family}.z_mm": bearing.position[2]
            for bearing in gearbox.bearings
            if bodies[bearing.body].family == family
        }
        places |= {f"bodies.{family}.gears_z_mm.{gear}": MM * z_mm for gear, z_mm in section.gears_z_mm.items()}
        for key, place in places.items():
            if not start - LEAST_CLASH < place < end + LEAST_CLASH:
                yield (
                    f"{key} = {1e3 * place:g}: beyond the shape of {family}, which extends from {1e3 * start:g} to "
                    f"{1e3 * end:g} mm; correct the position, or the sections of bodies.{family}.shape"
                )


def _bearings(gearbox: Gearbox) -> Iterator[str]:
    """Yield unknown designations, and diameters that differ from the designation or that no bearing has."""
    for name, designation in gearbox.unknown_bearings.items():
        near = similar_designation(designation)
        hint = f"did you mean {near!r}? Otherwise add" if near else "add"
        yield (
            f"bearings.{name}.designation = {designation!r}: has no known dimensions and is left out; all shafts run "
            f"aligned on ideal joints, without bearing loads and lives; {hint} [bearings.{name}.catalogue] or "
            f"[bearings.{name}.stiffness]"
        )
    for name, section in gearbox.case.bearings.items():
        catalogue = section.catalogue
        if catalogue is None:
            continue
        known = boundary_of(catalogue.designation)
        bore = catalogue.bore_mm
        outer = catalogue.outer_diameter_mm
        off = known is not None and max(abs(bore / known.bore - 1.0), abs(outer / known.outer - 1.0)) > OTHER_SIZE
        if known is not None and off:
            yield (
                f"bearings.{name}.catalogue.bore_mm = {bore:g}: with outer_diameter_mm = {outer:g} is not the "
                f"{catalogue.designation!r} of its designation, {known.bore:g} by {known.outer:g} mm ({known.source})"
            )
        elif outer > MOST_WALL * bore:
            yield (
                f"bearings.{name}.catalogue.bore_mm = {bore:g}: usual bearings of {outer:g} mm outer diameter have a "
                f"bore of at least {outer / MOST_WALL:.3g} mm; check both"
            )


def _faces(gearbox: Gearbox) -> Iterator[str]:
    """Yield gears in mesh with an axial offset of a part of their face width."""
    bodies = gearbox.named_bodies
    reported = set()
    for mesh in gearbox.meshes:
        pinion, gear = mesh.pair.pinion, mesh.pair.gear
        if mesh.family in reported:
            continue
        pinion_z, gear_z = bodies[mesh.pinion].wheels[pinion.name], bodies[mesh.gear].wheels[gear.name]
        low = max(pinion_z - 0.5 * pinion.face_width, gear_z - 0.5 * gear.face_width)
        high = min(pinion_z + 0.5 * pinion.face_width, gear_z + 0.5 * gear.face_width)
        if high - low < LEAST_OVERLAP * mesh.pair.face_width:
            reported.add(mesh.family)
            family = bodies[mesh.gear].family
            yield (
                f"bodies.{family}.gears_z_mm.{gear.name} = {1e3 * gear_z:g}: {mesh.family} has "
                f"{1e3 * max(high - low, 0.0):.4g} mm of its face width in mesh, but {1e3 * mesh.pair.face_width:.4g} "
                "mm are used; move a gear, or set common_face_width_mm"
            )


def usual_backlash(pair: GearPair) -> float:
    """Return the minimum normal backlash of ISO/TR 10064-2 for gears and housings of usual accuracy, m.

    Examples
    --------
    >>> pair = Gearbox.from_toml("cases/grc750/gearbox.toml").gear_pairs["high_speed"]
    >>> round(1e6 * usual_backlash(pair))
    235
    """
    distance = abs(pair.centre_distance)
    module = pair.pinion.normal_module
    return 2.0 / 3.0 * (0.06e-3 + 0.0005 * distance + 0.03 * module)


def _backlashes(gearbox: Gearbox) -> Iterator[str]:
    """Yield pairs with far more backlash than usual: shifts and centre distance do not match."""
    for name in dict.fromkeys(mesh.pair.name for mesh in gearbox.meshes):
        pair = gearbox.gear_pairs[name]
        usual = usual_backlash(pair)
        backlash = pair.circumferential_backlash
        if backlash > MOST_BACKLASH * usual:
            yield (
                f"pairs.{name}.centre_distance_mm = {1e3 * pair.centre_distance:g}: backlash is {1e6 * backlash:.0f} "
                f"µm, about {1e6 * usual:.0f} µm is usual; check the centre distance and the signs of the profile "
                f"shifts ({pair.pinion.profile_shift:g}, {pair.gear.profile_shift:g})"
            )


def shafts_on_one_bearing(gearbox: Gearbox) -> Iterator[str]:
    """Yield shafts with gears that are supported by only one bearing, which barely resists tilting."""
    reported = set()
    for body in gearbox.bodies():
        bearings = [bearing for bearing in gearbox.bearings if body.name in (bearing.body, bearing.on)]
        if len(bearings) != 1 or body.fixed or body.planet_of is not None or body.family in reported or not body.wheels:
            continue
        catalogue = bearings[0].catalogue
        if catalogue is None or catalogue.arrangement != "single":
            continue
        if connector_matrix(bearings[0].stiffness)[3, 3] > 0.0:
            continue
        if (catalogue.row_count or 1) == 1 or catalogue.type in SELF_ALIGNING:
            reported.add(body.family)
            yield (
                f"bodies.{body.family}: supported by one bearing ({bearings[0].family}) only, and one "
                f"{catalogue.type.replace('_', ' ')} bearing barely resists tilting; add a second [bearings.NAME], or "
                "set rows that resist tilting (arrangement or row_count)"
            )


def _faces_in_bearings(gearbox: Gearbox) -> Iterator[str]:
    """Yield gears that overlap a bearing of their own body."""
    reported = set()
    for body in gearbox.bodies():
        bearings = [bearing for bearing in gearbox.bearings if body.name in (bearing.body, bearing.on)]
        for name, wheel in body.wheels.items():
            for bearing in bearings:
                depth = _clash(gearbox.gears[name], wheel, bearing)
                if depth > 0.0 and (name, bearing.family) not in reported:
                    reported.add((name, bearing.family))
                    yield (
                        f"bodies.{body.family}.gears_z_mm.{name} = {1e3 * wheel:g}: the face width overlaps by "
                        f"{1e3 * depth:.3g} mm with bearings.{bearing.family} at z_mm = {1e3 * bearing.position[2]:g}"
                        "; move one of them"
                    )


def _clash(gear: Gear, place: float, bearing: Bearing) -> float:
    """Axial length (m) over which a gear's body and a bearing's rings overlap; zero if negligible."""
    catalogue = bearing.catalogue
    if catalogue is None:
        return 0.0
    along = 0.5 * (gear.face_width + seat_width(bearing)) - abs(place - bearing.position[2])
    inside, outside = sorted((0.5 * gear.held_diameter, gear.tip_radius))
    across = min(outside, 0.5e-3 * catalogue.outer_diameter_mm) - max(inside, 0.5e-3 * catalogue.bore_mm)
    if across > LEAST_CLASH and along > CLASHING_SHARE * MM * catalogue.width_mm:
        return along
    return 0.0


# Margins of gear pairs: form circles, tips, pressure at the pitch point

LEAST_FORM_MARGIN = 0.02
"""Minimum part of a flank between the mating gear's tip and the root form diameter.

Loaded teeth are in contact slightly beyond the path of contact; tables truncate contact at the form diameter, and
record the truncated load (`fe_ste.contact.kinematics`).
"""
LARGEST_PRESSURE = 3e9
"""Pressure at the pitch point that is doubted, Pa: case-hardened flanks bear 1.5 GPa for ever, 2.4 GPa once."""
PROPOSED_MARGIN = 0.025
"""Part of a flank that a proposed tip diameter leaves."""


@dataclass(frozen=True)
class PairMargins:
    """Margins of a gear pair."""

    form: tuple[float, float]
    """Of gear 1 and gear 2: roll length from the root form diameter to the contact of the mating tip, over the roll
    length of the flank; NaN where the root is relieved on purpose, so that contact may end there."""
    tip_thickness: tuple[float, float]
    """Of both tips in the normal section, in normal modules."""
    nominal_contact_stress: float
    """sigma_H0 of ISO 6336-2 under the static load, Pa; zero where the pair carries none."""


def pair_margins(spec: PairSpec) -> PairMargins:
    """Find the margins of a pair.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> margins = pair_margins(gearbox.pairs["high_speed"])
    >>> bool(min(margins.form) > LEAST_FORM_MARGIN), round(1e-6 * margins.nominal_contact_stress)
    (True, 834)
    """
    pair = spec.pair
    torque = spec.static_torque
    first, second = (gear.tip_thickness / gear.normal_module for gear in (pair.pinion, pair.gear))
    tangent = pair.base_tangent_length
    # Contact ends at the tip form diameter, below a chamfer.
    on_pinion = pair.pinion_roll_length(pair.gear.tip_form_roll_length)
    pinion_tip = pair.pinion.tip_form_roll_length
    on_gear = tangent + pinion_tip if pair.gear.internal else tangent - pinion_tip
    return PairMargins(
        form=(_margin(pair.pinion, on_pinion), _margin(pair.gear, on_gear)),
        tip_thickness=(first, second),
        nominal_contact_stress=nominal_contact_stress(pair, max(torque, 0.0) / pair.pinion.reference_radius),
    )


@dataclass(frozen=True)
class ThicknessRange:
    """What allowances of the tooth thickness make of a gear, from the thinnest to the thickest tooth."""

    thickness: tuple[float, float]
    """On the reference circle, normal section, m."""
    span_teeth: int | None
    """Number of teeth of the base tangent; None for internal gears."""
    span: tuple[float, float]
    """Base tangent length over them, m; zero for internal gears."""
    span_warning: str = ""
    """Why an inspector cannot measure over this number of teeth; empty where nothing is in the way."""


def thickness_range(gearbox: Gearbox, name: str) -> ThicknessRange:
    """Tooth thickness of a gear within its allowances, and the base tangent length that an inspector finds."""
    gear = gearbox.gears[name]
    thick, thin = (replace(gear, tooth_thinning=thinning) for thinning in thinning_range(gearbox.case.gears[name]))
    thickness = (thin.normal_tooth_thickness, thick.normal_tooth_thickness)
    if gear.internal:
        return ThicknessRange(thickness, None, (0.0, 0.0))
    count = gear.usual_span
    spans = (thin.span_measurement(count), thick.span_measurement(count))
    return ThicknessRange(thickness, count, spans, _span_warning(thick, count))


def _span_warning(gear: Gear, count: int) -> str:
    """Say why the base tangent length over a number of teeth cannot be measured; empty where it can."""
    needed = gear.span_face_width(count)
    if gear.face_width <= needed:
        return (
            f"gears.{gear.name}.face_width_mm = {1e3 * gear.face_width:g}: too narrow for the base tangent length over "
            f"{count} teeth, which needs more than {1e3 * needed:.2f} mm (W_k sin beta_b); measure over balls"
        )
    touched = gear.span_contact_radius(count)
    if not gear.root_form_radius <= touched <= gear.tip_form_radius:
        return (
            f"gears.{gear.name}: the base tangent length over {count} teeth touches at a diameter of "
            f"{2e3 * touched:.2f} mm, beyond the flank of {2e3 * gear.root_form_radius:.2f} to "
            f"{2e3 * gear.tip_form_radius:.2f} mm; measure over balls"
        )
    return ""


def backlash_range(gearbox: Gearbox, pair: GearPair) -> tuple[float, float, float]:
    """Return minimum, nominal and maximum backlash of a pair on its working circles, m: of thickest and thinnest teeth.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> [round(1e6 * play) for play in backlash_range(gearbox, gearbox.gear_pairs["high_speed"])]
    [201, 201, 201]
    """
    given = pair.circumferential_backlash
    across = 1.0 / math.cos(pair.working_pressure_angle)
    ends = [0.0, 0.0]
    for gear in (pair.pinion, pair.gear):
        # Thickness and radius grow alike along the involute: the base circle's share, on the working circle.
        thinnings = thinning_range(gearbox.case.gears[gear.name])
        share = math.cos(gear.transverse_pressure_angle) * across
        ends = [end + share * (thinning - gear.tooth_thinning) for end, thinning in zip(ends, thinnings, strict=True)]
    return given + ends[0], given, given + ends[1]


def _margin(gear: Gear, roll_length: float) -> float:
    if gear.has_relieved_root:
        return math.nan
    flank = gear.tip_form_roll_length - gear.form_roll_length  # negative for a ring, as the numerator is
    return (roll_length - gear.form_roll_length) / flank


def pair_warnings(gearbox: Gearbox) -> Iterator[str]:
    """Yield the small margins of active pairs: key, value, and the recommended value."""
    at_work = {mesh.pair.name for mesh in gearbox.meshes}
    for name, spec in gearbox.pairs.items():
        if name not in at_work:
            continue
        margins = pair_margins(spec)
        gears = (spec.pair.pinion, spec.pair.gear)
        for gear, mate, margin in zip(gears, gears[::-1], margins.form, strict=True):
            if margin < LEAST_FORM_MARGIN and spec.table:
                # A chamfer moves with the tip; a stated form diameter does not.
                is_stated = gearbox.case.gears[mate.name].tip_form_diameter_mm is not None
                key = "tip_form_diameter_mm" if is_stated else "tip_diameter_mm"
                chamfer = 0.0 if is_stated else mate.tip_radius - mate.tip_form_radius
                present = 2e3 * (mate.tip_form_radius + chamfer)
                proposed = 1e3 * _clear_form_diameter(spec.pair, mate) + 2e3 * chamfer
                yield (
                    f"gears.{mate.name}.{key} = {present:.6g}: the start of active profile is {100 * margin:.2g} % of "
                    f"the profile length from the root form diameter of {gear.name}, where contact under load is "
                    f"truncated; the table of {name} lists the truncated load; {proposed:.6g} leaves "
                    f"{100 * PROPOSED_MARGIN:g} %"
                )
        pair = spec.pair
        if pair.transverse_contact_ratio < 1.0:
            yield (
                f"pairs.{name}: transverse contact ratio {pair.transverse_contact_ratio:.3f}, continuous contact by "
                f"the overlap ratio {pair.overlap_ratio:.3f}; ISO 6336 does not cover such teeth; check tip diameters "
                "and centre distance unless it is intended"
            )
        if margins.nominal_contact_stress > LARGEST_PRESSURE:
            yield (
                f"pairs.{name}: nominal contact stress sigma_H0 = {1e-6 * margins.nominal_contact_stress:.4g} MPa "
                f"under [static_load] ({spec.static_torque:.4g} N m on {spec.pair.pinion.name}), about "
                f"{1e-6 * LARGEST_PRESSURE:.0f} MPa is the maximum for steel; check the units of torques, module and "
                "face widths"
            )
    for name, gear in gearbox.gears.items():
        thickness = gear.tip_thickness / gear.normal_module
        if thickness < USUAL_TIP_THICKNESS:
            yield (
                f"gears.{name}.tip_diameter_mm = {2e3 * gear.tip_radius:.6g}: tip thickness {thickness:.3f} m_n; "
                f"usual minimum {USUAL_TIP_THICKNESS:g} m_n, 0.4 m_n for case-hardened teeth"
            )


def _clear_form_diameter(pair: GearPair, mate: Gear) -> float:
    """Tip form diameter of a gear, m, that leaves the proposed margin on the other one of its pair."""
    other = pair.pinion if mate is pair.gear else pair.gear
    on_other = other.form_roll_length + PROPOSED_MARGIN * (other.tip_form_roll_length - other.form_roll_length)
    if mate is pair.pinion:
        roll = pair.pinion_roll_length(on_other)
    else:
        roll = on_other + pair.base_tangent_length if mate.internal else pair.base_tangent_length - on_other
    return 2.0 * math.hypot(mate.base_radius, roll)


def excitation_warnings(gearbox: Gearbox) -> Iterator[str]:
    """Compare stated loads with static torques, with the inertia that they turn, and with the unbalanced mass."""
    slowest, fastest = operating_range(gearbox) or (0.0, 0.0)
    if not gearbox.varying_loads or fastest == 0.0:
        return
    if beyond := speeds_beyond_tables(gearbox, slowest, fastest):
        yield f"{beyond} of [operation]"
    turns = gearbox.train.rolling_speeds(gearbox.case.overall.input, 1.0)
    bodies = {body.name: body for body in gearbox.bodies()}
    loads: dict[tuple[str, str], list[VaryingLoad]] = {}
    for load in gearbox.varying_loads:
        loads.setdefault((load.excitation, load.body), []).append(load)
    for (name, body), own in loads.items():
        ratio = abs(turns.get(body, 0.0))
        if ratio == 0.0:
            continue
        yield from _large_torques(gearbox, own, ratio * fastest)
        yield from _turned_train(gearbox, own, ratio, slowest)
        unbalance = gearbox.case.excitations[name].unbalance_g_mm
        if unbalance is not None:
            key = f"excitations.{name}.unbalance_g_mm = {unbalance:g}"
            yield from _balance(key, unbalance, bodies[body], ratio * fastest)


def _torque_of(load: VaryingLoad, speed: float) -> float:
    """Amplitude of the torque of a stated load at a speed of its body (rad/s), N m."""
    factor: float = speed**load.exponent
    if load.curve:
        factor = float(np.interp(speed, [row[0] for row in load.curve], [row[1] for row in load.curve]))
    return abs(load.wrench[5]) * factor


def _large_torques(gearbox: Gearbox, loads: Sequence[VaryingLoad], speed: float) -> Iterator[str]:
    """Compare the torques of an excitation at a speed of its body (rad/s) with the static torque that this carries."""
    name, body = loads[0].excitation, loads[0].body
    forces = gearbox.train.static_mesh_forces()
    carried = [abs(gearbox.train.static_torques.get(body, 0.0))]
    for mesh in gearbox.meshes:
        gears = {mesh.pinion: mesh.pair.pinion, mesh.gear: mesh.pair.gear}
        carried += [abs(forces[mesh.name]) * gear.base_radius for on, gear in gears.items() if on == body]
    amplitude = sum(_torque_of(load, speed) for load in loads)
    if amplitude > max(carried) > 0.0:
        yield (
            f"excitations.{name}: amplitude of {amplitude:.4g} N m on {body} at {speed / RPM:.4g} rpm, above the "
            f"static torque of {max(carried):.4g} N m, so that teeth lose contact; check the unit, or use "
            "--mesh-model table with --method nonlinear, or exugear run"
        )


def _turned_train(gearbox: Gearbox, loads: Sequence[VaryingLoad], ratio: float, slowest: float) -> Iterator[str]:
    """Compute how far a torque turns the free gear train, T / (J (n Omega)^2), at the lowest operating speed.

    `ratio` is the speed of the body over that of the input.
    """
    if gearbox.train.degrees_of_freedom > 1 or slowest == 0.0:
        return
    cycles = max(gearbox.train.mesh_frequencies(1.0).values(), default=0.0)
    inertia = inertia_at_input(gearbox)
    turned = [
        cycles * ratio * _torque_of(load, ratio * slowest) / (inertia * (load.order * ratio * slowest) ** 2)
        for load in loads
    ]
    largest = max(turned)
    if largest > MOST_TURNED:
        load = loads[turned.index(largest)]
        yield (
            f"excitations.{load.excitation}: its order {load.order:g} turns the gear train by {largest:.2g} mesh "
            f"cycles at {slowest / RPM:.4g} rpm of {gearbox.case.overall.input}; low orders are far too high without "
            "the inertias of the connected machines: add these as bodies with couplings"
        )


def _balance(key: str, unbalance: float, body: Body, speed: float) -> Iterator[str]:
    """Compare an unbalance (g mm) with grades of ISO 21940-11: unbalance times speed (rad/s) over mass, mm/s."""
    per_grade = 1e3 * body.mass / speed
    if per_grade == 0.0:
        return
    of = f"{body.mass:.4g} kg at {speed / RPM:.4g} rpm"
    if unbalance / per_grade > BALANCE_GRADES[-1]:
        yield f"{key}: balance quality grade G {unbalance / per_grade:.3g} of {of} (ISO 21940-11); check the unit"
    elif unbalance in BALANCE_GRADES and per_grade > LEAST_PER_GRADE:
        permitted = f"{unbalance * per_grade:.3g} g mm"
        yield f"{key}: looks like a balance quality grade; G {unbalance:g} of {of} permits {permitted}"
