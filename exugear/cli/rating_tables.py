"""A rating sheet on the console: one factor per line, both gears of a mesh in columns, finite elements below."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

from exugear.cli.console import note
from exugear.cli.tables import Column, print_table, print_text, wrapped
from exugear.life.rating.sheet import FINITE_ELEMENTS, UNITS, FlankSheet, RatingSheet, sheet_value

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


def print_rating(sheet: RatingSheet) -> None:
    """Print a rating sheet with its assumptions and neglected effects."""
    print_text(f"Rating to {sheet.edition}, method B; {sheet.load}")
    for title, flanks in _meshes(sheet):
        rows = [*_rows(flanks, sheet.other_edition)]
        print_table(f"Mesh {title}", rows, [Column(heading, heading) for heading in rows[0]])
        for line in dict.fromkeys(line for flank in flanks for line in _remarks(flank)):
            note(line, style="yellow")
    for line in sheet.assumptions:
        note(line)
    for line in sheet.left_out:
        note(line, style="yellow")


def _meshes(sheet: RatingSheet) -> Iterator[tuple[str, list[FlankSheet]]]:
    """Yield the gears of each mesh for one direction of load, with a title."""
    found: dict[tuple[str, int], list[FlankSheet]] = {}
    for flank in sheet.flanks:
        found.setdefault((flank.family, flank.sense), []).append(flank)
    for (family, sense), flanks in found.items():
        yield family if sense > 0 else f"{family}, reversed load", flanks


def _rows(flanks: list[FlankSheet], other_edition: str) -> Iterator[dict[str, str]]:
    names = [name for block in _BLOCKS.values() for name in block]
    for name in names:
        if name not in _OF_2019 or any(name in flank.standard for flank in flanks):
            yield _row(name, _WORDS.get(name, name), flanks, lambda one: one.standard)
    for name in names:
        if any(name in flank.other_edition for flank in flanks):
            yield _row(name, f"{name}, {other_edition}", flanks, lambda one: one.other_edition)
    if any(flank.finite_elements for flank in flanks):
        for name in FINITE_ELEMENTS:
            yield _row(name, f"{name}, finite elements", flanks, lambda one: one.finite_elements)


def _row(
    name: str, words: str, flanks: list[FlankSheet], figures: Callable[[FlankSheet], Mapping[str, float]]
) -> dict[str, str]:
    unit = UNITS.get(name, "")
    values = {f"{flank.gear} {flank.flank}": sheet_value(name, figures(flank).get(name, math.nan)) for flank in flanks}
    form = ".4g" if name == "N_L" else _DIGITS.get(unit, ".3f")
    return {"factor": f"{words}, {unit}" if unit else words} | {
        "\n".join(wrapped(label, GEAR_COLUMN)): _number(value, form) for label, value in values.items()
    }


def _number(value: float, form: str) -> str:
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf."
    return format(value, form)


def _remarks(sheet: FlankSheet) -> Iterator[str]:
    yield from (f"{sheet.family}: {name} {reason}" for name, reason in sheet.lacking.items())
    yield from (f"{sheet.gear} in {sheet.family}: {remark}" for remark in sheet.remarks)
