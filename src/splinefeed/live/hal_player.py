"""Runs in LinuxCNC's own Python: rows from stdin into the FIFO of HAL's `streamer`, and HAL's state back.

It needs nothing but the standard library and the `hal` module. One argument, JSON: `axes` (their number), `rows` (depth
to fill before the start), `nets` (lines of halcmd that connect its pins), `period` (s), `sampler` (what is sampled,
to be sent back), `settle` (s of samples behind the last row). Lines on stdin are rows as `halstreamer` takes them,
numbered from 1; their end is the end of the stream. Lines on stdout are JSON; any other line is a complaint.

When HAL runs out of rows it stays off, and rows are dropped until a line `# restart`, which comes
before the row behind the last one that was taken.

Its component `splinefeed` has the pins of PINS and, of every axis, command-0 and position-0 ... (in).
"""

import json
import os
import select
import subprocess
import sys
import time
from collections import deque
from typing import Any

import hal  # type: ignore[import-not-found]

#: Our component, and the library of HAL.
NAME, LIBRARY = "splinefeed", "liblinuxcnchal.so.0"
#: Seconds between two reports, and between two looks at the FIFO, where it is long enough for that.
REPORT, LOOK = 0.04, 0.01
#: Seconds without a row being taken, at the end of the stream, after which it counts as stopped.
PATIENCE = 5.0
#: Seconds that a change of pins needs to be seen by the servo thread, at least.
SETTLED = 0.01
#: Samples in one line.
MOST_SAMPLES = 2000
PINS = {
    **dict.fromkeys(["run", "end"], ("BIT", "OUT")),
    "allowed": ("FLOAT", "OUT"),
    "taken": ("U32", "IN"),
    "underruns": ("S32", "IN"),
    **dict.fromkeys(["last", "ok", "feed-hold", "feed-reverse"], ("BIT", "IN")),
    "feed-override": ("FLOAT", "IN"),
}


