"""What `run`, `compare` and `plan` say to people."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from splinefeed import units
from splinefeed.cli.output import WIDTH, number, print_table, print_text

#: A share of a limit from which on it counts as reached, as it counts as binding (`measures.BINDS`): bringing a
#: short motion to whole periods may take off that much.
REACHED = 0.99
#: A limit that binds for a smaller part of the time is not listed.
LEAST_PART = 0.005


def print_run(page: dict[str, Any]) -> None:
    """The numbers of a run, from its page of numbers; one by windows has fewer of them."""
    from splinefeed.records import unit_along

    period = units.format_quantity(page["period_s"], "time")
    unit = unit_along(page["axes"]) if "axes" in page else "mm"
    print_text(
        f"{page['name']}: {number(page['length_mm'], 7)} {unit} in {number(page['duration_s'], 6)} s, "
        f"{page['ticks']} setpoints, one every {period}"
    )
    print_text(f"law       {page['strategy']}; {law_sentence(page, unit)}")
    if "ripple_max" in page:
        chord = f", chord error at most {number(page['chord_error_max_mm'], 3)} mm" if unit == "mm" else ""
        print_text(
            f"method    {page['method']}; feed ripple at most {page['ripple_max']:.1e} (rounding alone: "
            f"{page['ripple_floor']:.1e}){chord}"
        )
    if bound := _bound_sentence(page.get("bound_by", {})):
        print_text(f"bound by  {bound}")
    print_notes(page["notes"])
    print_text()
    print_limits(page["limits"], unit)
    if "axes" in page:
        print_text()
        print_axes(page)
    if page.get("methods"):
        print_text()
        print_methods(page["methods"], unit)
    if "machine" in page:
        print_text()
        print_servo(page)
    print_text()
    for problem in page["problems"]:
        print_text(f"problem   {problem}")
    print_text("checked: every limit holds" if page["ok"] else f"NOT KEPT: {', '.join(_not_kept(page, unit))}")


def law_sentence(page: dict[str, Any], unit: str) -> str:
    """The top feed, and where it is known a lower bound of the time of all motions within the limits."""
    feed = page["limits"].get("feed")
    sentence = "no feed limit" if feed is None else feed_sentence(feed, unit)
    if not page.get("lower_bound_s"):
        return sentence
    return f"{sentence}; no motion within these limits is faster than {number(page['lower_bound_s'], 5)} s"


def feed_sentence(feed: dict[str, float], unit: str) -> str:
    """The top feed, and whether the limit is reached; unit of arc length."""
    top, limit = number(feed["worst"]), number(feed["limit"])
    if feed["share"] >= REACHED:
        return f"feed limit of {limit} {unit}/s reached"
    return f"top feed {top} {unit}/s, the limit of {limit} {unit}/s is never reached"


def _bound_sentence(parts: dict[str, float]) -> str:
    """The limits that hold the motion back, with their part of the time, the longest first."""
    said = sorted(((part, name) for name, part in parts.items() if part >= LEAST_PART and name != "none"), reverse=True)
    return ", ".join(f"{name} {part:.0%}" for part, name in said) + " of the time" if said else ""


def print_notes(notes: Sequence[str]) -> None:
    """What a reader or a planner had to say, one line each."""
    for note in notes:
        print_text(f"note      {note}")


def print_limits(limits: dict[str, dict[str, float]], unit: str) -> None:
    """The limits of the path, and how much of each is used; unit of arc length."""
    from splinefeed.records import unit_of

    rows = [
        [
            name,
            f"{number(each['worst'])} {unit_of(name, unit)}",
            f"{number(each['limit'])} {unit_of(name, unit)}",
            f"{each['share']:.1%}",
            f"{number(each['at_s'])} {unit}",
        ]
        for name, each in limits.items()
    ]
    print_table(["limit", "worst", "allowed", "share", "at"], rows)


def print_axes(page: dict[str, Any]) -> None:
    """Peaks of each axis beside the path's own acceleration and jerk, which do not bind the axes."""
    rows = []
    shared = any("acceleration_share" in peaks or "jerk_share" in peaks for peaks in page["axes"].values())
    for axis, peaks in page["axes"].items():
        row = [axis]
        for order, name in enumerate(("velocity", "acceleration", "jerk"), start=1):
            power = "" if order == 1 else f"^{order}"
            row.append(f"{number(peaks[name])} {peaks['unit']}/s{power}")
            if order > 1 and shared:
                share = peaks.get(f"{name}_share")
                row.append("" if share is None else number(share, 3))
        rows.append(row)
    heads = ["axis, peak", "velocity", "acceleration", "of path's A", "jerk", "of path's J"]
    print_table(heads if shared else heads[:3] + heads[4:5], rows)


