"""The entities of a DXF drawing as exact curves, with blocks inserted where the drawing says so.

Coordinates of flat entities are in a system of their own whose z is the extrusion (group 210): the arbitrary axis
algorithm says where its x points. Source: Autodesk, DXF Reference, "Object Coordinate Systems" and ENTITIES section.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from splinefeed.errors import FormatError
from splinefeed.formats import dxf_splines
from splinefeed.formats.drawing import Drawing, runs_that_meet
from splinefeed.formats.dxf_tags import Entity, Tags, fields
from splinefeed.geometry.arcs import arc, bulge_arc, moved, polyline
from splinefeed.geometry.curve import NurbsCurve
from splinefeed.records import Array

#: Blocks within blocks; drawings of people have three or four.
MAX_DEPTH = 32
#: Entities and tags (by sixteens) looked at, those in blocks again for each reference to them.
MAX_VISITS = 1_000_000
#: How many faulty entities have a finding each when repairing; the others are counted.
NAMED_FAULTS = 20
#: A bulge below this is straight: the arc is within rounding of its chord.
LEAST_BULGE = 1e-15
#: An extrusion whose x and y are both below this has its x axis from world y (the arbitrary axis algorithm).
_NEAR_Z = 1.0 / 64.0

Fields = dict[int, "str | float"]


class Placement(NamedTuple):
    """Where an entity's coordinates lie: matrix (3, 3) @ p + offset (3,), mm."""

    matrix: Array
    offset: Array

    def within(self, inner_matrix: Array, inner_offset: Array) -> Placement:
        """This placement of what is placed by `inner_matrix` and `inner_offset` already."""
        return Placement(self.matrix @ inner_matrix, self.matrix @ inner_offset + self.offset)


@dataclass(frozen=True)
class Block:
    """A block: its entities, base point and flags, and the file that it stands for if it is an external reference."""

    entities: list[Entity]
    base: Array
    external: str


class TooMuchError(FormatError):
    """A limit on the whole drawing; not even repairing goes on after it."""


