"""Random programs, overrides, pauses, steps, threads, MDI, aborts, emergency stops and killed planners, for hours.

`python -m benchmarks.linuxcnc_soak MINUTES [SEED]` starts LinuxCNC for some ten minutes at a time, and prints a line
each time: what was over a limit, said, lost, and how the memory of its processes grew.
"""

from __future__ import annotations

import random
import re
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.hal_session import alone
from benchmarks.linuxcnc_motion import LINEAR, START, machine
from benchmarks.linuxcnc_planner import PERIOD, module_missing, planned_by_us, session
from benchmarks.linuxcnc_programs import programs
from splinefeed.live.linuxcnc_sink import LinuxcncError

#: Around an emergency stop the drives are off and no limit holds, ticks; the machine ends here, mm.
OFF, END = 400, (1.0, 2.0, 3.0)
#: Rounds of one LinuxCNC, how long each takes, s, and which of them kill the planner.
ROUNDS, ROUND, KILLS = 8, 72.0, (2, 6)
#: Threads and a tapped hole, between programs.
THREADS = "G21 G90 G94 G0 X0 Y0 Z0\nM3 S600\nG33 Z-10 K1\nG0 Z0\nG33.1 Z-8 K1\nG95 F0.5\nG1 X10\nG94\nM5\n"


def turns(rng: random.Random, begin: float, end: float) -> list[tuple[float, str]]:
    """An operator who turns overrides, pauses and steps between two times, s."""
    out: list[tuple[float, str]] = []
    at = begin
    while at < end:
        what = rng.choice(["feed", "feed", "rapid", "most", "pause", "step"])
        if what in ("pause", "step"):
            steps = [(at + 0.3 + 0.2 * k, "step") for k in range(3)] if what == "step" else []
            out += [(at, "pause"), *steps, (at + 1.1, "resume")]
        else:
            out.append((at, f"{what}={rng.randint(10, 60) if what == 'most' else rng.randint(20, 150)}"))
        at += rng.uniform(0.2, 1.5) + 1.2 * (what in ("pause", "step"))
    return [*out, (at, "feed=100"), (at, "rapid=100"), (at, "most=60")]


def typed(rng: random.Random, begin: float, count: int) -> list[tuple[float, str]]:
    """Commands by hand, 2.5 s each."""
    out = []
    for k in range(count):
        x, y, z = (round(rng.uniform(-20.0, 20.0), 3) for _ in range(3))
        out.append((begin + 2.5 * k, f"mdi=G21 G90 G94 G{rng.choice(['0', '1 F3000'])} X{x} Y{y} Z{z}"))
    return out


def actions(rng: random.Random) -> str:
    """What the operator does in all rounds: an abort, MDI, perhaps a planner that is killed, an emergency stop."""
    out: list[tuple[float, str]] = [(0.0, "patient")]
    for k in range(ROUNDS):
        at = k * ROUND
        if k:
            out.append((at, f"open=job{k}.ngc"))
        out += turns(rng, at + 0.5, at + 12.0)
        out.append((at + 15.0, "abort"))
        out += typed(rng, at + 16.0, 3)
        out.append((at + 23.5, "run"))
        out += turns(rng, at + 24.0, at + 31.5)
        out += [(at + 33.5, "file=kill")] * (k in KILLS) + [(at + 36.0, "abort")]
        out += typed(rng, at + (46.0 if k in KILLS else 37.0), 2)  # another planner is there by then
        out.append((at + 51.0, "run"))
        out += turns(rng, at + 51.5, at + 55.0)
        out += [(at + 57.0, "estop"), (at + 58.0, "on")]
        out += typed(rng, at + 59.0, 2)
    at = ROUNDS * ROUND
    out += [(at, "mdi=G21 G90 G94 G0 X{} Y{} Z{}".format(*END)), (at + 5.0, "feed=100")]
    return ",".join(f"{at:.2f}:{what}" for at, what in sorted(out, key=lambda each: each[0]))


def memory_of(folder: Path) -> dict[str, int]:
    """Memory, MB, of LinuxCNC's own processes, by name."""
    out = {}
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, KeyError):
            if f"HOME={folder}".encode() in (process / "environ").read_bytes().split(b"\0"):
                lines = dict(line.split(":", 1) for line in (process / "status").read_text().splitlines())
                if lines["Name"].strip() in ("rtapi_app", "milltask"):
                    out[lines["Name"].strip()] = int(lines["VmRSS"].split()[0]) // 1024
    return out


def once(rng: random.Random) -> tuple[str, bool]:
    """One LinuxCNC; what it showed, and whether all of it is right."""
    mill = replace(machine("xyz", LINEAR[2]), spindle=True)
    seconds = ROUNDS * ROUND + 120.0
    texts = []
    for _ in range(ROUNDS):
        chosen = [*rng.sample([each.text for each in programs() if each.axes == "xyz"], 5), THREADS]
        rng.shuffle(chosen)
        texts.append("".join(START + re.sub(r"(?im)^m2\s*$", "", text) for text in chosen) + "M2\n")
    with alone(), tempfile.TemporaryDirectory(prefix="splinefeed-linuxcnc-") as name, ExitStack() as stack:
        folder = Path(name)
        files = {**mill.files(texts[0], folder, seconds), "actions": actions(rng)}
        files |= {f"job{k}.ngc": text for k, text in enumerate(texts)}
        (folder / "mill.ini").write_text(files["mill.ini"], encoding="utf-8")
        children = [stack.enter_context(planned_by_us(folder))]
        over = threading.Event()
        planner: list[int] = []
        own: list[dict[str, int]] = []

        def watch() -> None:
            while not over.wait(0.05):
                status = Path(f"/proc/{children[-1].pid}/status")
                with suppress(OSError):
                    planner.extend(int(line.split()[1]) for line in status.read_text().splitlines() if "VmRSS" in line)
                if len(planner) % 200 == 0:
                    own.append(memory_of(folder))
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
    said = Counter(each for each in told["said"] if "silent" not in each)
    lost = float(np.abs(position[-1] - END).max())
    good = max(worst) <= 1.0 + 1e-6 and lost < 1e-6
    seen = [each for each in own if len(each) == 2]
    grown = [f"{name} {seen[len(seen) // 4][name]} to {seen[-1][name]} MB" for name in seen[-1]] if seen else []
    text = (
        f"{len(position) * PERIOD:.0f} s, {len(acted)} actions, {len(told['said'])} messages, shares of velocity, "
        f"acceleration, jerk {worst[0]:.3f} {worst[1]:.3f} {worst[2]:.3f}, end off by {lost:.1e} mm, planner "
        f"{planner[len(planner) // 4] // 1024} to {max(planner) // 1024} MB, {', '.join(grown)}; said: {dict(said)}"
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
