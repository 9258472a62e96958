"""A contour that is drawn twice, in whatever description, is said. After torn#7 and Deepnest#135."""

from __future__ import annotations

import math
from pathlib import Path

import ezdxf
import pytest

from splinefeed.formats.registry import read_all

SQUARE = [(0, 0), (40, 0), (40, 30), (0, 30)]


def said(folder: Path, *draw: object, **options: bool) -> tuple[int, str]:
    """How many paths a drawing has, and what is said of contours that lie on others."""
    document = ezdxf.new("R2010", units=4)
    space = document.modelspace()
    for each in draw:
        each(space)  # type: ignore[operator]
    document.saveas(file := folder / "a.dxf")
    paths = read_all(file, **options)
    return len(paths), next((each for each in paths[0].findings if "described otherwise" in each), "")


def square(space) -> None:
    space.add_lwpolyline(SQUARE, close=True)


def from_another_corner(space) -> None:
    space.add_lwpolyline([*SQUARE[2:], *SQUARE[:2]], close=True)


def backwards(space) -> None:
    space.add_lwpolyline(SQUARE[::-1], close=True)


def as_lines(space) -> None:
    for a, b in zip(SQUARE, [*SQUARE[1:], SQUARE[0]], strict=True):
        space.add_line(a, b)


def split(space) -> None:
    space.add_lwpolyline([(0, 0), (15, 0), (40, 0), (40, 30), (21, 30), (0, 30)], close=True)


def ellipse(space) -> None:
    space.add_ellipse((5, 5), (0, 5), 1.0)


def circle(space) -> None:
    space.add_circle((5, 5), 5)


def two_arcs(space) -> None:
    space.add_arc((5, 5), 5, 20, 200)
    space.add_arc((5, 5), 5, 200, 20)


def bulges(space) -> None:
    space.add_lwpolyline([(0, 5, 1), (10, 5, 1)], format="xyb", close=True)


def octagon(space) -> None:
    turns = [k * math.pi / 4 for k in range(8)]
    space.add_lwpolyline([(5 + 5 * math.cos(t), 5 + 5 * math.sin(t)) for t in turns], close=True)


def notched(space) -> None:
    space.add_lwpolyline([*SQUARE[:2], (40, 14.9), (39.9, 15), (40, 15.1), *SQUARE[2:]], close=True)


@pytest.mark.parametrize(
    ("one", "other"),
    [(square, from_another_corner), (square, backwards), (square, as_lines), (as_lines, split), (split, backwards),
     (circle, two_arcs), (bulges, circle), (two_arcs, bulges), (two_arcs, ellipse)],
)  # fmt: skip
def test_the_same_contour_in_another_description_is_said(tmp_path, one, other):
    count, text = said(tmp_path, one, other)
    assert count == 2 and text.startswith("1 path(s) lie on others that are described otherwise, the first '0#2' on")
    assert said(tmp_path, one, other, repair=True)[0] == 1


@pytest.mark.parametrize(("one", "other"), [(circle, octagon), (square, notched), (square, circle)])
def test_contours_that_are_near_are_not_the_same(tmp_path, one, other):
    assert said(tmp_path, one, other) == (2, "")


def test_thousands_of_holes_take_no_longer(tmp_path):
    def grid(space):
        for k in range(2000):
            space.add_circle((k % 50, k // 50), 0.3)

    assert said(tmp_path, grid) == (2000, "")


def test_thousands_that_look_alike_are_not_compared_and_said(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=4)
    for k in range(400):
        document.modelspace().add_circle((0, 0), 5.0 + k * 1e-3)
    document.saveas(file := tmp_path / "a.dxf")
    paths = read_all(file)
    assert len(paths) == 400
    assert any("too many paths look alike" in each for each in paths[0].findings)


def test_lines_of_other_ends_are_not_compared(tmp_path: Path) -> None:
    document = ezdxf.new("R2010", units=4)
    for k in range(600):
        document.modelspace().add_line((0, 0), (100 + k * 1e-2, 100))
    document.saveas(file := tmp_path / "a.dxf")
    assert not any("too many paths look alike" in each for each in read_all(file)[0].findings)
