"""The gearbox as data: bodies, supports, meshes and load cases in SI units, read from TOML and checked.

Axes: +z along the shafts towards the output, lengths in m, angles in rad, rotation positive about +z. A planet set is
written once in the file. Here it appears as one body, support and mesh per planet, numbered from 1 (`planet_1`,
`sun_planet_1`).
"""

from __future__ import annotations

import difflib
import inspect
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from exugear.gearbox import body_parts, gear_parts
from exugear.gearbox.checks import ALONE, CHECKS, Check, Element, bodies_apart
from exugear.gearbox.named_files import NOTHING_MORE, Permissions
from exugear.gearbox.parts import (
    Bearing,
    Body,
    Coupling,
    DampingTimes,
    Joint,
    LoadCase,
    Mesh,
    PairSpec,
    PointForce,
    VaryingLoad,
    WheelDeviation,
    connector_matrix,
    draw_side_view,
)
from exugear.gearbox.reading import (
    GearboxFileError,
    Origin,
    flattened,
    parse_case,
    parsed_toml,
    read_text,
    read_toml,
    readable,
    shortened,
)
from exugear.gearbox.sections.case import NAMED_TABLES, GearboxFile, SteSection, labels_in_use
from exugear.gearbox.sections.entries import GROUND, unusual_values
from exugear.gearbox.train import SpinConstraint, Train
from exugear.gearbox.units import UM
from fe_ste.flanks import FlankModification
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.standards import iso6336
from fe_ste.tools.display import ReprMixin, TitledRows
from fe_ste.tools.drawing import axes_or_new
from fe_ste.tools.files import write_file
from fe_ste.tools.toml_text import with_numbers

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BESIDE_EQUATIONS = (
    "labels",
    "load_cases",
    "loads",
    "lubricant",
    "measurements",
    "operation",
    "rating",
    "report",
    "ste",
)
"""Tables of the file that do not affect the equations of motion: labels, load cases, life loads, lubricant,
measurements, operation, rating, and settings of reports and STE tables. STE settings enter the hashes separately; a
run adds its own load case.
"""


