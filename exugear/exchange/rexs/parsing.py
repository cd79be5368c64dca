"""Conversion of REXS files in XML and JSON to the tree of a model, with limits for untrusted files."""

from __future__ import annotations

import base64
import binascii
import codecs
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple
from xml.parsers import expat

import numpy as np

from exugear.exchange.rexs import tree as synonyms
from exugear.exchange.rexs.tree import Attribute, Component, LoadCase, Model, Relation, RexsError, Value, plain

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
    mark, encoding = next((one for one in _BYTE_ORDER_MARKS if content.startswith(one[0])), (b"", ""))
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


# Conversion of REXS files in XML and JSON to the tree of a model, with limits for untrusted files

DEEPEST = 24
"""Maximum depth of nesting; a REXS file has nine levels."""
MOST_ELEMENTS = 500_000
"""Maximum number of elements of an XML file; the largest known file has 20,000."""
LONGEST_WHOLE = 30
"""Number of digits from which a whole number of JSON is read as a float."""
CODES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}
"""Formats of numbers packed as base64 (since 1.4): little-endian, matrices row by row."""
_FORBIDDEN = ("data_source", "referenced_component_id")


def parse_model(content: bytes) -> Model:
    """Read the model from the bytes of an XML or JSON file.

    Raises
    ------
    RexsError
        The file has errors.
    """
    if is_json(content):
        return _model(_header_of_json(content))
    if _start(content) == b"<":
        return _model(_header_of_xml(content))
    raise RexsError("not a REXS file: neither XML nor JSON nor a zip archive of one of them")


def is_json(content: bytes) -> bool:
    """Return whether the bytes of a file begin like JSON."""
    return _start(content) in (b"{", b"[")


def _start(content: bytes) -> bytes:
    return content[:200].lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n\x00")[:1]


@dataclass
class _Raw:
    """A model before conversion, equal for both formats: plain values, and names as in the file."""

    version: str
    program: str
    relations: list[tuple[dict[str, Any], list[dict[str, Any]]]]
    components: list[tuple[dict[str, Any], list[tuple[str, Attribute]]]]
    load_cases: list[tuple[dict[str, Any], list[tuple[dict[str, Any], list[tuple[str, Attribute]]]]]]


# -- the tree ------------------------------------------------------------------------------------------------


def _model(raw: _Raw) -> Model:
    _check_version(raw.version)
    faults: list[str] = []
    components: dict[int, Component] = {}
    for head, attributes in raw.components:
        number = _identifier(head.get("id"), "a component")
        if number in components:
            faults.append(f"two components have the id {number}")
        kind = str(head.get("type", ""))
        named = _present_names(attributes)
        components[number] = Component(number, synonyms.TYPES.get(kind, kind), str(head.get("name") or ""), named)
        outside = [key for key in _FORBIDDEN if key in named]
        if outside:
            faults.append(f"{components[number]}: {outside[0]} refers to data outside the file, which are not read")
    relations = [_relation(head, references, components, faults) for head, references in raw.relations]
    if faults:
        raise RexsError(*faults)
    cases = tuple(
        LoadCase(
            _identifier(head.get("id"), "a load case"),
            {_identifier(one.get("id"), "a component"): _present_names(attributes) for one, attributes in parts},
        )
        for head, parts in raw.load_cases
    )
    return Model(raw.version, raw.program, components, tuple(relations), cases)


def _check_version(version: str) -> None:
    match = re.fullmatch(r"(\d{1,3})\.(\d{1,3})(\.\d{1,3})?", version)
    number = (int(match[1]), int(match[2])) if match else (0, 0)
    if not synonyms.LEAST_VERSION <= number <= synonyms.LAST_VERSION:
        least, last = (".".join(map(str, one)) for one in (synonyms.LEAST_VERSION, synonyms.LAST_VERSION))
        raise RexsError(f"the file is of REXS version '{plain(version)}'; versions {least} to {last} can be read")


def _relation(
    head: Mapping[str, Any],
    references: Sequence[Mapping[str, Any]],
    components: Mapping[int, Component],
    faults: list[str],
) -> Relation:
    kind = str(head.get("type", ""))
    roles = {}
    for reference in references:
        role = str(reference.get("role", ""))
        number = _identifier(reference.get("id"), "a reference")
        roles[synonyms.ROLES.get(role, role)] = number
        if number not in components:
            faults.append(f"relation {plain(head.get('id'))} ({plain(kind)}): component {number} does not exist")
    order = head.get("order")
    return Relation(synonyms.RELATIONS.get(kind, kind), 0 if order is None else _identifier(order, "an order"), roles)


def _present_names(attributes: Sequence[tuple[str, Attribute]]) -> dict[str, Attribute]:
    """Attributes by their current names; if an old and a current name occur together, the current one has priority."""
    named = {synonyms.ATTRIBUTES.get(key, key): attribute for key, attribute in attributes}
    return named | {key: attribute for key, attribute in attributes if key in named}


def _identifier(value: Any, what: str) -> int:
    try:
        number = float(value)
        if number == int(number) and abs(number) < 1e15:
            return int(number)
    except (TypeError, ValueError, OverflowError):
        pass
    raise RexsError(f"{what} has the id '{plain(value)}'; expected a whole number")


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
        return tuple(float(value) for value in values)
    if rows < 1 or len(values) % rows:
        raise RexsError(f"a packed matrix of {len(values)} numbers cannot have {rows} rows")
    return tuple(tuple(float(value) for value in row) for row in values.reshape(rows, -1))


