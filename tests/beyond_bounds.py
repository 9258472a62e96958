"""Files just beyond each bound of docs/security.md, and the tests that hold the bounds that no file reaches.

`python tests/hostile.py --bounds --write` reads each file by a command of its own and puts the table into the page.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np

SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9">{}</svg>'
DXF = "0\nSECTION\n2\nENTITIES\n{}0\nENDSEC\n0\nEOF\n"
LINE = "0\nLINE\n10\n0\n20\n0\n11\n{}\n21\n1\n"
JSON = '{"degree": 1, "knots": [0, 0, 1, 1], "control_points": [[0, 0], [1, %s]]}'
STEP = "ISO-10303-21;\nHEADER;\nENDSEC;\n"

Make = Callable[[Path], object]


def text(content: Callable[[], str]) -> Make:
    """What writes a text."""
    return lambda file: file.write_text(content())


def sparse(head: str, size: int) -> Make:
    """What writes a text, and nothing behind it up to a size."""

    def make(file: Path) -> None:
        with file.open("wb") as stream:
            stream.write(head.encode())
            stream.truncate(size)

    return make


def nested(before: str, behind: str, depth: int) -> str:
    """One in the other, so many deep."""
    return before * depth + behind * depth


def blocks(depth: int) -> str:
    """Blocks of DXF, each of which has the next one."""
    insert = "0\nINSERT\n8\n0\n2\nb{}\n10\n0\n20\n0\n"
    inside = "".join(f"0\nBLOCK\n2\nb{k}\n70\n0\n10\n0\n20\n0\n{insert.format(k + 1)}0\nENDBLK\n" for k in range(depth))
    last = f"0\nBLOCK\n2\nb{depth}\n70\n0\n10\n0\n20\n0\n{LINE.format(1)}0\nENDBLK\n"
    return f"0\nSECTION\n2\nBLOCKS\n{inside}{last}0\nENDSEC\n" + DXF.format(insert.format(0))


def uses(depth: int) -> str:
    """Uses of SVG, each of the next one."""
    named = "".join(f'<g id="g{k}"><use href="#g{k + 1}"/></g>' for k in range(depth))
    return SVG.format(f'{named}<path id="g{depth}" d="M0 0H1"/>')


def many_uses() -> str:
    """400 uses of 400 paths."""
    paths = '<path d="M0 0H1"/>' * 400
    return SVG.format(f'<g id="g">{paths}</g>' + '<use href="#g"/>' * 400)


def circles(count: int) -> str:
    """Contours over each other that look alike, none quite like the others."""
    return SVG.format("".join(f'<circle cx="4" cy="4" r="{3 + k * 1e-3}"/>' for k in range(count)))


def loop(lines: int) -> str:
    """A loop without an end whose turns are long."""
    return "G21 G91\no1 while [1]\n" + "G1 X0.001 F100\n" * lines + "o1 endwhile\nM2\n"


def subs(depth: int) -> str:
    """Subprograms that call each other."""
    inside = "".join(f"o{k} sub\no{k + 1} call\no{k} endsub\n" for k in range(1, depth))
    return f"{inside}o{depth} sub\nG1 X1 F100\no{depth} endsub\nG21 G91\no1 call\nM2\n"


def same_places() -> str:
    """Lines between twenty places, again and again."""
    random = np.random.default_rng(5)
    places = [f"{x} {y} {z}" for x, y, z in random.integers(0, 20, (20, 3))]
    return "\n".join(places[k] for k in random.integers(0, 20, 20_000))


def included(count: int, deep: bool) -> Make:
    """Configurations that name each other, or one that names them all."""

    def make(file: Path) -> None:
        for k in range(count):
            more = f"#INCLUDE more{k + 1}.inc\n" if deep and k + 1 < count else ""
            (file.parent / f"more{k}.inc").write_text(f"{more}[A{k}]\nB=1\n")
        file.write_text(
            "".join(f"#INCLUDE more{k}.inc\n" for k in range(1 if deep else count)) + "[EMC]\nVERSION=1.1\n"
        )

    return make


def grid(names: int, values: int) -> str:
    """A sweep of so many values of each of some settings."""
    known = ("feed", "acceleration", "jerk", "deceleration", "deceleration_jerk", "chord_error")[:names]
    said = ", ".join(map(str, range(1, values + 1)))
    return 'sources = ["circle"]\n[grid]\n' + "".join(f'"limits.{name}" = [{said}]\n' for name in known)


def files(count: int) -> Make:
    """A sweep over more files than are taken."""

    def make(file: Path) -> None:
        (folder := file.parent / f"parts{count}").mkdir(exist_ok=True)
        for k in range(count):
            (folder / f"{k}.dxf").touch()
        file.write_text(f'sources = ["parts{count}/*.dxf"]\n')

    return make


def mat(file: Path, **fields: object) -> None:
    """A MATLAB file with a struct of setpoints."""
    import scipy.io

    scipy.io.savemat(file, {"setpoints": fields}, do_compression=True)


def motion(file: Path) -> None:
    """Setpoints of a circle."""
    import splinefeed as sf

    path = sf.shapes.circle(1.0)
    law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20000), period=1e-3)
    sf.save(sf.interpolate(path, law), file)


def hollow(file: Path) -> None:
    """An HDF5 file of setpoints that says to have a thousand million of them and holds none."""
    import h5py

    motion(file)
    with h5py.File(file, "r+") as base:
        found: list[str] = []
        base.visititems(lambda name, each: found.append(name) if isinstance(each, h5py.Dataset) and each.ndim else None)
        for name in found:
            kind, shape, said = base[name].dtype, base[name].shape, dict(base[name].attrs)
            if shape[0] < 10:
                continue
            del base[name]
            made = base.create_dataset(name, (10**9, *shape[1:]), kind, chunks=(4096, *shape[1:]), compression="gzip")
            made.attrs.update(said)


def folded(file: Path) -> None:
    """A Parquet file of setpoints of about a MB with a hundred million rows."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    motion(file)
    schema = pq.read_schema(file)
    columns = [pa.array(np.zeros(1_000_000)).cast(each.type) for each in schema]
    with pq.ParquetWriter(file, schema) as writer:
        for _ in range(100):
            writer.write_table(pa.Table.from_arrays(columns, schema=schema))


