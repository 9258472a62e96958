"""Limits that a plan is made under, so that it can be overridden under the ones that hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from splinefeed.errors import LimitsError
from splinefeed.records import TABLE, Limits

#: Share of the acceleration and of the jerk that a plan may use, so that the rest can brake it along its own law.
ACCELERATION_SHARE, JERK_SHARE = 0.8, 0.6
#: Highest rate.
MOST_RATE = 10.0


def with_reserve(
    limits: Limits, top: float = 1.0, acceleration: float = ACCELERATION_SHARE, jerk: float = JERK_SHARE
) -> Limits:
    """Reduce limits to plan under, so that the plan can be run at rates up to `top` and slowed anywhere.

    Parameters
    ----------
    limits : Limits
        That hold for what is sent.
    top : float, optional
        The highest rate, at least 1.
    acceleration, jerk : float, optional
        The shares of these that the plan may use.

    Returns
    -------
    Limits
        Those to plan under.

    Raises
    ------
    LimitsError
        For shares that are not in (0, 1) and a top below 1.

    Notes
    -----
    A limit of what grows by k^p where a motion runs k times as fast (`power` of its row in `limit_table.py`) is

        share limit / top^p

    with the share of acceleration, of jerk, or 1, as its row says: V / top of a feed, share_j J / top^3 of a jerk. Of a
    torque what motion takes is held to share_a / top^2 of what weight and friction leave.

    References
    ----------
    .. [1] docs/math/override.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.planner.with_reserve(sf.Limits(feed=60, acceleration=500, jerk=20000), top=1.2).feed
    50.0
    """
    if not 1.0 <= top <= MOST_RATE:
        raise LimitsError(f"the highest override is {top:g}; it must be from 1 to {MOST_RATE:g}")
    for name, share in (("acceleration", acceleration), ("jerk", jerk)):
        if not 0.0 < share < 1.0:
            raise LimitsError(f"the share of {name} for the plan is {share:g}; it must lie between 0 and 1")
    shares = {"": 1.0, "acceleration": acceleration, "jerk": jerk}
    changed = {
        each.name: _times(getattr(limits, each.name), shares[each.share] / top**each.power)
        for each in TABLE
        if each.power and each.held
    }
    if limits.combinations is not None:
        factors = {"velocity": 1.0 / top, "acceleration": acceleration / top**2, "jerk": jerk / top**3}
        changed["combinations"] = {
            name: replace(each, **{kind: getattr(each, kind) * factor for kind, factor in factors.items()})
            for name, each in limits.combinations.items()
        }
    if limits.torque is not None:
        changed["torque"] = limits.torque.reserved(acceleration / top**2)
    return replace(limits, **changed)


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, Mapping):
        return {axis: each * factor for axis, each in value.items()}
    if isinstance(value, tuple):
        return tuple(each * factor for each in value)
    return None if value is None else value * factor
