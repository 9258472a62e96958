"""Plotly's JavaScript as pages carry it: whole, so that they need no network, and quick to load."""

from __future__ import annotations

import base64
import gzip
from functools import lru_cache
from importlib import resources

from splinefeed.errors import InputError

#: The library between these is wrapped in a function for other module systems, which browsers parse twice for it.
_BEGIN, _END = '"use strict";var Plotly=', "window.Plotly = Plotly;"
#: Effort of the compressor; more takes longer and gains nothing.
_EFFORT = 6


def available() -> bool:
    """Whether Plotly, which pages are drawn with, is installed."""
    try:
        import plotly  # noqa: F401
    except ImportError:
        return False
    return True


def script() -> str:
    """The library as a script that sets `window.Plotly`; InputError where Plotly is not installed."""
    try:
        place = resources.files("plotly").joinpath("package_data", "plotly.min.js")
    except ModuleNotFoundError:
        raise InputError("report.html needs Plotly: pip install 'splinefeed[report]'") from None
    text = place.read_text(encoding="utf-8")
    begin, end, licence = text.find(_BEGIN), text.rfind(_END), text.find("*/") + 2
    if not licence <= begin < end:  # a Plotly of another make is taken as it is
        return text
    return f"{text[:licence]}\n(function(){{{text[begin:end]}{_END}}})();\n"


@lru_cache(maxsize=1)
def compressed() -> str:
    """`script` through gzip, in base64, for pages that hold it themselves; page.js unpacks it."""
    return base64.b64encode(gzip.compress(script().encode(), _EFFORT, mtime=0)).decode()
