"""`splinefeed tune` and `tune-feed`: gains of a machine's axes, and the feed at which it keeps a contour tolerance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import splinefeed as sf
from splinefeed import units
from splinefeed.cli import options
from splinefeed.cli.answers import answers, recorded
from splinefeed.cli.output import Block, Page, Say, length, listed, notes, number
from splinefeed.cli.source import job_of
from splinefeed.errors import InputError
from splinefeed.simulation.linear import Bound
from splinefeed.simulation.shaping import REQUIRED
from splinefeed.simulation.tuning import MARGINS

#: Options that not every rule has: those of single axes, and those whose loops keep margins that are required; and
#: those of every rule. All others are for `path`.
_BY_RULE, _REQUIRED = ("kind",), ("phase_margin", "gain_margin")
_ALWAYS = ("axes", "rule", "period", "machine_file", "figures", "no_figures", "output")
#: An integral below this share of the old one is said; the rule that sees friction.
LESS_STIFF, PATH = 0.5, "path"
#: Margins of a stable loop: how they are called, what they are multiplied by to be shown, and then their unit.
_MARGINS = {"gain_margin_db": ("gain may rise by", 1.0, "dB"), "gain_fall_db": ("fall by", 1.0, "dB"),
            "phase_margin": ("phase margin", 1.0, "deg"), "delay_margin": ("delay margin", 1e3, "ms"),
            "bandwidth": ("bandwidth", 1.0, "Hz")}  # fmt: skip


def _show(page: Page) -> list[Block]:
    period, gains = units.format_quantity(page["period_s"], "time"), []
    head = [f"{page['machine']}: {page['rule']}, servo period {period}"]
    if "bound" in page:
        before = page["contour_error_max_before_mm"]
        old = "an axis ran away" if before is None else length(before)
        new = f"{length(page['contour_error_max_mm'])} with the new gains, with the old ones {old}"
        head += [f"largest contour error on {page['path_name']}: {new}; {page['runs']} runs"]
        head += [f"bound     {page['bound']}"]
    for name, each in page["axes"].items():
        if "ultimate_gain" in each:
            point = f"ultimate gain {number(each['ultimate_gain'])} {each['unit']}"
            head.append(f"axis {name}: {point}, ultimate period {number(1e3 * each['ultimate_period_s'])} ms")
        for when, ending in (("old", "_before"), ("new", "")):
            margins, said = each[f"margins{ending}"], each[f"gains{ending}"]
            hunts = margins["stable"] and each[f"hunts{ending}"]
            units_of = each[f"gain_units{ending}"]
            values = ", ".join(f"{gain} {number(value)} {units_of[gain]}" for gain, value in said.items() if value)
            gains += [
                f"{name}, {when} gains: {margins['verdict']}{'; hunts at rest: friction against ki; lower ki' * hunts}",
                f"    {values}",
                f"    {_margins(margins)}" if margins["stable"] else "",
                f"    {_moves(each, ending)}",
            ]
    return [head, [*filter(None, gains), *notes(page["notes"])]]


def _bound(given: Mapping[str, Any]) -> Bound:
    """The margins that are required."""
    phase, decibels = given["phase_margin"], given["gain_margin"]
    return Bound(
        gain_margin=REQUIRED.gain_margin if decibels is None else 10.0 ** (decibels / 20.0),
        phase_margin=REQUIRED.phase_margin if phase is None else phase,
        sensitivity=REQUIRED.sensitivity,
    )


def _short_of(axes: Mapping[str, Any], rule: str, bound: Bound) -> list[str]:
    """What a rule that asks for no margins does not keep of the usual ones."""
    short = [name for name, each in axes.items() if float(min(bound.slacks(each.margins))) < 0.0]
    words = f"axis {', '.join(short)}: gains of rule {rule} do not keep {bound.words}; rule {MARGINS} does"
    return [words] if short else []


def _softer(axes: Mapping[str, Any]) -> list[str]:
    """Axes whose new gains push less against friction: where the motion turns back they follow worse."""
    found = []
    for name, each in axes.items():
        old, new = (
            gains.get("ki", gains.get("velocity_ki", 0.0) * gains.get("position_gain", 0.0))
            for gains in (each.old.controller.gains, each.axis.controller.gains)
        )
        if 0.0 < new < LESS_STIFF * old:
            found.append(f"{name} ({new / old:.0%})")
    words = (
        f"the integral of axis {', '.join(found)} is less than that of the old gains: after reversals friction shows "
        f"longer; compare both on a path with follow, or tune with --rule {PATH}"
    )
    return [words] if found else []


def _slower_drives(axes: Mapping[str, Any]) -> list[str]:
    """Axes whose loop is faster than the speed loop of their drive, which the loop does not know."""
    found = []
    for name, each in axes.items():
        own = each.axis.drive.bandwidth
        if each.axis.drive.mode == "velocity" and own and own / math.tau < each.margins.bandwidth < math.inf:
            found.append(f"{name} ({own / math.tau:.3g} Hz, loop {each.margins.bandwidth:.3g} Hz)")
    words = (
        f"drive.bandwidth of axis {', '.join(found)} is below that of the position loop: margins and Bode take the "
        "drive as gain and lag, and its bandwidth as what rejects friction alone (docs/machines.md); see that its lag "
        "is true"
    )
    return [words] if found else []


def _moves(each: Mapping[str, Any], ending: str) -> str:
    """What the full axis does with these gains: on the standard move, and after a step."""
    error, over = each[f"following_error{ending}"], each[f"overshoot{ending}"]
    rotary = each["rest_swing_unit"] == "rad"
    swing = each[f"rest_swing{ending}"]

    def shown(value: float | None) -> str:
        return "runs away" if value is None else f"{math.degrees(value):.3g} deg" if rotary else length(value)

    return (
        f"following error {shown(error)} on a standard move, which does not turn back; step overshoot "
        f"{'-' if over is None else f'{over:.0%}'}; swing at rest {shown(swing)}"
    )


def _margins(margins: Mapping[str, Any]) -> str:
    """The margins of a stable loop, as far as it has them."""
    return ", ".join(
        f"{called} {number(factor * margins[name], 3)} {unit}"
        for name, (called, factor, unit) in _MARGINS.items()
        if margins["stable"] and margins[name] is not None
    )


@answers(_show)
@options.table("""
machine         MACHINE
--axis axes     NAMES            Only these axes.  [default: all]
--rule          NAME =margins    margins: of the loops that keep the margins the one that follows a standard move best;
                                 ziegler-nichols or tyreus-luyben, from the ultimate point; or path: small contour error
                                 on a path.
