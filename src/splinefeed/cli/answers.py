"""How a command is made: its help in panels, and one page of numbers as its answer, in JSON or in words."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

from splinefeed.cli import options
from splinefeed.cli.failures import DONE, NOT_KEPT
from splinefeed.cli.output import Block, Page, print_blocks, print_json
from splinefeed.cli.progress import busy
from splinefeed.limit_table import TABLE

#: Title of each panel and the options in it by parameter name, in this order; what stands in none comes last.
PANELS = {
    "Tuning": "axes rule kind feed_forward runs seed machine_file",
    "Most used": "feed axis_acceleration axis_jerk machine smooth output",
    "Limits": f"limits_file {' '.join(kind.name for kind in TABLE if kind.says)} travel",
    "Planning": "strategy period method corrections contour_tolerance tangential",
    "Source and units": "source which layer hidden units chord edges dialect start offsets tools increments from_line "
    "repair tolerance columns",
    "Smoothing": "corners corner_angle angle_tolerance",
    "Output": "formats tip figures no_figures figure compare as_json",
}


class PanelCommand(click.Command):
    """A command whose help shows its options in PANELS."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write a section for each panel."""
        params = [param for param in self.get_params(ctx) if isinstance(param, click.Option)]
        records = {param.name: record for param in params if (record := param.get_help_record(ctx))}
        for title, names in PANELS.items():
            if rows := [records.pop(name) for name in names.split() if name in records]:
                with formatter.section(title):
                    formatter.write_dl(rows)
        if records:
            with formatter.section("Other"):
                formatter.write_dl(list(records.values()))


def _help(make: Callable[..., Any], note: str) -> dict[str, Any]:
    """What click shows of a docstring: its words, and behind the options its examples and a note."""
    words, _, calls = inspect.cleandoc(make.__doc__ or "").partition("Examples:\n")
    epilog = f"\b\nExamples:\n{inspect.cleandoc(calls)}\n\n{note}".replace("\nsplinefeed", "\n  splinefeed")
    return {"help": words, "epilog": epilog}


def documented(note: str = "") -> Callable[[Callable[..., Any]], click.Command]:
    """A command whose help is its docstring, with the options in panels, and ends in `note`."""
    return lambda make: click.command(cls=PanelCommand, **_help(make, note))(make)


def group(make: Callable[[], None]) -> click.Group:
    """A command that has commands, its help from a docstring."""
    return click.Group(make.__name__, **_help(make, ""))


def answers(
    show: Callable[[Page], Iterable[Block]], note: str = options.UNITS_NOTE
) -> Callable[[Callable[..., Page]], click.Command]:
    """A command made of a function that says what it is busy with, its first argument, and returns its page of numbers.

    With --json, which this adds, the page is printed as it is; else the blocks that `show` makes of it and the names of
    its `files`. The exit code is 1 where its `ok` is false. For the help see `documented`.
    """

    def decorate(make: Callable[..., Page]) -> click.Command:
        @options.as_json
        @functools.wraps(make)
        def command(as_json: bool, **given: Any) -> None:
            with busy() as say:
                page = make(say, **given)
            if as_json:
                print_json(page)
            else:
                files = page.get("files")
                print_blocks([*show(page), [f"wrote {' '.join(files)}"] if files else []])
            kept = page["ok"] == page["runs"] if "there" in page else page.get("ok", True)  # a sweep counts its runs
            click.get_current_context().exit(DONE if kept else NOT_KEPT)

        return documented(note)(command)

    return decorate


def recorded(page: Page, names: list[str], folder: str, stage: Path, record: str) -> Page:
    """Write a page of numbers as the file `record` into a staged folder that has the files `names`; what to answer."""
    import splinefeed
    from splinefeed.files.atomic import write_page
    from splinefeed.files.plain import plain

    page = plain({**page, "program": f"splinefeed {splinefeed.__version__}"})
    names = [*names, record]
    write_page(stage / record, {**page, "files": names})
    return {**page, "files": [str(Path(folder) / name) for name in names]}
