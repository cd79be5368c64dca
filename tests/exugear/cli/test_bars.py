"""What long work shows, and how errors of the model end: one display however deep the work, one place of exit codes."""

from __future__ import annotations

import io
import re

import pytest
from rich.console import Console

from exugear.cli.bars import Bars, files_read
from exugear.cli.console import BadInputError, FailedError, exit_codes, model_errors, progress_bar
from exugear.gearbox.reading import GearboxFileError
from exugear.system.statics import BalanceError
from exugear.system.tooth_mesh.placement import MeshError


def test_work_inside_of_other_work_adds_a_row_to_its_display(capsys):
    bars = Bars()
    with bars.row() as outer:
        outer("steady state")
        display = bars.display()
        with bars.row() as inner:
            inner("table", 3, 4)
        assert bars.display() is display, "the console refuses a second one"
        outer("steady state", 1, 2)
        assert [(task.description, task.completed, task.total) for task in display.tasks] == [
            ("steady state", 1, 2),
            ("table", 3, 4),
        ]
    with bars.row() as later:
        later("run")
        assert bars.display() is not display
    assert capsys.readouterr().err == "", "a finished display disappears"


def test_a_row_that_has_nothing_to_say_shows_nothing(capsys):
    with Bars().row() as row:
        files_read(row)(1, 1)
    assert capsys.readouterr().err == ""


def test_an_error_closes_the_display_and_the_next_work_has_its_own():
    bars = Bars()
    with pytest.raises(ZeroDivisionError), bars.row() as row:
        row("work")
        raise ZeroDivisionError
    with bars.row() as row:
        row("more")


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (GearboxFileError("gearbox.toml: bodies: missing"), 2),
        (MeshError("a mesh that cannot be"), 2),
        (BalanceError("no state at rest"), 1),
        (BadInputError("bad"), 2),
        (FailedError("failed"), 1),
        (OSError(28, "No space left on device", "a.nc"), 1),
    ],
)
def test_errors_of_the_model_end_with_their_code_wherever_they_come_from(error, code, capsys):
    with pytest.raises(SystemExit) as ended, exit_codes():
        raise error
    assert ended.value.code == code
    assert str(error.strerror if isinstance(error, OSError) else error) in capsys.readouterr().err


def test_an_error_of_the_program_keeps_its_traceback():
    with pytest.raises(ZeroDivisionError), exit_codes():
        raise ZeroDivisionError


def test_who_looks_at_an_error_gets_that_of_the_command_line_with_its_cause():
    cause = GearboxFileError("one", "two")
    with pytest.raises(BadInputError) as told, model_errors():
        raise cause
    assert told.value.__cause__ is cause


def test_a_bar_is_one_line_in_80_columns_and_names_what_is_left():
    with progress_bar() as bar:
        task = bar.add_task("bushing: 10.00 of 10 s, 8.89 simulated s per s, and a long name", total=4.0)
        bar.update(task, completed=1.0)
        bar.update(task, completed=2.0)
        console = Console(width=80, file=io.StringIO(), color_system=None)
        console.print(bar.make_tasks_table(bar.tasks))
    (line,) = console.file.getvalue().splitlines()
    assert "…" in line and " 50% " in line
    assert re.search(r"0:00:00(, 0:00:\d\d left)?\s*$", line)


def test_a_bar_without_a_known_end_states_the_elapsed_time_alone():
    with progress_bar() as bar:
        bar.add_task("report", total=None)
        console = Console(width=80, file=io.StringIO(), color_system=None)
        console.print(bar.make_tasks_table(bar.tasks))
    assert "left" not in console.file.getvalue()
