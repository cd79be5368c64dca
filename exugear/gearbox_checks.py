"""The parts of a gearbox checked against each other: masses, places, assembly of planets, what holds what."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exugear.gearbox import Gearbox
    from exugear.parts import Body, Mesh

CENTRE_DISTANCE_TOLERANCE = 2e-5
"""Allowed difference between a pair's centre distance and the positions of its bodies, m."""
ASSEMBLY_TOLERANCE = 2e-3
"""Allowed departure from the assembly condition, in teeth: angles in a file are rounded."""


def check(gearbox: Gearbox) -> None:
    """Check the parts of a gearbox against each other.

    Raises
    ------
    CaseError
        Inertia sets incomplete, positions that contradict a centre distance, planets that cannot be
        assembled or collide, a body joined to nothing, a static load that nothing holds.
    """
    if gearbox.case.default_inertias not in gearbox.inertia_sets:
        raise gearbox.fault(
            f"default_inertias = {gearbox.case.default_inertias!r}: no such set; "
            f"sets are {', '.join(gearbox.inertia_sets)}"
        )
    for inertias in gearbox.inertia_sets:
        gearbox.bodies(inertias)
    _check_mass_properties(gearbox)
    _check_centre_distances(gearbox)
    _check_planets(gearbox)
    _check_connected(gearbox)
    _check_couplings(gearbox)
    _check_names(gearbox)
    _check_joints(gearbox)
    overall = gearbox.case.overall
    for key in ("input", "output"):
        if getattr(overall, key) not in gearbox.spinning:
            raise gearbox.fault(
                f"overall.{key} = {getattr(overall, key)!r}: no such turning body; "
                f"bodies are {', '.join(gearbox.spinning)}"
            )
    if overall.output_gear not in gearbox.gears:
        raise gearbox.fault(
            f"overall.output_gear = {overall.output_gear!r}: no such gear; gears are {', '.join(gearbox.gears)}"
        )
    gearbox.static_mesh_forces()
    for collection in (
        gearbox.modifications, gearbox.bearings, gearbox.mounts, gearbox.couplings, gearbox.load_cases,
        gearbox.deviations, gearbox.pin_offsets,
    ):  # fmt: skip
        list(collection)


def _check_mass_properties(gearbox: Gearbox) -> None:
    for family, section in gearbox.case.bodies.items():
        for inertias, values in section.inertia.items():
            if section.spin_only:
                continue
            for key in ("mass_kg", "transverse_kg_m2", "centre_of_mass_z_mm"):
                if getattr(values, key) is None:
                    raise gearbox.fault(
                        f"bodies.{family}.inertia.{inertias}.{key}: this key is "
                        "missing; only a spin_only body needs nothing but axial_kg_m2"
                    )


def _check_centre_distances(gearbox: Gearbox) -> None:
    for mesh in gearbox.meshes:
        difference = mesh.centre_distance - mesh.pair.centre_distance
        if abs(difference) > CENTRE_DISTANCE_TOLERANCE:
            raise gearbox.fault(
                f"pairs.{mesh.pair.name}.centre_distance_mm = {mesh.pair.centre_distance * 1e3:g}: "
                f"the bodies {mesh.pinion} and {mesh.gear} stand {mesh.centre_distance * 1e3:.4f} mm apart; "
                f"they may differ by {CENTRE_DISTANCE_TOLERANCE * 1e3:g} mm"
            )


def _check_planets(gearbox: Gearbox) -> None:
    bodies = {body.name: body for body in gearbox.bodies()}
    for family, section in gearbox.case.bodies.items():
        planets = [body for body in bodies.values() if body.family == family and body.carrier is not None]
        for one, two in zip(planets, planets[1:] + planets[:1], strict=True):
            if one is two:
                continue
            gap = math.dist(one.axis, two.axis)
            needed = 2.0 * max(gearbox.gears[gear].tip_radius for gear in one.wheels)
            if gap <= needed:
                raise gearbox.fault(
                    f"bodies.{family}.planet_angles_deg = {list(section.planet_angles_deg)}: "
                    f"{one.name} and {two.name} collide, their axes are {gap * 1e3:.2f} mm apart, their tips "
                    f"need more than {needed * 1e3:.2f} mm"
                )
        _check_assembly(gearbox, family, planets)


def _check_assembly(gearbox: Gearbox, family: str, planets: list[Body]) -> None:
    """Compare every planet with the first: going round two meshes must close on whole teeth.

    With tooth numbers zp of the planet wheel and zc of the central wheel (negative for an external one),
    (zc_b zp_a - zc_a zp_b) angle / 2 pi must be a multiple of gcd(zp_a, zp_b); for one planet wheel
    between sun and ring this is the familiar (z_sun + z_ring) angle / 2 pi = integer.
    """
    for planet in planets[1:]:
        teeth = [
            _teeth_on_planet(mesh, planet.name) for mesh in gearbox.meshes if planet.name in (mesh.pinion, mesh.gear)
        ]
        angle = planet.orbit_angle - planets[0].orbit_angle
        for planet_teeth, central_teeth in teeth[1:]:
            whole = math.gcd(planet_teeth, teeth[0][0])
            turns = (central_teeth * teeth[0][0] - teeth[0][1] * planet_teeth) / whole
            off = math.remainder(turns * angle / (2.0 * math.pi), 1.0)
            if abs(off) > ASSEMBLY_TOLERANCE:
                raise gearbox.fault(
                    f"bodies.{family}.planet_angles_deg: {planet.name} cannot be assembled at "
                    f"{math.degrees(angle):.4f} deg from the first planet; angles must be multiples of "
                    f"360/{abs(turns):g} = {360.0 / abs(turns):.4f} deg"
                )


