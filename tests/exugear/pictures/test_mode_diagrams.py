"""Diagrams of modes show what they are given where the axes say."""

import math

import numpy as np
import pytest

from exugear.pictures.mode_diagrams import Sensitivity, plot_campbell, plot_mode_energies, plot_sensitivities
from exugear.spectra.orders import OrderLine

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


def test_sensitivities_share_the_frequency_axis():
    values = np.array([0.2, 0.5, 1.0])
    frequencies = np.column_stack([1000 * values, [np.nan, 3000.0, 3100.0]])
    sweeps = [
        Sensitivity("housing factor", values, frequencies, default=0.5),
        Sensitivity("inertia / kg m²", values, frequencies, weights=np.ones((3, 2)), logarithmic=True),
    ]
    figure = plot_sensitivities(sweeps, target=3215.0, window=(500.0, 3500.0), title="bushing")
    left, right = figure.axes
    assert left.get_ylim() == right.get_ylim() == (0.5, 3.5)
    assert right.get_xscale() == "log"
    np.testing.assert_allclose(left.lines[0].get_ydata(), values)
    assert "3215 Hz" in [text.get_text() for text in left.texts]


def test_sensitivity_of_wrong_shape_is_named():
    with pytest.raises(ValueError, match="'housing factor'"):
        plot_sensitivities([Sensitivity("housing factor", np.zeros(3), np.zeros((2, 4)))])


def test_energy_bars_are_per_cent_and_gather_the_small():
    strain = {"mesh": 0.6, "bearing": 0.392, "small": 0.005, "tiny": 0.003}
    figure = plot_mode_energies(strain, {"shaft": 1.0}, title="3208 Hz")
    left, right = figure.axes
    assert [label.get_text() for label in left.get_yticklabels()] == ["mesh", "bearing", "others"]
    np.testing.assert_allclose([bar.get_width() for bar in left.patches], [60.0, 39.2, 0.8])
    assert [label.get_text() for label in right.get_yticklabels()] == ["shaft"]


def test_mode_diagrams_are_written(tmp_path):
    plot_mode_energies({"mesh": 1.0}, {"shaft": 1.0}, tmp_path / "energies.svg")
    assert (tmp_path / "energies.svg").read_text().startswith("<?xml")
