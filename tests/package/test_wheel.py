"""Wheel and sdist: the same bytes twice, everything in them that is needed, and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import splinefeed as sf
from docs_pages import ROOT

pytestmark = pytest.mark.slow
build = pytest.importorskip("build")
pytest.importorskip("hatchling", reason="hatchling is not installed: pip install splinefeed[slow]")

#: 2020-01-01, for every build.
EPOCH = "1577836800"


def build_in(folder: Path, what: str = "--wheel") -> Path:
    """The one file that a build of the repository leaves in `folder`, made without a network."""
    words = [sys.executable, "-m", "build", "--no-isolation", what, "--outdir", folder, ROOT]
    made = subprocess.run(
        words, env={**os.environ, "SOURCE_DATE_EPOCH": EPOCH}, capture_output=True, text=True, timeout=200
    )
    assert made.returncode == 0, made.stderr + made.stdout
    (file,) = folder.iterdir()
    return file


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    return build_in(tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def sdist(tmp_path_factory) -> Path:
    return build_in(tmp_path_factory.mktemp("sdist"), "--sdist")


def test_a_wheel_is_the_same_bytes_twice(wheel, tmp_path):
    assert build_in(tmp_path).read_bytes() == wheel.read_bytes()


def test_an_sdist_is_the_same_bytes_twice(sdist, tmp_path):
    assert build_in(tmp_path, "--sdist").read_bytes() == sdist.read_bytes()


def test_the_wheel_holds_the_package_whole_and_no_more(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    package = {
        file.relative_to(ROOT / "src").as_posix()
        for file in (ROOT / "src/splinefeed").rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    inside = {name for name in names if name.startswith("splinefeed/")}
    assert inside == package
    assert {"splinefeed/py.typed", "splinefeed/data/butterfly.json", "splinefeed/machines/xytheta.toml"} <= inside
    rest = {name.partition("/")[2] for name in names - inside}
    assert rest == {"METADATA", "RECORD", "WHEEL", "entry_points.txt", "licenses/LICENSE"}


def test_the_wheel_says_what_it_is(wheel):
    (metadata,) = (name for name in zipfile.ZipFile(wheel).namelist() if name.endswith("/METADATA"))
    text = zipfile.ZipFile(wheel).read(metadata).decode()
    for line in (f"Version: {sf.__version__}", "License-Expression: MIT", "Requires-Python: >=3.11"):
        assert f"\n{line}\n" in text
    for extra in ("cad", "studio", "dask", "all", "parquet", "report", "mpi"):
        assert f"\nProvides-Extra: {extra}\n" in text


def test_the_sdist_can_be_tested_and_has_no_litter(sdist):
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    for wanted in ("pyproject.toml", "LICENSE", "SECURITY.md", "CITATION.cff", "docs/index.md", "tests/conftest.py"):
        assert wanted in names
    assert not [name for name in names if "__pycache__" in name or name.startswith((".venv", "build/"))]
