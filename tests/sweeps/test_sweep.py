"""Sweeps on every engine: equal to the serial one, on after a kill, and never a broken dataset."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import FormatError, InputError
from splinefeed.formats import rows_parquet
from splinefeed.sweeps import store as stores
from splinefeed.sweeps.spec import from_dict
from splinefeed.sweeps.store import Store, columns_of, load, pareto, summary
from splinefeed.sweeps.sweeping import TRIES, EngineError
from splinefeed.sweeps.work import COLUMNS, row_of

SPEC = {
    "sources": ["circle?radius=1", "line?length=3"],
    "seed": 2,
    "set": {"machine": "xytheta", "limits": {"acceleration": 400, "jerk": 2e4}},
    "grid": {"limits.feed": [10, 20], "method": ["arc-length", "taylor-2"]},
    "random": {"count": 3, "machine.x.load.inertia": {"uniform": [0.9, 1.1]}},
}


@pytest.fixture(scope="module")
def serial():
    return list(sf.sweep(SPEC, workers=0))


def by_index(rows):
    return sorted(rows, key=lambda row: row["index"])


def test_rows_say_what_a_run_says(serial):
    assert len(serial) == 24
    assert [row["index"] for row in serial] == list(range(24))
    assert set(serial[0]) == {"index", "source", "limits.feed", "limits.acceleration", "limits.jerk", "machine",
                              "machine.x.load.inertia", *COLUMNS}  # fmt: skip
    row = serial[3]  # taylor-2 on the circle at 10 mm/s
    path = sf.shapes.circle(radius=1)
    of_machine = sf.Machine.load("xytheta").limits(path.axes)
    limits = sf.Limits(feed=10, acceleration=400, jerk=2e4, **of_machine)
    run = sf.run(path, limits, strategy="time-optimal", method="taylor-2")
    assert row["duration_s"] == run.law.duration
    assert row["ripple_max"] == run.ripple.max
    assert row["status"] == ("ok" if run.ok else "not kept")
    errors = [row["contour_error_max_mm"] for row in serial if row["source"].startswith("circle")]
    assert len(set(errors)) > 3  # the machines differ
    assert all(0.0 < error < 1.0 for error in errors)


def test_a_failure_is_a_row_and_no_stop(tmp_path):
    (tmp_path / "broken.json").write_text('{"degree": 3}')
    spec = from_dict({"sources": ["broken.json", "circle"], "grid": {"limits.jerk": [1e3, 1e4]}}, folder=tmp_path)
    rows = list(sf.sweep(spec, workers=0))
    assert [row["status"] for row in rows] == ["failed", "failed", "ok", "ok"]
    assert rows[0]["error_kind"] == "FormatError"
    assert "broken.json" in rows[0]["error"]


def test_processes_threads_and_this_process_agree_to_the_bit(serial, tmp_path):
    assert by_index(sf.sweep(SPEC, workers=2, folder=tmp_path / "two")) == serial
    with ThreadPoolExecutor(2) as pool:
        assert by_index(sf.sweep(SPEC, pool)) == serial
        assert pool.submit(int, "1").result() == 1  # it is ours to close, not the sweep's
    list(sf.sweep(SPEC, workers=0, folder=tmp_path / "one"))
    part = "rows/part-000000.parquet"
    assert (tmp_path / "one" / part).read_bytes() == (tmp_path / "two" / part).read_bytes()


@pytest.mark.parametrize(
    ("rows", "text", "why"),
    [(1001, "a", "has 1001 rows; at most 1000 stand in one file"), (1000, "a" * 70_000, "unpacks to more than 64 MB")],
)
def test_a_part_of_a_stranger_that_unfolds_is_refused(tmp_path, rows, text, why):
    file = tmp_path / "part-000000.parquet"
    rows_parquet.write([{"index": k, "source": text} for k in range(rows)], {"index": "whole", "source": "text"}, file)
    assert file.stat().st_size < 200_000
    with pytest.raises(FormatError, match=f"{file.name}: {why}"):
        rows_parquet.read(file, 1000)


@pytest.mark.slow
def test_a_dask_cluster_that_loses_a_worker_gives_the_same(serial, tmp_path):
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        rows = []
        killed = False
        for row in sf.sweep(SPEC, client.get_executor(pure=False, retries=3), workers=2, folder=tmp_path / "dask"):
            rows.append(row)
            if not killed:
                killed = True
                worker = next(iter(cluster.workers.values()))
                os.kill(worker.pid, signal.SIGKILL)
        assert by_index(rows) == serial
    _, whole = load(tmp_path / "dask")
    assert whole["duration_s"] == [row["duration_s"] for row in serial]


SCRIPT = """
import json, sys
import splinefeed as sf
for row in sf.sweep(json.loads(sys.argv[1]), workers=0, folder=sys.argv[2]):
    print(row["index"], flush=True)
