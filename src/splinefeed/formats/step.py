"""STEP (ISO 10303-21, AP203, AP214, AP242): curves in space, read by OCCT, written as B-splines with all their digits.

Read are free curves (geometric curve sets, wires, edges), one path a curve or wire; see docs/cad-files.md.
"""

from __future__ import annotations

import math
import os
import pathlib
import re
from collections.abc import Sequence
from itertools import groupby

import splinefeed
from splinefeed.curves.curve import NurbsCurve
from splinefeed.curves.editing import clamped
from splinefeed.errors import FormatError
from splinefeed.files.atomic import atomic_write
from splinefeed.formats import cad_process
from splinefeed.formats.drawing import Drawing, losses, three_axes
from splinefeed.paths.contents import Contents
from splinefeed.paths.path import JOIN_TOLERANCE, Path

START = b"ISO-10303-21"
_COMMENTS = re.compile(rb"\A(?:\xef\xbb\xbf)?(?:\s|/\*.*?\*/)*", re.DOTALL)


def holds(head: bytes) -> bool:
    """Tell whether the first bytes of a file, `head`, look like STEP, behind comments at most."""
    return _COMMENTS.sub(b"", head[:4096]).startswith(START)


def from_file(
    file: pathlib.Path,
    *,
    edges: bool = False,
    tolerance: float | str = JOIN_TOLERANCE,
    hidden: bool = False,
    repair: bool = False,
) -> Contents:
    """Read the paths in a STEP file.

    Parameters
    ----------
    file : path
        The file.
    edges : bool, optional
        Whether the edges of faces are read, too.
    tolerance : float or str, optional
        Curves whose ends meet within it make one path, mm.
    hidden : bool, optional
        Whether what the author's program does not show is read, too.
    repair : bool, optional
        Whether faults are repaired where that is safe, each a finding.

    Returns
    -------
    Contents
        Paths in the order of the file, mm, and its units.

    Raises
    ------
    FormatError, InputError
        For what cannot be read, with its place.
    """
    return cad_process.read(Drawing(file, tolerance, repair, hidden=hidden), "step", [], edges=edges)


# --- out --------------------------------------------------------------------------------------------------------------

_HEADER = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('curves of tool paths'),'2;1');
FILE_NAME({name},'',(''),(''),{program},'','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));
ENDSEC;
DATA;
"""
#: What a shape needs around it: product, context and units (mm, rad), with {name} and the {curves}.
_FRAME = """#1=APPLICATION_CONTEXT('core data for automotive mechanical design processes');
#2=APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#1);
#3=PRODUCT_CONTEXT('',#1,'mechanical');
#4=PRODUCT({name},{name},'',(#3));
#5=PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,(#4));
#6=PRODUCT_DEFINITION_FORMATION('','',#4);
#7=PRODUCT_DEFINITION_CONTEXT('part definition',#1,'design');
#8=PRODUCT_DEFINITION('design','',#6,#7);
#9=PRODUCT_DEFINITION_SHAPE('','',#8);
#10=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#11=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#12=(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT());
#13=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),#10,'distance_accuracy_value','');
#14=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#13))
GLOBAL_UNIT_ASSIGNED_CONTEXT((#10,#11,#12))REPRESENTATION_CONTEXT('',''));
#15=GEOMETRIC_CURVE_SET({name},({curves}));
#16=GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION({name},(#15),#14);
#17=SHAPE_DEFINITION_REPRESENTATION(#9,#16);
"""
_FIRST_FREE = 18
#: Entities of a line, and letters beyond ASCII.
_PER_LINE, _X2 = 10, "\\X2\\{}\\X0\\"


def write(paths: Sequence[Path], target: str | os.PathLike[str]) -> list[str]:
    """Write curves as a set of free B-spline curves, mm, every number with all its digits.

    Parameters
    ----------
    paths : sequence of Path
        Contours, mm.
    target : path
        The file.

    Returns
    -------
    list of str
        What STEP has no place for: rotary axes, feeds, tolerances, markers.

    Notes
    -----
    Curves are clamped, which is exact.
    """
    lost = losses(paths, "STEP")
    name = _text(paths[0].name if len(paths) == 1 else pathlib.Path(target).stem)
    blocks, ids, number = [], [], _FIRST_FREE
    for path in paths:
        for curve in path.curves:
            lines, number = _curve(curve, path, number)
            blocks.append(lines)
            ids.append(f"#{number - 1}")
    frame = _FRAME.format(name=name, curves=_wrapped(ids))
    with atomic_write(target) as temporary, temporary.open("w", encoding="ascii", newline="\n") as stream:
        stream.write(_HEADER.format(name=name, program=_text(f"splinefeed {splinefeed.__version__}")))
        stream.write(frame)
        stream.writelines(blocks)
        stream.write("ENDSEC;\nEND-ISO-10303-21;\n")
    return lost


def _curve(curve: NurbsCurve, path: Path, number: int) -> tuple[str, int]:
    """A curve of `path` and its points as instances from `number` on, and the number behind them."""
    whole = clamped(curve)
    rows = enumerate(three_axes(whole.control_points, path).tolist(), start=number)
    lines = [f"#{i}=CARTESIAN_POINT('',({','.join(map(_real, row))}));\n" for i, row in rows]
    points = [f"#{i}" for i in range(number, number + len(lines))]
    number += len(lines)
    runs = [(knot, len(list(run))) for knot, run in groupby(whole.knots.tolist())]
    listed = _wrapped(points)
    counts, knots = _wrapped([str(count) for _, count in runs]), _wrapped([_real(knot) for knot, _ in runs])
    shape = f"{whole.degree},({listed}),.UNSPECIFIED.,{'.T.' if whole.closed else '.F.'},.F."
    if whole.weights is None:
        lines.append(f"#{number}=B_SPLINE_CURVE_WITH_KNOTS('',{shape},({counts}),({knots}),.UNSPECIFIED.);\n")
    else:
        weights = _wrapped([_real(weight) for weight in whole.weights.tolist()])
        lines.append(
            f"#{number}=(BOUNDED_CURVE()B_SPLINE_CURVE({shape})\n"
            f"B_SPLINE_CURVE_WITH_KNOTS(({counts}),({knots}),.UNSPECIFIED.)\n"
            f"CURVE()GEOMETRIC_REPRESENTATION_ITEM()RATIONAL_B_SPLINE_CURVE(({weights}))REPRESENTATION_ITEM(''));\n"
        )
    return "".join(lines), number + 1


def _wrapped(words: list[str]) -> str:
    lines = [",".join(words[i : i + _PER_LINE]) for i in range(0, len(words), _PER_LINE)]
    return ",\n".join(lines)


def _real(value: float) -> str:
    """`value` with as many digits as it takes to read it back: STEP wants a point in every real, and E for e."""
    if not math.isfinite(value):
        raise FormatError(f"{value} is not a number that STEP can hold")
    mantissa, exponent, power = repr(value).partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.'}{exponent.upper()}{power}"


def _text(text: str) -> str:
    """`text` as a string of STEP: quotes doubled, letters beyond ASCII in the form X2."""
    quoted = text.replace("\\", "\\\\").replace("'", "''")
    beyond = re.compile(r"[^ -~]+")
    return f"'{beyond.sub(lambda run: _X2.format(run[0].encode('utf-16-be', 'replace').hex().upper()), quoted)}'"
