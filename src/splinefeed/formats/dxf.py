"""DXF drawings, text or binary, read by ezdxf: every curve exactly, blocks inserted, in mm; see docs/formats.md."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Sequence

import numpy as np
from ezdxf.math import Vec3

from splinefeed.errors import FormatError
from splinefeed.formats.contents import Contents
from splinefeed.formats.drawing import Drawing, join_tolerance, layers_from, many, unit_in_mm
from splinefeed.formats.dxf_entities import Block, EntityReader
from splinefeed.formats.dxf_tags import BINARY_MARK, Entity, Sections, read_sections
from splinefeed.formats.dxf_write import write as write
from splinefeed.formats.source import head_text
from splinefeed.geometry.path import JOIN_TOLERANCE

#: What the number in $INSUNITS means, in mm, and how info calls it.
INSERT_UNITS = {
    1: ("in", 25.4),
    2: ("ft", 304.8),
    3: ("mi", 1609344.0),
    4: ("mm", 1.0),
    5: ("cm", 10.0),
    6: ("m", 1000.0),
    7: ("km", 1e6),
    8: ("microinch", 2.54e-5),
    9: ("mil", 0.0254),
    10: ("yd", 914.4),
    13: ("um", 0.001),
    14: ("dm", 100.0),
    15: ("dam", 10000.0),
    16: ("hm", 100000.0),
    21: ("US ft", 1200000.0 / 3937.0),
}
#: Header lines and comments that may stand before the first section.
_COMMENT = "999"
_EXTERNAL = 4  # flag of a block


def holds(head: bytes) -> bool:
    """Whether `head` looks like this format: the mark of a binary file, or a section after comments at most."""
    if head.startswith(BINARY_MARK):
        return True
    lines = [line.strip() for line in head_text(head[:8192]).replace("\r\n", "\n").replace("\r", "\n").split("\n")]
    k = 0
    while k + 1 < len(lines) and lines[k] == _COMMENT:
        k += 2
    return lines[k : k + 2] == ["0", "SECTION"]


def from_file(
    file: str | os.PathLike[str],
    *,
    tolerance: float | str = JOIN_TOLERANCE,
    layer: str | Sequence[str] | None = None,
    units: str | None = None,
    repair: bool = False,
) -> Contents:
    """The paths in a drawing: curves whose ends meet within `tolerance`, mm, in the order of the file.

    `layer` reads these layers only (a list, or names between commas); `units` overrules those of the header.
    """
    allowed, wanted = join_tolerance(tolerance), layers_from(layer)
    source = os.fspath(file)
    found = read_sections(pathlib.Path(file).read_bytes(), source)
    drawing = Drawing(source)
    _check_complete(found, drawing, repair)
    name, scale = _units(found, drawing, units)
    reader = EntityReader(source, drawing, wanted, repair)
    _read_blocks(found, reader)
    reader.read(found.entities["ENTITIES"], None if scale == 1.0 else (np.diag([scale] * 3), np.zeros(3)))
    _say_layers(found, reader, wanted)
    _say_notes(reader)
    return Contents(drawing.paths(pathlib.Path(file).stem, allowed, repair), name)


def _check_complete(found: Sections, drawing: Drawing, repair: bool) -> None:
    """FormatError for a file without entities or cut inside a section; when repairing, its last entity goes."""
    if "ENTITIES" not in found.entities:
        raise FormatError(f"{found.source}: has no section ENTITIES; is the file complete, and is it a drawing?")
    if found.complete:
        return
    if found.open_section:
        text = f"ends inside section {found.open_section}; is the file complete?"
        if not repair:
            raise found.error(found.last, text)
        lost = found.entities[found.open_section]
        drawing.findings.append(f"the file {text} its last entity is left out" if lost else f"the file {text}")
        del lost[-1:]
    else:
        drawing.findings.append("the file has no EOF at its end, but its sections are complete")


def _units(found: Sections, drawing: Drawing, override: str | None) -> tuple[str, float]:
    """Name of the drawing's unit, and how many mm it is."""
    if override is not None:
        return override, unit_in_mm(override)
    number, measurement = (_header_number(found, name) for name in ("$INSUNITS", "$MEASUREMENT"))
    if number in INSERT_UNITS:
        return INSERT_UNITS[number]
    if number:
        raise FormatError(f"{found.source}: $INSUNITS is {number}, not a unit of workpieces; give units")
    hint = " ($MEASUREMENT says inch: if so, give units in)" if measurement == 0 else ""
    drawing.findings.append(f"the drawing has no units; read as mm{hint}")
    return "mm", 1.0


def _header_number(found: Sections, name: str) -> int | None:
    said = found.header.get(name)
    try:
        return None if said is None else int(float(str(said)))
    except (ValueError, OverflowError):
        raise FormatError(
            f"{found.source}: {name} is {str(said).strip()[:40]!r}; expected a whole number, or give units"
        ) from None


def _read_blocks(found: Sections, reader: EntityReader) -> None:
    """The blocks by their name in small letters, as DXF compares names."""
    inside: list[Entity] | None = None
    for entity in found.entities.get("BLOCKS", []):
        if entity.kind == "BLOCK":
            block = reader.understood(entity).dxf
            inside = []
            external = block.xref_path.strip() or "another file" if block.flags & _EXTERNAL else ""
            base = np.array(Vec3(block.base_point).xyz)
            reader.blocks[block.get("name", "").strip().casefold()] = Block(inside, base, external)
        elif entity.kind == "ENDBLK":
            inside = None
        elif inside is not None:
            inside.append(entity)


def _say_layers(found: Sections, reader: EntityReader, wanted: Sequence[str]) -> None:
    """FormatError for a wanted layer that is not there; findings for layers that are hidden but were read."""
    table = [reader.understood(entity) for entity in found.entities.get("TABLES", []) if entity.kind == "LAYER"]
    states = {
        each.dxf.get("name", ""): "frozen" if each.is_frozen() else "off" if each.is_off() else "" for each in table
    }
    there = {name.casefold(): name for name in [*states, *reader.seen_layers]}
    for name in wanted:
        if name.casefold() not in there:
            listed = ", ".join(repr(each) for each in list(there.values())[:12])
            raise FormatError(f"{found.source}: has no layer {name[:40]!r}; there are {listed or 'none'}")
    hidden = {name.casefold(): state for name, state in states.items() if state}
    for name, count in reader.seen_layers.items():
        if count and name.casefold() in hidden:
            reader.drawing.findings.append(
                f"layer {name!r} is {hidden[name.casefold()]} in the drawing; its {count} curves are read anyway"
            )


def _say_notes(reader: EntityReader) -> None:
    sentences = {
        "faulty": ("faulty entity is left out", "faulty entities are left out"),
        "zero": ("entity without length is left out", "entities without length are left out"),
        "flat": ("block reference of scale 0 is left out", "block references of scale 0 are left out"),
        "knots": ("knot of a spline differs", "knots of splines differ"),
        "open": ("spline says that it is closed but is not", "splines say that they are closed but are not"),
        "broken": ("spline has a knot", "splines have knots"),
        "fit": ("spline is given by fit points alone", "splines are given by fit points alone"),
    }
    more = {
        "knots": " by rounding only from the one before and was made equal",
        "open": "; left as drawn",
        "broken": " of multiplicity degree + 1, at which it may jump; each is the pieces between, exactly",
        "fit": ": a cubic by chord length runs through them, with natural ends where no tangent is given",
    }
    for key, count in reader.notes.items():
        reader.drawing.findings.append(many(count, *sentences[key]) + more.get(key, ""))
