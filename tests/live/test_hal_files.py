"""The HAL file: every axis of a machine in it once, and what cannot be is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from splinefeed.cli.main import command_line
from splinefeed.errors import InputError
from splinefeed.live.hal_files import HalAxis, hal_text


def test_init_writes_a_hal_file_and_an_ini_fragment_of_the_axes_that_are_asked_for(tmp_path: Path) -> None:
    result = CliRunner().invoke(
        command_line, ["linuxcnc", "init", "--machine", "xytheta", "--axes", "x,y", "-o", str(tmp_path / "mill")]
    )
    assert result.exit_code == 0, result.output
    text = (tmp_path / "mill.hal").read_text()
    assert "loadrt streamer depth=4000 cfg=uffb" in text
    assert "setp limit-x.max 200" in text
    assert "theta" not in text
    assert "MAX_VELOCITY = 200" in (tmp_path / "mill.ini").read_text()


def test_beside_the_motion_controller_its_file_has_the_thread_and_the_joints(tmp_path: Path) -> None:
    words = ["linuxcnc", "init", "--machine", "trunnion", "--motion", "-o", str(tmp_path / "mill"), "--period", "2ms"]
    result = CliRunner().invoke(command_line, words)
    assert result.exit_code == 0, result.output
    text = (tmp_path / "mill.hal").read_text()
    assert "loadrt threads" not in text
    assert all(line.endswith(" servo-thread") for line in text.splitlines() if line.startswith("addf "))
    assert "net spf-position-4 joint.4.motor-pos-fb" in text
    assert "HALFILE = " in result.output
    assert "SERVO_PERIOD = 2000000" in (tmp_path / "mill.ini").read_text()


def test_an_axis_that_the_machine_lacks_is_told(tmp_path: Path) -> None:
    result = CliRunner().invoke(command_line, ["linuxcnc", "init", "--machine", "xytheta", "--axes", "x,w"])
    assert result.exit_code == 2
    assert "has no axis 'w'; it has x, y, theta" in result.output


def test_every_pin_is_connected_once() -> None:
    text = hal_text((HalAxis("x"), HalAxis("y"), HalAxis("z")), 1e-3)
    nets = [line.split()[1:] for line in text.splitlines() if line.startswith("net ")]
    pins = [pin for net in nets for pin in net[1:]]
    assert len(pins) == len(set(pins))


def test_more_axes_than_hal_has_fields_for_are_refused() -> None:
    with pytest.raises(InputError, match="enough for 9"):
        hal_text(tuple(HalAxis(name) for name in "abcdefghij"), 1e-3)
