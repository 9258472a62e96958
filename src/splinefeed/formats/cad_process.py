"""The process that reads CAD files with OCCT and rhino3dm, and the paths of what it answers.

OCCT was seen to end by a segmentation fault on more than half of STEP files with a few bytes changed, and such
libraries cannot be stopped. So they run apart, with a limit on time and memory; a file that they cannot bear is an
error of one line, and the next file finds a new process. It is started by the first file and stays for the next ones.
"""

from __future__ import annotations

import atexit
import importlib.util
import json
import os
import pathlib
import subprocess
import sys
import threading
from contextlib import suppress
from typing import Any, NamedTuple

import splinefeed
from splinefeed.errors import CurveError, FormatError
from splinefeed.formats.cad_curves import curves_of
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import Drawing, many, runs_that_meet
from splinefeed.formats.sizes import MAX_DRAWING_CURVES, MAX_DRAWING_POINTS

#: Time that a library gets for a file, s, and for each MB of it.
MAX_SECONDS = 30.0
SECONDS_PER_MB = 5.0
#: Names that files give to their units.
_UNITS = {"millimetre": "mm", "metre": "m", "centimetre": "cm", "micrometre": "um", "inch": "in", "foot": "ft"}
#: The worker runs the same splinefeed as this process, wherever that was found.
_PROGRAM = (
    "import sys; sys.path.insert(0, sys.argv[1]); from splinefeed.formats import cad_worker; del sys.path[0]; "
    "cad_worker.main()"
)
_INSTALL = "run: pip install 'splinefeed[cad]'"


class Library(NamedTuple):
    """What reads a kind of file: the kind, the module to import, and what people call it."""

    kind: str
    module: str
    title: str


class _Worker:
    """The process that runs `cad_worker`; one task at a time."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._of_parents: list[object] = []

    def ask(self, task: dict[str, Any], seconds: float) -> dict[str, Any] | str:
        """The answer to `task`, or why there is none."""
        with self._lock:
            process = self._running()
            assert process.stdin is not None
            assert process.stdout is not None
            late = threading.Event()

            def end_it() -> None:
                late.set()
                process.kill()

            clock = threading.Timer(seconds, end_it)
            clock.daemon = True
            clock.start()
            try:
                process.stdin.write(json.dumps(task).encode() + b"\n")
                process.stdin.flush()
                line = process.stdout.readline()
            except BrokenPipeError:
                line = b""
            except BaseException:  # Ctrl-C: an answer that nobody read would be taken for that to the next task
                self.stop()
                raise
            finally:
                clock.cancel()
            if line.endswith(b"\n"):
                answer: dict[str, Any] = json.loads(line)
                return answer
            self.stop()
            return f"takes longer than {seconds:.0f} s" if late.is_set() else "makes the CAD library crash"

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            home = str(pathlib.Path(splinefeed.__file__).parent.parent)
            # -P: what lies in the current folder is not imported
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _PROGRAM, home],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
        return self._process

    def stop(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    with suppress(OSError):  # words that did not get through before the process died
                        stream.close()

    def forget(self) -> None:
        """Leave the process to the parent that this one was forked from: two must not talk through the same pipes."""
        self._of_parents.append(self._process)  # kept, or Python would say that it still runs
        self._lock = threading.Lock()
        self._process = None


_worker = _Worker()
atexit.register(_worker.stop)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_worker.forget)


def read(
    file: pathlib.Path,
    library: Library,
    findings: list[str],
    *,
    tolerance: float,
    repair: bool,
    **wanted: Any,
) -> Contents:
    """The paths in the checked `file`; `findings` are those of the check, `wanted` is for the library's side.

    Curves whose ends meet within `tolerance`, mm, make one path; see `drawing`. With `repair` a curve that cannot be is
    a finding. Raises FormatError for all else, and where the library is not installed.
    """
    _check_installed(file, library)
    limits = {"most_curves": MAX_DRAWING_CURVES, "most_points": MAX_DRAWING_POINTS}
    task = {"kind": library.kind, "file": os.path.abspath(file), "repair": repair, **limits, **wanted}
    answer = _worker.ask(task, MAX_SECONDS + SECONDS_PER_MB * file.stat().st_size / 2**20)
    if isinstance(answer, str):
        raise FormatError(f"{file}: {answer}; is it damaged?")
    if "missing" in answer:
        raise FormatError(f"{file}: needs {library.title}, which cannot be loaded ({answer['missing']}); {_INSTALL}")
    if "refused" in answer:
        raise FormatError(f"{file}: {answer['refused']}")
    drawing = Drawing(os.fspath(file), findings=[*findings, *answer["findings"]])
    number = no_length = broken = 0
    for group in answer["groups"]:
        curves = []
        for said in group["curves"]:
            number += 1
            try:
                made = curves_of(said)
            except CurveError as error:
                if not repair:
                    raise FormatError(f"{file}: curve {number}: {error}") from None
                drawing.findings.append(f"curve {number} is left out: {error}")
                continue
            no_length += not made
            broken += len(made) > 1
            curves += made
        for run in runs_that_meet(curves):
            drawing.add(run, group["name"] or file.stem)
    if broken:
        drawing.findings.append(
            f"{many(broken, 'spline has a knot', 'splines have knots')} of multiplicity degree + 1, at which it may "
            f"jump; each is the pieces between, exactly"
        )
    if no_length:
        drawing.left_out["curve of no length"] = no_length
    unit = answer["units"].lower()
    return Contents(drawing.paths(file.stem, tolerance, repair), _UNITS.get(unit, unit) or "mm")


def _check_installed(file: pathlib.Path, library: Library) -> None:
    try:
        there = importlib.util.find_spec(library.module) is not None
    except (ImportError, ValueError):  # ValueError: someone put None in sys.modules
        there = False
    if not there:
        raise FormatError(f"{file}: needs {library.title}, which is not installed; {_INSTALL}")