class EntityReader:
    """Reads entities into a `Drawing`, piece by piece."""

    def __init__(
        self, tags: Tags, blocks: dict[str, Block], drawing: Drawing, layers: Sequence[str], repair: bool
    ) -> None:
        self.tags = tags
        self.blocks = blocks
        self.drawing = drawing
        self.layers = {name.casefold() for name in layers}
        self.repair = repair
        self.visits = 0
        self._plain: Placement | None = None  # the one that moves nothing
        self.seen_layers: Counter[str] = Counter()
        self.notes: Counter[str] = Counter()
        self._handlers: dict[str, Callable[[Entity, Placement], list[NurbsCurve]]] = {
            "LINE": self._line,
            "ARC": self._arc,
            "CIRCLE": self._arc,
            "ELLIPSE": self._ellipse,
            "LWPOLYLINE": self._lwpolyline,
            "SPLINE": self._spline,
            "HELIX": self._spline,
        }

    def read(self, entities: list[Entity], place: Placement, inherited: str = "", above: tuple[str, ...] = ()) -> None:
        """Read `entities`, placed by `place`; on layer 0 they are on the layer of the block reference, if any."""
        if not above and np.array_equal(place.matrix, np.eye(3)) and not place.offset.any():
            self._plain = place
        k = 0
        while k < len(entities):
            entity = entities[k]
            k += 1
            self._visit(1 + (entity.high - entity.low) // 16)
            kind = entity.kind
            if kind in ("ATTRIB", "SEQEND", "VERTEX"):
                continue
            last = k
            if kind == "POLYLINE":  # its vertices are entities of their own
                while k < len(entities) and entities[k].kind == "VERTEX":
                    k += 1
                self._visit(k - last)
            codes = self.tags.codes[entity.low : entity.high]
            layer = self.tags.text(entity.low + codes.index(8)) if 8 in codes else "0"
            if inherited and layer == "0":
                layer = inherited
            try:
                if self._unseen(codes, entity, above):
                    continue
                if kind == "INSERT":
                    self._insert(entity, place, layer, above)
                    continue
                if self.layers and layer.casefold() not in self.layers:
                    self.seen_layers[layer] += 0
                    continue
                if kind == "POLYLINE":
                    curves = self._polyline(entity, entities[last:k], place)
                elif kind in self._handlers:
                    curves = self._handlers[kind](entity, place)
                else:
                    self.drawing.left_out[kind[:40]] += 1
                    continue
            except TooMuchError:
                raise
            except FormatError as error:
                if not self.repair:
                    raise
                self.notes["faulty"] += 1
                if self.notes["faulty"] <= NAMED_FAULTS:
                    self.drawing.findings.append(str(error).removeprefix(f"{self.tags.source}: ") + "; left out")
                continue
            if curves:
                self.seen_layers[layer] += len(curves)
                # only the pieces of a spline that jumps do not meet
                for run in [curves] if kind != "SPLINE" or len(curves) == 1 else runs_that_meet(curves):
                    self.drawing.add(run, layer)

    def _visit(self, count: int) -> None:
        self.visits += count
        if self.visits > MAX_VISITS:
            raise TooMuchError(
                f"{self.tags.source}: has more than {MAX_VISITS} entities with those of its nested blocks; "
                f"choose layers, or explode the blocks that are needed"
            )

    # --- where it is and what it is -----------------------------------------------------------------------------------

    def _error(self, entity: Entity, text: str) -> FormatError:
        return self.tags.error(entity.low - 1, f"{entity.kind}: {text}")

    def _unseen(self, codes: list[int], entity: Entity, above: tuple[str, ...]) -> bool:
        """Whether an entity is invisible, or on a sheet of paper and not in the model."""
        for code, kind in ((60, "invisible"), (67, "in paper space")):
            if code in codes and self.tags.text(entity.low + codes.index(code)) == "1" and not (code == 67 and above):
                self.drawing.left_out[f"{entity.kind[:40]} {kind}"] += 1
                return True
        return False

    def _number(self, entity: Entity, values: Fields, code: int, default: float | None = None) -> float:
        value = values.get(code)
        if value is None:
            if default is None:
                raise self._error(entity, f"group {code} is missing; is the file complete?")
            return default
        return self.finite(entity, code, value)

    def numbers(self, entity: Entity, code: int, values: list[str | float]) -> list[float]:
        """`values` as finite numbers; FormatError that names entity and group `code`."""
        try:
            numbers = list(map(float, values))
        except ValueError:
            numbers = [math.nan]
        if self.tags.odd or not math.isfinite(sum(numbers)):
            return [self.finite(entity, code, value) for value in values]  # says which one
        return numbers

    def finite(self, entity: Entity, code: int, value: str | float) -> float:
        """`value` as a finite number; FormatError that names entity and group `code`."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number) or (isinstance(value, str) and ("_" in value or not value.isascii())):
            raise self._error(entity, f"group {code} is {str(value).strip()[:40]!r}; expected a number")
        return number

    def _point(self, entity: Entity, values: Fields, code: int, default: float | None = None) -> Array:
        return np.array(
            [
                self._number(entity, values, code, default),
                self._number(entity, values, code + 10, default),
                self._number(entity, values, code + 20, 0.0),
            ]
        )

    def _own_axes(self, entity: Entity, values: Fields) -> Array | None:
        """Axes of the entity's own system as columns (3, 3); None where they are the drawing's."""
        if 210 not in values and 230 not in values:
            return None
        normal = np.array([self._number(entity, values, code, 1.0 if code == 230 else 0.0) for code in (210, 220, 230)])
        size = float(np.linalg.norm(normal))
        if not size > 0.0:
            raise self._error(entity, "the extrusion (group 210) has no length")
        if normal[0] == 0.0 and normal[1] == 0.0 and normal[2] > 0.0:
            return None
        return own_axes(normal / size)

    def _placed(self, entity: Entity, values: Fields, place: Placement) -> Placement:
        axes = self._own_axes(entity, values)
        return place if axes is None else place.within(axes, np.zeros(3))

    # --- curves -------------------------------------------------------------------------------------------------------

    def _line(self, entity: Entity, place: Placement) -> list[NurbsCurve]:
        values = fields(self.tags, entity)
        ends = np.array([self._point(entity, values, 10), self._point(entity, values, 11)])
        return self._straight(ends if place is self._plain else ends @ place.matrix.T + place.offset)

    def _straight(self, points: Array) -> list[NurbsCurve]:
        if np.array_equal(points[0], points[-1]) and len(points) == 2:
            self.notes["zero"] += 1
            return []
        return [polyline(points)]

    def _arc(self, entity: Entity, place: Placement) -> list[NurbsCurve]:
        values = fields(self.tags, entity)
        center = self._point(entity, values, 10)
        radius = self._number(entity, values, 40)
        if radius < 0.0:
            raise self._error(entity, f"radius (group 40) is {radius:g}; expected one above 0")
        matrix, offset = self._placed(entity, values, place)
        start, sweep = 0.0, 2.0 * math.pi
        if entity.kind == "ARC":
            first, last = (self._number(entity, values, code) for code in (50, 51))
            turn = math.fmod(last - first, 360.0)
            turn += 360.0 if turn <= 0.0 else 0.0
            start, sweep = math.radians(first), math.radians(turn)
        if radius == 0.0:
            self.notes["zero"] += 1
            return []
        return [arc(matrix @ center + offset, matrix[:, 0] * radius, matrix[:, 1] * radius, start, sweep)]

    def _ellipse(self, entity: Entity, place: Placement) -> list[NurbsCurve]:
        values = fields(self.tags, entity)
        center, major = self._point(entity, values, 10), self._point(entity, values, 11)
        ratio = self._number(entity, values, 40)
        first, last = self._number(entity, values, 41, 0.0), self._number(entity, values, 42, 2.0 * math.pi)
        axes = self._own_axes(entity, values)
        normal = np.array([0.0, 0.0, 1.0]) if axes is None else axes[:, 2]
        minor = np.cross(normal, major) * ratio
        if not np.any(major) or not np.any(minor):
            raise self._error(entity, f"an axis has no length (ratio {ratio:g})")
        sweep = math.fmod(last - first, 2.0 * math.pi)
        if abs(last - first) >= 2.0 * math.pi - 1e-9 or sweep == 0.0:
            sweep = 2.0 * math.pi
        elif sweep < 0.0:
            sweep += 2.0 * math.pi
        matrix, offset = place
        return [arc(matrix @ center + offset, matrix @ major, matrix @ minor, first, sweep)]

    def _spline(self, entity: Entity, place: Placement) -> list[NurbsCurve]:
        return dxf_splines.curves(self, entity, place.matrix, place.offset)

    def _lwpolyline(self, entity: Entity, place: Placement) -> list[NurbsCurve]:
        x: list[str | float] = []
        y: list[str | float] = []
        given: list[str | float] = []
        values: Fields = {}
        codes = self.tags.codes[entity.low : entity.high]
        for code, value in zip(codes, self.tags.values[entity.low : entity.high], strict=True):
            if code == 10:
                x.append(value)
                given.append(0.0)
            elif code == 20:
                y.append(value)
            elif code == 42 and given:
                given[-1] = value
            else:
                values[code] = value
        xs, ys, bulges = (self.numbers(entity, code, each) for code, each in ((10, x), (20, y), (42, given)))
        count = self._number(entity, values, 90, float(len(xs)))
        if len(xs) != len(ys) or count != len(xs):
            text = f"says {count:g} vertices, but {len(xs)} x and {len(ys)} y follow"
            if not self.repair or len(xs) != len(ys):
                raise self._error(entity, text)
            self.drawing.findings.append(f"{self.tags.place(entity.low - 1)}: LWPOLYLINE {text}")
        points = np.empty((len(xs), 3))
        points[:, 0], points[:, 1], points[:, 2] = xs, ys, self._number(entity, values, 38, 0.0)
        closed = int(self._number(entity, values, 70, 0.0)) & 1 == 1
        return self._vertices(points, bulges, closed, self._placed(entity, values, place))

    def _polyline(self, entity: Entity, vertices: list[Entity], place: Placement) -> list[NurbsCurve]:
        values = fields(self.tags, entity)
        flags = int(self._number(entity, values, 70, 0.0))
        if flags & (16 | 64):
            self.drawing.left_out["POLYLINE mesh"] += 1
            return []
        points, bulges = [], []
        for vertex in vertices:
            own = fields(self.tags, vertex)
            if int(self._number(vertex, own, 70, 0.0)) & 16:
                continue  # a control point of a fitted polyline, not on it
            points.append(self._point(vertex, own, 10))
            bulges.append(0.0 if flags & 8 else self._number(vertex, own, 42, 0.0))
        if not flags & 8:
            for point in points:
                point[2] = self._number(entity, values, 30, 0.0)
            place = self._placed(entity, values, place)
        return self._vertices(np.array(points).reshape(-1, 3), bulges, flags & 1 == 1, place)

    def _vertices(self, points: Array, bulges: list[float], closed: bool, place: Placement) -> list[NurbsCurve]:
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
            bent = [b for b, moving in zip(bulges, moves.tolist(), strict=False) if moving]
        curves: list[NurbsCurve] = []
        begin = 0
        for i, bulge in enumerate(bent):
            if abs(bulge) >= LEAST_BULGE:
                if i > begin:
                    curves.append(polyline(points[begin : i + 1]))
                curves.append(bulge_arc(points[i], points[i + 1], bulge))
                begin = i + 1
        if begin < len(points) - 1:
            curves.append(polyline(points[begin:]))
        if place is self._plain:
            return curves
        matrix, offset = place
        return [moved(curve, matrix, offset) for curve in curves]

    # --- blocks -------------------------------------------------------------------------------------------------------

    def _insert(self, entity: Entity, place: Placement, layer: str, above: tuple[str, ...]) -> None:
        values = fields(self.tags, entity)
        name = str(values.get(2, "")).strip()
        key = name.casefold()
        block = self.blocks.get(key)
        if block is None:
            raise self._error(entity, f"there is no block {name[:40]!r}")
        if key in above:
            chain = " > ".join([*above[above.index(key) :], key])
            raise self._error(entity, f"block {name[:40]!r} inserts itself ({chain[:120]})")
        if len(above) >= MAX_DEPTH:
            raise self._error(entity, f"blocks are nested more than {MAX_DEPTH} deep")
        if block.external:
            self.drawing.left_out[f"external reference to {block.external[:60]}"] += 1
            return
        scale = np.array([self._number(entity, values, code, 1.0) for code in (41, 42, 43)])
        if not np.all(scale[:2]):
            self.notes["flat"] += 1
            return
        angle = math.radians(self._number(entity, values, 50, 0.0))
        turn = np.array([[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0], [0, 0, 1]])
        if angle % (0.5 * math.pi) == 0.0:
            turn = np.round(turn)
        columns, rows = (max(1, int(self._number(entity, values, code, 1.0))) for code in (70, 71))
        steps = [self._number(entity, values, code, 0.0) for code in (44, 45)]
        matrix = turn * scale
        origin = self._point(entity, values, 10, 0.0)
        outer = self._placed(entity, values, place)
        self._visit(columns * rows)
        for row in range(rows):
            for column in range(columns):
                shift = turn @ np.array([column * steps[0], row * steps[1], 0.0])
                inner = outer.within(matrix, origin + shift - matrix @ block.base)
                self.read(block.entities, inner, layer, (*above, key))


def own_axes(normal: Array) -> Array:
    """x, y and z axis (columns) of the system whose z is the unit vector `normal`: the arbitrary axis algorithm."""
    world = np.array([0.0, 1.0, 0.0] if abs(normal[0]) < _NEAR_Z and abs(normal[1]) < _NEAR_Z else [0.0, 0.0, 1.0])
    x = np.cross(world, normal)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(normal, x), normal])
