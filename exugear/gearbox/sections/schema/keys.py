"""Description of every key of the gearbox file, read from the models: unit, type, range, default, meaning.

The meaning of a key is the docstring below it in :mod:`exugear.gearbox.sections`. It is read from the source on demand,
so that it does not delay the start of a program.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from exugear.gearbox.sections.case import GearboxFile
from exugear.gearbox.sections.entries import Range
from exugear.gearbox.sections.examples import examples_by_table, written
from exugear.gearbox.units import unit_suffix

_SIGNS = {"_per_": "/", "_": " ", "m2": "m²", "s2": "s²", "m3": "m³", "um": "µm", "hours": "h", "percent": "%"}
"""How units in the suffix of a key are written in texts."""


@dataclass(frozen=True)
class Key:
    """A key of the gearbox file."""

    table: str
    """Table of the key, such as ``gears.NAME``; empty at the top level."""
    name: str
    unit: str
    """Unit; empty for dimensionless numbers and for values that are not numbers."""
    kind: str
    """Type of the value as text."""
    range: str
    """Possible values; empty if all are possible."""
    default: str
    """Value if the key is omitted; "required" if there is none."""
    meaning: str
    example: object
    """A possible value in TOML notation."""


def unit_of(name: str) -> str:
    """Return the unit that the suffix of a key indicates.

    Examples
    --------
    >>> unit_of("axial_kg_m2"), unit_of("stiffness_N_m_per_rad"), unit_of("teeth")
    ('kg m²', 'N m/rad', '')
    """
    unit = unit_suffix(name)
    for text, sign in _SIGNS.items():
        unit = unit.replace(text, sign)
    return "°C" if unit == "C" else unit


def tables() -> dict[str, type[BaseModel]]:
    """Tables of the file by their path, such as ``bearings.NAME.catalogue``, in the order of the file."""
    return dict(_tables(GearboxFile, ""))


def keys() -> Iterator[Key]:
    """All keys, table by table; keys that hold a table are omitted because the table is listed."""
    examples = examples_by_table()
    for table, model in tables().items():
        texts = meanings(model)
        found: Any = examples
        for part in filter(None, table.split(".")):
            found = found[part]
            found = found[0] if isinstance(found, list) else found
        given = dict(found)
        for name, field in model.model_fields.items():
            if _model_within(field.annotation):
                continue
            limits = _range(field.annotation) or next((one for one in field.metadata if isinstance(one, Range)), None)
            told = "" if limits is None else f"{limits.least:g} to {limits.most:g}"
            kind = _kind(field.annotation)
            yield Key(table, name, unit_of(name), kind, told, _default(field), texts[name], given[name])


@cache
def meanings(model: type[BaseModel]) -> Mapping[str, str]:
    """Docstrings below the keys of a table, by key; those of the table that it extends among them."""
    texts: dict[str, str] = {}
    for extended in model.__bases__:
        if issubclass(extended, BaseModel) and extended.model_fields:
            texts |= meanings(extended)
    body = ast.parse(inspect.getsource(model)).body[0]
    assert isinstance(body, ast.ClassDef)
    for statement, text in zip(body.body, body.body[1:], strict=False):
        if not (isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)):
            continue
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            texts[statement.target.id] = str(text.value.value)
    return texts


def _tables(model: type[BaseModel], place: str) -> Iterator[tuple[str, type[BaseModel]]]:
    yield place, model
    for name, field in model.model_fields.items():
        within = _model_within(field.annotation)
        if within is not None:
            named = get_origin(_bare(field.annotation)) is dict
            yield from _tables(within, f"{place}.{name}".lstrip(".") + (".NAME" if named else ""))


def _model_within(kind: Any) -> type[BaseModel] | None:
    """Table that a key holds, once or several times; a list of tables counts as a table."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind
    return next((found for part in get_args(kind) if (found := _model_within(part)) is not None), None)


def _bare(kind: Any) -> Any:
    """Type without annotations and without None."""
    if get_origin(kind) is Annotated:
        return _bare(get_args(kind)[0])
    if get_origin(kind) in (Union, UnionType):
        others = [part for part in get_args(kind) if part is not NoneType]
        return _bare(others[0]) if len(others) == 1 else kind
    return kind


