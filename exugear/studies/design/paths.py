"""Dotted paths into a gearbox file: what stands there, what may stand there, and a content with other values."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from typing import Any

from exugear.gearbox.sections.schema.keys import tables

SHOWN_MATCHES = 3
"""Most near matches that a message names."""


class PathError(ValueError):
    """A path that leads nowhere in a gearbox file; the message names near matches."""


def value_at(content: Mapping[str, Any], path: str) -> Any:
    """Return what stands at a path; None where nothing does.

    Parameters
    ----------
    content : of a gearbox file
    path : keys joined by dots; an entry of a list by its number from 0

    Examples
    --------
    >>> value_at({"gears": {"sun": {"teeth": 21}}, "angles": [0.0, 120.0]}, "gears.sun.teeth")
    21
    >>> value_at({"angles": [0.0, 120.0]}, "angles.1")
    120.0
    """
    found: Any = content
    for key in path.split("."):
        if isinstance(found, Mapping) and key in found:
            found = found[key]
        elif isinstance(found, list) and key.isdigit() and int(key) < len(found):
            found = found[int(key)]
        else:
            return None
    return found


def changed(content: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a content with other values at some paths; tables on the way are made, what is not changed is shared.

    Raises
    ------
    PathError
        A path leads through what is neither table nor list, or beyond the end of a list.

    Examples
    --------
    >>> changed({"housing": {"factor": 1.0}, "angles": [0.0, 120.0]}, {"housing.factor": 0.3, "angles.1": 125.0})
    {'housing': {'factor': 0.3}, 'angles': [0.0, 125.0]}
    """
    result = dict(content)
    copied = {id(result)}
    for path, value in changes.items():
        *parents, last = path.split(".")
        section: Any = result
        for key in parents:
            inner = _inner(section, key, path)
            if id(inner) not in copied:
                inner = list(inner) if isinstance(inner, list) else dict(inner)
                copied.add(id(inner))
                section[_place(section, key, path)] = inner
            section = inner
        section[_place(section, last, path)] = value
    return result


def _inner(section: Any, key: str, path: str) -> Any:
    inner = section[_place(section, key, path)] if isinstance(section, list) else section.get(key, {})
    if not isinstance(inner, Mapping | list):
        raise PathError(f"{path}: {key!r} is neither a table nor a list")
    return inner


def _place(section: Any, key: str, path: str) -> Any:
    """Key of a table, or number of an entry of a list."""
    if not isinstance(section, list):
        return key
    if not (key.isdigit() and int(key) < len(section)):
        raise PathError(f"{path}: {key!r} is no entry of a list of {len(section)}; entries count from 0")
    return int(key)


def check_path(content: Mapping[str, Any], path: str) -> None:
    """Refuse a path that leads nowhere.

    A key that the file leaves out, and that may stand there, is fine.

    Raises
    ------
    PathError
        It names near matches.

    Examples
    --------
    >>> check_path({"housing": {"factor": 0.3}}, "housing.facter")
    Traceback (most recent call last):
    ...
    exugear.studies.design.paths.PathError: no key 'housing.facter' in the case; did you mean housing.factor?
    """
    if value_at(content, path) is not None or path in set(_possible(content)):
        return
    single = {key for key in _possible(content) if not isinstance(value_at(content, key), Mapping)}
    near = difflib.get_close_matches(path[:200], sorted(single.union(_present(content, ""))), SHOWN_MATCHES)
    hint = f"did you mean {' or '.join(near)}?" if near else "paths are as bearings.NAME.z_mm, with the case's names"
    raise PathError(f"no key {path[:200]!r} in the case; {hint}")


def _present(content: Any, before: str) -> Iterator[str]:
    """Paths of all single values of a content."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from _present(value, f"{before}.{key}" if before else key)
    else:
        yield before


def _possible(content: Mapping[str, Any]) -> Iterator[str]:
    """Paths of all keys that may stand in the file, for the names that it has."""
    for table, model in tables().items():
        for place in _named(content, table.split(".") if table else []):
            yield from (f"{place}.{key}" if place else key for key in model.model_fields)


def _named(content: Any, pattern: list[str], before: str = "") -> Iterator[str]:
    """Places of a table: the word NAME of its pattern stands for each entry that is there."""
    if not pattern:
        yield before
        return
    first, *rest = pattern
    every = list(content) if isinstance(content, Mapping) else []
    names = every if first == "NAME" else [first]
    for name in names:
        inner = content.get(name) if isinstance(content, Mapping) else None
        yield from _named(inner, rest, f"{before}.{name}" if before else name)
