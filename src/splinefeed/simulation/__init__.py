"""The servo loop over setpoints, experiments on an axis, and the rules that tune it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from splinefeed.lazy import lazily

_HOMES = {
    "AxisTuning": "pipeline.tuning",
    "Bound": "simulation.bound",
    "FrequencyResponse": "simulation.experiments",
    "Margins": "simulation.linear",
    "PathTuning": "pipeline.tuning",
    "Tuning": "simulation.tuning",
    "UltimatePoint": "simulation.experiments",
    "margins": "simulation.linear",
    "tune_on_path": "pipeline.tuning",
}

__all__ = [*_HOMES]  # pyright: ignore[reportUnsupportedDunderAll]

if TYPE_CHECKING:
    from splinefeed.pipeline.tuning import AxisTuning as AxisTuning
    from splinefeed.pipeline.tuning import PathTuning as PathTuning
    from splinefeed.pipeline.tuning import tune_on_path as tune_on_path
    from splinefeed.simulation.bound import Bound as Bound
    from splinefeed.simulation.experiments import FrequencyResponse as FrequencyResponse
    from splinefeed.simulation.experiments import UltimatePoint as UltimatePoint
    from splinefeed.simulation.linear import Margins as Margins
    from splinefeed.simulation.linear import margins as margins
    from splinefeed.simulation.tuning import Tuning as Tuning
else:
    __getattr__, __dir__ = lazily(__name__, _HOMES)
