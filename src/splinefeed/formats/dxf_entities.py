"""The entities of a DXF drawing as exact curves, with blocks inserted where the drawing says so.

ezdxf says what an entity holds and in which system its coordinates are; the curves are rational and exact, where ezdxf
draws arcs by Bezier curves. Source: Autodesk, DXF Reference, "Object Coordinate Systems" and ENTITIES section.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from ezdxf.lldxf.const import DXFError
from ezdxf.math import Vec3

from splinefeed.errors import CurveError, FormatError
from splinefeed.formats import dxf_splines
from splinefeed.formats.drawing import Drawing, runs_that_meet
from splinefeed.formats.dxf_tags import Entity, Faults
from splinefeed.formats.source import in_brief
from splinefeed.geometry.arcs import arc, bulge_arc, moved, polyline
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array

#: Blocks within blocks; drawings of people have three or four.
MAX_DEPTH = 32
#: Entities looked at, those in blocks again for each reference to them.
MAX_VISITS = 1_000_000
#: How many faulty entities have a finding each when repairing; the others are counted.
NAMED_FAULTS = 20
#: A bulge below this is straight: the arc is within rounding of its chord.
LEAST_BULGE = 1e-15
#: What ezdxf would put a default for and no drawing leaves out.
_REQUIRED = {
    "LINE": ("start", "end"),
    "ARC": ("center", "radius", "start_angle", "end_angle"),
    "CIRCLE": ("center", "radius"),
    "ELLIPSE": ("center", "major_axis", "ratio"),
    "VERTEX": ("location",),
    "INSERT": ("name",),
}
#: Flags of a POLYLINE and of its vertices.
_CLOSED, _IN_SPACE, _MESH, _FRAME_VERTEX = 1, 8, 16 | 64, 16

_ON_PAPER = "in paper space"

Placement = tuple[Array, Array]  # matrix (3, 3) and offset (3,), mm: where coordinates p lie, matrix @ p + offset


class Block(NamedTuple):
    """A block: its entities, base point, and the file that it stands for if it is an external reference."""

    entities: list[Entity]
    base: Array
    external: str


class TooMuchError(FormatError):
    """A limit on the whole drawing; not even repairing goes on after it."""


class _Known(NamedTuple):
    """An entity that is drawn: what ezdxf says of it, and its curves in the coordinates of its block."""

    layer: str
    unseen: str  # why it is not seen on the screen, if so
    insert: Any  # ezdxf's INSERT; None for a curve
    curves: list[NurbsCurve]


class EntityReader(Faults):
    """Reads entities into a `Drawing`, piece by piece."""

    def __init__(self, source: str, drawing: Drawing, layers: Sequence[str], repair: bool) -> None:
        super().__init__(source, drawing, repair)
        self.layers = {name.casefold() for name in layers}
        self.blocks: dict[str, Block] = {}
        self.visits = 0
        self.seen_layers: Counter[str] = Counter()
        self._known: dict[int, _Known] = {}  # by id: entities of a block are met again at each reference to it
        self._shapes: dict[str, Callable[[Entity, Any], list[NurbsCurve]]] = {
            "LINE": self._line,
            "ARC": self._arc,
            "CIRCLE": self._arc,
            "ELLIPSE": self._ellipse,
            "LWPOLYLINE": self._lwpolyline,
            "POLYLINE": self._polyline,
            "SPLINE": self._spline,
            "HELIX": self._spline,
        }

    def read(
        self, entities: list[Entity], place: Placement | None, inherited: str = "", above: tuple[str, ...] = ()
    ) -> None:
        """Read `entities`, placed by `place`; on layer 0 they are on the layer of the block reference, if any."""
        for entity in entities:
            self._visit(1 + len(entity.vertices))
            kind = entity.kind
            try:
                if kind != "INSERT" and kind not in self._shapes:
                    values = {tag.code: tag.value for tag in reversed(entity.tags)}
                    if self._wanted(str(values.get(8, "0")).strip(), inherited) is not None:
                        self.drawing.left_out[kind[:40]] += 1
                    continue
                known = self._known.get(id(entity)) or self._understood(entity)
                if known.unseen and not (known.unseen == _ON_PAPER and above):
                    self.drawing.left_out[f"{kind} {known.unseen}"] += 1
                elif known.insert is not None:
                    self._insert(entity, known.insert, place, inherited, above)
                else:
                    self._add(kind, known.curves, place, self._wanted(known.layer, inherited))
            except TooMuchError:
                raise
            except FormatError as error:
                if not self.repair:
                    raise
                self.notes["faulty"] += 1
                if self.notes["faulty"] <= NAMED_FAULTS:
                    self.drawing.findings.append(str(error).removeprefix(f"{self.source}: ") + "; left out")

    def understood(self, entity: Entity) -> Any:
        """The entity as ezdxf loads it; FormatError for what it cannot, lacks a place, or has a number not finite."""
        try:
            loaded = entity.loaded()
        except (DXFError, ValueError, TypeError) as error:
            raise self.error(entity, f"ezdxf says: {in_brief(error).rstrip('.')}") from None
        values = loaded.dxf.all_existing_dxf_attribs()
        for name in _REQUIRED.get(entity.kind, ()):
            if name not in values:
                raise self.error(entity, f"has no {name}; is the file complete?")
        # a spline lies in space as it is, whatever its extrusion
        if "extrusion" in values and values["extrusion"].is_null and entity.kind not in ("SPLINE", "HELIX"):
            raise self.error(entity, "the extrusion (group 210) has no length")
        for name, value in values.items():
            size = value.x + value.y + value.z if isinstance(value, Vec3) else value
            if isinstance(size, float) and not math.isfinite(size):
                raise self.error(entity, f"{name} is {value}; expected finite numbers")
        return loaded

    def _understood(self, entity: Entity) -> _Known:
        loaded = self.understood(entity)
        insert, curves = None, []
        if entity.kind == "INSERT":
            insert = loaded
        else:
            try:
                curves = self._shapes[entity.kind](entity, loaded)
            except (CurveError, OverflowError) as error:
                raise self.error(entity, in_brief(error)) from None
        said = loaded.dxf.get
        unseen = "invisible" if said("invisible", 0) else _ON_PAPER if said("paperspace", 0) else ""
        known = self._known[id(entity)] = _Known(said("layer", "0").strip(), unseen, insert, curves)
        return known

    def _wanted(self, layer: str, inherited: str) -> str | None:
        """The layer that something is drawn on, or None if that one is not to be read."""
        if inherited and layer == "0":
            layer = inherited
        if self.layers and layer.casefold() not in self.layers:
            self.seen_layers[layer] += 0
            return None
        return layer

    def _add(self, kind: str, curves: list[NurbsCurve], place: Placement | None, layer: str | None) -> None:
        if layer is None or not curves:
            return
        if place is not None:
            curves = [moved(curve, *place) for curve in curves]
        self.seen_layers[layer] += len(curves)
        # only the pieces of a spline that jumps do not meet
        for run in [curves] if kind != "SPLINE" or len(curves) == 1 else runs_that_meet(curves):
            self.drawing.add(run, layer)

    def _visit(self, count: int) -> None:
        self.visits += count
        if self.visits > MAX_VISITS:
            raise TooMuchError(
                f"{self.source}: has more than {MAX_VISITS} entities with those of its nested blocks; "
                f"choose layers, or explode the blocks that are needed"
            )

    # --- curves -------------------------------------------------------------------------------------------------------

    def _line(self, entity: Entity, line: Any) -> list[NurbsCurve]:
        start, end = line.dxf.start.xyz, line.dxf.end.xyz
        if start == end:
            self.notes["zero"] += 1
            return []
        return [polyline(np.array([start, end]))]

    def _arc(self, entity: Entity, circle: Any) -> list[NurbsCurve]:
        radius = circle.dxf.radius
        if radius < 0.0:
            raise self.error(entity, f"radius (group 40) is {radius:g}; expected one above 0")
        start, sweep = 0.0, 2.0 * math.pi
        if entity.kind == "ARC":
            turn = math.fmod(circle.dxf.end_angle - circle.dxf.start_angle, 360.0)
            turn += 360.0 if turn <= 0.0 else 0.0
            start, sweep = math.radians(circle.dxf.start_angle), math.radians(turn)
        if radius == 0.0:
            self.notes["zero"] += 1
            return []
        axes = own_axes(circle)
        return [arc(axes @ circle.dxf.center.xyz, axes[:, 0] * radius, axes[:, 1] * radius, start, sweep)]

    def _ellipse(self, entity: Entity, ellipse: Any) -> list[NurbsCurve]:
        major, first, last = ellipse.dxf.major_axis, ellipse.dxf.start_param, ellipse.dxf.end_param
        minor = Vec3(ellipse.dxf.extrusion).normalize().cross(major) * ellipse.dxf.ratio
        if major.is_null or minor.is_null:
            raise self.error(entity, f"an axis has no length (ratio {ellipse.dxf.ratio:g})")
        sweep = math.fmod(last - first, 2.0 * math.pi)
        if abs(last - first) >= 2.0 * math.pi - 1e-9 or sweep == 0.0:
            sweep = 2.0 * math.pi
        elif sweep < 0.0:
            sweep += 2.0 * math.pi
        center, *radii = (np.array(each.xyz) for each in (ellipse.dxf.center, major, minor))
        return [arc(center, radii[0], radii[1], first, sweep)]

    def _spline(self, entity: Entity, spline: Any) -> list[NurbsCurve]:
        return dxf_splines.curves(self, entity, spline)

    def _lwpolyline(self, entity: Entity, line: Any) -> list[NurbsCurve]:
        rows = np.array(line.lwpoints.values).reshape(-1, 5)  # x, y, two widths, bulge
        if not np.isfinite(rows).all():
            raise self.error(entity, "has a vertex that is not finite")
        points = np.column_stack([rows[:, :2], np.full(len(rows), line.dxf.elevation)])
        return self._vertices(points, rows[:, 4].tolist(), line.closed, own_axes(line))

    def _polyline(self, entity: Entity, line: Any) -> list[NurbsCurve]:
        flags = line.dxf.flags
        if flags & _MESH:
            self.drawing.left_out["POLYLINE mesh"] += 1
            return []
        vertices = [self.understood(vertex).dxf for vertex in entity.vertices]
        vertices = [each for each in vertices if not each.flags & _FRAME_VERTEX]  # on no curve: a control point
        points = np.array([each.location.xyz for each in vertices]).reshape(-1, 3)
        if flags & _IN_SPACE:
            return self._vertices(points, [0.0] * len(points), bool(flags & _CLOSED), _SAME)
        points[:, 2] = Vec3(line.dxf.elevation).z
        return self._vertices(points, [each.bulge for each in vertices], bool(flags & _CLOSED), own_axes(line))

    def _vertices(self, points: Array, bulges: list[float], closed: bool, axes: Array) -> list[NurbsCurve]:
        """Straight runs as one curve each, and the arcs between them."""
        if closed and len(points) > 1:
            points = np.concatenate([points, points[:1]])
        moves = (points[1:] != points[:-1]).any(axis=1)
        if len(points) < 2 or not moves.any():
            self.notes["zero"] += 1
            return []
        bent = bulges[: len(moves)]
        if not moves.all():
            points = np.concatenate([points[:1], points[1:][moves]])
            bent = [b for b, moving in zip(bent, moves.tolist(), strict=True) if moving]
        curves: list[NurbsCurve] = []
        begin = 0
        for i, bulge in enumerate(bent):
            if not abs(bulge) < LEAST_BULGE:
                if i > begin:
                    curves.append(polyline(points[begin : i + 1]))
                curves.append(bulge_arc(points[i], points[i + 1], bulge))
                begin = i + 1
        if begin < len(points) - 1:
            curves.append(polyline(points[begin:]))
        return curves if axes is _SAME else [moved(curve, axes, np.zeros(3)) for curve in curves]

    # --- blocks -------------------------------------------------------------------------------------------------------

    def _insert(
        self, entity: Entity, insert: Any, place: Placement | None, inherited: str, above: tuple[str, ...]
    ) -> None:
        dxf = insert.dxf
        name = dxf.name.strip()
        key = name.casefold()
        layer = inherited if inherited and dxf.layer.strip() == "0" else dxf.layer.strip()
        block = self.blocks.get(key)
        if block is None:
            raise self.error(entity, f"there is no block {name[:40]!r}")
        if key in above:
            chain = " > ".join([*above[above.index(key) :], key])
            raise self.error(entity, f"block {name[:40]!r} inserts itself ({chain[:120]})")
        if len(above) >= MAX_DEPTH:
            raise self.error(entity, f"blocks are nested more than {MAX_DEPTH} deep")
        if block.external:
            self.drawing.left_out[f"external reference to {block.external[:60]}"] += 1
            return
        if not dxf.xscale or not dxf.yscale:
            self.notes["flat"] += 1
            return
        count = insert.mcount
        self._visit(count)
        for one in insert.multi_insert() if count > 1 else [insert]:
            frame = np.array(list(one.matrix44())).reshape(4, 4).T
            matrix = frame[:3, :3]
            inner = matrix, frame[:3, 3] - matrix @ block.base
            if place is not None:
                inner = place[0] @ matrix, place[0] @ inner[1] + place[1]
            self.read(block.entities, inner, layer, (*above, key))


_SAME = np.eye(3)


def own_axes(entity: Any) -> Array:
    """x, y and z axis (columns) of the system in which a flat entity has its coordinates: ezdxf's OCS."""
    ocs = entity.ocs()
    return np.array([ocs.ux.xyz, ocs.uy.xyz, ocs.uz.xyz]).T if ocs.transform else _SAME
