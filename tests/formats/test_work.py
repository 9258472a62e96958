"""Small files that ask for much work: refused with the number, or read in time and memory that a fuzzer allows."""

from __future__ import annotations

import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hostile import blocks, fit_points

#: s of processor time, generous on a slow machine, and bytes of memory that a small file may take.
MOST_SECONDS, MOST_MEMORY = 20, 2**30
PROGRAM = (
    "import sys, splinefeed as sf\nfrom splinefeed.formats.registry import read_all\n"
    "try:\n    print(len(read_all(sys.argv[1])), 'read')\n"
    "except sf.errors.SplinefeedError as error:\n    print(error)\n"
    "print(int(open('/proc/self/status').read().split('VmHWM:')[1].split()[0]) * 1024)\n"
)


def same_places(count: int) -> str:
    random = np.random.default_rng(5)
    places = [f"{x} {y} {z}" for x, y, z in random.integers(0, 20, (20, 3))]
    return "\n".join(places[k] for k in random.integers(0, 20, count))


CASES: dict[str, tuple[str, Callable[[], str], str]] = {
    "19,000 fit points": (".dxf", lambda: fit_points(19_000), "1 read"),
    "fit points": (".dxf", lambda: fit_points(20_001), "20001 fit points up to here; at most 20000"),
    "fit points of three": (".dxf", lambda: fit_points(9000, 3), "27000 fit points up to here; at most 20000"),
    "blocks": (".dxf", lambda: blocks(6, 10), "more than 100000 references to blocks"),
    "places": (".csv", lambda: same_places(3000), "1 read"),
}


@pytest.mark.parametrize("name", CASES)
def test_a_small_file_takes_little_time_and_memory(tmp_path: Path, name: str) -> None:
    suffix, make, expected = CASES[name]
    file = tmp_path / f"much{suffix}"
    file.write_text(make())
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(file)],
        capture_output=True, text=True, check=True, timeout=120,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS + 1)),
    )  # fmt: skip
    said, memory = done.stdout.splitlines()
    assert expected in said
    assert int(memory) < MOST_MEMORY
