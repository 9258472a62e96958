"""`splinefeed studio`: the local web page to try limits, methods and machines by hand."""

from __future__ import annotations

import click

from splinefeed.cli import options
from splinefeed.cli.answers import documented
from splinefeed.cli.output import print_blocks, print_json
from splinefeed.errors import InputError


@documented()
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port on loopback.  [default: a free one]")
@click.option("--browser/--no-browser", default=True, help="Open the page in the browser.  [default: browser]")
@options.table("""
--history     FILE  Where the history is kept.  [default: a file in your data folder]
--no-history  -     Keep no history.
""")
@options.as_json
def studio(port: int, browser: bool, history: str | None, no_history: bool, as_json: bool) -> None:
    """Serve the studio on this computer alone, until Ctrl-C.

    The printed address carries a token: whoever has it, on this computer, can use the studio. Uploads are kept in a
    temporary folder that is removed at the end; the history is kept in a SQLite file.

    Examples:
      splinefeed studio
      splinefeed studio --port 8700 --no-browser
      splinefeed studio --history night.sqlite
    """
    import asyncio
    import sys
    from contextlib import suppress
    from importlib.util import find_spec
    from pathlib import Path

    import platformdirs

    if not (find_spec("plotly") and find_spec("tornado")):
        raise InputError("the studio needs Tornado and Plotly: pip install 'splinefeed[studio]'")
    own = platformdirs.user_data_path("splinefeed", appauthor=False) / "studio.sqlite"
    file = None if no_history else Path(history or own)

    def say(address: str) -> None:
        if as_json:
            print_json({"address": address, "history": None if file is None else str(file)})
        else:
            print_blocks([[f"the studio is at {address}", "Ctrl-C ends it"]])
        sys.stdout.flush()

    from splinefeed.studio.staff import Staff

    with suppress(KeyboardInterrupt), Staff() as staff:
        from splinefeed.studio import server  # while the first worker starts, too

        asyncio.run(server.serve(port, file, staff, browser=browser, say=say))
