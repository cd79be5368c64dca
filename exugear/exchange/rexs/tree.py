"""Content of a REXS file: components with attributes, relations between them, load cases."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

from exugear.exchange.rexs.mapping import UNITS
from exugear.gearbox.reading import ListedErrors
from exugear.gearbox.units import unit_of
from fe_ste.tools.display import ReprMixin


def unit_factor(unit: str, wanted: str) -> float | None:
    """Factor from a unit to a wanted one; None if the quantities differ or the unit is unknown.

    An empty unit counts as the wanted one, because some programs omit it.

    Examples
    --------
    >>> unit_factor("mum", "mm"), unit_factor("", "mm"), unit_factor("furlong", "mm")
    (0.001, 1.0, None)
    """
    source = unit_of(unit)
    target = unit_of(wanted)
    assert target is not None
    if source is None or source.quantity not in ("number", target.quantity):
        return None
    if source.quantity == "number" or unit == wanted:
        return 1.0
    return float(f"{source.factor / target.factor:.15g}")


# Errors of a REXS file: one clear sentence each, reported together

LONGEST_TEXT = 80
"""Maximum number of characters of a file's text in a message or comment."""


class RexsError(ListedErrors):
    """A REXS file that cannot be read or imported; the message has one sentence per error."""

    shown = 20


class Errors(list[str]):
    """Errors collected over several attempts."""

    @contextmanager
    def gathered(self) -> Iterator[None]:
        """Collect the errors that end the code inside the context."""
        try:
            yield
        except RexsError as error:
            self.extend(error.errors)

    def tell(self) -> None:
        """Raise the collected errors, if any.

        Raises
        ------
        RexsError
            There are errors; the exception holds all of them.
        """
        if self:
            raise RexsError(*self)


def plain(text: object, longest: int = LONGEST_TEXT) -> str:
    r"""Text of a file for messages and comments: one line, printable, of limited length.

    Examples
    --------
    >>> plain("Planetenrad\n [54]\x07"), plain("x" * 20, 10)
    ('Planetenrad [54]', 'xxxxxxxxx…')
    """
    words = "".join(sign if sign.isprintable() else " " for sign in str(text)[: 4 * longest]).split()
    line = " ".join(words).encode("utf-8", errors="replace").decode("utf-8")
    return line if len(line) <= longest else f"{line[: longest - 1]}…"


LARGEST_NUMBER = 1e40
"""Limit of numbers that represent physical quantities; files write 1e23 for rigid. Powers of it are still finite."""

Value = str | bool | float | tuple["Value", ...]
"""A value as in the file; texts of XML are converted to numbers on access."""


@dataclass(frozen=True)
class Attribute:
    """Value of a component with its unit; the unit is empty if the file has none."""

    value: Value
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Component:
    """A part of the gearbox, or data on a part."""

    number: int
    """Id of the component, unique in the file."""
    type: str
    name: str = ""
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    asked: set[str] = field(default_factory=set, repr=False)
    """Names that have been read so far; the others are reported as omitted by an import."""

    def __str__(self) -> str:
        """Return the name of the component in messages and comments."""
        name = plain(self.name)
        return f"{self.type} {self.number}" + (f" '{name}'" if name else "")

    def given(self, key: str) -> bool:
        """Return whether the file has a value of an attribute."""
        attribute = self._attribute(key)
        return attribute is not None and attribute.value not in ("", ())

    def quantity(self, key: str, unit: str = "") -> float | None:
        """Finite number in a unit, by default that of `UNITS`; None if the file has no value."""
        attribute = self._attribute(key)
        if attribute is None or not self.given(key):
            return None
        return self._number(key, attribute.value) * self._factor(key, attribute, unit or UNITS.get(key, "none"))

    def required(self, key: str) -> float:
        """Finite number in the unit of `UNITS`.

        Raises
        ------
        RexsError
            The file has no value, or as in `quantity`.
        """
        value = self.quantity(key)
        if value is None:
            raise RexsError(f"{self}: {key} is missing")
        return value

    def whole(self, key: str) -> int | None:
        """Whole number; None if the file has no value.

        Raises
        ------
        RexsError
            The value is not a whole number.
        """
        value = self.quantity(key)
        if value is None:
            return None
        if value != round(value):
            raise RexsError(f"{self}: {key} = {value:g} is not a whole number")
        return round(value)

    def has_lost_vector(self, key: str) -> bool:
        """Return whether an attribute that requires three numbers has a value without them."""
        value = self.attributes[key].value if key in self.attributes else None
        return value is not None and not (isinstance(value, tuple) and len(value) == 3)

    def vector(self, key: str) -> tuple[float, float, float] | None:
        """Three numbers in mm; None if the file has no value.

        Raises
        ------
        RexsError
            The value does not have three numbers.
        """
        attribute = self._attribute(key)
        if attribute is None:
            return None
        if not isinstance(attribute.value, tuple) or len(attribute.value) != 3:
            raise RexsError(f"{self}: {key} is not three numbers")
        factor = self._factor(key, attribute, "mm")
        u, v, w = (self._number(key, value) * factor for value in attribute.value)
        return u, v, w

    def text(self, key: str) -> str:
        """Text on one line; empty if the file has no value."""
        attribute = self._attribute(key)
        if attribute is None or isinstance(attribute.value, tuple):
            return ""
        return plain(attribute.value)

    def flag(self, key: str, number: int = 0) -> bool | None:
        """Truth value, or the entry of an array with a number; None if the file has no value."""
        attribute = self._attribute(key)
        if attribute is None:
            return None
        value = attribute.value
        if isinstance(value, tuple):
            value = value[min(number, len(value) - 1)] if value else ""
        known = {"true": True, "1": True, "false": False, "0": False}
        return known.get(str(value).strip().lower())

    def with_attributes(self, attributes: Mapping[str, Attribute]) -> Component:
        """Return the component with some attributes replaced, as by a load case."""
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
            raise RexsError(f"{self}: {key} = '{plain(value)}' is not a finite number")
        if abs(number) > LARGEST_NUMBER:
            raise RexsError(f"{self}: {key} = '{plain(value)}' is larger than any quantity of a gearbox")
        return number

    def _factor(self, key: str, attribute: Attribute, unit: str) -> float:
        factor = unit_factor(attribute.unit, unit)
        if factor is None:
            raise RexsError(f"{self}: {key} has the unit '{plain(attribute.unit)}'; expected {unit} or a multiple")
        return factor


