"""How far work is, from where it is done to who listens: a command, a studio, or the caller of `run`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

#: Called with what is done, how much of it is there, and how much there is.
Listener = Callable[[str, float, float], None]
_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


def tell(what: str, done: float, of: float) -> None:
    """Say that so much of a work is done; nothing where nobody listens, as in processes that work is spread to.

    Parameters
    ----------
    what : str
        The work.
    done, of : float
        How much of it is there, and how much there is.
    """
    if (listener := _listener.get()) is not None:
        listener(what, done, of)


@contextmanager
def listening(listener: Listener | None) -> Iterator[None]:
    """Hear what work inside the context tells.

    Parameters
    ----------
    listener : callable or None
        Called with what is done, how much of it is there, and how much there is; None leaves the listener of before.
    """
    token = _listener.set(listener or _listener.get())
    try:
        yield
    finally:
        _listener.reset(token)


def percent(done: float, of: float) -> str:
    """Write a share in words.

    Parameters
    ----------
    done, of : float
        How much is there, and how much there is.

    Returns
    -------
    str
        Whole per cent, 100 at the most.
    """
    return f"{100.0 * min(done / of, 1.0):.0f} %" if of > 0.0 else "0 %"
