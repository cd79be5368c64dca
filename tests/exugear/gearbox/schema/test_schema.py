"""The description of the gearbox file: complete, true, and what the documentation shows."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from pydantic import ConfigDict, TypeAdapter

from exugear.gearbox.sections.schema.keys import blocks, json_schema, keys, meanings, page, tables
from exugear.gearbox.templates.kinds import KINDS, template

from ...cases.command import exugear

ROOT = Path(__file__).parents[4]
GRC = ROOT / "cases" / "grc750" / "gearbox.toml"


def test_every_key_of_every_table_has_a_meaning() -> None:
    for table, model in tables().items():
        assert set(meanings(model)) == set(model.model_fields), table


def test_every_number_with_a_dimension_names_its_unit_and_its_range() -> None:
    numbers = [key for key in keys() if "number" in key.kind]
    assert len(numbers) > 100
    assert all(key.range for key in numbers if key.name != "profile" and key.name != "phase")
    named = {key.name for key in numbers if key.unit}
    assert {"teeth", "profile_shift"}.isdisjoint(named) and {"face_width_mm", "duration_s", "twist_um"} <= named


def test_every_example_is_a_value_that_the_program_takes() -> None:
    for key in keys():
        if key.name == "matrix":
            continue  # six rows; an empty one stands for them
        field = tables()[key.table].model_fields[key.name]
        annotated: Any = field.rebuild_annotation()
        TypeAdapter(annotated, config=ConfigDict(strict=True)).validate_python(key.example)


@pytest.mark.parametrize("text", [*(template(kind) for kind in KINDS), GRC.read_text(encoding="utf-8")])
def test_files_that_run_have_only_keys_and_ranges_of_the_schema(text: str) -> None:
    schema = json_schema()
    assert _errors(tomllib.loads(text), schema, schema) == []
    broken = tomllib.loads(text.replace("teeth = ", "teeth = 9000", 1).replace("face_width_mm", "face_width", 1))
    assert len(_errors(broken, schema, schema)) == 3  # too many teeth, an unknown key, a missing one


def _errors(value: Any, schema: dict[str, Any], root: dict[str, Any]) -> list[str]:
    """Check what of JSON schema the tables use: references, keys, numbers."""
    if "$ref" in schema:
        schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
    if isinstance(value, dict):
        found = [f"missing {key}" for key in schema.get("required", ()) if key not in value]
        for key, entry in value.items():
            patterns = list(schema.get("patternProperties", {}).values())
            if key in schema.get("properties", {}):
                found += _errors(entry, schema["properties"][key], root)
            elif patterns:
                found += _errors(entry, patterns[0], root)
            else:
                found.append(f"unknown {key}")
        return found
    if isinstance(value, int | float) and not isinstance(value, bool) and "minimum" in schema:
        return [] if schema["minimum"] <= value <= schema["maximum"] else [f"range {value}"]
    if isinstance(value, list):
        return [error for entry in value for error in _errors(entry, schema.get("items", {}), root)]
    return []


def test_the_documentation_has_a_page_for_every_block_of_the_file() -> None:
    overview = (ROOT / "docs" / "reference" / "gearbox_file.md").read_text(encoding="utf-8")
    linked = set(re.findall(r"\(keys/(\w+)\.md\)", overview))
    assert linked == set(blocks())


def test_schema_prints_or_writes_the_same(tmp_path: Path) -> None:
    printed = exugear("schema")
    assert printed.exit_code == 0
    assert json.loads(printed.stdout) == json_schema()
    assert exugear("schema", "--out", tmp_path / "a" / "s.json").exit_code == 0
    assert (tmp_path / "a" / "s.json").read_text(encoding="utf-8") == printed.stdout


def test_the_unit_of_a_key_is_that_at_the_end_of_its_name():
    """Also of rates such as `..._per_s`, stresses and temperatures."""
    spelled = {"µ": "u", "²": "2", "³": "3", "°": "", "%": "percent", "/": "_per_", " ": "_"}
    ends = {"mm", "um", "deg", "rad", "m", "s", "s2", "GPa", "MPa", "C", "kg", "m2", "m3", "N", "kN", "rpm", "Hz"}
    for key in keys():
        end = "".join(spelled.get(letter, letter) for letter in key.unit).replace("__", "_")
        if end == "h":
            end = "hours"
        assert not end or key.name.endswith(f"_{end}"), key
        if not end and "number" in key.kind:
            assert key.name.rpartition("_")[2] not in ends, key


def test_every_key_has_an_entry_and_each_table_text_of_its_own():
    entries = re.findall(r"^`(\w+)`\n: (.+)\n  \*(.+)\*\. Example: `.+`$", page(), re.MULTILINE)
    assert [name for name, _, _ in entries] == [key.name for key in keys()]
    assert all(meaning and about for _, meaning, about in entries)
    for table, model in tables().items():
        about = model.__doc__ or ""
        assert "of a gear." not in about or "gears" in table, table
        assert "of a bearing." not in about or "bearings" in table, table
