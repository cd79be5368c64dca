"""Where parts come from: sections of a gearbox file, its name and permissions, and what all builders of parts share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from exugear.gearbox.named_files import NamedFileError, Permissions, named_file
from exugear.gearbox.reading import CaseError, fault_line, shortened
from exugear.gearbox.sections.bodies import BodySection
from exugear.gearbox.sections.case import CaseFile
from exugear.gearbox.sections.entries import GROUND
from fe_ste.geometry.checks import GeometryError
from fe_ste.tools.display import Displayed

Entry = TypeVar("Entry")
Part = TypeVar("Part")


@dataclass(frozen=True)
class Origin(Displayed):
    """A gearbox file as the builders of parts see it."""

    case: CaseFile
    source: str
    """Path or name of the file; files that it names lie beside it."""
    permissions: Permissions

    def _line(self) -> str:
        return f" {shortened(self.source)}"

    def fault(self, text: str) -> CaseError:
        """Error that names the file before `text` (key, value and what would be right)."""
        return CaseError(fault_line(self.source, text))

    def file(self, key: str, name: str, largest: int) -> Path:
        """Path of a file of at most `largest` bytes that the gearbox file names under a key.

        Raises
        ------
        CaseError
            The file is not there or may not be read, as `exugear.gearbox.named_files.named_file` says.
        """
        try:
            return named_file(name, Path(self.source).parent, self.permissions, largest)
        except NamedFileError as error:
            raise self.fault(f"{key} = {name!r}: {error}") from None

    def guarded(self, key: str, build: Callable[..., Part], *arguments: Any, **named: Any) -> Part:
        """Build a part of gears; what their geometry forbids is a fault of the key."""
        try:
            return build(*arguments, **named)
        except GeometryError as error:
            raise self.fault(f"{key}: {error}") from None

    @cached_property
    def enabled(self) -> dict[str, BodySection]:
        """Sections of the bodies that are there, by name."""
        return {name: section for name, section in self.case.bodies.items() if section.enabled}

    def are_enabled(self, key: str, *names: str) -> bool:
        """Tell whether all bodies are enabled; an unknown name is an error, a disabled one is not."""
        for name in names:
            if name != GROUND and name not in self.case.bodies:
                raise self.fault(f"{key}: no body {name!r}; bodies are {', '.join(self.case.bodies)} and ground")
        return all(name == GROUND or name in self.enabled for name in names)

    def suffixes(self, family: str) -> list[str]:
        """List the endings of the names of a family's bodies: `_1`, `_2`, ... for planets, else one that is empty."""
        count = len(self.enabled[family].planet_angles_deg) if family in self.enabled else 0
        return [f"_{number}" for number in range(1, count + 1)] or [""]

    def instances(self, key: str, family: str, other_family: str) -> list[tuple[str, str, str]]:
        """(suffix, body, other body) for each planet; sets meet single bodies or equal sets."""
        suffixes = self.suffixes(family)
        other_suffixes = self.suffixes(other_family)
        single = suffixes == [""]
        other_single = other_suffixes == [""]
        if not single and not other_single and len(suffixes) != len(other_suffixes):
            raise self.fault(f"{key}: {family!r} and {other_family!r} are planet sets of different size")
        return [
            (suffix, family + ("" if single else suffix), other_family + ("" if other_single else suffix))
            for suffix in (other_suffixes if single else suffixes)
        ]


def part_of_each(build: Callable[[str, Entry], Part], sections: Mapping[str, Entry]) -> dict[str, Part]:
    """Build a part of each section.

    Raises
    ------
    CaseError
        The faults of all sections together.
    """
    parts: dict[str, Part] = {}
    faults: list[str] = []
    for name, section in sections.items():
        try:
            parts[name] = build(name, section)
        except CaseError as error:
            faults += error.faults
    if faults:
        raise CaseError(*faults)
    return parts


def parts_of_each(build: Callable[[str, Entry], tuple[Part, ...]], sections: Mapping[str, Entry]) -> tuple[Part, ...]:
    """Build the parts of each section, such as one bearing for each planet, likewise."""
    return tuple(part for parts in part_of_each(build, sections).values() for part in parts)
