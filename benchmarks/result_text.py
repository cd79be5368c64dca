"""What all tables of results share: figures with their units, Markdown, what a part was measured on."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
RESULTS = HERE / "results.json"
QUIET = 0.1
"""Cores that others may use on a machine that counts as quiet."""
DOCUMENT_WIDTH = 100

Results = dict[str, Any]


def stored() -> Results:
    """Figures by part; none before the first measurement."""
    return json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}


def table(head: list[str], rows: list[list[str]]) -> str:
    """Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def items(lines: list[str]) -> str:
    """Markdown list."""
    return "\n".join(f"- {line}" for line in lines) + "\n"


def number(value: float, digits: int = 3) -> str:
    """Figure with so many digits, without an exponent."""
    if value == 0.0:
        return "0"
    text = f"{value:.{digits}g}"
    return f"{float(text):,.0f}" if "e" in text or abs(value) >= 10 ** (digits - 1) else text


def duration(seconds: float) -> str:
    """Time in the unit that suits it."""
    if seconds < 1.0:
        return f"{number(1e3 * seconds)} ms"
    if seconds < 120.0:
        return f"{number(seconds)} s"
    return f"{number(seconds / 60.0)} min" if seconds < 7200.0 else f"{number(seconds / 3600.0)} h"


def percent(value: float | None) -> str:
    """Error as shown."""
    return "step cut" if value is None else f"{100 * value:.3f} %"


def circumstances(part: Results) -> str:
    """When and on what a part was measured."""
    machine, busy = part["machine"], part["cores_busy_before"]
    others = "" if busy is None else f"; before this part others kept {busy:.2f} cores busy"
    if busy is not None and busy > QUIET:
        others += ", so that wall times are too long"
    return (
        f"Measured {part['measured'][:10]} on {machine['cores']} cores ({machine['processor']}), Python "
        f"{machine['python']}, Exudyn {machine['exudyn']}, numba {machine['numba']}, pypardiso {machine['pypardiso']}; "
        f"load average when the command began {part['load_at_start']:.2f}{others}."
    )


def wrapped(text: str) -> str:
    """Paragraph with lines as long as documents have them."""
    return textwrap.fill(text, DOCUMENT_WIDTH, break_long_words=False, break_on_hyphens=False)