--phase-margin  DEGREES          Rules margins and path: least phase margin.  [default: 45]
--gain-margin   NUMBER           Rules margins and path: least gain margin, dB.  [default: 6]
--kind          NAME             Controller of a rule: p, pi, pid; of margins also p-pi.  [default: of margins as it is,
                                 else pid]
--path source   FILE|SHAPE       Rule path: the path.  [default: the paper's airfoil]
--which         NAME|NUMBER      Which path of a file that holds several (from 1).
--chord         LENGTH           Airfoil .dat: one unit of the file.
--tolerance     LENGTH           As for run.
--feed-forward  -                Rule path: feed-forward of speed and acceleration too.
--runs          INTEGER          Rule path: runs of the path at most.  [default: 300]
--seed          INTEGER          Rule path: seed of the random draws.  [default: 0]
--write machine_file  FILE       Write the machine with the new gains, TOML.
-o --output     DIR              Draw Bode and step figures to this folder.  [default: none]
""")
@options.limits
@options.figures
def tune(say: Say, machine: str, **given: Any) -> Page:
    """Find gains for the axes of MACHINE; report gain, phase and delay margins of the new and old ones.

    MACHINE is the name of a machine (splinefeed machine list shows them) or a machine file. Limits such as --feed set
    the motion of rule path. The exit code is 1 if an axis is unstable with its new gains.

    Examples:
      splinefeed tune xytheta
      splinefeed tune xytheta --axis x --rule tyreus-luyben -o x-tuned
      splinefeed tune my-table.toml --rule path --path wing.dat --feed 20 --write my-table-tuned.toml
    """
    from splinefeed.files.plain import plain
    from splinefeed.machine.limits_toml import letter
    from splinefeed.reports import files
    from splinefeed.reports.folder import staged
    from splinefeed.runs import tuning
    from splinefeed.runs.settings import PAPER_PERIOD

    drawing = options.figure_formats(given)
    model = sf.Machine.load(machine)
    names = tuple(map(letter, given["axes"] or model.axes))
    for name in names:
        if name not in model.axes:
            raise InputError(f"--axis: {model.name} has no axis {name!r}; its axes are {', '.join(model.axes)}")
    rule = given["rule"]
    for name, value in given.items():
        margined = name in _REQUIRED and rule in (MARGINS, tuning.PATH_RULE)
        own = name in _BY_RULE if rule == tuning.PATH_RULE else name not in (*_ALWAYS, *_BY_RULE)
        if value not in (None, False, ()) and own and not margined:
            spelled = "path" if name == "source" else name.replace("_", "-")
            raise InputError(f"--{spelled}: has no effect with --rule {rule}; leave it out")
    bound = _bound(given)
    source: dict[str, str] = {}
    found: Any  # a PathTuning or a TunedMachine
    if rule == tuning.PATH_RULE:
        what = job_of(say, given["source"], given)
        source = {"path": what.source}
        say("making the motion")
        along: Any = what.path
        setpoints = sf.run(along, what.limits, period=what.period, strategy=what.strategy).points
        found = tuning.tune_on_path(
            model,
            setpoints,
            along,
            axes=given["axes"],
            bound=bound,
            evaluations=tuning.EVALUATIONS if given["runs"] is None else given["runs"],
            seed=given["seed"] or 0,
            feed_forward=given["feed_forward"],
            on_progress=lambda done, total: say(f"tuning on {what.path.name}: {done} of {total} runs"),
        )
    else:
        period = PAPER_PERIOD if given["period"] is None else given["period"]
        found = tuning.by_rule(model, names, rule, period=period, kind=given["kind"], bound=bound, say=say)
    page = plain(
        {
            "ok": all(each.margins.stable for each in found.axes.values()),
            "machine": model.name,
            "machine_file": machine,
            "rule": rule,
            **found.numbers(),
            **source,
            "notes": [
                *_short_of(found.axes, rule, bound),
                *_softer(found.axes),
                *_slower_drives(found.axes),
                *([] if given["output"] is None else files.missing(drawing, page=False)),
            ],
        }
    )
    written = [given["machine_file"]] if given["machine_file"] else []
    for file in written:
        found.machine.save(file)
    if given["output"] is None:
        return {**page, "files": written}
    say("drawing")
    with staged(given["output"], files.TUNE_RECORD, files.tune_names(model.axes)) as stage:
        drawn = files.save_figures(files.tune_figures(list(found.axes.values()), model.name), stage, drawing)
        page = recorded(page, drawn, given["output"], stage, files.TUNE_RECORD)
    return {**page, "files": [*written, *page["files"]]}


def _show_feed(page: Page) -> list[Block]:
    best, tolerance, rows = page["best"], length(page["contour_tolerance_mm"]), []
    for each in page["trials"]:
        kept = each["contour_error_max_mm"] <= page["contour_tolerance_mm"]
        judged = "ran away" if each["stopped"] else "within" if kept else "over"
        rows.append({**each, "": "best" if each == best else "", "tolerance": judged})
    heads = (
        "=, scale, top feed=feed_max_mm_s, time=duration_s, contour error=contour_error_max_mm, "
        "its rms=contour_error_rms_mm, at=at_s_mm, tolerance"
    )
    if best is None:
        least, feed = length(page["least_error_mm"]), number(page["least_error_feed_mm_s"])
        end = f"NOT KEPT: no feed tried keeps {tolerance}; the least contour error is {least} at {feed} mm/s"
    else:
        feed, time, error = best["feed_max_mm_s"], best["duration_s"], best["contour_error_max_mm"]
        end = f"top feed {number(feed)} mm/s, {number(time, 6)} s, contour error {length(error)}"
    head = f"{page['name']} on {page['machine']}, contour error within {tolerance}, {page['strategy']}"
    return [[head, *notes(page["notes"])], listed(rows, heads), [end]]


@answers(_show_feed)
@options.table("""
source          SOURCE
--machine       NAME|FILE!       The machine; its axes' limits hold, too.
--contour-tolerance  LENGTH!     Largest distance of the simulated machine from the path.
--vary          all|feed =all    Scale all limits as a slower clock does (feed by k, acceleration by k^2, jerk by k^3),
                                 or the feed alone.
--method        NAME             Interpolation method.  [default: arc-length]
-o --output     DIR              Folder to write to.  [default: splinefeed-NAME-for-MACHINE]
""")
@options.limits
@options.tangential
@options.corrections
@options.linking
@options.reading
@options.figures
def tune_feed(say: Say, source: str, **given: Any) -> Page:
    """Find the fastest motion along SOURCE whose simulated contour error is within a tolerance.

    The given limits, or those of the machine's axes, are scaled down until it is; each trial plans, interpolates and
    follows. Writes the limits found (limits.toml, for run --limits), the setpoints under them, and the curve of
    contour error by feed. The exit code is 1 where no feed keeps the tolerance.

    Examples:
      splinefeed tune-feed butterfly --machine xytheta --contour-tolerance 20um
      splinefeed tune-feed part.json --machine my-table.toml --contour-tolerance 5um --feed 6000mm/min
      splinefeed tune-feed wing.dat --machine lintable --contour-tolerance 0.01 --vary feed --json
    """
    from splinefeed.interpolation import registry
    from splinefeed.machine import limits_toml
    from splinefeed.reports import files
    from splinefeed.reports.folder import default_name, staged
    from splinefeed.reports.record import command as command_line
    from splinefeed.reports.record import source_of
    from splinefeed.reports.servo_figures import feed_curve_figure
    from splinefeed.runs import contour_feed

    drawing = options.figure_formats(given)
    machine = sf.Machine.load(given["machine"])
    method = registry.method(given["method"] or registry.DEFAULT_METHOD).name
    what = job_of(say, source, given, machine)
    path: Any = what.path
    folder = given["output"] if given["output"] is not None else f"{default_name(path.name)}-for-{machine.name}"
    with staged(folder, files.TUNE_FEED_RECORD, files.TUNE_FEED_NAMES) as stage:
        tuning = contour_feed.tune_feed(
            path, what.limits, machine, given["contour_tolerance"],
            period=what.period, strategy=what.strategy, method=method, corrections=given["corrections"],
            vary=given["vary"], on_progress=say,
        )  # fmt: skip
        say("writing")
        names, served, points = [], tuning.served, tuning.setpoints
        if tuning.best is not None and served is not None and points is not None:
            limits_toml.write(tuning.best.limits, stage / files.LIMITS)
            command = command_line(source, points.settings, what.reading, ("hdf5",), given["machine"])
            settings = {**points.settings, "source": source_of(source), "command": command}
            sf.save(replace(points, settings=settings), stage / files.SETPOINTS["hdf5"])
            sf.save(served.response, stage / files.RESPONSE)
            names += [files.LIMITS, files.SETPOINTS["hdf5"], files.RESPONSE]
        names += files.save_figures(
            [("feed-curve", feed_curve_figure(tuning, path.name, machine.name))], stage, drawing
        )
        said = [*path.findings, *(served.notes if served else ()), *tuning.notes, *files.missing(drawing, page=False)]
        page = {
            "name": path.name,
            "source": source_of(source),
            "machine": machine.name,
            "machine_file": given["machine"],
            "period_s": what.period,
            "strategy": tuning.trials[-1].law.strategy,
            "method": method,
            "vary": given["vary"],
            "limits_asked": what.limits.as_dict(),
            **tuning.numbers(),
            "notes": said,
            "least_error_mm": tuning.least.error,
            "least_error_feed_mm_s": tuning.least.feed,
        }
        return recorded(page, names, folder, stage, files.TUNE_FEED_RECORD)
