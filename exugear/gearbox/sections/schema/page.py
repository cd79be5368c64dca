"""The page of the documentation that describes every key of the gearbox file."""

from __future__ import annotations

from itertools import groupby

from exugear.gearbox.sections.schema.keys import Key, keys, tables, written

_HEAD = """# The gearbox file

Every key there is, table by table; written by `exugear schema --page` from the models that read the
file, so that it is always what the program takes. `NAME` stands for a name of one's own. A key whose
default is "needed" must be there if its table is; with "none" the key may be left out. Nothing is
converted: a key's end names its unit, text stands in quotes, and a whole number may stand for a number.
Editors that know JSON schemas (`exugear schema`) tell all this while one types.
"""
_HEADINGS = "| Key | What it holds | From, to | Default | Meaning | Example |"


def page() -> str:
    """Page in Markdown."""
    parts = [_HEAD]
    for table, entries in groupby(keys(), lambda key: key.table):
        parts.append(_section(table, list(entries)))
    return "\n".join(parts)


def _section(table: str, entries: list[Key]) -> str:
    model = tables()[table]
    about = " ".join((model.__doc__ or "").split()) if table else "What stands before all tables."
    lines = [f"## {f'`[{table}]`' if table else 'Top of the file'}", "", about, ""]
    lines += [_HEADINGS, "| --- | --- | --- | --- | --- | --- |"]
    return "\n".join([*lines, *map(_row, entries), ""])


def _row(key: Key) -> str:
    kind = f"{key.kind}, {key.unit}" if key.unit else key.kind
    told = (f"`{key.name}`", kind, key.range, key.default, key.meaning, f"`{written(key.example)}`")
    return f"| {' | '.join(cell.replace('|', '/') for cell in told)} |"
