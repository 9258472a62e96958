"""Kernels of the look-ahead one by one: each against polynomials, quadrature and roots by NumPy and SciPy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.integrate import quad
from scipy.interpolate import BSpline
from scipy.optimize import brentq

import splinefeed as sf
from splinefeed.feed.look_ahead_window import limit_row
from splinefeed.kernels import look_ahead_law as laws
from splinefeed.kernels import look_ahead_profiles as profiles
from splinefeed.kernels import look_ahead_rows as rows
from splinefeed.kernels import look_ahead_samples as samples
from splinefeed.kernels.look_ahead_bounds import CAP, JUMPS
from splinefeed.kernels.look_ahead_cells import PLACES
from splinefeed.kernels.look_ahead_path import AT_CORNER, CENTRIPETAL, FEED, OF_AXES
from splinefeed.kernels.pieces import way_to_rest

pytestmark = pytest.mark.nojit


def joined(seed: int) -> tuple[Polynomial, float, np.ndarray]:
    """A quintic of `join` that goes forwards all the time, its duration, and its coefficients."""
    random = np.random.default_rng(seed)
    t, v0, v1 = random.uniform(0.2, 2.0), *random.uniform(2.0, 6.0, 2)
    a0, a1 = random.uniform(-1.0, 1.0, 2)
    law = np.empty(6)
    laws.join(0.5 * (v0 + v1) * t * 1.02, t, v0, a0, v1, a1, law)
    s = Polynomial(law)
    ends = [[s.deriv(k)(x) if k else s(x) for k in range(3)] for x in (0.0, t)]
    assert ends == [pytest.approx([0.0, v0, a0], abs=1e-13), pytest.approx([0.51 * (v0 + v1) * t, v1, a1], rel=1e-11)]
    assert np.min(s.deriv()(np.linspace(0.0, t, 101))) > 0.0
    return s, t, law


@pytest.mark.parametrize("seed", range(4))
def test_the_instant_of_a_place_is_the_root_of_its_quintic(seed: int):
    s, t, law = joined(seed)
    for share in (0.003, 0.2, 0.55, 0.98):
        for guess in (0.0, 0.5 * t, t):
            found = laws.instant(law, t, share * s(t), guess)
            wanted = brentq(s - share * s(t), 0.0, t, xtol=1e-15, rtol=1e-14)
            assert found == pytest.approx(wanted, abs=3e-13 * t)


def test_a_law_has_the_spline_s_feed_and_acceleration_at_nodes_and_lasts_the_integral_of_the_pace():
    nodes = np.array([0.5, 0.8, 1.2, 1.5, 2.1])
    c = np.array([90.0, 100.0, 115.0, 108.0, 120.0, 131.0])
    ends = np.array([0.04, 0.05])
    spans, law = np.empty(6), np.empty((6, 6))
    assert laws.lay_law(4, nodes, c, ends, spans, law)
    # the same quadratic spline by de Boor's rule: knots twice at the ends, one coefficient a cell
    q = BSpline(np.concatenate([nodes[:1], nodes[:1], nodes, nodes[-1:], nodes[-1:]]), c, 2)
    for i in range(4):
        s, t = Polynomial(law[i + 1]), spans[i + 1]
        assert s(0.0) == 0.0
        assert s(t) == pytest.approx(nodes[i + 1] - nodes[i], rel=1e-13)
        for x, at in ((0.0, nodes[i]), (t, nodes[i + 1])):
            assert s.deriv()(x) ** 2 == pytest.approx(float(q(at)), rel=1e-12)
            assert s.deriv(2)(x) == pytest.approx(0.5 * float(q.derivative()(min(at, 2.1 - 1e-12))), rel=1e-9)
        pace, _ = quad(lambda x: 1.0 / math.sqrt(q(x)), nodes[i], nodes[i + 1])
        assert t == pytest.approx(pace, rel=1e-8)
    # ramps of constant jerk: s = j t^3 / 6 from rest, and the same backwards
    for k, length, feed in ((0, 0.04, math.sqrt(90.0)), (5, 0.05, math.sqrt(131.0))):
        s, t = Polynomial(law[k]), spans[k]
        rest, moving = (0.0, t) if k == 0 else (t, 0.0)
        assert s(t) == pytest.approx(length, rel=1e-13)
        assert s.deriv()(moving) == pytest.approx(feed, rel=1e-13)
        assert [s.deriv()(rest), s.deriv(2)(rest)] == pytest.approx([0.0, 0.0], abs=1e-9)
        assert s.deriv(3)(0.5 * t) == pytest.approx(2.0 * feed / t**2, rel=1e-12)
    assert not laws.lay_law(4, nodes, np.array([-1.0, 100.0, 115.0, 108.0, 120.0, 131.0]), ends, spans, law)


def no_limit(axes: int) -> np.ndarray:
    limit = np.full(OF_AXES + 3 * axes, math.inf)
    limit[OF_AXES - 1] = 0.0
    return limit


def over(law: np.ndarray, span: float, d: np.ndarray, bend: np.ndarray, unsure: float, limit: np.ndarray) -> float:
    """`hold_law` of one piece as one interval."""
    length = Polynomial(law)(span)
    out = np.empty(1)
    worst = laws.hold_law(
        1, np.array([0.0, length]), np.zeros(1, dtype=np.int64), np.zeros(1), np.array([span]), law[None], d, bend,
        np.full((1, len(PLACES)), unsure), np.full(1, math.inf), np.full(1, math.inf), np.ones((1, 2)), limit, out,
    )  # fmt: skip
    assert worst == out[0]
    return worst


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_what_a_law_asks_of_an_axis_is_the_derivative_of_the_axis_by_time(seed: int, order: int):
    """x(s) a quartic and s(t) a quintic: x(s(t)) is a polynomial too, which NumPy derives."""
    s, t, law = joined(seed)
    x = Polynomial(np.random.default_rng(seed).normal(size=5))
    at = PLACES * s(t)
    d = np.array([x.deriv(k + 1)(at) for k in range(3)]).T[None, :, :, None]
    when = [brentq(s - place, 0.0, t, xtol=1e-15) for place in at[1:-1]]
    wanted = np.max(np.abs(x(s).deriv(order)(np.array([0.0, *when, t]))))
    limit = no_limit(1)
    limit[OF_AXES + order - 1] = 4.0 * wanted  # so little that no peak is looked for between places
    power = {1: 2.0, 2: 1.0, 3: 2.0 / 3.0}[order]
    found = over(law, t, d, np.zeros((1, len(PLACES))), 0.0, limit)
    assert found == pytest.approx(0.25**power, rel=1e-10)


@pytest.mark.parametrize("k", range(3))
@pytest.mark.parametrize("order", range(3))
def test_doubt_of_the_path_adds_its_power_of_the_distance_from_where_it_stands(order: int, k: int):
    """r', r'' and r''' go with the powers 1/2, 3/2 and 5/2: at a steady feed each is all that an order asks for."""
    if order != k:
        d = np.zeros((1, len(PLACES), 3, 1))
        d[:, :, k] = 1.0
        limit = no_limit(1)
        limit[OF_AXES + order] = 1.0
        law = np.array([0.0, 2.0, 0.0, 0.0, 0.0, 0.0])
        assert over(law, 0.1, d, np.zeros((1, len(PLACES))), 0.01, limit) == 0.0
        return
    d = np.zeros((1, len(PLACES), 3, 1))
    d[:, :, k] = 3.0
    limit = no_limit(1)
    limit[OF_AXES + k] = 1000.0
    law = np.array([0.0, 2.0, 0.0, 0.0, 0.0, 0.0])
    power = [2.0, 1.0, 2.0 / 3.0][k]
    wanted = (3.0 * 2.0 ** (k + 1) * (1.0 + (k + 0.5) * 0.01) / 1000.0) ** power
    assert over(law, 0.1, d, np.zeros((1, len(PLACES))), 0.01, limit) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("top", [0.3, 0.5, 0.62, 0.75])
def test_a_peak_between_places_is_found_with_twice_its_rise(top: float):
    """A use that is a parabola of the place: every three places give its top, 1, and the lowest of them rises most."""
    bend = 1.0 - (PLACES - top) ** 2
    law = np.array([0.0, 3.0, 0.0, 0.0, 0.0, 0.0])
    limit = no_limit(1)
    limit[CENTRIPETAL] = 9.0
    beside = [bend[j] for j in (1, 2, 3) if PLACES[j - 1] < top < PLACES[j + 1]]
    found = over(law, 0.7, np.zeros((1, len(PLACES), 3, 1)), bend[None], 0.0, limit)
    assert found == pytest.approx(2.0 - min(beside), rel=1e-12)


@pytest.mark.parametrize("v", [(1.0, -4.2, 4.2), (0.038, -0.4, 1.0)], ids=["in the middle", "early"])
def test_a_law_that_turns_back_is_over_without_any_limit(v: tuple[float, float, float]):
    """v(t) = v0 + v1 t + v2 t^2 falls below 0 on [0, 1]: in the middle of the way, or long before its second place."""
    still = np.zeros((1, len(PLACES), 3, 1))
    law = np.array([0.0, v[0], v[1] / 2.0, v[2] / 3.0, 0.0, 0.0])
    assert over(law, 1.0, still, np.zeros((1, len(PLACES))), 0.0, no_limit(1)) == math.inf
    law[2] *= 0.7  # so that it does not
    assert over(law, 1.0, still, np.zeros((1, len(PLACES))), 0.0, no_limit(1)) == 0.0


@pytest.mark.parametrize("feeds", [(2.0, 0.0), (0.5, 3.0)], ids=["alike", "unlike"])
def test_what_is_no_number_is_over(feeds: tuple[float, float]):
    d = np.zeros((1, len(PLACES), 3, 1))
    d[0, 3, 0] = math.nan
    limit = no_limit(1)
    limit[OF_AXES] = 1.0
    law = np.array([0.0, *feeds, 0.0, 0.0, 0.0])
    assert over(law, 1.0, d, np.zeros((1, len(PLACES))), 0.0, limit) == math.inf


def test_a_guess_from_rest_builds_up_a_quarter_of_the_jerk():
    """Beside a cell that nearly stands: x = J/4 t^3 / 6 and v = J/4 t^2 / 2, so v^3 = 9/8 x^2 J; then acceleration."""
    nodes = np.linspace(0.0, 0.4, 41)
    n = len(nodes) - 1
    d = np.zeros((n, len(PLACES), 3, 1))
    d[:, :, 0] = 1.0
    limit = no_limit(1)
    limit[FEED], limit[OF_AXES + 1], limit[OF_AXES + 2] = 1e3, 1e9, 4e4
    node_top = np.full(n + 1, 1e6)
    node_top[0] = 1e-12
    c = np.zeros(n + 2)
    rows.guess(n, nodes, d, np.full((n, 2), 1e6), node_top, limit, np.zeros(2), c)
    assert c[1] == 0.0  # an end that does not rest keeps its c
    c[1] = 1e-12
    rows.guess(n, nodes, d, np.full((n, 2), 1e6), node_top, limit, np.zeros(2), c)
    apart = 0.5 * (nodes[1:] + nodes[:-1]) - 0.5 * nodes[1]
    by_hand = (9.0 / 8.0 * apart**2 * 4e4) ** (2.0 / 3.0)
    # the last cell is an end in motion at 0 too: from there it is the same, backwards
    half = slice(2, n // 2)
    assert c[1:-1][half] == pytest.approx(by_hand[half], rel=1e-3)
    limit[OF_AXES + 1], limit[OF_AXES + 2] = 50.0, math.inf
    c = np.zeros(n + 2)
    c[1] = 1e-12
    rows.guess(n, nodes, d, np.full((n, 2), 1e6), node_top, limit, np.zeros(2), c)
    assert c[1:-1][half] == pytest.approx(50.0 * apart[half], rel=1e-9)  # v^2 = 2 a x at half the acceleration


def arcs_and_lines() -> sf.Path:
    """A line of 1 mm, a quarter circle of 1 mm, and a line again: curvature jumps by 1/mm at 1 and at 1 + pi/2."""
    return sf.Path(
        [
            sf.NurbsCurve.bezier([[-1, 0], [0, 0]]),
            sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, 1]], [1.0, math.sqrt(0.5), 1.0]),
            sf.NurbsCurve.bezier([[1, 1], [1, 3]]),
        ]
    )


@pytest.mark.parametrize(
    ("low", "reach", "behind"), [(0.7, 0.5, []), (1.3, 0.0, []), (1.3, 0.4, [1.0]), (2.8, 2.0, [1.0, 2.570796327])]
)
def test_jumps_are_found_ahead_and_as_far_behind_as_they_count(low: float, reach: float, behind: list[float]):
    path = arcs_and_lines()
    feeds = np.full((len(path.table), 2), math.inf)
    out = np.empty((samples.sample_room(len(path.table)), samples.COLUMNS))
    jumps = np.empty((len(path.table) + 1, JUMPS + 4))
    limit = limit_row(sf.Limits(feed=10.0, axis_acceleration=100.0), ("x", "y"), None)
    count, found = samples.sample_rows(path.table, feeds, path.shape, low, 4.0, reach, limit, out, jumps)
    ahead = [s for s in (1.0, 1.0 + 0.5 * math.pi) if s > low]
    at = jumps[:found]
    assert at[:, 0] == pytest.approx([*behind, *ahead], abs=1e-9)
    # from 0 to 1/mm along y, and from 1/mm along -x to 0; the direction does not jump
    assert at[:, JUMPS : JUMPS + 2] == pytest.approx(np.zeros((found, 2)), abs=1e-12)
    wanted = [[0.0, 1.0] if s < 2.0 else [1.0, 0.0] for s in at[:, 0]]
    assert at[:, JUMPS + 2 :] == pytest.approx(np.array(wanted), abs=1e-9)
    assert np.all(np.isinf(at[:, CAP]))
    begins = out[:count, samples.BEGIN]
    assert begins[0] == low
    for begin, bend in zip(begins, out[:count, samples.BEND], strict=True):
        assert bend == pytest.approx(1.0 if 1.0 <= begin < 1.0 + 0.5 * math.pi - 1e-9 else 0.0, abs=1e-9)


def crawled(path: sf.Path, limits: sf.Limits) -> sf.TimeLaw:
    """The slow profile over the whole path as a law."""
    table, length = path.table, path.length
    limit = limit_row(limits, path.axes, None)
    feeds = np.full((len(table), 2), math.inf)
    out = np.empty((samples.sample_room(len(table)), samples.COLUMNS))
    jumps = np.empty((len(table) + 1, JUMPS + 2 * len(path.axes)))
    count, found = samples.sample_rows(table, feeds, path.shape, 0.0, length, 0.0, limit, out, jumps)
    nodes, spans, law = np.empty(profiles.PHASES + 1), np.empty(profiles.PHASES), np.empty((profiles.PHASES, 6))
    pieces, time = profiles.crawl(
        table, feeds, path.shape, 0.0, length, count, out, found, jumps, limit, 1.0, nodes, spans, law
    )  # fmt: skip
    assert pieces == profiles.PHASES
    assert time == pytest.approx(np.sum(spans[:pieces]), rel=1e-15)
    assert 0.9 < profiles.held(table, feeds, path.shape, limit, pieces, nodes, spans, law) <= 1.0 + 1e-9
    law[:, 0] = nodes[:-1]
    return sf.TimeLaw(breaks=np.append(0.0, np.cumsum(spans)), coefficients=law, strategy="crawl")


def test_the_slow_profile_keeps_every_limit_and_uses_one_of_them_up():
    """An eighth of an ellipse: seven phases at a low feed, held by the check, and as fast as such a profile may be."""
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, 0.5]], [1.0, math.sqrt(0.5), 1.0])])
    limits = sf.Limits(feed=60.0, axis_velocity=20.0, axis_acceleration=2000.0, axis_jerk=5e5)
    law = crawled(path, limits)
    assert law.length == pytest.approx(path.length, rel=1e-12)
    verdict = sf.check(sf.interpolate(path, law, period=1e-3), path, limits, law=law)
    assert verdict.ok, verdict.problems
    assert max(each.share for each in verdict.limits.values()) > 0.95
    # up and down again at the least acceleration takes the square root of 4 L / A, and there is jerk besides
    assert 2.0 * math.sqrt(path.length / 2000.0) < law.duration < 6.0 * math.sqrt(path.length / 2000.0)


def test_no_slow_profile_without_length_or_where_nothing_may_move():
    path = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0], [1, 1]])])
    limit = limit_row(sf.Limits(feed=10.0, acceleration=100.0), path.axes, None)
    feeds = np.full((len(path.table), 2), math.inf)
    room = np.zeros((1, samples.COLUMNS))
    nodes, spans, law = np.empty(8), np.empty(7), np.empty((7, 6))
    for low, high, top in ((0.5, 0.5, 100.0), (0.0, 1.0, 0.0)):
        room[0, samples.TOP] = room[0, samples.SLOW] = top
        found = profiles.crawl(
            path.table, feeds, path.shape, low, high, 1, room, 0, np.empty((1, JUMPS + 4)), limit, 1.0, nodes, spans,
            law,
        )  # fmt: skip
        assert found == (0, math.inf)


def test_a_stretch_in_time_keeps_the_way_and_divides_each_derivative():
    s, t, law = joined(5)
    spans, both = np.array([t]), law[None].copy()
    profiles.stretch(1, 1.7, spans, both)
    slow = Polynomial(both[0])
    assert spans[0] == pytest.approx(1.7 * t, rel=1e-15)
    for share in (0.0, 0.4, 1.0):
        for order in range(1, 4):
            assert slow.deriv(order)(share * spans[0]) == pytest.approx(
                s.deriv(order)(share * t) / 1.7**order, rel=1e-12
            )
        assert slow(share * spans[0]) == pytest.approx(s(share * t), rel=1e-13, abs=1e-15)


def steady(path: sf.Path, limits: sf.Limits, feeds: np.ndarray, state: tuple[float, float] = (0.0, 0.0)) -> int:
    """Pieces of `straight` over the whole path."""
    room = np.empty(profiles.PHASES + 1), np.empty(profiles.PHASES), np.empty((profiles.PHASES, 6))
    ends = np.array([[0.0, 0.0], [0.0, 0.0]])
    ends[0] = state
    limit = limit_row(limits, path.axes, None)
    return profiles.straight(path.table, feeds, path.shape, 0.0, path.length, ends, limit, *room)


def test_only_what_is_straight_all_over_gets_the_exact_profile():
    """A corner in passing, another feed, another direction, a bend, an acceleration, no jerk: each is none."""
    line = [sf.NurbsCurve.bezier([[0, 0], [1, 0]]), sf.NurbsCurve.bezier([[1, 0], [3, 0]])]
    limits = sf.Limits(feed=20.0, axis_acceleration=2000.0, axis_jerk=5e5)
    path = sf.Path(line)
    free = np.full((len(path.table), 2), math.inf)
    assert steady(path, limits, free) > 0
    corner, slower = free.copy(), free.copy()
    corner[1, AT_CORNER] = 5.0
    slower[1, 0] = 5.0
    assert steady(path, limits, corner) == steady(path, limits, slower) == 0
    assert steady(path, limits, free, (3.0, 1.0)) == 0
    assert steady(path, limits, free, (25.0, 0.0)) == 0  # faster than the limit
    assert steady(path, sf.Limits(feed=20.0, axis_acceleration=2000.0), free) == 0
    turned = sf.Path([line[0], sf.NurbsCurve.bezier([[1, 0], [2, 1]])])
    bent = sf.Path([sf.NurbsCurve.bezier([[0, 0], [1, 0], [2, 0.1]])])
    still = sf.Path([sf.NurbsCurve.bezier([[0, 0], [0, 0], [2, 0]])])  # C' = 0 where it begins
    for other in (turned, bent, still):
        assert steady(other, limits, np.full((len(other.table), 2), math.inf)) == 0


def test_between_two_cusps_the_way_to_them_is_told_by_the_third_derivative():
    """x' = d (u^2 - g^2) / 2 has its zeros 2 d g^3 / 3 mm apart: from the middle, where x'' = 0, half of that."""
    g, d = 1e-3, 4.0
    half = d * g**3 / 3.0
    assert way_to_rest(d * g * g / 2.0, 0.0, d) == pytest.approx(half, rel=1e-12)
    for u in (0.3e-3, 0.9e-3):
        c, b = d * (g * g - u * u) / 2.0, d * u
        left = half - d * (g * g * u - u**3 / 3.0) / 2.0
        assert way_to_rest(c, b, d) == pytest.approx(left, rel=1e-12)
    # a parabola's cusp, c^2 / (2 b) away; a straight line has none
    assert way_to_rest(3.0, 2.0, 0.0) == pytest.approx(9.0 / 4.0, rel=1e-12)
    assert way_to_rest(1.0, 0.0, 0.0) == math.inf
    assert way_to_rest(0.0, 0.0, 0.0) == 0.0
