"""Files changed at random: what every reader must survive, in bounded time and memory.

`python tests/fuzzing.py KIND SEED COUNT` reads COUNT changed files of a kind in this process, under limits of memory
and of time for each, and prints what came of them; the tests of `make torture` run it.
"""

from __future__ import annotations

import contextlib
import gc
import io
import json
import os
import re
import resource
import select
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import scipy.io

if TYPE_CHECKING:
    from splinefeed.workers import Mail, Worker

DATA = Path(__file__).parent / "data"
#: Longest time for one file, s of the processor, and address space of the whole process, bytes; the CAD libraries have
#: their own limits.
MOST_SECONDS, MOST_MEMORY = 20, 2 * 2**30
#: A file that made a reader run a line which none before it did is changed further; at most so many are kept.
MOST_KEPT = 400
#: Files up to this size are changed, bytes: larger ones take long and are of the same kind.
LARGEST = 40_000
#: What is put into a file of any kind in place of something else, and into programs.
SPLINTERS = [
    b"nan", b"inf", b"-1", b"0", b"1e400", b"999999999999", b"", b"\n", b"\0", b"\xff", b"z", b"A", b"#", b"%", b'"',
    b"1_0", b",", b"(", b")", b"'", b"$", b"#1", b"\xff\xff\xff\x7f", b"1e308", b"null", b"[", b"]", b"{", b"}", b"<g>",
    b"  0\nENDSEC\n", b"</g>", b"LINE", b"SPLINE", b"INSERT", b"40", b"10", b"*", b"<style>", b"path{", b"em", b"%;",
]  # fmt: skip
WORDS = (
    """
G0 G1 G2 G3 G5 G5.1 G5.2 G5.3 G6.2 G4 G10 G20 G28 G53 G55 G61.1 G64 G91 G92 G93 G18 G90.1 X Y Z A I J K R P1 P-2 Q3 L2
L99 K0 K1 F1 F0 S5 M3 M30 #1=2 #1 [ ] [1/0] nan 1e9 -.5 9999999999 ; ( ) % / BSPLINE PL=1 PW=0.5 SD=3 X=3 CR=2
CC CR DR+ LX+1 IX-2 O1sub ~ \x00 é X=IC(5) I=AC(1) STOP T5 M6 TRAORI
""".replace("\n", " ").split(" ")
    + 8 * ["\n"]
)


