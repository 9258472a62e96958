"""The helper of the first run: it compiles on its own, is waited for, and never outlives the run."""

from __future__ import annotations

import subprocess

import numba
import pytest

from splinefeed.cli import warm
from splinefeed.kernels.jit import cache_directory


def test_it_measures_checks_and_follows():
    warm.main(machine=True)


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="there is nothing to compile")
def test_it_runs_where_a_command_never_ran_and_ends_with_the_run(monkeypatch):
    started = []
    real = subprocess.Popen

    def popen(words, **options):
        started.append(real(words, **options))
        return started[-1]

    monkeypatch.setattr(subprocess, "Popen", popen)
    with warm.helper("a command that never ran", True) as wait:
        wait()
        assert started[0].returncode == 0
    with warm.helper("another one", False):
        pass
    assert started[1].returncode is not None
    marker = cache_directory() / "a third one.ready"
    marker.touch()
    try:
        with warm.helper("a third one", False) as wait:
            wait()
    finally:
        marker.unlink()
    assert len(started) == 2
