"""The parts of an axis as frozen records; each field says what kind of quantity it is and which values it may take."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Any

from splinefeed.errors import InputError
from splinefeed.machine.quantities import show

#: Rounding of a unit, relative.
_ROUNDING = 1e-12

#: Rules that a value must keep, by name: how a message says it, and the test.
RULES: dict[str, tuple[str, Callable[[float], bool]]] = {
    "positive": ("must be greater than 0", lambda value: value > 0.0),
    "not negative": ("must not be negative", lambda value: value >= 0.0),
    "not zero": ("must not be 0", lambda value: value != 0.0),
    "any": ("", lambda value: True),
}


#: Gains of each kind of controller, and those that both have.
GAINS = {"pid": ("kp", "ki", "kd"), "p-pi": ("position_gain", "velocity_kp", "velocity_ki")}
FEED_FORWARD = ("velocity_feed_forward", "acceleration_feed_forward")


def quantity(kind: str, rule: str = "positive", default: Any = MISSING, *, motor: bool = False) -> Any:
    """A field that holds a quantity of `kind` (see `quantities.KINDS`); motor: of the motor's motion."""
    return field(default=default, metadata={"kind": kind, "rule": rule, "motor": motor})


def number(rule: str, default: Any) -> Any:
    """A field that holds a number without a unit."""
    return field(default=default, metadata={"kind": "number", "rule": rule, "motor": False})


def count(lowest: int, highest: int, default: Any = MISSING) -> Any:
    """A field that holds a whole number within bounds."""
    return field(default=default, metadata={"lowest": lowest, "highest": highest})


def choice(*names: str, default: Any = MISSING) -> Any:
    """A field that holds one of some names."""
    return field(default=default, metadata={"choices": names})


def words(default: Any = "") -> Any:
    """A field that holds text for people."""
    return field(default=default, metadata={"text": True})


def value_problem(described: Field[Any], value: Any) -> str | None:
    """What is wrong with `value` for a field made by the functions above, in words, or None; None stands for absent."""
    metadata = described.metadata
    if value is None and described.default is None:
        return None
    if "choices" in metadata:
        if value not in metadata["choices"]:
            return f"{value!r}; must be one of {', '.join(metadata['choices'])}"
    elif "text" in metadata:
        if not isinstance(value, str):
            return f"{value!r}; must be text"
    elif "lowest" in metadata:
        if isinstance(value, bool) or not isinstance(value, int):
            return f"{value!r}; must be a whole number"
        if value < metadata["lowest"] and metadata["lowest"] == 1:
            return f"{value}; must be greater than 0"
        if not metadata["lowest"] <= value <= metadata["highest"]:
            return f"{value}; must lie between {metadata['lowest']} and {metadata['highest']}"
    else:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f"{value!r}; must be a number"
        if not math.isfinite(value):
            return f"{value}; must be finite"
        sentence, holds = RULES[metadata["rule"]]
        if not holds(value):
            return f"{value:g}; {sentence}"
    return None


@dataclass(frozen=True, kw_only=True)
class _Part:
    def __post_init__(self) -> None:
        """Refuse a value that its field does not allow, naming the field."""
        for described in fields(self):
            problem = value_problem(described, getattr(self, described.name)) if described.metadata else None
            if problem is not None:
                raise InputError(f"{type(self).__name__.lower()}.{described.name}: {problem}")


