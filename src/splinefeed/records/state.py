"""State: how a motion moves at a place of its path."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from splinefeed.errors import InputError
from splinefeed.numbers import finite


@dataclass(frozen=True)
class State:
    """How a motion moves at a place of its path.

    Parameters
    ----------
    feed, acceleration : float
        Along the path, mm/s and mm/s^2 (of joints in rad: rad/s and rad/s^2), over all axes as `Path.length` counts
        them.
    s : float
        Length from the start of the path, mm (rad).

    Raises
    ------
    InputError
        For values that are not finite, s or feed below 0, and an acceleration at rest.

    References
    ----------
    .. [1] docs/math/planner.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> path, limits = sf.shapes.circle(radius=10), sf.Limits(feed=50, acceleration=1000, jerk=50000)
    >>> law = sf.plan(path, limits, strategy="time-optimal", start=sf.planner.State(feed=20.0))
    >>> print(f"{law.feed(0.0):.3f} mm/s")
    20.000 mm/s
    """

    feed: float = 0.0
    acceleration: float = 0.0
    s: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.acceleration) or not (0.0 <= self.feed < math.inf and 0.0 <= self.s < math.inf):
            raise InputError(f"{self!r}: feed and s must be finite and not negative, the acceleration finite")
        if self.feed == 0.0 != self.acceleration:
            raise InputError(f"{self!r}: at rest the acceleration is 0")

    def __str__(self) -> str:
        return f"a state of {self.feed:.6g} mm/s and {self.acceleration:.6g} mm/s^2 at s = {self.s:.6g} mm"

    @property
    def settings(self) -> dict[str, Any]:
        """What a law that begins so says in its settings, which its setpoints and their files have, too."""
        return {"start": asdict(self)}

    @staticmethod
    def said(settings: Mapping[str, Any]) -> State | None:
        """Read the state in which a motion begins from its settings.

        Parameters
        ----------
        settings : mapping
            Those of a law or of setpoints.

        Returns
        -------
        State or None
            The state; None for the start of the path.
        """
        given = settings.get("start")
        if given is None:
            return None
        if not isinstance(given, Mapping) or set(given) - set(asdict(REST)):
            raise InputError(f"start is {given!r}; expected feed, acceleration and s")
        return State(**{name: finite(value, f"start: {name}") for name, value in given.items()})

    def slower(self, share: float) -> State:
        """Give the state there of the same motion made slower.

        Parameters
        ----------
        share : float
            Of the feed; the acceleration changes by its square.

        Returns
        -------
        State
            At the same place.
        """
        return State(self.feed * share, self.acceleration * share**2, self.s)


#: At rest where a path begins.
REST = State()
