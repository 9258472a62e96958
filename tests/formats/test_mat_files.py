"""MATLAB's files are read bit for bit in a process of its own; damaged ones are one line."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import fuzzing
from splinefeed.errors import FormatError, SplinefeedError
from splinefeed.formats.setpoints import load, save
from splinefeed.records import Setpoints

HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"


def setpoints(ticks: int, axes: tuple[str, ...]) -> Setpoints:
    random = np.random.default_rng(2)
    t, u, s, feed = random.normal(size=(4, ticks))
    return Setpoints(
        t=t, curve=np.arange(ticks), u=u, s=s, feed=feed, position=random.normal(size=(ticks, len(axes))), axes=axes,
        period=0.001, method="milne µ", settings={"inner": {"unit": "mm", "list": [1, None]}},
    )  # fmt: skip


@pytest.mark.parametrize(("ticks", "axes"), [(50, ("x", "y", "theta")), (1, ("x", "y")), (7, ("x",)), (1, ("x",))])
@pytest.mark.parametrize("again", [False, True])
def test_setpoints_come_back_whatever_their_shape(
    tmp_path: Path, ticks: int, axes: tuple[str, ...], again: bool
) -> None:
    """MATLAB drops dimensions of one; `again` SciPy saves, unpacked, what it has loaded, as another program does."""
    points, file = setpoints(ticks, axes), tmp_path / "a.mat"
    save(points, file)
    if again:
        scipy.io.savemat(file, {"other": np.ones(9), "setpoints": scipy.io.loadmat(file)["setpoints"]})
    found = load(file, Setpoints)
    for name in ("t", "curve", "u", "s", "feed"):
        assert np.array_equal(getattr(found, name), getattr(points, name)), name
    assert np.allclose(found.position, points.position, rtol=1e-15, atol=0)  # of degrees
    assert (found.axes, found.period, found.method, found.settings) == (axes, 0.001, "milne µ", points.settings)


def element(kind: int, data: bytes) -> bytes:
    return kind.to_bytes(4, "little") + len(data).to_bytes(4, "little") + data + bytes(-len(data) % 8)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"MATLAB", "is not valid"),
        (HEAD[:-2] + b"XX", "is not valid"),
        (HEAD, "has no struct setpoints"),
        (HEAD + element(14, b"1234567"), "is not valid"),
        (HEAD + element(15, zlib.compress(bytes(2**27))), "unpacks to far more than it packs"),
        (HEAD + element(15, b"not packed"), "is not valid: Error -3"),
    ],
)
def test_damage_is_refused_in_one_line(tmp_path: Path, content: bytes, reason: str) -> None:
    file = tmp_path / "a.mat"
    file.write_bytes(content)
    with pytest.raises(FormatError) as caught:
        load(file)
    assert str(caught.value).startswith(f"{file}: ") and reason in str(caught.value) and "\n" not in str(caught.value)


def test_a_struct_of_others_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.mat"
    for struct in ({"t": np.ones(3)}, 5.0, np.zeros((2, 1), [("t", object)])):
        scipy.io.savemat(file, {"setpoints": struct})
        with pytest.raises(FormatError, match=r"has no struct setpoints with a field \w+; was this written by"):
            load(file)


def test_a_byte_of_the_heads_may_be_anything(tmp_path: Path) -> None:
    """Every seventh of the first bytes of an unpacked file in turn, as SciPy's reader is ended by such."""
    content = next(fuzzing.seeds("mat", tmp_path))
    file = tmp_path / "changed.mat"
    read = 0
    for at in range(0, 1400, 7):
        file.write_bytes(content[:at] + bytes([content[at] ^ 0x80]) + content[at + 1 :])
        try:
            load(file)
            read += 1
        except SplinefeedError as error:
            assert "\n" not in str(error) and str(error).startswith(str(file))
    assert 0 < read < 200
