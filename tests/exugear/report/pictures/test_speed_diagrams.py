"""Diagrams over speed and the still picture of a mode: places by hand, colours where something moves."""

from __future__ import annotations

import io
import re

import matplotlib.image
import numpy as np
import pytest

from exugear.gearbox.units import RPM
from exugear.report.findings.ranking import Envelope, Limit, PeakAmplitude, Ranking, Resonance
from exugear.report.pictures.shapes import BodyShape, TriangleSurface
from exugear.report.pictures.speed_diagrams import TOP, campbell_drawing, strips_of
from exugear.report.pictures.still import SIZE, mode_picture
from exugear.results.spectra.waterfall import OrderLine

MESH = OrderLine("mesh", 60.0)
LIMITS = (Limit(20e-6, 1), Limit(5e-6, 1))
FIRST = Resonance("mesh", 60.0, 100.0 * RPM, 100.0, {"error": PeakAmplitude(10e-6, "", 1, LIMITS)})
SECOND = Resonance("mesh", 60.0, 80.0 * RPM, 80.0, {"error": PeakAmplitude(2e-6, "", 2)})
RANKING = Ranking((FIRST, SECOND), (60.0 * RPM, 120.0 * RPM), False, "shafts")


def test_circles_are_over_the_peaks_of_the_curve_and_bars_span_the_damping():
    speed = np.linspace(0.0, 200.0, 401) * RPM
    amplitude = 0.1e-6 + sum(
        peak / (1.0 + ((speed / RPM - at) / 0.5) ** 2) for at, peak in ((100.0, 9.9e-6), (80.0, 1.9e-6))
    )
    drawn = strips_of(RANKING, {"error": Envelope(speed, amplitude)}, {"error": ("TE", 1e6)}, 90.0, (600.0, 300.0), "")
    (strip,) = drawn.strips
    points = np.array([[float(value) for value in pair] for pair in re.findall(r"([\d.]+) ([\d.]+)", strip.path)])
    highest = points[np.argmin(points[:, 1])]
    first, second = strip.circles
    assert (first.text, first.first, second.text) == ("1", True, "2")
    assert first.x == pytest.approx(highest[0], abs=0.1) and first.x == pytest.approx(drawn.frame.x(100.0))
    assert first.y < highest[1] and second.y > first.y
    ((x, low, high),) = strip.bands
    assert x == first.x
    # Equal factors are equal distances on a logarithmic axis.
    assert low - highest[1] == pytest.approx(highest[1] - high, abs=0.6)
    assert drawn.frame.rated == pytest.approx(drawn.frame.x(90.0))
    assert drawn.frame.span == pytest.approx((drawn.frame.x(60.0), drawn.frame.x(120.0)))


def test_a_run_at_constant_speed_and_infinite_values_are_drawn_all_the_same():
    limits = (Limit(np.inf, 1), Limit(5e-6, 1))
    one = Resonance("mesh", 60.0, 90.0 * RPM, 90.0, {"error": PeakAmplitude(10e-6, "", 1, limits)})
    ranking = Ranking((one,), (90.0 * RPM, 90.0 * RPM), True, "shafts")
    curve = Envelope(np.full(3, 90.0 * RPM), np.array([0.0, 10e-6, np.nan]))
    drawn = strips_of(ranking, {"error": curve}, {"error": ("TE", 1e6)}, None, (600.0, 300.0), "")
    (strip,) = drawn.strips
    places = [*strip.bands[0], strip.circles[0].x, strip.circles[0].y]
    assert np.isfinite(places).all() and drawn.frame.span is None
    assert campbell_drawing(ranking, [(MESH, "mesh")], np.zeros(0), {}, None, (600.0, 400.0), "").circles


def test_the_campbell_diagram_reaches_beyond_the_range_and_its_circles_lie_on_orders():
    frequencies = np.array([0.0, 80.5, 100.2, 129.0, 500.0])
    drawn = campbell_drawing(RANKING, [(MESH, "mesh")], frequencies, {1: 2, 2: 1}, 90.0, (600.0, 400.0), "")
    frame = drawn.frame
    assert frame.speeds[1] > 120.0
    assert [excited for _, excited in drawn.modes] == [True, True, False]  # up to 130 Hz: 1.3 times 100 Hz
    (ray,) = drawn.rays
    for circle in drawn.circles:
        share = (circle.x - frame.left) / (ray.x - frame.left)
        assert circle.y == pytest.approx(frame.bottom + share * (ray.y - frame.bottom), abs=0.5)
    assert [mark.text for mark in drawn.labels] == ["2: 80 Hz", "3: 100 Hz"]
    assert all(mark.y > TOP for mark in drawn.labels)


def test_a_still_picture_is_transparent_around_bodies_and_red_where_they_move():
    square = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3]])

    def plate(name, x):
        return BodyShape(name, name, TriangleSurface(square + [x, 0.0, 0.0], triangles), np.array([x, 0.0, 0.0]))

    bodies = [
        (plate("resting", -1.5), np.zeros(6), None),
        (plate("moving", 1.5), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), None),
    ]
    picture = matplotlib.image.imread(io.BytesIO(mode_picture(bodies)))
    assert picture.shape == (SIZE, SIZE, 4)
    assert picture[0, 0, 3] == 0.0
    shown = picture[picture[..., 3] > 0.9]
    grey = np.ptp(shown[:, :3], axis=1) < 0.1
    red = shown[:, 0] > 1.3 * shown[:, 1]
    assert 0.3 < grey.mean() < 0.7 and 0.3 < red.mean() < 0.7
