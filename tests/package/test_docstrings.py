"""Docstrings of public names have the sections of NumPy's convention, as SciPy writes them."""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest

import splinefeed as sf
from docs_pages import ROOT
from splinefeed.interpolation import registry

#: Sections in their order.
SECTIONS = ["Parameters", "Attributes", "Returns", "Yields", "Raises", "Notes", "References", "Examples"]
#: With what the sentence of a function begins.
VERBS = """
    Add Adjust Advance Allow Answer Append Apply Approximate Ask Average Bound Bring Build Calculate Calibrate Cancel
    Change Check Choose Clear Close Collect Combine Come Command Compare Compute Connect Convert Copy Correct Count Cut
    Decide Derive Describe Detect Differentiate Divide Draw Drive Elevate Emit End Estimate Evaluate Expand Extend
    Extract Fetch Fill Filter Find Finish Fit Follow Forget Format Freeze Generate Get Give Go Group Halve Hash Hold
    Insert Integrate Interpolate Invert Iterate Join Keep Label Lay Leave Limit Link List Load Locate Look Make Map Mark
    Match Measure Merge Mirror Model Move Name Normalize Number Offset Open Order Pair Parse Pass Place Plan Play Plot
    Predict Prepare Press Project Provide Push Put Raise Read Record Recover Reduce Refuse Register Release Remove
    Render Repeat Replace Report Rescale Reset Resolve Resume Return Reverse Rotate Round Run Sample Save Say Scale
    Search See Select Send Separate Serve Set Shift Show Shrink Simulate Sketch Slow Smooth Solve Sort Split Start Step
    Stop Store Stream Subtract Sum Sweep Take Tell Time Trace Transform Translate Trim Tune Turn Unwrap Update Use
    Validate Verify Wait Walk Warn Watch Weigh Work Write
"""
#: Shape of an array: (n,), (..., axes), (n, order + 1, axes), or any.
SHAPE = re.compile(r"\((\.\.\.|[\w(][\w +*/()-]*)(, ?(\.\.\.|[\w +*/-]+))*,?\)|any shape")
UNIT = re.compile(r"\b(mm|s|ms|us|rad|deg|dB|V|N|px|Hz|ticks?|share|bytes?)\b")
#: What only this package makes checks nothing.
NO_ERRORS = re.compile(
    r"AxisMotion|AxisTuning|Bound|Contour|Fit|Joint|LimitResult|LimitUse|Margins|MethodResult|MethodTrace|MotionBlock"
    r"|OverrideTicks|PathParts|PathTuning|Ripple|Run|SplinefeedError|Tuning|UltimatePoint|Verdict|butterfly|margins"
    r"|methods"
)
#: A name of a method, and text.
NO_UNITS = re.compile(r"SplinefeedError|Figure|methods|register|from_text")
#: What others derive from: their methods are described here, and a method in place of one says what it does there.
BASES = (sf.paths.Track, sf.records.Modelled)


class Said(NamedTuple):
    """A public name: where it is, and what it is; of a method, its class."""

    name: str
    thing: Any
    owner: type | None


def shown() -> dict[str, Any]:
    """Public names: those of the stubs of the package and its rooms, and what pages of the API show."""
    names = {}
    for stub in sorted((ROOT / "src/splinefeed").rglob("__init__.pyi")):
        room = ".".join(["splinefeed", *stub.parent.relative_to(ROOT / "src/splinefeed").parts])
        module = importlib.import_module(room)
        names.update({f"{room}.{each}": getattr(module, each) for each in module.__all__})
    names["splinefeed.records.Modelled"] = sf.records.Modelled
    names.update({f"splinefeed.plot.{each}": getattr(sf.plot, each) for each in sf.plot.__all__})
    for page in sorted((ROOT / "docs/api").glob("*.md")):
        for name in re.findall(r"auto(?:class|function):: (\S+)", page.read_text(encoding="utf-8")):
            thing: Any = sf
            for each in name.split(".")[1:]:
                thing = getattr(thing, each)
            names[name] = thing
    return {name: each for name, each in names.items() if inspect.isroutine(each) or inspect.isclass(each)}


def everything() -> Iterator[Said]:
    """Each public function and class once, and each public method that takes parameters."""
    seen = set()
    for name, thing in shown().items():
        if thing in seen or not thing.__module__.startswith("splinefeed."):
            continue
        seen.add(thing)
        yield Said(name, thing, None)
        for attribute, method in inspect.getmembers(thing, inspect.isroutine) if inspect.isclass(thing) else ():
            home = getattr(method, "__module__", None) or ""
            public = not attribute.startswith("_") or attribute == "__call__"
            key = getattr(method, "__func__", method)
            described = any(attribute in vars(base) for base in BASES if base in thing.__mro__[1:])
            if public and home.startswith("splinefeed.") and key not in seen and not described and parameters(method):
                seen.add(key)
                yield Said(f"{name}.{attribute}", method, thing)


