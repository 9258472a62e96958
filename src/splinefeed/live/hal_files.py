"""The .hal file of a machine whose axes follow a stream: streamer, a PID controller an axis, and a simulated drive."""

from __future__ import annotations

import math
from dataclasses import dataclass

from splinefeed.errors import InputError
from splinefeed.formats.setpoints_text import MAX_FIELDS, cfg

#: Rows of the FIFO; LinuxCNC delivers one less.
DEPTH = 4000
#: Samples that HAL keeps until they are read.
SAMPLES = 20000
#: What an axis gets by default: gain 1/s, largest velocity mm/s or deg/s, lag of its drive s.
GAIN, VELOCITY, LAG = 60.0, 100.0, 2e-3


@dataclass(frozen=True)
class HalAxis:
    """An axis in HAL; mm, or degrees for a rotary one.

    Parameters
    ----------
    name : str
        Of the axis.
    gain : float, optional
        Of the position loop, 1/s.
    velocity : float, optional
        What the command is limited to, mm/s or deg/s.
    following : float, optional
        The following error that stops the stream, mm or deg.
    """

    name: str
    gain: float = GAIN
    velocity: float = VELOCITY
    following: float = 1.0


def sampler_cfg(count: int) -> str:
    """What is sampled at every servo tick: row, rows in the FIFO, commands, positions, underruns."""
    return "us" + "f" * (2 * count) + "s"


#: The same beside LinuxCNC's motion controller, whose file brings thread, kinematics and joints.
MOTION = """\
loadrt [KINS](KINEMATICS)
loadrt [EMCMOT](EMCMOT) servo_period_nsec=[EMCMOT](SERVO_PERIOD) num_joints=[KINS](JOINTS)
addf motion-command-handler servo-thread
addf motion-controller servo-thread
net spf-emc iocontrol.0.user-enable-out iocontrol.0.emc-enable-in
net spf-prepare iocontrol.0.tool-prepare iocontrol.0.tool-prepared
net spf-change iocontrol.0.tool-change iocontrol.0.tool-changed"""

#: What each axis has, in the order in which the thread runs it; a drive and an axis are simulated: take these out where
#: there are real ones.
PARTS = {"pid": "pid", "limit": "limit1", "drive": "lowpass", "axis": "integ", "follows": "near"}
LOGIC = {"xor2": "more", "conv_s32_float": "missed", "comp": "dry", "not": "full,off", "or2": "kept"}
NETS = """\

net spf-row streamer.0.pin.0 sampler.0.pin.0
net spf-last streamer.0.pin.{last} more.in0
net spf-depth streamer.0.curr-depth sampler.0.pin.1
net spf-underruns streamer.0.underruns missed.in sampler.0.pin.{underruns}
# a row was missing: more underruns than allowed
net spf-missed missed.out dry.in1
net spf-allowed dry.in0
net spf-dry dry.out full.in
net spf-full full.out go-{first}.in0
# every axis follows and no row was missing, now and since the run began
net spf-kept kept.out ok.in0
net spf-off off.out kept.in1
net spf-ok ok.out kept.in0 goes.in1
# run, and not the last row, and ok
net spf-run off.in go.in0
net spf-end more.in1
net spf-more more.out goes.in0
net spf-goes goes.out go.in1
net spf-enable go.out streamer.0.enable
sets spf-allowed 0.5
sets spf-end 1"""
AXIS = """\

net spf-command-{k} streamer.0.pin.{next} pid-{name}.command follows-{name}.in1 sampler.0.pin.{command}
net spf-output-{k} pid-{name}.output limit-{name}.in
# the drive of {name} (drive-{name}, axis-{name}) is simulated: take these two out where there is a real one, which
# takes its velocity from spf-velocity-{k} and gives its position to spf-position-{k}
net spf-velocity-{k} limit-{name}.out drive-{name}.in
net spf-moving-{k} drive-{name}.out axis-{name}.in
net spf-position-{k} axis-{name}.out pid-{name}.feedback follows-{name}.in2 sampler.0.pin.{position}
net spf-follows-{k} follows-{name}.out go-{name}.in1
net spf-go-{next} go-{name}.out {following}
setp pid-{name}.Pgain {gain:.17g}
setp pid-{name}.FF1 1
setp pid-{name}.enable 1
setp limit-{name}.min -{velocity:.17g}
setp limit-{name}.max {velocity:.17g}
setp drive-{name}.gain {lag:.17g}
setp follows-{name}.scale 1
setp follows-{name}.difference {most:.17g}"""


