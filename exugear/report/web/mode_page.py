"""Page of one model's modes and operating deflection shapes: selected from lists, animated in 3-D, offline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exugear.report.web.document import NO_RESULTS, ArrayStore, rounded, whole_page
from exugear.report.web.html import Cell, Table, render
from exugear.report.web.stage import stage_data
from exugear.system.system import Assembly
from fe_ste.tools.arrays import Complexes, Floats
from fe_ste.tools.files import write_file

MODEL = "model"
"""Name of the only model of the page."""
MOST_DEFORMED = 60
"""Maximum number of shapes in which flexible bodies deform: those in operation, and modes next to the first shown."""


@dataclass(frozen=True)
class ModeRow:
    """Mode in the list of the page."""

    number: int
    """Number of the command line."""
    frequency: float
    damping: float
    """Hz, and ratio to critical damping."""
    moves: str
    strain: str = ""
    """Parts with most strain energy."""
    resonances: str = ""
    """Numbers of the resonances in operation at this mode."""

    def cells(self, choice: str) -> dict[str, object]:
        """Return the row of the table; `choice` is what its button selects in the scripts."""
        return {
            "No.": Cell(str(self.number), self.number),
            "frequency / Hz": Cell(f"{self.frequency:.1f}", self.frequency, choice),
            "damping / %": Cell(f"{100.0 * self.damping:.1f}", 100.0 * self.damping),
            "mode shape": self.moves,
            "resonances": self.resonances or "–",
            "strain energy": self.strain or "–",
        }

    def data(self) -> dict[str, Any]:
        """Return what the scripts show of it."""
        return {
            "frequency": rounded(self.frequency, 6),
            "title": f"Mode {self.number} at {self.frequency:.1f} Hz",
            "words": self.moves,
        }


@dataclass(frozen=True)
class ResonanceRow:
    """Resonance of the ranking in the list of the page, with the vibration of the gearbox in operation."""

    number: int
    """Place in the ranking of the command line."""
    line: str
    """Order, such as ``2 x intermediate``."""
    speed: float
    """Absolute speed of the input, rpm."""
    frequency: float
    """Hz."""
    amplitude: float
    """Peak amplitude of the overall transmission error, m."""
    mode: str
    """Number of the mode that it excites; empty if unknown."""
    shape: Complexes
    """(size,) complex amplitudes of the coordinates."""

    @property
    def title(self) -> str:
        """Heading of its picture."""
        return f"Resonance {self.number}: {self.line} at {self.speed:.4g} rpm, {self.frequency:.1f} Hz"

    def cells(self, choice: str) -> dict[str, object]:
        """Return the row of the table; `choice` is what its button selects in the scripts."""
        micrometres = 1e6 * self.amplitude
        return {
            "No.": Cell(str(self.number), self.number),
            "order": self.line,
            "speed / rpm": Cell(f"{self.speed:.2f}", self.speed),
            "frequency / Hz": Cell(f"{self.frequency:.1f}", self.frequency, choice),
            "overall TE / µm": Cell(f"{micrometres:.3g}", micrometres),
            "mode": self.mode or "–",
        }

    def data(self) -> dict[str, Any]:
        """Return what the scripts show of it."""
        return {
            "frequency": rounded(self.frequency, 6),
            "title": self.title,
            "words": f"Operating deflection shape, overall transmission error ±{1e6 * self.amplitude:.3g} µm.",
        }


def write_mode_page(
    assembly: Assembly,
    shapes: Floats,
    rows: Sequence[ModeRow],
    path: str | Path,
    *,
    resonances: Sequence[ResonanceRow] = (),
    about_resonances: str = "",
    heading: str = "Mode shapes",
    first: int = 0,
    labels: Mapping[str, str] | None = None,
) -> Path:
    """Write a web page that shows modes and operating deflection shapes of one gearbox.

    Parameters
    ----------
    assembly : vibrating system
    shapes : (size, modes) modes for selection
    rows : of the list, one for each mode
    path : output file
    resonances : with their operating deflection shapes
    about_resonances : what the resonances are from, or why there are none
    heading : gearbox, variant, mesh model and inertia set
    first : what is shown when the page opens: a mode, or after all modes a resonance
    labels : mapping of name to label, optional
        For bodies.

    Raises
    ------
    ValueError
        If there is no mode, or the number of rows differs.
    """
    if not rows or shapes.shape[1] != len(rows):
        raise ValueError(f"mode page: {shapes.shape[1]} modes with {len(rows)} rows; at least one of each is needed")
    arrays = ArrayStore()
    vibrations = np.column_stack([shapes, *(row.shape for row in resonances)])
    shown: list[ModeRow | ResonanceRow] = [*rows, *resonances]
    near = sorted(range(len(shown)), key=lambda place: (place < len(rows), abs(place - first)))
    deformed = near[:MOST_DEFORMED] if assembly.elastic_bodies else []
    data: dict[str, Any] = {
        "name": heading,
        **NO_RESULTS,
        "first": first,
        "models": {
            MODEL: {
                "words": heading,
                "variant": assembly.variant,
                "stage": stage_data(assembly, vibrations, labels or {}, arrays, deformed),
                "modes": [row.data() for row in shown],
            }
        },
    }
    cells = [row.cells(f"mode:{MODEL}:{place}") for place, row in enumerate(shown)]
    modes = Table(
        cells[: len(rows)],
        ("mode shape", "strain energy", "resonances"),
        caption="Modes",
        name="modes",
        hidden=("damping / %", "strain energy"),
        sortable=True,
    )
    operation = Table(
        cells[len(rows) :],
        ("order", "mode"),
        caption="In operation",
        name="operation",
        hidden=("mode",),
        sortable=True,
    )
    body = render("mode_page", heading=heading, modes=modes, operation=operation, about_resonances=about_resonances)
    page = whole_page(heading, body, "mode_page", data, arrays, ("three.min.js",))
    target = Path(path)
    write_file(target, page.encode("utf-8", errors="replace"))
    return target
