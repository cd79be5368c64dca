"""What all diagrams share: style, colours, figures written whole or not at all.

matplotlib is imported when a diagram is drawn and needs no display: figures are made without pyplot.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unicodedata import category

from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure


#: Colours that stay apart in print and for colour-blind readers (Okabe and Ito).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
WARNING_COLOUR = "#D0021B"
#: Points of an inch that files of pictures have.
_DPI = 200


@contextmanager
def drawing_style() -> Iterator[None]:
    """Draw in the style of this project inside a ``with`` block; the caller's settings come back after it."""
    import matplotlib

    with matplotlib.rc_context(
        {
            "font.size": 9.0,
            "axes.titlesize": 9.5,
            "axes.labelsize": 9.0,
            "legend.fontsize": 8.0,
            "legend.frameon": False,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.grid": True,
            "axes.axisbelow": True,
            "grid.color": "#DDDDDD",
            "grid.linewidth": 0.6,
            "lines.linewidth": 1.5,
            "figure.dpi": 100,
            "text.parse_math": False,  # names are shown as they are, even with a dollar in them
        }
    ):
        yield


def new_figure(width: float, height: float) -> Figure:
    """Make an empty figure with constrained layout, sizes in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def drawable(text: str) -> str:
    r"""Put a sign in place of what no font can draw: control characters but ends of lines, halves of characters.

    Examples
    --------
    >>> ascii(drawable("mode\x1b 3\n3215 Hz"))
    "'mode\\ufffd 3\\n3215 Hz'"
    """
    return "".join("\ufffd" if letter != "\n" and category(letter) in ("Cc", "Cs") else letter for letter in text)


def finish_figure(figure: Figure, path: str | Path | None) -> Figure:
    """Write a figure, if a path is given, in the format of its suffix, and return it; any text in it can be drawn."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        text.set_text(drawable(text.get_text()))
    if path is not None:
        path = Path(path)
        content = io.BytesIO()
        if path.suffix == ".png":
            _print_png(figure, content)
        else:
            figure.savefig(content, format=path.suffix.removeprefix(".") or None, dpi=_DPI)
        write_file(path, content.getvalue())
    return figure


def _print_png(figure: Figure, content: io.BytesIO) -> None:
    """Write a figure as `savefig` does, which draws everything twice, the first time for the layout alone."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    before = figure.get_dpi()
    figure.set_dpi(_DPI)
    try:
        canvas: Any = FigureCanvasAgg(figure)
        canvas.print_png(content)
    finally:
        figure.set_dpi(before)
