"""Everything that splinefeed raises on purpose; each message names what is wrong, where, and the mend."""

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
