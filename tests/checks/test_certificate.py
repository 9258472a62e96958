"""A certificate's hashes change with the last bit of what was checked, and with nothing else."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

import splinefeed as sf
from splinefeed.checks import certificate as module
from splinefeed.checks.certificate import certificate, write_certificate
from splinefeed.records import LimitResult, Verdict

PATH = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, 1]], [1.0, 0.5, 1.0])])
LIMITS = sf.Limits(feed=10.0, acceleration=100.0)
LAW = sf.TimeLaw(breaks=[0.0, 1.0], coefficients=[[0, PATH.length, 0, 0, 0, 0]], strategy="test")
POINTS = sf.interpolate(PATH, LAW, period=0.125)
VERDICT = Verdict(
    limits={"feed": LimitResult(limit=10.0, worst=np.inf, at_s=0.0, at_t=0.0)}, problems=("one",), numbers={"ticks": 9}
)


def hashes(setpoints=POINTS, path=PATH, limits=LIMITS, law=LAW) -> dict[str, str]:
    return certificate(setpoints, path, limits, VERDICT, law)["sha256"]


def test_each_hash_follows_its_own_input():
    base = hashes()
    position = POINTS.position.copy()
    position[3, 1] = np.nextafter(position[3, 1], np.inf)
    moved = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, np.nextafter(1.0, 2.0)]], [1.0, 0.5, 1.0])])
    coefficients = LAW.coefficients.copy()
    coefficients[0, 5] = 5e-324
    changed = {
        "setpoints": hashes(setpoints=replace(POINTS, position=position)),
        "path": hashes(path=moved),
        "limits": hashes(limits=sf.Limits(feed=10.0, acceleration=np.nextafter(100.0, 200.0))),
        "law": hashes(law=replace(LAW, coefficients=coefficients)),
    }
    for name, found in changed.items():
        assert {key for key in base if found[key] != base[key]} == {name}
    assert base["law"] == hashlib.sha256(LAW.breaks.tobytes() + LAW.coefficients.tobytes()).hexdigest()


def test_the_file_is_json_without_infinity_and_names_the_versions(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PARTS", ("numpy", "no-such-package"))
    write_certificate(certificate(POINTS, PATH, LIMITS, VERDICT, LAW), tmp_path / "c.json")
    page = json.loads((tmp_path / "c.json").read_text(), parse_constant=pytest.fail)
    assert page["verdict"]["limits"]["feed"]["worst"] is None
    assert (page["verdict"]["ok"], page["verdict"]["problems"], page["verdict"]["ticks"]) == (False, ["one"], 9)
    assert page["limits"] == LIMITS.as_dict()
    assert page["versions"]["splinefeed"] == sf.__version__
    assert page["versions"]["numpy"] == np.__version__
    assert page["versions"]["no-such-package"] is None
