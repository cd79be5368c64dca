"""Renamed keys of gearbox and study files, and the conversion of old files.

Old names are refused with a message that states the new ones. `migrated` replaces them in the text of a file and keeps
comments, order and spacing.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from fe_ste.tools.toml_text import Token, tokens


@dataclass(frozen=True)
class Rename:
    """Old and new name of a key, or old and new values of a key."""

    table: str
    """Table of the key with its old names, such as ``bearings.*.damping``; empty at the top level."""
    old: str
    new: str
    values: Mapping[str, str] = field(default_factory=dict)
    """Old and new values."""

    def fits(self, path: Sequence[str]) -> bool:
        """Return whether a path of old names leads to this key."""
        own = [part for part in self.table.split(".") if part] + [self.old]
        return len(path) == len(own) and all(map(fnmatchcase, path, own))


def _damping(connectors: str) -> tuple[Rename, ...]:
    """Keys of viscous damping, whose names had the unit of a stiffness."""
    names = {"N_per_m": ("radial", "axial"), "N_m_per_rad": ("tilt", "torsion")}
    true_units = {"N_per_m": "N_s_per_m", "N_m_per_rad": "N_m_s_per_rad"}
    return tuple(
        Rename(f"{connectors}.*.damping", f"{direction}_{unit}", f"{direction}_{true_units[unit]}")
        for unit, directions in names.items()
        for direction in directions
    )


def _limits(table: str) -> tuple[Rename, ...]:
    return Rename(table, "least", "min"), Rename(table, "most", "max")


GEARBOX_RENAMES: tuple[Rename, ...] = (
    Rename("bearings.*", "law", "model", {"stiffness": "linear"}),
    Rename("bearings.*.catalogue", "holds_towards", "locates_towards"),
    *_damping("bearings"),
    *_damping("mounts"),
    Rename("bodies.*", "wheels_z_mm", "gears_z_mm"),
    *(Rename("rating", f"least_{name}", f"minimum_{name}") for name in ("S_H", "S_F", "S_0", "dynamic_factor")),
    Rename("rating.gears.*", "roughness_um", "roughness_Rz_um"),
)
STUDY_RENAMES: tuple[Rename, ...] = (
    Rename("", "figures", "outputs"),
    Rename("figures.*", "figure", "quantity"),
    Rename("outputs.*", "figure", "quantity"),
    Rename("figures.*", "by", "by", {"least": "minimum"}),
    Rename("choice", "mesh_law", "mesh_model", {"seed": "tangential", "rigid": "kinematic"}),
    Rename("steady", "level", "method"),
    *_limits("parameters.*.uniform"),
    *_limits("parameters.*.normal"),
    *_limits("tolerances.*.uniform"),
    *_limits("tolerances.*.normal"),
    *_limits("optimise.limits.*"),
)


def new_name(path: Sequence[str], renames: Sequence[Rename]) -> str | None:
    """Return the new name of the key at a path, or None if its name is not an old one.

    Examples
    --------
    >>> new_name(["bearings", "left", "law"], GEARBOX_RENAMES)
    'model'
    """
    return next((rename.new for rename in renames if rename.fits(path) and rename.new != rename.old), None)


def renamed_hint(path: Sequence[str], renames: Sequence[Rename]) -> str:
    """Return the text that messages add for a key with an old name; empty for other keys."""
    new = new_name(path, renames)
    if new is None:
        return ""
    return f"was renamed to {new}; exugear migrate FILE.toml rewrites the file"


class MigrationError(ValueError):
    """A file that cannot be rewritten."""


def migrated(text: str) -> tuple[str, list[str]]:
    r"""Replace old names of keys and values in the text of a gearbox or study file.

    Returns
    -------
    text : the same text with the new names
    changes : a line for each of them, with the number of its line

    Raises
    ------
    MigrationError
        The text is not valid TOML, or has both the old and the new name of a key.

    Examples
    --------
    >>> migrated('[bearings.left]\nlaw = "stiffness"  # linear\n')
    ('[bearings.left]\nmodel = "linear"  # linear\n', ['line 2: law -> model', 'line 2: "stiffness" -> "linear"'])
    """
    try:
        before = tomllib.loads(text)
    except RecursionError:
        raise MigrationError("not valid TOML: nested too deep") from None
    except ValueError as error:
        raise MigrationError(f"not valid TOML: {error}") from None
    renames = GEARBOX_RENAMES
    if "case" in before and "parameters" in before:
        renames = STUDY_RENAMES
    pieces: list[str] = []
    changes: list[str] = []
    end = 0
    for token in tokens(text):
        new = _replacement(token, renames)
        if new is None:
            continue
        pieces += [text[end : token.start], new]
        end = token.end
        changes.append(f"line {text.count(chr(10), 0, token.start) + 1}: {text[token.start : token.end]} -> {new}")
    result = "".join([*pieces, text[end:]])
    try:
        after = tomllib.loads(result)
    except tomllib.TOMLDecodeError as error:
        raise MigrationError(f"holds the old and the new name of a key; remove one of them ({error})") from None
    if _count(before) != _count(after):
        raise MigrationError("cannot be rewritten without loss; rename the keys by hand")
    return result, changes


def _replacement(token: Token, renames: Sequence[Rename]) -> str | None:
    """Return the replacement of a key or string, or None if it is kept."""
    varied = token.value
    if token.kind == "other":
        return None
    if token.kind == "key":
        new = new_name(token.path, renames)
        if new is not None:
            return new
        varied = token.path[-1]
    else:
        for rename in renames:
            if rename.fits(token.path) and token.value in rename.values:
                return f'"{rename.values[token.value]}"'
    # Studies vary keys of the gearbox file by their dotted paths.
    path = varied.split(".")
    new = new_name(path, GEARBOX_RENAMES)
    if renames is STUDY_RENAMES and new is not None:
        return '"' + ".".join([*path[:-1], new]) + '"'
    return None


def _count(content: Any) -> int:
    """Count the values in all tables and lists."""
    if isinstance(content, Mapping):
        return sum(map(_count, content.values()))
    if isinstance(content, list):
        return sum(map(_count, content))
    return 1
