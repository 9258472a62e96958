"""`splinefeed methods`: the interpolation methods, their order, and where they come from."""

from __future__ import annotations

import inspect
import re
from typing import Any

import click

from splinefeed.cli import options, output

EXAMPLES = """\b
Examples:
  splinefeed methods
  splinefeed methods --json
"""

#: A reference in running text: from an initial to the DOI at the end.
_REFERENCE = re.compile(r": ([A-Z]\. [^:]+, doi \S+)$")


@click.command(epilog=EXAMPLES)
@options.as_json
def command(as_json: bool) -> None:
    """List the interpolation methods with their observed order of convergence and source."""
    from splinefeed.interpolation import registry

    page = [_method(registry.method(name)) for name in registry.methods()]
    if as_json:
        output.print_json({"methods": page, "default": registry.DEFAULT_METHOD})
        return
    rows = [[each["name"], each["title"], _order(each)] for each in page]
    output.print_table(["method", "what it is", "order"], rows, texts=2)
    output.print_text()
    output.print_text(f"The default is {registry.DEFAULT_METHOD}. Sources:")
    for each in page:
        output.print_text(f"  {each['name']}: {each['source'] or 'registered without one'}")


def _method(method: Any) -> dict[str, Any]:
    return {
        "name": method.name,
        "title": method.title,
        "order": method.order,
        "exact": method.anchor,
        "history": method.history,
        "source": _source(method.fill or method.step),
    }


def _order(page: dict[str, Any]) -> str:
    if page["order"] is not None:
        return str(page["order"])
    return "exact" if page["exact"] else "fit"


def _source(step: Any) -> str:
    """What stands behind "Source:" in the docstring of a step."""
    words = " ".join((inspect.getdoc(getattr(step, "py_func", step)) or "").split())
    reference = _REFERENCE.search(words)
    return words.partition("Source: ")[2] or (reference[1] if reference else "")
