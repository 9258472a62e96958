"""Pulses of an axis spread over the slots of a period, as bits of words, and counted again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from splinefeed.kernels.jit import kernel
from splinefeed.records import IntArray

Words = NDArray[np.uint16]

#: Slots of one word: its bits, bit 0 first.
SLOTS = 16


@kernel
def spread(counts: IntArray, words: Words) -> None:
    """Write the pulses between counts (n + 1, axes) into words (n, axes, 2, words a period), plus before minus.

    Of d pulses in S slots pulse j goes to slot floor((2 j + 1) S / (2 d)), the middle of its share (Bresenham's
    line, started half a step in): gaps differ by one slot at most, and a steady rate runs on over the periods.
    Needs |d| <= S, checked before.
    """
    slots = SLOTS * words.shape[3]
    for i in range(words.shape[0]):
        for axis in range(words.shape[1]):
            for sign in range(2):
                for w in range(words.shape[3]):
                    words[i, axis, sign, w] = 0
            pulses = counts[i + 1, axis] - counts[i, axis]
            sign = 0 if pulses >= 0 else 1
            pulses = abs(pulses)
            for j in range(pulses):
                slot = (2 * j + 1) * slots // (2 * pulses)
                words[i, axis, sign, slot // SLOTS] |= np.uint16(1 << (slot % SLOTS))


@kernel
def tally(words: Words, counts: IntArray) -> int:
    """Count the pulses of words (n, axes, 2, words a period) on from counts[0] into counts (n + 1, axes).

    Returns -1, or where plus and minus are set in one slot: (interval * axes + axis) * slots + slot.
    """
    slots = SLOTS * words.shape[3]
    for i in range(words.shape[0]):
        for axis in range(words.shape[1]):
            total = counts[i, axis]
            for w in range(words.shape[3]):
                plus = int(words[i, axis, 0, w])
                minus = int(words[i, axis, 1, w])
                for bit in range(SLOTS):
                    up = (plus >> bit) & 1
                    down = (minus >> bit) & 1
                    if up and down:
                        return (i * words.shape[1] + axis) * slots + w * SLOTS + bit
                    total += up - down
            counts[i + 1, axis] = total
    return -1
