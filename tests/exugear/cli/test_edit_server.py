"""The server of `exugear edit` answers its own page only, and survives hostile requests."""

from __future__ import annotations

import http.client
import json
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from exugear.cli.app import app
from exugear.cli.console import PROGRESS_SIGN, PROGRESS_VARIABLE, progress_bar
from exugear.cli.edit.server import MOST_BYTES, EditServer
from exugear.cli.edit.stored import UNSAVED_FILE, EditedFile, FileConflictError, digest_of
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.reading import read_toml
from exugear.gearbox.templates.kinds import template
from exugear.results.folder import REPORT_FILE, keep_case, note_time

PAIR = template("pair")
JSON = {"Content-Type": "application/json"}


@pytest.fixture
def server(tmp_path: Path) -> Iterator[EditServer]:
    case = tmp_path / "pair.toml"
    case.write_text(PAIR, encoding="utf-8")
    one = EditServer(case, tmp_path / "results")
    threading.Thread(target=one.serve_forever, daemon=True).start()
    yield one
    one.shutdown()
    one.server_close()
    one.work.end()


def ask(
    server: EditServer, path: str, content: Any = None, method: str = "", headers: dict[str, str] | None = None
) -> tuple[int, bytes, http.client.HTTPMessage]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
    body = None if content is None else content if isinstance(content, bytes) else json.dumps(content).encode()
    given = {**(JSON if body is not None else {}), **(headers or {})}
    connection.request(method or ("GET" if body is None else "POST"), path, body, given)
    response = connection.getresponse()
    try:
        return response.status, response.read(), response.headers
    finally:
        connection.close()


def own(server: EditServer, path: str) -> str:
    return f"/{server.token}/{path}"


def test_the_page_stands_alone_and_may_only_ask_its_server(server):
    status, page, headers = ask(server, own(server, ""))
    text = page.decode()
    assert status == 200
    assert headers["Cache-Control"] == "no-store"
    assert headers["Referrer-Policy"] == "no-referrer"
    policy = text[text.index("default-src") :].split('"')[0].replace("&#39;", "'")
    assert "connect-src 'self'" in policy
    assert "unsafe" not in policy
    assert 'src="http' not in text
    assert server.token not in text


def test_the_server_is_bound_to_this_machine_alone(server):
    assert server.server_address[0] == "127.0.0.1"
    assert len(server.token) >= 32


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": "https://example.org"}, 403),
        ({"Origin": "null"}, 403),
        ({"Host": "example.org"}, 403),
        ({"Host": "127.0.0.1"}, 403),
        ({}, 200),
    ],
)
@pytest.mark.parametrize("path", ["", "file", "poll"])
def test_other_origins_and_hosts_are_refused(server, headers, status, path):
    assert ask(server, own(server, path), headers=headers)[0] == status


def test_the_own_origin_is_answered_also_by_name(server):
    for host in ("127.0.0.1", "localhost"):
        given = {"Host": f"{host}:{server.server_port}", "Origin": f"http://{host}:{server.server_port}"}
        assert ask(server, own(server, "cancel"), {}, headers=given)[0] == 200


@pytest.mark.parametrize("path", ["/", "/file", "/wrong/file", "//", "/{token}~/file", "/{token}", "/%2e%2e/", "*"])
def test_without_the_token_there_is_nothing(server, path):
    status, content, _ = ask(server, path.replace("{token}", server.token[:-1]))
    assert status == 404
    assert PAIR[:40].encode() not in content


@pytest.mark.parametrize(
    "path",
    ["../pair.toml", "..%2fpair.toml", "results/../../pair.toml", "/etc/passwd", "%2fetc%2fpasswd", "report.html/../x"],
)
def test_no_path_leads_to_a_file(server, path):
    assert ask(server, own(server, path))[0] == 404


