"""The page of one model's modes: chosen from a list, moving in three dimensions, offline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from exugear.report.web import pieces
from exugear.report.web.arrays import ArrayStore, rounded
from exugear.report.web.document import whole_page
from exugear.report.web.pieces import Cell
from exugear.report.web.stage import stage_data
from exugear.report.web.stage_figure import stage_figure
from exugear.system.assembly import Assembly
from fe_ste.tools.arrays import Floats
from fe_ste.tools.files import write_file

MODEL = "model"
"""Name of the only model of the page."""
MOST_DEFORMED = 60
"""Modes in which elastic bodies deform: the first of those that are shown."""


def write_mode_page(
    assembly: Assembly,
    shapes: Floats,
    titles: Sequence[tuple[float, str]],
    path: str | Path,
    *,
    heading: str = "Mode shapes",
    first: int = 0,
    labels: Mapping[str, str] | None = None,
) -> Path:
    """Write a web page that shows modes of one gearbox.

    Parameters
    ----------
    assembly : what vibrates
    shapes : (size, modes) modes to choose from
    titles : frequency (Hz) of each, and what moves
    path : where to write the page
    heading : gearbox, variant, mesh law and inertia set
    first : mode that is shown when the page opens
    labels : mapping of name to words, optional
        Of bodies.

    Raises
    ------
    ValueError
        If there is no mode, or not a title for each.
    """
    if not titles or shapes.shape[1] != len(titles):
        raise ValueError(
            f"mode page: {shapes.shape[1]} modes with {len(titles)} titles; at least one of each is needed"
        )
    arrays = ArrayStore()
    near = sorted(range(len(titles)), key=lambda mode: abs(mode - first))[:MOST_DEFORMED]
    data: dict[str, Any] = {
        "name": heading,
        "input": "",
        "rated": None,
        "lines": [],
        "groups": [],
        "charts": {},
        "first": first,
        "models": {
            MODEL: {
                "words": heading,
                "variant": assembly.variant,
                "fastest": 1.0,
                "stage": stage_data(assembly, shapes, labels or {}, arrays, near if assembly.elastic_bodies else ()),
                "modes": [
                    {
                        "frequency": rounded(frequency, 6),
                        "damping": 0.0,
                        "words": words,
                        "seen": True,
                        "amplification": 0.0,
                        "mesh": "",
                    }
                    for frequency, words in titles
                ],
            }
        },
    }
    target = Path(path)
    page = whole_page(heading, _body(heading, titles), "mode_page", data, arrays, ("three.min.js",))
    write_file(target, page.encode("utf-8", errors="replace"))
    return target


def _body(heading: str, titles: Sequence[tuple[float, str]]) -> str:
    rows = [
        {
            "No.": Cell(str(number + 1), number),
            "Frequency / Hz": Cell(f"{frequency:.1f}", frequency, f"mode:{MODEL}:{number}"),
            "What moves": words,
        }
        for number, (frequency, words) in enumerate(titles)
    ]
    table = pieces.table(rows, ("What moves",), caption="Modes", name="modes", sortable=True)
    theme = pieces.element("button", "◐", type="button", id="theme", aria_label="Dark or light colours")
    tools = pieces.element("div", theme, class_="page-tools scripts-only")
    brand = pieces.element("div", pieces.element("h1", pieces.text(heading)), class_="brand")
    steps = pieces.element("button", "‹", type="button", id="before", aria_label="Mode before") + pieces.element(
        "button", "›", type="button", id="next", aria_label="Next mode"
    )
    element = pieces.element("p", "", id="mode-words", aria_live="polite")
    shown = pieces.element("div", steps, class_="controls") + element + stage_figure()
    main = pieces.element(
        "main",
        pieces.element(
            "section",
            pieces.element("div", pieces.element("div", shown, class_="scripts-only") + table, class_="split"),
        ),
    )
    toast = pieces.element("p", "", id="said", class_="toast", role="status", aria_live="polite")
    return pieces.element("header", brand + tools, class_="top") + main + toast
