"""Runs in LinuxCNC's own Python: rows from stdin into the FIFO of HAL's `streamer`, and back what HAL did with them.

It needs nothing but the standard library and the `hal` module. One argument, JSON: `axes` (their number), `rows` (depth
to fill before the start), `record` (whether to send every sampled row back). Lines on stdin are rows as `halstreamer`
takes them; their end is the end of the stream. Lines on stdout are JSON.

Its component `splinefeed` has the pins run (out), taken, underruns, feed-override, feed-hold and position-0 ... (in).
"""

import json
import os
import select
import sys
import time
from typing import Any

import hal  # type: ignore[import-not-found]

#: Seconds between two reports, and between two looks at the FIFO.
REPORT, LOOK = 0.02, 0.002
#: Seconds without a row being taken, at the end of the stream, after which it counts as dead.
PATIENCE = 5.0
#: Samples in one line.
MOST_SAMPLES = 2000


def main() -> None:
    """Play until the last row is taken."""
    given = json.loads(sys.argv[1])
    axes = given["axes"]
    part = hal.component("splinefeed")
    part.newpin("run", hal.HAL_BIT, hal.HAL_OUT)
    part.newpin("taken", hal.HAL_U32, hal.HAL_IN)
    part.newpin("underruns", hal.HAL_S32, hal.HAL_IN)
    part.newpin("last", hal.HAL_BIT, hal.HAL_IN)
    part.newpin("feed-override", hal.HAL_FLOAT, hal.HAL_IN)
    part.newpin("feed-hold", hal.HAL_BIT, hal.HAL_IN)
    for k in range(axes):
        part.newpin(f"position-{k}", hal.HAL_FLOAT, hal.HAL_IN)
    part["feed-override"] = 1.0
    part.ready()
    for line in given["nets"]:
        os.system(line + " >/dev/null 2>&1")
    fifo = hal.stream(part, hal.streamer_base, "u" + "f" * axes + "b")
    samples = hal.stream(part, hal.sampler_base, given["sampler"]) if given.get("sampler") else None
    report = 0.0
    text = b""
    rows: list[tuple[float, ...]] = []
    ended = False
    written = 0
    at = moved = time.monotonic()
    seen = -1
    say({"ready": True, "depth": fifo.maxdepth, "position": [part[f"position-{k}"] for k in range(axes)]})
    while True:
        if not ended and len(rows) < given["rows"] and select.select([0], [], [], 0.0)[0]:
            more = os.read(0, 1 << 16)
            ended = not more
            lines = (text + more).split(b"\n")
            text = lines.pop()
            for each in lines:
                if each and not each.startswith(b"#"):
                    words = each.split()
                    rows.append((int(words[0]), *map(float, words[1:-1]), words[-1] == b"1"))
        while rows and fifo.writable:
            fifo.write(rows.pop(0))
            written += 1
        if not part["run"] and (written >= given["rows"] or (ended and not rows) or not fifo.writable):
            time.sleep(0.02)
            part["run"] = True
        sampled(samples)
        now = time.monotonic()
        if part["taken"] != seen:
            seen, moved = part["taken"], now
        if now >= report:
            rate = 0.0 if part["feed-hold"] else part["feed-override"]
            say({"taken": part["taken"], "underruns": part["underruns"], "override": rate})
            report = now + REPORT
        if ended and not rows and (part["last"] or now - moved > PATIENCE):
            break
        time.sleep(LOOK)
    at = time.monotonic() + given.get("settle", 0.0)
    while time.monotonic() < at:
        sampled(samples)
        time.sleep(LOOK)
    say({"taken": part["taken"], "underruns": part["underruns"], "done": bool(part["last"])})
    part["run"] = False


def sampled(samples: Any) -> None:
    """Send on what HAL sampled since the last time."""
    found: list[object] = []
    while samples is not None and samples.readable and len(found) < MOST_SAMPLES:
        found.append((samples.sampleno, *samples.read()))
    if found:
        say({"samples": found})


def say(what: dict[str, object]) -> None:
    """One line of JSON."""
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