def test_only_the_report_of_the_folder_is_served_and_in_an_origin_of_its_own(server, tmp_path):
    assert ask(server, own(server, REPORT_FILE))[0] == 404
    report = tmp_path / "results" / REPORT_FILE
    report.parent.mkdir()
    report.write_text("<script>alert(1)</script>")
    status, page, headers = ask(server, own(server, REPORT_FILE))
    assert (status, page) == (200, report.read_bytes())
    assert headers["Content-Security-Policy"].startswith("sandbox allow-scripts")
    assert "allow-same-origin" not in headers["Content-Security-Policy"]
    report.unlink()
    report.symlink_to(tmp_path / "pair.toml")
    assert ask(server, own(server, REPORT_FILE))[0] == 404


def test_forms_of_other_pages_cannot_post(server):
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
        status = ask(server, own(server, "save"), b'{"text": "x"}', headers={"Content-Type": kind})[0]
        assert status == 415
    assert server.file.text() == PAIR


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b"[" * 100_000, b"\xff"])
def test_content_that_is_no_object_is_refused(server, content):
    assert ask(server, own(server, "state"), content, method="POST", headers=JSON)[0] in (400, 411)


@pytest.mark.parametrize(
    ("length", "status"), [("100000000", 413), ("9" * 30, 413), ("-1", 411), ("x", 411), ("", 411)]
)
def test_a_hundred_megabytes_are_refused_before_they_are_read(server, length, status):
    assert MOST_BYTES < 100_000_000
    head = (
        f"POST {own(server, 'state')} HTTP/1.0\r\nHost: 127.0.0.1:{server.server_port}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=60) as client:
        client.sendall(head.encode())
        assert client.recv(64).split()[1] == str(status).encode()


def test_a_hundred_at_once_are_answered_or_refused_and_the_server_goes_on(server):
    with ThreadPoolExecutor(100) as pool:
        statuses = list(pool.map(lambda _: ask(server, own(server, "file"))[0], range(100)))
    assert set(statuses) <= {200, 503}
    assert statuses.count(200) >= 1
    assert ask(server, own(server, "file"))[0] == 200


def test_garbage_does_not_stop_the_server(server):
    for garbage in (b"\x00" * 100, b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"A" * 70_000 + b"\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", server.server_port), timeout=60) as client:
            client.sendall(garbage)
            client.shutdown(socket.SHUT_WR)
            while client.recv(4096):
                pass
    assert ask(server, own(server, "file"))[0] == 200


def test_results_come_as_lines(server):
    status, content, _ = ask(server, own(server, "state"), {"text": PAIR.replace("teeth = 24", "teeth = 2.5")})
    (step,) = map(json.loads, content.splitlines())
    assert (status, step["ok"]) == (200, False)
    assert "must be a whole number" in step["remarks"][0]["text"]


def test_saving_needs_the_content_that_the_page_knows(server):
    text = PAIR.replace("# One", "# A new")
    status, content, _ = ask(server, own(server, "save"), {"text": text, "digest": digest_of("other")})
    assert status == 409
    assert json.loads(content)["file"]["digest"] == digest_of(PAIR)
    assert server.file.text() == PAIR
    assert ask(server, own(server, "save"), {"text": text, "digest": digest_of(PAIR)})[0] == 200
    assert server.file.case.read_text(encoding="utf-8") == text
    assert [path.name for path in server.file.case.parent.iterdir()] == ["pair.toml"]


def test_of_several_that_save_at_once_one_succeeds_and_the_others_are_told(tmp_path):
    """Two servers with four tabs each: what the first has saved is never replaced unseen."""
    case = tmp_path / "pair.toml"
    case.write_text(PAIR, encoding="utf-8")
    servers = [EditedFile(case, tmp_path / "results") for _ in range(2)]
    begin = threading.Barrier(8)

    def save(number: int) -> bool:
        begin.wait()
        try:
            servers[number % 2].save(f"{PAIR}# {number}\n", digest_of(PAIR))
        except FileConflictError:
            return False
        return True

    with ThreadPoolExecutor(8) as pool:
        saved = list(pool.map(save, range(8)))
    assert saved.count(True) == 1
    assert case.read_text(encoding="utf-8") == f"{PAIR}# {saved.index(True)}\n"


