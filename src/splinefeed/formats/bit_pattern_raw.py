"""Pulse words as a card's driver sends them: a file of bare 16-bit words, and a JSON page beside it that says the rest.

NAME.bits holds unsigned 16-bit words, the low byte first, and nothing else, in the order in which they are sent: for
each period, for each word of the period, for each axis the word of the plus direction and then that of minus. Bit 0 of
a word is the earliest of its 16 slots. NAME.bits.json says axes, period, clock, pulses per unit, where each axis stands
in the beginning, and the SHA-256 of the words, so that neither file is taken for another's.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed.errors import FormatError, InputError
from splinefeed.formats.atomic import atomic_write
from splinefeed.formats.bit_pattern import (
    MAX_SLOTS,
    SLOTS,
    BitPattern,
    consecutive,
    pulses_at,
)
from splinefeed.formats.metadata import SCHEMA, check_schema, sound_file
from splinefeed.formats.sizes import MAX_AXES, MAX_TICKS
from splinefeed.formats.source import check_file, read_bytes
from splinefeed.records import ROTARY_AXES, positive

#: Largest page beside the words, bytes.
MAX_PAGE = 2**16
_RECORD = "BitPattern"
_ORDER = "for each period, word and axis: plus, minus; uint16, low byte first; bit 0 is the earliest slot"


def page_of(path: str | os.PathLike[str]) -> Path:
    """The JSON page beside a file of words."""
    return Path(f"{path}.json")


def write(patterns: BitPattern | Iterable[BitPattern], path: str | os.PathLike[str]) -> None:
    """Write words and page, whole or not at all; of an iterable one pattern at a time is in memory.

    Raises FormatError for a file that cannot be written, InputError for patterns that do not follow on each other.
    """
    if Path(path).suffix.lower() != ".bits":
        raise FormatError(f"{path}: bare pulse words are written as .bits, with a .bits.json beside it")
    digest = hashlib.sha256()
    first: BitPattern | None = None
    periods = 0
    with atomic_write(page_of(path)) as page, atomic_write(path) as temporary:
        with temporary.open("wb") as stream:
            for pattern in consecutive(patterns, path):
                first = pattern if first is None else first
                words = np.ascontiguousarray(pattern.words.transpose(0, 3, 1, 2), dtype="<u2").tobytes()
                stream.write(words)
                digest.update(words)
                periods += len(pattern)
        assert first is not None  # consecutive refuses to give none
        content = {
            "record": _RECORD,
            "schema": SCHEMA,
            "order": _ORDER,
            "axes": list(first.axes),
            "periods": periods,
            "period_s": first.period,
            "words_per_period": int(first.words.shape[3]),
            "slots_per_period": first.slots_per_period,
            "pulse_clock_hz": first.pulse_clock,
            "pulses_per_unit": first.pulses_per_unit.tolist(),
            "units": ["rad" if axis in ROTARY_AXES else "mm" for axis in first.axes],
            "start_pulses": first.start.tolist(),
            "first_period": first.first,
            "sha256": digest.hexdigest(),
        }
        page.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def read(path: str | os.PathLike[str]) -> BitPattern:
    """All words of a file that `write` wrote; FormatError for what is cut off, changed, or something else."""
    empty, periods = _described(path)
    content = _words(path, 2 * periods * int(np.prod(empty.words.shape[1:])))
    if hashlib.sha256(content).hexdigest() != _page(path).get("sha256"):
        raise FormatError(f"{path}: the words are not those that {page_of(path).name} describes")
    axes, _, words = empty.words.shape[1:]
    raw = np.frombuffer(content, dtype="<u2").reshape(periods, words, axes, 2).transpose(0, 2, 3, 1)
    found = replace(empty, words=raw.astype(np.uint16))
    try:
        pulses_at(found)
    except InputError as error:
        raise FormatError(f"{path}: {error}") from None
    return found


def _words(path: str | os.PathLike[str], size: int) -> bytes:
    if size:
        check_file(path)
    length = os.stat(path).st_size
    if length != size:
        raise FormatError(f"{path}: has {length} bytes, {page_of(path).name} says {size}; was it cut off?")
    return read_bytes(path)


def _page(path: str | os.PathLike[str]) -> dict[str, Any]:
    page = page_of(path)
    if not page.is_file():
        raise FormatError(f"{path}: needs {page.name} beside it, which says what the words are")
    if page.stat().st_size > MAX_PAGE:
        raise FormatError(f"{page}: is larger than {MAX_PAGE} bytes; that is not a page of pulse words")
    try:
        content = json.loads(page.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(f"{page}: is not JSON: {' '.join(str(error).split())}") from None
    if not isinstance(content, dict) or content.get("record") != _RECORD:
        raise FormatError(f"{page}: does not describe pulse words")
    check_schema(content.get("schema"), page)
    if content.get("order") != _ORDER:
        raise FormatError(f"{page}: order: the words are in another order than {_ORDER!r}")
    return content


def _described(path: str | os.PathLike[str]) -> tuple[BitPattern, int]:
    """A pattern of no periods with all that the page says, and the number of periods."""
    page, content = page_of(path), _page(path)
    axes = content.get("axes")
    if not isinstance(axes, list) or not 1 <= len(axes) <= MAX_AXES or not all(isinstance(a, str) for a in axes):
        raise FormatError(f"{page}: axes: is not a list of 1 to {MAX_AXES} names")
    counts = {}
    for name, most in (("periods", MAX_TICKS), ("words_per_period", MAX_SLOTS // SLOTS), ("first_period", 2**53)):
        value = content.get(name)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
            raise FormatError(f"{page}: {name}: {value!r}; expected a whole number up to {most}")
        counts[name] = value
    for name in ("pulses_per_unit", "start_pulses"):
        values = content.get(name)
        numbers = isinstance(values, list) and all(isinstance(v, int | float) for v in values)
        if not numbers or len(values or ()) != len(axes):
            raise FormatError(f"{page}: {name}: {str(values)[:40]}; expected a list of {len(axes)} numbers")
    with sound_file(page, "page of pulse words"):
        scales = np.asarray(content["pulses_per_unit"], dtype=np.float64)
        if not np.all(np.isfinite(scales)) or np.any(scales <= 0.0):
            raise FormatError(f"{page}: pulses_per_unit: holds an invalid scale")
        return BitPattern(
            words=np.empty((0, len(axes), 2, counts["words_per_period"]), dtype=np.uint16),
            start=np.asarray(content["start_pulses"], dtype=np.int64),
            axes=tuple(axes),
            period=positive(content["period_s"], "period_s"),
            pulses_per_unit=scales,
            first=counts["first_period"],
        ), counts["periods"]
