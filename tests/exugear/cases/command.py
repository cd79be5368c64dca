"""The command line as a user calls it, in the process of the test."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from typer.testing import CliRunner

from exugear.cli.app import app


def exugear(*arguments: object, **environment: str) -> Any:
    """Outcome of a command: exit code and what it wrote on both streams."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments], env=environment)


def script(folder: Path, name: str) -> ModuleType:
    """Import a script and what it imports from its own folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        return importlib.import_module(name)
