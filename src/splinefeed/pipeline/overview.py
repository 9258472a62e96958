"""A response of any length in a bounded number of samples that still show every peak of its errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from splinefeed.analysis.thinning import extremes
from splinefeed.geometry.path import Path
from splinefeed.pipeline.deviation import Deviation, deviation
from splinefeed.records import Array, Response
from splinefeed.simulation.follow import join

#: Samples that are kept at the most; a figure has some hundred columns of pixels.
MOST_SAMPLES = 40_000
#: Ticks up to which the contour is pictured: five minutes at 1 ms.
MOST_PICTURED = 300_000


class Overview:
    """Keeps, of each block of ticks, those where an error of an axis or the contour error is largest or least.

    Up to MOST_SAMPLES ticks all are kept. When there are more, blocks are made, and made longer as they go on.
    """

    def __init__(self, most: int = MOST_SAMPLES) -> None:
        self._most = most
        self._block = 1
        self._kept: list[Response] = []
        self._count = 0

    def see(self, response: Response) -> None:
        """The next piece of the response."""
        if not len(response):
            return
        part = thinned(response, self._block)
        self._kept.append(part)
        self._count += len(part)
        while self._count > self._most:
            whole = join(self._kept)
            # a block of as many kept samples as it has extremes, times two, at the least halves them
            width = 2 * (2 * len(whole.axes) + 2)
            self._block = width * max(self._block, 1)
            self._kept = [thinned(whole, width)]
            self._count = len(self._kept[0])

    @property
    def response(self) -> Response:
        """The samples that were kept, with times that are not even; ValueError if nothing was seen."""
        return join(self._kept)


def thinned(response: Response, block: int) -> Response:
    """Of each `block` samples those with the extremes of following errors and contour error; and both ends."""
    if block <= 1 or len(response) <= 2:
        return response
    columns = [*response.tracking_error.T, *([] if response.contour_error is None else [response.contour_error])]
    blocks = -(-len(response) // block)
    at = np.unique(np.concatenate([extremes(np.asarray(values), blocks) for values in columns]))
    names = ("t", "command", "position", "measured", "output", "saturated")
    error = None if response.contour_error is None else response.contour_error[at]
    return replace(response, **{name: getattr(response, name)[at] for name in names}, contour_error=error)


class Pictured:
    """A response and its commanded arc lengths as long as they are short enough for a picture in the plane."""

    def __init__(self, most: int = MOST_PICTURED) -> None:
        self._left = most
        self._parts: list[tuple[Response, Array]] = []

    def see(self, response: Response, s: Array) -> None:
        """The next piece of the response, with its commanded arc lengths (n,), mm."""
        self._left -= len(response)
        if self._left < 0 or len(s) != len(response):
            self._left, self._parts = -1, []
        elif len(response):
            self._parts.append((response, s))

    def deviation(self, path: Path) -> Deviation | None:
        """Where the machine was beside the path, None if there was too much to picture."""
        if not self._parts:
            return None
        s = np.concatenate([each for _, each in self._parts])
        return deviation(join([each for each, _ in self._parts]), path, s)
