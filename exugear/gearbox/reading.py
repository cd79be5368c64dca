"""Reading of the gearbox file: TOML to checked sections, and errors as lines with file, key and remedy."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from exugear.gearbox.named_files import LARGEST_CASE, NamedFileError, Permissions, check_regular, named_file
from exugear.gearbox.renames import GEARBOX_RENAMES, new_name, renamed_hint
from exugear.gearbox.sections.bodies import BodySection
from exugear.gearbox.sections.case import GearboxFile
from exugear.gearbox.sections.entries import GROUND
from exugear.gearbox.sections.examples import example_at
from fe_ste.geometry.checks import GeometryError
from fe_ste.tools.display import ReprMixin

SHOWN_ERRORS = 24
"""Maximum number of errors that a message shows; the exception holds all of them."""
LONGEST_ERROR = 280
"""Maximum number of characters of an error after the name of the file."""


class ListedErrors(ValueError):
    """Several errors of a file, one line each.

    Attributes
    ----------
    errors : tuple of str
        All errors; the message shows the first ones, at most `shown`.
    """

    shown = SHOWN_ERRORS

    def __init__(self, *errors: str) -> None:
        self.errors = tuple(dict.fromkeys(errors))
        more = len(self.errors) - self.shown
        many = "s" if more > 1 else ""
        rest = [f"and {more} more error{many}"] if more > 0 else []
        super().__init__("\n".join([*self.errors[: self.shown], *rest]))


class GearboxFileError(ListedErrors):
    """A gearbox file that cannot be used; the message has one line per error with file, key, value and remedy."""


def error_line(source: str, text: str) -> str:
    """Return the file name and an error as one line; long errors are shortened in the middle to keep key and remedy."""
    text = " ".join(text.split())
    half = (LONGEST_ERROR - 1) // 2
    return f"{' '.join(source.splitlines())}: {text if len(text) <= LONGEST_ERROR else f'{text[:half]}…{text[-half:]}'}"


def read_toml(path: str | Path) -> dict[str, Any]:
    """Raw content of a TOML file.

    Raises
    ------
    GearboxFileError
        The file is not a regular file, is empty or too large, or is not TOML (with line and column).
    """
    return parsed_toml(plain_lines(read_text(path)), str(path))


def plain_lines(text: str) -> str:
    """Return a text whose lines all end with a line feed."""
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_text(path: str | Path) -> str:
    """Read the text of a gearbox or study file with its line ends; unsuitable files are refused before they are read.

    Raises
    ------
    GearboxFileError
        The file is not a regular file, is empty or too large, or is not UTF-8.
    """
    path = Path(path)
    try:
        check_regular(path, LARGEST_CASE)
    except NamedFileError as error:
        raise GearboxFileError(f"{path}: {error}; expected a gearbox file such as cases/grc750/gearbox.toml") from None
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise GearboxFileError(f"{path}: not UTF-8 text at byte {error.start}; expected TOML") from None
    except OSError as error:
        raise GearboxFileError(f"{path}: cannot be read ({error.strerror}); expected a gearbox file") from None
    if not text.strip():
        raise GearboxFileError(f"{path}: the file is empty; expected sections such as [gears.sun]")
    return text


_AT_LINE = re.compile(r"at line (\d+)")
_DECIMAL_COMMA = re.compile(r"=\s*([-+]?\d+),(\d+)\s*(?=[#,}]|$)")
_BARE_TEXT = re.compile(r"=\s*([A-Za-z_][\w.-]*)\s*(?=[#,}]|$)")


def parsed_toml(text: str, source: str) -> dict[str, Any]:
    """Content of a TOML text; an error quotes its line, with the remedy of a decimal comma or of text without quotes.

    Raises
    ------
    GearboxFileError
        The text is not TOML.

    Examples
    --------
    >>> parsed_toml("held_diameter_mm = 36,0", "x.toml")
    Traceback (most recent call last):
    ...
    exugear.gearbox.reading.GearboxFileError: x.toml: ... 'held_diameter_mm = 36,0'; ... decimal point: write 36.0
    """

    def parse() -> dict[str, Any]:
        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            place = _AT_LINE.search(str(error))
            if place is None:
                raise
            line = text.split("\n")[int(place[1]) - 1].strip()
            raise ValueError(f"{error}: {shortened(line)}{_remedy_of_line(line)}") from None

    return parsed(parse, source, "TOML")


def _remedy_of_line(line: str) -> str:
    """Return the remedy of a line of TOML with a decimal comma or with text without quotes; empty for others."""
    if comma := _DECIMAL_COMMA.search(line):
        return f"; numbers have a decimal point: write {comma[1]}.{comma[2]}"
    if (bare := _BARE_TEXT.search(line)) and bare[1] not in ("true", "false", "inf", "nan"):
        meant = bare[1].lower()
        return f"; write {meant}" if meant in ("true", "false") else f'; text needs quotes: "{bare[1]}"'
    return ""


def parsed(parse: Callable[[], dict[str, Any]], source: str, form: str) -> dict[str, Any]:
    """Run a parser of TOML or JSON (`form`) and convert its exceptions to an error of the file.

    Python's parsers raise ValueError for numbers of thousands of digits and exhaust the stack for deep nesting.

    Raises
    ------
    GearboxFileError
        The text is not valid in this form.
    """
    try:
        return parse()
    except RecursionError:
        raise GearboxFileError(
            error_line(source, f"not valid {form}: nested too deep; a gearbox needs 6 levels")
        ) from None
    except ValueError as error:
        why = "a whole number of thousands of digits" if "set_int_max_str_digits" in str(error) else error
        raise GearboxFileError(error_line(source, f"not valid {form}: {why}")) from None


def flattened(content: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Return all values of a file by dotted key.

    Examples
    --------
    >>> flattened({"gears": {"sun": {"teeth": 21}}, "name": "GRC"})
    {'gears.sun.teeth': 21, 'name': 'GRC'}
    """
    found: dict[str, Any] = {}
    for key, value in content.items():
        if isinstance(value, Mapping):
            found |= flattened(value, f"{before}{key}.")
        else:
            found[f"{before}{key}"] = value
    return found


