"""Runs in LinuxCNC's own Python: tells when its task waits for motion to end, so that no further move comes before.

Prints `waits` and `goes` as that changes, until its input ends. Nothing of splinefeed is imported here.
"""

import select
import sys
import time
from importlib import import_module
from typing import Any

linuxcnc: Any = import_module("linuxcnc")
#: How often the task is looked at, s; how long to wait for one that does not answer, s.
EVERY, AWAY = 0.002, 0.5


def waits(status: Any) -> bool:
    """Whether the task has handed over all that it can before motion is over."""
    if status.exec_state in (
        linuxcnc.EXEC_WAITING_FOR_MOTION,
        linuxcnc.EXEC_WAITING_FOR_MOTION_AND_IO,
    ):
        return True
    idle = status.interp_state == linuxcnc.INTERP_IDLE and status.exec_state == linuxcnc.EXEC_DONE
    return bool(idle and status.queue > 0)


def main() -> None:
    """Watch until nobody listens."""
    status, before = None, None
    while not select.select([sys.stdin], [], [], 0)[0]:
        try:
            status = status or linuxcnc.stat()
            status.poll()
        except (linuxcnc.error, SystemError):  # it has not begun, or has ended
            status = None
            time.sleep(AWAY)
            continue
        now = waits(status)
        if now != before:
            print("waits" if now else "goes", flush=True)
            before = now
        time.sleep(EVERY)


if __name__ == "__main__":
    main()
