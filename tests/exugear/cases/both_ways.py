"""The compiled solver, Exudyn and the plain kernels on one assembly: states, matrices and observed signals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from exugear.system.loads import LoadTable
from exugear.system.signals import signal_layout
from exugear.system.statics import linearise
from exugear.system.system import Assembly
from exugear.transient.compiled.solver import CompiledSystem, Observer
from exugear.transient.exudyn_model.system import ExudynSystem

from .plain_signals import energies_of, sampled
from .rounding import allowed_difference

States = tuple[np.ndarray, np.ndarray]
"""Coordinates and rates at the start and after each step, each (steps + 1, size)."""


def compiled_states(
    assembly: Assembly, q: np.ndarray, v: np.ndarray, load: Mapping[str, float], steps: int, step: float
) -> States:
    """States by the compiled solver under constant torques (N m) and those over angles that the file states."""
    out_q, out_v = np.empty((2, steps + 1, assembly.size))
    out_q[0], out_v[0] = q, v
    loads = LoadTable(load, varying=assembly.varying_loads)
    done = CompiledSystem(assembly, q, v, loads, step).advance(0, out_q[1:], out_v[1:])
    assert done == steps
    return out_q, out_v


def exudyn_states(
    assembly: Assembly, q: np.ndarray, v: np.ndarray, load: Mapping[str, float], steps: int, step: float
) -> States:
    """The same by Exudyn: RK44, or generalized-alpha for the variant `jointed`."""
    rows: list[np.ndarray] = []

    def keep(t: float, q: np.ndarray, v: np.ndarray) -> bool:
        rows.append(np.array([q, v]))
        return True

    loads = LoadTable(load, varying=assembly.varying_loads)
    ExudynSystem(assembly, q, v, loads).run(0.0, steps, step, keep, assembly.variant != "jointed")
    states = np.array(rows)
    return states[:, 0], states[:, 1]


def assert_both_solvers_move_alike(
    assembly: Assembly,
    q: np.ndarray,
    v: np.ndarray,
    without: Assembly | None = None,
    step: float = 2e-6,
    most: float = 1e-6,
) -> None:
    """60 steps of a spur pair under its static load, by both solvers; an assembly without the excitation differs."""
    load = {"shaft_1": 100.0, "shaft_2": 150.0}
    ours, exudyns = (states(assembly, q, v, load, 60, step)[0] for states in (compiled_states, exudyn_states))
    np.testing.assert_allclose(ours - q, exudyns - q, rtol=0.0, atol=most * np.abs(ours - q).max(axis=0).min())
    if without is not None:
        assert np.abs(compiled_states(without, q, v, load, 60, step)[0] - ours).max() > 1e-9


def errors_and_mesh_forces(assembly: Assembly) -> slice:
    """Columns of the transmission errors, overall and of the meshes, and of the forces of the meshes."""
    layout = signal_layout(assembly)
    return slice(layout["overall_dte_angle"].start, layout["mesh_force"].stop)


def relative_error(found: np.ndarray, expected: np.ndarray) -> float:
    """Greatest rms of a difference over the rms of how its column moves about its mean."""
    return float(np.sqrt(np.mean((found - expected) ** 2, axis=0) / np.var(expected, axis=0)).max())


def assert_matrices_of_exudyn_are_those_of(assembly: Assembly, q: np.ndarray, tolerance: float) -> None:
    """Mass, stiffness and damping matrix at standing coordinates, meshes left out."""
    found = ExudynSystem(assembly, q, np.zeros(assembly.size), LoadTable(), with_meshes=False).linearised()
    linear = linearise(assembly, q)
    others = [name for name in linear.stiffness if name not in assembly.mesh_names]
    stiff, damping = (sum(elements[name] for name in others) for elements in (linear.stiffness, linear.damping))
    for one, two in zip(found, (linear.mass, stiff, damping + linear.modal), strict=True):
        assert np.abs(one - two).max() < tolerance * np.abs(two).max()


def assert_signals_are_those_of_the_plain_kernels(
    assembly: Assembly, q: np.ndarray, v: np.ndarray, load: Mapping[str, float]
) -> np.ndarray:
    """Signals, energies and powers of states (samples, size); gives the powers (samples, kinds)."""
    signals, energies, powers = Observer(assembly, LoadTable(load)).observe(np.zeros(len(q)), q, v)
    expected = sampled(assembly, q, v)
    assert np.all(np.abs(signals - expected) < allowed_difference(expected, len(assembly.mesh_names)))
    plain = energies_of(assembly, q, v)
    # The non-conservative power is a small difference of large ones: measured by what is dissipated, too.
    scale = np.abs(plain).max(axis=0) + np.abs(plain[:, 2]).max()
    assert (np.abs(np.column_stack([energies, powers[:, 1:]]) - plain) / scale).max() < 1e-9
    return powers
