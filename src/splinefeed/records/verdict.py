"""Verdict: how every limit fares in a check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from splinefeed.limit_table import shown_by, unit_of
from splinefeed.records import view

#: A limit counts as kept up to this, relative: no drive tells less apart, and a plan may ride on its limit.
KEPT = 1e-6
#: What a check allows, in its words; the rounding of a position is eps times its size, see docs/check.md.
ALLOWED = "to within a millionth of it and the rounding of a position"


@dataclass(frozen=True, kw_only=True)
class LimitResult:
    """How one limit fares; mm, s and rad.

    Parameters
    ----------
    limit, worst : float
        The limit and the worst value, in the same unit.
    at_s, at_t : float
        Where the worst is, mm along the path, and when, s.
    floor : float
        What the rounding of the setpoints alone makes of this difference; 0 where the law itself is the worst.
    axis : str, optional
        Whose it is, if one's.
    by : str
        "setpoints" (their differences) or "law" (exact derivatives).
    over : int
        How many ticks, or instants of the law, are over the limit.

    References
    ----------
    .. [1] docs/check.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> result = sf.records.LimitResult(limit=50.0, worst=49.0, at_s=3.0, at_t=0.1)
    >>> result.share, result.holds
    (0.98, True)
    """

    limit: float
    worst: float
    at_s: float
    at_t: float
    floor: float = 0.0
    axis: str | None = None
    by: str = "setpoints"
    over: int = 0

    @property
    def share(self) -> float:
        """worst / limit."""
        return self.worst / self.limit

    @property
    def holds(self) -> bool:
        """worst <= limit (1 + 1e-6) + floor."""
        return self.worst <= self.limit * (1.0 + KEPT) + self.floor


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a check of setpoints found.

    Parameters
    ----------
    limits : mapping of str to LimitResult
        By name: feed, acceleration, deceleration, jerk, chord_error, centripetal, axis_jerk.x, ..., travel.x.
    problems : tuple of str
        What, how much and where, one sentence each; empty if all is well.
    notes : tuple of str, optional
        Allowances, and what decides where exact derivatives cannot, one sentence each.
    numbers : mapping, optional
        Other measurements: duration_s, length_mm, ticks, period_s, method, end_error_mm, ...
    along : str, optional
        The unit of s for people: mm, or deg where only rotary axes move.

    Notes
    -----
    Limits and worst values are in mm, s and rad; `as_dict` gives rotary axes in degrees, and `print(verdict)` says all
    of it with units, and what a check allows: 1e-6 of a limit and the rounding of a position.

    References
    ----------
    .. [1] docs/check.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> verdict = sf.run(sf.shapes.circle(radius=10), sf.Limits(feed=50, acceleration=1000, jerk=50000)).verdict
    >>> verdict.ok, list(verdict.limits)
    (True, ['feed', 'acceleration', 'deceleration', 'jerk'])
    """

    limits: Mapping[str, LimitResult]
    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)
    along: str = "mm"

    @property
    def ok(self) -> bool:
        """Whether every limit and every other check holds."""
        return not self.problems and all(result.holds for result in self.limits.values())

    def __str__(self) -> str:
        found = [(name, *words.split(" of ", 1)) for name, words in self._rows().items()]
        wide = [max((len(row[k]) for row in found), default=0) for k in range(2)]
        rows = [
            f"  {name:<{wide[0]}}  {worst:>{wide[1]}} of {limit}{'' if self.limits[name].holds else '  OVER'}"
            for name, worst, limit in found
        ]
        problems = [f"problem: {each}" for each in self.problems]
        return "\n".join([self.summary, *rows, *problems, *(f"note: {each}" for each in self.notes)])

    @property
    def summary(self) -> str:
        """Whether every limit and every other check holds, and what counts as held, in one sentence."""
        if self.ok:
            return f"every limit holds, {ALLOWED}"
        over = [name for name, result in self.limits.items() if not result.holds]
        return f"NOT KEPT: {', '.join(over) or 'see the problems'}; a limit holds {ALLOWED}"

    def _repr_html_(self) -> str:
        return view.table({"check": self.summary, **self._rows(), **dict.fromkeys(self.problems, "problem")})

    def _rows(self) -> dict[str, str]:
        """Worst value, limit and share of each limit, with its unit."""
        rows = {}
        for name, result in self.limits.items():
            factor, unit = shown_by(name, result.axis), unit_of(name, self.along)
            rows[name] = f"{factor * result.worst:.6g} of {factor * result.limit:.6g} {unit} ({result.share:.1%})"
        return rows

    def as_dict(self) -> dict[str, Any]:
        """The keys of `--json`; limits of rotary axes in degrees."""
        limits = {}
        for name, result in self.limits.items():
            unit = shown_by(name, result.axis)
            limits[name] = {
                "limit": unit * result.limit,
                "worst": unit * result.worst,
                "share": result.share,
                "at_s": result.at_s,
                "at_t_s": result.at_t,
                "axis": result.axis,
                "unit": unit_of(name, self.along),
                "floor": unit * result.floor,
                "by": result.by,
                "over": result.over,
                "ok": result.holds,
            }
        return {
            "ok": self.ok,
            **self.numbers,
            "limits": limits,
            "problems": list(self.problems),
            "notes": list(self.notes),
        }
