"""Programs of people who run the machine, against a reader that shares nothing with ours (`tests/gcode_truth.py`).

`tests/data/public_programs.json` has repository, commit, licence and hash of each. None is kept here: they are read
where they lie as `build/public-files/OWNER+REPOSITORY/PATH`. docs/gcode-public-programs.md lists what was tried,
with the outcome.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gcode_truth
import splinefeed as sf
from splinefeed.programs.gcode.dialects import DIALECTS

DATA = Path(__file__).parents[2] / "data" / "public_programs.json"
FOLDER = Path(__file__).parents[3] / "build" / "public-files"
PROGRAMS: dict[str, dict[str, Any]] = json.loads(DATA.read_text())
THERE = [name for name in PROGRAMS if (FOLDER / name).is_file()]


def of_feed_moves(path: sf.Path) -> dict[str, Any]:
    """Length, time and box of the moves that have a feed."""
    fed = np.isfinite(path.feeds)
    lengths = np.diff(path.curve_starts)[fed]
    boxes = np.array([curve.bounding_box() for curve, moved in zip(path.curves, fed, strict=True) if moved])
    return {
        "length": float(lengths.sum()), "time": float((lengths / path.feeds[fed]).sum()),
        "low": boxes[:, 0].min(axis=0), "high": boxes[:, 1].max(axis=0),
    }  # fmt: skip


def compared(path: sf.Path, said: dict[str, Any]) -> None:
    found = of_feed_moves(path)
    assert found["length"] == pytest.approx(said["feed_length_mm"], rel=1e-5)
    assert found["time"] == pytest.approx(said["feed_time_s"], rel=1e-5, abs=0.01)
    for end in ("low", "high"):
        for axis, value in zip(path.axes, found[end], strict=True):
            if axis in "xyz":
                assert value == pytest.approx(said[f"{end}_mm"]["xyz".index(axis)], abs=2e-3), (end, axis)


@pytest.mark.parametrize("name", THERE)
def test_a_public_program_is_as_long_and_as_large_and_takes_as_long(name: str, tmp_path: Path) -> None:
    said = PROGRAMS[name]
    assert hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() == said["sha256"]
    file = Path(shutil.copy(FOLDER / name, tmp_path))
    if "sub" in said:
        shutil.copy(FOLDER / said["sub"], tmp_path / said["sub_name"])
    compared(sf.read(file, dialect=said["dialect"], repair=said.get("repair", False)), said)


def test_the_list_names_three_programs_of_every_dialect_and_where_they_are_from() -> None:
    by_dialect: dict[str, int] = {}
    for name, said in PROGRAMS.items():
        assert name.count("/") >= 1 and "+" in name.partition("/")[0]
        assert {"commit", "licence", "sha256", "dialect", "feed_length_mm", "feed_time_s"} <= said.keys(), name
        by_dialect[said["dialect"]] = by_dialect.get(said["dialect"], 0) + 1
    held = {k for k, v in by_dialect.items() if v >= 3}
    assert held == set(DIALECTS) - {"printer", "mach4"}  # which is Marlin's and Klipper's; which has its manual alone


PROGRAM = ["G21 G90", "G0 X0 Y0 Z5", "G1 Z-1 F100", "X20 F600", "G2 X30 Y10 I0 J10", "G3 X40 Y20 R10", "G0 Z5", "M30"]


def test_that_reader_and_ours_agree_on_a_program_made_here(tmp_path: Path) -> None:
    file = tmp_path / "part.ngc"
    file.write_text("\n".join(PROGRAM))
    said = gcode_truth.truth(file, "linuxcnc")
    # 6 down, 20 along, 3/4 of a circle and a quarter of another, both of radius 10
    assert said["feed_length_mm"] == pytest.approx(26.0 + 20.0 * np.pi, abs=1e-3)
    assert said["feed_time_s"] == pytest.approx(3.6 + (20.0 + 20.0 * np.pi) / 10.0, abs=1e-3)
    compared(sf.read(file), said)
