"""`splinefeed machine from-ini`, `from-grbl`, `from-klipper` and `from-marlin`: machine files from configurations."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Block, Page, Say, table
from splinefeed.errors import InputError

#: Ending of each command, the one line of its help, and its example.
_FROM = {
    "ini": ("Make a machine file from the INI file of LinuxCNC.", "mill.ini"),
    "grbl": ("Make a machine file from what grbl answers to $$.", "settings.txt"),
    "klipper": ("Make a machine file from Klipper's printer.cfg.", "printer.cfg"),
    "marlin": ("Make a machine file from what Marlin answers to M503.", "m503.txt"),
}
_WORDS = """

    The file has the limits of the axes and how the control passes corners, each with the place that it comes from.
    What is assumed stands in its notes, and is printed. Edit the file as you like: the next commands take it.

    Examples:
      splinefeed machine from-{kind} {file}
      splinefeed machine from-{kind} {file} -o my-machine.toml
"""


def _show(page: Page) -> list[Block]:
    limits = []
    for name, axis in page["axes"].items():
        of = axis["limits"]
        cells = [f"{of[key]['value']:.6g} {of[key]['unit']}" if key in of else "-" for key in _LIMITS]
        limits.append([name, *cells])
    next_one = f"splinefeed time part.nc --machine {page['files'][0]}"
    return [
        [page["title"], *_said("assumed", page["assumed"]), *_said("note", page["facts"])],
        table(["axis", *_LIMITS], limits),
        [f"next: {next_one}"],
    ]


def _said(what: str, sentences: list[str]) -> list[str]:
    return [f"{what:<10}{each}" for each in sentences]


_LIMITS = ("velocity", "acceleration", "jerk", "minimum", "maximum")


def _command(kind: str) -> click.Command:
    title, example = _FROM[kind]

    def make(say: Say, file: str, **given: Any) -> Page:
        from splinefeed.files.atomic import write_text
        from splinefeed.machine.imports import imported

        target = given["output"] or f"{Path(file).stem}.toml"
        if not target.endswith(".toml"):
            raise InputError(f"-o {target}: a machine file is named .toml")
        if given["output"] is None and os.path.exists(target):
            raise InputError(f"{target}: is there already; name the file to write: -o {target}")
        machine, page = imported(kind, file)
        write_text(target, page.text())
        return {**machine.as_dict(), "assumed": page.assumed, "facts": page.facts, "files": [target]}

    make.__doc__ = title + _WORDS.format(kind=kind, file=example)
    make.__name__ = f"from_{kind}"
    described = options.table("""
file            FILE
-o --output     FILE.toml        Machine file to write.  [default: named as FILE]
""")
    return answers(_show, "")(described(make))


COMMANDS = {f"from-{kind}": _command(kind) for kind in _FROM}
