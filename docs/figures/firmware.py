"""Compare the models of open firmware with their published rules, and put the table into cycle-time.md.

python docs/figures/firmware.py
"""

from __future__ import annotations

import sys
import tempfile
from functools import partial
from pathlib import Path
from statistics import mean

from marked import DOCS, rows, write

import splinefeed as sf

put = partial(write, "cycle-time.md", "firmware")
PROGRAMS = 40


def main() -> int:
    """Time random programs by each model and by the oracle of the tests."""
    sys.path.insert(0, str(DOCS.parent / "tests" / "programs"))
    import test_firmware as oracle  # type: ignore[import-not-found]

    lines = [("control", "reference", "programs", "mean", "least", "most")]
    with tempfile.TemporaryDirectory() as folder:
        for name, (control, reference) in oracle.CASES.items():
            errors = []
            for seed in range(PROGRAMS):
                text, moves = oracle.program(seed)
                file = Path(folder) / "part.nc"
                file.write_text("\n".join(text) + "\n")
                machine = sf.Machine(name="mill", axes={}, control=control)
                total = sf.cycle_time(file, machine, dialect="linuxcnc").total
                errors.append(100.0 * (total / reference(moves) - 1.0))
            shown = (f"{value + 0.0:+.4f} %" for value in (mean(errors), min(errors), max(errors)))
            lines.append((name, "published rules, move by move", str(PROGRAMS), *shown))
    put("rules", rows(*lines, left=2))
    return 0


if __name__ == "__main__":
    sys.exit(main())
