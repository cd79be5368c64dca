"""The parts of a gearbox checked against each other: masses, places, assembly of planets, what holds what."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from exugear.model.parts import stiffness_matrix
from exugear.model.reading import CaseError, shortened
from exugear.model.sections import GROUND, BearingSection, StiffnessSection

if TYPE_CHECKING:
    from exugear.model.gearbox import Gearbox
    from exugear.model.parts import Body, Mesh


CENTRE_DISTANCE_TOLERANCE = 2e-5
"""Allowed difference between a pair's centre distance and the positions of its bodies, m."""
AXIS_TOLERANCE = 1e-6
"""Allowed distance of a central wheel from the axis of the carrier whose planets it meets, m."""
ASSEMBLY_TOLERANCE = 2e-3
"""Allowed departure from the assembly condition, in teeth: angles in a file are rounded."""
MATRIX_TOLERANCE = 1e-4
"""Rounding allowed in a stiffness matrix, against its diagonal: as printed with five digits."""
LARGEST_MATRICES = 2e9
"""Largest memory of all matrices of the elements together, bytes: each is over the coordinates of all bodies."""


def check(gearbox: Gearbox) -> None:
    """Check the parts of a gearbox against each other.

    Each stage needs those before it, so that all faults of the first stage that has any are told.

    Raises
    ------
    CaseError
        Parts that cannot be, inertia sets incomplete, positions that contradict a centre distance, planets that cannot
        be assembled or collide, a body joined to nothing, a static load that nothing holds.
    """
    for stage in _STAGES:
        faults: list[str] = []
        for step in stage:
            try:
                step(gearbox)
            except CaseError as error:
                faults += error.faults
        if faults:
            raise CaseError(*faults)


def _raise_all(gearbox: Gearbox, faults: Iterable[str]) -> None:
    """Raise what was found, a line each."""
    found = [line for fault in faults for line in gearbox.fault(fault).faults]
    if found:
        raise CaseError(*found)


def _check_bodies(gearbox: Gearbox) -> None:
    _raise_all(gearbox, _faults_of_bodies(gearbox))


def _faults_of_bodies(gearbox: Gearbox) -> Iterator[str]:
    """Names that are taken, carriers that cannot be, wheels that are no gears."""
    sections = gearbox.case.bodies
    if GROUND in sections:
        yield f"bodies.{GROUND}: {GROUND} is the name of what stands still; choose another"
    names: dict[str, str] = {}
    for family, section in sections.items():
        count = len(section.planet_angles_deg)
        for name in [f"{family}_{number}" for number in range(1, count + 1)] or [family]:
            if name in names:
                yield f"bodies.{family}: planets are numbered, and bodies.{names[name]} is {name}, too; rename one"
            names[name] = family
        for gear in section.wheels_z_mm:
            if gear not in gearbox.case.gears:
                yield f"bodies.{family}.wheels_z_mm.{gear}: no such gear; gears are {', '.join(gearbox.case.gears)}"
        if section.enabled and section.carrier is not None:
            yield from _faults_of_carrier(gearbox, f"bodies.{family}.carrier = {section.carrier!r}", section.carrier)


def _faults_of_carrier(gearbox: Gearbox, key: str, name: str) -> Iterator[str]:
    carrier = gearbox.case.bodies.get(name)
    if carrier is None:
        yield f"{key}: no such body; bodies are {', '.join(gearbox.case.bodies)}"
    elif not carrier.enabled:
        yield f"{key}: that body is not enabled"
    elif carrier.carrier is not None:
        yield f"{key}: a carrier cannot be a planet"
    elif carrier.fixed:
        yield f"{key}: a carrier that is fixed does not work yet; give each planet axis_position_mm instead"
    elif carrier.spin_only:
        yield f"{key}: a spin-only body has no place, and so carries no planets"


def _check_inertia_sets(gearbox: Gearbox) -> None:
    if not gearbox.inertia_sets:
        raise gearbox.fault("bodies: none turns; a gearbox has at least one body without fixed = true")
    if gearbox.case.default_inertias not in gearbox.inertia_sets:
        raise gearbox.fault(
            f"default_inertias = {gearbox.case.default_inertias!r}: no such set; "
            f"sets are {', '.join(gearbox.inertia_sets)}"
        )
    for inertias in gearbox.inertia_sets:
        gearbox.bodies(inertias)


def _check_size(gearbox: Gearbox) -> None:
    """Refuse what no memory holds: each element has a stiffness and a damping over all coordinates."""
    elements = len(gearbox.meshes) + len(gearbox.bearings) + len(gearbox.mounts) + len(gearbox.couplings)
    coordinates = 6 * len(gearbox.bodies())
    if 16.0 * elements * coordinates**2 > LARGEST_MATRICES:
        raise gearbox.fault(
            f"bodies: {len(gearbox.bodies())} with {elements} meshes, bearings and couplings are too many: their "
            f"matrices take more than {1e-9 * LARGEST_MATRICES:g} GB"
        )


