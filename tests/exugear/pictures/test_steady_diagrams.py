"""Diagrams of steady responses show what they are given where the axes say."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.model.parts import RPM
from exugear.pictures.steady_diagrams import Mark, ModeCurve, plot_campbell_over_speed
from exugear.spectra.orders import OrderLine

SPEED = RPM * np.array([0.0, 300.0, 600.0])
CURVES = [
    ModeCurve("rotational", SPEED, np.array([400.0, 410.0, 420.0])),
    ModeCurve("other", SPEED, np.array([900.0, np.nan, np.nan])),
    ModeCurve("rotational", SPEED, np.array([500.0, 500.0, 500.0])),
]


def test_modes_orders_marks_and_load_cases_lie_where_the_axes_say():
    marks = [Mark(RPM * 410.0, 410.0, 1.0), Mark(RPM * 250.0, 500.0, 0.0)]
    cases = {"run_up": (0.0, RPM * 500.0), "rated": (RPM * 400.0, RPM * 400.0)}
    figure = plot_campbell_over_speed(CURVES, [OrderLine("mesh", 60.0)], marks, cases, harmonics=2)
    above, panel = figure.axes
    drawn = [line.get_xydata().round(9).tolist() for line in panel.lines]
    assert [[0.0, 0.4], [300.0, 0.41], [600.0, 0.42]] in drawn
    # 60 per turn: 1 kHz at 1000 rpm; its double leaves the diagram above, at 1.1 of 900 Hz.
    assert [[0.0, 0.0], [600.0, 0.6]] in drawn
    assert [[0.0, 0.0], [495.0, 0.99]] in drawn
    circles = panel.collections[0]
    np.testing.assert_allclose(circles.get_offsets(), [(410.0, 0.41), (250.0, 0.5)])
    assert circles.get_sizes()[0] > 10.0 * circles.get_sizes()[1]
    assert [text.get_text() for text in figure.legends[0].texts] == ["other", "rotational"]
    assert [label.get_text() for label in above.get_yticklabels()] == ["run_up", "rated"]
    np.testing.assert_allclose(above.lines[0].get_xdata(), [0.0, 500.0])


def test_a_diagram_without_modes_is_refused():
    with pytest.raises(ValueError, match="at least one mode"):
        plot_campbell_over_speed([], [OrderLine("mesh", 60.0)], [], {})


def test_no_load_case_and_no_crossing_leave_the_modes(tmp_path):
    path = tmp_path / "campbell.png"
    plot_campbell_over_speed(CURVES, [], [], {}, path)
    assert path.stat().st_size > 1000
