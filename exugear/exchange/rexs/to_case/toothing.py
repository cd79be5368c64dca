"""Gears of a REXS file: one set of data for each gear, including flanks and tool."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from exugear.exchange.rexs.mapping import READ
from exugear.exchange.rexs.to_case.notes import Entry, Notes, assumed, entries_of, read, tidy
from exugear.exchange.rexs.tree import Component, Model, RexsError

PLAUSIBLE_TIP = (0.5, 2.0)
"""Range of tip diameter divided by reference diameter outside of which a tip diameter counts as a placeholder."""
THINNING = 0.02
"""Tooth thinning if the file has no value, in normal modules: half of a usual backlash."""
LENGTHS, PRESSURE_ANGLES, HELIX_ANGLES = (1e-3, 1e5), (1.0, 45.0), (-60.0, 60.0)
"""Possible modules and face widths (mm), pressure and helix angles (deg) of a cylindrical gear."""
EQUAL = 1e-6
"""Largest difference of equal values on flanks or planets."""
LEAST_RADIUS = 0.2
"""Minimum corner radius of a tool that the tooth model supports in all cases, in normal modules."""
USUAL_PROTUBERANCE_ANGLE = 10.0
"""Angle of a protuberance if the file has no value, deg."""
RIGID_MODULUS = 1e6
"""Young's modulus (MPa) above which a material represents a rigid body; real materials are below."""


@dataclass(frozen=True)
class Tool:
    """A tool of a gear in the order of manufacture; lengths in normal modules."""

    part: Component
    depth: float
    """Distance from its reference line to its tip: the dedendum of a gear whose root it cuts."""
    tip_radius: float
    protuberance: float
    """Protuberance amount: distance between the flank and a parallel line that touches the tip rounding; 0 for none."""
    protuberance_angle: float
    """Pressure angle of the protuberance, rad."""
    allowance: float
    """Machining allowance that it leaves on each flank for the following tools, normal to the flank."""


@dataclass(frozen=True)
class Toothing:
    """A gear in the units and signs of the gearbox file: mm, deg; the shift of a larger ring gear is positive."""

    part: Component
    teeth: int
    module: Entry
    pressure_angle: Entry
    helix_angle: Entry
    face_width: Entry
    shift: Entry | None
    """Profile shift; None if the file has no value, so that it follows from the centre distance."""
    tip: Entry | None
    root: Entry | None
    """Tip and root diameter, if specified."""
    dedendum: Entry
    tip_radius: Entry
    thinning: Entry
    allowances: Entry | None
    """Allowances of the tooth thickness, if specified; `thinning` is then their mean."""
    cutter: Entry | None
    """Cutter of a ring gear, as far as it is specified."""
    chamfer: float
    """Radial height of the tip chamfer, mm."""
    root_form: Entry | None
    """Root form diameter, if specified."""
    tools: tuple[Tool, ...]
    """Racks that generate an external gear, in the order of manufacture."""
    internal: bool

    @property
    def signed_shift(self) -> float | None:
        """Profile shift as it counts in the sum of a pair, negative for a larger ring gear; None if unspecified."""
        if self.shift is None:
            return None
        return float(-self.shift.value if self.internal else self.shift.value)


def toothing_of(model: Model, gear: Component, mates: Sequence[Component], notes: Notes) -> Toothing:
    """Collect the data of a gear; `mates` are its mating gears.

    Raises
    ------
    RexsError
        A value is missing, or left and right flanks differ.
    """
    internal = gear.type == "ring_gear"
    module = _required(gear, "normal_module", LENGTHS)
    flank = _flank(model, gear)
    steps = _steps(model, gear)
    # The tool with the largest depth generates the root; that of a ring gear is its cutter.
    tools = [tool for tool, _ in steps]
    if internal:
        tools = [tool for tool in tools if tool.type == "cutter_wheel_tool"] or tools
    tool = max(tools, key=lambda tool: tool.quantity("addendum_coefficient_reference_profile") or 0.0, default=None)
    angle = _pressure_angle(gear, flank)
    helix = _helix_angle(gear, mates)
    allowances = _allowances(gear, math.radians(angle.value), math.radians(helix.value), internal)
    teeth = abs(gear.whole("number_of_teeth") or 0)
    if not teeth:
        raise RexsError(f"{gear}: number_of_teeth is missing")
    return Toothing(
        part=gear,
        teeth=teeth,
        module=module,
        pressure_angle=angle,
        helix_angle=helix,
        face_width=_required(gear, "face_width", LENGTHS),
        shift=_shift(flank, internal),
        tip=_tip(gear, teeth * module.value, notes),
        root=_diameter(gear, "root_diameter"),
        dedendum=_tool_factor(tool, internal, "addendum_coefficient_reference_profile", 1.25),
        tip_radius=_rounded(_tool_factor(tool, internal, "tip_corner_radius_factor_reference_profile", 0.38)),
        thinning=_thinning(gear, module.value, allowances, math.radians(helix.value)),
        allowances=allowances,
        cutter=_cutter(gear, tool, module.value) if internal else None,
        chamfer=_chamfer(gear, flank),
        root_form=_diameter(gear, "root_form_diameter"),
        tools=() if internal else tuple(_racks(steps, module.value)),
        internal=internal,
    )


