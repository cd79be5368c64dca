"""What a REXS file holds: components with attributes, relations between them, load cases."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from exugear.exchange.rexs.faults import RexsError, plain
from exugear.exchange.rexs.synonyms import unit_factor
from fe_ste.tools.display import Displayed

LARGEST_NUMBER = 1e40
"""Numbers beyond it are no quantity of a gearbox; files write 1e23 for 'rigid'. Powers of it are still numbers."""

Value = str | bool | float | tuple["Value", ...]
"""A value as it stands in the file: texts of XML are turned into numbers when these are asked for."""


@dataclass(frozen=True)
class Attribute:
    """Value of a component with its unit; the unit is empty where the file gives none."""

    value: Value
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Component:
    """A part of the gearbox, or data on one."""

    number: int
    """Its id, unique in the file."""
    type: str
    name: str = ""
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    """By their present names."""
    asked: set[str] = field(default_factory=set, repr=False)
    """Names that were asked for so far: what nobody asks for is left out of an import, and told."""

    def __str__(self) -> str:
        """Return how messages and comments name it."""
        name = plain(self.name)
        return f"{self.type} {self.number}" + (f" '{name}'" if name else "")

    def given(self, key: str) -> bool:
        """Tell whether the file says anything under a key."""
        attribute = self._attribute(key)
        return attribute is not None and attribute.value not in ("", ())

    def quantity(self, key: str, unit: str = "none") -> float | None:
        """Finite number in a unit; None where the file gives none.

        Raises
        ------
        RexsError
            The value is no number, or its unit does not measure the same.
        """
        attribute = self._attribute(key)
        if attribute is None or not self.given(key):
            return None
        return self._number(key, attribute.value) * self._factor(key, attribute, unit)

    def whole(self, key: str) -> int | None:
        """Whole number; None where the file gives none.

        Raises
        ------
        RexsError
            The value is no whole number.
        """
        value = self.quantity(key)
        if value is not None and value != round(value):
            raise RexsError(f"{self}: {key} = {value:g} is no whole number")
        if value is None:
            return None
        return round(value)

    def has_lost_vector(self, key: str) -> bool:
        """Tell whether something stands under a key that wants three numbers, and is not."""
        value = self.attributes[key].value if key in self.attributes else None
        return value is not None and not (isinstance(value, tuple) and len(value) == 3)

    def vector(self, key: str, unit: str = "mm") -> tuple[float, float, float] | None:
        """Three numbers in a unit; None where the file gives nothing.

        Raises
        ------
        RexsError
            The value is not three numbers.
        """
        attribute = self._attribute(key)
        if attribute is None:
            return None
        if not isinstance(attribute.value, tuple) or len(attribute.value) != 3:
            raise RexsError(f"{self}: {key} is not three numbers")
        factor = self._factor(key, attribute, unit)
        u, v, w = (self._number(key, value) * factor for value in attribute.value)
        return u, v, w

    def text(self, key: str) -> str:
        """Text on one line; empty where the file gives none."""
        attribute = self._attribute(key)
        if attribute is None or isinstance(attribute.value, tuple):
            return ""
        return plain(attribute.value)

    def flag(self, key: str, number: int = 0) -> bool | None:
        """Truth value, of an array that with a number; None where the file gives none."""
        attribute = self._attribute(key)
        if attribute is None:
            return None
        value = attribute.value
        if isinstance(value, tuple):
            value = value[min(number, len(value) - 1)] if value else ""
        known = {"true": True, "1": True, "false": False, "0": False}
        return known.get(str(value).strip().lower())

    def with_attributes(self, attributes: Mapping[str, Attribute]) -> Component:
        """Return the component with some attributes replaced, as a load case does."""
        return Component(self.number, self.type, self.name, {**self.attributes, **attributes}, self.asked)

    def _attribute(self, key: str) -> Attribute | None:
        self.asked.add(key)
        return self.attributes.get(key)

    def _number(self, key: str, value: Value) -> float:
        try:
            number = math.nan if isinstance(value, bool | tuple) else float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise RexsError(f"{self}: {key} = '{plain(value)}' is no finite number")
        if abs(number) > LARGEST_NUMBER:
            raise RexsError(f"{self}: {key} = '{plain(value)}' is larger than any quantity of a gearbox")
        return number

    def _factor(self, key: str, attribute: Attribute, unit: str) -> float:
        factor = unit_factor(attribute.unit, unit)
        if factor is None:
            raise RexsError(f"{self}: {key} has the unit '{plain(attribute.unit)}'; expected {unit} or a multiple")
        return factor


@dataclass(frozen=True)
class Relation:
    """What joins components: their numbers by role."""

    type: str
    order: int
    roles: Mapping[str, int]


@dataclass(frozen=True)
class LoadCase:
    """Attributes that a load case replaces, by the number of their component."""

    number: int
    changes: Mapping[int, Mapping[str, Attribute]]


@dataclass(frozen=True)
class Model(Displayed, line=" REXS {version}: {components!n} components, {relations!n} relations"):
    """All of a REXS file."""

    version: str
    program: str
    """What wrote the file, with its version."""
    components: Mapping[int, Component]
    relations: tuple[Relation, ...]
    """Ordered ones in their order."""
    load_cases: tuple[LoadCase, ...] = ()

    def of_type(self, *types: str) -> tuple[Component, ...]:
        """Return all components of some types, in the order of the file."""
        return tuple(component for component in self.components.values() if component.type in types)

    def related(self, relation: str, role: str, number: int, wanted: str) -> tuple[Component, ...]:
        """Return the components in the role `wanted` of all relations in which a component has a role."""
        found = self._relations_by_role.get((relation, role, number), ())
        return tuple(self.components[one.roles[wanted]] for one in found if wanted in one.roles)

    def relations_of(self, *types: str) -> Iterator[Relation]:
        """Relations of some types."""
        return (relation for relation in self.relations if relation.type in types)

    @cached_property
    def _relations_by_role(self) -> dict[tuple[str, str, int], list[Relation]]:
        by_role: dict[tuple[str, str, int], list[Relation]] = {}
        for relation in sorted(self.relations, key=lambda one: one.order):
            for role, number in relation.roles.items():
                by_role.setdefault((relation.type, role, number), []).append(relation)
        return by_role
