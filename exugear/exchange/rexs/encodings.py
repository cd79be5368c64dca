"""Encodings of XML: what the bytes of a REXS file are as text, and what turns the text into such bytes again."""

from __future__ import annotations

import codecs
import re
from contextlib import suppress
from typing import NamedTuple

from exugear.exchange.rexs.faults import RexsError, plain

MULTI_BYTE = frozenset(
    ("utf-8", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "utf-32-be")
    + ("gb2312", "gbk", "gb18030", "big5", "shift_jis", "cp932", "euc_jp", "euc_kr", "cp949")
)
"""Encodings with more than a byte to a letter that are read: each byte sequence is one text, in linear time."""
_SINGLE_BYTE = re.compile(r"ascii|iso8859-\d{1,2}|cp\d{3,4}|koi8-[rut]|mac-\w+")
"""Families of encodings with a byte to each letter, as Python calls them; others are no encodings of text files."""
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_DECLARED = re.compile(rb"\s*<\?xml[^>]{0,200}?\bencoding\s*=\s*[\"']([\w.:-]{1,40})[\"']")


class Decoded(NamedTuple):
    """Text of a file: its byte order mark, the encoding of all that follows, and what this says."""

    mark: bytes
    encoding: str
    text: str


def decoded(content: bytes) -> Decoded:
    """Decode XML by its byte order mark, else by what its declaration says, else as UTF-8.

    Raises
    ------
    RexsError
        The encoding is unknown, or the bytes are none of it.

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
            f"the file is not in its encoding {encoding}: the byte 0x{content[len(mark) :][error.start]:02x} at "
            f"{error.start + len(mark)} stands for nothing; REXS is written in UTF-8"
        ) from None


def _without_mark(content: bytes) -> str:
    """Tell the encoding of a file without a byte order mark: UTF-16 shows by its zeros, others are declared."""
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
    raise RexsError(f"the file says that its encoding is '{plain(name)}', which cannot be read; expected UTF-8")
