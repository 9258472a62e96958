"""`splinefeed stream`: setpoints to a running controller; override, hold, reverse and stop keep the limits."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import splinefeed as sf
from splinefeed import units
from splinefeed.cli import options
from splinefeed.cli.answers import answers
from splinefeed.cli.output import Page, Say
from splinefeed.cli.setpoints_file import read_setpoints
from splinefeed.cli.source import job_of
from splinefeed.errors import InputError, SplinefeedError
from splinefeed.files.source import in_brief, read_bytes
from splinefeed.live.operator import MOST, Operator, OperatorServer
from splinefeed.numbers import finite

if TYPE_CHECKING:
    from splinefeed.live.motion import Motion
    from splinefeed.live.sinks import Sink
    from splinefeed.live.stream import StreamState
    from splinefeed.records import Array

#: One sentence each.
Notes = list[str]

KEYS = """\
Keys during the stream: + and - change the feedrate override by 10 %, h or space is feed hold, b retraces, r resumes,
s stops. The same by JSON lines on the local port that it prints, with the token: {"token": "...", "override": 80},
"hold": true, "reverse": true, "stop": true.

"""
#: Most that the state of a stream takes in its file, bytes.
MOST_STATE = 4096
#: s of what HAL samples that are kept behind the last row.
SETTLE = 0.1
#: Steps of the keys + and -, %.
KEY_STEP = 10.0
#: What other keys order.
_ORDERS = {
    "h": {"hold": True},
    " ": {"hold": True},
    "b": {"reverse": True},
    "r": {"hold": False, "reverse": False},
    "s": {"stop": True},
}


@answers(lambda page: [], f"{KEYS}{options.UNITS_NOTE}")
@options.table("""
source          SOURCE
--to            file|stdout|udp|linuxcnc!  Where the rows go.
-o --output     FILE             The file of --to file.
--host          ADDRESS =127.0.0.1  Address for --to udp.
--port          INTEGER =5010    Port for --to udp.
--ahead         TIME =300 ms     Lookahead kept in the controller's buffer.
--override      PERCENT =100%    Feedrate override at the start.
--most          PERCENT =200%    Highest override. 100 % is --feed, or the program's feeds; axis limits hold at every
                                 override.
