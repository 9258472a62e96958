"""NURBS curves through measured points and through functions, within a tolerance that is checked afterwards.

`points` fits points, with the smoothing of `smooth`; `function` fits a function; `grid` places the knots of both.
"""

from __future__ import annotations

from splinefeed.paths.fitting.function import fit_function
from splinefeed.paths.fitting.points import MAX_POINTS, Fit, distances, fit

__all__ = ["MAX_POINTS", "Fit", "distances", "fit", "fit_function"]
