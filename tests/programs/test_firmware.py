"""Times of grbl, Klipper and Marlin against their published rules, written here once more, move by move.

The oracle plans each program from the start of every move as the firmware does: it takes the moves that the look-ahead
sees, brings them to rest at its end, and keeps what that gives for the first of them. Angles are by the cosine, sums by
loops; nothing is shared with the package. Sources: S. K. Jeon, "Improving Grbl: cornering algorithm" (2011); grbl 1.1's
wiki (settings, look-ahead of 16 blocks); Klipper's documentation, "Kinematics" and "Config reference"; Marlin's, M204
and M205.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest

import splinefeed as sf
from splinefeed.machine.control import AxisControl, Control

Move = tuple[list[float], float]  # the vector, mm, and the greatest speed, mm/s


def program(seed: int, count: int = 120) -> tuple[list[str], list[Move]]:
    """Lines of random length, turn and feed: long and short ones, sharp corners and rows of small turns."""
    rng = random.Random(seed)
    lines, moves, angle, x, y, feed = ["G21 G90 G17 G94"], [], 0.0, 0.0, 0.0, 40.0
    for k in range(count):
        if k % 10 == 0:
            feed = rng.choice([20.0, 40.0, 80.0, 150.0])
        angle += rng.choice([rng.uniform(-0.2, 0.2), rng.uniform(-3.1, 3.1), 0.05])
        size = rng.choice([0.3, 1.0, 4.0, rng.uniform(0.1, 30.0)])
        new = [round(x + size * math.cos(angle), 4), round(y + size * math.sin(angle), 4)]
        moves.append(([new[0] - x, new[1] - y, 0.0], feed))
        lines.append(f"G1 X{new[0]:.4f} Y{new[1]:.4f} F{60 * feed:g}")
        x, y = new
    return [*lines, "M2"], moves


def cosine(one: Move, two: Move) -> float:
    """The cosine of the angle between two lines at their corner: 1 where the path turns back, -1 straight on."""
    dot = sum(a * b for a, b in zip(one[0], two[0], strict=True))
    return max(min(-dot / math.dist(one[0], (0, 0, 0)) / math.dist(two[0], (0, 0, 0)), 1.0), -1.0)


def trapezoid(length: float, low: float, high: float, top: float, a: float) -> float:
    """Seconds of a move between two speeds, within a top speed, at constant acceleration."""
    peak = min(top, math.sqrt((2 * a * length + low**2 + high**2) / 2))
    peak = max(peak, low, high)
    way = (2 * peak**2 - low**2 - high**2) / (2 * a)
    return (2 * peak - low - high) / a + (length - way) / peak


def lookahead(
    lengths: list[float], tops: list[float], corners: list[float], a: float, seen: int, first: float = 0.0
) -> list[float]:
    """The squares of the speeds at the start of the first and at the ends of all moves, each decided when it begins."""
    ends, now = [], first**2
    for k in range(len(lengths)):
        window = range(k, min(k + seen, len(lengths)))
        back, behind = 0.0, {}
        for i in reversed(window):  # from rest at the end of what is seen
            if i < window[-1]:
                back = min(back, corners[i] ** 2, tops[i] ** 2, tops[i + 1] ** 2)
            behind[i] = back
            back += 2 * a * lengths[i]
        if k == 0:
            now = min(now, tops[0] ** 2, behind[0] + 2 * a * lengths[0])
            ends.append(now)
        now = min(behind[k], now + 2 * a * lengths[k])
        ends.append(now)
    return ends


def total(
    lengths: list[float], tops: list[float], corners: list[float], a: float, seen: int, first: float = 0.0
) -> float:
    """Seconds of all moves."""
    starts = lookahead(lengths, tops, corners, a, seen, first)
    ends = starts[1:]
    del starts[-1]
    return sum(
        trapezoid(length, math.sqrt(low), math.sqrt(high), top, a)
        for length, low, high, top in zip(lengths, starts, ends, tops, strict=True)
    )


def deviated(moves: list[Move], a: float, d: float) -> list[float]:
    """Corner speeds by junction deviation."""
    out = []
    for one, two in pairwise(moves):
        s = math.sqrt((1 - cosine(one, two)) / 2)
        out.append(math.sqrt(a * d * s / (1 - s)) if s < 1 - 1e-12 else math.inf)
    return out


def grbl(moves: list[Move], a: float, d: float) -> float:
    """Sixteen blocks in the buffer, of which one runs."""
    lengths = [math.dist(vector, (0, 0, 0)) for vector, _ in moves]
    return total(lengths, [feed for _, feed in moves], deviated(moves, a, d), a, 15)


def klipper(moves: list[Move], a: float, corner: float, ratio: float) -> float:
    """All moves seen; corners within half of each line; tops of the smoothed look-ahead bound what lies between."""
    lengths = [math.dist(vector, (0, 0, 0)) for vector, _ in moves]
    tops = [feed for _, feed in moves]
    corners = deviated(moves, a, corner**2 * (math.sqrt(2) - 1) / a)
    for k, (one, two) in enumerate(pairwise(moves)):
        c = cosine(one, two)
        tangent = math.sqrt((1 - c) / (1 + c)) if c > -1 + 1e-12 else math.inf
        corners[k] = min(corners[k], *(math.sqrt(a * lengths[i] / 2 * tangent) for i in (k, k + 1)))
    if ratio:
        soft = (1 - ratio) * a
        *starts, _ = _, *ends = lookahead(lengths, tops, corners, soft, len(moves))
        peaks = [
            min(top**2, (2 * soft * length + low + high) / 2)
            for length, low, high, top in zip(lengths, starts, ends, tops, strict=True)
        ]
        hill: list[int] = []
        for k in range(len(moves)):
            hill.append(k)
            last = k == len(moves) - 1
            if last or (ends[k] <= starts[k] and ends[k] <= ends[k + 1]):
                highest = max(peaks[i] for i in hill)
                for i in hill:
                    tops[i] = min(tops[i], math.sqrt(highest))
                hill = []
    return total(lengths, tops, corners, a, len(moves))


def jerk(moves: list[Move], a: float, steps: tuple[float, float]) -> float:
    """Marlin's older rule: no axis's velocity steps by more than its jerk, at corners and from rest; sixteen blocks."""
    lengths = [math.dist(vector, (0, 0, 0)) for vector, _ in moves]
    corners = []
    for k, (one, two) in enumerate(pairwise(moves)):
        changes = [abs(two[0][i] / lengths[k + 1] - one[0][i] / lengths[k]) for i in (0, 1)]
        corners.append(min(step / max(change, 1e-12) for step, change in zip(steps, changes, strict=True)))
    vector = moves[0][0]
    first = min(step * lengths[0] / max(abs(part), 1e-12) for step, part in zip(steps, vector[:2], strict=True))
    return total(lengths, [feed for _, feed in moves], corners, a, 15, first)


AXES = {name: AxisControl(rapid=200.0) for name in "xyz"}
STEPS = {"x": AxisControl(rapid=200.0, velocity_step=8.0), "y": AxisControl(rapid=200.0, velocity_step=12.0)}
CASES: dict[str, tuple[Control, Callable[[list[Move]], float]]] = {
    "grbl": (
        Control(model="grbl", acceleration=300.0, junction_deviation=0.01, look_ahead=15, axes=AXES),
        lambda moves: grbl(moves, 300.0, 0.01),
    ),
    "klipper": (
        Control(model="klipper", acceleration=1500.0, corner_velocity=5.0, axes=AXES),
        lambda moves: klipper(moves, 1500.0, 5.0, 0.0),
    ),
    "klipper, smoothed": (
        Control(model="klipper", acceleration=3000.0, corner_velocity=8.0, cruise_ratio=0.5, axes=AXES),
        lambda moves: klipper(moves, 3000.0, 8.0, 0.5),
    ),
    "marlin": (
        Control(model="marlin", acceleration=800.0, junction_deviation=0.02, look_ahead=15, axes=AXES),
        lambda moves: grbl(moves, 800.0, 0.02),
    ),
    "marlin, jerk": (
        Control(model="marlin", acceleration=800.0, look_ahead=15, axes=STEPS),
        lambda moves: jerk(moves, 800.0, (8.0, 12.0)),
    ),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(8))
def test_times_are_those_of_the_published_rules(tmp_path, name: str, seed: int) -> None:
    """Within 0.1 %: 8 programs of 120 moves each."""
    control, oracle = CASES[name]
    lines, moves = program(seed)
    file = tmp_path / "part.nc"
    file.write_text("\n".join(lines) + "\n")
    time = sf.cycle_time(file, sf.Machine(name="mill", axes={}, control=control), dialect="linuxcnc")
    assert len(time.blocks) == len(moves)
    assert time.total == pytest.approx(oracle(moves), rel=1e-3)
    assert time.control == f"{control.model}, by its published rules"
    assert time.corner_stops == (0, 0.0)


@pytest.mark.parametrize(("name", "radius"), [("grbl", 4.0), ("klipper", 12.0), ("marlin", 6.0)])
def test_arcs_are_cut_as_chords(tmp_path, name: str, radius: float) -> None:
    """An arc of three quarters, and the chords that stand for it, one by one: within 1 %."""
    control, oracle = CASES[name]
    file = tmp_path / "part.nc"
    file.write_text(f"G21 G90 G17 G94\nG1 X20 F6000\nG3 X{20 - radius} Y{radius} I0 J{radius}\nG1 Y40\nM2\n")
    sweep = 1.5 * math.pi
    if name == "grbl":
        bow = 0.002
        count = math.floor(0.5 * sweep * radius / math.sqrt(bow * (2 * radius - bow)))
        control = replace(control, arc_tolerance=bow)
    else:
        count = math.floor(sweep * radius)
        control = replace(control, arc_segment=1.0)
    places = [(0.0, 0.0), (20.0, 0.0)]
    places += [
        (20 + radius * math.sin(sweep * k / count), radius - radius * math.cos(sweep * k / count))
        for k in range(1, count + 1)
    ]
    places.append((20 - radius, 40.0))
    moves: list[Move] = [([x - a, y - b, 0.0], 100.0) for (a, b), (x, y) in pairwise(places)]
    time = sf.cycle_time(file, sf.Machine(name="mill", axes={}, control=control), dialect="linuxcnc")
    assert time.total == pytest.approx(oracle(moves), rel=1e-2)


def test_marlin_s_jerk_starts_each_move_from_rest_at_a_speed(tmp_path) -> None:
    """A dwell parts two programs: both begin at the jerk, and end at rest."""
    control, oracle = CASES["marlin, jerk"]
    lines, moves = program(3, 40)
    file = tmp_path / "part.nc"
    file.write_text("\n".join([*lines[:21], "G4 P1.5", *lines[21:]]) + "\n")
    time = sf.cycle_time(file, sf.Machine(name="mill", axes={}, control=control), dialect="linuxcnc")
    assert time.total == pytest.approx(1.5 + oracle(moves[:20]) + oracle(moves[20:]), rel=1e-9)
    file.write_text("G21 G90\nG1 X10 F6000\nM2\n")
    time = sf.cycle_time(file, sf.Machine(name="mill", axes={}, control=control), dialect="linuxcnc")
    peak = ((2 * 800 * 10 + 8.0**2) / 2) ** 0.5  # from 8 mm/s to rest, within 100 mm/s
    assert time.total == pytest.approx((2 * peak - 8.0) / 800, rel=1e-9)


def test_a_corner_of_ninety_degrees_is_passed_at_klipper_s_corner_velocity(tmp_path) -> None:
    file = tmp_path / "part.nc"
    file.write_text("G21 G90\nG1 X50 F6000\nY50\nM2\n")
    control = CASES["klipper"][0]
    time = sf.cycle_time(file, sf.Machine(name="mill", axes={}, control=control), dialect="linuxcnc")
    assert time.times.end_speed[0] == pytest.approx(5.0, rel=1e-9)
