"""Arrays in a page: deflated and in base64, each in an element of its own that is unpacked when it is shown."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

KINDS: Final = {"u1": "u8", "u2": "u16", "i1": "i8", "i2": "i16", "u4": "u32", "f4": "f32"}
"""Types that the scripts know, by those of NumPy."""


class ArrayStore:
    """Arrays of one page, by name.

    Examples
    --------
    >>> store = ArrayStore()
    >>> store.add(np.arange(3, dtype="u1"), differences=True)
    {'blob': 'a0', 'type': 'u8', 'shape': [3], 'differences': True}
    """

    def __init__(self) -> None:
        self._packed: list[str] = []
        self._known: dict[bytes, str] = {}

    def add(self, values: NDArray[Any], *, differences: bool = False) -> dict[str, object]:
        """Keep an array and return what the scripts find it by.

        Parameters
        ----------
        values : of a type in `KINDS`
        differences : whether to keep differences along the first axis, which pack better where neighbours are alike
        """
        array = np.ascontiguousarray(values)
        kept = array
        if differences:
            kept = np.diff(array, axis=0, prepend=np.zeros_like(array[:1])).astype(array.dtype)
        little = kept.astype(kept.dtype.newbyteorder("<"), copy=False)
        packed = zlib.compress(little.tobytes(), 9)
        if packed not in self._known:  # planets look alike
            self._known[packed] = f"a{len(self._packed)}"
            self._packed.append(base64.b64encode(packed).decode("ascii"))
        return {
            "blob": self._known[packed],
            "type": KINDS[array.dtype.str[1:]],
            "shape": list(array.shape),
            "differences": differences,
        }

    def elements(self) -> str:
        """All arrays as elements of the page."""
        return "\n".join(
            f'<script type="text/plain" id="{name}">{data}</script>'
            for name, data in zip(self._known.values(), self._packed, strict=True)
        )


def json_element(name: str, content: Mapping[str, Any]) -> str:
    r"""Keep data as JSON in an element of the page; nothing in it ends the element or begins another.

    Examples
    --------
    >>> json_element("data", {"title": "</script>"})
    '<script type="application/json" id="data">{"title":"\\u003c/script\\u003e"}</script>'
    """
    written = json.dumps(content, separators=(",", ":"), allow_nan=False)
    safe = written.translate({ord(sign): f"\\u{ord(sign):04x}" for sign in "<>&"})
    return f'<script type="application/json" id="{name}">{safe}</script>'


def rounded(value: float, digits: int = 5) -> float | None:
    """Round a number to significant digits for JSON; None for what is no number.

    Examples
    --------
    >>> rounded(3.14159265, 3), rounded(float("nan"))
    (3.14, None)
    """
    if np.isfinite(value):
        return float(f"{value:.{digits}g}")
    return None


def rounded_list(values: NDArray[Any], digits: int = 5) -> list[float | None]:
    """Round all numbers of a row."""
    return [rounded(float(value), digits) for value in values]
