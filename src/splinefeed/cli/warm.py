"""The first run compiles on two cores: what its end needs in a process of its own, while its beginning compiles here.

`python -m splinefeed.cli.warm` is that process: it leaves compiled kernels in the cache and nothing else.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

#: The run goes on without the helper after this time, s, and compiles for itself.
LONGEST = 120.0


@contextmanager
def helper(command: str, with_machine: bool) -> Iterator[Callable[[], None]]:
    """Start the helper if `command` has never run here; what it gives waits until the kernels are there."""
    import numba

    from splinefeed.kernels.jit import cache_directory

    if numba.config.DISABLE_JIT or (cache_directory() / f"{command}.ready").exists():
        yield lambda: None
        return
    words = [sys.executable, "-m", "splinefeed.cli.warm", *(["machine"] if with_machine else [])]
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(words, stdin=quiet, stdout=quiet, stderr=quiet)

    def wait() -> None:
        with suppress(subprocess.TimeoutExpired):
            process.wait(LONGEST)

    try:
        yield wait
    finally:
        process.kill()
        process.wait()


def main(machine: bool) -> None:
    """Measure, check and follow a few setpoints, without planning or interpolating any."""
    import numpy as np

    from splinefeed.analysis.check import check
    from splinefeed.analysis.ripple import chord_errors, feed_ripple
    from splinefeed.geometry import shapes
    from splinefeed.machine.table import Table
    from splinefeed.pipeline.follow import follow
    from splinefeed.records import LAW_COEFFICIENTS, Limits, Setpoints, TimeLaw

    path = shapes.from_text("naca:0025?perimeter=33")
    feed = path.length / 0.02
    s = np.linspace(0.0, path.length, 21)
    curve, u = path.locate(s)
    t = s / feed
    points = Setpoints(
        t=t, curve=curve, u=u, s=s, feed=np.full(21, feed), position=path(s), axes=path.axes, period=1e-3, method="none"
    )
    coefficients = np.zeros((1, LAW_COEFFICIENTS))
    coefficients[0, 1] = feed
    law = TimeLaw(breaks=np.array([0.0, float(t[-1])]), coefficients=coefficients, strategy="none")
    feed_ripple(points, path, law)
    chord_errors(points, path)
    check(points, path, Limits(feed=feed, acceleration=1.0, jerk=1.0), law)
    if machine:
        follow(points, Table.load("xytheta"), path=path)


if __name__ == "__main__":
    main("machine" in sys.argv[1:])
