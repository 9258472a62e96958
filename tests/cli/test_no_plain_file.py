"""A pipe stands where a command expects a file: it is refused in one line, and nobody waits for who writes into it."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest

#: s after which a command that waits is given up.
PATIENCE = 60
#: What names a file, by the words of the command; {} is the pipe.
NAMED = {
    "source": "info {}", "limits": "plan circle --limits {}", "machine": "plan circle --machine {}",
    "tools": "info part.ngc --tools {}", "setpoints": "follow {} --machine xytheta",
    "law": "check {} --path circle --law {}", "sweep": "sweep {}", "folder of a sweep": "sweep show {}",
    "robot": "run motion.json --robot {}", "motion": "run {} --robot part.ngc", "ini": "machine from-ini {}",
    "grbl": "machine from-grbl {}", "klipper": "machine from-klipper {}", "marlin": "machine from-marlin {}",
    "folder of a run": "report {}", "program": "time {}", "runs": "calibrate {} {} --machine plain-mill",
    "pulses": "pulses {} --pulses x=1000,y=1000",
    "state": "stream circle --to file -o rows.csv --resume --state {}",
}  # fmt: skip

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with names are those of POSIX")


@pytest.fixture
def patience() -> Any:
    """End the test where nothing comes of it."""

    def late(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, late)
    signal.alarm(PATIENCE)
    yield
    signal.alarm(0)


@pytest.mark.parametrize("words", NAMED.values(), ids=NAMED)
@pytest.mark.usefixtures("patience")
def test_a_pipe_in_place_of_a_file_is_refused(refused: Any, folder: Path, words: str) -> None:
    os.mkfifo(folder / "pipe")
    (folder / "part.ngc").write_text("G21 G43 H1\nG1 X1 F100\nM2\n")
    (folder / "motion.json").write_text('{"waypoints": [[0, 0], [1, 1]]}')
    assert "pipe" in refused(*words.format("pipe", "pipe").split())


@pytest.mark.usefixtures("patience")
def test_a_pipe_beside_the_files_of_a_sweep_is_no_journal(refused: Any, folder: Path) -> None:
    """`sweep show` reads the folder of a stranger."""
    (folder / "s" / "parts").mkdir(parents=True)
    os.mkfifo(folder / "s" / "sweep.json")
    assert "sweep.json" in refused("sweep", "show", "s")
