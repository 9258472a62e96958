"""HDF5 and Parquet are read in a process of its own: whatever becomes of it, this one goes on."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import fuzzing
import splinefeed as sf
from splinefeed.errors import FormatError
from splinefeed.files import native_process
from splinefeed.formats.setpoints import load, load_chunks, save


def points(ticks: int = 500) -> sf.Setpoints:
    t, none = np.arange(ticks) * 1e-3, np.zeros(ticks)
    return sf.Setpoints(
        t=t, curve=none.astype(np.int64), u=none, s=t, feed=none, position=np.column_stack([np.sin(t), t]),
        axes=("x", "y"), period=1e-3, method="test", settings={"nan": None},
    )  # fmt: skip


@pytest.mark.parametrize("suffix", [".h5", ".parquet"])
def test_a_process_that_dies_over_a_file_is_one_line_and_the_next_file_is_read(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"wing{suffix}"
    save(points(), file)
    load(file)
    process = native_process._worker._process
    assert process is not None and process.pid != os.getpid()
    os.kill(process.pid, signal.SIGSTOP)  # so that it dies with the request in hand

    def kill() -> None:
        time.sleep(0.3)
        os.kill(process.pid, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    with pytest.raises(FormatError, match=r"wing.* makes the library that reads it crash"):
        load(file)
    killer.join()
    assert len(load(file)) == 500


def test_columns_are_aligned_and_come_in_chunks(tmp_path: Path) -> None:
    save(points(1001), tmp_path / "wing.h5")
    parts = list(load_chunks(tmp_path / "wing.h5", 400))
    assert [len(part) for part in parts] == [400, 400, 201]
    assert all(getattr(part, name).flags.aligned for part in parts for name in ("t", "curve", "position"))
    assert np.array_equal(np.concatenate([part.t for part in parts]), points(1001).t)


def test_few_bytes_that_say_many_rows_are_not_unpacked(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    save(points(), tmp_path / "wing.parquet")
    schema = parquet.read_schema(tmp_path / "wing.parquet")
    rows = 20_000_000
    kinds = {field.name: np.zeros(rows, "i8" if field.name == "curve" else "f8") for field in schema}
    parquet.write_table(pyarrow.table(kinds, schema=schema), tmp_path / "zeros.parquet", compression="zstd")
    assert (tmp_path / "zeros.parquet").stat().st_size < 2**20
    with pytest.raises(FormatError, match=f"has {rows} rows in far fewer bytes than they pack to; it is damaged"):
        load(tmp_path / "zeros.parquet")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["h5", "mat", "parquet"])
def test_ten_thousand_changed_files_end_in_setpoints_or_in_one_line(tmp_path: Path, kind: str) -> None:
    assert fuzzing.fuzz(kind, 40, 10_000, tmp_path).startswith(f"{kind}: 10000 inputs")
