"""Runs in LinuxCNC's own Python: tells when its task waits for motion to end, so that no further move comes before.

Prints as that changes, until its input ends: `waits` and since when it waits, s of the system's monotonic clock, or inf
while it goes on; `file` and the program that is loaded, or loaded again with other contents. Each line of the input
goes to the operator's screen. Nothing of splinefeed is imported here.
"""

import os
import select
import sys
import time
from contextlib import suppress
from importlib import import_module
from typing import Any

linuxcnc: Any = import_module("linuxcnc")
#: How often the task is looked at, s; how long to wait for one that does not answer, s.
EVERY, AWAY = 0.001, 0.1
#: Letters of a message that reach the screen.
LONGEST = 250
#: A command that was typed is taken for whole when its queue has not changed for so long, s.
QUIET = 0.010


def waits(status: Any) -> bool:
    """Whether the task has handed over all that it can before motion is over."""
    if status.exec_state in (
        linuxcnc.EXEC_WAITING_FOR_MOTION,
        linuxcnc.EXEC_WAITING_FOR_MOTION_AND_IO,
    ):
        return True
    return bool(
        status.interp_state == linuxcnc.INTERP_IDLE and status.exec_state == linuxcnc.EXEC_DONE and status.queue
    )


def by_hand(status: Any) -> bool:
    """Whether a command that was typed moves: nothing tells whether it has more to come but that nothing comes."""
    return bool(status.task_mode == linuxcnc.MODE_MDI and status.exec_state == linuxcnc.EXEC_DONE and status.queue)


def listens() -> bool:
    """Whether somebody listens; what came goes to the screen."""
    if select.select([sys.stdin], [], [], EVERY)[0]:
        text = sys.stdin.readline()
        if not text:
            return False
        with suppress(linuxcnc.error):
            linuxcnc.command().error_msg(text.strip()[:LONGEST])
    return True


def changed(file: str) -> float:
    """When a file was changed, s; 0 where it is not there."""
    try:
        return os.stat(file).st_mtime
    except OSError:
        return 0.0


def main() -> None:
    """Watch until nobody listens."""
    status, before, queue, since, file = None, None, 0, 0.0, ("", 0.0)
    while listens():
        try:
            status = status or linuxcnc.stat()
            status.poll()
        except linuxcnc.error:  # it has not begun, or has ended
            status = None
        except SystemError:  # it has no tool data yet, and this process will never see them
            return
        if status is None or not status.task_state:  # or it has begun again, with memory of its own
            status = None
            time.sleep(AWAY)
            continue
        now_file = (status.file, changed(status.file))
        if now_file != file:
            file = now_file
            print("file", status.file, flush=True)
        if status.queue != queue:
            queue, since = status.queue, time.monotonic()
        now = waits(status) or (by_hand(status) and time.monotonic() - since > QUIET)
        if now != before:
            print("waits", time.monotonic() if now else "inf", flush=True)
            before = now


if __name__ == "__main__":
    main()
