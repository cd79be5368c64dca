"""Mass properties of tubes: textbook bodies, and integrals taken numerically."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fe_ste.geometry.cylinders import Tube, mass_properties

STEEL = 7850.0


def test_a_hollow_cylinder_has_its_textbook_inertia() -> None:
    """J = m (R^2 + r^2) / 2 about its axis, m (3 (R^2 + r^2) + L^2) / 12 across."""
    found = mass_properties([Tube(start=0.2, length=0.3, outer=0.1, inner=0.04, density=STEEL)])
    mass = STEEL * math.pi * (0.05**2 - 0.02**2) * 0.3
    squares = 0.05**2 + 0.02**2
    assert found.mass == pytest.approx(mass, rel=1e-13)
    assert found.axial == pytest.approx(0.5 * mass * squares, rel=1e-13)
    assert found.transverse == pytest.approx(mass * (3.0 * squares + 0.3**2) / 12.0, rel=1e-12)
    assert found.centre == pytest.approx(0.35, rel=1e-13)


def test_a_pointed_cone_has_its_textbook_inertia() -> None:
    """J = 3 m R^2 / 10 about its axis, 3 m (R^2 + L^2 / 4) / 20 across; its centre L / 4 from the base."""
    found = mass_properties([Tube(start=0.0, length=0.3, outer=0.1, inner=0.0, outer_end=0.0, density=STEEL)])
    mass = STEEL * math.pi * 0.05**2 * 0.3 / 3.0
    assert found.mass == pytest.approx(mass, rel=1e-13)
    assert found.axial == pytest.approx(0.3 * mass * 0.05**2, rel=1e-13)
    assert found.transverse == pytest.approx(0.15 * mass * (0.05**2 + 0.3**2 / 4.0), rel=1e-12)
    assert found.centre == pytest.approx(0.075, rel=1e-13)


def test_a_hollow_cone_is_the_sum_of_its_slices() -> None:
    """10,000 discs, each a cylinder: the midpoint rule errs by their squared number, 1e-8."""
    tube = Tube(start=-0.1, length=0.4, outer=0.12, outer_end=0.2, inner=0.06, inner_end=0.02, density=STEEL)
    edges = np.linspace(0.0, 1.0, 10_001)
    share = 0.5 * (edges[1:] + edges[:-1])
    slices = [
        Tube(
            start=-0.1 + 0.4 * low,
            length=0.4 * (high - low),
            outer=0.12 + s * 0.08,
            inner=0.06 - s * 0.04,
            density=STEEL,
        )
        for low, high, s in zip(edges[:-1], edges[1:], share, strict=True)
    ]
    one, sliced = mass_properties([tube]), mass_properties(slices)
    for key in ("mass", "axial", "transverse", "centre"):
        assert getattr(one, key) == pytest.approx(getattr(sliced, key), rel=1e-7)


def test_pins_aside_are_spread_evenly_around_the_axis() -> None:
    """Three pins as points at 120 deg: the sum over them of m y^2 is 3 m R^2 / 2, about either axis."""
    pin = Tube(start=0.0, length=0.1, outer=0.03, inner=0.0, density=STEEL)
    on_axis, aside = (mass_properties([pin] * 3), mass_properties([Tube(**{**vars(pin), "aside": 0.2})] * 3))
    places = 0.2 * np.exp(2j * np.pi * np.arange(3) / 3)
    each = on_axis.mass / 3.0
    assert aside.axial - on_axis.axial == pytest.approx(each * np.sum(np.abs(places) ** 2), rel=1e-12)
    for direction in (places.real, places.imag):
        assert aside.transverse - on_axis.transverse == pytest.approx(each * np.sum(direction**2), rel=1e-12)


def test_nothing_has_no_mass() -> None:
    assert mass_properties([]).mass == 0.0
    assert mass_properties([Tube(start=0.0, length=0.1, outer=0.1, inner=0.1, density=STEEL)]).axial == 0.0
