"""Motions in time as the rotating frame sees them, against the frame's own way from its coordinates to motions."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.steady.mean_system.planet_sets import planet_sets
from exugear.steady.mean_system.rotating_frame import RotatingFrame
from exugear.steady.settling import frame_coordinates
from exugear.system.build import assemble

from ...cases.steady_runs import FOUR


@pytest.mark.parametrize("variant", ["rigid", "bushing"])
@pytest.mark.parametrize("changes", [{}, FOUR], ids=["three planets", "four planets"])
def test_coordinates_in_the_frame_come_back(grc, stiffness, variant, changes):
    assembly = assemble(grc.varied(changes), Choice(variant), stiffness)
    frame = RotatingFrame(assembly, planet_sets(assembly))
    psi = np.array([0.0, 0.7, -3.0, 40.0])
    u = 1e-4 * np.random.default_rng(0).normal(size=(len(psi), assembly.size))
    q = np.array([frame.state(float(angle), 1.0, own)[0] for angle, own in zip(psi, u, strict=True)])
    # Angles of hundreds of radians are taken off.
    np.testing.assert_allclose(frame_coordinates(frame, q, psi), u, rtol=0.0, atol=1e-10)
