"""The GRC by the law `table`, its tables by the finite elements, against runs in time of the compiled solver."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.project import Project
from exugear.steady.balance.response import signals
from exugear.system.build import assemble

from ..cases.steady_runs import fitted, solver_of
from ..conftest import CASE

pytestmark = [pytest.mark.validation, pytest.mark.long]
CHOICE = Choice("bushing", "table")


@pytest.fixture(scope="module")
def tables(grc, tmp_path_factory):
    """Grid tables of all four pairs: those that the results of the case have, if they fit, else computed."""
    folder = tmp_path_factory.mktemp("grc750")
    known = CASE.parents[2] / "results" / "grc750" / "tables"
    if known.is_dir():
        shutil.copytree(known, folder / "tables")
    return Project(grc, folder, choice=CHOICE).stiffness()


def differences(solver, speed):
    """Differences of lines and amplitudes from a run in time, over the size of all lines that the result has.

    RK4 at 1/120 kHz from the state, the last 2 of 3 s; the state is solved again at the mean speed of the run.
    """
    solver.response(speed)
    state, model = solver.state, solver.model
    measured, lines = fitted(state, state.response, 3.0, 1.0 / 120e3, 2.0)
    lines = lines[model.places_in(state.model)[0].ravel()[1:] - 1]
    known = 2.0 * signals(model, solver.response(measured))[1:, 0]
    size = np.linalg.norm(known)
    return np.linalg.norm(lines - known) / size, np.linalg.norm(abs(lines) - abs(known)) / size


# 3e-4 is asked for off resonance, 2e-3 and 1e-3 at resonances. At 8 rad/s one line at 630 Hz, beside modes at 609 and
# 612 Hz, is late by 6e-4 rad: the change of mass and stiffness with the carrier's turn is left out.
@pytest.mark.parametrize(
    ("speed", "complex_most", "amplitude_most"),
    [(8.0, 5e-4, 1.5e-4), (11.0, 3e-4, 3e-4), (18.0, 3e-4, 3e-4), (13.9, 2e-3, 1e-3)],
)
def test_the_gearbox_by_its_tables_stays_on_its_steady_state(grc, tables, speed, complex_most, amplitude_most):
    solver = solver_of(assemble(grc, CHOICE, tables), (1.0, 22.5), "nonlinear")
    lines, amplitudes = differences(solver, speed)
    assert lines < complex_most
    assert amplitudes < amplitude_most


def test_the_gearbox_by_its_tables_stays_on_a_state_with_contact_loss(grc, tables):
    """A tenth of the load, little damping: the teeth of the intermediate mesh are apart for 7 % of the time."""
    load = grc.case.static_load.torques_N_m
    changes = {f"static_load.torques_N_m.{name}": 0.1 * torque for name, torque in load.items()}
    changes |= {"damping.mesh_time_s": 5e-7, "damping.bearing_time_s": 1e-5}
    solver = solver_of(assemble(grc.varied(changes), CHOICE, tables), (1.0, 22.5), "nonlinear")
    lines, amplitudes = differences(solver, 12.5)
    assert solver.state.response.apart.max() > 0.05
    assert lines < 2e-3
    assert amplitudes < 1e-3
