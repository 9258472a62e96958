"""A file of setpoints that a user names, ours or another program's, and the path that it was made along."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

import splinefeed as sf
from splinefeed.cli import options
from splinefeed.cli.source import read_path
from splinefeed.errors import InputError
from splinefeed.files import json_values
from splinefeed.paths.track import Track
from splinefeed.records import positive


def read_setpoints(file: str, given: Mapping[str, Any]) -> tuple[sf.Setpoints, list[str]]:
    """The setpoints, and what had to be guessed to read them."""
    from splinefeed.formats import positions_csv

    if positions_csv.is_foreign(file):
        foreign, notes = positions_csv.read(file, columns=given["columns"], period=given["period"])
        allows = "resolution" in given and not given["resolution"]  # the command has that option, and it is not given
        return foreign, [note for note in notes if allows or "--resolution" not in note]
    for name in ("columns", "period"):
        if given[name] is not None:
            raise InputError(f"--{name}: is for CSV files of other programs; {file} has its own")
    return sf.load(file, sf.Setpoints), []


def read_setpoints_chunks(file: str, given: Mapping[str, Any], rows: int) -> tuple[Iterator[sf.Setpoints], list[str]]:
    """The setpoints in pieces of at most `rows` ticks, of which HDF5 holds one at a time in memory."""
    from splinefeed.formats.setpoints import load_chunks

    if file.lower().endswith((".h5", ".hdf5")) and given["columns"] is None and given["period"] is None:
        return load_chunks(file, rows), []
    whole, notes = read_setpoints(file, given)
    return (whole.part(start, start + rows) for start in range(0, len(whole), rows)), notes


def path_of(settings: Mapping[str, Any], given: Mapping[str, Any], file: str) -> tuple[sf.Path, str]:
    """Read the path of setpoints: that of --path, or what a run wrote into their settings.

    Parameters
    ----------
    settings : mapping
        Of the setpoints.
    given : mapping
        Values of the options.
    file : str
        Of the setpoints.

    Returns
    -------
    path : Path
        The path.
    source : str
        Where it is from.

    Raises
    ------
    InputError
        Where neither names one.
    """
    from splinefeed.reports.record import source_of

    if given["source"]:
        chosen = {name: given[name] for name in ("which", "chord") if given[name] is not None}
        return read_path(given["source"], chosen), given["source"]
    if not says_path(settings):
        raise InputError(f"{file}: does not name its path; give --path FILE or --path SHAPE")
    source = settings["source"]
    text: str = source["text"]
    if source.get("beside"):  # a run that was made in Python wrote its path beside its setpoints
        text = os.path.join(os.path.dirname(file), text)
    if (digest := source.get("sha256")) is not None and source_of(text).get("sha256") != digest:
        raise InputError(f"{file}: its path was read from {text}, which has changed since or is gone; give --path")
    if source.get("robot") is not None:
        raise InputError(
            f"{file}: is a motion of an arm, which no machine follows; splinefeed check and report know it"
        )
    return read_path(text, options.reading_from(options_of(settings))), text


def of_robot(settings: Mapping[str, Any], file: str) -> tuple[Track, sf.Limits, float] | None:
    """Make again the motion of an arm that a run made setpoints of, from its own files.

    Parameters
    ----------
    settings : mapping
        Of the setpoints.
    file : str
        Theirs.

    Returns
    -------
    (Track, Limits, float) or None
        Path, limits and period, s; None where it is no arm's.

    Raises
    ------
    InputError
        Where its files have changed since, or are gone.
    """
    from splinefeed.reports.record import source_of
    from splinefeed.robots.motion_file import read_motion

    said = settings["source"] if says_path(settings) else {}
    robot = said.get("robot")
    if not (isinstance(robot, Mapping) and isinstance(robot.get("text"), str)):
        return None
    for each in (said, robot):
        if source_of(each["text"]).get("sha256") != each.get("sha256"):
            raise InputError(f"{file}: was made from {each['text']}, which has changed since or is gone; run it again")
    _, path, limits = read_motion(said["text"], robot["text"], feed=options_of(settings)["feed"])
    if limits.as_dict() != settings.get("limits"):
        raise InputError(f"{file}: the limits of {said['text']} have changed since; run it again")
    return path, limits, positive(settings.get("period"), f"{file}: period")


def on_its_machine(path: sf.Path, settings: Mapping[str, Any], machine: str | None, limits: sf.Limits) -> Track:
    """A tool path in the joints of `machine`, or of the one that the settings say; any other path as it is."""
    from splinefeed.runs.run import on_machine

    own = options_of(settings)["machine"] if path.needs_machine else None
    return on_machine(path, machine or own, limits)


def options_of(settings: Mapping[str, Any]) -> dict[str, Any]:
    """The options of the run that wrote the setpoints, from its command."""
    from splinefeed.cli.run import run

    try:
        words = shlex.split(str(settings.get("command", "")))[2:]
    except ValueError as error:
        raise InputError(f"the command in the settings of the setpoints cannot be read: {error}") from None
    return run.make_context("run", words, resilient_parsing=True).params


def run_of(settings: Mapping[str, Any], file: str) -> tuple[sf.Limits, float]:
    """Limits and period, s, that a run wrote into the settings of its setpoints; InputError where it did not."""
    limits = json_values.fields(
        settings.get("limits"), f"{file}: limits", dict.fromkeys(settings.get("limits") or {}, json_values.number)
    )
    return sf.Limits.from_dict(limits), positive(settings.get("period"), f"{file}: period")


def says_path(settings: Mapping[str, Any]) -> bool:
    """Whether the settings of setpoints name the source of their path."""
    source = settings.get("source")
    return isinstance(source, Mapping) and isinstance(source.get("text"), str)
