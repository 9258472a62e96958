"""A figure laid out on paper: every line, dot and word at its place, pixels of 1/96 inch from the upper left corner."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from splinefeed.analysis.thinning import envelope, runs
from splinefeed.records import Array
from splinefeed.reports import theme
from splinefeed.reports.marks import Coloured, Dots, FigureData, Heat, Level, Line, Mark, Panel, PlotAxis, Shades

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
#: A curve of more points than so many times its pixels is drawn as the area from the least to the greatest of each
#: column of them; how much of the paper's white that area has; and colours along a path.
DENSE, WHITE, COLOURS = 3.0, 0.62, 64
#: What a figure with such a curve says below it.
ENVELOPE = "{}: the area is from the least to the greatest of each column of pixels"
#: Share of a picture behind which a word stands on the right of its point; on the left as far from the other side.
OUTER = 0.7
#: An arm is drawn so many times along its path, its first and its last pose in ink, with a dot at each joint.
ARMS, INKED, JOINT = 7, 1.8, 4.5
#: Most labels of powers of ten along an axis.
MOST_POWERS = 7
#: An end of the box nearer to 0 than this share of its size is 0: rounding, also of an arc between its samples.
ROUNDING = 1e-6
Box = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Stroke:
    """A line through points (n, 2); NaN breaks it; within the box `clip` (left, top, width, height) alone."""

    points: Array
    colour: str
    width: float
    dash: int = 0
    clip: Box | None = None
    fill: bool = False


@dataclass(frozen=True)
class Dot:
    """A disc."""

    x: float
    y: float
    size: float
    colour: str
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

    def text(self, x: float, y: float, text: str, size: float = SMALL, **how: Any) -> None:
        """Put words on the sheet."""
        self.items.append(Text(x, y, text, size, **how))

    def stroke(self, points: ArrayLike, colour: str, width: float, **how: Any) -> None:
        """Put a line on the sheet."""
        self.items.append(Stroke(np.asarray(points, dtype=np.float64), colour, width, **how))

    def ramp(self, box: Box, levels: Array) -> None:
        """Put the colours of levels (rows, columns), 0 to 1, into a box."""
        self.items.append(Picture(box, theme.shades(levels)))


@dataclass(frozen=True)
class _Scale:
    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def __call__(self, values: ArrayLike) -> Array:
        v, low, high = np.asarray(values, dtype=np.float64), self.low, self.high
        if self.log:
            v, low, high = np.log10(np.maximum(v, 1e-300)), math.log10(low), math.log10(high)
        out: Array = self.start + (v - low) / (high - low) * (self.end - self.start)
        return out

    def at(self, value: float) -> float:
        return float(self(value))

    def ticks(self, apart: float) -> list[tuple[float, str]]:
        """Places and texts, at least so many pixels apart."""
        room = max(abs(self.end - self.start) / apart, 1.0)
        if self.log:
            values = _log_ticks(self.low, self.high, room)
        else:
            step = _round_up((self.high - self.low) / room)
            first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
            values = [k * step for k in range(first, last + 1)]
        return [(self.at(value), theme.tick_text(value)) for value in values]


def layout(figure: FigureData) -> Sheet:
    """The figure on paper."""
    sheet = Sheet(float(figure.width))
    panels = tuple(_flattened(panel) if panel.z else panel for panel in figure.panels)
    y = 10.0
    for line in figure.title.split("\n"):
        y += TITLE
        sheet.text(10.0, y - 6.0, line, LARGE, bold=True)
    heats = any(panel.of(Heat) for panel in panels)
    rows = [name for panel in panels for heat in panel.of(Heat) for name in heat.rows]
    left = max([ROWS, *(text_width(name, SMALL) + 12.0 for name in rows)]) if heats else LEFT
    right = BAR if heats or any(panel.of(Coloured) for panel in panels) else RIGHT
    cell = (figure.width - right + RIGHT) / figure.columns
    width = cell - left - RIGHT
    ends = [_range(panel, panel.x, along=True) for panel in panels]
    for first in range(0, len(panels), figure.columns):
        row = panels[first : first + figure.columns]
        named = not (figure.legend and first)
        lines = [_header(sheet, panel, k * cell + left, y, width, named) for k, panel in enumerate(row)]
        top = y + 7.0 + LINE * max(lines)
        for k, panel in enumerate(row):
            alike = [pair for pair, other in zip(ends, panels, strict=True) if other.x == panel.x]
            across = min(low for low, _ in alike), max(high for _, high in alike)
            below = panels[first + k + figure.columns :: figure.columns]
            footed = all(other.x.label != panel.x.label for other in below)
            foot = top + _panel(sheet, panel, (k * cell + left, top, width), across, footed)
            y = max(y, foot + GAP + (FOOT if footed and panel.x.label else 0.0))
    long = [mark for panel in panels for mark in panel.of(Line) if dense(mark, width)]
    if long:
        y += LINE
        count, bands = max(len(mark.x) for mark in long), any(mark.high is not None for mark in long)
        sheet.text(
            10.0, y, ENVELOPE.format(f"{count:,} {'blocks of ticks' if bands else 'points'}"), colour=theme.FAINT
        )
    sheet.height = math.ceil(y + 4.0)
    return sheet


def dense(mark: Line, width: float) -> bool:
    """Whether a curve has so many points that its envelope is drawn, or is a band."""
    return mark.high is not None or (len(mark.x) > DENSE * width and mark.rising)


def _envelope(mark: Line, x: _Scale, y: _Scale, edges: Array) -> tuple[Array, Array, Array]:
    """Middles of the columns of pixels between edges that a curve or band is seen in, and its ends there, pixels."""
    if mark.high is None:
        return envelope(x(mark.x), y(mark.y), edges)
    sides = np.repeat(x(mark.x), 2)[1:-1]  # both edges of each block
    (middle, least, _), (_, _, most) = (envelope(sides, np.repeat(y(each), 2), edges) for each in (mark.high, mark.y))
    return middle, least, most


def _panel(
    sheet: Sheet, panel: Panel, place: tuple[float, float, float], across: tuple[float, float], footed: bool
) -> float:
    """Draw a panel whose upper left corner and width are given, and give its height."""
    left, top, width = place
    (low, high), (bottom, upper) = across, _range(panel, panel.y, along=False)
    height = float(panel.height)
    if panel.equal:
        wide, tall = high - low, upper - bottom
        height = width * float(np.clip(tall / wide if wide > 0.0 else 1.0, *ASPECTS))
        scale = max(wide / width, tall / height) or 1.0
        low, high = (low + high - scale * width) / 2.0, (low + high + scale * width) / 2.0
        bottom, upper = (bottom + upper - scale * height) / 2.0, (bottom + upper + scale * height) / 2.0
    box = (left, top, width, height)
    x = _Scale(low, high, left, left + width, panel.x.log)
    y = _Scale(bottom, upper, top + height, top, panel.y.log)
    for heat in panel.of(Heat):
        _heat(sheet, heat, box, x)
    if panel.x.label:
        _axes(sheet, panel, box, x, y, footed)
    for mark in panel.marks:
        if isinstance(mark, Line):
            if dense(mark, width):
                middle, least, most = _envelope(mark, x, y, np.linspace(left, left + width, int(width)))
                there = np.isfinite(least)
                for part in (slice(first, last + 1) for first, last in runs(there) if there[first]):
                    edge = np.column_stack([np.tile(middle[part], 2), np.concatenate([least[part], most[part]])])
                    edge[len(edge) // 2 :] = edge[: len(edge) // 2 - 1 : -1]
                    sheet.stroke(edge, theme.paler(mark.colour, WHITE), 0.0, clip=box, fill=True)
                    sheet.stroke(np.append(edge, edge[:1], axis=0), mark.colour, 0.6 * mark.width, clip=box)
            else:
                points = np.column_stack([x(mark.x), y(mark.y)])
                sheet.stroke(points, mark.colour, mark.width, dash=mark.dash, clip=box, fill=mark.fill)
        elif isinstance(mark, Coloured):
            points, thread = (np.column_stack([x(each[:, 0]), y(each[:, 1])]) for each in (mark.place, mark.thread))
            shades = next(iter(mark.shades.values()))
            if mark.rapid is not None:
                sheet.stroke(np.column_stack([x(mark.rapid[:, 0]), y(mark.rapid[:, 1])]), theme.FAINT, 1.0, dash=1)
            _shaded(sheet, mark, shades, points, thread)
            if panel.equal and panel.x.label and mark.joined:
                _arrow(sheet, points)
            _bar(sheet, box, shades.low, shades.high, shades.label)
    taken: list[tuple[float, float]] = []
    words = [_level(sheet, level, box, x, y, taken) for level in panel.levels()]
    sheet.items += [each for each in words if each is not None]  # above all lines, which would strike them through
    for dots in panel.of(Dots):
        _dots(sheet, dots, box, x, y, panel.equal)
    return height


def _axes(sheet: Sheet, panel: Panel, box: Box, x: _Scale, y: _Scale, footed: bool) -> None:
    left, top, width, height = box
    foot = top + height
    across, up = x.ticks(58.0), [] if panel.of(Heat) else y.ticks(25.0)  # nothing lies on a heat map
    for at, _ in across if up else ():
        sheet.stroke([[at, top], [at, foot]], theme.GRID, 0.8)
    for at, words in up:
        sheet.stroke([[left, at], [left + width, at]], theme.GRID, 0.8)
        sheet.text(left - 6.0, at + 4.0, words, anchor="end")
    sheet.stroke([[left, top], [left, foot], [left + width, foot]], theme.FAINT, 0.9)
    for at, words in across if footed else ():
        sheet.text(at, foot + 15.0, words, anchor="middle")
    if footed:
        sheet.text(left + 0.5 * width, foot + 32.0, panel.x.label, NORMAL, anchor="middle")


def _shaded(sheet: Sheet, mark: Coloured, shades: Shades, points: Array, thread: Array) -> None:
    """Draw a path in its colours: a line for each stretch of one colour, or dots on a thin thread."""
    values = np.where(np.isfinite(shades.values), shades.values, shades.low)
    levels = (values - shades.low) / ((shades.high - shades.low) or 1.0) * (COLOURS - 1)
    if mark.joined:
        levels = 0.5 * (levels[:-1] + levels[1:])
    ramp = [f"#{bytes(each).hex()}" for each in theme.shades(np.linspace(0.0, 1.0, COLOURS))]
    number = np.clip(np.rint(levels), 0, COLOURS - 1).astype(np.int64)
    if not mark.joined or np.isnan(thread).any():  # NaN: the tool axis beside the path
        sheet.stroke(thread, theme.FAINT, 0.6)
    if mark.joined:
        for first, last in runs(number) if len(number) else ():
            sheet.stroke(points[first : last + 2], ramp[number[first]], 3.2)
    else:
        there = np.isfinite(points).all(axis=1)  # rapid moves are dashed
        dots = zip(points[there].tolist(), number[there], strict=True)
        sheet.items += [Dot(x, y, 2.4, ramp[k]) for (x, y), k in dots]


def _arrow(sheet: Sheet, points: Array) -> None:
    points = points[np.isfinite(points).all(axis=1)]
    size = float(np.max(np.ptp(points, axis=0)))
    away = np.linalg.norm(points - points[0], axis=1)
    ahead = points[np.argmax(away > 0.05 * size)] - points[0]
    if not ahead.any():
        return
    along = ahead / np.hypot(*ahead)
    across = np.array([-along[1], along[0]])
    tip, back = points[0] + 34.0 * along, points[0] + 22.0 * along
    sheet.stroke([points[0], back], theme.INK, 1.8)
    sheet.stroke([tip, back + 5.0 * across, back - 5.0 * across, tip], theme.INK, 0.0, fill=True)


def _level(sheet: Sheet, level: Level, box: Box, x: _Scale, y: _Scale, taken: list[tuple[float, float]]) -> Text | None:
    """Draw a level, and give its words.

    `taken` has the places of words of other levels: words that would lie on them end before them.
    """
    left, top, width, height = box
    if level.upright:
        at = x.at(level.value)
        ends, words = [[at, top], [at, top + height]], (at - 4.0, top + 12.0)
    else:
        at = y.at(level.value)
        ends, words = [[left, at], [left + width, at]], (left + width - 3.0, at + (12.0 if level.value < 0.0 else -4.0))
    sheet.stroke(ends, level.colour, 1.1, dash=1, clip=box)
    if not level.text:
        return None
    if not level.upright:
        end = min([words[0], *(begin - 10.0 for line, begin in taken if abs(line - words[1]) < LINE)])
        words = max(end, left + text_width(level.text, SMALL)), words[1]
        taken.append((words[1], words[0] - text_width(level.text, SMALL)))
    return Text(*words, level.text, colour=level.colour, anchor="end")


def _dots(sheet: Sheet, mark: Dots, box: Box, x: _Scale, y: _Scale, equal: bool) -> None:
    left, top, width, height = box
    worded = (*mark.words, *[""] * len(mark.x))
    for px, py, words in zip(x(mark.x).tolist(), y(mark.y).tolist(), worded, strict=False):
        if not math.isfinite(px + py):
            continue
        if mark.size:
            sheet.items.append(Dot(px, py, mark.size, mark.colour, box))
        if not words:
            continue
        side = _side((px - left) / width)
        over = py < top + 0.5 * height
        if equal:  # outside of what is drawn
            shift, anchor = (10.0 * side, 4.0 if side else -9.0 if over else 19.0), ("end", "middle", "start")[side + 1]
        else:  # inside, where there is room
            shift, anchor = (-8.0 if side > 0 else 8.0, 16.0 if over else -8.0), "end" if side > 0 else "start"
        sheet.text(px + shift[0], py + shift[1], words, NORMAL, anchor=anchor)


def _heat(sheet: Sheet, heat: Heat, box: Box, x: _Scale) -> None:
    left, top, _, height = box
    start, end = x(heat.x[[0, -1]]).tolist()
    sheet.ramp((start, top, end - start, height), heat.columns(int(end - start))[1])
    tall = height / max(len(heat.rows), 1)
    for k, name in enumerate(heat.rows):
        sheet.text(left - 6.0, top + (k + 0.5) * tall + 4.0, name, anchor="end")
    _bar(sheet, box, 0.0, 1.0, heat.label)


def _bar(sheet: Sheet, box: Box, low: float, high: float, label: str) -> None:
    left, top, width, height = box
    x = left + width + 14.0
    sheet.ramp((x, top, 13.0, height), np.linspace(1.0, 0.0, 256)[:, None])
    for at, words in _Scale(low, high if high > low else low + 1.0, top + height, top).ticks(40.0):
        sheet.text(x + 18.0, at + 4.0, words)
    sheet.text(x + 70.0, top - 7.0, label, NORMAL, anchor="end")


def _flattened(panel: Panel) -> Panel:
    """A path in space as its eye sees it from far away, in the box around it: a picture in the plane without axes."""
    (path,) = panel.of(Coloured)
    towards = np.array(theme.EYE) / np.linalg.norm(theme.EYE)
    right = np.array([-towards[1], towards[0], 0.0]) / np.hypot(towards[0], towards[1])
    seen = np.column_stack([right, np.cross(towards, right)])
    whole = path.place if path.rapid is None else np.concatenate([path.place, path.rapid])
    ends = np.array([np.nanmin(whole, axis=0), np.nanmax(whole, axis=0)])
    corners = np.array([[ends[k >> axis & 1, axis] for axis in range(3)] for k in range(8)]) @ seen
    ends[np.abs(ends) <= ROUNDING * np.max(np.ptp(ends, axis=0))] = 0.0
    marks: list[Mark] = []
    measures: list[Mark] = []  # over the path
    for axis, label in enumerate((panel.x.label, panel.y.label, panel.z)):
        edges = np.array([corners[[k, k | 1 << axis]] for k in range(8) if not k >> axis & 1])
        marks += [Line(x, y, colour=theme.GRID, width=1.0) for x, y in edges.transpose(0, 2, 1)]
        middles = edges.mean(axis=1)
        at = middles[np.argmin(middles[:, int(axis < 2)])]  # the lowest edge, of z leftmost
        words = f"{label}: {theme.short(ends[0, axis])} to {theme.short(ends[1, axis])}"
        measures.append(Dots(at[:1], at[1:], words=(words,), size=0.0))
    if path.arm is not None:
        poses = path.arm[1][np.linspace(0, len(path.arm[1]) - 1, ARMS).round().astype(int)] @ seen
        marks += [Line(x, y, colour=theme.PALE, width=1.0) for x, y in poses[1:-1].transpose(0, 2, 1)]
        for (x, y), colour in ((poses[0].T, theme.INK), (poses[-1].T, theme.FAINT)):
            marks += [Line(x, y, colour=colour, width=INKED), Dots(x[:-1], y[:-1], colour=colour, size=JOINT)]
    rapid = None if path.rapid is None else path.rapid @ seen
    marks.append(replace(path, place=path.place @ seen, thread=path.thread @ seen, rapid=rapid))
    marks += measures
    for dots in panel.of(Dots):
        x, y = (np.column_stack([dots.x, dots.y, *dots.z]) @ seen).T
        marks.append(replace(dots, x=x, y=y))
    return Panel(PlotAxis(""), PlotAxis(""), tuple(marks), panel.note, equal=True)


def _header(sheet: Sheet, panel: Panel, left: float, top: float, width: float, named: bool) -> int:
    """Write the words above a panel, and give their lines: label, names of curves where wanted, note, far limits."""
    pieces: list[tuple[str, Line | Dots | None, str]] = [("" if panel.of(Heat) else panel.y.label, None, theme.INK)]
    pieces += [(words, mark, theme.INK) for words, mark in panel.legend() if named]
    pieces.append((panel.note, None, theme.FAINT))
    far = [level for level in panel.levels(drawn=False) if level.text]
    pieces += [(f"{level.text}: beyond this scale", None, level.colour) for level in far]
    x, lines = 0.0, 1
    for text, mark, colour in pieces:
        if not text:
            continue
        sample = 21.0 if mark else 0.0
        wide = sample + text_width(text, NORMAL) + 16.0
        if x and x + wide > width:
            x, lines = 0.0, lines + 1
        at, y = left + x, top + LINE * lines
        if isinstance(mark, Line):
            sheet.stroke([[at, y - 4.0], [at + 16.0, y - 4.0]], mark.colour, max(mark.width, 2.0), dash=mark.dash)
        elif mark is not None:
            sheet.items.append(Dot(at + 8.0, y - 4.0, max(mark.size, 5.0), mark.colour))
        sheet.text(at + sample, y, text, NORMAL, colour=colour)
        x += wide
    return lines


def text_width(text: str, size: float) -> float:
    """About how wide words are in DejaVu Sans, pixels."""
    narrow = sum(c in "iljft.,:;'|!()[]/ " for c in text)
    wide = sum(c in "mwMW%@" for c in text)
    return size * (0.37 * narrow + 0.92 * wide + 0.63 * (len(text) - narrow - wide))


def _range(panel: Panel, axis: PlotAxis, *, along: bool) -> tuple[float, float]:
    """The ends of an axis: those that are said, or around the data."""
    column = 0 if along else 1
    values = [np.array([level.value for level in panel.levels() if level.upright is along])]
    for mark in panel.marks:
        if isinstance(mark, Line | Dots):
            values.append(mark.x if along else mark.values)
        elif isinstance(mark, Coloured):
            values += [mark.place[:, column], mark.thread[:, column]]
        elif isinstance(mark, Heat) and along:
            values.append(mark.x)
    found = np.concatenate(values)
    found = found[np.isfinite(found) & ((found > 0.0) | (not axis.log))]
    low, high = (float(found.min()), float(found.max())) if len(found) else (0.1, 1.0)
    if axis.log:
        room = 2.0 if low == high else 1.05 if along else 1.15
        low, high = low / room, high * room
    elif not panel.of(Heat):
        if high - low <= 1e-12 * max(abs(low), abs(high)):
            low, high = low - (abs(low) or 1.0) * 0.5, high + (abs(high) or 1.0) * 0.5
        upright = WORDED if any(level.text for level in panel.levels()) else AROUND
        room = (PICTURE if panel.equal else ASIDE if along else upright) * (high - low)
        low, high = low - room, high + room
        if along and panel.equal:
            low, high = _with_words(panel, low, high)
    return low if axis.low is None else axis.low, high if axis.high is None else axis.high


def _with_words(panel: Panel, low: float, high: float) -> tuple[float, float]:
    """Room on both sides of a picture for the words beside points that are near them."""
    left = right = 0.0
    for dots in panel.of(Dots):
        for x, words in zip(dots.x, dots.words, strict=False):
            side, room = _side((x - low) / (high - low)), text_width(words, NORMAL) / 560.0 * (high - low)
            left, right = (max(left, room), right) if side < 0 else (left, max(right, room)) if side else (left, right)
    return low - left, high + right


def _side(share: float) -> int:
    """On which side of a point its word goes, by where the point is: 1 right, -1 left, 0 above or below."""
    return 1 if share > OUTER else -1 if share < 1.0 - OUTER else 0


def _round_up(step: float) -> float:
    power = 10.0 ** math.floor(math.log10(step)) if step > 0.0 and math.isfinite(step) else 1.0
    return next((k * power for k in (1.0, 2.0, 2.5, 5.0) if k * power >= step * (1.0 - 1e-9)), 10.0 * power)


def _log_ticks(low: float, high: float, room: float) -> list[float]:
    """Powers of ten, thinned; 1, 2 and 5 times them where there are few."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    powers = [10.0**p for p in range(first, last + 1) if low * (1 - 1e-9) <= 10.0**p <= high * (1 + 1e-9)]
    if len(powers) >= 3:
        return powers[:: 1 + (len(powers) - 1) // min(int(room) or 1, MOST_POWERS)]
    values = [k * 10.0**p for p in range(first, last + 1) for k in (1.0, 2.0, 5.0)]
    return [value for value in values if low <= value <= high]
