"""Smoothing: a path of lines, arcs and curves as one of continuous curvature, within a tolerance."""

from __future__ import annotations

import dataclasses

import numpy as np

from splinefeed.errors import InputError
from splinefeed.geometry.curves import Flat, Packed
from splinefeed.geometry.path import Path
from splinefeed.geometry.smoothing_stream import ANGULAR_TOLERANCE, SMOOTHING_CORNER_ANGLE, Smoother, raw
from splinefeed.geometry.smoothing_stream import PROGRAM as PROGRAM
from splinefeed.geometry.smoothing_stream import UNBOUNDED_TOLERANCE as UNBOUNDED_TOLERANCE
from splinefeed.records import Array


def smoothed(
    path: Path,
    tolerance: float | str,
    *,
    corner_angle: float = SMOOTHING_CORNER_ANGLE,
    corners: str = "keep",
    angular_tolerance: float = ANGULAR_TOLERANCE,
    share: Array | None = None,
) -> Path:
    """The path with continuous tangent and curvature and bounded third derivative, within `tolerance` everywhere.

    tolerance          mm; or "program" for the tolerance of each curve (G64 P), where 0 or none leaves it exact
    corner_angle       joints that turn by more, rad, are corners
    corners            "keep" them, the tool stops there, or "round" them within the tolerance; reversals are kept
    angular_tolerance  of rotary axes, rad
    share              (curves,) of the tolerance that each curve may use, all of it if not given, 0 for exact

    Runs of short lines become splines of degree 5 (least squares, knots where the error is); at the remaining joints,
    of any curves, quintics blend them. What they leave of long lines and of arcs stays as it is. Feeds, tolerances and
    markers stay at their places; rapid moves, stops and moves of rotary axes alone stay exact.
    Raises InputError for arguments that cannot be used. See docs/smoothing.md.
    """
    smoother = Smoother(
        tolerance, path.axes, corner_angle=corner_angle, corners=corners, angular_tolerance=angular_tolerance
    )
    value = smoother.tolerance
    if value != PROGRAM and float(value) > path.size > 0.0:
        raise InputError(f"tolerance is {value:g} mm, more than the whole path, {path.size:.4g} mm; give a smaller one")
    if not raw(path, value, 0, share).free.any():
        return path
    parts = [*smoother.take(path, share), *smoother.rest()]
    starts = np.cumsum([0, *(len(part.flat) for part in parts)]).tolist()
    return Path(
        Packed(Flat.joined([part.flat for part in parts])),
        path.axes,
        name=path.name,
        findings=(*path.findings, smoother.summary),
        tolerance=max(path.tolerance, 1e-9 * path.size),
        feeds=None if path.feeds is None else np.concatenate([part.feed for part in parts]),
        tolerances=None if path.tolerances is None else np.concatenate([part.said for part in parts]),
        markers=[
            dataclasses.replace(marker, before=marker.before + start)
            for part, start in zip(parts, starts, strict=False)
            for marker in part.markers
        ],
    )
