"""Lines of steady responses read as waterfalls: levels are those of the lines, and nothing is drawn beside them."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.results.spectra.line_spectra import LineSpectra, line_peaks, line_spectra
from exugear.results.spectra.resonances import pick_resonances
from exugear.results.spectra.waterfall import OrderLine

MESH, OTHER = OrderLine("mesh", 20.0), OrderLine("other", 50.0)
RESONANCE, DAMPING = 300.0, 0.01


def resonant(unknown: tuple[float, ...] = ()) -> LineSpectra:
    """An oscillator that the mesh drives through its resonance, and a flat line beside it."""
    speed = 2.0 * np.pi * np.linspace(50.0, 600.0, 1101) / MESH.order
    ratio = MESH.frequency(speed) / RESONANCE
    amplitude = np.stack([1e-6 / np.abs(1.0 - ratio**2 + 2j * DAMPING * ratio), np.full(speed.size, 1e-7)], axis=1)
    return line_spectra(speed, np.array([MESH.order, OTHER.order]), amplitude, 700.0, unknown=unknown)


def test_the_peak_of_an_oscillator_has_its_frequency_level_and_half_width():
    """Highest at f0 sqrt(1 - 2 zeta^2) with 1 / (2 zeta) to first order; half as wide as zeta f0 at half power."""
    (peak,) = pick_resonances(resonant(), [MESH, OTHER], peaks=line_peaks)
    assert peak.line is MESH
    # Frequencies stand 0.5 Hz apart; the level is that of the nearest, less than 1 % of half the width off.
    assert peak.frequency == pytest.approx(RESONANCE, abs=0.5)
    assert peak.level == pytest.approx(20.0 * np.log10(0.5 / DAMPING), abs=0.03)
    assert peak.resolution == pytest.approx(DAMPING * RESONANCE, abs=0.5)


def test_levels_along_an_order_are_those_of_its_line_and_none_of_others():
    spectra = resonant()
    assert np.allclose(spectra.along(OTHER), -20.0, atol=1e-9)
    assert np.isnan(spectra.along(OrderLine("third", 33.0))).all()


def test_the_picture_has_each_line_where_it_runs_and_silence_elsewhere():
    spectra = resonant()
    rows = spectra.frequency[1]
    for frame in range(0, spectra.speed.size, 37):
        lines = [float(line.frequency(spectra.speed[frame])) for line in (MESH, OTHER)]
        for line, order in zip((MESH, OTHER), lines, strict=True):
            if order < spectra.frequency[-1]:
                drawn = spectra.level[frame, round(order / rows)]
                # Where lines cross, the louder one is drawn. Pictures have single precision.
                assert drawn >= spectra.along(line)[frame] - 1e-4
        silent = np.min([np.abs(spectra.frequency - order) for order in lines], axis=0) > (2.0 * 2 + 1) * rows
        assert (spectra.amplitude[frame, silent] == 0.0).all()
    assert spectra.amplitude.max() == pytest.approx(1e-6 * 0.5 / DAMPING, rel=3e-3)


def test_speeds_without_a_state_are_left_blank_to_the_next_known_ones():
    gap = 2.0 * np.pi * 300.25 / MESH.order
    spectra = resonant((gap,))
    blank = np.isnan(spectra.along(MESH))
    assert np.isfinite(resonant().along(MESH)).all()
    # Known states stand at 300.0 and 300.5 Hz and are drawn.
    shown = MESH.frequency(spectra.speed[~blank])
    assert not ((shown > 300.0 + 1e-6) & (shown < 300.5 - 1e-6)).any()
    assert np.abs(shown - 300.0).min() < 1e-6 and np.abs(shown - 300.5).min() < 1e-6
    assert (spectra.amplitude[blank] == 0.0).all()
