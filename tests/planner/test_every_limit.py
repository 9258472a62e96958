"""A limit that is given is kept, by `check`, or refused by name: every field of Limits, by every strategy."""

from __future__ import annotations

import json
import math
from dataclasses import fields
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import splinefeed as sf
from splinefeed.cli.main import command_line
from splinefeed.errors import LimitsError
from splinefeed.limit_table import ENDS as ENDS_OF_PATH
from splinefeed.limit_table import PATH as ALONG_PATH
from splinefeed.limit_table import TRAVEL
from splinefeed.machine.machine import Machine
from splinefeed.planner.planning import STRATEGIES, strategy_for
from splinefeed.records import TABLE
from splinefeed.runs.contour_feed import tune_feed
from splinefeed.studio.settings import SettingsError, resolve
from splinefeed.sweeps.spec import Task
from splinefeed.sweeps.work import FAILED, row_of

PERIOD = 1e-3
#: A wave, and behind a corner of 45 degrees a line, at rest at both ends.
PATH = sf.Path(
    [
        sf.NurbsCurve.bezier([[0, 0], [10, 25], [20, -20], [30, 15], [40, 0]]),
        sf.NurbsCurve(1, [0, 0, 1, 1], [[40, 0], [60, 5]]),
    ]
)
SHAPE = "butterfly"
#: What seven-phase needs, and all that it is given where a test is about another limit.
ALONG = {"feed": 60.0, "acceleration": 500.0, "jerk": 20000.0}


def model(q, v, a):
    return a * (2.0 + np.cos(q / 10.0)) - 0.1 * v**2 * np.sin(q / 10.0)


#: Slow near both ends of its travel of 0 to 60 mm.
LAW = sf.records.VelocityByPosition({"x": lambda q: (-np.sqrt(8.0 * (q + 5.0)), np.sqrt(8.0 * (65.0 - q)))})
#: Each limit so tight that it binds, and, where ALONG is not enough for that, what a motion goes beyond it under.
TIGHT = {
    "feed": 20.0,
    "acceleration": 200.0,
    "jerk": 5000.0,
    "deceleration": 200.0,
    "deceleration_jerk": 5000.0,
    "start_feed": 10.0,
    "end_feed": 10.0,
    "chord_error": 2e-5,
    "centripetal": 100.0,
    "orientation_error": 1e-4,
    "axis_velocity": 20.0,
    "axis_acceleration": 200.0,
    "axis_jerk": 5000.0,
    "axis_velocity_step": 2.0,
    "axis_minimum": {"x": 1.0},
    "axis_maximum": {"x": 59.0},
    "combinations": {
        "sum": sf.records.Combination(weights={"x": 1.0, "y": -1.0}, velocity=40.0, acceleration=300.0, jerk=5e3)
    },
    "torque": sf.records.Torque(model, {"x": 500.0, "y": 300.0}),
    "torque_rate": sf.records.TorqueRate(model, {"x": 6000.0, "y": 8000.0}),
    "axis_velocity_law": LAW,
    "axis_approach": sf.records.Approach(LAW, {"x": 10.0}),
}
LOOSE = {"axis_velocity_step": 20.0}
NAMES = [each.name for each in TABLE]
#: Those that Limits takes as a list.
MODELLED = [name for name in NAMES if name not in {each.name for each in fields(sf.Limits)}]
ENDS = {"axis_minimum": {"x": 0.0}, "axis_maximum": {"x": 60.0}}
STREAM = "stream"
#: What is not a limit along the path alone, and a field of Limits.
BEYOND = [
    each.name for each in TABLE if each.bounds not in (ALONG_PATH, ENDS_OF_PATH, TRAVEL) and each.name not in MODELLED
]


def limits(name: str, value: object) -> sf.Limits:
    """ALONG and one limit; the travel of an axis has two ends."""
    travel = ENDS if name in ENDS else {}
    if name in MODELLED:
        return sf.Limits(**ALONG, modelled=[value])
    return sf.Limits(**{**ALONG, **travel, name: value})


def motion(given: sf.Limits, how: str) -> tuple[sf.Setpoints, sf.TimeLaw | None]:
    """Setpoints by a strategy, with their law, or streamed."""
    if how == STREAM:
        return sf.Setpoints.joined(list(sf.runs.stream_setpoints(PATH, given, period=PERIOD))), None
    law = sf.plan(PATH, given, strategy=how, period=PERIOD)
    return sf.interpolate(PATH, law), law


def exceeded(motion: tuple[sf.Setpoints, sf.TimeLaw | None], given: sf.Limits) -> list[str]:
    """What `check` says of the setpoints, and of the feed at both ends."""
    points, law = motion
    found = list(sf.check(points, PATH, given, law=law).problems)
    for name, feed in (("start_feed", points.feed[0]), ("end_feed", points.feed[-1])):
        if law is not None and abs(feed - getattr(given, name)) > 1e-6:
            found.append(f"{name}: {feed}")
    return found


def test_every_limit_is_tried():
    assert set(TIGHT) == set(NAMES)
    assert {*(each.name for each in fields(sf.Limits)), *MODELLED} == {*NAMES, "modelled"}
    assert {"seven-phase", "look-ahead", "time-optimal"} <= set(STRATEGIES)


