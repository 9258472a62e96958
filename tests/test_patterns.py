"""Every regular expression of the package on 100 KB of its worst texts: time in proportion to the text.

The patterns are found in the source: compiled ones by what the modules hold, others in the calls of `re`. The worst
texts are made from each pattern's own structure: of every repeat in it the letters that it takes, a hundred thousand of
them, behind the shortest text that leads there and before a letter that fits nowhere.
"""

from __future__ import annotations

import ast
import importlib
import math
import re
import signal
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import splinefeed

SOURCE = Path(splinefeed.__file__).parent
LENGTH, MOST_SECONDS = 100_000, 2
#: Where calls of `re` have their flags.
PLACE_OF_FLAGS = {
    "compile": 1, "match": 2, "fullmatch": 2, "search": 2, "findall": 2, "finditer": 2, "split": 3, "sub": 4,
}  # fmt: skip
#: What looks for a pattern anywhere in a text; the others begin at its start.
ANYWHERE = {"search", "sub", "split", "findall", "finditer", "subn"}
#: Longest beginning of a pattern that is said again and again.
LONGEST_SAID = 200
LETTERS = " \t\n0aAgGxXeEnN.-+(),;:*/#[]{}<>=_%\"'|\\^$?é"
ENDS = ("!", "", "\n!")
#: What may be longer than a text that the pattern ever sees: patterns on words and lines that are bounded before, and
#: why each may be slow on more. (module, pattern's beginning) to the most letters that it is given.
BOUNDED = {
    ("cli.options", "[paper: "): 10_000,  # help texts of our own
    ("reports.theme", r"\.?0*e"): 40,  # a number of our own
    ("formats.occt_shapes", "Line "): 4000,  # MOST_SAID
    ("files.table_text", r"\s*[,;\t]"): 2000,  # MOST_NAMES
    ("files.table_text", "(?:(?:pos|"): 80,  # MOST_NAME
}
#: How patterns are used that have another name when they are.
METHODS = {("formats.svg_paths", "_ARGUMENTS"): {"match"}}
#: Tables of a module whose texts become patterns under a name of a loop.
TABLES = {
    ("programs.gcode.lathe", "sign"): ("_CERTAIN", "_LIKELY", "_OF_SIEMENS"),
    ("programs.gcode.dialects", "pattern"): (),  # each is in a row of SIGNS or in _UNREAD
}
FILES = [
    file for file in sorted(SOURCE.rglob("*.py")) if re.search(r"^ *import re$", file.read_text("utf-8"), re.MULTILINE)
]


class Known(dict[str, Any]):
    """Names of a module; a name of a function's own stands for some text."""

    def __missing__(self, name: str) -> str:
        return "part"


@cache
def uses() -> dict[tuple[Path | None, str], set[str]]:
    """What is done with each name, in each file and anywhere."""
    found: dict[tuple[Path | None, str], set[str]] = {}
    for file in FILES:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute):
                owner = node.value
                while isinstance(owner, ast.Subscript):
                    owner = owner.value
                name = owner.id if isinstance(owner, ast.Name) else getattr(owner, "attr", "")
                for place in (file, None):
                    found.setdefault((place, name), set()).add(node.attr)
    return found


def patterns(file: Path) -> Iterator[tuple[Any, int, bool]]:
    """Each pattern of a module, its flags, and whether it is looked for anywhere in a text."""
    short = ".".join(file.relative_to(SOURCE).with_suffix("").parts)
    held = importlib.import_module(f"splinefeed.{short}".removesuffix(".__init__"))
    for name, value in vars(held).items():
        several = value.values() if isinstance(value, dict) else value if isinstance(value, tuple | list) else [value]
        several = [part for each in several for part in (each if isinstance(each, tuple) else [each])]  # of rows, too
        here = METHODS.get((short, name)) or uses().get((file, name)) or uses().get((None, name), set())
        for pattern in several:
            if isinstance(pattern, re.Pattern):
                yield pattern.pattern, pattern.flags, bool(here & ANYWHERE) or not here & {"match", "fullmatch"}
    for node in calls_of_re(file, inside=True):
        flags = [each.value for each in node.keywords if each.arg == "flags"] or node.args[
            PLACE_OF_FLAGS[node.func.attr] :
        ]
        said = eval(ast.unparse(flags[0]), {}, Known(vars(held))) if flags else 0
        given = node.args[0]
        if isinstance(given, ast.Name) and given.id not in vars(held):
            texts = [text for table in TABLES[short, given.id] for text in getattr(held, table).values()]
        else:
            texts = [eval(ast.unparse(given), {}, Known(vars(held)))]
        yield from ((text, said, node.func.attr in ANYWHERE) for text in texts)


