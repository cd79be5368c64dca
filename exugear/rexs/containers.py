"""A REXS file as it lies on the disk: XML, JSON, or a zip archive with one of them."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path

from exugear.rexs.faults import RexsError, plain
from exugear.rexs.parsing import parse_model
from exugear.rexs.tree import Model
from fe_ste.tools.files import FileError, open_regular

LARGEST = 64_000_000
"""Most bytes of a model, unpacked; the largest found is a tenth of it."""
MOST_MEMBERS = 1000
"""Most members of an archive."""
_ENDINGS = (".rexs", ".rexsj", ".xml", ".json")


def read_rexs(path: str | Path) -> Model:
    """Read a REXS file of version 1.0 to 2.0; what it holds tells its kind, not its name.

    Nothing outside the file is read, and of an archive nothing but its one model, in memory.

    Raises
    ------
    RexsError
        The file cannot be read, is no REXS file or asks for more than one may.

    Examples
    --------
    >>> read_rexs("tests/exugear/rexs/data/SEW_3-stage_cylindrical_gearbox_1.0.rexs")
    <Model REXS 1.0: 86 components, 82 relations>
    """
    try:
        with open_regular(Path(path)) as file:
            content = file.read(LARGEST + 1)
    except FileError as error:
        raise RexsError(str(error)) from None
    try:
        _check_size(len(content))
        return parse_model(_member(content) if content[:2] == b"PK" else content)
    except RexsError as error:
        raise RexsError(*(f"{path}: {fault}" for fault in error.faults)) from None


def _check_size(size: int) -> None:
    if size > LARGEST:
        raise RexsError(f"is larger than {LARGEST / 1e6:g} MB")


def _member(content: bytes) -> bytes:
    """Bytes of the one model in an archive."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            members = archive.infolist()
            if len(members) > MOST_MEMBERS:
                raise RexsError(f"the archive has {len(members)} members; {MOST_MEMBERS} are the most")
            models = [one for one in members if one.filename.lower().endswith(_ENDINGS) and not one.is_dir()]
            if len(models) != 1:
                names = ", ".join(plain(one.filename) for one in models[:5]) or "none"
                raise RexsError(f"the archive must hold one model ({', '.join(_ENDINGS)}); it holds {names}")
            if models[0].flag_bits & 1:
                raise RexsError("the archive is encrypted; only open ones can be read")
            _check_size(models[0].file_size)
            with archive.open(models[0]) as file:
                unpacked = file.read(LARGEST + 1)
    except (zipfile.BadZipFile, NotImplementedError, EOFError, OSError, zlib.error) as error:
        raise RexsError(f"the archive is damaged: {error}") from None
    _check_size(len(unpacked))
    return unpacked
