"""`splinefeed sweep`: many runs, kept as a dataset; `splinefeed sweep show`: what they came to."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, counted, listed, notes
from splinefeed.errors import InputError

SPEC = """\b
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
#: Runs that the rate is taken from, and at least: the first ones wait for workers that start, and for the compiler.
RECENT, ENOUGH = 100, 10


def _show(page: Page) -> list[Block]:
    numbers = [{"number": name, **each} for name, each in page["numbers"].items()]
    failed = [f"failed    {counted(each['runs'], 'run')}: {each['error']}" for each in page["failures"]]
    best = ", ".join(f"{each['index']} ({each['source']})" for each in page["pareto"][:8])
    return [
        [
            f"{page['name']}: {page['there']} of {page['runs']} runs",
            f"          {page['ok']} ok, {page['not_kept']} with a limit or a check not kept, {page['failed']} failed",
        ],
        [
            *listed(numbers, "number, least, run=least_run, median, most, run=most_run"),
            *failed,
            *([f"front     cycle time against contour error: runs {best}"] if best else []),
            *notes(page["notes"]),
        ],
    ]


@answers(_show, SPEC)
@options.table("""
spec            SPEC.toml | show
folder          [DIR]
-o --output     DIR              Folder of the dataset.  [default: splinefeed-sweep-NAME]
--workers       COUNT            Processes; 0: this one.  [default: all cores]
--dask          ADDRESS          Scheduler of a Dask cluster, tcp://host:port.
--mpi           -                Workers by MPI (mpi4py.futures); start with mpiexec -m mpi4py.futures.
""")
def sweep(say: Say, spec: str, folder: str | None, **given: Any) -> Page:
    """Do every run of SPEC.toml; each becomes a row of one Parquet dataset.

    A run that fails is a row too. A stopped sweep continues when it is called again. `show DIR` prints a summary of
    the runs so far and writes sweep.html beside them.

    Examples:
      splinefeed sweep night.toml
      splinefeed sweep night.toml -o results --workers 8
      splinefeed sweep show results
    """
    from splinefeed.files.atomic import write_text
    from splinefeed.reports import library, sweep_page
    from splinefeed.reports.figure import EXTRA
    from splinefeed.sweeps.store import load, summary

    if (spec == "show") != (folder is not None):
        raise InputError("give one spec, with -o for the folder of its dataset; or show and the folder of a sweep")
    place = Path(folder or _sweep(spec, given, say))
    about, rows = load(place)
    page = {**summary(about, rows), "files": [str(place / "rows")], "notes": []}
    if library.available():
        write_text(place / sweep_page.NAME, sweep_page.page(about, rows, page))
        page["files"].append(str(place / sweep_page.NAME))
    else:
        page["notes"].append(f"no {sweep_page.NAME}: it needs Plotly, {EXTRA}")
    return page


def _sweep(spec: str, given: dict[str, Any], say: Say) -> str:
    """Make the runs that are missing, and name the folder."""
    from splinefeed.reports.files import write_artefacts
    from splinefeed.reports.folder import default_name
    from splinefeed.sweeps import spec as specs
    from splinefeed.sweeps import sweeping
    from splinefeed.sweeps.store import Store

    runs = specs.read(spec)
    folder: str = given["output"] or default_name(f"sweep-{runs.name}")
    writes = partial(write_artefacts, str(Path(folder) / "runs"), runs.setpoints, runs.reports)
    artefacts = writes if runs.setpoints or runs.reports else None
    lately: deque[float] = deque(maxlen=RECENT)
    with Store(folder, runs) as store, _engine(given) as executor:
        rows = sweeping.rows(runs, store, executor, given["workers"], artefacts)
        for there, row in enumerate(rows, int(store.done.sum()) + 1):
            lately.append(time.monotonic())
            words = f"{there} of {len(runs)} runs, the last one {row['status']}"
            if len(lately) >= ENOUGH:
                rate = (len(lately) - 1) / max(lately[-1] - lately[0], 1e-9)
                words += f", {rate:.3g} a second, about {(len(runs) - there) / rate:.0f} s left"
            say(words)
    return folder


@contextmanager
def _engine(given: dict[str, Any]) -> Iterator[Executor | None]:
    """The executor that the options ask for; None for processes on this machine."""
    try:
        if given["dask"]:
            from distributed import Client

            try:
                client = Client(given["dask"], timeout="10s")
            except OSError as error:
                raise InputError(f"--dask: {given['dask']}: no scheduler answers ({error})") from None
            with client:
                yield client.get_executor(pure=False, retries=3)
        elif given["mpi"]:
            from mpi4py.futures import MPIPoolExecutor

            with MPIPoolExecutor() as pool:
                yield pool
        else:
            yield None
    except ImportError as error:
        raise InputError(f"--dask, --mpi: pip install 'splinefeed[dask]' or 'splinefeed[mpi]': {error}") from None
