"""The gearbox as data: bodies, supports, meshes and load cases in SI, read from TOML and checked.

Axes: +z along the shafts towards the output, lengths in m, angles in rad, rotation positive about +z.
Planet sets are written once in the file and appear here as one body, support and mesh per planet,
numbered from 1 (`planet_1`, `sun_planet_1`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exugear.casefile import (
    GROUND,
    BearingSection,
    BodySection,
    CaseError,
    CaseFile,
    LoadCaseSection,
    MeshSection,
    SteSection,
    parse_case,
    read_toml,
)
from exugear.gearbox_checks import check
from exugear.named_files import LARGEST_TABLE, NOTHING_MORE, NamedFileError, Permissions, named_file
from exugear.parts import (
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
)
from fe_ste.gears import Gear, GearPair, GeometryError
from fe_ste.modifications import (
    FlankModification,
)

__all__ = [
    "GROUND",
    "Bearing",
    "Body",
    "CaseError",
    "Coupling",
    "Gearbox",
    "Joint",
    "LoadCase",
    "Mesh",
    "PairSpec",
    "WheelDeviation",
]

RPM = math.pi / 30.0


@dataclass(frozen=True)
class Gearbox:
    """A checked gearbox. Build one with :meth:`from_toml` or :meth:`from_dict`.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> round(gearbox.ratio, 6)
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
        return CaseError(f"{self.source}: {text}")

    def file(self, key: str, name: str, largest: int) -> Path:
        """Path of a file of at most `largest` bytes that the gearbox file names under a key.

        Raises
        ------
        CaseError
            The file is not there or may not be read, as `exugear.named_files.named_file` says.
        """
        try:
            return named_file(name, Path(self.source).parent, self.permissions, largest)
        except NamedFileError as error:
            raise self.fault(f"{key} = {name!r}: {error}") from None

    @property
    def name(self) -> str:
        """Title of the gearbox."""
        return self.case.name

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
        return {
            name: self._guard(f"gears.{name}", gear_from, name, section) for name, section in self.case.gears.items()
        }

    @cached_property
    def modifications(self) -> dict[str, FlankModification]:
        """Flank modifications of all gears by name.

        Raises
        ------
        CaseError
            A modification that does not fit its gear, or a topography that cannot be read.
        """
        found = {}
        for name, section in self.case.gears.items():
            key = f"gears.{name}.modification"
            find = partial(self.file, f"{key}.topography", largest=LARGEST_TABLE)
            found[name] = self._guard(key, modification_from, self.gears[name], section, find)
        return found

    @cached_property
    def gear_pairs(self) -> dict[str, GearPair]:
        """All gear pairs by name."""
        found = {}
        for name, section in self.case.pairs.items():
            for key in ("pinion", "gear"):
                if getattr(section, key) not in self.gears:
                    raise self.fault(
                        f"pairs.{name}.{key} = {getattr(section, key)!r}: no such gear; "
                        f"gears are {', '.join(self.gears)}"
                    )
            found[name] = self._guard(
                f"pairs.{name}",
                GearPair,
                name=name,
                pinion=self.gears[section.pinion],
                gear=self.gears[section.gear],
                centre_distance=section.centre_distance_mm * 1e-3,
            )
        return found

    @cached_property
    def pairs(self) -> dict[str, PairSpec]:
        """Gear pairs with the static torque on gear 1 that the train's statics give."""
        forces = self.static_mesh_forces()
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
        found = []
        for name, section in self.case.joints.items():
            if not self._known(f"joints.{name}", section.body, section.on):
                continue
            for suffix, body, on in self._instances(section.body, section.on):
                found.append(Joint(name + suffix, body, on, self._place(body, section.z_mm)))
        return tuple(found)

    @cached_property
    def bearings(self) -> tuple[Bearing, ...]:
        """Compliant supports of the variants `bushing` and `flexible`."""
        found: list[Bearing] = []
        for name, section in self.case.bearings.items():
            if self._known(f"bearings.{name}", section.body, section.on):
                found.extend(self._bearing_instances(name, section))
        return tuple(found)

    @cached_property
    def mounts(self) -> tuple[Bearing, ...]:
        """Supports of the gearbox on the ground, at work where a fixed body is elastic."""
        found = []
        for name, section in self.case.mounts.items():
            key = f"mounts.{name}"
            if section.instead_of is not None and self._known(f"{key}.instead_of", section.instead_of):
                continue
            if section.body == GROUND or not self._known(key, section.body):
                raise self.fault(f"{key}.body = {section.body!r}: name an enabled body that the mount holds")
            body = self.case.bodies[section.body]
            if body.carrier is not None or body.spin_only:
                raise self.fault(f"{key}.body = {section.body!r}: a planet or a spin-only body cannot be mounted")
            x, y, z = (1e-3 * value for value in section.position_mm)
            found.append(
                Bearing(name, name, section.body, GROUND, (x, y, z), section.stiffness, None, section.damping, 1.0)
            )
        return tuple(found)

    @cached_property
    def couplings(self) -> tuple[Coupling, ...]:
        """Torsional springs between spins."""
        found = []
        for name, section in self.case.couplings.items():
            key = f"couplings.{name}"
            if section.instead_of is not None and self._known(f"{key}.instead_of", section.instead_of):
                continue
            if not self._known(key, *section.bodies):
                continue
            if section.seat is not None and section.seat not in {bearing.name for bearing in self.bearings}:
                known = ", ".join(bearing.name for bearing in self.bearings)
                raise self.fault(f"{key}.seat = {section.seat!r}: no such bearing; bearings are {known}")
            damping = section.damping_N_m_s_per_rad
            if damping is None:
                damping = self.case.damping.coupling_time_s * section.stiffness_N_m_per_rad
            found.append(Coupling(name, *section.bodies, section.seat, section.stiffness_N_m_per_rad, damping))
        return tuple(found)

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        """All meshes at work, one per planet."""
        found: list[Mesh] = []
        for name, section in self.case.meshes.items():
            if self._known(f"meshes.{name}", section.pinion_body, section.gear_body):
                found.extend(self._mesh_instances(name, section))
        return tuple(found)

    @cached_property
    def deviations(self) -> dict[tuple[str, str], WheelDeviation]:
        """Errors of wheels by body and gear; a pitch deviation is cumulative, positive into the tooth (ISO 1328-1)."""
        found = {}
        for name, section in self.case.deviations.items():
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
            found[section.body, gear] = WheelDeviation(
                teeth=toothed.teeth,
                pitch=pitch * toothed.base_radius / toothed.reference_radius,
                eccentricity=0.5e-6 * section.runout_um,
                eccentricity_angle=math.radians(section.runout_angle_deg),
            )
        return found

    @cached_property
    def pin_offsets(self) -> dict[str, tuple[float, float]]:
        """Position error of planets in their carrier at zero angles, x and y, m."""
        found = {}
        for name, section in self.case.pins.items():
            body = self._named_bodies.get(section.body)
            if body is None or body.carrier is None:
                planets = ", ".join(b.name for b in self._named_bodies.values() if b.carrier) or "none"
                raise self.fault(f"pins.{name}.body = {section.body!r}: no planet; planets are {planets}")
            error = 1e-6 * complex(section.radial_um, section.tangential_um)
            error *= complex(math.cos(body.orbit_angle), math.sin(body.orbit_angle))
            found[section.body] = error.real, error.imag
        return found

    @cached_property
    def load_cases(self) -> dict[str, LoadCase]:
        """Load cases by name."""
        return {name: self._load_case(name, section) for name, section in self.case.load_cases.items()}

    # -- kinematics and statics of the spins -------------------------------------------------------------

    @cached_property
    def spinning(self) -> tuple[str, ...]:
        """Names of the bodies that can turn, in the order of the spin vector."""
        return tuple(body.name for body in self.bodies() if not body.fixed)

    def mesh_row(self, mesh: Mesh) -> NDArray[np.float64]:
        """Return how a mesh closes per unit spins: r_b1 (t1 - tf) +- r_b2 (t2 - tf), flank s = +1, m/rad.

        Plus for an external pair, minus for an internal one; tf is the spin of the frame.
        """
        row = np.zeros(len(self.spinning))
        first = mesh.pair.pinion.base_radius
        second = mesh.pair.gear.base_radius * (-1.0 if mesh.pair.gear.internal else 1.0)
        for name, value in ((mesh.pinion, first), (mesh.gear, second), (mesh.frame, -(first + second))):
            if name in self.spinning:
                row[self.spinning.index(name)] += value
        return row

    @cached_property
    def kinematic_modes(self) -> NDArray[np.float64]:
        """Basis of rolling motions, (bodies, mobility): no mesh closes, no coupling twists."""
        rows = np.vstack([self.spin_rows, np.zeros((1, len(self.spinning)))])
        scale = np.abs(rows).max(axis=1, keepdims=True)
        _, singular, basis = np.linalg.svd(rows / np.where(scale > 0, scale, 1.0))
        rank = int(np.sum(singular > 1e-9 * singular[0]))
        return basis[rank:].T

    def rolling_speeds(self, body: str, speed: float) -> dict[str, float]:
        """Spins of all bodies (rad/s) in rolling motion when `body` turns at `speed`.

        In a train of several degrees of freedom, locked bodies other than the overall input and output stand.

        Raises
        ------
        CaseError
            The train is not fixed by that, or the body does not turn with it.
        """
        if body not in self.spinning:
            raise self.fault(f"body {body!r} does not turn; bodies are {', '.join(self.spinning)}")
        modes = self.kinematic_modes
        prescribed = {body: speed, **dict.fromkeys(self._held_aside(body), 0.0)}
        rows = modes[[self.spinning.index(name) for name in prescribed]]
        wanted = np.array(list(prescribed.values()))
        weights, _, rank, _ = np.linalg.lstsq(rows, wanted, rcond=1e-9)
        if rank < modes.shape[1] or np.abs(rows @ weights - wanted).max() > 1e-9 * abs(speed):
            raise self.fault(
                f"the gear train has {modes.shape[1]} degrees of freedom; turning {', '.join(prescribed)} "
                "does not fix it: name the bodies that are held in static_load.locked"
            )
        return dict(zip(self.spinning, (modes @ weights).tolist(), strict=True))

    def _held_aside(self, body: str) -> tuple[str, ...]:
        """Bodies that a train of several degrees of freedom holds: the locked ones but input, output, `body`."""
        overall = self.case.overall
        return tuple(name for name in self.case.static_load.locked if name not in (body, overall.input, overall.output))

    @cached_property
    def ratio(self) -> float:
        """Spin of the overall output per spin of the overall input."""
        return self.rolling_speeds(self.case.overall.input, 1.0)[self.case.overall.output]

    def mesh_frequencies(self, speed: float) -> dict[str, float]:
        """Mesh frequency (Hz) of each mesh when the overall input turns at `speed` rad/s."""
        spins = {GROUND: 0.0, **self.rolling_speeds(self.case.overall.input, speed)}
        return {
            mesh.name: abs(spins.get(mesh.pinion, 0.0) - spins.get(mesh.frame, 0.0))
            * mesh.pair.pinion.teeth
            / (2.0 * math.pi)
            for mesh in self.meshes
        }

    def static_mesh_forces(self, torques: Mapping[str, float] | None = None) -> dict[str, float]:
        """Line-of-action force F_bt of each mesh (N) in the static state, least-norm where planets share.

        The sign says which flank of gear 1 carries: positive = the one that faces the sense of +z rotation.
        `torques` default to the file's static load; the same bodies are locked.
        """
        load = self.case.static_load
        torques = load.torques_N_m if torques is None else torques
        for key, names in (("torques_N_m", tuple(torques)), ("locked", load.locked)):
            for name in names:
                if name not in self.spinning:
                    raise self.fault(
                        f"static_load.{key} = {name!r}: no such turning body; bodies are {', '.join(self.spinning)}"
                    )
        applied = np.array([torques.get(name, 0.0) for name in self.spinning])
        locks = np.array([[float(name == lock) for name in self.spinning] for lock in load.locked])
        balance = np.vstack([self.spin_rows, locks.reshape(-1, len(self.spinning))]).T
        forces = np.linalg.lstsq(balance, applied, rcond=1e-12)[0]
        if np.abs(balance @ forces - applied).max() > 1e-9 * np.abs(applied).max():
            raise self.fault(
                f"static_load: the torques {dict(torques)} are not held by locking "
                f"{', '.join(load.locked) or 'nothing'}"
            )
        return {mesh.name: float(force) for mesh, force in zip(self.meshes, forces, strict=False)}

    @property
    def spin_rows(self) -> NDArray[np.float64]:
        """How meshes close and couplings twist per unit spins, (meshes and couplings, spins); m/rad, and 1."""
        rows = [self.mesh_row(mesh) for mesh in self.meshes]
        for coupling in self.couplings:
            rows.append(
                np.array([float(name == coupling.first) - float(name == coupling.second) for name in self.spinning])
            )
        return np.array(rows).reshape(-1, len(self.spinning))

    # -- from sections to data ---------------------------------------------------------------------------

    @cached_property
    def _body_sections(self) -> dict[str, BodySection]:
        return {name: section for name, section in self.case.bodies.items() if section.enabled}

    def _known(self, key: str, *names: str) -> bool:
        """Tell whether all bodies are enabled; an unknown name is an error, a disabled one is not."""
        for name in names:
            if name != GROUND and name not in self.case.bodies:
                raise self.fault(f"{key}: no body {name!r}; bodies are {', '.join(self.case.bodies)} and ground")
        return all(name == GROUND or name in self._body_sections for name in names)

    def _guard(self, key: str, build: Any, *arguments: Any, **named: Any) -> Any:
        try:
            return build(*arguments, **named)
        except GeometryError as error:
            raise self.fault(f"{key}: {error}") from None

    def _suffixes(self, name: str) -> list[str]:
        count = len(self._body_sections[name].planet_angles_deg) if name in self._body_sections else 0
        return [f"_{number}" for number in range(1, count + 1)] or [""]

    def _instances(self, first: str, second: str) -> list[tuple[str, str, str]]:
        """(suffix, first, second) for each planet; sets meet single bodies or equal sets."""
        one, two = self._suffixes(first), self._suffixes(second)
        if len(one) > 1 and len(two) > 1 and len(one) != len(two):
            raise self.fault(f"bodies {first!r} and {second!r} are planet sets of different size")
        many = one if len(one) >= len(two) else two
        return [
            (suffix, first + (suffix if one != [""] else ""), second + (suffix if two != [""] else ""))
            for suffix in many
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

    def _bearing_instances(self, name: str, section: BearingSection) -> Iterator[Bearing]:
        factor = self.case.housing.factor if section.housing_factor_applies else 1.0
        for suffix, body, on in self._instances(section.body, section.on):
            yield Bearing(
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

    def _mesh_instances(self, name: str, section: MeshSection) -> Iterator[Mesh]:
        key = f"meshes.{name}"
        if section.pair not in self.gear_pairs:
            raise self.fault(f"{key}.pair = {section.pair!r}: no such pair; pairs are {', '.join(self.gear_pairs)}")
        pair = self.gear_pairs[section.pair]
        instances = self._instances(section.pinion_body, section.gear_body)
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
            yield Mesh(
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
