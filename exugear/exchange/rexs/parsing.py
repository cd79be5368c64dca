"""Documents of REXS in XML and JSON: reading of the model and adding of attributes, with limits for untrusted files."""

from __future__ import annotations

import base64
import binascii
import codecs
import json
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

import numpy as np

from exugear.exchange.rexs.mapping import ATTRIBUTES, LAST_VERSION, LEAST_VERSION, RELATIONS, ROLES, TYPES
from exugear.exchange.rexs.tree import (
    Addition,
    Attribute,
    Component,
    Model,
    Relation,
    RexsError,
    RexsLoadCase,
    Value,
    plain,
)

# Encodings of XML: decoding of the bytes of a REXS file, and encoding of edited text

MULTI_BYTE = frozenset(
    ("utf-8", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "utf-32-be")
    + ("gb2312", "gbk", "gb18030", "big5", "shift_jis", "cp932", "euc_jp", "euc_kr", "cp949")
)
"""Supported multi-byte encodings, which decode every byte sequence uniquely and in linear time."""
_SINGLE_BYTE = re.compile(r"ascii|iso8859-\d{1,2}|cp\d{3,4}|koi8-[rut]|mac-\w+")
"""Supported families of single-byte encodings, by their names in Python; others are not used for text files."""
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_DECLARED = re.compile(rb"\s*<\?xml[^>]{0,200}?\bencoding\s*=\s*[\"']([\w.:-]{1,40})[\"']")


class Decoded(NamedTuple):
    """Text of a file, with its byte order mark and the encoding of the remaining bytes."""

    mark: bytes
    encoding: str
    text: str


def decoded(content: bytes) -> Decoded:
    """Decode XML according to its byte order mark, else its declaration, else as UTF-8.

    Raises
    ------
    RexsError
        The encoding is unknown, or the bytes are invalid in it.

    Examples
    --------
    >>> decoded('<?xml version="1.0" encoding="ISO-8859-1"?><a>ä</a>'.encode("latin-1"))[1:]
    ('iso8859-1', '<?xml version="1.0" encoding="ISO-8859-1"?><a>ä</a>')
    """
    mark, encoding = next((mark for mark in _BYTE_ORDER_MARKS if content.startswith(mark[0])), (b"", ""))
    encoding = encoding or _without_mark(content)
    try:
        return Decoded(mark, encoding, content[len(mark) :].decode(encoding))
    except UnicodeDecodeError as error:
        raise RexsError(
            f"the file does not match its encoding {encoding}: invalid byte 0x{content[len(mark) :][error.start]:02x} "
            f"at {error.start + len(mark)}; expected UTF-8"
        ) from None


def _without_mark(content: bytes) -> str:
    """Return the encoding of a file without a byte order mark: UTF-16 if it has zero bytes, else the declared one."""
    if content[:1] == b"\x00":
        return "utf-16-be"
    if content[1:2] == b"\x00":
        return "utf-16-le"
    match = _DECLARED.match(content)
    name = match[1].decode("ascii", errors="replace") if match else "utf-8"
    with suppress(LookupError):
        known = codecs.lookup(name).name
        if known in MULTI_BYTE or _SINGLE_BYTE.fullmatch(known):
            return known
    raise RexsError(f"the file declares the encoding '{plain(name)}', which is not supported; expected UTF-8")


# Documents: one interface for both formats, with names and values as in the file

DEEPEST = 24
"""Maximum depth of nesting; a REXS file has nine levels."""
MOST_ELEMENTS = 500_000
"""Maximum number of elements of an XML file; the largest known file has 20,000."""
LONGEST_WHOLE = 30
"""Number of digits from which a whole number of JSON is read as a float."""
TOO_DEEP = "the file is nested far deeper than any REXS file"
CODES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}
"""Formats of numbers packed as base64 (since 1.4): little-endian, matrices row by row."""
_JSON_KINDS: Mapping[type, str] = {str: "string", float: "floating_point", tuple: "floating_point_array"}
"""JSON key of a value by its type."""
_JSON_KEYS = {"spectra": "load_spectrum", "changes": "components"}
_XML_PATHS = {
    "relations": ("relations", "relation"),
    "refs": ("ref",),
    "components": ("components", "component"),
    "attributes": ("attribute",),
    "spectra": ("load_spectrum",),
    "load_cases": ("load_case",),
    "changes": ("component",),
}


