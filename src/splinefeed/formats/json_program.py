"""What a program said of the curves of a path, in JSON: feeds, tolerances, and what stands between the curves.

A curve may have `feed` (units a second, or "rapid"), `tolerance` (units; 0 is exact, "free" sets no bound), `before`
and, for what stands behind the last one, `after`: lists of markers {"text": "M3 S12000", "dwell": s, "stop": true}.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from splinefeed.errors import FormatError, InputError
from splinefeed.formats.json_values import Check, each, fields, number, text, truth
from splinefeed.geometry.path import Marker, Path

RAPID, FREE = "rapid", "free"
_MARKER = {"text": text, "dwell": number, "stop": truth}
#: Most markers at one place.
MAX_MARKERS = 1000


def _bound(unbounded: str, least: str, holds: Callable[[float], bool]) -> Check:
    def check(value: Any, place: str) -> float:
        if value is None or value == unbounded:
            return math.inf
        if not (holds(number(value, place)) and value < 1e30):
            raise FormatError(f'{place}: expected a number, {least}, or "{unbounded}"')
        return float(value)

    return check


def _marker(item: Any, place: str) -> Marker:
    said = fields(item, place, _MARKER)
    if "\n" in said.get("text", ""):
        raise FormatError(f"{place}: text: must be one line")
    try:
        return Marker(0, said.get("text", ""), float(said.get("dwell", 0.0)), said.get("stop", True))
    except InputError as error:
        raise FormatError(f"{place}: {error}") from None


_MARKERS = each(_marker, "markers", MAX_MARKERS)
#: The keys of a curve.
KEYS: dict[str, Check] = {
    "feed": _bound(RAPID, "greater than 0", lambda value: value > 0.0),
    "tolerance": _bound(FREE, "0 or more", lambda value: value >= 0.0),
    "before": _MARKERS,
    "after": _MARKERS,
}


def written(path: Path, i: int) -> dict[str, Any]:
    """The keys of curve `i` of `path`; none if nothing is said of it."""
    keys: dict[str, Any] = {}
    for key, values, unbounded in (("feed", path.feeds, RAPID), ("tolerance", path.tolerances, FREE)):
        if values is not None:
            keys[key] = float(values[i]) if math.isfinite(values[i]) else unbounded
    places = {"before": i, "after": len(path.curves)} if i == len(path.curves) - 1 else {"before": i}
    for key, place in places.items():
        if markers := [_words(marker) for marker in path.markers if marker.before == place]:
            keys[key] = markers
    return keys


def _words(marker: Marker) -> dict[str, Any]:
    words: dict[str, Any] = {"text": marker.text} if marker.text else {}
    return {**words, **({"dwell": marker.dwell} if marker.dwell else {}), "stop": marker.stop}


def path_arguments(curves: Sequence[tuple[Mapping[str, Any], float]], source: object) -> dict[str, Any]:
    """`feeds`, `tolerances` and `markers` of a `Path` of curves, each its checked keys and mm of one unit."""
    arguments: dict[str, Any] = {}
    for key, name in (("feed", "feeds"), ("tolerance", "tolerances")):
        missing = [i for i, (said, _) in enumerate(curves) if key not in said]
        if not missing:
            arguments[name] = [scale * said[key] for said, scale in curves]
        elif len(missing) < len(curves):
            raise FormatError(
                f"{source}: curve {missing[0]} of a path has no {key}, but others have; give all of them one"
            )
    markers = []
    for i, (said, _) in enumerate(curves):
        for key, place in (("before", i), ("after", i + 1)):
            markers += [Marker(place, each.text, each.dwell, each.stop) for each in said.get(key, ())]
    return {**arguments, "markers": markers}