@dataclass(frozen=True, kw_only=True)
class Motor(_Part):
    """A motor: torques N*m, speed rad/s, inertia kg*m^2; a linear motor: forces N, speed mm/s, mass kg."""

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

    mode "velocity": speed_per_volt of the axis (mm/s/V or rad/s/V), reached with a first-order lag (s); an inner PI
    loop of the given bandwidth (rad/s) holds that speed against friction.
    mode "torque": force_per_volt of the motor (N*m/V or N/V), reached with a first-order lag (s) of the current.
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

    kind "screw" or "belt": lead, mm/rad; "gear": ratio, motor turns a turn of the axis; "direct": neither
    inertia   of screw, pulleys and gears at the motor shaft, kg*m^2
    backlash  between motor and load, mm or rad
    stiffness, damping  of the one compliance, N/mm and N*s/mm or N*m/rad and N*m*s/rad; without them it is rigid
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
    """What is moved: mass kg of a linear axis, or moment of inertia kg*m^2 of a rotary one."""

    inertia: float = quantity("inertia")
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Friction(_Part):
    """Friction of the guide: |F| = viscous |v| + coulomb + (static - coulomb) / (1 + (v / stribeck_speed)^2).

    coulomb, static  N or N*m; stribeck_speed  mm/s or rad/s; viscous  N*s/mm or N*m*s/rad. static follows coulomb
    by default.
    """

    coulomb: float = quantity("force", "not negative", 0.0)
    static: float | None = quantity("force", "not negative", None)
    stribeck_speed: float | None = quantity("speed", default=None)
    viscous: float = quantity("damping", "not negative", 0.0)
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Encoder(_Part):
    """An incremental encoder on the motor: pulses a turn, times the edges that are counted of each."""

    pulses: int = count(1, 100_000_000)
    multiplication: int = count(1, 4, 4)
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Scale(_Part):
    """A scale on the load: resolution, mm or rad."""

    resolution: float = quantity("position")
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Controller(_Part):
    """The controller of an axis, once a servo period; volts out.

    kind "pid"   kp V/mm, ki V/mm/s, kd V*s/mm (per rad on a rotary axis), derivative filtered with time constant filter
    kind "p-pi"  position_gain 1/s, then a velocity PI: velocity_kp V*s/mm, velocity_ki V/mm
    velocity_feed_forward V*s/mm, acceleration_feed_forward V*s^2/mm; filter s. In "p-pi" the first goes through the
               velocity loop: as large as velocity_kp it is the whole speed of the reference
    feedback   what closes the loop: the encoder on the motor or the scale on the load
    delay      computing delay, periods: 0 or 1
    output_limit V, output_bits of the converter (0: none)
    error_limit  error at which the axis has run away and is stopped, mm or rad
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
    """The limits of the axis: mm/s, mm/s^2, mm/s^3 (rad/s, ...), and the ends of its travel, mm or rad.

    A limit that is left out is infinite.
    """

    velocity: float | None = quantity("velocity", default=None)
    acceleration: float | None = quantity("acceleration", default=None)
    jerk: float | None = quantity("jerk", default=None)
    minimum: float | None = quantity("position", "any", default=None)
    maximum: float | None = quantity("position", "any", default=None)
    source: str = words()


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One axis of a machine. Raises InputError, one line for each fault, if its parts do not fit."""

    name: str
    motor: Motor
    drive: Drive
    transmission: Transmission
    load: Load
    controller: Controller
    friction: Friction = field(default_factory=Friction)
    encoder: Encoder | None = None
    scale: Scale | None = None
    limits: AxisLimits = field(default_factory=AxisLimits)
    motion: str = "linear"

    def __post_init__(self) -> None:
        problems = [f"axis.{self.name}.{problem}" for problem in self.problems()]
        if problems:
            raise InputError("\n".join(problems))

    @property
    def rotary(self) -> bool:
        """Whether the axis turns: rad in place of mm, N*m in place of N."""
        return self.motion == "rotary"

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

    def said(self, part: Any) -> Iterator[tuple[Field[Any], Any, bool]]:
        """Field, value, and whether that is of rotary motion, of all that one of its parts says."""
        for one in fields(part):
            value = getattr(part, one.name)
            if value is not None and value != "":
                yield one, value, self.motor.motion == "rotary" if one.metadata.get("motor") else self.rotary

    def problems(self) -> Iterator[str]:
        """What does not fit between the parts, each with its place, `section.key: what; how to fix it`."""
        kind = self.transmission.kind
        direct = kind == "direct"
        if self.motor.motion == "linear" and (self.rotary or not direct):
            yield "motor.motion: 'linear'; a linear motor needs a linear axis and transmission.kind 'direct'"
        elif direct and not self.rotary and self.motor.motion == "rotary":
            yield "transmission.kind: 'direct'; a rotary motor moves a linear axis by a screw or a belt"
        if self.rotary != (kind == "gear") and not direct:
            fitting = "gear" if self.rotary else "screw or belt"
            yield f"transmission.kind: {kind!r}; a {self.motion} axis takes {fitting}"
        for key, kinds in (("lead", ("screw", "belt")), ("ratio", ("gear",))):
            given = getattr(self.transmission, key) is not None
            if given != (kind in kinds):
                what = "not used by" if given else "missing; needed by"
                yield f"transmission.{key}: {what} transmission.kind {kind!r}"
        wanted = ("speed_per_volt", "bandwidth") if self.drive.mode == "velocity" else ("force_per_volt",)
        for key in ("speed_per_volt", "bandwidth", "force_per_volt"):
            given = getattr(self.drive, key) is not None
            if given != (key in wanted):
                what = "not used by" if given else "missing; needed by"
                yield f"drive.{key}: {what} drive.mode {self.drive.mode!r}"
        if self.motor.peak_force < self.motor.rated_force:
            yield f"motor.peak_force: {self.motor.peak_force:g}; must not be below rated_force"
        if self.transmission.damping > 0.0 and self.transmission.stiffness is None:
            yield "transmission.damping: needs transmission.stiffness"
        static = self.friction.static
        if static is not None and static < self.friction.coulomb:
            yield f"friction.static: {static:g}; must not be below friction.coulomb"
        if static is not None and static > self.friction.coulomb and self.friction.stribeck_speed is None:
            yield "friction.stribeck_speed: missing; needed when static differs from coulomb"
        if self.encoder is not None and self.motor.motion == "linear":
            yield "encoder: a linear motor has none; give a scale"
        if getattr(self, self.controller.feedback) is None:
            yield f"controller.feedback: {self.controller.feedback!r}; the axis has no {self.controller.feedback}"
        for sort, keys in GAINS.items():
            for key in keys:
                if sort != self.controller.kind and getattr(self.controller, key) != 0.0:
                    yield f"controller.{key}: not used by controller.kind {self.controller.kind!r}"
        needed = "kp" if self.controller.kind == "pid" else "position_gain"
        if getattr(self.controller, needed) == 0.0:
            yield f"controller.{needed}: 0; must be greater than 0"
        if self.controller.kind == "p-pi" and self.controller.velocity_kp == 0.0:
            yield "controller.velocity_kp: 0; must be greater than 0"
        yield from self._limit_problems()

    def _limit_problems(self) -> Iterator[str]:
        """What does not fit in the limits: travel with one end, or none left, and more speed than the motor has."""
        low, high = self.limits.minimum, self.limits.maximum
        if (low is None) != (high is None):
            yield f"limits.{'minimum' if low is None else 'maximum'}: missing; give both ends of the travel"
        elif low is not None and high is not None and not low < high:
            yield "limits.minimum: must be less than limits.maximum"
        top = self.motor.rated_speed * self.travel_per_motor
        if self.limits.velocity is not None and self.limits.velocity > top * (1.0 + _ROUNDING):
            wanted, there = (show(value, "velocity", self.rotary) for value in (self.limits.velocity, top))
            yield f"limits.velocity: {wanted}; the motor's rated speed gives {there} at most"
