"""How every figure looks: colours that colour-blind readers can tell apart, and short numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from splinefeed.paths.path import Path
from splinefeed.records import Array, raised, unit_of, unit_of_axis

#: Okabe and Ito's colours, https://jfly.uni-koeln.de/color/: distinct with every kind of colour blindness.
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
#: In place of their orange, sky blue and yellow, which white paper does not show: brown, ink and violet. Any two of the
#: colours of axes are at least 15 apart in CIELAB, to colour-blind eyes, too (Machado, Oliveira & Fernandes 2009,
#: doi:10.1109/TVCG.2009.113).
BROWN = "#772200"
PURPLE = "#CC79A7"
INK = "#1a1a1a"
VIOLET = "#8800FF"
FAINT = "#6b6b6b"
#: What stands behind the thing that is shown.
PALE = "#8a8f94"
GRID = "#e3e3e3"
#: Colours of axes and of methods, in turn; dress.js has those of a dark page.
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, BROWN, INK, VIOLET)
#: Those in which words are read on white paper, at a contrast of 4.5 or more (WCAG 2.2, 1.4.3), in place of others.
WORDS = {VERMILION: "#B84F00", GREEN: "#007A59", PURPLE: "#A34F7B"}
#: Ten colours of Matplotlib's viridis (CC0), and the part of it that white paper shows; dress.js has the same.
VIRIDIS = (
    "#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725",
)  # fmt: skip
SEEN = 0.93
#: How dashed curves run, pixels of line and gap in turn, the first not at all; as Plotly calls them; and as letters.
DASHES: tuple[tuple[float, ...], ...] = ((), (5.0, 3.0), (1.6, 2.2), (8.0, 2.5, 1.6, 2.5), (12.0, 4.0))
DASH_NAMES, DASH_SAMPLES = ("solid", "dash", "dot", "dashdot", "longdash"), ("━━", "╍╍", "┉┉", "━┉", "━╍")
#: Curves of so many colours are solid; those of the others are dashed, too.
SOLID = 4
#: From where a path in space is looked at: x to the right, y away, z up.
EYE = (-0.8, -1.85, 1.2)


def colour(number: int) -> str:
    """The colour of the curve of that number."""
    return COLOURS[number % len(COLOURS)]


def dash(number: int) -> int:
    """Which of DASHES the curve of that number has: no two curves have one colour, or two that look alike, and it."""
    return (2 * (number // len(COLOURS)) + (number % len(COLOURS) >= SOLID)) % len(DASHES)


def shades(share: Array) -> NDArray[np.uint8]:
    """Red, green and blue (..., 3), 0 to 255, of shares from 0 to 1 of a scale."""
    ends = np.linspace(0.0, 1.0, len(VIRIDIS))
    parts = np.array([[int(each[k : k + 2], 16) for each in VIRIDIS] for k in (1, 3, 5)])
    at = SEEN * np.clip(np.nan_to_num(share), 0.0, 1.0)
    return np.array(np.rint(np.stack([np.interp(at, ends, part) for part in parts], axis=-1)), dtype=np.uint8)


def paler(of: str, white: float) -> str:
    """A colour mixed with that share of white."""
    parts = (int(of[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(part + white * (255 - part)):02x}" for part in parts)


def words(name: str, longest: int = 48) -> str:
    """`name` for a title: without what cannot be printed, and not too long."""
    text = "".join(c if c.isprintable() else " " for c in name)
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def axis_words(axes: Sequence[str]) -> list[str]:
    """Names of axes for legends: without the parts between _ that all of them begin or end with, and not too long."""
    parts = [axis.split("_") for axis in axes]
    shortest = min(map(len, parts), default=0)
    ahead = next((k for k in range(shortest) if len({each[k] for each in parts}) > 1), 0)
    behind = next((k for k in range(shortest - ahead) if len({each[-1 - k] for each in parts}) > 1), 0)
    return [words("_".join(each[ahead : len(each) - behind]), 18) for each in parts]


def unit(name: str, along: str = "mm") -> str:
    """Give the unit of a limit, or of what it limits, for a label.

    Parameters
    ----------
    name : str
        Of the limit.
    along : str, optional
        Unit of length along the path.

    Returns
    -------
    str
        With signs for powers and degrees.
    """
    return raised(unit_of(name, along).replace("deg", "°"))


def of_feed(path: Path | None, along: str = "mm") -> tuple[float, str]:
    """What a feed in mm/s is multiplied by, and its unit then: programs say mm/min."""
    return (60.0, f"{along}/min") if path is not None and path.lines is not None else (1.0, f"{along}/s")


def of_axis(quantity: str, axis: str) -> str:
    """The unit of an axis's position, velocity, acceleration or jerk; joints without names may be in mm or in rad."""
    whole = unit_of_axis(axis).replace("deg", "°")
    return whole + {"position": "", "velocity": "/s", "acceleration": "/s²", "jerk": "/s³"}[quantity]


def short(value: float) -> str:
    """`value` in three digits, for a label."""
    return _short_power(f"{value:.3g}" if not 999.5 <= abs(value) < 1e5 else f"{value:.0f}")


def given(value: float) -> str:
    """`value` as it was given, in six digits: a limit that is rounded is another limit."""
    return _short_power(f"{value:.6g}" if not abs(value) >= 999999.5 else f"{value:.3g}")


def tick_text(value: float) -> str:
    """A tick's number in at most six letters: 12000, 1.2e6."""
    text = f"{value:.6g}"
    if len(text.lstrip("-")) > 5 or "e" in text:
        text = re.sub(r"\.?0*e", "e", _short_power(f"{value:.3e}"))
    return "0" if text in ("-0", "0e0") else text


def _short_power(text: str) -> str:
    return re.sub(r"e([+-])0*", lambda sign: "e" + sign[1].strip("+"), text)
