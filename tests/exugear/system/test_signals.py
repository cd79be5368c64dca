"""The table of signals and what is said of it elsewhere."""

from __future__ import annotations

from pathlib import Path

import pytest

from exugear.system.signals import SIGNALS

GUIDE = (Path(__file__).parents[3] / "docs" / "reference" / "runs.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("signal", [signal for signal in SIGNALS if signal.stored and signal.filled_by])
def test_the_page_of_runs_tells_of_every_signal_with_its_unit_and_dimensions(signal) -> None:
    row = next((line for line in GUIDE.splitlines() if line.startswith("|") and f"`{signal.name}`" in line), "")
    _, _, over, units, _, _ = row.split("|")
    assert over.strip() == ", ".join(signal.dimensions)
    assert signal.units in units
