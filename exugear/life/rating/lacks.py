"""Quick check of the input that a gearbox file lacks for load spectrum, life and rating."""

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
"""Maximum total size of load files that are read, bytes: tables of counted loads, not long series."""

COMMANDS = ("loads", "life", "check --rating")


def missing_for_life(gearbox: Gearbox) -> dict[str, tuple[str, ...]]:
    """Return by command all reasons why it cannot run; empty if it can.

    Long load files are not read; errors found only in them, such as reversed torques, are left to the commands.

    Examples
    --------
    >>> gearbox = Gearbox.from_toml("exugear/gearbox/templates/planetary.toml")
    >>> missing_for_life(gearbox)
    {'loads': (), 'life': (), 'check --rating': ()}
    """
    checks: tuple[Callable[[Gearbox], object], ...] = (section_of, _checked_by_keys, _checked_by_keys)
    if _are_quick(gearbox):
        checks = (count_loads, checked_loads, rated_loads)
    return {verb: _errors(gearbox, check) for verb, check in zip(COMMANDS, checks, strict=True)}


def _errors(gearbox: Gearbox, check: Callable[[Gearbox], object]) -> tuple[str, ...]:
    try:
        check(gearbox)
    except GearboxFileError as error:
        return tuple(line.removeprefix(f"{gearbox.source}: ") for line in error.errors)
    return ()


def _checked_by_keys(gearbox: Gearbox) -> None:
    """Check the input that does not depend on load files."""
    check_keys(gearbox)
    check_strengths(gearbox, rating_of(gearbox), tooth_exposures(gearbox, section_of(gearbox).body), False)


def _are_quick(gearbox: Gearbox) -> bool:
    """Return whether all load files are named individually and short, or one is missing, which is reported at once."""
    if gearbox.case.loads is None:
        return True
    size = 0
    for name, source in gearbox.case.loads.sources.items():
        if source.hours is not None:
            continue
        if source.file is None:
            return False
        try:
            size += gearbox.file(f"loads.sources.{name}.file", source.file, LARGEST_SERIES).stat().st_size
        except GearboxFileError:
            return True
    return size <= QUICK
