"""Results on gears and stages: what their geometry gives, their static load, and their transmission error tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from exugear.exchange.rexs.export.names import Results
from exugear.exchange.rexs.export.origins import Origins
from exugear.exchange.rexs.faults import RexsError
from exugear.exchange.rexs.tree import Model
from exugear.gearbox.gearbox import Gearbox
from fe_ste.geometry.gears import Gear, GearPair
from fe_ste.transmission_error.face_load import face_load_factor, load_along_face
from fe_ste.transmission_error.table import MeshTable

EQUAL = 1e-9
"""Largest relative difference of numbers that are the same in both files."""


@dataclass(frozen=True)
class Target:
    """Where results go: the model that was read, its parts, and the load case of the static load (None: the model)."""

    model: Model
    origins: Origins
    load_case: int | None


def check_same_gears(gearbox: Gearbox, imported: Gearbox) -> None:
    """Refuse a REXS file of another gearbox; numbers that may have been edited are no matter here.

    Raises
    ------
    RexsError
        Gears or pairs of the case that the file does not have, or that differ in what makes a gear that gear.
    """
    faults = []
    for kind, own, others in (("gears", gearbox.gears, imported.gears), ("pairs", gearbox.pairs, imported.pairs)):
        missing = [name for name in own if name not in others]
        if missing:
            faults.append(
                f"{gearbox.source}: {kind} {', '.join(missing)} do not come from this file, whose {kind} are imported "
                f"as {', '.join(others)}; keep the names of the import"
            )
    for name in gearbox.gears.keys() & imported.gears.keys():
        gear = gearbox.gears[name]
        other = imported.gears[name]
        for key in ("teeth", "normal_module", "internal"):
            if not math.isclose(getattr(gear, key), getattr(other, key), rel_tol=EQUAL):
                faults.append(
                    f"{gearbox.source}: gears.{name} has {key} = {getattr(gear, key):g}, in this file it is "
                    f"{getattr(other, key):g}: results of another gear do not belong into it"
                )
    if faults:
        raise RexsError(*faults)


def put_gears(results: Results, gearbox: Gearbox, target: Target) -> None:
    """Put diameters of gears, and inputs of the case that are not those of the file."""
    for name, gear in gearbox.gears.items():
        for number in target.origins.gears[name]:
            results.put(number, "reference_diameter", "mm", 2e3 * gear.reference_radius)
            results.put(number, "base_diameter", "mm", 2e3 * gear.base_radius)
            if gear.helix_angle:
                results.put(
                    number, "axial_pitch", "mm", 1e3 * math.pi * gear.normal_module / abs(math.sin(gear.helix_angle))
                )
            normal = gear.normal_tooth_thickness
            results.put(number, "normal_tooth_thickness", "mm", 1e3 * normal)
            results.put(number, "transverse_tooth_thickness", "mm", 1e3 * normal / math.cos(gear.helix_angle))
            results.put(number, "normal_tooth_thickness_at_tip_diameter", "mm", 1e3 * gear.tip_thickness)
            part = target.model.components[number]
            for key, radius in (("root_form_diameter", gear.form_radius), ("tip_diameter", gear.tip_radius)):
                stated = part.quantity(key, "mm")
                if stated is None and key == "root_form_diameter":
                    results.put(number, key, "mm", 2e3 * radius)
                elif stated is None or not math.isclose(abs(stated), 2e3 * radius, rel_tol=EQUAL):
                    results.put_own(number, key, "mm", 2e3 * radius)  # the file's own is an input and stays
            for key, unit, value in _inputs(gear):
                results.put_own(number, key, unit, value)


def _inputs(gear: Gear) -> tuple[tuple[str, str, float], ...]:
    """Return inputs that a REXS file leaves to assumptions, or that an import may have to replace."""
    return (
        ("profile_shift", "none", gear.profile_shift),
        ("tooth_thinning", "mm", 1e3 * gear.tooth_thinning),
        ("root_diameter", "mm", 2e3 * gear.root_radius),
        ("tool_tip_radius", "none", gear.rack.tip_radius),
    )


def put_pairs(results: Results, gearbox: Gearbox, target: Target) -> None:
    """Put relations of pairs: contact ratios, working circles, clearances."""
    for name, spec in gearbox.pairs.items():
        pair = spec.pair
        for stage in target.origins.pairs[name]:
            results.put(stage, "gear_ratio", "none", pair.ratio)
            results.put(stage, "transverse_contact_ratio", "none", pair.transverse_contact_ratio)
            if pair.overlap_ratio > 0.0:  # REXS has none of zero
                results.put(stage, "overlap_ratio", "none", pair.overlap_ratio)
            results.put(stage, "total_contact_ratio", "none", pair.total_contact_ratio)
            length = pair.path_end - pair.path_start
            results.put(stage, "length_of_path_of_contact", "mm", 1e3 * length)
            results.put_own(stage, "transverse_backlash", "mm", 1e3 * pair.circumferential_backlash)
            for gear, clearance, ends in (
                (pair.pinion, pair.pinion_tip_clearance, _active(pair, pair.pinion)),
                (pair.gear, pair.gear_tip_clearance, _active(pair, pair.gear)),
            ):
                data = _gear_data(target, stage, gear)
                if data is None:
                    continue
                results.put(data, "pitch_diameter", "mm", 2e3 * pair.working_radius(gear))
                results.put(data, "working_pressure_angle", "deg", math.degrees(pair.working_pressure_angle))
                results.put(data, "active_root_diameter", "mm", 2e3 * ends[0])
                results.put(data, "active_tip_diameter", "mm", 2e3 * ends[1])
                results.put(data, "tip_clearance", "mm", 1e3 * clearance)


def _active(pair: GearPair, gear: Gear) -> tuple[float, float]:
    """Radii at root and tip between which a gear touches its mate, m."""
    rolls = [pair.path_start, pair.path_end]
    if gear is pair.gear:
        tangent = pair.base_tangent_length
        rolls = [roll + tangent if gear.internal else tangent - roll for roll in rolls]
    low, high = sorted(math.hypot(gear.base_radius, roll) for roll in rolls)
    if gear.internal:
        return (high, low)
    return (low, high)


def _gear_data(target: Target, stage: int, gear: Gear) -> int | None:
    """Component that holds data of a gear in a stage."""
    numbers = target.origins.gears[gear.name]
    for relation in target.model.relations_of("stage_gear_data"):
        if relation.roles.get("stage") == stage and relation.roles.get("gear") in numbers:
            return relation.roles.get("stage_gear_data")
    return None


def put_static_forces(results: Results, gearbox: Gearbox, target: Target) -> None:
    """Put the forces that the static load asks of the meshes; equal planets share it evenly."""
    for mesh, force in gearbox.train.static_mesh_forces().items():
        one = next(each for each in gearbox.meshes if each.name == mesh)
        numbers = target.origins.pairs[one.pair.name]
        instance = instance_of(mesh, one.family)
        stage = numbers[instance] if instance < len(numbers) else None
        if stage is not None:
            results.put(stage, "tangential_force_at_base_circle", "N", abs(force), target.load_case)


def instance_of(name: str, family: str) -> int:
    """Return the number of a planet, from 0, in the name of what it carries.

    Examples
    --------
    >>> instance_of("sun_planet_3", "sun_planet"), instance_of("stage_1", "stage_1")
    (2, 0)
    """
    number = name.removeprefix(family).removeprefix("_")
    if number.isdigit():
        return int(number) - 1
    return 0


def put_tables(results: Results, gearbox: Gearbox, tables: Mapping[str, MeshTable], target: Target) -> None:
    """Put transmission error, mesh stiffness and load along the face of the static state."""
    for name, table in tables.items():
        data = table.static_state
        pair = gearbox.pairs[name].pair
        case = target.load_case
        positions = tuple(data["pmc"].to_numpy().tolist())
        for stage in target.origins.pairs[name]:
            series = {
                "transmission_error": ("mum", 1e6 * data["ste"]),
                "mesh_stiffness": ("N / mm", 1e-3 * data["mesh_stiffness"]),
            }
            for key, (unit, values) in series.items():
                if bool(values.isnull().any()):
                    continue  # REXS has no sign for a value that is missing
                results.put(stage, key, unit, tuple(values.to_numpy().tolist()), case)
            error = data["ste"]
            results.put_own(stage, "mesh_cycle_positions", "none", positions, case)
            results.put_own(
                stage, "transmission_error_peak_to_peak", "mum", float(1e6 * (error.max() - error.min())), case
            )
            results.put_own(stage, "mean_mesh_stiffness", "N / mm", float(1e-3 * data["mesh_stiffness"].mean()), case)
            results.put_own(stage, "contact_pressure_maximum", "MPa", float(1e-6 * data["max_pressure"].max()), case)
            results.put(stage, "face_load_factor", "none", float(face_load_factor(data)), case)
            along = load_along_face(data)
            places = tuple((1e3 * along["axial_position"]).to_numpy().tolist())
            results.put_own(stage, "load_along_face", "N / mm", tuple((1e-3 * along).to_numpy().tolist()), case)
            results.put_own(stage, "load_along_face_positions_from_middle", "mm", places, case)
            for gear in (pair.pinion, pair.gear):
                place = _gear_data(target, stage, gear)
                if place is not None:
                    turned = tuple(360.0 / gear.teeth * position for position in positions)
                    results.put(place, "mesh_positions", "deg", turned, case)
