"""`splinefeed tune`: gains of a machine's axes, with the margins before and after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from splinefeed import units
from splinefeed.cli import options
from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import number, print_table, print_text
from splinefeed.cli.panels import PanelCommand
from splinefeed.cli.progress import Say
from splinefeed.cli.source import read_path
from splinefeed.cli.summary import length, print_notes
from splinefeed.errors import InputError

if TYPE_CHECKING:
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.tuned import TunedMachine
    from splinefeed.simulation.curves import TunedAxis

EXAMPLES = """\b
Examples:
  splinefeed tune xytheta
  splinefeed tune xytheta --axis x --rule tyreus-luyben --identify relay -o x-tuned
  splinefeed tune my-table.toml --rule path --path wing.dat --feed 20 --write my-table-tuned.toml

"""

#: Options that say what is driven along a path, and how, and are of no use without one.
_FOR_PATH = (
    *("source", "which", "chord", "tolerance", "feed_forward", "runs", "seed", "strategy"),
    *("feed", "accel", "decel", "jerk", "decel_jerk", "start_feed", "end_feed", "centripetal"),
    *("chord_error", "orientation_error", "axis_velocity", "axis_acceleration", "axis_jerk"),
)


def _print(page: Mapping[str, Any]) -> None:
    print_text(
        f"{page['machine']}: {page['rule']}, servo period {units.format_quantity(page['period_s'], 'time')}"
        + (f", ultimate point by {page['identify']}" if "identify" in page else "")
    )
    for name, each in page["axes"].items():
        if "ultimate_gain" in each:
            print_text(
                f"axis {name}: ultimate gain {number(each['ultimate_gain'])} {each['unit']}, ultimate period "
                f"{number(1e3 * each['ultimate_period_s'])} ms"
            )
    if "bound" in page:
        before = page["contour_error_max_before_mm"]
        old = "an axis ran away" if before is None else length(before)
        print_text(
            f"largest contour error on {page['path_name']}: {length(page['contour_error_max_mm'])} with the new gains, "
            f"with the old ones {old}; {page['runs']} runs"
        )
        print_text(f"bound     {page['bound']}")
    print_text()
    rows = []
    for name, each in page["axes"].items():
        for when, ending in (("old", "_before"), ("new", "")):
            rows.append([name, when, _gain_words(each[f"gains{ending}"]), *_margin_cells(each[f"margins{ending}"])])
    heads = ["axis", "gains", "", "gain margin", "phase margin", "delay margin", "bandwidth"]
    print_table(heads, rows, texts=3)
    print_text()
    for name, each in page["axes"].items():
        for when, ending in (("old", "_before"), ("new", "")):
            print_text(f"{name}, {when} gains: {each[f'margins{ending}']['verdict']}{_hunting(each, ending)}")
    print_notes(page["notes"])


@click.command(cls=PanelCommand, epilog=EXAMPLES + options.UNITS_NOTE)
@click.argument("machine", metavar="MACHINE")
@click.option("--axis", "axes", type=options.Names(), metavar="NAMES", help="Only these axes.  [default: all]")
@click.option(
    "--rule",
    metavar="NAME",
    default="ziegler-nichols",
    show_default=True,
    help="ziegler-nichols or tyreus-luyben, from the ultimate point; or path: small contour error on a path.",
)
@click.option("--kind", metavar="NAME", help="Controller of a rule: p, pi or pid.  [default: pid]")
@click.option(
    "--identify",
    metavar="HOW",
    help="The ultimate point: of the linear model, or by an experiment on the full one: sine, relay.  [default: model]",
)
@click.option("--volts", type=float, metavar="V", help="Size of that experiment.  [default: 1]")
@click.option("--path", "source", metavar="FILE|SHAPE", help="Rule path: the path.  [default: the paper's airfoil]")
@click.option("--which", metavar="NAME|NUMBER", help="Which path of a file that holds several (from 1).")
@click.option("--chord", type=options.Quantity("length"), metavar="LENGTH", help="Airfoil .dat: one unit of the file.")
@click.option("--tolerance", type=options.Quantity("length"), metavar="LENGTH", help="As for run.")
@click.option(
    "--feed-forward", is_flag=True, default=None, help="Rule path: feed-forward of speed and acceleration too."
)
@click.option("--runs", type=int, metavar="N", help="Rule path: runs of the path at most.  [default: 300]")
@click.option("--seed", type=int, metavar="N", help="Rule path: seed of the random draws.  [default: 0]")
@options.limits
@click.option("--write", "machine_file", metavar="FILE", help="Write the machine with the new gains, TOML.")
@options.figures
@click.option("-o", "--output", metavar="DIR", help="Draw Bode and step figures to this folder.  [default: none]")
@answers(_print)
def command(say: Say, machine: str, **given: Any) -> Page:
    """Find gains for the axes of MACHINE; report gain, phase and delay margins of the new and old ones.

    MACHINE is the name of a machine (splinefeed machine list shows them) or a machine file. Limits such as --feed set
    the motion of rule path. The exit code is 1 if an axis is unstable with its new gains.
    """
    import splinefeed
    from splinefeed.formats.plain import plain
    from splinefeed.machine.machine import Machine
    from splinefeed.pipeline.tuning import PATH_RULE
    from splinefeed.report.files import missing

    drawing = options.figure_formats(given)
    if given["figures"] and given["output"] is None:
        raise InputError("--figures: needs a folder; give -o DIR")
    model = Machine.load(machine)
    names = given["axes"] or tuple(model.axes)
    for name in names:
        if name not in model.axes:
            raise InputError(
                f"--axis: machine {model.name!r} has no axis {name!r}; its axes are {', '.join(model.axes)}"
            )
    on_path = given["rule"] == PATH_RULE
    _check_options(given, on_path)
    found = (_on_path if on_path else _by_rule)(model, names, given, say)
    page = plain(
        {
            "ok": all(each["margins"]["stable"] for each in found.page["axes"].values()),
            "machine": model.name,
            "machine_file": machine,
            "rule": given["rule"],
            **found.page,
            "notes": [] if given["output"] is None else missing(drawing, page=False),
            "program": f"splinefeed {splinefeed.__version__}",
        }
    )
    files: list[str] = []
    if given["machine_file"]:
        found.machine.save(given["machine_file"])
        files.append(given["machine_file"])
    if given["output"] is not None:
        say("drawing")
        files += _draw(given["output"], model, page, found.curves(), drawing)
    return {**page, "files": files}


def _check_options(given: Mapping[str, Any], on_path: bool) -> None:
    """InputError for options that the rule would not heed."""
    wrong = ("kind", "identify", "volts") if on_path else _FOR_PATH
    spelled = {"source": "path", "axis_acceleration": "axis-accel"}
    for name in wrong:
        if given[name] is not None:
            use = "is for the rules that start from the ultimate point" if on_path else "is for --rule path"
            raise InputError(f"--{spelled.get(name, name).replace('_', '-')}: {use}, not for {given['rule']}")


def _by_rule(machine: Machine, names: tuple[str, ...], given: Mapping[str, Any], say: Say) -> TunedMachine:
    """Gains of single axes by a rule."""
    from splinefeed.pipeline.run import PAPER_PERIOD
    from splinefeed.pipeline.tuned import by_rule

    said = {name: given[name] for name in ("kind", "identify", "volts") if given[name] is not None}
    period = PAPER_PERIOD if given["period"] is None else given["period"]
    return by_rule(machine, names, given["rule"], period=period, say=say, **said)


def _on_path(machine: Machine, names: tuple[str, ...], given: Mapping[str, Any], say: Say) -> TunedMachine:
    """Gains of all axes together that make contour error small on a path."""
    from splinefeed.pipeline.run import PAPER_SHAPE, run
    from splinefeed.pipeline.tuned import along_path
    from splinefeed.pipeline.tuning import EVALUATIONS

    limits, period, strategy = options.limits_from(dict(given))
    source = given["source"] or PAPER_SHAPE
    reading = {name: given[name] for name in ("which", "chord", "tolerance") if given[name] is not None}
    say(f"reading {source}")
    path = read_path(source, reading)
    say("planning and interpolating")
    setpoints = run(path, limits, period=period, strategy=strategy).points
    found = along_path(
        machine,
        setpoints,
        path,
        axes=given["axes"],
        evaluations=EVALUATIONS if given["runs"] is None else given["runs"],
        seed=given["seed"] or 0,
        feed_forward=bool(given["feed_forward"]),
        on_progress=lambda done, total: say(f"tuning on {path.name}: {done} of {total} runs"),
    )
    found.page["path"] = source
    return found


def _draw(
    folder: str, machine: Machine, page: dict[str, Any], pictures: list[TunedAxis], drawing: tuple[str, ...]
) -> list[str]:
    """Write figures and the page of numbers to a folder; their names as seen from the current folder."""
    from pathlib import Path

    from splinefeed.report import files
    from splinefeed.report.folder import staged

    with staged(folder, files.TUNE_RECORD, files.tune_names(machine.axes)) as stage:
        names = [*files.save_figures(files.tune_figures(pictures, machine.name), stage, drawing), files.TUNE_RECORD]
        files.write_record({**page, "files": names}, stage / files.TUNE_RECORD)
    return [str(Path(folder) / name) for name in names]


def _hunting(each: Mapping[str, Any], ending: str) -> str:
    """What is added to the verdict of a stable loop that does not come to rest on the full model."""
    swing = each[f"rest_swing{ending}"]
    if not each[f"hunts{ending}"] or swing is None or not each[f"margins{ending}"]["stable"]:
        return ""
    size = length(swing) if each["rest_swing_unit"] == "mm" else f"{number(swing)} rad"
    return f"; hunts by {size} at rest: friction against ki; lower ki"


#: Short names of gains in a table.
_SHORT = {
    "position_gain": "kv",
    "velocity_kp": "kp",
    "velocity_ki": "ki",
    "velocity_feed_forward": "vff",
    "acceleration_feed_forward": "aff",
}


def _gain_words(gains: Mapping[str, float]) -> str:
    return " ".join(f"{_SHORT.get(name, name)} {number(value)}" for name, value in gains.items() if value != 0.0)


def _margin_cells(margins: Mapping[str, Any]) -> list[str]:
    def cell(value: float | None, unit: str, at: float | None = None) -> str:
        if value is None:
            return "none"
        return f"{number(value, 3)} {unit}" + ("" if at is None else f" at {number(at, 3)} Hz")

    if not margins["stable"]:
        return ["unstable", "", "", ""]
    delay = margins["delay_margin"]
    return [
        cell(margins["gain_margin_db"], "dB", margins["gain_frequency"]),
        cell(margins["phase_margin"], "deg", margins["phase_frequency"]),
        cell(None if delay is None else 1e3 * delay, "ms"),
        cell(margins["bandwidth"], "Hz"),
    ]
