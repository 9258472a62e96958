"""Where splinefeed runs: without a network, without HOME, from a package that nobody can write to, under any name."""

from __future__ import annotations

import json
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import splinefeed as sf
import surroundings
from docs_pages import ROOT

PACKAGE = Path(sf.__file__).parent
ENVIRONMENT = {**os.environ, "PYTHONWARNINGS": "error"}

#: Ends the program at the first thing that could reach another machine.
WITHOUT_NETWORK = """
import sys
def watch(event, arguments):
    if event in ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname", "socket.sendto", "socket.bind"):
        raise SystemExit(f"{event} {arguments[1:]}")
sys.addaudithook(watch)
from splinefeed.cli.main import main
main()
"""


def call(*words, environment=None, **options):
    return subprocess.run(
        [sys.executable, *words], env=environment or ENVIRONMENT, capture_output=True, text=True, timeout=250, **options
    )


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_nothing_of_the_caller_decides_how_a_test_ends():
    caller = {
        "HOME": "/h",
        "PYTHONUNBUFFERED": "1",
        "PYTHONPATH": "/x",
        "CI": "true",
        "MPLBACKEND": "Qt5Agg",
        "TMPDIR": "/t",
    }
    told = surroundings.stated(caller)
    assert set(told) == {"HOME", "LANG", "PATH", "PYTHONPATH", "TMPDIR", "XDG_CACHE_HOME"}
    assert told["PYTHONPATH"] == str(PACKAGE.parent)
    assert told["XDG_CACHE_HOME"] == str(Path("/h/.cache"))
    seen = json.loads(call("-c", "import json, os; print(json.dumps(dict(os.environ)))").stdout)
    assert set(seen) - {"LC_CTYPE"} <= {*surroundings.stated(dict(os.environ)), "PYTHONWARNINGS"}


def test_a_run_opens_no_connection(folder):
    words = ("run", "line", "--feed", "60", "--accel", "500", "--jerk", "20000", "--json", "-o", "out")
    result = call("-c", WITHOUT_NETWORK, *words)
    assert result.returncode == 0, result.stderr
    page = json.loads(result.stdout)
    assert page["ok"] and Path("out/setpoints.h5").exists()


def test_the_watch_above_sees_a_connection(folder):
    program = WITHOUT_NETWORK.partition("from splinefeed")[0] + "import socket; socket.create_connection(('::1', 9))"
    assert "socket." in call("-c", program).stderr


def homeless(folder: Path) -> dict[str, str]:
    """An environment whose HOME can hold nothing, and whose temporary folder is `folder`."""
    kept = {name: value for name, value in ENVIRONMENT.items() if not re.match(r"(XDG_|NUMBA_|HOME$|USER)", name)}
    return {**kept, "HOME": os.devnull, "XDG_CACHE_HOME": os.devnull, "TMPDIR": str(folder)}


def test_without_a_home_kernels_go_to_a_folder_of_this_process(folder):
    before = sorted(PACKAGE.rglob("*.nb*"))
    program = (
        "from splinefeed.kernels import jit\n"
        "@jit.kernel\n"
        "def twice(x):\n"
        "    return 2.0 * x\n"
        "assert twice(21.0) == 42.0\n"
        "print(jit.cache_directory())\n"
    )
    (folder / "one.py").write_text(program)
    result = call("one.py", environment=homeless(folder))
    assert result.returncode == 0, result.stderr
    assert Path(result.stdout.strip()).is_relative_to(folder) and not list(folder.glob("splinefeed-*"))
    assert sorted(PACKAGE.rglob("*.nb*")) == before  # nothing beside the package, where it may be read-only


@pytest.mark.skipif(os.name != "posix", reason="permissions as POSIX has them")
def test_compiled_kernels_that_others_can_write_are_never_run(folder):
    program = (
        "import os, sys\n"
        "from splinefeed.kernels import jit\n"
        "@jit.kernel\n"
        "def twice(x):\n"
        "    return 2.0 * x\n"
        "assert twice(21.0) == 42.0\n"
        "print(jit.cache_directory(), len(jit.compiled_here))\n"
    )
    (folder / "one.py").write_text(program)
    cache = folder / "cache"
    environment = {**homeless(folder), "NUMBA_CACHE_DIR": str(cache)}

    def used() -> tuple[Path, int]:
        result = call("one.py", environment=environment)
        assert result.returncode == 0, result.stderr
        where, compiled = result.stdout.split()
        return Path(where), int(compiled)

    own = cache / "splinefeed" / "kernels"
    assert used() == (own, 1) and used() == (own, 0)
    assert stat.S_IMODE(own.stat().st_mode) == 0o700
    files = list(own.glob("*.nbc"))
    assert files and all(stat.S_IMODE(each.stat().st_mode) == 0o600 for each in files)
    files[0].chmod(0o666)  # somebody may have put other code there
    assert used() == (own, 1)
    own.chmod(0o777)  # what is in it is still ours alone, and it is closed
    assert used() == (own, 0) and stat.S_IMODE(own.stat().st_mode) == 0o755
    cache.chmod(0o777)  # others could put a folder of theirs in the place of ours
    assert used()[0] != own
    cache.chmod(0o700)
    if os.geteuid() == 0:  # only then can files be given to another user
        os.chown(files[0], 65534, 65534)
        assert used() == (own, 1)
        os.chown(own, 65534, 65534)
        assert used()[0] != own


def test_without_a_home_the_command_works(folder):
    result = call("-m", "splinefeed", "version", "--verbose", "--json", environment=homeless(folder))
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["compiled_kernels"].startswith(str(folder))
    assert call("-m", "splinefeed", "methods", environment=homeless(folder)).returncode == 0


def test_python_m_splinefeed_is_the_command():
    assert call("-m", "splinefeed", "version").stdout == f"splinefeed {sf.__version__}\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_what_the_shell_reads(shell):
    text = call("-m", "splinefeed", "completion", shell).stdout
    assert "_SPLINEFEED_COMPLETE" in text and "splinefeed" in text
    page = json.loads(call("-m", "splinefeed", "completion", shell, "--json").stdout)
    assert (page["shell"], page["script"].strip()) == (shell, text.strip())


def test_completion_knows_commands_and_options():
    def completed(words: str, at: int) -> set[str]:
        asked = {**ENVIRONMENT, "_SPLINEFEED_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(at)}
        return {line.partition(",")[2] for line in call("-m", "splinefeed", environment=asked).stdout.splitlines()}

    assert completed("splinefeed me", 1) == {"methods"}
    assert {"--axis-accel", "--axis-jerk"} <= completed("splinefeed run --axis-", 2)


def test_version_tells_packages_settings_and_folders():
    environment = {**ENVIRONMENT, "NUMBA_NUM_THREADS": "1"}
    page = json.loads(call("-m", "splinefeed", "version", "--verbose", "--json", environment=environment).stdout)
    assert page["splinefeed"] == sf.__version__
    assert page["NUMBA_NUM_THREADS"] == "1"
    assert {"plotly", "pyarrow", "tornado", "distributed", "mpi4py"} <= set(page)
    assert Path(page["package"]) == PACKAGE


def test_the_citation_names_this_version_and_the_paper():
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {sf.__version__}\n" in text
    assert "\nlicense: MIT\n" in text and "Milne-Simpson" in text