def hal_text(axes: tuple[HalAxis, ...], period: float, depth: int = DEPTH, *, motion: bool = False) -> str:
    """Write the file for `halcmd -f`: everything simulated, with the place marked where the real drives go.

    Parameters
    ----------
    axes : tuple of HalAxis
        That follow the stream.
    period : float
        Of the servo, s.
    depth : int, optional
        Rows of the FIFO.
    motion : bool, optional
        Whether it is a HALFILE of LinuxCNC, whose motion controller has the places of the joints as its feedback: homed
        and switched off, it commands nothing, and its kinematics show the tool tip.

    Returns
    -------
    str
        The text of the file.

    Raises
    ------
    InputError
        For more axes than a streamer or a sampler has fields for.

    Notes
    -----
    The stream runs while `spf-run` is set, until the last row has come, a following error is too large, or a row is
    missing: then it stays off until `spf-run` is set again. `spf-end` is what the last field of the last row is, 0 or
    1, and `spf-allowed` what the count of underruns may not exceed.
    """
    names = [axis.name for axis in axes]
    if len(cfg(tuple(names))) > MAX_FIELDS or len(sampler_cfg(len(axes))) > MAX_FIELDS:
        raise InputError(f"{len(axes)} axes; HAL's streamer and sampler have {MAX_FIELDS} fields, enough for 9")
    thread = "servo-thread" if motion else "servo"

    def each(prefix: str) -> str:
        return ",".join(f"{prefix}-{name}" for name in names)

    count, runs = len(axes), [f"go-{name}" for name in names]
    out = [
        f"# Axes {', '.join(names)} that follow setpoints of splinefeed, one row every {period:.17g} s.",
        MOTION if motion else f"loadrt threads name1={thread} period1={round(period * 1e9)}",
        f"loadrt streamer depth={depth} cfg={cfg(tuple(names))}",
        f"loadrt sampler depth={SAMPLES} cfg={sampler_cfg(count)}",
        *(f"loadrt {kind} names={each(part)}" for part, kind in PARTS.items()),
        *(f"loadrt {kind} names={names}" for kind, names in LOGIC.items()),
        f"loadrt and2 names={','.join(['go', 'ok', 'goes', *runs])}",
        "",
        f"addf streamer.0 {thread}",
    ]
    for name in names:
        out += [f"addf {part}-{name}{'.do-pid-calcs' * (part == 'pid')} {thread}" for part in PARTS]
    order = ["sampler.0", "more", "missed", "dry", "full", "off", *runs, "kept", "ok", "goes", "go"]
    out += [f"addf {name} {thread}" for name in order]
    out.append(NETS.format(last=count + 1, underruns=2 * count + 2, first=names[0]))
    for k, (name, axis) in enumerate(zip(names, axes, strict=True)):
        following = f"go-{names[k + 1]}.in0" if k + 1 < count else "ok.in1"
        words = {"name": name, "k": k, "next": k + 1, "command": k + 2, "position": k + 2 + count, "gain": axis.gain}
        lag = 1.0 - math.exp(-period / LAG)
        out.append(AXIS.format(**words, velocity=axis.velocity, lag=lag, following=following, most=axis.following))
        if motion:
            out.append(f"net spf-position-{k} joint.{k}.motor-pos-fb")
    out += ["setp sampler.0.enable 1", ""]
    return "\n".join(out)
