"""Bearings with rolling laws in both solvers, and the account of energy with cages that turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.build import assemble
from exugear.system.loads import LoadTable
from exugear.system.signals import signal_layout
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import Observer
from exugear.transient.exudyn_model.system import ExudynSystem

from ...cases.assembled import assembled
from ...cases.both_ways import compiled_states, exudyn_states
from ...cases.floating import FLOATING_CASE, without_floating_frames
from ...cases.rolling import BALLS, CYLINDRICAL, TAPERED, on_rolling

LOAD = {"carrier": 240e3, "hss": -3000.0}
STEP = 1 / 60e3
PRELOADED = replace(CYLINDRICAL, radial_clearance=-20e-6)
PAIR = tuple(replace(TAPERED, contact_angle=a, axial_position=0.1 * a, radial_clearance=-10e-6) for a in (0.3, -0.3))


@pytest.fixture(scope="module")
def linear(grc: Gearbox, stiffness: dict) -> Assembly:
    return assemble(grc, Choice("bushing"), stiffness)


@pytest.fixture(scope="module")
def start(linear: Assembly) -> tuple[np.ndarray, np.ndarray]:
    """Preloaded state of the linear bearings at 46 rpm: at full speed a step covers many pieces of k(PMC)."""
    state = accelerating_start(linear, LOAD, -4.8)
    return state.q, state.v


def test_both_solvers_agree(linear: Assembly, start: tuple[np.ndarray, np.ndarray]) -> None:
    """Rollers, balls and a pair of taper rollers, on ground and pins, outer rings on either side, turning cages."""
    assembly = on_rolling(linear, [(PRELOADED,), (BALLS,), (), PAIR], stiffness=0.3)
    expected = np.hstack(exudyn_states(assembly, *start, LOAD, 100, STEP))
    found = np.hstack(compiled_states(assembly, *start, LOAD, 100, STEP))
    for part in (slice(0, assembly.size), slice(assembly.size, None)):
        moved = np.abs(expected[:, part] - expected[0, part]).max(axis=0)
        # Round-off of angles of some rad and velocities of some 2e3 rad/s, of 1e9 N/m and short steps.
        assert np.abs(found[:, part] - expected[:, part]).max() < 1e-9 * moved.max()


@pytest.mark.parametrize("turning", [False, True])
def test_account_of_energy_closes(linear: Assembly, start: tuple[np.ndarray, np.ndarray], turning: bool) -> None:
    """Change of all energies against the integral of all powers, of bearings that shake as they begin to carry."""
    assembly = on_rolling(linear, [(CYLINDRICAL,), (BALLS,), PAIR], stiffness=0.1, turning=turning)
    q, v = compiled_states(assembly, *start, LOAD, 2400, STEP)
    time = STEP * np.arange(len(q))
    signals, energies, powers = Observer(assembly, LoadTable(LOAD)).observe(time, q, v)
    net = powers[:, 0] - powers[:, 1:].sum(axis=1)  # of the loads, less what else takes a part
    work = STEP / 3.0 * (4.0 * net[1::2].sum() + 2.0 * net[::2].sum() - net[0] - net[-1])
    change = energies[-1].sum() - energies[0].sum()
    stored = np.ptp(energies[:, 1])
    assert stored > 10.0  # J
    assert abs(work - change) < 1e-4 * stored
    forces = signals[:, signal_layout(assembly)["support_force"]]
    # What a run keeps as a support's force is that of the plain kernels.
    n = len(q) // 2
    assert np.allclose(
        forces[n].reshape(-1, 3), -assembly.bearing_loads(q[n], v[n])[:, :3], atol=1e-6 * np.abs(forces[n]).max()
    )


def test_rows_within_their_clearance_leave_a_run_as_it_is_bit_by_bit(
    linear: Assembly, start: tuple[np.ndarray, np.ndarray]
) -> None:
    wide = replace(CYLINDRICAL, radial_clearance=10e-3)
    loose = on_rolling(linear, [(wide,)])
    one, other = (compiled_states(assembly, *start, LOAD, 200, STEP) for assembly in (linear, loose))
    assert np.array_equal(one[0], other[0])
    assert np.array_equal(one[1], other[1])


def test_a_floating_shaft_feels_its_rollers_as_in_the_frame_that_does_not_turn(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """Supports of floating bodies take another way into Exudyn; spins, and so cages, come from Euler parameters."""
    path = tmp_path_factory.mktemp("floating") / "case.toml"
    path.write_text(FLOATING_CASE, encoding="utf-8")
    mesh = 2e8 * (1.0 + 0.1 * np.cos(2.0 * np.pi * np.arange(50) / 50))
    floating = assembled(Gearbox.from_toml(path), Choice("flexible"), {"pair": mesh})
    start = accelerating_start(floating, {"shaft": 6.0, "wheel": 9.0}, 420.0)
    small = replace(CYLINDRICAL, element_diameter=0.008, pitch_diameter=0.06, effective_length=0.01)
    ends = []
    for frame in (floating, without_floating_frames(floating)):
        # Light enough for the case: 2e7 N/m by rollers instead of springs, preloaded by a few um.
        assembly = on_rolling(frame, [(replace(small, radial_clearance=-1e-6),)], stiffness=0.5)
        system = ExudynSystem(assembly, start.q, start.v, LoadTable({"shaft": 6.0, "wheel": 9.0}))
        system.run(0.0, 100, 1e-5, explicit=False)
        ends.append(system.state()[1])
    moved = ends[1] - start.q
    place = floating.elastic_slices["shaft"]
    for motions in ((0, 1, 2), (3, 4)):
        own = [i for i in range(place.start, place.start + 24) if (i - place.start) % 6 in motions]
        # As of linear bearings: second order in the tilts is left out in the frame that does not turn.
        assert np.abs(ends[0] - ends[1])[own].max() < 4e-3 * np.abs(moved[own]).max()
        assert np.abs(moved[own]).max() > 1e-7
