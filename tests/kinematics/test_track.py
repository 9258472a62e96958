"""Track: whatever a motion goes along is planned and interpolated by what it says of itself."""

from __future__ import annotations

import ast
import re
from dataclasses import replace
from pathlib import Path as File

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import InputError, LimitsError
from splinefeed.paths.track import Track

ROOT = File(sf.__file__).parent
KINDS = {"Path", "ToolPath", "JointPath", "ArmPath", "WaypointPath", "PathParts", "Job", "Track"}
PERIOD = 1e-3


class Beside(Track):
    """A path and an axis w that is half of x: a kind of track that no room knows."""

    def __init__(self, path: sf.Path) -> None:
        self.path, self.name, self.axes, self.linear = path, path.name, ("w",), 1
        self.kinematics = None

    beside = ("tip.x", "tip.y")

    length = property(lambda self: self.path.length)
    stops = property(lambda self: self.path.stops)
    dwells = property(lambda self: self.path.dwells)
    breaks = property(lambda self: self.path.breaks)
    weights = property(lambda self: np.array([0.0, 1.0, 1.0]))
    tip_path = property(lambda self: self.path)
    tip_columns = property(lambda self: slice(1, 3))
    pieces = property(lambda self: self.path.pieces)
    reach = property(lambda self: tuple(0.5 * each[:1] for each in self.path.reach))

    def __call__(self, s):
        return 0.5 * self.path(s)[..., :1]

    def derivatives(self, s, row=None):
        d = self.path.derivatives(s, row)
        return np.concatenate([0.5 * d[:, :, :1], d], axis=2)

    def positions(self, curve, u, s, tip):
        return 0.5 * tip[:, :1]

    def check_travel(self, travel):
        pass

    def check_limits(self, limits):
        pass

    def between_ticks(self, d):
        return None, None

    def chords(self, s, r, places):
        return np.arange(len(s) - 1), np.zeros(len(s) - 1), None

    def rounding(self, s, r):
        return 8.0 * np.spacing(np.max(np.abs(r), axis=0))


def test_a_kind_of_track_that_nobody_knows_is_planned_within_its_limits():
    path = sf.shapes.butterfly()
    track = Beside(path)
    limits = sf.Limits(feed=60.0, axis_velocity={"w": 20.0}, axis_acceleration={"w": 200.0}, axis_jerk={"w": 8000.0})
    law = sf.plan(track, limits, period=PERIOD)
    points = sf.interpolate(track, law)
    assert points.axes == ("w",)
    np.testing.assert_allclose(points.position, 0.5 * path.evaluate(points.curve, points.u)[:, 0, :1], atol=1e-12)
    w = np.concatenate([points.position[:1]] * 3 + [points.position] + [points.position[-1:]] * 3)
    worst = [np.abs(np.diff(w, k, axis=0)).max() / PERIOD**k for k in (1, 2, 3)]
    assert np.all(np.array(worst) <= np.array([20.0, 200.0, 8000.0]) * (1 + 2e-6))
    assert max(np.array(worst) / [20.0, 200.0, 8000.0]) > 0.95
    twice = sf.Limits(
        feed=60.0,
        axis_velocity={"x": 40.0},
        axis_acceleration={"x": 400.0, "y": 1e9},
        axis_jerk={"x": 16000.0, "y": 1e12},
    )
    own = sf.plan(path, twice, period=PERIOD, strategy="time-optimal")
    assert law.duration == pytest.approx(own.duration, rel=0.01)


LIMITS = sf.Limits(feed=60.0, axis_velocity={"w": 20.0}, axis_acceleration={"w": 200.0}, axis_jerk={"w": 8000.0})


class WithTip(Beside):
    """The axes of a path, which carry the tip, and one beside them."""

    beside = ()
    weights = property(lambda self: np.array([1.0, 1.0, 0.0]))
    tip_columns = property(lambda self: slice(0, 2))
    reach = property(lambda self: tuple(np.append(each, 0.5 * each[0]) for each in self.path.reach))

    def __init__(self, path: sf.Path) -> None:
        super().__init__(path)
        self.axes, self.linear = (*path.axes, "w"), 3

    def __call__(self, s):
        return np.concatenate([self.path(s), 0.5 * self.path(s)[..., :1]], axis=-1)

    def derivatives(self, s, row=None):
        d = self.path.derivatives(s, row)
        return np.concatenate([d, 0.5 * d[:, :, :1]], axis=2)

    def positions(self, curve, u, s, tip):
        return np.concatenate([tip, 0.5 * tip[:, :1]], axis=1)


class WrongBend(Beside):
    """Its second derivative is a thousandth too large."""

    def derivatives(self, s, row=None):
        d = super().derivatives(s, row).copy()
        d[:, 2, 0] *= 1.001
        return d


class WrongPlace(Beside):
    """Its positions are a millionth too large for its derivatives."""

    def __call__(self, s):
        return (1.0 + 1e-6) * super().__call__(s)


