"""The command `splinefeed`: finds the commands, and turns everything that goes wrong into one line."""

from __future__ import annotations

import io
import os
import signal
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any, NoReturn

import click
from click.shell_completion import shell_complete

from splinefeed import __version__
from splinefeed.cli.failures import guarded, on_signal, on_unraisable
from splinefeed.errors import nearest

#: Every command in the order of the help, with its one line there: the file of a command is imported when it is used.
COMMANDS = {
    "run": "Read, plan, interpolate and measure; write setpoints and figures.",
    "plan": "Plan only the time law: arc length over time.",
    "compare": "Compare all interpolation methods on one motion.",
    "check": "Check setpoints against path and limits, independently of the planner.",
    "report": "Make the HTML report of a run again, from its folder.",
    "follow": "Simulate a machine's axes: following error and contour error.",
    "stream": "Stream to a running controller, with feedrate override and feed hold.",
    "linuxcnc": "Write the HAL file of a machine that LinuxCNC drives from a stream.",
    "pulses": "Convert setpoints to a motion card's pulse words, and back.",
    "time": "Cycle time of a program: per tool, where, and what would save most.",
    "calibrate": "Fit the cycle-time model of a machine to recorded runs.",
    "tune": "Tune gains by a rule or for a path; margins before and after.",
    "tune-feed": "Find the highest feed within a contour tolerance.",
    "studio": "Open the local web page: sliders, plots, playback, tuning, history.",
    "sweep": "Run a grid of settings into a dataset: on processes, Dask or MPI.",
    "info": "Show what a file or shape holds, and what its reader reports.",
    "convert": "Convert from any format to any other; report what is approximated or lost.",
    "machine": "List or describe machines; make one from LinuxCNC, grbl, Klipper or Marlin.",
    "methods": "List the interpolation methods.",
    "completion": "Print the lines that turn on shell completion by Tab.",
    "version": "Print the version; with --verbose, those of its dependencies.",
}
#: Under this name the shell asks the command for what could come next.
COMPLETE = "_SPLINEFEED_COMPLETE"
#: Files of commands that share one; each other command stands in a file of its name.
HOMES = {
    "machine": "about", "methods": "about", "completion": "about", "version": "about",
    "time": "cycle_time", "calibrate": "cycle_time", "compare": "plan", "tune-feed": "tune",
}  # fmt: skip


class LazyGroup(click.Group):
    """A group whose commands live in files of their own; `main` ends in an exit code, never in a traceback."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands in the order of the help."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command `cmd_name`; None if there is none."""
        if cmd_name not in COMMANDS:
            if ctx.resilient_parsing:  # while a shell completes the name
                return None
            raise click.UsageError(f"no such command {cmd_name!r}; {nearest(cmd_name, COMMANDS, 'there are {}')}")
        home = import_module(f"splinefeed.cli.{HOMES.get(cmd_name, cmd_name)}")
        command: click.Command = getattr(home, cmd_name.replace("-", "_"))
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))

    def main(  # type: ignore[override]
        self, args: Sequence[str] | None = None, prog_name: str | None = None, **extra: Any
    ) -> NoReturn:
        """Errors are one line on stderr, and exit codes are those of the design."""
        name = prog_name or "splinefeed"
        if complete := os.environ.get(COMPLETE):
            sys.exit(shell_complete(self, {}, name, COMPLETE, complete))

        def run() -> Any:
            with self.make_context(name, list(sys.argv[1:] if args is None else args), **extra) as ctx:
                return self.invoke(ctx)

        sys.exit(guarded(run))


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  splinefeed run                                the paper's airfoil, to ./splinefeed-.../
  splinefeed run part.json --feed 3600mm/min    a curve of yours
  splinefeed COMMAND --help                     options and examples of a command

Quantities may carry a unit (3600mm/min, 1ms, 0.5in); bare numbers are mm and s. Each command takes --json. Exit codes:
0 done, 1 a limit or a check does not hold, 2 bad input or usage.""",
)
@click.version_option(__version__, prog_name="splinefeed")
@click.pass_context
def command_line(ctx: click.Context) -> None:
    """Turn a NURBS curve and a machine's limits into the position of every axis at each servo tick."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main() -> NoReturn:
    """Run the command line and leave with its exit code."""
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # of NumPy's: what comes of it is checked, and said
    sys.stdout = sys.stdout or io.StringIO()  # None where the shell closed it: >&-
    sys.stderr = sys.stderr or io.StringIO()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a terminal that lacks a letter is no reason to stop
    if os.name == "posix":
        sys.unraisablehook = on_unraisable
        signal.signal(signal.SIGTERM, on_signal)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else a shell's background ignores it
            signal.signal(signal.SIGINT, on_signal)
    command_line.main()
