"""Change the kernels in one place at a time and see whether the tests notice: make mutants ARGS="--count 50 --seed 1".

Each mutant is one changed operator, comparison or number in one kernel, taken at random from all there are. Of the
tests that run its line as plain Python (`make coverage` has written down which, and how long each takes) as many run
as fit into BUDGET, the quickest of each first, until one fails. Tests that need the compiler do not run.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import multiprocessing
import os
import queue
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
KERNELS = Path("src/splinefeed/kernels")
#: What `make coverage` left: the tests that run each line, and the time that each of them takes.
LINES, TIMES = ROOT / ".coverage", ROOT / "build" / "coverage.xml"
PAGE = ROOT / "docs" / "tests.md"
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}
COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
}
#: So long may the tests of one mutant take by what `make coverage` measured, s.
BUDGET = 30.0
#: A mutant whose tests take so many times as long, and this much more, hangs, which a user would notice too. s
SLOWER, PATIENCE = 10.0, 120.0
#: How a process ends that could not even start pytest.
_BROKEN = 99
#: Mutants that no test can notice, by file, line and what was changed, and why they change nothing that matters.
EQUIVALENT: dict[tuple[str, str, str], str] = {}


@dataclass(frozen=True)
class Mutant:
    """One change: `before` has become `after` in a kernel file, in `line` of the statement from line `statement` on.

    source  the line as it was; text  the whole file with the change
    """

    file: str
    line: int
    statement: int
    source: str
    before: str
    after: str
    text: str

    @property
    def why_equivalent(self) -> str | None:
        """Why no test can notice it, if that is so."""
        return EQUIVALENT.get((self.file, self.source, self.after))


def main() -> int:
    """Print each mutant's fate and how many survive; with --write, put them into docs/tests.md."""
    parser = argparse.ArgumentParser(description=__doc__.partition(":")[0])
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of the mutants to try, from 1")
    parser.add_argument("--write", action="store_true", help=f"write the table into {PAGE.relative_to(ROOT)}")
    given = parser.parse_args()
    chosen = dict(enumerate(sample(given.count, given.seed), 1))
    numbers = given.only or list(chosen)
    tests = {number: tests_of(chosen[number]) for number in numbers}
    fates: dict[int, str] = {}
    context = multiprocessing.get_context("fork")  # pytest and NumPy are imported once, here
    _import_what_takes_long()
    waiting, done = context.Queue(), context.Queue()
    for number in numbers + [0] * given.jobs:
        waiting.put(number)
    workers = [context.Process(target=_work, args=(waiting, done, chosen, tests)) for _ in range(given.jobs)]
    for worker in workers:
        worker.start()
    while len(fates) < len(numbers):
        try:
            number, fate = done.get(timeout=5.0)
        except queue.Empty:
            if not any(worker.is_alive() for worker in workers):
                raise SystemExit("every worker has ended, and some mutants have not been tried") from None
            continue
        fates[number] = fate
        mutant = chosen[number]
        print(f"{number:3d} {fate:12s} {mutant.file}:{mutant.line}  {mutant.before}  ->  {mutant.after}", flush=True)
    for worker in workers:
        worker.join()
    for number in sorted(fates):
        if fates[number] != "noticed":
            print(f"{number:3d} {fates[number]}: {chosen[number].file}:{chosen[number].line}  {chosen[number].source}")
    count = {fate: list(fates.values()).count(fate) for fate in ("noticed", "equivalent", "not noticed")}
    parts = [f"{len(fates)} mutants", *(f"{count[fate]} {fate}" for fate in count)]
    summary = ", ".join(parts)
    print(f"{summary}; seed {given.seed}")
    if given.write:
        _write(chosen, fates, given.seed, summary)
    return 0


def sample(count: int, seed: int) -> list[Mutant]:
    """Mutants taken at random from all kernels."""
    places = [
        (file, index) for file in sorted((ROOT / KERNELS).glob("*.py")) for index, _ in enumerate(_places(_tree(file)))
    ]
    return [_mutant(file, index) for file, index in random.Random(seed).sample(places, count)]


