"""`splinefeed sweep`: many runs, kept as a dataset; `splinefeed sweep show`: what they came to."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli import options
from splinefeed.cli.failures import DONE, NOT_KEPT
from splinefeed.cli.output import counted, number, print_json, print_table, print_text
from splinefeed.cli.progress import Say, busy
from splinefeed.cli.summary import print_notes
from splinefeed.errors import InputError

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from splinefeed.pipeline.run import Run
    from splinefeed.sweeps.spec import Sweep, Task

EXAMPLES = """\b
Examples:
  splinefeed sweep night.toml
  splinefeed sweep night.toml -o results --workers 8
  splinefeed sweep show results

\b
A spec:
  sources = ["parts/*.dxf", "butterfly"]
  [set]
  machine = "xytheta"
  [grid]
  "limits.feed" = [30, 60, "6000mm/min"]
  method = ["taylor-2", "milne-simpson-anchored"]
  [random]
  count = 100
  "machine.x.load.inertia" = { uniform = [0.8, 1.2] }

"""
#: Runs that the rate is taken from: the first ones, which compile, are soon forgotten.
RECENT = 100
#: ... and the fewest that say anything of what is to come.
ENOUGH = 10


@click.command(epilog=EXAMPLES)
@click.argument("spec", metavar="SPEC.toml | show")
@click.argument("folder", required=False, metavar="[DIR]")
@click.option("-o", "--output", metavar="DIR", help="Folder of the dataset.  [default: splinefeed-sweep-NAME]")
@click.option("--workers", type=click.IntRange(0), metavar="N", help="Processes; 0: this one.  [default: all cores]")
@click.option("--dask", metavar="ADDRESS", help="Scheduler of a Dask cluster, tcp://host:port.")
@click.option("--mpi", is_flag=True, help="Workers by MPI (mpi4py.futures); start with mpiexec -m mpi4py.futures.")
@options.as_json
@click.pass_context
def command(ctx: click.Context, /, spec: str, folder: str | None, as_json: bool, **given: Any) -> None:
    """Do every run of SPEC.toml; each becomes a row of one Parquet dataset.

    A run that fails is a row too. A stopped sweep continues when it is called again. `show DIR` prints a summary of
    the runs so far and writes sweep.html beside them.
    """
    if spec != "show":
        if folder is not None:
            raise InputError(f"{folder}: one spec at a time; name the folder of the dataset with -o")
        folder = _sweep(spec, given)
    elif folder is None:
        raise InputError("show: name the folder of a sweep, such as splinefeed sweep show splinefeed-sweep-night")
    page = _show(folder)
    if as_json:
        print_json(page)
    else:
        _print(page)
    ctx.exit(DONE if page["failed"] == page["not_kept"] == 0 and page["there"] == page["runs"] else NOT_KEPT)


def _sweep(spec: str, given: dict[str, Any]) -> str:
    """Make the runs that are missing, and name the folder."""
    from splinefeed.report.folder import default_name
    from splinefeed.sweeps import spec as specs
    from splinefeed.sweeps.sweeping import timed

    runs = specs.read(spec)
    folder: str = given["output"] or default_name(f"sweep-{runs.name}")
    with _engine(given) as executor, busy() as say:
        progress, artefacts = _Progress(len(runs), say), _artefacts(runs, folder)
        rows = timed(runs, executor, folder=folder, workers=given["workers"], artefacts=artefacts, start=progress.start)
        for row, _ in rows:
            progress.step(row["status"])
    return folder


@contextmanager
def _engine(given: dict[str, Any]) -> Iterator[Executor | None]:
    """The executor that the options ask for; None for processes on this machine."""
    if given["dask"]:
        try:
            from distributed import Client
        except ImportError:
            raise InputError("--dask needs Dask: pip install 'splinefeed[dask]'") from None
        try:
            with Client(given["dask"], timeout="10s") as client:
                yield client.get_executor(pure=False, retries=3)
        except OSError as error:
            raise InputError(f"--dask: {given['dask']}: no scheduler answers ({error})") from None
    elif given["mpi"]:
        try:
            from mpi4py.futures import MPIPoolExecutor
        except ImportError:
            raise InputError("--mpi needs mpi4py: pip install mpi4py") from None
        with MPIPoolExecutor() as pool:
            yield pool
    else:
        yield None


def _artefacts(runs: Sweep, folder: str) -> Callable[[Task, Run], None] | None:
    """What also writes setpoints and reports, if the spec says so."""
    if not (runs.setpoints or runs.reports):
        return None
    from functools import partial
    from pathlib import Path

    from splinefeed.report.files import write_artefacts

    return partial(write_artefacts, str(Path(folder) / "runs"), runs.setpoints, runs.reports)


class _Progress:
    """Says how many runs there are by now, how fast they come, and how long the rest will take."""

    def __init__(self, total: int, say: Say) -> None:
        self._total, self._say = total, say
        self._there = self._made = self._failed = 0
        self._lately: deque[float] = deque(maxlen=RECENT)

    def start(self, count: int) -> None:
        """So many runs are there already."""
        self._there = count
        self._lately.append(time.monotonic())

    def step(self, status: str) -> None:
        """One more has come."""
        self._there, self._made, self._failed = self._there + 1, self._made + 1, self._failed + (status == "failed")
        self._lately.append(time.monotonic())
        rate = (len(self._lately) - 1) / max(self._lately[-1] - self._lately[0], 1e-9)
        words = f"{self._there} of {self._total} runs"
        words += f", {self._failed} failed" if self._failed else ""
        if self._made >= ENOUGH:  # the first ones wait for workers that start, and for the compiler
            words += f", {rate:.3g} a second, about {(self._total - self._there) / rate:.0f} s left"
        self._say(words)


def _show(folder: str) -> dict[str, Any]:
    """The summary of the runs in a folder; sweep.html is written beside them, or a note says what that needs."""
    from pathlib import Path

    from splinefeed.report import library, sweep_page
    from splinefeed.report.figure import EXTRA
    from splinefeed.report.files import write_report
    from splinefeed.sweeps.store import load
    from splinefeed.sweeps.summary import summary

    about, rows = load(folder)
    page = summary(about, rows)
    page["files"] = [str(Path(folder) / "rows")]
    page["notes"] = [] if library.available() else [f"no {sweep_page.NAME}: it needs Plotly, {EXTRA}"]
    if library.available():
        target = Path(folder) / sweep_page.NAME
        write_report(sweep_page.page(about, rows, page), target)
        page["files"].append(str(target))
    return page


def _print(page: dict[str, Any]) -> None:
    print_text(f"{page['name']}: {page['there']} of {page['runs']} runs")
    print_text(
        f"          {page['ok']} ok, {page['not_kept']} with a limit or a check not kept, {page['failed']} failed"
    )
    print_text()
    rows = [
        [name, number(each["least"], 6), f"run {each['least_run']}", number(each["median"], 6), number(each["most"], 6),
         f"run {each['most_run']}"]
        for name, each in page["numbers"].items()
    ]  # fmt: skip
    print_table(["", "least", "", "median", "most", ""], rows)
    for each in page["failures"]:
        print_text(f"failed    {counted(each['runs'], 'run')}: {each['error']}")
    if page["pareto"]:
        best = ", ".join(f"{each['index']} ({each['source']})" for each in page["pareto"][:8])
        print_text(f"front     cycle time against contour error: runs {best}")
    print_notes(page["notes"])
    print_text()
    print_text(f"wrote {' '.join(page['files'])}")
