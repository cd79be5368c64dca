"""The account of energy of a run: powers integrated, energies as they are."""

from __future__ import annotations

import numpy as np

from exugear.system.signals import BALANCE_TERMS, ENERGIES, POWERS
from fe_ste.tools.arrays import Floats, Integers

INTEGRATED = [BALANCE_TERMS.index(term) for term in POWERS]
"""Columns of the account that are integrals of powers."""
OBSERVED = [BALANCE_TERMS.index(term) for term in ENERGIES]
"""Columns of the account that are observed as they are."""


class EnergyAccount:
    """Terms of `exugear.system.signals.BALANCE_TERMS` as a run goes on.

    Parameters
    ----------
    step : time between two states, s
    balance : (terms,) account at the state to start from, J
    powers : (powers,) powers at that state, W

    Attributes
    ----------
    balance, powers : (terms,) (powers,) account and powers at the last state, J and W

    Examples
    --------
    A steady 2 W of the loads over two steps of 0.5 s:

    >>> account = EnergyAccount(0.5, np.zeros(len(BALANCE_TERMS)), np.zeros(len(POWERS)))
    >>> powers = np.zeros((3, len(POWERS)))
    >>> powers[:, POWERS.index("work_of_loads")] = 2.0
    >>> lines = account.carry_on(powers, np.array([0, 2]), np.zeros((2, len(ENERGIES))))
    >>> lines[:, BALANCE_TERMS.index("work_of_loads")]
    array([0.5, 2.5])
    """

    def __init__(self, step: float, balance: Floats, powers: Floats) -> None:
        self.balance = balance
        self.powers = powers
        self._step = step

    def begin(self, powers: Floats) -> None:
        """Begin with the powers (W) at the first state, which is carried on to like all others."""
        # No time passes before the first state: the mean of its powers and these is none.
        self.powers = -powers

    def carry_on(self, powers: Floats, written: Integers, energies: Floats) -> Floats:
        """Carry the account on by states one step apart; powers by the trapezoidal rule.

        Parameters
        ----------
        powers : (n, powers) of `exugear.system.signals.POWERS` at each state, W
        written : (k,) numbers of the states whose lines are asked for, the last state's last
        energies : (k, energies) of `exugear.system.signals.ENERGIES` at these states, J

        Returns
        -------
        (k, terms) account at these states, J
        """
        # Whole sums up to each line; of the first and the last power in them half is too much or missing.
        starts = np.concatenate([[0], written[:-1] + 1])
        sums = np.cumsum(np.add.reduceat(powers, starts, axis=0), axis=0)
        worked = sums + 0.5 * (self.powers - powers[written])
        lines = np.empty((len(written), len(BALANCE_TERMS)))
        lines[:, INTEGRATED] = self.balance[INTEGRATED] + self._step * worked
        lines[:, OBSERVED] = energies
        self.powers, self.balance = powers[-1].copy(), lines[-1]
        return lines
