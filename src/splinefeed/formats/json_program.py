"""What a program said of the curves of a path, in JSON: feeds, tolerances, and what stands between the curves.

A curve may have `feed` (units a second, or "rapid"), `tolerance` (units; 0 is exact, "free" sets no bound), `before`
and, for what stands behind the last one, `after`: lists of markers {"text": "M3 S12000", "dwell": s, "stop": true}.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from splinefeed.errors import FormatError, InputError
from splinefeed.geometry.path import Marker, Path

KEYS = frozenset(("feed", "tolerance", "before", "after"))
RAPID, FREE = "rapid", "free"
_MARKER = {"text", "dwell", "stop"}
#: Most markers at one place.
MAX_MARKERS = 1000


@dataclass(frozen=True)
class Said:
    """What one curve says: feed mm/s (infinite: rapid) and tolerance mm, None if nothing, and markers at its ends."""

    feed: float | None = None
    tolerance: float | None = None
    before: tuple[Marker, ...] = ()
    after: tuple[Marker, ...] = ()


def written(path: Path, i: int) -> dict[str, Any]:
    """The keys of curve `i` of `path`; none if nothing is said of it."""
    keys: dict[str, Any] = {}
    if path.feeds is not None:
        keys["feed"] = float(path.feeds[i]) if math.isfinite(path.feeds[i]) else RAPID
    if path.tolerances is not None:
        keys["tolerance"] = float(path.tolerances[i]) if math.isfinite(path.tolerances[i]) else FREE
    places = {"before": i, "after": len(path.curves)} if i == len(path.curves) - 1 else {"before": i}
    for key, place in places.items():
        if markers := [_marker(marker) for marker in path.markers if marker.before == place]:
            keys[key] = markers
    return keys


def _marker(marker: Marker) -> dict[str, Any]:
    words: dict[str, Any] = {"text": marker.text} if marker.text else {}
    return {**words, **({"dwell": marker.dwell} if marker.dwell else {}), "stop": marker.stop}


def read(item: dict[str, Any], place: str, scale: float) -> Said:
    """What the curve `item` says; `scale` is mm of one unit. FormatError names the key that is wrong."""
    return Said(
        _number(item.get("feed", ...), f"{place}: feed", RAPID, scale, positive=True),
        _number(item.get("tolerance", ...), f"{place}: tolerance", FREE, scale, positive=False),
        _markers(item.get("before", []), f"{place}: before"),
        _markers(item.get("after", []), f"{place}: after"),
    )


def _number(value: object, place: str, unbounded: str, scale: float, *, positive: bool) -> float | None:
    if value is ...:
        return None
    if value is None or value == unbounded:
        return math.inf
    number = value if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    if not (0.0 < number < 1e30 or (number == 0.0 and not positive)):
        least = "greater than 0" if positive else "0 or more"
        raise FormatError(f'{place}: expected a number, {least}, or "{unbounded}"')
    return float(number) * scale


def _markers(items: object, place: str) -> tuple[Marker, ...]:
    if not isinstance(items, list) or len(items) > MAX_MARKERS:
        raise FormatError(f"{place}: is not a list of at most {MAX_MARKERS} markers")
    found = []
    for k, item in enumerate(items):
        if not isinstance(item, dict) or set(item) - _MARKER:
            raise FormatError(f"{place}[{k}]: expected an object with {', '.join(sorted(_MARKER))}")
        text, dwell, stop = item.get("text", ""), item.get("dwell", 0.0), item.get("stop", True)
        if not isinstance(text, str) or not isinstance(stop, bool) or "\n" in text or len(text) > 256:
            raise FormatError(f"{place}[{k}]: text must be one line and stop true or false")
        if isinstance(dwell, bool) or not isinstance(dwell, int | float):
            raise FormatError(f"{place}[{k}]: dwell is not a number of seconds")
        try:
            found.append(Marker(0, text, float(dwell), stop))
        except (InputError, OverflowError) as error:
            raise FormatError(f"{place}[{k}]: {error}") from None
    return tuple(found)


def path_arguments(said: Sequence[Said], source: object) -> dict[str, Any]:
    """`feeds`, `tolerances` and `markers` of a `Path` of curves that say this; FormatError if only some have a feed."""
    arguments: dict[str, Any] = {}
    for name, values in (("feeds", [each.feed for each in said]), ("tolerances", [each.tolerance for each in said])):
        if all(value is None for value in values):
            continue
        if any(value is None for value in values):
            missing = values.index(None)
            key = name[:-1]
            raise FormatError(
                f"{source}: curve {missing} of a path has no {key}, but others have; give all of them one"
            )
        arguments[name] = values
    markers = []
    for i, each in enumerate(said):
        markers += [Marker(i, m.text, m.dwell, m.stop) for m in each.before]
        markers += [Marker(i + 1, m.text, m.dwell, m.stop) for m in each.after]
    return {**arguments, "markers": markers}
