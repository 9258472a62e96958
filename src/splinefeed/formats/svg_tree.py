"""The elements of an SVG file with the line of each, and what styles say of them; nothing outside the file is opened.

tinycss2 reads style sheets, cssselect2 says which elements a selector means. Properties are those of SVG 2 that move or
hide something. Source: W3C, CSS Cascading and Inheritance 3.
"""

from __future__ import annotations

import gzip
import io
import re
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import cssselect2
import tinycss2

from splinefeed.errors import InputError
from splinefeed.files import markup
from splinefeed.files.sizes import MAX_DRAWING_BYTES

#: Most elements in one file, and how deep they may be nested.
MAX_ELEMENTS = 500_000
MAX_DEPTH = 200
#: Longest text that an entity stands for, letters: drawing programs name styles and name spaces by them.
MAX_ENTITY = 1000
#: How a packed file begins.
GZIP = b"\x1f\x8b"
#: Attributes of other name spaces that mean something, under the name they get whatever their prefix is.
_FOREIGN = {"href": "xlink:href", "label": "label"}


#: Properties that say where something lies or whether it is drawn.
RELEVANT = frozenset(
    ("display", "visibility", "transform", "transform-origin", "transform-box", "d", "x", "y", "width", "height",
     "cx", "cy", "r", "rx", "ry", "translate", "rotate", "scale", "clip-path", "mask", "opacity", "fill", "stroke",
     "fill-opacity", "stroke-opacity", "stroke-width", "stroke-dasharray")
)  # fmt: skip
#: Elements that all selectors of one file together may look at, and at-rules in at-rules.
MAX_QUESTIONS, MAX_NESTED = 10_000_000, 8
#: Comparisons in a row, of rules or of siblings, that take the time of one of these.
_AT_ONCE = 8
_SAYS = re.compile(rf"(?<![\w-])(?:{'|'.join(RELEVANT)})\s*+(?:/\*|:)", re.IGNORECASE)
#: The CSS reader turns digits into whole numbers, which Python does up to some thousands of them.
_MANY_DIGITS = re.compile(r"[0-9]{400}")
#: At-rules that move nothing.
_SILENT = ("charset", "namespace", "font-face", "keyframes", "-webkit-keyframes", "page", "color-profile")
#: What cssselect2 raises for a selector; all but the first for one that is nested too deeply or of a name space.
_UNREAD = (cssselect2.SelectorError, SyntaxError, RecursionError, MemoryError, NotImplementedError)

Said = dict[str, tuple[str, bool]]  # property: its value, and whether it is called important


