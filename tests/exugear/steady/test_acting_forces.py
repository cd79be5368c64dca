"""Orders at which meshes may have forces beyond those of their mean stiffness."""

from __future__ import annotations

import numpy as np
import pytest

from exugear.gearbox.choice import Choice
from exugear.steady.balance.acting_forces import acting_forces
from exugear.steady.settings import Method
from exugear.system.build import assemble

from ..cases.steady_runs import FOUR, solver_of

RIPPLES = {
    "fast": {"body": "hss", "orders": [12, 31], "torque_N_m": [200.0, 100.0]},
    "slow": {"body": "carrier", "orders": [13], "torque_N_m": [5000.0]},
}
ON_PLANET = {"one": {"body": "planet_2", "orders": [2], "torque_N_m": [500.0]}}
RUN_OUT = {"wheel": {"body": "hss", "runout_um": 20.0}}


@pytest.mark.parametrize("method", ["linear", "parametric"])
@pytest.mark.parametrize(
    "changes",
    [
        {"excitations": RIPPLES},
        {"excitations": RIPPLES, "deviations": RUN_OUT},
        {"excitations": ON_PLANET, **FOUR},
    ],
    ids=["ripples", "ripples and run-out", "planets out of phase"],
)
def test_forces_that_are_left_out_are_zero(grc, stiffness, changes, method: Method) -> None:
    """What the gearbox answers to them is not solved for, so that one that is not zero would be without motion."""
    assembly = assemble(grc.varied(changes), Choice("bushing"), stiffness)
    solver = solver_of(assembly, (1.0, 22.5), method, 10, 3)
    model = solver.model
    acting = acting_forces(model.coupling, model.slow_shifts[2], model.deviations(1.0))
    assert np.count_nonzero(~acting) > 0.05 * acting.size
    for speed in (4.0, 20.0):
        excess = np.abs(solver.response(speed).excess.reshape(acting.shape))
        assert excess[~acting].max() <= 1e-12 * excess.max()