def parse_case(content: dict[str, Any], source: str) -> GearboxFile:
    """Validate raw content; each error becomes a line of the message.

    Examples
    --------
    >>> parse_case({"case": "x.toml", "outputs": {}}, "x.study.toml")
    Traceback (most recent call last):
    ...
    exugear.gearbox.reading.GearboxFileError: x.study.toml: is a study file; run it by exugear study, or specify ...
    >>> parse_case({"name": 3}, "x.toml")
    Traceback (most recent call last):
    ...
    exugear.gearbox.reading.GearboxFileError: x.toml: name = 3: must be text in quotes
    x.toml: overall: this key is missing; for example overall = { input = "carrier", output = "hss", ...
    """
    if {"case", "outputs"} <= content.keys():
        what = "is a study file; run it by exugear study, or specify the gearbox file that it names as case"
        raise GearboxFileError(error_line(source, what))
    try:
        return GearboxFile.model_validate(content)
    except ValidationError as error:
        errors = error.errors(include_url=False)
    raise GearboxFileError(*(error_line(source, text) for text in _described(errors, content)))


def readable(content: Mapping[str, Any]) -> GearboxFile:
    """Readable entries of content with errors: entries that are valid and depend only on valid entries.

    A gear whose profile shift or tip follows from its pairs depends on these, a pair on its gears, and a body on its
    gears and its carrier. A reference to an entry that does not exist is reported if its whole table is readable.

    Returns
    -------
    with the tables of gears, pairs, bodies, bearings and mounts only; other required keys are missing

    Examples
    --------
    >>> gear = {"teeth": 20, "normal_module_mm": 2.0, "face_width_mm": 9.0, "held_diameter_mm": 20.0}
    >>> list(readable({"name": 3, "gears": {"one": gear, "two": {**gear, "teeth": "20"}}}).gears)
    ['one']
    """
    found: dict[str, dict[str, Any]] = {}
    written: dict[str, Mapping[str, Any]] = {}
    for table in _JUDGED:
        entries = content.get(table, {})
        written[table] = entries if isinstance(entries, Mapping) else {}
        found[table] = {}
        model = _inner(_inner(GearboxFile, table), "")
        for name, entry in written[table].items():
            with suppress(ValidationError):
                found[table][name] = model.model_validate(entry)
    before = -1
    while before != (count := sum(map(len, found.values()))):
        before = count
        lost = {table: set(written[table]) - set(entries) for table, entries in found.items()}
        for table in set(_JUDGED) & set(content):
            if not isinstance(content[table], Mapping):
                lost[table].add("")  # marks the whole table as unreadable
        pairs = found["pairs"].items()
        known = set(found["gears"])
        carriers = set(found["bodies"])
        found["pairs"] = {name: pair for name, pair in pairs if not lost["gears"] or {pair.pinion, pair.gear} <= known}
        broken = [
            pair for name, pair in written["pairs"].items() if name in lost["pairs"] and isinstance(pair, Mapping)
        ]
        mates = {str(one.get(end)) for one in broken for end in ("pinion", "gear")}
        found["gears"] = {
            name: gear
            for name, gear in found["gears"].items()
            if name not in mates or not (gear.profile_shift_from_centre_distance or gear.fitted_tip)
        }
        found["bodies"] = {
            name: body
            for name, body in found["bodies"].items()
            if (not lost["gears"] or set(body.gears_z_mm) <= known)
            and (not lost["bodies"] or body.carrier is None or body.carrier in carriers)
        }
    return GearboxFile.model_construct(None, **found)


