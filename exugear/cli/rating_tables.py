"""A rating sheet on the console: one factor per line, both gears of a mesh in columns, finite elements below."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

from exugear.cli.case import read_gearbox
from exugear.cli.tables import Column, Outcome, Table, failure_text, wrapped
from exugear.cli.watched import WatchedProject
from exugear.gearbox.choice import Choice
from exugear.gearbox.variant import Variant
from exugear.life.rating.sheet import FINITE_ELEMENTS, UNITS, FlankSheet, RatingSheet, sheet_value
from exugear.project import results_folder
from exugear.results.findings import Finding

_BLOCKS: Mapping[str, tuple[str, ...]] = {
    "load": ("torque", "load_torque", "F_t", "v", "N_L", "K_A", "K_gamma", "K_v", "F_betax", "K_Hbeta", "K_Halpha"),
    "stiffness": ("K_Fbeta", "K_Falpha", "c'", "c_gammaalpha", "m_red", "n_E1", "N"),
    "flank": ("Z_H", "Z_E", "Z_eps", "Z_beta", "f_ZCa", "Z_BD", "sigma_H0", "sigma_H"),
    "endured": ("sigma_Hlim", "Z_NT", "Z_L", "Z_v", "Z_R", "Z_W", "Z_X", "sigma_HG", "S_H"),
    "root": ("f_eps", "Y_F", "Y_S", "Y_beta", "Y_B", "Y_DT", "sigma_F0", "sigma_F"),
    "broken": ("sigma_Flim", "Y_NT", "Y_deltarelT", "Y_RrelT", "Y_X", "Y_rel", "Y_M", "sigma_FG", "S_F"),
}
_WORDS = {"torque": "torque of the gear", "load_torque": "torque of the loaded body"}
_OF_2019 = ("f_ZCa", "f_eps")
"""Factors of helical gears in the edition of 2019; their rows are omitted for other gears."""
GEAR_COLUMN = 14
"""Width in characters at which the heading of a gear is wrapped."""
_DIGITS = {
    "MPa": ".1f",
    "kN": ".4g",
    "kN m": ".5g",
    "m/s": ".3f",
    "um": ".1f",
    "kg/mm": ".4f",
    "rpm": ".0f",
    "N/(mm um)": ".3f",
    "N^0.5/mm": ".3f",
}


def _value(symbol: str, flank: FlankSheet) -> float:
    return sheet_value(symbol, flank.standard.get(symbol, math.nan))


FLANK_LEGEND = (
    "S_H, S_F: safety against pitting and tooth breakage over the life, to ISO 6336. Stresses and K_Hbeta: of the load "
    "with the largest damage. Safety by finite elements: life."
)
FLANKS = (
    Column("gear", lambda flank: f"{flank.gear} {flank.flank}"),
    Column("mesh", lambda flank: flank.family + " reversed" * (flank.sense < 0), is_text=True),
    *(
        Column(heading, partial(_value, symbol), form)
        for heading, symbol, form in (
            ("σ_H\nMPa", "sigma_H", ".0f"),
            ("S_H\nISO", "S_H", ".2f"),
            ("σ_F\nMPa", "sigma_F", ".0f"),
            ("S_F\nISO", "S_F", ".2f"),
            ("K_Hbeta", "K_Hbeta", ".2f"),
        )
    ),
)


def rating_outcome(sheet: RatingSheet, case: str, name: str) -> Outcome:
    """Return safety factors of all flanks, all factors by mesh, assumptions and neglected effects."""
    flanks = sorted(sheet.flanks, key=lambda flank: _value("S_H", flank))
    title = f"{sheet.edition}, method B; {sheet.load}"
    smallest = []
    for symbol in ("S_H", "S_F") if flanks else ():
        least = min(flanks, key=partial(_value, symbol))
        smallest.append(f"{symbol} {_value(symbol, least):.2f} ({least.gear} {least.flank}, {least.family})")
    meshes: dict[tuple[str, int], list[FlankSheet]] = {}
    remarks: dict[str, None] = {}
    for flank in sheet.flanks:
        meshes.setdefault((flank.family, flank.sense), []).append(flank)
        remarks |= dict.fromkeys(f"{flank.family}: {name} {reason}" for name, reason in flank.lacking.items())
        remarks |= dict.fromkeys(f"{flank.gear} in {flank.family}: {remark}" for remark in flank.remarks)
    factors = [
        Table(
            f"Mesh {family}" if sense > 0 else f"Mesh {family}, reversed load",
            [*_rows(own, sheet.other_edition)],
            [Column("factor", _factor), *map(_column, own)],
        )
        for (family, sense), own in meshes.items()
    ]
    return Outcome(
        verdict=f"Smallest {', '.join(smallest)}" if flanks else "No loaded flanks",
        summary={"case": case, "name": name, "rating": sheet.summary()},
        tables=[Table(title, flanks, FLANKS, FLANK_LEGEND, noun="flanks"), *factors],
        findings=[
            *(Finding("warning", line) for line in remarks),
            *(Finding("note", line) for line in (*sheet.assumptions, *sheet.left_out)),
        ],
        failure=failure_text("safety factors below the required minimum:", sheet.shortfalls),
    )


def _rows(flanks: list[FlankSheet], other_edition: str) -> Iterator[tuple[str, str, str]]:
    """Yield the text and the name of each factor, and the part of a sheet that has it."""
    names = [name for block in _BLOCKS.values() for name in block]
    for name in names:
        if name not in _OF_2019 or any(name in flank.standard for flank in flanks):
            yield _WORDS.get(name, name), name, "standard"
    for name in names:
        if any(name in flank.other_edition for flank in flanks):
            yield f"{name}, {other_edition}", name, "other_edition"
    if any(flank.finite_elements for flank in flanks):
        yield from ((f"{name}, finite elements", name, "finite_elements") for name in FINITE_ELEMENTS)


def _factor(row: tuple[str, str, str]) -> str:
    words, name, _ = row
    return ", ".join(filter(None, (words, UNITS.get(name, "").replace("um", "µm"))))


def _column(flank: FlankSheet) -> Column:
    def shown(row: tuple[str, str, str]) -> str:
        _, name, part = row
        form = ".4g" if name == "N_L" else _DIGITS.get(UNITS.get(name, ""), ".3f")
        return Column(name, name, form).cell({name: sheet_value(name, getattr(flank, part).get(name, math.nan))})

    return Column("\n".join(wrapped(f"{flank.gear} {flank.flank}", GEAR_COLUMN)), shown)


def rate(case: Path, out: Path | None, allow_dir: Path | None, as_json: bool, whole: bool) -> None:
    """Print the rating of all gears; end with code 1 if a safety factor is below the required one."""
    gearbox = read_gearbox(case, allow_dir, tell=not as_json)
    project = WatchedProject(gearbox, results_folder(case, out), Choice(Variant.bushing, "line_of_action"))
    rating_outcome(project.rating(), str(case), gearbox.name).show(as_json, whole)