"""


@pytest.mark.slow
def test_kill_9_at_any_moment_loses_at_most_what_was_in_flight(serial, tmp_path, monkeypatch):
    monkeypatch.setattr(stores, "PART", 5)
    folder = tmp_path / "kept"
    for moment in (2, 7):
        script = f"import splinefeed.sweeps.store as s; s.PART = 5\n{SCRIPT}"
        process = subprocess.Popen(
            [sys.executable, "-c", script, json.dumps(SPEC), str(folder)], stdout=subprocess.PIPE, text=True
        )
        for _ in range(moment):
            assert process.stdout.readline()
        process.kill()
        process.wait()
        process.stdout.close()
    _, whole = load(folder)
    assert len(whole["index"]) >= 9
    rest = list(sf.sweep(SPEC, workers=0, folder=folder))
    assert len(rest) <= 24 - 9
    _, whole = load(folder)
    assert sorted(whole["index"]) == list(range(24))
    clean = tmp_path / "clean"
    list(sf.sweep(SPEC, workers=0, folder=clean))
    names = sorted(each.name for each in (clean / "rows").iterdir())
    assert names == [f"part-{k:06d}.parquet" for k in range(5)]
    for name in names:
        assert (folder / "rows" / name).read_bytes() == (clean / "rows" / name).read_bytes()


ORPHANS = """
import os, time
from splinefeed.sweeps.sweeping import processes
if __name__ == "__main__":
    print(processes(1).submit(os.getpid).result(), flush=True)
    time.sleep(600)
"""


def runs(process: int) -> bool:
    """Whether a process is there, and not one that is gone and nobody has asked how."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    about = Path(f"/proc/{process}/stat")
    with suppress(OSError):
        return about.read_text().rpartition(")")[2].split()[0] != "Z"
    return not about.parent.parent.exists()


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs kill -9")
def test_workers_end_with_the_process_that_started_them(tmp_path):
    (tmp_path / "one.py").write_text(ORPHANS)
    with subprocess.Popen([sys.executable, tmp_path / "one.py"], stdout=subprocess.PIPE, text=True) as process:
        worker = int(process.stdout.readline())
        process.kill()
    end = time.monotonic() + 120.0
    while runs(worker):
        assert time.monotonic() < end
        time.sleep(0.05)


def test_a_folder_is_for_one_sweep_and_one_process(tmp_path):
    spec = from_dict(SPEC)
    with Store(tmp_path / "it", spec), pytest.raises(InputError, match="another sweep is at work"):
        Store(tmp_path / "it", spec).__enter__()
    other = from_dict({**SPEC, "seed": 3})
    with pytest.raises(InputError, match="holds another sweep"):
        Store(tmp_path / "it", other).__enter__()
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/letter.txt").write_text("")
    with pytest.raises(InputError, match=r"is not a folder of a sweep: it holds letter\.txt"):
        Store(tmp_path / "mine", spec).__enter__()


def test_a_torn_journal_is_read_up_to_the_tear(tmp_path, serial):
    spec = from_dict(SPEC)
    with Store(tmp_path, spec) as store:
        for row in serial[:4]:
            store.add(row)
    journal = tmp_path / "rows" / "part-000000.jsonl"
    journal.write_bytes(journal.read_bytes() + b'{"index": 5, "sour')
    with Store(tmp_path, spec) as store:
        assert np.flatnonzero(store.done).tolist() == [0, 1, 2, 3]
        store.add(serial[5])
    assert sorted(load(tmp_path)[1]["index"]) == [0, 1, 2, 3, 5]


