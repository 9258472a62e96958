"""The arrays of all records, checked and frozen where a record is made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from splinefeed.errors import InputError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
#: Places processed at once: their columns and what is made of them stay in a core's cache.
CHUNK = 2048
T = TypeVar("T", bound=NDArray[Any])
#: Points (n, d) as users write them: to mypy a list of integers beside one of floats is no ArrayLike.
Points: TypeAlias = NDArray[Any] | Sequence[Sequence[float | np.floating[Any] | np.integer[Any]] | NDArray[Any]]


def frozen_array(values: ArrayLike | Points, name: str, ndim: int) -> Array:
    """Copy values to a read-only contiguous array of float64.

    Parameters
    ----------
    values : array_like
        Of any shape: (...).
    name : str
        What they are, for the message.
    ndim : int
        How many dimensions they must have.

    Returns
    -------
    (...) array
        Of `ndim` dimensions.

    Raises
    ------
    InputError
        For values that are no numbers, of another shape, or not finite.
    """
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
    """Refuse an array with an element that is not finite.

    Parameters
    ----------
    array : (...) array
        The values.
    name : str
        What they are, for the message.

    Raises
    ------
    InputError
        Names the first element that is NaN or infinite.
    """
    finite = np.isfinite(array)
    if not finite.all():
        place = np.unravel_index(int(np.argmin(finite)), array.shape)
        index = ", ".join(str(int(i)) for i in place)
        raise InputError(f"{name}[{index}] is {array[place]}; every value must be finite")


def read_only(array: T) -> T:
    """Make a view of an array that cannot be written to.

    Parameters
    ----------
    array : (...) array
        The array.

    Returns
    -------
    (...) array
        The view.
    """
    view = array.view()
    view.setflags(write=False)
    return view


def chunks(count: int, most: int = CHUNK) -> Iterator[slice]:
    """Divide places into parts of so many that what is made of them stays in the cache.

    Parameters
    ----------
    count : int
        How many places.
    most : int, optional
        Of one part.

    Yields
    ------
    slice
        Of the next part.
    """
    return (slice(first, min(first + most, count)) for first in range(0, count, most))


def dot(one: Array, other: Array) -> Array:
    """Compute a scalar product over the first axis, added one after the other: how many there are changes no bit.

    Parameters
    ----------
    one, other : (m, ...) array
        The factors.

    Returns
    -------
    (...) array
        The products.
    """
    total: Array = one[0] * other[0] if len(one) else np.zeros(np.broadcast_shapes(one.shape, other.shape)[1:])
    for k in range(1, len(one)):
        total += one[k] * other[k]
    return total


def taken(index: Any, *arrays: Any) -> tuple[Any, ...]:
    """Take elements of the last axis of each array.

    Parameters
    ----------
    index : (k,) array of int or bool
        Which.
    *arrays : (..., n) array
        The arrays.

    Returns
    -------
    tuple of (..., k) array
        The elements.
    """
    return tuple(each[..., index] for each in arrays)


def expanded(count: IntArray) -> tuple[IntArray, IntArray]:
    """Number things by their owners.

    Parameters
    ----------
    count : (n,) array of int
        How many each of n owners has.

    Returns
    -------
    owner, number : (m,) array of int
        Of each thing, whose it is, and its number with that owner.
    """
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(len(owner)) - (np.cumsum(count) - count)[owner]
