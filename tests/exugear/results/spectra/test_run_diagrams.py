"""Diagrams of runs show what they are given where the axes say."""

import math

import numpy as np
import pytest
from matplotlib.figure import Figure

from exugear.gearbox.reading import GearboxFileError
from exugear.gearbox.units import RPM
from exugear.results.folder import keep_case
from exugear.results.solver_comparison import SolverComparison
from exugear.results.spectra.diagrams import plot_waterfalls, pooled_levels
from exugear.results.spectra.resonances import Pick
from exugear.results.spectra.run_spectra import run_waterfall
from exugear.results.spectra.waterfall import OrderLine, Waterfall, order_lines, waterfall
from exugear.transient.outcome import Run

from .run_ups import write_run

RATE = 2048.0
MESH, SECOND = OrderLine("mesh", 60.0), OrderLine("2 × mesh", 120.0)
FASTEST = 2.0 * math.pi * 10.0  # 600 rpm


def run(amplitude=1e-6, unit="m"):
    time = np.arange(round(8 * RATE)) / RATE
    angle = 0.5 * FASTEST * time**2 / 8.0
    signal = amplitude * np.sin(60 * angle)
    return waterfall(signal, FASTEST * time / 8.0, RATE, window_length=0.1, reference=1e-6, unit=unit)


def pick(speed_rpm, level=0.0):
    speed = speed_rpm * 2 * math.pi / 60.0
    return Pick(MESH, 1.0, speed, float(MESH.frequency(speed)), level, 10.0, 8.0)


def test_waterfalls_share_axes_and_colours():
    figure = plot_waterfalls({"soft": run(1e-6), "stiff": run(1e-7)}, [MESH, SECOND])
    soft, stiff, bar = figure.axes
    assert [soft.get_title(loc="left"), stiff.get_title(loc="left")] == ["soft", "stiff"]
    assert soft.images[0].get_clim() == stiff.images[0].get_clim()
    low, high = soft.images[0].get_clim()
    # The tone of 1 µm is the loudest: 0 dB, in the first windows with hardly a period somewhat more.
    assert high == pytest.approx(0.0, abs=1.0) and high - low == pytest.approx(110.0)
    assert soft.get_xlim() == stiff.get_xlim() and soft.get_ylim() == stiff.get_ylim()
    assert bar.get_ylabel() == "Overall transmission error, level / dB re 1 µm"
    assert figure.get_supxlabel() == "Hann window 100 ms, overlap 75 %, 0 dB = 1 µm"


def test_tone_lies_under_its_order_line():
    figure = plot_waterfalls({"run": run()}, [MESH], highest_frequency=1000.0)
    panel = figure.axes[0]
    levels = panel.images[0].get_array()
    left, right, bottom, top = panel.images[0].get_extent()
    column = int(0.75 * levels.shape[1])
    speed = left + (column + 0.5) / levels.shape[1] * (right - left)
    loudest = bottom + (np.argmax(levels[:, column]) + 0.5) / levels.shape[0] * (top - bottom)
    (end_speed, end_frequency) = (panel.lines[0].get_xdata()[1], panel.lines[0].get_ydata()[1])
    # One window sweeps over 7.5 Hz, a cell is 5 Hz high.
    assert loudest == pytest.approx(speed * end_frequency / end_speed, abs=0.012)
    assert end_frequency / end_speed == pytest.approx(1e-3 * 60.0 / 60.0)  # kHz per rpm


def test_order_lines_are_named_where_they_leave():
    panel = plot_waterfalls({"run": run()}, [MESH, SECOND], highest_frequency=800.0).axes[0]
    named = {text.get_text(): text.xy for text in panel.texts}
    fastest = panel.get_xlim()[1]
    assert named["mesh"] == (pytest.approx(fastest), pytest.approx(1e-3 * fastest))
    assert named["2 × mesh"] == (pytest.approx(400.0), pytest.approx(0.8))  # above: 120 per turn reach 800 Hz


