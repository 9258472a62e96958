"""The rate of an override along a straight line: differences of what is sent, and the closed form of the least time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from splinefeed.kernels import override as kernels

pytestmark = pytest.mark.nojit

PERIOD = 1e-3
#: A line at V, mm/s, on an axis of A, mm/s^2, and J, mm/s^3.
V, A, J = 60.0, 500.0, 2e4
WINDOWS = np.array([128, 256, 512, 1024], dtype=np.int64)


def run(
    wanted: float, rate: float, highest: float, *, way: float = 1.0, ticks: int = 300, begin: float = 1.0, used=(0, 0)
):
    """Ticks run towards a wanted rate from a steady one, and plan times before and at them, in direction `way`.

    used  shares of A and J that the law asks for itself
    """
    ahead = np.zeros((len(WINDOWS), 2000, 4, 1))
    ahead[:, :, 0], ahead[:, :, 1], ahead[:, :, 2] = V, used[0] * A, used[1] * J
    caps = np.full(ahead.shape[:2], highest)
    state = np.zeros(kernels.STATE)
    state[kernels.TAU], state[kernels.RATE], state[kernels.DIRECTION] = begin, rate, way
    taus, rates = np.empty(ticks), np.empty(ticks)
    count = kernels.run_rate(
        np.full(ticks, way * wanted), ahead, caps, np.array([[V * highest], [A], [J]]), int(begin / PERIOD), WINDOWS,
        PERIOD, 1.0, 100.0, state, taus, rates,
    )  # fmt: skip
    before = begin - way * rate * PERIOD * np.arange(3, -1, -1)
    return count, np.append(before, taus[:count]), np.append(rate, way * rates[:count])


def least_time(change: float) -> float:
    """Of a change of the rate under |r'| <= A / V and |r''| <= J / V, s."""
    slope, bend = A / V, J / V
    return change / slope + slope / bend if change * bend > slope * slope else 2.0 * math.sqrt(change / bend)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize(
    ("rate", "wanted", "highest"),
    [(1, 0, 1), (0, 1, 1), (1, 0.5, 1), (0.2, 0.25, 1), (2, 0, 2), (0, 2, 2), (1.5, 1.8, 2), (1.9, 1.4, 2)],
)
def test_every_change_of_the_rate_takes_its_least_time_within_the_limits(
    rate: float, wanted: float, highest: float, way: float
):
    count, tau, rates = run(wanted, rate, highest, way=way)
    assert count == 300
    x = V * tau
    assert np.max(np.abs(np.diff(x, 2))) / PERIOD**2 <= A * (1 + 1e-6)
    assert np.max(np.abs(np.diff(x, 3))) / PERIOD**3 <= J * (1 + 1e-4)  # 60 mm are told to 7e-15: 3e-5 of J
    assert np.all(np.diff(x) * way >= 0.0)
    # steady where it was wanted, and not before and not later than the closed form says, in whole ticks
    reached = int(np.argmax(rates == wanted))
    assert np.all(rates[reached:] == wanted)
    assert least_time(abs(rate - wanted)) - 1e-9 <= reached * PERIOD <= least_time(abs(rate - wanted)) + 2 * PERIOD
    # trapezoids under the rate are exact here: what each leaves out, T^2 / 12 of a change of slope, sums up to none
    assert way * (tau[-1] - 1.0) == pytest.approx(PERIOD * (np.sum(rates) - 0.5 * (rates[0] + rates[-1])), rel=1e-12)


@pytest.mark.parametrize(("used", "faster"), [((0.4, 0.3), 0.8), ((0.8, 0.6), 0.45), ((0.8, 0.0), 0.45)])
def test_from_rest_it_gains_by_what_the_law_asks_less_for_at_low_rates(used: tuple[float, float], faster: float):
    """A law's share of A goes with r^2: from rest the rate may rise more steeply than at 1, and must to be quick."""
    second, third = used[0] * A, used[1] * J
    slope = min((A - second) / V, 0.5 * (J - third) / (3.0 * second))
    bend = (J - third - 3.0 * second * slope) / V
    count, _, rates = run(1.0, 0.0, 1.0, used=used)
    reached = int(np.argmax(rates == 1.0))
    assert count == 300
    assert 0 < reached * PERIOD < faster * (1.0 / slope + slope / bend)
    slowest = np.minimum(rates[1:], rates[:-1]) ** 2
    assert np.max(second * slowest + V * np.abs(np.diff(rates)) / PERIOD) <= A
    bends = np.abs(np.diff(rates, 2)) / PERIOD**2
    assert np.max(third * np.minimum(slowest[1:], slowest[:-1]) + V * bends) <= J * (1 + 1e-9)


