"""The torture: very many random cases of every kind within a time, on all cores, and one table of how they went.

    python tests/torture.py --minutes 60 --seed 1000000

Each kind of case has a share of the time; what it leaves over goes to the next ones. A case fails by any error but
ours, by a finding of the check that shares no code with what made it, or by more than MOST_SECONDS of processor time,
also when it is run once more.
Exit code 1 and the seeds of what failed if anything did; one of them again:

    python tests/torture.py --only chains --seed SEED --count 1
"""

from __future__ import annotations

import argparse
import math
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from random_motions import Motion

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT)]

from benchmarks.tables import Cell, Column, Table, write_into  # noqa: E402 - found from here only

#: Processor time that one case may take, s, and how long nothing at all may be heard of any.
MOST_SECONDS, MOST_SILENCE = 60.0, 900.0
#: Memory that a worker may have, bytes: a case that asks for more fails, and the others go on.
MOST_MEMORY = 6 << 30
#: Longer motions are planned, and not interpolated.
MOST_TICKS = 1e6
PAGE = ROOT / "docs" / "tests.md"
#: Failures that are told in words.
MOST_TOLD = 20
PROFILES_A_CASE, INPUTS_A_CASE, KILLS_A_CASE = 1000, 2000, 20
READERS = (
    "gcode", "dxf", "svg", "json", "csv", "airfoil", "step", "iges", "3dm", "npz", "h5", "mat", "parquet", "points",
    "limits", "machine", "sweep", "tools", "log", "positions", "urdf",
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What came of one case: "ok" or another word, the largest share of a limit and ripple of the feed."""

    word: str = "ok"
    share: float = math.nan
    ripple: float = math.nan
    seconds: float = 0.0  # of another process


def profiles(seed: int) -> Outcome:
    """Seven phases alone: ends, lengths and limits by sums in extended precision."""
    from planner.test_profiles import check_motion, drawn

    check_motion(*drawn(seed, (2, 9)[seed % 2], PROFILES_A_CASE))
    return Outcome()


def chains(seed: int) -> Outcome:
    """Curve, limits, plan, setpoints, check: three of five by seven phases, one of twenty time-optimal."""
    import random_motions

    turn = seed % 20
    strategy = "time-optimal" if turn == 0 else "look-ahead" if turn < 8 else "seven-phase"
    return judged(lambda: random_motions.motion(seed, (strategy,)))


def corners(seed: int) -> Outcome:
    """The same, time-optimal, with corners in passing and ends in motion."""
    import random_motions

    return judged(lambda: random_motions.passing(seed))


def judged(draw: Callable[[], Motion]) -> Outcome:
    """Plan, interpolate and check a motion."""
    import splinefeed as sf
    from planner.test_torture import REFUSALS
    from splinefeed.errors import CurveError, LimitsError, PlanError

    try:
        motion = draw()
        law = sf.plan(motion.path, motion.limits, strategy=motion.strategy, period=motion.period)
    except (CurveError, LimitsError, PlanError) as error:
        assert any(reason in str(error) for reason in REFUSALS), str(error)
        return Outcome("refused")
    if law.duration > MOST_TICKS * motion.period:
        return Outcome("long")
    verdict = sf.check(sf.interpolate(motion.path, law), motion.path, motion.limits, law=law)
    assert verdict.ok, (motion.strategy, verdict.problems)
    share = max((limit.share for limit in verdict.limits.values()), default=math.nan)
    return Outcome("ok", share, verdict.numbers["ripple_max"])


def tools(seed: int) -> Outcome:
    """Five-axis paths on four machines: limits by differences of joints, the tip on its curve, refusals proved."""
    import random_tools

    came, share = random_tools.check_motion(seed)
    return Outcome(came, share)


def override(seed: int) -> Outcome:
    """What an operator does to the feed, on plans of three strategies."""
    from planner.test_override import CASES, assert_kept

    return Outcome(share=assert_kept(list(CASES)[seed % len(CASES)], seed))


def servo(seed: int) -> Outcome:
    """A machine follows, or stops with a reason."""
    from simulation.test_many_machines import check

    return Outcome("ok" if check(seed) == "followed" else "stopped")


def smoothing(seed: int) -> Outcome:
    """Lines, arcs and mixtures smoothed, proved by other means."""
    from paths.test_smoothing import check_one

    check_one(seed)
    return Outcome()


def readers(seed: int) -> Outcome:
    """Changed files, in a process with little memory, by turns for every reader."""
    words = [str(ROOT / "tests" / "fuzzing.py"), READERS[seed % len(READERS)], str(seed), str(INPUTS_A_CASE)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-500:]
    found = re.search(r"the slowest ([\d.]+) s", done.stdout)
    return Outcome(seconds=float(found[1]) if found else math.nan)


def kills(seed: int) -> Outcome:
    """Sweeps killed with kill -9 at random moments, and taken up again."""
    words = [str(ROOT / "tests" / "sweeps" / "kills.py"), str(seed), str(KILLS_A_CASE)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-500:]
    return Outcome()


def folders(seed: int) -> Outcome:
    """Runs into one folder killed with kill -9 at random moments; what is left is whole, or a report says that not."""
    words = [str(ROOT / "tests" / "folder_kills.py"), str(seed), str(KILLS_A_CASE)]
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-500:]
    return Outcome()


@dataclass(frozen=True)
class Family:
    """A kind of case: how many by default, how many at a time, its share of the time."""

    case: Callable[[int], Outcome]
    title: str
    count: int
    share: float
    batch: int = 20
    each: int = 1

    @property
    def name(self) -> str:
        """As on the command line."""
        return self.case.__name__


FAMILIES = (
    Family(profiles, "seven-phase profiles alone", 1000, 0.04, each=PROFILES_A_CASE),
    Family(servo, "machines that follow", 10_000, 0.05),
    Family(override, "override scripts", 1500, 0.06),
    Family(smoothing, "short lines smoothed", 10_000, 0.08),
    Family(readers, "files read, changed", 50 * len(READERS), 0.2, batch=1, each=INPUTS_A_CASE),
    Family(kills, "sweeps killed and taken up again", 100, 0.04, batch=1, each=KILLS_A_CASE),
    Family(folders, "runs killed while they write their folder", 25, 0.03, batch=1, each=KILLS_A_CASE),
    Family(tools, "five-axis paths", 2000, 0.1, batch=4),
    Family(corners, "motions that pass corners", 2000, 0.12, batch=4),
    Family(chains, "curve, limits, plan, setpoints, check", 100_000, 0.35),
)


@dataclass
class Tally:
    """What came of the cases of a family so far."""

    done: int = 0
    words: dict[str, int] = field(default_factory=dict)
    failed: list[tuple[int, str]] = field(default_factory=list)
    share: float = math.nan
    ripple: float = math.nan
    slowest: float = 0.0

    @property
    def refused(self) -> dict[str, int]:
        """How many were refused or stopped, by cause."""
        return {word: count for word, count in self.words.items() if word != "ok"}

    def add(self, other: Tally) -> None:
        """Those of another, too."""
        self.done += other.done
        for word, count in other.words.items():
            self.words[word] = self.words.get(word, 0) + count
        self.failed += other.failed
        self.share = _largest(self.share, other.share)
        self.ripple = _largest(self.ripple, other.ripple)
        self.slowest = max(self.slowest, other.slowest)


def _largest(a: float, b: float) -> float:
    return b if math.isnan(a) else a if math.isnan(b) else max(a, b)


def batch(case: Callable[[int], Outcome], first: int, count: int) -> Tally:
    """Cases of neighbouring seeds, one after another; done in a worker."""
    tally = Tally()
    for seed in range(first, first + count):
        begin = time.process_time()
        try:
            came = case(seed)
            if time.process_time() - begin > MOST_SECONDS:  # kernels were compiled, perhaps: once more without
                begin = time.process_time()
                came = case(seed)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # a failure in pytest's own words is no Exception
            where = " < ".join(f"{f.name}:{f.lineno}" for f in traceback.extract_tb(error.__traceback__)[:-9:-1])
            tally.failed.append((seed, f"{type(error).__name__}: {error}"[:300].replace("\n", " ") + f" in {where}"))
        else:
            tally.add(Tally(words={came.word: 1}, share=came.share, ripple=came.ripple))
            tally.slowest = max(tally.slowest, came.seconds)
        took = time.process_time() - begin
        if took > MOST_SECONDS:
            tally.failed.append((seed, f"it took {took:.0f} s, more than {MOST_SECONDS:.0f}"))
        tally.slowest = max(tally.slowest, took)
        tally.done += 1
    return tally


def run(family: Family, first: int, count: int, until: float, workers: int, say: Callable[[str], None]) -> Tally:
    """As many cases as the time allows, from seed `first`."""
    tally, told = Tally(), 0.0
    tasks = ((seed, min(family.batch, first + count - seed)) for seed in range(first, first + count, family.batch))
    pool = ProcessPoolExecutor(
        workers, get_context("spawn"), resource.setrlimit, (resource.RLIMIT_AS, [MOST_MEMORY] * 2)
    )
    waiting: dict[Future[Tally], int] = {}
    try:
        for done in _flowing(pool, family, tasks, until, workers, waiting):
            tally.add(done)
            for seed, why in done.failed:
                say(f"failed: {family.name}, seed {seed}: {why}")
            if time.monotonic() > told + 10.0:
                told = time.monotonic()
                say(f"{family.title}: {tally.done * family.each:,} done, {len(tally.failed)} failed")
        pool.shutdown()
    except TimeoutError:
        tally.failed += [(seed, f"nothing heard for {MOST_SILENCE:.0f} s") for seed in waiting.values()]
        for process in list(pool._processes.values()):
            process.kill()
    return tally


def _flowing(
    pool: ProcessPoolExecutor, family: Family, tasks: Iterator[tuple[int, int]], until: float, workers: int,
    waiting: dict[Future[Tally], int],
) -> Iterator[Tally]:  # fmt: skip
    """Results as they come, a few tasks under way, until the tasks or the time end."""
    more = True
    while more or waiting:
        while more and len(waiting) < 2 * workers:
            task = next(tasks, None) if time.monotonic() < until else None
            more = task is not None
            if task is not None:
                waiting[pool.submit(batch, family.case, *task)] = task[0]
        if not waiting:
            return
        ready, _ = wait(waiting, MOST_SILENCE, FIRST_COMPLETED)
        if not ready:
            raise TimeoutError
        for each in ready:
            del waiting[each]
            yield each.result()


COLUMNS = (
    Column("cases"), Column("planned", ",d"), Column("done", ",d"), Column("refused or stopped", ",d"),
    Column("failed", ",d"), Column("largest share of a limit", ".10f"), Column("largest ripple", ".1e"),
    Column("slowest, s", ".1f"), Column("from seed", "d"), Column("at"),
)  # fmt: skip


def table(rows: list[tuple[Family, int, Tally]], seed: int, code: str, before: str = "") -> Table:
    """What is printed, and below it the seeds that failed; kinds that did not run keep the row they have in `before`.

    code  what was tried, a commit
    """
    old = dict(re.findall(r"^\| (.+?) +\| (.+) \|$", before, re.MULTILINE))
    told = dict(re.findall(r"^Failed of (.+?): (.+)\.$", before, re.MULTILINE))
    new = {family: (asked, tally) for family, asked, tally in rows}
    lines: list[tuple[Cell, ...]] = []
    notes: list[str] = []
    for family in FAMILIES if before else new:
        if family in new:
            asked, tally = new[family]
            lines.append(
                (
                    family.title, asked * family.each, tally.done * family.each, sum(tally.refused.values()),
                    len(tally.failed), None if math.isnan(tally.share) else tally.share,
                    None if math.isnan(tally.ripple) else tally.ripple, tally.slowest, seed, code,
                )
            )  # fmt: skip
            seeds = ", ".join(str(each) for each, _ in tally.failed)
        elif family.title in old:
            lines.append((family.title, *(cell.strip() for cell in old[family.title].split("|"))))
            seeds = told.get(family.title, "")
        else:
            continue
        if seeds:
            notes.append(f"Failed of {family.title}: {seeds}.")
    caption = "Random cases; each row says from which seed and at which commit. Failures are listed below."
    return Table(caption, COLUMNS, tuple(lines), tuple(notes))


def tried() -> str:
    """The commit that is tried, "-dirty" if other files than PAGE differ from it; a dash without a repository."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", f":!{PAGE.relative_to(ROOT)}")
    return (git("describe", "--always") + ("-dirty" if changed else "")) or "-"


