"""What holds bodies and ties their spins, from its sections: joints, bearings, mounts, couplings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from exugear.gearbox.origin import Origin, parts_of_each
from exugear.gearbox.parts import Bearing, Body, Coupling, Joint
from exugear.gearbox.sections.connections import (
    BearingSection,
    CouplingSection,
    JointSection,
    MountSection,
)
from exugear.gearbox.sections.entries import GROUND


def joints(origin: Origin, bodies: Mapping[str, Body]) -> tuple[Joint, ...]:
    """Ideal joints of the variant `rigid`, one for each planet of a set.

    A file without any gets one for each body that turns: in the middle of its bearings, or else of its gears.

    Raises
    ------
    CaseError
        A joint of the ground, of unknown bodies, or between sets of different size.
    """

    def of_section(name: str, section: JointSection) -> tuple[Joint, ...]:
        key = f"joints.{name}"
        if section.body == GROUND:
            raise origin.fault(f"{key}.body = {GROUND!r}: name the body that turns; the ground is what it turns on")
        if not origin.are_enabled(key, section.body, section.on):
            return ()
        return tuple(
            Joint(name + suffix, body, on, _position(bodies[body], section.z_mm))
            for suffix, body, on in origin.instances(key, section.body, section.on)
        )

    return parts_of_each(of_section, origin.case.joints or dict(_usual_joints(origin)))


def _usual_joints(origin: Origin) -> Iterator[tuple[str, JointSection]]:
    for name, section in origin.enabled.items():
        held = [bearing.z_mm for bearing in origin.case.bearings.values() if bearing.body == name]
        places = held or list(section.wheels_z_mm.values())
        if places and not section.fixed and not section.spin_only:
            place = sum(places) / len(places)
            yield name, JointSection.model_construct(body=name, on=section.carrier or GROUND, z_mm=place)


def bearings(origin: Origin, bodies: Mapping[str, Body]) -> tuple[Bearing, ...]:
    """Compliant supports of the variants `bushing` and `flexible`, one for each planet of a set.

    A bearing of which only the designation is known is none yet: see `unknown_bearings`.

    Raises
    ------
    CaseError
        A bearing of the ground, of unknown bodies, or between sets of different size.
    """

    def of_section(name: str, section: BearingSection) -> tuple[Bearing, ...]:
        key = f"bearings.{name}"
        if section.body == GROUND:
            raise origin.fault(f"{key}.body = {GROUND!r}: name the body that is held; the ground is what it sits on")
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
                # A planet turns about its bearing, all other bodies in theirs, unless the file says otherwise.
                carries_outer_ring=bodies[body].planet_of == on
                if section.outer_ring is None
                else section.outer_ring == "body",
                law=section.law,
                cage=section.cage,
            )
            for suffix, body, on in origin.instances(key, section.body, section.on)
        )

    return parts_of_each(of_section, origin.case.bearings)


def unknown_bearings(origin: Origin) -> dict[str, str]:
    """Designations of the bearings at work of which nothing else is known, by name."""
    return {
        name: section.designation
        for name, section in origin.case.bearings.items()
        if not section.is_known and origin.are_enabled(f"bearings.{name}", section.body, section.on)
    }


def mounts(origin: Origin) -> tuple[Bearing, ...]:
    """Supports of the gearbox on the ground, at work where a fixed body is elastic.

    Raises
    ------
    CaseError
        A mount of what is no enabled body with a place of its own.
    """

    def of_section(name: str, section: MountSection) -> tuple[Bearing, ...]:
        key = f"mounts.{name}"
        if _stands_aside(origin, key, section):
            return ()
        if section.body == GROUND or not origin.are_enabled(key, section.body):
            raise origin.fault(f"{key}.body = {section.body!r}: name an enabled body that the mount holds")
        body = origin.case.bodies[section.body]
        if body.carrier is not None or body.spin_only:
            raise origin.fault(f"{key}.body = {section.body!r}: a planet or a spin-only body cannot be mounted")
        x, y, z = (1e-3 * value for value in section.position_mm)
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

    return parts_of_each(of_section, origin.case.mounts)


def couplings(origin: Origin, spinning: Sequence[str], bearing_names: Sequence[str]) -> tuple[Coupling, ...]:
    """Torsional springs between spins; `spinning` are the bodies that can turn.

    Raises
    ------
    CaseError
        A coupling of bodies that do not turn, or at a seat that is no bearing.
    """

    def of_section(name: str, section: CouplingSection) -> tuple[Coupling, ...]:
        key = f"couplings.{name}"
        if _stands_aside(origin, key, section) or not origin.are_enabled(key, *section.bodies):
            return ()
        for body in section.bodies:
            if body not in spinning:
                known = ", ".join(spinning)
                raise origin.fault(f"{key}.bodies: {body!r} does not turn by itself; a coupling joins two of {known}")
        if section.seat is not None and section.seat not in bearing_names:
            known = ", ".join(bearing_names)
            raise origin.fault(f"{key}.seat = {section.seat!r}: no such bearing; bearings are {known}")
        damping = section.damping_N_m_s_per_rad
        if damping is None:
            damping = origin.case.damping.coupling_time_s * section.stiffness_N_m_per_rad
        return (Coupling(name, *section.bodies, section.seat, section.stiffness_N_m_per_rad, damping),)

    return parts_of_each(of_section, origin.case.couplings)


def _stands_aside(origin: Origin, key: str, section: MountSection | CouplingSection) -> bool:
    """Tell whether the body that a section stands for is enabled."""
    return section.instead_of is not None and origin.are_enabled(f"{key}.instead_of", section.instead_of)


def _position(body: Body, z_mm: float) -> tuple[float, float, float]:
    return (*body.axis, z_mm * 1e-3)
