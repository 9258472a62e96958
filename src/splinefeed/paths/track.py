"""What every path is: somewhere to drive along, whatever its axes are and however it is held."""

from __future__ import annotations

from typing import Any, Protocol

from splinefeed.curves.flat import Flat
from splinefeed.records import Array, IntArray


class AnyPath(Protocol):
    """What all rooms may use of a `Path`, a `ToolPath`, joints of a machine (`JointPath`) and a path in parts.

    A path says what it is by what it has: no class is tested.

    name         in files and figures; axes  names of the axes that move
    tool_path    itself, where a machine has to make joints of it, as it has a tool axis; else None
    joint_path   itself, where its axes are joints that a machine made of a tool path; else None
    in_parts     itself, where its parts are read one after the other; else None
    linking      how the contours of a drawing are linked, where they are; else None
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def axes(self) -> tuple[str, ...]: ...  # noqa: D102

    @property
    def tool_path(self) -> Any: ...  # noqa: D102

    @property
    def joint_path(self) -> Any: ...  # noqa: D102

    @property
    def in_parts(self) -> Any: ...  # noqa: D102

    @property
    def linking(self) -> Any: ...  # noqa: D102


class Measured(Protocol):
    """What finding corners needs of a path; see `Path`, which has it."""

    @property
    def flat(self) -> Flat: ...  # noqa: D102

    @property
    def joined(self) -> Any: ...  # noqa: D102

    @property
    def length(self) -> float: ...  # noqa: D102

    @property
    def size(self) -> float: ...  # noqa: D102

    @property
    def table(self) -> Array: ...  # noqa: D102

    @property
    def units(self) -> Array: ...  # noqa: D102

    @property
    def weights(self) -> Array: ...  # noqa: D102

    @property
    def curve_rows(self) -> IntArray: ...  # noqa: D102

    @property
    def curve_starts(self) -> Array: ...  # noqa: D102

    def arc_length(self, curve: Any, u: Any) -> Array: ...  # noqa: D102

    def evaluate(self, curve: IntArray, u: Array, order: int = 1, *, side: str = "right") -> Array: ...  # noqa: D102
