"""What a page asks for: settings as JSON, checked strictly, and the path, limits and machine that they mean."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path as File
from typing import Any

from splinefeed import units
from splinefeed.errors import CurveError, InputError, SplinefeedError
from splinefeed.feed.planning import STRATEGIES, strategy_for
from splinefeed.formats import limits_toml
from splinefeed.geometry.path import Path
from splinefeed.geometry.tool_path import ToolPath
from splinefeed.interpolation import registry as methods
from splinefeed.kinematics import JointPath
from splinefeed.machine.machine import Machine, MachineError
from splinefeed.pipeline.run import PAPER_PERIOD, on_machine, planned_axes
from splinefeed.pipeline.settings import at_programmed_feeds, completed
from splinefeed.records import BY_AXIS, Limits
from splinefeed.studio import sources

#: All that settings may say, with what holds where they are silent; without a strategy the limits choose it.
USUAL: dict[str, Any] = {
    "source": {"shape": "butterfly"},
    "tangential": False,
    "smooth": "",
    "limits": {"feed": "60", "axis_acceleration": "500", "axis_jerk": "20000"},
    "strategy": None,
    "method": methods.DEFAULT_METHOD,
    "corrections": 1,
    "period": "1 ms",
    "machine": None,
    "by_control": False,  # a whole program, as the control of the machine plans it
}
#: Stands for a feed where the program of the path says it.
_ANY_FEED = 1.0
#: Longest text of a machine that settings carry.
LONGEST_MACHINE = 200_000


class SettingsError(SplinefeedError):
    """Settings that cannot be run: words by the name of the field that they are about, such as `limits.feed`."""

    def __init__(self, problems: Mapping[str, str]) -> None:
        self.problems = dict(problems)
        super().__init__("; ".join(f"{field}: {words}" for field, words in self.problems.items()))


@dataclass(frozen=True, eq=False)
class Wanted:
    """Settings made into what `run` takes.

    given  the settings, complete; notes  what was assumed, one sentence each; origin  where the path came from
    strategy  the one that plans, chosen by the limits where none is named
    """

    given: Mapping[str, Any]
    path: Path
    origin: sources.Origin
    limits: Limits
    strategy: str
    method: str
    corrections: int
    period: float
    machine: Machine | None
    notes: tuple[str, ...]

    @cached_property
    def moved(self) -> Path | JointPath:
        """What is planned: the path, or joints of the machine for a path with a tool axis."""
        return on_machine(self.path, self.machine if isinstance(self.path, ToolPath) else None, self.limits)

    @property
    def followed(self) -> bool:
        """Whether a machine's servo loops follow it; those of a tool path are not simulated."""
        return self.machine is not None and not isinstance(self.path, ToolPath)


def key_of(settings: Mapping[str, Any]) -> str:
    """The same text for the same settings."""
    return json.dumps(settings, sort_keys=True, separators=(",", ":"))


def complete(given: object) -> dict[str, Any]:
    """`given` with every setting said; SettingsError for a name that is none or a value of another kind."""
    if not isinstance(given, Mapping):
        raise SettingsError({"": "settings must be an object"})
    for name in given:
        if name not in USUAL:
            close = difflib.get_close_matches(str(name), USUAL, n=1)
            hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(USUAL)}"
            raise SettingsError({"": f"{str(name)[:40]!r} is not a setting; {hint}"})
    settings = {**USUAL, **given}
    for name in ("source", "tangential", "limits", "strategy", "method", "by_control"):
        kind = str | None if name == "strategy" else type(USUAL[name])
        if not isinstance(settings[name], kind):
            raise SettingsError({name: f"is {str(settings[name])[:40]!r}, which is of the wrong kind"})
    corrections = settings["corrections"]
    if isinstance(corrections, bool) or not isinstance(corrections, int) or not 0 <= corrections <= 100:
        raise SettingsError({"corrections": "must be a whole number from 0 to 100"})
    return settings


