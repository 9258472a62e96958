"""What stands in heads, comments and units of drawings is read, or said in our words.

After OCCT#1346 (a comment behind parameters loses the next entities), grid-apps#299 and vpype#106 (px of other
programs), svgo#460 (numbers without blanks); IGES 5.3, 2.2.4.3 and 2.2.4.5; SVG 1.1, 7.5.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from splinefeed.errors import FormatError
from splinefeed.formats.registry import read_all


def test_comments_behind_the_parameters_of_iges(data_dir: Path, tmp_path: Path) -> None:
    text = (data_dir / "iges" / "comment.igs").read_text()
    (path,) = read_all(data_dir / "iges" / "comment.igs")
    assert path.closed and path.length == pytest.approx(50.0 + 40.0 + 50.0**0.5 * 0.0 + 4100.0**0.5)
    assert not path.findings
    behind = text.replace("50.0,0.0,0.0; ".ljust(14), "50.0,0.0,0.0;x", 1)  # on the line of the parameters itself
    assert behind != text
    (tmp_path / "a.igs").write_text(behind)
    assert read_all(tmp_path / "a.igs")[0].length == pytest.approx(path.length)


def test_a_missing_date_and_a_model_scale_of_iges_are_said(data_dir: Path) -> None:
    (path,) = read_all(data_dir / "iges" / "no_date.igs")
    assert path.length == 50.0
    assert path.findings[0] == "a date in the header of the file is missing or not valid; no curve depends on it"
    (path,) = read_all(data_dir / "iges" / "scale_half.igs")
    assert path.length == 2.0 and path.findings[0].startswith("the file has a model scale of 0.5: places are read as")


def svg(folder: Path, body: str, size: str = 'width="100mm" height="100mm"') -> Path:
    file = folder / "a.svg"
    file.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 100 100">{body}</svg>')
    return file


@pytest.mark.parametrize(
    ("tight", "wide"),
    [
        ("translate(40-5)", "translate(40 -5)"),
        ("matrix(1 0 0-1 0 40)", "matrix(1, 0, 0, -1, 0, 40)"),
        ("translate(.5.25)", "translate(0.5 0.25)"),
        ("scale(1e1-2)", "scale(10 -2)"),
        ("rotate(30-5+4)", "rotate(30, -5, 4)"),
    ],
)
def test_numbers_without_blanks_in_transforms(tmp_path: Path, tight: str, wide: str) -> None:
    ends = [
        read_all(svg(tmp_path, f'<path transform="{each}" d="M1 2L4 9"/>'))[0].curves[0].ends.tolist()
        for each in (tight, wide)
    ]
    assert ends[0] == ends[1]


@pytest.mark.parametrize(
    "wrong", ["translate(1,,2)", "translate(,1)", "translate(1 2 3)", "translate(1;2)", "scale(a)"]
)
def test_what_is_no_transform_stays_refused(tmp_path: Path, wrong: str) -> None:
    with pytest.raises(FormatError, match="transform"):
        read_all(svg(tmp_path, f'<path transform="{wrong}" d="M1 2L4 9"/>'))


@pytest.mark.parametrize(("units", "length"), [("pt", 25.4 / 7.2), ("mm", 10.0), ("0.5mm", 5.0), (None, 25.4 / 9.6)])
def test_what_a_px_is(tmp_path: Path, units: str | None, length: float) -> None:
    file = svg(tmp_path, '<path d="M0 50H10"/>', 'width="100" height="100px"')
    (path,) = read_all(file, **({} if units is None else {"units": units}))
    assert path.length == pytest.approx(length)
    assert bool(path.findings) == (units is None)


def test_a_page_in_mm_has_no_px_to_choose(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="the page has its size in mm; option units is for pages in px"):
        read_all(svg(tmp_path, '<path d="M0 50H10"/>'), units="pt")
    with pytest.raises(FormatError, match="one px is a length above 0"):
        read_all(svg(tmp_path, '<path d="M0 50H10"/>', 'width="100" height="100"'), units="0mm")
