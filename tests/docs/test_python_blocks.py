"""The Python on the pages runs, page by page, in an empty folder that has the files that the pages talk of."""

from __future__ import annotations

import json
import re
import shutil
from unittest.mock import patch

import pytest
from click.testing import CliRunner

from docs_pages import PAGES, ROOT, blocks, name
from splinefeed.cli.main import command_line

#: Files that pages take for granted, and which of ours stand for them.
SAMPLES = {
    "part.dxf": "tests/data/dxf/dxfjs_squircle2.dxf",
    "plate.dxf": "tests/data/dxf/trimesh_ae_r2000a.dxf",
    "part.ngc": "tests/data/gcode/cncjs_tball.gcode",
    "wing.dat": "tests/data/airfoil/naca0024.dat",
}
WITH_PYTHON = [
    page for page in PAGES if any(block.language == "python" and not block.skipped for block in blocks(page))
]


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    for sample, file in SAMPLES.items():
        shutil.copy(ROOT / file, tmp_path / sample)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", WITH_PYTHON, ids=name)
def test_blocks_run(page, workplace, capsys):
    from splinefeed.interpolation import registry
    from splinefeed.kinematics import KINDS

    names: dict[str, object] = {"__name__": "page"}
    with patch.dict(registry._methods), patch.dict(KINDS):  # pages add to them
        for block in blocks(page):
            if block.language == "toml" and (file := re.match(r"# (\S+\.toml)\n", block.text)):
                (workplace / file[1]).write_text(block.text, encoding="utf-8")
            if block.language == "python" and not block.skipped:
                code = compile("\n" * (block.line - 1) + block.text, str(page), "exec", dont_inherit=True)
                exec(code, names)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_toml_and_json_blocks_can_be_read(page):
    import tomllib

    for block in blocks(page):
        if block.language == "toml":
            tomllib.loads(block.text)
        if block.language == "json" and "..." not in block.text:
            json.loads(block.text)


def test_the_machine_of_the_how_to_is_stable(workplace):
    """A page that people copy from must not hand out gains that swing."""
    import splinefeed as sf
    from splinefeed.simulation.linear import margins

    page = ROOT / "docs/how-to/add-a-machine.md"
    text = next(block.text for block in blocks(page) if block.language == "toml")
    (workplace / "my-mill.toml").write_text(text, encoding="utf-8")
    for axis in sf.Machine.load("my-mill.toml").axes.values():
        assert margins(axis, period=1e-3).verdict.startswith("stable: ")


def test_the_machine_of_the_how_to_does_what_the_page_does_with_it(workplace):
    """Its last commands, on a drawing of x and y: a machine of one axis was refused there."""
    page = ROOT / "docs/how-to/add-a-machine.md"
    text = next(block.text for block in blocks(page) if block.language == "toml")
    (workplace / "my-mill.toml").write_text(text, encoding="utf-8")
    words = "part.dxf --path 1 --machine my-mill.toml --no-figures --json"
    done = CliRunner().invoke(command_line, ["run", *words.split()])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["ok"]
