"""Export of results into the REXS file from which a gearbox was imported."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

import exugear
from exugear.exchange.rexs.containers import read_rexs, with_additions
from exugear.exchange.rexs.export.names import Origins, name_in, origins_of, stiffness_names, unit_in
from exugear.exchange.rexs.mapping import ATTRIBUTES, OWN, RESULTS, Version
from exugear.exchange.rexs.to_case.conversion import to_case
from exugear.exchange.rexs.to_case.notes import Rules
from exugear.exchange.rexs.tree import Addition, AdditionValue, Model, RexsError
from exugear.gearbox.choice import Choice, choice_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.parts import Body, seat_key
from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import KN, MPA, unit_of
from exugear.gearbox.variant import VariantError
from exugear.results.folder import bodies_folder, read_duties
from exugear.results.run_file import FINAL_NAME, load_run
from exugear.system.bearings.rolling.rows import BearingError
from exugear.system.bodies.elastic_body import ElasticBody
from exugear.system.bodies.of_gearbox import reduced_bodies
from exugear.system.build import assemble
from exugear.system.modes import load_modes
from exugear.system.statics import BalanceError, static_state
from exugear.system.system import Assembly, input_hash
from exugear.system.tooth_mesh.laws.stiffness import mesh_stiffness
from exugear.system.tooth_mesh.placement import MeshError
from exugear.system.tooth_mesh.tables import fitting_table, table_path
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.tools.arrays import Floats
from fe_ste.tools.display import ReprMixin
from fe_ste.tools.files import FileError
from fe_ste.transmission_error.contact_stress import face_load_factor, largest_contact_stress, load_along_face
from fe_ste.transmission_error.table import MeshTable, TableError

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

Result = TypeVar("Result")
Member = TypeVar("Member")
_UNFIT = (GearboxFileError, MeshError, VariantError, BearingError, BalanceError, FileError, KeyError, ValueError)
"""Errors of reading a result file or of assembling the gearbox with its model settings."""


@dataclass
class ResultsForExport:
    """Results stored in a results folder."""

    gearbox: Gearbox
    folder: Path
    left_out: list[str] = field(default_factory=list)
    """Files that do not belong to the gearbox, with the reason."""
    _assemblies: dict[Choice, Assembly] = field(default_factory=dict, repr=False)

    def tables(self) -> dict[str, MeshTable]:
        """Tables by pair."""
        found = {}
        for name in self.gearbox.pairs:
            if not table_path(self.folder, name).exists():
                continue
            try:
                found[name] = fitting_table(self.gearbox, name, self.folder)
            except TableError as error:
                self.left_out.append(f"table of {name}: {error}")
        return found

    def modes(self) -> dict[Choice, xr.Dataset]:
        """Modes by model settings."""
        return dict(self._each("*/*/modes.nc", self._modes))

    def runs(self) -> dict[Choice, xr.Dataset]:
        """Mesh forces of finished runs by model settings, including the load case."""
        return dict(self._each(f"*/*/{FINAL_NAME}", self._run))

    def duties(self) -> list[Mapping[str, Any]]:
        """Return the bearing loads of the most complete variant for which they were computed."""
        found = dict(self._each("*/*/bearings.json", self._duties))
        best = sorted(found, key=lambda choice: choice.variant.is_elastic)[-1:]
        return [duty for choice in best for duty in found[choice]]

    @property
    def loaded(self) -> Assembly | None:
        """The most complete variant with bearings for which results were read."""
        assemblies = [assembly for assembly in self._assemblies.values() if assembly.variant.has_bearings]
        return max(assemblies, key=lambda choice: choice.variant.is_elastic, default=None)

    def _each(self, pattern: str, read: Callable[[Path], tuple[Choice, Result]]) -> Iterator[tuple[Choice, Result]]:
        """Read files one by one; those that do not belong to the gearbox are recorded in `left_out`."""
        for path in sorted(self.folder.glob(pattern)):
            try:
                yield read(path)
            except _UNFIT as error:
                self.left_out.append(f"{path.relative_to(self.folder)}: {error}")

    def _modes(self, path: Path) -> tuple[Choice, xr.Dataset]:
        data = load_modes(path)
        self._check(choice_of(data.attrs), data.attrs)
        return choice_of(data.attrs), data

    def _run(self, path: Path) -> tuple[Choice, xr.Dataset]:
        data = load_run(path, ("mesh_force",))
        case = str(data.attrs["load_case"])
        if case not in self.gearbox.load_cases:
            raise GearboxFileError(f"the gearbox file has no load case {case!r}")
        self._check(choice_of(data.attrs), data.attrs, case)
        return replace(choice_of(data.attrs), load_case=case), data

    def _duties(self, path: Path) -> tuple[Choice, list[Mapping[str, Any]]]:
        content = read_duties(path)
        law, _, inertias = path.parent.name.partition("-")
        choice = Choice(path.parent.parent.name, law, inertias)
        self._check(choice, content)
        return choice, content["bearings"]

    def _check(self, choice: Choice, attributes: Mapping[str, Any], load_case: str | None = None) -> None:
        """Raise an error if a result was computed from other input.

        Raises
        ------
        GearboxFileError
            The input differs.
        """
        if choice not in self._assemblies:
            bodies: dict[str, ElasticBody] = {}
            if choice.variant.is_elastic:
                bodies = reduced_bodies(self.gearbox, choice.inertia_set(self.gearbox), bodies_folder(self.folder))
            stiffness = mesh_stiffness(self.gearbox, choice.mesh_model, self.folder)
            self._assemblies[choice] = assemble(self.gearbox, choice, stiffness, bodies)
        if input_hash(self._assemblies[choice], load_case) != attributes.get("input_hash"):
            raise GearboxFileError("was computed from another input; recompute it")


# Results on gears and stages: geometry, static load and transmission error tables

EQUAL = 1e-9
"""Largest relative difference at which numbers count as equal in both files."""


@dataclass
class Results(ReprMixin, line=": {additions!n} attributes"):
    """Results of a gearbox, collected for the REXS file from which it was imported."""

    gearbox: Gearbox
    model: Model
    origins: Origins
    static_case: int | None
    """Load case of the file with the static load; None if there is none, so that its results belong to the model."""
    additions: list[Addition] = field(default_factory=list)

    @property
    def version(self) -> Version:
        """Version of the file."""
        major, minor = self.model.version.split(".")[:2]
        return int(major), int(minor)

    def put(
        self, component: int, key: str, value: ArrayLike | None, load_case: int | None = None, own: bool = False
    ) -> None:
        """Add a result in SI (key of `RESULTS`) under its name in the version, or its `own` name; None is skipped."""
        if value is None:
            return
        unit = RESULTS[key].unit
        known = unit_of(unit)
        scaled = np.asarray(value, dtype=float) / (known.factor if known else 1.0)
        name = OWN + key if own else name_in(key, self.version)
        self.put_named(component, name, unit, tuple(scaled.tolist()) if scaled.ndim else float(scaled), load_case)

    def put_named(
        self, component: int, name: str, unit: str, value: AdditionValue, load_case: int | None = None
    ) -> None:
        """Add a result in a unit under a name."""
        self.additions.append(Addition(component, name, unit_in(unit, self.version), value, load_case))

    def sense(self, component: int) -> int:
        """Sense of a component's u axis: 1 along +z, -1 against it."""
        axes = self.origins.axes.get(component)
        return 1 if axes is None or axes[0, 2] > 0.0 else -1

    def gear_data(self, stage: int, gear: Gear) -> int | None:
        """Component with the data of a gear in a stage."""
        numbers = self.origins.gears[gear.name]
        for relation in self.model.relations_of("stage_gear_data"):
            if relation.roles.get("stage") == stage and relation.roles.get("gear") in numbers:
                return relation.roles.get("stage_gear_data")
        return None


