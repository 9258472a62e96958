"""Joint waypoints as one smooth path, which shows the arm in space."""

from __future__ import annotations

from functools import partial
from typing import Any

from splinefeed.paths.path import Path
from splinefeed.records import Array
from splinefeed.robots.frames import Frames


class WaypointPath(Path):
    """A path of the joints of an arm, which knows where its links are: pictures of it show the arm in space.

    `Arm.through` makes it; docs/readers/robots.md shows one.
    """

    def __init__(self, *made: Any, frames: Frames, **said: Any) -> None:
        self.frames = frames
        super().__init__(*made, **said)

    def __reduce__(self) -> tuple[object, ...]:
        return partial(WaypointPath, frames=self.frames, **self._said()), (self.curves, self.axes)

    def sticks(self, position: Array) -> Array:
        """The arm as lines: base, each joint and the tip, (n, joints + 2, 3), mm, for joints (n, joints)."""
        return self.frames.sticks(position)
