"""The folder that a run writes to: all files of a run appear in it together, or none does."""

from __future__ import annotations

import json
import os
import re
import secrets
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]

from splinefeed.errors import FormatError, InputError, SplinefeedError, expect
from splinefeed.files.atomic import TEMPORARIES, reason_of
from splinefeed.reports.files import NAMES, RECORD, RECORDS, SETPOINTS, write
from splinefeed.runs.result import Run

#: Longest part of a default folder's name that comes from the path's name.
LONGEST_NAME = 48
#: A page of numbers larger than this, bytes, is none of ours.
_LARGEST_RECORD = 2**20


def default_name(name: str) -> str:
    """Name the folder for a path: splinefeed-naca-0025 for "NACA 0025".

    Parameters
    ----------
    name : str
        Of the path.

    Returns
    -------
    str
        Letters, digits and dashes.
    """
    words = re.sub(r"[^a-z0-9]+", "-", name.lower())[:LONGEST_NAME].strip("-")
    return f"splinefeed-{words or 'path'}"


@contextmanager
def staged(folder: str | os.PathLike[str], record: str = RECORD, names: Sequence[str] = NAMES) -> Iterator[Path]:
    """Give a hidden folder to write to, whose files are put into `folder` at the end; on failure nothing is left.

    Parameters
    ----------
    folder : str or PathLike
        Made if it is not there.
    record : str, optional
        The file with the page of numbers that this command writes.
    names : sequence of str, optional
        All files that it may write, that included.

    Yields
    ------
    Path
        The hidden folder.

    Raises
    ------
    FormatError
        For a folder that cannot be made or written, or that holds files of these names that are not ours.

    Notes
    -----
    Files of an earlier run of this command are replaced, or taken away if it now has none of that name, and files that
    other commands of ours list as theirs may be replaced; nothing else is touched. The page of numbers is put in place
    last. What a killed run had complete is put in place first, what it had not is removed.
    """
    if not str(folder):
        raise FormatError("the name of the output folder is empty; leave -o out, or write -o . for the current folder")
    target = Path(folder)
    stage = target / f".splinefeed-{secrets.token_hex(8)}"
    earlier: tuple[str, ...] | None = ()
    try:
        if target.is_dir():
            _recover(target)
        earlier = _checked(target, record, names)
        target.mkdir(exist_ok=earlier is not None)
        stage.mkdir()
        with _held(stage):
            yield stage
            with _held(target, wait=True):  # of two runs into one folder one comes after the other
                _publish(stage, target, record, earlier or ())
    except OSError as error:
        raise FormatError(f"{folder}: cannot be written: {reason_of(error)}") from error
    except SplinefeedError as error:
        raise type(error)(str(error).replace(f"{stage}", f"{target}")) from None
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        if earlier is None:
            with suppress(OSError):  # it goes only if it is empty
                target.rmdir()


def _checked(target: Path, own: str, names: Sequence[str]) -> tuple[str, ...] | None:
    """Names of an earlier run's files in `target`, None if there is no such folder; FormatError if it is no use."""
    if "\0" in str(target):
        raise FormatError(f"{str(target)!r}: is not the name of a folder")
    if not os.path.lexists(target):
        if not target.absolute().parent.is_dir():
            raise FormatError(f"{target}: the folder {target.parent} does not exist; make it first")
        return None
    if not target.is_dir():
        raise FormatError(f"{target}: is a file; give the name of a folder")
    listed = {each: _listed(target / each) for each in RECORDS}
    ours = {name for each, files in listed.items() if files is not None for name in (*files, each)}
    for name in names:
        file = target / name
        if file.is_dir():
            raise FormatError(f"{file}: is a folder where a file must go; choose another folder with -o")
        if os.path.lexists(file) and name not in ours and listed[own] is None:
            raise FormatError(f"{file}: was not written by a run of splinefeed; choose another folder with -o")
    return tuple(name for name in names if name in (listed[own] or ()))


def _listed(file: Path) -> list[str] | None:
    """The files that the page of numbers of an earlier run lists, None if there is no such page that we wrote."""
    try:
        if not file.is_file() or file.stat().st_size > _LARGEST_RECORD:
            return None
        page = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(page, dict) or not str(page.get("program", "")).startswith("splinefeed "):
        return None
    names = page.get("files")
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []


@contextmanager
def _held(folder: Path, *, wait: bool = False) -> Iterator[bool]:
    """Hold a folder as this process's own until the context ends; whether it is, which is so where no other holds it.

    The system lets go of it when the process dies, however that is. Where there are no such locks, nobody holds any.
    """
    if fcntl is None:
        yield False
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except OSError:  # another process is at work there, or the disk has no locks
            yield False
        else:
            yield True
    finally:
        os.close(number)


def _recover(target: Path) -> None:
    """Put in place what killed runs had complete, which is so where their page is there, and remove the rest."""
    for stage in target.glob(TEMPORARIES):
        if not stage.is_dir() or stage.is_symlink():
            continue
        with _held(stage) as own, _held(target, wait=True):
            if own:
                for record in RECORDS:
                    if _listed(stage / record) is not None:
                        _publish(stage, target, record, ())
                shutil.rmtree(stage, ignore_errors=True)


def _publish(stage: Path, target: Path, record: str, earlier: tuple[str, ...]) -> None:
    names = sorted((file.name for file in stage.iterdir()), key=lambda name: (name == record, name))
    for name in names:
        os.replace(stage / name, target / name)
    for name in earlier:
        if name not in names:
            with suppress(OSError):
                (target / name).unlink()


def report(run: Run, folder: str | os.PathLike[str], *, formats: Iterable[str] = ("hdf5",)) -> list[str]:
    """Write what `splinefeed run` writes: setpoints, law, figures, report.html.

    Parameters
    ----------
    run : Run
        To be written.
    folder : str or PathLike
        Made if it is not there; files of an earlier run in it are replaced, all at once or not at all.
    formats : iterable of str, optional
        Of the setpoints: names of `splinefeed.formats.setpoint_table.FORMATS`.

    Returns
    -------
    list of str
        Names of the files. Lengths are in mm, rotary axes in rad or as the format says.

    Raises
    ------
    FormatError
        For a folder that cannot be written or holds files of these names that are not ours.
    InputError
        For an unknown format.

    References
    ----------
    .. [1] docs/start.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> line = sf.Path.polyline([[0, 0], [30, 0]])
    >>> run = sf.run(line, sf.Limits(feed=60, acceleration=500, jerk=20000))
    >>> sf.report(run, "line", formats=["csv"])
    ['setpoints.csv', 'run-path.json', 'law.h5', 'path.svg', 'motion.svg', 'report.html', 'run.json']
    """
    from splinefeed.reports.files import PATH
    from splinefeed.reports.record import documented, of_program

    expect("report(run, folder)", (run, Run), (folder, (str, os.PathLike)))
    wanted = tuple(formats)
    if unknown := [form for form in wanted if form not in SETPOINTS]:
        raise InputError(f"report: format {unknown[0]!r} is not known; choose from {', '.join(SETPOINTS)}")
    with staged(folder) as stage:
        said = {"source": {"text": PATH, "beside": True}, "command": ""}
        return write(documented(run, said), stage, formats=wanted, record=of_program(run), with_path=True)
