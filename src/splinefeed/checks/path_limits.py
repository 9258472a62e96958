"""Limits along the path of what a place and the feed there make: a function each, which evaluates one of them.

A limit of PLACES in the table (`limit_table.py`) has an evaluator here. By it the check holds setpoints and laws to the
limit, and reports show its use.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from splinefeed.checks.spans import SpanPlaces
from splinefeed.limit_table import KINDS
from splinefeed.records import Array


@dataclass(frozen=True, eq=False)
class TipPlaces:
    """Places on the tip's path, as evaluators see them.

    Parameters
    ----------
    places : SpanPlaces
        The spans (n,) that they lie on.
    c : list of (axes, ..., n) arrays
        C(u) there and its first three derivatives by u: all axes of the tip's path, the `places.linear` linear ones
        first.
    """

    places: SpanPlaces
    c: list[Array]

    @cached_property
    def curvature(self) -> Array:
        """Curvature of the path over the linear axes, (..., n), 1/mm."""
        return self.places.curvature(self.c)


Evaluator = Callable[[TipPlaces], Array]
"""Of places, (..., n): the size of what the limit bounds at a feed of the tip of 1 mm/s; it grows with `power`."""


def centripetal(at: TipPlaces) -> Array:
    """kappa, 1/mm: at a feed v it is kappa v^2."""
    return at.curvature


#: Of each limit of PLACES what evaluates it.
EVALUATORS: dict[str, Evaluator] = {"centripetal": centripetal}


def value_of(name: str, at: TipPlaces, feed: Array) -> Array:
    """Evaluate what a limit of places bounds.

    Parameters
    ----------
    name : str
        Of the limit.
    at : TipPlaces
        Places on the tip's path.
    feed : (..., n) array
        Of the tip there, mm/s.

    Returns
    -------
    (..., n) array
        Its size, in the unit of the limit.
    """
    return np.asarray(EVALUATORS[name](at) * feed ** KINDS[name].power)
