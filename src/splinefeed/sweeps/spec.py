"""What a sweep asks: a TOML file with sources, and grids, lists or distributions over settings."""

from __future__ import annotations

import fnmatch
import glob
import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from splinefeed import units
from splinefeed.errors import FormatError, InputError, ProblemsError, nearest
from splinefeed.files.source import check_size, read_text, toml_of
from splinefeed.interpolation import registry
from splinefeed.machine import limits_toml
from splinefeed.machine.machine import Machine
from splinefeed.paths import shapes
from splinefeed.planner.planning import STRATEGIES
from splinefeed.records import BY_AXIS

#: More runs than this are refused as a mistake.
MOST_RUNS = 100_000_000
#: More values than this of one setting in a grid or a list.
MOST_VALUES = 1_000_000
#: Largest file of a sweep, bytes: its lists may be long.
MAX_BYTES = 2**24
#: Largest source file, bytes.
MOST_SOURCE_BYTES = 2**34
#: Most source files of one sweep, and names looked at to find them.
MOST_SOURCES, MOST_NAMES = 100_000, 200_000
#: Settings that are no limit and no part of a machine.
PLAIN = ("strategy", "method", "period", "corrections", "machine")
_TOP = ("name", "seed", "sources", "set", "grid", "list", "random", "output")
_OUTPUT = ("setpoints", "reports")
#: Distributions of two numbers.
DISTRIBUTIONS = ("uniform", "loguniform", "normal")

Settings = dict[str, Any]


class SpecError(ProblemsError):
    """A sweep file with errors: the first line names the file, each of `problems` its place and how to fix it."""


@dataclass(frozen=True)
class Task:
    """One run of a sweep.

    Parameters
    ----------
    index : int
        Its number, from 0.
    source : str
        File or shape.
    settings : Settings
        Every setting that is not the usual one, in mm, s and rad.
    """

    index: int
    source: str
    settings: Settings


