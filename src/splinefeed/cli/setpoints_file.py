"""A file of setpoints that a user names, ours or another program's, and the path that it was made along."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from splinefeed.cli.source import read_path
from splinefeed.errors import InputError

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
    for name in ("columns", "period"):
        if given[name] is not None:
            raise InputError(f"--{name}: is for CSV files of other programs; {file} has its own")
    return load(file, Setpoints), []


def read_setpoints_chunks(file: str, given: Mapping[str, Any], rows: int) -> tuple[Iterator[Setpoints], list[str]]:
    """The setpoints in pieces of at most `rows` ticks, of which HDF5 holds one at a time in memory."""
    from splinefeed.formats.setpoints import load_chunks

    if file.lower().endswith((".h5", ".hdf5")) and given["columns"] is None and given["period"] is None:
        return load_chunks(file, rows), []
    whole, notes = read_setpoints(file, given)
    return (whole.part(start, start + rows) for start in range(0, len(whole), rows)), notes


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
    return read_path(text, _reading(settings)), text


def on_its_machine(path: Path, settings: Mapping[str, Any], machine: str | None, limits: Limits) -> Path | JointPath:
    """A tool path in the joints of `machine`, or of the one that the settings say; any other path as it is."""
    from splinefeed.geometry.tool_path import ToolPath
    from splinefeed.pipeline.run import on_machine

    return on_machine(path, machine or (machine_of(settings) if isinstance(path, ToolPath) else None), limits)


def machine_of(settings: Mapping[str, Any]) -> str | None:
    """The machine of the run that wrote the setpoints, as its command says, or None."""
    return _words(settings).get("--machine")


def _words(settings: Mapping[str, Any]) -> dict[str, str]:
    """Each word of the command of a run, and the one behind it."""
    import shlex
    from itertools import zip_longest

    words = shlex.split(str(settings.get("command", "")))
    return dict(zip_longest(words, words[1:], fillvalue=""))


def says_path(settings: Mapping[str, Any]) -> bool:
    """Whether the settings of setpoints name the source of their path."""
    source = settings.get("source")
    return isinstance(source, Mapping) and isinstance(source.get("text"), str)


def _reading(settings: Mapping[str, Any]) -> dict[str, Any]:
    """How a run read its source, from its command line."""
    from splinefeed.report.record import READING_FLAGS, READING_OPTIONS

    said = _words(settings)
    reading: dict[str, Any] = {name: said[word] for name, word in READING_OPTIONS.items() if word in said}
    for name in ("chord", "tolerance", "smooth", "corner_angle", "angle_tolerance"):
        if name in reading and reading[name] != "program":
            reading[name] = float(reading[name])
    return reading | {name: True for name, word in READING_FLAGS.items() if word in said}


def _check_unchanged(source: str, digest: object, file: str) -> None:
    """Raise InputError if the file that a run read is gone or another one by now."""
    import hashlib

    if digest is None:
        return
    unchanged = False
    if os.path.isfile(source):
        with open(source, "rb") as stream:
            unchanged = hashlib.file_digest(stream, "sha256").hexdigest() == digest
    if not unchanged:
        raise InputError(f"{file}: its path was read from {source}, which has changed since or is gone; give --path")
