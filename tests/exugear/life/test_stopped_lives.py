"""A life that is stopped while angles are solved goes on from these, and ends with the same bits."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.life.static_balance import KeptAngles, static_balance
from exugear.system.build import assemble
from fe_ste.tools.stores import Store

from ..cases.table import surfaces

KILLED = """
import os, signal, sys
from pathlib import Path
from tests.exugear.life.test_stopped_lives import solved
def die(done, total):
    if done >= 15:
        os.kill(os.getpid(), signal.SIGKILL)
solved(Path(sys.argv[1]), die)
"""


def solved(path: Path, progress=None, input_hash: str = "this input"):
    """Balance of the GRC under the law `table` at two angles, torques of both signs, with loads of a hub."""
    changes = {"bodies.main_shaft.enabled": True, "static_load.torques_N_m": {"main_shaft": 240e3}}
    gearbox = Gearbox.from_toml("cases/grc750/gearbox.toml").varied(changes)
    assembly = assemble(gearbox, Choice("bushing", "table"), surfaces(gearbox))
    hub = np.array([10e3, 0.0, 0.0, 0.0, 20e3])
    kept = KeptAngles(Store(path, input_hash))
    return static_balance(assembly, "main_shaft", np.array([240e3, -60e3]), 2, progress, hub, kept)


def arrays(balance) -> list[np.ndarray]:
    parts = (balance.mesh_force, balance.misalignment, balance.bearing_load, balance.bearing_tilt)
    return [array for part in parts for array in (part.values, part.by_hub)]


@pytest.mark.validation
def test_a_balance_that_was_killed_goes_on_with_the_same_bits(tmp_path):
    whole, partial = solved(tmp_path / "whole.npz"), tmp_path / "killed.npz"
    done = subprocess.run([sys.executable, "-c", KILLED, str(partial)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert repr(KeptAngles(Store(partial, "this input"))).startswith("<KeptAngles: 1 in")
    counted: list[int] = []
    resumed = solved(partial, lambda number, total: counted.append(number))
    assert counted[0] == 10, "one angle is there and needs no solution"
    for one, other in zip(arrays(whole), arrays(resumed), strict=True):
        assert np.array_equal(one, other)


def test_angles_of_another_input_and_damaged_files_are_not_taken(tmp_path):
    path = tmp_path / "life.partial.npz"
    with pytest.raises(KeyboardInterrupt):
        solved(path, interrupt)
    assert repr(KeptAngles(Store(path, "this input"))).startswith("<KeptAngles: 1 in")
    assert repr(KeptAngles(Store(path, "another"))).startswith("<KeptAngles: 0 in")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert repr(KeptAngles(Store(path, "this input"))).startswith("<KeptAngles: 0 in")


def interrupt(done: int, total: int) -> None:
    if done > 12:
        raise KeyboardInterrupt