def _required(part: Component, key: str, limits: tuple[float, float]) -> Entry:
    """Return a required value, which must be possible for a gear."""
    value = part.required(key)
    if not limits[0] <= value <= limits[1]:
        raise RexsError(f"{part}: {key} = {value:g} is impossible; expected {limits[0]:g} to {limits[1]:g}")
    return read(tidy(value), key)


def _chamfer(gear: Component, flank: Component | None) -> float:
    """Height of the tip chamfer, mm: specified, or from the tip form diameter."""
    stated = (flank.quantity("tooth_tip_chamfer") if flank else None) or 0.0
    tip = gear.quantity("tip_diameter")
    form = gear.quantity("tip_form_diameter")
    if stated or not tip or not form:
        return tidy(stated)
    return tidy(max(0.0, round(0.5 * (abs(tip) - abs(form)) * (-1.0 if gear.type == "ring_gear" else 1.0), 9)))


def _flank(model: Model, gear: Component) -> Component | None:
    """Left flank of a gear, which must equal the right one."""
    left, right = (model.related("flank", "gear", gear.number, side) for side in ("left", "right"))
    if not left or not right:
        return (left or right or (None,))[0]
    for key in (row.attribute for row in READ["flank"]):
        quantity = left[0].quantity(key)
        other = right[0].quantity(key)
        if quantity != other and (quantity is None or other is None or abs(quantity - other) > EQUAL):
            raise RexsError(
                f"{gear}: left and right flank differ in {key} ({quantity} and {other}); "
                "only equal flanks can be imported"
            )
    return left[0]


def _steps(model: Model, gear: Component) -> list[tuple[Component, Component | None]]:
    """Tools of a gear in order with their settings, from manufacturing steps (1.3 and later) or from references.

    They may belong to a flank instead of the gear.
    """
    for part in (gear, *model.related("flank", "gear", gear.number, "left")):
        relations = [
            relation
            for relation in model.relations_of("manufacturing_step")
            if relation.roles.get("workpiece") == part.number
        ]
        steps: list[tuple[Component, Component | None]] = []
        for relation in sorted(relations, key=lambda relation: relation.order):
            settings = model.components.get(relation.roles.get("manufacturing_settings", -1))
            if relation.roles.get("tool") in model.components:
                steps.append((model.components[relation.roles["tool"]], settings))
        for kind in ("ordered_reference", "reference"):
            steps = steps or [(tool, None) for tool in model.related(kind, "origin", part.number, "referenced")]
        steps = [step for step in steps if step[0].type in ("rack_shaped_tool", "cutter_wheel_tool")]
        if steps:
            return steps
    return []


def _racks(steps: Sequence[tuple[Component, Component | None]], module: float) -> Iterator[Tool]:
    """Yield the racks of known depth among the tools of an external gear."""
    for tool, settings in steps:
        depth = tool.quantity("addendum_coefficient_reference_profile")
        if tool.type != "rack_shaped_tool" or not depth or depth < 0.0:
            continue
        amount = (tool.quantity("protuberance_amount") or 0.0) / module
        allowance = settings.quantity("machining_allowance") if settings else None
        yield Tool(
            part=tool,
            depth=depth,
            tip_radius=max(tool.quantity("tip_corner_radius_factor_reference_profile") or 0.0, 0.0),
            protuberance=amount or tool.quantity("protuberance_amount_factor") or 0.0,
            protuberance_angle=math.radians(tool.quantity("protuberance_angle") or USUAL_PROTUBERANCE_ANGLE),
            allowance=(allowance or 0.0) / module,
        )


def _pressure_angle(gear: Component, flank: Component | None) -> Entry:
    key = "normal_pressure_angle"
    for part in (flank, gear):
        if part is not None and part.quantity(key) is not None:
            return replace(_required(part, key, PRESSURE_ANGLES), source=f"{key} of the flank")
    return assumed(20.0, "not in the file")


def _helix_angle(gear: Component, mates: Sequence[Component]) -> Entry:
    """Helix angle, right hand positive; for a ring gear from its mating gears, since programs differ in its sign."""
    key = "helix_angle_reference_diameter"
    if gear.type == "ring_gear" and mates:
        angle = _required(mates[0], key, HELIX_ANGLES)
        return replace(angle, source=f"{key}, with the hand of {mates[0]}, as internal pairs have")
    return _required(gear, key, HELIX_ANGLES)


def _shift(flank: Component | None, internal: bool) -> Entry | None:
    value = flank.quantity("addendum_modification_coefficient") if flank else None
    if value is None:
        return None
    source = "addendum_modification_coefficient of the flanks"
    return read(tidy(-value if internal else value), source + (", positive for a larger ring" if internal else ""))


def _diameter(gear: Component, key: str) -> Entry | None:
    value = gear.quantity(key)
    return read(tidy(abs(value)), key) if value else None


