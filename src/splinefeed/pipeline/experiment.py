"""The paper's experiment: setpoints of several methods on its machine, side by side, and the conclusions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from splinefeed.analysis.tally import ErrorTally
from splinefeed.geometry.path import Path
from splinefeed.interpolation.interpolator import interpolate
from splinefeed.machine.machine import Machine
from splinefeed.pipeline.follow import Served, serve
from splinefeed.records import ROTARY_AXES, TimeLaw

#: The machine of the paper as we model it, the methods that it compares and last the one that its setpoints are made
#: by here, and the largest error it measured, mm.
PAPER_MACHINE = "xytheta"
PAPER_METHODS = ("taylor-2", "milne-simpson", "milne-simpson-anchored")
PAPER_ERROR = 0.01218
#: Methods whose contour errors differ by less than this share of the largest count as the same.
SAME = 0.05


def serve_methods(
    path: Path, law: TimeLaw, machine: Machine, methods: Iterable[str] = PAPER_METHODS, corrections: int = 1
) -> Iterator[Served]:
    """The same motion by one method after the other, each followed by the same machine."""
    for method in methods:
        yield serve(path, law, interpolate(path, law, method=method, corrections=corrections), machine)


def largest_linear_error(tally: ErrorTally) -> tuple[str, float, float, float | None]:
    """Axis, largest following error, mm, its time, s, and commanded arc length, mm, over the linear axes."""
    linear = [(axis, worst) for axis, worst in zip(tally.axes, tally.tracking, strict=True) if axis not in ROTARY_AXES]
    axis, worst = max(linear, key=lambda pair: pair[1].value)
    return axis, worst.value, worst.t, worst.s


def comparison(served: list[Served]) -> dict[str, Any]:
    """How far the methods are apart on this machine, beside the error that the servo makes itself, mm."""
    errors = [each.tally.contour.value for each in served if each.tally.contour is not None]
    if not errors:
        return {}
    spread = max(errors) - min(errors)
    return {
        "contour_error_least_mm": min(errors),
        "contour_error_largest_mm": max(errors),
        "spread_share": spread / max(errors) if max(errors) > 0.0 else 0.0,
        "setpoints_off_law_largest_mm": max(each.off_law for each in served),
        "method_matters": spread > SAME * max(errors),
    }


def sentences(served: list[Served], machine: Machine) -> list[str]:
    """What is measured and what is assumed, and whether the choice of the method matters, from the numbers."""
    main = served[-1]
    axis, error, _, s = largest_linear_error(main.tally)
    half = 0.5 * float(main.setpoints.s[-1])
    place = "" if s is None else f", {abs(s - half):.2f} mm {'behind' if s > half else 'before'} the nose"
    words = [
        f"model: {machine.name}, simulated; the paper gives gains, encoders, scales and card, but not the plant: "
        f"speed per volt, lag, masses and friction are assumptions (splinefeed machine show {machine.name})",
        f"measurement: the paper's {PAPER_ERROR * 1e3:.2f} um, the largest of its axes, where the arc begins; here it "
        f"is {error * 1e3:.2f} um on {axis}{place}: {error / PAPER_ERROR:.1f} times as much, an effect of the "
        f"plant, not of the interpolator",
    ]
    found = comparison(served)
    if found:
        apart = (
            f"their contour errors are {found['contour_error_least_mm'] * 1e3:.2f} to "
            f"{found['contour_error_largest_mm'] * 1e3:.2f} um, {found['spread_share']:.1%} apart, and their setpoints "
            f"at most {found['setpoints_off_law_largest_mm'] * 1e3:.2f} um off the time law"
        )
        verdict = "matters" if found["method_matters"] else "is negligible next to the following error"
        words.append(f"finding: on this machine the choice of the interpolator {verdict}: {apart}")
    return words


def servo_numbers(served: list[Served], machine: Machine, of_paper: bool) -> dict[str, Any]:
    """The numbers of `run` for a machine: errors of the last of `served`, and of the paper's experiment all of them."""
    main = served[-1]
    numbers: dict[str, Any] = {"machine": machine.name, **main.tally.numbers(), "servo_notes": list(main.notes)}
    if of_paper:
        axis, error, t, s = largest_linear_error(main.tally)
        numbers["experiment"] = {
            "paper_error_mm": PAPER_ERROR,
            "largest_error_mm": error,
            "largest_error_axis": axis,
            "largest_error_at": {"t_s": t, "s_mm": s},
            "methods": [each.numbers() for each in served],
            **comparison(served),
            "sentences": sentences(served, machine),
        }
    return numbers