class Player:
    """The component, the FIFO and what is on its way into it."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given = given
        self.part = part = component()
        axes = range(given["axes"])
        places = {f"{what}-{k}": ("FLOAT", "IN") for k in axes for what in ("command", "position")}
        for name, (kind, way) in {**PINS, **places}.items():
            part.newpin(name, getattr(hal, f"HAL_{kind}"), getattr(hal, f"HAL_{way}"))
        part["feed-override"] = 1.0
        part.ready()
        done = subprocess.run(["halcmd", "-f"], input=given["nets"], capture_output=True, text=True, timeout=PATIENCE)
        if done.returncode:
            sys.exit(f"halcmd: {(done.stderr or done.stdout).strip()}")
        part["run"] = False
        time.sleep(SETTLED)
        self.fifo = hal.stream(part, hal.streamer_base, "u" + "f" * given["axes"] + "b")
        drain(self.fifo)  # of a stream that was stopped
        self.samples = hal.stream(part, hal.sampler_base, given["sampler"]) if given.get("sampler") else None
        drain(self.samples)  # what was sampled when nobody was here
        # HAL may have played before: its last row, its last field and its underruns are still there. A row that was
        # left in its FIFO has a number of its own
        self.before = part["taken"] + 1 if part["taken"] else 0
        self.old_last = bool(part["last"])
        part["end"] = not self.old_last
        self.old_underruns = part["underruns"]
        self.waited = 0.0  # s that rows were missing for
        self.allow()
        self.text = b""
        self.rows: deque[tuple[float, ...]] = deque()
        self.filled = 0  # rows written since it was last off
        self.written = 0
        self.ended = False
        self.dry_at = 0.0  # when it ran dry; 0 if it has not
        self.times_dry = 0

    def allow(self) -> None:
        """Allow the underruns that there are by now."""
        self.part["allowed"] = self.part["underruns"] + 0.5

    def settle(self) -> None:
        """Wait until HAL has seen that it is off, and would start."""
        end = time.monotonic() + PATIENCE
        time.sleep(SETTLED)
        while not self.part["ok"] and time.monotonic() < end:
            time.sleep(SETTLED)

    @property
    def taken(self) -> int:
        """The last of our rows that HAL has taken."""
        return max(self.part["taken"] - self.before, 0) if self.part["taken"] <= self.before + self.written else 0

    @property
    def done(self) -> bool:
        """Whether the last row is taken."""
        return self.written > 0 and bool(self.part["last"]) != self.old_last

    def read(self) -> None:
        """Take what has come on stdin, if there is room for it."""
        if self.ended or len(self.rows) >= self.given["rows"] or not select.select([0], [], [], 0.0)[0]:
            return
        more = os.read(0, 1 << 16)
        self.ended = not more
        lines = (self.text + more).split(b"\n")
        self.text = lines.pop()
        for each in lines:
            if each.startswith(b"# restart"):
                self.restart()
            elif each and not each.startswith(b"#") and not self.dry_at:
                words = each.split()
                last = (words[-1] == b"1") != self.old_last
                self.rows.append((int(words[0]) + self.before, *map(float, words[1:-1]), last))

    def feed(self) -> None:
        """Fill the FIFO, and start when there is enough in it."""
        part, rows = self.part, self.rows
        if self.dry_at:
            return
        while rows and self.fifo.writable:
            self.fifo.write(rows.popleft())
            self.written += 1
            self.filled += 1
        enough = self.filled >= self.given["rows"] or (self.ended and not rows) or not self.fifo.writable
        if not part["run"] and enough and self.filled:
            self.settle()
            part["run"] = True
            time.sleep(SETTLED)

    def watch(self) -> str | None:
        """Whether HAL is off; the reason if it is final, or None."""
        part = self.part
        if not part["run"] or part["ok"] or self.done or self.dry_at:
            return None
        if part["underruns"] > part["allowed"]:
            self.dry_at = time.monotonic()
            self.times_dry += 1
            self.rows.clear()
            self.written = self.taken
            return None
        away = [abs(part[f"command-{k}"] - part[f"position-{k}"]) for k in range(self.given["axes"])]
        return f"{away.index(max(away))} {max(away):.6g}"

    def restart(self) -> None:
        """Rows come again."""
        self.waited += time.monotonic() - self.dry_at
        self.part["run"] = False
        self.allow()
        self.settle()
        drain(self.fifo)  # rows that came too late
        self.dry_at, self.filled = 0.0, 0

    def report(self) -> dict[str, object]:
        """Its status; dry: how often it has run dry, 0 where it is not."""
        part = self.part
        rate = 0.0 if part["feed-hold"] else -part["feed-override"] if part["feed-reverse"] else part["feed-override"]
        return {
            "taken": self.taken,
            "underruns": part["underruns"] - self.old_underruns + round(self.waited / self.given["period"]),
            "override": rate,
            "dry": self.times_dry if self.dry_at else 0,
        }

    def sampled(self) -> None:
        """Send on what HAL sampled since the last time."""
        found: list[object] = []
        while self.samples is not None and self.samples.readable and len(found) < MOST_SAMPLES:
            found.append((self.samples.sampleno, *self.samples.read()))
        if found:
            say({"samples": found})


def component() -> Any:
    """Our component; one that was left by a player that was killed is taken away first."""
    try:
        return hal.component(NAME)
    except hal.error:
        listed = subprocess.run(["halcmd", "-s", "show", "comp", NAME], capture_output=True, text=True).stdout.split()
        if len(listed) < 4 or os.path.exists(f"/proc/{listed[3]}"):
            sys.exit("another stream plays into this HAL; end it first")
        # HAL's library frees it, in a process of its own, as that one cannot use the library any more
        free = f"import ctypes, hal; c = hal.component('{NAME}-mends'); ctypes.CDLL('{LIBRARY}').hal_exit({listed[0]})"
        subprocess.run([sys.executable, "-c", free], capture_output=True, timeout=PATIENCE)
        return hal.component(NAME)


def drain(fifo: Any) -> None:
    """Take out what is in a FIFO, if there is one."""
    while fifo is not None and fifo.readable:
        fifo.read()


def say(what: dict[str, object]) -> None:
    """One line of JSON."""
    print(json.dumps(what), flush=True)


def main() -> None:
    """Play until the last row is taken."""
    player = Player(json.loads(sys.argv[1]))
    part, count = player.part, player.given["axes"]
    say({"ready": True, "position": [part[f"position-{k}"] for k in range(count)]})
    report_at, moved, seen = 0.0, time.monotonic(), -1
    stopped = None
    ahead = player.given["rows"] * player.given["period"]
    look, report = min(LOOK, 0.1 * ahead), min(REPORT, 0.2 * ahead)
    while stopped is None:
        player.read()
        stopped = player.watch()
        player.feed()
        player.sampled()
        now = time.monotonic()
        if player.taken != seen:
            seen, moved = player.taken, now
        if now >= report_at:
            say(player.report())
            report_at = now + report
        if player.ended and not player.rows and (player.done or player.dry_at or now - moved > PATIENCE):
            break
        time.sleep(look)
    end = time.monotonic() + player.given.get("settle", 0.0)
    while time.monotonic() < end:
        player.sampled()
        time.sleep(LOOK)
    say({**player.report(), "done": player.done, "stopped": stopped})
    part["run"] = False


if __name__ == "__main__":
    main()
