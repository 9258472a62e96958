"""The sections of a DXF file, text or binary, as ezdxf loads its tags; every entity knows its place in the file.

ezdxf's own document wants every section sound, objects and styles too, and says of an error neither line nor entity;
its loaders of tags and of single entities, which are used here, ask for no more than what is drawn.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain, pairwise

from ezdxf.entities import factory
from ezdxf.entities.dxfentity import DXFEntity
from ezdxf.filemanagement import dxf_stream_info
from ezdxf.lldxf.const import DXFError
from ezdxf.lldxf.extendedtags import ExtendedTags
from ezdxf.lldxf.tagger import ascii_tags_loader, binary_tags_loader, tag_compiler
from ezdxf.lldxf.tags import group_tags
from ezdxf.lldxf.types import DXFTag

from splinefeed.errors import InputError
from splinefeed.files.source import in_brief
from splinefeed.numbers import finite

BINARY_MARK = b"AutoCAD Binary DXF\r\n\x1a\x00"
#: Most tags in one file, which take 2 GB; a drawing of a hundred thousand entities has about three million.
MAX_TAGS = 8_000_000
_COMMENT = 999
#: Group codes whose values are numbers. Source: Autodesk, DXF Reference, "Group Code Value Types".
_NUMERIC = frozenset(
    code
    for first, last in (
        (10, 79),
        (90, 99),
        (110, 179),
        (210, 239),
        (270, 289),
        (370, 389),
        (400, 409),
        (420, 429),
        (440, 469),
    )
    for code in range(first, last + 1)
)
#: A SPLINE or LWPOLYLINE has three subclasses: handle, layer and colour, shape; simple writers leave out their marks.
_SUBCLASSES = 3


def _counted(tags: Iterator[DXFTag]) -> Iterator[DXFTag]:
    """The tags, and InputError for too many, before they are kept together as one entity."""
    for number, tag in enumerate(tags):
        if number >= MAX_TAGS:
            raise InputError(f"has more than {MAX_TAGS} tags; that is not a drawing for a tool path")
        yield tag


@dataclass
class Entity:
    """What one code 0 begins.

    Parameters
    ----------
    kind : str
        Its type.
    place : str
        In the file.
    tags : list of DXFTag
        Of the entity.
    vertices : list of Entity
        Of a POLYLINE.
    """

    kind: str
    place: str
    tags: list[DXFTag]
    vertices: list[Entity] = field(default_factory=list)

    def loaded(self) -> DXFEntity:
        """Load the entity by ezdxf; DXFError for tags of which it makes nothing, InputError for numbers."""
        for tag in self.tags:
            if tag.code in _NUMERIC:
                finite(tag.value, f"group {tag.code}")
        # a point of two coordinates ends where another tag begins
        said = [*(tag for tag in self.tags if tag.code != _COMMENT), DXFTag(0, "")]
        tags = ExtendedTags(list(tag_compiler(iter(said)))[:-1])
        if len(tags.subclasses) < _SUBCLASSES:
            tags.subclasses += tags.subclasses[-1:] * (_SUBCLASSES - len(tags.subclasses))
        return factory.load(tags)


def read_sections(content: bytes) -> tuple[dict[str, object], dict[str, list[Entity]], str]:
    """Read a file into entities, strict about what begins and ends where, but not about a file that stops early.

    Parameters
    ----------
    content : bytes
        Of the file.

    Returns
    -------
    header : dict
        Values of the header.
    sections : dict of str to list of Entity
        Entities of each section.
    fault : str
        What is wrong with the end of the file, if anything.
    """
    header: dict[str, object] = {}
    entities: dict[str, list[Entity]] = {}
    fault = ""
    binary = content.startswith(BINARY_MARK)
    name = place = ""
    inside: list[Entity] | None = None
    start = 0  # the number of a tag, from 0
    try:
        loader = _counted(binary_tags_loader(content) if binary else ascii_tags_loader(_text(content), False))
        for head in loader:
            if head.code == 0:
                break
            start += 1
        else:
            return header, entities, fault
        for tags in group_tags(chain([head], loader)):
            place = f"tag {start + 1}" if binary else f"line {2 * start + 1}"
            start += len(tags)
            kind = str(tags[0].value).strip()
            if kind == "SECTION" and inside is None and len(tags) > 1 and tags[1].code == 2:
                name = str(tags[1].value).strip().upper()
                inside = entities.setdefault(name, [])
                if name == "HEADER":
                    header = {str(key.value).strip(): said.value for key, said in pairwise(tags) if key.code == 9}
            elif kind == "SECTION" or (inside is None and kind not in ("ENDSEC", "EOF")):
                raise InputError(f"{place}: {kind[:40]!r} where no section may begin; is the file complete?")
            elif kind == "ENDSEC":
                inside = None
            elif kind == "EOF" or inside is None:
                break
            elif kind == "VERTEX" and inside and inside[-1].kind == "POLYLINE":
                inside[-1].vertices.append(Entity(kind, place, tags))
            elif kind not in ("VERTEX", "ATTRIB", "SEQEND"):
                inside.append(Entity(kind, place, tags))
    except (DXFError, IndexError, ValueError, struct.error) as error:
        if isinstance(error, InputError):
            raise
        said = f"ezdxf says: {in_brief(error).rstrip('.')}" if isinstance(error, DXFError) else "ends inside a tag"
        raise InputError(f"{said}; is the file complete?") from None
    if inside is not None:
        fault = f"{place}: ends inside section {name}; is the file complete?"
        del inside[-1:]  # what the end of the file cuts
    return header, entities, fault


def _text(content: bytes) -> io.StringIO:
    """The text of a file with any of the line ends in use: UTF-8, or what its header says."""
    if b"\0" in content:
        raise InputError(f"byte {content.index(0)}: is binary; expected a text or binary DXF drawing")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        try:
            encoding = dxf_stream_info(io.StringIO(content.decode("latin-1"), newline=None)).encoding
        except StopIteration:  # no header, or half of one
            encoding = "cp1252"
        text = content.decode(encoding, "surrogateescape")
    return io.StringIO(text, newline=None)
