"""Machine files written and read again: the same machine, whatever its numbers and words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from splinefeed.errors import FormatError
from splinefeed.machine import Machine
from splinefeed.machine.quantities import KINDS, parse, write


@pytest.mark.parametrize("name", Machine.names())
def test_the_machines_of_the_package_come_back_equal(name: str, tmp_path: Path) -> None:
    machine = Machine.load(name)
    machine.save(tmp_path / f"{name}.toml")
    assert Machine.load(tmp_path / f"{name}.toml") == machine
    text = (tmp_path / f"{name}.toml").read_text()
    assert '"25mm/s/V"' in text or name != "xytheta"
    assert '"5mm/rev"' in text or name != "xytheta"
    assert '"10ms"' in text or name != "xytheta"
    assert 'kp = "22.3833V/mm"' in text or name != "xytheta"


@settings(max_examples=200)
@given(
    value=st.floats(min_value=1e-12, max_value=1e12) | st.floats(min_value=-1e6, max_value=-1e-6),
    kind=st.sampled_from(sorted(KINDS)),
    rotary=st.booleans(),
)
def test_a_quantity_is_written_exactly(value: float, kind: str, rotary: bool) -> None:
    assert parse(write(value, kind, rotary), kind, rotary) == value
    assert parse(write(0.0, kind, rotary), kind, rotary) == 0.0


def test_quantities_read_well() -> None:
    assert write(0.01, "time", False) == "10ms"
    assert write(2.0 * np.pi * 60.0, "frequency", False) == "60Hz"
    assert write(np.pi, "position", True) == "180deg"
    assert write(1e-3, "position", False) == "1um"
    assert write(30.0, "position loop gain", False) == "30/s"


@given(st.text(st.characters(exclude_categories=["Cs"]), max_size=30))
def test_any_words_come_back(words: str) -> None:
    machine = Machine.load("router")
    axis = machine.axes["x"]
    changed = replace(
        machine,
        title=words,
        notes=(words, "second"),
        axes={"x": replace(axis, motor=replace(axis.motor, source=words))},
    )
    assert Machine.parse(changed.to_text(), "router") == changed


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    machine = Machine.load("xytheta")
    with pytest.raises(FormatError) as caught:
        machine.save(tmp_path / "machine.txt")
    assert str(caught.value) == f"{tmp_path / 'machine.txt'}: a machine file is named .toml"
    with pytest.raises(FormatError, match="does not exist"):
        machine.save(tmp_path / "nowhere" / "machine.toml")
    assert list(tmp_path.iterdir()) == []
