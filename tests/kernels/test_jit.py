"""The cache of compiled kernels: a changed line compiles that kernel and its callers, and nothing else."""

from __future__ import annotations

import importlib
import os
import pkgutil
import subprocess
import sys
import types
from functools import partial

import numpy as np
import pytest

from splinefeed import interpolation, kernels
from splinefeed.kernels import jit

LEAVES = """
from splinefeed.kernels.jit import kernel

FACTOR = 2.0
ELSE = 5.0


@kernel
def leaf(x):
    return x + 1.0


@kernel
def scaled(x):
    return FACTOR * x


@kernel
def alone(x):
    return x - ELSE
"""
CALLERS = """
import types

from leaves import alone, leaf, scaled
from splinefeed.kernels.jit import kernel

HOW_MANY = 3


def _sum(x):
    total = 0.0
    for _ in range(HOW_MANY):
        total += leaf(x)
    return total


middle = kernel(_sum)


@kernel
def top(x):
    return middle(x) + scaled(x)


def copied(count):
    made = types.FunctionType(_sum.__code__, {**globals(), "HOW_MANY": count}, "copy")
    return kernel(made)
"""
MAIN = """
import sys
from splinefeed.kernels import jit
import callers
assert "numba" not in sys.modules
print(callers.top(1.0), callers.alone(1.0), callers.copied(1)(1.0), callers.copied(2)(1.0))
print(*sorted(name.partition(".")[2] for name in jit.compiled_here))
"""
ALL = "_sum _sum _sum alone leaf scaled top"


@pytest.fixture
def house(tmp_path):
    """A house of kernels, and how to run it in a new process: what it printed and which kernels it compiled."""
    folder = tmp_path / "house"
    folder.mkdir()
    for name, text in {"leaves": LEAVES, "callers": CALLERS, "main": MAIN}.items():
        (folder / f"{name}.py").write_text(text)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    environment |= {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}

    def start(where=folder, arguments=()):
        return subprocess.Popen(
            [sys.executable, "main.py", *arguments], cwd=where, env=environment, stdout=subprocess.PIPE, text=True
        )

    def run(where=folder, arguments=()):
        out, _ = start(where, arguments).communicate(timeout=200)
        return out.splitlines()

    def edit(name, old, new):
        file = folder / f"{name}.py"
        text = file.read_text()
        assert text.count(old) == 1
        file.write_text(text.replace(old, new))

    run.start, run.edit, run.folder = start, edit, folder
    return run


def test_only_what_a_change_concerns_is_compiled(house):
    assert house() == ["8.0 -4.0 2.0 4.0", ALL]
    assert house() == ["8.0 -4.0 2.0 4.0", ""]

    house.edit("leaves", "return FACTOR * x", "return FACTOR * x * 1.5")  # a line
    assert house() == ["9.0 -4.0 2.0 4.0", "scaled top"]
    house.edit("leaves", "ELSE = 5.0", "ELSE = 6.0")  # a constant
    assert house() == ["9.0 -5.0 2.0 4.0", "alone"]
    house.edit("leaves", "x + 1.0", "x + 2.0")  # a leaf in another file than its callers, and than copies of them
    assert house() == ["12.0 -5.0 3.0 6.0", "_sum _sum _sum leaf top"]
    house.edit("leaves", "x + 2.0", "x + 1.0")  # and back: it is still there
    assert house() == ["9.0 -5.0 2.0 4.0", ""]


def test_age_place_and_comments_compile_nothing(house, tmp_path):
    house()
    house.edit("leaves", "FACTOR = 2.0", "# a remark, and every line below moves\n\nFACTOR = 2.0")
    os.utime(house.folder / "callers.py", (1, 1))
    assert house()[1] == ""
    house.folder.rename(tmp_path / "elsewhere")
    assert house(tmp_path / "elsewhere")[1] == ""


def test_processes_at_once_share_what_they_compile(house):
    together = [house.start() for _ in range(2)]
    assert {process.communicate(timeout=200)[0].splitlines()[0] for process in together} == {"8.0 -4.0 2.0 4.0"}
    assert house()[1] == ""


