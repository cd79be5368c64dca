"""The command line as a user calls it, in the process of the test."""

from __future__ import annotations

from typing import Any

from typer.testing import CliRunner

from exugear.cli.app import app


def exugear(*arguments: object, **environment: str) -> Any:
    """Outcome of a command: exit code and what it wrote on both streams."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments], env=environment)
