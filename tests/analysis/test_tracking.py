"""Tracking errors of the axes: values put in on purpose, units, places, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from splinefeed.analysis.tracking import tracking
from splinefeed.errors import InputError
from splinefeed.records import Response, Setpoints

AXES = ("x", "y", "theta")


def response(error, axes=AXES, start=0.0, saturated=None):
    """A response that is behind its command by `error` (n, axes), and whose encoder says it is twice as far behind."""
    error = np.asarray(error, dtype=float)
    command = np.arange(error.size, dtype=float).reshape(error.shape)
    return Response(
        t=start + np.arange(len(error)) * 1e-3,
        command=command,
        position=command - error,
        measured=command - 2.0 * error,
        output=np.zeros_like(error),
        saturated=np.zeros(error.shape, dtype=bool) if saturated is None else saturated,
        axes=axes,
        period=1e-3,
    )


def setpoints(n, axes=AXES):
    return Setpoints(
        t=np.arange(n) * 1e-3,
        curve=np.zeros(n),
        u=np.zeros(n),
        s=np.arange(n) * 0.06,
        feed=np.full(n, 60.0),
        position=np.zeros((n, len(axes))),
        axes=axes,
        period=1e-3,
        method="test",
    )


@pytest.mark.nojit
def test_worst_mean_and_place():
    error = np.zeros((4, 3))
    error[:, 0] = [0.5, -1.5, 0.5, 0.5]
    error[2, 1] = 0.25
    error[3, 2] = -0.125
    saturated = np.zeros((4, 3), dtype=bool)
    saturated[:3, 1] = True
    found = tracking(response(error, saturated=saturated), setpoints(4))
    x, y, theta = (found.axes[axis] for axis in AXES)
    assert (x.max, x.error, x.tick, x.t, x.unit) == (1.5, -1.5, 1, 1e-3, "mm")
    assert x.rms == pytest.approx(np.sqrt((3 * 0.25 + 2.25) / 4))
    assert x.s == pytest.approx(0.06)
    assert (y.max, y.tick, y.saturated) == (0.25, 2, 0.75)
    assert (theta.max, theta.error, theta.unit) == (0.125, -0.125, "rad")
    assert list(found.linear) == ["x", "y"]
    assert list(found.rotary) == ["theta"]


def test_without_setpoints_no_arc_length_is_known():
    found = tracking(response(np.ones((3, 2)), axes=("x", "y")))
    assert found.axes["x"].s is None
    assert not found.rotary
    assert found.of == "position"
    assert not tracking(response(np.ones((3, 1)), axes=("c",))).linear


def test_behind_the_last_setpoint_the_end_is_commanded():
    error = np.zeros((9, 3))
    error[8, 0] = 1.0
    assert tracking(response(error), setpoints(5)).axes["x"].s == pytest.approx(4 * 0.06)


def test_by_the_encoder():
    found = tracking(response(np.full((3, 3), 0.5)), of="measured")
    assert found.of == "measured"
    assert found.axes["y"].max == 1.0


def test_an_axis_at_rest_has_no_error():
    found = tracking(response(np.zeros((5, 3))))
    assert all((each.max, each.rms, each.tick) == (0.0, 0.0, 0) for each in found.axes.values())


@pytest.mark.parametrize(
    ("given", "points", "options", "message"),
    [
        (np.zeros((2, 3)), None, {"of": "output"}, "of is 'output'; choose 'position' or 'measured'"),
        (np.zeros((0, 3)), None, {}, "the response has no samples, so it has no tracking error"),
        ([[0, 0, np.inf]], None, {}, "Response.position[0, 2] is -inf; every value must be finite"),
        (
            np.zeros((2, 3)),
            setpoints(2, ("x", "y")),
            {},
            "the response has axes ('x', 'y', 'theta'), the setpoints ('x', 'y'); they must be the same",
        ),
        (np.zeros((2, 3)), setpoints(0), {}, "there are no setpoints, so nothing is commanded"),
    ],
)
def test_refused(given, points, options, message):
    with pytest.raises(InputError) as caught:
        tracking(response(given), points, **options)
    assert str(caught.value) == message
