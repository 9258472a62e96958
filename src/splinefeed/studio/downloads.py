"""Files that a page offers: setpoints, the report, the path, the law, the machine, settings as TOML."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path as File
from typing import Any

from splinefeed.errors import InputError
from splinefeed.formats import registry
from splinefeed.formats.setpoints import save
from splinefeed.report import files, html
from splinefeed.report.record import documented
from splinefeed.studio import results
from splinefeed.studio.bench import Bench
from splinefeed.studio.settings import resolve

#: Formats that a path is offered in.
PATHS = ("json", "dxf", "svg", "ngc")


def make(what: str, form: str | None, settings: Mapping[str, Any], bench: Bench, place: File) -> File:
    """Write the requested file to the folder `place`; InputError for what is no such file."""
    if what == "machine":
        return _machine(settings, bench, place)
    wanted, run = bench.done(settings)
    bench.say(f"writing {what}")
    if what == "setpoints":
        if form not in files.SETPOINTS:
            raise InputError(f"no setpoints are written as {form!r}; there are {', '.join(files.SETPOINTS)}")
        file = place / files.SETPOINTS[form]
        save(documented(run, results.numbers(wanted, run, (form,))).setpoints(), file)
    elif what == "law":
        file = place / files.LAW
        save(run.law, file)
    elif what == "response" and run.served is not None:
        file = place / files.RESPONSE
        save(run.served.response, file)
    elif what == "report":
        file = place / files.REPORT
        responses = {} if run.served is None else {run.kept.method: run.served.response}
        drawn = files.of_run(run, responses, results.machine_name(wanted) or "")
        files.write_report(html.page(run, results.numbers(wanted, run), drawn), file)
    elif what == "numbers":
        file = place / files.RECORD
        page = results.numbers(wanted, run)
        file.write_text(json.dumps(page, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    elif what == "path" and form in PATHS:
        file = place / f"path.{form}"
        registry.write(run.path, file)
    else:
        raise InputError(f"there is no download {what[:40]!r} ({form})")
    return file


def _machine(settings: Mapping[str, Any], bench: Bench, place: File) -> File:
    machine = resolve(settings, bench.uploads).machine
    if machine is None:
        raise InputError("no machine is chosen")
    file = place / "machine.toml"
    machine.save(file)
    return file
