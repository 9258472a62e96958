"""The entities of a DXF drawing as exact curves, with blocks inserted where the drawing says so.

ezdxf says what an entity holds and in which system its coordinates are; the curves are rational and exact, where ezdxf
draws arcs by Bezier curves. Source: Autodesk, DXF Reference, "Object Coordinate Systems" and ENTITIES section.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from ezdxf.lldxf.const import DXFError
from ezdxf.math import Vec3

from splinefeed.curves.arcs import arc, bulge_arc, moved, polyline
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import unbroken
from splinefeed.errors import CurveError, InputError
from splinefeed.files.sizes import MAX_DRAWING_CURVES
from splinefeed.files.source import in_brief
from splinefeed.formats.drawing import BROKEN, DASHED, Drawing
from splinefeed.formats.dxf_tags import Entity
from splinefeed.numbers import MOST
from splinefeed.records import Array

#: Blocks within blocks; drawings of people have three or four.
MAX_DEPTH = 32
#: Entities looked at, those in blocks again for each reference to them.
MAX_VISITS = 1_000_000
#: References to blocks, those within blocks again for each reference: most of them draw more than one curve.
MAX_INSERTS = MAX_DRAWING_CURVES // 2
#: A bulge below this is straight: the arc is within rounding of its chord.
LEAST_BULGE = 1e-15
#: Most fit points of all splines of a drawing that have no control points: as many lines would be read faster.
MAX_FIT_POINTS = 20_000
#: Knots closer than this share of the whole range are one: CAD writes them apart by rounding.
SAME_KNOT = 1e-12
#: What ezdxf would put a default for and no drawing leaves out.
_REQUIRED = {
    "LINE": ("start", "end"),
    "ARC": ("center", "radius", "start_angle", "end_angle"),
    "CIRCLE": ("center", "radius"),
    "ELLIPSE": ("center", "major_axis", "ratio"),
    "VERTEX": ("location",),
    "INSERT": ("name",),
}
#: Flags of a POLYLINE and of its vertices, and of a block.
_IN_SPACE, _MESH, _FRAME_VERTEX, _EXTERNAL = 8, 16 | 64, 16, 4
#: Groups of a line type's name and of its dashes, which are gaps below 0.
_NAME, _DASH, _BY_LAYER = 2, 49, "bylayer"
_WIDE = "polyline with a width, of which the middle is read"
_NO_LENGTH = "entity without length"
_FIT = "spline given by fit points alone: a cubic by chord length, natural ends where no tangent is given"

Placement = tuple[Array, Array]  # matrix (3, 3) and offset (3,), mm: where coordinates p lie, matrix @ p + offset


class DxfBlock(NamedTuple):
    """A block: its entities, base point, and the file that it stands for if it is an external reference."""

    entities: list[Entity]
    base: Array
    external: str


def dashed_type(entity: Entity) -> str:
    """Return the name of a line type that has gaps, in small letters; "" for what is none."""
    said = [(tag.code, str(tag.value).strip()) for tag in entity.tags]
    gaps = entity.kind == "LTYPE" and any(code == _DASH and value.startswith("-") for code, value in said)
    return next((value for code, value in said if code == _NAME), "").casefold() if gaps else ""


class TooMuchError(InputError):
    """A limit on the whole drawing; not even repairing goes on after it."""


class EntityReader:
    """Read entities into a `Drawing`, piece by piece."""

    def __init__(self, drawing: Drawing) -> None:
        self.drawing = drawing
        self.blocks: dict[str, DxfBlock] = {}
        self.visits = self.inserts = self.fitted = 0
        self.seen_layers: dict[str, None] = {}  # in the order of the file
        self.states: dict[str, str] = {}  # of layers by their names in small letters: frozen, off or ""
        self.line_types: dict[str, str] = {}  # of layers; and those that have gaps, all in small letters
        self.dashed = set[str]()
        # by id what ezdxf loads and its curves: entities of a block are met again at each reference to it
        self._known: dict[int, tuple[Any, list[NurbsCurve]]] = {}
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

    def read_blocks(self, entities: Sequence[Entity]) -> None:
        """Take over the blocks by their name in small letters, as DXF compares names."""
        inside: list[Entity] = []
        for entity in entities:
            if entity.kind == "BLOCK":
                block = self.understood(entity).dxf
                external = block.xref_path.strip() or "another file" if block.flags & _EXTERNAL else ""
                inside = []
                name = block.get("name", "").strip().casefold()
                self.blocks[name] = DxfBlock(inside, np.array(Vec3(block.base_point).xyz), external)
            elif entity.kind != "ENDBLK":
                inside.append(entity)

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
                loaded, curves = self._known.get(id(entity)) or self._understood(entity)
                said = loaded.dxf.get
                layer = self._wanted(said("layer", "0").strip(), inherited)
                unseen = "in paper space" if said("paperspace", 0) and not above else ""
                unseen = "invisible" if said("invisible", 0) else unseen or self._unseen(kind, layer)
                if layer is None and kind != "INSERT":
                    continue
                if unseen and not self.drawing.reads(f"{kind} {unseen}"):
                    continue
                line_type = said("linetype", _BY_LAYER).casefold()
                if line_type == _BY_LAYER:
                    line_type = self.line_types.get((layer or "").casefold(), "")
                if line_type in self.dashed and kind != "INSERT":
                    self.drawing.notes[DASHED] += 1
                if kind == "INSERT":
                    self._insert(entity, loaded, place, inherited, above)
                else:
                    self._add(kind, curves, place, layer)
            except TooMuchError:
                raise
            except InputError as error:
                self.drawing.fault(str(error))

    def understood(self, entity: Entity) -> Any:
        """Load the entity by ezdxf; InputError for what it cannot load, or lacks a place."""
        try:
            loaded = entity.loaded()
        except InputError as error:
            raise self._error(entity, str(error)) from None
        except (DXFError, ValueError, TypeError, OverflowError) as error:
            raise self._error(entity, f"ezdxf says: {in_brief(error).rstrip('.')}") from None
        values = loaded.dxf.all_existing_dxf_attribs()
        for name in _REQUIRED.get(entity.kind, ()):
            if name not in values:
                raise self._error(entity, f"has no {name}; is the file complete?")
        # a spline lies in space as it is, whatever its extrusion
        if "extrusion" in values and values["extrusion"].is_null and entity.kind not in ("SPLINE", "HELIX"):
            raise self._error(entity, "the extrusion (group 210) has no length")
        return loaded

    def _error(self, entity: Entity, text: str) -> InputError:
        return InputError(f"{entity.place}: {entity.kind}: {text}")

    def _understood(self, entity: Entity) -> tuple[Any, list[NurbsCurve]]:
        loaded = self.understood(entity)
        try:
            curves = [] if entity.kind == "INSERT" else self._shapes[entity.kind](entity, loaded)
        except (CurveError, ArithmeticError) as error:
            raise self._error(entity, in_brief(error)) from None
        self._known[id(entity)] = loaded, curves
        return loaded, curves

    def _unseen(self, kind: str, layer: str | None) -> str:
        """Why something on a layer is not seen, or ""; of a block on a layer that is off the layers within count."""
        state = self.states.get((layer or "").casefold(), "")
        named = layer is not None and layer.casefold() in self.drawing.wanted
        return "" if named or (kind == "INSERT" and state == "off") or not state else f"on layer {layer!r}, {state}"

    def _wanted(self, layer: str, inherited: str) -> str | None:
        """The layer that something is drawn on, or None if that one is not to be read."""
        if inherited and layer == "0":
            layer = inherited
        if self.drawing.wanted and layer.casefold() not in self.drawing.wanted:
            self.seen_layers[layer] = None
            return None
        return layer

    def _add(self, kind: str, curves: list[NurbsCurve], place: Placement | None, layer: str | None) -> None:
        if layer is None or not curves:
            return
        if place is not None:
            curves = [moved(curve, *place) for curve in curves]
        self.seen_layers[layer] = None
        if kind == "SPLINE" and len(curves) > 1:  # it may jump
            self.drawing.add_runs(curves, layer)
        else:
            self.drawing.add(curves, layer)

    def _visit(self, count: int) -> None:
        self.visits += count
        if self.visits > MAX_VISITS:
            raise TooMuchError(
                f"has more than {MAX_VISITS} entities with those of its nested blocks; "
                f"choose layers, or explode the blocks that are needed"
            )

    # --- curves -------------------------------------------------------------------------------------------------------

    def _line(self, entity: Entity, line: Any) -> list[NurbsCurve]:
        ends = np.array([line.dxf.start.xyz, line.dxf.end.xyz])
        return [polyline(ends)] if line.dxf.start != line.dxf.end else self._vertices(ends)

    def _arc(self, entity: Entity, circle: Any) -> list[NurbsCurve]:
        radius = circle.dxf.radius
        if radius < 0.0:
            raise self._error(entity, f"radius (group 40) is {radius:g}; expected one above 0")
        start, sweep = 0.0, 2.0 * math.pi
        if entity.kind == "ARC":
            turn = math.fmod(circle.dxf.end_angle - circle.dxf.start_angle, 360.0)
            if circle.dxf.end_angle == circle.dxf.start_angle:  # no sweep: a circle goes from 0 to 360
                radius = 0.0
            turn += 360.0 if turn <= 0.0 else 0.0
            start, sweep = math.radians(circle.dxf.start_angle), math.radians(turn)
        if radius == 0.0:
            self.drawing.left_out[_NO_LENGTH] += 1
            return []
        axes = own_axes(circle)
        return [arc(axes @ circle.dxf.center.xyz, axes[:, 0] * radius, axes[:, 1] * radius, start, sweep)]

    def _ellipse(self, entity: Entity, ellipse: Any) -> list[NurbsCurve]:
        major, first, last = ellipse.dxf.major_axis, ellipse.dxf.start_param, ellipse.dxf.end_param
        minor = Vec3(ellipse.dxf.extrusion).normalize().cross(major) * ellipse.dxf.ratio
        if major.is_null or minor.is_null:
            raise self._error(entity, f"an axis has no length (ratio {ellipse.dxf.ratio:g})")
        if first == last:
            self.drawing.left_out[_NO_LENGTH] += 1
            return []
        sweep = math.fmod(last - first, 2.0 * math.pi)
        if abs(last - first) >= 2.0 * math.pi - 1e-9 or sweep == 0.0:
            sweep = 2.0 * math.pi
        elif sweep < 0.0:
            sweep += 2.0 * math.pi
        center, *radii = (np.array(each.xyz) for each in (ellipse.dxf.center, major, minor))
        return [arc(center, radii[0], radii[1], first, sweep)]

    def _lwpolyline(self, entity: Entity, line: Any) -> list[NurbsCurve]:
        rows = np.array(line.lwpoints.values).reshape(-1, 5)  # x, y, two widths, bulge
        if line.dxf.get("const_width", 0.0) or rows[:, 2:4].any():
            self.drawing.notes[_WIDE] += 1
        points = np.column_stack([rows[:, :2], np.full(len(rows), line.dxf.elevation)])
        return self._vertices(points, rows[:, 4].tolist(), line.closed, own_axes(line))

    def _polyline(self, entity: Entity, line: Any) -> list[NurbsCurve]:
        if line.dxf.flags & _MESH:
            self.drawing.left_out["POLYLINE mesh"] += 1
            return []
        vertices = [self.understood(vertex).dxf for vertex in entity.vertices]
        widths = [each.get(f"{end}_width", 0.0) for each in vertices for end in ("start", "end")]
        if any(widths) or line.dxf.get("default_start_width", 0.0) or line.dxf.get("default_end_width", 0.0):
            self.drawing.notes[_WIDE] += 1
        vertices = [each for each in vertices if not each.flags & _FRAME_VERTEX]  # on no curve: a control point
        points = np.array([each.location.xyz for each in vertices]).reshape(-1, 3)
        if line.dxf.flags & _IN_SPACE:
            return self._vertices(points, closed=line.is_closed)
        points[:, 2] = Vec3(line.dxf.elevation).z
        return self._vertices(points, [each.bulge for each in vertices], line.is_closed, own_axes(line))

    def _vertices(
        self, points: Array, bulges: Sequence[float] = (), closed: bool = False, axes: Array | None = None
    ) -> list[NurbsCurve]:
        """Straight runs as one curve each, and the arcs between them."""
        if closed and len(points) > 1:
            points = np.concatenate([points, points[:1]])
        moves = (points[1:] != points[:-1]).any(axis=1)
        if not moves.any():
            self.drawing.left_out[_NO_LENGTH] += 1
            return []
        bent = [i for i, (bulge, moves_there) in enumerate(zip(bulges, moves.tolist(), strict=False))
                if moves_there and not abs(bulge) < LEAST_BULGE]  # fmt: skip
        curves: list[NurbsCurve] = []
        begin = 0
        for i in [*bent, len(moves)]:
            run = points[begin : i + 1]
            run = run if moves[begin:i].all() else run[np.append(True, moves[begin:i])]
            if len(run) > 1:
                curves.append(polyline(run))
            if i < len(moves):
                curves.append(bulge_arc(points[i], points[i + 1], bulges[i]))
            begin = i + 1
        return curves if axes is None or axes is _SAME else [moved(curve, axes, np.zeros(3)) for curve in curves]

    def _spline(self, entity: Entity, spline: Any) -> list[NurbsCurve]:
        control, fit = (np.array(each.values).reshape(-1, 3) for each in (spline.control_points, spline.fit_points))
        knots, weights = np.array(spline.knots), np.array(spline.weights)
        if not len(control):
            return self._through(entity, spline, fit)
        if len(weights) not in (0, len(control)):
            raise CurveError(f"{len(weights)} weights (group 41) for {len(control)} control points; expected one each")
        if len(knots):
            apart = np.diff(knots, prepend=knots[0])
            number = np.cumsum(np.abs(apart) > SAME_KNOT * abs(knots[-1] - knots[0]))
            knots = np.where(apart < 0.0, knots, knots[np.searchsorted(number, number)])
        parts = unbroken(spline.dxf.degree, knots, control, weights if len(weights) else None)
        if len(parts) > 1:
            self.drawing.notes[BROKEN] += 1
            parts = [part for part in parts if np.any(part[1] != part[1][0])]
        return [NurbsCurve(spline.dxf.degree, *part) for part in parts]

    def _through(self, entity: Entity, spline: Any, fit: Array) -> list[NurbsCurve]:
        """The cubic through fit points by chord length, with the tangents given or natural ends; periodic if closed."""
        from scipy.interpolate import make_interp_spline

        around = spline.dxf.flags & (spline.CLOSED | spline.PERIODIC) and len(fit) > 2
        fit = np.concatenate([fit, fit[:1]]) if around else fit
        fit = fit[np.append(True, np.any(fit[1:] != fit[:-1], axis=1))[: len(fit)]]
        if len(fit) < 2:
            raise self._error(entity, "has no control points and no two different fit points")
        self.fitted += len(fit)
        if self.fitted > MAX_FIT_POINTS:
            raise TooMuchError(
                f"{entity.place}: {entity.kind}: {self.fitted} fit points up to here; at most {MAX_FIT_POINTS} are "
                "joined in a drawing; write control points or lines"
            )
        self.drawing.notes[_FIT] += 1
        tangents = [spline.dxf.get(name) for name in ("start_tangent", "end_tangent")]
        if len(fit) == 2 and tangents == [None, None] and not around:
            return [polyline(fit)]
        ends = [[(2, np.zeros(3))] if each is None else [(1, np.array(each.normalize().xyz))] for each in tangents]
        chords = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(fit, axis=0), axis=1))])
        try:
            made = make_interp_spline(chords, fit, k=3, bc_type="periodic" if around else (ends[0], ends[1]))
        except (ValueError, np.linalg.LinAlgError):  # chords that are one number, or so uneven that nothing is left
            apart = np.linalg.norm(np.diff(fit, axis=0), axis=1)
            raise self._error(
                entity,
                f"has fit points {apart.min():.3g} and {apart.max():.3g} apart, which no spline joins",
            ) from None
        made = NurbsCurve(3, made.t, made.c)
        return [made.with_clamped_ends() if around else made]

    # --- blocks -------------------------------------------------------------------------------------------------------

    def _insert(
        self, entity: Entity, insert: Any, place: Placement | None, inherited: str, above: tuple[str, ...]
    ) -> None:
        dxf = insert.dxf
        name = dxf.name.strip()
        key = name.casefold()
        block = self.blocks.get(key)
        if block is None:
            raise self._error(entity, f"there is no block {name[:40]!r}")
        if key in above or len(above) >= MAX_DEPTH:
            chain = " > ".join([*above, key])[-120:]
            raise self._error(entity, f"block {name[:40]!r} inserts itself, or more than {MAX_DEPTH} deep: {chain}")
        if block.external or not dxf.xscale or not dxf.yscale:
            why = f"external reference to {block.external[:60]}" if block.external else "block reference of scale 0"
            self.drawing.left_out[why] += 1
            return
        layer = inherited if inherited and dxf.layer.strip() == "0" else dxf.layer.strip()
        count = insert.mcount
        self._visit(count)
        self.inserts += count
        if self.inserts > MAX_INSERTS:
            raise TooMuchError(
                f"{entity.place}: more than {MAX_INSERTS} references to blocks, those within blocks counted each time; "
                f"explode the blocks that are needed"
            )
        for one in insert.multi_insert() if count > 1 else [insert]:
            frame = np.array(list(one.matrix44())).reshape(4, 4).T
            matrix = frame[:3, :3]
            inner = matrix, frame[:3, 3] - matrix @ block.base
            if place is not None:
                inner = place[0] @ matrix, place[0] @ inner[1] + place[1]
            if max(np.abs(inner[0]).max(), np.abs(inner[1]).max()) > MOST**0.5:  # of it times a place
                raise self._error(entity, f"block {name[:40]!r}: its scale, with those above it, is too large")
            self.read(block.entities, inner, layer, (*above, key))


_SAME = np.eye(3)


def own_axes(entity: Any) -> Array:
    """Return x, y and z axis (columns) of the system in which a flat entity has its coordinates: ezdxf's OCS."""
    ocs = entity.ocs()
    return np.array([ocs.ux.xyz, ocs.uy.xyz, ocs.uz.xyz]).T if ocs.transform else _SAME
