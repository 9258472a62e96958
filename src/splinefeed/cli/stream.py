"""`splinefeed stream`: setpoints to a running controller; override, hold, reverse and stop keep the limits."""

from __future__ import annotations

import json
import os
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from splinefeed.cli import options
from splinefeed.cli.failures import DONE
from splinefeed.cli.output import print_json
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import busy
from splinefeed.cli.setpoints_file import read_setpoints
from splinefeed.cli.source import read_path
from splinefeed.cli.stream_orders import ended_by_signals, keys, signals
from splinefeed.errors import InputError, SplinefeedError

if TYPE_CHECKING:
    from splinefeed.live.motion import Motion
    from splinefeed.live.operator import Operator
    from splinefeed.live.sink import Sink
    from splinefeed.live.stream import Resume, State
    from splinefeed.records import Array, Limits

#: s of what HAL samples that are kept behind the last row.
SETTLE = 0.1

EXAMPLES = """\b
Examples:
  splinefeed stream butterfly --feed 60 --axis-accel 500 --axis-jerk 20000 --to linuxcnc --approach --record run.h5
  splinefeed stream part.dxf --machine router --to file -o rows.txt
  splinefeed stream setpoints.h5 --machine router --to udp --port 5010 --override 50%

Keys during the stream: + and - change the feedrate override by 10 %, h or space is feed hold, b retraces, r resumes,
s stops. The same by JSON lines on the local port that it prints, with the token: {"token": "...", "override": 80},
"hold": true, "reverse": true, "stop": true.

"""


