"""A disk that runs full while a command writes: one line, exit code 2, and what was there before stays as it was."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits and file systems as Linux has them")
LIMITS = ["--axis-accel", "500", "--axis-jerk", "20000"]
SWEEP = 'sources = ["line?length=1"]\n[grid]\n"limits.feed" = [10, 20, 30]\n'
#: The words of each command, and what it writes.
COMMANDS = {
    "run": (["run", "circle?radius=9", "--feed", "{feed}", *LIMITS, "-o", "out", "--format", "csv"], "out"),
    "stream": (
        ["stream", "circle?radius=9", "--feed", "{feed}", *LIMITS, "--to", "file", "-o", "rows.txt"],
        "rows.txt",
    ),
    "convert": (["convert", "butterfly", "part.stp"], "part.stp"),
    "sweep": (["sweep", "sweep.toml", "-o", "out", "--workers", "0"], "out"),
}


def contents(place: Path) -> dict[str, bytes]:
    """Every file below a place, whole."""
    files = [place] if place.is_file() else sorted(place.rglob("*"))
    return {str(each): each.read_bytes() for each in files if each.is_file() and each.name != "lock"}


def command(name: str, folder: Path, feed: int, most: int | None = None) -> subprocess.CompletedProcess[str]:
    words = [word.format(feed=feed) for word in COMMANDS[name][0]]
    (folder / "sweep.toml").write_text(SWEEP) if most is None else None
    return subprocess.run(
        [sys.executable, "-B", "-m", "splinefeed", *words], cwd=folder, capture_output=True, text=True, check=False,
        preexec_fn=(lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))) if most else None,
    )  # fmt: skip


def said(done: subprocess.CompletedProcess[str]) -> list[str]:
    """What stands on stderr but for progress."""
    return [line for line in done.stderr.splitlines() if not line.endswith(" s)")]


@pytest.mark.parametrize("name", COMMANDS)
def test_files_that_may_not_grow(tmp_path: Path, name: str) -> None:
    if name != "sweep":  # which goes on from what is there
        assert command(name, tmp_path, 20).returncode in (0, 1)
    before = contents(tmp_path / COMMANDS[name][1])
    (tmp_path / "sweep.toml").write_text(SWEEP)
    done = command(name, tmp_path, 30, most=300)
    assert (done.returncode, len(said(done))) == (2, 1), done.stderr
    assert "the file would be larger than this system allows" in done.stderr
    if name != "sweep":
        assert contents(tmp_path / COMMANDS[name][1]) == before
        return
    assert command(name, tmp_path, 30).returncode in (0, 1)  # taken up again, nothing is lost
    assert (tmp_path / "out" / "sweep.html").is_file()


@pytest.fixture
def small(tmp_path: Path) -> Iterator[Path]:
    """A file system of 20 MB."""
    place = tmp_path / "small"
    place.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=20m", "none", str(place)]
    if os.geteuid() != 0 or subprocess.run(words, capture_output=True, check=False).returncode:
        pytest.skip("only root may mount a small file system")
    yield place
    subprocess.run(["umount", str(place)], check=True)


@pytest.mark.parametrize("name", COMMANDS)
def test_a_small_file_system(small: Path, name: str) -> None:
    assert name == "sweep" or command(name, small, 40).returncode in (0, 1)
    before = contents(small / COMMANDS[name][1])
    (small / "sweep.toml").write_text(SWEEP)
    (small / "fill").touch()
    with (small / "fill").open("wb", buffering=0) as stream, suppress(OSError):
        while True:
            stream.write(b"\0" * 4096)
    done = command(name, small, 50, most=2**30)
    assert (done.returncode, len(said(done))) == (2, 1), done.stderr
    assert "no space is left on the disk; free some or write elsewhere" in done.stderr
    assert name == "sweep" or contents(small / COMMANDS[name][1]) == before
    (small / "fill").unlink()
    assert command(name, small, 50, most=2**30).returncode in (0, 1)
