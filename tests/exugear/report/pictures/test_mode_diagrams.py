"""Diagrams of modes show what they are given where the axes say."""

import math

import numpy as np

from exugear.report.pictures.diagrams import plot_campbell
from exugear.results.spectra.waterfall import OrderLine

RATE = 2048.0
MESH, SECOND = OrderLine("mesh", 60.0), OrderLine("2 × mesh", 120.0)
FASTEST = 2.0 * math.pi * 10.0  # 600 rpm


def test_campbell_marks_crossings():
    figure = plot_campbell([200.0, 450.0], [MESH, SECOND], FASTEST, names=["a", "b"], weights=[0.0, 1.0], title="rigid")
    panel = figure.axes[0]
    first, second = (np.asarray(points.get_offsets()) for points in panel.collections)
    np.testing.assert_allclose(first, [(200.0, 0.2), (450.0, 0.45)])  # 60 per turn: 1 Hz per rpm
    np.testing.assert_allclose(second, [(100.0, 0.2), (225.0, 0.45)])
    assert [text.get_text() for text in panel.texts] == ["a", "b"]
