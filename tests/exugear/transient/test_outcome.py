"""How a run shows itself."""

from __future__ import annotations

from pathlib import Path

from exugear.transient.outcome import Run


def test_a_run_shows_its_state_and_what_speaks_against_it() -> None:
    run = Run(Path("out/run.partial"), complete=False, end=0.25, wall=3.0, reasons=("speed: 1 > 0",), halted=True)
    assert repr(run) == "<Run out/run.partial: aborted at a limit, 0.25 s simulated in 3.0 s, invalid>"
    assert "<th>valid</th><td>no: speed: 1 &gt; 0</td>" in run._repr_html_()
    assert "<td>stopped</td>" in Run(Path("run.partial"), complete=False, end=0.1, wall=1.0)._repr_html_()
