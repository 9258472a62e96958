"""`splinefeed machine`, `methods`, `completion` and `version`: what there is, and what is installed here."""

from __future__ import annotations

import inspect
import os
import re
from typing import Any

import click

import splinefeed as sf
from splinefeed import __version__
from splinefeed.cli import machine_from, options
from splinefeed.cli.answers import answers, group
from splinefeed.cli.output import Block, Page, Say, table

#: Settings of the surroundings that change what splinefeed does, or where it keeps things.
SETTINGS = ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT", "NUMBA_NUM_THREADS", "MPLCONFIGDIR", "SOURCE_DATE_EPOCH")


@group
def machine() -> None:
    """List the built-in machines, describe a machine, or make one from the configuration of a control.

    A machine is a TOML file: the limits of its axes; to simulate them, motor, drive, transmission, load and controller.

    Examples:
      splinefeed machine list
      splinefeed machine from-ini mill.ini
      splinefeed machine show xytheta
      splinefeed machine show my-table.toml --json
    """


def _show_machines(page: Page) -> list[Block]:
    rows = [[each["name"], " ".join(each["axes"]), each["title"]] for each in page["machines"]]
    return [table(["machine", "axes", "what it is"], rows, texts=3)]


@answers(_show_machines, "")
def list_machines(say: Say) -> Page:
    """List the built-in machines.

    --machine takes such a name, or a machine file.

    Examples:
      splinefeed machine list
      splinefeed machine list --json
    """
    models = map(sf.Machine.load, sf.Machine.names())
    return {"machines": [{"name": each.name, "title": each.title, "axes": list(each.axes)} for each in models]}


@answers(lambda page: [sf.Machine.load(page["file"]).describe().splitlines()], "")
@options.table("name  NAME|FILE")
def show_machine(say: Say, name: str) -> Page:
    """Describe a machine, built-in or of a file; report every error of the file, with its place.

    Examples:
      splinefeed machine show xytheta
      splinefeed machine show my-table.toml --json
    """
    return {**sf.Machine.load(name).as_dict(), "file": name}


machine.add_command(list_machines, "list")
machine.add_command(show_machine, "show")


def _show_usual(page: Page) -> list[Block]:
    if page["usual"] is None:
        return [[f"no usual machine; splinefeed time takes {page['plain']} where none is named"]]
    return [[f"the usual machine is {page['usual']}: splinefeed time takes it where none is named"]]


@answers(_show_usual, "")
@options.table("""
name        [NAME|FILE]
--forget    -           Have no usual machine.
""")
def use_machine(say: Say, name: str | None, forget: bool) -> Page:
    """Choose the machine that `splinefeed time` takes where none is named; without NAME, show it.

    Examples:
      splinefeed machine use mill.toml
      splinefeed machine use
      splinefeed machine use --forget
    """
    from splinefeed.errors import InputError
    from splinefeed.machine import usual

    if name is not None and forget:
        raise InputError("--forget: is for no machine; leave out the machine or --forget")
    kept = usual.choose(name) if name is not None or forget else usual.chosen()
    return {"usual": kept, "plain": usual.PLAIN}


machine.add_command(use_machine, "use")
for name, command in machine_from.COMMANDS.items():
    machine.add_command(command, name)


def _show_methods(page: Page) -> list[Block]:
    methods = [{**each, "order": each["order"] or ("exact" if each["exact"] else "fit")} for each in page["methods"]]
    sources = [f"  {each['name']}: {each['source'] or 'registered without one'}" for each in methods]
    rows = [[each["name"], each["title"], str(each["order"])] for each in methods]
    return [
        table(["method", "what it is", "order"], rows, texts=2),
        [f"The default is {page['default']}. Sources:", *sources],
    ]


@answers(_show_methods, "")
def methods(say: Say) -> Page:
    """List the interpolation methods with their observed order of convergence and source.

    Examples:
      splinefeed methods
      splinefeed methods --json
    """
    from splinefeed.interpolation import registry

    def source(step: Any) -> str:
        """Return the References of a step's docstring as one line."""
        words = inspect.getdoc(getattr(step, "py_func", step)) or ""
        listed = words.partition("References\n----------\n")[2].partition("\n\n")[0]
        return " ".join(listed.removeprefix(".. [1] ").replace(".. ", "").split())

    listed = [
        {
            "name": each.name,
            "title": each.title,
            "order": each.order,
            "exact": each.anchor,
            "history": each.history,
            "source": source(each.fill or each.step),
        }
        for each in map(registry.method, registry.methods())
    ]
    return {"methods": listed, "default": registry.DEFAULT_METHOD}


@answers(lambda page: [page["script"].splitlines()], "")
@options.table("shell  bash|zsh|fish")
def completion(say: Say, shell: str) -> Page:
    """Print the lines that make SHELL complete the commands and options of splinefeed.

    Examples:
      splinefeed completion bash >> ~/.bashrc
      splinefeed completion zsh >> ~/.zshrc
    """
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None  # the choices above are those that click knows
    return {"shell": shell, "script": found(click.Group(), {}, "splinefeed", "_SPLINEFEED_COMPLETE").source()}


def _show_version(page: Page) -> list[Block]:
    width = 16 if len(page) > 1 else 0
    return [[f"{name.replace('_', ' '):<{width}} {value}" for name, value in page.items()]]


@answers(_show_version, "")
@options.table("--verbose  -  Dependencies, those of the extras too, settings and folders.")
def version(say: Say, verbose: bool) -> Page:
    """Print the version.

    Examples:
      splinefeed version
      splinefeed version --verbose
    """
    if not verbose:
        return {"splinefeed": __version__}
    import platform
    from importlib.metadata import PackageNotFoundError, requires

    from splinefeed.checks.certificate import versions
    from splinefeed.kernels.jit import cache_directory

    try:
        wanted = {re.split(r"[^\w.-]", line, maxsplit=1)[0] for line in requires("splinefeed") or []}
    except PackageNotFoundError:  # run from a folder, without being installed
        wanted = set()
    return {
        "splinefeed": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        **{name: found or "not installed" for name, found in versions(sorted(wanted - {"splinefeed"})).items()},
        **{name: os.environ.get(name, "not set") for name in SETTINGS},
        "package": os.path.dirname(str(sf.__file__)),
        "compiled_kernels": str(cache_directory()),
    }
