"""`splinefeed machine`: the machines there are, and what a machine file says."""

from __future__ import annotations

import click

from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import print_table, print_text
from splinefeed.cli.progress import Say

EXAMPLES = """\b
Examples:
  splinefeed machine list
  splinefeed machine show xytheta
  splinefeed machine show my-table.toml --json
"""


@click.group(epilog=EXAMPLES)
def command() -> None:
    """List the built-in machines, or describe a machine.

    A machine is a TOML file: per axis motor, drive, transmission, load, friction, encoder or scale, controller, limits.
    """


def _print_list(page: Page) -> None:
    rows = [[each["name"], " ".join(each["axes"]), each["title"]] for each in page["machines"]]
    print_table(["machine", "axes", "what it is"], rows, texts=3)


@command.command("list", short_help="List the built-in machines.", epilog=EXAMPLES)
@answers(_print_list)
def list_machines(say: Say) -> Page:
    """List the built-in machines; --machine takes such a name, or a machine file."""
    from splinefeed.machine.machine import Machine

    models = map(Machine.load, Machine.names())
    return {"machines": [{"name": each.name, "title": each.title, "axes": list(each.axes)} for each in models]}


def _print_machine(page: Page) -> None:
    from splinefeed.machine.machine import Machine

    for line in Machine.load(page["file"]).describe().splitlines():
        print_text(line)


@command.command("show", short_help="Describe a machine.", epilog=EXAMPLES)
@click.argument("machine", metavar="NAME|FILE")
@answers(_print_machine)
def show_machine(say: Say, machine: str) -> Page:
    """Describe a built-in machine or a machine file; report every error of the file, with its place."""
    from splinefeed.machine.machine import Machine

    return {**Machine.load(machine).as_dict(), "file": machine}