def _tip(gear: Component, reference: float, notes: Notes) -> Entry | None:
    """Tip diameter, unless it is a placeholder; `reference` is teeth times normal module, mm."""
    tip = _diameter(gear, "tip_diameter")
    if tip is None or PLAUSIBLE_TIP[0] <= tip.value / reference <= PLAUSIBLE_TIP[1]:
        return tip
    notes.changed.append(f"{gear}: tip_diameter of {tip.value:g} mm is implausible, replaced by the value of the rack")
    return None


def _cutter(gear: Component, tool: Component | None, module: float) -> Entry | None:
    """Cutter of a ring gear; its tip is used if the file specifies no root diameter of the ring gear."""
    teeth = tool.whole("number_of_teeth") if tool else None
    if tool is None or tool.type != "cutter_wheel_tool" or not teeth:
        return None
    radius = tool.quantity("tip_corner_radius_cutter")
    factor = tool.quantity("tip_corner_radius_factor_reference_profile") if radius is None else radius / module
    rounded = _rounded(assumed(LEAST_RADIUS, "none given") if factor is None else read(tidy(factor), ""))
    shift = tool.quantity("addendum_modification_coefficient")
    cutter = {"teeth": abs(teeth), "tip_radius": rounded.value, "profile_shift": tidy(shift or 0.0)}
    tip = tool.quantity("tip_diameter")
    addendum = tool.quantity("addendum_coefficient_reference_profile")
    if not gear.quantity("root_diameter"):
        if tip:
            cutter["tip_diameter_mm"] = tidy(abs(tip))
        elif addendum:
            cutter["addendum"] = tidy(addendum)
    said = [f"tip radius: {' '.join(rounded.comment.split())}"] if rounded.kind else []
    said += ["profile shift: A not in the file"] if shift is None else []
    return read(cutter, "; ".join([f"number_of_teeth, tip and its radius of {tool}", *said]))


def _tool_factor(tool: Component | None, internal: bool, key: str, usual: float) -> Entry:
    """Rack factor of the tool that generates the root; an assumption for an internal gear, which has no rack."""
    value = tool.quantity(key) if tool else None
    if tool is None or value is None or value < 0.0:
        return assumed(usual, "no tool in the file")
    if internal:
        return assumed(tidy(value), f"{key} of {tool}, for an arc as fillet without cutter data")
    return read(tidy(value), f"{key} of {tool}")


def _rounded(radius: Entry) -> Entry:
    """Return the corner radius of the tool; a sharp corner gets a radius, because the tooth model requires a fillet."""
    if radius.value >= LEAST_RADIUS:
        return radius
    return assumed(LEAST_RADIUS, f"{radius.value:g} in the file, too small a radius for the tooth model")


def _allowances(gear: Component, angle: float, helix: float, internal: bool) -> Entry | None:
    """Return the tooth thickness allowances in the normal section, um, from a thickness or the base tangent length.

    DIN 3967: A_sn = A_st cos(beta), and A_W = A_sn cos(alpha_n) for external gears; chords and arcs differ by less than
    a part in a thousand. `angle` and `helix` in rad. None if they are not specified, or would thicken the teeth.
    """
    sources = {
        "chordal_tooth_thickness_{}_deviation": 1.0,
        "chordal_transverse_tooth_thickness_{}_deviation": math.cos(helix),
        "{}_backlash_allowance_referenced_to_span": 1.0 / math.cos(angle),
    }
    for key, factor in list(sources.items())[: 2 if internal else 3]:
        upper, lower = (gear.quantity(key.format(end)) for end in ("upper", "lower"))
        if upper is not None and lower is not None and lower <= upper <= 0.0:
            ends = {"upper": upper, "lower": lower}
            table = {f"{end}_allowance_um": tidy(round(1e3 * factor * allowance, 6)) for end, allowance in ends.items()}
            return read(table, key.format("upper and lower"))
    return None


def _thinning(gear: Component, module: float, allowances: Entry | None, helix: float) -> Entry:
    """Tooth thinning in the transverse section, mm."""
    if allowances is not None:
        mean = 0.5e-3 * sum(allowances.value.values())
        return read(tidy(-mean / math.cos(helix)), "mean of the tooth thickness allowances")
    series = gear.text("tooth_thickness_deviation_tolerance_series_din_3967_1978")
    why = f"only the tolerance {series} in the file" if series not in ("", "False") else "not in the file"
    return assumed(tidy(round(THINNING * module, 6)), f"{THINNING:g} normal modules; {why}")


def material_of(model: Model, part: Component) -> Component | None:
    """Material that a component refers to."""
    found = model.related("reference", "origin", part.number, "referenced")
    return next((component for component in found if component.type == "material"), None)


def is_rigid(material: Component | None) -> bool:
    """Return whether a material represents a rigid body."""
    modulus = material.quantity("elastic_modulus") if material else None
    return modulus is not None and modulus > RIGID_MODULUS


def material_table(material: Component | None) -> Entry | None:
    """Inline table of a material with its specified values; None if it represents a rigid body."""
    if material is None or is_rigid(material):
        return None
    values = {key: entry.value for key, entry in entries_of(READ["material"], material, zeros=True).items()}
    return read(values, str(material)) if values else None
