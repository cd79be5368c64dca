"""Command line: one function per verb, thin over the library.

Libraries that take long to load are imported inside the verbs, so that ``--help`` answers at once.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from exugear.console import BadInputError, exit_codes, print_json, print_table, results

if TYPE_CHECKING:
    from exugear.gearbox import Gearbox, PairSpec

app = typer.Typer(
    help="Transmission error of gear pairs by finite elements, and gearbox dynamics in Exudyn.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
)

CaseArgument = Annotated[
    Path, typer.Argument(metavar="CASE.toml", help="The gearbox file.", show_default=False)
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print a summary as one JSON object.")]


def main() -> None:
    """Run the command line."""
    app()


def _print_version(wanted: bool) -> None:
    if wanted:
        from exugear import __version__

        results.print(f"exugear {__version__}", highlight=False)
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Hold what all verbs share."""


@app.command()
def check(case: CaseArgument, as_json: JsonOption = False) -> None:
    """Read and check a gearbox file; compute nothing."""
    with exit_codes():
        gearbox = read_gearbox(case)
        pairs = [_pair_summary(name, spec) for name, spec in gearbox.pairs.items()]
        if as_json:
            print_json({"case": str(case), "name": gearbox.name, "ratio": gearbox.ratio, "pairs": pairs})
            return
        results.print(f"{gearbox.name}: no fault found, ratio {gearbox.ratio:.6f}", highlight=False)
        print_table("Gear pairs", [_pair_row(pair) for pair in pairs])


def read_gearbox(case: Path) -> Gearbox:
    """Read a gearbox file for a verb."""
    from exugear.gearbox import CaseError, Gearbox

    try:
        return Gearbox.from_toml(case)
    except CaseError as error:
        raise BadInputError(error) from error


def _pair_summary(name: str, spec: PairSpec) -> dict[str, Any]:
    pair = spec.pair
    return {
        "pair": name,
        "teeth": [pair.pinion.teeth, pair.gear.teeth],
        "centre_distance_mm": 1e3 * pair.centre_distance,
        "pressure_angle_deg": math.degrees(pair.working_pressure_angle),
        "transverse_contact_ratio": pair.transverse_contact_ratio,
        "overlap_ratio": pair.overlap_ratio,
        "torque_gear_1_N_m": spec.static_torque,
    }


def _pair_row(pair: dict[str, Any]) -> dict[str, str]:
    return {
        "pair": pair["pair"],
        "teeth": "{}/{}".format(*pair["teeth"]),
        "centre dist.\nmm": f"{pair['centre_distance_mm']:.3f}",
        "press. angle\ndeg": f"{pair['pressure_angle_deg']:.3f}",
        "contact ratio\n+ overlap": f"{pair['transverse_contact_ratio']:.3f} + {pair['overlap_ratio']:.3f}",
        "torque 1\nN m": f"{pair['torque_gear_1_N_m']:.1f}",
    }
