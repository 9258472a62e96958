"""The folder of a run: all files or none, and nothing of anybody else's."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import folder_kills
from splinefeed.errors import FormatError, InputError
from splinefeed.reports import folder as folders

RECORD = json.dumps({"program": "splinefeed 0.1.0", "files": ["setpoints.csv", "run.json", "../victim", "notes.txt"]})


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("NACA 0025", "splinefeed-naca-0025"),
        ("../../etc/passwd", "splinefeed-etc-passwd"),
        ("\x1b[31m", "splinefeed-31m"),
        ("", "splinefeed-path"),
        ("x" * 300, "splinefeed-" + "x" * folders.LONGEST_NAME),
    ],
)
def test_default_names(name, expected):
    assert folders.default_name(name) == expected


def test_files_appear_together(tmp_path):
    target = tmp_path / "out"
    with folders.staged(target) as stage:
        (stage / "setpoints.h5").write_text("points")
        (stage / "run.json").write_text(RECORD)
        assert [each.name for each in target.iterdir()] == [stage.name]
    assert sorted(each.name for each in target.iterdir()) == ["run.json", "setpoints.h5"]


def _broken_off(target, name, failure):
    with folders.staged(target) as stage:
        (stage / name).write_text("new")
        raise failure


@pytest.mark.parametrize("failure", [KeyboardInterrupt, RuntimeError, SystemExit])
def test_nothing_is_left_of_a_run_that_ended_early(tmp_path, failure):
    with pytest.raises(failure):
        _broken_off(tmp_path / "out", "setpoints.h5", failure)
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_run_stays_whole_until_the_new_one_is(tmp_path):
    (tmp_path / "run.json").write_text(RECORD)
    (tmp_path / "setpoints.csv").write_text("old")
    with pytest.raises(KeyboardInterrupt):
        _broken_off(tmp_path, "setpoints.csv", KeyboardInterrupt)
    assert (tmp_path / "setpoints.csv").read_text() == "old"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["run.json", "setpoints.csv"]


def test_files_of_an_earlier_run_that_this_one_does_not_have_are_taken_away_and_no_others(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    for name in ("setpoints.csv", "notes.txt", "path.svg"):
        (target / name).write_text("old")
    (target / "run.json").write_text(RECORD)
    (tmp_path / "victim").write_text("not ours")
    with folders.staged(target) as stage:
        (stage / "run.json").write_text("{}")
    assert sorted(each.name for each in target.iterdir()) == ["notes.txt", "path.svg", "run.json"]
    assert (tmp_path / "victim").exists()


@pytest.mark.parametrize("page", ["", "[]", "{}", '{"program": "other 1.0"}', "\0", '{"program": 1}'])
def test_a_page_that_is_not_ours_is_not_replaced(tmp_path, page):
    (tmp_path / "run.json").write_text(page)
    with pytest.raises(FormatError, match=r"run\.json: was not written by a run of splinefeed; choose another"):
        folders.staged(tmp_path).__enter__()
    assert (tmp_path / "run.json").read_text() == page


def test_a_folder_with_other_things_may_be_used(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with folders.staged(tmp_path) as stage:
        (stage / "run.json").write_text(RECORD)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_places_that_cannot_be_used(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("")
    Path("taken/path.svg").mkdir(parents=True)
    for name, line in {
        "file": "file: is a file; give the name of a folder",
        "no/where": "no/where: the folder no does not exist; make it first",
        "taken": "taken/path.svg: is a folder where a file must go; choose another folder with -o",
        "": "the name of the output folder is empty; leave -o out, or write -o . for the current folder",
    }.items():
        with pytest.raises(FormatError) as caught:
            folders.staged(name).__enter__()
        assert str(caught.value) == line
    with pytest.raises(FormatError, match="is not the name of a folder"):
        folders.staged("zero\0byte").__enter__()
    with pytest.raises(FormatError, match="the name is too long"):
        folders.staged("x" * 300).__enter__()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(FormatError, match="no permission to write in that folder; choose another one"):
        folders.staged(tmp_path / "out").__enter__()


def test_messages_name_the_folder_and_not_the_hidden_one(tmp_path):
    target = tmp_path / "out"
    with pytest.raises(InputError) as caught, folders.staged(target) as stage:
        raise InputError(f"{stage}/setpoints.mat: too many ticks")
    assert str(caught.value) == f"{target}/setpoints.mat: too many ticks"


def test_what_a_killed_run_had_complete_is_put_in_place_and_what_it_had_not_goes(tmp_path):
    whole, half = tmp_path / ".splinefeed-1111", tmp_path / ".splinefeed-2222"
    for stage in (whole, half):
        stage.mkdir()
        (stage / "setpoints.h5").write_text(f"points of {stage.name}")
    (tmp_path / "law.h5").write_text("law of .splinefeed-1111")  # put in place when the run was killed
    (whole / "run.json").write_text(RECORD)
    with pytest.raises(KeyboardInterrupt), folders.staged(tmp_path):
        raise KeyboardInterrupt
    assert sorted(each.name for each in tmp_path.iterdir()) == ["law.h5", "run.json", "setpoints.h5"]
    assert (tmp_path / "setpoints.h5").read_text() == "points of .splinefeed-1111"


def test_a_run_at_work_in_the_same_folder_is_left_alone(tmp_path):
    with folders.staged(tmp_path) as first:
        (first / "run.json").write_text(RECORD)
        with folders.staged(tmp_path) as second:
            assert first.is_dir() and second.is_dir()
            (second / "run.json").write_text(RECORD)
        assert first.is_dir() and not second.exists()
    assert [each.name for each in tmp_path.iterdir()] == ["run.json"]


@pytest.mark.skipif(os.name != "posix", reason="kills as POSIX has them")
def test_runs_that_are_killed_at_any_moment_leave_files_of_one_run_or_a_report_that_says_so(tmp_path):
    """Five kills here, many more by `make torture`: each moment is one of the things that a run does to files."""
    assert folder_kills.kills(tmp_path, seed=3, count=5) == 5


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="kills as POSIX has them")
def test_five_hundred_kills(tmp_path):
    assert folder_kills.kills(tmp_path, seed=40, count=500) == 500