def resolve(given: object, folder: File) -> Wanted:
    """The path, limits and machine that settings mean; folder: where uploads are.

    Raises SettingsError with every problem beside its field.
    """
    settings = complete(given)
    problems: dict[str, str] = {}
    strategy, method = settings["strategy"], settings["method"]
    if strategy is not None and strategy not in STRATEGIES:
        problems["strategy"] = f"{strategy[:40]!r} is not known; there are {', '.join(STRATEGIES)}"
    if method not in methods.methods():
        problems["method"] = f"{method[:40]!r} is not known; there are {', '.join(methods.methods())}"
    period = _quantity(settings["period"], "time", "period", problems) or PAPER_PERIOD
    smooth = _quantity(settings["smooth"], "length", "smooth", problems)
    machine = machine_of(settings["machine"], problems)
    if machine is not None and not machine.axes:
        problems["machine"] = f"{machine.name} has a control but no axes; choose another machine"
    try:
        path, origin = sources.path_of(settings["source"], folder, smooth=smooth, tangential=settings["tangential"])
    except (SplinefeedError, OSError) as error:
        raise SettingsError({**problems, "source": sources.words(error, folder)}) from error
    notes: list[str] = []
    limits = _limits(settings["limits"], path, machine, problems, notes)
    if problems or limits is None:
        raise SettingsError(problems)
    try:
        strategy = strategy_for(limits, strategy)
    except SplinefeedError as error:
        raise SettingsError({"strategy": str(error)}) from error
    return Wanted(
        given=settings,
        path=path,
        origin=origin,
        limits=limits,
        strategy=strategy,
        method=method,
        corrections=settings["corrections"],
        period=period,
        machine=machine,
        notes=tuple(notes),
    )


def field_of(error: SplinefeedError) -> str:
    """The field that an error of the planner is about, as far as its words tell; empty for the whole."""
    name = re.split(r"[ :.]", str(error), maxsplit=1)[0]
    if name in limits_toml.KINDS:
        return f"limits.{name}"
    if name == "period":
        return name
    return "source" if isinstance(error, CurveError) else ""


def _quantity(value: object, kind: str, field: str, problems: dict[str, str]) -> float | None:
    """A quantity as text or number; None for an empty text, and for one that is wrong."""
    if value is None or value == "":
        return None
    try:
        if isinstance(value, bool) or not isinstance(value, str | int | float):
            raise InputError(f"{str(value)[:40]!r} is not a quantity")
        number = units.parse(value, kind)
        if number <= 0.0:
            raise InputError("must be greater than 0")
        return number
    except InputError as error:
        problems[field] = str(error)
        return None


def machine_of(given: object, problems: dict[str, str]) -> Machine | None:
    """The machine by its name, or from the text of a machine file."""
    if given is None or given == "":
        return None
    name = given.get("name") if isinstance(given, Mapping) else given
    text = given.get("toml") if isinstance(given, Mapping) else None
    if not isinstance(name, str) or not (text is None or isinstance(text, str)):
        problems["machine"] = "must be the name of a machine"
        return None
    if text is None and name not in Machine.names():
        problems["machine"] = f"{name[:40]!r} is not a machine; there are {', '.join(Machine.names())}"
        return None
    if text is not None and len(text) > LONGEST_MACHINE:
        problems["machine"] = f"the machine file has {len(text)} characters; at most {LONGEST_MACHINE} are read"
        return None
    try:
        return Machine.load(name) if text is None else Machine.parse(text, name[:60])
    except MachineError as error:
        problems["machine"] = "; ".join(error.problems)
    except InputError as error:
        problems["machine"] = str(error)
    return None


def _limits(
    given: Mapping[str, Any], path: Path, machine: Machine | None, problems: dict[str, str], notes: list[str]
) -> Limits | None:
    """Limits as the fields say them, over those of the machine; None where one is wrong."""
    said = {str(name): value for name, value in given.items() if value not in ("", None, {})}
    for name in BY_AXIS:
        if isinstance(said.get(name), str) and "=" in said[name]:
            said[name] = dict(limits_toml.by_axis(said[name]))
    programmed = "feed" not in said and path.feeds is not None
    try:
        # the feed of a program stands in below; here another one lets all else be checked
        flat = limits_toml.from_content({"feed": _ANY_FEED, **said} if programmed else said, "limits").as_dict()
        limits = completed(flat, machine, planned_axes(path, machine), assume=False)
    except limits_toml.LimitsFileError as error:
        for problem in error.problems:
            name, _, words = problem.partition(": ")
            kind = name.partition(".")[0]
            known = kind in limits_toml.KINDS or kind == "travel"
            problems[f"limits.{kind}" if known else "limits.feed"] = (words or problem) if known else problem
        return None
    except InputError as error:
        problems[field_of(error) or "limits.feed"] = str(error)
        return None
    if programmed:
        limits, assumed = at_programmed_feeds(limits, path)
        notes += assumed
    return limits
