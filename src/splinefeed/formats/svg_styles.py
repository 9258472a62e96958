"""What style sheets, style attributes and presentation attributes say of elements, by the cascade of CSS.

tinycss2 reads the sheets. Properties are those of SVG 2 that move or hide something. Selectors are those that drawing
programs write: names, classes and ids, one within the other. Source: W3C, CSS Cascading and Inheritance 3.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

from splinefeed.errors import FormatError
from splinefeed.formats.svg_tree import Node

#: Properties that say where something lies or whether it is drawn.
RELEVANT = frozenset(
    ("display", "visibility", "transform", "transform-origin", "transform-box", "d", "x", "y", "width", "height",
     "cx", "cy", "r", "rx", "ry", "translate", "rotate", "scale", "clip-path", "mask")
)  # fmt: skip
#: Elements that all selectors of one file together may look at, and at-rules in at-rules.
MAX_QUESTIONS, MAX_NESTED = 20_000_000, 8
_SAYS = re.compile(rf"(?<![\w-])(?:{'|'.join(RELEVANT)})\s*(?:/\*.*?\*/\s*)*:", re.IGNORECASE | re.DOTALL)
#: At-rules that move nothing.
_SILENT = ("charset", "namespace", "font-face", "keyframes", "-webkit-keyframes", "page", "color-profile")
_COMPOUND = re.compile(r"(>?)(?:svg\|)?(\*|[\w-]*)((?:[.#][\w-]+)*)")
_MARK = re.compile(r"[.#][\w-]+")

Said = dict[str, tuple[str, bool]]  # property: its value, and whether it is called important


class _Part(NamedTuple):
    """What one element of a selector must be; child: whether the one before it is its parent, or any above it."""

    child: bool
    tag: str
    marks: frozenset[str]


class Styles:
    """The style sheets of a drawing; `findings` names rules that are not understood and would move or hide things."""

    def __init__(self, root: Node, source: str) -> None:
        self.source = source
        self.findings: list[str] = []
        self._rules: list[tuple[list[_Part], tuple[int, ...], Said]] = []
        self._asked = 0
        unknown: list[str] = []
        for node in root.walk():
            if node.tag == "style" and node.attributes.get("type", "text/css").strip() in ("", "text/css"):
                import tinycss2

                self._sheet(tinycss2.parse_stylesheet(node.text, skip_comments=True, skip_whitespace=True), unknown)
        if unknown:
            named = ", ".join(repr(each[:40]) for each in unknown[:3])
            self.findings.append(f"{len(unknown)} rules of the style sheet are not read here, such as {named}")

    def of(self, node: Node) -> Mapping[str, str]:
        """Attributes of `node`, those that are properties as the cascade has them."""
        own = _relevant(node.attributes.get("style", ""))
        rules = [(weight, said) for parts, weight, said in self._rules if self._means(parts, node)]
        if not own and not rules:
            return node.attributes
        ranked: dict[str, tuple[tuple[int, ...], str]] = {}
        for weight, said in (*rules, ((1,), own)):  # a weight of a rule begins with 0
            for name, (value, important) in said.items():
                rank = (int(important), *weight)
                if name not in ranked or ranked[name][0] <= rank:
                    ranked[name] = (rank, value)
        found = {**node.attributes, **{name: value for name, (_, value) in ranked.items()}}
        return {name: value for name, value in found.items() if value.lower() not in ("initial", "unset", "revert")}

    def _sheet(self, rules: Sequence[Any], unknown: list[str], depth: int = 0) -> None:
        import tinycss2

        for rule in rules:
            if rule.type not in ("at-rule", "qualified-rule"):
                continue
            words, body = tinycss2.serialize(rule.prelude).strip(), tinycss2.serialize(rule.content or ())
            if rule.type == "qualified-rule":
                said, selectors = _relevant(body), [_parts(each) for each in words.split(",")]
                if said and not all(selectors):
                    unknown.append(words)
                elif said:
                    self._rules += [(parts, _weight(parts), said) for parts in selectors]
            elif rule.lower_at_keyword == "media" and depth < MAX_NESTED and _on_screen(words):
                inner = tinycss2.parse_rule_list(rule.content or (), skip_comments=True, skip_whitespace=True)
                self._sheet(inner, unknown, depth + 1)
            elif rule.lower_at_keyword == "import" or (_SAYS.search(body) and rule.lower_at_keyword not in _SILENT):
                unknown.append(f"@{rule.at_keyword} {words}")

    def _means(self, parts: Sequence[_Part], node: Node) -> bool:
        self._asked += 1
        if self._asked > MAX_QUESTIONS:
            raise FormatError(f"{self.source}: its style sheets have too many rules for its elements; simplify them")
        *above, last = parts
        if not ((last.tag in ("", "*") or last.tag == node.tag) and last.marks <= node.marks):
            return False
        other = node.parent
        while above and other is not None:
            if self._means(above, other):
                return True
            other = None if last.child else other.parent
        return not above


def _on_screen(words: str) -> bool:
    return bool(set(words.lower().replace(" ", "").split(",")) & {"screen", "all", ""})


def _parts(selector: str) -> list[_Part]:
    """What a selector asks of an element and those above it, itself last; empty for one that is not understood."""
    parts = []
    for word in selector.replace(">", " >").replace("> ", ">").split():
        match = _COMPOUND.fullmatch(word)
        if match is None or not (match[2] or match[3]):
            return []
        parts.append(_Part(bool(match[1]), match[2], frozenset(_MARK.findall(match[3]))))
    return parts


def _weight(parts: Sequence[_Part]) -> tuple[int, ...]:
    """Its specificity: how many ids, classes and names it has."""
    marks = [mark[0] for part in parts for mark in part.marks]
    return 0, marks.count("#"), marks.count("."), sum(part.tag not in ("", "*") for part in parts)


@lru_cache(maxsize=4096)
def _relevant(text: str) -> Said:
    """The declarations in `text`, such as "display: none; fill: red", that move or hide something."""
    if not _SAYS.search(text):
        return {}
    import tinycss2

    found: Said = {}
    for each in tinycss2.parse_blocks_contents(text, skip_comments=True, skip_whitespace=True):
        if each.type != "declaration" or each.lower_name not in RELEVANT:
            continue
        value, name = tinycss2.serialize(each.value).strip(), each.lower_name
        if value and not (name in found and found[name][1] and not each.important):
            found[name] = (value, each.important)
    return found
