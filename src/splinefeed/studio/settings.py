"""What a page wants: settings as JSON or TOML, checked strictly, what they mean, and the runs of the last ones."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path as File
from typing import Any

import splinefeed as sf
from splinefeed import units
from splinefeed.errors import CurveError, FormatError, InputError, SplinefeedError, nearest
from splinefeed.files.source import toml_of
from splinefeed.interpolation import registry as methods
from splinefeed.machine import limits_toml
from splinefeed.planner.planning import STRATEGIES, strategy_for
from splinefeed.records import BY_AXIS
from splinefeed.runs.run import MotionJob, carry_out
from splinefeed.runs.settings import PAPER_LIMITS, PAPER_PERIOD, limited
from splinefeed.studio import sources
from splinefeed.telling import listening, percent
from splinefeed.workers import Mail

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
#: Those whose kind is checked before they are looked at.
_KINDS: dict[str, Any] = {"strategy": str | None}
_KINDS |= {
    name: type(USUAL[name]) for name in ("source", "tangential", "limits", "method", "corrections", "by_control")
}
#: Formats that a path is offered in.
PATHS = ("json", "dxf", "svg", "ngc")
#: Runs that a worker keeps at hand.
KEPT = 3
#: Stands for a feed where the program of the path says it.
_ANY_FEED = 1.0
#: Longest text of a machine that settings carry, and of settings in TOML.
LONGEST_MACHINE, LONGEST = 200_000, 6_000_000


class SettingsError(SplinefeedError):
    """Settings that cannot be run: words by the name of the field that they are about, such as `limits.feed`."""

    def __init__(self, problems: Mapping[str, str]) -> None:
        self.problems = dict(problems)
        super().__init__("; ".join(f"{field}: {words}" for field, words in self.problems.items()))


@dataclass(frozen=True, eq=False)
class Wanted(MotionJob):
    """Settings made into a job.

    Parameters
    ----------
    path : Path
        To drive along; this and the others of a MotionJob.
    given : mapping of str to object
        The settings, complete.
    origin : mapping of str to str
        What a record says of the path's source.
    """

    path: sf.Path
    given: Mapping[str, Any] = field(default_factory=dict)
    origin: Mapping[str, str] = field(default_factory=dict)

    @property
    def followed(self) -> bool:
        """Whether a machine's servo loops follow it; those of a tool path are not simulated."""
        return self.machine is not None and not self.path.needs_machine and self.machine.simulates(self.path.axes)


def complete(given: object) -> dict[str, Any]:
    """Complete settings with the usual ones.

    Parameters
    ----------
    given : mapping of str to object
        What a page says.

    Returns
    -------
    dict of str to object
        Every setting.

    Raises
    ------
    SettingsError
        For a name that is none, or a value of another kind.
    """
    if not isinstance(given, Mapping):
        raise SettingsError({"": "settings must be an object"})
    for name in given:
        if name not in USUAL:
            raise SettingsError({"": f"{str(name)[:40]!r} is not a setting; {nearest(name, USUAL)}"})
    settings = {**USUAL, **given}
    for name, kind in _KINDS.items():
        value = settings[name]
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise SettingsError({name: f"is {str(value)[:40]!r}, which is of the wrong kind"})
    if not 0 <= settings["corrections"] <= 100:
        raise SettingsError({"corrections": "must be from 0 to 100"})
    return settings


def to_toml(settings: Mapping[str, Any]) -> str:
    """The text of a file with all settings; a file of the user is named, not carried along."""
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("splinefeed studio: drop this file on the page to have these settings again"))
    document.update(_without_none(complete(settings)))
    return tomlkit.dumps(document)


