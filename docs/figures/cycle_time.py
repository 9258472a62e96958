"""Fit the controls of two mills to recorded runs, write their machine files, and put what came out into cycle-time.md.

    python docs/figures/cycle_time.py

Each program is left out in turn: its runs are then met by a control that has not seen it. The run under an override
that its log does not name is never fitted.
"""

from __future__ import annotations

import gzip
import shutil
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from marked import DOCS, rows, words, write

from splinefeed.machine.control import AxisControl, Control, SpindleControl
from splinefeed.machine.machine import Machine
from splinefeed.programs.calibration import Calibration, Recorded, calibrate, compared, record
from splinefeed.programs.cycle_time import cycle_time

DATA = DOCS.parent / "tests" / "data" / "cycle-time"
MACHINES = DOCS.parent / "src" / "splinefeed" / "machines"
#: Runs of each mill: program and run. The last of mill 02 is the one under an override.
RUNS = {
    "hurco-02": (("box-op2", "part11"), ("box-op3", "part9"), ("box-op3", "part11"), ("box-op2", "part9")),
    "hurco-04": (("plate-12", ""), ("plate-13", ""), ("plate-15", "")),
}
OVERRIDDEN = "box-op2-hurco02-part9.csv"
#: Rapid velocity of each axis, mm/s: the highest feed in the logs while Z moves alone.
RAPID = {"hurco-02": 500.0, "hurco-04": 176.1}
NOTES = (
    "Made by docs/figures/cycle_time.py from runs recorded by the Smart Manufacturing Systems Test Bed of NIST "
    "(github.com/usnistgov/smstestbed, tdp/mtc), public domain; NIST asks to be named as the source.",
    "Work offsets and the place of G28 are not in those data: home and change_place are places in the programs' own "
    "coordinates, good for workpieces that lie where those lay.",
    "Rapid velocities are the highest feeds in the logs while one axis moves.",
)


def blank(name: str) -> Machine:
    """A mill of which only rapid velocities and the spindle's top speed are known: all else is at its prior."""
    axes = {axis: AxisControl(rapid=RAPID[name]) for axis in "xyz"}
    spindle = SpindleControl(top_speed=Machine.parse(_SPINDLE).control.spindle.top_speed)  # type: ignore[union-attr]
    title = f"Hurco mill {name[-2:]} of NIST's test bed: its control alone, for cycle times"
    return Machine(name=name, title=title, notes=NOTES, axes={}, control=Control(axes=axes, spindle=spindle))


_SPINDLE = '[control.spindle]\ntop_speed = "12000rpm"'


def recorded(name: str, folder: Path) -> list[Recorded]:
    """The runs of a mill, from the files of the tests."""
    machine, mill = blank(name), name.replace("-", "")
    found = []
    for program, part in RUNS[name]:
        log = f"{program}-{mill}{f'-{part}' if part else ''}.csv"
        found.append(record(unpacked(f"{program}.nc", folder), unpacked(log, folder), machine))
    return found


def unpacked(name: str, folder: Path) -> Path:
    """A file of the tests, out of its .gz if it is in one."""
    if (DATA / name).exists():
        return DATA / name
    with gzip.open(DATA / f"{name}.gz") as packed, (folder / name).open("wb") as plain:
        shutil.copyfileobj(packed, plain)
    return folder / name


def left_out(name: str, runs: Sequence[Recorded]) -> tuple[Calibration, list[tuple[dict[str, Any], dict[str, Any]]]]:
    """The fit to all runs, and each run as that meets it and as the fit without its program does."""
    usual = [run for run in runs if run.log.name != OVERRIDDEN]
    whole = calibrate(usual, blank(name))
    pairs = {}
    for program in dict.fromkeys(run.program for run in runs):
        others = [run for run in usual if run.program != program]
        without = calibrate(others, blank(name))
        interval = cycle_time(program, without.machine).interval
        for run in runs:
            if run.program == program:
                test = compared(run, without.machine) | {"interval_s": interval}
                pairs[run.log.name] = compared(run, whole.machine), test
    return whole, [pairs[run.log.name] for run in runs]


def table(pairs: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> str:
    """Recorded and estimated seconds of runs, fit and test apart, with the worst tool of each."""
    head = ("run", "recorded, s", "fitted, s", "error", "not seen, s", "error", "95 % interval", "worst tool not seen")
    lines = [head]
    for fitted, test in pairs:
        worst = max(test["tools"], key=lambda tool: abs(tool["error"]))
        lines.append((
            test["run"].removesuffix(".csv"), f"{test['recorded_s']:.1f}", f"{fitted['estimated_s']:.1f}",
            f"{fitted['error']:+.2%}", f"{test['estimated_s']:.1f}", f"{test['error']:+.2%}",
            "{:.0f} to {:.0f}".format(*test["interval_s"]), f"{worst['tool']} {worst['error']:+.1%}",
        ))  # fmt: skip
    return rows(*lines)


def summary(pairs: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> str:
    """The median and the worst of programs that the fit has not seen, and of each of their tools."""
    tests = [test for _, test in pairs]
    whole = [abs(test["error"]) for test in tests]
    tools = [abs(tool["error"]) for test in tests for tool in test["tools"]]
    held = sum(test["interval_s"][0] <= test["recorded_s"] <= test["interval_s"][1] for test in tests)
    return (
        f"Of programs that the fit has not seen the error is {median(whole):.2%} in the median and {max(whole):.2%} at "
        f"worst, of each of their tools {median(tools):.2%} and {max(tools):.2%}. Their 95 % intervals hold {held} of "
        f"{len(tests)} recorded times."
    )


def known(found: Calibration) -> str:
    """The numbers of a control with their intervals."""
    lines = [("number", "value", "95 % interval", "unit")]
    for each in found.numbers:
        interval = f"{each.low:.3g} to {each.high:.3g}" if each.shown else "not shown: prior"
        lines.append((f"`{each.name}`", f"{each.value:.4g}", interval, each.unit))
    return rows(*lines)


def main() -> int:
    """Fit, write the machine files, and fill the page."""
    put = partial(write, "cycle-time.md", "cycle_time")
    found, pairs = {}, []
    with tempfile.TemporaryDirectory() as folder:
        for name in RUNS:
            found[name], met = left_out(name, recorded(name, Path(folder)))
            found[name].machine.save(MACHINES / f"{name}.toml")
            pairs += met
    usual = [pair for pair in pairs if pair[0]["run"] != OVERRIDDEN]
    put("runs", f"{table(usual)}\n\n{words(summary(usual))}")
    put("override", table([pair for pair in pairs if pair[0]["run"] == OVERRIDDEN]))
    put("mill-02", known(found["hurco-02"]))
    put("mill-04", known(found["hurco-04"]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
