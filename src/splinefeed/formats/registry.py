"""Read and write paths: which format a file is, by its content and its name; formats are imported when first used.

A format is a module, of this room but for G-code, named in `FORMATS`, with `holds`, `from_text` or `from_file`, and
perhaps `write`: docs/how-to/add-a-format.md. A reader whose file is not in mm returns `Contents` with its units.
"""

from __future__ import annotations

import gc
import inspect
import os
import pathlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from splinefeed.errors import FormatError, InputError, expect
from splinefeed.files import source as source_files
from splinefeed.files.metadata import naming
from splinefeed.files.sizes import MAX_CAD_BYTES, MAX_DRAWING_BYTES, MAX_MOVES
from splinefeed.paths.contents import Contents
from splinefeed.paths.jobs import Job, job
from splinefeed.paths.path import Path
from splinefeed.programs.gcode.dialects import HEAD_BYTES, SUFFIXES

#: How many names of paths a message lists.
_LISTED = 4


@dataclass(frozen=True)
class Format:
    """A kind of file that holds paths.

    Parameters
    ----------
    title : str
        What people call it.
    module : str
        In the package, with `holds` and `from_text` or `from_file`, and `write` if it can be written.
    suffixes : tuple of str
        Of its files.
    max_bytes : int, optional
        Its largest size.
    max_curves : int or None, optional
        Most curves in a file, whatever its reader takes; None where that counts moves as it reads.
    """

    title: str
    module: str
    suffixes: tuple[str, ...]
    max_bytes: int | None = None  # None: source.MAX_FILE_BYTES
    max_curves: int | None = MAX_MOVES

    def load(self) -> Any:
        """Return the module, imported at its first use."""
        return import_module(f"splinefeed.{self.module}")

    @property
    def reader(self) -> Callable[..., list[Path]]:
        """`from_text` or `from_file` of the module."""
        module = self.load()
        found: Callable[..., list[Path]] = getattr(module, "from_text", None) or module.from_file
        return found

    @property
    def writer(self) -> Callable[..., list[str]] | None:
        """`write` of the module; None if this format is only read."""
        return getattr(self.load(), "write", None)

    @property
    def writing_options(self) -> set[str]:
        """Names of the options that its writer takes; none if it is only read."""
        return set() if self.writer is None else options_of(self.writer)

    def check_options(self, known: set[str], options: Iterable[str]) -> None:
        """Refuse an option that is not among the `known` ones, by an InputError that lists them."""
        for name in options:
            if name not in known:
                there = ", ".join(["path", *sorted(known)])
                raise InputError(f"option {name!r} is not one of a {self.title} file; there are {there}")


#: Where two formats look alike the first one that holds a file is taken, unless the name says the other.
FORMATS = (
    Format("JSON curve", "formats.json_curve", (".json",)),
    Format("DXF drawing", "formats.dxf", (".dxf",), MAX_DRAWING_BYTES),
    Format("STEP", "formats.step", (".step", ".stp", ".p21"), MAX_CAD_BYTES),
    Format("IGES", "formats.iges", (".iges", ".igs"), MAX_CAD_BYTES),
    Format("3DM", "formats.threedm", (".3dm",), MAX_CAD_BYTES),
    Format("SVG drawing", "formats.svg", (".svg", ".svgz"), MAX_DRAWING_BYTES),
    Format("airfoil", "formats.airfoil", (".dat", ".txt")),
    Format("table of points", "formats.points", (".csv", ".txt", ".xyz", ".pts", ".asc")),
    Format("G-code", "programs.gcode", SUFFIXES, 2 * 2**30, max_curves=None),
)