def test_backwards_it_stands_at_the_start_and_forwards_it_ends_at_the_end():
    count, tau, rates = run(1.0, 0.0, 1.0, way=-1.0, begin=0.1)
    assert count == 300
    assert np.all(tau[4:] >= 0.0)
    assert tau[-1] == rates[-1] == 0.0
    state = np.zeros(kernels.STATE)
    state[kernels.TAU], state[kernels.RATE], state[kernels.DIRECTION] = 0.05, 1.0, 1.0
    taus, rates = np.empty(300), np.empty(300)
    ahead = np.zeros((1, 400, 4, 1))
    given = (np.ones((1, 400)), np.array([[V], [A], [J]]), 0, WINDOWS[:1], PERIOD, 1.0, 0.2)
    count = kernels.run_rate(np.ones(300), ahead, *given, state, taus, rates)
    assert taus[count - 1] == 0.2
    assert count == 150


@pytest.mark.parametrize(("still", "count"), [(0.0, 0), (1.0, 1), (2.0, 0)])
def test_a_turn_is_given_back_at_rest_but_not_after_one_tick_of_it(still: float, count: int):
    """The same setpoint twice could be a mistake, three times is a rest."""
    ahead = np.zeros((1, 2000, 4, 1))
    ahead[:, :, 0] = V
    state = np.zeros(kernels.STATE)
    state[kernels.TAU], state[kernels.DIRECTION], state[kernels.STILL] = 1.0, 1.0, still
    taus, rates = np.empty(300), np.empty(300)
    given = (np.ones((1, 2000)), np.array([[V], [A], [J]]), 1000, WINDOWS[:1], PERIOD, 1.0, 100.0)
    assert kernels.run_rate(np.full(300, -1.0), ahead, *given, state, taus, rates) == count
    assert np.all(taus[:count] == 1.0)
    # in motion it is slowed down to rest first
    state[kernels.RATE], state[kernels.STILL] = 0.1, 0.0
    ran = kernels.run_rate(np.full(300, -1.0), ahead, *given, state, taus, rates)
    assert least_time(0.1) <= ran * PERIOD <= least_time(0.1) + 3 * PERIOD
    assert rates[ran - 1] == 0.0
    assert np.all(np.diff(taus[:ran]) > 0.0)


@pytest.mark.parametrize("left", [0.0, 0.05, 0.127, 0.2, 0.255, 0.511, 1.023])
def test_a_rate_above_the_base_is_one_whose_way_back_fits(left: float):
    """On the way back from r to 1 in the least time t at least (r + 1) t / 2 of plan time goes by."""
    ahead = np.zeros((1, 1, 4, 1))
    ahead[:, :, 0] = V
    limit = np.array([[V * 2.0], [A], [J]])
    out = np.empty((1, 1))
    kernels.cap_rates(ahead, 1.0, 2.0, np.array([left]), limit, PERIOD, out)
    cap, step = out[0, 0], 0.5**kernels.HALVINGS
    assert (cap - 1.0) / step == round((cap - 1.0) / step)
    if cap > 1.0:
        assert 0.5 * (cap + 1.0) * least_time(cap - 1.0) <= left
    if cap < 2.0:  # the next one would not fit, or hardly
        beyond = cap + step
        assert beyond * (1.6 * least_time(beyond - 1.0) + 6 * PERIOD) > left


def test_no_rate_above_the_base_where_an_axis_is_at_its_limits():
    limit = np.array([[V * 2.0], [A], [J]])
    out = np.empty((1, 4))
    # as fast as it may be; all of the acceleration, all of the jerk in use at rate 1; nothing in use
    ahead = np.array([[2 * V, 0, 0, 0], [V, A, 0, 0], [V, 0, J, 0], [1e-3, 0, 0, 0]])[None, :, :, None]
    kernels.cap_rates(ahead, 1.0, 2.0, np.array([1.0]), limit, PERIOD, out)
    assert out[0].tolist() == [1.0, 1.0, 1.0, 2.0]


def test_a_rate_that_rises_from_below_the_base_has_no_way_down():
    """Met by a stream without a compiler: the square under the root is below 0 there, which plain Python refuses."""
    ahead = np.array([[30.3405, 53.56, 1.756186], [139.8116, 35.40177, 4.378646], [1784.533, 2257.761, 88.00428]])
    needs = np.vstack([ahead, np.zeros(3)]), np.outer([math.inf, A, J], np.ones(3)), PERIOD
    out = np.zeros(kernels.STATE)
    assert not kernels._way_out(0.96104, 8.06715, 8.17305, 1.32587, 1.10116, 0.1271, needs, out)
