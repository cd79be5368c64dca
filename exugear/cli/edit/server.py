"""Local server of the command `edit`.

Any program and any page in a browser of this machine can send requests to it. It therefore answers only requests that
know the random token in its address, that name it as the host and that come from no other page, limits their size and
number, and serves nothing but its own page, the gearbox file and the report pages of the results folder.
"""

from __future__ import annotations

import hmac
import json
import secrets
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from exugear.cli.edit.page import edit_page
from exugear.cli.edit.state import Analyst
from exugear.cli.edit.stored import EditedFile, FileConflictError, digest_of
from exugear.cli.edit.work import KINDS, BusyError, LongWork
from exugear.gearbox.named_files import LARGEST_CASE, Permissions
from exugear.gearbox.reading import GearboxFileError
from exugear.results.folder import REPORT_FILE

HOST = "127.0.0.1"
MOST_BYTES = 2 * LARGEST_CASE
"""Maximum size of the body of a request: a gearbox file as JSON."""
MOST_REQUESTS = 32
"""Maximum number of requests that are answered at the same time; further ones are refused."""
LONGEST_WAIT = 20.0
"""Time (s) in which a request must arrive."""
IDLE = 180.0
"""Time (s) without a request after which no page is open: hidden pages ask once per minute."""
PAGES = (REPORT_FILE,)
"""Pages of the results folder that are served."""
COMMON_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}


class RefusedError(Exception):
    """A request that is not answered, with the status and the reason."""

    def __init__(self, status: HTTPStatus, reason: str) -> None:
        self.status = status
        super().__init__(reason)


