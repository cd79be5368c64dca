"""The JSON schema of the gearbox file, for editors: it tells keys and ranges while one types."""

from __future__ import annotations

from typing import Any

from exugear.gearbox.sections.case import CaseFile
from exugear.gearbox.sections.schema.keys import meanings, tables

DIALECT = "https://json-schema.org/draft/2020-12/schema"


def json_schema() -> dict[str, Any]:
    """Describe the whole file; keys have their meaning, numbers their range.

    Examples
    --------
    >>> json_schema()["$defs"]["GearSection"]["properties"]["teeth"]
    {'maximum': 2000, 'minimum': 5, 'type': 'integer', 'description': 'Number of teeth, positive for rings, too.'}
    """
    schema = CaseFile.model_json_schema()
    models = {model.__name__: model for model in tables().values()}
    for name, table in {CaseFile.__name__: schema, **schema["$defs"]}.items():
        for key, meaning in meanings(models[name]).items():
            table["properties"][key]["description"] = meaning
    return {"$schema": DIALECT, **_as_toml_has_it(schema)}


def _as_toml_has_it(node: Any) -> Any:
    """Leave out what a TOML file cannot say: null, and titles that repeat the keys."""
    if isinstance(node, list):
        return [_as_toml_has_it(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    if "anyOf" in node:
        kinds = [kind for kind in node["anyOf"] if kind != {"type": "null"}]
        node = {key: value for key, value in node.items() if key != "anyOf"}
        node |= kinds[0] if len(kinds) == 1 else {"anyOf": kinds}
    titled = isinstance(node.get("title"), str)
    kept = {key: value for key, value in node.items() if not (key == "title" and titled)}
    return {key: _as_toml_has_it(value) for key, value in kept.items() if not (key == "default" and value is None)}
