"""Programs of a shop from their text to checked setpoints and a report."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

import splinefeed as sf

#: A small mill, and the period of its control; look-ahead, as controls plan.
LIMITS = sf.Limits(feed=150, axis_acceleration=2000, axis_jerk=50_000)
PERIOD = 4e-3


def ran(file: Path, folder: Path, **options: object) -> sf.Run:
    run = sf.run(sf.read(file, **options), LIMITS, period=PERIOD, strategy="look-ahead")
    assert run.verdict.ok
    sf.report(run, folder / "out")
    assert "report.html" in {each.name for each in (folder / "out").iterdir()}
    return run


def plate(data: Path, number: str = "13") -> str:
    return gzip.decompress((data / "cycle-time" / f"plate-{number}.nc.gz").read_bytes()).decode()


@pytest.mark.parametrize(("name", "curves", "length", "tools"), [
    ("box-op2", 1168, 1735.63, ["T3 M6", "T21 M6"]),
    ("box-op3", 2954, 5206.66, ["T3 M6", "T4 M6", "T21 M6"]),
])  # fmt: skip
def test_a_box_is_run_and_reported(
    tmp_path: Path, data_dir: Path, name: str, curves: int, length: float, tools: list[str]
) -> None:
    run = ran(data_dir / "cycle-time" / f"{name}.nc", tmp_path)
    assert len(run.path.curves) == curves
    assert run.path.length == pytest.approx(length, abs=0.01)
    assert [marker.text for marker in run.path.markers if "M6" in marker.text] == tools


def test_one_tool_of_a_plate_is_run_and_reported(tmp_path: Path, data_dir: Path) -> None:
    lines = plate(data_dir).splitlines()
    one = tmp_path / "one.nc"
    one.write_text("\n".join([*lines[:34], "M30", ""]))  # up to the change to the next tool
    run = ran(one, tmp_path, from_line=23)
    assert "T15 M6" in {marker.text for marker in run.path.markers}


@pytest.mark.slow
@pytest.mark.parametrize("number", ["12", "13", "15"])
def test_a_whole_plate_is_run_and_reported(tmp_path: Path, data_dir: Path, number: str) -> None:
    file = tmp_path / f"plate-{number}.nc"
    file.write_text(plate(data_dir, number))
    run = ran(file, tmp_path)
    assert len(run.path.curves) == 4120
    assert run.path.length == pytest.approx(18409.57, abs=0.01)
    assert sum("M6" in marker.text for marker in run.path.markers) == 7
