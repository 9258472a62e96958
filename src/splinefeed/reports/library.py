"""JavaScript as pages carry it: Plotly whole, so that they need no network, and quick to load; and our modules."""

from __future__ import annotations

import base64
import gzip
import hashlib
from contextlib import suppress
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import platformdirs

from splinefeed.errors import InputError
from splinefeed.files.atomic import write_text
from splinefeed.reports.figure import EXTRA

#: The library between these is wrapped in a function for other module systems, which browsers parse twice for it.
_BEGIN, _END = '"use strict";var Plotly=', "window.Plotly = Plotly;"
#: Modules of a page, each behind those that it imports; the studio has all but the last.
MODULES = ("dom.js", "dress.js", "time.js", "zoom.js", "view.js", "path.js", "listing.js", "page.js")
#: Effort of the compressor; more takes longer and gains nothing.
_EFFORT = 6


def file() -> Path | None:
    """The library as the package `plotly` brings it, found without importing that; None where it is not installed."""
    spec = find_spec("plotly")
    found = Path(str(spec.origin)).with_name("package_data") / "plotly.min.js" if spec else None
    return found if found and found.is_file() else None


def available() -> bool:
    """Tell whether Plotly, which pages are drawn with, is installed."""
    return file() is not None


def _file() -> Path:
    if (found := file()) is None:
        raise InputError(f"report.html needs Plotly: {EXTRA}")
    return found


def script() -> str:
    """Give Plotly as a script that sets `window.Plotly`.

    Returns
    -------
    str
        JavaScript.

    Raises
    ------
    InputError
        Where Plotly is not installed.
    """
    text = _file().read_text(encoding="utf-8")
    begin, end, licence = text.find(_BEGIN), text.rfind(_END), text.find("*/") + 2
    if not licence <= begin < end:  # a Plotly of another make is taken as it is
        return text
    return f"{text[:licence]}\n(function(){{{text[begin:end]}{_END}}})();\n"


@lru_cache(maxsize=1)
def compressed() -> str:
    """`script` through gzip, in base64, for pages that hold it themselves; page.js unpacks it.

    Compressing takes longer than all figures of a run, so the user's cache folder keeps the result.
    """
    source = _file()
    about = source.stat()
    key = hashlib.sha256(f"{source} {about.st_size} {about.st_mtime_ns} {_EFFORT}".encode()).hexdigest()[:16]
    kept = None
    with suppress(OSError, ValueError, RuntimeError, KeyError):  # the latter two: no home folder is known
        kept = platformdirs.user_cache_path("splinefeed", appauthor=False) / f"plotly-{key}.txt"
        return kept.read_text(encoding="ascii")
    text = base64.b64encode(gzip.compress(script().encode(), _EFFORT, mtime=0)).decode()
    with suppress(OSError, InputError):
        if kept is None:
            return text
        kept.parent.mkdir(parents=True, exist_ok=True)
        write_text(kept, text)
    return text