def _range(kind: Any) -> Range | None:
    """Range of the numbers in a type."""
    own = next((entry for entry in getattr(kind, "__metadata__", ()) if isinstance(entry, Range)), None)
    return own or next((found for part in get_args(kind) if (found := _range(part)) is not None), None)


def _kind(kind: Any) -> str:
    """Return the type of a value as text."""
    bare = _bare(kind)
    simple = {bool: "true or false", int: "whole number", float: "number", str: "text"}
    if bare in simple:
        return simple[bare]
    origin = get_origin(bare)
    parts = get_args(bare)
    if origin is Literal:
        return ", ".join(f'"{choice}"' for choice in parts)
    if origin is dict:
        return f"{_kind(parts[1])} by name"
    if origin is tuple:
        count = "" if parts[-1] is Ellipsis else f"{len(parts)} of "
        return f"list: {count}{_kind(parts[0])}"
    return " or ".join(_kind(part) for part in parts if part is not NoneType)


def _default(field: FieldInfo) -> str:
    if field.default is PydanticUndefined:
        return "required"
    if field.default is None or field.default in ((), {}, ""):
        return "none"
    return written(field.default)


# The JSON schema of the gearbox file, with which editors show keys and ranges during typing

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of the file; keys have descriptions, numbers have ranges.

    Examples
    --------
    >>> json_schema()["$defs"]["GearSection"]["properties"]["teeth"]
    {'maximum': 2000, 'minimum': 5, 'type': 'integer', 'description': 'Number of teeth, positive for rings, too.'}
    """
    schema = GearboxFile.model_json_schema()
    models = {model.__name__: model for model in tables().values()}
    for name, table in {GearboxFile.__name__: schema, **schema["$defs"]}.items():
        for key, meaning in meanings(models[name]).items():
            table["properties"][key]["description"] = meaning
    return {"$schema": DIALECT, **_remove_nulls(schema)}


def _remove_nulls(node: Any) -> Any:
    """Remove content that TOML cannot express, which is null, and titles that repeat the keys."""
    if isinstance(node, list):
        return [_remove_nulls(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    if "anyOf" in node:
        kinds = [kind for kind in node["anyOf"] if kind != {"type": "null"}]
        node = {key: value for key, value in node.items() if key != "anyOf"}
        node |= kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
    titled = isinstance(node.get("title"), str)
    kept = {key: value for key, value in node.items() if not (key == "title" and titled)}
    return {key: _remove_nulls(value) for key, value in kept.items() if not (key == "default" and value is None)}


# Pages of the documentation that describe every key of the gearbox file, block by block

TOP = "top_of_the_file"
"""Name of the block of keys before the first table."""


def page() -> str:
    """Return the description of all keys in Markdown."""
    return "\n".join(blocks().values())


def blocks() -> dict[str, str]:
    """Return the description of the keys in Markdown by block: a table of the top level with those within it.

    Examples
    --------
    >>> print(blocks()["pins"].splitlines()[2])
    Position error of a planet pin in its carrier.
    """
    described: dict[str, str] = {}
    for table, entries in groupby(keys(), lambda key: key.table):
        block = table.partition(".")[0] or TOP
        model = tables()[table]
        about = " ".join((model.__doc__ or "").split()) if table else "Keys before the first table."
        lines = [f"## {f'`[{table}]`' if table else 'Top of the file'}", "", about, "", *map(_entry, entries), ""]
        described[block] = described.get(block, "") + "\n".join(lines)
    return described


def _entry(key: Key) -> str:
    kind = f"{key.kind}, {key.unit}" if key.unit else key.kind
    default = {"required": "required", "none": "optional"}.get(key.default, f"default {key.default}")
    about = "; ".join(filter(None, (kind, key.range, default)))
    return f"`{key.name}`\n: {' '.join(key.meaning.split())}\n  *{about}*. Example: `{written(key.example)}`\n"
