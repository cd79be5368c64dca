"""Pictures as PNG, and as addresses that contain them, so that a page needs no other file."""

from __future__ import annotations

import base64
import io

import matplotlib.image

from fe_ste.tools.arrays import Floats


def png(pixels: Floats) -> bytes:
    """Return pixels (rows, columns, 4), red, green, blue and opacity from 0 to 1, as PNG."""
    content = io.BytesIO()
    matplotlib.image.imsave(content, pixels, format="png")
    return content.getvalue()


def png_address(content: bytes) -> str:
    """Return the address of a picture that contains it.

    Examples
    --------
    >>> png_address(b"PNG")
    'data:image/png;base64,UE5H'
    """
    return f"data:image/png;base64,{base64.b64encode(content).decode('ascii')}"
