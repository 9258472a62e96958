"""How a command answers: one page of numbers, as a JSON object or in words, with what was written and the exit code."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.failures import DONE, NOT_KEPT
from splinefeed.cli.output import print_json, print_text
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import busy

Page = dict[str, Any]


def answers(show: Callable[[Page], None]) -> Callable[[Callable[..., Page]], Callable[..., None]]:
    """A command made of a function that says what it is busy with, its first argument, and returns its page of numbers.

    With --json, which this adds, the page is printed as it is; else `show` says it and the names of its `files` follow.
    The exit code is 1 where its `ok` is false.
    """

    def decorate(make: Callable[..., Page]) -> Callable[..., None]:
        @options.as_json
        @functools.wraps(make)
        def command(as_json: bool, **given: Any) -> None:
            with busy() as say:
                page = make(say, **given)
            if as_json:
                print_json(page)
            else:
                show(page)
                if page.get("files"):
                    print_text()
                    print_text(f"wrote {' '.join(page['files'])}")
            kept = page["ok"] == page["runs"] if "there" in page else page.get("ok", True)  # a sweep counts its runs
            click.get_current_context().exit(DONE if kept else NOT_KEPT)

        return command

    return decorate


def declared(
    show: Callable[[Page], None], note: str = options.UNITS_NOTE
) -> Callable[[Callable[..., Page]], click.Command]:
    """A command that `answers`; its help ends in the examples of its docstring, behind the options, and a note."""

    def decorate(make: Callable[..., Page]) -> click.Command:
        words, _, calls = inspect.cleandoc(make.__doc__ or "").partition("Examples:\n")
        epilog = f"\b\nExamples:\n{inspect.cleandoc(calls)}\n\n{note}".replace("\nsplinefeed", "\n  splinefeed")
        return click.command(cls=PanelCommand, help=words, epilog=epilog)(answers(show)(make))

    return decorate


def recorded(page: Page, names: list[str], folder: str, stage: Path, record: str) -> Page:
    """Write a page of numbers as the file `record` into a staged folder that has the files `names`; what to answer."""
    import splinefeed
    from splinefeed.formats.plain import plain
    from splinefeed.report.files import write_record

    page = plain({**page, "program": f"splinefeed {splinefeed.__version__}"})
    names = [*names, record]
    write_record({**page, "files": names}, stage / record)
    return {**page, "files": [str(Path(folder) / name) for name in names]}