def print_methods(methods: Sequence[Mapping[str, Any]], unit: str) -> None:
    """One line a method; unit of arc length."""
    rows = [
        [
            each["method"],
            f"{each['ripple_max']:.1e}",
            f"{each['ripple_rms']:.1e}",
            f"{each['drift_mm']:+.1e} {unit}",
            f"{each['chord_error_mm']:.2e} mm",
            *([] if each["ns_per_tick"] is None else [f"{each['ns_per_tick']:.0f}"]),
        ]
        for each in methods
    ]
    heads = ["method", "ripple max", "ripple rms", "drift at end", "chord error", "ns a tick"]
    print_table(heads[: len(rows[0])] if rows else heads, rows)
    notes = "{method}: {replaced} steps gave no finite number; the arc length was taken"
    print_notes([notes.format(**each) for each in methods if each["replaced"]])


def _not_kept(page: dict[str, Any], unit: str) -> list[str]:
    over = [f"{name} ({each['share']:.6g} of its limit)" for name, each in page["limits"].items() if not each["ok"]]
    missed = f"the end of the path is missed by {number(page['end_error_mm'], 3)} {unit}"
    stopped = ["an axis ran away"] if page.get("stopped") else []
    return [*over, *([] if page["end_reached"] else [missed]), *stopped] or ["see the problems above"]


def print_servo(page: Mapping[str, Any]) -> None:
    """What a machine made of the setpoints; of the paper's experiment method by method, and what follows."""
    experiment = page.get("experiment")
    if experiment is None:
        print_text(f"on {page['machine']}:")
        print_errors(page)
    else:
        print_text(f"on {page['machine']}, largest errors by method:")
        rows = []
        for each in experiment["methods"]:
            cells = [
                _error_cells(one["max"], one["rms"], one["unit"], 0.0, None)[0] for one in each["tracking"].values()
            ]
            contour = [length(each["contour_error_max_mm"]), length(each["contour_error_rms_mm"])]
            at = each["contour_error_at"]
            rows.append([each["method"], *cells, *contour, f"{number(at['t_s'])} s", f"{number(at['s_mm'])} mm"])
        print_table(["method", *page["tracking"], "contour", "its rms", "at", "at"], rows)
        axis, at = experiment["largest_error_axis"], experiment["largest_error_at"]
        print_text(
            f"largest error of an axis {number(experiment['largest_error_mm'])} mm ({axis}, at {number(at['t_s'])} s, "
            f"{number(at['s_mm'])} mm along the path); the paper measured {experiment['paper_error_mm']} mm"
        )
        print_text()
        for sentence in experiment["sentences"]:
            print_wrapped(sentence)
    if page["stopped"]:
        print_text(f"STOPPED: {page['stopped']}")


def print_wrapped(text: str) -> None:
    """A sentence in lines of at most WIDTH letters, the later ones indented."""
    for line in textwrap.wrap(text, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False):
        print_text(line)


def print_errors(page: Mapping[str, Any]) -> None:
    """The following error of each axis, and the contour error where the path is known, from a page of numbers."""
    rows = []
    for axis, each in page["tracking"].items():
        rows.append([axis, *_error_cells(each["max"], each["rms"], each["unit"], each["at_t_s"], each["at_s_mm"])])
        rows[-1].append(f"{each['saturated_ticks']} ticks" if each["saturated_ticks"] else "never")
    if page["contour_error_max_mm"] is not None:
        at = page["contour_error_at"]
        largest, rms = page["contour_error_max_mm"], page["contour_error_rms_mm"]
        rows.append(["contour", *_error_cells(largest, rms, "mm", at["t_s"], at["s_mm"]), ""])
    print_table(["error", "largest", "rms", "at", "at", "output at its limit"], rows)


def length(value: float) -> str:
    """A length, mm, in micrometres below a millimetre."""
    return f"{number(1e3 * value)} um" if abs(value) < 1.0 else f"{number(value)} mm"


def _error_cells(largest: float, rms: float, unit: str, t: float, s: float | None) -> list[str]:
    sizes = [length(each) if unit == "mm" else f"{number(each)} {unit}" for each in (largest, rms)]
    return [*sizes, f"{number(t)} s", "" if s is None else f"{number(s)} mm"]
