"""Branches of steady states as curves of the page."""

from __future__ import annotations

import numpy as np

from exugear.report.sections.resonances import branch_curves


def test_a_branch_with_two_folds_is_drawn_in_parts_that_rise_or_fall_and_meet():
    along = np.linspace(0.0, 1.0, 201)
    speed = 100.0 + 30.0 * along + 20.0 * np.sin(2.0 * np.pi * along)
    falls = np.gradient(speed) < 0.0
    parts = branch_curves(speed, 10.0 * along, np.where(falls, 2.0, -2.0))
    assert [part.label.split(":")[0] for part in parts if len(part.x) > 2] == ["stable", "unstable", "stable"]
    for part in parts:
        steps = np.diff(part.x)
        assert (steps >= 0.0).all() or (steps <= 0.0).all()
    for one, other in zip(parts, parts[1:], strict=False):
        assert one.x[-1] == other.x[0]
    assert sum(len(part.x) - 1 for part in parts) == len(speed) - 1


def test_a_branch_without_folds_is_one_curve_whatever_is_known_of_its_stability():
    speed = np.arange(5.0)
    for growth in (np.full(5, -1.0), np.full(5, np.nan)):
        (part,) = branch_curves(speed, speed, growth)
        assert part.style == "line"
        assert part.x.tolist() == speed.tolist()