@pytest.mark.validation
@pytest.mark.usefixtures("terminal_signals")
def test_ctrl_c_while_saving_leaves_one_whole_text_and_no_other_file(tmp_path):
    case = tmp_path / "pair.toml"
    case.write_text(PAIR, encoding="utf-8")
    command = [sys.executable, "-P", "-c", "from exugear.cli.app import main; main()", "edit", str(case)]
    with subprocess.Popen([*command, "--no-browser"], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        port, token = re.search(r":(\d+)/([\w-]+)/", process.stdout.readline()).groups()
        texts = [PAIR]
        with suppress(OSError, http.client.HTTPException):
            while True:
                texts.append(f"{PAIR}# {len(texts)}\n")
                connection = http.client.HTTPConnection("127.0.0.1", int(port), timeout=60)
                content = json.dumps({"text": texts[-1], "digest": digest_of(texts[-2])})
                connection.request("POST", f"/{token}/save", content, JSON)
                assert connection.getresponse().status == 200
                connection.close()
                if len(texts) == 20:
                    process.send_signal(signal.SIGINT)
        assert process.wait(60) == 130
    assert len(texts) > 20 or case.read_text(encoding="utf-8") == texts[-1]
    assert case.read_text(encoding="utf-8") in texts[-2:]
    assert [path.name for path in tmp_path.iterdir()] == ["pair.toml"]


@pytest.mark.validation
def test_work_that_fails_shows_the_message_of_the_command(server, capsys):
    (server.file.folder).write_text("no folder")
    server.work.start("tables", digest_of(PAIR))
    while server.work.running:
        time.sleep(0.05)
    told = server.work.told()
    with pytest.raises(SystemExit) as end:
        app(server.work.commands("tables")[0])
    assert (told["state"], end.value.code) == ("failed", 2)
    assert told["message"] == capsys.readouterr().err.strip()
    assert told["message"].startswith("Bad input: ")


def test_work_of_an_unknown_kind_or_of_a_file_with_errors_is_refused(server):
    for kind in ("rm", ["tables"], {}, None):
        assert ask(server, own(server, "start"), {"kind": kind})[0] == 404
    server.file.case.write_text(PAIR.replace("teeth = 24", "teeth = 0"))
    status, content, _ = ask(server, own(server, "start"), {"kind": "tables"})
    assert (status, "correct them" in json.loads(content)["error"]) == (409, True)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ({}, "content has no text"),
        ({"text": None}, "content has no text"),
        ({"text": 5}, "content has no text"),
        ({"text": "a = 1\n# \ud800\n"}, "line 2 has a character that no file can contain; delete it"),
    ],
)
def test_what_is_no_text_of_a_file_does_not_replace_the_file(server, content, reason):
    for path in ("save", "state"):
        status, answer, _ = ask(server, own(server, path), {**content, "digest": digest_of(PAIR)})
        assert (status, json.loads(answer)["error"]) == (400, reason)
    assert server.file.case.read_text() == PAIR


def test_line_ends_of_the_file_are_kept(tmp_path):
    case = tmp_path / "pair.toml"
    case.write_bytes(b"a = 1\r\nb = 2\r\n")
    file = EditedFile(case, tmp_path)
    assert file.text() == "a = 1\nb = 2\n"
    file.save("a = 1\nb = 3\n", digest_of(file.text()))
    assert case.read_bytes() == b"a = 1\r\nb = 3\r\n"
    with pytest.raises(FileConflictError, match="changed by another program"):
        file.save("a = 2", digest_of("a = 1"))


