"""Attributes inserted into the JSON text of a REXS file; spaces, order and number format are kept."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from json.decoder import scanstring  # type: ignore[attr-defined]

from exugear.exchange.rexs.additions import Addition, Edit, edited, json_entry

LONGEST_INDENT = 200
"""Maximum indentation before an entry that is repeated."""
_BLANK = re.compile(r"[ \t\r\n]*")
_PLAIN = re.compile(r"[-+.\w]+")
_MARK = b"\xef\xbb\xbf"


def with_additions(content: bytes, additions: Mapping[tuple[int | None, int], Mapping[str, Addition]]) -> bytes:
    """Return JSON with added attributes, which replace existing ones of the same name; see `xml_additions`."""
    mark = _MARK if content.startswith(_MARK) else b""
    text = content[len(mark) :].decode("utf-8")
    components, load_cases = _places(_scanned(text, 0), text)
    edits: list[Edit] = []
    for (case, component), attributes in additions.items():
        place = components.get((case, component))
        if place is not None:
            edits += _edits(text, place, attributes)
        elif case is not None:
            model = components[None, component]
            heads = [f'"{key}": {text[one.start : one.end]}' for key in ("id", "type", "name") if (one := model[key])]
            inside = ", ".join(json_entry(attribute) for attribute in attributes.values())
            edits += _put_inside(
                text, load_cases[case], "components", [f'{{{", ".join(heads)}, "attributes": [{inside}]}}']
            )
    return mark + edited(text, edits).encode("utf-8")


@dataclass
class _Node:
    """A value: its position and its content."""

    start: int
    end: int = 0
    members: dict[str, _Node] = field(default_factory=dict)
    items: list[_Node] = field(default_factory=list)

    def __getitem__(self, key: str) -> _Node | None:
        return self.members.get(key)

    def all(self, key: str) -> list[_Node]:
        """Return the objects in a list, or the single object in its place."""
        node = self.members.get(key)
        if node is None:
            return []
        if node.members:
            return [node]
        return node.items


def _scanned(text: str, start: int) -> _Node:
    """Value that begins at a position, with the positions of its content."""
    node = _Node(_skip_blanks(text, start))
    place = node.start
    if text[place] == '"':
        node.end = scanstring(text, place + 1)[1]
    elif text[place] in "{[":
        place = _skip_blanks(text, place + 1)
        while text[place] not in "}]":
            if text[node.start] == "{":
                name, place = scanstring(text, place + 1)
                child = node.members[name] = _scanned(text, _skip_blanks(text, place) + 1)
            else:
                child = _scanned(text, place)
                node.items.append(child)
            place = _skip_blanks(text, child.end)
            place = _skip_blanks(text, place + 1) if text[place] == "," else place
        node.end = place + 1
    else:
        match = _PLAIN.match(text, place)
        assert match is not None
        node.end = match.end()
    return node


def _skip_blanks(text: str, place: int) -> int:
    match = _BLANK.match(text, place)
    assert match is not None
    return match.end()


def _places(tree: _Node, text: str) -> tuple[dict[tuple[int | None, int], _Node], dict[int, _Node]]:
    """Components by load case and number, and load cases by number."""
    model = tree.members["model"]
    cases = {_number(one, text): one for spectrum in model.all("load_spectrum") for one in spectrum.all("load_cases")}
    components: dict[tuple[int | None, int], _Node] = {(None, _number(c, text)): c for c in model.all("components")}
    for case, node in cases.items():
        components |= {(case, _number(one, text)): one for one in node.all("components")}
    return components, cases


def _number(node: _Node, text: str) -> int:
    value = node.members["id"]
    return int(float(text[value.start : value.end].strip('"')))


def _edits(text: str, node: _Node, attributes: Mapping[str, Addition]) -> Iterator[Edit]:
    there = {_text(text, one.members["id"]): one for one in node.all("attributes") if "id" in one.members}
    for name in attributes.keys() & there.keys():
        yield there[name].start, there[name].end, json_entry(attributes[name])
    yield from _put_inside(
        text, node, "attributes", [json_entry(attribute) for n, attribute in attributes.items() if n not in there]
    )


def _text(text: str, node: _Node) -> str:
    return text[node.start + 1 : node.end - 1]


def _put_inside(text: str, place: _Node, key: str, new: Sequence[str]) -> Iterator[Edit]:
    """Insert values after the last one of a list, which may be empty or missing."""
    if not new:
        return
    items = place.all(key)
    node = place[key]
    if items:
        before = text[max(0, items[-1].start - LONGEST_INDENT) : items[-1].start]
        space = before[len(before.rstrip()) :]
        yield items[-1].end, items[-1].end, "".join(f",{space}{one}" for one in new)
    elif node is not None:
        yield node.start, node.end, f"[{', '.join(new)}]"
    else:
        last = max(member.end for member in place.members.values())
        yield last, last, f', "{key}": [{", ".join(new)}]'
