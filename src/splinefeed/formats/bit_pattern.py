"""Setpoints as the pulse words of a motion card's bit-pattern mode, and back; files of them.

The pulses of the period from tick k to k + 1 are N_(k+1) - N_k with N = round(position * pulses_per_unit), half to
even: since counts are rounded, not the steps between them, no pulse is ever lost or added. A card's clock knows whole
periods only: if the last period of a time law is a short one, its pulses take a whole one. docs/bit-pattern.md has the
order of words and files; NAME.bits.json holds the SHA-256 of the words, so that neither file is taken for another's.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import FormatError, InputError
from splinefeed.files.atomic import atomic_write
from splinefeed.files.json_values import anything, fields, names, number, numbers, parse, whole
from splinefeed.files.metadata import SCHEMA, axis_units, check_schema, naming
from splinefeed.files.sizes import MAX_TICKS
from splinefeed.files.source import check_file, read_bytes, read_text
from splinefeed.records import ROTARY_AXES, Array, IntArray, Setpoints, check_finite, positive
from splinefeed.records.arrays import read_only

Words = NDArray[np.uint16]

#: Slots of one word: its bits, bit 0 first.
SLOTS = 16
#: Axes that one card runs in step.
AXES_OF_CARD = 3
#: Slots of one period at most; at 1 ms that is a pulse clock of 65 MHz, beyond any card.
MAX_SLOTS = 2**16
#: Counts up to here are exact in double precision.
MAX_COUNT = 2**53
#: Slots that are spread over at once, one byte each.
MOST_BITS = 2**22
#: Words that are held in memory at the most, bytes.
MAX_BYTES = 2**31
#: Largest page beside the words, bytes.
MAX_PAGE = 2**16
_ORDER = "for each period, word and axis: plus, minus; uint16, low byte first; bit 0 is the earliest slot"
_PAGE = {
    **dict.fromkeys(("record", "schema", "order", "units", "sha256"), anything),
    "axes": names,
    **dict.fromkeys(("periods", "words_per_period", "slots_per_period", "first_period"), whole),
    **dict.fromkeys(("period_s", "pulse_clock_hz"), number),
    **dict.fromkeys(("pulses_per_unit", "start_pulses"), numbers),
}


@dataclass(frozen=True, eq=False, kw_only=True)
class BitPattern:
    """Pulse words of consecutive periods.

    Parameters
    ----------
    words : (n, axes, 2, words a period) array of uint16
        Of each period and axis, plus before minus; a bit is a slot of the pulse clock, the lowest one first.
    start : (axes,) array of int
        Pulses from zero at the beginning of the first period.
    axes : tuple of str
        Names of the axes.
    period : float
        s.
    pulses_per_unit : (axes,) array
        Pulses per mm, rotary axes pulses per rad.

    Raises
    ------
    InputError
        For arrays of other shapes.

    References
    ----------
    .. [1] docs/bit-pattern.md.

    Examples
    --------
    >>> import numpy as np
    >>> import splinefeed as sf
    >>> words = np.array([[[[0b101], [0]]]], dtype=np.uint16)  # two pulses forward
    >>> pattern = sf.formats.BitPattern(
    ...     words=words, start=np.zeros(1, dtype=np.int64), axes=("x",), period=1e-3, pulses_per_unit=np.array([1000.0])
    ... )
    >>> pattern.pulse_clock  # Hz
    16000.0
    """

    words: Words
    start: IntArray
    axes: tuple[str, ...]
    period: float
    pulses_per_unit: Array

    def __post_init__(self) -> None:
        axes, words = tuple(self.axes), np.ascontiguousarray(self.words)
        if words.dtype != np.uint16 or words.ndim != 4 or words.shape[1:3] != (len(axes), 2) or words.shape[3] < 1:
            wanted = f"(n, {len(axes)}, 2, words) of uint16"
            raise InputError(f"BitPattern.words has shape {words.shape} of {words.dtype}; expected {wanted}")
        start, scales = np.array(self.start, dtype=np.int64), np.array(self.pulses_per_unit, dtype=np.float64)
        if not scales.shape == start.shape == (len(axes),) or not np.all((scales > 0.0) & (scales < np.inf)):
            raise InputError("BitPattern: expected one start and one scale greater than 0 for each axis")
        held = {"words": read_only(words), "start": read_only(start), "pulses_per_unit": read_only(scales)}
        for name, value in {**held, "axes": axes, "period": positive(self.period, "period")}.items():
            object.__setattr__(self, name, value)

    @property
    def slots_per_period(self) -> int:
        """Slots of the pulse clock in one period."""
        return SLOTS * int(self.words.shape[3])

    @property
    def pulse_clock(self) -> float:
        """Frequency of the slots, Hz."""
        return self.slots_per_period / self.period

    @property
    def cards(self) -> tuple[tuple[str, ...], ...]:
        """The axes of each card, three at most; two cards are in step only by a clock and a start in common."""
        return tuple(self.axes[i : i + AXES_OF_CARD] for i in range(0, len(self.axes), AXES_OF_CARD))

    def __len__(self) -> int:
        return len(self.words)


def encode(
    points: Setpoints, pulses_per_unit: Mapping[str, float], slots_per_period: int, *, rotary: str = "rad"
) -> BitPattern:
    """Make the words of every period between two setpoints.

    Parameters
    ----------
    points : Setpoints
        n of them.
    pulses_per_unit : mapping of str to float
        Pulses per mm of each axis by name, rotary axes per rad, or per degree with rotary="deg".
    slots_per_period : int
        Slots of the pulse clock in one period: a multiple of 16.
    rotary : str, optional
        "rad" or "deg".

    Returns
    -------
    BitPattern
        Of n - 1 periods.

    Raises
    ------
    InputError
        For scales and slots that cannot be, positions that are not finite, more words than memory should hold, and,
        with tick and axis, for more pulses in one period than it has slots.
    """
    whole = isinstance(slots_per_period, int | np.integer) and not isinstance(slots_per_period, bool)
    if not whole or slots_per_period % SLOTS or not SLOTS <= slots_per_period <= MAX_SLOTS:
        raise InputError(
            f"slots_per_period is {slots_per_period!r}; a multiple of {SLOTS} from {SLOTS} to {MAX_SLOTS} is needed"
        )
    slots = int(slots_per_period)
    counts, scales = counts_of(points, pulses_per_unit, rotary)
    if counts.size * slots // 4 > MAX_BYTES:
        raise InputError(f"{len(points)} setpoints of {slots} slots make too many words; take fewer of either")
    pulses = np.diff(counts, axis=0)
    if np.any(over := np.abs(pulses) > slots):
        i, axis = np.argwhere(over)[0]
        needed, unit = abs(int(pulses[i, axis])), axis_units(points.axes, "rad")[axis]
        period = points.period
        raise InputError(
            f"tick {i}, axis {points.axes[axis]}: {needed} pulses are needed before the next tick "
            f"({needed / period:g} a second), at most {slots} are possible ({slots / period:g} a second); "
            f"lower the feed, or take more slots per period or fewer than {scales[axis]:g} pulses per {unit}"
        )
    words = _spread(pulses, slots)
    return BitPattern(words=words, start=counts[0], axes=points.axes, period=points.period, pulses_per_unit=scales)


def counts_of(points: Setpoints, pulses_per_unit: Mapping[str, float], rotary: str = "rad") -> tuple[IntArray, Array]:
    """Return pulses from zero at each tick.

    Parameters
    ----------
    points : Setpoints
        n of them.
    pulses_per_unit : mapping of str to float
        As for `encode`.
    rotary : str, optional
        "rad" or "deg".

    Returns
    -------
    counts : (n, axes) array of int
        Pulses.
    scales : (axes,) array
        Pulses per mm or rad.

    Raises
    ------
    InputError
        For scales that cannot be, no setpoints, and positions that are not finite or too far.
    """
    axes = points.axes
    if not len(points):
        raise InputError("there are no setpoints to make pulses of")
    if rotary not in ("rad", "deg"):
        raise InputError(f"rotary is {rotary!r}; choose 'rad' or 'deg'")
    if not isinstance(pulses_per_unit, Mapping) or set(pulses_per_unit) != set(axes):
        raise InputError(f"pulses_per_unit is {pulses_per_unit!r:.60}; give one scale for each of {', '.join(axes)}")
    scales = np.array([positive(pulses_per_unit[axis], f"pulses_per_unit[{axis!r}]") for axis in axes])
    turning = [rotary == "deg" and axis in ROTARY_AXES for axis in axes]
    scales = np.where(turning, scales * 180.0 / np.pi, scales)
    check_finite(points.position, "Setpoints.position")
    with np.errstate(over="ignore"):
        counts = np.rint(points.position * scales)
    if not np.all(np.abs(counts) <= MAX_COUNT):
        i, axis = np.argwhere(~(np.abs(counts) <= MAX_COUNT))[0]
        raise InputError(f"tick {i}, axis {axes[axis]}: more than 2^53 pulses from zero")
    return counts.astype(np.int64), scales


def decode(pattern: BitPattern) -> Array:
    """Return positions at the beginning of the first period and the end of every one.

    Parameters
    ----------
    pattern : BitPattern
        Of n periods.

    Returns
    -------
    (n + 1, axes) array
        mm, rotary axes rad: round(position * pulses_per_unit) / pulses_per_unit of what was encoded, exactly.

    Raises
    ------
    InputError
        Where plus and minus are set in the same slot, with period, axis and slot.
    """
    return np.asarray(pulses_at(pattern) / pattern.pulses_per_unit)


def pulses_at(pattern: BitPattern) -> IntArray:
    """Return pulses from zero at the beginning of the first period and the end of every one.

    Parameters
    ----------
    pattern : BitPattern
        Of n periods.

    Returns
    -------
    (n + 1, axes) array of int
        Pulses.

    Raises
    ------
    InputError
        As `decode`.
    """
    plus, minus = pattern.words[:, :, 0], pattern.words[:, :, 1]
    both = plus & minus
    if both.any():
        interval, axis, word = np.unravel_index(int(np.argmax(both != 0)), both.shape)
        value = int(both[interval, axis, word])
        slot = int(word) * SLOTS + (value & -value).bit_length() - 1
        raise InputError(f"period {interval}, axis {pattern.axes[axis]}, slot {slot}: plus and minus are both set")
    counts = np.empty((len(pattern) + 1, len(pattern.axes)), dtype=np.int64)
    counts[0] = pattern.start
    counts[1:] = np.bitwise_count(plus).sum(axis=2, dtype=np.int64)
    counts[1:] -= np.bitwise_count(minus).sum(axis=2, dtype=np.int64)
    np.cumsum(counts, axis=0, out=counts)
    return counts


def _spread(pulses: IntArray, slots: int) -> Words:
    """The pulses (n, axes) of each period as words (n, axes, 2, slots / SLOTS), plus before minus.

    Of d pulses in S slots pulse j goes to slot floor((2 j + 1) S / (2 d)), the middle of its share (Bresenham's
    line, started half a step in): gaps differ by one slot at most, and a steady rate runs on over the periods.
    Needs |d| <= S, checked before.
    """
    words = np.empty((*pulses.shape, 2, slots // SLOTS), dtype=np.uint16)
    step = max(MOST_BITS // (2 * slots * pulses.shape[1]), 1)
    for start in range(0, len(pulses), step):
        part = pulses[start : start + step]
        bits = np.zeros((part.size, 2, slots), dtype=np.uint8)
        count = np.abs(part).ravel()
        owner = np.repeat(np.arange(part.size), count)
        j = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        bits[owner, (part.ravel() < 0).astype(np.int64)[owner], (2 * j + 1) * slots // (2 * count[owner])] = 1
        packed = np.packbits(bits, axis=2, bitorder="little").view("<u2")
        words[start : start + step] = packed.reshape(*part.shape, 2, -1)
    return words


def write(pattern: BitPattern, path: str | os.PathLike[str]) -> None:
    """Write words and page, whole or not at all.

    Parameters
    ----------
    pattern : BitPattern
        To write.
    path : path
        File that ends in .bits; the page goes beside it, see `page_of`.

    Raises
    ------
    FormatError
        For another suffix, and a file that cannot be written.
    InputError
        For what is no BitPattern, and where plus and minus are set in the same slot.
    """
    if Path(path).suffix.lower() != ".bits":
        raise FormatError(f"{path}: pulse words are written as .bits, with a .bits.json beside it")
    if not isinstance(pattern, BitPattern):
        raise InputError(f"{path}: pulse words are written from BitPattern, got {type(pattern).__name__}")
    pulses_at(pattern)  # words that no card may get are refused here
    words = np.ascontiguousarray(pattern.words.transpose(0, 3, 1, 2), dtype="<u2").tobytes()
    content = {
        "record": "BitPattern",
        "schema": SCHEMA,
        "order": _ORDER,
        "axes": list(pattern.axes),
        "periods": len(pattern),
        "period_s": pattern.period,
        "words_per_period": int(pattern.words.shape[3]),
        "slots_per_period": pattern.slots_per_period,
        "pulse_clock_hz": pattern.pulse_clock,
        "pulses_per_unit": pattern.pulses_per_unit.tolist(),
        "units": axis_units(pattern.axes, "rad"),
        "start_pulses": pattern.start.tolist(),
        "first_period": 0,
        "sha256": hashlib.sha256(words).hexdigest(),
    }
    with atomic_write(page_of(path)) as page, atomic_write(path) as temporary:
        temporary.write_bytes(words)
        page.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def read(path: str | os.PathLike[str]) -> BitPattern:
    """Read all words of a file that `write` wrote.

    Parameters
    ----------
    path : path
        The file, with its page beside it.

    Returns
    -------
    BitPattern
        As it was written, bit for bit.

    Raises
    ------
    FormatError
        For what is cut off, changed, or something else.
    """
    page = page_of(path)
    if not page.is_file():
        raise FormatError(f"{path}: needs {page.name} beside it, which says what the words are")
    said = fields(parse(read_text(page, "JSON", MAX_PAGE), page), str(page), _PAGE, tuple(_PAGE))
    with naming(page):
        check_schema(said["schema"])
        if (said["record"], said["order"]) != ("BitPattern", _ORDER):
            raise InputError("does not describe pulse words in the order that is known here")
        shape = (said["periods"], said["words_per_period"], len(said["axes"]), 2)
        if not 0 <= shape[0] <= MAX_TICKS or not 1 <= shape[1] <= MAX_SLOTS // SLOTS:
            raise InputError(f"says {shape[0]} periods of {shape[1]} words; that is no file of pulse words")
    size = 2 * int(np.prod(shape))
    if size:
        check_file(path)
    if os.stat(path).st_size != size:
        raise FormatError(f"{path}: has {os.stat(path).st_size} bytes, {page.name} says {size}; was it cut off?")
    content = read_bytes(path) if size else b""
    if hashlib.sha256(content).hexdigest() != said["sha256"]:
        raise FormatError(f"{path}: the words are not those that {page.name} describes")
    with naming(page):
        found = BitPattern(
            words=np.frombuffer(content, dtype="<u2").reshape(shape).transpose(0, 2, 3, 1).astype(np.uint16),
            start=np.asarray(said["start_pulses"]),
            axes=tuple(said["axes"]),
            period=said["period_s"],
            pulses_per_unit=np.asarray(said["pulses_per_unit"]),
        )
        pulses_at(found)
    return found


def page_of(path: str | os.PathLike[str]) -> Path:
    """Return the path of the JSON page beside a file of words."""
    return Path(f"{path}.json")
