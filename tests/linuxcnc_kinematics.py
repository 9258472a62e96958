"""Poses through the kinematics modules of an installed LinuxCNC, loaded in its HAL: the oracle of the tests.

Run as a program it is the child, in LinuxCNC's own surroundings; imported, it has `asked` for the tests. The modules
are called as the motion controller calls them, their pins set by halcmd.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

LETTERS = "xyzabcuvw"


class Pose(ctypes.Structure):
    _fields_ = [(letter, ctypes.c_double) for letter in LETTERS]


def asked(module: str, sets: Sequence[dict[str, Any]]) -> list[list[list[float]]]:
    """Rows that the module answers: of each set {pins, inverse, rows}, poses (x ... w, deg) or joints (deg)."""
    from benchmarks.hal_session import alone

    from splinefeed.live.linuxcnc_sink import PYTHON, as_nobody

    job = json.dumps({"module": module, "sets": sets})
    with alone():
        return _answer(job, [*as_nobody(), PYTHON, "-"])


def _answer(job: str, command: Sequence[str]) -> list[list[list[float]]]:
    done = subprocess.run(
        command,
        input=f"{Path(__file__).read_text(encoding='utf-8')}\nchild({job!r})\n",
        capture_output=True,
        text=True,
        timeout=300,
        cwd="/",
    )
    assert done.returncode == 0, done.stderr
    answer: list[list[list[float]]] = json.loads(done.stdout)
    return answer


def child(text: str) -> None:
    """Answer one job."""
    job = json.loads(text)
    answer = os.dup(1)
    os.dup2(2, 1)  # what the module says on stdout
    ctypes.CDLL("liblinuxcnchal.so.0", mode=ctypes.RTLD_GLOBAL)
    module = ctypes.CDLL(f"/usr/lib/linuxcnc/modules/{job['module']}.so")
    if module.rtapi_app_main() != 0:
        sys.exit("the module does not load")
    try:
        found = [_rows(module, one) for one in job["sets"]]
    finally:
        module.rtapi_app_exit()
    os.write(answer, json.dumps(found).encode())


def _rows(module: ctypes.CDLL, job: dict[str, Any]) -> list[list[float]]:
    for pin, value in job["pins"].items():
        subprocess.run(["halcmd", "setp", pin, repr(value)], check=True)
    flags = ctypes.c_ulong(0)
    rows = []
    for row in job["rows"]:
        pose, joints = Pose(), (ctypes.c_double * 16)()
        if job["inverse"]:
            for letter, value in zip(LETTERS, row, strict=True):
                setattr(pose, letter, value)
            code = module.kinematicsInverse(ctypes.byref(pose), joints, ctypes.byref(flags), ctypes.byref(flags))
            rows.append(list(joints[:6]))
        else:
            for k, value in enumerate(row):
                joints[k] = value
            code = module.kinematicsForward(joints, ctypes.byref(pose), ctypes.byref(flags), ctypes.byref(flags))
            rows.append([getattr(pose, letter) for letter in LETTERS])
        if code != 0:
            sys.exit(f"the module refuses {row}")
    return rows
