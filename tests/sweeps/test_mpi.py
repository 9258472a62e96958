"""A sweep over MPI: one process hands out the runs, the others make them, and the rows are those of any engine."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

import splinefeed as sf

SPEC = """
name = "mpi"
sources = ["circle?radius=1", "line?length=3"]
seed = 4
[set]
"limits.acceleration" = 400
"limits.jerk" = 20000
[random]
count = 6
"limits.feed" = { uniform = [10, 20] }
"""
#: More processes than cores, and started by root, as continuous integration does: Open MPI asks for each of these.
ALLOWED = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
}


@pytest.fixture
def mpiexec() -> str:
    pytest.importorskip("mpi4py", reason="mpi4py is not installed: pip install 'splinefeed[mpi]'")
    found = shutil.which("mpiexec")
    if found is None:
        pytest.skip("no mpiexec: install an MPI library, on Debian apt-get install openmpi-bin")
    return found


@pytest.mark.slow
def test_three_processes_of_mpi_give_the_rows_of_one(mpiexec, tmp_path):
    (tmp_path / "mpi.toml").write_text(SPEC)
    rows = list(sf.sweep(tmp_path / "mpi.toml", workers=0, folder=tmp_path / "one"))
    command = [mpiexec, "-n", "3", sys.executable, "-m", "mpi4py.futures", "-m", "splinefeed", "sweep", "mpi.toml"]
    spread = subprocess.run(
        [*command, "--mpi", "-o", "three"],
        cwd=tmp_path, env={**os.environ, **ALLOWED}, capture_output=True, text=True, timeout=200,
    )  # fmt: skip
    assert spread.returncode == int(any(row["status"] != "ok" for row in rows)), spread.stderr
    part = "rows/part-000000.parquet"
    assert (tmp_path / "three" / part).read_bytes() == (tmp_path / "one" / part).read_bytes()
    assert spread.stdout.count("12 of 12 runs") == 1  # the workers say nothing