class EditServer(ThreadingHTTPServer):
    """Server of one gearbox file, on this machine only; port 0 is any free one."""

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, case: Path, folder: Path, allow_dir: Path | None = None, port: int = 0) -> None:
        self.file = EditedFile(case, folder)
        self.work = LongWork(case, folder, allow_dir)
        self.analyst = Analyst(case, Permissions(below=allow_dir))
        self.token = secrets.token_urlsafe(24)
        self.last_request = time.monotonic()
        self._slots = threading.BoundedSemaphore(MOST_REQUESTS)
        super().__init__((HOST, port), Handler)
        self.timeout = 0.5

    @property
    def origin(self) -> str:
        """Scheme, host and port."""
        return f"http://{HOST}:{self.server_port}"

    @property
    def address(self) -> str:
        """Address of the page, with the token."""
        return f"{self.origin}/{self.token}/"

    def serve(self) -> None:
        """Answer requests until no page has been open for `IDLE` and no long computation is running."""
        while self.work.running or time.monotonic() - self.last_request < IDLE:
            self.handle_request()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a request in a thread; refuse it if too many are being answered."""
        if self._slots.acquire(blocking=False):
            super().process_request(request, client_address)
            return
        with suppress(OSError):
            request.sendall(b"HTTP/1.0 503 Service Unavailable\r\nRetry-After: 1\r\nContent-Length: 0\r\n\r\n")
        self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a request and free its slot."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._slots.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore connections that end early; other errors are printed."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)


class Handler(BaseHTTPRequestHandler):
    """Answer to one request."""

    server: EditServer
    timeout = LONGEST_WAIT
    server_version = "exugear"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer a request that changes nothing."""
        self._answered(self._get)

    def do_POST(self) -> None:
        """Answer a request with content."""
        self._answered(self._post)

    def _answered(self, answer: Callable[[str], None]) -> None:
        try:
            answer(self._permitted_path())
        except RefusedError as error:
            self._send_json({"error": str(error)}, error.status)
        except FileConflictError as error:
            self._send_json({"error": str(error), "file": self.server.file.told()}, HTTPStatus.CONFLICT)
        except BusyError as error:
            self._send_json({"error": str(error)}, HTTPStatus.CONFLICT)
        except (GearboxFileError, OSError) as error:
            if isinstance(error, (ConnectionError, TimeoutError)):
                raise
            self._send_json({"error": str(error)}, HTTPStatus.INTERNAL_SERVER_ERROR)

    def _permitted_path(self) -> str:
        """Return the path after the token.

        Raises
        ------
        RefusedError
            The request names another host, comes from another page, or does not know the token.
        """
        hosts = (f"{HOST}:{self.server.server_port}", f"localhost:{self.server.server_port}")
        if self.headers.get("Host") not in hosts:
            raise RefusedError(HTTPStatus.FORBIDDEN, "another host is named")
        origin = self.headers.get("Origin")
        if origin is not None and origin not in [f"http://{host}" for host in hosts]:
            raise RefusedError(HTTPStatus.FORBIDDEN, "requests of other pages are refused")
        _, token, *rest = [*self.path.partition("?")[0].split("/", 2), ""]
        if not hmac.compare_digest(token.encode(), self.server.token.encode()):
            raise RefusedError(HTTPStatus.NOT_FOUND, "no such page; open the address that exugear edit has printed")
        self.server.last_request = time.monotonic()
        return rest[0]

    def _get(self, path: str) -> None:
        server = self.server
        if path == "":
            nonce = secrets.token_urlsafe(16)
            self._send(edit_page(server.file.case, nonce), "text/html; charset=utf-8")
        elif path == "file":
            self._send_json({"text": server.file.text(), **server.file.told()})
        elif path == "poll":
            self._send_json({"file": server.file.told(), "work": server.work.told()})
        elif path in PAGES and (page := server.file.page(path)) is not None:
            # In an origin of its own: scripts of a page that somebody else wrote cannot use this server.
            sandbox = {"Content-Security-Policy": "sandbox allow-scripts allow-downloads allow-popups allow-modals"}
            self._send(page, "text/html; charset=utf-8", headers=sandbox)
        else:
            raise RefusedError(HTTPStatus.NOT_FOUND, "no such page")

    def _post(self, path: str) -> None:
        server = self.server
        content = self._content()
        if path == "state":
            text = _text(content)
            tab, geometry = (str(content.get(key, "")) for key in ("tab", "geometry"))
            server.file.latest = text
            _check_characters(text)
            # The rest is not computed for a page that has gone.
            steps = server.analyst.steps(text, tab, geometry)
            with closing(steps):
                self._begin("application/x-ndjson", HTTPStatus.OK, {})
                for step in steps:
                    self.wfile.write(json.dumps(step).encode() + b"\n")
                    self.wfile.flush()
        elif path == "save":
            text = _text(content)
            _check_characters(text)
            try:
                server.file.save(text, str(content.get("digest", "")))
            except OSError as error:
                reason = f"{error.filename or server.file.case}: {error.strerror or error}"
                raise RefusedError(
                    HTTPStatus.INTERNAL_SERVER_ERROR,
                    f"The file was not saved and has its earlier content ({reason}). The text is still in this page.",
                ) from error
            self._send_json(server.file.told())
        elif path == "start" and str(content.get("kind")) in KINDS:
            text = server.file.text()
            if server.analyst.check(text).gearbox is None:
                raise RefusedError(HTTPStatus.CONFLICT, "the saved file has errors; correct them and save it first")
            server.work.start(str(content["kind"]), digest_of(text))
            self._send_json({"work": server.work.told()})
        elif path == "cancel":
            server.work.cancel()
            self._send_json({"work": server.work.told()})
        else:
            raise RefusedError(HTTPStatus.NOT_FOUND, "no such page")

    def _content(self) -> dict[str, Any]:
        if self.headers.get_content_type() != "application/json":  # a form of another page cannot send it
            raise RefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "content must be JSON")
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()):
            raise RefusedError(HTTPStatus.LENGTH_REQUIRED, "Content-Length is missing")
        if len(length) > 12 or int(length) > MOST_BYTES:
            raise RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"more than {MOST_BYTES} bytes")
        try:
            content = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            raise RefusedError(HTTPStatus.BAD_REQUEST, "content must be JSON") from None
        if not isinstance(content, dict):
            raise RefusedError(HTTPStatus.BAD_REQUEST, "content must be a JSON object")
        return content

    def _send(
        self, content: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK, headers: Mapping[str, str] | None = None
    ) -> None:
        self._begin(kind, status, {"Content-Length": str(len(content)), **(headers or {})})
        self.wfile.write(content)

    def _begin(self, kind: str, status: HTTPStatus, headers: Mapping[str, str]) -> None:
        self.send_response(status)
        for name, value in {"Content-Type": kind, **COMMON_HEADERS, **headers}.items():
            self.send_header(name, value)
        self.end_headers()

    def _send_json(self, content: Mapping[str, Any], status: HTTPStatus = HTTPStatus.OK) -> None:
        self._send(json.dumps(content).encode(), "application/json", status)

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing."""


def _text(content: Mapping[str, Any]) -> str:
    """Return the text of a gearbox file in the content of a request.

    Raises
    ------
    RefusedError
        There is no text.
    """
    text = content.get("text")
    if not isinstance(text, str):
        raise RefusedError(HTTPStatus.BAD_REQUEST, "content has no text")
    return text


def _check_characters(text: str) -> None:
    """Refuse a text that UTF-8 cannot represent, since no command could read its file.

    Raises
    ------
    RefusedError
        Half of a pair of surrogates, which a browser can send.
    """
    try:
        text.encode()
    except UnicodeEncodeError as error:
        line = text.count("\n", 0, error.start) + 1
        raise RefusedError(
            HTTPStatus.BAD_REQUEST, f"line {line} has a character that no file can contain; delete it"
        ) from None
