"""Limits that a developer adds.

Along the path: a line of the table, a row maker, an evaluator, and nothing else. By a model: a row of the table and one
class, that of docs/code-overview.md. The package is copied, these are written into the copy, and its commands run as a
user runs them.
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
from docs_pages import ROOT, blocks
from splinefeed.limit_table import MODELS, LimitKind

#: How fast the direction of the tip turns, rad/s: kappa v; and the jerk across the path, mm/s^3: |dkappa / ds| v^3.
LINE = """    turn_rate: float | None = limit(
        None, "turn rate", PLACES, 1, 1, angle=True, says="How fast the direction of the tip may turn."
    )
    lateral_jerk: float | None = limit(None, "lateral jerk", PLACES, 3, 3, says="Jerk by a change of curvature.")
"""
ROWS = """

def turn_rate(at: Places, most: float) -> ModelRows:
    return ModelRows(top=(most * at.tip[0] / np.maximum(at.bend, TINY)) ** 2)


def lateral_jerk(at: Places, most: float) -> ModelRows:
    one, two, three = (at.of_tip[:, k] for k in (1, 2, 3))
    share = np.sum(one * two, axis=1) / np.maximum(np.sum(one * one, axis=1), TINY)
    across = two - share[:, None] * one
    turned = np.sum(across * three, axis=1) / np.maximum(at.bend, TINY) - 3.0 * share * at.bend
    return ModelRows(top=(most / np.maximum(np.abs(turned), TINY)) ** (2.0 / 3.0))


ROWS |= {"turn_rate": turn_rate, "lateral_jerk": lateral_jerk}
"""
EVALUATOR = """

def turn_rate(at: TipPlaces) -> Array:
    return at.curvature


def lateral_jerk(at: TipPlaces) -> Array:
    one, two, three = at.c[1:4]
    square, along, kappa = np.sum(one * one, axis=0), np.sum(one * two, axis=0), at.curvature
    across = two - along / square * one
    turned = np.sum(across * three, axis=0) / np.sqrt(np.sum(across * across, axis=0)) - 3.0 * along * kappa
    return np.abs(turned) / square**1.5


EVALUATORS |= {"turn_rate": turn_rate, "lateral_jerk": lateral_jerk}
"""
#: The class of the page, and its row.
MODEL = next(
    block.text for block in blocks(ROOT / "docs/code-overview.md") if "class AxisPower(Modelled)" in block.text
)
MODEL_ROW = """    LimitKind("axis_power", "axis power", MODELS, 3, unit=("mm^2/s^3", "rad^2/s^3"), filed=False),
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
    rows, torque, rest = after.partition('    LimitKind("torque", ')
    assert centripetal
    assert torque
    table.write_text(before + LINE + centripetal + rows + MODEL_ROW + torque + rest)
    (folder / "splinefeed" / "records" / "axis_power.py").write_text(MODEL)
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
    assert python(package, code).split() == ["2.0", "4.0"]


def test_a_new_limit_may_need_the_third_derivative(package: Path) -> None:
    most = 500.0  # mm/s^3
    page = json.loads(ran(package, "run", "butterfly", *FREE, f"--lateral-jerk={most}", "--json", "-o", "third"))
    assert page["ok"]
    assert 0.9 < page["limits"]["lateral_jerk"]["share"] <= 1.0 + 1e-6
    assert page["bound_by"]["lateral_jerk"] > 0.1
    ran(package, "run", "butterfly", *FREE, "--no-figures", "-o", "loose")
    words = ("check", "loose/setpoints.h5", "--path", "butterfly", f"--lateral-jerk={most}")
    assert "lateral_jerk: " in ran(package, *words, code=1)


def test_a_new_model_is_kept_and_says_its_unit(package: Path) -> None:
    code = """
import splinefeed as sf
from splinefeed.records.axis_power import AxisPower
path = sf.shapes.butterfly()
free = dict(feed=60.0, axis_acceleration=500.0, axis_jerk=20000.0)
power = AxisPower({"x": 4000.0, "y": 3000.0})
run = sf.run(path, sf.Limits(**free, modelled=[power]))
loose = sf.run(path, sf.Limits(**free))
other = sf.check(loose.points, path, sf.Limits(**free, modelled=[power]))
print(run.verdict.ok, 0.98 < run.verdict.limits["axis_power.x"].share <= 1.0 + 1e-6, other.ok)
print(other.problems[0])
print(sf.records.unit_of("axis_power.a"), sf.records.shown_by("axis_power.a", "a"))
"""
    kept, problem, unit = python(package, code).splitlines()
    assert kept == "True True False"
    assert problem.startswith("axis_power.")
    assert "mm^2/s^3" in problem
    assert unit == "rad^2/s^3 1.0"


def test_a_model_without_a_unit_is_refused() -> None:
    with pytest.raises(ValueError, match="axis_power: say its unit"):
        LimitKind("axis_power", "axis power", MODELS, 3, filed=False)


def python(package: Path, code: str) -> str:
    """What a program prints that imports the package of the folder."""
    environment = {**os.environ, "PYTHONPATH": str(package), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=package, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
