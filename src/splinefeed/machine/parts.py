"""The parts of an axis as frozen records; each field says what kind of quantity it is and which values it may take."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any

from splinefeed.errors import InputError
from splinefeed.machine.quantities import show
from splinefeed.records import ROTARY_AXES

#: Rounding of a unit, relative.
_ROUNDING = 1e-12

#: Gains of each kind of controller, and those that both have.
GAINS = {"pid": ("kp", "ki", "kd"), "p-pi": ("position_gain", "velocity_kp", "velocity_ki")}
FEED_FORWARD = ("velocity_feed_forward", "acceleration_feed_forward")
#: Units of all of them, in place of {} mm or rad.
GAIN_UNITS = {
    "kp": "V/{}", "ki": "V/{}/s", "kd": "V*s/{}", "position_gain": "1/s", "velocity_kp": "V*s/{}",
    "velocity_ki": "V/{}", "velocity_feed_forward": "V*s/{}", "acceleration_feed_forward": "V*s^2/{}",
}  # fmt: skip
#: Section, key, and the choices of another key of that section with which alone it is used.
_BELONGS = (
    ("transmission", "lead", "kind", ("screw", "belt")),
    ("transmission", "ratio", "kind", ("gear",)),
    ("drive", "speed_per_volt", "mode", ("velocity",)),
    ("drive", "bandwidth", "mode", ("velocity",)),
    ("drive", "force_per_volt", "mode", ("torque",)),
    *(("controller", gain, "kind", (kind,)) for kind, gains in GAINS.items() for gain in gains),
)
#: Those of them that are needed then.
_NEEDED = ("lead", "ratio", "speed_per_volt", "bandwidth", "force_per_volt", "kp", "position_gain", "velocity_kp")


def _kept(default: Any, rule: str, holds: Callable[[Any], bool], **more: Any) -> Any:
    """A field whose values keep a rule; None stands for absent where it is the default."""
    return field(default=default, metadata={"rule": rule, "holds": holds, **more})


def _finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


#: Rules of numbers, by name: how a message says it, and the test.
_RULES: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "positive": ("must be greater than 0", lambda value: _finite(value) and value > 0.0),
    "not negative": ("must not be negative", lambda value: _finite(value) and value >= 0.0),
    "any": ("must be a finite number", _finite),
}


def quantity(kind: str, rule: str = "positive", default: Any = MISSING, *, motor: bool = False) -> Any:
    """Make a field that holds a quantity of `kind` (see `quantities.KINDS`); motor: of the motor's motion."""
    return _kept(default, *_RULES[rule], kind=kind, motor=motor)


def number(rule: str, default: Any) -> Any:
    """Make a field that holds a number without a unit."""
    return _kept(default, *_RULES[rule], kind="number")


def count(low: int, high: int, default: Any = MISSING) -> Any:
    """Make a field that holds a whole number within bounds."""
    rule = f"must be a whole number from {low} to {high}"
    return _kept(default, rule, lambda value: _finite(value) and isinstance(value, int) and low <= value <= high)


def choice(*names: str, default: Any = MISSING) -> Any:
    """Make a field that holds one of some names."""
    return _kept(default, f"must be one of {', '.join(names)}", lambda value: value in names)


def words(default: Any = "") -> Any:
    """Make a field that holds text for people."""
    return _kept(default, "must be text", lambda value: isinstance(value, str))


def listed(rule: str, holds: Callable[[Any], bool]) -> Any:
    """Make a field that holds a list."""
    return _kept((), rule, lambda value: isinstance(value, list | tuple) and all(map(holds, value)))


def part(of: type[Any], key: str = "") -> dict[str, Any]:
    """Return metadata of a field with the record of a table; with `key`, those of all tables in [key], by axis."""
    return {"part": of, "key": key}


def rule_broken(described: Field[Any], value: Any) -> str | None:
    """Return the rule of a field that `value` breaks, in words, or None."""
    absent = value is None and described.default is None
    rule: str = described.metadata["rule"]
    return None if absent or described.metadata["holds"](value) else rule