class _Xml:
    """Tree of elements, whose names include their prefix; a DOCTYPE and entities are refused.

    `model` is the node of the whole model.
    """

    def __init__(self, content: bytes) -> None:
        self._source = decoded(content)
        raw = self._source.text.encode("utf-8")
        builder = ElementTree.TreeBuilder(insert_comments=True, insert_pis=True)
        parser = expat.ParserCreate("utf-8")
        positions: list[int] = []
        depth = 0

        def start(tag: str, attributes: dict[str, str]) -> None:
            nonlocal depth
            depth += 1
            positions.append(parser.CurrentByteIndex)
            if len(positions) > MOST_ELEMENTS or depth > DEEPEST:
                raise RexsError("the file has more elements, or deeper ones, than any REXS file")
            builder.start(tag, attributes)

        def end(tag: str) -> None:
            nonlocal depth
            depth -= 1
            builder.end(tag)
            if not depth:
                last = parser.CurrentByteIndex
                last = raw.index(b">", last) + 1 if raw.startswith(b"</", last) else last
                self._after = raw[last:].decode("utf-8")

        def refuse(*_: object) -> None:
            raise RexsError("the file has a DOCTYPE or an entity, which REXS files must not have")

        parser.buffer_text = True
        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.CharacterDataHandler = builder.data
        parser.CommentHandler = builder.comment
        parser.ProcessingInstructionHandler = builder.pi
        parser.StartDoctypeDeclHandler = refuse
        parser.EntityDeclHandler = refuse
        try:
            parser.Parse(raw, True)
        except expat.ExpatError as error:
            reason = expat.errors.messages.get(error.code, "cannot be parsed")
            raise RexsError(f"not an XML file: {reason} in line {error.lineno}") from None
        self.model: Any = builder.close()
        self._before = raw[: positions[0]].decode("utf-8")
        if _local(self.model) != "model":
            raise RexsError(f"not a REXS file: the root element is '{plain(_local(self.model))}', not 'model'")

    def children(self, node: Element, kind: str) -> list[Any]:
        """Nodes of a kind (key of `_XML_PATHS`) in a node, in the order of the file."""
        found = [node]
        for tag in _XML_PATHS[kind]:
            found = [child for parent in found for child in parent if _local(child) == tag]
        return found

    def head(self, node: Element) -> Mapping[str, Any]:
        """Id, type and similar data of a node."""
        return node.attrib

    def attributes(self, component: Element) -> Iterator[tuple[str, Attribute]]:
        """Yield the attributes of a component by the names of the file."""
        for node in self.children(component, "attributes"):
            value = next((_xml_value(child) for child in _elements(node)), _text(node))
            yield node.get("id", ""), Attribute(value, node.get("unit", ""))

    def put(self, component: Element, additions: Mapping[str, Addition], depth: int) -> None:
        """Add attributes to a component at a depth of nesting, or replace those of the same names."""
        prefix = component.tag.removesuffix("component")
        there = {node.get("id"): node for node in self.children(component, "attributes")}
        for name, addition in additions.items():
            node = Element(f"{prefix}attribute", {"id": name, "unit": addition.unit})
            value = addition.value
            if isinstance(value, tuple):
                array = ElementTree.SubElement(node, f"{prefix}array")
                for number in value:
                    ElementTree.SubElement(array, f"{prefix}c").text = repr(number)
            else:
                node.text = str(value)
            if name in there:
                node.tail = there[name].tail
                component[list(component).index(there[name])] = node
            else:
                _append(component, node, depth + 1)

    def new_change(self, case: Element, component: Element) -> Any:
        """Add an empty node for a component of the model to a load case."""
        node = Element(component.tag, component.attrib)
        _append(case, node, 3)
        return node

    def content(self) -> bytes:
        """Bytes of the document in its encoding, with its comments."""
        mark, encoding, source = self._source
        text = self._before + ElementTree.tostring(self.model, encoding="unicode") + self._after
        if " />" not in source:
            text = text.replace(" />", "/>")
        if "\r\n" in source:
            text = re.sub("\r?\n", "\r\n", text)
        return mark + text.encode(encoding, errors="xmlcharrefreplace")


def _local(node: Element) -> str:
    """Return the name of an element without its prefix; that of a comment equals none of an element."""
    return str(node.tag).rpartition(":")[2]


def _elements(node: Element) -> list[Element]:
    """Return the children of an element without comments."""
    return [child for child in node if isinstance(child.tag, str)]


def _text(node: Element) -> str:
    """Return the text of an element around its children and comments."""
    return "".join([node.text or "", *(child.tail or "" for child in node)]).strip()


def _append(parent: Element, node: Element, depth: int) -> None:
    """Append an element at a depth of nesting, with the indentation of its siblings."""
    if len(parent):
        node.tail = parent[-1].tail
        parent[-1].tail = parent.text
    else:
        node.tail = "\n" + "  " * (depth - 1)
        parent.text = "\n" + "  " * depth
    parent.append(node)


def _xml_value(node: Element) -> Value:
    """Value of an array, a matrix or an array of arrays."""
    if "code" in node.attrib:
        rows = _identifier(node.get("rows"), "rows") if _local(node) == "matrix" else None
        return _unpacked(node.attrib["code"], _text(node), rows)
    return tuple(_xml_value(child) if _local(child) in ("r", "array") else _text(child) for child in _elements(node))