def _check_overall(gearbox: Gearbox) -> None:
    overall = gearbox.case.overall
    for key in ("input", "output"):
        if getattr(overall, key) not in gearbox.spinning:
            raise gearbox.fault(
                f"overall.{key} = {getattr(overall, key)!r}: no such turning body; "
                f"bodies are {', '.join(gearbox.spinning)}"
            )
    if overall.input == overall.output:
        raise gearbox.fault(f"overall.output = {overall.output!r}: is the input, too; name the body at the other end")


def _check_output_gear(gearbox: Gearbox) -> None:
    """Let the overall transmission error be a length on a gear of the output; a carrier has none, and so any serves."""
    overall = gearbox.case.overall
    if overall.output_gear not in gearbox.gears:
        raise gearbox.fault(
            f"overall.output_gear = {overall.output_gear!r}: no such gear; gears are {', '.join(gearbox.gears)}"
        )
    turning = _coupled(gearbox, overall.output)
    known = [gear for body in gearbox.bodies() if body.name in turning for gear in body.wheels]
    if known and overall.output_gear not in known:
        raise gearbox.fault(
            f"overall.output_gear = {overall.output_gear!r}: does not turn with {overall.output}; "
            f"gears that do are {', '.join(known)}"
        )


def _coupled(gearbox: Gearbox, body: str) -> set[str]:
    """Bodies that couplings tie to one, and itself: all turn at one speed."""
    reached = {body}
    for _ in gearbox.couplings:
        reached |= {name for c in gearbox.couplings if {c.first, c.second} & reached for name in (c.first, c.second)}
    return reached


def _check_static_load(gearbox: Gearbox) -> None:
    gearbox.train.static_mesh_forces()
    if not gearbox.meshes:
        raise gearbox.fault("meshes: none is at work; a gearbox has at least one")
    _ = gearbox.train.ratio


def _check_told_once(gearbox: Gearbox) -> None:
    """Let errors of a wheel or a pin be told once: a second section would replace the first."""
    if len(gearbox.deviations) < len(gearbox.case.deviations):
        raise gearbox.fault("deviations: two of them are of one wheel; give its errors together")
    if len(gearbox.pin_offsets) < len(gearbox.case.pins):
        raise gearbox.fault("pins: two of them are of one planet; give its errors together")


def _check_mass_properties(gearbox: Gearbox) -> None:
    _raise_all(gearbox, _faults_of_mass_properties(gearbox))


def _faults_of_mass_properties(gearbox: Gearbox) -> Iterator[str]:
    for family, section in gearbox.case.bodies.items():
        for inertias, values in section.inertia.items():
            if section.spin_only:
                continue
            for key in ("mass_kg", "transverse_kg_m2", "centre_of_mass_z_mm"):
                if getattr(values, key) is None:
                    yield (
                        f"bodies.{family}.inertia.{inertias}.{key}: this key is "
                        "missing; only a spin_only body needs nothing but axial_kg_m2"
                    )


def _check_centre_distances(gearbox: Gearbox) -> None:
    _raise_all(gearbox, _faults_of_centre_distances(gearbox))


def _faults_of_centre_distances(gearbox: Gearbox) -> Iterator[str]:
    for mesh in gearbox.meshes:
        difference = mesh.centre_distance - mesh.pair.centre_distance
        if abs(difference) > CENTRE_DISTANCE_TOLERANCE:
            yield (
                f"pairs.{mesh.pair.name}.centre_distance_mm = {mesh.pair.centre_distance * 1e3:g}: "
                f"the bodies {mesh.pinion} and {mesh.gear} stand {mesh.centre_distance * 1e3:.4f} mm apart; "
                f"they may differ by {CENTRE_DISTANCE_TOLERANCE * 1e3:g} mm"
            )
        for body in (mesh.pinion, mesh.gear):
            if mesh.frame != GROUND and gearbox.body(body).carrier is None:
                apart = math.dist(gearbox.body(body).axis, gearbox.body(mesh.frame).axis)
                if apart > AXIS_TOLERANCE:
                    yield (
                        f"meshes.{mesh.family}: {body} stands {apart * 1e3:.4f} mm off the axis of {mesh.frame}, whose "
                        "spin carries the line of centres; only planets of it may"
                    )


def _check_planets(gearbox: Gearbox) -> None:
    _raise_all(gearbox, _faults_of_planets(gearbox))


