"""Torques and speeds of a REXS file, static, by load case and over the life, and the strength of the gears."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from exugear.exchange.rexs.mapping import READ
from exugear.exchange.rexs.to_case.bodies import RigidGroup, RigidGroups
from exugear.exchange.rexs.to_case.notes import (
    Block,
    ComponentPositions,
    Entry,
    Notes,
    assumed,
    derived,
    entries_of,
    read,
    tidy,
)
from exugear.exchange.rexs.to_case.toothing import material_of
from exugear.exchange.rexs.tree import Component, Model, RexsError, RexsLoadCase
from exugear.gearbox.sections.entries import HOURS_PER_YEAR
from exugear.gearbox.units import RPM

FORCES = ("force_u_direction", "force_v_direction", "force_w_direction")
MOMENTS = ("torque_around_v_axis", "torque_around_w_axis")
UNKNOWN_TORQUE = 100.0
"""Torque if the file has no value, N m."""
SPECTRUM = "load_spectrum.csv"
"""Name of the table of life loads in the folder of the gearbox file."""
USUAL_YEARS, USUAL_VISCOSITY, USUAL_DYNAMIC_FACTOR, USUAL_ROUGHNESS, USUAL_ROOT_FACTOR, BOTH_WAYS = (
    20.0,
    220.0,
    1.2,
    4.8,
    0.95,
    0.7,
)
"""Assumptions for a life: years, viscosity at 40 degrees (mm2/s), K_v, Rz (um), Y_drelT Y_RrelT Y_X, Y_M."""
ROUGHNESS_RANGE = (0.1, 100.0)
"""Range of accepted roughness of a gear, um."""
DENSITIES = (500.0, 2000.0)
"""Range of accepted densities of an oil, kg/m3."""
TEMPERATURES = (-50.0, 250.0)
"""Range of accepted temperatures of an oil, degrees Celsius."""
TOLERANCE_CLASSES = (1, 11)
"""Flank tolerance classes of ISO 1328-1:2013."""
HARD_FLANK = 1100.0
"""Endurance limit of flanks (MPa) from which they count as case hardened if no treatment is specified (ISO 6336-5)."""
_NITRIDED = (((1e5, 1.3), (2e6, 1.0), (1e10, 0.85)), ((1e3, 1.6), (3e6, 1.0), (1e10, 0.85)))
CURVES = {
    "nitrided": _NITRIDED,
    "grey_cast": _NITRIDED,
    "through_hardened": (((1e5, 1.6), (5e7, 1.0), (1e10, 0.85)), ((1e4, 2.5), (3e6, 1.0), (1e10, 0.85))),
}
"""Life factors for contact and bending over load cycles, by words in the heat treatment; by default case hardened."""
LEAST_SHARE = 0.1
"""Speed at the start of a run-up divided by that at its end."""


@dataclass(frozen=True)
class ImportedForce:
    """Force (N) and moment (N m) on a body at an axial position, in the axes of the gearbox file."""

    part: Component
    body: str
    z: float
    """Axial position, mm."""
    force: tuple[float, ...]
    """(3,) force along x, y, z."""
    moment: tuple[float, ...]
    """(2,) moment about x, y."""


@dataclass(frozen=True)
class ImportedLoads:
    """Torques (N m) and speeds (rpm) on bodies, positive about +z."""

    name: str
    description: str
    torques: Mapping[str, float]
    speeds: Mapping[str, float]
    """Speeds by body name."""
    forces: Mapping[int, ImportedForce] = field(default_factory=dict)
    """Forces by the number of the component."""
    share: float | None = None
    """Fraction of the operating time, %; None if the file has no value."""


@dataclass(frozen=True)
class Ends:
    """Input and output bodies of the gearbox, and the reasons for their selection."""

    input: str
    output: str
    reason: str


def loads_of(model: Model, places: ComponentPositions, bodies: RigidGroups, notes: Notes) -> list[ImportedLoads]:
    """Collect the loads of each load case, or of the file itself if it has none."""
    return [_loads(model, places, bodies, case, notes) for case in model.load_cases or (None,)]


def _loads(
    model: Model, places: ComponentPositions, bodies: RigidGroups, case: RexsLoadCase | None, notes: Notes
) -> ImportedLoads:
    speeds: dict[str, float] = {}
    for shaft in model.components_in(case, "shaft"):
        body = bodies.body_of(shaft)
        speed = shaft.quantity("rotational_speed")
        if body is not None and speed is not None and not body.fixed:
            speeds.setdefault(body.name, tidy(places.sense(shaft) * speed))
    torques: dict[str, float] = {}
    forces: dict[int, ImportedForce] = {}
    for load in model.components_in(case, "external_load"):
        owner = _shaft(model, load)
        body = _free_body(bodies, owner)
        force = _point_force(places, load, owner, body, notes)
        if force is not None:
            forces[load.number] = force
        if owner is None or body is None:
            continue
        torque = load.quantity("torque_around_u_axis")
        if torque is not None:
            torque = tidy(places.sense(owner) * torque)
        elif (power := load.quantity("power")) and (speed := speeds.get(body.name)):
            torque = tidy(1e3 * power / (speed * RPM))
        if torque and load.flag("transmits_torque") is not False:
            torques[body.name] = torques.get(body.name, 0.0) + torque
    share = None
    for unit in model.components_in(case, "gear_unit"):
        share = unit.quantity("operating_time_fraction")
    name = f"load_case_{case.number}" if case else "nominal"
    return ImportedLoads(
        name, "" if share is None else f"{share:g} % of the operating time", torques, speeds, forces, share
    )


def _point_force(
    places: ComponentPositions, load: Component, shaft: Component | None, body: RigidGroup | None, notes: Notes
) -> ImportedForce | None:
    """Radial and axial force and moment of a load, in the axes of the gearbox file; None if there is none.

    A load on a planet rotates with its carrier and is omitted; the casing can carry any load.
    """
    force = np.array([load.quantity(key) or 0.0 for key in FORCES])
    moment = np.array([0.0, *(load.quantity(key) or 0.0 for key in MOMENTS)])
    if not force.any() and not moment.any():
        return None
    size = " and ".join(
        f"{np.linalg.norm(vector):g} {unit}" for vector, unit in ((force, "N"), (moment, "N m")) if vector.any()
    )
    if shaft is None or body is None:
        notes.lost.append(f"{load}: {size}; the body it acts on is fixed, is a planet, or is not imported")
        return None
    axes = places.axes(shaft)
    z = places.position(shaft)[2] + places.sense(shaft) * (load.quantity("u_coordinate_on_shaft") or 0.0)
    return ImportedForce(
        load,
        body.name,
        tidy(round(z, 9)),
        tuple(tidy(round(value, 6)) for value in (force @ axes).tolist()),
        tuple(tidy(round(value, 6)) for value in (moment @ axes).tolist()[:2]),
    )


def _shaft(model: Model, load: Component) -> Component | None:
    owners = model.related("assembly", "part", load.number, "assembly")
    return next((owner for owner in owners if owner.type in ("shaft", "side_plate", "planet_carrier")), None)


def _free_body(bodies: RigidGroups, shaft: Component | None) -> RigidGroup | None:
    """Body of a shaft unless it is fixed or a planet."""
    body = bodies.body_of(shaft) if shaft else None
    return None if body is None or body.fixed or body.carrier else body


def ends_of(model: Model, bodies: RigidGroups, loads: Sequence[ImportedLoads], links: Mapping[str, int]) -> Ends:
    """Determine input and output of the gearbox; `links` are the numbers of meshes of the rotating bodies.

    Raises
    ------
    RexsError
        The file does not define them.
    """
    turning = [body for body in bodies.members if not body.fixed and not body.carrier]
    links = {body.name: links[body.name] for body in turning if body.name in links}
    if len(links) < 2:
        raise RexsError(
            f"only {', '.join(links) or 'nothing'} can rotate, all other bodies are connected to the casing: a "
            "gearbox requires an input and an output; remove one connection with the casing"
        )
    defined = {b.name for b in turning for part in b.parts if part.flag("defines_speed") is True}
    loaded = [
        body.name
        for part in model.components_of_type("external_load")
        if part.flag("transmits_torque") is not False and (body := _free_body(bodies, _shaft(model, part))) is not None
    ]
    given = [name for load in loads for name in load.torques]
    candidates = [name for name in given if name in defined] or given or [n for n in loaded if n in defined] or loaded
    candidates = candidates or [name for name in links if name in defined] or list(links)
    first = candidates[0]
    others = [name for name in dict.fromkeys(loaded) if name != first]
    why = "bodies with an external_load; the input has the torque or defines the speed"
    if not others:
        others = [name for name, count in links.items() if count == 1 and name != first]
        why = "the file has a load on one body only; the output is the other end of the train"
    if not others:
        raise RexsError("no external_load defines the driven and loaded shafts; add one on each of them")
    return Ends(first, others[-1], why)


def static_load(loads: Sequence[ImportedLoads], ends: Ends) -> Entry:
    """Torque of the static state: the largest input torque of all load cases."""
    torques = [load.torques[ends.input] for load in loads if load.torques.get(ends.input)]
    if not torques:
        return assumed({ends.input: UNKNOWN_TORQUE}, "no torque in the file: SET IT")
    source = "torque_around_u_axis, or power over speed" + ("; the largest of the load cases" if len(loads) > 1 else "")
    return read({ends.input: max(torques, key=abs)}, source)


def force_blocks(loads: Sequence[ImportedLoads], ends: Ends, notes: Notes) -> dict[str, Block]:
    """Tables of the constant forces of the load case with the static load, which act in all load cases.

    If forces differ between load cases, this is reported.
    """
    static = max(loads, key=lambda loading: abs(loading.torques.get(ends.input, 0.0)))
    blocks = {}
    for number, point_force in static.forces.items():
        key = ", ".join((*FORCES, *MOMENTS))
        entries = {"body": Entry(point_force.body), "z_mm": read(point_force.z, "u_coordinate_on_shaft")}
        if any(point_force.force):
            entries["force_N"] = read(list(point_force.force), key)
        if any(point_force.moment):
            entries["moment_N_m"] = read(list(point_force.moment), key)
        blocks[f"load_{number}"] = Block(str(point_force.part), entries)
    for number in sorted({number for one in loads for number in one.forces}):
        found = [one.forces[number] for one in loads if number in one.forces]
        part = found[0].part
        if len(found) < len(loads) or len({(one.force, one.moment) for one in found}) > 1:
            notes.changed.append(
                f"{part}: its force differs between load cases; that of {static.name}, which has the largest torque, "
                "acts in all of them"
            )
    return blocks


def load_case_blocks(loads: Sequence[ImportedLoads], ends: Ends, static: float, ratio: float) -> dict[str, Block]:
    """Tables of the load cases, each at its speed with balanced torques, and of a run-up to the highest speed.

    Parameters
    ----------
    static : torque of the static state at the input, N m
    ratio : speed ratio output / input
    """
    blocks = {}
    fastest = 0.0
    for load in loads:
        torque = load.torques.get(ends.input) or static
        speed = _input_speed(load, ends, ratio)
        fastest = max(fastest, speed, key=abs)
        entries = {"description": Entry(load.description)} if load.description else {}
        torques = {ends.input: torque, ends.output: _rounded(-torque / ratio)}
        entries["torques_N_m"] = derived(torques, "the output balances the torques")
        if speed:
            entries["start_speed_rpm"] = read(tidy(speed), f"rotational_speed, at {ends.input}")
        entries["duration_s"] = assumed(1.0, "")
        blocks[load.name] = Block("", entries)
    if fastest:
        stiffness = tidy(max(100.0 * abs(static), 10.0))
        entries = {
            "description": Entry("the input is driven up to its speed, the output loaded"),
            "torques_N_m": derived({ends.output: _rounded(-static / ratio)}, "as in the static state"),
            "driven_body": Entry(ends.input),
            "start_speed_rpm": assumed(tidy(LEAST_SHARE * fastest), ""),
            "end_speed_rpm": derived(tidy(fastest), "the fastest of the file"),
            "drive_stiffness_N_m_per_rad": assumed(stiffness, "twist 0.01 rad under the torque of the static state"),
            "duration_s": assumed(5.0, ""),
        }
        blocks["run_up"] = Block("", entries)
    return blocks


def _input_speed(loads: ImportedLoads, ends: Ends, ratio: float) -> float:
    if ends.input in loads.speeds:
        return loads.speeds[ends.input]
    return loads.speeds.get(ends.output, 0.0) / ratio


def _rounded(torque: float) -> float:
    return float(f"{torque:.8g}") + 0.0


# -- life loads and strength ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class LifeLoads:
    """Life loads as a table, and the corresponding sections of the gearbox file."""

    spectrum: str
    """Text of the table `SPECTRUM` in the folder of the gearbox file; empty if the file has insufficient data."""
    blocks: Mapping[str, Block]
    """Sections by name."""


def life_blocks(
    model: Model, loads: Sequence[ImportedLoads], ends: Ends, ratio: float, gears: Mapping[str, tuple[Component, bool]]
) -> LifeLoads:
    """Sections on operation, loads and rating, as far as the file has the data that `life` requires.

    Parameters
    ----------
    ratio : speed ratio output / input
    gears : gears by name, and whether their teeth are loaded in reversed bending
    """
    rated = max(loads, key=lambda loading: abs(loading.torques.get(ends.input, 0.0)))
    speed = abs(_input_speed(rated, ends, ratio))
    blocks = {}
    if speed:
        source = "rotational_speed at the torque of the static state"
        blocks["operation"] = Block("", {"rated_speed_rpm": read(tidy(speed), source)})
    lubricant = _lubricant(model)
    if lubricant is not None:
        blocks["lubricant"] = lubricant
    rows = _spectrum(model, loads, ends, ratio)
    if rows is None:
        return LifeLoads("", blocks)
    body, life, lines = rows
    of_life = {"body": Entry(body), "life_years": life}
    file = read(SPECTRUM, "load_case: torque, speed and operating_time_fraction of each")
    source_block = Block("", {"file": file, "hours_per_year": assumed(HOURS_PER_YEAR, "always active")})
    blocks["loads"] = Block("", of_life, {"sources.load_spectrum": source_block})
    blocks["rating"] = _rating(model, gears)
    if lubricant is not None:
        del blocks["rating"].entries["viscosity_40_mm2_per_s"]
    return LifeLoads("torque_N_m,speed_rpm,hours\n" + "".join(lines), blocks)


def _spectrum(
    model: Model, loads: Sequence[ImportedLoads], ends: Ends, ratio: float
) -> tuple[str, Entry, list[str]] | None:
    """Return the loaded body, years, and rows of torque, speed and hours; None if the file has insufficient data."""
    body = next((end for end in (ends.input, ends.output) if all(load.torques.get(end) for load in loads)), None)
    shares = [100.0] if len(loads) == 1 else [load.share or 0.0 for load in loads]
    speeds = [_input_speed(load, ends, ratio) * (ratio if body == ends.output else 1.0) for load in loads]
    if body is None or not sum(shares) or not all(speeds):
        return None
    hours = next((h for unit in model.components_of_type("gear_unit") if (h := unit.quantity("operating_time"))), None)
    life = assumed(USUAL_YEARS, "no operating_time in the file")
    if hours:
        life = derived(_rounded(hours / HOURS_PER_YEAR), f"operating_time of {hours:g} h")
    durations = [(hours or life.value * HOURS_PER_YEAR) * share / sum(shares) for share in shares]
    lines = [
        f"{load.torques[body]!r},{tidy(speed)!r},{_rounded(duration)!r}\n"
        for load, speed, duration in zip(loads, speeds, durations, strict=True)
    ]
    return body, life, lines


def _lubricant(model: Model) -> Block | None:
    """Section on the oil if the file specifies its viscosity at both temperatures; for several oils, the thinnest."""
    cold = "viscosity_40_mm2_per_s"
    hot = "viscosity_100_mm2_per_s"
    oils = [(entries_of(READ["viscosity"], oil), oil) for oil in model.components_of_type("lubricant")]
    oils = [(stated, oil) for stated, oil in oils if len(stated) == 2 and stated[hot].value < stated[cold].value]
    if not oils:
        return None
    entries, oil = min(oils, key=lambda one: one[0][cold].value)
    entries[cold] = replace(entries[cold], source=f"{entries[cold].source} of the lubricant")
    entries |= entries_of(READ["oil density"], oil, limits=DENSITIES)
    casings = [casing for case in (None, *model.load_cases) for casing in model.components_in(case, "gear_casing")]
    temperatures = [casing.quantity("temperature_lubricant") for casing in casings]
    hottest = max((t for t in temperatures if t is not None), default=math.nan)
    if TEMPERATURES[0] <= hottest <= TEMPERATURES[1]:
        entries["temperature_C"] = read(tidy(hottest), "temperature_lubricant of the casing (hottest load case)")
    return Block("", entries)


def _rating(model: Model, gears: Mapping[str, tuple[Component, bool]]) -> Block:
    """Section on the rating: strength of gears by their materials, unless a limit is missing, and viscosity."""
    entries = {
        "dynamic_factor": assumed(
            USUAL_DYNAMIC_FACTOR, "not in the file; computed by a run or `steady`, see dynamic_factor_run"
        ),
        "viscosity_40_mm2_per_s": assumed(USUAL_VISCOSITY, "no lubricant in the file"),
    }
    stages = model.components_of_type("cylindrical_stage")
    factors = [one for stage in stages for row in READ["dynamic factors"] if (one := stage.quantity(row.attribute))]
    if factors:
        entries["dynamic_factor"] = read(tidy(max(1.0, *factors)), "the largest dynamic_factor of the stages")
    key = "viscosity_at_40_degree_celsius"
    viscosities = [one for oil in model.components_of_type("lubricant") if (one := oil.quantity(key))]
    if viscosities:
        entries["viscosity_40_mm2_per_s"] = read(tidy(min(viscosities)), f"{key} of the lubricant")
    block = Block("", entries)
    for name, (gear, both_ways) in gears.items():
        flanks = model.related("flank", "gear", gear.number, "left")
        strength = _strength(material_of(model, gear), (gear, *flanks), both_ways)
        if strength is not None:
            block.blocks[f"gears.{name}"] = strength
    return block


def _strength(material: Component | None, parts: Sequence[Component], both_ways: bool) -> Block | None:
    """Strength of a gear; None without both of its endurance limits. `parts` are the gear and its flank."""
    entries = {
        key: replace(entry, source=f"{entry.source} of {material}")
        for key, entry in entries_of(READ["strength"], material).items()
    }
    if material is None or len(entries) < len(READ["strength"]):
        return None
    entries |= _curves(material.text("heat_treated_material_type_iso_6336_2006"), entries["sigma_H_lim_MPa"].value)
    roughness = entries_of(READ["roughness"], *parts, limits=ROUGHNESS_RANGE)
    if "roughness_Ra_um" in roughness:  # unchanged priority; a file that specifies both means the same surface
        roughness.pop("roughness_Rz_um", None)
    elif "roughness_Rz_um" not in roughness:
        roughness["roughness_Rz_um"] = assumed(USUAL_ROUGHNESS, "not in the file")
    if "root_roughness_Rz_um" not in roughness:
        roughness["root_factor"] = assumed(USUAL_ROOT_FACTOR, "Y_drelT Y_RrelT Y_X, near 1 to ISO 6336-3")
    entries |= roughness
    for key in (row.attribute for row in READ["tolerance class"]):
        stated = next((one for part in parts if (one := part.whole(key)) is not None), None)
        if stated is not None and TOLERANCE_CLASSES[0] <= stated <= TOLERANCE_CLASSES[1]:
            entries.setdefault("tolerance_class", read(stated, key))
    if both_ways:
        entries["mean_stress_factor"] = assumed(BOTH_WAYS, "Y_M of ISO 6336-3, annex B, for alternating bending")
    return Block(str(material), entries)


def _curves(kind: str, flank_limit: float) -> dict[str, Entry]:
    """S-N curves of a heat treatment: ISO 6336-2:2006, table 2, and ISO 6336-3:2006, table 1."""
    source = f"heat_treated_material_type_iso_6336_2006 {kind}"
    if kind.lower() in ("", "false", "none"):
        hard = flank_limit >= HARD_FLANK
        kind = "case_hardened" if hard else "through_hardened"
        source = f"no heat treatment in the file; {flank_limit:g} MPa is for {'' if hard else 'un'}hardened flanks"
    found = next((curves for word, curves in CURVES.items() if word in kind), None)
    if found is None:
        return {"curve": assumed("case_hardened", source)}
    contact, bending = ([list(point) for point in curve] for curve in found)
    return {"contact_curve": derived(contact, source), "bending_curve": derived(bending, source)}
