"""Type hints seen from outside: the examples of the documentation pass `mypy --strict`, and misuse does not."""

from __future__ import annotations

import subprocess
import sys

import pytest

from docs_pages import PAGES, blocks, name

#: Pages whose Python is not a user's program: a look into the packaging of others.
NOT_OURS = ("docs/decisions/0001-dependencies.md",)
#: Pages with functions that users write without annotations.
UNTYPED = ("docs/add-a-method.md", "docs/how-to/add-a-format.md")

USE = """
import numpy as np

import splinefeed as sf

path: sf.Path = sf.shapes.butterfly()
limits = sf.Limits(feed=60, axis_acceleration=[500, 800], axis_jerk=np.array([20000, 30000]))
law: sf.TimeLaw = sf.plan(path, limits, period=1e-3)
points: sf.Setpoints = sf.interpolate(path, law)
chunks: list[sf.Setpoints] = list(sf.interpolate(path, law, chunk=100))
verdict: sf.Verdict = sf.check(points, path, limits, law=law)
worst: sf.LimitResult = verdict.limits["feed"]
run: sf.Run = sf.run(path, limits)
figure: sf.plot.Figure = run.plot()
names: list[str] = run.report("folder")
machine: sf.Machine = sf.Machine.load("xytheta")
response: sf.Response = sf.follow(points, machine, path=path)
one: sf.simulation.Tuning = sf.tune(machine.axes["x"], rule="tyreus-luyben")
many: sf.simulation.PathTuning = sf.tune(machine, setpoints=points, path=path)
traces: list[sf.MethodTrace] = list(sf.compare(path, law))
results: list[sf.MethodResult] = [trace.result for trace in traces]
blocks: list[sf.live.Block] = sf.live.LookAhead(limits, 1e-3, path.axes).push(path)
ticks: sf.live.Ticks = sf.live.Override(sf.live.LawCourse(path, law), limits).run(np.ones(3))
fitted: sf.geometry.Fit = sf.fit([[0, 0], [1, 0.2], (2, np.sqrt(2.0))], 0.1)
curves = [sf.NurbsCurve.bezier([np.zeros(2), (1, 0.2)]), sf.NurbsCurve(1, [0, 0, 1, 1], np.eye(2))]
lines: sf.Path = sf.Path.polyline([[0, 0], [1, 0.2]])
loaded: sf.Response = sf.load("x.h5", sf.Response)
ripple: sf.analysis.Ripple = sf.analysis.feed_ripple(points, path, law)
margins: sf.simulation.Margins = sf.simulation.margins(machine.axes["x"], 1e-3)
"""
MISUSE = {
    "sf.check(path, points, limits)": "arg-type",
    "sf.check(points, path, limits, law)": "call-arg",
    "sf.follow(points, machine, path)": "call-overload misc call-arg",
    "sf.plan(path, limits, 1e-3)": "call-arg",
    "sf.plan(path, limits, perod=1e-3)": "call-arg",
    "sf.Limits(feed='fast')": "arg-type",
    "sf.nonsense": "attr-defined",
    "sf.live.nonsense": "attr-defined",
    "sf.tune(machine)": "call-overload",
    "bad: sf.TimeLaw = points": "assignment",
}


@pytest.mark.slow
def test_examples_pass_and_misuse_is_found(tmp_path):
    for page in PAGES:
        texts = [block.text for block in blocks(page) if block.language == "python" and not block.skipped]
        if texts and name(page) not in NOT_OURS:
            head = "# mypy: allow-untyped-defs, allow-incomplete-defs, allow-untyped-calls\n"
            file = name(page).replace("/", "_").replace("-", "_").replace(".md", ".py")
            (tmp_path / file).write_text(head * (name(page) in UNTYPED) + "\n".join(texts), encoding="utf-8")
    assert (tmp_path / "README.py").is_file()
    assert (tmp_path / "docs_api.py").is_file()
    (tmp_path / "use.py").write_text(USE, encoding="utf-8")
    (tmp_path / "misuse.py").write_text(USE + "\n".join(MISUSE), encoding="utf-8")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "mypy",
            "--strict",
            "--config-file=",
            "--cache-dir=cache",
            *map(str, tmp_path.glob("*.py")),
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    errors = [line for line in done.stdout.splitlines() if ": error: " in line]
    assert [line for line in errors if "misuse.py" not in line] == []
    first = USE.count("\n") + 1
    for number, (call, codes) in enumerate(MISUSE.items(), start=first):
        found = [line for line in errors if line.partition("misuse.py:")[2].startswith(f"{number}:")]
        assert found, call
        assert any(line.rpartition("[")[2].rstrip("]") in codes.split() for line in found), found
    numbers = {int(line.partition("misuse.py:")[2].partition(":")[0]) for line in errors}
    assert numbers == set(range(first, first + len(MISUSE)))
