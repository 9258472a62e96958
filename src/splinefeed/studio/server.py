"""The server of the page: who may talk to it, static files, uploads, downloads, and one socket a tab; loopback only."""

from __future__ import annotations

import asyncio
import hmac
import html
import json
import os
import re
import secrets
import signal
import sqlite3
import webbrowser
from contextlib import suppress
from importlib import resources
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from tornado.httpserver import HTTPServer
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler, stream_request_body
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from splinefeed.errors import InputError, SplinefeedError
from splinefeed.numbers import finite, whole
from splinefeed.reports import library
from splinefeed.studio import sources
from splinefeed.studio.house import House
from splinefeed.studio.staff import Staff

#: Names that the loopback interface goes by.
HOSTS = ("127.0.0.1", "localhost")
#: Kinds of the page's files by their endings.
KINDS = {"html": "text/html; charset=utf-8", "css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}
#: Piece of a file that is sent at once, bytes.
PIECE = 2**18
#: s without a request after which a connection is closed, and that the body of an upload may take; most connections
#: that have not said the token, and their share of the files that the system lets a process open.
IDLE, UPLOADING, MOST_STRANGERS, STRANGERS_SHARE = 20.0, 300.0, 64, 0.25
#: What a tab calls itself, drawn at random by the page.
_TAB = re.compile(r"[0-9a-f]{16}")


class Guard:
    """The token of this server, and the checks of a request.

    Parameters
    ----------
    port : int
        Where it listens.

    Attributes
    ----------
    token : str
        Stands in the address that the user opens; the page gets a cookie in its place, which no other site's requests
        carry (SameSite=Strict).
    """

    def __init__(self, port: int) -> None:
        self.token, self._cookie = secrets.token_urlsafe(24), secrets.token_urlsafe(24)
        self.hosts = [f"{host}:{port}" for host in HOSTS]
        self.address = f"http://127.0.0.1:{port}/?token={self.token}"
        self._cookie_name = f"splinefeed-{port}"  # cookies do not know ports

    def check(self, handler: RequestHandler) -> None:
        """Refuse a request that is not from our page; at the entrance the token stands for the cookie.

        Parameters
        ----------
        handler : RequestHandler
            Of the request.

        Raises
        ------
        HTTPError
            That says why.
        """
        request = handler.request
        entrance = request.path == "/"
        if request.host not in self.hosts:
            raise HTTPError(421, reason="this server answers to 127.0.0.1 and localhost only")  # DNS rebinding
        origin = request.headers.get("Origin")
        cross = request.headers.get("Sec-Fetch-Site") == "cross-site" and not entrance
        changes = request.method != "GET" or request.headers.get("Upgrade")
        if cross or (origin is None and changes) or origin not in (None, f"http://{request.host}"):
            raise HTTPError(403, reason="the request is not from the page")
        if _same(handler.get_cookie(self._cookie_name) or "", self._cookie):
            return
        if entrance and _same(handler.get_query_argument("token", ""), self.token):
            handler.set_cookie(self._cookie_name, self._cookie, path="/", httponly=True, samesite="Strict")
            return
        raise HTTPError(403, reason="the token is missing or wrong: open the address that splinefeed studio printed")

    def headers(self) -> dict[str, str]:
        """What every answer carries: no script, style, picture or connection but ours, no frame, nothing kept.

        Inline styles are allowed, which Plotly sets on its axes and brings for its maps; the page writes no HTML.
        """
        sockets = " ".join(f"ws://{host}" for host in self.hosts)
        policy = (
            "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
            f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        return {
            "Content-Security-Policy": policy,
            "X-Content-Type-Options": "nosniff",
            "X-Frame-Options": "DENY",
            "Referrer-Policy": "no-referrer",
            "Cross-Origin-Opener-Policy": "same-origin",
            "Cross-Origin-Resource-Policy": "same-origin",
            "Cache-Control": "no-store",
            "Server": "splinefeed",
        }


def _same(given: str, expected: str) -> bool:
    return hmac.compare_digest(given.encode(errors="replace"), expected.encode())


class _Guarded(RequestHandler):
    """What all our handlers share: the guard before anything else, and headers that keep the browser to our files."""

    @property
    def house(self) -> House:
        house: House = self.application.settings["house"]
        return house

    def set_default_headers(self) -> None:
        for name, value in self.application.settings["guard"].headers().items():
            self.set_header(name, value)

    def prepare(self) -> None:
        self.application.settings["guard"].check(self)
        stream = getattr(self.request.connection, "stream", None)
        self.application.settings["strangers"].pop(stream, None)

    def write_error(self, status_code: int, **more: Any) -> None:
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code}: {self._reason}\n")


class _PagePart(_Guarded):
    """The page itself and its files, from memory, and nothing else of any file system."""

    def get(self, name: str | None) -> None:
        parts: dict[str, bytes] = self.application.settings["parts"]
        wanted = name or "index.html"
        if wanted not in parts:
            raise HTTPError(404, reason="there is no such file")
        self.set_header("Content-Type", KINDS[wanted.rpartition(".")[2]])
        if name:
            self.set_header("Cache-Control", "private, max-age=3600" if name.startswith("plotly") else "no-cache")
        self.finish(parts[wanted])


@stream_request_body
class _Dropped(_Guarded):
    """An upload; its body is taken only from who passes the guard, and no more of it than the server allows."""

    def prepare(self) -> None:
        super().prepare()
        self.chunks: list[bytes] = []

    def data_received(self, chunk: bytes) -> None:
        self.chunks.append(chunk)

    def post(self) -> None:
        try:
            name = unquote(self.request.headers.get("X-Name", ""))[:400]
            self.finish({"file": sources.put(self.house.uploads, name, b"".join(self.chunks))})
        except InputError as error:
            self.set_status(413)
            self.finish({"error": str(error)})


class _Download(_Guarded):
    """A file that a job has made, piece by piece."""

    async def get(self, name: str) -> None:
        try:
            file = sources.upload(name, self.house.made)
        except InputError:
            raise HTTPError(404, reason="the file is not kept any more; make it again") from None
        self.set_header("Content-Type", "application/octet-stream")
        self.set_header("Content-Disposition", f"attachment; filename*=UTF-8''{quote(file.name)}")
        with file.open("rb") as stream:
            while piece := stream.read(PIECE):
                self.write(piece)
                await self.flush()


class _Socket(_Guarded, WebSocketHandler):
    """The socket of a tab: a page says who it is, then what it asks of the house."""

    name = ""

    def check_origin(self, origin: str) -> bool:
        return True  # the guard has looked at it

    def on_close(self) -> None:
        # its jobs go on, and it may come back
        if self.house.tabs.get(self.name) == self.send:
            del self.house.tabs[self.name]
            if self.house.playing == self.name:
                self.house.player.order({"stop": True})

    def send(self, kind: str, body: bytes | None = None, **said: Any) -> None:
        """Tell the page something of a kind; the body, JSON already, is put in as it is."""
        head = json.dumps({"kind": kind, **said}, allow_nan=False)
        with suppress(WebSocketClosedError):
            self.write_message(head if body is None else f'{head[:-1]},"answer":{body.decode()}}}')

    def on_message(self, message: str | bytes) -> None:
        n = None
        try:
            said = json.loads(message, parse_float=_number, parse_int=_number, parse_constant=_number)
            n = said.get("n")
            if self.name:
                self.house.request(self.name, said)
            elif said["do"] == "hello" and _TAB.fullmatch(said["tab"]):
                self.name = said["tab"]
                self.house.welcome(self.name, self.send)
            else:
                raise TypeError
        except SplinefeedError as error:
            self.send("refused", n=n, error={"fields": {"": str(error)}, "fault": False})
        except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError, sqlite3.Error):
            self.send("refused", n=None, error={"fields": {"": "the page sent an invalid request"}, "fault": True})


