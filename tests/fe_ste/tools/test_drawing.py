"""Style of all diagrams: a mesh has one colour, a harmonic one dash, and labels at curves do not overlap."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from fe_ste.tools.drawing import COLUMN_WIDTHS, label_curves, order_styles, paper_axes


def test_the_colour_is_that_of_the_mesh_and_the_dash_that_of_the_harmonic() -> None:
    styles = order_styles(["sun", "2 x sun", "3 × sun", "9 x sun", "ring", "2 × ring", "ring - 2 x sun"])
    assert {styles[name]["color"] for name in ("sun", "2 x sun", "3 × sun", "9 x sun")} == {styles["sun"]["color"]}
    assert len({styles[name]["color"] for name in ("sun", "ring", "ring - 2 x sun")}) == 3
    assert styles["2 x sun"]["linestyle"] == styles["2 × ring"]["linestyle"] != styles["sun"]["linestyle"]
    assert len({str(styles[name]["linestyle"]) for name in ("sun", "2 x sun", "3 × sun", "9 x sun")}) == 4


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_labels_at_the_ends_of_curves_do_not_overlap(scale: str) -> None:
    panel = paper_axes(1)
    x = np.array([0.0, 1.0, 2.0])
    for number in range(9):
        panel.plot(x, 1.0 + 0.01 * number * x, label=f"curve {number}")
    panel.plot(x, np.array([1.0, 5.0, np.nan]), label="ends early")
    panel.set_yscale(scale)
    label_curves(panel)
    canvas = FigureCanvasAgg(panel.figure)
    canvas.draw()
    boxes = [text.get_window_extent(canvas.get_renderer()) for text in panel.texts]
    assert len(boxes) == 10
    for box in boxes:
        for other in boxes:
            assert box is other or not box.overlaps(other)


def test_pictures_have_the_width_of_one_or_two_columns() -> None:
    for columns, width in COLUMN_WIDTHS.items():
        assert paper_axes(columns).figure.get_size_inches()[0] == width
    assert paper_axes(2, 6.0).figure.get_size_inches()[1] == 6.0
    with pytest.raises(ValueError, match="columns = 3: must be 1 or 2"):
        paper_axes(3)
