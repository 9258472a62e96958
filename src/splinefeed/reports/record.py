"""The record of a run: settings, results, versions, and the command that repeats it."""

from __future__ import annotations

import dataclasses
import hashlib
import os
import platform
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import splinefeed
from splinefeed.checks.certificate import versions
from splinefeed.errors import FormatError
from splinefeed.files import json_values
from splinefeed.files.plain import plain
from splinefeed.files.source import read_text
from splinefeed.records import ANGLES, ORDERS, ROTARY_AXES, TRAVEL_ENDS, unit_of
from splinefeed.runs.comparison import MethodResult
from splinefeed.runs.settings import PAPER_SHAPE

if TYPE_CHECKING:
    from splinefeed.runs.comparison import MethodTrace
    from splinefeed.runs.result import Run

#: Largest page of numbers, bytes.
MOST_BYTES = 2**24
#: Packages whose version can change a number or a figure.
PARTS = ("numpy", "numba", "scipy", "h5py", "matplotlib")
#: Options that are not called as what they set.
_CALLED = {
    "acceleration": "accel", "deceleration": "decel", "deceleration_jerk": "decel-jerk",
    "which": "path", "tangential": "3d",
}  # fmt: skip


def _option(name: str, value: object = True) -> list[str]:
    """The words that say an option of `run`, none where it is not given; of a flag the word alone says it."""
    if value is None or value is False:
        return []
    unit = "rad" if name in ANGLES or name == "angle_tolerance" else ""
    return [f"--{_CALLED.get(name, name.replace('_', '-'))}", *([] if value is True else [f"{value}{unit}"])]


