"""Type hints seen from outside: mypy and pyright, both strict, pass the examples of the documentation and no misuse."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs_pages import PAGES, ROOT, blocks, name

#: Pages whose Python is not a user's program: a look into the packaging of others.
NOT_OURS = ("docs/decisions/0001-dependencies.md",)
#: Pages with functions that users write without annotations.
UNTYPED = ("docs/add-a-method.md", "docs/how-to/add-a-format.md")

#: What both checkers let pass there.
UNTYPED_HERE = """# mypy: allow-untyped-defs, allow-incomplete-defs, allow-untyped-calls
# pyright: basic
"""

USE = """
import numpy as np

import splinefeed as sf

path: sf.Path = sf.shapes.butterfly()
limits = sf.Limits(feed=60, axis_acceleration={"x": 500, "y": 800}, axis_jerk=20000)
law: sf.TimeLaw = sf.plan(path, limits, period=1e-3)
points: sf.Setpoints = sf.interpolate(path, law)
chunks: list[sf.Setpoints] = list(sf.interpolate(path, law, chunk=100))
verdict: sf.Verdict = sf.check(points, path, limits, law=law)
worst: sf.records.LimitResult = verdict.limits["feed"]
run: sf.Run = sf.run(path, limits)
figure: sf.plot.Figure = sf.plot.overview(run)
names: list[str] = sf.report(run, "folder")
machine: sf.Machine = sf.Machine.load("xytheta")
response: sf.Response = sf.runs.follow(points, machine, path=path)
one: sf.simulation.Tuning = sf.runs.tune(machine.axes["x"], rule="tyreus-luyben")
many: sf.runs.PathTuning = sf.runs.tune(machine, setpoints=points, path=path)
traces: list[sf.runs.MethodTrace] = list(sf.runs.compare(path, law))
results: list[sf.runs.MethodResult] = [trace.result for trace in traces]
blocks: list[sf.planner.MotionBlock] = sf.planner.LookAhead(limits, 1e-3, path.axes).push(path)
ticks: sf.planner.OverrideTicks = sf.planner.Override(sf.planner.LawSource(path, law), limits).run(np.ones(3))
fitted: sf.paths.Fit = sf.paths.fit([[0, 0], [1, 0.2], (2, np.sqrt(2.0))], 0.1)
curves = [sf.NurbsCurve.bezier([np.zeros(2), (1, 0.2)]), sf.NurbsCurve(1, [0, 0, 1, 1], np.eye(2))]
lines: sf.Path = sf.Path.polyline([[0, 0], [1, 0.2]])
loaded: sf.Response = sf.load("x.h5", sf.Response)
ripple: sf.analysis.Ripple = sf.analysis.feed_ripple(points, path, law)
margins: sf.simulation.Margins = sf.simulation.margins(machine.axes["x"], 1e-3)
"""
#: Lines that must not pass, and what mypy calls the fault.
MISUSE = {
    "sf.check(path, points, limits)": "arg-type",
    "sf.check(points, path, limits, law)": "call-arg",
    "sf.runs.follow(points, machine, path)": "call-overload misc call-arg",
    "sf.plan(path, limits, 1e-3)": "call-arg",
    "sf.plan(path, limits, perod=1e-3)": "call-arg",
    "sf.Limits(feed='fast')": "arg-type",
    "sf.nonsense": "attr-defined",
    "sf.runs.tune(machine)": "call-overload",
    "bad: sf.TimeLaw = points": "assignment",
}


@pytest.fixture(scope="module")
def examples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the Python of every page, the gallery, USE and MISUSE, away from the package."""
    folder = tmp_path_factory.mktemp("examples")
    for page in PAGES:
        texts = [block.text for block in blocks(page) if block.language == "python" and not block.skipped]
        if texts and name(page) not in NOT_OURS:
            head = UNTYPED_HERE * (name(page) in UNTYPED)
            file = name(page).replace("/", "_").replace("-", "_").replace(".md", ".py")
            (folder / file).write_text(head + "\n".join(texts), encoding="utf-8")
    assert {"README.py", "docs_api.py"} <= {file.name for file in folder.iterdir()}
    for script in (ROOT / "docs/gallery").glob("*.py"):
        shutil.copy(script, folder / f"gallery_{script.name}")
    (folder / "use.py").write_text(USE, encoding="utf-8")
    (folder / "misuse.py").write_text(USE + "\n".join(MISUSE), encoding="utf-8")
    return folder


def mypy(folder: Path) -> Iterator[tuple[str, int, str]]:
    """File, line and text of every error; the text ends with its code."""
    words = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--cache-dir=cache"]
    done = subprocess.run(
        [*words, *folder.glob("*.py")], cwd=folder, capture_output=True, text=True, check=False, timeout=600
    )
    assert "Found" in done.stdout, done.stdout + done.stderr
    for line in done.stdout.splitlines():
        if ": error: " in line:
            file, number, text = line.split(":", 2)
            yield file, int(number), text


def pyright(folder: Path) -> Iterator[tuple[str, int, str]]:
    """The same of pyright, which needs Node.js and brings itself from the registry of npm."""
    pytest.importorskip("pyright", reason="pyright is not installed: pip install splinefeed[slow]")
    if shutil.which("node") is None:
        pytest.skip("there is no Node.js to run pyright: on Debian, apt-get install nodejs")
    page = {"typeCheckingMode": "strict", "pythonVersion": "3.11"}
    (folder / "pyrightconfig.json").write_text(json.dumps(page), encoding="utf-8")
    words = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False, timeout=600)
    if not done.stdout.startswith("{"):
        pytest.skip(f"pyright cannot be fetched: {done.stderr.strip()[-200:]}")
    for each in json.loads(done.stdout)["generalDiagnostics"]:
        if each["severity"] == "error":
            yield Path(each["file"]).name, each["range"]["start"]["line"] + 1, each["message"]


@pytest.mark.slow
@pytest.mark.parametrize("checker", [mypy, pyright])
def test_examples_pass_and_misuse_is_found(checker, examples):
    errors = list(checker(examples))
    assert [error for error in errors if error[0] != "misuse.py"] == []
    first = USE.count("\n") + 1
    for number, (call, codes) in enumerate(MISUSE.items(), start=first):
        found = [text for _, line, text in errors if line == number]
        assert found, call
        if checker is mypy:
            assert any(text.rpartition("[")[2].rstrip("]") in codes.split() for text in found), found
    assert {line for _, line, _ in errors} == set(range(first, first + len(MISUSE)))
