"""Variants of a gearbox, which define how its bodies are supported."""

from __future__ import annotations

import difflib
from enum import Flag, StrEnum, auto


class VariantError(ValueError):
    """An unknown variant, or one that is not available for a gearbox."""


class Trait(Flag):
    """Properties of a variant."""

    none = 0
    spins_only = auto()
    has_bearings = auto()
    elastic = auto()
    constrained = auto()


class Variant(StrEnum):
    """Support of the bodies, from stiff to compliant; files and the command line use its name.

    Examples
    --------
    >>> Variant.of("bushing").label
    'on bearings'
    >>> [variant for variant in Variant if variant.is_elastic]
    ['flexible']
    """

    label: str
    """Text that follows a noun, as in "resonances on bearings"."""
    traits: Trait

    def __new__(cls, name: str, label: str = "", traits: Trait = Trait.none) -> Variant:
        """Make a variant from a row of the list below."""
        member = str.__new__(cls, name)
        member._value_ = name
        member.label, member.traits = label, traits
        return member

    rigid = "rigid", "on ideal joints", Trait.spins_only
    jointed = "jointed", "on joints kept as constraints", Trait.constrained
    bushing = "bushing", "on bearings", Trait.has_bearings
    flexible = "flexible", "with flexible bodies", Trait.has_bearings | Trait.elastic

    def __repr__(self) -> str:
        """Return the name as files have it."""
        return repr(self.value)

    @property
    def spins_only(self) -> bool:
        """Whether bodies only rotate about their axes: minimal coordinates with ideal joints."""
        return Trait.spins_only in self.traits

    @property
    def has_bearings(self) -> bool:
        """Whether bearings support the shafts, which then also translate and tilt."""
        return Trait.has_bearings in self.traits

    @property
    def is_elastic(self) -> bool:
        """Whether bodies are flexible."""
        return Trait.elastic in self.traits

    @property
    def is_constrained(self) -> bool:
        """Whether ideal joints are modelled as constraints, as a reference for the minimal coordinates."""
        return Trait.constrained in self.traits

    @classmethod
    def of(cls, name: str) -> Variant:
        """Return the variant with a name.

        Raises
        ------
        VariantError
            No variant has this name; the message suggests a similar one.
        """
        if name in cls.__members__:
            return cls[name]
        near = difflib.get_close_matches(name, list(OFFERED), n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"variants are {', '.join(OFFERED)}"
        raise VariantError(f"variant {name!r} is unknown; {hint}")

    @classmethod
    def offered(cls, name: str) -> Variant:
        """Return the variant with a name if it is offered to users.

        Raises
        ------
        VariantError
            The variant is unknown, or exists only to verify others.
        """
        variant = cls.of(name)
        if variant not in OFFERED:
            raise VariantError(f"variant {name!r} is for internal comparisons only; variants are {', '.join(OFFERED)}")
        return variant


OFFERED: tuple[Variant, ...] = tuple(variant for variant in Variant if not variant.is_constrained)
"""Variants that are offered to users."""
