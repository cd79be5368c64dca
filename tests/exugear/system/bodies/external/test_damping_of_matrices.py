"""Damping of housings from matrices."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.bodies.matrix_files.interface import InterfaceMatrices
from exugear.system.bodies.reduction import ReducedBody
from exugear.system.modes import modes_of
from exugear.system.statics import linearise
from exugear.system.system import Assembly

from .....optional_libraries import needs_meshio
from ....cases.assembled import assembled
from ....cases.both_ways import assert_matrices_of_exudyn_are_those_of
from .shared import LOAD, STIFFNESS, box_of, write

pytestmark = needs_meshio


def damped_box(folder: Path, box: InterfaceMatrices, external: Mapping[str, Any], **more: Any) -> Assembly:
    """The spur pair in the box on supports that are 10,000 times softer and have no damping."""
    content = dict(box_of(folder, {**write(folder, box), **external}).content)
    content = copy.deepcopy(content)
    for part in (*content["bearings"].values(), *content["mounts"].values()):
        part["stiffness"] = {key: 1e-4 * value for key, value in part["stiffness"].items()}
    content["static_load"]["torques_N_m"] = {key: 1e-4 * value for key, value in LOAD.items() if key == "shaft_1"}
    content["damping"] = {"bearing_time_s": 0.0, "mesh_time_s": 0.0, **more}
    gearbox = Gearbox.from_dict(content, str(folder / "case.toml"))
    return assembled(gearbox, Choice("flexible"), {"spur": 1e-4 * STIFFNESS["spur"]})


def free_modes(body: ReducedBody) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies (rad/s) and shapes of unit modal mass of the elastic modes of a free body."""
    squares, shapes = scipy.linalg.eigh(body.stiffness, body.mass)
    return np.sqrt(squares[6:]), shapes[:, 6:]


@pytest.mark.parametrize(
    ("external", "ratio"),
    [
        ({"loss_factor": 0.04}, lambda w: 0.02),
        ({"damping_time_s": 2e-6}, lambda w: 1e-6 * w),
        ({}, lambda w: 2.5e-6 * w),
    ],
)
def test_a_nearly_free_box_has_the_damping_ratios_that_its_keys_state(
    tmp_path: Path, box: InterfaceMatrices, external: dict[str, float], ratio: Any
) -> None:
    """Eta / 2 for structural damping, beta w / 2 for C = beta K; supports have 0.2 % of the strain energy."""
    assembly = damped_box(tmp_path, box, external, body_time_s=5e-6)
    wanted = free_modes(assembly.elastic_bodies["box"].reduced)[0]
    modes = modes_of(assembly)
    for w in wanted[:2]:
        own = int(np.abs(modes.frequency - w / (2.0 * np.pi)).argmin())
        assert modes.frequency[own] == pytest.approx(w / (2.0 * np.pi), rel=2e-3)
        assert modes.damping_ratio[own] == pytest.approx(ratio(w), rel=1e-2)


def test_rigid_motions_of_a_box_with_a_loss_factor_are_undamped(tmp_path: Path, box: InterfaceMatrices) -> None:
    """The same matrix in the equations, their linearisation, and both solvers; C = eta w in each free mode."""
    assembly = damped_box(tmp_path, box, {"loss_factor": 0.04})
    body, at = assembly.elastic_bodies["box"].reduced, assembly.elastic_slices["box"]
    q = np.zeros(assembly.size)
    total = linearise(assembly, q).total_damping[at, at]
    frequencies, shapes = free_modes(body)
    assert shapes.T @ total @ shapes == pytest.approx(np.diag(0.04 * frequencies), abs=1e-9 * frequencies.max())
    rigid = body.rigid_motions((0.0, 0.0, 0.0))
    assert np.abs(total @ rigid).max() < 1e-9 * np.abs(total).max()
    rate = np.random.default_rng(2).normal(size=assembly.size)
    rate[[n for n in range(assembly.size) if n not in range(at.start, at.stop)]] = 0.0
    change = assembly.forces(q, 1e-3 * rate) - assembly.forces(q, np.zeros(assembly.size))
    assert change[at] == pytest.approx(-1e-3 * total @ rate[at], rel=1e-9, abs=1e-9 * np.abs(change).max())
    assert_matrices_of_exudyn_are_those_of(assembly, q, 1e-9)


def test_modal_damping_counts_a_loss_factor_towards_its_ratio(tmp_path: Path, box: InterfaceMatrices) -> None:
    """0.2 % of critical in every mode, or more where the strain energy is mostly in the box, which alone has 4 %."""
    content = copy.deepcopy(dict(box_of(tmp_path, {**write(tmp_path, box), "loss_factor": 0.08}).content))
    content["damping"] = {"modal_percent": 0.2}
    gearbox = Gearbox.from_dict(content, str(tmp_path / "case.toml"))
    modes = modes_of(assembled(gearbox, Choice("flexible"), STIFFNESS))
    moving = (modes.frequency > 1.0) & (modes.frequency < gearbox.case.elasticity.band_Hz)
    assert modes.damping_ratio[moving].min() == pytest.approx(0.002, rel=1e-3)
    assert 0.004 < modes.damping_ratio[moving].max() < 0.05
