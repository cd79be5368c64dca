"""Variables in the files of a run: its signals, and the state to go on from."""

from __future__ import annotations

from exugear.system.signals import SIGNALS, Variable

STATE = (
    Variable("state_q", ("coordinate",), "m or rad"),
    Variable("state_v", ("coordinate",), "m/s or rad/s"),
    Variable("state_past", ("past", "coordinate"), "m/s2 or rad/s2"),
    Variable("state_balance", ("term",), "J"),
    Variable("state_powers", ("power",), "W"),
    Variable("state_judgement", ("criterion", "figure"), "value, s, place"),
    Variable("state_pending", ("pending", "signal"), "of the signals"),
)
"""What a `exugear.results.pieces.Checkpoint` is kept as."""
VARIABLES = {variable.name: variable for variable in (*(signal for signal in SIGNALS if signal.stored), *STATE)}
"""All variables by name, in the order of the file; a run holds those of its mesh law."""
GROWING = ("time", "balance_time")
"""Dimensions along which a run grows piece by piece."""
