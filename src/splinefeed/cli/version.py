"""`splinefeed version`: what is installed here, and what it goes by."""

from __future__ import annotations

import re
from typing import Any

import click

from splinefeed import __version__
from splinefeed.cli import options, output

EXAMPLES = """\b
Examples:
  splinefeed version
  splinefeed version --verbose
"""

#: Settings of the surroundings that change what splinefeed does, or where it keeps things.
SETTINGS = ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT", "NUMBA_NUM_THREADS", "MPLCONFIGDIR", "SOURCE_DATE_EPOCH")
#: Extras that users may add, in the order of docs/decisions/0013-extras.md.
EXTRAS = ("plots", "cad", "parquet", "studio", "dask", "mpi")


@click.command(epilog=EXAMPLES)
@click.option("--verbose", is_flag=True, help="Dependencies, missing extras, settings and folders.")
@options.as_json
def command(verbose: bool, as_json: bool) -> None:
    """Print the version."""
    page: dict[str, Any] = {"splinefeed": __version__}
    if verbose:
        page |= _surroundings()
    if as_json:
        output.print_json(page)
        return
    for name, value in page.items():
        shown = ", ".join(f"{key} {one}" for key, one in value.items()) if isinstance(value, dict) else value
        output.print_text(f"{name.replace('_', ' '):<17}{shown}" if verbose else f"{name} {shown}")


def _surroundings() -> dict[str, Any]:
    """Versions of Python, the system and every package of the recipe; settings that are set; folders."""
    import os
    import platform
    from pathlib import Path

    import splinefeed
    from splinefeed.interpolation.registry import DEFAULT_METHOD
    from splinefeed.kernels.jit import cache_directory
    from splinefeed.pipeline.run import PAPER_PERIOD
    from splinefeed.report.record import version_of

    page: dict[str, Any] = {"python": platform.python_version(), "system": platform.platform()}
    page |= {name: version_of(name) for name in _requested(None)}
    page["extras"] = {
        extra: "installed" if all(version_of(name) for name in _requested(extra)) else "not installed"
        for extra in EXTRAS
    }
    page["settings"] = {name: os.environ.get(name, "not set") for name in SETTINGS}
    page["defaults"] = {"method": DEFAULT_METHOD, "strategy": "by the limits given", "period": f"{PAPER_PERIOD:g} s"}
    page["package"] = str(Path(splinefeed.__file__).parent)
    page["compiled_kernels"] = str(cache_directory())
    return page


def _requested(extra: str | None) -> list[str]:
    """Names of the packages that splinefeed, or one of its extras, asks for."""
    from importlib.metadata import PackageNotFoundError, requires

    try:
        wanted = requires("splinefeed") or []
    except PackageNotFoundError:  # run from a folder, without being installed
        return []
    found = []
    for line in wanted:
        marker = re.search(r"extra\s*==\s*['\"]([\w-]+)['\"]", line)
        if (marker[1] if marker else None) == extra:
            found.append(re.split(r"[^\w.-]", line, maxsplit=1)[0])
    return sorted(name for name in found if name != "splinefeed")
