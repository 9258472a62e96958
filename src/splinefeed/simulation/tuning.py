"""Tuning rules: the gains of an axis from its ultimate point, with the margins and the bandwidth they give."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from splinefeed.errors import InputError
from splinefeed.machine.parts import GAIN_UNITS, Controller, ServoAxis
from splinefeed.simulation.curves import following_error, hunts, overshoot, rest_swing, step_responses
from splinefeed.simulation.linear import Bound, Margins, margins
from splinefeed.simulation.shaping import REQUIRED, shaped

#: The rule that shapes a loop by its margins.
MARGINS = "margins"

#: K_p / K_u, T_i / P_u and T_d / P_u of each rule and sort of controller.
#: Ziegler and Nichols, Trans. ASME 64 (1942) 759-768; Tyreus and Luyben, Ind. Eng. Chem. Res. 31 (1992) 2625-2628,
#: doi:10.1021/ie00011a029, the PID row after M. L. Luyben and W. L. Luyben, Essentials of Process Control (1997).
RULES: dict[str, dict[str, tuple[float, float, float]]] = {
    "ziegler-nichols": {
        "p": (0.5, math.inf, 0.0),
        "pi": (0.45, 1.0 / 1.2, 0.0),
        "pid": (0.6, 0.5, 0.125),
    },
    "tyreus-luyben": {
        "pi": (1.0 / 3.2, 2.2, 0.0),
        "pid": (1.0 / 2.2, 2.2, 1.0 / 6.3),
    },
}


@dataclass(frozen=True)
class UltimatePoint:
    """Where proportional control alone oscillates steadily.

    Attributes
    ----------
    gain : float
        V/mm or V/rad.
    period : float
        Of the oscillation, s.

    References
    ----------
    .. [1] J. G. Ziegler, N. B. Nichols, Trans. ASME 64 (1942) 759-768.
    .. [2] docs/tune.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> point = sf.runs.tune(sf.Machine.load("router").axes["x"], "ziegler-nichols").ultimate
    >>> round(point.gain, 2), round(point.period, 4)
    (7.39, 0.0071)
    """

    gain: float
    period: float


@dataclass(frozen=True, kw_only=True, eq=False)
class TunedAxis:
    """An axis as it was and with the controller that a rule gives.

    Attributes
    ----------
    rule : str
        Its name.
    old, axis : ServoAxis
        With the old and with the new controller.
    period : float
        Of the servo, s.
    """

    rule: str
    old: ServoAxis
    axis: ServoAxis
    period: float

    @cached_property
    def before(self) -> Margins:
        """The margins of the old controller."""
        return margins(self.old, self.period)

    @cached_property
    def margins(self) -> Margins:
        """The margins of the new controller."""
        return margins(self.axis, self.period)

    def numbers(self) -> dict[str, Any]:
        """Return what `--json` prints: gains, margins and hunting at rest before and after."""
        unit = "rad" if self.axis.rotary else "mm"
        out: dict[str, Any] = {"unit": f"V/{unit}", "rest_swing_unit": unit}
        for ending, axis, loop in (("_before", self.old, self.before), ("", self.axis, self.margins)):
            swing = rest_swing(axis, self.period)
            out[f"gains{ending}"] = axis.controller.gains
            out[f"gain_units{ending}"] = {name: GAIN_UNITS[name].format(unit) for name in axis.controller.gains}
            out[f"kind{ending}"] = axis.controller.kind
            out[f"margins{ending}"] = loop.as_dict()
            out[f"following_error{ending}"] = following_error(axis, self.period)
            out[f"rest_swing{ending}"] = swing
            out[f"hunts{ending}"] = hunts(axis, swing)
        steps = step_responses(self.old, self.axis, self.period)
        out["step"] = steps[1].size
        out["overshoot_before"], out["overshoot"] = (overshoot(each) for each in steps)
        return out


@dataclass(frozen=True, kw_only=True, eq=False)
class Tuning(TunedAxis):
    """Gains that a rule gives, and their source.

    Attributes
    ----------
    rule : str
        Its name.
    old, axis : ServoAxis
        With the old and with the new controller; gains in V/mm or V/rad.
    period : float
        Of the servo, s.
    ultimate : UltimatePoint or None
        Gain and period that the rule starts from; None for rule "margins".

    References
    ----------
    .. [1] docs/tune.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> tuning = sf.runs.tune(sf.Machine.load("router").axes["x"], "tyreus-luyben")
    >>> tuning.before.stable, tuning.margins.stable, tuning.controller.kind
    (True, True, 'pid')
    """

    ultimate: UltimatePoint | None = None

    @property
    def controller(self) -> Controller:
        """The controller with the new gains."""
        return self.axis.controller

    def numbers(self) -> dict[str, Any]:
        """Return those of a tuned axis, and the ultimate point."""
        point = self.ultimate
        found = {} if point is None else {"ultimate_gain": point.gain, "ultimate_period_s": point.period}
        return {**super().numbers(), **found}

    def describe(self) -> str:
        """Return gains, margins and bandwidth in words, with those of the old gains beside them."""
        unit = "V/rad" if self.axis.rotary else "V/mm"
        slope = "V*s/rad" if self.axis.rotary else "V*s/mm"
        new, point = self.controller, self.ultimate
        if new.kind == "pid":
            gains = f"kp {new.kp:.6g} {unit}, ki {new.ki:.6g} {unit}/s, kd {new.kd:.6g} {slope}"
        else:
            gains = f"position_gain {new.position_gain:.6g} 1/s, velocity_kp {new.velocity_kp:.6g} {slope}"
            gains += f", velocity_ki {new.velocity_ki:.6g} {unit}"
        start = (
            []
            if point is None
            else [f"  ultimate gain {point.gain:.6g} {unit}, ultimate period {point.period * 1e3:.4g} ms"]
        )
        return "\n".join(
            [
                f"axis {self.axis.name}, {self.rule}, servo period {self.period * 1e3:g} ms",
                *start,
                f"  {gains}",
                f"  new gains {self.margins.sentence}",
                f"  old gains {self.before.sentence}",
            ]
        )


def ultimate_point(axis: ServoAxis, period: float) -> UltimatePoint:
    """Find where proportional control of the linear plant is at its limit.

    Parameters
    ----------
    axis : ServoAxis
        The axis.
    period : float
        Of the servo, s.

    Returns
    -------
    UltimatePoint
        Gain, V/mm or V/rad, and period, s.

    Raises
    ------
    InputError
        For an axis without one: stable, or unstable, at any gain.
    """
    gains: dict[str, Any] = dict.fromkeys(("ki", "kd", "position_gain", "velocity_kp", "velocity_ki"), 0.0)
    kp = 1.0
    for _ in range(2):
        plain = replace(axis.controller, kind="pid", filter=0.0, **gains | {"kp": kp})
        found = margins(replace(axis, controller=plain), period)
        if found.stable_below is None:
            break
        kp = 0.5 * found.stable_below  # the gain that was tried is beyond the ultimate one
    if not (found.stable and math.isfinite(found.gain_margin) and found.gain_reduction == 0.0):
        raise InputError(
            f"axis {axis.name}: no ultimate gain: proportional control alone is unstable, or stable, at any gain; "
            f"rules that start from it need a drive in velocity mode; rules 'margins' and 'path' do not"
        )
    return UltimatePoint(kp * found.gain_margin, 1.0 / found.gain_frequency)


def tune(
    axis: ServoAxis,
    rule: str = MARGINS,
    *,
    period: float = 1e-3,
    kind: str | None = None,
    bound: Bound | None = None,
) -> Tuning:
    """Find gains of an axis by a rule: by margins, or from the ultimate point of its linear model.

    Parameters
    ----------
    axis : ServoAxis
        With its old controller.
    rule : str, optional
        "margins" (`simulation.shaping`), whose loops keep the `bound`, or one of RULES, which keep what they keep.
    period : float, optional
        Of the servo, s.
    kind : str, optional
        "p", "pi" or "pid", for "margins" also "p-pi"; by default "pid", for "margins" what the axis has.
    bound : Bound, optional
        Of "margins"; by default 45 deg and 6 dB.

    Returns
    -------
    Tuning
        The axis with its old and its new controller.

    Raises
    ------
    InputError
        For unknown names, where no gains keep the bound, and for an axis without an ultimate gain.

    Notes
    -----
    Of RULES K_p = c K_u,  K_i = K_p / T_i,  K_d = K_p T_d with c, T_i and T_d of the rule. Filter and feed-forward
    stay, but for that of speed where a P-PI cascade becomes a PID: there it went through the speed loop.
    """
    if rule == MARGINS:
        tuned = shaped(axis, period, kind or axis.controller.kind, bound or REQUIRED)
        return Tuning(rule=rule, old=axis, axis=tuned, period=period)
    if rule not in RULES:
        raise InputError(f"no tuning rule is called {rule!r}; there are {', '.join((MARGINS, *RULES))}, path")
    kind = kind or "pid"
    if kind not in RULES[rule]:
        raise InputError(f"rule {rule!r} has no controller {kind!r}; it has {', '.join(RULES[rule])}")
    point = ultimate_point(axis, period)
    share, integral, derivative = RULES[rule][kind]
    kp = share * point.gain
    gains: dict[str, Any] = {"kp": kp, "ki": kp / (integral * point.period), "kd": kp * derivative * point.period}
    cascade: dict[str, Any] = {"position_gain": 0.0, "velocity_kp": 0.0, "velocity_ki": 0.0}
    if axis.controller.kind == "p-pi":
        cascade["velocity_feed_forward"] = 0.0
    source = f"{rule} ({kind}) from the ultimate point of the linear model"
    tuned = replace(axis, controller=replace(axis.controller, kind="pid", source=source, **gains, **cascade))
    return Tuning(rule=rule, old=axis, axis=tuned, period=period, ultimate=point)