def _tree(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


def _places(tree: ast.Module) -> Iterator[ast.AST]:
    """What can be changed, inside kernels only: module constants and docstrings are not arithmetic."""
    for function in tree.body:
        if isinstance(function, ast.FunctionDef) and function.decorator_list:
            for statement in function.body:
                yield from filter(_can_change, ast.walk(statement))


def _can_change(node: ast.AST) -> bool:
    if isinstance(node, (ast.BinOp, ast.AugAssign)):
        return type(node.op) in OPERATORS
    if isinstance(node, ast.Compare):
        return type(node.ops[0]) in COMPARISONS
    return isinstance(node, ast.Constant) and type(node.value) is float and node.value not in (0.0, 1.0)


def _mutant(file: Path, index: int) -> Mutant:
    tree = _tree(file)
    node = next(node for number, node in enumerate(_places(tree)) if number == index)
    before = ast.unparse(node)
    if isinstance(node, (ast.BinOp, ast.AugAssign)):
        node.op = OPERATORS[type(node.op)]()
    elif isinstance(node, ast.Compare):
        node.ops[0] = COMPARISONS[type(node.ops[0])]()
    elif isinstance(node, ast.Constant):
        node.value = 1.5 * node.value
    line: int = node.lineno  # type: ignore[attr-defined]
    source = file.read_text(encoding="utf-8").splitlines()[line - 1].strip()
    begins = (part.lineno for part in ast.walk(tree) if isinstance(part, ast.stmt) and part.lineno <= line)
    return Mutant(file.name, line, max(begins), source, before, ast.unparse(node), ast.unparse(tree))


def tests_of(mutant: Mutant) -> dict[str, float]:
    """Tests that run the line of a mutant, and their seconds: of each function its quickest first, up to BUDGET."""
    from coverage import CoverageData

    data = CoverageData(str(LINES))
    data.read()
    by_line = data.contexts_by_lineno(str(ROOT / KERNELS / mutant.file))
    if not by_line:
        raise SystemExit(f"{LINES} knows nothing of {mutant.file}; run make coverage first")
    lines = range(mutant.statement, mutant.line + 1)  # of a statement over many lines only some are traced
    names = {context.partition("|")[0] for line in lines for context in by_line.get(line, [])}
    times = _times()
    of_function: dict[str, list[tuple[float, str]]] = {}
    for name in names & times.keys():
        of_function.setdefault(name.partition("[")[0], []).append((times[name], name))
    ranked = sorted((rank, *test) for tests in of_function.values() for rank, test in enumerate(sorted(tests)))
    chosen: dict[str, float] = {}
    for _, seconds, name in ranked:
        if sum(chosen.values()) + seconds <= BUDGET:
            chosen[name] = seconds
    return chosen


def _times() -> dict[str, float]:
    """Seconds of each test that passed, by its node id."""
    times = {}
    for case in ElementTree.parse(TIMES).iter("testcase"):
        if len(case) == 0:  # a failure or a skip would be its child
            module = case.attrib["classname"].replace(".", "/")
            times[f"{module}.py::{case.attrib['name']}"] = float(case.attrib["time"])
    return times


def _import_what_takes_long() -> None:
    for module in ("numba", "numpy", "pytest", "scipy.integrate", "scipy.optimize"):
        importlib.import_module(module)


def _work(waiting: multiprocessing.Queue, done: multiprocessing.Queue, chosen: dict, tests: dict) -> None:
    """Try one mutant after the other in a copy of the project."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "project"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".venv", ".git", "build", "__pycache__", ".*"))
        while number := waiting.get():
            mutant: Mutant = chosen[number]
            target = copy / KERNELS / mutant.file
            whole = target.read_bytes()
            target.write_text(mutant.text, encoding="utf-8")
            noticed = any(_fails(copy, part) for part in _parts(tests[number]))
            target.write_bytes(whole)
            done.put((number, "noticed" if noticed else "equivalent" if mutant.why_equivalent else "not noticed"))


def _parts(tests: dict[str, float]) -> Iterator[dict[str, float]]:
    """A few tests first, as most mutants die at once; then the others."""
    names = list(tests)
    for part in (names[:12], names[12:]):
        if part:
            yield {name: tests[name] for name in part}


def _fails(copy: Path, tests: dict[str, float]) -> bool:
    """Whether one of the tests fails in `copy`, or they hang."""
    child = os.fork()
    if child == 0:
        code = _BROKEN
        try:
            code = _run(copy, list(tests))
        finally:  # nothing of what this process has open is the child's to close
            os._exit(code)
    until = time.monotonic() + PATIENCE + SLOWER * sum(tests.values())
    while True:
        finished, status = os.waitpid(child, os.WNOHANG)
        if finished:
            break
        if time.monotonic() > until:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return True
        time.sleep(0.05)
    code = os.waitstatus_to_exitcode(status)
    if code not in (0, 1, 2):  # 2: a module of tests cannot be imported any more
        raise SystemExit(f"pytest ended with {code}: {(copy / 'output').read_text()}")
    return code != 0


def _run(copy: Path, tests: list[str]) -> int:
    """Run tests in `copy`, in this process, as plain Python; pytest's exit code."""
    import numba
    import pytest

    os.chdir(copy)
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    numba.config.DISABLE_JIT = True
    os.environ["PYTHONPATH"] = str(copy / "src")
    sys.path[:] = [str(copy), str(copy / "src"), *sys.path]
    sys.dont_write_bytecode = True
    with open(copy / "output", "w", encoding="utf-8") as output:
        os.dup2(output.fileno(), 1)
        os.dup2(output.fileno(), 2)
        try:
            return int(pytest.main(["-x", "-q", "-n", "0", "--timeout", "0", "-p", "no:cacheprovider", *tests]))
        except BaseException:
            traceback.print_exc()
            return _BROKEN


def _write(chosen: dict[int, Mutant], fates: dict[int, str], seed: int, summary: str) -> None:
    from benchmarks.tables import Column, Table, write_into

    rows = tuple(
        (f"`{chosen[n].file}`", f"`{chosen[n].before}`", f"`{chosen[n].after}`", chosen[n].why_equivalent or fates[n])
        for n in sorted(fates)
        if fates[n] != "noticed"
    )
    caption = f"{summary} (seed {seed})."
    columns = tuple(Column(title) for title in ("kernel", "was", "became", "why no test notices"))
    table = Table(caption, columns, rows).markdown() if rows else caption
    if not write_into(PAGE, "mutants", table):
        raise SystemExit(f"{PAGE} has no place for the table")


if __name__ == "__main__":
    sys.exit(main())