def parameters(thing: Any) -> dict[str, inspect.Parameter]:
    if getattr(thing, "_is_protocol", False) or (inspect.isclass(thing) and issubclass(thing, Exception)):
        return {}
    return {each: p for each, p in inspect.signature(thing).parameters.items() if each not in ("self", "cls")}


def sections(text: str) -> dict[str, list[str]]:
    """Lines of a docstring by section, what stands before the first by ""."""
    lines = text.splitlines()
    found: dict[str, list[str]] = {"": []}
    here = ""
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        if line and below == "-" * len(line) and line[0] != "-":
            assert line not in found, f"section {line} twice"
            found[here := line] = []
        elif not (line and line == "-" * len(line) and not found[here]):
            found[here].append(line)
    return found


def entries(lines: list[str]) -> list[tuple[str, str]]:
    """First lines of entries of a section, and what is indented below each."""
    found: list[tuple[str, str]] = []
    for line in lines:
        if line and not line[0].isspace():
            found.append((line, ""))
        elif line and found:
            found[-1] = (found[-1][0], f"{found[-1][1]} {line.strip()}".strip())
    return found


def named_twice_or_not(said: Said, found: dict[str, list[str]]) -> Iterator[str]:
    """What is wrong with the sections of parameters."""
    wanted = parameters(said.thing)
    listed: dict[str, str] = {}
    for section in ("Parameters", "Attributes") if inspect.isclass(said.thing) else ("Parameters",):
        for head, below in entries(found.get(section, [])):
            names, colon, kind = head.partition(" : ")
            if not colon or not kind:
                yield f"{section}: `{head}` has no type (name : type)"
            for name in names.split(","):
                name = name.strip().lstrip("*")
                if name in listed:
                    yield f"{name} is described twice"
                if name not in wanted and section == "Parameters":
                    yield f"{name} is no parameter"
                listed[name] = f"{kind} {below}"
    for name, parameter in wanted.items():
        if name not in listed:
            yield f"{name} is not described"
        elif re.search(r"Array|Points", str(parameter.annotation)) and not SHAPE.search(listed[name]):
            yield f"{name} has no shape"


def faults(said: Said) -> Iterator[str]:
    """What is wrong with a docstring."""
    text = inspect.getdoc(said.thing) or ""
    found = sections(text)
    order = [each for each in found if each]
    if unknown := set(order) - set(SECTIONS):
        yield f"sections {sorted(unknown)} are not of the convention"
    elif order != sorted(order, key=SECTIONS.index):
        yield f"sections stand in another order than {SECTIONS}"
    sentence = " ".join(text.split("\n\n")[0].split())
    if not re.match(r"[A-Z`].*\.$", sentence):
        yield "the first paragraph is no sentence"
    function = not inspect.isclass(said.thing)
    if function and sentence.split(" ")[0] not in VERBS.split():
        yield f"the sentence begins with {sentence.split(' ')[0]!r}, not with a verb of VERBS"
    yield from named_twice_or_not(said, found)
    returns = str(getattr(said.thing, "__annotations__", {}).get("return", "None"))
    if function and parameters(said.thing) and returns not in ("None", "NoReturn"):
        values = entries(found.get("Returns", []) + found.get("Yields", []))
        if not values or not all(below for _, below in values):
            yield "Returns or Yields, with a description, is missing"
        elif "Array" in returns and not SHAPE.search(" ".join(map(" ".join, values))):
            yield "what it returns has no shape"
    for head, below in entries(found.get("Raises", [])):
        if not below or not all(hasattr(sf.errors, each) or each in ERRORS for each in head.split(", ")):
            yield f"Raises: `{head}` is no error with a description"
    if said.owner is None:
        yield from of_a_public_name(said, text, found)


ERRORS = ("StopIteration", "AttributeError", "ImportError", "TimeoutError")


def of_a_public_name(said: Said, text: str, found: dict[str, list[str]]) -> Iterator[str]:
    """What a function or class has beyond what a method has."""
    last = said.name.rpartition(".")[2]
    if not any(line.startswith(">>> ") for line in found.get("Examples", [])):
        yield "Examples are missing"
    if not UNIT.search(text) and not NO_UNITS.fullmatch(last):
        yield "no unit is named"
    if "Raises" not in found and not NO_ERRORS.fullmatch(last):
        yield "Raises is missing"
    numbers = re.findall(r"^\.\. \[(\d+)\] ", "\n".join(found.get("References", [])), re.MULTILINE)
    if not numbers or numbers != [str(i + 1) for i in range(len(numbers))]:
        yield "References, `.. [1] ...`, are missing"
    for page in re.findall(r"docs/[\w/-]+\.md", text):
        if not (ROOT / page).is_file():
            yield f"{page} is missing"


ALL = {each.name: each for each in everything()}


@pytest.mark.parametrize("name", ALL)
def test_a_docstring_has_the_sections_that_a_reader_looks_for(name):
    assert list(faults(ALL[name])) == []


