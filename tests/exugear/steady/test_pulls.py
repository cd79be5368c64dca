"""Teeth that would have to pull: shares of time in closed form."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from exugear.steady.peaks import pulls

STATIC = 1000.0


def response(amplitudes: list[float], static: float = STATIC, waves: float = 0.0) -> xr.Dataset:
    """A mesh of planets with one line over its static force at each speed, and a cosine wave that stands still."""
    force = np.zeros((len(amplitudes), 2, 2), dtype=complex)
    force[:, 0, 0], force[:, 1, 0], force[:, 0, 1] = static, amplitudes, waves
    return xr.Dataset(
        {
            "speed": ("point", 10.0 * np.arange(1, len(amplitudes) + 1)),
            "order": ("line", [0.0, 20.0]),
            "amplitude": (("point", "line", "signal"), np.abs(force)),
            "phase": (("point", "line", "signal"), np.angle(force)),
        },
        {"signal": ["mesh_force sun", "mesh_force sun cosine"]},
    )


@pytest.mark.parametrize("static", [STATIC, -STATIC])
def test_a_single_line_pulls_for_the_share_of_the_arc_cosine(static):
    """F + a cos x has the other sign for acos(F / a) / pi of the time."""
    (pull,) = pulls(response([900.0, 1500.0, 3000.0], static))
    assert (pull.name, pull.count, pull.speed) == ("sun", 2, 30.0)
    # 4096 drawn angles: one standard deviation is 0.008.
    assert pull.share == pytest.approx(np.arccos(1.0 / 3.0) / np.pi, abs=0.03)


def test_the_planet_that_a_wave_unloads_pulls_first():
    assert pulls(response([0.0, 900.0, 999.0])) == ()
    (pull,) = pulls(response([900.0], waves=400.0))
    assert pull.share == pytest.approx(np.arccos(600.0 / 900.0) / np.pi, abs=0.03)
