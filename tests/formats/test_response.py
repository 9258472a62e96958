"""Responses to HDF5 and back; setpoints in pieces from any format."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest

import motions
import splinefeed as sf
from splinefeed.errors import FormatError, InputError
from splinefeed.formats.setpoints import load_chunks
from splinefeed.runs.following import Servo, follow_chunks

COLUMNS = ("t", "command", "position", "measured", "output", "saturated", "contour_error")


@pytest.fixture(scope="module")
def points() -> sf.Setpoints:
    return sf.run(motions.smooth(), sf.Limits(feed=60, acceleration=500, jerk=20000)).points


@pytest.fixture(scope="module")
def response(points) -> sf.Response:
    return sf.runs.follow(points, sf.Machine.load("xytheta"), path=motions.smooth())


def test_a_response_comes_back_bit_for_bit(tmp_path, response):
    sf.save(response, tmp_path / "r.h5")
    back = sf.load(tmp_path / "r.h5")
    assert isinstance(back, sf.Response)
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(back, name), getattr(response, name))
        assert getattr(back, name).dtype == getattr(response, name).dtype
    assert (back.axes, back.period, back.stopped) == (response.axes, response.period, None)
    assert back.settings == response.settings
    with h5py.File(tmp_path / "r.h5") as file:
        assert list(file["command"].attrs["units"]) == [b"mm", b"mm"]
        assert file["output"].attrs["units"] == b"V"


def test_pieces_make_the_same_file(tmp_path, points, response):
    servo = Servo(sf.Machine.load("xytheta"), points, motions.smooth())
    pieces = follow_chunks((points.part(i, i + 300) for i in range(0, len(points), 300)), servo)
    sf.save(pieces, tmp_path / "r.h5")
    np.testing.assert_array_equal(sf.load(tmp_path / "r.h5").contour_error, response.contour_error)


def test_without_a_path_and_with_a_reason(tmp_path, response):
    bare = replace(response, contour_error=None, stopped="axis x ran away")
    sf.save(bare, tmp_path / "r.h5")
    back = sf.load(tmp_path / "r.h5")
    assert back.contour_error is None
    assert back.stopped == "axis x ran away"


def test_what_cannot_be_saved(tmp_path, response):
    with pytest.raises(FormatError, match=r"r\.csv: Response is saved as HDF5 only; name the file \.h5"):
        sf.save(response, tmp_path / "r.csv")
    with pytest.raises(InputError, match="has other columns than the first one"):
        sf.save([response, replace(response, contour_error=None)], tmp_path / "r.h5")
    with pytest.raises(FormatError, match="there are no ticks to save"):
        sf.save([], tmp_path / "r.h5")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["p.h5", "p.csv", "p.mat"])
def test_setpoints_in_pieces_are_the_setpoints(tmp_path, points, name):
    sf.save(points, tmp_path / name)
    pieces = list(load_chunks(tmp_path / name, 400))
    assert [len(each) for each in pieces[:-1]] == [400] * (len(pieces) - 1)
    for column in ("t", "curve", "u", "s", "feed", "position"):
        np.testing.assert_array_equal(
            np.concatenate([getattr(each, column) for each in pieces]), getattr(sf.load(tmp_path / name), column)
        )
    assert pieces[0].settings == sf.load(tmp_path / name).settings


def test_pieces_of_a_damaged_file_are_refused(tmp_path, points, response):
    sf.save(points, tmp_path / "p.h5")
    with h5py.File(tmp_path / "p.h5", "r+") as file:
        file["s"].resize(5, axis=0)
    with pytest.raises(FormatError, match=r"the datasets have different numbers of ticks: .*'s': 5"):
        list(load_chunks(tmp_path / "p.h5", 100))
    sf.save(response, tmp_path / "r.h5")
    with pytest.raises(FormatError, match="holds a record 'Response'; known are Setpoints"):
        next(load_chunks(tmp_path / "r.h5", 100))


def test_a_record_of_another_kind_is_refused(tmp_path, response):
    sf.save(response, tmp_path / "response.h5")
    assert isinstance(sf.load(tmp_path / "response.h5", sf.Response), sf.Response)
    with pytest.raises(sf.errors.FormatError, match=r"response\.h5: holds Response; expected Setpoints"):
        sf.load(tmp_path / "response.h5", sf.Setpoints)


def test_the_largest_contour_error(response):
    assert response.contour_error_max == response.contour_error.max()
    bare = replace(response, contour_error=None)
    with pytest.raises(sf.errors.InputError, match=r"give it: follow\(setpoints, machine, path=path\)"):
        _ = bare.contour_error_max


def test_columns_of_a_record_are_flat():
    path = sf.Path.polyline([[0.0, 0.0], [3.0, 4.0]])
    run = sf.run(path, sf.Limits(feed=10, axis_acceleration=500, axis_jerk=20000), machine="xytheta")
    table = run.points.as_columns()
    assert list(table) == ["t", "curve", "u", "s", "feed", "x", "y"]
    assert np.array_equal(table["y"], run.points.position[:, 1])
    served = run.served.response
    table = served.as_columns()
    assert list(table)[:4] == ["t", "contour_error", "command.x", "command.y"]
    assert np.array_equal(table["position.y"], served.position[:, 1])
    assert {len(values) for values in table.values()} == {len(served)}
