"""Points of the sections among the sample files."""

from __future__ import annotations

import numpy as np


def airfoil(data_dir, name, chord=100.0):
    """Points (n, 2) of a section among the sample files, mm."""
    rows = [line.split() for line in (data_dir / "airfoil" / f"{name}.dat").read_text().splitlines()]
    return chord * np.array([row for row in rows if len(row) == 2 and row[0][0] in "-.0123456789"], dtype=float)