def check_same_gears(gearbox: Gearbox, imported: Gearbox) -> None:
    """Raise an error if a REXS file describes another gearbox; editable values may differ.

    Raises
    ------
    RexsError
        The file lacks gears or pairs of the gearbox, or gears differ in tooth number, module or type.
    """
    errors = []
    for kind, own, others in (("gears", gearbox.gears, imported.gears), ("pairs", gearbox.pairs, imported.pairs)):
        missing = [name for name in own if name not in others]
        if missing:
            errors.append(
                f"{gearbox.source}: {kind} {', '.join(missing)} do not originate from this file, whose {kind} are "
                f"imported as {', '.join(others)}; keep the names of the import"
            )
    for name in gearbox.gears.keys() & imported.gears.keys():
        gear = gearbox.gears[name]
        other = imported.gears[name]
        for key in ("teeth", "normal_module", "internal"):
            if not math.isclose(getattr(gear, key), getattr(other, key), rel_tol=EQUAL):
                errors.append(
                    f"{gearbox.source}: gears.{name} has {key} = {getattr(gear, key):g}, in this file it is "
                    f"{getattr(other, key):g}; export results of the same gear only"
                )
    if errors:
        raise RexsError(*errors)


def put_gears(results: Results) -> None:
    """Add the diameters of gears, and those inputs of the gearbox file that differ from the REXS file."""
    for name, gear in results.gearbox.gears.items():
        normal = gear.normal_tooth_thickness
        sine = abs(math.sin(gear.helix_angle))
        values = {
            "reference_diameter": 2.0 * gear.reference_radius,
            "base_diameter": 2.0 * gear.base_radius,
            "axial_pitch": math.pi * gear.normal_module / sine if sine else None,
            "normal_tooth_thickness": normal,
            "transverse_tooth_thickness": normal / math.cos(gear.helix_angle),
            "normal_tooth_thickness_at_tip_diameter": gear.tip_thickness,
        }
        # Inputs that a REXS file may not specify, or that an import may have replaced.
        inputs = {
            "profile_shift": gear.profile_shift,
            "tooth_thinning": gear.tooth_thinning,
            "root_diameter": 2.0 * gear.root_radius,
            "tool_tip_radius": gear.rack.tip_radius,
        }
        for number in results.origins.gears[name]:
            for key, value in values.items():
                results.put(number, key, value)
            part = results.model.components[number]
            for key, radius in (("root_form_diameter", gear.form_radius), ("tip_diameter", gear.tip_radius)):
                stated = part.quantity(key, "mm")
                if stated is None and key == "root_form_diameter":
                    results.put(number, key, 2.0 * radius)
                elif stated is None or not math.isclose(abs(stated), 2e3 * radius, rel_tol=EQUAL):
                    results.put(number, key, 2.0 * radius, own=True)  # the value of the file is an input and is kept
            for key, value in inputs.items():
                results.put(number, key, value)


