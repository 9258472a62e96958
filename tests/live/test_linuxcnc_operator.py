"""An operator who never rests, over single moves that come one by one: every one arrives within the limits."""

from __future__ import annotations

import numpy as np
import pytest

from linuxcnc_machine import GCC, Machine


@pytest.mark.skipif(GCC is None, reason="no C compiler; on Debian: apt-get install gcc")
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_moves_one_by_one_under_overrides_that_change_all_the_time(seed: int):
    rng, machine = np.random.default_rng(seed), Machine()
    for k in range(1, 25):
        machine.line(6.0 * k, 4.0 * (k % 2), 0.0)
        for _ in range(400):
            machine.feed_scale = float(rng.choice([0.2, 0.5, 1.0, 1.5]))
            machine.pausing = bool(rng.random() < 0.1)
            machine.run(int(rng.integers(1, 60)))
            if int(machine.wire.seg_done) == int(machine.wire.seg_head) and not machine.moving:
                break
        assert machine.said == []
        np.testing.assert_allclose(machine.at[:3], [6.0 * k, 4.0 * (k % 2), 0.0], atol=1e-9)
    assert max(machine.differences()) <= 1.0 + 1e-6