_JUDGED = ("gears", "pairs", "bodies", "bearings", "mounts")
"""Tables whose entries are validated one by one."""


def _described(errors: list[Any], content: dict[str, Any]) -> Iterator[str]:
    """Yield key, value and remedy of each error; a key that was misspelt is not reported as missing in addition."""
    meant = set()
    locations = {error["loc"] for error in errors}
    for error in errors:
        if error["type"] == "extra_forbidden":
            renamed = new_name([str(part) for part in error["loc"]], GEARBOX_RENAMES)
            meant.add((*error["loc"][:-1], renamed or _nearest(error["loc"])))
    for error in errors:
        path = _path(error["loc"], content)
        key = ".".join(
            str(part) if re.fullmatch(r"[A-Za-z0-9_-]{1,60}", str(part)) else shortened(part) for part in path
        )
        if error["type"] == "too_short" and any(loc[:-1][: len(error["loc"])] == error["loc"] for loc in locations):
            continue  # the array is too short only because its entries are invalid
        if error["type"] == "missing":
            if path not in meant:
                example = example_at(path)
                yield f"{key}: this key is missing{f'; for example {example}' if example else ''}"
            continue
        shown = "" if isinstance(error["input"], Mapping) else f" = {shortened(error['input'])}"
        if error["loc"][-1:] == ("[key]",):
            yield f"{key}: {_A_NAME}"
        else:
            yield f"{key}{shown}: {_remedy(error)}"


_NO_CONTROL = "must be text without control characters"
_A_NAME = "a name consists of letters, digits and underscores, begins with a letter, and has at most 80 characters"
_TYPES = {
    "float_type": "must be a number",
    "int_type": "must be a whole number, without quotes and decimal point",
    "int_from_float": "must be a whole number, without decimal point",
    "bool_type": "must be true or false",
    "string_type": "must be text in quotes",
    "dict_type": "must be a table",
    "model_type": "must be a table",
    "tuple_type": "must be an array in brackets",
}
"""Remedies for values of a wrong type; numbers and texts of a file are not converted."""


def _remedy(error: Any) -> str:
    if error["type"] == "extra_forbidden":
        if hint := renamed_hint([str(part) for part in error["loc"]], GEARBOX_RENAMES):
            return hint
        if near := _nearest(error["loc"]):
            return f"unknown key; did you mean {near!r}?"
        return f"unknown key; known keys are {', '.join(_known_keys(error['loc']))}"
    if error["type"] in _TYPES:
        return _TYPES[error["type"]]
    if error["type"] in ("too_long", "too_short"):
        limit = error["ctx"].get("max_length", error["ctx"].get("min_length"))
        return f"must have {'at most' if error['type'] == 'too_long' else 'at least'} {limit} entries"
    if error["type"] == "string_pattern_mismatch":
        return _NO_CONTROL if "x7f" in error["ctx"]["pattern"] else _A_NAME
    if error["type"] in ("literal_error", "enum"):
        return one_of(error["ctx"]["expected"], error["input"])
    text = str(error["msg"]).removeprefix("Value error, ").replace("Input should", "must", 1)
    return text[:1].lower() + text[1:]