def _faults_of_planets(gearbox: Gearbox) -> Iterator[str]:
    """Planets that run into each other, of one set or of several on a carrier, and such as cannot be assembled."""
    planets = [body for body in gearbox.bodies() if body.carrier is not None]
    told = set()
    for one, two in itertools.combinations(planets, 2):
        if (one.family, two.family) in told or one.carrier != two.carrier:
            continue
        for first, second in itertools.product(one.wheels, two.wheels):
            if not _side_by_side(gearbox, one, first, two, second):
                continue
            gap = math.dist(one.axis, two.axis)
            needed = gearbox.gears[first].tip_radius + gearbox.gears[second].tip_radius
            if gap <= needed:
                told.add((one.family, two.family))
                angles = [round(angle, 4) for angle in gearbox.case.bodies[one.family].planet_angles_deg]
                yield (
                    f"bodies.{one.family}.planet_angles_deg = {shortened(angles)}: {one.name} and {two.name} collide, "
                    f"their axes are {gap * 1e3:.2f} mm apart, their tips need more than {needed * 1e3:.2f} mm"
                )
                break
    for family in gearbox.case.bodies:
        yield from _faults_of_assembly(gearbox, family, [body for body in planets if body.family == family])


def _side_by_side(gearbox: Gearbox, one: Body, first: str, two: Body, second: str) -> bool:
    """Tell whether two wheels of planets share a place along the axis and do not mesh with each other."""
    if any({mesh.pinion, mesh.gear} == {one.name, two.name} for mesh in gearbox.meshes):
        return False
    reach = 0.5 * (gearbox.gears[first].face_width + gearbox.gears[second].face_width)
    return abs(one.wheels[first] - two.wheels[second]) < reach


def _faults_of_assembly(gearbox: Gearbox, family: str, planets: list[Body]) -> Iterator[str]:
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
                yield (
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
        torsion = 0.0 if given is None else stiffness_matrix(given)[5, 5]
        if torsion and bearing.on in gearbox.spinning:
            raise gearbox.fault(
                f"bearings.{bearing.family}.stiffness: torsion {torsion:g} N m/rad between {bearing.on} and "
                f"{bearing.body}, which both turn; give it in a [couplings] table, which knows that they turn together"
            )


def _check_supports(gearbox: Gearbox) -> None:
    _raise_all(gearbox, _faults_of_supports(gearbox))


def _faults_of_supports(gearbox: Gearbox) -> Iterator[str]:
    """Stiffness and damping that no support has: unsymmetric, indefinite, or none at all."""
    for table, sections in (("bearings", gearbox.case.bearings), ("mounts", gearbox.case.mounts)):
        for name, section in sections.items():
            key = f"{table}.{name}"
            given, damping = section.stiffness, section.damping
            catalogue = isinstance(section, BearingSection) and section.catalogue is not None
            if given is not None:
                yield from _faults_of_matrix(f"{key}.stiffness", given)
                if not catalogue and not np.any(stiffness_matrix(given)):
                    yield f"{key}.stiffness: is zero in all directions; give at least one above zero"
            if damping is not None:
                yield from _faults_of_matrix(f"{key}.damping", damping)


def _faults_of_matrix(key: str, section: StiffnessSection) -> Iterator[str]:
    """Compare each entry with the diagonal entries of its row and column: units differ by row."""
    if section.matrix is None:
        return
    matrix = stiffness_matrix(section)
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scaled = matrix / np.outer(*[np.where(scale > 0.0, scale, 1.0)] * 2)
    skew = np.abs(scaled - scaled.T)
    row, column = (int(place) for place in np.unravel_index(np.argmax(skew), skew.shape))
    if skew[row, column] > MATRIX_TOLERANCE:
        yield (
            f"{key}.matrix: is not symmetric: {matrix[row, column]:g} in row {row + 1}, column {column + 1}, but "
            f"{matrix[column, row]:g} in row {column + 1}, column {row + 1}"
        )
    elif np.linalg.eigvalsh(0.5 * (scaled + scaled.T))[0] < -MATRIX_TOLERANCE:
        yield f"{key}.matrix: is indefinite, some displacement would release energy; no eigenvalue may be below zero"


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


_STAGES: tuple[tuple[Callable[[Gearbox], object], ...], ...] = (
    (_check_bodies, _check_mass_properties, lambda gearbox: gearbox.gears),
    (_check_inertia_sets, lambda gearbox: gearbox.modifications, lambda gearbox: gearbox.gear_pairs),
    (_check_overall, lambda gearbox: gearbox.bearings, lambda gearbox: gearbox.meshes),
    (
        lambda gearbox: gearbox.joints,
        lambda gearbox: gearbox.mounts,
        lambda gearbox: gearbox.couplings,
        lambda gearbox: gearbox.load_cases,
        lambda gearbox: gearbox.deviations,
        lambda gearbox: gearbox.pin_offsets,
        _check_centre_distances,
        _check_planets,
    ),
    (_check_size, _check_connected, _check_couplings, _check_supports, _check_names, _check_joints, _check_told_once),
    (_check_output_gear, _check_static_load),
)
"""What is checked together; each stage needs those before it."""
