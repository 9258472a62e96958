"""Commands over a local socket: JSON lines on loopback, each with the token.

{"token": "...", "override": 80}, "hold": true or false, "reverse": true or false, "stop": true, "status": true; every
line is answered by one, and their rate is limited, so that a flood of them does not delay the stream.
"""

from __future__ import annotations

import hmac
import json
import secrets
import socket
import threading
import time
from contextlib import suppress
from types import TracebackType
from typing import Any

from splinefeed.errors import InputError
from splinefeed.live.operator import Operator

#: Longest line that is read, bytes; most clients at once; s without a line after which one is disconnected.
LONGEST_LINE, MOST_CLIENTS, IDLE = 1024, 4, 60.0
#: Reasons to disconnect a client, so that there is room for others.
STRANGER, TOO_LONG = "the token is missing or wrong", "the line is too long"
SENT_AWAY = (STRANGER, TOO_LONG)
#: s between two lines of a client, and between two clients.
PAUSE = 0.01


class Control:
    """Listens on a free port of loopback, in its own thread, until the context ends.

    port   where; token  what every line must carry; status  the answer to a status request
    """

    def __init__(self, operator: Operator, port: int = 0) -> None:
        self._operator = operator
        self.token = secrets.token_hex(8)
        self.status: dict[str, Any] = {}
        self._socket = socket.create_server(("127.0.0.1", port), backlog=MOST_CLIENTS)
        self.port = int(self._socket.getsockname()[1])
        self._room = threading.BoundedSemaphore(MOST_CLIENTS)
        self._open = True
        threading.Thread(target=self._listen, daemon=True).start()

    def __enter__(self) -> Control:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open = False
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _listen(self) -> None:
        while self._open:
            try:
                client, _ = self._socket.accept()
            except OSError:
                return
            if not self._room.acquire(blocking=False):
                with suppress(OSError):
                    client.sendall(b'{"ok": false, "error": "too many clients"}\n')
                client.close()
                time.sleep(PAUSE)
                continue
            threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        try:
            client.settimeout(IDLE)
            with client, client.makefile("rb") as lines:
                while line := lines.readline(LONGEST_LINE + 1):
                    answer = self._answer(line) if len(line) <= LONGEST_LINE else _refused(TOO_LONG)
                    client.sendall(json.dumps(answer).encode() + b"\n")
                    time.sleep(PAUSE)
                    if answer["error"] in SENT_AWAY:
                        return
        except OSError:
            return
        finally:
            self._room.release()

    def _answer(self, line: bytes) -> dict[str, Any]:
        try:
            said = json.loads(line)
        except (ValueError, RecursionError):
            return _refused("a line must be one JSON object")
        if not isinstance(said, dict) or not isinstance(said.get("token"), str):
            return _refused(STRANGER)
        if not hmac.compare_digest(said.pop("token").encode(errors="replace"), self.token.encode()):
            return _refused(STRANGER)
        unknown = set(said) - {"override", "hold", "reverse", "stop", "status"}
        if unknown:
            return _refused(f"{min(unknown)!r} is not a command; choose from override (%), hold, reverse, stop, status")
        override = said.get("override")
        if override is not None and (isinstance(override, bool) or not isinstance(override, int | float)):
            return _refused("override must be a number, in percent")
        for name in ("hold", "reverse", "stop", "status"):
            if not isinstance(said.get(name, False), bool):
                return _refused(f"{name} must be true or false")
        try:
            if override is not None:
                self._operator.set_rate(override / 100.0)
        except (InputError, OverflowError) as error:
            return _refused(str(error))
        if "hold" in said:
            self._operator.hold(said["hold"])
        if "reverse" in said:
            self._operator.reverse(said["reverse"])
        if said.get("stop"):
            self._operator.stop()
        operator = self._operator
        return {
            "ok": True,
            "error": None,
            "override": 100.0 * operator.rate,
            "hold": operator.held,
            "reverse": operator.back,
            **self.status,
        }


def _refused(why: str) -> dict[str, Any]:
    return {"ok": False, "error": why}
