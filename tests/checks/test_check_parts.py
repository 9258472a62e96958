"""The check by parts says what the check of the whole says, wherever the path is cut."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.checks.check import Check
from splinefeed.paths.smoothing import smoothed
from splinefeed.runs.long_path import parts_of

PERIOD = 1e-3
LIMITS = sf.Limits(
    feed=60, axis_velocity=50, axis_acceleration=500, axis_jerk=20000, axis_velocity_step={"x": 2.0, "y": 2.0, "c": 0.5}
)


def program() -> sf.Path:
    """Lines and arcs with feeds, a dwell, corners that are passed, and a rotary axis that turns alone."""
    points = np.array([[0, 0, 0], [4, 0, 0], [8, 0.1, 0], [8, 0.1, 1.0], [12, 3, 1.0], [12, 8, 0.5], [2, 8, 0.5],
                       [2, 8, 0.0], [1, 3, 0.0]])  # fmt: skip
    return sf.Path.polyline(
        points, ("x", "y", "c"), name="program", feeds=[20, 30, 40, np.inf, 30, 20, 50, 10],
        markers=[sf.paths.Marker(2, "M3", 0.1, True), sf.paths.Marker(5, "", 0.0, True)],
    )  # fmt: skip


def judged(path: sf.Path, points: sf.Setpoints, size: int, limits: sf.Limits = LIMITS, chunk: int = 97) -> sf.Verdict:
    """The verdict by parts of `size` curves, of which the check is told just before the setpoints that need them."""
    check, parts, known = Check(limits), parts_of(path, size), 0
    for start in range(0, len(points), chunk):
        part = points.part(start, min(start + chunk, len(points)))
        while known <= part.curve[-1]:
            known += len((come := next(parts)).curves)
            check.part(come)
        check.see(part)
    for come in parts:
        check.part(come)
    return check.verdict()


def without_floors(problems: tuple[str, ...]) -> list[str]:
    """Sentences without the floor of rounding, which a shorter path has lower."""
    return [re.sub(r"floor [^;)]+", "", problem) for problem in problems]


def same(one: sf.Verdict, other: sf.Verdict) -> None:
    assert without_floors(one.problems) == without_floors(other.problems)
    assert one.limits.keys() == other.limits.keys()
    for name, each in one.limits.items():
        there = other.limits[name]
        assert each.worst == pytest.approx(there.worst, rel=1e-9, abs=max(each.floor, there.floor)), name
        assert (each.limit, each.over, each.axis) == (there.limit, there.over, there.axis)
        if each.share > 0.9:
            assert each.at_s == pytest.approx(there.at_s, abs=1e-6), name
    assert one.numbers["ticks"] == other.numbers["ticks"]
    assert one.numbers["length_mm"] == pytest.approx(other.numbers["length_mm"], rel=1e-12)


@pytest.mark.parametrize("size", [1, 3])
def test_a_program_is_judged_by_parts_as_by_the_whole(size, monkeypatch):
    monkeypatch.setattr(import_module("splinefeed.checks.check"), "BLOCK", 61)
    path = program()
    points = sf.Setpoints.joined(list(sf.runs.stream_setpoints(parts_of(path, size), LIMITS, period=PERIOD)))
    whole = sf.check(points, path, LIMITS)
    assert whole.ok, whole.problems
    found = judged(path, points, size)
    same(found, whole)
    turning = [note for note in whole.notes if "rotary axes move alone" in note]
    assert turning
    assert [note for note in found.notes if "rotary axes move alone" in note] == turning


def test_what_is_wrong_is_found_in_its_place(monkeypatch):
    monkeypatch.setattr(import_module("splinefeed.checks.check"), "BLOCK", 61)
    path = program()
    points = sf.Setpoints.joined(list(sf.runs.stream_setpoints(parts_of(path, 2), LIMITS, period=PERIOD)))
    at = len(points) * 3 // 4
    bent, early = points.position.copy(), points.t.copy()
    bent[at, 1] += 1e-4
    early[at + 5] += 1e-5
    for wrong in (replace(points, position=bent), replace(points, t=early), points.part(0, len(points) - 3)):
        whole = sf.check(wrong, path, LIMITS)
        assert not whole.ok
        same(judged(path, wrong, 2), whole)
    tight = replace(LIMITS, axis_acceleration=300.0)
    whole = sf.check(points, path, tight)
    assert not whole.ok
    same(judged(path, points, 2, tight), whole)


def test_a_smoothed_path_is_judged_as_it_was_made():
    turn = np.cumsum(0.4 * np.sin(np.arange(600) / 9.0))
    path = sf.Path.polyline(np.cumsum(np.column_stack([np.cos(turn), np.sin(turn)]), axis=0) * 0.2, ("x", "y"))
    limits = sf.Limits(feed=40, axis_acceleration=800, axis_jerk=30000)
    smooth = smoothed(path, 0.01)
    points = sf.Setpoints.joined(list(sf.runs.stream_setpoints(parts_of(smooth, 5), limits, period=PERIOD)))
    whole = sf.check(points, smooth, limits)
    assert whole.ok, whole.problems
    same(judged(smooth, points, 5, limits, chunk=700), whole)


@pytest.mark.parametrize("length", [10.0, 1e3, 1e6])
def test_a_curve_whose_spans_hang_on_the_length_of_the_path_keeps_its_ticks(length, monkeypatch):
    """A curve is parted until its speed is a polynomial to the rounding of the path: less finely once more is known."""
    monkeypatch.setattr(import_module("splinefeed.checks.check"), "BLOCK", 61)
    wave = sf.NurbsCurve.bezier([[0, 0], [2, 9], [5, -9], [8, 9], [10, 0]])
    way = np.array([2.0, -9.0]) / np.hypot(2.0, 9.0)
    path = sf.Path([wave, sf.NurbsCurve.bezier([[10.0, 0.0], np.array([10.0, 0.0]) + length * way])], feeds=[20, 1e5])
    limits = sf.Limits(feed=1e5, axis_acceleration=1e4, axis_jerk=1e6)
    points = sf.interpolate(path, sf.plan(path, limits, period=PERIOD))
    whole = sf.check(points, path, limits)
    assert whole.ok, whole.problems
    same(judged(path, points, 1, limits), whole)
