"""What style sheets, style attributes and presentation attributes say of elements, by the cascade of CSS.

Source: W3C, Selectors Level 3 (compounds, the four combinators, specificity) and CSS Cascading and Inheritance 3;
properties are those of SVG 2 that move or hide something. Nothing outside the file is opened.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

from splinefeed.errors import FormatError
from splinefeed.formats.svg_tree import Node

#: Properties that say where something lies or whether it is drawn at all.
RELEVANT = frozenset(
    ("display", "visibility", "transform", "transform-origin", "transform-box", "font-size", "font", "d", "x", "y",
     "width", "height", "cx", "cy", "r", "rx", "ry", "translate", "rotate", "scale", "clip-path", "mask")
)  # fmt: skip
#: Most selectors of one file, compounds in one, and questions whether an element is meant by one.
MAX_SELECTORS, MAX_COMPOUNDS, MAX_QUESTIONS = 10_000, 16, 20_000_000
#: At-rules in at-rules, and letters in front of a pair of braces where they have brackets of their own.
MAX_NESTED, MAX_PRELUDE = 8, 10_000
#: Selectors that a finding names.
_NAMED = 3

_COMMENT = re.compile(r"/\*.*?(?:\*/|$)|<!--|-->", re.DOTALL)
_MARK = re.compile(r'"[^"]*"|\'[^\']*\'|[{};]')
_IDENTIFIER = r"(?:\\.|[\w-])+"
_PART = re.compile(
    rf"(?P<tag>(?:[\w*-]*\|)?(?:{_IDENTIFIER}|\*))|\#(?P<id>{_IDENTIFIER})|\.(?P<cls>{_IDENTIFIER})"
    rf"|\[\s*(?:[\w*-]*\|)?(?P<name>{_IDENTIFIER})\s*(?:(?P<how>[~|^$*]?=)\s*(?P<value>\"[^\"]*\"|'[^']*'|[^\]\s]+)\s*)?\]"
    rf"|::?(?P<pseudo>[\w-]+)(?P<call>\()?"
)
_COMBINATOR = re.compile(r"\s*([>+~])\s*|\s+")
#: What no element of a drawing on paper is, and where an element may stand.
_NEVER = frozenset(("hover", "active", "focus", "visited", "link", "target", "before", "after", "selection", "checked"))
_PLACES = frozenset(("root", "first-child", "last-child", "only-child"))
#: At-rules that move nothing.
_SILENT = ("@charset", "@namespace", "@font-face", "@keyframes", "@-webkit-keyframes", "@page", "@color-profile")

Test = Callable[[Node], bool]


@dataclass
class _Compound:
    """What one element must be: tests, and the sign that stands between it and the compound to its left."""

    tests: list[Test] = field(default_factory=list)
    key: str = "*"  # the rarest thing that the element must have: #id, .class or its name
    sign: str = ""
    weight: tuple[int, int, int] = (0, 0, 0)


@dataclass(frozen=True)
class _Rule:
    """A selector, right to left, its weight by the cascade, and what it says."""

    compounds: tuple[_Compound, ...]
    weight: tuple[int, int, int, int]
    said: dict[str, tuple[str, bool]]


class Styles:
    """The style sheets of a drawing; `findings` names rules that are not understood and would move or hide things."""

    def __init__(self, root: Node, source: str) -> None:
        self.source = source
        self.findings: list[str] = []
        self._rules: dict[str, list[_Rule]] = {}
        self._count = self._questions = 0
        self._unknown: list[str] = []
        for node in root.walk():
            if (
                node.tag == "style"
                and node.text
                and node.attributes.get("type", "text/css").strip() in ("", "text/css")
            ):
                self._sheet(_COMMENT.sub(" ", node.text))
        if self._unknown:
            named = ", ".join(repr(each) for each in self._unknown[:_NAMED])
            more = f" and {len(self._unknown) - _NAMED} more" if len(self._unknown) > _NAMED else ""
            self.findings.append(f"rules of the style sheet that are not read here are left out: {named}{more}")

    def of(self, node: Node) -> Mapping[str, str]:
        """Attributes of `node`, those that are properties as the cascade has them."""
        own = _relevant(node.attributes.get("style", ""))
        if not own and not self._rules:
            return node.attributes
        ranked: dict[str, tuple[tuple[int, ...], str]] = {}
        for rule in self._candidates(node):
            for name, (value, important) in rule.said.items():
                rank = (int(important), 0, *rule.weight)
                if name not in ranked or ranked[name][0] <= rank:
                    ranked[name] = (rank, value)
        for name, (value, important) in own.items():
            above_rules = (int(important), 1)
            if name not in ranked or ranked[name][0] <= above_rules:
                ranked[name] = (above_rules, value)
        found = dict(node.attributes)
        for name, (_, value) in ranked.items():
            if value.lower() in ("initial", "unset", "revert"):
                found.pop(name, None)
            else:
                found[name] = value
        return found

    def _candidates(self, node: Node) -> Iterator[_Rule]:
        if not self._rules:
            return
        keys = ["*", node.tag, *(f".{each}" for each in set(node.attributes.get("class", "").split()))]
        if "id" in node.attributes:
            keys.append(f"#{node.attributes['id']}")
        for key in keys:
            for rule in self._rules.get(key, ()):
                if self._matches(node, rule.compounds):
                    yield rule

    # --- matching ---------------------------------------------------------------------------------------------------

    def _matches(self, node: Node, compounds: tuple[_Compound, ...]) -> bool:
        self._questions += 1
        if self._questions > MAX_QUESTIONS:
            raise FormatError(f"{self.source}: its style sheets have too many rules for its elements; simplify them")
        first = compounds[0]
        if not all(test(node) for test in first.tests):
            return False
        rest = compounds[1:]
        if not rest:
            return True
        if first.sign in (">", " "):
            above = node.parent
            while above is not None:
                if self._matches(above, rest):
                    return True
                above = above.parent if first.sign == " " else None
            return False
        elders = node.elders(1 if first.sign == "+" else node.place_in_parent)
        self._questions += len(elders)
        return any(self._matches(elder, rest) for elder in elders)

    # --- reading ----------------------------------------------------------------------------------------------------

    def _sheet(self, text: str, depth: int = 0) -> None:
        for prelude, body in _blocks(text):
            if prelude.startswith("@"):
                self._at_rule(prelude, body, depth)
                continue
            said = _relevant(body or "")
            for selector in _split(prelude) if said else ():
                self._add(selector.strip(), said)

    def _at_rule(self, prelude: str, body: str | None, depth: int) -> None:
        kind, _, rest = prelude.lower().partition(" ")
        shown = set(rest.replace(" ", "").split(",")) & {"screen", "all", ""}
        if kind == "@media" and body is not None and shown and depth < MAX_NESTED:
            self._sheet(body, depth + 1)
        elif kind == "@import" or (body and any(name in body for name in RELEVANT) and kind not in _SILENT):
            self._unknown.append(" ".join(prelude.split())[:40])

    def _add(self, selector: str, said: dict[str, tuple[str, bool]]) -> None:
        self._count += 1
        if self._count > MAX_SELECTORS:
            raise FormatError(
                f"{self.source}: its style sheets have more than {MAX_SELECTORS} selectors; simplify them"
            )
        compounds = _compounds(selector)
        if compounds is None:
            self._unknown.append(selector[:40])
        elif compounds:
            weights = [sum(each.weight[k] for each in compounds) for k in range(3)]
            rule = _Rule(tuple(compounds), (weights[0], weights[1], weights[2], self._count), said)
            self._rules.setdefault(compounds[0].key, []).append(rule)


def declarations(text: str) -> dict[str, tuple[str, bool]]:
    """Properties in the text of a style, such as "display: none; fill: red", and whether each is called important."""
    found: dict[str, tuple[str, bool]] = {}
    for each in text.split(";"):
        name, _, value = each.partition(":")
        value, important, _ = value.partition("!")
        name = name.strip().lower()
        if name and value.strip() and not (name in found and found[name][1] and not important):
            found[name] = (value.strip(), bool(important))
    return found


def _blocks(text: str) -> Iterator[tuple[str, str | None]]:
    """What stands in front of each pair of braces, and within; None for what a semicolon ends."""
    begin = depth = inner = 0
    prelude = ""
    for match in _MARK.finditer(text):
        mark = match[0]
        if mark == "{":
            depth += 1
            if depth == 1:
                prelude, inner = text[begin : match.start()].strip(), match.end()
        elif mark == "}":
            depth = max(depth - 1, 0)
            if depth == 0 and prelude:  # a brace too many belongs to what follows it, which then means nothing
                yield prelude, text[inner : match.start()]
                prelude, begin = "", match.end()
        elif mark == ";" and depth == 0:
            yield text[begin : match.start()].strip(), None
            begin = match.end()


@lru_cache(maxsize=4096)
def _relevant(text: str) -> dict[str, tuple[str, bool]]:
    """The declarations in `text` that move or hide something."""
    return {name: value for name, value in declarations(text).items() if name in RELEVANT}


def _split(selectors: str) -> list[str]:
    """The selectors of a rule; commas in brackets belong to one of them."""
    if "[" not in selectors and "(" not in selectors:
        return selectors.split(",")
    if len(selectors) > MAX_PRELUDE:
        return [selectors]  # which is not understood
    return re.split(r",(?![^\[(]*[\])])", selectors)


def _compounds(selector: str) -> list[_Compound] | None:
    """The compounds of a selector, right to left; empty if it can mean no element here, None if not understood."""
    found: list[_Compound] = []
    at, sign = 0, ""
    if not selector or len(selector) > MAX_PRELUDE:
        return None
    while at < len(selector):
        compound = _Compound(sign=sign)
        begin = at
        while (match := _PART.match(selector, at)) is not None and not (match["tag"] and at > begin):
            at = match.end()
            if match["pseudo"] is not None and match["pseudo"].lower() in _NEVER:
                return []
            if not _require(compound, match):
                return None
        if at == begin or len(found) >= MAX_COMPOUNDS:
            return None
        found.append(compound)
        space = _COMBINATOR.match(selector, at)
        if space is None or space.end() >= len(selector):
            if at < len(selector) and space is None:
                return None
            break
        sign = space[1] or " "
        at = space.end()
    # a sign belongs to the compound on its right, whose left neighbour it describes
    return found[::-1]


def _require(compound: _Compound, match: re.Match[str]) -> bool:
    """Add what a part of a compound asks; False if that is not known here."""
    ids, classes, tags = compound.weight
    if match["tag"] is not None:
        tag = match["tag"].rpartition("|")[2].replace("\\", "")
        if tag != "*":
            compound.tests.append(lambda node: node.tag == tag)
            compound.key, compound.weight = tag, (ids, classes, tags + 1)
        return True
    if match["id"] is not None:
        name = match["id"].replace("\\", "")
        compound.tests.append(lambda node: node.attributes.get("id") == name)
        compound.key, compound.weight = f"#{name}", (ids + 1, classes, tags)
        return True
    compound.weight = (ids, classes + 1, tags)
    if match["cls"] is not None:
        name = match["cls"].replace("\\", "")
        compound.tests.append(lambda node: name in node.attributes.get("class", "").split())
        compound.key = compound.key if compound.key.startswith("#") else f".{name}"
        return True
    if match["name"] is not None:
        name, how = match["name"].replace("\\", "").rpartition(":")[2], match["how"]
        value = (match["value"] or "").strip("\"'")
        compound.tests.append(lambda node: _has(node.attributes.get(name), how, value))
        return True
    pseudo = match["pseudo"].lower()
    if match["call"] or pseudo not in _PLACES:
        return False
    compound.tests.append(lambda node: _stands(node, pseudo))
    return True


def _has(given: str | None, how: str | None, value: str) -> bool:
    if given is None or how is None:
        return given is not None
    return {
        "=": given == value,
        "~=": value in given.split(),
        "|=": given == value or given.startswith(f"{value}-"),
        "^=": bool(value) and given.startswith(value),
        "$=": bool(value) and given.endswith(value),
        "*=": bool(value) and value in given,
    }[how]


def _stands(node: Node, place: str) -> bool:
    if place == "root" or node.parent is None:
        return node.parent is None
    among = node.parent.children
    first, last = among[0] is node, among[-1] is node
    return {"first-child": first, "last-child": last, "only-child": first and last}[place]
