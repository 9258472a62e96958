"""How Sphinx makes the documentation: `make docs`, without a network, warnings being errors."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from sphinx.ext.napoleon import Config, NumpyDocstring

from splinefeed import __version__
from splinefeed.reports import theme
from splinefeed.reports.layout import WHITE

project = "splinefeed"
author = "The splinefeed authors"
copyright = "The splinefeed authors, MIT licence"
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc"]
source_suffix = {".md": "markdown"}
myst_enable_extensions = ["dollarmath"]
myst_dmath_allow_digits = myst_dmath_allow_space = False
html_math_renderer = "mathml"  # browsers draw it themselves: no script, no network, dark pages too
myst_heading_anchors = 4
highlight_language = "none"  # what has no language is a formula or a command
suppress_warnings = ["misc.highlighting_failure"]  # a chart in Mermaid is drawn where Markdown is shown, not here
html_theme = "furo"
html_title = f"splinefeed {__version__}"
html_show_sphinx = False
html_static_path = ["_static"]
html_css_files = ["pages.css"]
templates_path: list[str] = []

autodoc_typehints = "none"  # docstrings say shapes and units, which types do not
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
autodoc_class_signature = "separated"
autodoc_default_options = {"exclude-members": "__new__"}  # of records: it takes what __init__ takes
smartquotes_action = "D"  # dashes alone: the prime of C' and the dots of (...) are letters of formulas
#: How sections of docstrings are shown: names that share a line stay together, attributes are a list, too.
SHOWN = Config(
    napoleon_use_param=False, napoleon_use_rtype=False, napoleon_custom_sections=[("Attributes", "params_style")]
)


def as_written(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Docstrings as reStructuredText, formulas letter by letter: sentences are escaped, what is indented stands alone.

    Napoleon makes lists of the sections of NumPy's convention.
    """
    shown: list[str] = []
    section, i = "", 0
    while i < len(lines):
        line = lines[i]
        inside = 4 if section in ENTRIES else 0
        depth = len(line) - len(line.lstrip())
        if _underlines(lines, i + 1):
            section = line
            shown += lines[i : i + 2]
            i += 2
        elif line.startswith(">>>"):
            end = next((k for k in range(i, len(lines)) if not lines[k].strip()), len(lines))
            shown += lines[i:end]
            i = end
        elif section == "References":  # docutils has one list of footnotes a page: an entry is a paragraph here
            entry = line.startswith(".. [")
            text = _escaped(line.strip().removeprefix(".. "))
            shown += [*[""] * entry, re.sub(r"docs/([\w/-]+)\.md", r":doc:`docs/\1.md </\1>`", text)]
            i += 1
        elif line.strip() and depth > inside:
            end = next((k for k in range(i, len(lines)) if lines[k][: inside + 1].strip()), len(lines))
            shown += [" " * inside + each for each in _literal([each[inside:] for each in lines[i:end]])]
            i = end
        else:
            name, colon, kind = line.partition(" : ") if section in ENTRIES and not depth else ("", "", line)
            shown.append(f"{name}{colon}{' ' * depth}{_escaped(kind.strip())}")
            i += 1
    lines[:] = str(NumpyDocstring(shown, SHOWN)).splitlines()


#: Sections whose lines are names or types, each with sentences indented below it.
ENTRIES = ("Parameters", "Attributes", "Returns", "Yields", "Raises")


def _underlines(lines: list[str], i: int) -> bool:
    """Whether line `i` underlines a section's name."""
    return 0 < i < len(lines) and bool(lines[i]) and lines[i] == "-" * len(lines[i - 1])


def _literal(lines: list[str]) -> list[str]:
    """A block of text that is shown letter by letter; nothing for no text."""
    return ["", "::", "", *(f"   {line}".rstrip() for line in lines), ""] if any(map(str.strip, lines)) else []


def _escaped(text: str) -> str:
    """`text` for reStructuredText: code between backticks, everything else as it stands."""
    parts = re.sub(r"(\[\d+\])_", r"\1", text).split("`")
    if len(parts) % 2 == 0:  # a lone backtick is a letter
        parts = [text]
    plain = [re.sub(r"([\\`*_|])", r"\\\1", part) for part in parts]
    plain[0] = re.sub(r"^(\w+[.)]|\(\w+\))( |$)", r"\\\g<0>", plain[0])  # not the number of a list, as mm. is
    return "".join(f"``{parts[i]}``" if i % 2 else plain[i] for i in range(len(parts)))


_PRIME = re.compile(r"<msup>(<m[in]>[^<]*</m[in]>)<mi>(&#x0203[234];|&#x02057;)</mi></msup>")


def formula(writer: Any, node: Any) -> None:
    """A formula as MathML, in a line or in a block of its own."""
    from docutils.nodes import SkipNode

    block = node.tagname == "math_block"
    text = convert(node.astext(), display="block" if block else "inline")
    text = _PRIME.sub(r'<mrow>\1<mo lspace="0" rspace="0">\2</mo></mrow>', text)  # fonts have it where it belongs
    writer.body.append(f'<div class="math">{text}</div>' if block else text)
    raise SkipNode


#: Of dark pages: paper and lines across it; dress.js has the other colours by those on white paper.
PAPER, GRID = "#131416", "#33373b"


def dark_style() -> str:
    """What pictures of the site wear on a dark page: other colours of lines, words and areas, and the same scales."""
    script = resources.files("splinefeed.reports").joinpath("page", "dress.js").read_text(encoding="utf-8")
    swapped = json.loads(re.search(r"const DARK = (\{.*?\});", script).group(1))  # type: ignore[union-attr]
    colours = {**swapped, "#fff": PAPER, theme.GRID: GRID}
    for colour in theme.COLOURS:
        light = swapped.get(colour.lower(), colour)
        parts = zip(*([int(each[k : k + 2], 16) for k in (1, 3, 5)] for each in (light, PAPER)), strict=True)
        mixed = [round((1.0 - WHITE) * ink + WHITE * paper) for ink, paper in parts]
        colours[theme.paler(colour, WHITE)] = f"#{bytes(mixed).hex()}"
    rules = [f'[fill="{old}" i]{{fill:{new}}}[stroke="{old}" i]{{stroke:{new}}}' for old, new in colours.items()]
    edge = '[stroke-width="3.2"]{filter:drop-shadow(0 0 1px #a9afb5)}'  # the darkest colours of a scale
    return f"<style>@media (prefers-color-scheme:dark){{{''.join(rules)}{edge}}}</style>"


def wear(app: Any, error: Exception | None) -> None:
    """Put that into the pictures of the built site."""
    style = dark_style()
    for file in Path(app.outdir, "_images").glob("*.svg"):
        text = file.read_text(encoding="utf-8")
        if style not in text:
            file.write_text(text.replace("</title>", f"</title>{style}", 1), encoding="utf-8")


def setup(app: Any) -> None:
    """Tell Sphinx of the three above."""
    app.connect("build-finished", wear)
    app.connect("autodoc-process-docstring", as_written)
    app.add_html_math_renderer("mathml", (formula, None), (formula, None))
