"""What a gearbox file lacks for loads, life and rating, as far as that is quick to tell."""

from __future__ import annotations

from collections.abc import Callable

from exugear.exchange.series_files import LARGEST_SERIES
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import GearboxFileError
from exugear.life.gear_life import check_strengths
from exugear.life.life import check_keys, checked_loads, rating_of
from exugear.life.load_spectrum.counted import count_loads, tooth_exposures
from exugear.life.load_spectrum.sources import section_of
from exugear.life.rating.sheet import rated_loads

QUICK = 1 << 20
"""Bytes of all files of loads together up to which they are read: tables of counted loads, not series of hours."""

COMMANDS = ("loads", "life", "check --rating")


def lacks_of_life(gearbox: Gearbox) -> dict[str, tuple[str, ...]]:
    """Say by verb why it is not possible, all reasons at once; nothing where it is.

    Long files of loads are not read: what only they show, such as torques that reverse, is then left to the verbs.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("exugear/gearbox/templates/planetary.toml")
    >>> lacks_of_life(gearbox)["loads"]
    ('loads: this section is missing; add [loads] with the loaded body and the load files',)
    """
    checks: tuple[Callable[[Gearbox], object], ...] = (section_of, _checked_by_keys, _checked_by_keys)
    if _are_quick(gearbox):
        checks = (count_loads, checked_loads, rated_loads)
    return {verb: _faults(gearbox, check) for verb, check in zip(COMMANDS, checks, strict=True)}


def _faults(gearbox: Gearbox, check: Callable[[Gearbox], object]) -> tuple[str, ...]:
    try:
        check(gearbox)
    except GearboxFileError as error:
        return tuple(fault.removeprefix(f"{gearbox.source}: ") for fault in error.faults)
    return ()


def _checked_by_keys(gearbox: Gearbox) -> None:
    """Check what is known without the files of loads."""
    check_keys(gearbox)
    check_strengths(gearbox, rating_of(gearbox), tooth_exposures(gearbox, section_of(gearbox).body), False)


def _are_quick(gearbox: Gearbox) -> bool:
    """Tell whether all files of loads are named one by one, and are short; one that is missing is told at once."""
    if gearbox.case.loads is None:
        return True
    size = 0
    for name, source in gearbox.case.loads.sources.items():
        if source.file is None:
            return False
        try:
            size += gearbox.file(f"loads.sources.{name}.file", source.file, LARGEST_SERIES).stat().st_size
        except GearboxFileError:
            return True
    return size <= QUICK
