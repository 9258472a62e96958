"""Damaged and hostile STEP, IGES and 3DM files: an error of one line, whatever the library does with them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import FormatError, SplinefeedError
from splinefeed.files import native_process
from splinefeed.formats import threedm
from splinefeed.formats.registry import read_all

SMALL = {
    "step": "part.stp",
    "iges": "iges/igesio_sample_curves.igs",
    "3dm": "3dm/rhino_joincurves_newFile.3dm",
}


def small(kind: str, tmp_path: Path, data_dir: Path) -> Path:
    """A small sound file of the kind, to be damaged."""
    file = tmp_path / f"part.{ {'step': 'stp', 'iges': 'igs', '3dm': '3dm'}[kind] }"
    if kind == "step":
        sf.write(sf.shapes.circle(5.0), file)
    else:
        file.write_bytes((data_dir / SMALL[kind]).read_bytes())
    return file


@pytest.mark.parametrize("kind", SMALL)
def test_a_file_cut_off_anywhere_is_refused(tmp_path: Path, data_dir: Path, kind: str) -> None:
    file = small(kind, tmp_path, data_dir)
    whole = file.read_bytes()
    # what may be missing at the end: the last line break, in STEP the semicolon, in IGES the blanks of the last line
    for end in range(0, len(whole) - (60 if kind == "iges" else 2), 50 if kind == "step" else 10):
        file.write_bytes(whole[:end])
        with pytest.raises(FormatError) as caught:
            read_all(file)
        assert str(caught.value).startswith(f"{file}: ")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", SMALL)
def test_repairing_a_file_that_is_cut_off_gives_what_is_there_or_an_error(
    tmp_path: Path, data_dir: Path, kind: str
) -> None:
    file = small(kind, tmp_path, data_dir)
    whole = file.read_bytes()
    for end in range(1, len(whole), len(whole) // 12):
        file.write_bytes(whole[:end])
        try:
            contents = read_all(file, repair=True)
        except SplinefeedError as error:
            assert "\n" not in str(error)
        else:
            assert contents[0].findings or (kind == "iges" and len(whole) - end < 60)


def mutated(content: bytes, seed: int) -> bytes:
    random = np.random.default_rng(seed)
    out = bytearray(content)
    for _ in range(random.integers(1, 5)):
        at, other = random.integers(0, len(out), 2)
        kind = random.integers(0, 5)
        if kind == 0:
            out[at] = random.integers(0, 256)
        elif kind == 1:
            del out[at : at + random.integers(1, 20)]
        elif kind == 2:
            out[at:at] = out[other : other + random.integers(1, 200)]
        elif kind == 3:
            out[at : at + 4] = random.bytes(4)
        else:
            words = (b"-1", b"99999999", b"#1", b",", b"(", b"'", b"1e308", b"$", b"nan", b"\xff\xff\xff\x7f")
            out[at : at + 1] = words[random.integers(0, len(words))]
        out = out or bytearray(b" ")
    return bytes(out)


def fuzz(file: Path, rounds: int, repair: bool) -> None:
    whole = file.read_bytes()
    for seed in range(rounds):
        file.write_bytes(mutated(whole, seed))
        try:
            read_all(file, repair=repair)
        except SplinefeedError as error:
            assert str(error).startswith(f"{file}: "), seed
            assert "\n" not in str(error), seed


@pytest.mark.slow
@pytest.mark.parametrize("kind", SMALL)
@pytest.mark.parametrize("repair", [False, True])
def test_changed_files_give_curves_or_an_error_of_ours(tmp_path: Path, data_dir: Path, kind: str, repair: bool) -> None:
    fuzz(small(kind, tmp_path, data_dir), 30, repair)


@pytest.mark.parametrize("suffix", [".stp", ".igs", ".3dm"])
@pytest.mark.parametrize(
    "content",
    [
        b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n",
        b"\0" * 5000,
        bytes(range(256)) * 20,
        b"ISO-10303-21;\nEND-ISO-10303-21;\n",
        b"ISO-10303-21;HEADER;ENDSEC;DATA;" + b"#1=A((((((" * 2000 + b";ENDSEC;END-ISO-10303-21;",
        b" " * 72 + b"S      1\n" * 3,
        b"3D Geometry File Format       70" + b"\xff" * 5000,
        b"3D Geometry File Format        1" + b"\0" * 100,
    ],
)
def test_what_is_no_such_file_is_refused_at_once(tmp_path: Path, suffix: str, content: bytes) -> None:
    file = tmp_path / f"part{suffix}"
    file.write_bytes(content)
    for repair in (False, True):
        with pytest.raises(FormatError) as caught:
            read_all(file, repair=repair)
        assert str(caught.value).startswith(f"{file}: ")
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", SMALL)
def test_the_content_counts_more_than_the_name(tmp_path: Path, data_dir: Path, kind: str) -> None:
    file = small(kind, tmp_path, data_dir)
    wanted = [path.length for path in read_all(file)]
    for suffix in (".stp", ".igs", ".3dm", ".dxf", ".txt"):
        assert [path.length for path in read_all(file.rename(tmp_path / f"other{suffix}"))] == wanted
        file = tmp_path / f"other{suffix}"


@pytest.mark.skipif(not hasattr(os, "truncate"), reason="no sparse files here")
def test_a_file_of_two_gigabytes_is_not_read(tmp_path: Path, data_dir: Path) -> None:
    file = small("step", tmp_path, data_dir)
    os.truncate(file, 2**31)
    with pytest.raises(FormatError, match="is larger than 256 MB"):
        read_all(file)


def test_a_library_that_dies_is_an_error_and_the_next_file_is_read(tmp_path: Path, data_dir: Path) -> None:
    file = small("3dm", tmp_path, data_dir)
    before = read_all(file)
    process = native_process._worker._process
    assert process is not None
    process.send_signal(signal.SIGSTOP)
    threading.Timer(0.3, process.kill).start()
    with pytest.raises(FormatError) as caught:
        read_all(file)
    assert str(caught.value) == f"{file}: makes the library that reads it crash; is it damaged?"
    assert [path.length for path in read_all(file)] == [path.length for path in before]


def test_a_library_that_takes_too_long_is_ended(
    tmp_path: Path, data_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = small("step", tmp_path, data_dir)
    native_process._worker.stop()
    monkeypatch.setattr(native_process, "MAX_SECONDS", 1e-3)  # starting the library takes longer
    with pytest.raises(FormatError, match=r"part\.stp: takes longer than 0 s; is it damaged\?"):
        read_all(file)
    monkeypatch.undo()
    assert len(read_all(file)) == 1


def test_a_library_that_cannot_be_loaded_is_said_so(tmp_path: Path, data_dir: Path) -> None:
    file = small("3dm", tmp_path, data_dir)
    (tmp_path / "broken" / "rhino3dm").mkdir(parents=True)
    (tmp_path / "broken" / "rhino3dm" / "__init__.py").write_text("raise ImportError('libGL.so.1: not found')\n")
    program = (
        "import sys\nimport splinefeed as sf\n"
        "try:\n    sf.read(sys.argv[1])\nexcept sf.SplinefeedError as error:\n    print(error)\n"
    )
    places = [str(tmp_path / "broken"), str(Path(sf.__file__).parents[1])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(places)}
    done = subprocess.run(
        [sys.executable, "-c", program, str(file)], capture_output=True, text=True, env=environment, check=True
    )
    assert done.stdout == (
        f"{file}: needs rhino3dm, which cannot be loaded (libGL.so.1: not found); run: pip install 'splinefeed[cad]'\n"
    )
    assert done.stderr == ""


def test_reading_prints_nothing_and_leaves_no_process(tmp_path: Path, data_dir: Path) -> None:
    file = small("iges", tmp_path, data_dir)
    program = (
        "import sys\nimport splinefeed as sf\nfrom splinefeed.formats import registry\n"
        "registry.read_all(sys.argv[1])\nsys.exit(0 if 'OCP' not in sys.modules else 3)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, str(file)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_checks_of_a_file_that_repairs_are_findings(tmp_path: Path) -> None:
    file = small("step", tmp_path, tmp_path)
    file.write_text(file.read_text().replace("ENDSEC;\nEND-ISO", "#999=CIRCLE('',#998,1.);\nENDSEC;\nEND-ISO"))
    fault = "OCCT says: Unresolved Reference, Ent.Id.#999 Param.n0 2 (Id.#998)"
    with pytest.raises(FormatError) as caught:
        read_all(file)
    assert str(caught.value).startswith(f"{file}: {fault}")
    assert read_all(file, repair=True)[0].findings[0] == fault


def test_a_3dm_file_without_its_last_record_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "part.3dm"
    file.write_bytes(threedm.START + b"      70" + b"\0" * 50)
    with pytest.raises(FormatError, match="the record that ends it is missing at byte 82"):
        read_all(file)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_reads_through_a_process_of_its_own(tmp_path: Path, data_dir: Path) -> None:
    file = small("3dm", tmp_path, data_dir)
    wanted = read_all(file)[0].length
    child = os.fork()
    if child == 0:
        os._exit(0 if read_all(file)[0].length == wanted else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert read_all(file)[0].length == wanted
