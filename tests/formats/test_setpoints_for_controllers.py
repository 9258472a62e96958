"""Rows for LinuxCNC's halstreamer and PVT tables: the layout to the letter, and the numbers as exact as the format."""

from __future__ import annotations

import builtins
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import splinefeed as sf
from splinefeed.errors import FormatError, InputError
from splinefeed.formats.setpoint_table import FORMATS
from splinefeed.formats.setpoints import load, save
from splinefeed.records import Setpoints


def motion(t: np.ndarray[Any, Any], columns: list[Any], axes: tuple[str, ...]) -> Setpoints:
    position = np.column_stack(columns)
    return Setpoints(
        t=t,
        curve=np.zeros(len(t), dtype=np.int64),
        u=t,
        s=t,
        feed=np.ones(len(t)),
        position=position,
        axes=axes,
        period=1e-3,
        method="arc-length",
    )


def parts(points: Setpoints, *cuts: int) -> list[Setpoints]:
    names = ("t", "curve", "u", "s", "feed", "position")
    bounds = [0, *cuts, len(points)]
    return [
        Setpoints(**{**vars(points), **{name: getattr(points, name)[a:b] for name in names}})
        for a, b in pairwise(bounds)
    ]


def run_of(path: sf.Path, **limits: float) -> Setpoints:
    law = sf.plan(path, sf.Limits(**limits), period=1e-3)
    return sf.interpolate(path, law)


def test_a_streamer_gets_number_axes_and_last(tmp_path: Path) -> None:
    t = np.arange(3) * 1e-3
    points = motion(t, [[0.1, 1 / 3, 2.0], [0.0, -1e-17, 5.0], np.deg2rad([0.0, 30.0, 90.0])], ("x", "y", "theta"))
    save(points, tmp_path / "job.halstream")
    assert (tmp_path / "job.halstream").read_text() == (
        "# row x_mm y_mm theta_deg last   (cfg=ufffb, one row every 0.001 s, last row repeated)\n"
        "1 0.10000000000000001 0 0 0\n"
        "2 0.33333333333333331 -1.0000000000000001e-17 29.999999999999996 0\n"
        "3 2 5 90 1\n"
        "4 2 5 90 1\n"
    ).replace("29.999999999999996", f"{np.rad2deg(np.deg2rad(30.0)):.17g}")


def test_streamer_rows_are_the_setpoints_bit_for_bit_however_they_come(tmp_path: Path) -> None:
    points = run_of(sf.shapes.butterfly(), feed=60, acceleration=500, jerk=20000)
    save(points, tmp_path / "whole.halstream")
    save(parts(points, 1, 2, 2, 700), tmp_path / "parts.halstream")
    assert (tmp_path / "whole.halstream").read_bytes() == (tmp_path / "parts.halstream").read_bytes()
    rows = np.loadtxt(tmp_path / "whole.halstream")
    assert np.array_equal(rows[:-1, 1:3], points.position)
    assert np.array_equal(rows[-1, 1:3], points.position[-1])
    assert np.array_equal(rows[:, 0], np.arange(1, len(points) + 2))
    assert np.array_equal(np.flatnonzero(rows[:, 3]), [len(points) - 1, len(points)])


def test_a_streamer_is_told_of_a_short_last_step(tmp_path: Path) -> None:
    points = motion(np.array([0.0, 1e-3, 1.4e-3]), [[0.0, 1.0, 1.4]], ("x",))
    save(points, tmp_path / "job.halstream")
    assert "\n# the plan takes 0.0004 s for the last step" in (tmp_path / "job.halstream").read_text()


def test_a_pvt_table_has_steps_ways_and_velocities(tmp_path: Path) -> None:
    t = np.array([0.0, 0.5, 1.0])
    save(motion(t, [[1.0, 1.5, 3.0], np.deg2rad([0.0, 90.0, 180.0])], ("x", "c")), tmp_path / "job.pvt")
    rows = np.loadtxt(tmp_path / "job.pvt", delimiter=",")
    # the parabola 1 + 2 t^2 and a steady turn
    assert rows == pytest.approx(np.array([[0.5, 0.5, 2.0, 90.0, 180.0], [0.5, 1.5, 4.0, 90.0, 180.0]]), rel=1e-14)


