"""What a sweep came to: how many runs went well, the best and the worst, failures by kind, and the Pareto front."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from splinefeed.records import Array, IntArray
from splinefeed.sweeps.work import DONE, FAILED, OVER

#: Numbers whose least and greatest values are reported, in the order of the table.
REPORTED = (
    "duration_s",
    "ripple_max",
    "chord_error_max_mm",
    "worst_share",
    "contour_error_max_mm",
    "tracking_error_max_mm",
)
#: Texts of errors that are reported, the most frequent first.
ERRORS = 10


def summary(about: Mapping[str, Any], rows: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    """Counts by status, extremes of each number over the runs that gave one, and failures by kind."""
    status = Counter(rows["status"])
    kinds = Counter(
        (kind, error) for kind, error, state in zip(rows["error_kind"], rows["error"], rows["status"], strict=True)
        if state == FAILED
    )  # fmt: skip
    numbers: dict[str, Any] = {}
    for name in REPORTED:
        values = column(rows, name)
        if np.isfinite(values).any():
            least, most = int(np.nanargmin(values)), int(np.nanargmax(values))
            numbers[name] = {
                "least": float(values[least]), "least_run": rows["index"][least], "median": float(np.nanmedian(values)),
                "most": float(values[most]), "most_run": rows["index"][most],
            }  # fmt: skip
    front = pareto(rows)
    return {
        "name": about["name"],
        "runs": about["runs"],
        "there": len(rows["index"]),
        "ok": status[DONE],
        "not_kept": status[OVER],
        "failed": status[FAILED],
        "numbers": numbers,
        "failures": [
            {"kind": kind, "error": error, "runs": count} for (kind, error), count in kinds.most_common(ERRORS)
        ],
        "pareto": [{"index": rows["index"][k], "source": rows["source"][k]} for k in front],
    }


def column(rows: Mapping[str, Sequence[Any]], name: str) -> Array:
    """A column as numbers, NaN where there is none, (n,)."""
    return np.array([np.nan if value is None else float(value) for value in rows[name]], dtype=np.float64)


def pareto(rows: Mapping[str, Sequence[Any]]) -> IntArray:
    """Rows that no other one beats in both cycle time and contour error, by cycle time; empty without a machine.

    Only runs that keep every limit count: it is easy to be fast without.
    """
    time, error = column(rows, "duration_s"), column(rows, "contour_error_max_mm")
    kept = np.array([status == DONE for status in rows["status"]], dtype=np.bool_)
    known = np.flatnonzero(np.isfinite(time) & np.isfinite(error) & kept)
    order = known[np.lexsort((error[known], time[known]))]
    best = np.inf
    front = []
    for k in order:
        if error[k] < best:
            best = error[k]
            front.append(int(k))
    return np.array(front, dtype=np.int64)
