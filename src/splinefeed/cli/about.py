"""`splinefeed machine`, `methods`, `completion` and `version`: what there is, and what is installed here."""

from __future__ import annotations

import inspect
import os
import re
from typing import Any

import click

import splinefeed as sf
from splinefeed import __version__
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import print_table, print_text
from splinefeed.cli.progress import Say

#: A reference in running text: from an initial to the DOI at the end.
_REFERENCE = re.compile(r": ([A-Z]\. [^:]+, doi \S+)$")
#: Settings of the surroundings that change what splinefeed does, or where it keeps things.
SETTINGS = ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT", "NUMBA_NUM_THREADS", "MPLCONFIGDIR", "SOURCE_DATE_EPOCH")
MACHINE = """\b
Examples:
  splinefeed machine list
  splinefeed machine show xytheta
  splinefeed machine show my-table.toml --json
"""


@click.group(epilog=MACHINE)
def machine() -> None:
    """List the built-in machines, or describe a machine.

    A machine is a TOML file: per axis motor, drive, transmission, load, friction, encoder or scale, controller, limits.
    """


def _print_list(page: Page) -> None:
    rows = [[each["name"], " ".join(each["axes"]), each["title"]] for each in page["machines"]]
    print_table(["machine", "axes", "what it is"], rows, texts=3)


@machine.command("list", short_help="List the built-in machines.", epilog=MACHINE)
@answers(_print_list)
def list_machines(say: Say) -> Page:
    """List the built-in machines; --machine takes such a name, or a machine file."""
    models = map(sf.Machine.load, sf.Machine.names())
    return {"machines": [{"name": each.name, "title": each.title, "axes": list(each.axes)} for each in models]}


def _print_machine(page: Page) -> None:

    for line in sf.Machine.load(page["file"]).describe().splitlines():
        print_text(line)


@machine.command("show", short_help="Describe a machine.", epilog=MACHINE)
@click.argument("name", metavar="NAME|FILE")
@answers(_print_machine)
def show_machine(say: Say, name: str) -> Page:
    """Describe a built-in machine or a machine file; report every error of the file, with its place."""
    return {**sf.Machine.load(name).as_dict(), "file": name}


def _print_methods(page: Page) -> None:
    rows = [[each["name"], each["title"], _order(each)] for each in page["methods"]]
    print_table(["method", "what it is", "order"], rows, texts=2)
    print_text()
    print_text(f"The default is {page['default']}. Sources:")
    for each in page["methods"]:
        print_text(f"  {each['name']}: {each['source'] or 'registered without one'}")


def _order(page: Page) -> str:
    return str(page["order"] or ("exact" if page["exact"] else "fit"))


@click.command(epilog="\b\nExamples:\n  splinefeed methods\n  splinefeed methods --json")
@answers(_print_methods)
def methods(say: Say) -> Page:
    """List the interpolation methods with their observed order of convergence and source."""
    from splinefeed.interpolation import registry

    def source(step: Any) -> str:
        """What stands behind "Source:" in the docstring of a step."""
        words = " ".join((inspect.getdoc(getattr(step, "py_func", step)) or "").split())
        reference = _REFERENCE.search(words)
        return words.partition("Source: ")[2] or (reference[1] if reference else "")

    known = [registry.method(name) for name in registry.methods()]
    listed = [
        {
            "name": each.name,
            "title": each.title,
            "order": each.order,
            "exact": each.anchor,
            "history": each.history,
            "source": source(each.fill or each.step),
        }
        for each in known
    ]
    return {"methods": listed, "default": registry.DEFAULT_METHOD}


@click.command(
    epilog="\b\nExamples:\n  splinefeed completion bash >> ~/.bashrc\n  splinefeed completion zsh >> ~/.zshrc"
)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@answers(lambda page: click.echo(page["script"]))
def completion(say: Say, shell: str) -> Page:
    """Print the lines that make SHELL complete the commands and options of splinefeed."""
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None  # the choices above are those that click knows
    return {"shell": shell, "script": found(click.Group(), {}, "splinefeed", "_SPLINEFEED_COMPLETE").source()}


def _print_version(page: Page) -> None:
    for name, value in page.items():
        print_text(f"{name.replace('_', ' '):<17}{value}" if len(page) > 1 else f"{name} {value}")


@click.command(epilog="\b\nExamples:\n  splinefeed version\n  splinefeed version --verbose")
@click.option("--verbose", is_flag=True, help="Dependencies, those of the extras too, settings and folders.")
@answers(_print_version)
def version(say: Say, verbose: bool) -> Page:
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