#: How a file of each kind is called; records, what else has a reader of its own, and files that are no text.
SUFFIXES = {
    "dxf": ".dxf", "svg": ".svg", "json": ".json", "airfoil": ".dat", "iges": ".igs", "3dm": ".3dm", "csv": ".csv",
    "npz": ".npz", "h5": ".h5", "step": ".stp", "gcode": ".ngc", "mat": ".mat", "parquet": ".parquet", "points": ".csv",
    "limits": ".toml", "machine": ".toml", "sweep": ".toml", "tools": ".tbl", "log": ".csv", "positions": ".csv",
    "urdf": ".urdf", "heidenhain": ".h", "siemens": ".mpf", "macro": ".nc", "printer": ".gcode", "ini": ".ini",
    "grbl": ".txt", "klipper": ".cfg", "marlin": ".txt", "record": ".json", "joints": ".yaml", "rows": ".jsonl",
    "about": ".json", "state": ".json",
    "folder": ".csv",
}  # fmt: skip
#: Kinds that are known by their content, whatever the name says.
DRAWINGS = ("dxf", "svg", "json", "airfoil", "iges", "3dm", "step", "gcode")
#: Dialects of programs other than LinuxCNC's.
DIALECTS = ("heidenhain", "siemens", "macro", "printer")
#: Kinds that libraries for CAD read.
CAD = ("step", "iges", "3dm")
RECORDS = ("csv", "npz", "h5", "mat", "parquet")
OTHERS = {
    "points": "formats.registry:read_all", "limits": "machine.limits_toml:read",
    "machine": "machine.machine:Machine.load", "sweep": "sweeps.spec:read", "tools": "programs.gcode.tools:read_tools",
    "log": "programs.run_log:read_run", "positions": "formats.positions_csv:read", "urdf": "robots.arm:robot",
}  # fmt: skip
BINARY = ("npz", "h5", "mat", "parquet", "3dm")
#: Files in folders of runs and sweeps: the page and the setpoints of a run, the journal and the page of a sweep.
KEPT = ("record", "folder", "rows", "about")
#: Configurations of other controls.
CONFIGURATIONS = ("ini", "grbl", "klipper", "marlin")
#: Sound texts of kinds that have no files in the data of the tests.
TEXTS = {
    "limits": (
        'feed = "3600mm/min"\nstart_feed = 5\ncentripetal = "0.1g"\naxis_jerk = { x = 2000, theta = "90deg/s^3" }\n'
        '[axis_acceleration]\nx = 500\ny = "0.5m/s^2"\n[travel]\nx = ["-10mm", 200]\n',
        "feed = 60\nacceleration = 500.0\njerk = 20000\ndeceleration = 400\nchord_error = 1e-3\n",
    ),
    "sweep": (
        'sources = ["circle", "butterfly"]\n[set]\nlimits.acceleration = "50mm/s^2"\n[grid]\n'
        '"limits.feed" = [30, 60.0]\nmethod = ["taylor-2"]\nperiod = ["1ms", "2ms"]\n[random]\ncount = 3\n'
        '"limits.jerk" = { uniform = [100, 2000] }\n[output]\nsetpoints = true\n',
        'name = "s"\nseed = 7\nsources = ["circle"]\n[list]\nlimits.feed = [1, 2]\ncorrections = [0, 1]\n',
    ),
    "tools": ("; tools\nT1 P1 Z50.2 D6 ; mill\nT2 P2 X-1.5 Z+40 D.5 I1 J2 Q3\nT99 P3 A90\n",),
    "points": (
        "x,y,z\n" + "".join(f"{k},{k * k % 7}.5,{-k}\n" for k in range(12)),
        "12\n" + "".join(f"{k}.5 {k % 3}\n" for k in range(12)),
        "x [in];y\n" + "".join(f"{k},5;{k % 5},25\n" for k in range(12)),
    ),
    "positions": (
        "t_s,x [mm],theta_deg\n" + "".join(f"{k / 1000:.3f},{k * 0.1:.4f},{k % 9}.5\n" for k in range(20)),
        "time;x;y\n(ms);(in);(mm)\n" + "".join(f"{k};{k}.25;nan\n" for k in range(20)),
    ),
    "heidenhain": (
        "0 BEGIN PGM PART MM\n1 BLK FORM 0.1 Z X+0 Y+0 Z-20\n2 TOOL CALL 5 Z S3000 F500\n3 L X+10 Y+5 R0 FMAX M3\n"
        "4 FN 0: Q1 = +12.5\n5 L X+Q1 IY+2 F300\n6 CC X+20 Y+7\n7 C X+27.5 Y+7 DR+\n8 LP PR+10 PA+45\n"
        "9 CR X+50 Y+0 R+35 DR-\n10 LBL 1\n11 L IX+1 IY-1\n12 RND R0.2\n13 L IX+1 IY+1\n11 CALL LBL 1 REP 2\n"
        "13 CYCL DEF 9.0 DWELL TIME\n"
        "14 CYCL DEF 9.1 DWELL 0.5\n15 L Z+50 R0 FMAX M30\n16 END PGM PART MM\n",
    ),
    "siemens": (
        "; %_N_PART_MPF\nN10 DEF REAL DEPTH=-2.5\nN20 G17 G71 G90 G54\nN30 T5 D1 M6\nN40 S3000 M3\nN50 G0 X0 Y=IC(5)\n"
        "N60 G1 Z=DEPTH F300\nN70 G2 X10 Y0 CR=12\nN80 BSPLINE X20 Y5 PL=1\nN90 X30 Y0 PW=0.8\nN95 X40 Y2\n"
        'N100 G64 G1 X=AC(50)\nN110 SOFT\nN120 COMPCAD X55 Y1\nN130 MSG("end")\nN140 M30\n',
    ),
    "macro": (
        "%\nO1234 (PART)\n#1=10.\n#2=[#1*2.+SIN[30.]]\nG90 G21 G17\nWHILE [#1 GT 5.] DO1\nG1 X#1 Y#2 F300.\n#1=#1-1.\n"
        "END1\nIF [#1 EQ 5.] GOTO 100\nG81 X1. Y2. Z-3. R1. F50.\nG80\nN100 G65 P2000 A1. B2.\nM98 P3000 L2\nM30\n"
        "O2000\nG1 X#1 Y#2\nM99\nO3000\nG91 G1 X1.\nG90\nM99\n%\n",
    ),
    "printer": (
        "; generated by a slicer\nM140 S60\nG28 ; home\nG90\nM82\nG1 Z0.2 F1200\n"
        "G1 X10 Y20 E1.5 F1800\nG2 X20 Y20 I5 J0 E2\n"
        "SET_VELOCITY_LIMIT VELOCITY=100 ACCEL=1000\nM204 P800 T1000\nM205 X8 J0.02\n"
        "G92 E0\nM220 S90 B\nN5 G1 X1*93\nG4 P100\nM84\n",
    ),
    "ini": (
        "[EMC]\nVERSION=1.1\n[KINS]\nJOINTS=3\nKINEMATICS=trivkins coordinates=XYZ\n[TRAJ]\nCOORDINATES=XYZ\n"
        "LINEAR_UNITS=mm\nMAX_LINEAR_VELOCITY=50\n[EMCMOT]\nSERVO_PERIOD=1000000\n[RS274NGC]\n"
        "RS274NGC_STARTUP_CODE=G17 G21 G64 P0.025 Q0.01\n"
        + "".join(
            f"[AXIS_{axis}]\nMAX_VELOCITY={v}\nMAX_ACCELERATION=500\nMIN_LIMIT=-1\nMAX_LIMIT=300\n"
            f"[JOINT_{k}]\nTYPE=LINEAR\nMAX_VELOCITY={v}\nMAX_ACCELERATION=500\nMIN_LIMIT=-1\nMAX_LIMIT=300\n"
            for k, (axis, v) in enumerate((("X", 50), ("Y", "40.5"), ("Z", "2e1")))
        ),
    ),
    "grbl": (
        "Grbl 1.1h ['$' for help]\n$0=10 (step pulse, usec)\n$11=0.010\n$12=0.002\n$13=0\n$100=250.000\n"
        "$101=250\n$102=250\n"
        "$110=5000.000\n$111=5000\n$112=500\n$120=200.000\n$121=200\n$122=50\n$130=300\n$131=200\n$132=80\nok\n",
    ),
    "klipper": (
        "[printer]\nkinematics: cartesian\nmax_velocity: 300\nmax_accel: 3000\nmax_z_velocity = 5\nmax_z_accel: 100\n"
        "square_corner_velocity: 5.0 # mm/s\nminimum_cruise_ratio: 0.5\n"
        + "".join(f"[stepper_{axis}]\nposition_min: -1\nposition_max: 235\nposition_endstop: 0\n" for axis in "xyz"),
    ),
    "marlin": (
        "echo:; Linear Units:\necho:  G21 ; Units in mm (mm)\necho:; Maximum feedrates (units/s):\n"
        "echo:  M203 X500.00 Y500.00 Z5.00 E25.00\necho:  M201 X500.00 Y500.00 Z100.00 E5000.00\n"
        "echo:  M204 P500.00 R1000.00 T500.00\necho:  M205 B20000.00 S0.00 T0.00 J0.02\nok\n",
    ),
    "joints": (
        "joint_limits:\n  shoulder:\n    has_velocity_limits: true\n    max_velocity: 2.0\n"
        "    has_acceleration_limits: true\n"
        "    max_acceleration: 5\n  elbow: {has_jerk_limits: true, max_jerk: 1.0e+2, max_velocity: &v 3.5}\n",
    ),
}
#: A sweep whose folder is changed: its page and its journal.
SWEEP = {
    "sources": ["circle?radius=1"],
    "set": {"limits": {"acceleration": 400, "jerk": 2e4}},
    "grid": {"limits.feed": [10, 20, 30]},
}


