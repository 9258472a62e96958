"""The elements of an SVG file as a tree of plain nodes, with the line of each; nothing outside the file is opened."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from xml.parsers import expat

from splinefeed.errors import FormatError

#: Most elements in one file, and how deep they may be nested.
MAX_ELEMENTS = 500_000
MAX_DEPTH = 200
#: Longest name in a message.
_SHOWN = 40
_SVG = "http://www.w3.org/2000/svg"
_XLINK = "http://www.w3.org/1999/xlink"
_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
#: Attributes of other name spaces that mean something here, under the name they get.
_FOREIGN = {f"{_XLINK} href": "xlink:href", f"{_INKSCAPE} label": "label"}


@dataclass
class Node:
    """An element: its name ("" in a name space that is not SVG's), attributes, children, line and text of a style."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    text: str = ""

    def __str__(self) -> str:
        name = self.attributes.get("id", "")
        return f"<{self.tag}" + (f" id={name[:_SHOWN]!r}>" if name else ">")

    def place(self) -> str:
        """Line and element, as a message names them."""
        return f"line {self.line}: {self}"


def read_tree(content: bytes, source: str) -> Node:
    """The root element; FormatError for what is no XML, declares entities, or is too large or too deep."""
    parser = expat.ParserCreate(namespace_separator=" ")
    root: list[Node] = []
    stack: list[Node] = []
    count = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MAX_ELEMENTS:
            raise FormatError(f"{source}: has more than {MAX_ELEMENTS} elements; that is no drawing for a tool path")
        if len(stack) >= MAX_DEPTH:
            raise FormatError(f"{source}: line {parser.CurrentLineNumber}: elements are nested {MAX_DEPTH} deep")
        space, _, tag = name.rpartition(" ")
        own = {_FOREIGN.get(key, key): value for key, value in attributes.items()}
        node = Node(tag if space in ("", _SVG) else "", own, parser.CurrentLineNumber)
        if stack:
            stack[-1].children.append(node)
        else:
            root.append(node)
        stack.append(node)

    def text(data: str) -> None:
        if stack and stack[-1].tag == "style":
            stack[-1].text += data

    def declared(name: str, *_: object) -> None:
        raise FormatError(
            f"{source}: line {parser.CurrentLineNumber}: declares the entity {name[:_SHOWN]!r}; "
            f"files with entities are not read, save it without a DOCTYPE"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.CharacterDataHandler = text
    parser.EntityDeclHandler = declared
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise FormatError(
            f"{source}: line {error.lineno}, column {error.offset + 1}: {expat.ErrorString(error.code)}; "
            f"expected SVG, is the file complete?"
        ) from None
    except (ValueError, LookupError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{source}: its encoding is not known: {error}") from None
    if root[0].tag != "svg":
        raise FormatError(f"{source}: line {root[0].line}: begins with {root[0]}; expected <svg>")
    return root[0]


_RULE = re.compile(r"([^{}]*)\{([^{}]*)\}")
_COMMENT = re.compile(r"/\*.*?(?:\*/|$)", re.DOTALL)
_SIMPLE = re.compile(r"(\w+|\*)?(?:([.#])([\w-]+))?")


class Styles:
    """What style sheets say of elements, by name, class or id alone: enough to know what is hidden."""

    def __init__(self, root: Node) -> None:
        self._rules: dict[str, dict[str, str]] = {}
        pending = [root]
        while pending:
            node = pending.pop()
            pending += node.children
            if node.tag == "style" and node.text:
                self._add(_COMMENT.sub(" ", node.text))

    def _add(self, text: str) -> None:
        for selectors, body in _RULE.findall(text):
            said = declarations(body)
            for selector in selectors.split(","):
                match = _SIMPLE.fullmatch(selector.strip())
                if match and selector.strip():
                    tag, mark, name = match.groups()
                    if tag in (None, "*") or not mark:
                        self._rules.setdefault((mark or "") + (name or tag or ""), {}).update(said)

    def of(self, node: Node, name: str) -> str | None:
        """The value of property `name`: the style attribute's, or a sheet's by id, class, element, or the attribute."""
        own = declarations(node.attributes.get("style", ""))
        if name in own:
            return own[name]
        keys = [f"#{node.attributes['id']}"] if "id" in node.attributes else []
        keys += [f".{each}" for each in reversed(node.attributes.get("class", "").split())] + [node.tag, "*"]
        for key in keys if self._rules else ():
            if name in self._rules.get(key, {}):
                return self._rules[key][name]
        return node.attributes.get(name)


def declarations(text: str) -> dict[str, str]:
    """Properties in the text of a style, such as "display: none; fill: red"."""
    pairs = (each.partition(":") for each in text.split(";")) if text else ()
    return {
        name.strip().lower(): value.replace("!important", "").strip().lower()
        for name, _, value in pairs
        if name.strip()
    }
