"""The command line: the table of its commands, and their common settings.

The commands have their options and import what they do, `exugear.cli.tasks`, only when they start, so that ``--help``
responds immediately. `exugear.cli.console.exit_codes` ends all of them.
"""

from __future__ import annotations

import gc
import importlib
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from exugear.cli.console import exit_codes, say, say_what_is_logged
from exugear.cli.process import leave_out_dask, standard_streams

COMMANDS = (
    "files.new",
    "files.import_",
    "files.schema",
    "files.migrate",
    "files.check",
    "files.edit",
    "models.ste",
    "models.bearings",
    "models.modes",
    "models.steady",
    "models.measured",
    "models.run",
    "models.study",
    "models.loads",
    "models.losses",
    "models.life",
    "models.view",
    "models.report",
    "files.export",
)
"""Module and function of each command, in the order of the help; names that Python reserves have a trailing underscore,
which the command line omits.
"""

OBJECTS_OF_A_START = 300_000
"""Number of new objects that starts a garbage collection: more than a start creates, but without noticeable memory use.
"""

RENAMED = {
    "sweep": "study",
    "--mesh-law": "--mesh-model",
    "--level": "--method",
    "--branches": "--continuation",
    "--files-below": "--allow-dir",
}
"""Commands and options of earlier versions, which are refused with the new names."""
RENAMED_VARIABLE = "EXUGEAR_FILES_BELOW"
"""Environment variable of earlier versions."""


app = typer.Typer(
    help="Gearbox dynamics: transmission error, modes, resonances, run-ups, loads and service life.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_show_locals=False,
)


def main() -> None:
    """Run the command line.

    BLAS uses one thread: its idle threads wait actively and slow down the compiled kernels severalfold.
    """
    if message := old_name(sys.argv[1:]):
        typer.echo(f"Error: {message}", err=True)
        sys.exit(2)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    leave_out_dask()
    say_what_is_logged()
    with garbage_seldom_looked_for(), standard_streams():
        app()


def old_name(arguments: list[str]) -> str:
    """Return a message about the first old name on the command line; empty if there is none.

    Examples
    --------
    >>> old_name(["steady", "my.toml", "--level=linear"])
    '--level was renamed to --method'
    """
    if RENAMED_VARIABLE in os.environ:
        return f"{RENAMED_VARIABLE} was renamed to EXUGEAR_ALLOW_DIR"
    for number, argument in enumerate(arguments):
        name = argument.split("=")[0]
        if name in RENAMED and (number == 0 or name.startswith("--")):
            return f"{name} was renamed to {RENAMED[name]}"
    return ""


@contextmanager
def garbage_seldom_looked_for() -> Iterator[None]:
    """Reduce the frequency of garbage collection and skip it at exit, which saves a fifth of a short command's time.

    Loading the libraries creates a quarter of a million permanent objects. By default Python traverses them after every
    few hundred new ones, and twice when the process ends, although its memory is then released in any case.
    """
    often = gc.get_threshold()
    gc.set_threshold(OBJECTS_OF_A_START, *often[1:])
    try:
        yield
    finally:
        gc.set_threshold(*often)
        gc.freeze()


def _print_version(wanted: bool) -> None:
    if wanted:
        from exugear import __version__

        say(f"exugear {__version__}")
        raise typer.Exit


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Define the options of the program without a command."""


for place in COMMANDS:
    module, verb = place.split(".")
    command = getattr(importlib.import_module(f"exugear.cli.commands.{module}"), verb)
    app.command(verb.rstrip("_"))(exit_codes()(command))
