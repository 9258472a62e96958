"""What tabulating, editing and measuring need of a curve: a `NurbsCurve` has it."""

from __future__ import annotations

from typing import Protocol, Self

from numpy.typing import ArrayLike

from splinefeed.kernels.layout import Shape
from splinefeed.records import Array, Points


class AnySpline(Protocol):
    """A rational B-spline: degree, knots (k,), control points (n, axes), mm, weights (n,) or None; see `NurbsCurve`."""

    degree: int
    knots: Array
    control_points: Array
    weights: Array | None

    def __init__(
        self, degree: int, knots: ArrayLike, control_points: Points, weights: ArrayLike | None = None
    ) -> None: ...

    @classmethod
    def trusted(  # noqa: D102
        cls, degree: int, knots: Array, control_points: Array, weights: Array | None = None, *, clamped: bool = True
    ) -> Self: ...

    @property
    def axes(self) -> int: ...  # noqa: D102

    @property
    def domain(self) -> tuple[float, float]: ...  # noqa: D102

    @property
    def rational(self) -> bool: ...  # noqa: D102

    @property
    def breaks(self) -> Array: ...  # noqa: D102

    @property
    def clamped(self) -> bool: ...  # noqa: D102

    @property
    def size(self) -> float: ...  # noqa: D102

    @property
    def table(self) -> tuple[Array, Shape]: ...  # noqa: D102

    @property
    def _shape(self) -> Shape: ...

    def __call__(self, u: ArrayLike) -> Array: ...  # noqa: D102

    def derivatives(self, u: ArrayLike, order: int = 1, *, side: str = "right") -> Array: ...  # noqa: D102

    def check_parameters(self, u: ArrayLike) -> Array: ...  # noqa: D102
