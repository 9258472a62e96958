"""`splinefeed completion`: what a shell must read to complete commands and options by Tab."""

from __future__ import annotations

import click

from splinefeed.cli.answers import Page, answers
from splinefeed.cli.progress import Say

EXAMPLES = """\b
Examples:
  splinefeed completion bash >> ~/.bashrc
  splinefeed completion zsh >> ~/.zshrc
  splinefeed completion fish > ~/.config/fish/completions/splinefeed.fish
"""


@click.command(epilog=EXAMPLES)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@answers(lambda page: click.echo(page["script"]))
def command(say: Say, shell: str) -> Page:
    """Print the lines that make SHELL complete the commands and options of splinefeed."""
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None  # the choices above are those that click knows
    return {"shell": shell, "script": found(click.Group(), {}, "splinefeed", "_SPLINEFEED_COMPLETE").source()}