def urdf(links: int) -> str:
    """A robot of many links."""
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>' for k in range(links - 1)
    )  # fmt: skip
    return f'<robot name="r">{"".join(f"""<link name="l{k}"/>""" for k in range(links))}{joints}</robot>'


#: The bound and what is beyond it, the file's name, what writes it, and the command ({} is the name).
BOUNDS: tuple[tuple[str, str, Make, tuple[str, ...]], ...] = (
    ("numbers: 1e101", "number.json", text(lambda: JSON % "1e101"), ("info", "{}")),
    ("numbers: 100,000 digits", "digits.json", text(lambda: JSON % ("9" * 100_000)), ("info", "{}")),
    ("TOML: 1 MB of a comment", "long.toml", text(lambda: "#" * (2**20 + 1)), ("plan", "circle", "--limits", "{}")),
    ("TOML: a sweep of 16 MB", "long.toml", text(lambda: "#" * (2**24 + 1)), ("sweep", "{}")),
    ("TOML: 9 words in a key", "key.toml", text(lambda: "a." * 8 + "b = 1"), ("plan", "circle", "--limits", "{}")),
    ("SVG: 257 MB, packed", "packed.svgz",
     lambda file: file.write_bytes(gzip.compress(SVG.format(" " * (257 * 2**20)).encode(), 1)), ("info", "{}")),
    ("SVG: 500,001 elements", "elements.svg", text(lambda: SVG.format("<g/>" * 500_001)), ("info", "{}")),
    ("SVG: 201 elements deep", "deep.svg", text(lambda: SVG.format(nested("<g>", "</g>", 201))), ("info", "{}")),
    ("SVG: 160,000 drawn by uses", "used.svg", text(many_uses), ("info", "{}")),
    ("SVG: uses 33 deep", "uses.svg", text(lambda: uses(34)), ("info", "{}")),
    ("SVG: an entity of 1001 letters", "entity.svg",
     text(lambda: f'<!DOCTYPE svg [<!ENTITY a "{"a" * 1001}">]>' + SVG.format('<g id="&a;"/>')), ("info", "{}")),
    ("DXF: 257 MB", "large.dxf", sparse(DXF.format(""), 257 * 2**20), ("info", "{}")),
    ("DXF: 8 million tags", "tags.dxf", text(lambda: DXF.format("1\n\n" * 8_000_001)), ("info", "{}")),
    ("DXF: a million entities", "entities.dxf",
     text(lambda: DXF.format("0\nPOINT\n10\n0\n20\n0\n" * 1_000_001)), ("info", "{}")),
    ("DXF: blocks 33 deep", "deep.dxf", text(lambda: blocks(34)), ("info", "{}")),
    ("drawings: 200,001 curves", "curves.svg",
     text(lambda: SVG.format("".join(f'<path d="M{k} 0V1"/>' for k in range(200_001)))), ("info", "{}")),
    ("drawings: 2,000,001 control points", "points.svg",
     text(lambda: SVG.format('<polyline points="' + "0 0 1 1 " * 1_000_001 + '"/>')), ("info", "{}")),
    ("G-code: a million lines executed", "steps.ngc", text(lambda: loop(20_000)), ("info", "{}")),
    ("G-code: a line of 4097 letters", "line.ngc", text(lambda: "G1 X1" + " " * 4092 + "\n"), ("info", "{}")),
    ("G-code: calls 11 deep", "calls.ngc", text(lambda: subs(11)), ("info", "{}")),
    ("G-code: 41 brackets", "brackets.ngc", text(lambda: f"G21 F100\nG1 X{nested('[', ']', 41)}\n"), ("info", "{}")),
    ("points of a table: 1,000,001 points", "points.csv", text(lambda: "0 1\n" * 1_000_001), ("info", "{}")),
    ("nearest points: 20,000 lines between 20 places", "places.csv", text(same_places), ("info", "{}")),
    ("STEP, IGES, 3DM: 257 MB", "large.stp", sparse(STEP, 257 * 2**20), ("info", "{}")),
    ("HDF5, Parquet: HDF5: a thousand million rows that are not there", "rows.h5", hollow,
     ("follow", "{}", "--machine", "xytheta")),
    ("HDF5, Parquet: Parquet: a hundred million rows, packed", "rows.parquet", folded,
     ("follow", "{}", "--machine", "xytheta")),
    ("MATLAB (.mat): 200 MB, packed", "packed.mat", lambda file: mat(file, t=np.zeros(25_000_000)),
     ("follow", "{}", "--machine", "xytheta")),
    ("MATLAB (.mat): a GB", "large.mat", sparse("MATLAB 5.0 MAT-file", 2**30 + 1),
     ("follow", "{}", "--machine", "xytheta")),
    ("sweeps: 216 million runs", "runs.toml", text(lambda: grid(3, 600)), ("sweep", "{}")),
    ("sweeps: 1,000,001 values", "values.toml", text(lambda: grid(1, 1_000_001)), ("sweep", "{}")),
    ("sweeps: 100,001 files", "files.toml", files(100_001), ("sweep", "{}")),
    ("configurations: 4 MB", "long.ini", text(lambda: "[EMC]\n" + "#" * 2**22), ("machine", "from-ini", "{}")),
    ("configurations: 101 files included", "many.ini", included(101, False), ("machine", "from-ini", "{}")),
    ("configurations: files included 9 deep", "deep.ini", included(10, True), ("machine", "from-ini", "{}")),
    ("robots: 1001 links", "links.urdf", text(lambda: urdf(1001)), ("run", "motion.json", "--robot", "{}")),
    ("tool tables: 10,001 tools", "tools.tbl", text(lambda: "".join(f"T{k} P{k} Z1\n" for k in range(1, 10_002))),
     ("info", "part.ngc", "--tools", "{}")),
    ("drawings that look alike: 4,950 pairs: compared", "alike.svg", text(lambda: circles(100)), ("info", "{}")),
    ("drawings that look alike: 19,900 pairs: not compared", "more.svg", text(lambda: circles(200)), ("info", "{}")),
)  # fmt: skip
#: Files that stand beside those.
BESIDE = {
    "motion.json": '{"waypoints": [[0, 0], [1, 1]]}',
    "part.ngc": "G21 G43 H1\nG1 X1 F100\nM2\n",
}
#: Bounds that no file reaches, and the tests that hold them.
HELD = {
    "STEP, IGES, 3DM: time and memory of the process": (
        "formats/test_cad_hostile.py::test_a_library_that_takes_too_long_is_ended",
        "formats/test_cad_hostile.py::test_a_library_that_dies_is_an_error_and_the_next_file_is_read",
    ),
    "HDF5, Parquet: time and memory of the process": ("test_workers.py::test_its_memory_is_bounded",),
    "studio: size and number of uploads": ("studio/test_guard.py::test_uploads_are_bounded_in_size_and_number",),
    "studio: time of an upload": ("studio/test_desk.py::test_an_upload_that_hangs_costs_that_upload_only",),
    "studio: time of a plan": (
        "studio/test_desk.py::test_a_plan_that_takes_too_long_is_left_to_a_job_and_the_next_worker_is_warmed_up",
    ),
    "studio: tabs at once": (
        "studio/test_many_clients.py::"
        "test_twenty_tabs_plan_at_once_one_closes_in_the_middle_and_none_waits_for_another",
        "studio/test_desk.py::test_tabs_jobs_and_plans_are_bounded",
    ),
    "studio: plans kept": ("studio/test_desk.py::test_a_worker_keeps_the_last_runs_alone",),
    "studio: connections without the token": (
        "studio/test_guard.py::test_connections_that_say_nothing_do_not_lock_the_owner_out",
        "studio/test_guard.py::test_silent_connections_do_not_lock_the_owner_out_where_few_files_may_be_open",
    ),
    "control port: length of lines, time for the token, clients": (
        "live/test_stream.py::test_silent_and_slow_connections_do_not_lock_the_operator_out",
        "live/test_stream.py::test_a_flood_of_lines_and_clients_neither_stops_the_stream_nor_changes_the_override",
    ),
}
