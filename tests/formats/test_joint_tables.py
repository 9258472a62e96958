"""Tables of joints: named by q1, j1 or joint1, up to nine, in rad unless the column says another unit."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import SplinefeedError

ROWS = [[0.1 * row * (k + 1) for k in range(9)] for row in range(12)]


def table(tmp_path: Path, head: str, columns: int, mark: str = ",") -> Path:
    file = tmp_path / "joints.csv"
    rows = (mark.join(f"{value:.6f}" for value in row[:columns]) for row in ROWS)
    file.write_text("\n".join([head.replace(",", mark), *rows, ""]))
    return file


@pytest.mark.parametrize(
    ("head", "axes"),
    [
        ("q1,q2,q3,q4,q5,q6", ("q1", "q2", "q3", "q4", "q5", "q6")),
        ("q1,q2,q3,q4,q5,q6,q7,q8,q9", tuple(f"q{k}" for k in range(1, 10))),
        ("Joint_1,Joint_2,Joint_3", ("joint1", "joint2", "joint3")),
        ("j1;j2", ("j1", "j2")),
        ('"Q1","Q2"', ("q1", "q2")),
    ],
)
def test_joints_are_axes_by_their_names(tmp_path: Path, head: str, axes: tuple[str, ...]) -> None:
    path = sf.read(table(tmp_path, head, len(axes), ";" if ";" in head else ","))
    assert path.axes == axes
    assert np.allclose(path(0.0), 0.0, atol=1e-3)
    assert np.allclose(path(path.length), ROWS[-1][: len(axes)], atol=1e-3)
    assert any("joints without a unit are in rad" in each for each in path.findings)


def test_a_column_says_the_unit_of_its_joint(tmp_path: Path) -> None:
    path = sf.read(table(tmp_path, "q1 (deg),q2 [rad],q3_mm", 3))
    assert np.allclose(path(path.length), [math.radians(1.1), 2.2, 3.3], atol=1e-3)
    assert not any("without a unit" in each for each in path.findings)


def test_other_columns_are_left_out_and_said(tmp_path: Path) -> None:
    path = sf.read(table(tmp_path, "t,q1,q2,effort", 4))
    assert path.axes == ("q1", "q2")
    assert any("2 of 4 columns are not named as axes" in each for each in path.findings)


@pytest.mark.parametrize(
    ("head", "reason"),
    [
        ("x,y,q1", "names joints (q1, ...) and places (x); which is the path? Rename the others"),
        ("q1,q1,q2", "two columns are called q1"),
        ("q1,q2 (kg),q3", "column q2: "),
        ("q1,q2", "does not name 3 columns, one of them x, y or a joint (q1)"),
    ],
)
def test_what_does_not_say_a_path_is_refused(tmp_path: Path, head: str, reason: str) -> None:
    with pytest.raises(SplinefeedError) as caught:
        sf.read(table(tmp_path, head, 3))
    assert reason in str(caught.value)


def test_they_are_planned_under_limits_by_joint(tmp_path: Path) -> None:
    path = sf.read(table(tmp_path, "q1,q2,q3,q4,q5,q6", 6))
    run = sf.run(path, sf.Limits(axis_velocity=1.0, axis_acceleration=5.0, axis_jerk=50.0))
    assert run.ok
