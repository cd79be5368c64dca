"""A possible value for each key of the gearbox file, in its notation."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any


def example_at(path: Sequence[int | str]) -> str:
    """Return a key or an inline table at a path of a gearbox file with a possible value; empty for none.

    Examples
    --------
    >>> example_at(["gears", "sun", "teeth"]), example_at(["gears", "sun", "toothing"])
    ('teeth = 21', '')
    >>> example_at(["static_load"])
    'static_load = { torques_N_m = { carrier = 240000.0 }, locked = ["hss"] }'
    """
    found: Any = examples_by_table()
    for part in path:
        if isinstance(found, list):
            found = found[0]
        elif isinstance(found, Mapping) and (part in found or "NAME" in found):
            found = found.get(part, found.get("NAME"))
        else:
            return ""
    return f"{path[-1]} = {written(found)}"


def examples_by_table() -> dict[str, Any]:
    """Tables of the gearbox file with a possible value of each key; entries of named tables have the name NAME."""
    return tomllib.loads(files(__package__).joinpath("schema", "examples.toml").read_text(encoding="utf-8"))


def written(value: object) -> str:
    """Return a value in the notation of a gearbox file.

    Examples
    --------
    >>> written(True), written((1.0, 2e6)), written({"hss": 3.5})
    ('true', '[1.0, 2e+06]', '{ hss = 3.5 }')
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        short = f"{value:g}"
        return short if set(short) & set(".e") else f"{short}.0"
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {written(entry)}' for key, entry in value.items())} }}"
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(written, value))}]"
    if isinstance(value, str):
        return f'"{value}"'
    return str(value)
