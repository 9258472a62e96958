"""Steps of tuned axes as Plotly's plain data: what the full axis does with its old and with its new gains."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from splinefeed.report import theme
from splinefeed.report.drawing import short
from splinefeed.simulation.curves import StepResponse, TunedAxis

#: Height of one panel, pixels, and the share of it that stays empty below.
PANEL, GAP = 230, 0.2
_NAMES = (("old gains", theme.FAINT, "dot"), ("new gains", theme.BLUE, "solid"))


def steps(axes: Sequence[TunedAxis]) -> dict[str, Any]:
    """A panel an axis: its position after a small step, um or degrees, with both gains, and where it is to go."""
    data: list[dict[str, Any]] = []
    count = len(axes)
    layout: dict[str, Any] = {
        "height": PANEL * count + 60,
        "margin": {"l": 84, "r": 24, "t": 30, "b": 46},
        "font": {"size": 12.5},
        "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom"},
        "hovermode": "x",
    }
    for k, tuned in enumerate(axes):
        suffix = "" if k == 0 else f"{k + 1}"
        factor, unit = (180.0 / np.pi, "°") if tuned.axis.rotary else (1e3, "µm")
        for step, (name, colour, dash) in zip(tuned.steps, _NAMES, strict=True):
            data.append(_line(step, factor, name, colour, dash, suffix, k == 0))
        goal = factor * tuned.steps[0].size
        data.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": [0.0, 1e3 * max(float(step.t[-1]) for step in tuned.steps if len(step.t))],
                "y": [goal, goal],
                "name": "commanded",
                "line": {"color": theme.VERMILION, "width": 1, "dash": "dash"},
                "xaxis": f"x{suffix}",
                "yaxis": f"y{suffix}",
                "showlegend": k == 0,
                "hoverinfo": "skip",
            }
        )
        top = 1.0 - k / count
        layout[f"xaxis{suffix}"] = {"anchor": f"y{suffix}", "title": {"text": "time after the step (ms)"}}
        layout[f"yaxis{suffix}"] = {
            "anchor": f"x{suffix}",
            "domain": [top - (1.0 - GAP) / count, top],
            "title": {"text": f"{theme.words(tuned.axis.name, 12)}, step of {short(goal)} {unit}"},
        }
    return {"data": data, "layout": layout}


def _line(
    step: StepResponse, factor: float, name: str, colour: str, dash: str, suffix: str, named: bool
) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "x": np.round(1e3 * step.t, 6).tolist(),
        "y": (factor * step.position).tolist(),
        "name": name if step.stopped is None else f"{name}: stopped",
        "line": {"color": colour, "width": 1.6, "dash": dash},
        "xaxis": f"x{suffix}",
        "yaxis": f"y{suffix}",
        "showlegend": named,
    }