@dataclass(frozen=True, kw_only=True)
class _Part:
    def __post_init__(self) -> None:
        """Refuse a value that its field does not allow, naming the field."""
        for described in fields(self):
            value = getattr(self, described.name)
            if "rule" in described.metadata and (rule := rule_broken(described, value)) is not None:
                raise InputError(f"{type(self).__name__.lower()}.{described.name}: {value!r}; {rule}")


#: Name in the file (`spindle.start`), field, value, and whether that is of rotary motion.
Said = tuple[str, Field[Any], Any, bool]


def values(record: Any, turns: tuple[bool, bool] = (False, True), place: str = "") -> Iterator[Said]:
    """Walk all that a record and its parts hold.

    Parameters
    ----------
    record : object
        A dataclass of fields as this module makes them.
    turns : (bool, bool), optional
        Whether the axis and its motor turn.
    place : str, optional
        Name of the record in the file, with a dot behind.

    Yields
    ------
    Said
        Name in the file, field, value, and whether that is of rotary motion.
    """
    for one in fields(record):
        value = getattr(record, one.name)
        if value is None or value == "" or not one.metadata:
            continue
        if "part" not in one.metadata:
            yield f"{place}{one.name}", one, value, turns[bool(one.metadata.get("motor"))]
        elif key := one.metadata["key"]:
            for axis, each in value.items():
                yield from values(each, (axis in ROTARY_AXES, True), f"{place}{key}.{axis}.")
        else:
            yield from values(value, turns, f"{place}{one.name}.")


