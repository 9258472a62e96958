"""`splinefeed machine`: the machines there are, and what a machine file says."""

from __future__ import annotations

import click

from splinefeed.cli import options, output

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


@command.command("list", short_help="List the built-in machines.", epilog=EXAMPLES)
@options.as_json
def list_machines(as_json: bool) -> None:
    """List the built-in machines; --machine takes such a name, or a machine file."""
    from splinefeed.machine.machine import Machine

    models = [Machine.load(name) for name in Machine.names()]
    if as_json:
        numbers = [{"name": model.name, "title": model.title, "axes": list(model.axes)} for model in models]
        output.print_json({"machines": numbers})
        return
    rows = [[model.name, " ".join(model.axes), model.title] for model in models]
    output.print_table(["machine", "axes", "what it is"], rows, texts=3)


@command.command("show", short_help="Describe a machine.", epilog=EXAMPLES)
@click.argument("machine", metavar="NAME|FILE")
@options.as_json
def show_machine(machine: str, as_json: bool) -> None:
    """Describe a built-in machine or a machine file; report every error of the file, with its place."""
    from splinefeed.machine.machine import Machine

    model = Machine.load(machine)
    if as_json:
        output.print_json({**model.as_dict(), "file": machine})
        return
    for line in model.describe().splitlines():
        output.print_text(line)
