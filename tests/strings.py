"""Every string that users may see, room by room: `make strings` prints them, to be read from top to bottom."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[1] / "src/splinefeed"


def strings(file: Path) -> Iterator[tuple[int, str]]:
    """Line and text of every string of words in a module but its docstrings; what is put in stands as {}."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    parts = {part for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)} - {tree}
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr):  # a docstring
            parts.add(node.value)
        if isinstance(node, ast.JoinedStr):
            texts = [part.value if isinstance(part, ast.Constant) else "{}" for part in node.values]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in parts:
            texts = [node.value]
        else:
            continue
        text = " ".join("".join(map(str, texts)).split())
        if " " in text and sum(map(str.isalpha, text)) > 4:
            yield node.lineno, text


def commands(file: Path) -> Iterator[tuple[int, str]]:
    """Line and text of the docstrings of commands, which are their help."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef) and any("click." in ast.unparse(each) for each in node.decorator_list):
            yield node.lineno, " ".join((ast.get_docstring(node) or "").split())


if __name__ == "__main__":
    for each in sorted(SOURCE.rglob("*.py")):
        found = sorted({*strings(each), *(commands(each) if each.parent.name == "cli" else ())})
        print(*(f"{each.relative_to(SOURCE)}:{line}: {text}" for line, text in found), sep="\n", end="\n" * bool(found))
