"""A limit along the path that a developer adds: a line of the table, a row maker, an evaluator, and nothing else.

The package is copied, these three are written into the copy, and its commands run as a user runs them.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import splinefeed

#: How fast the direction of the tip turns, rad/s: kappa v.
LINE = """    turn_rate: float | None = limit(
        None, "turn rate", PLACES, 1, 1, angle=True, says="How fast the direction of the tip may turn."
    )
"""
ROWS = """

def turn_rate(at: Places, most: float) -> ModelRows:
    return ModelRows(top=(most * at.tip[0] / np.maximum(at.bend, TINY)) ** 2)


ROWS["turn_rate"] = turn_rate
"""
EVALUATOR = """

def turn_rate(at: TipPlaces) -> Array:
    return at.curvature


EVALUATORS["turn_rate"] = turn_rate
"""
FREE = ("--feed", "60", "--axis-accel", "500", "--axis-jerk", "20000", "--period", "2ms")
MOST = 200.0  # deg/s


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package and its new limit, to work in."""
    folder = tmp_path_factory.mktemp("package")
    own = Path(splinefeed.__file__).parent
    shutil.copytree(own, folder / "splinefeed", ignore=shutil.ignore_patterns("__pycache__"))
    table = folder / "splinefeed" / "limit_table.py"
    before, centripetal, after = table.read_text().partition("    centripetal: float | None = ")
    assert centripetal
    table.write_text(before + LINE + centripetal + after)
    for name, more in (("planner/path_rows.py", ROWS), ("checks/path_limits.py", EVALUATOR)):
        with (folder / "splinefeed" / name).open("a") as file:
            file.write(more)
    return folder


def ran(package: Path, *words: str, code: int = 0) -> str:
    """What a command prints in the folder of the package; its exit code is `code`."""
    environment = {**os.environ, "PYTHONPATH": str(package), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "splinefeed", *words],
        cwd=package,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


def test_a_new_limit_is_an_option_and_is_kept_named_and_reported(package: Path) -> None:
    assert "--turn-rate ANGULAR VELOCITY" in ran(package, "run", "--help")
    page = json.loads(ran(package, "run", "butterfly", *FREE, f"--turn-rate={MOST}deg/s", "--json", "-o", "out"))
    assert page["ok"]
    found = page["limits"]["turn_rate"]
    assert found["limit"] == pytest.approx(MOST)
    assert 0.98 < found["share"] <= 1.0 + 1e-6
    assert page["bound_by"]["turn_rate"] > 0.1
    report = (package / "out" / "report.html").read_text()
    assert "turn rate" in report


def test_a_new_limit_is_checked_read_from_files_and_left_a_reserve(package: Path) -> None:
    ran(package, "run", "butterfly", *FREE, "--no-figures", "-o", "free")
    (package / "limits.toml").write_text(f"feed = 60\nturn_rate = {MOST}\n")
    said = ran(package, "check", "free/setpoints.h5", "--path", "butterfly", "--limits", "limits.toml", code=1)
    assert "turn_rate: " in said
    assert "deg/s" in said
    code = (
        "import splinefeed as sf; limits = sf.Limits(feed=60.0, turn_rate=4.0)\n"
        "print(sf.planner.with_reserve(limits, top=2.0).turn_rate, sf.Limits.from_dict(limits.as_dict()).turn_rate)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(package)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split() == ["2.0", "4.0"]
