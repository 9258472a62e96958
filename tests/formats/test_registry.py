"""Which format a file is, and the one line that says why a file cannot be read or written."""

from __future__ import annotations

import errno
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest

import splinefeed
import splinefeed as sf
from splinefeed.errors import FormatError, InputError
from splinefeed.files import source
from splinefeed.formats import json_curve, registry
from splinefeed.formats.registry import FORMATS, read, read_all, write
from splinefeed.paths.jobs import Job

EXPECTED = ", ".join(f"{each.title} ({' '.join(each.suffixes)})" for each in FORMATS)


def test_the_content_counts_more_than_the_name(tmp_path: Path, data_dir: Path) -> None:
    misnamed = tmp_path / "butterfly.dat"
    shutil.copy(data_dir / "curves" / "butterfly.json", misnamed)
    assert read(misnamed).name == "butterfly"


def test_the_butterfly_of_the_package_is_the_one_of_the_tests(data_dir: Path) -> None:
    packaged = files(splinefeed) / "data" / "butterfly.json"
    assert packaged.read_bytes() == (data_dir / "curves" / "butterfly.json").read_bytes()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty; was its writing interrupted?"),
        (b" \n\t\n", "holds only white space"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", f"is not one of {EXPECTED}"),
        (b"version https://git-lfs.x/v1\n", "is a pointer of Git LFS, not the file itself; run: git lfs pull"),
        (b"\xff\xfe{\0}\0", "is UTF-16 text; save it as UTF-8"),
        (b"solid of a kind\nfacet normal 0 0 1\n", f"is not one of {EXPECTED}"),
    ],
)
def test_what_is_no_curve_is_refused_in_one_line(tmp_path: Path, content: bytes, reason: str) -> None:
    file = tmp_path / "part.abc"
    file.write_bytes(content)
    with pytest.raises(FormatError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: {reason}"


def test_a_missing_file_a_folder_and_a_device_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError) as caught:
        read(tmp_path / "none.json")
    assert str(caught.value) == f"{tmp_path}/none.json: no such file; check the name and the folder"
    with pytest.raises(FormatError, match="is a folder; name a file in it"):
        read(tmp_path)
    with pytest.raises(FormatError, match="/dev/zero: is a device or pipe; name a plain file"):
        read("/dev/zero")
    with pytest.raises(FormatError, match="cannot be opened: File name too long"):
        read("w" * 5000)
    with pytest.raises(FormatError, match=r"cannot be opened: .*embedded null"):
        read("a\0b.json")


def test_an_unreadable_file_is_refused(data_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(FormatError, match=r"butterfly\.json: cannot be read: Permission denied"):
        read(data_dir / "curves" / "butterfly.json")


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source, "MAX_FILE_BYTES", 2**20)
    file = tmp_path / "cloud.json"
    with file.open("wb") as stream:
        stream.truncate(2**30)
    with pytest.raises(FormatError, match=r"cloud\.json: is larger than 1 MB; that is not a curve but a point cloud"):
        read(file)


def test_an_unknown_option_names_those_there_are(data_dir: Path) -> None:
    file = data_dir / "curves" / "butterfly.json"
    with pytest.raises(InputError, match="option 'chord' is not one of a JSON curve file; there are path, tolerance"):
        read(file, chord=100)


def test_of_several_paths_one_is_chosen(data_dir: Path) -> None:
    file = data_dir / "json" / "tigl_wing3_guides.json"
    assert [path.name for path in read_all(file)] == ["edge1", "edge2", "edge3"]
    assert read(file, path="edge2").name == "edge2"
    assert read(file, path=3).name == "edge3"
    assert read(file, path="3").name == "edge3"
    made = read(file)  # all of them as one motion
    assert isinstance(made, Job)
    assert (made.name, len(made.contours)) == (file.stem, 3)
    with pytest.raises(InputError, match="clearance is -1e"):
        made.job(clearance=-1e9)
    for wrong in ("0", "4", "edge", "²", "9" * 5000):
        with pytest.raises(FormatError, match="has no path"):
            read(file, path=wrong)


def test_a_suffix_that_nothing_writes_names_those_that_are(tmp_path: Path, data_dir: Path) -> None:
    path = read(data_dir / "curves" / "butterfly.json")
    with pytest.raises(FormatError) as caught:
        write(path, tmp_path / "wing.docx")
    assert str(caught.value).startswith(
        f"{tmp_path}/wing.docx: this name is not that of a path file; name it as one of "
    )
    assert "JSON curve (.json)" in str(caught.value)
    assert "airfoil" not in str(caught.value)
    with pytest.raises(InputError, match="there is no path to write"):
        write([], tmp_path / "wing.json")
    with pytest.raises(InputError, match="option 'colour' is not one of a JSON curve file"):
        write(path, tmp_path / "wing.json", colour="red")


def test_several_paths_go_into_one_file_and_keep_their_names(tmp_path: Path, data_dir: Path) -> None:
    paths = read_all(data_dir / "json" / "tigl_wing3_guides.json")
    assert write(paths, tmp_path / "guides.json") == ()
    back = read_all(tmp_path / "guides.json")
    assert [path.name for path in back] == ["edge1", "edge2", "edge3"]
    assert [path.curves for path in back] == [path.curves for path in paths]


def test_a_binary_file_of_a_promised_format_is_refused_by_its_reader(tmp_path: Path) -> None:
    file = tmp_path / "part.json"
    file.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    with pytest.raises(FormatError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: byte 8: is binary; expected the text of a JSON curve"


def test_formats_that_a_file_does_not_need_are_not_imported(data_dir: Path) -> None:
    code = f"import sys, splinefeed; splinefeed.read({str(data_dir / 'curves' / 'butterfly.json')!r})\n"
    code += "print(*(m for m in sys.modules if m.startswith('splinefeed.formats.')), 'ezdxf' in sys.modules)"
    names = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    titles = {each.module for each in FORMATS}
    assert {name.removeprefix("splinefeed.") for name in names[:-1]} & titles == {"formats.json_curve"}
    assert names[-1] == "False"


def test_a_fault_of_a_reader_names_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(text: str, source: object) -> list[Path]:
        raise ValueError("not enough values to unpack")

    broken.__name__ = "from_text"
    monkeypatch.setattr(json_curve, "from_text", broken)
    file = tmp_path / "part.json"
    file.write_text("{}")
    with pytest.raises(ValueError, match="not enough values") as caught:
        read(file)
    assert caught.value.__notes__ == [f"at {file}"]


def test_more_curves_than_a_format_may_hold_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "part.json"
    write(sf.Path.polyline([[0, 0], [1, 0], [1, 1], [0, 1]]), file)
    fewer = [replace(each, max_curves=2) for each in FORMATS]
    monkeypatch.setattr(registry, "FORMATS", fewer)
    with pytest.raises(FormatError) as caught:
        read(file)
    assert str(caught.value) == f"{file}: holds 3 curves; at most 2 are taken: split the file"


def test_every_format_has_a_suffix_of_its_own() -> None:
    suffixes = [
        suffix for each in FORMATS for suffix in each.suffixes if (each.module, suffix) != ("formats.airfoil", ".txt")
    ]
    assert len(suffixes) == len(set(suffixes))
