"""The elements of an SVG file with the line of each, and what styles say of them; nothing outside the file is opened.

Of style sheets those rules are read that drawing programs write: of a name, a class, an id or `*`. Source: W3C, CSS
Cascading and Inheritance 3.
"""

from __future__ import annotations

import gzip
import io
import re
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

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
#: A selector of one name, class or id, or of everything; and what its kind weighs against the others.
_PLAIN, _WEIGHTS = re.compile(r"\*|[.#]?[^\W\d][\w-]*+"), {"*": 0, ".": 2, "#": 3}
#: What is in a style attribute weighs more than any rule.
_OWN = 4
_COMMENT = re.compile(r"/\*.*?(?:\*/|\Z)|<!--|-->", re.DOTALL)
#: At-rules that move nothing.
_SILENT = re.compile(r"@(?:charset|namespace|font-face|(?:-webkit-)?keyframes|page|color-profile)\b", re.IGNORECASE)

Said = dict[str, tuple[str, bool]]  # property: its value, and whether it is called important


@dataclass
class Node:
    """An element.

    Parameters
    ----------
    tag : str
        Its name; "" in a name space that is not SVG's.
    attrib : dict of str to str
        Attributes.
    line : int
        In the file.
    children : list of Node
        Elements in it.
    text : str
        Of a style.
    """

    tag: str
    attrib: dict[str, str]
    line: int
    children: list[Node] = field(default_factory=list)
    text: str = ""

    def get(self, name: str, otherwise: str = "") -> str:
        """Return an attribute."""
        return self.attrib.get(name, otherwise)

    def walk(self) -> Iterator[Node]:
        """Yield the node itself and all below it, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def place(self) -> str:
        """Return line and element, as a message names them."""
        name = self.get("id")
        return f"line {self.line}: <{self.tag}" + (f" id={name[:40]!r}>" if name else ">")


def unpacked(content: bytes) -> bytes:
    """Return `content`, unpacked if it is gzip (.svgz)."""
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
    """Parse the content of a drawing.

    Parameters
    ----------
    content : bytes
        XML.

    Returns
    -------
    Node
        The root element.

    Raises
    ------
    InputError
        For what is not XML, refers to other files, or is too large or too deep.

    Notes
    -----
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
    """Apply the style sheets of a drawing.

    `findings` names rules that are not understood and would move or hide things.
    """

    def __init__(self, root: Node) -> None:
        # by selector, of each property: whether it is important, the weight and the number of its rule, and its value
        self._rules: dict[str, dict[str, tuple[bool, int, int, str]]] = {}
        self._count = 0
        self._unread: list[str] = []
        for node in root.walk():
            if node.tag == "style" and node.get("type", "text/css").strip() in ("", "text/css"):
                self._read(_COMMENT.sub("", node.text))
        named = ", ".join(repr(each[:40]) for each in self._unread[:3])
        many = f"{len(self._unread)} rules" if len(self._unread) > 1 else "1 rule"
        what = "not followed; what such a rule hides, moves or sizes is read as it stands"
        said = f"{many} of the style sheet {what}: {named}"
        self.findings = [said] if self._unread else []

    def of(self, node: Node) -> Mapping[str, str]:
        """Return attributes of `node`, those that are properties as its style and the rules for it have them."""
        own = _declared(node.get("style"))
        classes = [f".{each}" for each in node.get("class").split()] if self._rules else []
        keys = ["*", node.tag, *classes, f"#{node.get('id')}"]
        rules = [self._rules[key] for key in keys if key in self._rules]
        if not own and not rules:
            return node.attrib
        found = {name: (important, _OWN, 0, value) for name, (value, important) in own.items()}
        for rule in rules:
            found |= {name: max(said, found.get(name, said)) for name, said in rule.items()}
        given = {**node.attrib, **{name: said[-1] for name, said in found.items()}}
        return {name: value for name, value in given.items() if value.lower() not in ("initial", "unset", "revert")}

    def _read(self, sheet: str) -> None:
        around: list[str] = []  # at-rules that are open
        for part in sheet.split("}"):
            *begun, body = part.split("{")
            *lines, rule = (begun[0] if begun else body).split(";")
            self._unread += [each.strip() for each in lines if each.strip().lower().startswith("@import")]
            opened = around + [rule, *begun[1:]][: len(begun)]
            around = opened[:-1]
            if not opened or not (said := _declared(body)):
                continue
            self._count += 1
            outer = opened[0].strip()
            for selector in [outer] if around or outer.startswith("@") else map(str.strip, outer.split(",")):
                if _PLAIN.fullmatch(selector):
                    known, weight = self._rules.setdefault(selector, {}), _WEIGHTS.get(selector[0], 1)
                    for name, (value, important) in said.items():
                        ranked = (important, weight, self._count, value)
                        known[name] = max(ranked, known.get(name, ranked))
                elif not _SILENT.match(selector):
                    self._unread.append(selector)


@lru_cache(maxsize=4096)
def _declared(text: str) -> Said:
    """The declarations in `text`, such as "display: none; fill: red", that move or hide something."""
    found: Said = {}
    for each in _COMMENT.sub("", text).split(";"):
        name, _, words = each.partition(":")
        name, (value, _, mark) = name.strip().lower(), words.partition("!")
        important = mark.strip().lower() == "important"
        if name in RELEVANT and value.strip() and (important or not found.get(name, ("", False))[1]):
            found[name] = value.strip(), important
    return found