def _number(text: str) -> float:
    """A number of a message: finite, and a whole one of at most 64 bits."""
    return whole(text) if text.lstrip("-").isdigit() else finite(text)


class _Server(HTTPServer):
    """One that closes connections which do not say the token: the oldest of too many, and each after a time."""

    strangers: dict[Any, None]  # in the order in which they came
    most_strangers = MOST_STRANGERS

    def handle_stream(self, stream: Any, address: Any) -> None:
        """Take a connection."""
        for old in [each for each in self.strangers if each.closed()]:
            del self.strangers[old]
        self.strangers[stream] = None
        if len(self.strangers) > self.most_strangers:
            old = next(iter(self.strangers))
            del self.strangers[old]
            old.close()
        super().handle_stream(stream, address)


def most_strangers() -> int:
    """Most connections without the token: files are left for pages and workers, however few this process may open."""
    with suppress(ImportError):
        import resource

        files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
        if files != resource.RLIM_INFINITY:
            return max(1, min(MOST_STRANGERS, int(STRANGERS_SHARE * files)))
    return MOST_STRANGERS


def redirect(folder: Path, address: str) -> str:
    """The address of a file that leads a browser to `address`: others see command lines, and that has the token.

    Only its user may read it, as the folder of the studio.
    """
    file = folder / "open.html"
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as stream:
        stream.write(f'<!DOCTYPE html><meta http-equiv="refresh" content="0; url={html.escape(address)}">\n')
    return file.as_uri()


