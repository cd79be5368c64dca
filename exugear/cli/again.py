"""The typed command line, written as a command to repeat or resume it."""

from __future__ import annotations

import shlex

import typer


def resuming(context: typer.Context) -> str:
    """Return the command that resumes interrupted work: the typed command with `--resume`.

    Omitted options remain omitted, so that their default behaviour applies again.
    """
    words = ["exugear", str(context.info_name)]
    for parameter in context.command.params:
        source = context.get_parameter_source(str(parameter.name))
        value = context.params.get(str(parameter.name))
        if source is None or source.name != "COMMANDLINE" or parameter.name == "resume":
            continue
        if parameter.param_type_name == "argument":
            words.append(str(value))
        elif value is True:
            words.append(parameter.opts[0])
        else:
            words += [parameter.opts[0], str(value)]
    return shlex.join([*words, "--resume"])