def test_a_broken_file_is_compiled_again(house, tmp_path):
    house()
    for file in (tmp_path / "cache").rglob("top-*.nbc"):
        file.write_bytes(file.read_bytes()[:100])
    assert house() == ["8.0 -4.0 2.0 4.0", "top"]
    assert house()[1] == ""


def test_every_kernel_names_only_what_its_digest_can_tell():
    modules = [
        importlib.import_module(f"{room.__name__}.{each.name}")
        for room in (kernels, interpolation)
        for each in pkgutil.iter_modules(room.__path__)
    ]
    found = [value for module in modules for value in vars(module).values() if isinstance(value, jit.Kernel)]
    assert len({each.digest for each in found}) == len(set(map(id, found))) > 10
    named = {value.__name__ for each in found for _, value in each._named if isinstance(value, types.ModuleType)}
    assert named <= {"math", "numpy"}  # what a module holds is not in the digest


#: A process that does `sys.argv[1]` ticks, so many at a time as the next one says, by a leaf that is worth 1000.
LONG = """
import sys
import numpy as np
from functools import partial
from splinefeed.kernels.jit import Leaf, compiled_here

@partial(Leaf, worth=1000)
def add(count, state):
    for _ in range(count):
        state[0] += 1.0

state = np.zeros(1)
plain = 0
total, at_once = map(int, sys.argv[1:])
for _ in range(total // at_once):
    function = add.for_work(at_once)
    plain += function == add.plainly
    function(at_once, state)
print(int(state[0]), plain, "numba" in sys.modules, len(compiled_here))
"""


def test_only_work_that_is_worth_it_is_compiled_and_what_is_compiled_is_loaded_sooner(house):
    (house.folder / "main.py").write_text(LONG)

    def told(*numbers):
        (line,) = house(arguments=map(str, numbers))
        return line

    assert told(1000, 1000) == "1000 1 False 0"  # short: Numba is not even imported
    assert told(600, 60) == "600 10 False 0"
    assert told(1001, 1001) == "1001 0 True 1"  # long: compiled at once
    assert told(100, 100) == "100 1 False 0"
    assert told(101, 101) == "101 0 True 0"  # to load it costs a tenth


def test_work_of_unknown_length_is_compiled_when_it_has_cost_as_much(house):
    (house.folder / "main.py").write_text(LONG)
    assert house(arguments=["3000", "300"]) == ["3000 3 True 1"]


@partial(jit.Leaf, worth=10, rows=("table",), lists=("factors",))
def _divided(table, factors, out, by):
    for i in range(len(out)):
        row = table[i]
        out[i] += row[0] * factors[1] / by


@pytest.mark.parametrize("by", [3.0, 0.0, -0.0])
def test_a_division_by_zero_gives_what_compiled_code_gives(by):
    table, factors = np.arange(6.0).reshape(3, 2) / 7.0, np.array([0.1, 0.3])
    plain, compiled = np.ones(3), np.ones(3)
    with np.errstate(all="ignore"):
        _divided.plainly(table, factors, plain, by)
        _divided(table, factors, compiled, by)
    assert plain.tobytes() == compiled.tobytes()
    assert np.isfinite(plain).all() == (by != 0.0)


#: A process in which Numba is not installed.
WITHOUT = """
import importlib.metadata, sys
from functools import partial
import numpy as np

def version(name, real=importlib.metadata.version):
    if name == "numba":
        raise importlib.metadata.PackageNotFoundError(name)
    return real(name)

importlib.metadata.version, sys.modules["numba"] = version, None
from splinefeed.kernels.jit import Leaf, compiled_here, kernel, wanted_numba

@kernel
def third(x):
    return x / 3.0

@partial(Leaf, worth=10)
def add(count, state):
    for _ in range(count):
        state[0] += third(state[0])

state = np.ones(1)
add.for_work(9)(9, state)
few = list(wanted_numba)
add.for_work(9)(9, state)
print(float(state[0]).hex(), few, wanted_numba, compiled_here)
"""


def test_without_numba_everything_runs_as_plain_python_and_what_was_long_is_told(house):
    (house.folder / "main.py").write_text(WITHOUT)
    (line,) = house()
    state = 1.0
    for _ in range(18):
        state += state / 3.0
    assert line == f"{state.hex()} [] ['__main__.add'] []"
