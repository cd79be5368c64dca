"""Motions far slower than a step: they must not make a step look unstable."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.system.build import assemble
from exugear.transient.compiled.integrator import (
    MARGIN,
    RUNGE_KUTTA,
    SLOWEST,
    adams,
    choose_integration,
    growth,
    stabilised,
)

SWAYING = 1e-9
"""Growth in a step that round-off makes of slow motions; see `GROWTH_ALLOWED` of the step."""


def test_a_train_on_pins_that_are_off_finds_a_stable_step(grc, stiffness):
    """Such a train rolls as a pendulum or falls away from its place, at some 1/s: seen in a study of pins' errors."""
    errors = {1: (12.0, -7.0), 2: (-20.0, 15.0), 3: (9.0, 21.0)}
    pins = {
        f"pins.pin_{n}.{key}": value
        for n, (radial, tangential) in errors.items()
        for key, value in (("body", f"planet_{n}"), ("radial_um", radial), ("tangential_um", tangential))
    }
    assembly = assemble(grc.varied(pins), Choice("bushing"), stiffness)
    assert choose_integration(assembly, 20e3, 6.4e3).margin >= MARGIN


@pytest.mark.parametrize("method", [stabilised(), adams(4), adams(6), RUNGE_KUTTA], ids=lambda method: method.name)
def test_methods_follow_motions_at_the_limit_without_growth(method):
    """At the limit their own error is 1e-15; what is left is round-off of double roots."""
    swaying = np.array([1j * SLOWEST])
    assert float(np.abs(growth(method, swaying, 1.0)).max()) <= 1.0 + SWAYING
