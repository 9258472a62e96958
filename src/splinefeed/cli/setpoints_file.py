"""A file of setpoints that a user names, ours or another program's, and the path that it was made along."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from splinefeed.cli.source import read_path
from splinefeed.errors import FormatError, InputError

if TYPE_CHECKING:
    from splinefeed.geometry.path import Path
    from splinefeed.kinematics.joint_path import JointPath
    from splinefeed.records import Limits, Setpoints


def read_setpoints(file: str, given: Mapping[str, Any]) -> tuple[Setpoints, list[str]]:
    """The setpoints, and what had to be guessed to read them."""
    from splinefeed.formats import positions_csv
    from splinefeed.formats.setpoints import load
    from splinefeed.records import Setpoints

    if positions_csv.is_foreign(file):
        foreign, notes = positions_csv.read(file, columns=given["columns"], period=given["period"])
        allows = "resolution" in given and not given["resolution"]  # the command has that option, and it is not given
        return foreign, [note for note in notes if allows or "--resolution" not in note]
    _check_says_its_own(file, given)
    setpoints = load(file)
    if not isinstance(setpoints, Setpoints):
        raise FormatError(f"{file}: holds {type(setpoints).__name__}, not setpoints")
    return setpoints, []


def read_setpoints_chunks(file: str, given: Mapping[str, Any], rows: int) -> tuple[Iterator[Setpoints], list[str]]:
    """The setpoints in pieces of at most `rows` ticks, and what had to be guessed to read them."""
    from splinefeed.formats import positions_csv
    from splinefeed.formats.setpoints import load_chunks

    if positions_csv.is_foreign(file):
        setpoints, notes = read_setpoints(file, given)
        return (setpoints.part(start, start + rows) for start in range(0, len(setpoints), rows)), notes
    _check_says_its_own(file, given)
    return load_chunks(file, rows), []


def _check_says_its_own(file: str, given: Mapping[str, Any]) -> None:
    """InputError for options that only files of other programs take."""
    for name in ("columns", "period"):
        if given[name] is not None:
            raise InputError(f"--{name}: is for CSV files of other programs; {file} has its own")


def path_of(settings: Mapping[str, Any], given: Mapping[str, Any], file: str) -> tuple[Path, str]:
    """The path that --path says, or that a run wrote into the settings of its setpoints; and its source.

    Raises InputError where neither says one.
    """
    if given["source"]:
        chosen = {name: given[name] for name in ("which", "chord") if given[name] is not None}
        return read_path(given["source"], chosen), given["source"]
    if not says_path(settings):
        raise InputError(f"{file}: does not name its path; give --path FILE or --path SHAPE")
    source = settings["source"]
    text: str = source["text"]
    if source.get("beside"):  # a run that was made in Python wrote its path beside its setpoints
        text = os.path.join(os.path.dirname(file), text)
    _check_unchanged(text, source.get("sha256"), file)
    return read_path(text, _reading(str(settings.get("command", "")))), text


def on_its_machine(path: Path, settings: Mapping[str, Any], machine: str | None, limits: Limits) -> Path | JointPath:
    """A tool path in the joints of `machine`, or of the one that the settings say; any other path as it is."""
    from splinefeed.geometry.tool_path import ToolPath
    from splinefeed.pipeline.run import on_machine

    return on_machine(path, machine or (machine_of(settings) if isinstance(path, ToolPath) else None), limits)


def machine_of(settings: Mapping[str, Any]) -> str | None:
    """The machine of the run that wrote the setpoints, as its command says, or None."""
    import shlex
    from itertools import pairwise

    words = shlex.split(str(settings.get("command", "")))
    return next((after for word, after in pairwise(words) if word == "--machine"), None)


def says_path(settings: Mapping[str, Any]) -> bool:
    """Whether the settings of setpoints name the source of their path."""
    source = settings.get("source")
    return isinstance(source, Mapping) and isinstance(source.get("text"), str)


def _reading(command: str) -> dict[str, Any]:
    """How a run read its source, from its command line."""
    import shlex
    from itertools import pairwise

    from splinefeed.report.record import READING_FLAGS, READING_OPTIONS

    words = shlex.split(command)
    said = {word: after for word, after in pairwise(words)}
    reading: dict[str, Any] = {name: said[word] for name, word in READING_OPTIONS.items() if word in said}
    for name in ("chord", "tolerance", "smooth", "corner_angle", "angle_tolerance"):
        if name in reading and reading[name] != "program":
            reading[name] = float(reading[name])
    return reading | {name: True for name, word in READING_FLAGS.items() if word in words}


def _check_unchanged(source: str, digest: object, file: str) -> None:
    """Raise InputError if the file that a run read is gone or another one by now."""
    import hashlib

    if digest is None:
        return
    if not os.path.isfile(source):
        raise InputError(f"{file}: its path was read from {source}, which no longer exists; give --path")
    with open(source, "rb") as stream:
        if hashlib.file_digest(stream, "sha256").hexdigest() != digest:
            raise InputError(f"{file}: its path was read from {source}, which has changed since; give --path")