def read(
    source: str | os.PathLike[str], *, path: str | int | None = None, repair: bool = False, **options: Any
) -> Path:
    """Read the path in a file.

    Parameters
    ----------
    source : path
        The file; its content and its name show the format.
    path : str or int, optional
        Where the file holds several, the name or number (from 1) of one. Without it several contours are one motion, a
        `Job`: inner before outer, linked by rapid moves, laser off; `sf.read("plate.dxf").job(clearance=5)` links them
        otherwise.
    repair : bool, optional
        Whether faults are repaired where that is safe, each a finding.
    **options : object
        Those of the format: `tolerance` for JSON curves; `chord`, `tolerance`, `degree` for airfoils and points;
        docs/formats.md has all.

    Returns
    -------
    Path
        Lengths in mm, angles in rad.

    Raises
    ------
    FormatError
        For what cannot be read, with the file and the place.
    InputError
        For an option that the format does not have, and for contours that cannot be linked.

    References
    ----------
    .. [1] docs/formats.md, which names the standard of each format.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.write(sf.Path.polyline([[0, 0], [10, 0], [10, 10]]), "part.dxf")
    ()
    >>> sf.read("part.dxf").length
    20.0
    """
    expect("read(file)", (source, (str, os.PathLike)))
    paths = read_all(source, repair=repair, **options)
    return as_job(paths, source) if path is None and len(paths) > 1 else choose(paths, path, source)


def as_job(paths: Sequence[Path], source: str | os.PathLike[str], **linking: Any) -> Job:
    """Join the contours of a file to one motion.

    Parameters
    ----------
    paths : sequence of Path
        The contours.
    source : path
        The file, for messages.
    **linking : object
        As for `paths.jobs.job`.

    Returns
    -------
    Job
        The motion.

    Raises
    ------
    InputError
        As `paths.jobs.job`, with the file.
    """
    try:
        return job(paths, name=pathlib.Path(source).stem, **linking)
    except InputError as error:
        raise InputError(f"{source}: {error}") from None


def choose(paths: Sequence[Path], path: str | int | None, source: str | os.PathLike[str]) -> Path:
    """Choose one of the paths of a file.

    Parameters
    ----------
    paths : sequence of Path
        All of them.
    path : str or int or None
        Name or number (from 1) of the one; None for a lone one.
    source : path
        The file, for messages.

    Returns
    -------
    Path
        The one.

    Raises
    ------
    FormatError
        For another name or number, and for none where there are several.
    """
    if path is None and len(paths) == 1:
        return paths[0]
    names, number = [each.name for each in paths], str(path)
    listed = ", ".join(names[:_LISTED]) + (", ..." if len(names) > _LISTED else "")
    if path is None:
        raise FormatError(
            f"{source}: holds {len(paths)} paths that do not meet; choose one by the option path, "
            f"1 to {len(paths)}, or a name: {listed}"
        )
    if path in names:
        return paths[names.index(number)]
    if number.isascii() and number.isdigit() and len(number) < 10 and 1 <= int(number) <= len(paths):
        return paths[int(number) - 1]
    raise FormatError(f"{source}: has no path {number[:40]!r}; there are 1 to {len(paths)}, named {listed}")


def read_all(source: str | os.PathLike[str], *, repair: bool = False, **options: Any) -> Contents:
    """Read every path in a file.

    Parameters
    ----------
    source : path
        The file.
    repair : bool, optional
        As for `read`.
    **options : object
        As for `read`.

    Returns
    -------
    Contents
        Paths in the order of the file, mm and rad, and the units of the file.

    Raises
    ------
    FormatError, InputError
        As `read`.
    """
    found = format_of(source)
    reader = found.reader
    known = options_of(reader)
    found.check_options(known - {"repair"}, options)
    options |= {"repair": repair} if "repair" in known else {}
    # a drawing is a million small objects that all stay: looking for garbage among them costs a fifth of the time
    collecting = gc.isenabled()
    gc.disable()
    try:
        with naming(source):
            if reader.__name__ == "from_text":
                text = source_files.read_text(source, f"the text of a {found.title}", found.max_bytes)
                paths = reader(text, source, **options)
            else:
                paths = reader(pathlib.Path(source), **options)
            count = sum(len(each.curves) for each in paths)
            if found.max_curves is not None and count > found.max_curves:
                raise InputError(f"holds {count} curves; at most {found.max_curves} are taken: split the file")
            for each in paths:
                if each.linear < len(each.axes):  # curves do have a length, but perhaps none over the linear axes
                    _ = each.length
    finally:
        if collecting:
            gc.enable()
    contents = paths if isinstance(paths, Contents) else Contents(paths)
    contents.format = found.title
    return contents