class _Json:
    """Tree of objects, with the methods of `_Xml`."""

    def __init__(self, content: bytes) -> None:
        self._mark = codecs.BOM_UTF8 if content.startswith(codecs.BOM_UTF8) else b""
        try:
            text = content.decode("utf-8-sig")
            self._tree = json.loads(text, parse_constant=_no_number, parse_int=_whole_number)
        except UnicodeDecodeError:
            raise RexsError("the file is not UTF-8, as JSON must be") from None
        except json.JSONDecodeError as error:
            raise RexsError(f"not a JSON file: {error.msg} in line {error.lineno}") from None
        except RecursionError:
            raise RexsError(TOO_DEEP) from None
        self.model: Any = _table(_table(self._tree, "the file").get("model"), "model")
        indent = re.search(r"\n([ \t]+)", text)
        self._indent = indent[1] if indent else None

    def children(self, node: Mapping[str, Any], kind: str) -> list[Any]:
        key = _JSON_KEYS.get(kind, kind)
        values = node.get(key) or []
        if kind == "spectra" and not isinstance(values, list):
            values = [values]
        if not isinstance(values, list):
            raise RexsError(f"not a REXS file: {key} is not a list")
        return [_table(value, f"an entry of {key}") for value in values]

    def head(self, node: Mapping[str, Any]) -> Mapping[str, Any]:
        return node

    def attributes(self, component: Mapping[str, Any]) -> Iterator[tuple[str, Attribute]]:
        for node in self.children(component, "attributes"):
            value = next((value for key, value in node.items() if key not in ("id", "unit")), None)
            if value is not None:
                yield str(node.get("id", "")), Attribute(_json_value(value), str(node.get("unit") or ""))

    def put(self, component: dict[str, Any], additions: Mapping[str, Addition], depth: int) -> None:
        nodes = self.children(component, "attributes")
        new = [
            {"id": name, "unit": addition.unit, _JSON_KINDS[type(addition.value)]: addition.value}
            for name, addition in additions.items()
        ]
        component["attributes"] = [node for node in nodes if str(node.get("id", "")) not in additions] + new

    def new_change(self, case: dict[str, Any], component: Mapping[str, Any]) -> Any:
        node = {key: component[key] for key in ("id", "type", "name") if key in component}
        case["components"] = [*self.children(case, "changes"), node]
        return node

    def content(self) -> bytes:
        try:
            text = json.dumps(self._tree, ensure_ascii=False, indent=self._indent, allow_nan=False)
        except ValueError:
            raise RexsError("the file has a number beyond 1e308, which cannot be written; correct it") from None
        except RecursionError:
            raise RexsError(TOO_DEEP) from None
        return self._mark + text.encode("utf-8", errors="backslashreplace")


def _whole_number(digits: str) -> int | float:
    """Whole number; to save time, one with more digits than any id is a float, which may be infinite."""
    return int(digits) if len(digits) < LONGEST_WHOLE else float(digits)


def _no_number(text: str) -> float:
    raise RexsError(f"the file contains '{text}', which is not a finite number")