@dataclass(frozen=True, kw_only=True)
class Motor(_Part):
    """A motor, rotary or linear.

    Parameters
    ----------
    rated_force, peak_force : float
        Torques, N*m; of a linear motor forces, N.
    rated_speed : float
        rad/s; of a linear motor mm/s.
    inertia : float
        kg*m^2; of a linear motor its moving mass, kg.
    motion : str, optional
        "rotary" or "linear".
    model, source : str, optional
        What it is called, and where the numbers are from.
    """

    rated_force: float = quantity("force", motor=True)
    peak_force: float = quantity("force", motor=True)
    rated_speed: float = quantity("speed", motor=True)
    inertia: float = quantity("inertia", motor=True)
    motion: str = choice("rotary", "linear", default="rotary")
    model: str = words()
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Drive(_Part):
    """What turns volts into motion.

    Parameters
    ----------
    mode : str
        "velocity": `speed_per_volt` of the axis, reached with a first-order lag; an inner PI loop of the given
        `bandwidth` holds that speed against friction. "torque": `force_per_volt` of the motor, reached with a
        first-order lag of the current.
    lag : float
        Time constant, s.
    speed_per_volt : float, optional
        mm/s/V or rad/s/V.
    bandwidth : float, optional
        Of the inner loop, rad/s.
    force_per_volt : float, optional
        N*m/V; of a linear motor N/V.
    source : str, optional
        Where the numbers are from.
    """

    mode: str = choice("velocity", "torque")
    lag: float = quantity("time")
    speed_per_volt: float | None = quantity("speed per volt", default=None)
    bandwidth: float | None = quantity("frequency", default=None)
    force_per_volt: float | None = quantity("force per volt", default=None, motor=True)
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Transmission(_Part):
    """What carries the motor's motion to the load.

    Parameters
    ----------
    kind : str
        "screw" or "belt" with a lead, "gear" with a ratio, or "direct" with neither.
    lead : float, optional
        mm/rad.
    ratio : float, optional
        Motor turns a turn of the axis.
    inertia : float, optional
        Of screw, pulleys and gears at the motor shaft, kg*m^2.
    backlash : float, optional
        Between motor and load, mm or rad.
    stiffness : float, optional
        Of the one compliance, N/mm or N*m/rad; without it the transmission is rigid.
    damping : float, optional
        Of the compliance, N*s/mm or N*m*s/rad.
    source : str, optional
        Where the numbers are from.
    """

    kind: str = choice("screw", "belt", "gear", "direct")
    lead: float | None = quantity("lead", default=None)
    ratio: float | None = number("positive", None)
    inertia: float = quantity("rotary inertia", "not negative", 0.0)
    backlash: float = quantity("position", "not negative", 0.0)
    stiffness: float | None = quantity("stiffness", default=None)
    damping: float = quantity("damping", "not negative", 0.0)
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Load(_Part):
    """What is moved.

    Parameters
    ----------
    inertia : float
        Mass of a linear axis, kg, or moment of inertia of a rotary one, kg*m^2.
    source : str, optional
        Where the number is from.
    """

    inertia: float = quantity("inertia")
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Friction(_Part):
    """Friction of the guide: |F| = viscous |v| + coulomb + (static - coulomb) / (1 + (v / stribeck_speed)^2).

    Parameters
    ----------
    coulomb : float, optional
        N or N*m.
    static : float, optional
        N or N*m; by default `coulomb`.
    stribeck_speed : float, optional
        mm/s or rad/s.
    viscous : float, optional
        N*s/mm or N*m*s/rad.
    source : str, optional
        Where the numbers are from.
    """

    coulomb: float = quantity("force", "not negative", 0.0)
    static: float | None = quantity("force", "not negative", None)
    stribeck_speed: float | None = quantity("speed", default=None)
    viscous: float = quantity("damping", "not negative", 0.0)
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Encoder(_Part):
    """An incremental encoder on the motor.

    Parameters
    ----------
    pulses : int
        A turn.
    multiplication : int, optional
        Edges that are counted of each pulse, 1 to 4.
    source : str, optional
        Where the numbers are from.
    """

    pulses: int = count(1, 100_000_000)
    multiplication: int = count(1, 4, 4)
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Scale(_Part):
    """A scale on the load.

    Parameters
    ----------
    resolution : float
        mm or rad.
    source : str, optional
        Where the number is from.
    """

    resolution: float = quantity("position")
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Controller(_Part):
    """The controller of an axis, once a servo period; volts out.

    Parameters
    ----------
    kind : str, optional
        "pid", or "p-pi": a position gain, then a velocity PI.
    kp, ki, kd : float, optional
        Of "pid", V/mm, V/mm/s, V*s/mm; of a rotary axis per rad.
    position_gain : float, optional
        Of "p-pi", 1/s.
    velocity_kp, velocity_ki : float, optional
        Of "p-pi", V*s/mm, V/mm; of a rotary axis per rad.
    filter : float, optional
        Time constant of the derivative, s.
    velocity_feed_forward : float, optional
        V*s/mm or V*s/rad. In "p-pi" it goes through the velocity loop: as large as velocity_kp it is the whole speed of
        the reference.
    acceleration_feed_forward : float, optional
        V*s^2/mm or V*s^2/rad.
    feedback : str
        What closes the loop: the "encoder" on the motor or the "scale" on the load.
    delay : int, optional
        Computing delay, 0 or 1 period.
    output_limit : float, optional
        V.
    output_bits : int, optional
        Of the converter; 0 for none.
    error_limit : float
        Error at which the axis has run away and is stopped, mm or rad.
    source : str, optional
        Where the gains are from.
    """

    kind: str = choice("pid", "p-pi", default="pid")
    kp: float = quantity("gain", "not negative", 0.0)
    ki: float = quantity("integral gain", "not negative", 0.0)
    kd: float = quantity("derivative gain", "not negative", 0.0)
    position_gain: float = quantity("position loop gain", "not negative", 0.0)
    velocity_kp: float = quantity("derivative gain", "not negative", 0.0)
    velocity_ki: float = quantity("gain", "not negative", 0.0)
    filter: float = quantity("time", "not negative", 0.0)
    velocity_feed_forward: float = quantity("derivative gain", "not negative", 0.0)
    acceleration_feed_forward: float = quantity("acceleration gain", "not negative", 0.0)
    feedback: str = choice("encoder", "scale")
    delay: int = count(0, 1, 0)
    output_limit: float = quantity("voltage", default=10.0)
    output_bits: int = count(0, 32, 0)
    error_limit: float = quantity("position")
    source: str = words()

    @property
    def gains(self) -> dict[str, float]:
        """The gains that this kind of controller uses, and its feed-forward, by name."""
        return {name: getattr(self, name) for name in (*GAINS[self.kind], *FEED_FORWARD)}


