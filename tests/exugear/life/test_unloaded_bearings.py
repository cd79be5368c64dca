"""Lives of bearings that carry nothing: their loads are the rounding errors of the static balance."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.project import Project


@pytest.mark.validation
def test_a_bearing_without_load_has_no_life_and_says_so(tmp_path: Path) -> None:
    """Three equal planets share the torque, so that the bearings of sun and carrier carry nothing."""
    gearbox = Gearbox.from_dict(tomllib.loads(template("planetary"))).varied({"ste.positions": 8})
    life = Project(gearbox, tmp_path, Choice("bushing")).life()
    remarks = json.loads(life.attrs["bearing_remarks"])
    for name, load, reference, damage, hours, safety in zip(
        life["bearing"].to_numpy().tolist(),
        life["bearing_largest_load"].to_numpy(),
        life["bearing_reference_damage"].to_numpy(),
        life["bearing_damage"].to_numpy(),
        life["bearing_basic_hours"].to_numpy(),
        life["bearing_static_safety"].to_numpy(),
        strict=True,
    ):
        carries = name.startswith("planet")
        if not carries:
            assert load == damage == 0.0 and np.isinf(hours) and np.isinf(safety)
        assert (load > 1.0) == carries and np.isfinite(reference) == carries
        assert ("no load: elements may slide" in remarks.get(name, ())) == (not carries)
        assert not any("equilibrium" in line for line in remarks.get(name, ()))
