"""HAL alone, without a motion controller, a screen or a real-time kernel: started, and taken down again."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

from splinefeed.live.linuxcnc_sink import LinuxcncError, as_nobody, installed

REALTIME = "/usr/lib/linuxcnc/realtime"


@contextmanager
def hal_session(text: str) -> Iterator[str]:
    """Run HAL with the .hal file `text`; gives the home folder of its user. One session a machine at a time.

    Raises LinuxcncError where LinuxCNC is not installed, or says why it does not start.
    """
    if not installed():
        raise LinuxcncError("LinuxCNC is not installed here: on Debian, apt-get install linuxcnc-uspace")
    with alone():
        yield from _session(text)


@contextmanager
def alone() -> Iterator[None]:
    """Wait until no other session of ours runs, HAL alone or all of LinuxCNC: it has one shared memory a machine."""
    import fcntl

    name = os.path.join(tempfile.gettempdir(), f"splinefeed-hal-{os.getuid()}.lock")
    with open(name, "w", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _session(text: str) -> Iterator[str]:
    home = tempfile.mkdtemp(prefix="splinefeed-hal-")
    os.chmod(home, 0o755)
    file = os.path.join(home, "session.hal")
    with open(file, "w", encoding="ascii") as stream:
        stream.write(text)
    if as_nobody():
        shutil.chown(home, "nobody", "nogroup")
    try:
        for command in ([REALTIME, "start"], ["halcmd", "-f", file], ["halcmd", "start"]):
            code, said = run_in_hal(command, home)
            if code:
                raise LinuxcncError(f"{' '.join(command)}: {_last_line(said)}")
        yield home
    finally:
        for command in (["halcmd", "stop"], ["halcmd", "unload", "all"], [REALTIME, "stop"]):
            run_in_hal(command, home)
        shutil.rmtree(home, ignore_errors=True)


def run_in_hal(command: list[str], home: str) -> tuple[int, str]:
    """Run a command, such as halcmd, as the user of a session; its exit code and what it said."""
    # into a file: HAL's process lives on with what it was started with, and a pipe would never end
    with open(os.path.join(home, "said.txt"), "w+", encoding="utf-8", errors="replace") as said:
        done = subprocess.run(
            [*as_nobody(), *command],
            env={**os.environ, "HOME": home},
            cwd=home,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            timeout=30,
        )
        said.seek(0)
        return done.returncode, said.read()


def _last_line(text: str) -> str:
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "it failed without a word"