def put_pairs(results: Results) -> None:
    """Add results of pairs: contact ratios, working pitch circles, clearances."""
    for name, spec in results.gearbox.pairs.items():
        pair = spec.pair
        values = {
            "gear_ratio": pair.ratio,
            "transverse_contact_ratio": pair.transverse_contact_ratio,
            "overlap_ratio": pair.overlap_ratio or None,  # REXS does not permit zero
            "total_contact_ratio": pair.total_contact_ratio,
            "length_of_path_of_contact": pair.path_end - pair.path_start,
            "transverse_backlash": pair.circumferential_backlash,
        }
        for stage in results.origins.pairs[name]:
            for key, value in values.items():
                results.put(stage, key, value)
            for gear, clearance in ((pair.pinion, pair.pinion_tip_clearance), (pair.gear, pair.gear_tip_clearance)):
                data = results.gear_data(stage, gear)
                if data is None:
                    continue
                root, tip = _active(pair, gear)
                results.put(data, "pitch_diameter", 2.0 * pair.working_radius(gear))
                results.put(data, "working_pressure_angle", pair.working_pressure_angle)
                results.put(data, "active_root_diameter", 2.0 * root)
                results.put(data, "active_tip_diameter", 2.0 * tip)
                results.put(data, "tip_clearance", clearance)


