"""Where a page's path comes from: a shape, an upload, or curves that were edited by hand; and the folders of files."""

from __future__ import annotations

import hashlib
import json
import re
import secrets
import shutil
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

import splinefeed as sf
from splinefeed import units
from splinefeed.errors import InputError, ProblemsError, SplinefeedError
from splinefeed.formats import json_curve, registry
from splinefeed.paths.contents import Contents
from splinefeed.paths.jobs import Job
from splinefeed.paths.tangent_axis import tangential as with_theta
from splinefeed.paths.track import Track
from splinefeed.runs.settings import smooth as smoothed

if TYPE_CHECKING:
    from splinefeed.robots.arm import Arm

#: Size of an upload at most, bytes; files of a folder that are kept: the oldest goes when another one comes.
LARGEST, MOST = 64 * 2**20, 16
#: What a file is called on our side; nothing else is looked for in its folder.
NAME = re.compile(r"[0-9a-f]{32}")
#: Longest name of a file that is kept, and longest text of edited curves.
LONGEST_NAME, LONGEST_CURVES = 80, 4_000_000
#: Longest name that file systems take, bytes; letters beyond ASCII take up to four.
LONGEST_NAME_BYTES = 200
#: Control points that a page shows for editing, at the most.
MOST_EDITED = 2000
#: Options of readers that a page may give, each with the kind of its value.
READING = {"chord": float, "tolerance": float, "layer": str, "units": str, "dialect": str, "offsets": str, "tools": str}
#: Those of programs.
PROGRAM = ("dialect", "offsets", "tools")


def room(folder: File) -> File:
    """A new folder with a name of ours in the folder of uploads, or of files made; the oldest ones go."""
    kept = sorted(folder.iterdir(), key=lambda each: each.stat().st_mtime_ns)
    for old in kept[: max(len(kept) - MOST + 1, 0)]:
        shutil.rmtree(old, ignore_errors=True)
    place = folder / secrets.token_hex(16)
    place.mkdir(mode=0o700)
    return place


def put(folder: File, name: str, content: bytes) -> str:
    """Keep a file under a harmless name that users know again; what it is called on our side."""
    if not 0 < len(content) <= LARGEST:
        raise InputError(f"the file has {len(content)} bytes; from 1 to {LARGEST} are taken, more by the command line")
    clean = re.sub(r"[^\w. -]", "_", re.split(r"[/\\]", name)[-1]).lstrip(". ")
    stem, dot, suffix = clean.rpartition(".")
    place = room(folder)
    kept = f"{stem[: LONGEST_NAME - 12]}{dot}{suffix[:11]}" if stem else clean[:LONGEST_NAME]
    kept = kept.encode("utf-8", "replace")[-LONGEST_NAME_BYTES:].decode("utf-8", "ignore").lstrip(". ")
    (place / (kept or "upload")).write_bytes(content)
    return place.name