@click.command(cls=PanelCommand, epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("source")
@click.option(
    "--to", type=click.Choice(["file", "stdout", "udp", "linuxcnc"]), required=True, help="Where the rows go."
)
@click.option("-o", "--output", metavar="FILE", help="The file of --to file.")
@click.option("--host", default="127.0.0.1", show_default=True, help="Address for --to udp.")
@click.option("--port", type=int, default=5010, show_default=True, help="Port for --to udp.")
@options.quantity("--ahead", kind="time", text="Lookahead kept in the controller's buffer.  [default: 300 ms]")
@click.option(
    "--override", default="100%", show_default=True, metavar="PERCENT", help="Feedrate override at the start."
)
@click.option(
    "--most",
    default="200%",
    show_default=True,
    metavar="PERCENT",
    help="Highest override. 100 % is --feed, or the program's feeds; axis limits hold at every override.",
)
@click.option(
    "--top",
    type=float,
    default=1.0,
    show_default=True,
    help="Plan with a reserve, so that 1.2 = 120 % is possible everywhere.",
)
@click.option("--approach", is_flag=True, help="First move the axes straight to the start of the path.")
@click.option("--here", is_flag=True, help="Shift the path to begin where the axes are.")
@click.option("--record", "record_file", metavar="FILE.h5", help="--to linuxcnc: keep what HAL measured, a Response.")
@click.option("--state", "state_file", metavar="FILE", help="Keep the last confirmed row in this file.")
@click.option("--resume", is_flag=True, help="Continue from the row in --state FILE, and where the axes are.")
@click.option("--columns", type=options.Names(), metavar="NAMES", help="SOURCE is CSV: its columns, as t,x,y.")
@options.limits
@options.machine
@options.reading
@options.as_json
@click.pass_context
def command(ctx: click.Context, /, source: str, as_json: bool, **given: Any) -> None:
    """Plan SOURCE with a reserve and stream it to a controller, one row a servo period.

    SOURCE may also be a file of setpoints (.h5, .csv, ...): its rows are sent as they are; their motion must leave a
    reserve for feed hold within the axis limits. Ctrl-C stops on the path within the limits; a second one ends at
    once.
    """
    from splinefeed.formats.setpoints import save
    from splinefeed.live.recording import response_of

    operator = _operator(given)
    with ended_by_signals(), busy() as say:
        made = _made(source, given, say)
    motion, sink = made.motion, made.sink
    state = _streamed(made, operator, given)
    files = [given["output"]] if given["to"] == "file" else []
    if given["record_file"]:
        settings = {"source": source, "underruns": state.underruns, "rows": state.row, "done": state.done}
        response = response_of(sink.samples, motion.axes, motion.period, settings)
        save(response, given["record_file"])
        files.append(given["record_file"])
    page = {
        "ok": state.done or operator.stopping,
        "done": state.done,
        "rows": state.row,
        "confirmed": state.confirmed,
        "underruns": state.underruns,
        "tau_s": state.tau,
        "planned_s": motion.duration,
        "top": motion.override.top,
        "period_s": motion.period,
        "files": files,
    }
    if as_json:
        print_json(page)
    else:
        end = "to the end of the path" if state.done else f"stopped at {state.tau:.3f} s of {motion.duration:.3f} s"
        print(f"{state.row} rows, {end}; {state.underruns} underruns", file=sys.stderr)
    ctx.exit(DONE)


@dataclass(frozen=True)
class _Made:
    """All that a stream needs, checked before anything moves."""

    motion: Motion
    sink: Any
    resume: Resume | None
    limits: Limits


def _percent(given: dict[str, Any], name: str) -> float:
    """An option in percent as a share."""
    try:
        return float(given[name].removesuffix("%")) / 100.0
    except ValueError:
        raise InputError(f"--{name}: {given[name]!r} is not a percentage; write for example 80%") from None


def _operator(given: dict[str, Any]) -> Operator:
    from splinefeed.live.operator import Operator

    operator = Operator()
    operator.set_rate(_percent(given, "override"))
    return operator


def _made(source: str, given: dict[str, Any], say: Any) -> _Made:
    from splinefeed.live.operator import MOST

    if given["to"] == "file" and not given["output"]:
        raise InputError("--to file needs -o FILE")
    if given["resume"] and not given["state_file"]:
        raise InputError("--resume needs --state FILE, in which the last stream kept its last confirmed row")
    if given["record_file"] and given["to"] != "linuxcnc":
        raise InputError(f"--record: nothing is measured by --to {given['to']}; it needs --to linuxcnc")
    if given["here"] and given["approach"]:
        raise InputError("--here moves the path to the axes, --approach the axes to the path: give one of them")
    most = _percent(given, "most")
    if not 0.0 < most <= MOST:
        raise InputError(f"--most: {given['most']} must be above 0 and at most {100.0 * MOST:g} %")
    say(f"reading {source}")
    motion, limits = (_through if _is_setpoints(source) else _along)(source, given, most, say)
    resume = None
    if given["resume"]:
        resume = _resumed(given["state_file"], motion)
        motion.begin_at(resume.confirmed)
    return _Made(motion, _sink(given, motion.period), resume, limits)


def _is_setpoints(source: str) -> bool:
    from splinefeed.formats.setpoints import FORMATS

    suffix = os.path.splitext(source)[1].lower()
    return os.path.isfile(source) and any(suffix in each.suffixes for each in FORMATS.values() if each.loads)


def _along(source: str, given: dict[str, Any], most: float, say: Any) -> tuple[Motion, Limits]:
    """The motion along a path, and the limits that hold for it."""
    from dataclasses import replace

    from splinefeed.feed.planning import plan
    from splinefeed.feed.reserve import with_reserve
    from splinefeed.geometry.tool_path import ToolPath
    from splinefeed.live.motion import along
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.run import on_machine, planned_axes

    machine = Machine.load(given["machine"]) if given["machine"] else None
    path = read_path(source, options.reading_from(given))
    tool = isinstance(path, ToolPath)
    limits, period, strategy = options.limits_from(given, machine, planned_axes(path, machine))
    limits, _ = options.as_programmed(limits, path, given)
    moved = on_machine(path, machine if tool else None, limits)
    say("planning")
    law = plan(moved, with_reserve(limits, given["top"]), strategy=strategy, period=period)
    # the feed is what is programmed: 100 %; what is a limit is that of the axes
    return along(moved, law, replace(limits, feed=max(most, 1.0) * limits.feed), highest=most), limits


def _through(source: str, given: dict[str, Any], most: float, say: Any) -> tuple[Motion, Limits]:
    """The motion through setpoints as they are, and the limits that hold for it."""
    from dataclasses import replace

    import numpy as np

    from splinefeed.live.motion import through
    from splinefeed.machine.machine import Machine
    from splinefeed.records import ROTARY_AXES

    rows, _ = read_setpoints(source, given)
    machine = Machine.load(given["machine"]) if given["machine"] else None
    limits, _, _ = options.limits_from({**given, "period": None}, machine, rows.axes)
    if given["feed"] is None and given["limits_file"] is None:  # nobody said one: that of the rows is 100 %
        linear = rows.position[:, [axis not in ROTARY_AXES for axis in rows.axes]]
        feed = float(np.max(np.linalg.norm(np.diff(linear, axis=0), axis=1), initial=0.0)) / rows.period
        limits = replace(limits, feed=max(feed, 1.0))
    say("measuring the rows")
    return through(rows, replace(limits, feed=1.01 * max(most, 1.0) * limits.feed), highest=most), limits


def _ahead(given: dict[str, Any], period: float) -> int:
    return max(round((0.3 if given["ahead"] is None else given["ahead"]) / period), 24)


def _sink(given: dict[str, Any], period: float) -> Sink:
    ahead = _ahead(given, period)
    if given["to"] == "linuxcnc":
        from splinefeed.live.linuxcnc_sink import LinuxcncSink

        return LinuxcncSink(ahead, record=bool(given["record_file"]), settle=SETTLE)
    if given["to"] == "udp":
        from splinefeed.live.udp_sink import UdpSink

        return UdpSink(given["host"], given["port"], ahead=ahead)
    from splinefeed.live.text_sink import FileSink, TextSink

    return FileSink(given["output"]) if given["to"] == "file" else TextSink(sys.stdout)


def _streamed(made: _Made, operator: Operator, given: dict[str, Any]) -> State:
    from splinefeed.live.control import Control
    from splinefeed.live.motion import approach
    from splinefeed.live.stream import play

    motion, sink = made.motion, made.sink
    warned: list[str] = []
    if given["state_file"] and not given["resume"]:
        _save(given["state_file"], None, motion)  # a file that cannot be written is an error before anything moves

    def saved(state: State) -> None:
        if not given["state_file"]:
            return
        try:
            _save(given["state_file"], state, motion)
        except SplinefeedError as error:  # no reason to stop axes that move
            if not warned:
                print(f"splinefeed: {error}; --resume cannot continue from it", file=sys.stderr, flush=True)
            warned.append(str(error))

    def seen(state: State) -> None:
        control.status = {
            "row": state.row,
            "depth": state.depth,
            "confirmed": state.confirmed,
            "tau_s": state.tau,
            "rate": state.rate,
            "underruns": state.underruns,
        }

    def to_start(at: Array, start: Array) -> Motion:
        return approach(at, start, motion.axes, made.limits, motion.period)

    with Control(operator) as control, signals(operator), keys(operator):
        if sink.paced:
            print(f"commands: 127.0.0.1:{control.port} token {control.token}", file=sys.stderr, flush=True)
        return play(
            motion,
            sink,
            operator,
            _ahead(given, motion.period),
            here=given["here"],
            resume=made.resume,
            approach=to_start if given["approach"] else None,
            saved=saved,
            seen=seen,
        )


def _save(file: str, state: State | None, motion: Motion) -> None:
    """Write down where the stream is; None: it has not begun."""
    from splinefeed.formats.atomic import atomic_write

    page = {
        "row": state.confirmed if state else 0,
        "tau_s": state.confirmed_tau if state else 0.0,
        "sent_tau_s": state.tau if state else 0.0,
        "done": state is not None and state.done,
        "axes": list(motion.axes),
        "planned_s": motion.duration,
        "start": motion.origin.tolist(),
    }
    with atomic_write(file) as temporary:
        temporary.write_text(json.dumps(page) + "\n", encoding="ascii")


def _resumed(file: str, motion: Motion) -> Resume:
    """Where that stream was; InputError for a state of another motion, or of one that is done."""
    from splinefeed.live.stream import Resume

    try:
        with open(file, encoding="utf-8") as stream:
            page = json.loads(stream.read(4096))
        tau, sent = float(page["tau_s"]), float(page["sent_tau_s"])
        same = (page["axes"], page["planned_s"], page["start"]) == (
            list(motion.axes),
            motion.duration,
            motion.origin.tolist(),
        )
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{file}: is not the state of a stream") from None
    if not same:
        raise InputError(f"{file}: is the state of another motion; give the same source and limits")
    if page.get("done") or not 0.0 <= tau < motion.duration:
        raise InputError(f"{file}: that stream has reached its end; leave out --resume")
    return Resume(tau, sent)
