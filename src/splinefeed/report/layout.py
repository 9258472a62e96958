"""A figure laid out on paper: every line, dot and word at its place, pixels of 1/96 inch from the upper left corner."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from splinefeed.analysis.thinning import extremes, runs
from splinefeed.records import Array
from splinefeed.report import theme
from splinefeed.report.figure import Axis, Coloured, Dots, Figure, Heat, Level, Line, Mark, Panel, Shades, legend_of

#: Room left of a panel, right of it without and with a colour bar, above its first line of words, below its x axis.
LEFT, RIGHT, BAR, FOOT = 62.0, 16.0, 92.0, 40.0
#: Room of one line of words, of one of the title, between panels, and letters of a row of a heat map.
LINE, TITLE, GAP, ROWS = 17.0, 19.0, 9.0, 118.0
#: Sizes of letters: ticks, words, title.
SMALL, NORMAL, LARGE = 11.5, 12.5, 14.5
#: Height of a picture with equal scales over its width, at the least and at the most.
ASPECTS = (0.22, 0.85)
#: Room around the data, shares of it: above and below, there with words on a line, aside, and of a picture.
AROUND, WORDED, ASIDE, PICTURE = 0.08, 0.2, 0.01, 0.06
#: Columns of pixels that a long curve is thinned to, and colours along a path.
COLUMNS, COLOURS = 600, 64
#: Share of a picture behind which a word stands on the right of its point; on the left as far from the other side.
OUTER = 0.7
#: Most labels of powers of ten along an axis.
MOST_POWERS = 7
#: From where a path in space is looked at: x to the right, y away, z up. The page does the same.
EYE = np.array([-0.8, -1.85, 1.2])
DASH = (5.0, 3.0)
#: An end of the box nearer to 0 than this share of its size is 0, but for rounding.
ROUNDING = 1e-12
Box = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Stroke:
    """A line through points (n, 2); NaN breaks it; within the box `clip` (left, top, width, height) alone."""

    points: Array
    colour: str
    width: float
    dash: bool = False
    clip: Box | None = None
    fill: bool = False


@dataclass(frozen=True)
class Dot:
    """A disc, or a ring that is white inside."""

    x: float
    y: float
    size: float
    colour: str
    hollow: bool = False
    clip: Box | None = None


@dataclass(frozen=True)
class Text:
    """Words; `anchor` start, middle or end, the baseline at y."""

    x: float
    y: float
    text: str
    size: float = SMALL
    colour: str = theme.INK
    anchor: str = "start"
    bold: bool = False


@dataclass(frozen=True, eq=False)
class Picture:
    """Pixels (rows, columns, 3), 0 to 255, stretched over a box."""

    box: Box
    pixels: np.ndarray


Item = Stroke | Dot | Text | Picture


@dataclass(eq=False)
class Sheet:
    """Paper of that size with what lies on it, the lowest first."""

    width: float
    height: float = 0.0
    items: list[Item] = field(default_factory=list)

    def text(self, x: float, y: float, text: str, **how: object) -> None:
        """Put words on the sheet."""
        self.items.append(Text(x, y, text, **how))  # type: ignore[arg-type]

    def stroke(self, points: object, colour: str, width: float, **how: object) -> None:
        """Put a line on the sheet."""
        self.items.append(Stroke(np.asarray(points, dtype=np.float64), colour, width, **how))  # type: ignore[arg-type]


@dataclass(frozen=True)
class _Scale:
    """From values to pixels along one axis."""

    low: float
    high: float
    start: float
    end: float
    log: bool

    def __call__(self, values: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            v = np.log10(np.maximum(values, 1e-300)) if self.log else np.asarray(values, dtype=np.float64)
        low, high = (math.log10(self.low), math.log10(self.high)) if self.log else (self.low, self.high)
        out: Array = self.start + (v - low) / (high - low) * (self.end - self.start)
        return out

    def at(self, value: float) -> float:
        return float(self(np.array([value]))[0])

    def ticks(self, apart: float) -> list[tuple[float, str]]:
        """Values and their texts, at least so many pixels apart."""
        room = max(abs(self.end - self.start) / apart, 1.0)
        if self.log:
            return _log_ticks(self.low, self.high, room)
        step = _round_up((self.high - self.low) / room)
        first = math.ceil(self.low / step - 1e-9)
        values = [k * step for k in range(first, math.floor(self.high / step + 1e-9) + 1)]
        return [(value, theme.tick_text(value)) for value in values]


def layout(figure: Figure) -> Sheet:
    """The figure on paper."""
    sheet = Sheet(float(figure.width))
    panels = tuple(_flattened(panel) if panel.z else panel for panel in figure.panels)
    y = 10.0
    for line in figure.title.split("\n"):
        y += TITLE
        sheet.text(10.0, y - 6.0, line, size=LARGE, bold=True)
    barred = [any(isinstance(mark, Coloured | Heat) for mark in panel.marks) for panel in panels]
    heats = any(isinstance(mark, Heat) for panel in panels for mark in panel.marks)
    right = BAR if any(barred) else RIGHT
    left = ROWS if heats else LEFT
    cell = (figure.width - right + RIGHT) / figure.columns
    width = cell - left - RIGHT
    ranges: dict[tuple[str, bool], tuple[float, float]] = {}
    for panel in panels:
        key = panel.x.label, panel.x.log
        low, high = _range(panel, panel.x, along=True)
        known = ranges.get(key, (low, high))
        ranges[key] = min(low, known[0]), max(high, known[1])
    for first in range(0, len(panels), figure.columns):
        row = panels[first : first + figure.columns]
        headers = [_header(panel, width, named=not (figure.legend and first)) for panel in row]
        top = y + 7.0 + LINE * max((len(lines) for lines in headers), default=1)
        heights, foot = [], 0.0
        for k, (panel, lines) in enumerate(zip(row, headers, strict=True)):
            x0 = k * cell + left
            _write_header(sheet, lines, x0, top - 7.0)
            below = panels[first + k + figure.columns :: figure.columns]
            footed = not any(other.x.label == panel.x.label for other in below)
            foot = max(foot, FOOT if footed and panel.x.label else 0.0)
            heights.append(_panel(sheet, panel, (x0, top, width), ranges[panel.x.label, panel.x.log], footed))
        y = top + max(heights) + foot + GAP
    sheet.height = math.ceil(y + 4.0)
    return sheet


def _panel(
    sheet: Sheet, panel: Panel, place: tuple[float, float, float], across: tuple[float, float], footed: bool
) -> float:
    """Draw a panel whose upper left corner and width are given, and give its height."""
    left, top, width = place
    heat = next((mark for mark in panel.marks if isinstance(mark, Heat)), None)
    (low, high), (bottom, upper) = across, _range(panel, panel.y, along=False)
    height = float(panel.height)
    if panel.equal:
        wide, tall = high - low, upper - bottom
        height = width * float(np.clip(tall / wide if wide > 0.0 else 1.0, *ASPECTS))
        scale = max(wide / width, tall / height) or 1.0
        low, high = (low + high - scale * width) / 2.0, (low + high + scale * width) / 2.0
        bottom, upper = (bottom + upper - scale * height) / 2.0, (bottom + upper + scale * height) / 2.0
    box = (left, top, width, height)
    if heat is not None:
        bottom, upper = 0.0, 1.0
    x = _Scale(low, high, left, left + width, panel.x.log)
    y = _Scale(bottom, upper, top + height, top, panel.y.log)
    if heat is not None:
        _heat(sheet, heat, box, x)
    if panel.x.label:
        _axes(sheet, panel, box, x, None if heat is not None else y, footed)
    for mark in panel.marks:
        if isinstance(mark, Line):
            kept = np.arange(len(mark.x)) if mark.fill else _thinned(mark)
            points = np.column_stack([x(mark.x[kept]), y(mark.y[kept])])
            sheet.stroke(points, mark.colour, mark.width, dash=mark.dash, clip=box, fill=mark.fill)
        elif isinstance(mark, Coloured):
            points = np.column_stack([x(mark.place[:, 0]), y(mark.place[:, 1])])
            thread = np.column_stack([x(mark.thread[:, 0]), y(mark.thread[:, 1])])
            shades = _shaded(sheet, mark, points, thread)
            if panel.equal and panel.x.label and mark.joined:
                _arrow(sheet, points)
            _bar(sheet, box, shades.low, shades.high, shades.label)
    for level in panel.levels():
        _level(sheet, level, box, x, y)
    for mark in panel.marks:
        if isinstance(mark, Dots):
            _dots(sheet, mark, box, x, y, panel.equal)
    return height


def _axes(sheet: Sheet, panel: Panel, box: Box, x: _Scale, y: _Scale | None, footed: bool) -> None:
    left, top, width, height = box
    under: list[Item] = []
    foot = top + height
    for value, text in x.ticks(58.0):
        at = x.at(value)
        under.append(Stroke(np.array([[at, top], [at, foot]]), theme.GRID, 0.8))
        if footed:
            sheet.text(at, foot + 15.0, text, anchor="middle")
    for value, text in y.ticks(25.0) if y is not None else ():
        at = y.at(value) if y is not None else 0.0
        under.append(Stroke(np.array([[left, at], [left + width, at]]), theme.GRID, 0.8))
        sheet.text(left - 6.0, at + 4.0, text, anchor="end")
    under.append(Stroke(np.array([[left, top], [left, foot], [left + width, foot]]), theme.FAINT, 0.9))
    if y is None:
        under = under[-1:]  # nothing lies on a heat map
    sheet.items.extend(under)
    if footed:
        sheet.text(left + 0.5 * width, foot + 32.0, panel.x.label, size=NORMAL, anchor="middle")


def _thinned(mark: Line) -> np.ndarray | slice:
    """Every peak of a long curve over a rising x; another curve is drawn as it is."""
    if len(mark.x) <= 4 * COLUMNS or not np.all(np.diff(mark.x) >= 0.0):
        return slice(None)
    return extremes(mark.y, COLUMNS)


def _shaded(sheet: Sheet, mark: Coloured, points: Array, thread: Array) -> Shades:
    """Draw a path in its colours: a line for each stretch of one colour, or dots on a thin thread."""
    shades = next(iter(mark.shades.values()))
    levels = np.where(np.isfinite(shades.values), shades.values, shades.low)
    levels = (levels - shades.low) / ((shades.high - shades.low) or 1.0) * (COLOURS - 1)
    ramp = [hexed(theme.shade(k / (COLOURS - 1))) for k in range(COLOURS)]
    if not mark.joined:
        sheet.stroke(thread, theme.FAINT, 0.6)
        for at, level in zip(points, np.clip(np.rint(levels), 0, COLOURS - 1).astype(int), strict=True):
            sheet.items.append(Dot(float(at[0]), float(at[1]), 2.4, ramp[level]))
        return shades
    if np.isnan(thread).any():  # the tool axis beside the path
        sheet.stroke(thread, theme.FAINT, 0.6)
    middle = np.clip(np.rint(0.5 * (levels[:-1] + levels[1:])), 0, COLOURS - 1).astype(np.int64)
    for first, last in runs(middle) if len(middle) else ():
        sheet.stroke(points[first : last + 2], ramp[middle[first]], 3.2)
    return shades


def _arrow(sheet: Sheet, points: Array) -> None:
    """The direction of travel at the start."""
    size = float(np.max(np.ptp(points, axis=0)))
    away = np.linalg.norm(points - points[0], axis=1)
    ahead = points[np.argmax(away > 0.05 * size)] - points[0]
    length = float(np.hypot(*ahead))
    if length <= 0.0:
        return
    along = ahead / length
    across = np.array([-along[1], along[0]])
    tip, back = points[0] + 34.0 * along, points[0] + 22.0 * along
    sheet.stroke([points[0], back], theme.INK, 1.8)
    sheet.stroke([tip, back + 5.0 * across, back - 5.0 * across, tip], theme.INK, 0.0, fill=True)


def _level(sheet: Sheet, level: Level, box: Box, x: _Scale, y: _Scale) -> None:
    left, top, width, height = box
    if level.upright:
        at = x.at(level.value)
        sheet.stroke([[at, top], [at, top + height]], level.colour, 1.1, dash=True, clip=box)
        sheet.text(at - 4.0, top + 12.0, level.text, colour=level.colour, anchor="end")
        return
    at = y.at(level.value)
    sheet.stroke([[left, at], [left + width, at]], level.colour, 1.1, dash=True, clip=box)
    if level.text:
        sheet.text(
            left + width - 3.0, at - 4.0 if level.value >= 0.0 else at + 12.0, level.text, colour=level.colour,
            anchor="end",
        )  # fmt: skip


def _dots(sheet: Sheet, mark: Dots, box: Box, x: _Scale, y: _Scale, equal: bool) -> None:
    left, top, width, height = box
    for k, (px, py) in enumerate(zip(x(mark.x), y(mark.y), strict=True)):
        if not np.isfinite(px + py):
            continue
        if mark.size:
            sheet.items.append(Dot(float(px), float(py), mark.size, mark.colour, mark.hollow, box))
        if k >= len(mark.words):
            continue
        side = _side((px - left) / width)
        over = py < top + 0.5 * height
        if equal:  # outside of what is drawn
            shift, anchor = (10.0 * side, 4.0 if side else -9.0 if over else 19.0), ("end", "middle", "start")[side + 1]
        else:  # inside, where there is room
            shift, anchor = (-8.0 if side > 0 else 8.0, 16.0 if over else -8.0), "end" if side > 0 else "start"
        sheet.text(px + shift[0], py + shift[1], mark.words[k], size=NORMAL, anchor=anchor)


def _heat(sheet: Sheet, heat: Heat, box: Box, x: _Scale) -> None:
    left, top, _, height = box
    ramp = np.array([theme.shade(k / 255.0) for k in range(256)], dtype=np.uint8)
    levels = np.clip(np.nan_to_num(heat.share) * 255.0, 0, 255).astype(np.int64)
    half = 0.5 * (heat.x[1] - heat.x[0]) if len(heat.x) > 1 else 0.5 * (x.high - x.low)
    start, end = x.at(float(heat.x[0]) - half), x.at(float(heat.x[-1]) + half)
    sheet.items.append(Picture((start, top, end - start, height), ramp[levels]))
    tall = height / max(len(heat.rows), 1)
    for k, name in enumerate(heat.rows):
        sheet.text(left - 6.0, top + (k + 0.5) * tall + 4.0, name, anchor="end")
    _bar(sheet, box, 0.0, 1.0, heat.label)


def _bar(sheet: Sheet, box: Box, low: float, high: float, label: str) -> None:
    """A scale of colours on the right, its label above it."""
    left, top, width, height = box
    x = left + width + 14.0
    ramp = np.array([[theme.shade(1.0 - k / 255.0)] for k in range(256)], dtype=np.uint8)
    sheet.items.append(Picture((x, top, 13.0, height), ramp))
    scale = _Scale(low, high if high > low else low + 1.0, top + height, top, log=False)
    for value, text in scale.ticks(40.0):
        sheet.text(x + 18.0, scale.at(value) + 4.0, text)
    sheet.text(x + 70.0, top - 7.0, label, size=NORMAL, anchor="end")


def _flattened(panel: Panel) -> Panel:
    """A path in space as its eye sees it from far away, in the box around it: a picture in the plane without axes."""
    mark = next(mark for mark in panel.marks if isinstance(mark, Coloured))
    towards = EYE / np.linalg.norm(EYE)
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(towards[0], towards[1])
    seen = np.column_stack([right, np.cross(towards, right)])
    ends = np.array([mark.place.min(axis=0), mark.place.max(axis=0)])
    corners = np.array([[ends[k >> axis & 1, axis] for axis in range(3)] for k in range(8)]) @ seen
    ends_shown = np.where(np.abs(ends) > ROUNDING * np.max(np.ptp(ends, axis=0)), ends, 0.0)
    edges: list[Array] = []
    marks: list[Mark] = []
    for axis, label in enumerate((panel.x.label, panel.y.label, panel.z)):
        starts = [k for k in range(8) if not k >> axis & 1]
        edges += [np.array([corners[k], corners[k | 1 << axis], [np.nan, np.nan]]) for k in starts]
        middles = [0.5 * (corners[k] + corners[k | 1 << axis]) for k in starts]
        x, y = min(middles, key=lambda at: at[1] if axis < 2 else at[0])  # the lowest edge, of z the leftmost
        words = f"{label}: {theme.short(ends_shown[0, axis])} to {theme.short(ends_shown[1, axis])}"
        marks.append(Dots(np.array([x]), np.array([y]), words=(words,), size=0.0))
    box, start = np.concatenate(edges), mark.place[:1] @ seen
    marks.append(Line(box[:, 0], box[:, 1], colour=theme.GRID, width=1.0))
    marks.append(replace(mark, place=mark.place @ seen, thread=mark.thread @ seen))
    marks.append(Dots(start[:, 0], start[:, 1], words=("start",), colour=theme.INK, size=8.0))
    return Panel(Axis(""), Axis(""), tuple(marks), panel.note, equal=True)


def _header(panel: Panel, width: float, named: bool) -> list[list[tuple[str, Line | Dots | None, str]]]:
    """Lines of words above a panel: the label, the names of curves with their colours where wanted, and the note."""
    pieces: list[tuple[str, Line | Dots | None, str]] = []
    label = "" if any(isinstance(mark, Heat) for mark in panel.marks) else panel.y.label
    if label:
        pieces.append((label, None, theme.INK))
    for mark in panel.marks:
        if isinstance(mark, Line | Dots) and legend_of(mark) and named:
            pieces.append((legend_of(mark), mark, theme.INK))
    if panel.note:
        pieces.append((panel.note, None, theme.FAINT))
    pieces += [
        (f"{each.text}: beyond this scale", None, each.colour) for each in panel.levels(drawn=False) if each.text
    ]
    lines: list[list[tuple[str, Line | Dots | None, str]]] = [[]]
    used = 0.0
    for piece in pieces:
        wide = _advance(piece)
        if lines[-1] and used + wide > width:
            lines.append([])
            used = 0.0
        lines[-1].append(piece)
        used += wide
    return lines


def _write_header(sheet: Sheet, lines: list[list[tuple[str, Line | Dots | None, str]]], left: float, y: float) -> None:
    y -= LINE * (len(lines) - 1)
    for line in lines:
        x = left
        for piece in line:
            text, mark, colour = piece
            if isinstance(mark, Line):
                sheet.stroke([[x, y - 4.0], [x + 16.0, y - 4.0]], mark.colour, max(mark.width, 2.0), dash=mark.dash)
            elif mark is not None:
                sheet.items.append(Dot(x + 8.0, y - 4.0, max(mark.size, 5.0), mark.colour, mark.hollow))
            sheet.text(x + (21.0 if mark else 0.0), y, text, size=NORMAL, colour=colour)
            x += _advance(piece)
        y += LINE


def _advance(piece: tuple[str, Line | Dots | None, str]) -> float:
    return text_width(piece[0], NORMAL) + (21.0 if piece[1] else 0.0) + 16.0


def text_width(text: str, size: float) -> float:
    """About how wide words are in DejaVu Sans, pixels."""
    narrow = sum(c in "iljft.,:;'|!()[]/ " for c in text)
    wide = sum(c in "mwMW%@" for c in text)
    return size * (0.37 * narrow + 0.92 * wide + 0.63 * (len(text) - narrow - wide))


def _range(panel: Panel, axis: Axis, *, along: bool) -> tuple[float, float]:
    """The ends of an axis: those that are said, or around the data."""
    values = []
    for mark in panel.marks:
        if isinstance(mark, Line | Dots):
            values.append(mark.x if along else mark.y)
        elif isinstance(mark, Coloured):
            values += [mark.place[:, 0 if along else 1], mark.thread[:, 0 if along else 1]]
        elif isinstance(mark, Heat) and along:
            half = 0.5 * (mark.x[1] - mark.x[0]) if len(mark.x) > 1 else 0.0
            values.append(np.array([mark.x[0] - half, mark.x[-1] + half]))
    values.append(np.array([level.value for level in panel.levels() if level.upright is along]))
    found = np.concatenate(values)
    found = found[np.isfinite(found) & ((found > 0.0) | (not axis.log))]
    low, high = (float(found.min()), float(found.max())) if len(found) else (0.1, 1.0)
    if axis.log:
        room = 2.0 if low == high else 1.05 if along else 1.15
        low, high = low / room, high * room
    else:
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            low, high = low - (abs(low) or 1.0) * 0.5, high + (abs(high) or 1.0) * 0.5
        heat = any(isinstance(mark, Heat) for mark in panel.marks)
        worded = any(level.text for level in panel.levels())
        room = PICTURE if panel.equal else 0.0 if along and heat else ASIDE if along else WORDED if worded else AROUND
        low, high = low - room * (high - low), high + room * (high - low)
        if along and panel.equal:
            low, high = _with_words(panel, low, high)
    return axis.low if axis.low is not None else low, axis.high if axis.high is not None else high


def _with_words(panel: Panel, low: float, high: float) -> tuple[float, float]:
    """Room on both sides of a picture for the words beside points that are near them."""
    left = right = 0.0
    for mark in panel.marks:
        for x, words in zip(mark.x, mark.words, strict=False) if isinstance(mark, Dots) else ():
            side, room = _side((x - low) / (high - low)), text_width(words, NORMAL) / 560.0 * (high - low)
            left, right = (max(left, room), right) if side < 0 else (left, max(right, room)) if side else (left, right)
    return low - left, high + right


def _side(share: float) -> int:
    """On which side of a point its word goes, by where the point is: 1 right, -1 left, 0 above or below."""
    return 1 if share > OUTER else -1 if share < 1.0 - OUTER else 0


def _round_up(step: float) -> float:
    """The next 1, 2, 2.5 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(step)) if step > 0.0 and math.isfinite(step) else 1.0
    return next((k * power for k in (1.0, 2.0, 2.5, 5.0) if k * power >= step * (1.0 - 1e-9)), 10.0 * power)


def _log_ticks(low: float, high: float, room: float) -> list[tuple[float, str]]:
    """Powers of ten, thinned; 1, 2 and 5 times them where there are few."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    powers = [p for p in range(first, last + 1) if low * (1 - 1e-9) <= 10.0**p <= high * (1 + 1e-9)]
    if len(powers) >= 3:
        step = 1 + (len(powers) - 1) // min(int(room) or 1, MOST_POWERS)
        return [(10.0**p, f"1e{p}" if abs(p) > 3 else theme.tick_text(10.0**p)) for p in powers[::step]]
    values = [k * 10.0**p for p in range(first, last + 1) for k in (1.0, 2.0, 5.0)]
    return [(value, theme.tick_text(value)) for value in values if low <= value <= high]


def hexed(colour: tuple[int, int, int]) -> str:
    """Red, green and blue as #rrggbb."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
