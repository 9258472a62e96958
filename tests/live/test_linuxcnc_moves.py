"""Moves of LinuxCNC's task as curves, their feeds, their pieces of motion, and their joints."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import splinefeed as sf
from linuxcnc_machine import mill
from splinefeed.live import linuxcnc_wire as wires
from splinefeed.live.linuxcnc_joints import PROBES
from splinefeed.live.linuxcnc_moves import curve_of, feeds_of
from splinefeed.live.linuxcnc_pieces import PlannedTrack, portions, quintics
from splinefeed.records import Array


def moves(rows: list[dict[str, object]]) -> Array:
    out = np.zeros(len(rows), wires.SEGMENT)
    for k, row in enumerate(rows):
        for name, value in row.items():
            out[name][k] = value
    return out


@pytest.mark.parametrize(
    ("turn", "angle"), [(0, 0.5 * np.pi), (1, 2.5 * np.pi), (-1, -1.5 * np.pi), (-2, -3.5 * np.pi)]
)
@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0, 1, 0), (0.6, 0.0, 0.8)])
def test_arcs_turn_as_their_numbers_say(turn, angle, normal):
    machine = mill(axes="xyzu")
    axis = np.array(normal, dtype=float)
    u = np.cross(axis, [0.3, 0.9, 0.1])
    u /= np.linalg.norm(u)
    w, centre, r, rise = np.cross(axis, u), np.array([1.0, 2, 3]), 5.0, 4.0

    def at(share: float) -> Array:
        t = share * angle
        place = np.zeros(9)
        place[:3] = centre + r * (np.cos(t) * u + np.sin(t) * w) + share * rise * axis
        place[6] = 2.0 * share
        return place

    row = moves([{"kind": wires.ARC, "turn": turn, "centre": centre, "normal": axis, "from": at(0.0), "to": at(1.0)}])
    curve = curve_of(row[0], machine)
    path = sf.Path([curve], machine.axes)
    for share in (0.0, 0.2, 0.5, 0.9, 1.0):
        wanted = at(share)[machine.columns]
        np.testing.assert_allclose(path(share * path.length), wanted, atol=2e-7)


def test_feeds_count_as_linuxcnc_counts_them():
    machine = mill(axes="xyzau")
    rows = moves(
        [
            {"kind": 1, "canon": 2, "enables": 15, "feed": 10.0, "top": 99.0, "to": [3, 4, 0, 0, 0, 0, 0, 0, 0]},
            {"kind": 1, "canon": 2, "enables": 15, "feed": 10.0, "top": 99.0, "to": [3, 4, 0, 0, 0, 0, 12, 0, 0]},
            {"kind": 1, "canon": 2, "enables": 13, "feed": 10.0, "top": 99.0, "to": [3, 4, 0, 9, 0, 0, 0, 0, 0]},
            {"kind": 1, "canon": 1, "enables": 15, "feed": 80.0, "top": 80.0, "to": [3, 4, 0, 0, 0, 0, 0, 0, 0]},
            {"kind": 1, "canon": 2, "enables": 15, "feed": 70.0, "top": 99.0, "to": [0, 0, 0, 9, 0, 0, 0, 0, 0]},
        ]
    )
    feeds, scales = feeds_of(rows, machine, 1.5, 0.5, 30.0)
    np.testing.assert_allclose(feeds, [15.0, 15.0 * 13 / 5, 10.0, 30.0, 99.0])
    np.testing.assert_allclose(scales, [1.5, 1.5, 1.0, 0.5, 1.5])


def test_a_curve_is_cut_at_the_knot_that_is_there():
    knots = np.r_[np.zeros(4), np.cumsum(np.full(6, 1.0 / 7.0)), np.ones(4)]
    points = np.column_stack([np.arange(10.0), np.arange(10.0) % 3, np.zeros(10)])
    path = sf.Path([sf.NurbsCurve(3, knots, points)], ("x", "y", "z"), feeds=[10.0])
    parts = portions(path, np.array([0]), np.array([7.0]), 1.0)
    assert len(parts) == 7 and sum(part.length for part, _ in parts) == pytest.approx(path.length)


def test_pieces_join_where_a_path_has_a_curve_shorter_than_a_piece():
    places = np.array([0.0, 5.0, 5.0002, 10.0])  # the short one begins another part of the path
    lines = [sf.NurbsCurve.bezier([[a, 0.0, 0.0], [b, 0.0, 0.0]]) for a, b in pairwise(places)]
    track = PlannedTrack(0)
    track.push(np.diff(places))
    for part, origins in ((lines[:1], [0]), (lines[1:], [1, 2])):
        track.add(sf.Path(part, ("x", "y", "z")), np.array(origins))
    steady = np.array([[0.0, 50.0, 0.0, 0.0, 0.0, 0.0], [5.0, 50.0, 0.0, 0.0, 0.0, 0.0]])
    law = sf.TimeLaw(breaks=[0.0, 0.1, 0.2], coefficients=steady, strategy="steady")
    found = quintics(track, 0.0, law)
    ends = np.einsum("nak,nk->na", found.c, found.span[:, None] ** np.arange(6))
    np.testing.assert_allclose(ends[:-1], found.c[1:, :, 0], atol=1e-9)
    np.testing.assert_allclose(ends[-1], [10.0, 0.0, 0.0], atol=1e-9)


def test_lengths_of_kinematics_come_from_the_answers_and_the_module_may_be_switched():
    moved = mill(axes="xyzac", kinematics="xyzac-trt-kins").moved
    assert moved is not None
    rng, pose = np.random.default_rng(4), (1.0, 2.0, 3.0, 0.4, -0.7)
    for _ in range(20):
        wanted = moved.with_lengths(dict(zip(moved.module.lengths, rng.uniform(-200.0, 200.0, 6), strict=True)))
        found = moved.answering(moved.at(wanted, PROBES))
        np.testing.assert_allclose(found.of(pose), wanted.of(pose), atol=1e-9)
    trivial = moved.answering(PROBES[:, :3])
    assert trivial.of(pose) == (1.0, 2.0, 3.0) and not trivial.bend
    with pytest.raises(sf.errors.SplinefeedError, match="not planned"):
        moved.answering(np.full((wires.PROBES, 3), np.nan))
