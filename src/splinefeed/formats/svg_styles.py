"""What style sheets, style attributes and presentation attributes say of elements, by the cascade of CSS.

tinycss2 reads the sheets, cssselect2 says which elements a selector means. Properties are those of SVG 2 that move or
hide something. Nothing outside the file is opened. Source: W3C, CSS Cascading and Inheritance 3.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

from splinefeed.errors import FormatError
from splinefeed.formats.svg_tree import Node

#: Properties that say where something lies or whether it is drawn at all.
RELEVANT = frozenset(
    ("display", "visibility", "transform", "transform-origin", "transform-box", "font-size", "font", "d", "x", "y",
     "width", "height", "cx", "cy", "r", "rx", "ry", "translate", "rotate", "scale", "clip-path", "mask")
)  # fmt: skip
#: Most selectors of one file, at-rules in at-rules, and elements that all selectors together may look at.
MAX_SELECTORS, MAX_NESTED, MAX_QUESTIONS = 10_000, 8, 20_000_000
#: Selectors that a finding names.
_NAMED = 3
_SAYS = re.compile(rf"(?<![\w-])(?:{'|'.join(RELEVANT)})\s*(?:/\*.*?\*/\s*)*:", re.IGNORECASE | re.DOTALL)
#: At-rules that move nothing.
_SILENT = ("charset", "namespace", "font-face", "keyframes", "-webkit-keyframes", "page", "color-profile")

Said = dict[str, tuple[str, bool]]  # property: its value, and whether it is called important


class Styles:
    """The style sheets of a drawing; `findings` names rules that are not understood and would move or hide things."""

    def __init__(self, root: Node, source: str) -> None:
        self.source = source
        self.findings: list[str] = []
        self._count = 0
        self._unknown: list[str] = []
        self._rules: dict[Node, list[tuple[tuple[int, ...], Said]]] = {}
        sheets = [each.text for each in root.walk() if each.tag == "style" and each.text and _is_css(each)]
        if not sheets:
            return
        import cssselect2
        import tinycss2

        matcher = cssselect2.Matcher()
        for text in sheets:
            self._sheet(tinycss2.parse_stylesheet(text, skip_comments=True, skip_whitespace=True), matcher)
        if self._count:
            try:
                self._match(root, matcher)
            except _TooManyError:
                raise FormatError(
                    f"{source}: its style sheets have too many rules for its elements; simplify them"
                ) from None
        if self._unknown:
            named = ", ".join(repr(each) for each in self._unknown[:_NAMED])
            more = f" and {len(self._unknown) - _NAMED} more" if len(self._unknown) > _NAMED else ""
            self.findings.append(f"rules of the style sheet that are not read here are left out: {named}{more}")

    def of(self, node: Node) -> Mapping[str, str]:
        """Attributes of `node`, those that are properties as the cascade has them."""
        own = _relevant(node.attributes.get("style", ""))
        rules = self._rules.get(node, ())
        if not own and not rules:
            return node.attributes
        ranked: dict[str, tuple[tuple[int, ...], str]] = {}
        for weight, said in (*rules, ((1,), own)):  # a weight of a rule begins with 0
            for name, (value, important) in said.items():
                rank = (int(important), *weight)
                if name not in ranked or ranked[name][0] <= rank:
                    ranked[name] = (rank, value)
        found = dict(node.attributes)
        for name, (_, value) in ranked.items():
            if value.lower() in ("initial", "unset", "revert"):
                found.pop(name, None)
            else:
                found[name] = value
        return found

    def _sheet(self, rules: Sequence[Any], matcher: Any, depth: int = 0) -> None:
        import cssselect2
        import tinycss2

        for rule in rules:
            if rule.type == "at-rule":
                self._at_rule(rule, matcher, depth)
            elif rule.type == "qualified-rule" and (said := _relevant(tinycss2.serialize(rule.content))):
                try:
                    selectors = cssselect2.compile_selector_list(rule.prelude, _ANY_SPACE)
                except cssselect2.SelectorError:
                    self._unknown.append(tinycss2.serialize(rule.prelude).strip()[:40])
                    continue
                for selector in selectors:
                    self._count += 1
                    if selector.pseudo_element is None:
                        matcher.add_selector(selector, said)
                if self._count > MAX_SELECTORS:
                    raise FormatError(
                        f"{self.source}: its style sheets have more than {MAX_SELECTORS} selectors; simplify them"
                    )

    def _at_rule(self, rule: Any, matcher: Any, depth: int) -> None:
        import tinycss2

        words, body = tinycss2.serialize(rule.prelude), tinycss2.serialize(rule.content or ())
        shown = set(words.lower().replace(" ", "").split(",")) & {"screen", "all", ""}
        if rule.lower_at_keyword == "media" and rule.content is not None and shown and depth < MAX_NESTED:
            inner = tinycss2.parse_rule_list(rule.content, skip_comments=True, skip_whitespace=True)
            self._sheet(inner, matcher, depth + 1)
        elif rule.lower_at_keyword == "import" or (_SAYS.search(body) and rule.lower_at_keyword not in _SILENT):
            self._unknown.append(" ".join(f"@{rule.at_keyword}{words}".split())[:40])

    def _match(self, root: Node, matcher: Any) -> None:
        for element in _counting().from_xml_root(root).iter_subtree():
            found = matcher.match(element)
            if found:
                self._rules[element.etree_element] = [((0, *weight), said) for weight, _, _, said in found]


class _TooManyError(Exception):
    """The selectors have looked at more than MAX_QUESTIONS elements."""


#: Every prefix of a name space means SVG's: names in others have no name here.
_ANY_SPACE: dict[str, str] = defaultdict(str, svg="")


def _is_css(node: Node) -> bool:
    return node.attributes.get("type", "text/css").strip() in ("", "text/css")


def _counting() -> Any:
    """A class of elements for cssselect2 that counts what selectors look at: a few can ask for more than can be done.

    Its own also walks to elder siblings by recursion, which ends at a thousand of them.
    """
    from cssselect2 import ElementWrapper

    asked = 0

    def count(number: int = 1) -> None:
        nonlocal asked
        asked += number
        if asked > MAX_QUESTIONS:
            raise _TooManyError

    class Element(ElementWrapper):  # type: ignore[misc]
        def __init__(self, *words: Any, **named: Any) -> None:
            count()
            super().__init__(*words, **named)

        @property
        def ancestors(self) -> Iterator[Any]:
            return self._chain("parent")

        @property
        def previous_siblings(self) -> Iterator[Any]:
            return self._chain("previous")

        @property
        def etree_siblings(self) -> Any:
            count(len(self._siblings))
            return self._siblings

        @etree_siblings.setter
        def etree_siblings(self, siblings: Any) -> None:
            self._siblings = siblings

        def _chain(self, name: str) -> Iterator[Any]:
            found = getattr(self, name)
            while found is not None:
                count()
                yield found
                found = getattr(found, name)

    return Element


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
