"""How do I plan a drawing? An SVG is read, its curves stay curves, and the figure shows feed along it."""

from pathlib import Path

import splinefeed as sf

Path("heart.svg").write_text(
    '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm" viewBox="0 0 60 60">'
    '<path fill="none" stroke="black" '
    'd="M30 55 C0 30 5 5 20 5 C25 5 30 10 30 15 C30 10 35 5 40 5 C55 5 60 30 30 55 Z"/></svg>'
)
path = sf.read("heart.svg")
run = sf.run(path, sf.Limits(feed=50, axis_acceleration=500, axis_jerk=20000))

figure = sf.plot.overview(run)
assert len(path.curves) == 4