--top           NUMBER =1.0      Plan with a reserve, so that 1.2 = 120 % is possible everywhere.
--approach      -                First move the axes straight to the start of the path.
--here          -                Shift the path to begin where the axes are.
--record record_file  FILE.h5    --to linuxcnc: keep what HAL measured, a Response.
--state state_file  FILE         Keep the last confirmed row in this file.
--resume        -                Continue from the row in --state FILE, and where the axes are.
--at            AXIS=PLACE,...   Where the axes are, for --resume where nothing tells it: x=12.5,y=3.
--columns       NAMES            SOURCE is CSV: its columns, as t,x,y.
""")
@options.limits
@options.machine
@options.linking
@options.reading
def stream(say: Say, source: str, **given: Any) -> Page:
    """Plan SOURCE with a reserve and stream it to a controller, one row a servo period.

    SOURCE may also be a file of setpoints (.h5, .csv, ...): its rows are sent as they are; their motion must leave a
    reserve for feed hold within the axis limits. Ctrl-C stops on the path within the limits; a second one ends at
    once.

    Examples:
      splinefeed stream butterfly --feed 60 --axis-accel 500 --axis-jerk 20000 --to linuxcnc --approach --record run.h5
      splinefeed stream part.dxf --machine router --to file -o rows.txt
      splinefeed stream setpoints.h5 --machine router --to udp --port 5010 --override 50%
    """
    from splinefeed.live.motion import approach
    from splinefeed.live.stream import BLIND, play

    operator, file = Operator(), given["state_file"]
    operator.obey({"override": given["override"]})
    with on_signals(_end):
        _check(given)
        machine = sf.Machine.load(given["machine"]) if given["machine"] else None
        motion, limits, notes = (_through if _is_setpoints(source) else _along)(say, source, given, machine)
        saved = _saver(file, motion)
        known = _position(given["at"], motion) if given["at"] else None
        resume: tuple[float, float] | None = None
        if given["resume"]:
            resume, stood = _resumed(file, motion)
            if given["to"] != "linuxcnc" and known is None:
                if stood is None:
                    raise InputError(f"{file}: {BLIND}")
                known, resume = stood, None
        else:
            saved(None)  # a file that cannot be written is an error before anything moves
        to_start = partial(approach, axes=motion.axes, limits=limits, period=motion.period)
        ahead = max(round(given["ahead"] / motion.period), 24)
        sink = _sink(given, ahead)
    with OperatorServer(operator) as control, on_signals(partial(_stop, operator)), keys(operator):
        for note in notes:
            print(f"note: {note}", file=sys.stderr, flush=True)
        if sink.paced:
            print(f"commands: 127.0.0.1:{control.port} token {control.token}", file=sys.stderr, flush=True)
        say("")

        def seen(state: StreamState) -> None:
            shown = ("row", "depth", "confirmed", "rate", "underruns")
            control.status = {"tau_s": state.tau, **{name: getattr(state, name) for name in shown}}

        start = to_start if given["approach"] else None
        how = {"here": given["here"], "resume": resume, "known": known, "approach": start, "saved": saved, "seen": seen}
        state = play(motion, sink, operator, ahead, **how)
    files = [given["output"]] if given["to"] == "file" else []
    if given["record_file"]:
        settings = {"source": source, "underruns": state.underruns, "rows": state.row, "done": state.done}
        sf.save(sink.response(settings), given["record_file"])
        files.append(given["record_file"])
    end = "to the end of the path" if state.done else f"stopped at {state.tau:.3f} s of {motion.duration:.3f} s"
    print(f"{state.row} rows, {end}; {state.underruns} underruns", file=sys.stderr)
    return {
        "ok": state.done or operator.stopping,
        "done": state.done,
        "rows": state.row,
        "confirmed": state.confirmed,
        "underruns": state.underruns,
        "tau_s": state.tau,
        "planned_s": motion.duration,
        "top": motion.override.top,
        "period_s": motion.period,
        "notes": notes,
        "files": files,
    }


def _check(given: dict[str, Any]) -> None:
    """InputError for options that do not go together."""
    wrong = {
        "--to file: needs -o FILE": given["to"] == "file" and not given["output"],
        "--resume: needs --state FILE, which the last stream has written": given["resume"] and not given["state_file"],
        "--record: needs --to linuxcnc; nothing else measures": given["record_file"] and given["to"] != "linuxcnc",
        "--here, --approach: give one of them; the path moves, or the axes do": given["here"] and given["approach"],
        "--at: HAL tells where the axes are; leave it out": given["at"] and given["to"] == "linuxcnc",
        "--at: is for --resume; a stream begins where its path does": given["at"] and not given["resume"],
        "--most: must be above 0 and at most 200 %": not 0.0 < given["most"] <= 200.0,
    }
    for words in (words for words, found in wrong.items() if found):
        raise InputError(words)


def _is_setpoints(source: str) -> bool:
    from splinefeed.formats.setpoint_table import FORMATS

    suffix = os.path.splitext(source)[1].lower()
    return os.path.isfile(source) and any(suffix in each.suffixes for each in FORMATS.values())


def _along(say: Say, source: str, given: dict[str, Any], machine: sf.Machine | None) -> tuple[Motion, sf.Limits, Notes]:
    """The motion along a path, the limits that hold for it, and notes on them."""
    from splinefeed.live.motion import planned
    from splinefeed.runs.run import on_machine

    what, most = job_of(say, source, given, machine), given["most"] / 100.0
    path: Any = what.path
    moved = on_machine(path, machine if path.needs_machine else None, what.limits)
    say("planning")
    reserve = {"top": given["top"], "most": most}
    law, motion = planned(moved, what.limits, period=what.period, strategy=what.strategy, **reserve)
    return motion, what.limits, [*what.notes, *law.notes]


def _through(
    say: Say, source: str, given: dict[str, Any], machine: sf.Machine | None
) -> tuple[Motion, sf.Limits, Notes]:
    """The motion through setpoints as they are, the limits that hold for it, and notes on them."""
    import numpy as np

    from splinefeed.live.motion import through
    from splinefeed.records import ROTARY_AXES, axes_without_limits
    from splinefeed.runs.settings import completed

    say(f"reading {source}")
    (rows, _), most = read_setpoints(source, given), given["most"] / 100.0
    limits = completed(options.said_limits(given, {}), machine, rows.axes, assume=not given["limits_file"])
    if given["feed"] is None and given["limits_file"] is None:  # nobody said one: that of the rows is 100 %
        linear = rows.position[:, [axis not in ROTARY_AXES for axis in rows.axes]]
        feed = float(np.max(np.linalg.norm(np.diff(linear, axis=0), axis=1), initial=0.0)) / rows.period
        limits = replace(limits, feed=max(feed, 1.0))
    say("measuring the rows")
    allowed = replace(limits, feed=1.01 * max(most, 1.0) * limits.feed)
    notes = axes_without_limits(limits, rows.axes, rows.position.min(axis=0), rows.position.max(axis=0))
    return through(rows, allowed, highest=most), limits, notes


def _sink(given: dict[str, Any], ahead: int) -> Any:
    from splinefeed.live.linuxcnc_sink import LinuxcncSink
    from splinefeed.live.sinks import TextSink, UdpSink

    made: dict[str, Callable[[], Sink]] = {
        "linuxcnc": lambda: LinuxcncSink(ahead, record=bool(given["record_file"]), settle=SETTLE),
        "udp": lambda: UdpSink(given["host"], given["port"], ahead=ahead),
        "file": lambda: TextSink(given["output"]),
        "stdout": lambda: TextSink(sys.stdout),
    }
    return made[given["to"]]()


def _saver(file: str | None, motion: Motion) -> Callable[[StreamState | None], None]:
    """Writes down where the stream is, None: it has not begun; later errors are said once, and do not stop axes."""
    from splinefeed.files.atomic import write_text

    failed = False

    def saved(state: StreamState | None) -> None:
        nonlocal failed
        row, tau, sent, done = (
            (state.confirmed, state.confirmed_tau, state.tau, state.done) if state else (0, 0, 0, False)
        )
        page = {
            "row": row, "tau_s": tau, "sent_tau_s": sent, "done": done, "motion": _motion(motion),
            "rests_at": list(state.position) if state and state.rests else None,
        }  # fmt: skip
        try:
            if file:
                write_text(file, json.dumps(page) + "\n")
        except SplinefeedError as error:
            if state is None:
                raise
            if not failed:
                print(f"splinefeed: {error}; --resume cannot continue from it", file=sys.stderr, flush=True)
            failed = True

    return saved


def _motion(motion: Motion) -> list[Any]:
    """What tells one motion from another."""
    return [list(motion.axes), motion.duration, motion.origin.tolist()]


def _resumed(file: str, motion: Motion) -> tuple[tuple[float, float], Array | None]:
    """Let the motion begin where a stream ended.

    Parameters
    ----------
    file : str
        The state.
    motion : Motion
        What is streamed.

    Returns
    -------
    times : (float, float)
        Plan times of the last row confirmed and sent, s.
    rest : (axes,) array or None
        Where it rested.

    Raises
    ------
    InputError
        For what is no state, one of another motion, or one at its end.
    """
    import numpy as np

    try:
        page = json.loads(read_bytes(file, MOST_STATE))
        tau, sent = (finite(page[name], name) for name in ("tau_s", "sent_tau_s"))
        same, stood = page["motion"] == _motion(motion), page["rests_at"]
        stood = None if stood is None else np.array([finite(each, "rests_at") for each in stood])
        if stood is not None and len(stood) != len(motion.axes):
            raise InputError(f"rests_at has {len(stood)} numbers, the motion {len(motion.axes)} axes")
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise InputError(f"{file}: is not the state of a stream: {in_brief(error)}") from None
    if not same:
        raise InputError(f"{file}: is the state of another motion; give the same source and limits")
    if page.get("done") or not 0.0 <= tau < motion.duration:
        raise InputError(f"{file}: that stream has reached its end; leave out --resume")
    motion.begin_at(tau)
    return (tau, min(max(sent, 0.0), motion.duration)), stood


def _position(text: str, motion: Motion) -> Array:
    """Where the axes are, `x=12.5,theta=90`, as (axes,), mm and rad; InputError for another axis or one that is not."""
    import numpy as np

    from splinefeed.machine.limits_toml import by_axis, turning
    from splinefeed.records import ROTARY_AXES

    said = {axis: turning(place, 0) if axis in ROTARY_AXES else units.parse(place, "length")
            for axis, place in by_axis(text)}  # fmt: skip
    if set(said) != set(motion.axes):
        raise InputError(f"--at: {text[:60]!r} must give {', '.join(motion.axes)}, each once, such as x=12.5,y=3")
    return np.array([said[axis] for axis in motion.axes])


def _end(number: int) -> None:
    """End the program at once, also within a compiler, which would catch an exception."""
    os.write(2, b"splinefeed: interrupted before anything moved\n")
    os._exit(128 + number)


def _stop(operator: Operator, number: int) -> None:
    """Stop on the path."""
    operator.obey({"stop": True})
    print("stopping on the path; press again to end at once", file=sys.stderr, flush=True)


@contextlib.contextmanager
def on_signals(handle: Callable[[int], None]) -> Iterator[None]:
    """Within this the first SIGINT or SIGTERM is handled, the next one does what it always does; main thread alone."""
    numbers = (signal.SIGINT, signal.SIGTERM) if threading.current_thread() is threading.main_thread() else ()
    before = {number: signal.getsignal(number) for number in numbers}

    def once(number: int, frame: object) -> None:
        signal.signal(number, before[signal.Signals(number)])
        handle(number)

    try:
        for number in numbers:
            signal.signal(number, once)
        yield
    finally:
        for number, own in before.items():
            signal.signal(number, own)


@contextlib.contextmanager
def keys(operator: Operator) -> Iterator[None]:
    """Obey keys, where there is a keyboard."""
    if os.name != "posix" or not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    tty.setcbreak(number)
    threading.Thread(target=_obey, args=(operator, number), daemon=True).start()
    try:
        yield
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)


def _obey(operator: Operator, number: int) -> None:
    while key := os.read(number, 1).decode(errors="replace"):
        if key in "+-":
            turned = 100.0 * operator.rate + (KEY_STEP if key == "+" else -KEY_STEP)
            operator.obey({"override": min(max(turned, 0.0), 100.0 * MOST)})
        else:
            operator.obey(_ORDERS.get(key, {}))
