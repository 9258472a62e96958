"""The operator's orders, from any thread: keys, signals, pins of the controller, and JSON lines on a local socket."""

from __future__ import annotations

import hmac
import json
import secrets
import socket
import socketserver
import threading
import time
from collections.abc import Mapping
from typing import Any

from splinefeed.errors import InputError

#: Highest rate.
MOST = 2.0
#: Longest line that is read, bytes; most clients at once; s without a whole line after which one is disconnected.
LONGEST_LINE, MOST_CLIENTS, IDLE = 1024, 4, 60.0
#: s that a client has for its first line, with the token.
AUTHENTICATION = 2.0
#: s between two lines of a client, and between two clients: so few are there that have not said the token.
PAUSE = 0.01


class Operator:
    """Feedrate override, feed hold, retrace and stop; a hold goes before a retrace, a stop before both.

    Parameters
    ----------
    rate : float, optional
        The feedrate override, 1 as planned.

    Attributes
    ----------
    held, back, stopping : bool
        Whether these are on.
    """

    def __init__(self, rate: float = 1.0) -> None:
        self.rate, self.held, self.back, self.stopping = rate, False, False, False

    def obey(self, orders: Mapping[str, Any]) -> None:
        """Do what is ordered, all of it or nothing.

        Parameters
        ----------
        orders : mapping of str to object
            By name: `override`, %; `hold`, `reverse`, `stop`, true or false. `status` is an order that changes nothing.

        Raises
        ------
        InputError
            For what is no order.
        """
        for name, value in orders.items():
            if name == "override":
                if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 100.0 * MOST:
                    raise InputError(f"override: {str(value)[:20]} must be a number from 0 to {100.0 * MOST:g} %")
            elif name not in ("hold", "reverse", "stop", "status"):
                raise InputError(f"{name!r} is no order; choose from override (%), hold, reverse, stop, status")
            elif not isinstance(value, bool):
                raise InputError(f"{name} must be true or false")
        if "override" in orders:
            self.rate = orders["override"] / 100.0
        self.held = orders.get("hold", self.held)
        self.back = orders.get("reverse", self.back)
        self.stopping = self.stopping or orders.get("stop", False)

    @property
    def wanted(self) -> float:
        """The rate to run at, negative backwards."""
        if self.held or self.stopping:
            return 0.0
        return -self.rate if self.back else self.rate


class OperatorServer(socketserver.ThreadingTCPServer):
    """Orders over a free port of loopback until the context ends: {"token": "...", "override": 80}, one JSON a line.

    Every line is answered by one, and their rate is limited, so that a flood of them does not delay the stream.

    Parameters
    ----------
    operator : Operator
        That obeys.

    Attributes
    ----------
    port : int
        Where it listens.
    token : str
        What every line must carry.
    status : dict of str to object
        What else answers carry.
    """

    daemon_threads, block_on_close, request_queue_size = True, False, 32

    def __init__(self, operator: Operator) -> None:
        super().__init__(("127.0.0.1", 0), _Client)
        self.port = int(self.server_address[1])
        self.token = secrets.token_hex(8)
        self.status: dict[str, Any] = {}
        self.room = threading.BoundedSemaphore(MOST_CLIENTS)
        self._operator = operator
        threading.Thread(target=self.serve_forever, args=(0.1,), daemon=True).start()

    def __exit__(self, *error: Any) -> None:
        self.shutdown()
        super().__exit__(*error)

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Let everyone in, one after the other."""
        time.sleep(PAUSE)
        return True

    def answer(self, line: bytes) -> dict[str, Any] | None:
        """The answer to a line; None for one without the token."""
        try:
            said = json.loads(line)
            token = said.pop("token").encode(errors="replace")
        except (ValueError, RecursionError, AttributeError, LookupError, TypeError):
            return None
        if not hmac.compare_digest(token, self.token.encode()):
            return None
        operator = self._operator
        try:
            operator.obey(said)
        except InputError as error:
            return {"ok": False, "error": str(error)}
        states = {"override": 100.0 * operator.rate, "hold": operator.held, "reverse": operator.back}
        return {"ok": True, "error": None, **states, **self.status}


class _Client(socketserver.StreamRequestHandler):
    server: OperatorServer
    request: socket.socket

    def handle(self) -> None:
        """Answer lines; one that is too long, late or without the token is the last."""
        server, known = self.server, False
        self._rest = b""
        try:
            while line := self._line(IDLE if known else AUTHENTICATION):
                answer = server.answer(line) if len(line) <= LONGEST_LINE else None
                if answer is None:
                    self._say({"ok": False, "error": "the token is missing or wrong"})
                    break
                self._say(answer)
                if not known and not server.room.acquire(blocking=False):
                    break  # one of more than MOST_CLIENTS that know the token is obeyed once
                known = True
                time.sleep(PAUSE)
        except OSError:
            return
        finally:
            if known:
                server.room.release()

    def _line(self, seconds: float) -> bytes:
        """The next line, which has to be whole in its time; what is longer than a line may be, and b"" at the end."""
        end = time.monotonic() + seconds
        while b"\n" not in self._rest and len(self._rest) <= LONGEST_LINE:
            self.request.settimeout(max(end - time.monotonic(), 1e-3))
            more = self.request.recv(LONGEST_LINE + 1)
            if not more:
                return b""
            self._rest += more
        line, mark, self._rest = self._rest.partition(b"\n")
        return line + mark

    def _say(self, said: Mapping[str, Any]) -> None:
        self.request.settimeout(AUTHENTICATION)
        self.request.sendall(json.dumps(said).encode() + b"\n")
