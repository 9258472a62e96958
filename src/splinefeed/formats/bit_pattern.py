"""Setpoints as the pulse words of a motion card's bit-pattern mode, and back; files of them.

In that mode the computer decides for every slot of a fixed pulse clock whether an axis moves by one pulse. For each
axis there is a 16-bit word for the plus direction and one for minus; bit 0 is sent first, 1 means a pulse, and plus
and minus are never 1 in the same slot. The words are queued on the card a few deep: whoever feeds it writes the words
of one period while those before it are sent.

The pulses of the period from tick k to k + 1 are N_(k+1) - N_k with N = round(position * pulses_per_unit), half to
even. Since it is the counts that are rounded, not the steps between them, no pulse is ever lost or added: after every
tick the axis is within half a pulse of its setpoint. A card's clock knows whole periods only: if the last period of a
time law is a short one, its pulses take a whole one.

Up to three axes run in step on one card. More are dealt to cards in their order, three each (`BitPattern.cards`), and
all words of a period are still made together; but nothing in the words keeps two cards in step: they need one pulse
clock and one start signal in common.

The file is HDF5, like that of setpoints: it grows period by period with one chunk in memory, its attributes name axes,
scales and clock, and gzip takes the words, which repeat themselves, to a small part. A .npy holds one array of a size
known beforehand and nothing about it.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from splinefeed.errors import FormatError, InputError
from splinefeed.formats import hdf5
from splinefeed.formats.sizes import MAX_AXES, MAX_TICKS
from splinefeed.records import ROTARY_AXES, Array, IntArray, Setpoints, check_finite, number, positive

Words = NDArray[np.uint16]

#: Slots of one word: its bits, bit 0 first.
SLOTS = 16
#: Axes that one card runs in step.
AXES_OF_CARD = 3
#: Slots of one period at most; at 1 ms that is a pulse clock of 65 MHz, beyond any card.
MAX_SLOTS = 2**16
#: Counts up to here are exact in double precision.
MAX_COUNT = 2**53
#: Words of a chunk on disk, 128 KB.
CHUNK_WORDS = 2**16
#: Periods that `read_chunks` gives at once.
CHUNK_PERIODS = 8192
#: Slots that are spread over at once, one byte each.
MOST_BITS = 2**22
_RECORD = "BitPattern"
_DATASET = "words"
_MEANING = "[period, axis, 0 plus or 1 minus, word]; bit 0 of word 0 is the first slot of the period; 1 is one pulse"


@dataclass(frozen=True, eq=False, kw_only=True)
class BitPattern:
    """Pulse words of consecutive periods.

    words            (n, axes, 2, words a period)  uint16; [period, axis, 0 plus or 1 minus, word]
    start            (axes,)  pulses from zero at the beginning of the first period
    axes             names of the axes; period  s
    pulses_per_unit  (axes,)  pulses per mm, rotary axes pulses per rad
    first            number of the first period, from 0: not 0 in a later chunk of a stream
    Raises InputError for arrays of other shapes. Source: docs/bit-pattern.md.
    Example: `sf.formats.BitPattern.__annotations__["words"]`
    """

    words: Words
    start: IntArray
    axes: tuple[str, ...]
    period: float
    pulses_per_unit: Array
    first: int = 0

    def __post_init__(self) -> None:
        words = np.ascontiguousarray(self.words)
        axes = len(self.axes)
        if words.dtype != np.uint16 or words.ndim != 4 or words.shape[1:3] != (axes, 2) or words.shape[3] < 1:
            raise InputError(
                f"BitPattern.words has shape {words.shape} of {words.dtype}; expected (n, {axes}, 2, words) of uint16"
            )
        arrays: dict[str, NDArray[Any]] = {"words": words}
        for name, dtype in (("start", np.int64), ("pulses_per_unit", np.float64)):
            array: NDArray[Any] = np.array(getattr(self, name), dtype=dtype)
            if array.shape != (axes,):
                raise InputError(f"BitPattern.{name} has shape {array.shape}; expected ({axes},)")
            arrays[name] = array
        for name, array in arrays.items():
            view = array.view()
            view.setflags(write=False)
            object.__setattr__(self, name, view)
        object.__setattr__(self, "axes", tuple(self.axes))
        object.__setattr__(self, "period", positive(self.period, "period"))

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
    """The words of every period between two setpoints; n setpoints make n - 1 periods.

    pulses_per_unit   pulses per mm of each axis by name, rotary axes per rad, or per degree with rotary="deg"
    slots_per_period  slots of the pulse clock in one period: a multiple of 16

    Raises InputError for scales and slots that cannot be, positions that are not finite, and, naming tick and axis,
    for more pulses in one period than it has slots.
    """
    return next(encode_chunks([points], pulses_per_unit, slots_per_period, rotary=rotary))


def encode_chunks(
    chunks: Iterable[Setpoints], pulses_per_unit: Mapping[str, float], slots_per_period: int, *, rotary: str = "rad"
) -> Iterator[BitPattern]:
    """`encode` for setpoints that come in chunks, with one chunk in memory: a pattern for each.

    The first pattern has a period less than its chunk has ticks, the others begin with the period that leads over
    from the chunk before; together they are the same as of all setpoints at once.
    """
    slots = _checked_slots(slots_per_period)
    first: Setpoints | None = None
    scales = np.empty(0)
    last = np.empty((0, 0), dtype=np.int64)
    ticks = 0
    for chunk in chunks:
        if not isinstance(chunk, Setpoints):
            raise InputError(f"pulse words are made from Setpoints, got {type(chunk).__name__}")
        if not len(chunk):
            raise InputError(f"the setpoints from tick {ticks} on are empty; leave such a chunk out")
        if first is None:
            first = chunk
            scales = scales_of(pulses_per_unit, chunk.axes, rotary)
            last = np.empty((0, len(chunk.axes)), dtype=np.int64)
        for name in ("axes", "period"):
            here, there = getattr(chunk, name), getattr(first, name)
            if here != there:
                raise InputError(f"the chunk at tick {ticks} has {name} {here!r}, the first one {there!r}")
        counts = np.concatenate([last, counts_of(chunk, scales, ticks)])
        before = ticks - len(last)
        _check_rate(counts, slots, before, first, scales)
        yield BitPattern(
            words=_spread(np.diff(counts, axis=0), slots),
            start=counts[0],
            axes=chunk.axes,
            period=chunk.period,
            pulses_per_unit=scales,
            first=before,
        )
        last = counts[-1:]
        ticks += len(chunk)


def decode(pattern: BitPattern) -> Array:
    """Positions (n + 1, axes), mm, rotary axes rad, at the beginning of the first period and the end of every one.

    Exactly round(position * pulses_per_unit) / pulses_per_unit of what was encoded. Raises InputError, naming
    period, axis and slot, where plus and minus are set in the same slot.
    """
    return np.asarray(pulses_at(pattern) / pattern.pulses_per_unit)


def pulses_at(pattern: BitPattern) -> IntArray:
    """Pulses from zero at the beginning of the first period and the end of every one, (n + 1, axes); see `decode`."""
    plus, minus = pattern.words[:, :, 0], pattern.words[:, :, 1]
    both = plus & minus
    if both.any():
        interval, axis, word = np.unravel_index(int(np.argmax(both != 0)), both.shape)
        value = int(both[interval, axis, word])
        slot = int(word) * SLOTS + (value & -value).bit_length() - 1
        raise InputError(
            f"period {pattern.first + interval}, axis {pattern.axes[axis]}, slot {slot}: plus and minus are both set"
        )
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


def write(patterns: BitPattern | Iterable[BitPattern], path: str | os.PathLike[str]) -> None:
    """Write pulse words as HDF5 (.h5, .hdf5), whole or not at all; of an iterable one pattern at a time is in memory.

    Raises FormatError for a file that cannot be written, InputError for patterns that do not follow on each other.
    """
    if Path(path).suffix.lower() not in (".h5", ".hdf5"):
        raise FormatError(f"{path}: pulse words are written as HDF5; name the file .h5")
    with hdf5.create(path, _RECORD) as (file, check):
        dataset: Any = None
        for pattern in consecutive(patterns, path):
            dataset = dataset or _create_dataset(file, pattern)
            periods = dataset.shape[0]
            dataset.resize(periods + len(pattern), axis=0)
            dataset[periods:] = pattern.words
            check()


def read(path: str | os.PathLike[str]) -> BitPattern:
    """All pulse words of a file that `write` wrote; FormatError for what is cut off, changed, or something else."""
    chunks = list(read_chunks(path))
    return replace(chunks[0], words=np.concatenate([chunk.words for chunk in chunks]))


def read_chunks(path: str | os.PathLike[str], periods: int = CHUNK_PERIODS) -> Iterator[BitPattern]:
    """The pulse words of a file, `periods` at once, at least one pattern; see `read`."""
    if isinstance(periods, bool) or not isinstance(periods, int) or periods < 1:
        raise InputError(f"periods is {periods!r}; expected a whole number from 1 up")
    with hdf5.opened(path, (_RECORD,)) as (file, _, checked):
        dataset, pattern = _open(file, checked)
        start = pattern.start
        for first in range(0, max(len(dataset), 1), periods):
            words = dataset[first : first + periods]
            chunk = replace(pattern, words=words, start=start, first=pattern.first + first)
            start = pulses_at(chunk)[-1]
            yield chunk


def _checked_slots(slots_per_period: object) -> int:
    whole = isinstance(slots_per_period, int | np.integer) and not isinstance(slots_per_period, bool)
    slots = int(slots_per_period) if isinstance(slots_per_period, int | np.integer) else 0
    if not whole or not SLOTS <= slots <= MAX_SLOTS or slots % SLOTS:
        raise InputError(
            f"slots_per_period is {slots_per_period!r}; a multiple of {SLOTS} from {SLOTS} to {MAX_SLOTS} is needed"
        )
    return slots


def scales_of(pulses_per_unit: Mapping[str, float], axes: tuple[str, ...], rotary: str) -> Array:
    """Pulses per mm or rad, (axes,)."""
    if rotary not in ("rad", "deg"):
        raise InputError(f"rotary is {rotary!r}; choose 'rad' or 'deg'")
    if not isinstance(pulses_per_unit, Mapping):
        raise InputError(
            f"pulses_per_unit is a {type(pulses_per_unit).__name__}; expected a scale by name, such as {{'x': 1000}}"
        )
    listed = ", ".join(axes)
    for axis in axes:
        if axis not in pulses_per_unit:
            raise InputError(f"pulses_per_unit has no axis {axis!r}; the setpoints have {listed}")
    for axis in pulses_per_unit:
        if axis not in axes:
            raise InputError(f"pulses_per_unit has an axis {axis!r}; the setpoints have {listed}")
    scales = np.empty(len(axes))
    for i, axis in enumerate(axes):
        scale = number(pulses_per_unit[axis], f"pulses_per_unit[{axis!r}]")
        if scale <= 0.0:
            raise InputError(f"pulses_per_unit[{axis!r}] is {scale:g}; it must be greater than 0")
        scales[i] = scale * 180.0 / np.pi if rotary == "deg" and axis in ROTARY_AXES else scale
    return scales


def counts_of(chunk: Setpoints, scales: Array, ticks: int) -> IntArray:
    """Pulses from zero at each tick, (n, axes)."""
    check_finite(chunk.position, "Setpoints.position")
    with np.errstate(over="ignore"):
        counts = np.rint(chunk.position * scales)
    if not np.all(np.abs(counts) <= MAX_COUNT):
        i, axis = np.argwhere(~(np.abs(counts) <= MAX_COUNT))[0]
        raise InputError(
            f"tick {ticks + i}, axis {chunk.axes[axis]}: {counts[i, axis]:g} pulses from zero; at most 2^53 are counted"
        )
    return counts.astype(np.int64)


def _check_rate(counts: IntArray, slots: int, before: int, points: Setpoints, scales: Array) -> None:
    """InputError at the first period that needs more pulses than it has slots."""
    needed = np.abs(np.diff(counts, axis=0))
    if not np.any(needed > slots):
        return
    i, axis = np.argwhere(needed > slots)[0]
    name, period = points.axes[axis], points.period
    raise InputError(
        f"tick {before + i}, axis {name}: {needed[i, axis]} pulses are needed before the next tick "
        f"({needed[i, axis] / period:g} a second), at most {slots} are possible ({slots / period:g} a second); "
        f"lower the feed, or take more slots per period or fewer than {scales[axis]:g} pulses per "
        f"{'rad' if name in ROTARY_AXES else 'mm'}"
    )


def consecutive(patterns: BitPattern | Iterable[BitPattern], path: object) -> Iterator[BitPattern]:
    """The patterns for the file `path`, each going on where the one before ends; FormatError for none or too many."""
    first: BitPattern | None = None
    end = np.empty(0, dtype=np.int64)
    periods = 0
    for pattern in [patterns] if isinstance(patterns, BitPattern) else patterns:
        if not isinstance(pattern, BitPattern):
            raise InputError(f"{path}: pulse words are written from BitPattern, got {type(pattern).__name__}")
        first = pattern if first is None else first
        if pattern is not first and not (
            pattern.axes == first.axes
            and pattern.period == first.period
            and pattern.words.shape[1:] == first.words.shape[1:]
            and np.array_equal(pattern.pulses_per_unit, first.pulses_per_unit)
            and np.array_equal(pattern.start, end)
        ):
            raise InputError(f"{path}: the pattern at period {periods} does not continue the one before")
        end = pulses_at(pattern)[-1]  # words that no card may get are refused here
        periods += len(pattern)
        if periods > MAX_TICKS:
            raise FormatError(f"{path}: more than {MAX_TICKS} periods do not fit in one file; write several")
        yield pattern
    if first is None:
        raise FormatError(f"{path}: there are no pulse words to write")


def _create_dataset(file: Any, pattern: BitPattern) -> Any:
    file.attrs["axes"] = list(pattern.axes)
    file.attrs["pulses_per_unit"] = pattern.pulses_per_unit
    file.attrs["pulses_per_unit_units"] = ["1/rad" if axis in ROTARY_AXES else "1/mm" for axis in pattern.axes]
    file.attrs["start"] = pattern.start
    file.attrs["start_units"] = "pulses"
    file.attrs["first"] = pattern.first
    file.attrs["period"] = pattern.period
    file.attrs["period_units"] = "s"
    file.attrs["slots_per_period"] = pattern.slots_per_period
    dataset = file.create_dataset(
        _DATASET,
        shape=(0, *pattern.words.shape[1:]),
        maxshape=(None, *pattern.words.shape[1:]),
        chunks=(max(1, CHUNK_WORDS // math.prod(pattern.words.shape[1:])), *pattern.words.shape[1:]),
        dtype=np.uint16,
        **hdf5.PACKING,
    )
    dataset.attrs["meaning"] = _MEANING
    return dataset


def _open(file: Any, path: Path) -> tuple[Any, BitPattern]:
    """The dataset of words, and a pattern of no periods with all else that the file says."""
    dataset = hdf5.dataset(file, _DATASET, path, 4, MAX_TICKS * 2 * (MAX_SLOTS // SLOTS))
    axes = hdf5.axes_of(file, path)
    words = int(file.attrs["slots_per_period"]) // SLOTS
    expected = (len(axes), 2, words)
    sizes_fit = len(axes) <= MAX_AXES and dataset.shape[1:] == expected and 1 <= words <= MAX_SLOTS // SLOTS
    if dataset.dtype != np.uint16 or not sizes_fit or dataset.shape[0] > MAX_TICKS:
        raise FormatError(
            f"{path}: dataset {_DATASET}: has shape {dataset.shape} of {dataset.dtype}; "
            f"expected (periods, {len(axes)}, 2, {words}) of uint16"
        )
    scales = np.asarray(file.attrs["pulses_per_unit"], dtype=np.float64)
    if not np.all(np.isfinite(scales)) or np.any(scales <= 0.0):
        raise FormatError(f"{path}: attribute pulses_per_unit: holds an invalid scale")
    return dataset, BitPattern(
        words=np.empty((0, *expected), dtype=np.uint16),
        start=np.asarray(file.attrs["start"], dtype=np.int64),
        axes=axes,
        period=positive(file.attrs["period"], "period"),
        pulses_per_unit=scales,
        first=int(file.attrs["first"]),
    )
