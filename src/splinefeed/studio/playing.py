"""A motion played in real time for a page, through the same stream, override and hold that drive a controller."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import splinefeed as sf
from splinefeed.errors import SplinefeedError
from splinefeed.feed.reserve import with_reserve
from splinefeed.live.motion import Motion, along
from splinefeed.live.operator import MOST, Operator
from splinefeed.live.sinks import ClockSink
from splinefeed.live.stream import play
from splinefeed.studio import sources
from splinefeed.studio.settings import Bench, SettingsError, field_of, resolve

#: Look-ahead that is kept before the clock, and at least so many rows; time between two pictures, s.
AHEAD, LEAST_ROWS, FRAME = 0.15, 24, 1.0 / 30.0


def played(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Plan with a reserve for the override, play to the end or to a stop, and say how it went.

    Orders are those of `Operator.obey`.
    """
    operator = Operator()
    operator.obey({"override": request["override"]})
    law, motion, moved = motion_of(request, bench, operator.rate)
    ahead = max(round(AHEAD / motion.period), LEAST_ROWS)
    sink = ClockSink(fill=ahead // 2)
    ended = threading.Event()

    def show() -> None:
        """Tell the page some thirty times a second where the axes are, or the tip of a tool path."""
        last = 0
        while not ended.wait(FRAME):
            row, position = sink.now()
            if row == last:
                continue
            last, tau = row, motion.tau_of(row)
            if isinstance(moved, sf.JointPath):
                position = moved.kinematics.forward(position)[0]
            frame = {"kind": "frame", "row": row, "tau_s": tau, "planned_s": law.duration, "s_mm": float(law(tau))}
            rates = {"rate": motion.override.rate, "wanted": operator.wanted, "top": motion.override.top}
            bench.mail.tell({**frame, **rates, "position": position.tolist()})

    bench.mail.obey = operator.obey
    frames = threading.Thread(target=show, daemon=True)
    frames.start()
    try:
        state = play(motion, sink, operator, ahead)
    finally:
        ended.set()
        frames.join()
    return {"done": state.done, "rows": state.row, "underruns": state.underruns, "tau_s": state.tau}


def motion_of(
    request: Mapping[str, Any], bench: Bench, rate: float = 1.0
) -> tuple[sf.TimeLaw, Motion, sf.Path | sf.JointPath]:
    """Law, motion and path of the settings, planned with a reserve for overrides up to `top`."""
    wanted = resolve(request["settings"], bench.uploads)
    bench.say(f"planning {wanted.path.name}, {wanted.strategy}, with a reserve for the override")
    try:
        limits = with_reserve(wanted.limits, float(request.get("top", 1.0)))
        law = sf.plan(wanted.moved, limits, strategy=wanted.strategy, period=wanted.period)
        # the feed is what is programmed: 100 %; what is a limit is that of the axes
        allowed = replace(wanted.limits, feed=MOST * wanted.limits.feed)
        return law, along(wanted.moved, law, allowed, rate=rate, highest=MOST), wanted.moved
    except SplinefeedError as error:
        raise SettingsError({field_of(error): sources.words(error, bench.uploads)}) from error