@dataclass(frozen=True, kw_only=True)
class AxisLimits(_Part):
    """The limits of an axis; one that is left out is infinite.

    Parameters
    ----------
    velocity, acceleration, jerk : float, optional
        mm/s, mm/s^2, mm/s^3 or rad/s, rad/s^2, rad/s^3.
    minimum, maximum : float, optional
        Ends of the travel, mm or rad; both or none.
    source : str, optional
        Where the numbers are from.
    """

    velocity: float | None = quantity("velocity", default=None)
    acceleration: float | None = quantity("acceleration", default=None)
    jerk: float | None = quantity("jerk", default=None)
    minimum: float | None = quantity("position", "any", default=None)
    maximum: float | None = quantity("position", "any", default=None)
    source: str = words()


#: Limits of an axis: name in Limits and in the file of a machine.
LIMITS_OF_AXIS = {f"axis_{name}": name for name in ("velocity", "acceleration", "jerk", "minimum", "maximum")}


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One axis of a machine, of which its limits are known.

    Parameters
    ----------
    name : str
        As paths name it.
    motion : str, optional
        "linear" or "rotary".
    limits : AxisLimits, optional
        mm and s, of a rotary axis rad.

    Raises
    ------
    InputError
        With a line for each fault.

    References
    ----------
    .. [1] docs/machines.md.

    Examples
    --------
    >>> from splinefeed.machine import Axis, AxisLimits
    >>> Axis(name="x", limits=AxisLimits(velocity=200.0)).rotary
    False
    """

    name: str
    motion: str = "linear"
    limits: AxisLimits = field(default_factory=AxisLimits, metadata=part(AxisLimits))

    def __post_init__(self) -> None:
        problems = [f"axis.{self.name}.{problem}" for problem in self.problems()]
        if problems:
            raise InputError("\n".join(problems))

    @property
    def rotary(self) -> bool:
        """Whether the axis turns: rad in place of mm, N*m in place of N."""
        return self.motion == "rotary"

    def values(self) -> Iterator[Said]:
        """Walk all that its parts hold, as `values` does."""
        return values(self, (self.rotary, True))

    def describe(self) -> str:
        """Return what follows for the axis from its parts, in words."""
        return f"Axis {self.name}: limits alone; its servo is not described"

    def problems(self) -> Iterator[str]:
        """Yield what does not fit between the parts, each with its place, `section.key: what; how to fix it`."""
        low, high = self.limits.minimum, self.limits.maximum
        if (low is None) != (high is None) or (low is not None and high is not None and not low < high):
            yield "limits.minimum: give both ends of the travel, limits.minimum less than limits.maximum"


@dataclass(frozen=True, kw_only=True)
class ServoAxis(Axis):
    """An axis with motor, drive, transmission and controller: one that can be simulated and tuned.

    Parameters
    ----------
    name, motion, limits : str, str, AxisLimits
        As of an `Axis`.
    motor, drive, transmission, load, controller : Motor, Drive, Transmission, Load, Controller
        The chain from volts to the load, and what gives the volts.
    friction : Friction, optional
        Of the guide; none by default.
    encoder : Encoder, optional
        On the motor.
    scale : Scale, optional
        On the load. One of the two closes the loop.

    Raises
    ------
    InputError
        With a line for each fault.

    References
    ----------
    .. [1] docs/machines.md.

    Examples
    --------
    >>> import splinefeed as sf
    >>> axis = sf.Machine.load("router").axes["x"]
    >>> round(axis.encoder_resolution, 6)  # mm
    0.01
    """

    motor: Motor = field(metadata=part(Motor))
    drive: Drive = field(metadata=part(Drive))
    transmission: Transmission = field(metadata=part(Transmission))
    load: Load = field(metadata=part(Load))
    friction: Friction = field(default_factory=Friction, metadata=part(Friction))
    encoder: Encoder | None = field(default=None, metadata=part(Encoder))
    scale: Scale | None = field(default=None, metadata=part(Scale))
    controller: Controller = field(metadata=part(Controller))

    @property
    def travel_per_motor(self) -> float:
        """Motion of the axis for one rad (or mm) of the motor: mm/rad, rad/rad or mm/mm."""
        if self.transmission.kind in ("screw", "belt"):
            return float(self.transmission.lead or 0.0)
        return 1.0 / self.transmission.ratio if self.transmission.kind == "gear" and self.transmission.ratio else 1.0

    @property
    def force_per_motor_force(self) -> float:
        """Force at the axis (N or N*m) for one N*m or N of the motor, by virtual work: 1 N*m is 1000 N*mm."""
        metres = 1000.0 if self.motor.motion == "rotary" and not self.rotary else 1.0
        return metres / self.travel_per_motor

    @property
    def motor_inertia(self) -> float:
        """Inertia of motor and transmission at the axis: N*s^2/mm (a thousandth of kg), or kg*m^2."""
        inertia = self.motor.inertia + self.transmission.inertia
        if self.motor.motion == "linear":
            return inertia / 1000.0
        return inertia * self.force_per_motor_force / self.travel_per_motor

    @property
    def load_inertia(self) -> float:
        """Inertia of the load at the axis: N*s^2/mm, or kg*m^2."""
        return self.load.inertia if self.rotary else self.load.inertia / 1000.0

    @property
    def encoder_resolution(self) -> float:
        """Motion of the axis for one count of the encoder, mm or rad; 0 without an encoder."""
        if self.encoder is None:
            return 0.0
        return 2.0 * math.pi * self.travel_per_motor / (self.encoder.pulses * self.encoder.multiplication)

    def values(self) -> Iterator[Said]:
        """Walk all that its parts hold, as `values` does."""
        return values(self, (self.rotary, self.motor.motion == "rotary"))

    def describe(self) -> str:
        """Return what follows for the axis from its parts, in words: inertias, peak force, an encoder count."""
        unit, factor = ("kg*m^2", 1.0) if self.rotary else ("kg", 1000.0)
        peak = show(self.motor.peak_force * self.force_per_motor_force, "force", self.rotary)
        count = f", one encoder count {show(self.encoder_resolution, 'position', self.rotary)}" if self.encoder else ""
        return (
            f"Axis {self.name}: {factor * self.motor_inertia:.4g} {unit} of motor and transmission beside "
            f"{factor * self.load_inertia:.4g} {unit} of load, peak {peak}{count}"
        )

    def problems(self) -> Iterator[str]:
        """Yield what does not fit between the parts, each with its place, `section.key: what; how to fix it`."""
        kind, controller, friction, limits = self.transmission.kind, self.controller, self.friction, self.limits
        if self.motor.motion == "linear" and (self.rotary or kind != "direct" or self.encoder is not None):
            yield "motor.motion: 'linear'; it needs a linear axis, transmission.kind 'direct' and a scale"
        elif self.motor.motion == "rotary" and kind not in (("gear", "direct") if self.rotary else ("screw", "belt")):
            fitting = "gear or direct" if self.rotary else "screw or belt"
            yield f"transmission.kind: {kind!r}; a rotary motor moves a {self.motion} axis by {fitting}"
        for section, key, chooser, choices in _BELONGS:
            part = getattr(self, section)
            chosen, given = getattr(part, chooser), getattr(part, key) not in (None, 0.0)
            if given != (chosen in choices) and (given or key in _NEEDED):
                what = "not used by" if given else "missing; needed by"
                yield f"{section}.{key}: {what} {section}.{chooser} {chosen!r}"
        if self.motor.peak_force < self.motor.rated_force:
            yield f"motor.peak_force: {self.motor.peak_force:g}; must not be below rated_force"
        if self.transmission.damping > 0.0 and self.transmission.stiffness is None:
            yield "transmission.damping: needs transmission.stiffness"
        if friction.static is not None and friction.static < friction.coulomb:
            yield f"friction.static: {friction.static:g}; must not be below friction.coulomb"
        elif friction.static not in (None, friction.coulomb) and friction.stribeck_speed is None:
            yield "friction.stribeck_speed: missing; needed when static differs from coulomb"
        if getattr(self, controller.feedback) is None:
            yield f"controller.feedback: {controller.feedback!r}; the axis has no {controller.feedback}"
        yield from super().problems()
        top = self.motor.rated_speed * self.travel_per_motor
        if limits.velocity is not None and limits.velocity > top * (1.0 + _ROUNDING):
            wanted, there = (show(value, "velocity", self.rotary) for value in (limits.velocity, top))
            yield f"limits.velocity: {wanted}; the motor's rated speed gives {there} at most"
