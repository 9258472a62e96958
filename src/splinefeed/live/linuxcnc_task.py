"""Runs in LinuxCNC's own Python: tells when its task waits for motion to end, so that no further move comes before.

Prints as that changes, until its input ends: since when it waits, s of the system's monotonic clock, or `inf` while it
goes on. Nothing of splinefeed is imported here.
"""

import re
import select
import sys
import time
from importlib import import_module
from typing import Any

linuxcnc: Any = import_module("linuxcnc")
#: How often the task is looked at, s; how long to wait for one that does not answer, s.
EVERY, AWAY = 0.001, 0.1
#: A command that was typed is taken for whole when its queue has not changed for so long, s.
QUIET = 0.010

#: What a program may not have, and words of G-code that are comments.
REFUSED = re.compile(r"g0*(33(?:\.1)?|76)(?![\d.])")
COMMENT = re.compile(r"\([^()]*\)|;.*")


def refused(file: str) -> str:
    """The first word of a program that stops it when its turn comes, in one line; empty where there is none."""
    try:
        with open(file, encoding="utf-8", errors="replace") as stream:
            for number, line in enumerate(stream, 1):
                found = REFUSED.search(COMMENT.sub("", line).lower().replace(" ", ""))
                if found:
                    what = f"G{found[1]}, motion in step with the spindle, is not supported"
                    return f"splinefeed: line {number}: {what}: the program stops there"
    except OSError:
        pass
    return ""


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


def main() -> None:
    """Watch until nobody listens."""
    status, before, queue, since, file = None, None, 0, 0.0, ""
    while not select.select([sys.stdin], [], [], EVERY)[0]:
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
        if status.file != file:
            file = status.file
            text = refused(file) if file else ""
            if text:
                linuxcnc.command().error_msg(text)
        if status.queue != queue:
            queue, since = status.queue, time.monotonic()
        now = waits(status) or (by_hand(status) and time.monotonic() - since > QUIET)
        if now != before:
            print(time.monotonic() if now else "inf", flush=True)
            before = now


if __name__ == "__main__":
    main()