def test_unsaved_text_is_kept_at_the_end(tmp_path):
    case = tmp_path / "pair.toml"
    case.write_text(PAIR)
    file = EditedFile(case, tmp_path / "results")
    assert file.keep_unsaved() is None
    file.latest = PAIR
    assert file.keep_unsaved() is None
    file.latest = "new"
    assert file.keep_unsaved() == tmp_path / "results" / UNSAVED_FILE
    assert (tmp_path / "results" / UNSAVED_FILE).read_text() == "new"
    assert case.read_text() == PAIR


def test_stored_results_are_current_only_for_the_content_that_they_were_completed_for(tmp_path):
    case = tmp_path / "pair.toml"
    case.write_text(PAIR)
    file = EditedFile(case, tmp_path)

    def complete(*steps: str) -> None:
        keep_case(Gearbox.from_dict(read_toml(case), str(case)), tmp_path)
        for step in steps:
            note_time(tmp_path, step, 1.0)

    assert file.told()["results"] == {}
    complete("steady, bushing, discs, line_of_action", "report")
    assert file.told()["results"] == {"tables": "current", "steady": "current"}  # the page itself was deleted
    (tmp_path / REPORT_FILE).write_text("report")
    assert file.told()["results"]["report"] == "current"
    case.write_text(PAIR + "# a comment changes nothing\n")
    assert set(file.told()["results"].values()) == {"current"}
    case.write_text(PAIR.replace("factor = 0.5", "factor = 0.4"))
    assert set(file.told()["results"].values()) == {"old"}
    complete("tables of transmission error")
    assert file.told()["results"] == {"tables": "current", "steady": "old", "report": "old"}
    case.write_text("a = [")
    assert set(file.told()["results"].values()) == {"old"}
    case.write_text(PAIR)
    assert file.told()["results"] == {"tables": "current", "steady": "current", "report": "current"}


@pytest.mark.validation
def test_steady_response_and_report_are_computed_one_after_the_other(server):
    server.work.start("report", digest_of(PAIR))
    assert server.work.running
    assert ask(server, own(server, "start"), {"kind": "steady"})[0] == 409
    while server.work.running:
        assert ask(server, own(server, "poll"))[0] == 200
    told = server.work.told()
    assert (told["state"], told["digest"]) == ("done", digest_of(PAIR)), told["lines"]
    assert server.file.told()["results"] == {"tables": "current", "steady": "current", "report": "current"}
    assert b"helical gear pair" in ask(server, own(server, REPORT_FILE))[1]


def test_the_server_ends_when_no_page_asks_any_more(tmp_path, monkeypatch):
    case = tmp_path / "pair.toml"
    case.write_text(PAIR)
    monkeypatch.setattr("exugear.cli.edit.server.IDLE", 0.0)
    server = EditServer(case, tmp_path / "results")
    server.serve()
    server.server_close()
    assert not (tmp_path / "results").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.toml"], "no such file; write one to start from by: exugear new"),
        (["pair.toml", "--port", "{taken}"], "omit it for any free port"),
        (["pair.toml", "--allow-dir", "none"], "no such folder"),
        (["pair.toml", "--out", "pair.toml"], "is not a folder"),
    ],
)
def test_what_cannot_be_served_is_bad_input(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pair.toml").write_text(PAIR)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        given = [word.replace("{taken}", str(taken.getsockname()[1])) for word in arguments]
        with pytest.raises(SystemExit) as end:
            app(["edit", *given, "--no-browser"])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.replace("\n", " ")


def test_a_command_tells_its_progress_to_the_program_that_started_it(monkeypatch, capsys):
    monkeypatch.setenv(PROGRESS_VARIABLE, "1")
    with progress_bar() as bar:
        task = bar.add_task("table", total=4)
        bar.update(task, completed=3)
        bar.refresh()
    lines = [line for line in capsys.readouterr().err.split("\n") if line.startswith(PROGRESS_SIGN)]
    rows = [json.loads(line[1:]) for line in lines]
    assert ("table", 3, 4) in [(row["words"], row["done"], row["total"]) for row in rows]