def about(
    settings: Mapping[str, Any],
    source: str | None,
    reading: Mapping[str, Any],
    formats: Sequence[str],
    *,
    machine: str | None = None,
    origin: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Say how a run is made, as `run.json` has it.

    Parameters
    ----------
    settings : mapping of str to object
        Of planning and setpoints.
    source : str or None
        What the user calls it; None for the paper's experiment.
    reading : mapping of str to object
        How the source was read, as options of the command line.
    formats : sequence of str
        Of the setpoints.
    machine : str, optional
        Whose axes follow, or whose joints.
    origin : mapping of str to str, optional
        What to say of a source that is not at hand.

    Returns
    -------
    dict of str to object
        Source, settings, the command that repeats the run, and with what it was made.
    """
    said_source: dict[str, Any] = (
        source_of(PAPER_SHAPE if source is None else source) if origin is None else dict(origin)
    )
    if "robot" in reading and origin is None:
        said_source["robot"] = source_of(str(reading["robot"]))
    said: dict[str, Any] = {
        "source": said_source,
        "settings": plain({**settings, "reading": dict(reading)}),
        "command": command(source, settings, reading, formats, machine),
        **_program(),
    }
    return said


def _program() -> dict[str, Any]:
    found = {"python": platform.python_version(), **versions(PARTS)}
    return {"program": f"splinefeed {splinefeed.__version__}", "versions": found, "ran_on": _ran_on()}


def _ran_on() -> dict[str, str]:
    """What adds in another order elsewhere: system, processor, and the library of linear algebra behind NumPy."""
    import numpy as np

    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processor = names[0] if names else platform.processor() or platform.machine()
    built: Any = np.show_config(mode="dicts")
    blas = built.get("Build Dependencies", {}).get("blas", {})
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processor": processor,
        "blas": f"{blas.get('name', 'unknown')} {blas.get('version', '')}".strip(),
    }


def record(
    run: Run,
    said: Mapping[str, Any],
    traces: Sequence[MethodTrace] = (),
    servo: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Say all of a run that `run.json` says and `--json` prints, but for the names of the files.

    Parameters
    ----------
    run : Run
        With its numbers.
    said : mapping of str to object
        What `about` gives.
    traces : sequence of MethodTrace, optional
        Of methods that the run's is compared with.
    servo : mapping of str to object, optional
        Numbers of what a machine made of it.

    Returns
    -------
    dict of str to object
        For JSON.
    """
    numbers = run.numbers()
    if servo is not None:
        numbers |= {**servo, "ok": numbers["ok"] and servo["stopped"] is None}
        numbers["notes"] = [*numbers["notes"], *servo["servo_notes"]]
    if traces:
        numbers["methods"] = [trace.result.as_dict() for trace in traces]
    page: dict[str, Any] = plain({**numbers, "name": run.name, **said})
    return page


def read(file: Path) -> dict[str, Any]:
    """Read the page of numbers that `record` gave to a file.

    Parameters
    ----------
    file : Path
        `run.json`.

    Returns
    -------
    dict of str to object
        The page; it may say more than is known here, as that of a later version does.

    Raises
    ------
    FormatError
        That names the place of what is none of it.
    """
    page = json_values.parse(read_text(file, "the record of a run", MOST_BYTES), file)
    if not isinstance(page, dict) or not str(page.get("program", "")).startswith("splinefeed "):
        raise FormatError(f"{file}: is not the record of a run; give a folder of splinefeed run")
    for key, check in _PAGE.items():
        if key in page:
            check(page[key], f"{file}: {key}")
    return page


def _object(value: Any, place: str) -> Any:
    if not isinstance(value, dict):
        raise FormatError(f"{place}: is not an object")
    return value


def _method(value: Any, place: str) -> Any:
    number = json_values.number
    known: dict[str, json_values.Check] = {each.name: number for each in dataclasses.fields(MethodResult)}
    known |= {"method": json_values.text, "title": json_values.text, "replaced": json_values.whole}
    known["ns_per_tick"] = json_values.or_none(number)
    return json_values.fields(value, place, known, tuple(known))


#: What a page of numbers says where it says it; its numbers are measured again.
_PAGE: dict[str, json_values.Check] = {
    **dict.fromkeys(("name", "machine", "command", "program"), json_values.text),
    **dict.fromkeys(("settings", "versions", "source", "ran_on"), _object),
    "methods": json_values.each(_method, "methods", 1000),
    "files": json_values.each(json_values.text, "names", 1000),
    "sha256": _object,
}


def of_program(run: Run) -> dict[str, Any]:
    """What `run.json` says of a run that was made in Python: its numbers and settings, and with what."""
    return record(run, {"settings": run.settings, **_program()})


def documented(run: Run, said: Mapping[str, Any]) -> Run:
    """Let the setpoints of a run say the source and the command.

    Parameters
    ----------
    run : Run
        With its setpoints.
    said : mapping of str to object
        What `about` gives.

    Returns
    -------
    Run
        The same with other settings.
    """
    settings = {**run.settings, "source": said["source"], "command": said["command"]}
    return dataclasses.replace(run, kept=dataclasses.replace(run.kept, settings=settings))


def command(
    source: str | None,
    settings: Mapping[str, Any],
    reading: Mapping[str, Any],
    formats: Sequence[str],
    machine: str | None = None,
) -> str:
    """Write the command line that makes the same run again, every setting said, each number to its last digit.

    Parameters
    ----------
    source : str or None
        What the user calls it; None for the paper's experiment, whose limits are not those of its machine.
    settings : mapping of str to object
        Of planning and setpoints.
    reading : mapping of str to object
        How the source was read.
    formats : sequence of str
        Of the setpoints.
    machine : str, optional
        Its name.

    Returns
    -------
    str
        Quoted for a shell.
    """
    words = [
        "splinefeed",
        "run",
        *([] if source is None else [source]),
        *([] if "robot" in reading else _limit_words(settings["limits"])),
    ]
    if machine is not None:
        words += ["--machine", machine]
    said = {name: settings[name] for name in ("period", "strategy", "method", "corrections") if name in settings}
    words += [word for name, value in {**said, **reading}.items() for word in _option(name, value)]
    return shlex.join([*words, *(word for form in formats for word in ("--format", form))])


def _limit_words(limits: Mapping[str, float]) -> list[str]:
    """Options that say all limits, as `Limits.as_dict` has them, each number to its last digit."""
    said: dict[str, list[str]] = {}
    for key, value in limits.items():
        name, _, axis = key.partition(".")
        unit = unit_of(key).replace("deg", "rad") if axis in ROTARY_AXES else ""
        text = f"{axis}={value!r}{unit}" if axis else repr(value)
        if name == TRAVEL_ENDS[0]:
            name, text = "travel", f"{text}:{limits[f'{TRAVEL_ENDS[1]}.{axis}']!r}{unit}"
        if name == "travel" or name in ORDERS.keys() - TRAVEL_ENDS:
            said.setdefault(name, []).append(text)
    return [word for name, texts in said.items() for word in _option(name, ",".join(texts))]


def source_of(source: str) -> dict[str, str]:
    """Describe a source, so that a later command can tell a change.

    Parameters
    ----------
    source : str
        What the user calls it.

    Returns
    -------
    dict of str to str
        That, and of a file its SHA-256.
    """
    from splinefeed.paths import shapes

    if shapes.is_shape(source) or not os.path.isfile(source):
        return {"text": source}
    with open(source, "rb") as stream:
        return {"text": source, "sha256": hashlib.file_digest(stream, "sha256").hexdigest()}
