"""The command as a process of its own: what only the system can show."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from splinefeed.cli.progress import COMPILING

ENVIRONMENT = {**os.environ, "PYTHONWARNINGS": "error"}
COMMAND = [sys.executable, "-m", "splinefeed"]


def run(*words, **options):
    return subprocess.run([*COMMAND, *words], env=ENVIRONMENT, capture_output=True, text=True, check=False, **options)


def test_json_is_alone_on_stdout(folder):
    result = run("run", "smooth.json", "--json", "-o", "out")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["ok"] is True
    assert all(COMPILING in line or line.startswith("splinefeed: ") for line in result.stderr.splitlines())
    assert "Warning" not in result.stderr


def test_errors_are_one_line_and_exit_codes_are_kept(folder):
    result = run("info", "nothing.json")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == "splinefeed: nothing.json: no such file; check the name and the folder\n"
    assert run("run", "smooth.json", "--method", "taylor-1", "--no-figures").returncode == 1


def test_help_imports_nothing_heavy():
    code = (
        "import sys\n"
        "from splinefeed.cli.main import command_line\n"
        "try:\n"
        "    command_line.main(['run', '--help'])\n"
        "finally:\n"
        "    print(sorted({'numpy', 'numba', 'matplotlib', 'rich', 'pint', 'h5py', 'scipy'} & set(sys.modules)))\n"
    )
    result = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, capture_output=True, text=True, check=True)
    assert result.stdout.splitlines()[-1] == "[]"


def test_no_plotting_library_is_imported_for_a_run_and_its_figures(folder):
    code = (
        "import sys\n"
        "from splinefeed.cli.main import command_line\n"
        "try:\n"
        "    command_line.main(['run', 'smooth.json', '--json'])\n"
        "finally:\n"
        "    sys.exit(bool({'matplotlib', 'plotly'} & set(sys.modules)))\n"
    )
    result = subprocess.run([sys.executable, "-c", code], env=ENVIRONMENT, capture_output=True, check=False)
    assert result.returncode == 0


@pytest.mark.skipif(os.name != "posix", reason="pipes and signals of POSIX")
@pytest.mark.parametrize("buffered", [True, False])
@pytest.mark.parametrize(
    "words",
    [
        ["--help"],
        ["--version"],
        ["run", "--help"],
        ["methods"],
        ["plan", "smooth.json", "--json"],
        ["run", "smooth.json", "--method", "taylor-1", "--no-figures", "--json"],  # a limit is exceeded
    ],
    ids=" ".join,
)
def test_a_reader_that_goes_away_is_no_error(folder, words, buffered):
    read, write = os.pipe()
    os.close(read)
    environment = {**ENVIRONMENT, **({} if buffered else {"PYTHONUNBUFFERED": "1"})}
    process = subprocess.run(
        [*COMMAND, *words], env=environment, stdout=write, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(write)
    assert all(line.startswith("splinefeed: ") for line in process.stderr.splitlines())  # progress, and no complaint
    assert process.returncode == 141


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_an_error_is_told_though_the_reader_went_away():
    read, write = os.pipe()
    os.close(read)
    process = subprocess.run(
        [*COMMAND, "info", "nothing.json"],
        env=ENVIRONMENT,
        stdout=write,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(write)
    assert process.returncode == 2
    assert process.stderr == "splinefeed: nothing.json: no such file; check the name and the folder\n"


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_nobody_reads_errors_either(folder):
    read, write = os.pipe()
    os.close(read)
    process = subprocess.run(
        [*COMMAND, "info", "nothing.json"], env=ENVIRONMENT, stdout=write, stderr=write, check=False
    )
    os.close(write)
    assert process.returncode == 2


@pytest.mark.skipif(os.name != "posix", reason="a shell of POSIX")
def test_without_stdout_nothing_is_printed(folder):
    shell = ["sh", "-c", '"$@" >&-', "sh"]
    process = subprocess.run(
        [*shell, *COMMAND, "methods"], env=ENVIRONMENT, stderr=subprocess.PIPE, text=True, check=False
    )
    assert (process.returncode, process.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
@pytest.mark.parametrize("words", [["methods"], ["--help"]])
def test_a_full_output_is_one_line(words):
    with open("/dev/full", "w") as full:
        result = subprocess.run(
            [*COMMAND, *words], env=ENVIRONMENT, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert result.returncode == 2
    assert result.stderr == "splinefeed: output: no space is left on the disk; free some or write elsewhere\n"


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_leaves_no_file(folder, number, code):
    # The signal is sent from inside, when the first file of the run has just been written.
    script = (
        "import os, time\n"
        "from splinefeed.reports import files\n"
        "from splinefeed.cli.main import main\n"
        "real = files.save\n"
        "def save(*words):\n"
        "    real(*words)\n"
        f"    os.kill(os.getpid(), {int(number)})\n"
        "    time.sleep(300)\n"
        "files.save = save\n"
        "import sys; sys.argv = ['splinefeed', 'run', 'smooth.json', '--no-compare']\n"
        "main()\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert result.returncode == code
    assert result.stdout == ""
    assert "Traceback" not in result.stderr
    assert [each.name for each in folder.iterdir()] == ["smooth.json"]


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_while_an_object_is_taken_away_ends_the_command(folder, number, code):
    script = (
        "import os, time\n"
        "from splinefeed.reports import files\n"
        "from splinefeed.cli.main import main\n"
        "class Gone:\n"
        "    def __del__(self):\n"
        f"        os.kill(os.getpid(), {int(number)})\n"
        "        time.sleep(0.01)\n"  # here Python calls the handler, and drops what it raises
        "def save(*words):\n"
        "    Gone()\n"
        "    time.sleep(300)\n"
        "files.save = save\n"
        "import sys; sys.argv = ['splinefeed', 'run', 'smooth.json']\n"
        "main()\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", script], env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=200
    )
    assert result.returncode == code
    assert "Traceback" not in result.stderr
    assert [each.name for each in folder.iterdir()] == ["smooth.json"]


def test_a_terminal_without_unicode(folder):
    curve = json.loads((folder / "smooth.json").read_text())
    (folder / "odd.json").write_text(json.dumps({**curve, "name": "Flügel 飛"}), encoding="utf-8")
    result = subprocess.run(
        [*COMMAND, "info", "odd.json"],
        env={**ENVIRONMENT, "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert "\nFl\\xfcgel \\u98db: open, " in result.stdout


@pytest.mark.skipif(sys.platform != "linux", reason="needs the pty module and its ways")
def test_progress_on_a_terminal_stays_on_stderr(folder):
    import pty

    leader, follower = pty.openpty()
    result = subprocess.run(
        [*COMMAND, "plan", "smooth.json", "--json"],
        env={**ENVIRONMENT, "TERM": "xterm"},
        stdout=subprocess.PIPE,
        stderr=follower,
        text=True,
        check=False,
    )
    os.close(follower)
    seen = b""
    try:
        while chunk := os.read(leader, 65536):
            seen += chunk
    except OSError:  # how Linux says that the other side is closed
        pass
    os.close(leader)
    assert result.returncode == 0
    assert json.loads(result.stdout)["ok"] is True
    assert seen


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_of_which_a_library_makes_another_error_is_one(number: int, code: int) -> None:
    """HDF5 does so while it writes, Python 3.11 while a class is made."""
    program = (
        "import os, sys\nfrom splinefeed.cli import main\n"
        "class Field:\n    def __set_name__(self, owner, name):\n"
        f"        try:\n            os.kill(os.getpid(), {int(number)})\n        except BaseException:\n"
        "            raise RuntimeError('write request failed') from None\n"
        "main.LazyGroup.invoke = lambda *_: type('Record', (), {'linear': Field()})\nmain.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", program, "info"], capture_output=True, text=True, check=False)
    assert done.returncode == code
    assert done.stderr == ("splinefeed: interrupted; no half-written file is left\n" if code == 130 else "")
