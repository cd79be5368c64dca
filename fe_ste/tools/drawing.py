"""Shared parts of all diagrams: style, colours, and picture files written completely or not at all.

matplotlib is imported when a diagram is drawn and needs no display: pictures are drawn without pyplot.

pyvista is imported when a picture is rendered. VTK renders into memory without a display through EGL or OSMesa. Without
either, VTK ends the process, so rendering is first tried in a separate process.
"""

from __future__ import annotations

import functools
import importlib.util
import io
import math
import subprocess
import sys
from base64 import b64encode
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from unicodedata import category

import numpy as np

from fe_ste.tools.arrays import Pixels
from fe_ste.tools.files import write_file

if TYPE_CHECKING:
    import pyvista
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colours that stay apart in print and for colour-blind readers (Okabe and Ito).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
WARNING_COLOUR = "#D0021B"
#: Dashes of the first harmonic of a mesh, the second, the third, and all higher ones.
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (6, 1.5, 1.5, 1.5)))
#: Width of a picture in one and in two columns of a paper, inches (about 89 and 183 mm).
COLUMN_WIDTHS = {1: 3.5, 2: 7.2}
#: Points of an inch that files of pictures have, and pictures inside of a notebook.
_DPI = 200
_INLINE_DPI = 90


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
    """Return an empty `matplotlib.figure.Figure` with constrained layout, size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def paper_axes(columns: int = 1, height: float | None = None) -> Axes:
    """Return new axes in the style of this project, of the width of one or two columns of a paper.

    Parameters
    ----------
    columns : 1 or 2
    height : inches; by default three quarters of the width for one column, and half of it for two

    Examples
    --------
    >>> ax = paper_axes(1)
    >>> ax.figure.get_size_inches().tolist()
    [3.5, 2.625]
    """
    if columns not in COLUMN_WIDTHS:
        raise ValueError(f"columns = {columns!r}: must be 1 or 2")
    width = COLUMN_WIDTHS[columns]
    with drawing_style():
        return new_figure(width, height or width * (0.75 if columns == 1 else 0.5)).add_subplot()


def order_styles(names: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return how the curve of each order is drawn: its colour by the mesh, its dash by the harmonic.

    Parameters
    ----------
    names : of orders, such as ``sun_planet`` and ``2 × sun_planet``; any other name counts as a mesh

    Examples
    --------
    >>> styles = order_styles(["sun", "2 × sun", "ring"])
    >>> styles["sun"]["color"] == styles["2 × sun"]["color"], styles["ring"]["color"] == styles["sun"]["color"]
    (True, False)
    >>> styles["sun"]["linestyle"], styles["ring"]["linestyle"]
    ('-', '-')
    """
    meshes: dict[str, int] = {}
    styles = {}
    for name in names:
        number, _, mesh = name.replace(" x ", " × ").partition(" × ")
        harmonic = int(number) if number.isdigit() else 1
        place = meshes.setdefault(mesh if number.isdigit() else name, len(meshes))
        dash = DASHES[min(max(harmonic, 1), len(DASHES)) - 1]
        styles[name] = {"color": COLOURS[place % len(COLOURS)], "linestyle": dash}
    return styles


