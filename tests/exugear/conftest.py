"""Shared inputs: the GRC case and mesh stiffnesses of known shape that stand for FE tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.gearbox import Gearbox
from exugear.system.modal_damping import with_damping_times
from exugear.system.tooth_mesh.element import MeshCurve

from .cases.contact import curves_of
from .cases.spur import COARSE_INPUT

CASE = Path(__file__).parents[2] / "cases" / "grc750" / "gearbox.toml"


@pytest.fixture(scope="session")
def grc() -> Gearbox:
    """The case with the damping times of its comparisons with published figures, on which these tests' numbers rest.

    The file states modal damping, which has tests of its own (`test_modal_damping.py`, `test_damping_band.py`).
    """
    return with_damping_times(Gearbox.from_toml(CASE))


@pytest.fixture(scope="session")
def grc_shafts() -> Gearbox:
    """Elastic shafts only: carrier and housing rigid in every variant, so that nothing has to be meshed."""
    rigid = {f"bodies.{name}.flexibility": "none" for name in ("carrier", "housing")}
    return with_damping_times(Gearbox.from_toml(CASE)).varied(rigid)


@pytest.fixture(scope="session")
def stiffness() -> dict[str, np.ndarray]:
    """Means by ISO 6336-1 as listed in the case data, N/m, with harmonics as strong as tables have them."""
    cycle = 2.0 * np.pi * np.arange(50) / 50
    mean = {"sun_planet": 3.77e9, "ring_planet": 4.85e9, "intermediate": 3.07e9, "high_speed": 1.93e9}
    shape = 1.0 + 0.05 * np.cos(cycle + 0.3) + 0.02 * np.cos(2 * cycle + 1.1) + 0.01 * np.cos(3 * cycle)
    return {name: value * shape for name, value in mean.items()}


@pytest.fixture(scope="session")
def curves(stiffness: dict[str, np.ndarray]) -> dict[str, MeshCurve]:
    """Curves through that stiffness, as bent as teeth with strong relief have them."""
    return curves_of(stiffness)


@pytest.fixture(scope="module")
def coarse_tables() -> Iterator[None]:
    """Few elements a tooth in all tables that tests of a file have computed; asked for by the whole file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("exugear.system.tooth_mesh.tables.TableInput", COARSE_INPUT)
        yield
