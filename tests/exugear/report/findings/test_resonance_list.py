"""What weakens the amplitudes of single speeds, and the columns of waterfalls."""

from __future__ import annotations

import numpy as np

from exugear.report.sections.run_data import knots_of, pooled
from exugear.steady.findings import SpeedCaveats


def test_caveats_are_those_of_the_nearest_speed() -> None:
    speed = np.array([10.0, 20.0, 30.0])
    ratios = {"left": np.array([0.1, 0.29, 0.9]), "right": np.array([0.0, 0.1, 1.2])}
    caveats = SpeedCaveats(speed, ratios, {"stage": np.array([0.0, 0.05, 0.0])})
    assert caveats.at(11.0) == ()
    (tensile,) = caveats.at(-19.0)
    assert tensile.startswith("tensile force of stage for 5 %")
    (strained,) = caveats.at(29.0)
    assert strained.startswith("dynamic load of right 120 % of its static load")


def test_most_columns_are_for_the_operating_range_and_no_peak_is_lost() -> None:
    knots = knots_of(0.0, 200.0, (10.0, 26.0), 100)
    columns = np.interp([10.0, 26.0], *knots)
    assert np.diff(columns)[0] == 70 and knots[1][-1] == 100
    speed = np.linspace(0.0, 200.0, 2001)
    level = np.full((2001, 4), -60.0)
    level[[150, 151, 1900], 2] = [3.0, 1.0, 7.0]
    cells = pooled(level, speed, knots, 1)
    assert cells.shape == (100, 4) and cells.max() == 7.0
    assert np.flatnonzero(cells[:, 2] > -60.0).tolist() == [
        int(np.interp(speed[150], *knots)),
        *({int(np.interp(speed[151], *knots))} - {int(np.interp(speed[150], *knots))}),
        int(np.interp(speed[1900], *knots)),
    ]
