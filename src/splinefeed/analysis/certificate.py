"""Certificate: a check's verdict with the hashes of what was checked, as one JSON file."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
from collections.abc import Iterable, Iterator
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

import splinefeed
from splinefeed.errors import InputError
from splinefeed.formats.atomic import atomic_write
from splinefeed.geometry.path import Path
from splinefeed.records import Limits, Setpoints, TimeLaw, Verdict

#: Raised by one when a key of a certificate changes its meaning.
SCHEMA = 1
#: Packages whose version can change a number.
PARTS = ("numpy", "numba", "scipy")
_COLUMNS = ("t", "curve", "u", "s", "feed", "position")


class SetpointsHash:
    """SHA-256 of setpoints that come in chunks; how they are cut makes no difference."""

    def __init__(self) -> None:
        self._columns = {name: hashlib.sha256() for name in _COLUMNS}
        self._head = b""

    def update(self, setpoints: Setpoints) -> None:
        """Take the next chunk."""
        self._head = json.dumps([list(setpoints.axes), setpoints.period.hex()]).encode()
        for name, digest in self._columns.items():
            digest.update(_bytes(getattr(setpoints, name)))

    def through(self, chunks: Iterable[Setpoints]) -> Iterator[Setpoints]:
        """The same chunks, each taken on its way: check(hash.through(chunks), ...)."""
        for chunk in chunks:
            self.update(chunk)
            yield chunk

    def hexdigest(self) -> str:
        """The hash of all chunks so far: of axes and period, then of the hashes of the columns."""
        whole = hashlib.sha256(self._head)
        for digest in self._columns.values():
            whole.update(digest.digest())
        return whole.hexdigest()


def setpoints_hash(setpoints: Setpoints) -> str:
    """SHA-256 of axes, period and every column, bit for bit."""
    digest = SetpointsHash()
    digest.update(setpoints)
    return digest.hexdigest()


def path_hash(path: Path) -> str:
    """SHA-256 of the axes, and of degree, knots, control points and weights of every curve, bit for bit."""
    whole = hashlib.sha256(json.dumps(list(path.axes)).encode())
    for curve in path.curves:
        weights = np.zeros(0) if curve.weights is None else curve.weights
        whole.update(json.dumps([curve.degree, len(curve.knots), curve.axes, len(weights)]).encode())
        for array in (curve.knots, curve.control_points, weights):
            whole.update(_bytes(array))
    return whole.hexdigest()


def limits_hash(limits: Limits) -> str:
    """SHA-256 of the limits' names and values, to the last bit."""
    flat = {name: value.hex() for name, value in sorted(limits.as_dict().items())}
    return hashlib.sha256(json.dumps(flat).encode()).hexdigest()


def law_hash(law: TimeLaw) -> str:
    """SHA-256 of a law's breaks and coefficients."""
    return hashlib.sha256(_bytes(law.breaks) + _bytes(law.coefficients)).hexdigest()


def certificate(
    setpoints: Setpoints | SetpointsHash, path: Path, limits: Limits, verdict: Verdict, law: TimeLaw | None = None
) -> dict[str, Any]:
    """What was checked, by its hashes, with what, and the verdict; nothing in it depends on place or time."""
    if not isinstance(setpoints, Setpoints | SetpointsHash):
        raise InputError(f"certificate: expected Setpoints or a SetpointsHash, got {type(setpoints).__name__}")
    hashes = {
        "setpoints": setpoints_hash(setpoints) if isinstance(setpoints, Setpoints) else setpoints.hexdigest(),
        "path": path_hash(path),
        "limits": limits_hash(limits),
    }
    if law is not None:
        hashes["law"] = law_hash(law)
    return {
        "certificate": "splinefeed check",
        "schema": SCHEMA,
        "sha256": hashes,
        "limits": limits.as_dict(),
        "versions": {"splinefeed": splinefeed.__version__, "python": platform.python_version(), **_versions()},
        "verdict": _plain(verdict.as_dict()),
    }


def write_certificate(page: dict[str, Any], target: str | os.PathLike[str]) -> None:
    """Write a certificate as JSON, whole or not at all."""
    with atomic_write(target) as temporary:
        temporary.write_text(json.dumps(page, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def _bytes(array: Any) -> bytes:
    """An array's elements, little-endian, whatever this machine's order is."""
    values = np.ascontiguousarray(array)
    return values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()


def _versions() -> dict[str, str | None]:
    found: dict[str, str | None] = {}
    for name in PARTS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found


def _plain(value: Any) -> Any:
    """`value` as JSON knows it; null for what is not finite."""
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
