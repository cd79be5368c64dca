"""The command line that a user typed, written once more."""

from __future__ import annotations

import shlex

import typer


def resuming(context: typer.Context) -> str:
    """Write the command that goes on with what was stopped: the same one with `--resume`.

    Options that were left out stay out, so that what they follow is asked for again.
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