@dataclass(eq=False)
class Node:
    """An element: its name ("" in a name space that is not SVG's), attributes, line, and text of a style.

    `attrib`, `get` and what it is iterated by are named as in the standard library's elements, as cssselect2 asks.
    """

    tag: str
    attrib: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    text: str = ""

    def __iter__(self) -> Iterator[Node]:
        return iter(self.children)

    def get(self, name: str, otherwise: str = "") -> str:
        """An attribute."""
        return self.attrib.get(name, otherwise)

    def walk(self) -> Iterator[Node]:
        """This node and all below it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def place(self) -> str:
        """Line and element, as a message names them."""
        name = self.get("id")
        return f"line {self.line}: <{self.tag}" + (f" id={name[:40]!r}>" if name else ">")


def unpacked(content: bytes) -> bytes:
    """`content`, unpacked if it is gzip (.svgz)."""
    if not content.startswith(GZIP):
        return content
    try:
        found = gzip.GzipFile(fileobj=io.BytesIO(content)).read(MAX_DRAWING_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"is not a valid gzip file: {error}; is it damaged?") from None
    if len(found) > MAX_DRAWING_BYTES:
        raise InputError(f"unpacks to more than {MAX_DRAWING_BYTES // 2**20} MB; that is not a drawing of a part")
    return found


def read_tree(content: bytes) -> Node:
    """The root element; InputError for what is not XML, refers to other files, or is too large or too deep.

    Elements of SVG have no prefix, svg, or that of the root. Entities stand for short texts, never for others; how
    much all of them together become is bounded by expat.
    """
    parser = markup.parser()
    roots: list[Node] = []
    stack: list[Node] = []
    styles: list[str] = []  # texts of the style that is open: an entity is given line by line
    count, own = 0, ""

    def fault(text: str) -> InputError:
        return InputError(f"line {parser.CurrentLineNumber}: {text}")

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal count, own
        count += 1
        if count > MAX_ELEMENTS or len(stack) >= MAX_DEPTH:
            raise fault(f"has more than {MAX_ELEMENTS} elements, or they are nested more than {MAX_DEPTH} deep")
        prefix, _, tag = name.rpartition(":")
        own = own if roots else prefix
        if any(":" in key for key in attributes):
            known = {key: key.partition(":")[2] for key in attributes}
            attributes = {_FOREIGN.get(known[key], key): value for key, value in attributes.items()}
        node = Node(tag if prefix in ("", "svg", own) else "", attributes, parser.CurrentLineNumber)
        (stack[-1].children if stack else roots).append(node)
        stack.append(node)

    def text(data: str) -> None:
        if stack and stack[-1].tag == "style":
            styles.append(data)

    def end(_: str) -> None:
        if (node := stack.pop()).tag == "style":
            node.text = "".join(styles)
            styles.clear()

    def declared(name: str, parameter: int, value: str | None, *_: object) -> None:
        if parameter or value is None:
            raise fault(f"declares the entity {name[:40]!r}, which is in another file; save it without a DOCTYPE")
        if "&" in value or "<" in value or len(value) > MAX_ENTITY:
            why = f"made of others or of elements, or of more than {MAX_ENTITY} letters"
            raise fault(f"declares the entity {name[:40]!r}, {why}; save it without a DOCTYPE")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = text
    parser.EntityDeclHandler = declared
    markup.parse(parser, content, "SVG")
    if roots[0].tag != "svg":
        raise InputError(f"{roots[0].place()}: expected <svg>")
    return roots[0]


# --- styles -----------------------------------------------------------------------------------------------------------


class Styles:
    """The style sheets of a drawing; `findings` names rules that are not understood and would move or hide things."""

    def __init__(self, root: Node) -> None:
        self.findings: list[str] = []
        self._questions = 0
        self._matcher = cssselect2.Matcher()
        self._rules: dict[Node, list[tuple[tuple[int, ...], Said]]] = {}
        unknown: list[str] = []
        for node in root.walk():
            if node.tag == "style" and node.get("type", "text/css").strip() in ("", "text/css"):
                _refuse_long_numbers(node, node.text)
                self._sheet(tinycss2.parse_stylesheet(node.text, skip_comments=True, skip_whitespace=True), unknown)
        if unknown:
            named = ", ".join(repr(each[:40]) for each in unknown[:3])
            self.findings.append(f"{len(unknown)} rules of the style sheet are not read here, such as {named}")
        if self._matcher.order:
            counting: Any = type("_Counting", (_SvgElement,), {"ask": self._ask})
            for element in counting.from_xml_root(root).iter_subtree():
                found = self._matcher.match(element)
                self._ask(len(found) + self._matcher.order // _AT_ONCE)
                if found:
                    self._rules[element.etree_element] = [((0, *weight), said) for weight, _, _, said in found]

    def of(self, node: Node) -> Mapping[str, str]:
        """Attributes of `node`, those that are properties as the cascade has them."""
        style = node.get("style")
        _refuse_long_numbers(node, style)
        own = _relevant(style)
        rules = self._rules.get(node, ())
        if not own and not rules:
            return node.attrib
        ranked: dict[str, tuple[tuple[int, ...], str]] = {}
        for weight, said in (*rules, ((1,), own)):  # a weight of a rule begins with 0
            for name, (value, important) in said.items():
                rank = (int(important), *weight)
                if name not in ranked or ranked[name][0] <= rank:
                    ranked[name] = (rank, value)
        found = {**node.attrib, **{name: value for name, (_, value) in ranked.items()}}
        return {name: value for name, value in found.items() if value.lower() not in ("initial", "unset", "revert")}

    def _sheet(self, rules: Sequence[Any], unknown: list[str], depth: int = 0) -> None:
        for rule in rules:
            if rule.type not in ("at-rule", "qualified-rule"):
                continue
            words, body = tinycss2.serialize(rule.prelude).strip(), tinycss2.serialize(rule.content or ())
            if rule.type == "qualified-rule":
                try:
                    said = _relevant(body)
                    for selector in cssselect2.compile_selector_list(rule.prelude, {"svg": ""}) if said else ():
                        if selector.pseudo_element is None:
                            self._matcher.add_selector(selector, said)
                except _UNREAD:
                    unknown.append(words)
                continue
            media = set(words.lower().replace(" ", "").split(",")) if rule.lower_at_keyword == "media" else set()
            if media & {"screen", "all", ""} and depth < MAX_NESTED:
                inner = tinycss2.parse_rule_list(rule.content or (), skip_comments=True, skip_whitespace=True)
                self._sheet(inner, unknown, depth + 1)
            elif rule.lower_at_keyword == "import" or (_SAYS.search(body) and rule.lower_at_keyword not in _SILENT):
                unknown.append(f"@{rule.at_keyword} {words}")

    def _ask(self, number: int = 1) -> None:
        self._questions += number
        if self._questions > MAX_QUESTIONS:
            raise InputError("its style sheets have too many rules for its elements; simplify them")


class _SvgElement(cssselect2.ElementWrapper):  # type: ignore[misc]
    """An element that counts what selectors look at, and walks by loops: recursion ends at a thousand siblings."""

    ask: Callable[..., None]
    ancestors = property(lambda self: self._chain("parent"))
    previous_siblings = property(lambda self: self._chain("previous"))

    def __init__(self, *words: Any, **named: Any) -> None:
        self.ask()
        super().__init__(*words, **named)

    @property
    def etree_siblings(self) -> list[Node]:
        self.ask(len(self._siblings) // _AT_ONCE)
        return self._siblings

    @etree_siblings.setter
    def etree_siblings(self, siblings: list[Node]) -> None:
        self._siblings = siblings

    def _chain(self, name: str) -> Iterator[_SvgElement]:
        found = getattr(self, name)
        while found is not None:
            self.ask()
            yield found
            found = getattr(found, name)


def _refuse_long_numbers(node: Node, text: str) -> None:
    """InputError for a style with a number that is none."""
    if found := _MANY_DIGITS.search(text):
        begin = text[: found.start()][-10:] + text[found.start() :][:10]
        raise InputError(f"{node.place()}: {begin!r}... is too large for a number")


@lru_cache(maxsize=4096)
def _relevant(text: str) -> Said:
    """The declarations in `text`, such as "display: none; fill: red", that move or hide something."""
    if not _SAYS.search(text):
        return {}
    found: Said = {}
    for each in tinycss2.parse_blocks_contents(text, skip_comments=True, skip_whitespace=True):
        if each.type != "declaration" or each.lower_name not in RELEVANT:
            continue
        value, name = tinycss2.serialize(each.value).strip(), each.lower_name
        if value and not (name in found and found[name][1] and not each.important):
            found[name] = (value, each.important)
    return found
