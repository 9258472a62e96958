"""`splinefeed stream`: setpoints to a running controller, with an override, a hold and a stop that keep the limits."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli import options
from splinefeed.cli.failures import DONE

if TYPE_CHECKING:
    from splinefeed.live.sink import Sink
    from splinefeed.live.stream import Knob, State

#: Steps of the keys + and -.
KEY_STEP = 0.1

EXAMPLES = """\b
Examples:
  splinefeed stream butterfly --feed 60 --axis-accel 500 --axis-jerk 20000 --to linuxcnc --here
  splinefeed stream part.dxf --machine router --to file -o rows.txt
  splinefeed stream wing.dat --feed 20 --to udp --port 5010 --override 50%

Keys while it streams: + and - turn the override by 10 %, h or space holds, r goes on, s stops. The same by JSON lines
on the local port that it prints, with the token: {"token": "...", "override": 80}, "hold": true, "stop": true.

"""


@click.command(epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("source")
@click.option("--to", type=click.Choice(["file", "stdout", "udp", "linuxcnc"]), required=True, help="Where rows go.")
@click.option("-o", "--output", metavar="FILE", help="The file of --to file.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Where --to udp sends to.")
@click.option("--port", type=int, default=5010, show_default=True, help="Its port.")
@options.quantity("--ahead", kind="time", text="Look-ahead kept in the controller's buffer.  [default: 300 ms]")
@click.option("--override", default="100%", show_default=True, metavar="PERCENT", help="To begin with.")
@click.option(
    "--top", type=float, default=1.0, show_default=True, help="Highest override to leave room for: 1.2 = 120 %."
)
@click.option("--here", is_flag=True, help="Move the path so that it begins where the axes are.")
@click.option("--state", "state_file", metavar="FILE", help="Keep the last confirmed row in this file.")
@click.option("--resume", is_flag=True, help="Go on from the row that --state FILE says.")
@options.limits
@options.machine
@options.reading
@options.as_json
@click.pass_context
def command(ctx: click.Context, /, source: str, as_json: bool, **given: Any) -> None:
    """Plan SOURCE with a reserve and stream it, one row a servo period, to a controller.

    Ctrl-C comes to rest on the path within the limits, and ends; a second one ends at once.
    """
    from splinefeed.cli.output import print_json
    from splinefeed.cli.progress import busy

    with busy("stream") as say:
        motion, sink, knob = _made(source, given, say)
    state = _streamed(motion, sink, knob, given)
    page = {
        "ok": state.done or knob.stopping,
        "done": state.done,
        "rows": state.row,
        "confirmed": state.confirmed,
        "underruns": state.underruns,
        "tau_s": state.tau,
        "planned_s": motion.law.duration,
        "top": motion.override.top,
        "period_s": motion.period,
        "files": [given["output"]] if given["to"] == "file" else [],
    }
    if as_json:
        print_json(page)
    else:
        end = "to the end of the path" if state.done else f"stopped at {state.tau:.3f} s of {motion.law.duration:.3f} s"
        print(f"{state.row} rows, {end}; {state.underruns} underruns", file=sys.stderr)
    ctx.exit(DONE)


def _made(source: str, given: dict[str, Any], say: Any) -> tuple[Any, Sink, Knob]:
    """The motion, where it goes, and the knob, all checked before anything moves."""
    from splinefeed.cli.source import read_path
    from splinefeed.errors import InputError
    from splinefeed.feed.override import with_reserve
    from splinefeed.feed.planning import plan
    from splinefeed.live.motion import Motion
    from splinefeed.live.stream import Knob
    from splinefeed.machine.table import Table

    knob = Knob()
    try:
        knob.set_rate(float(given["override"].removesuffix("%")) / 100.0)
    except ValueError:
        raise InputError(f"--override: {given['override']!r} is no number of percent; write for example 80%") from None
    if given["to"] == "file" and not given["output"]:
        raise InputError("--to file needs -o FILE")
    if given["resume"] and not given["state_file"]:
        raise InputError("--resume needs --state FILE, in which the last stream kept its last confirmed row")
    machine = Table.load(given["machine"]) if given["machine"] else None
    say(f"reading {source}")
    path = read_path(source, options.reading_from(given))
    limits, period, strategy = options.limits_from(given, machine, path.axes)
    limits, _ = options.as_programmed(limits, path, given)
    say("planning")
    law = plan(path, with_reserve(limits, given["top"]), strategy=strategy, period=period)
    tau = _resumed(given["state_file"], path.length, law.duration) if given["resume"] else 0.0
    motion = Motion(path, law, limits, tau=tau, rate=knob.wanted)
    return motion, _sink(given, period), knob


def _ahead(given: dict[str, Any], period: float) -> int:
    return max(round((0.3 if given["ahead"] is None else given["ahead"]) / period), 24)


def _sink(given: dict[str, Any], period: float) -> Sink:
    if given["to"] == "linuxcnc":
        from splinefeed.live.linuxcnc_sink import LinuxcncSink

        return LinuxcncSink(_ahead(given, period))
    if given["to"] == "udp":
        from splinefeed.live.udp_sink import UdpSink

        return UdpSink(given["host"], given["port"])
    from splinefeed.live.text_sink import FileSink, TextSink

    return FileSink(given["output"]) if given["to"] == "file" else TextSink(sys.stdout)


def _streamed(motion: Any, sink: Sink, knob: Knob, given: dict[str, Any]) -> State:
    from splinefeed.live.control import Control
    from splinefeed.live.stream import play

    def saved(state: State) -> None:
        if given["state_file"]:
            _save(given["state_file"], state, motion)

    def seen(state: State) -> None:
        control.status = {"row": state.row, "depth": state.depth, "confirmed": state.confirmed, "rate": state.rate}

    with Control(knob) as control, _signals(knob), _keys(knob):
        if sink.paced:
            print(f"commands: 127.0.0.1:{control.port} token {control.token}", file=sys.stderr, flush=True)
        return play(motion, sink, knob, _ahead(given, motion.period), here=given["here"], saved=saved, seen=seen)


def _save(file: str, state: State, motion: Any) -> None:
    from splinefeed.formats.atomic import atomic_write

    page = {
        "row": state.confirmed,
        "tau_s": state.confirmed_tau,
        "done": state.done,
        "length_mm": motion.path.length,
        "planned_s": motion.law.duration,
    }
    with atomic_write(file) as temporary:
        temporary.write_text(json.dumps(page) + "\n", encoding="ascii")


def _resumed(file: str, length: float, duration: float) -> float:
    """Plan time of the last confirmed row; InputError for a state of another motion, or of one that is done."""
    from splinefeed.errors import InputError

    try:
        with open(file, encoding="utf-8") as stream:
            page = json.loads(stream.read(4096))
        tau, same = float(page["tau_s"]), (page["length_mm"], page["planned_s"]) == (length, duration)
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{file}: is no state of a stream") from None
    if not same:
        raise InputError(f"{file}: is the state of another motion; give the same source and limits")
    if page.get("done") or not 0.0 <= tau < duration:
        raise InputError(f"{file}: that stream has reached its end; leave out --resume")
    return tau


@contextlib.contextmanager
def _signals(knob: Knob) -> Iterator[None]:
    """The first SIGINT or SIGTERM stops on the path; the next one is what it always is."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def stop(number: int, frame: object) -> None:
        knob.stop()
        print("stopping on the path; once more to end at once", file=sys.stderr, flush=True)
        signal.signal(number, before[signal.Signals(number)])

    for number in before:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def _keys(knob: Knob) -> Iterator[None]:
    """Obey keys, where there is a keyboard."""
    if os.name != "posix" or not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    tty.setcbreak(number)
    threading.Thread(target=_obey, args=(knob, number), daemon=True).start()
    try:
        yield
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)


def _obey(knob: Knob, number: int) -> None:
    orders = {
        "+": lambda: knob.turn(KEY_STEP),
        "-": lambda: knob.turn(-KEY_STEP),
        "h": knob.hold,
        " ": knob.hold,
        "r": lambda: knob.hold(False),
        "s": knob.stop,
    }
    while key := os.read(number, 1):
        orders.get(key.decode(errors="replace"), lambda: None)()
