"""Setpoints to the pulse words of a motion card, which are decoded again."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from splinefeed.errors import InputError
from splinefeed.formats import bit_pattern
from splinefeed.formats.bit_pattern import SLOTS, BitPattern
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import ServoAxis
from splinefeed.records import ROTARY_AXES, Setpoints


def pulse_words(
    points: Setpoints, pulses_per_unit: Mapping[str, float], slots: int | None = None, *, rotary: str = "rad"
) -> tuple[BitPattern, dict[str, Any]]:
    """Encode setpoints as pulse words of a motion card, and count what they hold.

    Parameters
    ----------
    points : Setpoints
        Of n ticks, mm, rotary axes rad.
    pulses_per_unit : mapping of str to float
        By axis.
    slots : int, optional
        Of a period; the fewest that are enough by default.
    rotary : str, optional
        "rad" or "deg": the unit of `pulses_per_unit` of rotary axes.

    Returns
    -------
    pattern : BitPattern
        The words, as `formats.bit_pattern.encode` makes them.
    numbers : dict of str to object
        As `splinefeed pulses --json` has them: `fastest`, most pulses of one axis in one period, its rate in Hz, and
        its tick (the period after it); `pulses_plus` and `pulses_minus`, sent each way by axis; `off_max_pulses`, the
        largest distance of a setpoint from what the words lead to.
    """
    counts, scales = bit_pattern.counts_of(points, pulses_per_unit, rotary)
    steps = np.abs(np.diff(counts, axis=0))
    most = int(np.max(steps, initial=0))
    tick, axis = np.unravel_index(int(np.argmax(steps)), steps.shape) if most else (0, 0)
    enough = max(-(-most // SLOTS), 1) * SLOTS
    pattern = bit_pattern.encode(points, pulses_per_unit, enough if slots is None else slots, rotary=rotary)
    sent = np.bitwise_count(pattern.words).sum(axis=(0, 3), dtype=np.int64)
    off = np.abs((bit_pattern.decode(pattern) - points.position) * scales)
    fastest = {"axis": points.axes[axis] if most else "", "pulses": most, "rate_hz": most / points.period}
    return pattern, {
        "fastest": {**fastest, "tick": int(tick)},
        "pulses_plus": dict(zip(points.axes, sent[:, 0].tolist(), strict=True)),
        "pulses_minus": dict(zip(points.axes, sent[:, 1].tolist(), strict=True)),
        "off_max_pulses": float(off.max()),
    }


def pulses_of(machine: Machine, axes: Iterable[str]) -> dict[str, float]:
    """Find the pulses per mm or rad of a machine's axes: the counts of their encoders.

    Parameters
    ----------
    machine : Machine
        With encoders.
    axes : iterable of str
        Their names.

    Returns
    -------
    dict of str to float
        By axis.

    Raises
    ------
    InputError
        For an axis that the machine lacks, and for one without an encoder.
    """
    found = {}
    for name in axes:
        if name not in machine.axes:
            listed = ", ".join(machine.axes)
            raise InputError(f"machine {machine.name!r} has no axis {name!r}; its axes are {listed}")
        axis = machine.axes[name]
        if not isinstance(axis, ServoAxis) or axis.encoder is None:
            raise InputError(
                f"machine {machine.name!r}: axis {name} has no encoder to take pulses from; give them yourself, "
                f"such as --pulses {name}=1000"
            )
        found[name] = 1.0 / axis.encoder_resolution
    return found


def per_degree(pulses_per_unit: Mapping[str, float]) -> dict[str, float]:
    """Convert pulses of rotary axes per rad to those per degree, as people read them.

    Parameters
    ----------
    pulses_per_unit : mapping of str to float
        By axis, per mm or rad.

    Returns
    -------
    dict of str to float
        By axis, per mm or degree.
    """
    return {axis: value * math.pi / 180.0 if axis in ROTARY_AXES else value for axis, value in pulses_per_unit.items()}