@pytest.mark.parametrize("cuts", [(), (1,), (1, 2, 3), (4,), (5, 11), (30, 31, 36), tuple(range(1, 40))])
def test_velocities_are_exact_for_motions_of_degree_4(tmp_path: Path, cuts: tuple[int, ...]) -> None:
    random = np.random.default_rng(3)
    t = np.cumsum(random.uniform(0.5e-3, 1.5e-3, 40))
    x, y = (Polynomial(random.normal(size=5) * 10.0 ** np.arange(5)) for _ in range(2))
    points = motion(t, [x(t), y(t)], ("x", "y"))
    save(parts(points, *cuts), tmp_path / "job.pvt")
    rows = np.loadtxt(tmp_path / "job.pvt", delimiter=",")
    assert np.array_equal(rows[:, 0], np.diff(t))
    assert np.array_equal(rows[:, 1], np.diff(x(t))) and np.array_equal(rows[:, 3], np.diff(y(t)))
    for column, q in ((2, x), (4, y)):
        assert np.allclose(rows[:, column], q.deriv()(t[1:]), rtol=0.0, atol=1e-9 * np.max(np.abs(q.deriv()(t))))


def test_velocities_are_those_of_the_path(tmp_path: Path) -> None:
    path = sf.shapes.butterfly()
    points = run_of(path, feed=60, acceleration=500, jerk=20000)
    save(points, tmp_path / "job.pvt")
    rows = np.loadtxt(tmp_path / "job.pvt", delimiter=",")
    tangent = path.evaluate(points.curve, points.u, 1)[1:, 1]
    exact = tangent / np.linalg.norm(tangent, axis=1, keepdims=True) * points.feed[1:, None]
    # at the sharp tips of the butterfly a tick is a good part of the least radius: there T^4 q^(5) / 30 is what it is
    error = np.linalg.norm(rows[:, 2::2] - exact, axis=1) / 60.0
    assert np.median(error) < 1e-7 and np.quantile(error, 0.99) < 2e-3
    assert np.all(rows[-1, 2::2] == 0.0)
    assert points.position[0] + rows[:, 1::2].sum(axis=0) == pytest.approx(points.position[-1], abs=1e-10)


def test_a_pvt_table_needs_two_ticks_that_follow_each_other(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"one\.pvt: one tick is no step; a PVT table needs at least two ticks"):
        save(motion(np.zeros(1), [[0.0]], ("x",)), tmp_path / "one.pvt")
    with pytest.raises(FormatError, match=r"two\.pvt: t does not grow from tick to tick"):
        save(motion(np.zeros(2), [[0.0, 1.0]], ("x",)), tmp_path / "two.pvt")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".halstream", ".pvt"])
def test_what_is_for_controllers_is_not_loaded(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(FormatError, match="files are for controllers and cannot be loaded"):
        load(tmp_path / f"job{suffix}")


def test_parquet_without_pyarrow_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.partition(".")[0] == "pyarrow":
            raise ImportError(name)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    monkeypatch.delitem(sys.modules, "pyarrow", raising=False)
    points = motion(np.zeros(1), [[0.0]], ("x",))
    with pytest.raises(InputError, match=r"Parquet needs pyarrow: pip install 'splinefeed\[parquet\]'"):
        save(points, tmp_path / "job.parquet")
    assert list(tmp_path.iterdir()) == []


def test_npz_is_plain_numpy_and_parquet_says_its_units(tmp_path: Path) -> None:
    import json

    import pyarrow.parquet

    points = motion(np.arange(5) * 1e-3, [np.arange(5.0), np.arange(5.0)], ("x", "theta"))
    save(points, tmp_path / "job.npz")
    with np.load(tmp_path / "job.npz", allow_pickle=False) as archive:
        assert sorted(archive) == ["curve", "feed", "metadata", "position", "s", "t", "u"]
        assert np.array_equal(archive["position"], points.position)
        assert json.loads(str(archive["metadata"]))["units"]["position"] == ["mm", "rad"]
    save(points, tmp_path / "job.parquet")
    schema = pyarrow.parquet.read_schema(tmp_path / "job.parquet")
    assert schema.names == ["t_s", "curve", "u", "s_mm", "feed_mm_s", "x_mm", "theta_rad"]
    assert schema.field("theta_rad").metadata == {b"unit": b"rad"}
    assert json.loads(schema.metadata[b"splinefeed"])["period_s"] == 1e-3


def test_every_format_is_a_choice_of_run() -> None:
    from splinefeed.cli.run import run

    choice = next(option for option in run.params if option.name == "formats")
    assert list(choice.type.choices) == list(FORMATS)
