"""`splinefeed completion`: what a shell must read to complete commands and options by Tab."""

from __future__ import annotations

import click

from splinefeed.cli import options, output

EXAMPLES = """\b
Examples:
  splinefeed completion bash >> ~/.bashrc
  splinefeed completion zsh >> ~/.zshrc
  splinefeed completion fish > ~/.config/fish/completions/splinefeed.fish
"""

#: Under this name the shell asks the command for what could come next.
VARIABLE = "_SPLINEFEED_COMPLETE"


@click.command(epilog=EXAMPLES)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@options.as_json
@click.pass_context
def command(ctx: click.Context, shell: str, as_json: bool) -> None:
    """Print the lines that make SHELL complete the commands and options of splinefeed."""
    from click.shell_completion import get_completion_class

    found = get_completion_class(shell)
    assert found is not None  # the choices above are those that click knows
    root = ctx.find_root()
    complete = found(root.command, {}, "splinefeed", VARIABLE)
    script = complete.source_template % complete.source_vars()
    if as_json:
        output.print_json({"shell": shell, "script": script})
        return
    click.echo(script)
