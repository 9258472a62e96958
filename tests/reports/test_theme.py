"""Colours of axes are told apart by colour-blind readers, too; numbers of limits are those that were given."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from splinefeed.reports import theme

#: What protanopia, deuteranopia and tritanopia make of linear red, green and blue: Machado, Oliveira & Fernandes 2009,
#: https://doi.org/10.1109/TVCG.2009.113, severity 1.
EYES = {
    "usual": np.eye(3),
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = np.array([0.95047, 1.0, 1.08883])


def lab(colour: str, eye: str) -> np.ndarray:
    """CIELAB of a colour as an eye sees it."""
    s = np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    linear = np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)
    x, y, z = XYZ @ np.clip(np.array(EYES[eye]) @ linear, 0.0, 1.0) / WHITE
    f = [np.cbrt(each) if each > (6 / 29) ** 3 else each / (3 * (6 / 29) ** 2) + 4 / 29 for each in (x, y, z)]
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("eye", EYES)
def test_axes_are_told_apart_by_their_colours(eye):
    apart = {
        pair: np.linalg.norm(lab(pair[0], eye) - lab(pair[1], eye)) for pair in itertools.combinations(theme.COLOURS, 2)
    }
    nearest = min(apart, key=apart.__getitem__)
    assert apart[nearest] >= 15.0, nearest


def test_a_limit_is_said_as_it_was_given():
    assert [theme.given(each) for each in (2.175, 20000.0, 0.333333333, 12500.0)] == [
        "2.175",
        "20000",
        "0.333333",
        "12500",
    ]