def _active(pair: GearPair, gear: Gear) -> tuple[float, float]:
    """Active root and tip radius of a gear, between which it contacts its mating gear, m."""
    rolls = [pair.path_start, pair.path_end]
    if gear is pair.gear:
        tangent = pair.base_tangent_length
        rolls = [roll + tangent if gear.internal else tangent - roll for roll in rolls]
    low, high = sorted(math.hypot(gear.base_radius, roll) for roll in rolls)
    return (high, low) if gear.internal else (low, high)


def put_static_forces(results: Results) -> None:
    """Add the static mesh forces, which equal planets share evenly."""
    meshes = {mesh.name: mesh for mesh in results.gearbox.meshes}
    for name, force in results.gearbox.train.static_mesh_forces().items():
        stage = member_of(results.origins.pairs[meshes[name].pair.name], name, meshes[name].family)
        if stage is not None:
            results.put(stage, "tangential_force_at_base_circle", abs(force), results.static_case)


def member_of(members: Sequence[Member], name: str, family: str) -> Member | None:
    """Return the member of a planet, whose number is in the name of its part; None if there are fewer members.

    Examples
    --------
    >>> member_of([7, 8, 9], "sun_planet_3", "sun_planet"), member_of([7], "stage_1", "stage_1")
    (9, 7)
    """
    number = name.removeprefix(family).removeprefix("_")
    place = int(number) - 1 if number.isdigit() else 0
    return members[place] if place < len(members) else None


def put_tables(results: Results, tables: Mapping[str, MeshTable]) -> None:
    """Add transmission error, mesh stiffness and load distribution along the face width in the static state."""
    for name, table in tables.items():
        data = table.static_state
        pair = results.gearbox.pairs[name].pair
        case = results.static_case
        error = data["ste"]
        stiffness = data["mesh_stiffness"]
        along = load_along_face(data)
        values = {
            # REXS has no symbol for a missing value.
            "transmission_error": None if error.isnull().any() else error,
            "mesh_stiffness": None if stiffness.isnull().any() else stiffness,
            "mesh_cycle_positions": data["pmc"],
            "transmission_error_peak_to_peak": error.max() - error.min(),
            "mean_mesh_stiffness": stiffness.mean(),
            "contact_pressure_maximum": largest_contact_stress(pair, data),
            "face_load_factor": face_load_factor(data),
            "load_along_face": along,
            "load_along_face_positions_from_middle": along["axial_position"],
        }
        for stage in results.origins.pairs[name]:
            for key, value in values.items():
                results.put(stage, key, value, case)
            for gear in (pair.pinion, pair.gear):
                place = results.gear_data(stage, gear)
                if place is not None:
                    results.put(place, "mesh_positions", 2.0 * math.pi / gear.teeth * data["pmc"], case)


# Results on shafts: speeds in each load case, and displacements at the static load

SPEED = "rotational_speed"


def put_speeds(results: Results) -> None:
    """Add the kinematic speeds of shafts and gears where the file does not specify them.

    Speeds of planets are omitted, because REXS does not define whether they are relative to the carrier.
    """
    for case in results.model.load_cases or (None,):
        name = "nominal" if case is None else f"load_case_{case.number}"
        known = results.gearbox.load_cases.get(name)
        if known is None or not known.start_speed:
            continue
        speeds = results.gearbox.train.rolling(
            {results.gearbox.case.overall.input: known.start_speed, **known.start_speeds}
        )
        for body, members in results.origins.bodies.items():
            for number in members[0] if body in speeds else ():
                part = results.model.components[number]
                stated = part.attributes if case is None else {**part.attributes, **case.changes.get(number, {})}
                if SPEED not in stated:
                    speed = results.sense(number) * speeds[body]
                    results.put(number, SPEED, speed, None if case is None else case.number)