def _without_none(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values without those that are None, which TOML has no word for."""
    given = {name: value for name, value in values.items() if value is not None}
    return {name: _without_none(value) if isinstance(value, Mapping) else value for name, value in given.items()}


def from_toml(text: str) -> dict[str, Any]:
    """Read settings from the text of a file.

    Parameters
    ----------
    text : str
        TOML.

    Returns
    -------
    dict of str to object
        Every setting.

    Raises
    ------
    FormatError
        For what is not TOML.
    SettingsError
        For what are no settings.
    """
    if len(text) > LONGEST:
        raise FormatError(f"settings have {len(text)} characters; at most {LONGEST} are read")
    return complete(toml_of(text, "settings", LONGEST))


def offer() -> dict[str, Any]:
    """What a page can choose from by name, with what it is; and the usual settings."""
    from splinefeed.reports.files import SETPOINTS

    return {
        "shapes": [{"name": name, "what": what, "example": example} for name, what, example in sf.shapes.describe()],
        "strategies": list(STRATEGIES),
        "methods": [{"name": name, "title": methods.method(name).title} for name in methods.methods()],
        "machines": [
            {"name": each.name, "title": each.title, "axes": bool(each.axes), "control": each.control is not None}
            for each in map(sf.Machine.load, sf.Machine.names())
        ],
        "setpoints": list(SETPOINTS),
        "paths": list(PATHS),
        "usual": USUAL,
    }


def resolve(given: object, folder: File) -> Wanted:
    """Find the path, limits and machine that settings mean.

    Parameters
    ----------
    given : mapping of str to object
        The settings.
    folder : Path
        Where uploads are.

    Returns
    -------
    Wanted
        The job.

    Raises
    ------
    SettingsError
        With every problem beside its field.
    """
    settings = complete(given)
    problems: dict[str, str] = {}

    def tried(field: str, make: Callable[..., Any], *given: Any, **more: Any) -> Any:
        """What `make` gives; None where it raises, and the problem beside the field."""
        try:
            return make(*given, **more)
        except SettingsError as error:
            problems.update(error.problems)
        except (SplinefeedError, OSError) as error:
            problems[field] = sources.words(error, folder)
        return None

    tried("method", methods.method, settings["method"])
    period = tried("period", _quantity, settings["period"], "time") or PAPER_PERIOD
    limits, notes = None, ()
    if (arm := tried("source", sources.arm_of, settings["source"], folder)) is not None:
        model, path, limits, file, robot = arm
        machine, origin, reading = None, sources.origin_of(file), {"robot": robot.name}
        notes = (*model.notes, "the limits are those of the arm, not of this page")
    elif "source" not in problems:
        smooth = tried("smooth", _quantity, settings["smooth"], "length")
        machine = tried("machine", machine_of, settings["machine"])
        if machine is not None and not machine.axes:
            problems["machine"] = f"{machine.name} has a control but no axes; choose another machine"
        found = tried(
            "source", sources.path_of, settings["source"], folder, smooth=smooth, tangential=settings["tangential"],
            unsaid=_unsaid(settings["limits"], machine),
        )  # fmt: skip
        if found is not None:
            read, origin, reading = found
            path, limits, notes = tried("limits.feed", _limits, settings["limits"], read, machine) or (read, None, ())
            if path is not read:  # feed moves have the feed that is given
                reading = {**reading, "cut_feed": _quantity(settings["limits"]["feed"], "feed")}
    strategy = None if limits is None else tried("strategy", strategy_for, limits, settings["strategy"])
    if problems or limits is None or strategy is None:
        raise SettingsError(problems)
    return Wanted(
        path, limits, machine, period, strategy, settings["method"], settings["corrections"], source=origin["text"],
        reading=reading, notes=notes, given=settings, origin=origin,
    )  # fmt: skip


def field_of(error: SplinefeedError) -> str:
    """The field that an error of the planner is about, as far as its words tell; empty for the whole."""
    name = re.split(r"[ :.]", str(error), maxsplit=1)[0]
    if name in limits_toml.KINDS:
        return f"limits.{name}"
    return name if name == "period" else "source" if isinstance(error, CurveError) else ""


def _quantity(value: Any, kind: str) -> float | None:
    """A quantity as text or number; None for an empty text."""
    if value is None or value == "":
        return None
    number = units.parse(value, kind)
    if not number > 0.0:
        raise InputError("must be greater than 0")
    return number


def machine_of(given: Any) -> sf.Machine | None:
    """The machine by its name, or from the text of a machine file."""
    if given is None or given == "":
        return None
    name, text = (given.get("name"), given.get("toml")) if isinstance(given, Mapping) else (given, None)
    if text is not None:
        if not isinstance(text, str) or len(text) > LONGEST_MACHINE:
            raise InputError(f"a machine file is text of at most {LONGEST_MACHINE} characters")
        return sf.Machine.parse(text, str(name)[:60])
    if name not in sf.Machine.names():
        raise InputError(f"{str(name)[:40]!r} is not a machine; there are {', '.join(sf.Machine.names())}")
    return sf.Machine.load(name)


def _limits(
    given: Mapping[str, Any], path: sf.Path, machine: sf.Machine | None
) -> tuple[sf.Path, sf.Limits, tuple[str, ...]]:
    """The path with its feeds as `limited` has it, limits as the fields say them, over those of the machine, and notes.

    SettingsError has problems by field.
    """
    said = {str(name): value for name, value in given.items() if value not in ("", None, {})}
    for name in BY_AXIS:
        if isinstance(said.get(name), str) and "=" in said[name]:
            said[name] = dict(limits_toml.by_axis(said[name]))
        elif isinstance(said.get(name), str) and "," in said[name]:
            said[name] = [each.strip() for each in said[name].split(",")]
    programmed = "feed" not in said and path.feeds is not None
    try:
        # a file of limits says a feed; here that of the program may stand in for it
        flat = limits_toml.flat_of({"feed": _ANY_FEED, **said} if programmed else said, "limits")
        if programmed:
            flat = {name: value for name, value in flat.items() if name != "feed"}
        return limited(path, flat, machine, assume=False)
    except InputError as error:
        problems = {}
        for problem in getattr(error, "problems", (str(error),)):
            name = re.split(r"[ :.]", problem, maxsplit=1)[0]
            known = name in limits_toml.KINDS or name == "travel"
            problems[f"limits.{name}" if known else "limits.feed"] = problem.partition(": ")[2] or problem
        raise SettingsError(problems) from error


def _unsaid(limits: Mapping[str, Any], machine: sf.Machine | None) -> dict[str, Any]:
    """How contours are linked to one motion where the source does not say it: as `splinefeed run` links them."""
    linking = {} if machine is None or machine.clearance is None else {"clearance": machine.clearance}
    try:
        feed = _quantity(limits.get("feed"), "feed")
    except InputError:  # the field of the limit says so
        feed = None
    return {**linking, "feed": PAPER_LIMITS.feed if feed is None else feed}


@dataclass
class Bench:
    """Folders of uploads and of files made, the mail to the server, and the last runs by their settings."""

    uploads: File
    made: File
    mail: Mail
    runs: dict[str, tuple[Wanted, sf.Run]] = field(default_factory=dict)
    said: str = ""

    def say(self, words: str) -> None:
        """Tell the page what is being done, once."""
        if words == self.said:
            return
        self.said = words
        self.mail.tell({"kind": "progress", "words": words})

    def done(self, requested: Mapping[str, Any], *, follow: bool = True) -> tuple[Wanted, sf.Run]:
        """The run of these settings, followed by its machine if `follow`; from the last ones where it is there."""
        key = json.dumps({**complete(requested), "follow": follow}, sort_keys=True)
        found = self.runs.pop(key, None) or self._run(resolve(requested, self.uploads), follow)
        self.runs[key] = found
        while len(self.runs) > KEPT:
            del self.runs[next(iter(self.runs))]
        return found

    def _run(self, wanted: Wanted, follow: bool) -> tuple[Wanted, sf.Run]:
        self.say(f"planning {wanted.path.name}, {wanted.strategy}")
        job = wanted if follow or not wanted.followed else replace(wanted, machine=None)
        with listening(lambda what, done, of: self.say(f"{what}: {percent(done, of)}")):
            return wanted, carry_out(job)