@pytest.mark.parametrize("how", [*STRATEGIES, STREAM])
@pytest.mark.parametrize("name", NAMES)
def test_a_limit_is_kept_or_refused(name, how):
    tight = limits(name, TIGHT[name])
    if name == "orientation_error":  # this path has no tool axis; test_tool.py has one
        with pytest.raises(LimitsError, match=r"^orientation_error: "):
            motion(tight, how)
        return
    if name in ENDS:  # no motion is within: the path itself is not
        with pytest.raises(LimitsError, match=r"the path goes to x = .*; its travel allows at"):
            motion(tight, how)
        kept = limits(name, ENDS[name])
        assert exceeded(motion(kept, how), kept) == []
        return
    loose = limits(name, LOOSE[name]) if name in LOOSE else sf.Limits(**ALONG)
    if how != STREAM and name not in STRATEGIES[how].holds:
        with pytest.raises(LimitsError, match=rf"^{name}: the {how} strategy cannot hold it; choose time-optimal or "):
            motion(tight, how)
        if name not in LOOSE:  # nor does it hold this by itself
            assert exceeded(motion(loose, how), tight)
        return
    assert exceeded(motion(tight, how), tight) == []
    if how != STREAM or name not in ("start_feed", "end_feed"):
        assert exceeded(motion(loose, how), tight), "the limit does not bind"


def named(given: dict, strategy: str | None) -> dict:
    """What the page of the studio sends."""
    return {"source": {"shape": SHAPE}, "limits": given, **({} if strategy is None else {"strategy": strategy})}


def swept(given: dict, strategy: str | None) -> str:
    settings = {f"limits.{name}": value for name, value in given.items()}
    row = row_of(Task(0, SHAPE, {**settings, **({} if strategy is None else {"strategy": strategy})}))
    if row["status"] == FAILED:
        raise LimitsError(row["error"])
    return row["strategy"]


def typed(command: tuple[str, ...], given: dict, strategy: str | None) -> str:
    """The strategy that a command of the command line names in its answer."""
    spelled = {"acceleration": "accel", "axis_acceleration": "axis-accel"}
    words = [word for name, value in given.items() for word in (f"--{spelled.get(name, name)}", str(value))]
    words += [] if strategy is None else ["--strategy", strategy]
    result = CliRunner().invoke(command_line, [*command, *words, "--json"])
    if result.exit_code == 2:
        raise LimitsError(result.stderr)
    return str(json.loads(result.stdout)["strategy"])


def served(given: dict, strategy: str | None) -> str:
    tuning = tune_feed(PATH, sf.Limits(**given), Machine.load("xytheta"), 1.0, period=1e-3,
                       strategy=strategy, vary="feed")  # fmt: skip
    return tuning.trials[-1].law.strategy


#: Every way from limits to a motion, and the name of the strategy that it takes.
WAYS = {
    "plan": lambda given, strategy: sf.plan(PATH, sf.Limits(**given), strategy=strategy, period=PERIOD).strategy,
    "run": lambda given, strategy: sf.run(PATH, sf.Limits(**given), strategy=strategy).law.strategy,
    "tune_feed": served,
    "sweep": swept,
    "studio": lambda given, strategy: resolve(named(given, strategy), Path()).strategy,
    "splinefeed plan": partial(typed, ("plan", SHAPE)),
    "splinefeed compare": partial(typed, ("compare", SHAPE, "--methods", "arc-length")),
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_in_goes_through_the_rule(way):
    taken, beyond = WAYS[way], {**ALONG, "axis_acceleration": 300.0}
    assert taken(ALONG, None) == "seven-phase"
    assert taken(beyond, None) == "time-optimal"
    with pytest.raises(
        (LimitsError, SettingsError), match="axis_acceleration: the seven-phase strategy cannot hold it"
    ):
        taken(beyond, "seven-phase")


@pytest.mark.parametrize(
    ("given", "strategy"),
    [
        (ALONG, "seven-phase"),
        ({**ALONG, "deceleration": 100.0, "deceleration_jerk": 900.0, "start_feed": 1.0, **ENDS}, "seven-phase"),
        ({**ALONG, "chord_error": math.inf, "centripetal": math.inf}, "seven-phase"),
        ({"feed": 60.0, "acceleration": 500.0}, "time-optimal"),  # without jerk seven-phase makes no law
        *[({**ALONG, name: value}, "time-optimal") for name, value in TIGHT.items() if name in BEYOND],
    ],
)
def test_without_a_strategy_the_limits_choose_it(given, strategy):
    limits = sf.Limits(**given)
    assert strategy_for(limits) == strategy
    assert strategy_for(limits, strategy) == strategy


def test_every_limit_that_is_too_much_is_named():
    given = sf.Limits(**ALONG, axis_velocity={"x": 50}, chord_error=1e-3, axis_jerk=900)
    with pytest.raises(LimitsError) as caught:
        strategy_for(given, "seven-phase")
    assert str(caught.value) == (
        "chord_error, axis_velocity, axis_jerk: the seven-phase strategy cannot hold them; choose time-optimal or "
        "look-ahead, or leave the strategy open"
    )


@pytest.mark.parametrize("strategy", [None, "look-ahead", "time-optimal"])
def test_a_chord_error_needs_the_period(strategy):
    with pytest.raises(LimitsError, match="chord_error: needs the servo period"):
        sf.plan(PATH, limits("chord_error", 1e-3), strategy=strategy)


def test_what_is_no_path_is_refused():
    line = SimpleNamespace(length=10.0, stops=())
    with pytest.raises(sf.errors.InputError, match="plan: expected Path first, got SimpleNamespace"):
        sf.plan(line, sf.Limits(**ALONG))
    assert sf.plan(sf.Path.polyline([[0.0], [10.0]]), sf.Limits(**ALONG)).strategy == "seven-phase"
