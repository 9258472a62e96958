"""Setpoints to the pulse words of a motion card; each word is decoded again before it is written."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import tee

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats import bit_pattern
from splinefeed.formats.bit_pattern import SLOTS, BitPattern
from splinefeed.machine.machine import Machine
from splinefeed.records import ROTARY_AXES, Setpoints


@dataclass
class Survey:
    """The demand of setpoints on a pulse clock.

    fastest  most pulses of one axis in one period (s), at tick `at` (the period after it), of axis `axis`
    """

    period: float = math.nan
    axes: tuple[str, ...] = ()
    fastest: int = 0
    at: int = 0
    axis: str = ""

    @property
    def slots(self) -> int:
        """The fewest slots of a period, a multiple of 16, that hold its pulses."""
        return max(-(-self.fastest // SLOTS), 1) * SLOTS

    @property
    def rate(self) -> float:
        """The highest rate of pulses of one axis over a period, Hz."""
        return self.fastest / self.period


def survey(chunks: Iterable[Setpoints], pulses_per_unit: Mapping[str, float], *, rotary: str = "rad") -> Survey:
    """How many pulses a period the setpoints need at most, and where; see `formats.bit_pattern.encode_chunks`."""
    found = Survey()
    for first, counts, chunk, _ in bit_pattern.counted(chunks, pulses_per_unit, rotary):
        found.period, found.axes = chunk.period, chunk.axes
        steps = np.abs(np.diff(counts, axis=0))
        if np.max(steps, initial=0) > found.fastest:
            i, axis = np.unravel_index(int(np.argmax(steps)), steps.shape)
            found.fastest, found.axis, found.at = int(steps[i, axis]), chunk.axes[int(axis)], first + int(i)
    if not found.axes:
        raise InputError("there are no setpoints to make pulses of")
    return found


@dataclass
class Tally:
    """The words, decoded again: periods, pulses each way by axis, and the largest distance in pulses."""

    periods: int = 0
    plus: dict[str, int] = field(default_factory=dict)
    minus: dict[str, int] = field(default_factory=dict)
    off: float = 0.0


def encoded(
    chunks: Iterable[Setpoints], pulses_per_unit: Mapping[str, float], slots: int, tally: Tally, *, rotary: str = "rad"
) -> Iterator[BitPattern]:
    """The words chunk by chunk, each decoded again and held against its setpoints in `tally`."""
    encoding, beside = tee(chunks)
    for pattern in bit_pattern.encode_chunks(encoding, pulses_per_unit, slots, rotary=rotary):
        chunk = next(beside)
        tally.periods += len(pattern)
        bits = np.bitwise_count(pattern.words).sum(axis=(0, 3), dtype=np.int64)
        for axis, (plus, minus) in zip(pattern.axes, bits.tolist(), strict=True):
            tally.plus[axis] = tally.plus.get(axis, 0) + plus
            tally.minus[axis] = tally.minus.get(axis, 0) + minus
        decoded = bit_pattern.decode(pattern)[-len(chunk) :]
        off = np.abs((decoded - chunk.position) * pattern.pulses_per_unit)
        tally.off = max(tally.off, float(np.max(off, initial=0.0)))
        yield pattern


def pulses_of(machine: Machine, axes: Iterable[str]) -> dict[str, float]:
    """Pulses per mm or rad of the named axes of a machine: the counts of their encoders."""
    found = {}
    for name in axes:
        if name not in machine.axes:
            listed = ", ".join(machine.axes)
            raise InputError(f"machine {machine.name!r} has no axis {name!r}; its axes are {listed}")
        axis = machine.axes[name]
        if axis.encoder is None:
            raise InputError(
                f"machine {machine.name!r}: axis {name} has no encoder to take pulses from; give them yourself, "
                f"such as --pulses {name}=1000"
            )
        found[name] = 1.0 / axis.encoder_resolution
    return found


def per_degree(pulses_per_unit: Mapping[str, float]) -> dict[str, float]:
    """The same with rotary axes per degree, as people read them."""
    return {axis: value * math.pi / 180.0 if axis in ROTARY_AXES else value for axis, value in pulses_per_unit.items()}