@dataclass(frozen=True)
class Sweep:
    """All runs of a sweep, made one by one when they are needed.

    Parameters
    ----------
    name : str
        Of the sweep.
    sources : tuple of str
        Files and shapes.
    fixed : Settings
        Settings of every run.
    grid : mapping of str to tuple
        Values by setting: every combination.
    listed : mapping of str to tuple
        Values by setting, side by side, all of one length.
    random : mapping of str to (str, tuple)
        Distribution by setting, and its numbers.
    count : int
        Draws of all of them, the same for every source and combination.
    seed : int
        Of the draws.
    setpoints, reports : bool, optional
        Whether they are kept of every run.
    """

    name: str
    sources: tuple[str, ...]
    fixed: Settings
    grid: Mapping[str, tuple[Any, ...]]
    listed: Mapping[str, tuple[Any, ...]]
    random: Mapping[str, tuple[str, tuple[Any, ...]]]
    count: int
    seed: int
    setpoints: bool = False
    reports: bool = False

    @cached_property
    def varied(self) -> tuple[str, ...]:
        """Settings that are not the same in every run, in the order of the dataset's columns."""
        return tuple(dict.fromkeys([*self.grid, *self.listed, *self.random]))

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """How many sources, values of each setting in the grid, rows of the lists, and draws there are."""
        rows = len(next(iter(self.listed.values()))) if self.listed else 1
        return (len(self.sources), *(len(values) for values in self.grid.values()), rows, self.count)

    @property
    def count_of_runs(self) -> int:
        """How many runs there are, however many: `len` ends at what an index of Python holds."""
        return math.prod(self.sizes)

    def __len__(self) -> int:
        return self.count_of_runs

    def task(self, index: int) -> Task:
        """Return one run.

        Parameters
        ----------
        index : int
            Its number: the last setting varies fastest.

        Returns
        -------
        Task
            Random draws depend on seed and draw number alone.
        """
        if not 0 <= index < len(self):
            raise InputError(f"run {index} is not one of the {len(self)} runs of the sweep")
        source, *combination, row, draw = (int(k) for k in np.unravel_index(index, self.sizes))
        settings = dict(self.fixed)
        settings |= {name: values[k] for (name, values), k in zip(self.grid.items(), combination, strict=True)}
        settings |= {name: values[row] for name, values in self.listed.items()}
        if self.random:
            generator = np.random.default_rng([self.seed, draw])
            settings |= {name: _draw(generator, *self.random[name]) for name in sorted(self.random)}
        return Task(index, self.sources[source], settings)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that the results depend on, the contents of the source files included."""
        files = {}
        for source in self.sources:
            if os.path.isfile(source):
                check_size(source, MOST_SOURCE_BYTES)
                try:
                    with open(source, "rb") as stream:
                        # a file of the system that says that it is empty may go on for ever
                        empty = not os.fstat(stream.fileno()).st_size
                        files[source] = "" if empty else hashlib.file_digest(stream, "sha256").hexdigest()
                except OSError as error:
                    raise FormatError(f"{source}: cannot be read: {error.strerror or error}") from None
        said = [self.sources, files, self.fixed, dict(self.grid), dict(self.listed), dict(self.random)]
        text = json.dumps([*said, self.count, self.seed], sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()


def read(source: str | os.PathLike[str]) -> Sweep:
    """Read the sweep in a TOML file, whose files are looked for from its folder.

    Parameters
    ----------
    source : path
        The file.

    Returns
    -------
    Sweep
        In mm, s and rad.

    Raises
    ------
    SpecError
        With every error at once.
    """
    text = read_text(source, "a sweep", MAX_BYTES)
    return from_dict(toml_of(text, str(source), MAX_BYTES), str(source), Path(source).parent)


def from_dict(content: Mapping[str, Any], source: str = "sweep", folder: Path | None = None) -> Sweep:
    """Make the sweep of a dict as the TOML file has it.

    Parameters
    ----------
    content : mapping
        Of the file.
    source : str, optional
        What messages call it.
    folder : Path, optional
        Where relative names of files begin.

    Returns
    -------
    Sweep
        In mm, s and rad.

    Raises
    ------
    SpecError
        With every error at once.
    """
    problems: list[str] = []
    base = folder or Path()

    def tried(place: str, check: Callable[..., Any], *given: Any) -> Any:
        """What a check gives; None, and a problem at its place, where it raises."""
        try:
            return check(*given)
        except InputError as error:
            problems.append(f"{place}: {error}")
            return None

    for key in content:
        if key not in _TOP:
            problems.append(f"{key}: is not part of a sweep; {nearest(key, _TOP)}")
    tables = {key: tried(key, _flat, content.get(key, {})) or {} for key in ("set", "grid", "list", "random", "output")}
    seed = tried("seed", _whole, content.get("seed", 0), 0, math.inf)
    count = tried("random.count", _whole, tables["random"].pop("count", 1), 1, MOST_RUNS)
    sources = tried("sources", _sources, content.get("sources"), base)
    checks = {"set": checked, "grid": _values, "list": _values, "random": _distribution}
    made = {
        table: {name: tried(f"{table}.{name}", check, name, given, base) for name, given in tables[table].items()}
        for table, check in checks.items()
    }
    lengths = {name: len(values) for name, values in made["list"].items() if values}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"{name} has {length} values" for name, length in lengths.items())
        problems.append(f"list: {said}; give all as many")
    names = [name for table in made.values() for name in table]
    for name in {name for name in names if names.count(name) > 1}:
        problems.append(f"{name}: is in two tables; leave one out")
    for key, value in tables["output"].items():
        if key not in _OUTPUT or not isinstance(value, bool):
            problems.append(f"output.{key}: write setpoints = true or reports = true")
    if problems:
        raise SpecError(source, problems)
    sweep = Sweep(
        name=str(content.get("name", Path(source).stem)),
        sources=sources,
        fixed=made["set"],
        grid=made["grid"],
        listed=made["list"],
        random=made["random"],
        count=count,
        seed=seed,
        **tables["output"],
    )
    if sweep.count_of_runs > MOST_RUNS:
        many = " x ".join(str(size) for size in sweep.sizes if size > 1)
        raise SpecError(source, [f"{many} runs; at most {MOST_RUNS} in one sweep"])
    return sweep


def _flat(table: Any, prefix: str = "") -> dict[str, Any]:
    """Nested tables as one, names joined by dots: limits.feed may be written either way."""
    if not isinstance(table, Mapping):
        raise InputError("write a table in brackets")
    out: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping) and not (len(value) == 1 and next(iter(value)) in DISTRIBUTIONS):
            out |= _flat(value, f"{prefix}{key}.")
        else:
            out[f"{prefix}{key}"] = value
    return out


def _whole(given: Any, least: int, most: float) -> int:
    if not isinstance(given, int) or isinstance(given, bool) or not least <= given <= most:
        raise InputError(f"{given!r} must be a whole number from {least}{f' to {most}' if most < math.inf else ''}")
    return given


def _sources(given: Any, folder: Path) -> tuple[str, ...]:
    if not isinstance(given, list) or not given or not all(isinstance(each, str) for each in given):
        raise InputError('write a list of files, patterns and shapes, such as ["parts/*.dxf", "butterfly"]')
    found: list[str] = []
    for each in given:
        if shapes.is_shape(each) and not (folder / each).exists():
            found.append(each)
            continue
        names = sorted(_matching(folder, each)) if glob.has_magic(each) else [str(folder / each)]
        names = [name for name in names if os.path.isfile(name)]
        if not names:
            raise InputError(f"{each[:200]}: no such file or shape, and no file matches it as a pattern")
        found += names
        if len(found) > MOST_SOURCES:
            raise InputError(f"{each[:200]}: more than {MOST_SOURCES} files; make several sweeps of them")
    return tuple(dict.fromkeys(found))


def _matching(folder: Path, pattern: str) -> list[str]:
    """Files and folders that match `pattern`, ** being folders in folders; links to folders are not followed there.

    InputError where more than MOST_NAMES are looked at: /proc or a whole disk.
    """
    whole = folder / pattern
    found: list[str] = []
    looked_at = 0

    def entries(place: str) -> list[os.DirEntry[str]]:
        nonlocal looked_at
        with suppress(OSError), os.scandir(place) as listed:
            inside = [each for each in listed if not each.name.startswith(".")]
            looked_at += len(inside)
            if looked_at > MOST_NAMES:
                raise InputError(f"{pattern[:200]}: more than {MOST_NAMES} names to look at; name a smaller folder")
            return inside
        return []

    def walk(place: str, parts: tuple[str, ...]) -> None:
        if not parts:
            found.append(place)
            return
        head, rest = parts[0], parts[1:]
        if head == "**":
            walk(place, rest or ("*",))
            for entry in entries(place):
                if entry.is_dir(follow_symlinks=False):
                    walk(entry.path, parts)
        elif glob.has_magic(head):
            for entry in entries(place):
                if fnmatch.fnmatchcase(entry.name, head):
                    walk(entry.path, rest)
        elif os.path.lexists(os.path.join(place, head)):
            walk(os.path.join(place, head), rest)

    parts = tuple(part for k, part in enumerate(whole.parts) if not (k and part == whole.parts[k - 1] == "**"))
    walk(parts[0] if whole.is_absolute() else ".", parts[whole.is_absolute() :])
    return [os.path.normpath(name) for name in found]


def _values(name: str, given: Any, base: Path) -> tuple[Any, ...]:
    if not isinstance(given, list) or not given:
        raise InputError("write a list of values")
    if len(given) > MOST_VALUES:
        raise InputError(f"has {len(given)} values; at most {MOST_VALUES} of one setting are taken")
    if any(isinstance(each, list) for each in given):
        raise InputError("one value of a list is a list itself; vary the axes by name, such as limits.axis_jerk.x")
    return tuple(checked(name, each, base) for each in given)


def _distribution(name: str, given: Any, base: Path) -> tuple[str, tuple[Any, ...]]:
    """Name and numbers of a distribution, numbers in mm, s and rad, or ("choice", values)."""
    if not isinstance(given, Mapping):
        return "choice", _values(name, given, base)
    kind, numbers = next(iter(given.items()))
    if name in PLAIN and name != "period":
        raise InputError("is not a number; give a list to choose from")
    values = _values(name, numbers, base)
    if len(values) != 2 or (kind != "normal" and not values[0] < values[1]):
        raise InputError(f"{kind} takes two numbers{', the smaller first' * (kind != 'normal')}, not {numbers}")
    return kind, values


def checked(name: str, given: Any, base: Path) -> Any:
    """Return the value of a setting as runs take it.

    Parameters
    ----------
    name : str
        Of the setting.
    given : object
        As a file has it.
    base : Path
        Where relative names of files begin.

    Returns
    -------
    object
        In mm, s and rad.

    Raises
    ------
    InputError
        For a setting or a value that cannot be.
    """
    kind, _, rest = name.partition(".")
    if kind == "limits" and rest:
        limit, _, axis = rest.partition(".")
        if limit in limits_toml.KINDS and (not axis or limit in BY_AXIS):
            if isinstance(given, list) and limit in BY_AXIS and not axis:
                limits_toml.in_order({limit: given}, ())  # refuses what is no quantity
                return given
            return limits_toml.axis_value(limit, axis or "x", given)
        raise InputError(f"{rest!r} is not a limit; {nearest(limit, limits_toml.KINDS)}")
    if kind == "machine" and rest:
        if len(rest.split(".")) != 3:
            raise InputError("write machine.AXIS.PART.FIELD, such as machine.x.load.inertia: a multiple of its value")
        if isinstance(given, bool) or not isinstance(given, int | float) or not 0.0 < given < math.inf:
            raise InputError(f"{given!r} must be a number above 0: a multiple of what the machine file says")
        return float(given)
    if name == "period":
        return units.parse(given, "time")
    if name == "corrections":
        return _whole(given, 0, 100)
    if name == "strategy":
        if given not in STRATEGIES:
            raise InputError(f"{given!r} is not a strategy; {nearest(str(given), STRATEGIES)}")
        return given
    if name == "method":
        return registry.method(str(given)).name
    if name == "machine":
        if given in Machine.names():
            return given
        Machine.load(base / str(given))
        return str(base / str(given))
    raise InputError(f"is not a setting; {nearest(name, [*PLAIN, 'limits.feed', 'machine.x.load.inertia'])}")


def _draw(generator: np.random.Generator, kind: str, numbers: tuple[Any, ...]) -> Any:
    if kind == "choice":
        return numbers[int(generator.integers(len(numbers)))]
    first, second = numbers
    if kind == "loguniform":
        return float(math.exp(generator.uniform(math.log(first), math.log(second))))
    return float(getattr(generator, kind)(first, second))
