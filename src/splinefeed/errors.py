"""Everything that splinefeed raises on purpose; each message names what is wrong, where, and how to fix it."""

from __future__ import annotations

from collections.abc import Iterable


class SplinefeedError(Exception):
    """The root: catch this to catch every error that splinefeed raises on purpose.

    References
    ----------
    .. [1] docs/api/errors.md

    Examples
    --------
    >>> import splinefeed as sf
    >>> try:
    ...     sf.Limits(feed=-60)
    ... except sf.SplinefeedError as error:
    ...     print(type(error).__name__)
    LimitsError
    """


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


#: Longest words on one fault of several, letters: a value may be a list of thousands.
LONGEST_PROBLEM = 400


class ProblemsError(FormatError):
    """A file with several faults: the first line names the file, each other one a place and how to fix it.

    Parameters
    ----------
    name : object
        The file.
    problems : iterable of str
        One for each fault; long ones are cut.
    """

    def __init__(self, name: object, problems: Iterable[str]) -> None:
        self.problems = tuple(
            each if len(each) <= LONGEST_PROBLEM else f"{each[:LONGEST_PROBLEM]}..." for each in problems
        )
        head = self.problems[0] if len(self.problems) == 1 else f"{len(self.problems)} errors"
        rest = [f"  {problem}" for problem in self.problems] if len(self.problems) > 1 else []
        super().__init__("\n".join([f"{name}: {head}", *rest]))


class PlanError(SplinefeedError):
    """No time law exists under these limits; the message says which length or feed would do."""


#: Words for the first, second and third place of a call.
_PLACES = ("first", "second", "third")


def expect(call: str, *given: tuple[object, type | tuple[type, ...]]) -> None:
    """Refuse a call whose arguments are of other types.

    Parameters
    ----------
    call : str
        The call, written with its order.
    *given : tuple
        What stands in each place of the call, and its type or types.

    Raises
    ------
    InputError
        That names the place, and the order of the call.

    Examples
    --------
    >>> import splinefeed as sf
    >>> sf.errors.expect("smooth(path, tolerance)", (5, sf.Path))
    Traceback (most recent call last):
        ...
    splinefeed.errors.InputError: smooth: expected Path first, got int; the order is smooth(path, tolerance)
    """
    for place, (value, types) in zip(_PLACES, given, strict=False):
        if not isinstance(value, types):
            wanted = types[0] if isinstance(types, tuple) else types
            raise InputError(
                f"{call.partition('(')[0]}: expected {wanted.__name__} {place}, got {type(value).__name__}; "
                f"the order is {call}"
            )


def nearest(name: object, known: Iterable[str], otherwise: str = "known are {}") -> str:
    """Say what a name that is not known may have meant.

    Parameters
    ----------
    name : object
        That is not known.
    known : iterable of str
        The names that are.
    otherwise : str, optional
        What to say of all of them where none is near.

    Returns
    -------
    str
        A question, or all names.

    Examples
    --------
    >>> from splinefeed.errors import nearest
    >>> nearest("buterfly", ["butterfly", "circle"])
    "did you mean 'butterfly'?"
    """
    from difflib import get_close_matches

    known = list(known)
    close = get_close_matches(str(name), known, n=1, cutoff=0.5)
    return f"did you mean {close[0]!r}?" if close else otherwise.format(", ".join(known))