def changed(rng: np.random.Generator, content: bytes) -> bytes:
    """`content` with some bytes taken out, put in, doubled or moved; sometimes cut off."""
    data = bytearray(content)
    digits = [i for i, byte in enumerate(data) if 48 <= byte <= 57]
    for _ in range(int(rng.geometric(0.4))):
        at, other = (int(value) for value in rng.integers(0, max(len(data), 1), 2))
        kind = rng.integers(8)
        if kind > 5 and digits:  # only another number
            place = min(digits[rng.integers(len(digits))], len(data) - 1)
            data[place : place + 1] = b"%d" % rng.integers(10)
            continue
        if kind == 0:
            data[at : at + 1] = bytes([int(rng.integers(256))])
        elif kind == 1:
            del data[at : at + int(rng.integers(1, 30))]
        elif kind == 2:
            data[at:at] = data[other : other + int(rng.integers(1, 200))]
        elif kind == 3:
            data[at : at + 4] = rng.bytes(4)
        else:
            data[at : at + int(rng.integers(0, 30))] = SPLINTERS[rng.integers(len(SPLINTERS))]
        if rng.random() < 0.03:
            del data[int(rng.integers(1, len(data) + 2)) :]
    return bytes(data) or b"0"


#: Words of the languages of files that are text: numbers beyond all bounds, deep keys, brackets without an end.
TOKENS = [
    b"9" * 400, b"9" * 5000, b"1e308", b"-1e308", b"1e400", b"1e-400", b"1e101", b".", b"-", b"e5", b"[" * 60,
    b"(" * 60, b"{" * 60, b"a." * 40, b"true", b"[]", b"{}", b'""', b"'", b"inf", b"-inf", b"nan", b"2**63", b"1 " * 50,
    b"-9223372036854775809", b"9223372036854775808", b"x" * 300, b"\xc3\xa9", b"=", b"\n\n", b",,", b";", b"&a;",
    b"0" * 400 + b"1", b"../..",
]  # fmt: skip
_WORDS_OF_TEXT = re.compile(rb"[-+.\w]+")


