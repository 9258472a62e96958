"""Every `splinefeed ...` line on the pages is one that the command line takes: commands, options and their values."""

from __future__ import annotations

import re
import shlex

import click
import pytest

from docs_pages import PAGES, blocks, name
from splinefeed.cli.main import command_line

CALL = re.compile(r"^\s*(?:\S*/bin/|mpiexec .* -m )?splinefeed (?P<words>.+)$")
#: Stand for whatever the reader has.
PLACEHOLDER = re.compile(r"[A-Z]{4,}")


def calls() -> list[tuple[str, str]]:
    found = []
    for page in PAGES:
        for block in blocks(page):
            if block.language not in ("", "sh", "bash", "console"):
                continue
            for line in block.text.splitlines():
                # behind two blanks a remark begins, with or without its #; behind | and > is what the shell does
                call = CALL.match(re.split(r"\s{2,}|\s#|\s[|>]", line.strip())[0])
                if call:
                    found.append((name(page), call["words"]))
    return found


CALLS = calls()


def test_pages_are_full_of_commands():
    assert len(CALLS) > 50


@pytest.mark.parametrize("page", sorted({page for page, _ in CALLS}))
def test_commands_parse(page):
    for where, words in CALLS:
        if where != page or PLACEHOLDER.search(words):
            continue
        first, *rest = shlex.split(words)
        command = command_line.get_command(click.Context(command_line), first)
        assert command is not None, words
        try:
            command.make_context(first, rest)
        except click.exceptions.Exit:
            pass  # --help
        except click.UsageError as error:
            pytest.fail(f"splinefeed {words}: {error.format_message()}")
