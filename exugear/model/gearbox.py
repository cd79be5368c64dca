"""The gearbox as data: bodies, supports, meshes and load cases in SI, read from TOML and checked.

Axes: +z along the shafts towards the output, lengths in m, angles in rad, rotation positive about +z.
Planet sets are written once in the file and appear here as one body, support and mesh per planet,
numbered from 1 (`planet_1`, `sun_planet_1`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from exugear.model.checks import check
from exugear.model.named_files import LARGEST_TABLE, NOTHING_MORE, NamedFileError, Permissions, named_file
from exugear.model.parts import (
    Bearing,
    Body,
    Coupling,
    Joint,
    LoadCase,
    Mesh,
    PairSpec,
    WheelDeviation,
    gear_from,
    modification_from,
    stiffness_matrix,
)
from exugear.model.quantities import unusual_values
from exugear.model.reading import CaseError, fault_line, parse_case, read_toml
from exugear.model.sections import (
    GROUND,
    BearingSection,
    BodySection,
    CaseFile,
    CouplingSection,
    DeviationSection,
    GearSection,
    JointSection,
    LoadCaseSection,
    MeshSection,
    MountSection,
    PairSection,
    PinSection,
    SteSection,
)
from exugear.train.train import Train
from fe_ste.flanks.modifications import FlankModification
from fe_ste.geometry.checks import GeometryError
from fe_ste.geometry.gears import Gear, GearPair

RPM = math.pi / 30.0
DEEPEST_REMOVAL = 0.5
"""Most that a modification or an error may take off a flank, in normal modules: a tooth is 1.6 thick."""
Section = TypeVar("Section")
Part = TypeVar("Part")


@dataclass(frozen=True)
class Gearbox:
    """A checked gearbox. Build one with :meth:`from_toml` or :meth:`from_dict`.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> round(gearbox.train.ratio, 6)
    81.490683
    >>> sorted(gearbox.pairs)
    ['high_speed', 'intermediate', 'ring_planet', 'sun_planet']
    """

    case: CaseFile
    source: str
    content: Mapping[str, Any] = field(repr=False)
    permissions: Permissions = field(default=NOTHING_MORE, repr=False)

    @classmethod
    def from_toml(cls, path: str | Path, permissions: Permissions = NOTHING_MORE) -> Gearbox:
        """Read and check a gearbox file.

        Parameters
        ----------
        path : path-like
        permissions : Permissions
            Whether scripts that it names may run, and where else files that it names may lie.

        Raises
        ------
        CaseError
            Anything wrong with the file: one message with file, key, value and what would be right.
        """
        return cls.from_dict(read_toml(path), str(path), permissions)

    @classmethod
    def from_dict(
        cls, content: Mapping[str, Any], source: str = "gearbox", permissions: Permissions = NOTHING_MORE
    ) -> Gearbox:
        """Check content already in memory, such as a varied case; files that it names lie beside `source`."""
        gearbox = cls(parse_case(dict(content), source), source, content, permissions)
        check(gearbox)
        return gearbox

    def varied(self, changes: Mapping[str, Any]) -> Gearbox:
        """Build a new, checked gearbox with some keys replaced; keys are dotted paths of the file.

        Examples
        --------
        >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
        >>> gearbox.varied({"housing.factor": 0.5}).case.housing.factor
        0.5
        """
        content = _copied(self.content)
        for dotted, value in changes.items():
            section = content
            *parents, last = dotted.split(".")
            for part in parents:
                section = section.setdefault(part, {})
                if not isinstance(section, dict):
                    raise self.fault(f"{dotted}: {part!r} is not a section")
            section[last] = value
        return Gearbox.from_dict(content, self.source, self.permissions)

    def fault(self, text: str) -> CaseError:
        """Error that names the file before `text` (key, value and what would be right)."""
        return CaseError(fault_line(self.source, text))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is possible and unusual about the file, a line each."""
        found = [f"{key} = {value:g}: {what}" for key, value, what in unusual_values(self.case)]
        for bearing in self.bearings:
            if bearing.body in self.spinning and bearing.on not in self.spinning:
                torsion = stiffness_matrix(bearing.stiffness)[5, 5]
                if torsion:
                    key = f"bearings.{bearing.family}.stiffness"
                    found.append(f"{key}: torsion {torsion:g} N m/rad holds {bearing.body} back, which turns")
        return tuple(dict.fromkeys(found))

    def file(self, key: str, name: str, largest: int) -> Path:
        """Path of a file of at most `largest` bytes that the gearbox file names under a key.

        Raises
        ------
        CaseError
            The file is not there or may not be read, as `exugear.model.named_files.named_file` says.
        """
        try:
            return named_file(name, Path(self.source).parent, self.permissions, largest)
        except NamedFileError as error:
            raise self.fault(f"{key} = {name!r}: {error}") from None

    @property
    def name(self) -> str:
        """Title of the gearbox."""
        return self.case.name

    def table_distances(self, pair: str) -> tuple[float, ...]:
        """Centre distances (m) of a pair's table with axes.

        Raises
        ------
        CaseError
            The gears cannot run at one of them.
        """
        static = self.gear_pairs[pair]
        distances = tuple(static.centre_distance + 1e-6 * um for um in self.ste.centre_distance_offsets_um)
        for offset, distance in zip(self.ste.centre_distance_offsets_um, distances, strict=True):
            self._guard(f"ste.centre_distance_offsets_um: {offset:g}", static.with_centre_distance, distance)
        return distances

    @property
    def ste(self) -> SteSection:
        """Settings of the STE tables."""
        return self.case.ste

    @property
    def inertia_sets(self) -> tuple[str, ...]:
        """Names of the inertia sets; every moving body has each of them."""
        moving = [body for body in self._body_sections.values() if not body.fixed]
        return tuple(moving[0].inertia) if moving else ()

    @cached_property
    def gears(self) -> dict[str, Gear]:
        """All gears by name.

        Raises
        ------
        CaseError
            A gear that cannot be made, with its key.
        """
        return self._all(self._gear, self.case.gears)

    def _gear(self, name: str, section: GearSection) -> Gear:
        return self._guard(f"gears.{name}", gear_from, name, section)

    @cached_property
    def modifications(self) -> dict[str, FlankModification]:
        """Flank modifications of all gears by name.

        Raises
        ------
        CaseError
            A modification that does not fit its gear, or a topography that cannot be read.
        """
        return self._all(self._modification, self.case.gears)

    def _modification(self, name: str, section: GearSection) -> FlankModification:
        key = f"gears.{name}.modification"
        given = {} if section.modification is None else dict(section.modification)
        self._check_depth(key, given, section.normal_module_mm)
        find = partial(self.file, f"{key}.topography", largest=LARGEST_TABLE)
        found: FlankModification = self._guard(key, modification_from, self.gears[name], section, find)
        if found.topography is not None:
            removed = 1e6 * max(abs(value) for row in found.topography.removed for value in row)
            self._check_depth(key, {"topography, removed_um": removed}, section.normal_module_mm)
        return found

    def _check_depth(self, key: str, amounts: Mapping[str, Any], module_mm: float) -> None:
        """Refuse removal that leaves nothing of the teeth."""
        deepest = 1e3 * DEEPEST_REMOVAL * module_mm
        for name, amount in amounts.items():
            if name.endswith("_um") and abs(amount) > deepest:
                raise self.fault(f"{key}.{name} = {amount:g}: must be at most {deepest:g}, half a normal module")

    @cached_property
    def gear_pairs(self) -> dict[str, GearPair]:
        """All gear pairs by name."""
        return self._all(self._gear_pair, self.case.pairs)

    def _gear_pair(self, name: str, section: PairSection) -> GearPair:
        for key in ("pinion", "gear"):
            if getattr(section, key) not in self.gears:
                raise self.fault(
                    f"pairs.{name}.{key} = {getattr(section, key)!r}: no such gear; gears are {', '.join(self.gears)}"
                )
        return self._guard(
            f"pairs.{name}",
            GearPair,
            name=name,
            pinion=self.gears[section.pinion],
            gear=self.gears[section.gear],
            centre_distance=section.centre_distance_mm * 1e-3,
        )

    @cached_property
    def pairs(self) -> dict[str, PairSpec]:
        """Gear pairs with the static torque on gear 1 that the train's statics give."""
        forces = self.train.static_mesh_forces()
        found = {}
        for name, pair in self.gear_pairs.items():
            section = self.case.pairs[name]
            at_work = [forces[mesh.name] for mesh in self.meshes if mesh.pair.name == name]
            force = sum(abs(one) for one in at_work) / len(at_work) if at_work else 0.0
            flank = -1 if sum(at_work) < 0.0 else 1
            modifications = (self.modifications[section.pinion], self.modifications[section.gear])
            torque = force * pair.pinion.base_radius
            found[name] = PairSpec(name, pair, torque, section.table, flank, modifications)
        return found

    def bodies(self, inertias: str | None = None) -> tuple[Body, ...]:
        """All enabled bodies, planets one by one, with the mass properties of an inertia set."""
        inertias = inertias or self.case.default_inertias
        if inertias not in self.inertia_sets:
            raise self.fault(f"inertia set {inertias!r} is unknown; sets are {', '.join(self.inertia_sets)}")
        return tuple(self._bodies(inertias))

    def body(self, name: str, inertias: str | None = None) -> Body:
        """One body by name."""
        for body in self.bodies(inertias):
            if body.name == name:
                return body
        known = ", ".join(body.name for body in self.bodies(inertias))
        raise self.fault(f"no body {name!r}; bodies are {known}")

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Ideal joints of the variant `rigid`."""
        return self._flat(self._joint_instances, self.case.joints)

    def _joint_instances(self, name: str, section: JointSection) -> tuple[Joint, ...]:
        key = f"joints.{name}"
        if section.body == GROUND:
            raise self.fault(f"{key}.body = {GROUND!r}: name the body that turns; the ground is what it turns on")
        if not self._known(key, section.body, section.on):
            return ()
        return tuple(
            Joint(name + suffix, body, on, self._place(body, section.z_mm))
            for suffix, body, on in self._instances(key, section.body, section.on)
        )

    @cached_property
    def bearings(self) -> tuple[Bearing, ...]:
        """Compliant supports of the variants `bushing` and `flexible`."""
        return self._flat(self._bearing_instances, self.case.bearings)

    @cached_property
    def mounts(self) -> tuple[Bearing, ...]:
        """Supports of the gearbox on the ground, at work where a fixed body is elastic."""
        return self._flat(self._mount, self.case.mounts)

    def _mount(self, name: str, section: MountSection) -> tuple[Bearing, ...]:
        key = f"mounts.{name}"
        if section.instead_of is not None and self._known(f"{key}.instead_of", section.instead_of):
            return ()
        if section.body == GROUND or not self._known(key, section.body):
            raise self.fault(f"{key}.body = {section.body!r}: name an enabled body that the mount holds")
        body = self.case.bodies[section.body]
        if body.carrier is not None or body.spin_only:
            raise self.fault(f"{key}.body = {section.body!r}: a planet or a spin-only body cannot be mounted")
        x, y, z = (1e-3 * value for value in section.position_mm)
        return (Bearing(name, name, section.body, GROUND, (x, y, z), section.stiffness, None, section.damping, 1.0),)

    @cached_property
    def couplings(self) -> tuple[Coupling, ...]:
        """Torsional springs between spins."""
        return self._flat(self._coupling, self.case.couplings)

    def _coupling(self, name: str, section: CouplingSection) -> tuple[Coupling, ...]:
        key = f"couplings.{name}"
        if section.instead_of is not None and self._known(f"{key}.instead_of", section.instead_of):
            return ()
        if not self._known(key, *section.bodies):
            return ()
        for body in section.bodies:
            if body not in self.spinning:
                known = ", ".join(self.spinning)
                raise self.fault(f"{key}.bodies: {body!r} does not turn by itself; a coupling joins two of {known}")
        if section.seat is not None and section.seat not in {bearing.name for bearing in self.bearings}:
            known = ", ".join(bearing.name for bearing in self.bearings)
            raise self.fault(f"{key}.seat = {section.seat!r}: no such bearing; bearings are {known}")
        damping = section.damping_N_m_s_per_rad
        if damping is None:
            damping = self.case.damping.coupling_time_s * section.stiffness_N_m_per_rad
        return (Coupling(name, *section.bodies, section.seat, section.stiffness_N_m_per_rad, damping),)

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        """All meshes at work, one per planet."""
        return self._flat(self._mesh_instances, self.case.meshes)

    @cached_property
    def deviations(self) -> dict[tuple[str, str], WheelDeviation]:
        """Errors of wheels by body and gear; a pitch deviation is cumulative, positive into the tooth (ISO 1328-1)."""
        return dict(self._all(self._deviation, self.case.deviations).values())

    def _deviation(self, name: str, section: DeviationSection) -> tuple[tuple[str, str], WheelDeviation]:
        key = f"deviations.{name}"
        if section.body not in self._named_bodies:
            known = ", ".join(self._named_bodies)
            raise self.fault(f"{key}.body = {section.body!r}: no such body; bodies are {known}")
        wheels = self._named_bodies[section.body].wheels
        gear = section.gear or next(iter(wheels), "")
        if gear not in wheels or (section.gear is None and len(wheels) > 1):
            raise self.fault(f"{key}.gear = {section.gear!r}: name one of {', '.join(wheels) or 'no gears'}")
        toothed, pitch = self.gears[gear], np.array(section.cumulative_pitch_um) * 1e-6
        if len(pitch) not in (0, toothed.teeth):
            raise self.fault(f"{key}.cumulative_pitch_um: {len(pitch)} values; {gear} has {toothed.teeth} teeth")
        amounts = {"cumulative_pitch_um": max(map(abs, section.cumulative_pitch_um), default=0.0)}
        amounts["runout_um"] = section.runout_um
        self._check_depth(key, amounts, 1e3 * toothed.normal_module)
        return (section.body, gear), WheelDeviation(
            teeth=toothed.teeth,
            pitch=pitch * toothed.base_radius / toothed.reference_radius,
            eccentricity=0.5e-6 * section.runout_um,
            eccentricity_angle=math.radians(section.runout_angle_deg),
        )

    @cached_property
    def pin_offsets(self) -> dict[str, tuple[float, float]]:
        """Position error of planets in their carrier at zero angles, x and y, m."""
        return dict(self._all(self._pin_offset, self.case.pins).values())

    def _pin_offset(self, name: str, section: PinSection) -> tuple[str, tuple[float, float]]:
        body = self._named_bodies.get(section.body)
        if body is None or body.carrier is None:
            planets = ", ".join(b.name for b in self._named_bodies.values() if b.carrier) or "none"
            raise self.fault(f"pins.{name}.body = {section.body!r}: no planet; planets are {planets}")
        error = 1e-6 * complex(section.radial_um, section.tangential_um)
        error *= complex(math.cos(body.orbit_angle), math.sin(body.orbit_angle))
        return section.body, (error.real, error.imag)

    @cached_property
    def load_cases(self) -> dict[str, LoadCase]:
        """Load cases by name."""
        return self._all(self._load_case, self.case.load_cases)

    @cached_property
    def spinning(self) -> tuple[str, ...]:
        """Names of the bodies that can turn, in the order of the spin vector."""
        return tuple(body.name for body in self.bodies() if not body.fixed)

    @cached_property
    def train(self) -> Train:
        """The gear train: how it rolls, and what its meshes carry in the static state.

        Examples
        --------
        >>> train = Gearbox.from_toml("cases/grc750/gearbox.toml").train
        >>> round(train.ratio, 6)
        81.490683
        """
        overall, load = self.case.overall, self.case.static_load
        return Train(
            self.spinning,
            self.meshes,
            self.couplings,
            overall.input,
            overall.output,
            load.torques_N_m,
            load.locked,
            self.fault,
        )

    # -- from sections to data ---------------------------------------------------------------------------

    def _all(self, build: Callable[[str, Section], Part], sections: Mapping[str, Section]) -> dict[str, Part]:
        """Build a part of each section; faults of several are told together."""
        found: dict[str, Part] = {}
        faults: list[str] = []
        for name, section in sections.items():
            try:
                found[name] = build(name, section)
            except CaseError as error:
                faults += error.faults
        if faults:
            raise CaseError(*faults)
        return found

    def _flat(
        self, build: Callable[[str, Section], tuple[Part, ...]], sections: Mapping[str, Section]
    ) -> tuple[Part, ...]:
        """Build the parts of each section, such as one bearing for each planet, likewise."""
        return tuple(part for parts in self._all(build, sections).values() for part in parts)

    @cached_property
    def _body_sections(self) -> dict[str, BodySection]:
        return {name: section for name, section in self.case.bodies.items() if section.enabled}

    def _known(self, key: str, *names: str) -> bool:
        """Tell whether all bodies are enabled; an unknown name is an error, a disabled one is not."""
        for name in names:
            if name != GROUND and name not in self.case.bodies:
                raise self.fault(f"{key}: no body {name!r}; bodies are {', '.join(self.case.bodies)} and ground")
        return all(name == GROUND or name in self._body_sections for name in names)

    def _guard(self, key: str, build: Callable[..., Part], *arguments: Any, **named: Any) -> Part:
        try:
            return build(*arguments, **named)
        except GeometryError as error:
            raise self.fault(f"{key}: {error}") from None

    def _suffixes(self, name: str) -> list[str]:
        count = len(self._body_sections[name].planet_angles_deg) if name in self._body_sections else 0
        return [f"_{number}" for number in range(1, count + 1)] or [""]

    def _instances(self, key: str, first: str, second: str) -> list[tuple[str, str, str]]:
        """(suffix, first, second) for each planet; sets meet single bodies or equal sets."""
        one, two = self._suffixes(first), self._suffixes(second)
        if one != [""] and two != [""] and len(one) != len(two):
            raise self.fault(f"{key}: {first!r} and {second!r} are planet sets of different size")
        return [
            (suffix, first + (suffix if one != [""] else ""), second + (suffix if two != [""] else ""))
            for suffix in (two if one == [""] else one)
        ]

    def _bodies(self, inertias: str) -> Iterator[Body]:
        for family, section in self._body_sections.items():
            inertia = section.inertia.get(inertias)
            if inertia is None and not section.fixed:
                raise self.fault(
                    f"bodies.{family}.inertia: no set {inertias!r}; every moving body "
                    f"needs the sets {', '.join(self.inertia_sets)}"
                )
            angles = [math.radians(angle) for angle in section.planet_angles_deg] or [0.0]
            for suffix, angle in zip(self._suffixes(family), angles, strict=True):
                yield Body(
                    name=family + suffix,
                    family=family,
                    axis=self._axis(family, angle),
                    centre_of_mass_z=1e-3 * ((inertia and inertia.centre_of_mass_z_mm) or 0.0),
                    mass=(inertia and inertia.mass_kg) or 0.0,
                    axial=inertia.axial_kg_m2 if inertia else 0.0,
                    transverse=(inertia and inertia.transverse_kg_m2) or 0.0,
                    carrier=section.carrier,
                    orbit_angle=angle if section.carrier else 0.0,
                    spin_only=section.spin_only,
                    fixed=section.fixed,
                    wheels={gear: z * 1e-3 for gear, z in section.wheels_z_mm.items()},
                )

    def _axis(self, family: str, angle: float) -> tuple[float, float]:
        section = self.case.bodies[family]
        if section.axis_position_mm is not None:
            x, y = section.axis_position_mm
            return x * 1e-3, y * 1e-3
        carrier, radius = section.carrier, section.orbit_radius_mm
        if carrier is None or radius is None:
            raise self.fault(f"bodies.{family}: give axis_position_mm or the keys of a planet")
        if not self._known(f"bodies.{family}.carrier", carrier):
            raise self.fault(f"bodies.{family}.carrier = {carrier!r}: that body is not enabled")
        if self.case.bodies[carrier].axis_position_mm is None:
            raise self.fault(f"bodies.{family}.carrier = {carrier!r}: a carrier cannot be a planet")
        x, y = self._axis(carrier, 0.0)
        return x + radius * 1e-3 * math.cos(angle), y + radius * 1e-3 * math.sin(angle)

    @cached_property
    def _named_bodies(self) -> dict[str, Body]:
        return {body.name: body for body in self.bodies()}

    def _place(self, body: str, z_mm: float) -> tuple[float, float, float]:
        return (*self._named_bodies[body].axis, z_mm * 1e-3)

    def _bearing_instances(self, name: str, section: BearingSection) -> tuple[Bearing, ...]:
        key = f"bearings.{name}"
        if section.body == GROUND:
            raise self.fault(f"{key}.body = {GROUND!r}: name the body that is held; the ground is what it sits on")
        if not self._known(key, section.body, section.on):
            return ()
        factor = self.case.housing.factor if section.housing_factor_applies else 1.0
        return tuple(
            Bearing(
                name + suffix,
                name,
                body,
                on,
                self._place(body, section.z_mm),
                section.stiffness,
                section.catalogue,
                section.damping,
                factor,
            )
            for suffix, body, on in self._instances(key, section.body, section.on)
        )

    def _mesh_instances(self, name: str, section: MeshSection) -> tuple[Mesh, ...]:
        key = f"meshes.{name}"
        for end in ("pinion_body", "gear_body"):
            if getattr(section, end) == GROUND:
                raise self.fault(f"{key}.{end} = {GROUND!r}: name a body; one with fixed = true does not turn")
        if not self._known(key, section.pinion_body, section.gear_body):
            return ()
        if section.pair not in self.gear_pairs:
            raise self.fault(f"{key}.pair = {section.pair!r}: no such pair; pairs are {', '.join(self.gear_pairs)}")
        pair = self.gear_pairs[section.pair]
        instances = self._instances(key, section.pinion_body, section.gear_body)
        found = []
        phases = section.phase if isinstance(section.phase, tuple) else (section.phase,) * len(instances)
        if len(phases) != len(instances):
            raise self.fault(f"{key}.phase = {list(phases)}: {len(instances)} meshes need {len(instances)} phases")
        for (suffix, pinion, gear), phase in zip(instances, phases, strict=True):
            first, second = self._named_bodies[pinion], self._named_bodies[gear]
            frame = section.frame or first.carrier or second.carrier or GROUND
            if frame != GROUND and frame not in self._named_bodies:
                raise self.fault(f"{key}.frame = {frame!r}: no such body; use a carrier's name or ground")
            dx, dy = second.axis[0] - first.axis[0], second.axis[1] - first.axis[1]
            angle = math.atan2(dy, dx)
            stated = section.position_angle_deg
            if stated is not None and abs(math.remainder(angle - math.radians(stated), 2 * math.pi)) > 1e-4:
                raise self.fault(
                    f"{key}.position_angle_deg = {stated}: the bodies' positions give "
                    f"{math.degrees(angle):.4f} deg; leave the key out or correct the positions"
                )
            z = self._common_middle(key, pair, first, second)
            found.append(
                Mesh(
                    name=name + suffix,
                    family=name,
                    pair=pair,
                    pinion=pinion,
                    gear=gear,
                    frame=frame,
                    z=z,
                    offsets=(z - first.wheels[pair.pinion.name], z - second.wheels[pair.gear.name]),
                    position_angle=angle,
                    centre_distance=math.hypot(dx, dy),
                    phase=phase,
                )
            )
        return tuple(found)

    def _common_middle(self, key: str, pair: GearPair, first: Body, second: Body) -> float:
        """Middle of the overlap of the two faces, m."""
        low, high = -math.inf, math.inf
        for body, gear in ((first, pair.pinion), (second, pair.gear)):
            if gear.name not in body.wheels:
                raise self.fault(
                    f"{key}: body {body.family!r} carries no gear {gear.name!r}; give its z in "
                    f"bodies.{body.family}.wheels_z_mm"
                )
            low = max(low, body.wheels[gear.name] - gear.face_width / 2)
            high = min(high, body.wheels[gear.name] + gear.face_width / 2)
        if high <= low:
            raise self.fault(f"{key}: the faces of {pair.pinion.name} and {pair.gear.name} do not overlap in z")
        return (low + high) / 2

    def _load_case(self, name: str, section: LoadCaseSection) -> LoadCase:
        key = f"load_cases.{name}"
        for body in (*section.torques_N_m, *((section.driven_body,) if section.driven_body else ())):
            if body not in self.spinning:
                raise self.fault(f"{key}: no turning body {body!r}; bodies are {', '.join(self.spinning)}")
        series = None
        if section.torque_series is not None:
            series = self.file(f"{key}.torque_series", section.torque_series, LARGEST_TABLE)
        return LoadCase(
            name,
            dict(section.torques_N_m),
            series,
            section.duration_s,
            section.start_speed_rpm * RPM,
            section.driven_body,
            None if section.end_speed_rpm is None else section.end_speed_rpm * RPM,
            section.drive_stiffness_N_m_per_rad,
            section.description,
        )


def _copied(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _copied(entry) for key, entry in value.items()}
    return list(value) if isinstance(value, list) else value
