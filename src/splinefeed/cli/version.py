"""`splinefeed version`: what is installed here."""

from __future__ import annotations

import click

from splinefeed import __version__
from splinefeed.cli import options

EXAMPLES = """\b
Examples:
  splinefeed version
  splinefeed version --verbose
"""

#: Everything that splinefeed needs, in the order of the alphabet.
NEEDED = ("click", "h5py", "matplotlib", "numba", "numpy", "pint", "platformdirs", "rich", "scipy")


@click.command(epilog=EXAMPLES)
@click.option("--verbose", is_flag=True, help="Versions of what it stands on, and the folder of compiled kernels.")
@options.as_json
def command(verbose: bool, as_json: bool) -> None:
    """Print the version."""
    from splinefeed.cli import output

    page: dict[str, object] = {"splinefeed": __version__}
    if verbose:
        import platform

        from splinefeed.kernels.jit import cache_directory
        from splinefeed.report.record import version_of

        page |= {"python": platform.python_version(), "system": platform.platform()}
        page |= {name: version_of(name) for name in NEEDED}
        page["compiled_kernels"] = str(cache_directory())
    if as_json:
        output.print_json(page)
        return
    for name, value in page.items():
        output.print_text(f"{name.replace('_', ' '):<17}{value}" if verbose else f"{name} {value}")
