"""Reference page of the command line, generated from the program: every command, argument and option."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Any

import typer
from sphinx.application import Sphinx

from exugear.cli.app import app as command_line

PAGE = Path(__file__).parent.parent / "reference" / "command_line.md"
HEAD = """# Command line

Every command with its arguments and options, as `exugear COMMAND --help` prints them. The order of the commands and
their exit codes are described in [workflow](workflow.md).
"""


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("builder-inited", lambda app: write_page())
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_page() -> None:
    """Write the page if the command line changed."""
    text = page()
    if not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != text:
        PAGE.write_text(text, encoding="utf-8")


def page() -> str:
    """Return the page in Markdown."""
    group: Any = typer.main.get_command(command_line)
    return "\n".join([HEAD, *(_verb(name, verb) for name, verb in group.commands.items() if not verb.hidden)])


def _verb(name: str, verb: Any) -> str:
    arguments = [one for one in verb.params if one.param_type_name == "argument"]
    options = [one for one in verb.params if one.param_type_name == "option" and not one.hidden]
    called = " ".join(["exugear", name, *(one.metavar for one in arguments), "[OPTIONS]"])
    parts = [f"## {name}", "", verb.help, "", f"    {called}", ""]
    parts += [f"`{one.metavar}`\n: {one.help}\n" for one in arguments]
    parts += [f"{_heading(one)}\n: {one.help or ''}{_from_environment(one)}\n" for one in options]
    return "\n".join(parts)


def _heading(option: Any) -> str:
    """Return names, values and default of an option."""
    kind = option.type_descriptor.annotation
    choices = [str(value.value) for value in kind] if isinstance(kind, type) and issubclass(kind, Enum) else []
    taken = "" if option.is_flag else " | ".join(choices) or option.metavar or kind.__name__.upper()
    default = option.default.value if isinstance(option.default, Enum) else option.default
    said = "needed" if option.required else "" if default in (None, False) or option.is_flag else f"default {default}"
    words = ["`" + ", ".join(option.opts) + (f" {taken}" if taken else "") + "`", said]
    return ", ".join(filter(None, words))


def _from_environment(option: Any) -> str:
    return f" Also by the environment variable `{option.envvar}`." if option.envvar else ""
