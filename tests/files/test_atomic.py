"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from splinefeed.errors import FormatError
from splinefeed.files.atomic import atomic_write


def test_the_file_appears_when_the_writing_is_done(tmp_path: Path) -> None:
    target = tmp_path / "wing.csv"
    with atomic_write(target) as temporary:
        temporary.write_text("new")
        assert temporary.parent == tmp_path
        assert not target.exists()
    assert target.read_text() == "new"
    assert os.listdir(tmp_path) == ["wing.csv"]


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, SystemExit, ValueError])
def test_an_interruption_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, interruption: type[BaseException]
) -> None:
    target = tmp_path / "wing.csv"
    target.write_text("old")

    def write_half() -> None:
        with atomic_write(target) as temporary:
            temporary.write_text("half")
            raise interruption

    with pytest.raises(interruption):
        write_half()
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["wing.csv"]


@pytest.mark.parametrize(
    ("number", "reason"),
    [
        (errno.ENOSPC, "no space is left on the disk; free some or write elsewhere"),
        (errno.EACCES, "no permission to write in that folder; choose another one"),
        (errno.EIO, os.strerror(errno.EIO)),
    ],
)
def test_what_the_system_refuses_is_said_in_one_line(tmp_path: Path, number: int, reason: str) -> None:
    target = tmp_path / "wing.csv"

    def fail() -> None:
        with atomic_write(target):
            raise OSError(number, os.strerror(number))

    with pytest.raises(FormatError) as caught:
        fail()
    assert str(caught.value) == f"{target}: cannot be written: {reason}"
    assert os.listdir(tmp_path) == []


def _write(target: str | Path) -> None:
    with atomic_write(target) as temporary:
        temporary.write_text("new")


def test_a_missing_folder_a_folder_and_a_device_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError) as caught:
        _write(tmp_path / "none" / "wing.csv")
    assert str(caught.value) == (f"{tmp_path}/none/wing.csv: the folder {tmp_path}/none does not exist; make it first")
    with pytest.raises(FormatError, match="is a folder; give the name of a file"):
        _write(tmp_path)
    with pytest.raises(FormatError, match="/dev/null: is a device or pipe; give the name of a file"):
        _write("/dev/null")
    with pytest.raises(FormatError, match="is not the name of a file"):
        _write("wing\0.csv")
    assert not Path("/dev/null").is_file()


def test_a_link_is_followed_and_the_longest_name_can_be_written(tmp_path: Path) -> None:
    target = tmp_path / ("w" * 251 + ".csv")
    _write(target)
    link = tmp_path / "link.csv"
    link.symlink_to(target)
    target.write_text("old")
    _write(link)
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_the_file_has_the_permissions_that_the_user_asks_for(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        _write(tmp_path / "wing.csv")
    finally:
        os.umask(before)
    assert (tmp_path / "wing.csv").stat().st_mode & 0o777 == 0o640