def _teeth_on_planet(mesh: Mesh, planet: str) -> tuple[int, int]:
    """(teeth of the planet's wheel, teeth of its mate, the latter negative unless internal)."""
    pinion, gear = mesh.pair.pinion, mesh.pair.gear
    if mesh.pinion == planet:
        return pinion.teeth, gear.teeth if gear.internal else -gear.teeth
    return gear.teeth, -pinion.teeth


def _check_connected(gearbox: Gearbox) -> None:
    links = [(mesh.pinion, mesh.gear) for mesh in gearbox.meshes]
    links += [(coupling.first, coupling.second) for coupling in gearbox.couplings]
    links += [(body.name, body.carrier) for body in gearbox.bodies() if body.carrier]
    names = [body.name for body in gearbox.bodies() if not body.fixed]
    reached = {gearbox.case.overall.input}
    while True:
        more = {b for pair in links for a, b in (pair, pair[::-1]) if a in reached} - reached
        if not more:
            break
        reached |= more
    lost = [name for name in names if name not in reached]
    if lost:
        aside = [
            f"; couplings.{name} stands aside while bodies.{section.instead_of} is enabled"
            for name, section in gearbox.case.couplings.items()
            if section.instead_of is not None and set(section.bodies) & set(lost)
        ]
        raise gearbox.fault(
            f"bodies {', '.join(lost)} are joined to {gearbox.case.overall.input} by no "
            f"mesh, coupling or carrier{''.join(aside)}; the gear train must be one connected whole"
        )


def _check_couplings(gearbox: Gearbox) -> None:
    """Let torsion take one path: couplings form no loop, and bearings between turning bodies leave it to them."""
    paths: dict[str, dict[str, list[str]]] = {name: {name: []} for name in gearbox.spinning}
    for coupling in gearbox.couplings:
        one, two = paths[coupling.first], paths[coupling.second]
        if coupling.second in one:
            raise gearbox.fault(
                f"couplings {', '.join([*one[coupling.second], coupling.name])} form a loop: {coupling.first} and "
                f"{coupling.second} are joined twice; leave one of them out"
            )
        for start, first in list(one.items()):
            for end, second in list(two.items()):
                paths[start][end] = [*first[::-1], coupling.name, *second]
                paths[end][start] = paths[start][end][::-1]
    for bearing in gearbox.bearings:
        given = bearing.stiffness
        torsion = 0.0 if given is None else given.torsion_N_m_per_rad if given.matrix is None else given.matrix[5][5]
        if torsion and bearing.on in gearbox.spinning:
            raise gearbox.fault(
                f"bearings.{bearing.family}.stiffness: torsion {torsion:g} N m/rad between {bearing.on} and "
                f"{bearing.body}, which both turn; give it in a [couplings] table, which knows that they turn together"
            )


def _check_names(gearbox: Gearbox) -> None:
    """Meshes, supports and couplings share one list in the results, where each name stands once."""
    names = [("meshes", mesh.name) for mesh in gearbox.meshes]
    names += [("bearings", bearing.name) for bearing in gearbox.bearings]
    names += [("mounts", mount.name) for mount in gearbox.mounts]
    names += [("couplings", coupling.name) for coupling in gearbox.couplings]
    seen: dict[str, str] = {}
    for section, name in names:
        if name in seen:
            raise gearbox.fault(f"{section}.{name}: one of [{seen[name]}] has this name, too; rename one")
        seen[name] = section


def _check_joints(gearbox: Gearbox) -> None:
    bodies = {body.name: body for body in gearbox.bodies()}
    seen: dict[str, str] = {}
    for joint in gearbox.joints:
        body = bodies[joint.body]
        if body.fixed or body.spin_only:
            raise gearbox.fault(f"joints.{joint.name}.body = {joint.body!r}: a fixed or spin-only body takes no joint")
        if joint.body in seen:
            raise gearbox.fault(
                f"joints.{joint.name}.body = {joint.body!r}: the body already turns "
                f"on {seen[joint.body]}; a second ideal joint on the same axis is redundant"
            )
        if body.carrier is not None and joint.on != body.carrier:
            raise gearbox.fault(
                f"joints.{joint.name}.on = {joint.on!r}: a planet turns on its carrier {body.carrier!r}"
            )
        seen[joint.body] = joint.name