@dataclass(frozen=True)
class Gearbox(ReprMixin):
    """A checked gearbox, built by :meth:`from_toml` or :meth:`from_dict`.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
    >>> round(gearbox.train.ratio, 6)
    81.490683
    >>> sorted(gearbox.pairs)
    ['high_speed', 'intermediate', 'ring_planet', 'sun_planet']
    """

    case: GearboxFile
    """Validated content of the gearbox file."""
    source: str
    """Path or name of the file."""
    content: Mapping[str, Any]
    """Raw content of the file before validation."""
    permissions: Permissions = NOTHING_MORE

    @classmethod
    def from_toml(cls, path: str | Path, permissions: Permissions = NOTHING_MORE) -> Gearbox:
        """Read and check a gearbox file.

        Parameters
        ----------
        permissions : whether scripts named in the file may run, and in which other folder its files may lie

        Raises
        ------
        GearboxFileError
            The file has errors; one message lists them with file, key, value and remedy.
        """
        return cls.from_dict(read_toml(path), str(path), permissions)

    @classmethod
    def from_dict(
        cls, content: Mapping[str, Any], source: str = "gearbox", permissions: Permissions = NOTHING_MORE
    ) -> Gearbox:
        """Check content in memory, such as a varied gearbox; the files that it names are in the folder of `source`.

        Raises
        ------
        GearboxFileError
            The content has errors, as in :meth:`from_toml`.
        """
        try:
            case = parse_case(dict(content), source)
        except GearboxFileError as error:
            rest = cls(readable(content), source, content, permissions)
            alone = [check for check in CHECKS if check.name in ALONE]
            raise GearboxFileError(*error.errors, *_errors(rest, alone)) from None
        gearbox = cls(case, source, content, permissions)
        if errors := _errors(gearbox, CHECKS):
            raise GearboxFileError(*errors)
        return gearbox

    def varied(self, changes: Mapping[str, Any]) -> Gearbox:
        """Build a new, checked gearbox with some keys replaced, which are dotted paths of the file.

        Labels of removed entries are removed as well.

        Raises
        ------
        GearboxFileError
            A path leads through a key that is not a section, or the new gearbox has errors. If a path created a new
            entry, the message names the nearest existing path.

        Examples
        --------
        >>> gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml")
        >>> gearbox.varied({"housing.factor": 0.5}).case.housing.factor
        0.5
        """
        content = _copied(self.content)
        made = []  # keys of named entries that do not exist, such as a gear
        for dotted in changes:
            keys = dotted.split(".")
            if len(keys) > 2 and keys[0] in NAMED_TABLES and keys[1] not in content.get(keys[0], {}):
                made.append(dotted)
        for dotted, value in changes.items():
            section = content
            *parents, key = dotted.split(".")
            for parent in parents:
                section = section.setdefault(parent, {})
                if not isinstance(section, dict):
                    raise self.error(f"{dotted}: {parent!r} is not a section")
            section[key] = value
        content["labels"] = labels_in_use(content)
        try:
            return Gearbox.from_dict(content, self.source, self.permissions)
        except GearboxFileError as error:
            if not made:
                raise
            near = difflib.get_close_matches(made[0], list(flattened(self.content)), 1, 0.0)
            raise self.error(
                f"{made[0]}: the file has no entry of this name, and a new one lacks keys; did you mean {near[0]}?"
            ) from error

    def check_copy(self, path: Path) -> None:
        """Refuse a path to which `write_copy` does not write.

        Raises
        ------
        GearboxFileError
            The path exists, is not in the folder of the gearbox file, or does not end in ``.toml``.
        """
        if os.path.lexists(path):
            raise self.error(f"copy {path}: exists and is not overwritten; name a new file")
        if path.parent.resolve() != Path(self.source).parent.resolve() or path.suffix != ".toml":
            raise self.error(
                f"copy {path}: must end in .toml and be in the folder of the gearbox file, as the files that it names"
            )

    def write_copy(self, path: Path, numbers: Mapping[str, float]) -> None:
        """Write a copy of the file into its folder, with numbers replaced by dotted key; comments and spacing are kept.

        The copy is checked before it is written, and written whole or not at all.

        Raises
        ------
        GearboxFileError
            The path is refused, see `check_copy`, the gearbox file has changed since it was read or cannot be read, a
            key has no single number in it, or a value is out of range.
        """
        self.check_copy(path)
        text = read_text(self.source)
        if repr(parsed_toml(text, self.source)) != repr(self.content):
            raise self.error("has changed since it was read; repeat the command")
        self.varied(numbers)
        try:
            changed = with_numbers(text, numbers)
        except ValueError as error:
            raise self.error(str(error)) from None
        try:
            write_file(path, changed.encode())
        except OSError as error:
            raise self.error(f"copy {path}: cannot be written ({error.strerror}); name another file") from error

    def error(self, text: str) -> GearboxFileError:
        """Error whose message is the file name followed by `text` (key, value and remedy)."""
        return self._origin.error(text)

    def file(self, key: str, name: str, largest: int) -> Path:
        """Path of a file that the gearbox file names under a key, with at most `largest` bytes.

        Raises
        ------
        GearboxFileError
            The file does not exist or may not be read, see `exugear.gearbox.named_files.named_file`.
        """
        return self._origin.file(key, name, largest)

    @cached_property
    def _origin(self) -> Origin:
        return Origin(self.case, self.source, self.permissions)

    @property
    def name(self) -> str:
        """Title of the gearbox."""
        return self.case.name

    @property
    def viscosity_40(self) -> float:
        """Kinematic viscosity of the oil at 40 degrees Celsius, mm2/s.

        Raises
        ------
        GearboxFileError
            No viscosity is specified, or two are.
        """
        sections = (self.case.lubricant, self.case.rating)
        found = [section.viscosity_40_mm2_per_s for section in sections if section is not None]
        given = [value for value in found if value is not None]
        if len(given) != 1:
            what = "is set twice; remove the key of [rating]" if given else "this key is missing"
            raise self.error(f"lubricant.viscosity_40_mm2_per_s: {what}")
        return given[0]

    @property
    def ste(self) -> SteSection:
        """Settings of the STE tables."""
        return self.case.ste

    @property
    def computed_content(self) -> dict[str, Any]:
        """Content of the file without `BESIDE_EQUATIONS`, which is the part that the equations depend on."""
        return {key: value for key, value in self.content.items() if key not in BESIDE_EQUATIONS}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about valid but unusual content of the file, one line each."""
        lines = [f"{key} = {value:g}: {warning}" for key, value, warning in unusual_values(self.case)]
        for bearing in self.bearings:
            torsion = connector_matrix(bearing.stiffness)[5, 5]
            ends = (self.case.overall.input, self.case.overall.output)
            if torsion and bearing.body in ends and bearing.on not in self.spinning:
                key = f"bearings.{bearing.family}.stiffness"
                lines.append(f"{key}: torsion {torsion:g} N m/rad constrains {bearing.body}, which rotates; remove it")
        lines += gear_parts.margins_of_roots(self.gear_pairs.values())
        lines += gear_parts.rounded_overlaps(self._origin, self.gears)
        lines += gear_parts.smaller_roundings(self._origin, self.gears)
        for name, gear in self.gears.items():
            if gear.is_undercut:
                start = 2e3 * gear.form_radius
                lines.append(f"gears.{name}: undercut by its rack; the root form diameter is {start:.3f} mm")
        return tuple(dict.fromkeys(lines))

    def _line(self) -> str:
        return (
            f" {shortened(self.name)}: ratio {self.train.ratio:.6g}, {len(self.named_bodies)} bodies, "
            f"{len(self.meshes)} meshes"
        )

    def _table(self) -> TitledRows:
        return self.name, {
            "file": self.source,
            "ratio": f"{self.train.ratio:.6g}",
            "bodies": ", ".join(self.named_bodies),
            "meshes": ", ".join(mesh.name for mesh in self.meshes),
            "bearings": str(len(self.bearings)),
            "inertia sets": ", ".join(self.inertia_sets),
            "load cases": ", ".join(self.load_cases),
            "warnings": str(len(self.warnings)),
        }

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw gears, shafts and bearings to scale, seen across the plane in which the axes are farthest apart.

        Parameters
        ----------
        ax : matplotlib axes; by default new ones, whose ``ax.figure`` can be shown and saved

        Examples
        --------
        >>> ax = Gearbox.from_toml("cases/grc750/gearbox.toml").plot()
        >>> ax.get_xlabel(), [text.get_text() for text in ax.texts]
        ('z / mm', ['housing', 'carrier', 'planet', 'lss', 'ims', 'hss'])
        """
        with axes_or_new(ax, 7.2, 4.0) as panel:
            draw_side_view(panel, self.bodies(), self.gears, self.bearings)
            return panel

    # -- bodies ------------------------------------------------------------------------------------------

    @property
    def inertia_sets(self) -> tuple[str, ...]:
        """Names of the inertia sets; every moving body has each of them."""
        return body_parts.inertia_sets(self._origin)

    def bodies(self, inertias: str | None = None) -> tuple[Body, ...]:
        """All enabled bodies, one per planet, with the mass properties of an inertia set.

        Raises
        ------
        GearboxFileError
            No such inertia set exists.
        """
        inertias = inertias or self.case.default_inertias
        if inertias not in self.inertia_sets:
            raise self.error(f"inertia set {inertias!r} is unknown; sets are {', '.join(self.inertia_sets)}")
        return body_parts.bodies(self._origin, inertias)

    def body(self, name: str, inertias: str | None = None) -> Body:
        """One body by name.

        Raises
        ------
        GearboxFileError
            No such body or inertia set exists.
        """
        bodies = {body.name: body for body in self.bodies(inertias)} if inertias else self.named_bodies
        if name not in bodies:
            raise self.error(f"no body {name!r}; bodies are {', '.join(bodies)}")
        return bodies[name]

    @cached_property
    def bodies_by_inertias(self) -> dict[str, tuple[Body, ...]]:
        """All enabled bodies by inertia set."""
        return {inertias: self.bodies(inertias) for inertias in self.inertia_sets}

    @cached_property
    def named_bodies(self) -> dict[str, Body]:
        """All enabled bodies by name, with the default inertia set."""
        return {body.name: body for body in self.bodies()}

    @cached_property
    def spinning(self) -> tuple[str, ...]:
        """Names of the bodies that can rotate, in the order of the vector of rotational speeds."""
        return tuple(body.name for body in self.named_bodies.values() if not body.fixed)

    @cached_property
    def pin_offsets(self) -> dict[str, tuple[float, float]]:
        """Position errors of planets in their carrier at zero angles, x and y, m."""
        return body_parts.pin_offsets(self._origin, self.named_bodies)

    @property
    def damping_times(self) -> DampingTimes:
        """Damping over stiffness of bearings, meshes and couplings; zero where the file states the damping of modes."""
        return body_parts.damping_times(self.case.damping)

    @cached_property
    def load_cases(self) -> dict[str, LoadCase]:
        """Load cases by name."""
        return body_parts.load_cases(self._origin, self.spinning)

    # -- supports ----------------------------------------------------------------------------------------

    @cached_property
    def joints(self) -> tuple[Joint, ...]:
        """Ideal joints of the variant `rigid`."""
        return body_parts.joints(self._origin, self.named_bodies)

    @cached_property
    def bearings(self) -> tuple[Bearing, ...]:
        """Compliant supports of the variants `bushing` and `flexible`."""
        return body_parts.bearings(self._origin, self.named_bodies)

    @cached_property
    def unknown_bearings(self) -> dict[str, str]:
        """Designations of bearings without other data, by name; variants with bearings require these data."""
        return body_parts.unknown_bearings(self._origin)

    @cached_property
    def mounts(self) -> tuple[Bearing, ...]:
        """Supports of the gearbox on the ground, which are active if a fixed body is flexible."""
        return body_parts.mounts(self._origin)

    @cached_property
    def standing_bearings(self) -> tuple[Bearing, ...]:
        """Bearings between a moving body and one that stands still, such as the housing or the ground."""
        standing = {GROUND, *(body.name for body in self.bodies() if body.fixed)}
        return tuple(own for own in self.bearings if own.on in standing and own.body not in standing)

    @cached_property
    def forces(self) -> tuple[PointForce, ...]:
        """Constant forces and moments on bodies."""
        return body_parts.point_forces(self._origin, self.named_bodies)

    @cached_property
    def varying_loads(self) -> tuple[VaryingLoad, ...]:
        """Forces and moments on bodies that vary with their angle, order by order."""
        return body_parts.varying_loads(self._origin, self.named_bodies, lambda body: self.train.static_torques[body])

    @cached_property
    def couplings(self) -> tuple[Coupling, ...]:
        """Torsional springs between rotating bodies."""
        return body_parts.couplings(self._origin, self.spinning, [bearing.name for bearing in self.bearings])

    @property
    def elements(self) -> dict[str, Sequence[Element]]:
        """Parts that exert forces, by their table in the file."""
        return {
            "meshes": self.meshes,
            "bearings": self.bearings,
            "mounts": self.mounts,
            "couplings": self.couplings,
            "forces": self.forces,
        }

    # -- gears -------------------------------------------------------------------------------------------

    @cached_property
    def gears(self) -> dict[str, Gear]:
        """All gears by name."""
        return gear_parts.gears(self._origin)

    @cached_property
    def modifications(self) -> dict[str, FlankModification]:
        """Flank modifications of all gears by name."""
        return gear_parts.modifications(self._origin, self.gears)

    @cached_property
    def deviations(self) -> dict[tuple[str, str], WheelDeviation]:
        """Deviations of gears by body and gear; pitch deviation cumulative, positive into the tooth (ISO 1328-1)."""
        return gear_parts.deviations(self._origin, self.gears, self.named_bodies)

    @cached_property
    def gear_pairs(self) -> dict[str, GearPair]:
        """All gear pairs by name."""
        return gear_parts.gear_pairs(self._origin, self.gears)

    @cached_property
    def meshes(self) -> tuple[Mesh, ...]:
        """All enabled meshes, one per planet."""
        return gear_parts.meshes(self._origin, self.gear_pairs, self.named_bodies)

    @cached_property
    def train(self) -> Train:
        """The gear train: its rigid kinematics and the static mesh forces.

        Examples
        --------
        >>> train = Gearbox.from_toml("cases/grc750/gearbox.toml").train
        >>> round(train.ratio, 6)
        81.490683
        """
        return Train(
            spins=self.spinning,
            meshes=self.meshes,
            couplings=(*self.couplings, *self.held_by_torsion.values()),
            input=self.case.overall.input,
            output=self.case.overall.output,
            torques=self.case.static_load.torques_N_m,
            locked=self.locked,
            error=self.error,
        )

    @cached_property
    def held_by_torsion(self) -> dict[str, SpinConstraint]:
        """Constraints by name of rotating bodies with torsional support, such as a ring gear on a torque arm.

        The kinematics of the train treat these bodies as fixed. Torsional supports of the overall input and output are
        excluded, because they do not affect the kinematics.
        """
        ends = (self.case.overall.input, self.case.overall.output)
        mounts = tuple(mount for mount in self.mounts if mount.body in self.apart)
        return {
            bearing.body: SpinConstraint(bearing.on, bearing.body)
            for bearing in (*self.bearings, *mounts)
            if connector_matrix(bearing.stiffness)[5, 5]
            and bearing.body in self.spinning
            and bearing.body not in ends
            and bearing.on not in self.spinning
        }

    @cached_property
    def apart(self) -> tuple[str, ...]:
        """Movable bodies that do not belong to the train, such as a pedestal between a bearing and the ground."""
        return bodies_apart(self.case, self.named_bodies.values(), self.meshes, self.couplings)

    @property
    def locked(self) -> tuple[str, ...]:
        """Bodies that react the static load, without those that torsional supports restrain."""
        return tuple(name for name in self.case.static_load.locked if name not in self.held_by_torsion)

    @property
    def output_radius(self) -> float:
        """Base radius of the overall output gear, m; 1 m for a rotor without gears."""
        name = self.case.overall.output_gear
        return 1.0 if name is None else self.gears[name].base_radius

    def start_speeds(self, case: LoadCase) -> dict[str, float]:
        """Rotational speeds of all bodies at the start of a load case, rad/s.

        Raises
        ------
        GearboxFileError
            The speeds of the load case contradict each other.
        """
        return self.train.rolling({self.case.overall.input: case.start_speed, **case.start_speeds})

    def mesh_orders(self, count: int = 3) -> dict[str, float]:
        """Orders of all meshes with `count` harmonics, by name; meshes of equal frequency share an order.

        Examples
        --------
        >>> orders = Gearbox.from_toml("cases/grc750/gearbox.toml").mesh_orders(2)
        >>> {name: round(order, 3) for name, order in list(orders.items())[:3]}
        {'sun_planet': 99.0, '2 × sun_planet': 198.0, 'intermediate': 468.571}
        """
        first: dict[str, float] = {}
        by_mesh = self.train.mesh_frequencies(2.0 * math.pi)  # at one revolution per second
        for mesh in self.meshes:
            order = by_mesh[mesh.name]
            if not any(abs(order - known) < 1e-6 * known for known in first.values()):
                first[mesh.family] = order
        orders: dict[str, float] = {}
        for name, order in first.items():
            orders |= {f"{n} × {name}" if n > 1 else name: n * order for n in range(1, count + 1)}
        return orders

    @cached_property
    def pairs(self) -> dict[str, PairSpec]:
        """Gear pairs with the static torque on gear 1 from the statics of the train."""
        static_forces = self.train.static_mesh_forces()
        forces: dict[str, list[float]] = {}
        for mesh in self.meshes:
            forces.setdefault(mesh.pair.name, []).append(static_forces[mesh.name])
        return gear_parts.pair_specs(
            self.case.pairs, self.gear_pairs, self.modifications, forces, self.stated_stiffness
        )

    @cached_property
    def idle_pairs(self) -> tuple[str, ...]:
        """Pairs of enabled meshes without static torque whose stiffness the file does not specify."""
        forces = self.train.static_mesh_forces()
        loaded = {mesh.pair.name for mesh in self.meshes if forces[mesh.name] != 0.0}
        at_work = dict.fromkeys(mesh.pair.name for mesh in self.meshes)
        return tuple(name for name in at_work if name not in loaded and self.case.pairs[name].stiffness is None)

    @cached_property
    def file_stiffness(self) -> dict[str, tuple[float, ...]]:
        """Mesh stiffness that the file specifies by pair, N/m at equal distances over the mesh cycle."""
        return gear_parts.stated_stiffness(self._origin)

    @cached_property
    def stated_stiffness(self) -> dict[str, tuple[float, ...]]:
        """Mesh stiffness of the pairs that need no table, N/m at equal distances over the mesh cycle.

        The stiffness of the file has priority. A pair without torque has no loaded flank and therefore no table: it
        gets the mesh stiffness of loaded teeth according to ISO 6336-1, which is constant and causes no excitation.
        """
        idle = {name: (iso6336.mesh_stiffness(self.gear_pairs[name]).stiffness,) for name in self.idle_pairs}
        return self.file_stiffness | idle

    def table_distances(self, pair: str) -> tuple[float, ...]:
        """Centre distances (m) specified for the table of a pair with axes; none if they follow from the state.

        Raises
        ------
        GearboxFileError
            The gears cannot run at one of the centre distances.
        """
        static = self.gear_pairs[pair]
        offsets = self.ste.centre_distance_offsets_um or ()
        distances = tuple(static.centre_distance + UM * offset for offset in offsets)
        for offset, distance in zip(offsets, distances, strict=True):
            key = f"ste.centre_distance_offsets_um: {offset:g}"
            self._origin.guarded(key, static.with_centre_distance, distance)
        return distances


def _errors(gearbox: Gearbox, selected: Iterable[Check]) -> list[str]:
    """Errors of checks in their order, without the checks whose prerequisites failed or were skipped."""
    errors: list[str] = []
    failed: set[str] = set()
    for check in selected:
        if failed & set(check.needs):
            failed.add(check.name)
            continue
        try:
            if check.errors is None:
                getattr(gearbox, check.name)
                continue
            parts = {name: getattr(gearbox, name) for name in inspect.signature(check.errors).parameters}
            lines = [line for text in check.errors(**parts) for line in gearbox.error(text).errors]
        except GearboxFileError as error:
            lines = list(error.errors)
        if lines:
            errors += lines
            failed.add(check.name)
    return errors


def _copied(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _copied(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return list(value)
    return value