def retold(rng: np.random.Generator, content: bytes) -> bytes:
    """`content` with some of its own words, or TOKENS, in place of others."""
    words = list(_WORDS_OF_TEXT.finditer(content))
    if not words:
        return changed(rng, content)
    data, chosen = content, sorted(rng.choice(len(words), min(len(words), int(rng.geometric(0.5))), False))
    for k in reversed(chosen):
        one, other = words[k], words[rng.integers(len(words))]
        put = other[0] if rng.random() < 0.4 else TOKENS[rng.integers(len(TOKENS))]
        data = data[: one.start()] + put + data[one.end() :]
    return data


def program(rng: np.random.Generator, content: bytes) -> bytes:
    """A changed program, or words of all dialects in no order."""
    if rng.random() < 0.4:
        return " ".join(rng.choice(WORDS, rng.integers(1, 60))).encode()
    return changed(rng, content[:600])


def seeds(kind: str, folder: Path) -> Iterator[bytes]:
    """Sound files of a kind, those of others and one that is made here."""
    import splinefeed as sf

    made = folder / f"seed{SUFFIXES[kind]}"
    if kind in RECORDS:
        path = sf.shapes.circle(5.0)
        law = sf.plan(path, sf.Limits(feed=60, acceleration=500, jerk=20000), strategy="seven-phase", period=5e-3)
        sf.save(sf.interpolate(path, law, period=5e-3), made)
        if kind == "mat":  # not packed: a change comes through to what is read
            struct = scipy.io.loadmat(made)["setpoints"]
            scipy.io.savemat(made, {"setpoints": struct}, do_compression=False)
            yield made.read_bytes()
            sf.save(sf.interpolate(path, law, period=5e-3), made)
    elif kind in ("dxf", "svg", "json", "step", "gcode"):
        sf.write(sf.shapes.circle(5.0), made)
    if made.exists():
        yield made.read_bytes()
    if kind == "state":
        from splinefeed.cli.stream import _motion

        page = {"row": 9, "tau_s": 0.02, "sent_tau_s": 0.03, "done": False, "rests_at": [1.0, 2.5]}
        yield json.dumps({**page, "motion": _motion(streamed())}).encode()
    if kind in KEPT:
        yield kept(kind, folder)
    if kind in ("dxf", "svg", "json", "airfoil", "gcode", "iges", "3dm"):
        for file in sorted((DATA / kind).iterdir()):
            if file.stat().st_size <= LARGEST:
                yield file.read_bytes()
    if kind == "svg":
        yield (
            b'<svg width="9mm" viewBox="0 0 9 9"><style>g > .a, #b path:first-child {display:none;transform:scale(2)}'
            b'</style><symbol id="s" viewBox="0 0 5 5"><rect width="1em" height="50%"/></symbol><g font-size="2em">'
            b'<use href="#s" x="1" width="3"/><path class="a" style="transform:rotate(3deg)" d="M0 0 h5"/></g></svg>'
        )
    yield from (text.encode() for text in TEXTS.get(kind, ()))
    if kind == "machine":
        for name in sf.Machine.names():
            yield (Path(sf.__file__).parent / "machines" / f"{name}.toml").read_bytes()
    if kind == "urdf":
        yield (DATA / "two-link.urdf").read_bytes()
    if kind == "log":
        yield (DATA / "cycle-time" / "box-op2-hurco02-part11.csv").read_bytes()
    if kind == "json":
        yield (DATA / "curves" / "butterfly.json").read_bytes()


