"""Everything that splinefeed raises on purpose; each message names what is wrong, where, and how to fix it."""

from __future__ import annotations


class SplinefeedError(Exception):
    """The root: catch this to catch every error that splinefeed raises on purpose."""


class InputError(SplinefeedError, ValueError):
    """A value that was handed in cannot be used."""


class CurveError(InputError):
    """A curve or a path that cannot be: wrong knots, weights, points, or ends that do not meet."""


class LimitsError(InputError):
    """Limits or periods that are not positive, not finite, or contradict each other."""


class UnitError(InputError):
    """A quantity whose unit is unknown or of the wrong kind."""


class MethodError(InputError):
    """An interpolation method that is not registered, or cannot be."""


class FormatError(InputError):
    """A file that cannot be read or written; the message begins with the file and the place in it."""


class PlanError(SplinefeedError):
    """No time law exists under these limits; the message says which length or feed would do."""


#: Words for the first, second and third place of a call.
_PLACES = ("first", "second", "third")


def expect(call: str, *given: tuple[object, type | tuple[type, ...]]) -> None:
    """InputError unless what stands in each place of a call is of its type; `call` is written with its order.

    Example: `expect("check(setpoints, path, limits)", (points, Setpoints), (path, Path), (limits, Limits))`
    """
    for place, (value, types) in zip(_PLACES, given, strict=False):
        if not isinstance(value, types):
            wanted = types[0] if isinstance(types, tuple) else types
            raise InputError(
                f"{call.partition('(')[0]}: expected {wanted.__name__} {place}, got {type(value).__name__}; "
                f"the order is {call}"
            )
