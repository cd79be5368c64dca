"""Stored signals are those of the corrected states, not of the predicted ones that they are evaluated at."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from exugear.gearbox.choice import Choice
from exugear.gearbox.gearbox import Gearbox
from exugear.system.loads import LoadTable
from exugear.system.signals import signal_layout
from exugear.system.statics import accelerating_start
from exugear.system.system import Assembly
from exugear.transient.compiled.integrator import RUNGE_KUTTA, Method, adams, stabilised
from exugear.transient.compiled.solver import CompiledSystem, Observer
from exugear.transient.filters import Decimator, plain_filter, stored_filter

from ..cases.assembled import assembled
from ..cases.table import surfaces

FASTEST_RPM = 215.0
"""The high-speed mesh is at 6.42 kHz."""
BAND = 6.6e3
"""Frequency (Hz) up to which signals are compared."""
START = 0.06
"""Time (s) after which a run has settled enough."""


def runs(assembly: Assembly, method: Method, step: float, factor: int) -> SimpleNamespace:
    """Signals of 0.16 s at the fastest speed: as stored, only filtered, and filtered ones of the states themselves."""
    load = {"carrier": 240e3, "hss": -240e3 / assembly.gearbox.train.ratio}
    start = accelerating_start(assembly, load, FASTEST_RPM * np.pi / 30.0)
    count, layout = round(0.16 / step), signal_layout(assembly)
    q, v = np.empty((2, count, assembly.size))
    read, energies = np.empty((count, layout.count)), np.empty((count, 8))
    CompiledSystem(assembly, start.q, start.v, LoadTable(load), step, method).advance(0, q, v, read, energies)
    observer = Observer(assembly, LoadTable(load))
    observer.complete(q, v, read)
    by = stored_filter(assembly, method, step, factor)
    plain = plain_filter(factor, layout.count)
    own = np.pad(plain.own, ((by.half - plain.half,) * 2, (0, 0)))
    plain = plain._replace(own=own, other=np.zeros_like(own))
    signals = read, read, observer.observe(np.zeros(count), q, v)[0]
    first = round(START / (step * factor))
    filtered = (
        Decimator(factor, layout.count, one).push(rows)[1]
        for one, rows in zip((by, plain, plain), signals, strict=True)
    )
    stored, plainly, exact = (rows[first:] for rows in filtered)
    return SimpleNamespace(stored=stored, plainly=plainly, exact=exact, layout=layout, interval=factor * step)


def deviations(found: SimpleNamespace, rows: NDArray, name: str) -> NDArray:
    """Rms of a signal's deviation up to the band over that of its fluctuation, of columns that fluctuate."""
    columns = found.layout[name]
    exact, deviation = found.exact[:, columns], rows[:, columns] - found.exact[:, columns]
    window = np.hanning(len(exact))[:, None]
    kept = np.fft.rfftfreq(len(exact), found.interval) < BAND
    size, off = (
        np.linalg.norm(np.fft.rfft(window * (values - values.mean(axis=0)), axis=0)[kept], axis=0)
        for values in (exact, deviation)
    )
    counts = exact.std(axis=0) > 1e-5 * np.abs(exact).max()
    assert counts.any()
    return off[counts] / size[counts]


@pytest.mark.parametrize(
    ("method", "step", "factor"),
    [(adams(5), 1 / 60e3, 3), (adams(5), 1 / 60e3, 1), (adams(6), 1 / 40e3, 2), (stabilised(), 1 / 60e3, 3)],
    ids=["as chosen", "; correct the file", "longer steps", "stabilised"],
)
def test_signals_on_bearings_are_those_of_the_states(
    grc: Gearbox, stiffness: dict, method: Method, step: float, factor: int
) -> None:
    found = runs(assembled(grc, Choice("bushing"), stiffness), method, step, factor)
    for name in ("mesh_dte", "mesh_force", "support_force", "support_moment"):
        # As they are read they differ by 2e-4 and more at the chosen step. Changes of a mesh's stiffness times those of
        # its deflection are left: half of the deviation at steps that are longer than chosen ones.
        put_right, left = (deviations(found, rows, name).max() for rows in (found.stored, found.plainly))
        assert put_right < max(1e-4, 0.5 * left), name


def test_joints_and_gears_that_only_spin_have_the_signals_of_the_states(grc: Gearbox, stiffness: dict) -> None:
    found = runs(assembled(grc, Choice("rigid"), stiffness), adams(5), 1 / 60e3, 3)
    assert deviations(found, found.stored, "mesh_dte").max() < 1e-7
    for name in ("mesh_force", "support_force"):
        assert deviations(found, found.stored, name).max() < 2e-4, name


def test_signals_of_the_law_table_are_those_of_the_states(grc: Gearbox) -> None:
    found = runs(assembled(grc, Choice("bushing", "table"), surfaces(grc)), adams(5), 1 / 60e3, 3)
    for name in ("mesh_dte", "mesh_force", "support_force", "centre_distance_change", "misalignment"):
        assert deviations(found, found.stored, name).max() < 2e-4, name


def test_states_that_are_not_predicted_are_left_as_they_are(grc: Gearbox, stiffness: dict) -> None:
    assembly = assembled(grc, Choice("bushing"), stiffness)
    count = signal_layout(assembly).count
    for factor in (1, 3):
        by, plain = stored_filter(assembly, RUNGE_KUTTA, 1 / 60e3, factor), plain_filter(factor, count)
        assert np.array_equal(by.own, plain.own)
        assert not by.other.any()


@pytest.mark.parametrize("factor", [1, 3])
def test_what_does_not_change_stays_to_rounding(grc: Gearbox, stiffness: dict, factor: int):
    """Mounts carry ten thousand times what they fluctuate by; with elastomers the remedy is longer than its taps."""
    elastomers = assembled(grc.varied({"damping.bearing_time_s": 1.4e-3}), Choice("bushing"), stiffness)
    by = stored_filter(elastomers, adams(4), 1.0 / 60e3, factor)
    np.testing.assert_allclose(by.own.sum(axis=0), 1.0, atol=1e-12)
    np.testing.assert_allclose(by.other.sum(axis=0), 0.0, atol=1e-12 * np.abs(by.other).max())
