"""A motion played in real time for a page, through the same stream, override and hold that drive a controller."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from splinefeed.errors import SplinefeedError
from splinefeed.feed.override import with_reserve
from splinefeed.feed.planning import plan
from splinefeed.live.clock_sink import ClockSink
from splinefeed.live.motion import Motion
from splinefeed.live.stream import Knob, play
from splinefeed.records import ROTARY_AXES
from splinefeed.studio import sources
from splinefeed.studio.settings import SettingsError, field_of, resolve

if TYPE_CHECKING:
    from splinefeed.studio.tasks import Bench

#: Look-ahead that is kept before the clock, and at least so many rows; time between two pictures, s.
AHEAD, LEAST_ROWS, FRAME = 0.15, 24, 1.0 / 30.0


def played(request: Mapping[str, Any], bench: Bench) -> dict[str, Any]:
    """Plan with a reserve for the override, play to the end or to a stop, and say how it went.

    Orders: `rate`, 1 = as planned; `hold`, true or false; `stop`.
    """
    knob = Knob()
    _obey(knob, {"rate": request.get("rate", 1.0)})
    motion = motion_of(request, bench, knob.wanted)
    sink = ClockSink()
    ended = threading.Event()
    bench.mail.obey = lambda order: _obey(knob, order)
    frames = threading.Thread(target=_show, args=(motion, sink, knob, bench, ended), daemon=True)
    frames.start()
    try:
        state = play(motion, sink, knob, max(round(AHEAD / motion.period), LEAST_ROWS))
    finally:
        ended.set()
        frames.join()
    return {
        "done": state.done,
        "rows": state.row,
        "underruns": state.underruns,
        "tau_s": state.tau,
        "planned_s": motion.law.duration,
        "top": motion.override.top,
    }


def motion_of(request: Mapping[str, Any], bench: Bench, rate: float = 1.0) -> Motion:
    """The motion of the settings, planned with a reserve for overrides up to `top`."""
    wanted = resolve(request.get("settings"), bench.uploads)
    bench.say(f"planning {wanted.path.name}, {wanted.strategy}, with a reserve for the override")
    try:
        limits = with_reserve(wanted.limits, float(request.get("top", 1.0)))
        law = plan(wanted.path, limits, strategy=wanted.strategy, period=wanted.period)
        return Motion(wanted.path, law, wanted.limits, rate=rate)
    except SplinefeedError as error:
        raise SettingsError({field_of(error): sources.words(error, bench.uploads)}) from error


def _obey(knob: Knob, order: Mapping[str, Any]) -> None:
    if "rate" in order:
        knob.set_rate(float(order["rate"]))
    if "hold" in order:
        knob.hold(bool(order["hold"]))
    if order.get("stop"):
        knob.stop()


def _show(motion: Motion, sink: ClockSink, knob: Knob, bench: Bench, ended: threading.Event) -> None:
    """Tell the page some thirty times a second where the axes are."""
    law, top = motion.law, motion.override.top
    last = -1
    while not ended.wait(FRAME):
        row, position = sink.now()
        if row == last or not row:
            continue
        last = row
        tau = motion.tau_of(row)
        bench.mail.tell(
            {
                "kind": "frame",
                "row": row,
                "tau_s": tau,
                "planned_s": law.duration,
                "s_mm": float(law(tau)),
                "rate": motion.override.rate,
                "wanted": knob.wanted,
                "top": top,
                "position": position.tolist(),
                "rotary": [axis in ROTARY_AXES for axis in motion.axes],
            }
        )