AdditionValue = str | float | tuple[float, ...]


@dataclass(frozen=True)
class Addition:
    """An attribute that is added to a component of an existing file."""

    component: int
    name: str
    """Name in the version of the file."""
    unit: str
    value: AdditionValue
    load_case: int | None = None
    """Load case of the value; None for the component itself."""


@dataclass(frozen=True)
class Relation:
    """Relation between components: their numbers by role."""

    type: str
    order: int
    roles: Mapping[str, int]


@dataclass(frozen=True)
class RexsLoadCase:
    """Attributes that a load case replaces, by the number of their component."""

    number: int
    changes: Mapping[int, Mapping[str, Attribute]]


@dataclass(frozen=True)
class Model(ReprMixin, line=" REXS {version}: {components!n} components, {relations!n} relations"):
    """Complete content of a REXS file."""

    version: str
    program: str
    """Program that wrote the file, with its version."""
    components: Mapping[int, Component]
    relations: tuple[Relation, ...]
    """Relations; ordered ones in their order."""
    load_cases: tuple[RexsLoadCase, ...] = ()

    def components_of_type(self, *types: str) -> tuple[Component, ...]:
        """Return all components of some types, in the order of the file."""
        return tuple(component for component in self.components.values() if component.type in types)

    def components_in(self, case: RexsLoadCase | None, *types: str) -> list[Component]:
        """Return all components of some types with the attributes that a load case replaces; None for no load case."""
        changes = case.changes if case else {}
        parts = self.components_of_type(*types)
        return [part.with_attributes(changes[part.number]) if part.number in changes else part for part in parts]

    def related(self, relation: str, role: str, number: int, wanted: str) -> tuple[Component, ...]:
        """Return the components in the role `wanted` of all relations in which a component has a role."""
        found = self._relations_by_role.get((relation, role, number), ())
        return tuple(self.components[relation.roles[wanted]] for relation in found if wanted in relation.roles)

    def parts_of(self, owner: Component, kind: str) -> list[Component]:
        """Return the parts of a type in the assembly of a component."""
        return [part for part in self.related("assembly", "assembly", owner.number, "part") if part.type == kind]

    def relations_of(self, *types: str) -> Iterator[Relation]:
        """Yield the relations of some types."""
        return (relation for relation in self.relations if relation.type in types)

    @cached_property
    def _relations_by_role(self) -> dict[tuple[str, str, int], list[Relation]]:
        by_role: dict[tuple[str, str, int], list[Relation]] = {}
        for relation in sorted(self.relations, key=lambda relation: relation.order):
            for role, number in relation.roles.items():
                by_role.setdefault((relation.type, role, number), []).append(relation)
        return by_role