def label_curves(panel: Axes) -> None:
    """Write the label of each curve at its right end, in its colour, apart from the next; no legend is needed.

    Labels that would overlap are moved up or down as far as necessary.
    """
    curves = []
    for curve in panel.get_lines():
        x, y = (np.asarray(values, dtype=np.float64) for values in curve.get_data())
        drawn = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
        if not str(curve.get_label()).startswith("_") and drawn.size:
            curves.append((curve, x[drawn[-1]], y[drawn[-1]]))
    if not curves:
        return
    to_axes = panel.transData + panel.transAxes.inverted()
    ends = np.array([to_axes.transform((x, y)) for _, x, y in curves]).clip(0.0, 1.0)
    size = 7.0
    least = 1.25 * size / 72.0 / (panel.get_window_extent().height / panel.figure.dpi)
    order = np.argsort(ends[:, 1])
    heights = ends[order, 1]
    for place in range(1, heights.size):
        heights[place] = max(heights[place], heights[place - 1] + least)
    heights -= max(0.0, heights[-1] - 1.0)
    for place, index in enumerate(order):
        panel.annotate(
            str(curves[index][0].get_label()),
            (ends[index, 0], heights[place]),
            (4, 0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center",
            fontsize=size,
            color=curves[index][0].get_color(),
            annotation_clip=False,
        )


@contextmanager
def axes_or_new(ax: Axes | None, width: float = 5.0, height: float = 3.4) -> Iterator[Axes]:
    """Give axes to draw on inside a ``with`` block: those of the caller in their own style, or new ones in this style.

    Parameters
    ----------
    width, height : size of a new picture, inches
    """
    if ax is None:
        with drawing_style():
            yield new_figure(width, height).add_subplot()
        return
    import matplotlib

    with matplotlib.rc_context({"text.parse_math": False}):
        yield ax


def drawable(text: str) -> str:
    r"""Put a sign in place of what no font can draw: control characters but ends of lines, halves of characters.

    Examples
    --------
    >>> ascii(drawable("mode\x1b 3\n3215 Hz"))
    "'mode\\ufffd 3\\n3215 Hz'"
    """
    return "".join("\ufffd" if letter != "\n" and category(letter) in ("Cc", "Cs") else letter for letter in text)


def finish_figure(figure: Figure, path: str | Path | None) -> Figure:
    """Save a diagram, if a path is given, in the format of its suffix, and return it; any text can be drawn."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        text.set_text(drawable(text.get_text()))
    if path is not None:
        path = Path(path)
        content = io.BytesIO()
        if path.suffix == ".png":
            _print_png(figure, content, _DPI)
        else:
            figure.savefig(content, format=path.suffix.removeprefix(".") or None, dpi=_DPI)
        write_file(path, content.getvalue())
    return figure


def inline_picture(figure: Figure, name: str) -> str:
    """Return a diagram as an HTML image that contains its PNG; `name` is its alternative text."""
    content = io.BytesIO()
    _print_png(finish_figure(figure, None), content, _INLINE_DPI)
    return f'<img alt="{escape(name)}" src="data:image/png;base64,{b64encode(content.getvalue()).decode("ascii")}">'


def _print_png(figure: Figure, content: io.BytesIO, dpi: int) -> None:
    """Save a diagram as `savefig` does, which draws everything twice, the first time only for the layout."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    before = figure.get_dpi()
    figure.set_dpi(dpi)
    try:
        canvas: Any = FigureCanvasAgg(figure)
        canvas.print_png(content)
    finally:
        figure.set_dpi(before)


# What all rendered pictures share: an off-screen plotter, images without margins, a scale

_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.AddRenderer(vtkRenderer())
window.Render()
"""


class RenderingError(RuntimeError):
    """Three-dimensional pictures cannot be made on this machine."""


@functools.cache
def _probe_rendering() -> bool:
    finished = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, check=False, timeout=120)
    return finished.returncode == 0


def require_rendering() -> None:
    """Check that pyvista is installed and can render without a display.

    Raises
    ------
    RenderingError
        With what to install. VTK ends the process where OpenGL is not available, hence the trial in another one.
    """
    if importlib.util.find_spec("pyvista") is None:
        raise RenderingError("3-D pictures need pyvista: pip install 'exugear[pictures]'")
    if not _probe_rendering():
        raise RenderingError(
            "VTK cannot render off-screen here: it found no OpenGL. No display is needed, but on Debian or "
            "Ubuntu either EGL with Mesa's software renderer (apt-get install libegl1 libgl1 libxrender1) or "
            "OSMesa "
            "(apt-get install libosmesa6 libx11-6)."
        )


@contextmanager
def offscreen_plotter(width: int, height: int) -> Iterator[pyvista.Plotter]:
    """Open a plotter on a white image of given size in pixels, with parallel projection and smooth edges.

    Raises
    ------
    RenderingError
        See `require_rendering`.
    """
    require_rendering()
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    # Before it takes EGL, VTK complains on standard error that there is no X server.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    plotter = pyvista.Plotter(off_screen=True, window_size=[width, height], lighting="three lights")
    try:
        plotter.background_color = pyvista.Color("white")
        plotter.camera.parallel_projection = True
        plotter.enable_anti_aliasing("ssaa")
        yield plotter
    finally:
        plotter.close()
        vtkLogger.SetStderrVerbosity(verbosity)


def rendered_image(plotter: pyvista.Plotter) -> tuple[Pixels, float]:
    """Render a plotter in parallel projection.

    Returns
    -------
    image : (height, width, 3) array of uint8
    pixel : size of a pixel in the units of the scene
    """
    plotter.render()  # what has moved since the last picture
    image = np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    return image, 2.0 * plotter.camera.parallel_scale / image.shape[0]


def drawn_part(image: Pixels, margin: int = 20) -> tuple[slice, slice]:
    """Rows and columns of an image that are not white, and `margin` pixels around them."""
    drawn = np.any(image != 255, axis=-1)
    rows = np.flatnonzero(drawn.any(axis=1))
    columns = np.flatnonzero(drawn.any(axis=0))
    if not rows.size:
        return slice(None), slice(None)
    top = max(0, int(rows[0]) - margin)
    left = max(0, int(columns[0]) - margin)
    return slice(top, int(rows[-1]) + 1 + margin), slice(left, int(columns[-1]) + 1 + margin)


def without_margins(image: Pixels, margin: int = 20) -> Pixels:
    """Cut the white borders of an image down to `margin` pixels."""
    return image[drawn_part(image, margin)]


def nice_length(longest: float) -> float:
    """Longest round length (1, 2 or 5 times a power of ten) that does not exceed `longest`.

    Examples
    --------
    >>> nice_length(0.037), nice_length(0.6), nice_length(0.012)
    (0.02, 0.5, 0.01)
    """
    power = 10.0 ** math.floor(math.log10(longest))
    return float(f"{max(step * power for step in (1.0, 2.0, 5.0) if step * power <= longest * (1 + 1e-12)):.3g}")


def place_picture(panel: Axes, image: Pixels, pixel: float, title: str = "") -> None:
    """Show a rendered image in parallel projection with a scale bar below; `pixel` is a pixel's size in m."""
    panel.imshow(image, interpolation="antialiased")
    panel.set_axis_off()
    panel.set_title(drawable(title), loc="left")
    height, width = image.shape[:2]
    bar = nice_length(0.2 * width * pixel)
    below = 1.04 * height
    panel.plot([0.0, bar / pixel], [below, below], color="black", linewidth=2.5, solid_capstyle="butt")
    panel.text(bar / pixel + 0.015 * width, below, f"{1e3 * bar:g} mm", ha="left", va="center")
    panel.set(xlim=(0, width), ylim=(1.08 * height, 0))
