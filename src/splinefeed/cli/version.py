"""`splinefeed version`: what is installed here, and what it goes by."""

from __future__ import annotations

import os
import re

import click

from splinefeed import __version__
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import print_text
from splinefeed.cli.progress import Say

EXAMPLES = """\b
Examples:
  splinefeed version
  splinefeed version --verbose
"""

#: Settings of the surroundings that change what splinefeed does, or where it keeps things.
SETTINGS = ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT", "NUMBA_NUM_THREADS", "MPLCONFIGDIR", "SOURCE_DATE_EPOCH")


def _print(page: Page) -> None:
    for name, value in page.items():
        print_text(f"{name.replace('_', ' '):<17}{value}" if len(page) > 1 else f"{name} {value}")


@click.command(epilog=EXAMPLES)
@click.option("--verbose", is_flag=True, help="Dependencies, those of the extras too, settings and folders.")
@answers(_print)
def command(say: Say, verbose: bool) -> Page:
    """Print the version."""
    if not verbose:
        return {"splinefeed": __version__}
    import platform
    from importlib.metadata import PackageNotFoundError, requires

    import splinefeed
    from splinefeed.kernels.jit import cache_directory
    from splinefeed.report.record import version_of

    try:
        wanted = {re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in requires("splinefeed") or []}
    except PackageNotFoundError:  # run from a folder, without being installed
        wanted = set()
    return {
        "splinefeed": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        **{name: version_of(name) or "not installed" for name in sorted(wanted - {"splinefeed"})},
        **{name: os.environ.get(name, "not set") for name in SETTINGS},
        "package": os.path.dirname(splinefeed.__file__),
        "compiled_kernels": str(cache_directory()),
    }
