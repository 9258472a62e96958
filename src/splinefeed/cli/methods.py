"""`splinefeed methods`: the interpolation methods, their order, and where they come from."""

from __future__ import annotations

import inspect
import re
from typing import Any

import click

from splinefeed.cli.answers import Page, answers
from splinefeed.cli.output import print_table, print_text
from splinefeed.cli.progress import Say

EXAMPLES = """\b
Examples:
  splinefeed methods
  splinefeed methods --json
"""

#: A reference in running text: from an initial to the DOI at the end.
_REFERENCE = re.compile(r": ([A-Z]\. [^:]+, doi \S+)$")
_ELSEWHERE = re.compile(r"`stepping\.(\w+)`")


def _print(page: Page) -> None:
    rows = [[each["name"], each["title"], _order(each)] for each in page["methods"]]
    print_table(["method", "what it is", "order"], rows, texts=2)
    print_text()
    print_text(f"The default is {page['default']}. Sources:")
    for each in page["methods"]:
        print_text(f"  {each['name']}: {each['source'] or 'registered without one'}")


def _order(page: Page) -> str:
    return str(page["order"] or ("exact" if page["exact"] else "fit"))


@click.command(epilog=EXAMPLES)
@answers(_print)
def command(say: Say) -> Page:
    """List the interpolation methods with their observed order of convergence and source."""
    from splinefeed.interpolation import registry, stepping

    def source(step: Any) -> str:
        """What stands behind "Source:" in the docstring of a step, or of the shared step that it names there."""
        words = " ".join((inspect.getdoc(getattr(step, "py_func", step)) or "").split())
        reference = _REFERENCE.search(words)
        text = words.partition("Source: ")[2] or (reference[1] if reference else "")
        return _ELSEWHERE.sub(lambda shared: source(getattr(stepping, shared[1])).rstrip("."), text)

    methods = [registry.method(name) for name in registry.methods()]
    listed = [
        {
            "name": each.name,
            "title": each.title,
            "order": each.order,
            "exact": each.anchor,
            "history": each.history,
            "source": source(each.fill or each.step),
        }
        for each in methods
    ]
    return {"methods": listed, "default": registry.DEFAULT_METHOD}
