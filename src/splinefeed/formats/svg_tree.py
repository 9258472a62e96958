"""The elements of an SVG file with the line of each; nothing outside the file is opened."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from splinefeed.errors import InputError
from splinefeed.formats.sizes import MAX_DRAWING_BYTES

#: Most elements in one file, and how deep they may be nested.
MAX_ELEMENTS = 500_000
MAX_DEPTH = 200
#: How a packed file begins.
GZIP = b"\x1f\x8b"
#: Attributes of other name spaces that mean something, under the name they get whatever their prefix is.
_FOREIGN = {"href": "xlink:href", "label": "label"}


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

    Elements of SVG have no prefix, svg, or that of the root. What entities stand for is bounded by expat.
    """
    parser = expat.ParserCreate()
    roots: list[Node] = []
    stack: list[Node] = []
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
            stack[-1].text += data

    def declared(name: str, parameter: int, value: str | None, *_: object) -> None:
        if parameter or value is None:
            raise fault(f"declares the entity {name[:40]!r}, which is in another file; save it without a DOCTYPE")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _: stack.pop()
    parser.CharacterDataHandler = text
    parser.EntityDeclHandler = declared
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        place = f"line {error.lineno}, column {error.offset + 1}"
        said = expat.ErrorString(error.code)
        raise InputError(f"{place}: {said}; expected SVG, is the file complete?") from None
    except (ValueError, LookupError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"its encoding is not known: {error}") from None
    if roots[0].tag != "svg":
        raise InputError(f"{roots[0].place()}: expected <svg>")
    return roots[0]
