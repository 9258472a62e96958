"""A command line in an empty folder, and small files to give it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

import motions
from splinefeed.cli import progress
from splinefeed.cli.main import command_line

#: A curve of one quartic piece, 79 mm long.
SMOOTH = {
    "name": "smooth",
    "degree": 4,
    "knots": [0] * 5 + [1] * 5,
    "control_points": motions.smooth().curves[0].control_points.tolist(),
    "units": "mm",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with the file smooth.json in it and nothing else."""
    (tmp_path / "smooth.json").write_text(json.dumps(SMOOTH))
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SPLINEFEED_DEBUG", raising=False)
    for name in ("PATIENCE", "FIRST_WORD"):  # whether kernels are compiled here is not what is tested
        monkeypatch.setattr(progress, name, 1e6)
    return tmp_path


@pytest.fixture
def splinefeed(folder: Path) -> Callable[..., Result]:
    """`splinefeed(*words)` as a user types it in that folder."""

    def invoke(*words: Any) -> Result:
        return CliRunner().invoke(command_line, [str(word) for word in words], prog_name="splinefeed")

    return invoke


@pytest.fixture
def refused(splinefeed: Callable[..., Result], folder: Path) -> Callable[..., str]:
    """`refused(*words)`: that command ends with 2 and one line, which is given; it prints and leaves nothing."""

    def invoke(*words: Any) -> str:
        before = sorted(folder.rglob("*"))
        result = splinefeed(*words)
        assert result.exit_code == 2, result.output
        assert result.stdout == ""
        assert result.stderr.count("\n") == 1
        assert result.stderr.startswith("splinefeed: ")
        assert sorted(folder.rglob("*")) == before
        return result.stderr.removeprefix("splinefeed: ").rstrip("\n")

    return invoke
