"""Change the kernels in one place at a time and see whether the tests notice: python tests/mutants.py [COUNT] [SEED].

Each mutant is one changed operator, comparison or number in one kernel, taken at random from all there are. The tests
marked `nojit` of that kernel's room run with the compiler off until one fails. A mutant that none notices is printed.
"""

from __future__ import annotations

import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
KERNELS = ROOT / "src" / "splinefeed" / "kernels"
#: Where the tests of each kernel file that is changed here are, below tests.
TESTS = {
    "arc_length": ("geometry",),
    "barrier": ("feed/test_without_compiler.py",),
    "cells": ("geometry", "feed/test_without_compiler.py"),
    "check": ("analysis",),
    "contour": ("analysis",),
    "law": ("feed", "analysis"),
    "look_ahead_path": ("feed/test_without_compiler.py",),
    "look_ahead_solver": ("feed/test_without_compiler.py",),
    "mechanics": ("simulation", "machine"),
    "nearest": ("geometry",),
    "nurbs": ("geometry",),
    "pieces": ("geometry", "interpolation"),
    "profile": ("feed",),
    "servo": ("simulation",),
}
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
#: A mutant whose tests take longer hangs, which a user would notice too. s
PATIENCE = 300


def main() -> int:
    """Print each mutant's fate and how many survive."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    places = [
        (file, index)
        for file in sorted(KERNELS.glob("*.py"))
        if file.stem in TESTS
        for index, _ in enumerate(_places(file))
    ]
    chosen = random.Random(seed).sample(places, count)
    survivors = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "project"
        ignore = shutil.ignore_patterns(".venv", ".git", "__pycache__", ".*_cache")
        shutil.copytree(ROOT, copy, ignore=ignore)
        for number, (file, index) in enumerate(chosen, 1):
            target = copy / file.relative_to(ROOT)
            line, text = _mutated(file, index)
            target.write_text(text, encoding="utf-8")
            noticed = _noticed(copy, file.stem)
            shutil.copy2(file, target)
            survivors += not noticed
            fate = "noticed" if noticed else "SURVIVES"
            print(
                f"{number:3d} {fate:8s} {file.stem}.py:{line}  {file.read_text().splitlines()[line - 1].strip()}",
                flush=True,
            )
    print(f"{count} mutants, {survivors} survive, seed {seed}")
    return 0


def _places(file: Path) -> Iterator[ast.AST]:
    """What can be changed, inside functions only: module constants and docstrings are not arithmetic."""
    for function in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(function, ast.FunctionDef):
            yield from _of(function)


def _of(function: ast.FunctionDef) -> Iterator[ast.AST]:
    for statement in function.body:
        for node in ast.walk(statement):
            arithmetic = isinstance(node, (ast.BinOp, ast.AugAssign)) and type(node.op) in OPERATORS
            comparison = isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS
            number = isinstance(node, ast.Constant) and type(node.value) is float and node.value not in (0.0, 1.0)
            if arithmetic or comparison or number:
                yield node


def _mutated(file: Path, index: int) -> tuple[int, str]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    nodes = (node for function in tree.body if isinstance(function, ast.FunctionDef) for node in _of(function))
    node = next(node for number, node in enumerate(nodes) if number == index)
    if isinstance(node, (ast.BinOp, ast.AugAssign)):
        node.op = OPERATORS[type(node.op)]()
    elif isinstance(node, ast.Compare):
        node.ops[0] = COMPARISONS[type(node.ops[0])]()
    elif isinstance(node, ast.Constant):
        node.value = 1.5 * node.value
    return node.lineno, ast.unparse(tree)


def _noticed(copy: Path, kernel: str) -> bool:
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(copy / "src")}
    folders = [str(copy / "tests" / name) for name in TESTS[kernel]]
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-p",
        "no:cacheprovider",
        "-m",
        "nojit and not torture",
        *folders,
    ]
    try:
        done = subprocess.run(command, cwd=copy, env=environment, capture_output=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return True
    if done.returncode not in (0, 1):
        raise SystemExit(done.stdout.decode() + done.stderr.decode())
    return done.returncode == 1


if __name__ == "__main__":
    sys.exit(main())