# -- JSON ----------------------------------------------------------------------------------------------------


def _header_of_json(content: bytes) -> _Raw:
    try:
        tree = json.loads(content.decode("utf-8-sig"), parse_constant=_no_number, parse_int=_whole_number)
    except UnicodeDecodeError:
        raise RexsError("the file is not UTF-8, as JSON must be") from None
    except json.JSONDecodeError as error:
        raise RexsError(f"not a JSON file: {error.msg} in line {error.lineno}") from None
    except RecursionError:
        raise RexsError("the file is nested far deeper than any REXS file") from None
    model = _table(_table(tree, "the file").get("model"), "model")
    spectra = model.get("load_spectrum") or []
    spectra = spectra if isinstance(spectra, list) else [spectra]
    cases = [case for spectrum in spectra for case in _tables(spectrum, "load_cases")]
    return _Raw(
        str(model.get("version", "")),
        f"{model.get('applicationId', '')} {model.get('applicationVersion', '')}".strip(),
        [(table, list(_tables(table, "refs"))) for table in _tables(model, "relations")],
        [(table, list(_json_attributes(table))) for table in _tables(model, "components")],
        [(case, [(table, list(_json_attributes(table))) for table in _tables(case, "components")]) for case in cases],
    )


def _whole_number(digits: str) -> int | float:
    """Whole number; to save time, one with more digits than any id is a float, which may be infinite."""
    if len(digits) < LONGEST_WHOLE:
        return int(digits)
    return float(digits)


def _no_number(text: str) -> float:
    raise RexsError(f"the file contains '{text}', which is not a finite number")


def _table(value: Any, what: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise RexsError(f"not a REXS file: {what} is not a JSON object")
    return value


def _tables(parent: Mapping[str, Any], key: str) -> Iterator[dict[str, Any]]:
    """Yield the objects of a list, which may be missing."""
    values = _table(parent, key).get(key) or []
    if not isinstance(values, list):
        raise RexsError(f"not a REXS file: {key} is not a list")
    return (_table(value, f"an entry of {key}") for value in values)


def _json_attributes(component: Mapping[str, Any]) -> Iterator[tuple[str, Attribute]]:
    for attribute in _tables(component, "attributes"):
        values = [value for key, value in attribute.items() if key not in ("id", "unit")]
        if values and values[0] is not None:
            yield str(attribute.get("id", "")), Attribute(_json_value(values[0]), str(attribute.get("unit") or ""))


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


# -- XML -----------------------------------------------------------------------------------------------------


@dataclass
class _Element:
    tag: str
    attributes: dict[str, str]
    children: list[_Element] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        return "".join(self.texts).strip()

    def all(self, tag: str) -> Iterator[_Element]:
        return (child for child in self.children if child.tag == tag)


def _header_of_xml(content: bytes) -> _Raw:
    model = _elements(content)
    if model.tag != "model":
        raise RexsError(f"not a REXS file: the root element is '{plain(model.tag)}', not 'model'")
    get = model.attributes.get
    relations = [one for group in model.all("relations") for one in group.all("relation")]
    components = [one for group in model.all("components") for one in group.all("component")]
    cases = [one for spectrum in model.all("load_spectrum") for one in spectrum.all("load_case")]
    return _Raw(
        get("version", ""),
        f"{get('applicationId', '')} {get('applicationVersion', '')}".strip(),
        [
            (relation.attributes, [dict(reference.attributes) for reference in relation.all("ref")])
            for relation in relations
        ],
        [(component.attributes, list(_xml_attributes(component))) for component in components],
        [
            (case.attributes, [(one.attributes, list(_xml_attributes(one))) for one in case.all("component")])
            for case in cases
        ],
    )


def _xml_attributes(component: _Element) -> Iterator[tuple[str, Attribute]]:
    for one in component.all("attribute"):
        value = _xml_value(one.children[0]) if one.children else one.text
        yield one.attributes.get("id", ""), Attribute(value, one.attributes.get("unit", ""))


def _xml_value(element: _Element) -> Value:
    """Value of an array, a matrix or an array of arrays."""
    if "code" in element.attributes:
        rows = _identifier(element.attributes.get("rows"), "rows") if element.tag == "matrix" else None
        return _unpacked(element.attributes["code"], element.text, rows)
    return tuple(_xml_value(child) if child.tag in ("r", "array") else child.text for child in element.children)


def _elements(content: bytes) -> _Element:
    """Tree of an XML file; a file with declarations of its own is refused."""
    top = _Element("", {})
    open_elements = [top]
    count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MOST_ELEMENTS or len(open_elements) > DEEPEST:
            raise RexsError("the file has more elements, or deeper ones, than any REXS file")
        element = _Element(tag.rpartition(":")[2], attributes)
        open_elements[-1].children.append(element)
        open_elements.append(element)

    def refuse(*_: object) -> None:
        raise RexsError("the file has a DOCTYPE or an entity, which REXS files must not have")

    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: open_elements.pop()
    parser.CharacterDataHandler = lambda text: open_elements[-1].texts.append(text)
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    try:
        parser.Parse(decoded(content).text, True)
    except expat.ExpatError as error:
        reason = expat.errors.messages.get(error.code, "cannot be parsed")
        raise RexsError(f"not an XML file: {reason} in line {error.lineno}") from None
    return top.children[0]
