"""Records saved and loaded: bit for bit, whole or not at all, and what damaged files are told."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io
from hypothesis import given
from hypothesis import strategies as st

import splinefeed as sf
from splinefeed.errors import FormatError, InputError, SplinefeedError
from splinefeed.formats import positions_csv, setpoints
from splinefeed.formats.setpoints import Writer, load, save
from splinefeed.records import Joint, Limits, Setpoints, TimeLaw

SUFFIXES = [".h5", ".hdf5", ".csv", ".mat", ".npz", ".parquet"]
#: One suffix a format that can be loaded.
LOADED = [".h5", ".csv", ".mat", ".npz", ".parquet"]
NEWER = "is newer than the 1 known here; update splinefeed"
CUT_OFF = "the last line does not say how many setpoints there are; the file looks cut off"
UNSOUND = "is not a valid .csv file of setpoints"
SETTINGS = {"source": "naca:0025", "feed": 60.0, "corrections": None, "nested": {"list": [1, 2.5, "µ"], "flag": True}}


def some_points(ticks: int, axes: tuple[str, ...] = ("x", "y"), first: int = 0) -> Setpoints:
    random = np.random.default_rng(first)
    return Setpoints(
        t=np.arange(first, first + ticks) * 1e-3,
        curve=np.sort(random.integers(0, 3, ticks)),
        u=random.random(ticks),
        s=np.sort(random.random(ticks)) * 382.8,
        feed=random.random(ticks) * 60.0,
        position=random.normal(size=(ticks, len(axes))) * 50.0,
        axes=axes,
        period=1e-3,
        method="milne-simpson-anchored",
        settings=SETTINGS,
    )


def assert_same(left: Setpoints, right: Setpoints) -> None:
    for name in ("t", "curve", "u", "s", "feed"):
        assert np.array_equal(getattr(left, name), getattr(right, name)), name
    linear = [axis not in ("a", "b", "c", "theta") for axis in left.axes]
    assert np.array_equal(left.position[:, linear], right.position[:, linear])
    # degrees in the file: one rounding on the way out and one on the way in
    assert np.allclose(left.position, right.position, rtol=4e-16, atol=0.0)
    for name in ("axes", "period", "method", "settings"):
        assert getattr(left, name) == getattr(right, name), name


def loaded(path: Path) -> Setpoints:
    record = load(path)
    assert isinstance(record, Setpoints)
    return record


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("axes", [("x", "y"), ("x",), ("x", "y", "theta"), ("x", "y", "z", "a", "b", "c")])
@pytest.mark.parametrize("ticks", [1, 5000])
def test_setpoints_come_back_bit_for_bit(tmp_path: Path, suffix: str, axes: tuple[str, ...], ticks: int) -> None:
    points = some_points(ticks, axes)
    save(points, tmp_path / f"wing{suffix}")
    assert_same(points, loaded(tmp_path / f"wing{suffix}"))
    assert os.listdir(tmp_path) == [f"wing{suffix}"]


def test_hdf5_keeps_rotary_axes_bit_for_bit(tmp_path: Path) -> None:
    points = some_points(5000, ("x", "theta"))
    save(points, tmp_path / "wing.h5")
    assert np.array_equal(points.position, loaded(tmp_path / "wing.h5").position)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_chunks_make_the_same_file_as_the_whole(tmp_path: Path, suffix: str) -> None:
    chunks = [some_points(ticks, first=first) for first, ticks in ((0, 3000), (3000, 1), (3001, 8192))]
    save(iter(chunks), tmp_path / f"wing{suffix}")
    whole = loaded(tmp_path / f"wing{suffix}")
    assert len(whole) == 11193
    assert np.array_equal(whole.position, np.concatenate([chunk.position for chunk in chunks]))
    assert np.array_equal(whole.curve, np.concatenate([chunk.curve for chunk in chunks]))


@given(value=st.floats(-1e9, 1e9))
def test_any_number_survives_a_csv(tmp_path_factory: pytest.TempPathFactory, value: float) -> None:
    path = tmp_path_factory.mktemp("csv") / "one.csv"
    points = some_points(1)
    one = Setpoints(**{**vars(points), "position": np.array([[value, -value]])})
    save(one, path)
    assert loaded(path).position.tobytes() == one.position.tobytes()


def test_a_law_and_limits_come_back_bit_for_bit(tmp_path: Path) -> None:
    random = np.random.default_rng(7)
    for period in (None, 1e-3):
        law = TimeLaw(
            breaks=np.array([0.0, 0.1, 0.35]),
            coefficients=random.normal(size=(2, 6)),
            strategy="seven-phase",
            period=period,
            notes=("stretched by 1.0003", "second"),
            settings=SETTINGS,
        )
        save(law, tmp_path / "law.h5")
        back = load(tmp_path / "law.h5")
        assert isinstance(back, TimeLaw)
        assert np.array_equal(back.breaks, law.breaks)
        assert np.array_equal(back.coefficients, law.coefficients)
        for name in ("strategy", "period", "notes", "settings"):
            assert getattr(back, name) == getattr(law, name)
    limits = Limits(
        feed=60,
        acceleration=50,
        jerk=2000,
        deceleration=40,
        start_feed=1 / 3,
        chord_error=1e-3,
        axis_velocity=70,
        axis_jerk={"x": 2e4, "theta": 1 / 7},
        axis_velocity_step={"y": 1.5},
        axis_minimum={"x": -1.0},
        axis_maximum={"x": 71.0},
    )
    save(limits, tmp_path / "limits.hdf5")
    assert load(tmp_path / "limits.hdf5") == limits


# --- what stands in the files beside the numbers ----------------------------------------------------------------------


def test_hdf5_says_units_and_settings(tmp_path: Path) -> None:
    save(some_points(10, ("x", "y", "theta")), tmp_path / "wing.h5")
    with h5py.File(tmp_path / "wing.h5") as file:
        units = [file[name].attrs["units"] for name in ("t", "curve", "u", "s", "feed")]
        assert units == [b"s", b"1", b"1", b"mm", b"mm/s"]
        assert list(file["position"].attrs["units"]) == [b"mm", b"mm", b"rad"]
        assert list(file.attrs["axes"]) == [b"x", b"y", b"theta"]
        assert (file.attrs["record"], file.attrs["schema"], file.attrs["period"]) == (b"Setpoints", 1, 1e-3)
        assert json.loads(file.attrs["settings"]) == SETTINGS
        assert (file["t"].compression, file["t"].shuffle) == ("gzip", True)
    save(Limits(feed=60, acceleration=50, jerk=2000), tmp_path / "limits.h5")
    with h5py.File(tmp_path / "limits.h5") as file:
        assert (file["jerk"][()], file["jerk"].attrs["units"]) == (2000.0, b"mm/s^3")


def test_csv_says_units_and_settings(tmp_path: Path) -> None:
    save(some_points(2, ("x", "theta")), tmp_path / "wing.csv")
    lines = (tmp_path / "wing.csv").read_text().splitlines()
    metadata = json.loads(lines[1].removeprefix("# metadata: "))
    assert lines[0] == "# splinefeed setpoints"
    assert metadata["settings"] == SETTINGS
    assert metadata["units"] == {"t": "s", "curve": "1", "u": "1", "s": "mm", "feed": "mm/s", "position": ["mm", "deg"]}
    assert lines[2] == "t_s,curve,u,s_mm,feed_mm_s,x_mm,theta_deg"
    assert lines[-1] == "# end: 2 ticks"
    assert len(lines) == 6


def test_matlab_gets_one_struct_with_units(tmp_path: Path) -> None:
    points = some_points(3, ("x", "theta"))
    save(points, tmp_path / "wing.mat")
    struct = scipy.io.loadmat(tmp_path / "wing.mat", simplify_cells=True)["setpoints"]
    assert struct["units"]["feed"] == "mm/s"
    assert list(struct["units"]["position"]) == ["mm", "deg"]
    assert struct["position"][:, 1] == pytest.approx(np.rad2deg(points.position[:, 1]), rel=1e-15)
    assert json.loads(struct["settings"]) == SETTINGS


@pytest.mark.parametrize("suffix", LOADED)
def test_joints_keep_their_names(tmp_path: Path, suffix: str) -> None:
    """A Joint is a text that knows its unit; MATLAB files made a struct of it."""
    points = some_points(3, (Joint("elbow", "rad"), Joint("slide", "mm")))
    save(points, tmp_path / f"arm{suffix}")
    assert loaded(tmp_path / f"arm{suffix}").axes == ("elbow", "slide")


def test_settings_of_any_length_and_numpy_kind_are_kept(tmp_path: Path) -> None:
    settings = {"path": Path("a") / "b", "array": np.arange(3), "number": np.float64(0.1), "long": "x" * 200_000}
    points = Setpoints(**{**vars(some_points(2)), "settings": settings})
    for suffix in LOADED:
        save(points, tmp_path / f"wing{suffix}")
        back = loaded(tmp_path / f"wing{suffix}").settings
        assert back == {"path": os.path.join("a", "b"), "array": [0, 1, 2], "number": 0.1, "long": "x" * 200_000}


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", LOADED)
def test_what_cannot_be_saved_leaves_no_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"wing{suffix}"
    good = some_points(10)

    def interrupted() -> Iterator[Setpoints]:
        yield good
        raise KeyboardInterrupt

    other_axes = some_points(10, ("x", "z"))
    not_finite = Setpoints(**{**vars(good), "u": np.full(10, np.nan)})
    no_json = Setpoints(**{**vars(good), "settings": {"limits": object()}})
    cases: list[tuple[Any, type[BaseException], str]] = [
        (interrupted(), KeyboardInterrupt, "^$"),
        (
            [good, other_axes],
            InputError,
            "wing.*: the chunk at tick 10 has axes \\('x', 'z'\\), the first one \\('x', 'y'\\)",
        ),
        ([good, 3], InputError, "wing.*: setpoints are saved from Setpoints, got int"),
        ([], FormatError, "wing.*: there are no ticks to save"),
        (not_finite, InputError, r"Setpoints\.u\[0\] is nan; every value must be finite"),
        (no_json, InputError, "settings: cannot be written as JSON: "),
    ]
    for record, error, message in cases:
        with pytest.raises(error, match=message):
            save(record, path)
        assert os.listdir(tmp_path) == []


def test_a_name_that_says_no_format_is_refused(tmp_path: Path) -> None:
    law = TimeLaw(breaks=np.array([0.0, 1.0]), coefficients=np.zeros((1, 6)), strategy="seven-phase")
    with pytest.raises(FormatError, match=r"wing: a record's file is named \.h5, .* or \.\w+; sf\.write"):
        save(some_points(1), tmp_path / "wing")
    with pytest.raises(FormatError, match=r"law\.csv: TimeLaw is saved as HDF5 only; name the file \.h5"):
        save(law, tmp_path / "law.csv")
    with pytest.raises(FormatError, match=r"wing\.xlsx: a record's file is named"):
        load(tmp_path / "wing.xlsx")
    with pytest.raises(FormatError, match="is a folder; name a file in it, such as setpoints"):
        load(tmp_path)


def test_more_ticks_than_matlab_takes_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(setpoints, "MAX_TICKS_AT_ONCE", 15)
    with pytest.raises(FormatError) as caught:
        save([some_points(10), some_points(10)], tmp_path / "wing.mat")
    assert str(caught.value) == (
        f"{tmp_path}/wing.mat: more than 15 ticks do not fit in this format; write HDF5 or several files"
    )


@pytest.mark.parametrize("suffix", LOADED)
def test_a_disk_that_runs_full_leaves_no_file(tmp_path: Path, suffix: str) -> None:
    program = (
        "import resource, signal, sys\n"
        "sys.path.insert(0, sys.argv[2])\n"
        "from test_setpoints import some_points\n"
        "from splinefeed.errors import FormatError\n"
        "from splinefeed.formats.setpoints import save\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))\n"
        "try:\n"
        "    save((some_points(5000, first=5000 * i) for i in range(10)), sys.argv[1])\n"
        "except FormatError as error:\n"
        "    print(error)\n"
    )
    path = tmp_path / f"wing{suffix}"
    # -B: a cache of bytecode that is cut off at the limit would stay behind
    command = [sys.executable, "-B", "-c", program, str(path), str(Path(__file__).parent)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout == f"{path}: cannot be written: the file would be larger than this system allows\n"
    assert (done.returncode, done.stderr) == (0, "")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("suffix", LOADED)
def test_a_file_cut_off_anywhere_is_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"wing{suffix}"
    save(some_points(3), path)
    content = path.read_bytes()
    for end in range(0, len(content) - 1, 10):
        path.write_bytes(content[:end])
        with pytest.raises(FormatError, match=f"wing\\{suffix}: "):
            load(path)


@pytest.mark.parametrize("suffix", LOADED)
@pytest.mark.parametrize("content", [b"", b"\0" * 100, b"\xff" * 5000, b"# splinefeed setpoints\n", b"x,y\n1,2\n" * 9])
def test_a_foreign_file_is_refused(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"wing{suffix}"
    path.write_bytes(content)
    with pytest.raises(FormatError) as caught:
        load(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", LOADED)
def test_a_missing_file_is_named(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(FormatError) as caught:
        load(tmp_path / f"none{suffix}")
    assert str(caught.value) == f"{tmp_path}/none{suffix}: no such file; check the name and the folder"


def test_changed_csv_files_are_told_what_is_wrong(tmp_path: Path) -> None:
    path = tmp_path / "wing.csv"
    save(some_points(3), path)
    text = path.read_text()
    lines = text.splitlines(keepends=True)
    cases = [
        (text.replace("# end: 3", "# end: 4"), "has (3, 7) rows and columns; expected (4, 7)"),
        (text.replace("end: 3", "end: 67108865"), CUT_OFF),
        ("".join(lines[:4] + lines[5:]), "has (2, 7) rows and columns; expected (3, 7)"),
        ("".join(lines[:-1]), CUT_OFF),
        (text.replace("x_mm", "x"), "line 3: expected the column names t_s,curve,u,s_mm,feed_mm_s,x_mm,y_mm"),
        (text.replace('"schema": 1', '"schema": 2'), f"schema: 2 {NEWER}"),
        (text.replace('"schema": 1', '"schema": "1"'), "schema: '1' is not a schema of splinefeed"),
        (text.replace('"record": "Setpoints"', '"record": "Table"'), "does not describe setpoints"),
        (text.replace('"period_s": 0.001', '"period_s": 0'), "period is 0; it must be greater than 0"),
        (text.replace(",2,", ",0.5,", 1), "column curve: holds something other than whole numbers"),
        (text.replace("\n0.001", "\nnan"), "Setpoints.t[1] is nan; every value must be finite"),
        (text.replace("\n0.001", "\n0,0.001"), f"{UNSOUND}: the number of columns changed from 7 to 8 at row 2"),
        (text.replace("# metadata: ", "# metadata "), "line 2: expected '# metadata: '"),
    ]  # fmt: skip
    for changed, reason in cases:
        assert changed != text
        path.write_text(changed)
        with pytest.raises(FormatError) as caught:
            load(path)
        assert str(caught.value).startswith(f"{path}: {reason}")


def test_hostile_hdf5_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "wing.h5"
    other = tmp_path / "other.h5"
    save(some_points(3), other)

    def external_link(file: Any) -> None:
        del file["t"]
        file["t"] = h5py.ExternalLink(str(other), "/t")

    def external_bytes(file: Any) -> None:
        del file["t"]
        file.create_dataset("t", shape=(3,), dtype="f8", external=[("/etc/hostname", 0, 24)])

    def empty_but_huge(file: Any) -> None:
        del file["t"]
        file.create_dataset("t", shape=(2**26,), dtype="f8", chunks=(2**16,))

    def absurdly_large(file: Any) -> None:
        del file["t"]
        file.create_dataset("t", shape=(2**40,), dtype="f8", chunks=(2**16,))

    def texts(file: Any) -> None:
        del file["t"]
        file["t"] = ["a", "b", "c"]

    def group(file: Any) -> None:
        del file["t"]
        file.create_group("t")

    def record(file: Any) -> None:
        file.attrs["record"] = "Curve"

    def no_axes(file: Any) -> None:
        del file.attrs["axes"]

    def settings(file: Any) -> None:
        file.attrs["settings"] = "[" * 100_000

    cases = [
        (external_link, "dataset t: is missing or not a dataset of this file"),
        (external_bytes, "dataset t: is missing or not a dataset of this file"),
        (empty_but_huge, "dataset t: has shape (67108864,) of float64, but far fewer bytes on disk than"),
        (absurdly_large, "dataset t: has shape (1099511627776,) of float64; at most 67108864 ticks can be read"),
        (texts, "dataset t: has shape (3,) of object; expected numbers in 1 dimension(s)"),
        (group, "dataset t: is missing or not a dataset of this file"),
        (record, "holds a record 'Curve'; known are Setpoints, Response, TimeLaw, Limits"),
        (no_axes, "is not a valid HDF5 file: Setpoints.__init__() missing"),
        (settings, "is not a valid HDF5 file: maximum recursion depth exceeded"),
    ]  # fmt: skip
    for change, reason in cases:
        save(some_points(3), path)
        with h5py.File(path, "a") as file:
            change(file)
        with pytest.raises(FormatError) as caught:
            load(path)
        assert str(caught.value).startswith(f"{path}: {reason}")
        assert "\n" not in str(caught.value)


def test_a_library_that_quotes_the_file_is_cut_short(tmp_path: Path) -> None:
    """Found by `make torture`, seed 7000002: zipfile puts the names it finds into its message, kilobytes of them."""
    file = tmp_path / "wing.npz"
    save(some_points(10), file)
    content = bytearray(file.read_bytes())
    header = content.index(b"PK\x03\x04")
    struct.pack_into("<H", content, header + 26, 3000)  # the length of the first name
    file.write_bytes(content)
    with pytest.raises(FormatError) as caught:
        load(file)
    message = str(caught.value)
    assert message.startswith(f"{file}: is not a valid .npz file of setpoints: ") and message.endswith("...")
    assert "\n" not in message and len(message) < 300 + len(str(file))


def test_all_that_says_what_is_where_has_a_checksum(tmp_path: Path) -> None:
    """HDF5 reads a damaged heap of texts or of names for ever: there is none in our files."""
    file = tmp_path / "wing.h5"
    save(some_points(10), file)
    content = file.read_bytes()
    assert b"GCOL" not in content and b"HEAP" not in content
    at = content.index(b"OHDR") + 40
    file.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
    with pytest.raises(FormatError, match=r"wing\.h5: is not a valid HDF5 file: "):
        load(file)


def test_texts_of_older_files_are_read(tmp_path: Path) -> None:
    file = tmp_path / "wing.h5"
    points = some_points(10)
    save(points, file)
    with h5py.File(file, "a") as opened:
        for name in ("record", "method", "settings"):
            text = opened.attrs[name].decode()
            del opened.attrs[name]
            opened.attrs[name] = text
        del opened.attrs["axes"]
        opened.attrs["axes"] = list(points.axes)
    assert_same(points, loaded(file))


def test_an_attribute_that_hdf5_would_crash_on_is_refused(tmp_path: Path) -> None:
    """A text that one changed byte makes a list of variable length is a segmentation fault in the library."""
    file = tmp_path / "wing.h5"
    save(some_points(10), file)
    with h5py.File(file, "a") as opened:
        values = np.empty(1, dtype=object)
        values[0] = np.array([1, 2], dtype=np.int32)
        opened.attrs.create("method", values, dtype=h5py.vlen_dtype(np.int32))
    with pytest.raises(FormatError, match=r"wing\.h5: attribute method: is neither text nor a number"):
        load(file)


def test_a_limit_that_is_not_known_is_not_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "limits.h5"
    save(Limits(feed=60, acceleration=50, jerk=2000), path)
    with h5py.File(path, "a") as file:
        file["snap"] = 1.0
    with pytest.raises(FormatError, match=r"limits\.h5: 'snap' is not a limit"):
        load(path)
    with h5py.File(path, "a") as file:
        del file["snap"]
        file["jerk"][()] = -1.0
    with pytest.raises(FormatError, match=r"limits\.h5: jerk is -1; it must be greater than 0"):
        load(path)


@given(st.binary(max_size=300), st.sampled_from(LOADED))
def test_any_bytes_give_an_error_of_ours(tmp_path_factory: pytest.TempPathFactory, content: bytes, suffix: str) -> None:
    path = tmp_path_factory.mktemp("any") / f"any{suffix}"
    path.write_bytes(content)
    with pytest.raises(SplinefeedError):
        load(path)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the peak of memory is read from /proc")
def test_an_hour_of_ticks_is_written_in_little_memory(tmp_path: Path) -> None:
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "sys.path.insert(0, sys.argv[2])\n"
        "from test_setpoints import some_points\n"
        "from splinefeed.formats.setpoints import save\n"
        "save((some_points(60_000, first=60_000 * i) for i in range(60)), sys.argv[1])\n"
        "print(Path('/proc/self/status').read_text().split('VmHWM:')[1].split()[0])\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "hour.h5"), str(Path(__file__).parent)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    # VmHWM and not ru_maxrss, which a process inherits from the one that started it
    kilobytes = int(done.stdout)
    assert kilobytes < 250_000
    with h5py.File(tmp_path / "hour.h5") as file:
        assert file["position"].shape == (3_600_000, 2)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"position": np.full((3, 2), 1.1e9)}, "Setpoints.position: goes beyond 1e\\+09 mm or rad; is the unit right"),
        ({"feed": np.full(3, 1e308)}, "Setpoints.feed: goes beyond 1e\\+100; is the unit right"),
        ({"t": np.array([-1e101, 0.0, 1.0])}, "Setpoints.t: goes beyond"),
        ({"period": 1e-10}, "period: 1e-10 s is not from 1e-09 to 1e\\+06 s"),
        ({"period": 1e7}, "period: 1e\\+07 s is not from"),
    ],
)
def test_numbers_that_no_machine_has_are_refused(tmp_path: Path, changed: dict[str, Any], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        save(Setpoints(**{**vars(some_points(3)), **changed}), tmp_path / "wing.h5")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("t,x\n0,1e308\n1,-1e308\n", "row 1 of the numbers: goes beyond 1e\\+09 mm"),
        ("t,x\n0,1\n1,inf\n", "row 2 of the numbers: goes beyond"),
        ("t,x\n0,1\n1e-320,2\n2e-320,2\n", "period: .* is not from 1e-09 to 1e\\+06 s"),
        ("t,x\n0,1\n1e308,2\n", "row 2 of the numbers: goes beyond"),
        ("t,x\n0,1\n1e308,2\n2,2\n-1e308,1\n", "row 2 of the numbers: goes beyond"),
        ("t,x\n0,1\n1e98,2\n", "period: 1e\\+98 s is not from"),
        ("t,x\n0,1\n# a remark\n0.001,2\n", ""),
    ],
)
def test_rows_of_others_are_within_bounds(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "other.csv").write_text(text)
    if reason:
        with pytest.raises(FormatError, match=reason):
            positions_csv.read(tmp_path / "other.csv")
    else:
        assert len(positions_csv.read(tmp_path / "other.csv")[0]) == 2


def test_a_writer_that_is_left_writes_nothing(tmp_path):
    points = sf.run(sf.shapes.butterfly()).points
    for name in ("part.h5", "part.csv", "part.npz"):
        with Writer(tmp_path / name) as writer:
            writer.feed(points.part(0, 10))
        assert not list(tmp_path.iterdir())
        with Writer(tmp_path / name) as writer:
            writer.feed(points.part(0, 10))
            writer.feed(points.part(10, len(points)))
            writer.finish()
        assert np.array_equal(sf.load(tmp_path / name, sf.Setpoints).position, points.position)
        (tmp_path / name).unlink()


@pytest.mark.parametrize("word", ["3e9", "1e300", "nan", "0.5", "-3e9"])
def test_numbers_of_curves_that_are_none_are_refused_without_a_warning(tmp_path: Path, word: str) -> None:
    path = sf.shapes.circle(5.0)
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20000), strategy="seven-phase", period=5e-3)
    sf.save(sf.interpolate(path, law, period=5e-3), tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    place = lines[2].split(",").index("curve")
    cells = lines[9].split(",")
    lines[9] = ",".join([*cells[:place], word, *cells[place + 1 :]])
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(FormatError, match="column curve: holds something other than whole numbers"):
        sf.load(tmp_path / "a.csv")
