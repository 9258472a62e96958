"""The wheel in bare environments, one for each Python at hand, and each extra in turn.

Needs a package registry, some minutes and some gigabytes.
"""

from __future__ import annotations

import json
import os
import pwd
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from docs_pages import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

VERSIONS = ("3.11", "3.12", "3.13", "3.14")
REPORT = """
import subprocess, sys
from pathlib import Path
words = "run line --feed 60 --accel 500 --jerk 20000 -o out".split()
subprocess.run([sys.executable, "-m", "splinefeed", *words], check=True)
page = Path("out/report.html").read_text(encoding="utf-8")
assert "Plotly" in page and "every limit holds" in page
"""
PARQUET = """
import splinefeed as sf
points = sf.run(sf.shapes.line()).points
sf.save(points, "a.parquet")
assert len(sf.load("a.parquet")) == len(points)
"""
CAD = """
import splinefeed as sf
sf.write(sf.shapes.butterfly(), "a.step")
assert abs(sf.read("a.step").length - sf.shapes.butterfly().length) < 1e-6
"""
STUDIO = """
import json, subprocess, sys, urllib.request
words = [sys.executable, "-m", "splinefeed", "studio", "--no-browser", "--no-history", "--json"]
with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as studio:
    try:
        told = ""
        while not told.rstrip().endswith("}"):
            line = studio.stdout.readline()
            assert line, told
            told += line
        with urllib.request.urlopen(json.loads(told)["address"], timeout=60) as answer:
            assert b"<html" in answer.read().lower()
    finally:
        studio.terminate()
"""
DASK = """
from distributed import Client
import splinefeed as sf
if __name__ == "__main__":
    with Client(n_workers=1, threads_per_worker=1, dashboard_address=None) as client:
        rows = list(sf.sweep({"name": "a", "sources": ["line"], "grid": {"limits.feed": [30, 60]}},
                             client.get_executor(pure=False)))
    assert [row["status"] for row in rows] == ["ok", "ok"], rows
"""
#: What shows that an extra works, from an empty folder. With `all` every one of these does.
JOBS = {"plots": (REPORT,), "parquet": (PARQUET,), "cad": (CAD,), "studio": (STUDIO,), "dask": (DASK,)}
JOBS["all"] = tuple(job for jobs in JOBS.values() for job in jobs)

#: Extras that are installed with the first of the versions only.
HEAVY = ("cad", "all")


def interpreter(version: str) -> str | None:
    """A Python of that version that starts, on the path or among pyenv's."""
    places = [shutil.which(f"python{version}")]
    pyenv = Path(pwd.getpwuid(os.getuid()).pw_dir, ".pyenv", "versions")  # HOME is the tests' own
    places += [str(place) for place in sorted(pyenv.glob(f"{version}.*/bin/python"))]
    asked = "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"
    for place in filter(None, places):
        answer = subprocess.run([place, "-c", asked], capture_output=True, text=True)
        if answer.returncode == 0 and answer.stdout.strip() == version:
            return place
    return None


def quietly(*words, **options) -> subprocess.CompletedProcess[str]:
    clean = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, env=clean, **options)
    assert done.returncode == 0, f"{words}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
    return done


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    quietly(sys.executable, "-m", "build", "--wheel", "--outdir", folder, ROOT)
    (file,) = folder.glob("*.whl")
    return file


@pytest.fixture(scope="module", params=VERSIONS)
def bare(request, tmp_path_factory, wheel) -> Path:
    """The bin folder of an environment with the wheel and nothing else that was not asked for."""
    python = interpreter(request.param)
    if python is None:
        pytest.skip(f"no Python {request.param} at hand")
    folder = tmp_path_factory.mktemp(f"python{request.param}")
    quietly(python, "-m", "venv", folder / "venv")
    bin_folder = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    quietly(bin_folder / "python", "-m", "pip", "install", "--quiet", wheel)
    installed = quietly(bin_folder / "python", "-m", "pip", "list", "--format", "json").stdout
    (folder / "packages.json").write_text(installed)  # before an extra comes
    return bin_folder


def test_the_main_job_runs_from_an_empty_folder(bare, tmp_path):
    told = json.loads(quietly(bare / "splinefeed", "run", "--json", cwd=tmp_path).stdout)
    assert told["ok"] is True
    assert (tmp_path / "splinefeed-naca0025/setpoints.h5").exists()
    packages = json.loads((bare.parents[1] / "packages.json").read_text())
    assert len({each["name"] for each in packages} - {"pip", "setuptools", "splinefeed"}) <= 25


@pytest.mark.parametrize("extra", JOBS)
def test_each_extra_does_its_job(bare, wheel, extra, tmp_path):
    if extra in HEAVY and not bare.parents[1].name.startswith(f"python{VERSIONS[0]}"):
        pytest.skip("400 MB once is enough")
    quietly(bare / "python", "-m", "pip", "install", "--quiet", f"{wheel}[{extra}]")
    for job in JOBS[extra]:
        (tmp_path / "job.py").write_text(job)
        quietly(bare / "python", "job.py", cwd=tmp_path)
