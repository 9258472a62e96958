"""Random programs, overrides, pauses, MDI, aborts, emergency stops and killed planners inside LinuxCNC, for hours.

`python -m benchmarks.linuxcnc_soak MINUTES [SEED]` prints a line a session: what was over a limit, said, or lost.
"""

from __future__ import annotations

import random
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from benchmarks.hal_session import alone
from benchmarks.linuxcnc_motion import LINEAR, START, machine
from benchmarks.linuxcnc_planner import PERIOD, module_missing, planned_by_us, session
from benchmarks.linuxcnc_programs import programs
from splinefeed.live.linuxcnc_sink import LinuxcncError

#: Around an emergency stop the drives are off and no limit holds, ticks; the machine ends here, mm.
OFF, END = 400, (1.0, 2.0, 3.0)


def actions(rng: random.Random) -> str:
    """A minute and a half of an operator: an abort, MDI, a planner that is killed, an emergency stop, and the end."""
    out: list[tuple[float, str]] = [(0.0, "patient")]

    def turn(begin: float, end: float) -> None:
        at = begin
        while at < end:
            what = rng.choice(["feed", "feed", "rapid", "most", "pause"])
            if what == "pause":
                out.extend([(at, "pause"), (at + 0.5, "resume")])
            else:
                out.append((at, f"{what}={rng.randint(10, 60) if what == 'most' else rng.randint(20, 150)}"))
            at += rng.uniform(0.2, 1.5) + 0.6 * (what == "pause")
        out.extend([(at, "feed=100"), (at, "rapid=100"), (at, "most=60")])

    def typed(begin: float, count: int) -> float:
        for k in range(count):
            x, y, z = (round(rng.uniform(-20.0, 20.0), 3) for _ in range(3))
            out.append((begin + 2.5 * k, f"mdi=G21 G90 G{rng.choice(['0', '1 F3000'])} X{x} Y{y} Z{z}"))
        return begin + 2.5 * count

    turn(0.5, 12.0)
    out.append((15.0, "abort"))
    at = typed(16.0, 3)
    out.append((at, "run"))
    turn(at + 0.5, at + 8.0)
    out += [(at + 10.0, "file=kill"), (at + 12.5, "abort")]
    at = typed(at + 22.0, 2)  # another planner is there by then
    out.append((at, "run"))
    turn(at + 0.5, at + 4.0)
    out += [(at + 6.0, "estop"), (at + 7.0, "on")]
    at = typed(at + 8.0, 2)
    out += [(at, "mdi=G21 G90 G0 X{} Y{} Z{}".format(*END)), (at + 5.0, "feed=100")]
    return ",".join(f"{at:.2f}:{what}" for at, what in sorted(out, key=lambda each: each[0]))


def once(rng: random.Random, seconds: float = 240.0) -> tuple[str, bool]:
    """One session; what it showed, and whether all of it is right."""
    chosen = rng.sample([each for each in programs() if each.axes == "xyz"], 6)
    text = "".join(START + each.text.replace("M2\n", "").replace("m2\n", "") for each in chosen) + "M2\n"
    mill = machine("xyz", LINEAR[2])
    with alone(), tempfile.TemporaryDirectory(prefix="splinefeed-linuxcnc-") as name, ExitStack() as stack:
        folder = Path(name)
        files = {**mill.files(text, folder, seconds), "actions": actions(rng)}
        (folder / "mill.ini").write_text(files["mill.ini"], encoding="utf-8")
        children = [stack.enter_context(planned_by_us(folder))]
        over = threading.Event()
        memory: list[int] = []

        def watch() -> None:
            while not over.wait(0.05):
                status = Path(f"/proc/{children[-1].pid}/status")
                if status.exists():
                    memory.extend(int(line.split()[1]) for line in status.read_text().splitlines() if "VmRSS" in line)
                if (folder / "kill").exists():
                    (folder / "kill").unlink()
                    children[-1].kill()
                    time.sleep(1.5)
                    children.append(stack.enter_context(planned_by_us(folder)))

        watcher = threading.Thread(target=watch)
        watcher.start()
        try:
            rows, told = session(folder, files, seconds, len(mill.sampled), complains=True)
        finally:
            over.set()
            watcher.join()
        position, acted = rows[:, :3], told["acted"]
    off = np.zeros(len(position), dtype=bool)
    for row, what in acted:
        if what == "estop":
            off[row : row + OFF] = True
    worst = []
    for n in (1, 2, 3):
        d = np.abs(np.diff(position, n=n, axis=0)).max(axis=1) / PERIOD**n / LINEAR[n - 1]
        worst.append(float(np.where(off[: len(d)], 0.0, d).max()))
    said = [each for each in told["said"] if "silent" not in each]
    lost = float(np.abs(position[-1] - END).max())
    good = max(worst) <= 1.0 + 1e-6 and lost < 1e-6
    text = (
        f"{len(position) * PERIOD:.0f} s, shares of velocity, acceleration, jerk {worst[0]:.3f} {worst[1]:.3f} "
        f"{worst[2]:.3f}, end off by {lost:.1e} mm, planner at most {max(memory) // 1024} MB; said: {said}"
    )
    return text, good


def main() -> int:
    """Sessions until the minutes are over; 1 where one was not right."""
    minutes, seed = float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    if missing := module_missing():
        raise LinuxcncError(missing)
    end, bad = time.monotonic() + 60.0 * minutes, 0
    while time.monotonic() < end:
        try:
            text, good = once(random.Random(seed))
        except LinuxcncError as error:
            text, good = str(error), "lost" in str(error)
        bad += not good
        print(f"seed {seed}: {'' if good else 'NOT RIGHT, '}{text}", flush=True)
        seed += 1
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
