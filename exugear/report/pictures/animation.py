"""Animated pictures of standing waves: half a period is rendered, the way back shows the same pictures again."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fe_ste.tools.arrays import Pixels
from fe_ste.tools.files import write_file
from fe_ste.tools.rendering import drawn_part, rendered_image

if TYPE_CHECKING:
    import PIL.Image
    import pyvista
    from matplotlib.figure import Figure


def gif_path(path: str | Path) -> Path:
    """Return where an animation goes.

    Raises
    ------
    ValueError
        If the suffix is not ``.gif``.
    """
    target = Path(path)
    if target.suffix.lower() != ".gif":
        raise ValueError(f"animation {target}: the suffix must be .gif")
    return target


def half_period_images(
    plotter: pyvista.Plotter, frames: int, move: Callable[[float], None]
) -> list[tuple[Pixels, float]]:
    """Render half a period, from one largest deflection to the other, with one margin around all images.

    Parameters
    ----------
    plotter : with all meshes, looking at them
    frames : pictures per period, an even number
    move : moves the meshes to a part of the largest deflection, from 1 to -1

    Returns
    -------
    list of (image, float)
        Pixels, and m per pixel.
    """
    images = []
    count = frames // 2 + 1
    for number in range(count):
        move(math.cos(math.pi * number / (count - 1)))
        images.append(rendered_image(plotter))
    # The darkest of all frames at each pixel shows what any of them needs.
    rows, columns = drawn_part(np.min([image for image, _ in images], axis=0))
    return [(image[rows, columns], pixel) for image, pixel in images]


def write_animation(way_out: Sequence[Figure], target: Path, duration: float) -> Path:
    """Write a standing wave as an animated picture from figures of half a period; `duration` of a period in s."""
    from PIL import Image

    # A standing wave: the way back shows the pictures of the way out.
    finished = [_set_picture(figure) for figure in way_out]
    pictures = finished + finished[-2:0:-1]
    # One palette for all frames, else colours flicker.
    palette = _with_white(pictures[0].quantize(colors=255, method=Image.Quantize.MEDIANCUT))
    indexed = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    pause = round(1e3 * duration / len(indexed))
    content = io.BytesIO()
    rest = indexed[1:]
    indexed[0].save(content, "GIF", save_all=True, append_images=rest, duration=pause, loop=0, optimize=True)
    write_file(target, content.getvalue())
    return target


def _set_picture(figure: Figure) -> PIL.Image.Image:
    """Turn a figure into a frame."""
    from PIL import Image

    finished = io.BytesIO()
    figure.savefig(finished, format="png", dpi=100)
    return Image.open(finished).convert("RGB")


def _with_white(indexed: PIL.Image.Image) -> PIL.Image.Image:
    """Make the lightest colours of a palette white, which averaging has made light greys."""
    colours = np.array(indexed.getpalette()).reshape(-1, 3)
    colours[colours.min(axis=1) >= 250] = 255
    indexed.putpalette(colours.ravel().tolist())
    return indexed