@pytest.fixture(scope="module")
def planned() -> tuple[sf.Path, sf.TimeLaw, sf.Setpoints]:
    path = sf.shapes.butterfly()
    law = sf.plan(Beside(path), LIMITS, period=PERIOD)
    return path, law, sf.interpolate(Beside(path), law)


def test_a_kind_of_track_that_nobody_knows_is_checked_and_run(planned) -> None:
    path, law, points = planned
    verdict = sf.check(points, Beside(path), LIMITS, law=law)
    assert verdict.ok and set(verdict.limits) >= {"axis_velocity.w", "axis_acceleration.w", "axis_jerk.w"}
    assert verdict.limits["axis_jerk.w"].share > 0.99
    (note,) = (each for each in verdict.notes if "judged by the positions of w alone" in each)
    assert float(note.split("within ")[1].split()[0]) < 1e-7
    run = sf.run(Beside(path), LIMITS)
    assert run.verdict.ok and 0.99 * 8000.0 < run.numbers()["axes"]["w"]["jerk"] <= 8000.0
    assert sf.run(WithTip(path), LIMITS).verdict.ok


def test_setpoints_off_a_track_of_ones_own_are_found(planned) -> None:
    path, _law, points = planned
    moved = points.position.copy()
    moved[300] += 1e-6
    (problem,) = sf.check(replace(points, position=moved), Beside(path), sf.Limits(feed=60.0)).problems
    assert problem.startswith("tick 300 ") and "from where the track has it" in problem
    tighter = replace(LIMITS, axis_jerk={"w": 4000.0})
    (problem,) = sf.check(points, Beside(path), tighter).problems
    assert problem.startswith("axis_jerk.w")


def test_wrong_derivatives_and_positions_of_a_track_are_found(planned) -> None:
    path, law, points = planned
    problems = sf.check(points, WrongBend(path), LIMITS, law=law).problems
    assert any(each.startswith("track: its derivative 2 of w by length is off by 0.00") for each in problems)
    problems = sf.check(points, WrongPlace(path), LIMITS, law=law).problems
    assert any("from where the track has it" in each for each in problems)


def test_what_is_not_checked_of_axes_beside_the_tip_is_refused(planned) -> None:
    path, _law, points = planned
    with pytest.raises(LimitsError, match="do not carry the tip"):
        sf.check(points, Beside(path), replace(LIMITS, axis_velocity_step={"w": 1.0}))
    with pytest.raises(InputError, match="no u"):
        sf.check(replace(points, u=np.full(len(points), np.nan)), Beside(path), LIMITS)


def test_axes_say_their_units():
    path = sf.Path.polyline([[0.0, 0.0, 0.0], [10.0, 0.0, 1.0]], ("x", "y", "c"))
    assert path.axis_units == ("mm", "mm", "deg")


def test_no_room_asks_which_class_a_path_is():
    """No isinstance of a kind of path outside the rooms of paths and kinematics."""
    found = []
    for file in sorted(ROOT.rglob("*.py")):
        if file.relative_to(ROOT).parts[0] in ("paths", "kinematics"):
            continue
        text = file.read_text(encoding="utf-8")
        of_files = "from pathlib import Path\n" in text
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "isinstance":
                names = {each.id for each in ast.walk(node.args[1]) if isinstance(each, ast.Name)}
                names |= {each.attr for each in ast.walk(node.args[1]) if isinstance(each, ast.Attribute)}
                asked = names & KINDS - ({"Path"} if of_files else set())
                found += [f"{file.relative_to(ROOT)}:{node.lineno}: {name}" for name in asked]
    assert not found


class Kinked(Beside):
    """An axis that bends at a place of which the track says nothing."""

    at = 100.3

    def __call__(self, s):
        return super().__call__(s) + 4e-5 * np.abs(s - self.at)[..., None]

    def derivatives(self, s, row=None):
        d = super().derivatives(s, row)
        d[:, 0, 0] += 4e-5 * np.abs(s - self.at)
        d[:, 1, 0] += 4e-5 * np.sign(s - self.at)
        return d

    def positions(self, curve, u, s, tip):
        return super().positions(curve, u, s, tip) + 4e-5 * np.abs(s - self.at)[:, None]


@pytest.mark.parametrize(("kind", "said"), [(Beside, False), (Kinked, True)])
def test_places_where_derivatives_cannot_be_told_from_positions_are_said(kind, said):
    track = kind(sf.Path([sf.NurbsCurve.bezier([[0, 0], [60, 90], [140, -40], [200, 20]])]))
    law = sf.plan(track, LIMITS, period=PERIOD)
    verdict = sf.check(sf.interpolate(track, law), track, LIMITS, law=law)
    assert verdict.ok, verdict.problems
    places = [re.search(r"the first at s = ([\d.]+) mm, derivatives", each) for each in verdict.notes]
    found = [float(each[1]) for each in places if each]
    assert found == (pytest.approx([Kinked.at], abs=1.0) if said else [])
