"""Containers of REXS files: XML, JSON, or a zip archive with one of them."""

from __future__ import annotations

import copy
import io
import lzma
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from exugear.exchange.rexs.parsing import parse_model, put_additions
from exugear.exchange.rexs.tree import Addition, AdditionValue, Model, RexsError, plain
from fe_ste.tools.files import FileError, open_regular

LARGEST = 64_000_000
"""Maximum size of an unpacked model, bytes; the largest known model has a tenth of it."""
MOST_MEMBERS = 1000
"""Maximum number of members of an archive."""
_DAMAGES = (
    zipfile.BadZipFile,
    NotImplementedError,
    RuntimeError,
    EOFError,
    OSError,
    ValueError,
    struct.error,
    zlib.error,
    lzma.LZMAError,
)
_ENDINGS = (".rexs", ".rexsj", ".xml", ".json")


def read_rexs(path: str | Path) -> Model:
    """Read a REXS file of version 1.0 to 2.0; its format is detected from its content, not from its name.

    No other files are read. In an archive only the single model is unpacked, in memory.

    Raises
    ------
    RexsError
        The file cannot be read, is not a REXS file, or exceeds the limits.

    Examples
    --------
    >>> read_rexs("tests/exugear/exchange/rexs/data/SEW_3-stage_cylindrical_gearbox_1.0.rexs")
    <Model REXS 1.0: 86 components, 82 relations>
    """
    return parsed(_bytes_of(path), path)


def parsed(content: bytes, path: str | Path) -> Model:
    """Read the bytes of a REXS file; `path` is for messages.

    Raises
    ------
    RexsError
        As in `read_rexs`.
    """
    with _errors_naming(path):
        return parse_model(_member(content)[1])


def with_additions(path: str | Path, additions: Iterable[Addition]) -> bytes:
    """Return the bytes of a REXS file with added attributes; format, version, encoding, values and comments are kept.

    An existing attribute of the same name is replaced. Other members of an archive are kept.

    Raises
    ------
    RexsError
        The file cannot be read, or an addition refers to a component that does not exist.
    """
    content = _bytes_of(path)
    model = parsed(content, path)
    cases = {case.number for case in model.load_cases}
    placed: dict[tuple[int | None, int], dict[str, Addition]] = {}
    for addition in additions:
        case = addition.load_case
        number = addition.component
        if number not in model.components or not (case is None or case in cases):
            raise RexsError(
                f"{path}: component {number} does not exist" + ("" if case is None else f", load case {case}")
            )
        named = placed.setdefault((case, number), {})
        if addition.name in named:
            raise RexsError(f"component {number}: two results have the name {addition.name}")
        named[addition.name] = replace(addition, value=rounded(addition.value))
    with _errors_naming(path):
        member, unpacked = _member(content)
        new = put_additions(unpacked, placed)
    return _repacked(content, member, new) if _is_archive(content) else new


def rounded(value: AdditionValue) -> AdditionValue:
    """Round numbers to ten digits for a file.

    Examples
    --------
    >>> rounded(-0.0), rounded((1e20, 1.0 / 3.0)), rounded("text")
    (0.0, (1e+20, 0.3333333333), 'text')
    """
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        return tuple(float(f"{number:.10g}") + 0.0 for number in value)
    return float(f"{value:.10g}") + 0.0


def _repacked(content: bytes, member: str, new: bytes) -> bytes:
    """Return an archive in which one member is replaced; the packed bytes of all others are unchanged."""
    packed = io.BytesIO()
    with _damage_reported(), zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(packed, "w") as target:
        target.comment = old.comment
        members = sorted(old.infolist(), key=lambda member: member.header_offset)
        stops = [*(member.header_offset for member in members[1:]), old.start_dir]
        for one, stop in zip(members, stops, strict=True):
            if one.filename == member:
                target.writestr(one, new)
                continue
            start = one.header_offset
            moved = copy.copy(one)
            moved.header_offset = packed.tell()
            packed.write(content[start:stop])
            target.filelist.append(moved)
            target.start_dir = packed.tell()
    return packed.getvalue()


def _bytes_of(path: str | Path) -> bytes:
    try:
        with open_regular(Path(path)) as file:
            content = file.read(LARGEST + 1)
    except FileError as error:
        raise RexsError(str(error)) from None
    with _errors_naming(path):
        _check_size(len(content))
    return content


@contextmanager
def _errors_naming(path: str | Path) -> Iterator[None]:
    """Put the path of a file before its errors."""
    try:
        yield
    except RexsError as error:
        raise RexsError(*(f"{path}: {line}" for line in error.errors)) from None


def _is_archive(content: bytes) -> bool:
    return content[:2] == b"PK"


def _check_size(size: int) -> None:
    if size > LARGEST:
        raise RexsError(f"is larger than {LARGEST / 1e6:g} MB")


def _member(content: bytes) -> tuple[str, bytes]:
    """Name and bytes of the single model in an archive; any other file is the model itself."""
    if not _is_archive(content):
        return "", content
    with _damage_reported(), zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        if len(members) > MOST_MEMBERS:
            raise RexsError(f"the archive has {len(members)} members; at most {MOST_MEMBERS} are permitted")
        if len({member.header_offset for member in members}) < len(members):
            raise RexsError("the archive is damaged: two of its members overlap")
        models = [member for member in members if member.filename.lower().endswith(_ENDINGS) and not member.is_dir()]
        if len(models) != 1:
            names = ", ".join(plain(model.filename) for model in models[:5]) or "none"
            raise RexsError(f"the archive must contain one model ({', '.join(_ENDINGS)}); it contains {names}")
        if models[0].flag_bits & 1:
            raise RexsError("the archive is encrypted; decrypt it first")
        _check_size(models[0].file_size)
        with archive.open(models[0]) as file:
            unpacked = file.read(LARGEST + 1)
    _check_size(len(unpacked))
    return models[0].filename, unpacked


@contextmanager
def _damage_reported() -> Iterator[None]:
    """Convert the exceptions of the unpacking modules to an error that describes the damage of an archive."""
    try:
        yield
    except RexsError:
        raise
    except _DAMAGES as error:
        raise RexsError(f"the archive is damaged: {plain(error)}") from None
