"""Programs that a live LinuxCNC has run, and the seconds that it took: what the model of its planner is held to.

Measured with LinuxCNC 2.9.0~pre1 of Debian 12, headless, from the commanded joint positions of every servo tick of
1 ms: from the first tick that moves to the last. MACHINES names the limits of each set: velocity mm/s and acceleration
mm/s^2 of X, Y, Z and of the path. The form of the model was found on the first set, and corrected in two places by the
second (a corner is passed at the feed of the faster line; the acceleration along wide arcs); it had not seen the third.
"""

from __future__ import annotations

import math
import random

#: Velocity and acceleration of each set.
MACHINES = {"first": (60.0, 500.0), "second": (80.0, 1200.0), "third": (50.0, 800.0)}

#: Seconds that each program took.
SECONDS = {
    "arcs-g61": 2.796, "arcs-g64p02": 2.854, "drill": 13.727, "helix": 5.267, "pocket-g61": 15.187,
    "pocket-g64p02": 14.577, "poly36-g61": 12.647, "poly36-g64p02": 6.982, "poly360-g64": 4.362,
    "poly360-g64p01": 4.349, "random-g61": 21.453, "random-g64p05": 21.085, "square-g61": 11.208,
    "square-g611": 11.154, "square-g64": 10.53, "square-g64p02": 11.177, "square-g64p2": 11.022, "zigzag-g61": 6.434,
    "zigzag-g64": 4.903, "zigzag-g64p1": 6.324, "mixed-p02": 3.826, "rough-g61": 7.876, "rough-g64": 8.479,
    "rough-p1": 13.078, "slots-g61": 8.783, "slots-p02": 8.732, "star-p05": 7.001, "three-p05": 6.757,
    "wave-g61": 5.311, "wave-p02": 2.006, "boss-p02": 4.568, "gear-g61": 7.996, "gear-p03": 7.71, "raster-g64": 5.588,
    "raster-p05": 5.939, "rough3-p02": 13.888, "spiral-g64": 11.327, "spiral-p01": 11.608, "steps-g611": 3.806,
    "steps-p02": 3.777,
}  # fmt: skip


def programs(which: str) -> dict[str, str]:
    """The programs of a set by name."""
    made = {"first": _first, "second": _second, "third": _third}[which]()
    return {name: "\n".join([f"G21 G90 G17 G94 {mode}", "G0 X0 Y0 Z0", *lines, "M2"]) + "\n"
            for name, (mode, lines) in made.items()}  # fmt: skip


def _turned(count: int, parts: int, radius: float, feed: int) -> list[str]:
    angles = [2 * math.pi * k / parts for k in range(count)]
    return [f"G1 X{radius * math.cos(a):.4f} Y{radius * math.sin(a):.4f} F{feed}" for a in angles]


def _first() -> dict[str, tuple[str, list[str]]]:
    rng = random.Random(4)
    square = ["G1 X40 F1800", "Y40", "X0", "Y0"] * 2
    zigzag = [f"G1 X{3 * k} Y{(k % 2) * 8} F3600" for k in range(1, 25)]
    pocket: list[str] = []
    for k in range(1, 8):
        r = 2 * k
        pocket += [f"G1 X{r} Y{-r} F2400", f"G3 X{r + 1} Y{-r + 1} R1", f"G1 Y{r}", f"G3 X{r} Y{r + 1} R1",
                   f"G1 X{-r}", f"G3 X{-r - 1} Y{r} R1", f"G1 Y{-r}", f"G3 X{-r} Y{-r - 1} R1", f"G1 X{r}"]  # fmt: skip
    drill: list[str] = []
    for k in range(8):
        drill += [f"G0 X{10 * (k % 4)} Y{12 * (k // 4)}", "G0 Z2", "G1 Z-3 F300", "G0 Z5"]
    arcs = ["G1 X10 F3000", *(f"G{2 + k % 2} X{10 + 12 * (k + 1)} I6 J0" for k in range(6))]
    places = [
        f"G1 X{rng.uniform(0, 40):.3f} Y{rng.uniform(0, 40):.3f} F{rng.choice([1200, 2400, 3600])}" for _ in range(30)
    ]
    circle, fine = _turned(73, 36, 20.0, 2400), _turned(721, 360, 15.0, 3000)
    helix = [f"G2 X0 Y0 Z{-k} I8 J0 F2400" for k in range(1, 5)]
    return {
        "square-g61": ("G61", square), "square-g611": ("G61.1", square), "square-g64": ("G64", square),
        "square-g64p02": ("G64 P0.02", square), "square-g64p2": ("G64 P0.2", square),
        "poly36-g61": ("G61", circle), "poly36-g64p02": ("G64 P0.02", circle),
        "poly360-g64": ("G64", fine), "poly360-g64p01": ("G64 P0.01", fine),
        "zigzag-g61": ("G61", zigzag), "zigzag-g64": ("G64", zigzag), "zigzag-g64p1": ("G64 P0.1", zigzag),
        "pocket-g61": ("G61", pocket), "pocket-g64p02": ("G64 P0.02", pocket), "drill": ("G64 P0.05", drill),
        "arcs-g61": ("G61", arcs), "arcs-g64p02": ("G64 P0.02", arcs),
        "random-g64p05": ("G64 P0.05", places), "random-g61": ("G61", places), "helix": ("G64 P0.02", helix),
    }  # fmt: skip


