"""Plans are the same on every processor: under each kernel of OpenBLAS that this one can run, each in a process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
#: Seeds of `random_motions`, and kernels; the last one needs AVX2.
SEEDS, KERNELS = range(2000, 2200), ("Prescott", "Nehalem", "Haswell")
PLANNED = f"""
import json, sys
sys.path.insert(0, {str(TESTS)!r})
import random_motions
import splinefeed as sf

found = {{}}
for seed in range({SEEDS.start}, {SEEDS.stop}):
    motion = random_motions.motion(seed, ("time-optimal", "look-ahead"))
    try:
        law = sf.plan(motion.path, motion.limits, strategy=motion.strategy, period=motion.period)
        found[seed] = law.duration / motion.period
    except sf.SplinefeedError as error:
        found[seed] = str(error)
print(json.dumps(found))
"""


def planned(kernel: str | None) -> dict[str, float | str]:
    """Periods that each motion takes, or why it is refused, under one kernel."""
    surroundings = os.environ | ({} if kernel is None else {"OPENBLAS_CORETYPE": kernel})
    done = subprocess.run([sys.executable, "-c", PLANNED], capture_output=True, text=True, env=surroundings, check=True)
    return json.loads(done.stdout)


def can_run(kernel: str) -> bool:
    """Whether this processor has what a kernel needs."""
    if kernel != "Haswell":
        return True
    flags = Path("/proc/cpuinfo")
    return flags.exists() and "avx2" in flags.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_motions_are_planned_alike_under_every_kernel() -> None:
    here = planned(None)
    assert not [seed for seed, found in here.items() if isinstance(found, str)]
    for kernel in filter(can_run, KERNELS):
        there = planned(kernel)
        assert not [seed for seed, found in there.items() if isinstance(found, str)]
        apart = [seed for seed in here if abs(float(here[seed]) - float(there[seed])) > 1.0 + 1e-6]
        assert len(apart) <= 1, (kernel, apart)