def put_displacements(results: Results, assembly: Assembly) -> None:
    """Add the displacements of shafts at the static load, in their own axes, at the positions of gears and bearings."""
    q = static_state(assembly).q
    for body in assembly.bodies:
        members = member_of(results.origins.bodies.get(body.family, ()), body.name, body.family) or ()
        shafts = [n for n in members if n in results.origins.axes and results.model.components[n].type == "shaft"]
        nodes = sorted(_nodes(assembly, q, body), key=lambda node: node[0])
        if len(shafts) != 1 or not nodes or body.fixed:
            continue
        number = shafts[0]
        nodes = nodes[:: results.sense(number)]
        heights, moved = zip(*nodes, strict=True)
        along = results.sense(number) * (np.array(heights) - results.origins.places[number])
        displacements = np.array(moved) @ results.origins.axes[number].T
        results.put(number, "node_positions", along, results.static_case)
        for axis, column in zip("uvw", displacements.T, strict=True):
            results.put(number, f"displacement_{axis}", column, results.static_case)


def _nodes(assembly: Assembly, q: Floats, body: Body) -> Iterator[tuple[float, Floats]]:
    """Yield positions (m) along a body with six degrees of freedom, and displacements (3,) in m of its axis there."""
    seats = dict(body.wheels)
    for support in assembly.supports:
        if body.name in (support.body, support.on):
            seats[support.name] = support.position[2]
    coordinates = list(assembly.coordinates[body.name])
    if coordinates[0] < 0:
        return
    for item, height in seats.items():
        own = assembly.coordinates.get(seat_key(body.name, item))
        if own is not None:
            yield height, q[list(own[:3])]
        elif body.name not in assembly.elastic_bodies:
            x, y, z, about_x, about_y = q[coordinates[:5]]
            arm = height - body.centre_of_mass_z
            yield height, np.array([x + about_y * arm, y - about_x * arm, z])


# Results on bearings, modes and runs


def put_bearings(results: Results, duties: Sequence[Mapping[str, Any]]) -> None:
    """Add results of catalogue bearings: loads, stiffness at the operating point, contact stress and life."""
    families = {bearing.name: bearing.family for bearing in results.gearbox.bearings}
    case = results.static_case
    for duty in duties:
        name = str(duty["bearing"])
        family = families.get(name, name)
        number = member_of(results.origins.bearings.get(family, ()), name, family)
        if number is None:
            continue
        results.put(number, "radial_load", KN * float(duty["radial_load_kN"]), case)
        results.put(number, "axial_load", KN * float(duty["axial_load_kN"]), case)
        pressure = duty["contact_pressure_MPa"]
        results.put(number, "contact_pressure", None if pressure is None else MPA * pressure, case)
        results.put(number, "basic_rating_life", duty["L10_Mrev"], case)
        results.put(number, "reference_rating_life", duty["L10r_Mrev"], case)
        stiffness = rotated_stiffness(np.array(duty["stiffness_matrix_N_m_rad"]), results.origins.axes[number])
        for key, row, column, unit, factor in stiffness_names(results.version):
            results.put_named(number, key, unit, factor * float(stiffness[row, column]), case)


def rotated_stiffness(stiffness: Floats, axes: Floats) -> Floats:
    """Transform a stiffness (6, 6) over x, y, z and rotations to a bearing's axes u, v, w, rows of a (3, 3)."""
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = axes
    return np.asarray(turn @ stiffness @ turn.T)


def model_suffix(choice: Choice) -> str:
    """Model settings as part of an attribute's name."""
    return "_".join(str(part) for part in (choice.variant, choice.mesh_model, choice.inertias)).replace("-", "_")


def put_modes(results: Results, modes: Mapping[Choice, xr.Dataset], unit: int) -> None:
    """Add eigenfrequencies and damping of the variants to the gear unit."""
    for choice, data in modes.items():
        moving = data["frequency"].to_numpy() > 0.0
        for key, name, sign in (("eigenfrequencies", "frequency", "Hz"), ("damping_ratios", "damping_ratio", "none")):
            values = tuple(data[name].to_numpy()[moving].tolist())
            results.put_named(unit, f"{OWN}{key}_{model_suffix(choice)}", sign, values, results.static_case)


