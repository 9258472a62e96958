"""Certificate: a check's verdict with the hashes of what was checked, as one JSON file."""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

import splinefeed
from splinefeed.files.atomic import write_page
from splinefeed.files.plain import plain
from splinefeed.paths.path import Path
from splinefeed.records import Limits, Setpoints, TimeLaw, Verdict

#: Raised by one when a key of a certificate changes its meaning.
SCHEMA = 1
#: Packages whose version can change a number.
PARTS = ("numpy", "numba", "scipy")


def setpoints_hash(setpoints: Setpoints) -> str:
    """SHA-256 of axes, period and the hashes of every column, bit for bit."""
    whole = hashlib.sha256(json.dumps([list(setpoints.axes), setpoints.period.hex()]).encode())
    for column in setpoints.columns.values():
        whole.update(hashlib.sha256(_bytes(column)).digest())
    return whole.hexdigest()


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


def certificate(
    setpoints: Setpoints, path: Path, limits: Limits, verdict: Verdict, law: TimeLaw | None = None
) -> dict[str, Any]:
    """State what was checked, by its hashes, with what, and the verdict; nothing in it depends on place or time.

    Parameters
    ----------
    setpoints : Setpoints
        What was checked.
    path : Path
        Theirs.
    limits : Limits
        What they must keep.
    verdict : Verdict
        Of the check.
    law : TimeLaw, optional
        What was checked with them.

    Returns
    -------
    dict of str to object
        What `write_certificate` writes.
    """
    hashes = {"setpoints": setpoints_hash(setpoints), "path": path_hash(path), "limits": limits_hash(limits)}
    if law is not None:
        hashes["law"] = hashlib.sha256(_bytes(law.breaks) + _bytes(law.coefficients)).hexdigest()
    return {
        "certificate": "splinefeed check",
        "schema": SCHEMA,
        "sha256": hashes,
        "limits": limits.as_dict(),
        "versions": {"splinefeed": splinefeed.__version__, "python": platform.python_version(), **versions(PARTS)},
        "verdict": plain(verdict.as_dict()),
    }


def write_certificate(page: dict[str, Any], target: str | os.PathLike[str]) -> None:
    """Write a certificate as JSON, whole or not at all.

    Parameters
    ----------
    page : dict of str to object
        What `certificate` gave.
    target : str or path
        The file.
    """
    write_page(target, page)


def _bytes(array: Any) -> bytes:
    """An array's elements, little-endian, whatever this machine's order is."""
    values = np.ascontiguousarray(array)
    return values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()


def versions(names: Iterable[str]) -> dict[str, str | None]:
    """Find the installed versions of packages.

    Parameters
    ----------
    names : iterable of str
        Of packages.

    Returns
    -------
    dict of str to str or None
        None for one that is not there.
    """
    found: dict[str, str | None] = {}
    for name in names:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found
