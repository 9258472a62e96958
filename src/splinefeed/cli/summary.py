"""What `run`, `compare`, `plan` and `follow` say to people, as blocks of lines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from splinefeed import units
from splinefeed.cli.output import Block, Page, length, listed, notes, number, table, verdict

#: A share of a limit from which on it counts as reached, as it counts as binding (`measures.BINDS`): bringing a
#: short motion to whole periods may take off that much.
REACHED = 0.99
#: A limit that binds for a smaller part of the time is not listed.
LEAST_PART = 0.005


def unit_of_path(page: Page) -> str:
    """The unit of arc length."""
    from splinefeed.records import unit_along

    return str(page.get("unit") or unit_along(page["axes"]))


def motion_sentence(page: Page) -> str:
    """Name, length and duration."""
    motion = f"{number(page['length_mm'], 7)} {unit_of_path(page)} in {number(page['duration_s'], 6)} s"
    return f"{page['name']}: {motion}"


def run(page: Page) -> list[Block]:
    """The numbers of a run, from its page of numbers."""
    unit = unit_of_path(page)
    period = units.format_quantity(page["period_s"], "time")
    lines = [f"{motion_sentence(page)}, {page['ticks']} setpoints, one every {period}", law(page)]
    if found := measured(page, unit):
        lines.append(f"method    {page['method']}; {', '.join(found)}")
    parts = sorted(page["bound_by"].items(), key=lambda each: (each[0] == "none", -each[1]))
    binding = [f"{name} {part:.0%}" for name, part in parts if part >= LEAST_PART]
    if binding and binding[0] != "none 100%":
        lines.append(f"bound by  {', '.join(binding)} of the time")
    over = [f"{name} ({each['share']:.6g} of its limit)" for name, each in page["limits"].items() if not each["ok"]]
    if not page["end_reached"]:
        over.append(f"the end of the path is missed by {number(page['end_error_mm'], 3)} {unit}")
    over += ["an axis ran away"] if page.get("stopped") else []
    return [
        [*lines, *notes(page["notes"])],
        limits(page),
        axes(page),
        methods(page) if page.get("methods") else [],
        *(servo(page) if "machine" in page else []),
        verdict(page, ", ".join(over) or "see the problems above"),
    ]


def measured(page: Page, unit: str) -> list[str]:
    """What the measures of a run found."""
    from splinefeed.runs.measures import MEASURES

    found = []
    for label in (each.label for each in MEASURES):
        if label.key in page and label.unit in ("", unit):
            value = f"{number(page[label.key], 3)} {label.unit}" if label.unit else f"{page[label.key]:.1e}"
            beside = "" if label.beside is None else f" ({label.beside[0]}: {page[label.beside[1]]:.1e})"
            found.append(f"{label.name} at most {value}{beside}")
    return found


def law(page: Page) -> str:
    """The strategy, the top feed, and where it is known a lower bound of the time of all motions within the limits."""
    from splinefeed.records import KEPT

    feed, unit = page["limits"].get("feed"), unit_of_path(page)
    sentence = "feeds as programmed" if page.get("bound_by", {}).get("feed") else "no feed limit"
    if feed is not None:
        top, limit = number(feed["worst"]), number(feed["limit"])
        limit = f"{limit} {unit}/s" + f" ({number(60.0 * feed['limit'])} mm/min)" * (unit == "mm")
        sentence = f"top feed {top} {unit}/s, the limit of {limit} is never reached"
        reached, highest = feed["share"] >= REACHED, page.get("feed_max_mm_s", 0.0)
        if highest > feed["limit"] * (1.0 + KEPT):  # another move may have more, and this one has most of its own
            so = "reached" if reached else "never reached"
            sentence = f"top feed {number(highest)} {unit}/s, feeds as programmed are {so}"
        elif reached:
            sentence = f"feed limit of {limit} reached"
    if page.get("lower_bound_s"):
        sentence += f"; no motion within these limits is faster than {number(page['lower_bound_s'], 5)} s"
    return f"law       {page['strategy']}; {sentence}"


def limits(page: Page, *, checked: bool = False) -> Block:
    """The limits of the path, and how much of each is used; checked: to more digits, and where and when most."""
    from splinefeed.records import KEPT, unit_of

    unit, rows = unit_of_path(page), []
    for name, each in page["limits"].items():
        own = each.get("unit") or unit_of(name, unit)
        values = [f"{number(each[key], 6 if checked else 4)} {own}" for key in ("worst", "limit")]
        several = name == "feed" and page.get("feed_max_mm_s", 0.0) > each["limit"] * (1.0 + KEPT)
        more = " of its line" if several else ", from its middle" if name.startswith("travel.") else ""
        row = [name + more, *values, f"{each['share']:.{6 if checked else 1}%}", f"{number(each['at_s'])} {unit}"]
        if checked:
            holds = "holds" if each["ok"] else "OVER"
            row += [f"{number(each['at_t_s'])} s", f"{each['floor']:.1e}", each["by"], holds]
        rows.append(row)
    heads = ["limit", "worst", "allowed", "share", "at", "at time", "floor", "by", ""]
    return table(heads if checked else heads[:5], rows)


def axes(page: Page) -> Block:
    """Peaks of each axis."""
    powers = {"velocity": "", "acceleration": "^2", "jerk": "^3"}
    rows = [
        [axis, *(f"{number(peaks[name])} {peaks['unit']}/s{power}" for name, power in powers.items())]
        for axis, peaks in page["axes"].items()
    ]
    return table(["peak by setpoints", *powers], rows)


def methods(page: Page) -> Block:
    """One line a method, and notes on their steps."""
    unit, compared = unit_of_path(page), page["methods"]
    timed = all(each["ns_per_tick"] is not None for each in compared)
    rows = [
        {
            **each,
            "drift": f"{each['drift_mm']:+.1e}",
            "chord": f"{each['chord_error_mm']:.2e}",
            "ns": f"{each['ns_per_tick'] or 0.0:.0f}",
        }
        for each in compared
    ]
    heads = f"method, ripple max=ripple_max, rms=ripple_rms, drift ({unit})=drift, chord ({unit})=chord"
    said = "{method}: {replaced} steps gave no finite number; the arc length was taken"
    found = [said.format(**each) for each in compared if each["replaced"]]
    return [*listed(rows, heads + ", ns" * timed), *notes(found)]


def servo(page: Page) -> list[Block]:
    """What a machine made of the setpoints; of the paper's experiment method by method, and what follows."""
    experiment = page.get("experiment")
    if experiment is None:
        return [[f"on {page['machine']}:", *errors(page)], stopped(page)]
    rows = []
    for each in experiment["methods"]:
        at = each["contour_error_at"]
        sizes = [_size(one["max"], one["unit"]) for one in each["tracking"].values()]
        sizes += [length(each["contour_error_max_mm"]), length(each["contour_error_rms_mm"])]
        rows.append([each["method"], *sizes, f"{number(at['t_s'])} s", f"{number(at['s_mm'])} mm"])
    axis, at = experiment["largest_error_axis"], experiment["largest_error_at"]
    place = f"{axis}, at {number(at['t_s'])} s, {number(at['s_mm'])} mm along the path"
    largest = (
        f"largest error of an axis {number(experiment['largest_error_mm'])} mm ({place}); the paper measured "
        f"{experiment['paper_error_mm']} mm"
    )
    heads = ["method", *page["tracking"], "contour", "its rms", "at", "at"]
    return [
        [f"on {page['machine']}, largest errors by method:", *table(heads, rows), largest],
        experiment["sentences"],
        stopped(page),
    ]


def stopped(page: Page) -> Block:
    """Why the axes did not reach the end, if they did not."""
    return [f"STOPPED: {page['stopped']}"] if page["stopped"] else []


def errors(page: Page) -> Block:
    """The following error of each axis, and the contour error where the path is known."""
    rows: list[Mapping[str, Any]] = []
    for axis, each in page["tracking"].items():
        limited = f"{each['saturated_ticks']} ticks" if each["saturated_ticks"] else "never"
        sizes = {name: _size(each[name], each["unit"]) for name in ("max", "rms")}
        rows.append({"error": axis, **sizes, "t_s": each["at_t_s"], "s_mm": each["at_s_mm"], "limited": limited})
    if page["contour_error_max_mm"] is not None:
        sizes = {name: length(page[f"contour_error_{name}_mm"]) for name in ("max", "rms")}
        rows.append({"error": "contour", **sizes, **page["contour_error_at"]})
    return listed(rows, "error, largest=max, rms, at=t_s, at=s_mm, output at its limit=limited")


def _size(value: float, unit: str) -> str:
    return length(value) if unit == "mm" else f"{number(value)} {unit}"
