"""Values as JSON knows them, for pages of numbers and for what a browser is sent."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """Convert a value to what JSON knows.

    Parameters
    ----------
    value : object
        Mappings, sequences, arrays, numbers and names of files.

    Returns
    -------
    object
        Lists, dicts, numbers of Python, and null for what is not finite.

    Examples
    --------
    >>> import math
    >>> from splinefeed.files.plain import plain
    >>> plain({"x": (1.0, math.nan)})
    {'x': [1.0, None]}
    """
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, str | bool | int) or value is None:
        return value
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return [plain(each) for each in value]
