"""Attributes inserted into the XML text of a REXS file; spaces, order, comments and encoding are kept."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

from exugear.exchange.rexs.additions import Addition, Edit, edited, number
from exugear.exchange.rexs.parsing import decoded

LONGEST_INDENT = 200
"""Maximum indentation before an element that is repeated."""
_TAG_END = re.compile(rb"(?:[^\"'>]|\"[^\"]*\"|'[^']*')*>")
_COMPONENT = ("model", "components", "component")
_LOAD_CASE = ("model", "load_spectrum", "load_case")
_IN_LOAD_CASE = (*_LOAD_CASE, "component")


def with_additions(content: bytes, additions: Mapping[tuple[int | None, int], Mapping[str, Addition]]) -> bytes:
    """Return XML with added attributes, which replace existing ones of the same name.

    Parameters
    ----------
    content : file in a form that `exugear.exchange.rexs.parsing.parse_model` can read
    additions : mapping of (load case, component) to attributes by name
    """
    written = decoded(content)
    elements = _elements(written.text.encode("utf-8"))
    edits: list[Edit] = []
    for (case, component), attributes in additions.items():
        place = elements.components.get((case, component))
        if place is not None:
            edits += _edits(elements, place, attributes)
        elif case is not None:
            edits.append(
                _new_component(elements, elements.load_cases[case], elements.components[None, component], attributes)
            )
    # Positions are in bytes; edits are at tags, so that UTF-8 is cut only between characters.
    raw = edited(elements.content.decode("latin-1"), [(a, b, new.encode().decode("latin-1")) for a, b, new in edits])
    text = raw.encode("latin-1").decode("utf-8")
    return written.mark + text.encode(written.encoding, errors="xmlcharrefreplace")


@dataclass
class _Place:
    """Positions of an element in bytes: its beginning, the end of its first tag, and its end."""

    start: int
    tag_end: int
    end: int = 0
    children: list[_Place] = field(default_factory=list)
    name: str = ""


@dataclass
class _Found:
    content: bytes
    components: dict[tuple[int | None, int], _Place] = field(default_factory=dict)
    load_cases: dict[int, _Place] = field(default_factory=dict)

    def space_before(self, place: _Place) -> str:
        """Return the blanks before an element if they are an indentation."""
        before = self.content[max(0, place.start - LONGEST_INDENT) : place.start]
        return before[len(before.rstrip()) :].decode("ascii")

    def first_tag(self, place: _Place) -> str:
        return self.content[place.start : place.tag_end].decode("utf-8")

    def tag(self, place: _Place) -> str:
        """Return the name in the first tag of an element, with its prefix."""
        return self.first_tag(place)[1:-1].rstrip("/").split()[0]


def _elements(content: bytes) -> _Found:
    """Positions of components, their attributes and load cases in UTF-8."""
    found = _Found(content)
    path: list[str] = []
    stack: list[_Place] = []
    case: list[int] = []
    parser = expat.ParserCreate("utf-8")

    def start(tag: str, attributes: dict[str, str]) -> None:
        path.append(tag.rpartition(":")[2])
        begin = parser.CurrentByteIndex
        place = _Place(begin, _end_of_tag(content, begin), name=attributes.get("id", ""))
        stack.append(place)
        if tuple(path) == _LOAD_CASE:
            case[:] = [int(float(place.name))]
            found.load_cases[case[0]] = place
        elif tuple(path) in (_COMPONENT, _IN_LOAD_CASE):
            inside = case[0] if tuple(path) == _IN_LOAD_CASE else None
            found.components[inside, int(float(place.name))] = place

    def end(tag: str) -> None:
        place = stack.pop()
        place.end = _end_of_tag(content, parser.CurrentByteIndex)
        if stack and path[-1] in ("attribute", "component"):
            stack[-1].children.append(place)
        path.pop()

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.Parse(content, True)
    return found


def _end_of_tag(content: bytes, start: int) -> int:
    match = _TAG_END.match(content, start)
    assert match is not None
    return match.end()


def _edits(found: _Found, place: _Place, attributes: Mapping[str, Addition]) -> Iterator[Edit]:
    there = {child.name: child for child in place.children}
    prefix = _prefix(found.tag(place))
    for name in attributes.keys() & there.keys():
        yield there[name].start, there[name].end, _element(attributes[name], prefix)
    new = [_element(attribute, prefix) for name, attribute in attributes.items() if name not in there]
    yield from _put_inside(found, place, new)


def _prefix(tag: str) -> str:
    """Namespace prefix of a tag with its colon; inserted elements need the same prefix as adjacent ones."""
    prefix, colon, _ = tag.rpartition(":")
    return prefix + colon


def _put_inside(found: _Found, place: _Place, new: Sequence[str]) -> Iterator[Edit]:
    """Insert elements after the last one inside an element, or into an empty element."""
    if not new:
        return
    outside = found.space_before(place)
    if place.children:
        space = found.space_before(place.children[-1])
        yield place.children[-1].end, place.children[-1].end, "".join(space + one for one in new)
        return
    space = f"{outside}  " if "\n" in outside else ""
    inside = "".join(space + one for one in new)
    if found.first_tag(place).endswith("/>"):
        yield place.tag_end - 2, place.tag_end, f">{inside}{outside if space else ''}</{found.tag(place)}>"
    else:
        yield place.tag_end, place.tag_end, inside


def _new_component(found: _Found, case: _Place, model: _Place, attributes: Mapping[str, Addition]) -> Edit:
    """Component of a load case, with the first tag of that component in the model."""
    space = found.space_before(case.children[-1] if case.children else case)
    inner = f"{space}  " if "\n" in space else ""
    head = found.first_tag(model)
    head = f"{head[:-2]}>" if head.endswith("/>") else head
    tag = found.tag(model)
    content = "".join(inner + _element(attribute, _prefix(tag)) for attribute in attributes.values())
    return next(iter(_put_inside(found, case, [f"{head}{content}{space if inner else ''}</{tag}>"])))


def _element(addition: Addition, prefix: str) -> str:
    """Attribute in XML notation."""
    head = f"<{prefix}attribute id={quoteattr(addition.name)} unit={quoteattr(addition.unit)}>"
    value = addition.value
    if isinstance(value, tuple):
        entries = "".join(f"<{prefix}c>{number(one)}</{prefix}c>" for one in value)
        inside = f"<{prefix}array>{entries}</{prefix}array>"
    else:
        inside = escape(value) if isinstance(value, str) else number(value)
    return f"{head}{inside}</{prefix}attribute>"
