"""REXS files of our own making: small gearboxes, each with one thing that files of other programs have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from xml.sax.saxutils import escape, quoteattr

from exugear.exchange.rexs.parsing import parse_model
from exugear.exchange.rexs.tree import Model

UNITS = {
    "density_at_15_degree_celsius": "kg / dm^3",
    "temperature_lubricant": "C",
    "support_vector": "mm",
    "u_axis_vector": "none",
    "w_axis_vector": "none",
    "normal_module": "mm",
    "face_width": "mm",
    "center_distance": "mm",
    "length": "mm",
    "width": "mm",
    "normal_pressure_angle": "deg",
    "helix_angle_reference_diameter": "deg",
    "pressure_angle": "deg",
    "radial_stiffness": "N / m",
    "axial_stiffness": "N / m",
    "bending_stiffness": "N mm / rad",
    "rotational_stiffness": "N mm / rad",
    "rotational_speed": "1 / min",
    "torque_around_u_axis": "N m",
    "operating_time_fraction": "%",
    "radial_dynamic_load_rating": "kN",
    "radial_static_load_rating": "kN",
    "axial_dynamic_load_rating": "kN",
    "axial_static_load_rating": "kN",
    "fatigue_limit_load": "kN",
    "u_coordinate_on_shaft": "mm",
    "endurance_limit_flank": "N / mm^2",
    "endurance_limit_root": "N / mm^2",
    "viscosity_at_40_degree_celsius": "mm^2 / s",
    "viscosity_at_100_degree_celsius": "mm^2 / s",
    "averaged_peak_to_valley_height_root": "mm",
    "operating_time": "h",
    "elastic_modulus": "N / mm^2",
    "density": "kg / dm^3",
    "tip_radius_factor": "none",
    "force_u_direction": "N",
    "force_v_direction": "N",
    "force_w_direction": "N",
    "torque_around_v_axis": "N m",
    "torque_around_w_axis": "N m",
    "machining_allowance": "mm",
    "protuberance_amount": "mm",
    "protuberance_angle": "deg",
}
"""Units of attributes; others are lengths where their name says so."""
LENGTHS = ("diameter", "radius", "distance", "clearance", "length", "width")


class OwnFile:
    """A REXS file as it grows: components, relations between them, load cases."""

    def __init__(self, version: str = "1.6") -> None:
        self.version = version
        self._components: list[tuple[int, str, str, dict[str, object]]] = []
        self._relations: list[tuple[str, int | None, Mapping[str, int]]] = []
        self._cases: list[Mapping[int, Mapping[str, object]]] = []
        self.unit = self.add("gear_unit", "unit")
        self.casing = self.add("gear_casing", "casing")
        self.steel = self.add("material", "steel", elastic_modulus=206000.0, poisson_ratio=0.3, density=7.85)

    def add(self, kind: str, name: str = "", **attributes: object) -> int:
        number = len(self._components) + 1
        self._components.append((number, kind, name, {k: v for k, v in attributes.items() if v is not None}))
        return number

    def give(self, number: int, **attributes: object) -> None:
        self._components[number - 1][3].update(attributes)

    def relate(self, kind: str, order: int | None = None, **roles: int) -> None:
        self._relations.append((kind, order, roles))

    def load_case(self, changes: Mapping[int, Mapping[str, object]]) -> None:
        self._cases.append(changes)

    def shaft(
        self, at: Sequence[float], sections: Iterable[Sequence[float]], name: str = "", speed: float | None = None
    ) -> int:
        """Shaft whose left end stands at (u, v, w), of sections (start, length, outer, inner), mm."""
        shaft = self.add("shaft", name, support_vector=tuple(at), rotational_speed=speed)
        self.relate("reference", origin=shaft, referenced=self.steel)
        for start, length, outer, *inner in sections:
            keys = {"outer_diameter_begin": outer, "outer_diameter_end": outer}
            keys |= {"inner_diameter_begin": inner[0], "inner_diameter_end": inner[0]} if inner else {}
            section = self.add("shaft_section", u_coordinate_on_shaft=start, length=length, **keys)
            self.relate("assembly", assembly=shaft, part=section)
        return shaft

    def gear(self, shaft: int, at: Sequence[float], teeth: int, module: float, **given: object) -> int:
        """Gear on a shaft, its middle at (u, v, w); a shift of None is not given."""
        values = {"face_width": 20.0, "helix_angle_reference_diameter": 0.0, "ring": False, "shift": 0.0} | given
        ring, shift, angle = values.pop("ring"), values.pop("shift"), values.pop("angle", 20.0)
        kind = "ring_gear" if ring else "cylindrical_gear"
        gear = self.add(kind, support_vector=tuple(at), number_of_teeth=teeth, normal_module=module, **values)
        flanks = [
            self.add("cylindrical_gear_flank", addendum_modification_coefficient=shift, normal_pressure_angle=angle)
            for _ in range(2)
        ]
        self.relate("flank", gear=gear, left=flanks[0], right=flanks[1])
        self.relate("assembly", assembly=shaft, part=gear)
        self.relate("reference", origin=gear, referenced=self.steel)
        return gear

    def stage(self, first: int, second: int, distance: float | None = None, **given: object) -> int:
        stage = self.add("cylindrical_stage", center_distance=distance, **given)
        self.relate("stage", stage=stage, gear_1=first, gear_2=second)
        return stage

    def stiff_bearing(self, shaft: int, at: Sequence[float], on: int | None = None, **given: object) -> int:
        values = {"radial_stiffness": 1e9, "axial_stiffness": 1e9, "axial_force_absorption": "both_directions"} | given
        bearing = self.add("concept_bearing", support_vector=tuple(at), **values)
        self.relate("side", assembly=bearing, inner_part=shaft, outer_part=on or self.casing)
        return bearing

    def rolling_bearing(
        self,
        shaft: int,
        at: Sequence[float],
        rows: Iterable[tuple[Mapping[str, object], Mapping[str, object]]] = (),
        on: int | None = None,
        **given: object,
    ) -> int:
        """Bearing with rows: attributes of each row, and of its rolling elements."""
        bearing = self.add("rolling_bearing_with_catalog_geometry", support_vector=tuple(at), **given)
        self.relate("side", assembly=bearing, inner_part=shaft, outer_part=on or self.casing)
        for order, (of_row, of_element) in enumerate(rows, 1):
            row = self.add("rolling_bearing_row", **of_row)
            self.relate("ordered_assembly", order, assembly=bearing, part=row)
            if of_element:
                element = self.add("rolling_element", **of_element)
                self.relate("assembly", assembly=row, part=element)
        return bearing

    def coupling(self, inner: int, outer: int, at: Sequence[float], **given: object) -> int:
        coupling = self.add("coupling", support_vector=tuple(at), **given)
        self.relate("side", assembly=coupling, inner_part=inner, outer_part=outer)
        return coupling

    def load(self, shaft: int, torque: float | None, **given: object) -> int:
        load = self.add("external_load", torque_around_u_axis=torque, u_coordinate_on_shaft=0.0, **given)
        self.relate("assembly", assembly=shaft, part=load)
        return load

    def text(self, prefix: str = "") -> str:
        """XML of the file; with a prefix all its elements have it."""
        p = f"{prefix}:" if prefix else ""
        space = f' xmlns:{prefix}="https://rexs.info"' if prefix else ""
        lines = ['<?xml version="1.0" encoding="UTF-8"?>']
        lines += [f'<{p}model{space} version="{self.version}" applicationId="own" applicationVersion="1">']
        lines += [f" <{p}relations>"]
        for number, (kind, order, roles) in enumerate(self._relations, 1):
            place = "" if order is None else f' order="{order}"'
            lines += [f'  <{p}relation id="{number}" type="{kind}"{place}>']
            lines += [f'   <{p}ref id="{one}" role="{role}"/>' for role, one in roles.items()]
            lines += [f"  </{p}relation>"]
        lines += [f" </{p}relations>", f" <{p}components>"]
        for number, kind, name, attributes in self._components:
            head = f'<{p}component id="{number}" type="{kind}" name={quoteattr(name)}>'
            lines += [f"  {head}", *self._attributes(attributes, p), f"  </{p}component>"]
        lines += [f" </{p}components>"]
        lines += [f' <{p}load_spectrum id="1">'] if self._cases else []
        for number, case in enumerate(self._cases, 1):
            lines += [f'  <{p}load_case id="{number}">']
            for part, changes in case.items():
                kind = self._components[part - 1][1]
                head = f'<{p}component id="{part}" type="{kind}">'
                lines += [f"   {head}", *self._attributes(changes, p), f"   </{p}component>"]
            lines += [f"  </{p}load_case>"]
        lines += [f" </{p}load_spectrum>"] if self._cases else []
        return "\n".join([*lines, f"</{p}model>", ""])

    def _attributes(self, attributes: Mapping[str, object], p: str) -> Iterable[str]:
        for key, value in attributes.items():
            unit = UNITS.get(key) or ("mm" if any(word in key for word in LENGTHS) else "none")
            if isinstance(value, tuple):
                inside = f"<{p}array>{''.join(f'<{p}c>{one}</{p}c>' for one in value)}</{p}array>"
            else:
                inside = escape(str(value).lower() if isinstance(value, bool) else str(value))
            yield f'   <{p}attribute id="{key}" unit="{unit}">{inside}</{p}attribute>'

    def model(self) -> Model:
        return parse_model(self.text().encode())


def spur_pair(version: str = "1.6", torque: float = 100.0, **gears: object) -> tuple[OwnFile, list[int]]:
    """Two shafts of 100 mm on two bearings each at 10 and 90, gears of 20 and 40 teeth at 40, m_n 3; their numbers."""
    file = OwnFile(version)
    shafts = []
    for teeth, v, speed in ((20, 0.0, 1500.0), (40, 90.0, -750.0)):
        shaft = file.shaft((0.0, v, 0.0), [(0.0, 100.0, 30.0)], speed=speed)
        for u in (10.0, 90.0):
            file.stiff_bearing(shaft, (u, v, 0.0))
        shafts.append(shaft)
        gear = file.gear(shaft, (40.0, v, 0.0), teeth, 3.0, **gears)
        file.load(shaft, torque if teeth == 20 else None)
        if teeth == 20:
            pinion = gear
    file.stage(pinion, gear, 90.0)
    return file, shafts