def upload(name: object, folder: File) -> File:
    """The file of an upload, or one that was made; InputError where it is not there any more."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise InputError("there is no such upload; drop the file again")
    files = sorted((folder / name).glob("*"))
    if not files:
        raise InputError("the uploaded file is gone; drop it again")
    return files[0]


def path_of(
    source: Mapping[str, Any],
    folder: File,
    *,
    smooth: float | None,
    tangential: bool,
    unsaid: Mapping[str, Any],
) -> tuple[sf.Path, dict[str, str], dict[str, Any]]:
    """Find the path that a source means, smoothed, with theta behind if the settings say so.

    Parameters
    ----------
    source : mapping of str to object
        A shape, an upload, or curves that were edited.
    folder : Path
        Where uploads are.
    smooth : float or None
        The tolerance, mm.
    tangential : bool
        Whether theta goes behind.
    unsaid : mapping of str to object
        How several contours of which none is chosen are linked to one motion (`paths.jobs.job`), where the source does
        not say it.

    Returns
    -------
    path : Path
        To be driven.
    origin : dict of str to str
        What a record says of the source.
    reading : dict of str to object
        How it was read, as a command line says it.

    Raises
    ------
    InputError
        For what is not a source; and what the readers raise.
    """
    text, how = json.dumps(source, sort_keys=True), (("smooth", smooth), ("tangential", tangential))
    paths, origin, reading = _plain_paths(text, folder)
    if len(paths) == 1:
        path = _shaped(paths[0], *how)
    else:
        linking = {**unsaid, **_linking(source)}
        path = _one_motion(text, folder, how, tuple(sorted(linking.items())))
        said = {"clearance": path.linking.clearance, "cut_feed": path.linking.feed}
        reading = {**reading, **{name: value for name, value in said.items() if value is not None}}
        reading |= {"keep_order": True} if path.linking.keep_order else {}
    return path, origin, {**reading, **{name: value for name, value in how if value}}


def _linking(source: Mapping[str, Any]) -> dict[str, Any]:
    """How a page links several contours: the height of rapid moves, and their order."""
    said: dict[str, Any] = {}
    if source.get("clearance") not in (None, ""):
        try:
            said["clearance"] = units.parse(source["clearance"], "length")
        except InputError as error:
            raise InputError(f"rapids at z: {error}") from error
    if source.get("keep_order") not in (None, False):
        if source["keep_order"] is not True:
            raise InputError(f"keep_order: {str(source['keep_order'])[:40]!r} is neither true nor false")
        said["keep_order"] = True
    return said


def _shaped(path: sf.Path, *how: tuple[str, Any]) -> sf.Path:
    """The path smoothed, with theta behind, where the settings say so."""
    said = dict(how)
    if said["smooth"] is not None:
        path = smoothed(path, said)
    return with_theta(path) if said["tangential"] else path


@lru_cache(maxsize=2)
def _one_motion(text: str, folder: File, how: tuple[tuple[str, Any], ...], linking: tuple[tuple[str, Any], ...]) -> Job:
    paths, origin, _ = _plain_paths(text, folder)
    return registry.as_job([_shaped(each, *how) for each in paths], origin["text"], **dict(linking))


@lru_cache(maxsize=8)
def _plain_paths(text: str, folder: File) -> tuple[tuple[sf.Path, ...], dict[str, str], dict[str, Any]]:
    source = json.loads(text)
    if "shape" in source:
        shape = source["shape"]
        if not isinstance(shape, str) or not sf.shapes.is_shape(shape):
            raise InputError(f"{str(shape)[:80]!r} is not a shape; there are {', '.join(sf.shapes.names())}")
        return (sf.shapes.from_text(shape),), {"text": shape}, {}
    if "curves" in source:
        content, path = _edited(source["curves"])
        return (path,), _origin(f"{path.name}.json", content), {}
    contents, file = contents_of(source, folder)
    which = source.get("which")
    paths = contents if which is None else [registry.choose(contents, which, file.name)]
    reading = {name: source[name] for name in (*READING, "which") if source.get(name) is not None}
    return tuple(paths), origin_of(file), reading


def _origin(name: str, content: bytes) -> dict[str, str]:
    return {"text": name, "sha256": hashlib.sha256(content).hexdigest()}


def origin_of(file: File) -> dict[str, str]:
    """What a record says of an upload."""
    return _origin(file.name, file.read_bytes())


def _edited(text: object) -> tuple[bytes, sf.Path]:
    """The path of curves that a page has changed, from the text of a JSON curve file."""
    if not isinstance(text, str) or len(text) > LONGEST_CURVES:
        raise InputError(f"edited curves must be the text of a JSON curve file of at most {LONGEST_CURVES} characters")
    found = json_curve.from_text(text, "the edited curve")
    if len(found) != 1:
        raise InputError(f"the edited curves are {len(found)} paths that do not meet; move their ends together")
    return text.encode(), found[0]


def arm_of(source: Mapping[str, Any], folder: File) -> tuple[Arm, Track, sf.Limits, File, File] | None:
    """Find the motion of an arm, if an upload is one.

    Parameters
    ----------
    source : mapping of str to object
        An upload, with `robot`, the upload of a URDF.
    folder : Path
        Where uploads are.

    Returns
    -------
    tuple or None
        Arm, path, limits and both files; None of what is no motion of an arm. What `read_motion` raises is raised.
    """
    from splinefeed.robots.motion_file import is_motion, read_motion

    if source.get("robot") is None or not is_motion(file := upload(source.get("file"), folder)):
        return None
    robot = upload(source["robot"], folder)
    return (*read_motion(file, robot), file, robot)


def contents_of(source: Mapping[str, Any], folder: File) -> tuple[Contents, File]:
    """All paths of an upload, and its file."""
    file = upload(source.get("file"), folder)
    return registry.read_all(file, **reading_of(source, READING, folder)), file


def reading_of(source: Mapping[str, Any], names: Iterable[str], folder: File) -> dict[str, Any]:
    """Options of a reader: a tool table is an upload too."""
    options = {name: source[name] for name in names if source.get(name) is not None}
    for name, value in options.items():
        kind = READING[name]
        if isinstance(value, bool) or not isinstance(value, kind | int if kind is float else kind):
            raise InputError(f"{name}: {str(value)[:40]!r} is of the wrong kind")
    return options | ({"tools": upload(options["tools"], folder)} if "tools" in options else {})


def words(error: Exception, folder: File) -> str:
    """What an error says, with the names that the user knows in place of ours."""
    said = "; ".join(error.problems) if isinstance(error, ProblemsError) else str(error)
    text = re.sub(re.escape(f"{folder}") + r"/[0-9a-f]{32}/", "", " ".join(said.split()))
    return text if isinstance(error, SplinefeedError) else f"{type(error).__name__}: {text}"