def put_runs(results: Results, runs: Mapping[Choice, xr.Dataset]) -> None:
    """Add the maximum and mean mesh forces of runs to the stages."""
    families = {mesh.name: mesh for mesh in results.gearbox.meshes}
    numbers = {f"load_case_{case.number}": case.number for case in results.model.load_cases}
    for choice, data in runs.items():
        case = numbers.get(str(choice.load_case))
        ending = model_suffix(choice) if case is not None else f"{model_suffix(choice)}_{choice.load_case}"
        for name in data["mesh"].to_numpy().tolist():
            mesh = families[str(name)]
            stage = member_of(results.origins.pairs[mesh.pair.name], mesh.name, mesh.family)
            force = data["mesh_force"].sel(mesh=name)
            for key, value in (("mesh_force_maximum", force.max()), ("mesh_force_mean", force.mean())):
                if stage is not None and math.isfinite(float(value)):
                    results.put_named(stage, f"{OWN}{key}_{ending}", "N", float(value), case)


@dataclass(frozen=True)
class Exported(ReprMixin, line=": {named} attributes of REXS, {own} of exugear"):
    """A REXS file with results."""

    content: bytes
    """The file in unchanged format, version and encoding."""
    own: int
    """Number of attributes for which REXS has no name; they begin with ``custom_exugear_``."""
    named: int
    """Number of attributes with a REXS name."""
    replaced: tuple[str, ...]
    """Replaced results of another program."""
    left_out: tuple[str, ...]
    """Files in the results folder that do not belong to the gearbox."""


def with_results(gearbox: Gearbox, folder: Path, path: str | Path, rules: Rules | None = None) -> Exported:
    """Return the REXS file from which a gearbox was imported, with results added.

    Results of geometry and statics are always added; tables, modes, bearings and runs if the results folder contains
    them. Results at the static load are added to the load case of the file with the same torque.

    Parameters
    ----------
    gearbox : imported from the file; its values may have been edited, its names must be unchanged
    path : the REXS file, which is not changed

    Raises
    ------
    RexsError
        The file cannot be read, or describes another gearbox.
    """
    model = read_rexs(path)
    imported = to_case(model, Path(path).name, rules=rules)
    check_same_gears(gearbox, imported.gearbox)
    results = Results(gearbox, model, origins_of(imported.found), _static_load_case(gearbox, model))
    stored = ResultsForExport(gearbox, folder)
    unit = next((part.number for part in model.components_of_type("gear_unit")), next(iter(model.components)))
    results.put_named(unit, f"{OWN}program", "none", f"exugear {exugear.__version__}")
    results.put_named(unit, f"{OWN}case", "none", gearbox.name)
    for body, torque in gearbox.case.static_load.torques_N_m.items():
        results.put_named(unit, f"{OWN}static_torque_{body}", "N m", torque, results.static_case)
    put_gears(results)
    put_pairs(results)
    put_static_forces(results)
    put_tables(results, stored.tables())
    put_speeds(results)
    put_bearings(results, stored.duties())
    put_modes(results, stored.modes(), unit)
    put_runs(results, stored.runs())
    if stored.loaded is not None:
        put_displacements(results, stored.loaded)
    content = with_additions(path, results.additions)
    custom = sum(addition.name.startswith(OWN) for addition in results.additions)
    return Exported(content, custom, len(results.additions) - custom, _replaced(results), tuple(stored.left_out))


def _static_load_case(gearbox: Gearbox, model: Model) -> int | None:
    """Load case of the file whose input torque equals that of the static load."""
    body = gearbox.case.overall.input
    static = gearbox.case.static_load.torques_N_m.get(body)
    for case in model.load_cases:
        known = gearbox.load_cases.get(f"load_case_{case.number}")
        if known is not None and known.torques.get(body) == static:
            return case.number
    return None


def _replaced(results: Results) -> tuple[str, ...]:
    entries = []
    cases = {case.number: case.changes for case in results.model.load_cases}
    for addition in results.additions:
        part = results.model.components[addition.component]
        there = part.attributes
        if addition.load_case is not None:
            there = cases[addition.load_case].get(addition.component, {})
        if ATTRIBUTES.get(addition.name, addition.name) in there and not addition.name.startswith(OWN):
            entries.append(f"{part}: {addition.name}")
    return tuple(entries)
