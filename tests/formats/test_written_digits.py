"""Ends join as far apart as the last decimal of a file leaves them, and farther ones are said; z noise is flat.

After CadQuery#996 and maker.js#480 (slots and plates exported with three decimals) and openscad#4268 (z of 1e-9).
"""

from __future__ import annotations

from pathlib import Path

import ezdxf
import pytest

from splinefeed.formats.registry import read_all


def dxf(folder: Path, *lines: tuple[tuple[float, ...], tuple[float, ...]]) -> Path:
    """A drawing of lines, mm."""
    document = ezdxf.new("R2010", units=4)
    for begin, end in lines:
        document.modelspace().add_line(begin, end)
    document.saveas(file := folder / "a.dxf")
    return file


def test_a_rounded_plate_of_three_decimals_is_one_contour(data_dir: Path) -> None:
    file = data_dir / "dxf" / "three_decimals.dxf"
    (path,) = read_all(file)
    assert path.closed and path.length == pytest.approx(2 * (84.6 + 29.0) + 2 * 3.14159265 * 6.35, abs=2e-2)
    assert path.findings[0].startswith("8 gap(s) of up to 0.000775 mm closed: ends were moved, each by half, as far as")
    assert len(read_all(file, tolerance=1e-6)) == 8  # what the user says holds


@pytest.mark.parametrize(
    ("x", "paths"), [(10.12, 1), (10.121, 1), (10.122, 2), (10.1201, 1), (10.1202, 2), (10.13, 2)]
)  # with 10.120 beside it: 3 decimals allow 0.0015 mm, 4 decimals 0.00015 mm
def test_how_far_the_last_decimal_lets_ends_be(tmp_path: Path, x: float, paths: int) -> None:
    file = dxf(tmp_path, ((0.0, 0.0), (10.12, 0.0)), ((x, 0.0), (20.0, 5.125)))
    found = read_all(file)
    assert len(found) == paths
    if paths == 2:
        assert any("a tolerance of" in each and "would join them" in each for each in found[0].findings)


def test_numbers_with_all_their_digits_join_as_before_and_what_is_close_is_said(tmp_path: Path) -> None:
    third = 1.0 / 3.0
    found = read_all(dxf(tmp_path, ((third, 0.0), (50.002, 0.0)), ((50.0, 0.0), (50.0, 30.0))))
    assert len(found) == 2 and "0.002 mm at (50, 0); a tolerance of 0.0021 mm would join them" in found[0].findings[0]
    found = read_all(dxf(tmp_path, ((third, 0.0), (50.0, 0.0)), ((60.0, 0.0), (50.0, 30.0))))
    assert len(found) == 2 and not found[0].findings


def test_whole_numbers_say_nothing_of_rounding(tmp_path: Path) -> None:
    assert len(read_all(dxf(tmp_path, ((0, 0), (50, 0)), ((51, 0), (60, 0))))) == 2


def test_an_svg_of_three_decimals(tmp_path: Path) -> None:
    file = tmp_path / "a.svg"
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">'
    file.write_text(f'{head}<path d="M0 0L10.123 7.457"/><path d="M10.124 7.457L30 3"/></svg>')
    (path,) = read_all(file)
    assert len(path.curves) == 2 and path.findings[0].startswith("1 gap(s) of up to 0.001 mm closed")
    file.write_text(f'{head}<path d="M0 0L10.123 7.457"/><path d="M10.124 7.457L30.12345 3"/></svg>')
    assert len(read_all(file)) == 2


@pytest.mark.parametrize(("z", "axes"), [(1e-9, "xy"), (9e-7, "xy"), (1e-3, "xyz")])
def test_z_below_what_paths_resolve_is_flat(tmp_path: Path, z: float, axes: str) -> None:
    (path,) = read_all(dxf(tmp_path, ((0, 0, z), (50, 0, 0))))
    assert "".join(path.axes) == axes and bool(path.findings) == (axes == "xy")