def _table(value: Any, what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise RexsError(f"not a REXS file: {what} is not a JSON object")
    return value


def _json_value(value: Any, depth: int = 0) -> Value:
    if isinstance(value, list):
        if depth > 2:
            raise RexsError("an array is nested deeper than a matrix")
        return tuple(_json_value(entry, depth + 1) for entry in value)
    if isinstance(value, dict):
        rows = value.get("rows")
        return _unpacked(
            str(value.get("code", "")), str(value.get("value", "")), None if rows is None else _identifier(rows, "rows")
        )
    if isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if isinstance(value, str | bool | float):
        return value
    return ""


def _unpacked(code: str, text: str, rows: int | None) -> tuple[Value, ...]:
    """Numbers of a base64 text; those of a matrix as its rows.

    A truncated text is refused; REXS requires no padding.
    """
    if code not in CODES:
        raise RexsError(f"an array is packed as '{plain(code)}'; expected one of {', '.join(CODES)}")
    try:
        content = base64.b64decode("".join(text.split()), validate=True)
        values = np.frombuffer(content, CODES[code]).astype(float)
    except (binascii.Error, ValueError) as error:
        raise RexsError(f"an array packed as base64 is damaged: {error}") from None
    if rows is None:
        return tuple(values.tolist())
    if rows < 1 or len(values) % rows:
        raise RexsError(f"a packed matrix of {len(values)} numbers cannot have {rows} rows")
    return tuple(tuple(row) for row in values.reshape(rows, -1).tolist())


Document = _Xml | _Json


def document_of(content: bytes) -> Document:
    """Parse the bytes of an XML or JSON file.

    Raises
    ------
    RexsError
        The file is neither, or has errors.
    """
    start = content[:200].lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n\x00")[:1]
    if start in (b"{", b"["):
        return _Json(content)
    if start == b"<":
        return _Xml(content)
    raise RexsError("not a REXS file: neither XML nor JSON nor a zip archive of one of them")


_FORBIDDEN = ("data_source", "referenced_component_id")


def parse_model(content: bytes) -> Model:
    """Read the model from the bytes of an XML or JSON file.

    Raises
    ------
    RexsError
        The file has errors.
    """
    document = document_of(content)
    head = document.head(document.model)
    version = str(head.get("version", ""))
    match = re.fullmatch(r"(\d{1,3})\.(\d{1,3})(\.\d{1,3})?", version)
    stated_version = (int(match[1]), int(match[2])) if match else (0, 0)
    if not LEAST_VERSION <= stated_version <= LAST_VERSION:
        least, last = (".".join(map(str, pair)) for pair in (LEAST_VERSION, LAST_VERSION))
        raise RexsError(f"the file is of REXS version '{plain(version)}'; versions {least} to {last} can be read")
    errors: list[str] = []
    components: dict[int, Component] = {}
    for node in document.children(document.model, "components"):
        stated = document.head(node)
        number, kind = _component_number(document, node), str(stated.get("type", ""))
        name = str(stated.get("name") or "")
        component = Component(number, TYPES.get(kind, kind), name, _attributes(document, node))
        if component.number in components:
            errors.append(f"two components have the id {component.number}")
        components[component.number] = component
        outside = [key for key in _FORBIDDEN if key in component.attributes]
        if outside:
            errors.append(f"{component}: {outside[0]} refers to data outside the file, which are not read")
    relations = [
        _relation(document, node, components, errors) for node in document.children(document.model, "relations")
    ]
    if errors:
        raise RexsError(*errors)
    cases = tuple(
        RexsLoadCase(
            number,
            {
                _component_number(document, changed): _attributes(document, changed)
                for changed in document.children(node, "changes")
            },
        )
        for number, node in _load_cases(document)
    )
    program = f"{head.get('applicationId', '')} {head.get('applicationVersion', '')}".strip()
    return Model(version, program, components, tuple(relations), cases)


def _component_number(document: Document, node: Any) -> int:
    return _identifier(document.head(node).get("id"), "a component")


def _load_cases(document: Document) -> Iterator[tuple[int, Any]]:
    """Yield number and node of all load cases of all spectra."""
    for spectrum in document.children(document.model, "spectra"):
        for node in document.children(spectrum, "load_cases"):
            yield _identifier(document.head(node).get("id"), "a load case"), node


def _relation(document: Document, node: Any, components: Mapping[int, Component], errors: list[str]) -> Relation:
    head = document.head(node)
    kind = str(head.get("type", ""))
    roles = {}
    for reference in map(document.head, document.children(node, "refs")):
        role = str(reference.get("role", ""))
        number = _identifier(reference.get("id"), "a reference")
        roles[ROLES.get(role, role)] = number
        if number not in components:
            errors.append(f"relation {plain(head.get('id'))} ({plain(kind)}): component {number} does not exist")
    order = head.get("order")
    return Relation(RELATIONS.get(kind, kind), 0 if order is None else _identifier(order, "an order"), roles)


def _attributes(document: Document, node: Any) -> dict[str, Attribute]:
    """Attributes by their current names; if an old and a current name occur together, the current one has priority."""
    attributes = list(document.attributes(node))
    named = {ATTRIBUTES.get(key, key): attribute for key, attribute in attributes}
    return named | {key: attribute for key, attribute in attributes if key in named}


def _identifier(value: Any, what: str) -> int:
    try:
        number = float(value)
        if number == int(number) and abs(number) < 1e15:
            return int(number)
    except (TypeError, ValueError, OverflowError):
        pass
    raise RexsError(f"{what} has the id '{plain(value)}'; expected a whole number")


def put_additions(content: bytes, placed: Mapping[tuple[int | None, int], Mapping[str, Addition]]) -> bytes:
    """Return the bytes of a valid XML or JSON file with added attributes, which replace others of the same name.

    Parameters
    ----------
    placed : mapping of (load case, component) to attributes by name; all of them exist in the file
    """
    document = document_of(content)
    parts = {_component_number(document, node): node for node in document.children(document.model, "components")}
    cases = dict(_load_cases(document))
    for (case, number), additions in placed.items():
        if case is None:
            document.put(parts[number], additions, 2)
            continue
        changes = {_component_number(document, node): node for node in document.children(cases[case], "changes")}
        node = changes[number] if number in changes else document.new_change(cases[case], parts[number])
        document.put(node, additions, 3)
    return document.content()
