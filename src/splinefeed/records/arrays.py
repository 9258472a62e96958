"""The arrays of all records, checked and frozen where a record is made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splinefeed.errors import InputError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
T = TypeVar("T", bound=NDArray[Any])
#: Points (n, d) as users write them: to mypy a list of integers beside one of floats is no ArrayLike.
Points: TypeAlias = NDArray[Any] | Sequence[Sequence[float | np.floating[Any] | np.integer[Any]] | NDArray[Any]]


def frozen_array(values: ArrayLike | Points, name: str, ndim: int) -> Array:
    """Copy to a read-only contiguous float64 array of `ndim` dimensions; InputError names what is wrong."""
    try:
        array = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{name}: expected numbers in {ndim} dimension(s), got {type(values).__name__} ({error})"
        ) from None
    if array.ndim != ndim:
        raise InputError(f"{name}: expected {ndim} dimension(s), got shape {array.shape}")
    array.setflags(write=False)
    return array


def check_finite(array: Array, name: str) -> None:
    """Raise InputError naming the first element of `array` that is NaN or infinite."""
    finite = np.isfinite(array)
    if not finite.all():
        place = np.unravel_index(int(np.argmin(finite)), array.shape)
        index = ", ".join(str(int(i)) for i in place)
        raise InputError(f"{name}[{index}] is {array[place]}; every value must be finite")


def read_only(array: T) -> T:
    """A view of `array` that cannot be written to."""
    view = array.view()
    view.setflags(write=False)
    return view
