"""Tip and tool axis smoothed together: both stay within their tolerances, looked at by means of this file's own."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.errors import InputError
from splinefeed.kinematics import kinematics
from splinefeed.paths.smoothing_proven import proven_tool
from splinefeed.records import Array

TOLERANCE, ANGLE = 0.01, math.radians(0.1)
KNOTS = [0.0, 0.0, 1.0, 1.0]


def direction(tilt: Array, azimuth: Array) -> Array:
    return np.stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)], axis=-1)


def rows(count: int, noise: float = 0.0, seed: int = 0) -> tuple[Array, Array, Array]:
    """Tips (n + 1, 3), angles (n + 1, 2) and tool axes (n + 1, 3) of lines along smooth curves, with noise, mm."""
    t = np.linspace(0.0, 1.0, count + 1)
    tip = np.stack([-40 + 80 * t, 15 * np.sin(2 * np.pi * t), 2 * np.cos(4 * np.pi * t)], axis=1)
    tip += noise * np.random.default_rng(seed).normal(size=tip.shape)
    angles = np.stack([np.radians(25 + 8 * np.sin(2 * np.pi * t)), np.radians(40 * t + 6 * np.sin(9 * t))], axis=1)
    return tip, angles, direction(angles[:, 0], angles[:, 1])


def lines(tip: Array, axis: Array, kind: str, **said: object) -> sf.ToolPath:
    tips, axes = ([sf.NurbsCurve(1, KNOTS, pair) for pair in pairwise(each)] for each in (tip, axis))
    return sf.ToolPath(tips, axes, kind=kind, **said)  # type: ignore[arg-type]


def of_kind(kind: str, count: int = 120, **more: float) -> sf.ToolPath:
    tip, angles, axis = rows(count, **more)  # type: ignore[arg-type]
    given = {"angles": angles, "vectors": axis, "points": tip + 20.0 * axis}[kind]
    return lines(tip, given, kind, lines=np.arange(count) + 7, feeds=np.full(count, 25.0), tool_length=80.0)


def placed(path: sf.ToolPath, s: Array) -> tuple[Array, Array]:
    """Tip and tool axis (n, 3) at arc lengths."""
    curve, u = path.locate(s)
    k = path.orientation(curve, u)[:, 0]
    axis = direction(k[:, 0], k[:, 1]) if path.kind == "angles" else k / np.linalg.norm(k, axis=1)[:, None]
    return path(s), axis


def worst(original: sf.ToolPath, result: sf.ToolPath) -> tuple[float, float]:
    """Shares of both tolerances at the place of the original that suits each place of the result best."""
    s = np.linspace(0.0, result.length, 601)
    tip, axis = placed(result, s)
    near = np.linspace(-0.03, 0.03, 121)
    about = np.clip(s[:, None] * original.length / result.length + near, 0.0, original.length)
    tips, axes = (each.reshape(*about.shape, 3) for each in placed(original, about.ravel()))
    off = np.linalg.norm(tips - tip[:, None], axis=2) / TOLERANCE
    turned = 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(axes - axis[:, None], axis=2), 1.0)) / ANGLE
    best = np.argmin(np.maximum(off, turned), axis=1)
    at = np.arange(len(s))
    return float(off[at, best].max()), float(turned[at, best].max())


@pytest.mark.parametrize("kind", ["angles", "vectors", "points"])
@pytest.mark.parametrize("noise", [0.0, pytest.param(0.002, marks=pytest.mark.slow)])
def test_both_tolerances_hold_and_nothing_kinks(kind: str, noise: float) -> None:
    path = of_kind(kind, noise=noise)
    result, proof = proven_tool(path, TOLERANCE, angular_tolerance=ANGLE)
    assert proof.holds and proof.tolerance == TOLERANCE and proof.angular_tolerance == ANGLE
    assert proof.order.largest <= TOLERANCE and proof.order.largest_angle <= ANGLE
    off, turned = worst(path, result)
    assert off <= 1.0 and turned <= 1.0  # what is proven bounds what is seen
    assert off * TOLERANCE <= proof.order.largest + 1e-12
    assert result.kind == ("angles" if kind == "angles" else "vectors") and result.tool_length == 80.0
    assert result.feeds is not None and np.all(result.feeds == 25.0) and len(result.curves) < 15
    assert result.lines is not None and result.lines[0] == 7
    assert "side by side" in result.findings[-1] and "tolerance 0.01 mm" in result.findings[-1]
    machine = kinematics("xyzac-trt", z_offset=-15.0)
    if kind != "angles":
        assert (
            len(sf.kinematics.JointPath(path, machine).stops) > 60
            and sf.kinematics.JointPath(result, machine).stops == ()
        )


def test_a_kink_of_the_tool_axis_alone_is_rounded_and_a_corner_of_the_tip_stays() -> None:
    tip = np.array([[0.0, 0, 0], [20, 0, 0], [40, 0, 0], [40, 20, 0]])
    axis = direction(np.radians([10.0, 14.0, 10.0, 10.0]), np.radians([20.0, 20.0, 20.0, 30.0]))
    path = lines(tip, axis, "vectors")
    result, _ = proven_tool(path, TOLERANCE, angular_tolerance=ANGLE)
    machine = kinematics("xyzac-trt")
    assert sf.kinematics.JointPath(path, machine).stops == pytest.approx((20.0, 40.0))
    assert sf.kinematics.JointPath(result, machine).stops == pytest.approx((40.0,), abs=1e-3)
    assert max(worst(path, result)) <= 1.0
    rounded = sf.smooth(path, TOLERANCE, angular_tolerance=ANGLE, corners="round")
    assert isinstance(rounded, sf.ToolPath) and sf.kinematics.JointPath(rounded, machine).stops == ()
    assert max(worst(path, rounded)) <= 1.0


def test_the_tighter_tolerance_binds() -> None:
    path = of_kind("vectors", noise=0.002)
    _, proof = proven_tool(path, 0.1, angular_tolerance=1e-4)
    assert proof.order.largest_angle <= 1e-4 < proven_tool(path, 0.1)[1].order.largest_angle
    assert proven_tool(path, 1e-3, angular_tolerance=ANGLE)[1].order.largest <= 1e-3


def test_the_program_says_the_tolerance_and_rapid_moves_stay() -> None:
    tip, _, axis = rows(60)
    feeds = np.where(np.arange(60) < 30, 25.0, np.inf)
    path = lines(tip, axis, "vectors", tolerances=np.full(60, 0.01), feeds=feeds)
    result = sf.smooth(path, "program", angular_tolerance=ANGLE)
    assert result.feeds is not None and np.count_nonzero(np.isinf(result.feeds)) == 30
    assert max(worst(path, result)) <= 1.0  # type: ignore[arg-type]


def test_what_cannot_be_smoothed_is_refused() -> None:
    path = of_kind("vectors", 8)
    for angle in (0.0, -1.0, math.nan, 1.0):
        with pytest.raises(InputError, match="tolerance of the tool axis is"):
            proven_tool(path, 0.01, angular_tolerance=angle)
    with pytest.raises(InputError, match="tolerance"):
        sf.smooth(path, math.nan)
    far = lines(np.array([[0.0, 0, 0], [9, 0, 0]]), np.array([[1.0, 0, 0.1], [-1, 0, 0.1]]), "vectors")
    with pytest.raises(InputError, match=r"turns too far along curve 0 to be smoothed, at s = 9 mm; split"):
        sf.smooth(far, 0.01)
    other = sf.NurbsCurve(2, [0, 0, 0, 1, 1, 1], [[0, 0, 1], [0, 0.1, 1], [0, 0.2, 1]])
    with pytest.raises(InputError, match="curve 0 has other knots or weights for the tool axis than for the tip"):
        sf.smooth(sf.ToolPath(sf.NurbsCurve(1, KNOTS, [[0, 0, 0], [9, 0, 0]]), other, kind="vectors"), 0.01)


def test_an_upright_tool_is_smoothed_as_its_tip() -> None:
    tip, _, _ = rows(60)
    tool = sf.ToolPath(sf.Path.polyline(tip))
    result = sf.smooth(tool, 0.01)
    assert isinstance(result, sf.ToolPath) and result.tool_axis is None
    plain = sf.smooth(sf.Path.polyline(tip), 0.01 / 1.02)
    assert [c.degree for c in result.curves] == [c.degree for c in plain.curves]