def one_of(expected: str, value: Any) -> str:
    """Return the permitted texts as the remedy of an unknown value, and suggest the most similar one.

    Examples
    --------
    >>> one_of("'linear' or 'iso16281'", "liner")
    "did you mean 'linear'? It must be 'linear' or 'iso16281'"
    """
    near = difflib.get_close_matches(str(value)[:100], re.findall("'([^']*)'", expected), n=1)
    if near:
        return f"did you mean {near[0]!r}? It must be {expected}"
    return f"must be {expected}"


def known_names(kind: str, names: Iterable[str], table: str, wanted: str = "") -> str:
    """Return which names a file has, or which table to add if it has none; suggest the one most similar to `wanted`.

    Examples
    --------
    >>> known_names("gears", ["sun", "ring"], "gears.NAME")
    'gears are sun, ring'
    >>> known_names("gears", ["sun", "ring"], "gears.rign", "rign")
    "did you mean 'ring'? gears are sun, ring"
    >>> known_names("pairs", [], "pairs.p")
    'the file has no pairs; add [pairs.p]'
    """
    known = list(names)
    if not known:
        return f"the file has no {kind}; add [{table}]"
    near = difflib.get_close_matches(wanted[:100], known, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{hint}{kind} are {', '.join(known)}"


def _path(location: tuple[int | str, ...], content: Any) -> tuple[int | str, ...]:
    """Path of an error in the content, without the names that pydantic adds for the branches of a union type."""
    path: list[int | str] = []
    for number, part in enumerate(location):
        inside = (isinstance(content, Mapping) and part in content) or (
            isinstance(content, list | tuple) and isinstance(part, int) and part < len(content)
        )
        if inside:
            content = content[part]
        if inside or (number == len(location) - 1 and isinstance(content, Mapping) and part != "[key]"):
            path.append(part)
    return tuple(path)


def shortened(value: Any, longest: int = 60) -> str:
    """Return a value as text on one line, shortened for messages.

    Examples
    --------
    >>> shortened([1.5, "a"]), shortened(10**30), shortened("x" * 200, 20)
    ("[1.5, 'a']", 'an integer of 100 bits', "'xxxxxxxxxxxxxxxxxx…")
    """
    if isinstance(value, int) and value.bit_length() > 64:  # Python refuses to print thousands of digits
        return f"an integer of {value.bit_length()} bits"
    if isinstance(value, list | tuple):
        text = "[" + ", ".join(shortened(entry, 20) for entry in value[:longest]) + "]"
    elif isinstance(value, Mapping):
        text = "a table"
    else:
        text = repr(value[: longest + 1] if isinstance(value, str) else value)
    return text if len(text) <= longest else text[: longest - 1] + "…"


def _nearest(location: tuple[int | str, ...]) -> str:
    """Known key with a name similar to an unknown one; empty for none."""
    near = difflib.get_close_matches(str(location[-1])[:100], _known_keys(location), n=1)
    return near[0] if near else ""


def _known_keys(location: tuple[int | str, ...]) -> list[str]:
    """Known keys of the section that contains an unknown one."""
    section: Any = GearboxFile
    for part in location[:-1]:
        section = _inner(section, part)
    if isinstance(section, type) and issubclass(section, BaseModel):
        return list(section.model_fields)
    return []


def _inner(section: Any, part: int | str) -> Any:
    """Model of the sub-section `part`: a field of a model, or the value type of a table of named entries."""
    if isinstance(section, type) and issubclass(section, BaseModel):
        field = section.model_fields.get(str(part))
        section = field.annotation if field else None
        candidates = [section, *getattr(section, "__args__", ())]
        models = [c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)]
        if models and getattr(section, "__origin__", None) not in (dict, tuple):
            return models[0]
        return section
    arguments = getattr(section, "__args__", ())
    return next((kind for kind in reversed(arguments) if kind is not Ellipsis), None)


