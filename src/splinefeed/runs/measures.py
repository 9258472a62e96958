"""The measures of every run, beside the check and the use of limits: the one list of them."""

from __future__ import annotations

from splinefeed.runs.chord_error import ChordError
from splinefeed.runs.feed_ripple import FeedRipple
from splinefeed.runs.measure import Measure

#: Runs make each of them; numbers, `--json`, the summary, reports, the studio and sweeps tell what they found.
MEASURES: tuple[type[Measure], ...] = (FeedRipple, ChordError)
