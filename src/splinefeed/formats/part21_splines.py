"""B-spline curves in the clear text of STEP, written in the way that OCCT can take them: the same curves exactly."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import accumulate
from typing import NamedTuple

_INSTANCE = re.compile(rb"\s*#\s*([0-9]{1,18})\s*=")
#: Degree and control points, in a curve written as one entity and in the parts of a rational one alike.
_CURVE = re.compile(
    rb"B_SPLINE_CURVE(?:_WITH_KNOTS)?\s*\(\s*(?:(?:'\s*'|\$)\s*,\s*)?([0-9]{1,4})\s*,\s*\(([#0-9,\s]*)\)"
)
_CLOSED = re.compile(rb"\s*,\s*\.[A-Z_]+\.\s*,\s*\.([TU])\.")
_TIMES = re.compile(rb"\(\s*([0-9]{1,6}(?:\s*,\s*[0-9]{1,6})+)\s*\)\s*,\s*\(")
_WEIGHTS = re.compile(rb"RATIONAL_B_SPLINE_CURVE\s*\(\s*\(([^()]*)\)")
_NUMBER = re.compile(rb"[0-9]{1,18}")
_POINT = re.compile(rb"#\s*([0-9]{1,18})\s*=\s*CARTESIAN_POINT\s*\(\s*(?:'\s*'|\$)\s*,\s*\(([^()]*)\)")


class _Spline(NamedTuple):
    """What of a curve matters here, and where in the file its lists and the word that calls it closed stand."""

    number: int
    at: int
    degree: int
    points: list[int]
    times: list[int]
    weights: list[bytes]
    spans: tuple[tuple[int, int], tuple[int, int], tuple[int, int]]
    closed: tuple[int, int] | None

    def joints(self) -> list[tuple[int, int, int]]:
        """Each inner knot of multiplicity above the degree p: its place in the list, and the control points there.

        The curve ends on the one before the first of the equal knots and goes on from the one before the last p + 1.
        """
        return [
            (i, end - self.times[i] - 1, end - self.degree - 1)
            for i, end in enumerate(accumulate(self.times))
            if 0 < i < len(self.times) - 1 and self.times[i] > self.degree
        ]

    def fits(self) -> bool:
        """Whether there are as many control points and weights as the knots want."""
        count = sum(self.times) - self.degree - 1
        return self.degree >= 1 and len(self.points) == count and len(self.weights) in (0, count)


def mended(content: bytes, plain: bytes) -> tuple[bytes, list[tuple[int, str]]]:
    """`content` as OCCT can take it, and places in it where it cannot, with the reason.

    `plain` is the same with its strings and comments blank. An inner knot of multiplicity above the degree p becomes
    one of p, less all but one of the control points that meet there, if they are the same. A rational curve called
    closed with other weights at its end than at its beginning is called open: OCCT makes every closed curve periodic
    and drops the last weight. None of this changes a point of a curve.
    """
    splines = list(_splines(plain))
    wanted = {s.points[k] for s in splines if s.fits() for _, *ends in s.joints() for k in ends}
    places: dict[int, list[float]] = {}
    for match in _POINT.finditer(plain) if wanted else ():
        if (number := int(match[1])) in wanted:
            places[number] = [] if number in places else _reals(match[2])  # given twice: nobody knows which it is
    edits: list[tuple[tuple[int, int], bytes]] = []
    faults: list[tuple[int, str]] = []
    for spline in splines:
        points, times, weights = list(spline.points), list(spline.times), list(spline.weights)
        for i, before, after in reversed(spline.joints()):
            if why := _apart(spline, before, after, places):
                says = f"#{spline.number}: an inner knot stands {times[i]} times, more than the degree, and {why}"
                faults.append((spline.at, f"{says}, which OCCT cannot hold; let the CAD system split it there"))
                break
            times[i] = spline.degree
            del points[before + 1 : after + 1], weights[before + 1 : after + 1]
        else:
            lists = [b"#%d" % n for n in points], [b"%d" % n for n in times], weights
            if len(points) < len(spline.points):
                edits += [(span, b",\n".join(words)) for span, words in zip(spline.spans, lists, strict=True) if words]
            if spline.closed and weights and _reals(weights[0]) != _reals(weights[-1]):
                edits.append((spline.closed, b"F"))
    parts, at = [], 0
    for (begin, end), text in sorted(edits):
        parts += [content[at:begin], text]
        at = end
    return (b"".join([*parts, content[at:]]) if parts else content), faults


def _apart(spline: _Spline, before: int, after: int, places: dict[int, list[float]]) -> str:
    """Why the curve does not go on where it ended; empty if it does."""
    if not spline.fits():
        return "its control points or weights are not as many as its knots want"
    here, there = spline.points[before], spline.points[after]
    if here != there and not (places.get(here) and places[here] == places.get(there)):
        return f"the curve jumps there from #{here} to #{there}"
    if spline.weights and _reals(spline.weights[before]) != _reals(spline.weights[after]):
        return f"the weights of #{here} and #{there} are not the same there"
    return ""


def _splines(plain: bytes) -> Iterator[_Spline]:
    """The B-spline curves that may need mending: with such a knot, or rational and called closed."""
    at = 0
    while (word := plain.find(b"B_SPLINE_CURVE", at)) >= 0:
        begin = max(plain.rfind(b";", at, word) + 1, at)
        at = end if (end := plain.find(b";", word)) >= 0 else len(plain)
        name = _INSTANCE.match(plain, begin, at)
        curve, times, weights = (each.search(plain, begin, at) for each in (_CURVE, _TIMES, _WEIGHTS))
        if name is None or curve is None:
            continue  # OCCT will say what is wrong with it
        closed = _CLOSED.match(plain, curve.end(), at)
        spline = _Spline(
            int(name[1]),
            name.start(1),
            int(curve[1]),
            [int(number) for number in _NUMBER.findall(curve[2])],
            [int(time) for time in times[1].split(b",")] if times else [],
            weights[1].split(b",") if weights else [],
            (curve.span(2), times.span(1) if times else (0, 0), weights.span(1) if weights else (0, 0)),
            closed.span(1) if closed else None,
        )
        if spline.joints() or (spline.weights and closed):
            yield spline


def _reals(text: bytes) -> list[float]:
    """The numbers in `text`; none if one of them is none."""
    try:
        return [float(word) for word in text.split(b",")]
    except ValueError:
        return []
