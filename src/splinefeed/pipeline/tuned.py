"""A machine tuned, by a rule or on a path: the new one, its numbers, and what figures show of its axes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from splinefeed.geometry.path import Path
from splinefeed.machine.machine import Machine
from splinefeed.machine.parts import Axis
from splinefeed.pipeline.tuning import tune_on_path
from splinefeed.records import Setpoints
from splinefeed.simulation.curves import TunedAxis, hunts, rest_swing, tuned_axis
from splinefeed.simulation.linear import Margins
from splinefeed.simulation.tuning import VOLTS, tune


@dataclass(frozen=True, eq=False)
class TunedMachine:
    """A machine with new gains.

    page    what was found: gains and margins of each axis before and after; curves  what figures show, made on request
    """

    machine: Machine
    page: dict[str, Any]
    curves: Callable[[], list[TunedAxis]]


def by_rule(
    machine: Machine,
    names: Sequence[str],
    rule: str,
    *,
    period: float,
    kind: str = "pid",
    identify: str = "model",
    volts: float = VOLTS,
    say: Callable[[str], None] = lambda words: None,
) -> TunedMachine:
    """Gains of single axes by a rule that starts from the ultimate point; see `simulation.tuning.tune`."""
    tunings = []
    for name in names:
        say(f"tuning axis {name}")
        tunings.append(tune(machine.axes[name], rule, period=period, kind=kind, experiment=identify, volts=volts))
    new = replace(machine, axes={**machine.axes, **{each.axis.name: each.axis for each in tunings}})
    axes = {
        each.axis.name: {
            **_numbers(each.old, each.axis, each.before, each.margins, period),
            "ultimate_gain": each.ultimate.gain,
            "ultimate_period_s": each.ultimate.period,
            "ultimate_source": each.ultimate.source,
        }
        for each in tunings
    }

    def curves() -> list[TunedAxis]:
        return [tuned_axis(t.old, t.axis, t.rule, period, t.response if identify == "sine" else None) for t in tunings]

    return TunedMachine(new, {"period_s": period, "identify": identify, "axes": axes}, curves)


def along_path(machine: Machine, setpoints: Setpoints, path: Path, **options: Any) -> TunedMachine:
    """Gains of all axes together that make contour error small on a path; see `pipeline.tuning.tune_on_path`."""
    found = tune_on_path(machine, setpoints, path, **options)
    numbers = {
        name: {
            **_numbers(each.old, each.axis, each.before, each.margins, setpoints.period),
            "tracking_error_max_before": each.tracking_before,
            "tracking_error_max": each.tracking,
            "tracking_unit": "rad" if each.axis.rotary else "mm",
        }
        for name, each in found.axes.items()
    }
    page = {
        "period_s": setpoints.period,
        "path_name": path.name,
        "bound": found.bound.words,
        "runs": found.evaluations,
        "contour_error_max_before_mm": None if found.before is None else found.before.max,
        "contour_error_max_mm": found.contour.max,
        "contour_error_rms_mm": found.contour.rms,
        "axes": numbers,
    }

    def curves() -> list[TunedAxis]:
        return [tuned_axis(t.old, t.axis, f"rule path, {path.name}", setpoints.period) for t in found.axes.values()]

    return TunedMachine(found.machine, page, curves)


def _numbers(old: Axis, new: Axis, before: Margins, after: Margins, period: float) -> dict[str, Any]:
    """Gains and margins of an axis before and after, and how the gains are measured."""
    unit = "rad" if new.rotary else "mm"
    out: dict[str, Any] = {"unit": f"V/{unit}", "rest_swing_unit": unit}
    for ending, axis, margins in (("_before", old, before), ("", new, after)):
        swing = rest_swing(axis, period)
        out[f"gains{ending}"] = axis.controller.gains
        out[f"kind{ending}"] = axis.controller.kind
        out[f"margins{ending}"] = margins.as_dict()
        out[f"rest_swing{ending}"] = swing
        out[f"hunts{ending}"] = hunts(axis, swing)
    return out
