"""Reading a study file: TOML to checked sections, and faults as lines that name file, key and remedy."""

from __future__ import annotations

import difflib
import tomllib
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from exugear.gearbox.reading import fault_line, parsed, shortened
from exugear.studies.design.sections import StudyFile
from fe_ste.tools.files import FileError, read_text

LARGEST_STUDY = 10_000_000
"""Largest study file that is read, bytes."""
SHOWN_FAULTS = 20


class StudyError(ValueError):
    """A study that cannot be used; a line for each fault says file, key, value and what would be right."""


def read_study_file(path: Path) -> StudyFile:
    """Read and check a study file.

    Raises
    ------
    StudyError
        Anything wrong with the file.

    Examples
    --------
    >>> read_study_file(Path("nowhere.study.toml"))
    Traceback (most recent call last):
    ...
    exugear.studies.design.reading.StudyError: nowhere.study.toml: no such file
    """
    try:
        text = read_text(path, LARGEST_STUDY)
    except FileError as error:
        raise StudyError(str(error)) from None
    try:
        content = parsed(lambda: tomllib.loads(text.removeprefix("\ufeff")), str(path), "TOML")
    except ValueError as error:
        raise StudyError(str(error)) from None
    return parse_study(content, str(path))


def parse_study(content: dict[str, Any], source: str) -> StudyFile:
    """Check content already in memory.

    Raises
    ------
    StudyError
        Anything wrong with it.

    Examples
    --------
    >>> parse_study({"name": "a", "case": "b.toml", "parameters": {}, "figure": {}}, "s.toml")
    Traceback (most recent call last):
    ...
    exugear.studies.design.reading.StudyError: s.toml: parameters: must have at least 1 entry
    s.toml: figures: this key is missing
    s.toml: figure: unknown key; did you mean 'figures'?
    """
    try:
        return StudyFile.model_validate(content)
    except ValidationError as error:
        faults = error.errors(include_url=False)
    lines = list(dict.fromkeys(fault_line(source, _described(fault)) for fault in faults))
    more = [f"and {len(lines) - SHOWN_FAULTS} more faults"] if len(lines) > SHOWN_FAULTS else []
    raise StudyError("\n".join([*lines[:SHOWN_FAULTS], *more]))


_REMEDIES = {
    "missing": "this key is missing",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text in quotes",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "list_type": "must be an array in brackets",
    "too_short": "must have at least 1 entry",
}


def _described(fault: Any) -> str:
    """Key, value and what would be right."""
    location = [str(part) for part in fault["loc"] if part not in ("[key]", "int", "float", "str", "bool")]
    key = ".".join(location) or "the file"
    if fault["type"] == "extra_forbidden":
        known = _known_keys(location[:-1])
        near = difflib.get_close_matches(location[-1][:100], known, n=1)
        return f"{key}: unknown key; " + (
            f"did you mean {near[0]!r}?" if near else f"known keys are {', '.join(known)}"
        )
    remedy = _REMEDIES.get(fault["type"])
    if remedy is None:
        text = str(fault["msg"]).removeprefix("Value error, ").removeprefix("Input ")
        remedy = text[:1].lower() + text[1:]
    value = fault["input"]
    shown = "" if isinstance(value, dict) or fault["type"] == "missing" else f" = {shortened(value)}"
    return f"{key}{shown}: {remedy}"


def _known_keys(location: list[str]) -> list[str]:
    """Keys of the table at a place of the file."""
    section: Any = StudyFile
    for part in location:
        fields = getattr(section, "model_fields", {})
        kind = fields[part].annotation if part in fields else section
        section = next((model for model in _models(kind)), section)
    return list(getattr(section, "model_fields", {}))


def _models(kind: Any) -> list[Any]:
    own = [kind] if hasattr(kind, "model_fields") else []
    return own + [model for part in getattr(kind, "__args__", ()) for model in _models(part)]
