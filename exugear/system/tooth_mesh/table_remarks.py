"""What there is to say of tables: states that are not solved, and contact that is cut off at form circles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fe_ste.transmission_error.gaps import DOUBTFUL_CUT_OFF, MOST_MISSING
from fe_ste.transmission_error.states import CUT_OFF
from fe_ste.transmission_error.table import MeshTable


def remarks_about_table(name: str, table: MeshTable) -> Iterator[str]:
    """Say what is missing or cut off in the table of a pair, and what becomes of it; a line each."""
    missing, states = _missing(table)
    if missing:
        first = f", first {table.failures[0]}" if table.failures else ""
        yield (
            f"{name}: {missing} of {states} states are not solved{first}; they are marked in the table, others stand "
            "in for them, and what comes near them says so"
        )
    shares = table.dataset[CUT_OFF].to_numpy()
    cut = int(np.count_nonzero(shares > 0.0))
    largest = float(np.nanmax(shares, initial=0.0))
    if cut:
        yield (
            f"{name}: in {cut} of {states} states contact passes a form circle and is cut off there; up to "
            f"{_percent(largest)} of the load would be beyond, {_percent(static_cut_off(table))} in the static state"
        )


def doubts_about_table(name: str, table: MeshTable) -> Iterator[str]:
    """Say why the table of a pair is not to be trusted; a line each, none if it is."""
    missing, states = _missing(table)
    if missing > MOST_MISSING * states:
        yield f"{name}: {missing} of {states} states are not solved, more than {_percent(MOST_MISSING)}"
        yield from (f"{name}: {line}" for line in table.failures)
        return
    static = table.static_state
    lost = int(np.count_nonzero(~static["converged"].to_numpy().astype(bool)))
    positions = static.sizes["pmc"]
    if lost > MOST_MISSING * positions:
        yield f"{name}: {lost} of {positions} positions of the static state are not solved"
    share = static_cut_off(table)
    if share > DOUBTFUL_CUT_OFF:
        yield (
            f"{name}: in the static state {_percent(share)} of the load would be beyond a form circle, where a "
            f"tip presses on a fillet (limit {_percent(DOUBTFUL_CUT_OFF)}); a tip of the mate that ends earlier, or a "
            "tool with a smaller tip radius, keeps clear"
        )


def static_cut_off(table: MeshTable) -> float:
    """Largest share of the load that is cut off in the static state."""
    return float(np.nanmax(table.static_state[CUT_OFF].to_numpy(), initial=0.0))


def _missing(table: MeshTable) -> tuple[int, int]:
    """Numbers of states that are not solved, and of all."""
    solved = table.dataset["converged"].to_numpy().astype(bool)
    return int(np.count_nonzero(~solved)), solved.size


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %"