# Source of parts: sections of a gearbox file with its name and permissions, and functions that all builders share

Entry = TypeVar("Entry")
Part = TypeVar("Part")


@dataclass(frozen=True)
class Origin(ReprMixin):
    """A gearbox file with its source and permissions, as used by the builders of parts."""

    case: GearboxFile
    source: str
    """Path or name of the file; the files that it names are in the same folder."""
    permissions: Permissions

    def _line(self) -> str:
        return f" {shortened(self.source)}"

    def error(self, text: str) -> GearboxFileError:
        """Error whose message is the file name followed by `text` (key, value and remedy)."""
        return GearboxFileError(error_line(self.source, text))

    def file(self, key: str, name: str, largest: int) -> Path:
        """Path of a file that the gearbox file names under a key, with at most `largest` bytes.

        Raises
        ------
        GearboxFileError
            The file does not exist or may not be read, see `exugear.gearbox.named_files.named_file`.
        """
        try:
            return named_file(name, Path(self.source).parent, self.permissions, largest)
        except NamedFileError as error:
            raise self.error(f"{key} = {name!r}: {error}") from None

    def guarded(self, key: str, build: Callable[..., Part], *arguments: Any, **named: Any) -> Part:
        """Build a part of gears; geometric errors are reported as errors of the key."""
        try:
            return build(*arguments, **named)
        except GeometryError as error:
            raise self.error(f"{key}: {error}") from None

    @cached_property
    def enabled(self) -> dict[str, BodySection]:
        """Sections of the enabled bodies, by name."""
        return {name: section for name, section in self.case.bodies.items() if section.enabled}

    def are_enabled(self, key: str, *names: str) -> bool:
        """Return whether all bodies are enabled; an unknown name raises an error, a disabled body does not."""
        for name in names:
            if name != GROUND and name not in self.case.bodies:
                known = known_names("bodies", [*self.case.bodies, GROUND], "bodies.NAME", name)
                raise self.error(f"{key}: no body {name!r}; {known}")
        return all(name == GROUND or name in self.enabled for name in names)

    def suffixes(self, family: str) -> list[str]:
        """List the suffixes of the names of a family's bodies: `_1`, `_2`, ... for planets, else a single empty one."""
        count = len(self.enabled[family].planet_angles_deg) if family in self.enabled else 0
        return [f"_{number}" for number in range(1, count + 1)] or [""]

    def instances(self, key: str, family: str, other_family: str) -> list[tuple[str, str, str]]:
        """(suffix, body, other body) for each planet; the other bodies are a single one or a set of equal size."""
        suffixes = self.suffixes(family)
        other_suffixes = self.suffixes(other_family)
        single = suffixes == [""]
        other_single = other_suffixes == [""]
        if not single and not other_single and len(suffixes) != len(other_suffixes):
            raise self.error(f"{key}: {family!r} and {other_family!r} are planet sets of different size")
        return [
            (suffix, family + ("" if single else suffix), other_family + ("" if other_single else suffix))
            for suffix in (other_suffixes if single else suffixes)
        ]


def part_of_each(build: Callable[[str, Entry], Part], sections: Mapping[str, Entry]) -> dict[str, Part]:
    """Build a part of each section.

    Raises
    ------
    GearboxFileError
        Some sections have errors; the exception holds all of them.
    """
    parts: dict[str, Part] = {}
    errors: list[str] = []
    for name, section in sections.items():
        try:
            parts[name] = build(name, section)
        except GearboxFileError as error:
            errors += error.errors
    if errors:
        raise GearboxFileError(*errors)
    return parts


def parts_of_each(build: Callable[[str, Entry], tuple[Part, ...]], sections: Mapping[str, Entry]) -> tuple[Part, ...]:
    """Build the parts of each section, such as one bearing for each planet, as `part_of_each` does."""
    return tuple(part for parts in part_of_each(build, sections).values() for part in parts)
