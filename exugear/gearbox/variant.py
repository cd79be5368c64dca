"""Variants of a gearbox: how its bodies are held, and what follows from that."""

from __future__ import annotations

import difflib
from enum import Flag, StrEnum, auto


class VariantError(ValueError):
    """A variant that is unknown, or that a gearbox cannot have."""


class Trait(Flag):
    """What holds for a variant."""

    none = 0
    spins_only = auto()
    on_bearings = auto()
    elastic = auto()
    constrained = auto()


class Variant(StrEnum):
    """How bodies are held, from stiff to soft; files and the command line have its name.

    Examples
    --------
    >>> Variant.of("bushing").label
    'on bearings'
    >>> [variant for variant in Variant if variant.is_elastic]
    ['flexible']
    """

    label: str
    """Reads on behind a noun: "resonances on bearings"."""
    traits: Trait

    def __new__(cls, name: str, label: str = "", traits: Trait = Trait.none) -> Variant:
        """Make a variant of a row of the list below."""
        member = str.__new__(cls, name)
        member._value_ = name
        member.label, member.traits = label, traits
        return member

    rigid = "rigid", "on ideal joints", Trait.spins_only
    jointed = "jointed", "on joints kept as constraints", Trait.constrained
    bushing = "bushing", "on bearings", Trait.on_bearings
    flexible = "flexible", "with flexible bodies", Trait.on_bearings | Trait.elastic

    def __repr__(self) -> str:
        """Show the name as files have it."""
        return repr(self.value)

    @property
    def spins_only(self) -> bool:
        """Whether bodies turn about their axes and do nothing else: minimal coordinates on ideal joints."""
        return Trait.spins_only in self.traits

    @property
    def on_bearings(self) -> bool:
        """Whether bearings hold the shafts, which then move sideways and tilt."""
        return Trait.on_bearings in self.traits

    @property
    def is_elastic(self) -> bool:
        """Whether bodies deform."""
        return Trait.elastic in self.traits

    @property
    def is_constrained(self) -> bool:
        """Whether ideal joints are constraints: what minimal coordinates are checked against."""
        return Trait.constrained in self.traits

    @classmethod
    def of(cls, name: str) -> Variant:
        """Return the variant of a name.

        Raises
        ------
        VariantError
            No variant has it; the message names the one that is meant.
        """
        if name in cls.__members__:
            return cls[name]
        near = difflib.get_close_matches(name, list(OFFERED), n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"variants are {', '.join(OFFERED)}"
        raise VariantError(f"variant {name!r} is unknown; {hint}")

    @classmethod
    def offered(cls, name: str) -> Variant:
        """Return the variant of a name if users choose from it.

        Raises
        ------
        VariantError
            It is unknown, or only there to check others.
        """
        variant = cls.of(name)
        if variant not in OFFERED:
            raise VariantError(f"variant {name!r} is for internal comparisons only; variants are {', '.join(OFFERED)}")
        return variant


OFFERED: tuple[Variant, ...] = tuple(variant for variant in Variant if not variant.is_constrained)
"""Those that users choose from."""