def test_marks_are_numbered_at_speed_and_frequency():
    panel = plot_waterfalls({"run": run()}, [], marks={"run": [pick(300.0), pick(480.0)]}).axes[0]
    circles = [(line.get_xdata()[0], line.get_ydata()[0]) for line in panel.lines]
    np.testing.assert_allclose(circles, [(300.0, 0.3), (480.0, 0.48)])
    assert [text.get_text() for text in panel.texts] == ["1", "2"]


def test_different_scales_are_not_drawn_as_one():
    with pytest.raises(ValueError, match="differ in unit"):
        plot_waterfalls({"a": run(), "b": run(unit="rad")}, [])
    with pytest.raises(ValueError, match="no run"):
        plot_waterfalls({}, [])


def test_pooling_keeps_a_line_narrower_than_a_cell():
    amplitude = np.full((400, 4001), 1e-9)
    amplitude[:, 1234] = 1.0
    spectra = Waterfall(
        time=np.arange(400.0),
        speed=np.linspace(0.0, 10.0, 400),
        frequency=np.arange(4001.0),
        amplitude=amplitude,
        window="hann",
        window_length=1.0,
        overlap=0.75,
        reference=1.0,
        unit="m",
    )
    cells = pooled_levels(spectra, 4000.0, 10.0, shape=(100, 50))
    assert cells.shape == (100, 50)
    np.testing.assert_array_equal(cells[30], 0.0)
    np.testing.assert_allclose(np.delete(cells, 30, axis=0), -180.0)


def test_pooling_leaves_speeds_blank_that_the_run_does_not_reach():
    cells = pooled_levels(run(), 1000.0, 2 * FASTEST)
    half = cells.shape[1] // 2
    assert np.isfinite(cells[:, 5 : half - 5]).all() and np.isnan(cells[:, half + 5 :]).all()


def test_run_diagrams_are_written(tmp_path):
    plot_waterfalls({"a": run(), "b": run()}, [MESH], tmp_path / "waterfall.png")
    assert (tmp_path / "waterfall.png").stat().st_size > 20_000


def test_a_run_draws_the_levels_along_its_orders_and_its_waterfall(tmp_path, grc):
    path = write_run(tmp_path / "bushing" / "reference-line_of_action-gears" / "run.nc", "bushing", [500.0])
    finished = Run(path, complete=True, end=8.0, wall=1.0)
    with pytest.raises(GearboxFileError, match="contains no results"):
        finished.plot()
    assert "<p>No diagram: " in finished._repr_html_()
    keep_case(grc, tmp_path)
    assert finished._repr_html_().count("<img ") == 1
    spectra = run_waterfall(path)
    panel = Figure().add_subplot()
    assert finished.plot(ax=panel) is panel
    assert panel.get_xlabel() == "Input speed / rpm"
    assert panel.get_ylabel() == "Overall transmission error, level / dB re 1 µm"
    for curve, line in zip(panel.lines, order_lines(grc), strict=True):
        assert curve.get_label() == line.name
        np.testing.assert_array_equal(curve.get_xdata(), spectra.speed / RPM)
        np.testing.assert_array_equal(curve.get_ydata(), spectra.along(line))
    panel = finished.plot("waterfall", gearbox=grc)
    expected = pooled_levels(spectra, spectra.frequency[-1], spectra.speed.max())
    np.testing.assert_array_equal(np.ma.filled(panel.images[0].get_array(), np.nan), expected)
    assert panel.get_ylabel() == "Frequency / kHz"


def test_both_solvers_are_drawn_as_deviations_from_the_mean_of_exudyn():
    time = np.linspace(0.0, 1.0, 5)
    compared = SolverComparison(
        "Exudyn 1.8", "Newmark", 1.0, {"overall_dte": 1e-3}, time, (1e-6 * time**2, 1e-6 * time)
    )
    compiled, exudyn = compared.plot().lines
    np.testing.assert_allclose(compiled.get_xydata().T, [time, time**2 - 0.5], atol=1e-15)
    np.testing.assert_allclose(exudyn.get_xydata().T, [time, time - 0.5], atol=1e-15)