def kept(kind: str, folder: Path) -> bytes:
    """What a run or a sweep keeps in its folder, which is made here; the page of the run knows no digests."""
    import splinefeed as sf
    from splinefeed.reports.folder import report
    from splinefeed.sweeps import store

    if kind in ("record", "folder"):
        limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
        report(sf.run(sf.shapes.circle(5.0), limits, period=5e-3), folder / "run", formats=("csv",))
        page = folder / "run" / "run.json"
        page.write_text(json.dumps({**json.loads(page.read_text()), "sha256": {}}, indent=1))
        return (page if kind == "record" else folder / "run" / "setpoints.csv").read_bytes()
    rows = list(sf.sweep(SWEEP, folder=folder / "sweep", workers=0))
    if kind == "about":
        return (folder / "sweep" / store.ABOUT).read_bytes()
    (folder / "sweep" / store.PARTS / "part-000000.parquet").unlink()
    return b"".join(json.dumps(row).encode() + b"\n" for row in rows)


def of_folder(kind: str, folder: Path) -> Callable[[Path, bool], Any]:
    """What reads a folder in which one file has changed."""
    from splinefeed.cli.main import command_line
    from splinefeed.errors import SplinefeedError
    from splinefeed.sweeps import store

    sweep, run = folder / "sweep", folder / "run"
    target = {
        "about": sweep / store.ABOUT, "rows": sweep / store.PARTS / "part-000000.jsonl", "record": run / "run.json",
        "folder": run / "setpoints.csv",
    }[kind]  # fmt: skip

    def read(file: Path, repair: bool) -> Any:
        target.write_bytes(file.read_bytes())
        if kind in ("about", "rows"):
            return store.summary(*store.load(sweep))
        with contextlib.redirect_stderr(io.StringIO()) as said:
            try:
                command_line.main(["report", str(run)])
            except SystemExit as end:
                if end.code == 2:
                    raise SplinefeedError(said.getvalue().strip()) from None
                assert end.code in (0, 1), said.getvalue()

    return read


def streamed() -> Any:
    """The motion whose state a stream keeps."""
    import splinefeed as sf
    from splinefeed.live.motion import planned

    limits = sf.Limits(feed=60, acceleration=500, jerk=20000)
    return planned(sf.shapes.line(length=5.0), limits, period=1e-3, strategy="seven-phase")[1]


def other_reader(kind: str) -> Callable[[Path, bool], Any]:
    """What reads a configuration of another control, limits of joints, or the state of a stream."""
    import splinefeed as sf
    from splinefeed.cli.stream import _resumed
    from splinefeed.machine.imports import imported

    if kind in CONFIGURATIONS:
        return lambda file, repair: imported(kind, file)
    if kind == "joints":
        return lambda file, repair: sf.robot(DATA / "two-link.urdf", limits=file)
    motion = streamed()
    return lambda file, repair: _resumed(str(file), motion)