def write(paths: Path | Iterable[Path], target: str | os.PathLike[str], **options: Any) -> tuple[str, ...]:
    """Write one path or several to a file, whole or not at all.

    Parameters
    ----------
    paths : Path or iterable of Path
        One, or several contours, mm.
    target : path
        The file, whose suffix chooses the format.
    **options : object
        Those of the format.

    Returns
    -------
    tuple of str
        What had to be approximated and what the format cannot hold, one sentence each; empty if nothing is lost.

    Raises
    ------
    FormatError
        For a suffix that no format writes, and a file that cannot be written.
    InputError
        For an option that the format does not have, and for no path.

    References
    ----------
    .. [1] docs/formats.md, which has what each format holds.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.write(sf.Path.polyline([[0, 0], [10, 0]]), "part.svg")
    ()
    """
    expect("write(path, file)", (paths, object), (target, (str, os.PathLike)))
    found = format_to_write(target)
    found.check_options(found.writing_options, options)
    chosen = tuple(paths) if isinstance(paths, Iterable) else (paths,)
    if not chosen:
        raise InputError(f"{target}: there is no path to write")
    lost = [each.name for each in chosen if each.needs_machine and found.module != "formats.json_curve"]
    left_out = [f"the tool axis of {name} is left out: a {found.title} cannot hold it" for name in lost]
    return (*found.load().write(chosen, target, **options), *left_out)


def format_to_write(target: str | os.PathLike[str]) -> Format:
    """Return the format of the suffix of `target`; FormatError for one that nothing writes."""
    suffix = pathlib.Path(target).suffix.lower()
    found = next((each for each in FORMATS if suffix in each.suffixes), None)
    if found is None or found.writer is None:
        can = [each for each in FORMATS if each.writer is not None]
        raise FormatError(f"{target}: this name is not that of a path file; name it as one of {_listed(can)}")
    return found


def format_of(source: str | os.PathLike[str], *, any_size: bool = False) -> Format:
    """Find the format of a file: the one of its name if it holds it, else one that its content shows.

    Parameters
    ----------
    source : path
        The file.
    any_size : bool, optional
        Whether it may be larger than its format allows, as one that is read in parts.

    Returns
    -------
    Format
        Where the content shows none, the one of the name, the last of them: its reader tells what is wrong.

    Raises
    ------
    FormatError
        For no plain file, an empty one, a pointer of Git LFS, and what no format knows.
    """
    file = source_files.check_file(source)
    head = source_files.read_head(source, HEAD_BYTES)
    promised = [each for each in FORMATS if file.suffix.lower() in each.suffixes]
    ranked = promised + [each for each in FORMATS if each not in promised]
    found = next((each for each in ranked if each.load().holds(head)), promised[-1] if promised else None)
    if found is None:
        raise FormatError(f"{source}: is not one of {_listed(FORMATS)}")
    if not any_size:
        source_files.check_size(file, found.max_bytes)
    return found


def _listed(formats: Iterable[Format]) -> str:
    return ", ".join(f"{each.title} ({' '.join(each.suffixes)})" for each in formats)


def options_of(function: Callable[..., Any]) -> set[str]:
    """Return the names of the keyword-only arguments of a reader or writer."""
    parameters = inspect.signature(function).parameters.values()
    return {parameter.name for parameter in parameters if parameter.kind is parameter.KEYWORD_ONLY}
