"""The account of energy of a run: powers integrated, energies as they are."""

from __future__ import annotations

import numpy as np

from exugear.dynamics.signals import BALANCE_TERMS, ENERGIES, POWERS
from fe_ste.tools.arrays import Floats

INTEGRATED = [BALANCE_TERMS.index(term) for term in POWERS]
"""Columns of the account that are integrals of powers."""
OBSERVED = [BALANCE_TERMS.index(term) for term in ENERGIES]
"""Columns of the account that are observed as they are."""


class EnergyAccount:
    """Terms of `exugear.dynamics.signals.BALANCE_TERMS` as a run goes on.

    Parameters
    ----------
    step : float
        Time between two states, s.
    balance : (terms,) array
        Account at the state to start from, J.

    Attributes
    ----------
    balance : (terms,) array
        Account at the last state, J.

    Examples
    --------
    A steady 2 W of the loads over two steps of 0.5 s:

    >>> account = EnergyAccount(0.5, np.zeros(len(BALANCE_TERMS)))
    >>> powers = np.zeros((3, len(POWERS)))
    >>> powers[:, POWERS.index("work_of_loads")] = 2.0
    >>> account.carry_on(np.zeros((3, len(ENERGIES))), powers)[:, BALANCE_TERMS.index("work_of_loads")]
    array([0., 1., 2.])
    """

    def __init__(self, step: float, balance: Floats) -> None:
        self.balance = balance
        self._step = step
        self._last_powers: Floats | None = None

    def resume(self, powers: Floats) -> None:
        """Set the powers (1, powers) at the state that `balance` belongs to, W."""
        self._last_powers = powers

    def carry_on(self, energies: Floats, powers: Floats) -> Floats:
        """Carry the account on by states one step apart; powers by the trapezoidal rule.

        Parameters
        ----------
        energies, powers : (n, energies) and (n, powers) arrays
            Of `exugear.dynamics.signals.ENERGIES`, J, and `exugear.dynamics.signals.POWERS`, W.

        Returns
        -------
        (n, terms) array
            Account at each state, J.
        """
        before = powers[:1] if self._last_powers is None else self._last_powers
        series = np.vstack([before, powers])
        worked = self.balance[INTEGRATED] + 0.5 * self._step * np.cumsum(series[1:] + series[:-1], axis=0)
        if self._last_powers is None:
            worked -= self._step * powers[0]  # no time passes before the first state
        lines = np.empty((len(powers), len(BALANCE_TERMS)))
        lines[:, INTEGRATED] = worked
        lines[:, OBSERVED] = energies
        self._last_powers = powers[-1:]
        self.balance = lines[-1]
        return lines