class Forks:
    """Answers tasks for CAD libraries by forks of this process, which holds them; in place of the process for that.

    What a library is asked and what it may take are the same, and a fork starts in some ms where that process, which
    must load OCCT after each crash, takes a second.
    """

    def __init__(self, kind: str) -> None:
        from splinefeed.files import native_process
        from splinefeed.formats import cad_process

        self._handler, self._most = native_process.open_libraries, native_process.MAX_ADDRESS_SPACE
        library = import_module(f"splinefeed.formats.{cad_process.MODULES[kind][0]}")
        sound = min((DATA / kind).iterdir(), key=lambda file: file.stat().st_size)
        with tempfile.TemporaryDirectory() as folder, unheard():  # what a library makes at its first file is made once
            task = {"kind": kind, "file": str(sound), "folder": folder, "layers": [], "repair": True}
            library.read({**task, "hidden": True, "edges": True})
        gc.collect()
        gc.freeze()  # a fork looks for its own garbage alone

    def ask(self, request: Any, heard: Any = None, seconds: float = 0.0) -> tuple[Any, bytes]:
        """The answer to `request`; LostError where there is none in its time."""
        from splinefeed.workers import LostError

        ours, theirs = os.pipe()
        child = os.fork()
        if child == 0:
            with contextlib.suppress(BaseException):
                self._answer(request, ours, theirs)
            os._exit(1)
        os.close(theirs)
        end, body = time.monotonic() + seconds, b""
        try:
            while select.select([ours], [], [], max(0.0, end - time.monotonic()))[0]:
                if not (part := os.read(ours, 2**20)):
                    break
                body += part
            else:
                raise LostError(late=True)
        finally:
            os.close(ours)
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
        if not body.endswith(b"\n"):
            raise LostError(late=False)
        return {}, body

    def _answer(self, request: Any, ours: int, theirs: int) -> None:
        """In the fork."""
        from splinefeed.workers import limit_memory

        os.close(ours)
        sys.settrace(None)
        for number in (signal.SIGALRM, signal.SIGPROF):
            signal.signal(number, signal.SIG_DFL)
        limit_memory(self._most)
        with unheard(), open(theirs, "wb") as stream:
            stream.write(self._handler(cast("Mail", None))(request)[1] + b"\n")
        os._exit(0)


