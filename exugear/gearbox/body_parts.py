"""Parts built from the gearbox file: bodies, joints, bearings, mounts, couplings; load cases, forces, excitations."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from exugear.gearbox.named_files import LARGEST_TABLE
from exugear.gearbox.parts import Bearing, Body, Coupling, DampingTimes, Joint, LoadCase, PointForce, VaryingLoad
from exugear.gearbox.reading import Origin, part_of_each, parts_of_each
from exugear.gearbox.sections.bodies import BodySection, InertiaSection
from exugear.gearbox.sections.case import DampingSection, ForceSection, GearboxFile, LoadCaseSection
from exugear.gearbox.sections.connections import (
    BearingSection,
    ConnectorDampingSection,
    CouplingSection,
    JointSection,
    MountSection,
    StiffnessSection,
)
from exugear.gearbox.sections.entries import GROUND
from exugear.gearbox.sections.excitation_tables import TableError, read_ripple_table
from exugear.gearbox.sections.excitations import ExcitationSection
from exugear.gearbox.sections.gears import GearSection, PinSection
from exugear.gearbox.units import DEG, MM, RPM, UM, optional_si, si
from fe_ste.geometry.cylinders import MassProperties, Tube, mass_properties, together


def damping_times(section: DampingSection) -> DampingTimes:
    """Return damping over stiffness; zero where the file states the damping of modes.

    Examples
    --------
    >>> damping_times(DampingSection()).mesh, damping_times(DampingSection(modal_percent=2.0)).mesh
    (4e-06, 0.0)
    """
    if section.modal_percent is not None:
        return DampingTimes(0.0, 0.0, 0.0)
    return DampingTimes(section.bearing_time_s, section.mesh_time_s, section.coupling_time_s)


def inertia_sets(origin: Origin) -> tuple[str, ...]:
    """Names of the inertia sets; a moving body has all of them, or none if its inertia follows from its shape.

    If the inertia of all bodies follows from their shapes, the default set is the only one.
    """
    moving = [section for section in origin.enabled.values() if not section.fixed]
    named = next((section.inertia for section in moving if section.inertia), None)
    return tuple(named or (origin.case.default_inertias,)) if moving else ()


def bodies(origin: Origin, inertias: str) -> tuple[Body, ...]:
    """All enabled bodies, with one body per planet.

    Raises
    ------
    GearboxFileError
        A body lacks the inertia set or has no position.
    """
    return tuple(
        body for family, section in origin.enabled.items() for body in _family(origin, family, section, inertias)
    )


def _family(origin: Origin, family: str, section: BodySection, inertias: str) -> Iterator[Body]:
    """Yield one body, or the planets of a set."""
    inertia = section.inertia.get(inertias)
    if not section.inertia and not section.fixed:
        inertia = _computed_inertia(origin, family, section)
    elif inertia is None and not section.fixed:
        raise origin.error(
            f"bodies.{family}.inertia: no set {inertias!r}; every moving body "
            f"needs the sets {', '.join(inertia_sets(origin))}"
        )
    angles = [math.radians(angle) for angle in section.planet_angles_deg] or [0.0]
    held = section.carrier is not None and origin.case.bodies[section.carrier].fixed
    for suffix, angle in zip(origin.suffixes(family), angles, strict=True):
        yield Body(
            name=family + suffix,
            family=family,
            axis=_axis(origin, family, angle),
            centre_of_mass_z=MM * ((inertia and inertia.centre_of_mass_z_mm) or 0.0),
            mass=(inertia and inertia.mass_kg) or 0.0,
            axial=inertia.axial_kg_m2 if inertia else 0.0,
            transverse=(inertia and inertia.transverse_kg_m2) or 0.0,
            carrier=None if section.carrier is None or held else section.carrier,
            orbit_angle=angle if section.carrier else 0.0,
            spin_only=section.spin_only,
            fixed=section.fixed,
            wheels={gear: z * MM for gear, z in section.gears_z_mm.items()},
            planet_of=section.carrier,
        )


def _computed_inertia(origin: Origin, family: str, section: BodySection) -> InertiaSection:
    """Inertia of the pieces of a body's shape, of all its blanks, and of gears without a blank.

    A gear without a blank is a tube up to its reference circle. The tube begins at the diameter at which the gear is
    held, or at the shaft surface if the shaft is thicker there.
    """
    tubes: list[Tube] = []
    rings: list[MassProperties] = []
    shape = section.shape
    if shape is not None:
        start = si(shape, "start_z_mm")
        for piece in shape.sections:
            tube = Tube(
                start=start,
                length=si(piece, "length_mm"),
                outer=si(piece, "outer_diameter_mm"),
                inner=si(piece, "inner_diameter_mm"),
                density=shape.material.density_kg_per_m3,
                outer_end=optional_si(piece, "outer_diameter_end_mm"),
                inner_end=optional_si(piece, "inner_diameter_end_mm"),
            )
            tubes.append(tube)
            start += tube.length
        places = blank_places(origin.case, family)
        for name, blank in shape.blanks.items():
            if name in places:  # `errors_of_blanks` reports the others
                place = MM * places[name]
                rings.append(MassProperties(blank.mass_kg, blank.axial_kg_m2, blank.transverse_kg_m2, place))
    for name, z in section.gears_z_mm.items():
        if name in origin.case.gears and not (shape is not None and name in shape.blanks):
            tubes.append(gear_tube(origin.case.gears[name], MM * z, tubes))
    total = together([mass_properties(tubes), *rings])
    return InertiaSection.model_construct(
        mass_kg=total.mass,
        axial_kg_m2=total.axial,
        # The transverse inertia of a thin disc is half of the axial one; rounding must not make it smaller.
        transverse_kg_m2=max(total.transverse, 0.5 * total.axial),
        centre_of_mass_z_mm=1e3 * total.centre,
    )


def blank_places(case: GearboxFile, family: str) -> dict[str, float]:
    """Axial positions (mm) at which a blank may be placed on the shape of a body, by the name of the supported element.

    These are the gears, bearings, mounts and forces of the body, and the position at which torques act, if they lie on
    the axis of the body. They are the seats of a flexible shaft, whether or not the body is flexible.
    """
    section = case.bodies[family]
    places = dict(section.gears_z_mm)
    for name, bearing in case.bearings.items():
        ends = [case.bodies[end] for end in (bearing.body, bearing.on) if end in case.bodies]
        if family in (bearing.body, bearing.on) and all(end.carrier is None for end in ends):
            places[name] = bearing.z_mm
    for name, mount in case.mounts.items():
        if mount.body == family:
            places[name] = mount.position_mm[2]
    places |= {name: force.z_mm for name, force in case.forces.items() if force.body == family}
    if section.shape is not None and section.shape.torque_z_mm is not None:
        places["torque"] = section.shape.torque_z_mm
    return places


def gear_tube(gear: GearSection, z: float, shaft: Sequence[Tube]) -> Tube:
    """Gear body on a shaft: a tube up to the reference circle, centred on the face width at z (m)."""
    reference = MM * gear.teeth * gear.normal_module_mm / math.cos(si(gear, "helix_angle_deg"))
    width = si(gear, "face_width_mm")
    held = si(gear, "held_diameter_mm")
    under = [
        tube.outer for tube in shaft if tube.start < z + 0.5 * width and tube.start + tube.length > z - 0.5 * width
    ]
    inner, outer = (reference, held) if gear.internal else (min(max([held, *under]), reference), reference)
    density = gear.material.density_kg_per_m3
    return Tube(start=z - 0.5 * width, length=width, outer=outer, inner=inner, density=density)


def _axis(origin: Origin, family: str, angle: float) -> tuple[float, float]:
    """Position (x, y) of a body's axis, m; for a planet, at its angle on the carrier (rad).

    A body without a position of its own is shown at a coupled body, or else at the origin.
    """
    section = origin.case.bodies[family]
    if section.axis_position_mm is not None:
        x, y = section.axis_position_mm
        return x * MM, y * MM
    carrier = section.carrier
    radius = section.orbit_radius_mm
    if carrier is None or radius is None:
        for coupling in origin.case.couplings.values():
            for other in coupling.bodies:
                neighbour = origin.case.bodies.get(other)
                if family in coupling.bodies and neighbour is not None and neighbour.axis_position_mm is not None:
                    x, y = neighbour.axis_position_mm
                    return x * MM, y * MM
        return 0.0, 0.0
    if not origin.are_enabled(f"bodies.{family}.carrier", carrier):
        raise origin.error(f"bodies.{family}.carrier = {carrier!r}: that body is not enabled")
    if origin.case.bodies[carrier].axis_position_mm is None:
        raise origin.error(
            f"bodies.{family}.carrier = {carrier!r}: a carrier has its own axis position and is not a planet; set "
            f"bodies.{carrier}.axis_position_mm"
        )
    x, y = _axis(origin, carrier, 0.0)
    return x + radius * MM * math.cos(angle), y + radius * MM * math.sin(angle)


def pin_offsets(origin: Origin, bodies: Mapping[str, Body]) -> dict[str, tuple[float, float]]:
    """Position error of planets in their carrier at zero angles, x and y, m.

    Raises
    ------
    GearboxFileError
        Errors are specified for a body that is not a planet.
    """

    def offset(name: str, section: PinSection) -> tuple[str, tuple[float, float]]:
        body = bodies.get(section.body)
        if body is None or body.planet_of is None:
            planets = ", ".join(planet.name for planet in bodies.values() if planet.planet_of) or "none"
            raise origin.error(f"pins.{name}.body = {section.body!r}: not a planet; planets are {planets}")
        error = UM * complex(section.radial_um, section.tangential_um)
        error *= complex(math.cos(body.orbit_angle), math.sin(body.orbit_angle))
        return section.body, (error.real, error.imag)

    return dict(part_of_each(offset, origin.case.pins).values())


def load_cases(origin: Origin, spinning: Sequence[str]) -> dict[str, LoadCase]:
    """Load cases by name.

    Raises
    ------
    GearboxFileError
        A torque acts on a body that does not rotate, or a torque series does not exist or may not be read.
    """

    def load_case(name: str, section: LoadCaseSection) -> LoadCase:
        key = f"load_cases.{name}"
        driven = (section.driven_body,) if section.driven_body else ()
        for body in (*section.torques_N_m, *section.start_speeds_rpm, *driven):
            if body not in spinning:
                raise origin.error(f"{key}: no rotating body {body!r}; bodies are {', '.join(spinning)}")
        if origin.case.overall.input in section.start_speeds_rpm:
            raise origin.error(
                f"{key}.start_speeds_rpm: {origin.case.overall.input} is the overall input, whose speed is "
                "start_speed_rpm; remove it here"
            )
        series = None
        if section.torque_series is not None:
            series = origin.file(f"{key}.torque_series", section.torque_series, LARGEST_TABLE)
        return LoadCase(
            name=name,
            torques=dict(section.torques_N_m),
            torque_series=series,
            duration=section.duration_s,
            start_speed=si(section, "start_speed_rpm"),
            start_speeds={body: speed * RPM for body, speed in section.start_speeds_rpm.items()},
            driven_body=section.driven_body,
            end_speed=optional_si(section, "end_speed_rpm"),
            drive_stiffness=section.drive_stiffness_N_m_per_rad,
            description=section.description,
        )

    return part_of_each(load_case, origin.case.load_cases)


def joints(origin: Origin, bodies: Mapping[str, Body]) -> tuple[Joint, ...]:
    """Ideal joints of the variant `rigid`, one for each planet of a set.

    If the file has no joints, each rotating body gets one: in the middle of its bearings, or else of its gears.

    Raises
    ------
    GearboxFileError
        A joint supports the ground or an unknown body, or connects sets of different size.
    """

    def convert_section(name: str, section: JointSection) -> tuple[Joint, ...]:
        key = f"joints.{name}"
        if section.body == GROUND:
            raise origin.error(
                f"{key}.body = {GROUND!r}: set the rotating body here, and the ground in the key of the other body"
            )
        if not origin.are_enabled(key, section.body, section.on):
            return ()
        return tuple(
            Joint(name + suffix, body, on, _position(bodies[body], section.z_mm))
            for suffix, body, on in origin.instances(key, section.body, section.on)
        )

    sections = dict(origin.case.joints)
    for name, body in origin.enabled.items() if not sections else ():
        held = [bearing.z_mm for bearing in origin.case.bearings.values() if bearing.body == name]
        places = held or list(body.gears_z_mm.values())
        if places and not body.fixed and not body.spin_only:
            place = sum(places) / len(places)
            sections[name] = JointSection.model_construct(body=name, on=body.carrier or GROUND, z_mm=place)
    return parts_of_each(convert_section, sections)


def bearings(origin: Origin, bodies: Mapping[str, Body]) -> tuple[Bearing, ...]:
    """Compliant supports of the variants `bushing` and `flexible`, one for each planet of a set.

    Bearings of which only the designation is known are omitted: see `unknown_bearings`.

    Raises
    ------
    GearboxFileError
        A bearing supports the ground or an unknown body, or connects sets of different size.
    """

    def convert_section(name: str, section: BearingSection) -> tuple[Bearing, ...]:
        key = f"bearings.{name}"
        if section.body == GROUND:
            raise origin.error(
                f"{key}.body = {GROUND!r}: set the supported body here, and the ground in the key of the other body"
            )
        if not origin.are_enabled(key, section.body, section.on) or not section.is_known:
            return ()
        return tuple(
            Bearing(
                name=name + suffix,
                family=name,
                body=body,
                on=on,
                position=_position(bodies[body], section.z_mm),
                stiffness=section.stiffness,
                catalogue=section.catalogue,
                damping=section.damping,
                factor=origin.case.housing.factor if section.housing_factor_applies else 1.0,
                # By default the outer ring is mounted in the planet for a bearing of a planet, and in the support for
                # all others.
                carries_outer_ring=bodies[body].planet_of == on
                if section.outer_ring is None
                else section.outer_ring == "body",
                model=section.model,
                cage=section.cage,
            )
            for suffix, body, on in origin.instances(key, section.body, section.on)
        )

    return (*parts_of_each(convert_section, origin.case.bearings), *_couplings_on_fixed_bodies(origin, bodies))


def _holds_on_a_fixed_body(origin: Origin, section: CouplingSection) -> bool:
    """Return whether one of the two bodies of a coupling is fixed, so that it restrains the rotation of the other."""
    known = [origin.case.bodies[name] for name in section.bodies if name in origin.case.bodies]
    return len(known) == 2 and [body.fixed for body in known].count(True) == 1


def _couplings_on_fixed_bodies(origin: Origin, bodies: Mapping[str, Body]) -> Iterator[Bearing]:
    """Yield couplings to fixed bodies as supports that act in torsion only."""
    for name, section in origin.case.couplings.items():
        key = f"couplings.{name}"
        if _stands_aside(origin, key, section) or not origin.are_enabled(key, *section.bodies):
            continue
        if not _holds_on_a_fixed_body(origin, section):
            continue
        on, body = sorted(section.bodies, key=lambda body: not origin.case.bodies[body].fixed)
        seat = origin.case.bearings.get(section.seat or "")
        place = bodies[body].centre_of_mass_z if seat is None else si(seat, "z_mm")
        damping = _coupling_damping(origin, section)
        yield Bearing(
            name=name,
            family=name,
            body=body,
            on=on,
            position=(*bodies[body].axis, place),
            stiffness=StiffnessSection(torsion_N_m_per_rad=section.stiffness_N_m_per_rad),
            catalogue=None,
            damping=ConnectorDampingSection(torsion_N_m_s_per_rad=damping),
            factor=1.0,
        )


def unknown_bearings(origin: Origin) -> dict[str, str]:
    """Designations of enabled bearings of which no other data are known, by name."""
    return {
        name: section.designation
        for name, section in origin.case.bearings.items()
        if not section.is_known and origin.are_enabled(f"bearings.{name}", section.body, section.on)
    }


def mounts(origin: Origin) -> tuple[Bearing, ...]:
    """Supports of the gearbox on the ground, which are active if a fixed body is flexible.

    Raises
    ------
    GearboxFileError
        The supported body is not an enabled body with a position of its own.
    """

    def convert_section(name: str, section: MountSection) -> tuple[Bearing, ...]:
        key = f"mounts.{name}"
        if _stands_aside(origin, key, section):
            return ()
        if section.body == GROUND or not origin.are_enabled(key, section.body):
            raise origin.error(f"{key}.body = {section.body!r}: set an enabled body that the mount supports")
        body = origin.case.bodies[section.body]
        if body.carrier is not None or body.spin_only:
            raise origin.error(f"{key}.body = {section.body!r}: a planet or a spin-only body cannot be mounted")
        x, y, z = (MM * value for value in section.position_mm)
        mount = Bearing(
            name=name,
            family=name,
            body=section.body,
            on=GROUND,
            position=(x, y, z),
            stiffness=section.stiffness,
            catalogue=None,
            damping=section.damping,
            factor=1.0,
        )
        return (mount,)

    return parts_of_each(convert_section, origin.case.mounts)


def point_forces(origin: Origin, bodies: Mapping[str, Body]) -> tuple[PointForce, ...]:
    """Constant forces and moments on enabled bodies.

    Raises
    ------
    GearboxFileError
        A force acts on the ground, on a planet, on a body without a position, or on an unknown body.
    """

    def convert_section(name: str, section: ForceSection) -> tuple[PointForce, ...]:
        key = f"forces.{name}"
        if section.body == GROUND:
            raise origin.error(f"{key}.body = {GROUND!r}: a force on the ground has no effect; set a moving body")
        if not origin.are_enabled(key, section.body):
            return ()
        body = origin.case.bodies[section.body]
        if body.carrier is not None or body.spin_only:
            raise origin.error(
                f"{key}.body = {section.body!r}: a planet or a spin-only body cannot have a constant force; set a "
                "body on a fixed axis"
            )
        position = _position(bodies[section.body], section.z_mm)
        return (PointForce(name, section.body, position, (*section.force_N, *section.moment_N_m)),)

    return parts_of_each(convert_section, origin.case.forces)


def varying_loads(
    origin: Origin, bodies: Mapping[str, Body], static_torque: Callable[[str], float]
) -> tuple[VaryingLoad, ...]:
    """Convert forces and moments on enabled bodies that vary with their angle, order by order.

    Parameters
    ----------
    static_torque : torque on a body in the static load, N m; asked for where an amplitude depends on it

    Raises
    ------
    GearboxFileError
        A load acts on the ground, on a body that does not rotate or is unknown, or a force or an unbalance on a body
        without a position; or a table cannot be used.
    """

    def convert_section(name: str, section: ExcitationSection) -> tuple[VaryingLoad, ...]:
        key = f"excitations.{name}"
        if section.body == GROUND:
            raise origin.error(f"{key}.body = {GROUND!r}: a load on the ground has no effect; set a moving body")
        loaded = [bodies[section.body]] if section.body in bodies else []
        if not loaded and origin.are_enabled(key, section.body):
            loaded = [body for body in bodies.values() if body.family == section.body]  # a set of planets
        reaction_on = _reaction_of(origin, key, section, bodies)
        if not section.enabled:
            return ()
        loads: list[VaryingLoad] = []
        for body in loaded:
            if body.fixed:
                raise origin.error(f"{key}.body = {section.body!r}: a fixed body has no angle; set a rotating body")
            if section.z_mm is not None and body.spin_only:
                raise origin.error(
                    f"{key}.z_mm: {section.body!r} is a spin-only body, which takes torques only; remove z_mm, forces, "
                    "moments and unbalance, or give the body a position"
                )
            halves = [order for order in section.orders if order * section.pole_pairs % 1.0]
            if halves and body.carrier is not None:
                raise origin.error(
                    f"{key}.orders: {halves[0]:g}: half orders of planets are not supported; set whole numbers"
                )
            loads += _loads_on(origin, name, section, body, static_torque)
        return tuple(replace(load, reaction_on=reaction_on) for load in loads)

    return parts_of_each(convert_section, origin.case.excitations)


def _reaction_of(origin: Origin, key: str, section: ExcitationSection, bodies: Mapping[str, Body]) -> str | None:
    """Body on which the reaction of an excitation acts; None for the ground."""
    name = section.reaction_on
    if name is None or name == GROUND:
        return None
    if name not in bodies and not origin.are_enabled(f"{key}.reaction_on", name):
        return None
    where = f"{key}.reaction_on = {name!r}"
    if name == section.body:
        raise origin.error(f"{where}: the load acts on this body itself; set the body that reacts it")
    if name not in bodies or bodies[name].carrier is not None:
        raise origin.error(f"{where}: a planet cannot take a reaction; set another body")
    if bodies[name].spin_only and (section.force_N or section.moment_N_m):
        raise origin.error(f"{where}: a spin-only body takes torques only; set a body with a position")
    return name


def _loads_on(
    origin: Origin, name: str, section: ExcitationSection, body: Body, static_torque: Callable[[str], float]
) -> Iterator[VaryingLoad]:
    """Yield the loads of an excitation on one body, order by order, without its reaction."""
    position = None if section.z_mm is None else _position(body, section.z_mm)
    if section.unbalance_g_mm is not None:
        unbalance = si(section, "unbalance_g_mm") * _phasor(section, 0)
        yield VaryingLoad(name, body.name, 1.0, position, (unbalance, -1j * unbalance, 0j, 0j, 0j, 0j), 2.0)
        return
    if section.table is not None:
        key = f"excitations.{name}.table"
        path = origin.file(key, section.table, LARGEST_TABLE)
        try:
            table = read_ripple_table(path)
            curves = table.curves(static_torque(body.name) if table.has_torques else 0.0)
        except TableError as error:
            raise origin.error(f"{key} = {section.table!r}: {error}") from None
        for order, rows in curves.items():
            curve = tuple((RPM * speed, amplitude, DEG * phase) for speed, amplitude, phase in rows)
            unit = (0j, 0j, 0j, 0j, 0j, 1.0 + 0j)
            yield VaryingLoad(name, body.name, order * section.pole_pairs, position, unit, curve=curve)
        return
    share = 0.0
    if section.torque_percent:
        share = 0.01 * abs(static_torque(body.name))
        if share == 0.0:
            raise origin.error(
                f"excitations.{name}.torque_percent: {body.name!r} has no torque in the static load, neither applied "
                "nor by being locked; set torque_N_m"
            )
    growth = 1.0
    if section.reference_speed_rpm is not None:
        growth = si(section, "reference_speed_rpm") ** -section.speed_exponent
    for n, order in enumerate(section.orders):
        wrench = tuple(growth * value for value in _wrench(section, n, share))
        yield VaryingLoad(name, body.name, order * section.pole_pairs, position, wrench, section.speed_exponent)


def _phasor(section: ExcitationSection, n: int) -> complex:
    """Factor exp(i phi) of the n-th order of an excitation."""
    return cmath.rect(1.0, math.radians(section.phase_deg[n]) if section.phase_deg else 0.0)


def _wrench(section: ExcitationSection, n: int, share: float) -> tuple[complex, ...]:
    """Complex force (N) and moment (N m) of the n-th order of an excitation; `share` N m are a percent of torque."""
    phasor = _phasor(section, n)
    sense = {"fixed": 0, "rotating": 1, "counter_rotating": -1}[section.direction]

    def turned(x: float, y: float) -> tuple[complex, complex]:
        # (x, y) turned by an angle a is (x cos a - y sin a, x sin a + y cos a).
        return (x + sense * 1j * y) * phasor, (y - sense * 1j * x) * phasor

    x, y, z = section.force_N[n] if section.force_N else (0.0, 0.0, 0.0)
    moment = section.moment_N_m[n] if section.moment_N_m else (0.0, 0.0)
    torque = section.torque_N_m[n] if section.torque_N_m else 0.0
    if section.torque_percent:
        torque = share * section.torque_percent[n]
    return (*turned(x, y), z * phasor, *turned(*moment), torque * phasor)


def couplings(origin: Origin, spinning: Sequence[str], bearing_names: Sequence[str]) -> tuple[Coupling, ...]:
    """Torsional springs between rotating bodies; a bearing may be the seat of one.

    Raises
    ------
    GearboxFileError
        A coupled body does not rotate, or the seat of a coupling is not a bearing.
    """

    def convert_section(name: str, section: CouplingSection) -> tuple[Coupling, ...]:
        key = f"couplings.{name}"
        if _stands_aside(origin, key, section) or not origin.are_enabled(key, *section.bodies):
            return ()
        if _holds_on_a_fixed_body(origin, section):
            return ()
        for body in section.bodies:
            if body not in spinning:
                known = ", ".join(spinning)
                raise origin.error(
                    f"{key}.bodies: {body!r} has no rotation of its own; a coupling connects two of {known}"
                )
        if section.seat is not None and section.seat not in bearing_names:
            known = ", ".join(bearing_names)
            raise origin.error(f"{key}.seat = {section.seat!r}: no such bearing; bearings are {known}")
        damping = _coupling_damping(origin, section)
        return (Coupling(name, *section.bodies, section.seat, section.stiffness_N_m_per_rad, damping),)

    return parts_of_each(convert_section, origin.case.couplings)


def _coupling_damping(origin: Origin, section: CouplingSection) -> float:
    """Return the torsional damping of a coupling (N m s/rad), by default in proportion to its stiffness."""
    if section.damping_N_m_s_per_rad is not None:
        return section.damping_N_m_s_per_rad
    return damping_times(origin.case.damping).coupling * section.stiffness_N_m_per_rad


def _stands_aside(origin: Origin, key: str, section: MountSection | CouplingSection) -> bool:
    """Return whether the body that a section replaces is enabled, so that the section is ignored."""
    return section.instead_of is not None and origin.are_enabled(f"{key}.instead_of", section.instead_of)


def _position(body: Body, z_mm: float) -> tuple[float, float, float]:
    return (*body.axis, z_mm * MM)
