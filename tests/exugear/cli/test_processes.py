"""The program among others: signals that end it, and standard streams that fail."""

from __future__ import annotations

import contextlib
import logging
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray as xr

from exugear.cli.console import StoppedError, exit_codes, say_what_is_logged
from exugear.results.run_file import load_run

from ..cases.spur import SPUR_CASE

pytestmark = pytest.mark.usefixtures("terminal_signals")
ROOT = Path(__file__).parents[3]
CASE = ROOT / "cases" / "grc750" / "gearbox.toml"
SIGNALS_IN_EACH_CHANGE = {(signal.SIGKILL, 5), (signal.SIGINT, 3)}
"""Signal and seed of its delay: killed while workers work, stopped while they begin; the others before a release."""
PROGRAM = "from exugear.cli.app import main; main()"
#: The same with few elements a tooth.
COARSE_PROGRAM = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[1] / "cases")!r})
import exugear.system.tooth_mesh.tables, spur
exugear.system.tooth_mesh.tables.TableInput = spur.COARSE_INPUT
{PROGRAM}
"""


def command(*arguments, program=PROGRAM):
    return [sys.executable, "-c", program, *map(str, arguments)]


def begun(*arguments, program=PROGRAM, **options):
    called = command(*arguments, program=program)
    return subprocess.Popen(called, stderr=subprocess.PIPE, text=True, cwd=ROOT, **options)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_other_requests_to_stop_act_as_ctrl_c(number, capsys):
    with pytest.raises(SystemExit) as end, exit_codes():
        os.kill(os.getpid(), number)
        time.sleep(10.0)
    assert end.value.code == 130
    assert "Stopped" in capsys.readouterr().err


def test_a_hangup_that_nohup_has_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with exit_codes():
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


def test_ctrl_c_that_nothing_noticed_ends_the_work_with_130(capsys):
    with pytest.raises(SystemExit) as end, exit_codes(), contextlib.suppress(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    assert end.value.code == 130
    assert "Stopped" in capsys.readouterr().err


def test_ctrl_c_in_a_callback_of_a_library_stops_without_a_traceback():
    """Where Python drops it, as while kernels are compiled."""
    program = """
import ctypes, signal
from exugear.cli.console import exit_codes
called_back = ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGINT))
with exit_codes():
    called_back()
"""
    process = begun(program=program)
    _, said = process.communicate(timeout=30.0)
    assert process.returncode == 130
    assert said == "Stopped: finished results are kept; run the same command to resume\n"


def test_ctrl_c_that_a_library_made_an_error_of_ends_the_work_with_130(capsys):
    with pytest.raises(SystemExit) as end, exit_codes():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise SystemError("returned a result with an exception set") from None
    assert end.value.code == 130
    assert "SystemError" not in capsys.readouterr().err


def test_what_a_stopped_work_says_stays(capsys):
    with pytest.raises(SystemExit), exit_codes():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise StoppedError("kept in this file") from None
    assert "Stopped: kept in this file" in capsys.readouterr().err


def test_the_second_ctrl_c_ends_at_once():
    program = """
import sys, time
from exugear.cli.console import exit_codes
with exit_codes():
    try:
        print("working", file=sys.stderr, flush=True)
        time.sleep(600.0)
    finally:
        print("putting away", file=sys.stderr, flush=True)
        time.sleep(600.0)
"""
    process = begun(program=program)
    for line in ("working\n", "putting away\n"):
        assert process.stderr.readline() == line
        process.send_signal(signal.SIGINT)
    process.communicate(timeout=10.0)
    assert process.returncode == -signal.SIGINT


def stopped_run(case, number, delay=None):
    """Exit code, what was said, s until the end, and file of a long run that got a signal.

    The signal comes a while (s) after the results folder was made, or after the run began to write. Torques nearly in
    balance: a run that gains speed ends by itself on a fast machine, before the signal, where wheels would burst.
    """
    out = case.parent / "out"
    case.write_text(SPUR_CASE.replace("shaft_2 = 140.0", "shaft_2 = 149.9"), encoding="utf-8")
    process = begun("run", case, "--variant", "bushing", "--mesh-model", "iso6336", "--duration", 300, "--out", out)
    folder = out / "bushing" / "run_up-iso6336-disc"
    begun_with = folder / "run.partial" / "000001.npz" if delay is None else out
    deadline = time.monotonic() + 300.0
    while not begun_with.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(0.5 if delay is None else delay)
    process.send_signal(number)
    begin = time.monotonic()
    _, said = process.communicate(timeout=120)
    return process.returncode, said, time.monotonic() - begin, folder / "run.partial"


@pytest.mark.validation
def test_a_run_that_is_terminated_keeps_what_it_reached(case):
    code, said, _, partial = stopped_run(case, signal.SIGTERM)
    assert code == 130, said
    assert "resume with:\nexugear run " in said
    assert load_run(partial).sizes["time"] > 0


@pytest.mark.validation
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.long) for seed in (0, *range(2, 10)))])
def test_ctrl_c_at_any_time_of_a_run_ends_it_soon_with_130(case, seed):
    """Loading libraries and kernels, start, compiled loop, writing."""
    delay = random.Random(seed).uniform(0.0, 5.0)
    code, said, took, _ = stopped_run(case, signal.SIGINT, delay)
    assert code == 130, said
    assert "Traceback" not in said
    assert "SystemError" not in said
    assert took < 10.0


@pytest.mark.validation
@pytest.mark.parametrize(
    ("number", "seed"),
    [
        pytest.param(number, seed, marks=() if (number, seed) in SIGNALS_IN_EACH_CHANGE else pytest.mark.long)
        for number in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
        for seed in range(7)
    ],
)
def test_no_worker_outlives_a_sweep(case, number, seed):
    """Workers begin, load libraries, work; they hold the program's standard error open while they live."""
    grid = "centre_distance_offsets_um = [0.0, 100.0, 200.0]"
    case.write_text(SPUR_CASE.replace("positions = 8", f"positions = 8, {grid}"), encoding="utf-8")
    arguments = ("ste", case, "--grid", "--positions", 100, "--out", case.parent / "out")
    mark = f"EXUGEAR_TEST_MARK={os.getpid()}-{number}-{seed}"
    name, value = mark.split("=")
    process = begun(*arguments, program=COARSE_PROGRAM, env={**os.environ, name: value})
    deadline = time.monotonic() + 120.0
    while len(marked(mark)) < 3 and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(random.Random(seed).uniform(0.0, 4.0))
    assert process.poll() is None
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == (-number if number == signal.SIGKILL else 130), said
    deadline = time.monotonic() + 20.0
    while marked(mark) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert marked(mark) == []


