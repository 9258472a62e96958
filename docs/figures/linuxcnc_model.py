"""Compare the model of LinuxCNC's planner with what a live one took, and put the table into cycle-time.md.

Call: python docs/figures/linuxcnc_model.py
"""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from pathlib import Path
from statistics import mean, median

from marked import DOCS, rows, write

put = partial(write, "cycle-time.md", "linuxcnc_model")
SETS = {"first": "that showed the form of the model", "second": "that corrected it in two places", "third": "not seen"}


def main() -> int:
    """Time both sets of programs."""
    tests = DOCS.parent / "tests"
    sys.path[:0] = [str(tests), str(tests / "programs")]
    from test_linuxcnc_times import MACHINES, errors  # type: ignore[import-not-found]

    lines = [("programs", "limits", "number", "mean", "least", "most", "median of sizes")]
    for which, words in SETS.items():
        with tempfile.TemporaryDirectory() as folder:
            found = [100.0 * each for each in errors(which, Path(folder)).values()]
        velocity, acceleration = MACHINES[which]
        shown = (f"{value:+.2f} %" for value in (mean(found), min(found), max(found)))
        limits = f"{velocity:g} mm/s, {acceleration:g} mm/s^2"
        lines.append((words, limits, str(len(found)), *shown, f"{median(abs(each) for each in found):.2f} %"))
    put("live", rows(*lines, left=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