def _rough(count: int, seed: int, feeds: list[int], size: float) -> list[str]:
    rng = random.Random(seed)
    return [f"G1 X{rng.uniform(0, size):.3f} Y{rng.uniform(0, size):.3f} F{rng.choice(feeds)}" for _ in range(count)]


def _second() -> dict[str, tuple[str, list[str]]]:
    rng = random.Random(11)
    angles = [2 * math.pi * k * 4 / 9 for k in range(1, 16)]
    star = [f"G1 X{15 * math.cos(a):.4f} Y{15 * math.sin(a):.4f} F4200" for a in angles]
    slots: list[str] = []
    for k in range(4):
        y = 10 * k
        slots += [f"G0 X0 Y{y}", "G0 Z2", "G1 Z-1 F400", "G1 X20 F2500", f"G3 X20 Y{y + 4} J2 I0", "G1 X0",
                  f"G3 X0 Y{y} J-2 I0", "G0 Z6"]  # fmt: skip
    wave = [f"G1 X{0.8 * k:.3f} Y{5 * math.sin(0.25 * k):.4f} F3600" for k in range(1, 90)]
    three = [
        f"G1 X{rng.uniform(0, 20):.3f} Y{rng.uniform(0, 20):.3f} Z{rng.uniform(-5, 5):.3f} F3000" for _ in range(25)
    ]
    mixed: list[str] = []
    for k in range(6):
        r = 1 + k
        mixed += [f"G1 X{6 * k + 3} Y0 F3600", f"G2 X{6 * k + 3 + r} Y{r} I{r} J0", f"G1 Y{r + 5}",
                  f"G3 X{6 * k + 6} Y0 R{max(8, r + 4)}"]  # fmt: skip
    return {
        "rough-p1": ("G64 P0.1", _rough(40, 1, [1500, 3000, 4500], 25)),
        "rough-g64": ("G64", _rough(30, 2, [2000, 4800], 30)),
        "rough-g61": ("G61", _rough(30, 3, [2000, 4800], 20)),
        "star-p05": ("G64 P0.05", star), "slots-p02": ("G64 P0.02", slots), "slots-g61": ("G61", slots),
        "wave-p02": ("G64 P0.02", wave), "wave-g61": ("G61", wave), "three-p05": ("G64 P0.05", three),
        "mixed-p02": ("G64 P0.02", mixed),
    }  # fmt: skip


def _third() -> dict[str, tuple[str, list[str]]]:
    gear: list[str] = []
    for k in range(12):
        a, b = 2 * math.pi * k / 12, 2 * math.pi * (k + 0.5) / 12
        gear += [f"G1 X{20 * math.cos(a):.4f} Y{20 * math.sin(a):.4f} F2700",
                 f"G2 X{20 * math.cos(b):.4f} Y{20 * math.sin(b):.4f} R3",
                 f"G1 X{15 * math.cos(b):.4f} Y{15 * math.sin(b):.4f}"]  # fmt: skip
    raster: list[str] = []
    for k in range(8):
        raster += [f"G1 X{30 * ((k + 1) % 2)} F3000", f"Y{1.5 * (k + 1)}"]
    spiral = [f"G1 X{0.05 * k * math.cos(0.2 * k):.4f} Y{0.05 * k * math.sin(0.2 * k):.4f} F2400" for k in range(300)]
    steps: list[str] = []
    for k in range(10):
        steps += [f"G1 X{4 * k + 4} F{600 + 240 * k}", f"Y{3 * (k % 3)}"]
    boss = ["G0 X10 Y0 Z2", "G1 Z-2 F500", "G3 X10 Y0 I-10 J0 F2800", "G1 X12", "G3 X12 Y0 I-12 J0", "G0 Z5", "X0"]
    return {
        "gear-p03": ("G64 P0.03", gear), "gear-g61": ("G61", gear), "raster-p05": ("G64 P0.05", raster),
        "raster-g64": ("G64", raster), "spiral-p01": ("G64 P0.01", spiral), "spiral-g64": ("G64", spiral),
        "steps-p02": ("G64 P0.02", steps), "steps-g611": ("G61.1", steps), "boss-p02": ("G64 P0.02", boss),
        "rough3-p02": ("G64 P0.02", _rough(35, 9, [900, 1800, 3000], 15)),
    }  # fmt: skip
