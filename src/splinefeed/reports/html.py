"""report.html: settings, results and interactive figures in one file; works offline."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from string import Template
from typing import Any

import numpy as np

from splinefeed import units
from splinefeed.records import unit_along, unit_of_axis, words_of
from splinefeed.records.verdict import ALLOWED
from splinefeed.reports import interactive, library, program, theme
from splinefeed.reports.detail import DetailStore
from splinefeed.reports.figure import Figure
from splinefeed.reports.theme import given
from splinefeed.runs.comparison import MethodResult
from splinefeed.runs.result import Run


def page(
    run: Run, record: Mapping[str, Any], figures: Mapping[str, Figure], results: Sequence[MethodResult] = ()
) -> str:
    """Write the report of a run as one HTML file.

    Parameters
    ----------
    run : Run
        Of the report.
    record : mapping of str to object
        The page of numbers, as `run.json` has it.
    figures : mapping of str to Figure
        Of `files.of_run`; those with a place on the page are drawn.
    results : sequence of MethodResult, optional
        Of the methods that are compared.

    Returns
    -------
    str
        The text of the file.

    Raises
    ------
    InputError
        Where Plotly is not installed.
    """
    shown = {name: figure for name, figure in figures.items() if name in ("path", "motion", *SECTIONS)}
    sections = [section(name, *SECTIONS[name]) for name in SECTIONS if name in shown]
    if results:
        sections.append(_methods(results, unit_along(run.path.axes)))
    plain, store = _within(shown)
    data: dict[str, Any] = {"figures": plain, "series": store.series}
    text = ""
    if run.path.lines is not None:
        text, (begin, line) = program.text_of_program(record), program.starts(run)
        columns = {"begin": interactive.array(begin), "line": interactive.array(line.astype(np.float64))}
        data["program"] = {"text": text, **columns}
    return filled(
        "page.html",
        data,
        store.text(),
        title=text_of(record.get("name", run.path.name)),
        subtitle=text_of(_subtitle(run)),
        state="good" if record.get("ok", run.ok) else "bad",
        verdict=text_of(_verdict(run, record)),
        problems=listed(record.get("problems", run.verdict.problems), "said bad"),
        cards=_cards(run, record),
        limits=_limits(run),
        notes=listed(record.get("notes", ()), "said"),
        sections="".join(sections),
        view="" if run.path.lines is None else ' data-view="program"' if text else "",
        listing=_LISTING if text else "",
        operations="" if run.path.lines is None else _operations(run),
        command=_COMMAND.format(text_of(record["command"])) if record.get("command") else "",
        settings=_settings(record),
    )


#: Base64 of the points of long curves at the most; the page is some 2 MB more.
MOST_BYTES = 5_500_000


def _within(figures: Mapping[str, Figure]) -> tuple[dict[str, interactive.Plain], DetailStore]:
    """Figures as plain data with the points of their long curves: as many of each as leave the page within its size."""
    store = DetailStore()
    plain = {name: interactive.to_plain(figure, store) for name, figure in figures.items()}
    while (size := len(store.text())) > MOST_BYTES:
        store = DetailStore(most=int(0.95 * MOST_BYTES / size * store.longest))
        plain = {name: interactive.to_plain(figure, store) for name, figure in figures.items()}
    return plain, store


#: Figures below those of path and motion: title, and what a screen reader says.
SECTIONS = {
    "errors": ("Errors of the axes", "errors of the axes over time"),
    "spectra": ("Spectra of the following errors", "amplitude over frequency"),
    "limits": ("Which limit binds", "feed, maximum velocity and the share of each limit over time"),
}


#: What makes a file a module, which one script does without.
_EXPORT = re.compile(r"^(import .*\n|export (?=[a-z]))", re.MULTILINE)


def filled(name: str, data: Mapping[str, Any], points: str = "", **fields: str) -> str:
    """Fill a page with its style, its scripts and its data.

    Parameters
    ----------
    name : str
        Of the page, in the folder `page`.
    data : mapping of str to object
        For its script: `figures` by place, and `series` of the points of their long curves.
    points : str, optional
        These points, as `DetailStore.text` gives them.
    **fields : str
        HTML by place.

    Returns
    -------
    str
        The text of the file.

    Raises
    ------
    InputError
        Where Plotly is not installed.
    """
    folder = resources.files("splinefeed.reports").joinpath("page")
    read = {file: folder.joinpath(file).read_text(encoding="utf-8") for file in (name, "page.css", *library.MODULES)}
    script = "".join(_EXPORT.sub("", read[file]) for file in library.MODULES)
    text = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return Template(read[name]).substitute(
        plotly=library.compressed(), data=text, points=points, style=read["page.css"], script=script, **fields
    )


def table(names: Sequence[str], rows: Sequence[str]) -> str:
    """A table with these heads, the cells of each row as HTML, that scrolls where it is wide."""
    head, body = "".join(f"<th>{name}</th>" for name in names), "".join(f"<tr>{row}</tr>" for row in rows)
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def text_of(value: object) -> str:
    """A value as text in HTML, on one line."""
    return html.escape("".join(c if c.isprintable() else " " for c in str(value)))


def _subtitle(run: Run) -> str:
    period = units.format_quantity(run.kept.period, "time")
    unit, count = unit_along(run.path.axes), len(run.path.curves)
    of = "read in parts" if run.planned is None else f"{count} curve{'s' * (count != 1)}"
    return (
        f"{run.length:.7g} {unit}, {of}, axes {' '.join(run.axes)}; strategy "
        f"{run.strategy}, method {run.kept.method}, {run.ticks} setpoints, one every {period}"
    )


def _verdict(run: Run, record: Mapping[str, Any]) -> str:
    if record.get("ok", run.ok):
        return f"Checked: every limit holds, {ALLOWED}, in {run.duration:.6g} s."
    over = []
    for name, each in run.verdict.limits.items():
        if not each.holds:
            over.append(
                f"{words_of(name)} {100.0 * (each.share - 1.0):.2g} % over at {each.at_t:.4g} s{_line(run, each.at_t)}"
            )
    return f"Not kept: {'; '.join(over) if over else 'see the problems below'}."


def _cards(run: Run, record: Mapping[str, Any]) -> str:
    duration, bound, along = run.duration, run.lower_bound, unit_along(run.path.axes)
    cards = [("cycle time", f"{duration:.6g} s", "")]
    if bound:
        gap = f"no motion within these limits is faster; gap {100.0 * (duration / bound - 1.0):.2g} %"
        cards.append(("lower bound", f"{bound:.6g} s", gap))
    if run.verdict.limits:
        name, worst = max(run.verdict.limits.items(), key=lambda each: each[1].share)
        cards.append(("largest share", f"{100.0 * worst.share:.4g} %", words_of(name)))
    if run.path.lines is None:  # who runs a program asks for neither; run.json has both
        measured = run.measured()
        for label in (each.label for each in run.measures):
            if label.unit in ("", along):
                value = _length(measured[label.key]) if label.unit else f"{measured[label.key]:.2g}"
                beside = "at most" if label.beside is None else f"{label.beside[0]} {measured[label.beside[1]]:.2g}"
                cards.append((label.name, value, beside))
        cards.append(("end error", _length(run.end_error_mm, along), ""))
    else:
        found = program.operations(run)
        idle = sum(each.rapid_s for each in found)
        cards.append(("feed moves", f"{duration - idle:.6g} s", f"{sum(each.cut_mm for each in found):.6g} mm"))
        cards.append(("rapid moves", f"{idle:.6g} s", ""))
        cards.append(
            ("tools", f"{len({each.tool for each in found})}", f"{len(found)} operation{'s' * (len(found) != 1)}")
        )
    if record.get("contour_error_max_mm") is not None:
        rms = record.get("contour_error_rms_mm")
        cards.append(("contour error", _length(record["contour_error_max_mm"]), f"rms {_length(rms)}" if rms else ""))
    for axis, value in (record.get("tracking_error_max") or {}).items():
        cards.append((f"following error {axis}", _length(value, unit_of_axis(axis)), "largest"))
    return "".join(
        f"<div><dt>{text_of(name)}</dt><dd>{text_of(value)}<small>{text_of(small)}</small></dd></div>"
        for name, value, small in cards
    )


def _length(value: float, along: str = "mm") -> str:
    """A length in the unit that suits it, or what is no length in its own."""
    if along == "deg":
        return f"{value:.3g}°"
    if along != "mm":
        return f"{value:.3g} {along}"
    for unit, factor, least in (("mm", 1.0, 1.0), ("µm", 1e3, 1e-3), ("nm", 1e6, 1e-6)):
        if abs(value) >= least:
            return f"{value * factor:.3g} {unit}"
    return f"{value:.2g} mm" if value else "0"


def _limits(run: Run) -> str:
    bound, along = run.use.time_bound_by(), unit_along(run.path.axes)
    rows = []
    for name, each in run.verdict.as_dict()["limits"].items():
        unit = theme.unit(name, along)
        state, share, part = "good" if each["ok"] else "bad", 100.0 * each["share"], bound.get(name, 0.0)
        bar = f'<span class="{state}" style="width:{min(share, 100.0):.2f}%"></span>'
        rows.append(
            f'<td>{text_of(words_of(name))}</td><td class="{state}">{"holds" if each["ok"] else "OVER"}</td>'
            f'<td>{share:.4f} %</td><td class="share">{bar}</td>'
            f"<td>{given(each['worst'])} {unit}</td><td>{given(each['limit'])} {unit}</td>"
            f"<td>{each['at_s']:.6g} {along.replace('deg', '°')}{_line(run, each['at_t_s'])}</td>"
            f"<td>{each['at_t_s']:.6g} s</td>"
            f"<td>{f'{100.0 * part:.1f} %' if part else ''}</td>"
        )
    return table(("limit", "", "share", "", "worst", "allowed", "at place", "at time", "binds"), rows)


#: How the run is made again, of one that a command made.
_COMMAND = (
    '<p>The command that repeats this run:</p><pre id="command" tabindex="0">{}</pre>'
    '<button id="copy" type="button">copy the command</button>'
)
#: Where the lines of a program are.
_LISTING = (
    '<div class="program"><div id="listing" class="listing" tabindex="0" role="listbox" '
    'aria-label="lines of the program"><div></div></div></div>'
)


def _operations(run: Run) -> str:
    """The operations of a program: tool, lines, time, and feeds as they are programmed."""
    rows = []
    for each in program.operations(run):
        feeds = "" if each.feeds is None else " to ".join(dict.fromkeys(f"{value:.4g}" for value in each.feeds))
        rows.append(
            f"<td>{text_of(each.tool or 'no tool')}</td><td>{each.lines[0]} to {each.lines[1]}</td>"
            f"<td>{each.seconds:.4g} s</td><td>{each.rapid_s:.4g} s</td><td>{each.cut_mm:.5g} mm</td>"
            f"<td>{feeds}{' mm/min' if feeds else ''}</td>"
        )
    names = ("tool", "lines", "time", "of it rapid", "cut", "programmed feeds")
    return f"<section><h2>Operations</h2>{table(names, rows)}</section>"


def _line(run: Run, t: float) -> str:
    line = program.line_at(run, t)
    return "" if line is None else f", line {line}"


def _methods(results: Sequence[MethodResult], along: str) -> str:
    rows = [
        f"<td>{text_of(r.method)}</td><td>{r.ripple_max:.2g}</td><td>{r.ripple_rms:.2g}</td>"
        f"<td>{r.drift_mm:+.2g} {along.replace('deg', '°')}</td><td>{_length(r.chord_error_mm)}</td>"
        for r in results
    ]
    names = ("method", "ripple max", "ripple rms", "drift at end", "chord error")
    return f"<section><h2>Methods compared</h2>{table(names, rows)}</section>"


def section(place: str, title: str, label: str) -> str:
    """The section of a figure; label  what a screen reader says."""
    return (
        f'<section><h2>{text_of(title)}</h2><div id="{place}" class="figure" role="img" '
        f'aria-label="{text_of(label)}"></div></section>'
    )


def listed(sentences: Sequence[str], kind: str) -> str:
    """Sentences as a list of this class, nothing for none."""
    items = "".join(f"<li>{text_of(each)}</li>" for each in sentences)
    return f'<ul class="{kind}">{items}</ul>' if items else ""


def _settings(record: Mapping[str, Any]) -> str:
    shown = {key: record[key] for key in ("source", "settings", "program", "versions", "ran_on") if key in record}
    text = json.dumps(shown, indent=2, ensure_ascii=False)
    return f"<details><summary>settings, versions, input hash</summary><pre>{html.escape(text)}</pre></details>"