@pytest.fixture(scope="module")
def names():
    path = sf.shapes.naca("0025", perimeter=33)
    limits = sf.Limits(feed=60, acceleration=50, jerk=2000)
    law = sf.plan(path, limits, period=1e-3)
    slow = sf.plan(path, sf.planner.with_reserve(limits), period=1e-3)
    tip = sf.NurbsCurve.bezier([[0, 0, 0], [20, 25, 0], [40, -15, 2], [60, 10, 2]])
    axis = sf.NurbsCurve.bezier([[-5, 3, 20], [16, 30, 20], [42, -8, 22], [66, 15, 22]])
    return {
        **{"sf": sf, "np": np, "path": path, "limits": limits, "law": law, "slow": slow},
        **{"setpoints": sf.interpolate(path, law), "run": sf.run(path, limits, law=law), "curve": path.curves[0]},
        **{"machine": sf.Machine.load("xytheta"), "tip": tip, "axis": axis, "tool": sf.ToolPath(tip, axis)},
    }


@pytest.mark.parametrize("name", ALL)
def test_the_examples_run(name, names, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(registry, "_methods", dict(registry._methods))  # one is added
    for each in doctest.DocTestFinder(recurse=False).find(ALL[name].thing, name, globs=dict(names)):
        assert doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(each).failed == 0


def of_others() -> Iterator[doctest.DocTest]:
    """Examples of what is not public."""
    public = {f"{each.thing.__module__}.{each.thing.__qualname__}" for each in ALL.values()}
    for file in sorted((ROOT / "src/splinefeed").rglob("*.py")):
        if ">>> " in file.read_text(encoding="utf-8"):
            module = ".".join(file.relative_to(ROOT / "src").with_suffix("").parts)
            for each in doctest.DocTestFinder().find(importlib.import_module(module.removesuffix(".__init__"))):
                if each.examples and each.name not in public:
                    yield each


def test_the_examples_of_others_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    assert [each.name for each in of_others() if runner.run(each).failed] == []
    assert runner.summarize(verbose=False).attempted > 0


def defined() -> Iterator[tuple[str, ast.FunctionDef | ast.ClassDef, str]]:
    """Functions and classes of the package that have a docstring, private ones too, with where they are."""
    for file in sorted((ROOT / "src/splinefeed").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            text = ast.get_docstring(node) if isinstance(node, ast.FunctionDef | ast.ClassDef) else None
            if text and "\nExamples:\n" not in text:  # a command's is its help
                yield f"{file.relative_to(ROOT)}:{node.lineno} {node.name}", node, text


def test_sections_of_every_function_name_the_parameters_that_it_has():
    wrong = []
    for place, node, text in defined():
        found = sections(text)
        if isinstance(node, ast.FunctionDef) and "Parameters" in found:
            given = node.args
            all_of = [*given.posonlyargs, *given.args, given.vararg, *given.kwonlyargs, given.kwarg]
            wanted = {each.arg for each in all_of if each} - {"self", "cls"}
            heads = [head.partition(" : ")[0] for head, _ in entries(found["Parameters"])]
            listed = [name.strip().lstrip("*") for head in heads for name in head.split(",")]
            wrong += [(place, sorted(set(listed) ^ wanted))] if sorted(listed) != sorted(wanted) else []
    assert wrong == []


#: A table of parameters of the older form, `name   text`, and what has a section now.
OLDER = re.compile(r"^\w+(, \w+)*( +\([^)]*\))?  +\S|\b(Raises|Returns|Sources?:|Example:) ", re.MULTILINE)


def test_no_docstring_has_a_form_of_its_own():
    older = [place for place, _, text in defined() if not set(sections(text)) - {""} and OLDER.search(text)]
    assert older == []


FORM = """
    Wait at the end.

    Parameters
    ----------
    after, before : float
        s.
    at : (n, axes) array
        mm.

    Returns
    -------
    bool
        Whether it waited.
"""


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("Wait at", "Waits at", "the sentence begins with 'Waits', not with a verb of VERBS"),
        ("the end.", "the end", "the first paragraph is no sentence"),
        ("after, before", "after", "before is not described"),
        ("at : ", "at, why : ", "why is no parameter"),
        ("at : ", "at, after : ", "after is described twice"),
        ("at : (n, axes) array", "at  (n, axes) array", "Parameters: `at  (n, axes) array` has no type (name : type)"),
        ("(n, axes) array", "array", "at has no shape"),
        ("        Whether it waited.\n", "", "Returns or Yields, with a description, is missing"),
        ("Returns\n    -------\n    bool", "Raises\n    ------\n    Trouble", "Returns or Yields, with a description"),
        ("Parameters\n    ----------", "Arguments\n    ---------", "sections ['Arguments'] are not of the convention"),
    ],
)
def test_what_is_missing_is_found(old, new, fault):
    def wait(after: float, before: float, at: Array) -> bool:  # type: ignore[name-defined]  # noqa: F821
        return True

    wait.__doc__ = FORM
    assert list(faults(Said("wait", wait, sf.Path))) == []
    wait.__doc__ = FORM.replace(old, new)
    assert any(each.startswith(fault) for each in faults(Said("wait", wait, sf.Path)))
