"""Random programs, overrides, pauses, steps, runs back, MDI, aborts, emergency stops and killed planners, for hours.

`python -m benchmarks.linuxcnc_soak MINUTES [SEED]` starts LinuxCNC once for so long, and prints what was over a limit,
said, lost, and how the memory of its processes grew; 1 is returned where anything was not right.
"""

from __future__ import annotations

import math
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
#: How long a round takes, s; in the first half one of so many kills the planner; memory is looked at so often, s.
ROUND, KILLS, LOOKS = 72.0, 4, 10.0
#: Threads and a tapped hole, between programs.
THREADS = "G21 G90 G94 G0 X0 Y0 Z0\nM3 S600\nG33 Z-10 K1\nG0 Z0\nG33.1 Z-8 K1\nG95 F0.5\nG1 X10\nG94\nM5\n"


def turns(rng: random.Random, begin: float, end: float) -> list[tuple[float, str]]:
    """An operator who turns overrides, pauses, steps and runs back between two times, s."""
    out: list[tuple[float, str]] = []
    at = begin
    while at < end:
        what = rng.choice(["feed", "feed", "rapid", "most", "pause", "step", "back"])
        if what in ("pause", "step"):
            steps = [(at + 0.3 + 0.2 * k, "step") for k in range(3)] if what == "step" else []
            out += [(at, "pause"), *steps, (at + 1.1, "resume")]
        elif what == "back":
            for direction in ("reverse", "forward"):
                out += [(at, "pause"), (at + 0.6, direction), (at + 0.8, "resume")]
                at += 1.3
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


def actions(rng: random.Random, rounds: int) -> str:
    """What the operator does in all rounds: an abort, MDI, perhaps a planner that is killed, an emergency stop."""
    out: list[tuple[float, str]] = [(0.0, "patient")]
    for k in range(rounds):
        at, kills = k * ROUND, k % KILLS == KILLS // 2 and 2 * k < rounds
        if k:
            out.append((at, f"open=job{k}.ngc"))
        out += turns(rng, at + 0.5, at + 12.0)
        out.append((at + 15.0, "abort"))
        out += typed(rng, at + 16.0, 3)
        out.append((at + 23.5, "run"))
        out += turns(rng, at + 24.0, at + 31.5)
        out += [(at + 33.5, "file=kill")] * kills + [(at + 36.0, "abort")]
        out += typed(rng, at + (46.0 if kills else 37.0), 2)  # another planner is there by then
        out.append((at + 51.0, "run"))
        out += turns(rng, at + 51.5, at + 55.0)
        out += [(at + 57.0, "estop"), (at + 58.0, "on")]
        out += typed(rng, at + 59.0, 2)
    at = rounds * ROUND
    out += [(at, "mdi=G21 G90 G94 G0 X{} Y{} Z{}".format(*END)), (at + 5.0, "feed=100")]
    return ",".join(f"{at:.2f}:{what}" for at, what in sorted(out, key=lambda each: each[0]))


def memory_of(folder: Path, planner: int, number: int) -> dict[str, int]:
    """Memory, MB, of LinuxCNC's own processes and of the planner that is the so manieth, by name."""
    out = {}
    with suppress(OSError, StopIteration):
        lines = (Path("/proc") / str(planner) / "status").read_text().splitlines()
        out[f"planner {number}"] = next(int(line.split()[1]) for line in lines if "VmRSS" in line) // 1024
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, KeyError):
            if f"HOME={folder}".encode() in (process / "environ").read_bytes().split(b"\0"):
                lines = dict(line.split(":", 1) for line in (process / "status").read_text().splitlines())
                if lines["Name"].strip() in ("rtapi_app", "milltask"):
                    out[lines["Name"].strip()] = int(lines["VmRSS"].split()[0]) // 1024
    return out


def soaked(rng: random.Random, rounds: int) -> tuple[str, bool]:
    """One LinuxCNC for so many rounds; what it showed, and whether all of it is right."""
    mill = replace(machine("xyz", LINEAR[2]), spindle=True)
    seconds = rounds * ROUND + 120.0
    texts = []
    for _ in range(rounds):
        chosen = [*rng.sample([each.text for each in programs() if each.axes == "xyz"], 5), THREADS]
        rng.shuffle(chosen)
        texts.append("".join(START + re.sub(r"(?im)^m2\s*$", "", text) for text in chosen) + "M2\n")
    with alone(), tempfile.TemporaryDirectory(prefix="splinefeed-linuxcnc-") as name, ExitStack() as stack:
        folder = Path(name)
        files = {**mill.files(texts[0], folder, seconds), "actions": actions(rng, rounds)}
        files |= {f"job{k}.ngc": text for k, text in enumerate(texts)}
        (folder / "mill.ini").write_text(files["mill.ini"], encoding="utf-8")
        children = [stack.enter_context(planned_by_us(folder))]
        over = threading.Event()
        seen: list[dict[str, int]] = []  # a planner has the number of its start in its name
        begun = time.monotonic()

        def watch() -> None:
            looked = begun
            while not over.wait(0.05):
                if time.monotonic() - looked > LOOKS:
                    looked = time.monotonic()
                    seen.append(memory_of(folder, children[-1].pid, len(children)))
                    if len(seen) % 30 == 0:
                        print(f"after {looked - begun:.0f} s: {seen[-1]}", file=sys.stderr, flush=True)
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
    good = max(worst) <= 1.0 + 1e-6 and lost < 1e-6 and not any("following" in each for each in said)
    text = (
        f"{len(position) * PERIOD:.0f} s, {len(acted)} actions, {len(children) - 1} planners killed, "
        f"{sum('silent' in each for each in told['said'])} times said to be silent, shares of velocity, acceleration, "
        f"jerk {worst[0]:.3f} {worst[1]:.3f} {worst[2]:.3f}, end off by {lost:.1e} mm; memory, MB: {grown(seen)}; "
        f"said: {dict(said)}"
    )
    return text, good


def grown(seen: list[dict[str, int]]) -> str:
    """Memory of each process as it was first, at a quarter of the time it was there, and last."""
    out = []
    for name in sorted({name for each in seen for name in each}):
        values = [each[name] for each in seen if name in each]
        out.append(f"{name} {values[0]}, {values[len(values) // 4]}, {values[-1]}")
    return "; ".join(out)


def main() -> int:
    """One LinuxCNC for so many minutes; 1 where not all was right."""
    minutes, seed = float(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1
    if missing := module_missing():
        raise LinuxcncError(missing)
    text, good = soaked(random.Random(seed), math.ceil(60.0 * minutes / ROUND))
    print(f"seed {seed}: {'' if good else 'NOT RIGHT, '}{text}", flush=True)
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
