"""Contours of a drawing that lie on others although they are described otherwise: another start, direction or kind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.nearest import Nearest
from splinefeed.paths.path import Path
from splinefeed.records import Array

#: Places of each span at which contours are compared, and how much boxes of these may differ as a share of their size.
PLACES, ALIKE = 9, 0.05
#: Most contours that are compared, and pairs of them whose boxes are alike: each takes a ms or two.
MOST, MOST_PAIRS = 20_000, 5000
Run = Sequence[NurbsCurve]


def on_others(runs: Sequence[Run], tolerance: float) -> list[tuple[int, int]] | None:
    """Find contours that lie on an earlier one, as long as itself.

    Parameters
    ----------
    runs : sequence of Run
        Curves of each contour, end to end.
    tolerance : float
        mm.

    Returns
    -------
    list of (int, int) or None
        Number of each such contour and of the earlier one; None where too many would have to be compared.

    Notes
    -----
    Both lie on each other: places of either are nowhere farther from the other, by exact distances.
    """
    from scipy.spatial import cKDTree

    if len(runs) < 2:
        return []
    if len(runs) > MOST:
        return None
    places = [_places(run) for run in runs]
    boxes = np.array([np.concatenate([each.min(axis=0), each.max(axis=0)]) for each in places])
    size = np.linalg.norm(boxes[:, boxes.shape[1] // 2 :] - boxes[:, : boxes.shape[1] // 2], axis=1)
    # those of lines are exact, those of places on curves are not
    exact = np.array([all(curve.degree == 1 for curve in run) for run in runs])
    reach = np.where(exact, 0.0, ALIKE * size) + np.sqrt(boxes.shape[1]) * tolerance
    tree = cKDTree(boxes)
    if np.sum(tree.query_ball_point(boxes, reach, return_length=True) - 1) > 2 * MOST_PAIRS:
        return None
    alike: list[set[int]] = [set() for _ in runs]  # of each contour the earlier ones
    for i, others in enumerate(tree.query_ball_point(boxes, reach)):
        for other in others:
            alike[max(i, other)].add(min(i, other))
    made: dict[int, tuple[Path, Nearest]] = {}

    def track(i: int) -> tuple[Path, Nearest]:
        if i not in made:
            path = Path(runs[i], tolerance=np.inf)
            made[i] = path, Nearest(path.table, path.shape)
        return made[i]

    def lies(i: int, on: int) -> bool:
        return bool(np.max(track(on)[1].find(places[i])[2]) <= tolerance)

    found: dict[int, int] = {}
    for i, earlier in enumerate(alike):
        for other in sorted(each for each in earlier if each < i and each not in found):
            if lies(i, other) and lies(other, i):
                found[i] = other
                break
    return list(found.items())


def _places(run: Run) -> Array:
    found = []
    for curve in run:
        if curve.degree == 1:  # corners, and the middle between them
            corners = curve.control_points
            found += [corners, 0.5 * (corners[1:] + corners[:-1])]
        else:
            breaks, part = np.array(curve.breaks), np.arange(PLACES - 1) / (PLACES - 1)
            inner = breaks[:-1, None] + np.diff(breaks)[:, None] * part
            found.append(curve(np.append(inner.ravel(), breaks[-1])))
    return np.concatenate(found)