@contextlib.contextmanager
def unheard() -> Iterator[None]:
    """Have what libraries in C print go nowhere."""
    kept = [os.dup(stream) for stream in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
    finally:
        for stream, old in zip((1, 2), kept, strict=True):
            os.dup2(old, stream)
        for each in (*kept, nowhere):
            os.close(each)


def reader(kind: str, folder: Path) -> Callable[[Path, bool], Any]:
    """What reads a file of a kind, strictly or repairing; `folder` is that of the sound files."""
    import splinefeed as sf
    from splinefeed.formats.registry import FORMATS, read_all

    if kind in RECORDS:
        return lambda file, repair: sf.load(file)
    if kind in KEPT:
        return of_folder(kind, folder)
    if kind in (*CONFIGURATIONS, "joints", "state"):
        return other_reader(kind)
    if kind in OTHERS:
        module, _, name = OTHERS[kind].partition(":")
        function = attrgetter(name)(import_module(f"splinefeed.{module}"))
        return lambda file, repair: function(file)
    forks = Forks(kind) if kind in CAD else None
    modules = {"json": "json_curve", "3dm": "threedm"}
    name = "programs.gcode" if kind in (*DIALECTS, "gcode") else f"formats.{modules.get(kind, kind)}"
    module = next(each for each in FORMATS if each.module == name)
    takes_repair = kind not in ("json", "airfoil")

    def read(file: Path, repair: bool) -> Any:
        made = file.with_suffix(SUFFIXES[kind] if kind in DIALECTS else module.suffixes[0])
        made.write_bytes(file.read_bytes())
        with in_place(forks) if forks else contextlib.nullcontext():
            return read_all(made, repair=repair) if takes_repair else read_all(made)

    return read


@contextlib.contextmanager
def in_place(forks: Forks) -> Iterator[None]:
    """Have native readers work in forks of this process."""
    from splinefeed.files import native_process

    kept, native_process._worker = native_process._worker, cast("Worker", forks)
    try:
        yield
    finally:
        native_process._worker = kept


class Coverage:
    """Lines of the readers that have run, while it is on: `new` says whether there were any since the last time.

    Only what reads is watched (formats, machine, sweeps, robots): a fit or a search is not led to by a file's words.
    """

    ROOMS = tuple(f"/splinefeed/{room}/" for room in ("formats", "programs", "files", "machine", "sweeps", "robots"))

    def __init__(self) -> None:
        self.lines: set[tuple[Any, int]] = set()
        self._before = 0

    def __enter__(self) -> Coverage:
        sys.settrace(self._call)
        return self

    def __exit__(self, *error: object) -> None:
        sys.settrace(None)

    def new(self) -> bool:
        before, self._before = self._before, len(self.lines)
        return self._before > before

    def _call(self, frame: Any, event: str, given: Any) -> Any:
        return self._line if any(room in frame.f_code.co_filename for room in self.ROOMS) else None

    def _line(self, frame: Any, event: str, given: Any) -> Any:
        self.lines.add((frame.f_code, frame.f_lineno))
        return self._line


def fuzz(kind: str, seed: int, count: int, folder: Path, say: Callable[[str], None] = lambda text: None) -> str:
    """Read `count` changed files; what came of them. AssertionError with the file that brought about anything else.

    A file that runs a line of a reader which none before it ran is kept, and changed further in its turn.
    """
    from splinefeed.errors import SplinefeedError

    rng, coverage = np.random.default_rng(seed), Coverage()
    sound, read = list(seeds(kind, folder)), reader(kind, folder)
    change = program if kind == "gcode" else changed
    suffix = ".bin" if kind in DRAWINGS else SUFFIXES[kind]
    file = folder / f"changed{suffix}"
    came = slowest = 0.0
    for i in range(count):
        told = kind not in BINARY and rng.random() < 0.4
        content = (retold if told else change)(rng, sound[i % len(sound)])
        file.write_bytes(content)
        start = time.monotonic()
        limit(3 * MOST_SECONDS)  # lines that are watched take three times as long, or more
        try:
            with coverage:
                read(file, bool(rng.integers(2)))
            came += 1
        except SplinefeedError as error:
            lines = str(error).split("\n")
            one = len(lines) == 1 or len(lines) == len(getattr(error, "problems", ())) + 1
            assert one and max(map(len, lines)) < 1000, f"{kind}, seed {seed}, input {i}: {error}"
        except BaseException as error:
            kept = Path(tempfile.gettempdir()) / f"fuzzed-{kind}-{seed}-{i}{suffix}"
            kept.write_bytes(content)
            raise AssertionError(f"{kind}, seed {seed}, input {i}, kept as {kept}: {error!r}") from error
        finally:
            limit(0)
        slowest = max(slowest, time.monotonic() - start)
        if coverage.new() and i >= len(sound) and len(sound) < MOST_KEPT and len(content) <= LARGEST:
            sound.append(content)
        if i % 1000 == 999:
            say(f"{kind}: {i + 1} inputs")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return f"{kind}: {count} inputs, {came:.0f} read, the slowest {slowest:.1f} s, peak {peak:.0f} MB"


def limit(seconds: int) -> None:
    """Raise an error after so many s of processor time, or ten times as many by the clock; 0 for never."""
    signal.setitimer(signal.ITIMER_PROF, seconds)
    signal.alarm(10 * seconds)


def _too_long(*_: object) -> None:
    raise TimeoutError(f"more than {3 * MOST_SECONDS} s")


def main() -> None:
    """Run as a program: see above."""
    kind, seed, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    # the processes of native libraries have limits of their own, which are not to be below this one
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
    for number in (signal.SIGALRM, signal.SIGPROF):
        signal.signal(number, _too_long)
    warnings.simplefilter("error", RuntimeWarning)  # a user would see it beside the one line
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(sys.stderr):
        found = fuzz(kind, seed, count, Path(folder), lambda text: print(text, file=sys.stderr, flush=True))
    print(found)


if __name__ == "__main__":
    main()
