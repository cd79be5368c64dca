"""The page of `exugear edit` in a real browser, with the real server: type, correct, slide, select, save, compute."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from exugear.cli.edit.stored import EditedFile, digest_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.templates.kinds import template
from exugear.results.folder import REPORT_FILE, keep_case, note_time

from .page_view import IN_BROWSER, SIZES

pytestmark = IN_BROWSER
PAIR = template("pair")
WAIT = 120_000
"""Longest wait, ms: compiled kernels may have to be compiled first."""


class EditView:
    """A page of the server, and what went wrong in it."""

    def __init__(self, browser: Any, address: str, size: str = "desk") -> None:
        width, height = SIZES[size]
        self.errors: list[str] = []
        self.page = browser.new_context(viewport={"width": width, "height": height}, reduced_motion="reduce").new_page()
        self.page.set_default_timeout(WAIT)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda told: self.errors.append(told.text) if told.type == "error" else None)
        self.page.on("dialog", lambda dialog: dialog.accept())
        self.page.on(
            "request", lambda asked: None if asked.url.startswith((address, "blob:")) else self.errors.append(asked.url)
        )
        self.address = address
        self.open()

    def open(self) -> None:
        self.page.goto(self.address)
        self.page.wait_for_selector("html[data-ready]", state="attached")

    def current(self) -> None:
        """Wait until all results belong to the text."""
        self.page.wait_for_selector("html[data-ready]:not(:has([data-step].old))", state="attached")

    def line(self, words: str) -> None:
        """Put the cursor at the beginning of a line that is in view."""
        self.page.locator(".cm-line", has_text=words).first.click()
        self.page.keyboard.press("Home")

    def type_over(self, words: str, count: int, text: str) -> None:
        """Replace the last characters of a line without a comment."""
        self.page.locator(".cm-line", has_text=words).first.click()
        self.page.keyboard.press("End")
        for _ in range(count):
            self.page.keyboard.press("Backspace")
        self.page.keyboard.type(text)

    def text(self, selector: str) -> str:
        return str(self.page.locator(selector).inner_text())

    def pixels(self, selector: str) -> str:
        return str(self.page.evaluate("s => document.querySelector(s).toDataURL()", selector))

    def soon(self, claim: Callable[[], bool], seconds: int = 30) -> bool:
        for _ in range(10 * seconds):
            if claim():
                return True
            self.page.wait_for_timeout(100)
        return False


@pytest.fixture(scope="module")
def served(
    tmp_path_factory: pytest.TempPathFactory, terminal_signals_of_module: None
) -> Iterator[tuple[Path, str, subprocess.Popen[str]]]:
    """File, address and process of one server for all tests, since its start takes longer than most of them."""
    pytest.importorskip("playwright", reason="no playwright: pip install playwright")
    path = tmp_path_factory.mktemp("edit") / "pair.toml"
    path.write_text(PAIR, encoding="utf-8")
    command = [sys.executable, "-P", "-c", "from exugear.cli.app import main; main()"]
    arguments = ["edit", str(path), "--no-browser", "--out", str(path.parent / "results")]
    with subprocess.Popen(
        [*command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as server:
        assert server.stdout is not None
        found = re.search(r"http://127\.0\.0\.1:\d+/[\w-]+/", server.stdout.readline())
        assert found
        yield path, found[0], server
        server.send_signal(signal.SIGINT)
        assert server.wait(60) == 130


@pytest.fixture
def case(served: tuple[Path, str, Any]) -> Path:
    """The file as it was before the first test, without results."""
    path = served[0]
    path.write_text(PAIR, encoding="utf-8")
    shutil.rmtree(path.parent / "results", ignore_errors=True)
    return path


@pytest.fixture
def address(served: tuple[Path, str, Any], case: Path) -> str:
    return served[1]


@pytest.fixture
def process(served: tuple[Path, str, subprocess.Popen[str]]) -> subprocess.Popen[str]:
    return served[2]


@pytest.fixture
def early_view(browser: Any, address: str) -> Iterator[EditView]:
    """A page whose results are still being computed."""
    one = EditView(browser, address)
    yield one
    one.page.context.close()


@pytest.fixture
def view(early_view: EditView) -> EditView:
    early_view.current()
    return early_view


def test_an_error_is_shown_at_its_line_and_its_correction_is_taken(view: EditView) -> None:
    view.line("teeth = 24")
    view.page.keyboard.press("Delete")
    view.page.keyboard.press("Delete")
    view.page.wait_for_selector("#verdict.bad")
    number = PAIR.split("\n").index("teeth = 24") + 1
    assert "did you mean 'teeth'?" in view.text("#remarks")
    assert view.text("#remarks button.choice") == f"Line {number}"
    assert view.page.locator(".cm-lint-marker-error").count() == 1
    assert view.page.locator("[data-step=dynamics].old").count() > 0
    view.page.get_by_role("button", name="Replace by teeth").click()
    view.current()
    assert view.page.locator("#verdict.good").count() == 1
    assert view.page.locator(".cm-line", has_text="teeth = 24").count() == 1
    assert view.errors == []


def test_results_of_an_earlier_text_stay_grey_while_there_is_an_error(view: EditView) -> None:
    view.type_over("modal_percent = 2.0", 1, "5")
    view.page.keyboard.type("x")
    view.page.wait_for_selector("#verdict.bad")
    view.page.wait_for_timeout(1000)
    steps = view.page.locator("[data-step]")
    assert [one.get_attribute("aria-busy") for one in steps.all()] == ["true"] * steps.count()
    assert view.errors == []


def test_keys_are_completed_with_their_meaning(view: EditView) -> None:
    view.type_over("held_diameter_mm = 90.0", 0, "\ntip_d")
    # The list is narrowed as the key is typed.
    view.page.wait_for_selector(".cm-tooltip-autocomplete li:first-child:has-text('tip_diameter_mm')")
    assert "number; mm" in view.text(".cm-completionDetail >> nth=0")
    assert "diameter" in view.text(".cm-completionInfo")
    assert view.soon(lambda: "old" in str(view.page.get_attribute("[data-step=check]", "class")))
    view.page.wait_for_timeout(100)  # CodeMirror ignores Enter just after its list has opened
    view.page.keyboard.press("Enter")
    assert re.match(r"tip_diameter_mm = [\d.]+$", view.text(".cm-activeLine"))
    assert view.errors == []


def test_the_slider_changes_text_modes_and_campbell_diagram_and_is_undone(view: EditView) -> None:
    first = "#table-modes tbody tr:nth-child(2) td:nth-child(2)"
    frequency, diagram = view.text(first), view.pixels("#campbell canvas")
    view.line("factor = 0.5")
    for _ in range(len("factor = 0")):
        view.page.keyboard.press("ArrowRight")
    assert view.text("#key-name") == "housing.factor"
    view.page.locator("#slider").fill("0.3")
    assert view.page.locator(".cm-line", has_text="factor = 0.3").count() == 1
    view.current()
    assert view.text(first) != frequency
    assert view.pixels("#campbell canvas") != diagram
    view.page.click("#undo")
    assert view.page.locator(".cm-line", has_text="factor = 0.5").count() == 1
    view.current()
    assert view.text(first) == frequency
    assert view.errors == []


def test_picture_and_text_select_each_other(view: EditView) -> None:
    plain, marks = view.pixels("#view-3d"), view.pixels("#marks")
    view.line("[gears.pinion]")
    assert view.soon(lambda: view.pixels("#marks") != marks)
    assert view.pixels("#view-3d") != plain
    box = view.page.locator("#view-3d").bounding_box()
    view.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert view.soon(lambda: re.match(r"\[(gears|bodies|bearings)\.", view.text(".cm-activeLine")) is not None)
    before = view.text(".cm-activeLine")
    view.page.locator("#table-bearings .choice").first.click()
    assert view.soon(lambda: view.text(".cm-activeLine").startswith("[bearings."))
    assert view.text(".cm-activeLine") != before
    assert view.errors == []


def test_a_mode_is_chosen_in_the_table_and_in_the_diagram(view: EditView) -> None:
    view.page.locator("#table-modes .choice").nth(3).click()
    chosen = view.text("#table-modes tr.chosen td:first-child")
    assert view.soon(lambda: view.text("#mode-title").startswith(f"Mode {chosen} at"))
    view.page.click("#next")
    assert view.soon(lambda: view.text("#mode-title").startswith(f"Mode {int(chosen) + 1} at"))
    assert view.errors == []


@pytest.mark.parametrize("name", ["Tables", pytest.param("Design changes", marks=pytest.mark.long)])
def test_long_work_shows_progress_and_is_cancelled(browser: Any, address: str, case: Path, name: str) -> None:
    case.write_text(f"{PAIR}\n[ste]\npositions = 1000\n", encoding="utf-8")  # half a minute on a fast machine
    view = EditView(browser, address)
    view.current()
    view.page.get_by_role("button", name=name).click()
    view.page.wait_for_selector("#cancel:visible")
    assert view.soon(lambda: view.page.evaluate("document.getElementById('progress').value") > 0)
    assert re.search(r"(state|position) \d+ of \d+", view.text("#work-words"))
    view.page.click("#cancel")
    assert view.soon(lambda: view.text("#work-words").startswith(f"{name}: cancelled after"))
    assert not view.page.locator("#cancel").is_visible()
    assert not list((case.parent / "results").glob("**/*.tmp"))
    # Tables that were finished before are kept, and belong to this text.
    assert view.page.locator("#stored .old").count() == 0
    assert "Report" not in view.text("#stored")
    assert view.errors == []
    view.page.context.close()


@pytest.mark.long
def test_finished_design_changes_are_opened_in_a_page_of_their_own(view: EditView) -> None:
    view.page.get_by_role("button", name="Design changes").click()
    assert view.soon(lambda: "Design change 2 of" in view.text("#work-words"), seconds=300)
    assert view.soon(lambda: view.text("#work-words").startswith("Design changes: done after"), seconds=900)
    with view.page.context.expect_page() as opened:
        view.page.get_by_role("link", name="Open report").click()
    opened.value.get_by_role("heading", name="Design changes").wait_for(state="attached")
    assert view.errors == []


def test_stored_results_of_another_state_are_grey_and_said_in_words(view: EditView, case: Path) -> None:
    assert not view.page.locator("#stored").is_visible()
    folder = case.parent / "results"
    keep_case(Gearbox.from_toml(case), folder)
    for step in ("steady, bushing, discs, line_of_action", "report"):
        note_time(folder, step, 1.0)
    (folder / REPORT_FILE).write_text("<title>report</title>")
    assert view.soon(lambda: "Report: for this text" in view.text("#stored"))
    assert view.page.locator("#stored .old").count() == 0
    view.type_over("modal_percent = 2.0", 3, "2.5")
    assert view.soon(lambda: "Report: for the saved file, not for this text" in view.text("#stored"))
    assert view.text("#report") == "Open report of an earlier state"
    view.page.click("#save")
    assert view.soon(lambda: "Steady-state response: for an earlier state of the file" in view.text("#stored"))
    assert view.page.locator("#stored .old").count() == 3
    assert view.errors == []


def test_the_file_is_written_on_request_only_and_keeps_its_comments(view: EditView, case: Path) -> None:
    view.type_over("modal_percent = 2.0", 3, "2.5")
    view.current()
    assert case.read_text(encoding="utf-8") == PAIR
    view.page.get_by_role("button", name="Tables").click()
    assert "Save the file first" in view.text("#said")
    view.page.click("#save")
    assert view.soon(lambda: view.text("#saved") == "saved")
    assert case.read_text(encoding="utf-8") == PAIR.replace("modal_percent = 2.0", "modal_percent = 2.5")


def test_text_that_is_not_saved_survives_a_reload(view: EditView) -> None:
    view.type_over("modal_percent = 2.0", 3, "2.5")
    view.current()
    view.open()
    view.page.wait_for_selector(".cm-line >> text=modal_percent = 2.5")
    assert view.text("#saved") == "not saved"


def test_two_tabs_and_another_editor_do_no_harm(view: EditView, browser: Any, address: str, case: Path) -> None:
    other = EditView(browser, address)
    view.type_over("modal_percent = 2.0", 3, "2.5")
    view.page.click("#save")
    other.page.wait_for_selector(".cm-line >> text=modal_percent = 2.5")
    # Both change it: the second to save is asked.
    other.type_over("modal_percent = 2.5", 3, "3.5")
    case.write_text(PAIR.replace("modal_percent = 2.0", "modal_percent = 1.0"), encoding="utf-8")
    view.page.wait_for_selector(".cm-line >> text=modal_percent = 1.0")
    other.page.wait_for_selector("#conflict:visible")
    number = PAIR.split("\n").index("modal_percent = 2.0") + 1
    assert f"They differ in line {number}." in other.text("#conflict-words")
    other.page.click("#keep-text")
    other.page.wait_for_selector("#conflict", state="hidden")
    # The other text is not lost: it is one step of undo away.
    other.page.click("#undo")
    other.page.wait_for_selector(".cm-line >> text=modal_percent = 1.0")
    other.page.click("#redo")
    other.page.wait_for_selector(".cm-line >> text=modal_percent = 3.5")
    other.page.click("#save")
    view.page.wait_for_selector(".cm-line >> text=modal_percent = 3.5")
    assert "modal_percent = 3.5" in case.read_text(encoding="utf-8")
    other.page.context.close()


def test_the_page_cannot_replace_what_another_server_has_saved(early_view: EditView, case: Path) -> None:
    view = early_view
    view.type_over("modal_percent = 2.0", 3, "2.5")
    EditedFile(case, case.parent / "results").save(PAIR.replace("= 2.0", "= 3.5"), digest_of(PAIR))
    view.page.click("#save")
    view.page.wait_for_selector("#conflict:visible")
    assert "modal_percent = 3.5" in case.read_text(encoding="utf-8")
    view.page.click("#take-file")
    view.page.wait_for_selector(".cm-line >> text=modal_percent = 3.5")
    assert view.text("#saved") == "saved"
    view.page.click("#undo")
    view.page.wait_for_selector(".cm-line >> text=modal_percent = 2.5")
    assert view.text("#saved") == "not saved"


@pytest.mark.skipif(sys.platform != "linux", reason="limits the files of another process")
def test_on_a_full_disk_the_file_keeps_its_content_and_the_page_says_so(
    early_view: EditView, case: Path, process: subprocess.Popen[str]
) -> None:
    """A file may not grow beyond a limit: as on a full disk, some of it can be written and the rest cannot."""
    import resource

    view = early_view
    view.type_over("modal_percent = 2.0", 3, "2.5")
    unlimited = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (1000, unlimited[1]))
    try:
        view.page.click("#save")
        view.page.wait_for_selector("#not-saved:visible")
    finally:
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, unlimited)
    told = view.text("#not-saved")
    assert told.startswith("The file was not saved and has its earlier content")
    assert "File too large" in told
    assert case.read_text(encoding="utf-8") == PAIR
    assert not list(case.parent.glob(".*"))
    assert view.text("#saved") == "not saved"
    view.page.click("#save")
    assert view.soon(lambda: view.text("#saved") == "saved")
    assert not view.page.locator("#not-saved").is_visible()


def test_work_that_fails_says_why(early_view: EditView, case: Path) -> None:
    view = early_view
    (case.parent / "results").write_text("no folder")
    view.page.get_by_role("button", name="Tables").click()
    assert view.soon(lambda: view.text("#work-words").startswith("Tables: failed after"))
    assert re.search(r"s\. Bad input: .*results: .*; specify a folder", view.text("#work-words"))
    (case.parent / "results").unlink()
    assert view.errors == []


def test_on_a_phone_text_and_results_take_turns(browser: Any, address: str) -> None:
    view = EditView(browser, address, "phone")
    assert view.page.locator("#text").is_visible()
    view.page.get_by_role("button", name="Results").click()
    view.current()
    assert not view.page.locator("#text").is_visible()
    assert view.page.evaluate("document.documentElement.scrollWidth") == SIZES["phone"][0]
    assert view.errors == []
    view.page.context.close()
