"""The command `edit`: start of the server, and its end."""

from __future__ import annotations

import threading
import webbrowser
from collections import deque
from pathlib import Path

from exugear.cli.case import check_allow_dir
from exugear.cli.console import BadInputError, StoppedError, check_results_folder, note, say
from exugear.cli.edit.server import EditServer
from exugear.gearbox.reading import read_text
from exugear.project import results_folder


def edit(case: Path, out: Path | None, allow_dir: Path | None, port: int, browser: bool) -> None:
    """Serve the page of a gearbox file until no page is open."""
    check_allow_dir(allow_dir)
    folder = results_folder(case, out)
    check_results_folder(folder)
    if not case.is_file():
        raise BadInputError(f"{case}: no such file; write one to start from by: exugear new {case}")
    text = read_text(case)
    try:
        server = EditServer(case, folder, allow_dir, port)
    except OSError as error:
        raise BadInputError(f"--port {port}: cannot be used ({error.strerror}); omit it for any free port") from error
    say(f"Page of {case}: {server.address}")
    note("The address is for this machine and this user only. End: Ctrl-C, or close the page.")
    # Kernels are loaded, or compiled once per installation, while the browser opens the page.
    threading.Thread(target=lambda: deque(server.analyst.steps(text, "start"), 0), daemon=True).start()
    if browser:
        webbrowser.open(server.address)
    try:
        server.serve()
        note("No page is open: the server has ended.")
    except KeyboardInterrupt:
        raise StoppedError("the editor has ended; finished results are kept") from None
    finally:
        server.server_close()
        server.work.end()
        if (unsaved := server.file.keep_unsaved()) is not None:
            note(f"Unsaved text of the page: {unsaved}", style="yellow")