def marked(mark):
    """Processes with an entry in their environment."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if mark.encode() in (process / "environ").read_bytes().split(b"\0"):
                found.append(int(process.name))
    return found


def outcome_into(output, *arguments, stderr=subprocess.PIPE, **options):
    return subprocess.run(
        command(*arguments), stdout=output, stderr=stderr, text=True, cwd=ROOT, check=False, timeout=120, **options
    )


def said(outcome):
    """Standard error without the message that kernels are compiled, and without the warning of the GRC's damping."""
    lines = outcome.stderr.splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith(("Compiling kernels", "Warning: damping of")))


def close_standard_output():
    os.close(1)


needs_full_device = pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")


@pytest.mark.validation
@needs_full_device
@pytest.mark.parametrize(
    "arguments",
    [["check", CASE], pytest.param(["check", CASE, "--json"], marks=pytest.mark.long), ["--version"], ["--help"]],
)
def test_a_full_standard_output_is_a_sentence_and_code_1(arguments):
    with open("/dev/full", "w") as full:
        outcome = outcome_into(full, *arguments)
    assert said(outcome) == "Failed: standard output: No space left on device\n"
    assert outcome.returncode == 1


@pytest.mark.validation
@pytest.mark.long
def test_a_closed_standard_output_is_a_sentence_and_code_1():
    outcome = outcome_into(None, "check", CASE, "--json", preexec_fn=close_standard_output)
    assert said(outcome) == "Failed: standard output: Bad file descriptor\n"
    assert outcome.returncode == 1


@pytest.mark.validation
def test_a_reader_that_has_read_enough_is_code_141_without_a_word():
    reader, writer = os.pipe()
    os.close(reader)
    outcome = outcome_into(writer, "check", CASE)
    os.close(writer)
    assert (outcome.returncode, said(outcome)) == (141, "")


@pytest.mark.validation
@needs_full_device
def test_what_cannot_be_said_on_standard_error_costs_nothing(case):
    """A verb with a progress bar and messages."""
    out = case.parent / "out"
    with open("/dev/full", "w") as full:
        run = ("run", case, "--variant", "rigid", "--mesh-model", "iso6336", "--duration", 0.01, "--out", out)
        outcome = outcome_into(subprocess.PIPE, *run, stderr=full)
        assert outcome.returncode == 0
        assert "Results: " in outcome.stdout
        assert outcome_into(subprocess.PIPE, "check", "missing.toml", stderr=full).returncode == 2


@pytest.mark.validation
def test_no_result_is_lost_with_a_standard_output_that_cannot_be_written(case):
    """Nor does what is printed get into a file that was given the number of a closed stream."""
    out = case.parent / "out"
    run = ("run", case, "--variant", "rigid", "--mesh-model", "iso6336", "--duration", 0.01, "--out", out)
    outcome = outcome_into(None, *run, preexec_fn=close_standard_output)
    assert outcome.returncode == 1
    assert "standard output: " in outcome.stderr
    with xr.open_dataset(out / "rigid" / "run_up-iso6336-disc" / "run.nc", engine="h5netcdf") as data:
        assert data.attrs["complete"] == 1


def test_what_the_library_logs_is_said_on_standard_error(capsys):
    loggers = [logging.getLogger(name) for name in ("exugear", "fe_ste")]
    try:
        say_what_is_logged()
        logging.getLogger("fe_ste.tools.compilation").info("Compiling [kernels]")
        assert capsys.readouterr().err == "Compiling [kernels]\n"
    finally:
        for logger in loggers:
            logger.handlers.clear()
            logger.setLevel(logging.NOTSET)


@pytest.mark.validation
def test_what_is_compiled_is_told_before_it_is_and_ctrl_c_ends_it(tmp_path):
    """The first verb of an installation: nothing is left of a run that did not begin."""
    verb = ["run", str(CASE), "--variant", "rigid", "--mesh-model", "iso6336", "--duration", "0.01"]
    command = [sys.executable, "-c", PROGRAM, *verb, "--out", str(tmp_path / "out")]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "kernels")}
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as process:
        told = ""
        while "update" not in told:  # the console may wrap the line
            told += process.stderr.readline()
        process.send_signal(signal.SIGINT)
        said = process.stderr.read()
    told = " ".join(told.split())
    assert "of the equations of motion (10 to 30 s per model type); once per installation" in told
    assert process.returncode == 130, said
    assert "Stopped" in said
    assert not list((tmp_path / "out").rglob("run*"))
