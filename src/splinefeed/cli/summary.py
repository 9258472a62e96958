"""What `run`, `compare` and `plan` say to people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from splinefeed import units
from splinefeed.cli.output import length, number, print_rows, print_table, print_text

#: A share of a limit from which on it counts as reached, as it counts as binding (`analysis.binding.BINDS`): bringing a
#: short motion to whole periods may take off that much.
REACHED = 0.99
#: A limit that binds for a smaller part of the time is not listed.
LEAST_PART = 0.005


def motion_sentence(page: Mapping[str, Any]) -> str:
    """Name, length and duration; a run by windows is along linear axes."""
    from splinefeed.records import unit_along

    unit = unit_along(page["axes"]) if "axes" in page else "mm"
    return f"{page['name']}: {number(page['length_mm'], 7)} {unit} in {number(page['duration_s'], 6)} s"


def print_run(page: dict[str, Any]) -> None:
    """The numbers of a run, from its page of numbers; one by windows has fewer of them."""
    from splinefeed.records import unit_along

    unit = unit_along(page["axes"]) if "axes" in page else "mm"
    period = units.format_quantity(page["period_s"], "time")
    print_text(f"{motion_sentence(page)}, {page['ticks']} setpoints, one every {period}")
    print_text(f"law       {page['strategy']}; {law_sentence(page, unit)}")
    if "ripple_max" in page:
        chord = f", chord error at most {number(page['chord_error_max_mm'], 3)} mm" if unit == "mm" else ""
        print_text(
            f"method    {page['method']}; feed ripple at most {page['ripple_max']:.1e} (rounding alone: "
            f"{page['ripple_floor']:.1e}){chord}"
        )
    parts = sorted(((part, name) for name, part in page.get("bound_by", {}).items()), reverse=True)
    if binding := [f"{name} {part:.0%}" for part, name in parts if part >= LEAST_PART and name != "none"]:
        print_text(f"bound by  {', '.join(binding)} of the time")
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
    over = [f"{name} ({each['share']:.6g} of its limit)" for name, each in page["limits"].items() if not each["ok"]]
    if not page["end_reached"]:
        over.append(f"the end of the path is missed by {number(page['end_error_mm'], 3)} {unit}")
    over += ["an axis ran away"] if page.get("stopped") else []
    why = ", ".join(over) or "see the problems above"
    print_text("checked: every limit holds" if page["ok"] else f"NOT KEPT: {why}")


def law_sentence(page: dict[str, Any], unit: str) -> str:
    """The top feed, and where it is known a lower bound of the time of all motions within the limits."""
    feed = page["limits"].get("feed")
    sentence = "no feed limit"
    if feed is not None:
        top, limit = number(feed["worst"]), number(feed["limit"])
        sentence = f"top feed {top} {unit}/s, the limit of {limit} {unit}/s is never reached"
        if feed["share"] >= REACHED:
            sentence = f"feed limit of {limit} {unit}/s reached"
    if not page.get("lower_bound_s"):
        return sentence
    return f"{sentence}; no motion within these limits is faster than {number(page['lower_bound_s'], 5)} s"


def print_notes(notes: Sequence[str]) -> None:
    """What a reader or a planner had to say, one line each."""
    for note in notes:
        print_text(f"note      {note}")


def print_limits(limits: dict[str, dict[str, float]], unit: str) -> None:
    """The limits of the path, and how much of each is used; unit of arc length."""
    from splinefeed.records import unit_of

    rows = []
    for name, each in limits.items():
        values = [f"{number(each[key])} {unit_of(name, unit)}" for key in ("worst", "limit")]
        rows.append([name, *values, f"{each['share']:.1%}", f"{number(each['at_s'])} {unit}"])
    print_table(["limit", "worst", "allowed", "share", "at"], rows)


def print_axes(page: dict[str, Any]) -> None:
    """Peaks of each axis."""
    rows = []
    for axis, peaks in page["axes"].items():
        powers = {"velocity": "", "acceleration": "^2", "jerk": "^3"}
        values = [f"{number(peaks[name])} {peaks['unit']}/s{power}" for name, power in powers.items()]
        rows.append([axis, *values])
    print_table(["axis, peak", "velocity", "acceleration", "jerk"], rows)


def print_methods(methods: Sequence[Mapping[str, Any]], unit: str) -> None:
    """One line a method; unit of arc length."""
    timed = all(each["ns_per_tick"] is not None for each in methods)
    rows = [
        {
            **each,
            "drift": f"{each['drift_mm']:+.1e} {unit}",
            "chord": f"{each['chord_error_mm']:.2e} mm",
            "ns": f"{each['ns_per_tick'] or 0.0:.0f}",
        }
        for each in methods
    ]
    heads = "method, ripple max=ripple_max, ripple rms=ripple_rms, drift at end=drift, chord error=chord"
    print_rows(rows, heads + ", ns a tick=ns" * timed)
    notes = "{method}: {replaced} steps gave no finite number; the arc length was taken"
    print_notes([notes.format(**each) for each in methods if each["replaced"]])


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
            at = each["contour_error_at"]
            errors = [_size(one["max"], one["unit"]) for one in each["tracking"].values()]
            errors += [length(each["contour_error_max_mm"]), length(each["contour_error_rms_mm"])]
            rows.append([each["method"], *errors, f"{number(at['t_s'])} s", f"{number(at['s_mm'])} mm"])
        print_table(["method", *page["tracking"], "contour", "its rms", "at", "at"], rows)
        axis, at = experiment["largest_error_axis"], experiment["largest_error_at"]
        print_text(
            f"largest error of an axis {number(experiment['largest_error_mm'])} mm ({axis}, at {number(at['t_s'])} s, "
            f"{number(at['s_mm'])} mm along the path); the paper measured {experiment['paper_error_mm']} mm"
        )
        print_text()
        for sentence in experiment["sentences"]:
            print_text(sentence)
    if page["stopped"]:
        print_text(f"STOPPED: {page['stopped']}")


def print_errors(page: Mapping[str, Any]) -> None:
    """The following error of each axis, and the contour error where the path is known, from a page of numbers."""
    rows = []
    for axis, each in page["tracking"].items():
        limited = f"{each['saturated_ticks']} ticks" if each["saturated_ticks"] else "never"
        sizes = {name: _size(each[name], each["unit"]) for name in ("max", "rms")}
        rows.append({"error": axis, **sizes, "t_s": each["at_t_s"], "s_mm": each["at_s_mm"], "limited": limited})
    if page["contour_error_max_mm"] is not None:
        sizes = {name: length(page[f"contour_error_{name}_mm"]) for name in ("max", "rms")}
        rows.append({"error": "contour", **sizes, **page["contour_error_at"]})
    print_rows(rows, "error, largest=max, rms, at=t_s, at=s_mm, output at its limit=limited")


def _size(value: float, unit: str) -> str:
    return length(value) if unit == "mm" else f"{number(value)} {unit}"
