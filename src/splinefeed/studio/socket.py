"""One socket a tab: requests of a page, and the answers."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from tornado.websocket import WebSocketClosedError, WebSocketHandler

from splinefeed.errors import SplinefeedError
from splinefeed.studio import share
from splinefeed.studio.guard import Guarded
from splinefeed.studio.house import message

#: What a tab calls itself, drawn at random by the page.
_NAME = re.compile(r"[0-9a-f]{16}")


class Socket(Guarded, WebSocketHandler):
    """The socket of a tab."""

    name = ""

    def check_origin(self, origin: str) -> bool:
        """The guard has looked at it."""
        return True

    def open(self, *args: str, **kwargs: str) -> None:
        """A page is there; it says its name first."""
        self.name = ""

    def on_close(self) -> None:
        """The page is gone; its jobs go on, and it may come back."""
        if self.house.tabs.get(self.name) is self:
            del self.house.tabs[self.name]
            if self.house.playing == self.name:
                self.house.player.order({"stop": True})

    def send(self, kind: str, body: bytes | None = None, **said: Any) -> None:
        """Tell the page something."""
        with suppress(WebSocketClosedError):
            self.write_message(message(kind, said, body).decode())

    def on_message(self, message: str | bytes) -> None:
        """Do what the page asks; what is wrong with it is said to it."""
        try:
            said = json.loads(message)
            if not isinstance(said, dict):
                raise TypeError
            request = _REQUESTS.get(str(said.get("do")))
            if request is None or (not self.name and said["do"] != "hello"):
                raise TypeError
            request(self, said)
        except SplinefeedError as error:
            self.send("refused", n=said.get("n"), error={"fields": {"": str(error)}, "fault": False})
        except (ValueError, TypeError, KeyError, RecursionError):
            self.send("refused", n=None, error={"fields": {"": "the page sent an invalid request"}, "fault": True})

    def _hello(self, said: dict[str, Any]) -> None:
        name = str(said["tab"])
        if not _NAME.fullmatch(name):
            raise TypeError
        self.name = name
        self.house.welcome(self)

    def _plan(self, said: dict[str, Any]) -> None:
        self.house.jobs.replace(self.name)
        plan = {"n": int(said["n"]), "settings": dict(said["settings"]), "rest": bool(said.get("rest"))}
        self.house.plan(self.name, {**plan, "look": said.get("look")})

    def _job(self, said: dict[str, Any]) -> None:
        kind = str(said["kind"])
        words, fields = _JOBS[kind]
        request = {"task": kind, **{name: said[name] for name in fields if name in said}}
        self.house.jobs.add(kind, f"{words} {str(said.get('title', ''))[:60]}".strip(), self.name, request)

    def _cancel(self, said: dict[str, Any]) -> None:
        self.house.jobs.cancel(int(said["job"]))

    def _play(self, said: dict[str, Any]) -> None:
        request = {"settings": dict(said["settings"]), "top": float(said["top"]), "override": float(said["override"])}
        self.house.play(self.name, request)

    def _order(self, said: dict[str, Any]) -> None:
        if self.house.playing == self.name:
            self.house.player.order(
                {name: said[name] for name in ("override", "hold", "reverse", "stop") if name in said}
            )

    def _history(self, said: dict[str, Any]) -> None:
        history = self.house.history
        if "delete" in said and history is not None:
            history.delete(int(said["delete"]))
            self.house.tell("history")
        elif "open" in said:
            self.send("opened", settings=self.house.reopen(int(said["open"])), pin=bool(said.get("pin")))
        else:
            self.send("entries", entries=[] if history is None else history.entries(), kept=history is not None)

    def _share(self, said: dict[str, Any]) -> None:
        if "text" in said:
            self.send("opened", settings=share.from_toml(str(said["text"])), pin=False)
        else:
            self.send("toml", text=share.to_toml(dict(said["settings"])))


#: What each kind of job is called, and what it takes from the page.
_JOBS = {
    "settle": ("plan", ["settings"]),
    "read": ("read file", ["source"]),
    "make": ("make file", ["settings", "what", "form"]),
    "tune": ("tune", ["settings", "how"]),
}
#: What a page may ask.
_REQUESTS: dict[str, Callable[[Socket, dict[str, Any]], None]] = {
    "hello": Socket._hello,
    "plan": Socket._plan,
    "job": Socket._job,
    "cancel": Socket._cancel,
    "play": Socket._play,
    "order": Socket._order,
    "history": Socket._history,
    "share": Socket._share,
}
