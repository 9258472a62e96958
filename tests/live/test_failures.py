"""What becomes of a `splinefeed stream` that is interrupted, killed, short of disk, or steered by keys."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as File

import numpy as np
import pytest

from live_rows import Datagrams, assert_limits

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals and terminals as POSIX has them")
#: A motion of 6 s.
MOTION = ["naca:0025?perimeter=66", "--feed", "12", "--axis-accel", "500", "--axis-jerk", "20000"]
STREAM = [sys.executable, "-m", "splinefeed", "stream", *MOTION]
SHORT = [*STREAM[:4], "naca:0025?perimeter=33", "--feed", "60", "--axis-accel", "500", "--axis-jerk", "20000"]


@contextmanager
def started(*words: str, stdin: int = subprocess.DEVNULL) -> Iterator[tuple[subprocess.Popen[str], Datagrams]]:
    """A stream to UDP that has sent 600 rows at least."""
    with Datagrams() as there:
        command = [*STREAM, "--to", "udp", "--port", str(there.port), *words]
        with subprocess.Popen(command, stdin=stdin, stderr=subprocess.PIPE, text=True) as process:
            try:
                there.wait(600)
                yield process, there
            finally:
                process.kill()


def ended(process: subprocess.Popen[str]) -> str:
    """What it said in the end, without the line of the socket."""
    said = process.communicate(timeout=60)[1]
    return "\n".join(line for line in said.splitlines() if not line.startswith("commands:"))


def resumed(state: File, rows: File, *words: str) -> np.ndarray:
    """The rows of a resume into a file."""
    command = [*STREAM, "--to", "file", "-o", str(rows), "--state", str(state), "--resume", *words]
    subprocess.run(command, check=True, timeout=60, stderr=subprocess.PIPE)
    return np.loadtxt(rows)[:, 1:3]


def killed(state: File, rows: int) -> np.ndarray:
    """The rows that a stream sent until it was killed at some time behind a row."""
    with started("--state", str(state)) as (process, there):
        there.wait(rows)
        process.kill()
        process.wait(10)
    return np.array(there.rows)


def assert_resumes_without_a_step(state: File, sent: np.ndarray, rows: File) -> None:
    """A stream that was cut off goes on from nowhere but the place that the user gives."""
    command = [*STREAM, "--to", "file", "-o", str(rows), "--state", str(state), "--resume"]
    refused = subprocess.run(command, check=False, timeout=60, stderr=subprocess.PIPE, text=True)
    assert refused.returncode == 2 and not rows.exists()
    assert "was not stopped but cut off, and nothing tells where the axes are" in refused.stderr
    x, y = sent[-1].tolist()
    more = resumed(state, rows, "--at", f"x={x!r},y={y!r}")
    np.testing.assert_allclose(more[0], sent[-1], atol=1e-6)
    assert_limits(more, feed=12)
    np.testing.assert_allclose(more[-1], sent[0], atol=1e-9)  # a closed contour
    assert len(sent) + len(more) >= 5500


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_a_signal_stops_on_the_path_within_the_limits(number: int, tmp_path: File) -> None:
    state = tmp_path / "state.json"
    with started("--state", str(state)) as (process, there):
        process.send_signal(number)
        said = ended(process)
    assert process.returncode == 0, said
    assert "stopping on the path" in said and "stopped at" in said
    rows = np.array(there.rows)
    assert there.numbers == list(range(1, len(rows) + 1))
    assert_limits(rows, feed=12)
    page = json.loads(state.read_text())
    assert page["row"] == len(rows) and not page["done"]
    if number == signal.SIGINT:
        more = resumed(state, tmp_path / "more.txt")
        np.testing.assert_allclose(more[0], rows[-1], atol=1e-12)
        assert_limits(np.concatenate([rows, more]), feed=12)


def test_kill_leaves_a_whole_file_of_the_last_confirmed_row_to_resume_from(tmp_path: File) -> None:
    state = tmp_path / "state.json"
    sent = killed(state, 1500)
    page = json.loads(state.read_text())
    assert 100 < page["row"] <= len(sent) and page["rests_at"] is None
    assert os.listdir(tmp_path) == ["state.json"]
    assert_resumes_without_a_step(state, sent, tmp_path / "more.txt")


@pytest.mark.slow
def test_fifty_kills_at_random_times_never_step(tmp_path: File) -> None:
    random = np.random.default_rng(40)
    for k in range(50):
        state = tmp_path / f"state{k}.json"
        sent = killed(state, int(random.integers(600, 5000)))
        assert_resumes_without_a_step(state, sent, tmp_path / f"more{k}.txt")


def in_one_line(stderr: str) -> str:
    """The one line of an error; what took over two seconds on a busy machine has said so before it."""
    (line,) = [line for line in stderr.splitlines() if not line.endswith(" s)")]
    return line


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--at", "x=1"], "--at: is for --resume"),
        (["--resume", "--state", "s.json", "--at", "x=1"], "--at: 'x=1' must give x, y, each once"),
        (["--resume", "--state", "s.json", "--at", "x=1,y=2,z=3"], "must give x, y, each once"),
        (["--resume", "--state", "s.json", "--at", "x=1,y=two"], "'two' cannot be read"),
    ],
)
def test_a_place_is_one_of_every_axis(tmp_path: File, words: list[str], reason: str) -> None:
    (tmp_path / "s.json").write_text("{}")
    done = subprocess.run([*SHORT, "--to", "udp", *words], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and reason in (said := in_one_line(done.stderr)), said


@pytest.mark.parametrize(
    "page",
    ["[" * 4000, "[]", "3", '{"tau_s": 1}', '{"tau_s": 1e999, "sent_tau_s": 0, "motion": [], "rests_at": null}',
     '{"tau_s": true, "sent_tau_s": 0, "motion": [], "rests_at": null}', '{"tau_s": "' + "9" * 4000],
)  # fmt: skip
def test_what_is_no_state_is_one_line(tmp_path: File, page: str) -> None:
    (tmp_path / "s.json").write_text(page)
    command = [*SHORT, "--to", "udp", "--resume", "--state", "s.json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "s.json: is not the state of a stream" in in_one_line(done.stderr)


def test_an_interrupt_while_kernels_compile_ends_at_once(tmp_path: File) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [*SHORT, "--to", "file", "-o", str(tmp_path / "rows.txt")]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        deadline = time.monotonic() + 60
        while not any(tmp_path.rglob("*.nbc")) and time.monotonic() < deadline:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=20)[1]
    assert process.returncode == 130, said
    assert said.splitlines()[-1] == "splinefeed: interrupted before anything moved"
    assert not (tmp_path / "rows.txt").exists()


def test_a_full_disk_is_told() -> None:
    with open("/dev/full", "w") as full:
        piped = subprocess.run([*SHORT, "--to", "stdout"], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
    assert piped.returncode == 2
    assert "no space is left on the disk" in piped.stderr and "Traceback" not in piped.stderr


@pytest.mark.slow
def test_a_file_that_may_not_grow_is_told_and_leaves_no_half_file(tmp_path: File) -> None:
    words = " ".join(f"'{word}'" for word in [*SHORT, "--to", "file", "-o", str(tmp_path / "rows.txt")])
    # 16 blocks of 512 or 1024 bytes: less than the rows, and more than what is written before them
    filed = subprocess.run(["sh", "-c", f"ulimit -f 16; exec {words}"], stderr=subprocess.PIPE, text=True, timeout=60)
    assert filed.returncode == 2, filed.stderr
    assert "cannot be written" in filed.stderr and "Traceback" not in filed.stderr
    assert os.listdir(tmp_path) == []


def test_keys_hold_go_back_go_on_and_stop() -> None:
    master, slave = pty.openpty()
    try:
        with started(stdin=slave) as (process, there):
            os.write(master, b"h")
            there.rest()
            held = there.rows[-1]
            os.write(master, b"b ")  # still held
            os.write(master, b"r")
            there.wait(len(there.rows) + 500)
            assert there.rows[-1] != held
            os.write(master, b"b")
            there.wait(len(there.rows) + 900)
            os.write(master, b"+s")
            said = ended(process)
    finally:
        os.close(master)
        os.close(slave)
    assert process.returncode == 0, said
    rows = np.array(there.rows)
    assert_limits(rows, feed=12)
    k = int(np.flatnonzero(np.all(rows == held, axis=1))[0])
    there_and_back = np.linalg.norm(rows[k:] - rows[k], axis=1)
    top = int(np.argmax(there_and_back[: len(rows) - k]))
    assert np.max(np.abs(np.diff(there_and_back[:top]))) <= 0.012 * (1 + 1e-9)
    assert there_and_back[-1] < there_and_back[top] - 0.5  # it was going back when it was stopped