def calls_of_re(file: Path, *, inside: bool) -> Iterator[Any]:
    """Calls of `re` with a pattern: those inside of functions and classes, or those that a module makes at once."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    at_once = {part for each in tree.body if isinstance(each, ast.Assign) for part in ast.walk(each)}
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.args
            and isinstance(node.func.value, ast.Name) and node.func.value.id == "re"
            and node.func.attr != "escape" and (node in at_once) != inside
        ):  # fmt: skip
            yield node


def sample(items: Any, least: int = 0) -> str:
    """A short text that a parsed pattern takes, what repeats in it at least so many times, where it may."""
    out = ""
    for kind, given in items:
        name = str(kind)
        if name == "LITERAL":
            out += chr(given)
        elif name in ("IN", "NOT_LITERAL", "ANY"):
            out += next((each for each in LETTERS if takes(kind, given, each)), "a")
        elif name in ("MAX_REPEAT", "MIN_REPEAT", "POSSESSIVE_REPEAT"):
            out += sample(given[2], least) * max(given[0], min(least, given[1]))
        elif name == "SUBPATTERN":
            out += sample(given[3], least)
        elif name == "ATOMIC_GROUP":
            out += sample(given, least)
        elif name == "BRANCH":
            out += sample(given[1][0], least)
    return out


def beginnings(items: Any) -> Iterator[str]:
    """What a parsed pattern takes up to each of its parts, of each of its branches: to be said again and again."""
    for k, (kind, given) in enumerate(items):
        name = str(kind)
        inner = (
            given[1]
            if name == "BRANCH"
            else [given[3]]
            if name == "SUBPATTERN"
            else [given]
            if name == "ATOMIC_GROUP"
            else []
        )
        for least in (0, 1):
            before = sample(items[:k], least)
            yield from (before + each for branch in inner for each in beginnings(branch))
            yield before + sample([items[k]], least)


def takes(kind: Any, given: Any, letter: str) -> bool:
    """Whether one item of a parsed pattern takes a letter."""
    tree = re._parser.SubPattern(re._parser.State(), [(kind, given)])  # type: ignore[attr-defined]
    try:
        return re._compiler.compile(tree, 0).fullmatch(letter) is not None  # type: ignore[attr-defined]
    except (TypeError, re.error):
        return False


def units_of(items: Any, lead: str = "") -> Iterator[tuple[str, str]]:
    """What leads to each repeat of a parsed pattern, and what it repeats."""
    before = lead
    for k, (kind, given) in enumerate(items):
        name = str(kind)
        if name in ("MAX_REPEAT", "MIN_REPEAT", "POSSESSIVE_REPEAT"):
            if given[1] > 9:
                inner = list(given[2])
                if len(inner) == 1 and str(inner[0][0]) in ("IN", "ANY", "NOT_LITERAL", "LITERAL"):
                    letters = [each for each in LETTERS if takes(*inner[0], each)]
                    yield from (
                        (before, each) for each in dict.fromkeys((*letters[:2], *letters[4:7:2], *letters[-1:]))
                    )
                else:
                    yield before, sample(inner) or "a"
            yield from units_of(given[2], before)
        elif name == "SUBPATTERN":
            yield from units_of(given[3], before)
        elif name == "ATOMIC_GROUP":
            yield from units_of(given, before)
        elif name == "BRANCH":
            for branch in given[1]:
                yield from units_of(branch, before)
        before += sample([items[k]])


def worst(pattern: Any, flags: int) -> Iterator[str]:
    """Texts of LENGTH letters that make a pattern try much."""
    text = pattern.decode("latin-1") if isinstance(pattern, bytes) else pattern
    tree = re._parser.parse(text, flags & ~re.UNICODE)  # type: ignore[attr-defined]
    seen = set()
    for lead, unit in [*units_of(tree), *(("", each) for each in " 0a.\t(-")]:
        for front in (lead, ""):
            for end in ENDS:
                if (front, unit, end) not in seen:
                    seen.add((front, unit, end))
                    yield front + unit * (LENGTH // len(unit)) + end
        if lead and (lead, unit, 2) not in seen:
            seen.add((lead, unit, 2))
            yield (lead + unit) * (LENGTH // len(lead + unit)) + "!"
    if any(units_of(tree)):  # what repeats nothing takes its time once a letter at the most
        for unit in sorted({each for each in beginnings(tree) if 1 < len(each) < LONGEST_SAID}):
            yield unit * (LENGTH // len(unit)) + "!"


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(SOURCE)))
def test_every_pattern_of_the_source_is_seen(file: Path) -> None:
    """One in a place that `patterns` does not look at would never be tried."""
    short = ".".join(file.relative_to(SOURCE).with_suffix("").parts)
    held = vars(importlib.import_module(f"splinefeed.{short}".removesuffix(".__init__")))
    seen = {pattern for pattern, _, _ in patterns(file)}
    for node in calls_of_re(file, inside=False):
        if all(name.id in held for name in ast.walk(node.args[0]) if isinstance(name, ast.Name)):  # not of a loop
            assert eval(ast.unparse(node.args[0]), {}, held) in seen, ast.unparse(node)
    imports = [each for each in ast.walk(ast.parse(file.read_text("utf-8"))) if isinstance(each, ast.ImportFrom)]
    assert not any(each.module == "re" for each in imports)


def test_no_file_uses_patterns_under_another_name() -> None:
    others = [file for file in SOURCE.rglob("*.py") if file not in FILES]
    assert not [str(file) for file in others if re.search(r"\bimport re\b|from re import", file.read_text("utf-8"))]


def _late(*_: object) -> None:
    raise TimeoutError


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(SOURCE)))
def test_time_is_in_proportion_to_the_text(file: Path) -> None:
    short = ".".join(file.relative_to(SOURCE).with_suffix("").parts)
    found = list(dict.fromkeys(patterns(file)))
    assert found or not [*calls_of_re(file, inside=True), *calls_of_re(file, inside=False)]
    for pattern, flags, anywhere in found:
        compiled = re.compile(pattern, flags)
        shown = pattern if isinstance(pattern, str) else pattern.decode("latin-1")
        most = next((most for (place, part), most in BOUNDED.items() if place == short and part in shown), LENGTH)
        for text in worst(pattern, flags):
            given: Any = text.encode("latin-1", "replace") if isinstance(pattern, bytes) else text
            given = given[: most - 1] + given[-1:]
            took = seconds(compiled, given, anywhere)
            assert took < MOST_SECONDS, f"{shown} on {text[:30]!r}...{text[-12:]!r}"


def seconds(compiled: re.Pattern[Any], text: Any, anywhere: bool) -> float:
    """s of processor time until a pattern is found, or not; infinite where that takes far too long."""
    signal.signal(signal.SIGALRM, _late)
    begin = time.process_time()
    signal.alarm(5 * MOST_SECONDS)
    try:
        if anywhere:
            for _ in compiled.finditer(text):
                pass
        else:
            compiled.match(text)
            compiled.fullmatch(text)
    except TimeoutError:
        return math.inf
    finally:
        signal.alarm(0)
    return time.process_time() - begin


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(SOURCE)))
def test_no_group_is_possessive(file: Path) -> None:
    """Python 3.11.2 takes what such a group matched of a turn that failed: `1(?:EX[0-9]++)?+` takes all of 1EX."""
    for pattern, _, _ in patterns(file):
        text = pattern if isinstance(pattern, str) else pattern.decode("latin-1")
        assert not re.search(r"(?<!\\)\)[+*?]\+", text), text