def parts() -> dict[str, bytes]:
    """The files of the page by name, Plotly's among them."""
    folder = resources.files("splinefeed.studio").joinpath("page")
    found = {each.name: each.read_bytes() for each in folder.iterdir() if each.name.rpartition(".")[2] in KINDS}
    report = resources.files("splinefeed.reports").joinpath("page")
    found["report.css"] = report.joinpath("page.css").read_bytes()  # one theme for both
    found |= {name: report.joinpath(name).read_bytes() for name in library.MODULES[:-1]}  # and figures
    found["plotly.min.js"] = library.script().encode()
    return found


async def serve(port: int, history: Path | None, staff: Staff, *, browser: bool, say: Any) -> None:
    """Serve until the process is terminated.

    Parameters
    ----------
    port : int
        Of loopback; 0 for a free one.
    history : Path or None
        Where plans are kept; None for nowhere.
    staff : Staff
        Who works.
    browser : bool
        Whether a browser is opened.
    say : callable
        Called with the address.
    """
    sockets = bind_sockets(port, "127.0.0.1")
    guard = Guard(sockets[0].getsockname()[1])
    house = House(history, staff)
    strangers: dict[Any, None] = {}
    application = Application(
        [
            (r"/(?:page/([a-z0-9.-]+))?", _PagePart),
            (r"/upload", _Dropped),
            (r"/download/([0-9a-f]{32})", _Download),
            (r"/socket", _Socket),
        ],
        guard=guard,
        house=house,
        strangers=strangers,
        parts=parts(),
        websocket_max_message_size=8 * 2**20,
        websocket_ping_interval=20,
        compress_response=False,
        log_function=lambda handler: None,  # requests are not written anywhere: addresses may carry the token
    )
    server = _Server(
        application, max_body_size=sources.LARGEST + 1, max_header_size=2**16, idle_connection_timeout=IDLE,
        body_timeout=UPLOADING,
    )  # fmt: skip
    server.strangers, server.most_strangers = strangers, most_strangers()
    server.add_sockets(sockets)
    ended = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with suppress(NotImplementedError):  # Windows: Ctrl-C ends the loop itself
            loop.add_signal_handler(number, ended.set)
    try:
        house.open()
        say(guard.address)
        if browser:
            await loop.run_in_executor(None, webbrowser.open, redirect(staff.folder, guard.address))
        await ended.wait()
    finally:
        server.stop()
        await house.close()
