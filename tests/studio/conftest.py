"""A studio that runs as users start it, one for all tests of this folder."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from studio_tools import PATIENCE

#: Kernels are loaded, and on a machine that has never run them compiled, ms.
WARMING = 480_000


class Studio:
    """A server in a process of its own."""

    def __init__(self, folder: Path, most_files: int | None = None) -> None:
        self.history = folder / "history.sqlite"
        self.temporary = folder / "tmp"
        self.temporary.mkdir()
        words = [sys.executable, "-m", "splinefeed", "studio", "--no-browser", "--json", "--history", str(self.history)]
        env = {**os.environ, "TMPDIR": str(self.temporary)}
        few = None if most_files is None else partial(resource.setrlimit, resource.RLIMIT_NOFILE, (most_files,) * 2)
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=env, preexec_fn=few)
        text = ""
        while "}" not in text:
            assert self.process.stdout is not None
            line = self.process.stdout.readline()
            assert line, "the studio did not start"
            text += line
        self.address: str = json.loads(text)["address"]
        self.port = urlsplit(self.address).port
        self.token = self.address.partition("token=")[2]

    def end(self) -> int:
        """Ctrl-C, and the exit code."""
        self.process.send_signal(signal.SIGINT)
        assert self.process.stdout is not None
        self.process.stdout.close()
        return self.process.wait(120)


@pytest.fixture(scope="session")
def studio(tmp_path_factory) -> Iterator[Studio]:
    """The studio of all tests; it must end well and leave no file behind."""
    pytest.importorskip("tornado", reason="the studio needs the extra [studio]")
    running = Studio(tmp_path_factory.mktemp("studio"))
    yield running
    assert running.end() == 0
    assert not [each for each in running.temporary.iterdir() if each.name.startswith("splinefeed-studio")]


@pytest.fixture
def opened(studio, chromium) -> Iterator[Any]:
    """Open a page of the studio, ready and planned; whatever its console complains of fails the test."""
    contexts, said = [], []

    def open_page(
        width: int = 1280, height: int = 900, *, address: str | None = None, scheme: str = "light", shown: str = "final"
    ) -> Any:
        context = chromium.new_context(
            viewport={"width": width, "height": height}, accept_downloads=True, color_scheme=scheme
        )
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE)
        page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(address or studio.address)
        page.wait_for_selector(f"body[data-shown={shown}]", timeout=WARMING)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert said == []