def main(words: list[str] | None = None) -> int:
    """Run as a program: see above."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60.0, help="for all together (60)")
    parser.add_argument("--seed", type=int, default=1_000_000, help="the first of each kind (1000000)")
    parser.add_argument("--count", type=int, help="of each kind, instead of the default")
    parser.add_argument("--only", choices=[family.name for family in FAMILIES], action="append", help="these kinds")
    parser.add_argument("--write", action="store_true", help="put these rows into docs/tests.md, too")
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)), help="processes (all cores)")
    given = parser.parse_args(words)
    chosen = [family for family in FAMILIES if not given.only or family.name in given.only]
    code = tried()
    begin = time.monotonic()
    end = begin + 60.0 * given.minutes
    rows: list[tuple[Family, int, Tally]] = []

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    # what readers are given is kept in a folder that goes away
    with tempfile.TemporaryDirectory() as folder:
        os.environ["TMPDIR"] = folder
        for k, family in enumerate(chosen):
            part = family.share / sum(each.share for each in chosen[k:])
            until = time.monotonic() + part * max(end - time.monotonic(), 0.0)
            count = given.count or family.count
            rows.append((family, count, run(family, given.seed, count, until, given.workers, say)))
    failed = [(family.name, *each) for family, _, tally in rows for each in tally.failed]
    print(table(rows, given.seed, code).markdown())
    for family, _, tally in rows:
        if tally.refused:
            causes = ", ".join(f"{word} {count}" for word, count in sorted(tally.refused.items()))
            print(f"Refused or stopped of {family.title}: {causes}")
    print(f"{(time.monotonic() - begin) / 60.0:.0f} min")
    if given.write:
        whole = table(rows, given.seed, code, PAGE.read_text(encoding="utf-8"))
        assert write_into(PAGE, "torture", whole.markdown()), f"{PAGE} has no place for it"
    for name, seed, why in failed[:MOST_TOLD]:
        print(f"failed: {name}, seed {seed}: {why}")
    return 1 if failed or any(tally.done == 0 for _, _, tally in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
