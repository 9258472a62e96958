"""What tests of the studio's page share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

#: What a page waits for is there long before, however busy the machine is, ms.
PATIENCE = 400_000


def rest(page: Any, action: Callable[[], object]) -> None:
    """Do what changes the settings, and wait until the final result of that is shown."""
    page.evaluate("document.body.dataset.shown = 'waiting'")
    action()
    page.wait_for_selector("body[data-shown=final]")


def value(page: Any, key: str) -> float:
    """A number of the cards, as it was sent."""
    return float(page.get_attribute(f'#cards dd[data-key="{key}"]', "data-value"))
