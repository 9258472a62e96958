"""What a sweep file asks: every run by its number, draws that depend on the seed alone, and every error at once."""

from __future__ import annotations

import math

import numpy as np
import pytest

from splinefeed.errors import InputError
from splinefeed.sweeps.spec import SpecError, from_dict, read

TEXT = """
name = "shop"
seed = 5
sources = ["circle?radius=2mm", "parts/*.json"]
[set]
machine = "xytheta"
period = "2ms"
[set.limits]
acceleration = "0.5m/s^2"
[grid]
"limits.feed" = [30, "3600mm/min"]
method = ["arc-length", "taylor-2"]
[list]
"limits.jerk" = [1000, 2000, 3000]
strategy = ["seven-phase", "seven-phase", "look-ahead"]
[random]
count = 4
"machine.x.load.inertia" = { uniform = [0.8, 1.2] }
"limits.chord_error" = { loguniform = ["1um", "10um"] }
corrections = [0, 1, 2]
"""


@pytest.fixture
def sweep(tmp_path):
    (tmp_path / "parts").mkdir()
    for name in ("b", "a"):
        (tmp_path / f"parts/{name}.json").write_text("{}")
    (tmp_path / "shop.toml").write_text(TEXT)
    return read(tmp_path / "shop.toml")


def test_every_run_has_its_number(sweep, tmp_path):
    assert len(sweep) == 3 * 2 * 2 * 3 * 4
    assert sweep.sources == ("circle?radius=2mm", str(tmp_path / "parts/a.json"), str(tmp_path / "parts/b.json"))
    tasks = [sweep.task(k) for k in range(len(sweep))]
    assert [task.index for task in tasks] == list(range(len(sweep)))
    assert len({(task.source, str(task.settings)) for task in tasks}) == len(sweep)
    first = tasks[0].settings
    assert first["limits.feed"] == 30.0
    assert tasks[-1].settings["limits.feed"] == 60.0
    assert first["limits.acceleration"] == 500.0
    assert first["period"] == 2e-3
    assert tasks[-1].settings["strategy"] == "look-ahead"
    assert tasks[-1].settings["limits.jerk"] == 3000.0
    with pytest.raises(InputError, match="run 144 is not one of the 144 runs"):
        sweep.task(144)


def test_draws_are_the_same_for_every_source_and_stay_in_their_range(sweep):
    tasks = [sweep.task(k) for k in range(len(sweep))]
    for k in range(4):
        same = [task.settings["machine.x.load.inertia"] for task in tasks[k::4]]
        assert len(set(same)) == 1
        assert 0.8 <= same[0] <= 1.2
        assert 1e-3 <= tasks[k].settings["limits.chord_error"] <= 1e-2
        assert tasks[k].settings["corrections"] in (0, 1, 2)
    assert len({task.settings["machine.x.load.inertia"] for task in tasks}) == 4


def test_distributions_are_what_they_are_called():
    spec = from_dict(
        {
            "sources": ["circle"],
            "random": {
                "count": 4000,
                "limits.feed": {"normal": [60, 2]},
                "limits.jerk": {"loguniform": [10, 1000]},
                "machine.x.load.inertia": {"uniform": [1, 3]},
            },
        }
    )
    drawn = [spec.task(k).settings for k in range(len(spec))]
    feed = np.array([each["limits.feed"] for each in drawn])
    assert abs(feed.mean() - 60.0) < 4 * 2.0 / math.sqrt(4000)
    assert feed.std() == pytest.approx(2.0, rel=0.05)
    assert np.median([each["limits.jerk"] for each in drawn]) == pytest.approx(100.0, rel=0.12)
    assert np.mean([each["machine.x.load.inertia"] for each in drawn]) == pytest.approx(2.0, rel=0.02)


def test_every_error_at_once(tmp_path):
    content = {
        "sorces": [],
        "sources": ["nothing*.dxf"],
        "seed": -1,
        "set": {"metod": "taylor-2", "limits": {"fed": 3}, "machine": "nomachine"},
        "grid": {"limits.feed": [-3], "method": "taylor-2", "strategy": ["fast"]},
        "list": {"limits.jerk": [1, 2], "limits.acceleration": [1]},
        "random": {
            "count": 0,
            "limits.feed": {"uniform": [3, 1]},
            "method": {"normal": [1, 2]},
            "period": {"beta": [1]},
        },
        "output": {"setpoints": 3},
    }
    with pytest.raises(SpecError) as error:
        from_dict(content, "bad.toml", tmp_path)
    said = "\n".join(error.value.problems)
    for part in (
        "sorces: is not part of a sweep; did you mean 'sources'?",
        "seed: -1 must be a whole number from 0",
        "random.count: 0 must be",
        "list: limits.jerk has 2 values, limits.acceleration has 1 values; give all as many",
        "set.metod: is not a setting; did you mean 'method'?",
        "set.limits.fed: 'fed' is not a limit; did you mean 'feed'?",
        "set.machine: ",
        "grid.limits.feed: -3 must be greater than 0",
        "grid.method: write a list of values",
        "grid.strategy: 'fast' is not a strategy",
        "random.limits.feed: uniform takes two numbers, the smaller first, not [3, 1]",
        "random.method: is not a number; give a list to choose from",
        "random.period.beta: ",
        "limits.feed: is in two tables",
        "output.setpoints: write setpoints = true",
        "nothing*.dxf: no such file or shape",
    ):
        assert part in said
    assert str(error.value).startswith("bad.toml: ")


def test_a_setting_may_be_a_machine_file_beside_the_spec(tmp_path):
    with pytest.raises(SpecError, match=r"machine\.AXIS\.PART\.FIELD"):
        from_dict({"sources": ["circle"], "grid": {"machine.x": [1.0]}})
    with pytest.raises(SpecError, match="a multiple of what the machine file says"):
        from_dict({"sources": ["circle"], "grid": {"machine.x.load.inertia": ["2kg"]}})
