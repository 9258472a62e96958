"""Draw the gallery, a picture and a page for each script, and notebooks: `python docs/gallery/draw.py [NAME ...]`."""

from __future__ import annotations

import json
import os
import runpy
import sys
import tempfile
from contextlib import chdir
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
#: Which scripts answer whose questions, by the pages in docs/readers.
READERS = {
    "linuxcnc": ("program_time", "program_feeds", "limits", "corners", "override"),
    "cad": ("drawing", "curvature", "butterfly", "short_lines", "tolerance"),
    "research": ("methods", "order", "strategies", "lower_bound", "ripple", "jerk"),
    "robots": ("joints", "joint_limits", "five_axis", "tangential"),
    "teaching": ("airfoil", "seven_phase", "errors", "machine", "bode"),
}
TITLES = {
    "linuxcnc": "LinuxCNC machine", "cad": "CAD file", "research": "Research", "robots": "Robot paths",
    "teaching": "Teaching",
}  # fmt: skip
#: Scripts that are notebooks, too.
NOTEBOOKS = ("butterfly", "limits", "methods", "joints", "seven_phase")


def scripts() -> list[Path]:
    """The script of each picture."""
    return [HERE / f"{name}.py" for names in READERS.values() for name in names]


def question(script: Path) -> str:
    """What a script answers: the first sentence of its docstring."""
    return script.read_text(encoding="utf-8").split('"""')[1].partition("?")[0] + "?"


def answer(script: Path) -> str:
    """What its picture shows: the rest of that line."""
    return script.read_text(encoding="utf-8").split('"""')[1].partition("?")[2].strip()


def drawn(script: Path) -> Any:
    """The figure of a script, which may write files: in a folder of its own."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        return runpy.run_path(os.fspath(script))["figure"]


def page(script: Path) -> str:
    """The page of a script: question, picture, and code."""
    name = script.stem
    more = f"\nAs a notebook: [{name}.ipynb]({name}.ipynb)\n" if name in NOTEBOOKS else ""
    return (
        f"# {question(script)}\n\n{answer(script)}\n\n![{answer(script)}]({name}.svg)\n\n"
        f"```{{literalinclude}} {name}.py\n:language: python\n```\n{more}"
    )


def contents() -> str:
    """The first page of the gallery: the questions of each reader."""
    parts = [
        "# Gallery\n\nA script for each question, with its picture. Copy one, and change the path and the limits. "
        "A script\n"
        'makes a figure and shows nothing: a notebook does, and `figure.save("joints.svg")` writes it.\n'
    ]
    for reader, names in READERS.items():
        cells = [
            f"[![{question(HERE / f'{n}.py')}]({n}.svg)]({n}.md) [{question(HERE / f'{n}.py')}]({n}.md)" for n in names
        ]
        cells += [""] * (-len(cells) % 3)
        rows = [f"| {' | '.join(cells[k : k + 3])} |" for k in range(0, len(cells), 3)]
        parts.append(f"## {TITLES[reader]}\n\n| | | |\n|---|---|---|\n" + "\n".join(rows) + "\n")
    parts.append("```{toctree}\n:hidden:\n\n" + "\n".join(script.stem for script in scripts()) + "\n```\n")
    return "\n".join(parts)


def notebook(script: Path) -> str:
    """A script as a Jupyter notebook: its words, its code, its figure."""
    code = script.read_text(encoding="utf-8").split('"""', 2)[2]
    cell: dict[str, Any] = {"metadata": {}, "cell_type": "code", "execution_count": None, "outputs": []}
    cells: list[dict[str, Any]] = [
        {
            "cell_type": "markdown",
            "metadata": {},
            "id": "question",
            "source": f"# {question(script)}\n\n{answer(script)}",
        },
        {**cell, "id": "code", "source": code.strip()},
        {**cell, "id": "figure", "source": "figure"},
    ]
    about = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return json.dumps({"cells": cells, "metadata": about, "nbformat": 4, "nbformat_minor": 5}, indent=1) + "\n"


def main(names: list[str]) -> None:
    """Write the pictures and pages beside their scripts."""
    for script in scripts():
        if not names or script.stem in names:
            drawn(script).save(script.with_suffix(".svg"))
            script.with_suffix(".md").write_text(page(script), encoding="utf-8")
            if script.stem in NOTEBOOKS:
                script.with_suffix(".ipynb").write_text(notebook(script), encoding="utf-8")
            print(script.with_suffix(".svg").name)
    (HERE / "index.md").write_text(contents(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
