"""Flank tolerances of ISO 1328-1:2013 against the tables of its first edition, and by their own rules."""

from __future__ import annotations

import math

import pytest

from fe_ste.standards.iso1328 import DEVIATIONS, tolerance

MIDDLE = {"reference_diameter": 80e-3, "normal_module": 2.65e-3, "face_width": 28e-3}
"""Geometric means of the ranges 50 to 125 mm, 2 to 3.5 mm and 20 to 40 mm, which the tables of 1995 were made for."""


@pytest.mark.parametrize(
    ("deviation", "table_of_1995"),
    [("single_pitch", 6.0), ("cumulative_pitch", 19.0), ("profile_slope", 5.0), ("helix_slope", 6.0), ("runout", 15.0)],
)
def test_class_5_is_near_the_tables_of_the_first_edition(deviation, table_of_1995):
    """The second edition has other formulas; by its foreword the classes stay about what they were: 15 % at most."""
    assert 1e6 * tolerance(deviation, 5, **MIDDLE) == pytest.approx(table_of_1995, rel=0.15)


@pytest.mark.parametrize("deviation", DEVIATIONS)
def test_two_classes_double_a_tolerance_but_for_rounding(deviation):
    large = {"reference_diameter": 2.0, "normal_module": 20e-3, "face_width": 0.4}
    for finer in range(3, 9):
        ratio = tolerance(deviation, finer + 2, **large) / tolerance(deviation, finer, **large)
        assert ratio == pytest.approx(2.0, rel=0.06)


def test_values_are_rounded_as_a_drawing_has_them():
    for tolerance_class in range(1, 12):
        for deviation in DEVIATIONS:
            micrometres = 1e6 * tolerance(deviation, tolerance_class, **MIDDLE)
            grain = 1.0 if micrometres > 10.0 else 0.5 if micrometres > 5.0 else 0.1
            assert math.isclose(micrometres / grain, round(micrometres / grain), abs_tol=1e-6)


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"normal_module": 0.1}, "module 100 mm"), ({"face_width": 1e-3}, "face width 1 mm")],
)
def test_a_gear_outside_the_standard_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        tolerance("runout", 6, **{**MIDDLE, **changes})


def test_an_unknown_class_or_deviation_is_refused():
    with pytest.raises(ValueError, match="classes 1 to 11"):
        tolerance("runout", 12, **MIDDLE)
    with pytest.raises(ValueError, match="deviations are profile_slope"):
        tolerance("lead", 6, **MIDDLE)
