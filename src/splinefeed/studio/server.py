"""The server of the page: static files, uploads, downloads, and one socket a tab; loopback only."""

from __future__ import annotations

import asyncio
import signal
import webbrowser
from contextlib import suppress
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler, stream_request_body

from splinefeed.errors import InputError
from splinefeed.report import library
from splinefeed.studio.guard import Guard, Guarded
from splinefeed.studio.house import House
from splinefeed.studio.socket import Socket
from splinefeed.studio.uploads import LARGEST, Upload

#: Kinds of the page's files by their endings.
KINDS = {"html": "text/html; charset=utf-8", "css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}
#: Piece of a file that is sent at once, bytes.
PIECE = 2**18


class Answering(Guarded):
    """A handler that says errors in words."""

    def write_error(self, status_code: int, **more: Any) -> None:
        """One line of text, no traceback."""
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code}: {self._reason}\n")


class Page(Answering):
    """The page itself; the token in its address is exchanged for a cookie."""

    entrance = True

    def get(self) -> None:
        """The page."""
        self.set_header("Content-Type", KINDS["html"])
        self.finish(self.application.settings["parts"]["index.html"])


class Part(Answering):
    """One of the page's files, and nothing else of any file system."""

    def get(self, name: str) -> None:
        """The file, from memory."""
        parts: dict[str, bytes] = self.application.settings["parts"]
        if name not in parts:
            raise HTTPError(404, reason="there is no such file")
        self.set_header("Content-Type", KINDS[name.rpartition(".")[2]])
        self.set_header("Cache-Control", "private, max-age=3600" if name.startswith("plotly") else "no-cache")
        self.finish(parts[name])


@stream_request_body
class Dropped(Answering):
    """An upload, streamed to a file."""

    upload: Upload | None = None

    def prepare(self) -> None:
        """Check who sends, and how much."""
        super().prepare()
        try:
            length = self.request.headers.get("Content-Length")
            name = unquote(self.request.headers.get("X-Name", ""))[:400]
            self.upload = self.house.uploads.begin(name, int(length) if length and length.isdigit() else None)
        except InputError as error:
            self._refuse(413, error)

    def data_received(self, chunk: bytes) -> None:
        """Take a piece."""
        if self.upload is not None:
            self.upload.write(chunk)

    def post(self) -> None:
        """The whole file is there."""
        assert self.upload is not None
        try:
            self.finish({"file": self.upload.end()})
        except InputError as error:
            self._refuse(400, error)

    def on_connection_close(self) -> None:
        """Half a file is of no use."""
        if self.upload is not None:
            self.upload.drop()

    def _refuse(self, status: int, error: InputError) -> None:
        self.set_status(status)
        self.finish({"error": str(error)})


class Download(Answering):
    """A file that a job has made."""

    async def get(self, name: str) -> None:
        """The file, piece by piece."""
        file = self.house.download(name)
        if file is None:
            raise HTTPError(404, reason="the file is not kept any more; make it again")
        self.set_header("Content-Type", "application/octet-stream")
        self.set_header("Content-Disposition", f"attachment; filename*=UTF-8''{quote(file.name)}")
        self.set_header("Content-Length", str(file.stat().st_size))
        with file.open("rb") as stream:
            while piece := stream.read(PIECE):
                self.write(piece)
                await self.flush()


def parts() -> dict[str, bytes]:
    """The files of the page by name, Plotly's among them."""
    folder = resources.files("splinefeed.studio").joinpath("page")
    found = {each.name: each.read_bytes() for each in folder.iterdir() if each.name.rpartition(".")[2] in KINDS}
    report = resources.files("splinefeed.report").joinpath("page")
    found["report.css"] = report.joinpath("page.css").read_bytes()  # one theme for both
    found["dress.js"] = report.joinpath("dress.js").read_bytes() + b"export { colours, dressed, shade };\n"
    found["plotly.min.js"] = library.script().encode()
    return found


def application(guard: Guard, house: House) -> Application:
    """The handlers of a studio."""
    own = {"guard": guard, "house": house}
    return Application(
        [
            (r"/", Page, own),
            (r"/page/([a-z0-9.-]+)", Part, own),
            (r"/upload", Dropped, own),
            (r"/download/([0-9a-f]{32})", Download, own),
            (r"/socket", Socket, own),
        ],
        port=guard.port,
        parts=parts(),
        websocket_max_message_size=8 * 2**20,
        websocket_ping_interval=20,
        compress_response=False,
        log_function=_no_log,
    )


def _no_log(handler: RequestHandler) -> None:
    """Requests are not written anywhere: addresses may carry the token."""


async def serve(port: int, history: Path | None, *, browser: bool, say: Any) -> None:
    """Serve until the process is terminated; `say` is called with the address."""
    sockets = bind_sockets(port, "127.0.0.1")
    own = Guard(sockets[0].getsockname()[1])
    house = House(history)
    server = HTTPServer(application(own, house), max_body_size=LARGEST + 1, max_header_size=2**16)
    server.add_sockets(sockets)
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with suppress(NotImplementedError):  # Windows: Ctrl-C ends the loop itself
            loop.add_signal_handler(number, ended.set)
    try:
        house.open()
        say(own.address)
        if browser:
            await loop.run_in_executor(None, webbrowser.open, own.address)
        await ended.wait()
    finally:
        server.stop()
        await house.close()