class Breaking(Executor):
    """An executor that loses its workers whenever one task is in the batch, and otherwise does the work at once."""

    def __init__(self, killer: int | None) -> None:
        self.killer = killer

    def submit(self, fn, /, *args, **kwargs):
        from concurrent.futures.process import BrokenProcessPool

        future: Future = Future()
        if self.killer is None or any(task.index == self.killer for task in args[0]):
            future.set_exception(BrokenProcessPool("a worker died"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


@pytest.mark.slow
def test_a_run_that_kills_its_worker_is_given_up_and_the_rest_is_done(serial):
    rows = by_index(sf.sweep(SPEC, lambda: Breaking(7), workers=2))
    assert len(rows) == 24
    assert rows[7]["error"] == f"the worker was lost {TRIES} times at this run"
    assert [row for row in rows if row["index"] != 7] == [row for row in serial if row["index"] != 7]


def test_workers_that_never_live_end_the_sweep():
    with pytest.raises(EngineError, match="workers were lost"):
        list(sf.sweep({**SPEC, "random": {}}, Breaking(None), workers=2))


def test_runs_are_made_when_asked_for():
    """A million runs are not a million futures."""

    class Counting(ThreadPoolExecutor):
        flying = most = 0

        def submit(self, fn, /, *args, **kwargs):
            self.flying += 1
            self.most = max(self.most, self.flying)
            future = super().submit(fn, *args, **kwargs)
            future.add_done_callback(lambda _: setattr(self, "flying", self.flying - 1))
            return future

    spec = from_dict(
        {"sources": ["line?length=0.01"], "random": {"count": 1_000_000, "limits.feed": {"uniform": [5, 9]}}}
    )
    assert len(spec) == 1_000_000
    with Counting(2) as pool:
        began = time.monotonic()
        rows = sf.sweep(spec, pool)
        for _, row in zip(range(50), rows, strict=False):
            assert row["status"] in ("ok", "not kept", "failed")
        rows.close()
        assert pool.most <= 6
        assert time.monotonic() - began < 60.0


def test_summary_and_front(serial):
    spec = from_dict(SPEC)
    columns = columns_of(spec)
    whole = {name: [row.get(name) for row in serial] for name in columns}
    told = summary({"name": "it", "runs": 24, "varied": list(spec.varied)}, whole)
    assert told["ok"] + told["not_kept"] == 24
    assert told["numbers"]["duration_s"]["least"] == min(row["duration_s"] for row in serial)
    front = pareto(whole)
    kept = [r for r in serial if r["status"] == "ok"]
    assert 0 < len(kept) < len(serial)
    assert min(r["duration_s"] for r in kept) == whole["duration_s"][front[0]]
    for k in front:
        assert whole["status"][k] == "ok"
        time_, error = whole["duration_s"][k], whole["contour_error_max_mm"][k]
        assert not [r for r in kept if r["duration_s"] <= time_ and r["contour_error_max_mm"] < error]


def test_five_axis_runs_in_the_joints_of_a_machine(data_dir):
    flank = str(data_dir / "five-axis" / "flank_milling_2022.json")
    grid = {"machine": ["trunnion"], "limits.feed": [100.0, 15.0], "limits.orientation_error": [1e-5]}
    spec = from_dict({"sources": [flank], "grid": grid, "set": {"period": 0.005, "strategy": "look-ahead"}})
    fast, slow = row_of(spec.task(0)), row_of(spec.task(1))
    assert (fast["status"], slow["status"], fast["error"]) == ("ok", "ok", None)
    assert fast["duration_s"] < slow["duration_s"]
    assert fast["worst_limit"].startswith(("axis_jerk.", "axis_acceleration.", "orientation_error"))
    alone = row_of(from_dict({"sources": [flank], "grid": {"limits.feed": [100.0]}}).task(0))
    assert "has a tool axis, which only a machine can follow" in alone["error"]


def test_a_part_of_the_machine_that_is_not_there():
    spec = from_dict({"sources": ["circle"], "grid": {"machine": ["xytheta"], "machine.q.load.inertia": [1.1]}})
    assert "machine xytheta has the axes x, y, theta" in row_of(spec.task(0))["error"]
    spec = from_dict({"sources": ["circle"], "grid": {"machine.x.load.inertia": [1.1]}})
    assert "there is none; add machine = NAME" in row_of(spec.task(0))["error"]


def test_what_a_kill_left_half_written_counts_for_nothing_and_odd_lines_run_again(tmp_path, serial):
    with Store(tmp_path, from_dict(SPEC)) as store:
        for row in serial[:3]:
            store.add(row)
    journal = next((tmp_path / "rows").glob("part-*.jsonl"))
    (journal.parent / ".splinefeed-1234.jsonl").write_bytes(journal.read_bytes())
    with journal.open("ab") as stream:
        stream.write(
            b'3\n[]\nnull\n{"index": "0"}\n{"index": 1e99}\n{"index": -1}\n{"index": 999999}\n' + b"[" * 9000 + b"\n"
        )
        stream.write(json.dumps(serial[0]).encode() + b"\n")  # a row that is there already
    _, rows = load(tmp_path)
    assert rows["index"] == [row["index"] for row in sorted(serial[:3], key=lambda row: row["index"])]
    with Store(tmp_path, from_dict(SPEC)) as store:
        assert int(store.done.sum()) == 3
    assert not list(journal.parent.glob(".splinefeed-*"))
