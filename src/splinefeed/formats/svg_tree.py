"""The elements of an SVG file as a tree of plain nodes, with the line of each; nothing outside the file is opened."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from splinefeed.errors import FormatError
from splinefeed.formats.sizes import MAX_DRAWING_BYTES

#: Most elements in one file, and how deep they may be nested.
MAX_ELEMENTS = 500_000
MAX_DEPTH = 200
#: Longest text that an entity may stand for, and letters that all uses of one may come to.
MAX_ENTITY, MAX_ENTITIES = 200, 2**20
#: Longest name in a message.
_SHOWN = 40
#: How a packed file begins.
GZIP = b"\x1f\x8b"
_SVG = "http://www.w3.org/2000/svg"
_XLINK = "http://www.w3.org/1999/xlink"
_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
#: Attributes of other name spaces that mean something here, under the name they get.
_FOREIGN = {f"{_XLINK} href": "xlink:href", f"{_INKSCAPE} label": "label", "inkscape:label": "label"}


@dataclass(eq=False)
class Node:
    """An element: its name ("" in a name space that is not SVG's), attributes, children, line and text of a style."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    text: str = ""

    def walk(self) -> Iterator[Node]:
        """This node and all below it, in the order of the file."""
        pending = [self]
        while pending:
            node = pending.pop()
            pending += reversed(node.children)
            yield node

    def __iter__(self) -> Iterator[Node]:
        return iter(self.children)

    @property
    def attrib(self) -> dict[str, str]:
        """The attributes, by the name that the standard library's elements have for them, as cssselect2 asks."""
        return self.attributes

    def get(self, name: str, otherwise: str | None = None) -> str | None:
        """An attribute, likewise."""
        return self.attributes.get(name, otherwise)

    def __str__(self) -> str:
        name = self.attributes.get("id", "")
        return f"<{self.tag}" + (f" id={name[:_SHOWN]!r}>" if name else ">")

    def place(self) -> str:
        """Line and element, as a message names them."""
        return f"line {self.line}: {self}"


def unpacked(content: bytes, source: str, most: int = MAX_DRAWING_BYTES) -> bytes:
    """`content`, unpacked if it is gzip (.svgz); FormatError for what is damaged or unpacks to more than `most`."""
    if not content.startswith(GZIP):
        return content
    parts, size = [], 0
    try:
        while content:
            unpacker = zlib.decompressobj(zlib.MAX_WBITS | 16)
            parts.append(unpacker.decompress(content, most - size + 1))
            size += len(parts[-1])
            if size > most:
                raise FormatError(f"{source}: unpacks to more than {most // 2**20} MB; that is not a drawing of a part")
            if not unpacker.eof:
                raise FormatError(f"{source}: ends inside of its packed data (gzip); is the file complete?")
            content = unpacker.unused_data.lstrip(b"\0")
            if content and not content.startswith(GZIP):
                raise FormatError(f"{source}: more data follows its packed data (gzip); is it damaged?")
    except zlib.error as error:
        raise FormatError(f"{source}: is not a valid gzip file: {error}; is it damaged?") from None
    return b"".join(parts)


def read_tree(content: bytes, source: str, findings: list[str] | None = None) -> Node:
    """The root element; FormatError for what is not XML, declares entities, or is too large or too deep.

    A prefix that the file does not declare means what it usually does; `findings` say so.
    """
    try:
        return _tree(content, source, " ")
    except expat.ExpatError as error:
        if error.code != expat.errors.codes[expat.errors.XML_ERROR_UNBOUND_PREFIX]:
            raise _not_xml(error, source) from None
        if findings is not None:
            findings.append(f"line {error.lineno}: a prefix is not declared (xmlns:...); it is taken for the usual one")
    try:
        return _tree(content, source, "")
    except expat.ExpatError as error:
        raise _not_xml(error, source) from None


def _not_xml(error: expat.ExpatError, source: str) -> FormatError:
    return FormatError(
        f"{source}: line {error.lineno}, column {error.offset + 1}: {expat.ErrorString(error.code)}; "
        f"expected SVG, is the file complete?"
    )


def _tree(content: bytes, source: str, between: str) -> Node:
    parser = expat.ParserCreate(namespace_separator=between or None)
    root: list[Node] = []
    stack: list[Node] = []
    count = 0

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MAX_ELEMENTS:
            raise FormatError(f"{source}: has more than {MAX_ELEMENTS} elements; that is not a drawing for a tool path")
        if len(stack) >= MAX_DEPTH:
            raise FormatError(f"{source}: line {parser.CurrentLineNumber}: elements are nested {MAX_DEPTH} deep")
        space, _, tag = name.rpartition(between or ":")
        own = {_FOREIGN.get(key, key): value for key, value in attributes.items()}
        node = Node(tag if space in ("", "svg", _SVG) else "", own, parser.CurrentLineNumber)
        if stack:
            stack[-1].children.append(node)
        else:
            root.append(node)
        stack.append(node)

    def text(data: str) -> None:
        if stack and stack[-1].tag == "style":
            stack[-1].text += data

    def declared(name: str, parameter: int, value: str | None, *_: object) -> None:
        plain = not parameter and value is not None and not set(value) & set("&%<") and len(value) <= MAX_ENTITY
        if plain and content.count(f"&{name};".encode()) * len(value or "") <= MAX_ENTITIES:
            return  # as Illustrator names its name spaces
        raise FormatError(
            f"{source}: line {parser.CurrentLineNumber}: declares the entity {name[:_SHOWN]!r}; "
            f"only short texts may be entities, save it without a DOCTYPE"
        )

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.CharacterDataHandler = text
    parser.EntityDeclHandler = declared
    try:
        parser.Parse(content, True)
    except (ValueError, LookupError) as error:
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"{source}: its encoding is not known: {error}") from None
    if root[0].tag != "svg":
        raise FormatError(f"{source}: line {root[0].line}: begins with {root[0]}; expected <svg>")
    return root[0]
