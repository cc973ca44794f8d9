"""Where return maps end: against bisection of the maps themselves, and scans that know nothing of it."""

import numpy as np
import pytest

from survey.kernels.cylinder import borders as bo
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import returns as rt
from survey.measures.cylinder import equation, fate
from survey.methods import taylor

SYSTEMS = np.random.default_rng(17).normal(size=(150, 6)) * [1, 1, 2, 2, 3, 3]


def _image(kind, s, anchor, x):
    node = np.zeros(rt.NODE_SIZE)
    taylor.flow_image(kind, s.p, s.equilibria, len(s.equilibria), anchor, x, fate.FINE, node)
    return node


def _bisected(kind, s, anchor, low, high):
    """The border of a class between low and high."""
    first = _image(kind, s, anchor, low)[rt.CLASS]
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        if _image(kind, s, anchor, middle)[rt.CLASS] == first:
            low = middle
        else:
            high = middle
    return high


def _intervals(s):
    """(number, first angle, last angle) of the intervals where librations begin."""
    angles = [*s.equilibria[:, eq.ANGLE], s.equilibria[0, eq.ANGLE] + 2.0 * np.pi]
    return [(i, angles[i], angles[i + 1]) for i, row in enumerate(s.equilibria) if row[eq.DG] < 0.0]


def test_the_first_border_of_rotations():
    compared = 0
    for six in SYSTEMS[:30]:
        s = fate.outline(six)
        places = fate.borders(taylor, rt.ROTATION, s.p, s.equilibria, s.section, fate.FINE)
        lattice = np.geomspace(1e-5, 100.0, 60)
        classes = [_image(rt.ROTATION, s, s.section, x)[rt.CLASS] for x in lattice]
        if classes[0] == 1.0:  # every turn is completed
            assert not len(places) or places[-1, bo.PLACE] < lattice[0]
            continue
        first = classes.index(1.0)
        border = _bisected(rt.ROTATION, s, s.section, lattice[first - 1], lattice[first])
        assert places[-1, bo.PLACE] == pytest.approx(border, rel=1e-11)
        assert set(classes[first:]) == {1.0}  # above the border every turn is completed
        compared += 1
    assert compared > 10


def test_every_border_of_librations():
    compared = 0
    for six in SYSTEMS[:30]:
        s = fate.outline(six)
        places = fate.borders(taylor, rt.LIBRATION, s.p, s.equilibria, 0.0, fate.FINE)
        for i, low, high in _intervals(s):
            xs = low + (high - low) / (1.0 + np.exp(-np.linspace(-8.0, 8.0, 60)))
            classes = [_image(rt.LIBRATION, s, high, x)[rt.CLASS] for x in xs]
            for k in np.flatnonzero(np.diff(classes)):
                border = _bisected(rt.LIBRATION, s, high, xs[k], xs[k + 1])
                here = places[places[:, bo.OF] == i, bo.PLACE]
                if s.equilibria[i, eq.KIND] == eq.NODE and border < here.min(initial=np.inf):
                    continue  # up to there orbits are proved to run into the node
                assert np.abs(here - border).min() < 1e-10
                compared += 1
    assert compared > 20


@pytest.mark.parametrize("kind", [rt.ROTATION, rt.LIBRATION])
def test_scans_that_know_no_border_find_the_same_cycles(kind):
    found = 0
    for six in SYSTEMS:
        s = fate.outline(six)
        eqs, p = s.equilibria, s.p
        works = [(0, s.section, np.geomspace(1e-5, 30.0, 60))]
        if kind == rt.LIBRATION:
            works = [
                (i, high, low + (high - low) / (1.0 + np.exp(-np.linspace(-11.0, 11.0, 56))))
                for i, low, high in _intervals(s)
            ]
        places = fate.borders(taylor, kind, p, eqs, s.section, fate.FINE)
        for i, anchor, xs in works:
            tables = []
            here = places[:, bo.PLACE]
            if kind == rt.LIBRATION:
                here = here[places[:, bo.OF] == i]
            for guesses in (here.copy(), np.array([np.nan])):
                table, edges = np.zeros((rt.MOST_CYCLES, rt.CYCLE_SIZE)), np.zeros(rt.EDGES)
                given = kind, p, eqs, len(eqs), anchor, i, xs, guesses, fate.FINE
                size = taylor.flow_cycles(*given, table, 0, edges)
                tables.append(table[:size])
            known, unknown = tables
            assert len(known) == len(unknown)
            bars = known[:, rt.CYCLE_BAR] + unknown[:, rt.CYCLE_BAR]
            assert (abs(known[:, rt.CYCLE_X] - unknown[:, rt.CYCLE_X]) <= bars).all()
            np.testing.assert_array_equal(known[:, rt.ABOVE], unknown[:, rt.ABOVE])
            found += len(known)
    assert found > 3


def test_a_cycle_that_hides_at_the_border_is_not_denied():
    """The unstable branch meets the section below the stable one, but D > 0 from 1e-13 behind that on: about
    as far as doubles tell, the cycle between lies at the border itself.
    """
    s = fate.skeleton(
        taylor,
        [0.6581494849637273, 5.137133460086418, 1.2152447154396184, 0.10764041873729935, -0.14386793899862532,
         0.8686703417067414],
    )  # fmt: skip
    cycles = s.cycles(fate.PLUS)
    w_c, w_d = cycles.threshold
    assert w_d < w_c - 1e-3
    assert _image(rt.ROTATION, s, s.section, w_c + 1e-12)[rt.CHANGE] > 1e-3
    assert not len(cycles.table) and not cycles.conclusive


def test_two_cycles_a_third_apart_are_not_left_out():
    """D > 0 rises, falls below 0 and rises again: a pair that the nodes about it do not show by their slopes
    alone. True roots from DOP853 at rtol = 1e-13: D changes sign in (0.24, 0.3) and (0.36, 0.4).
    """

    def f(x, q):
        u = 1.0 - np.cos(x)
        return q[0] * (q[1] + u * (q[2] + u * (q[3] + u * (q[4] + u))))

    q = [
        0.140046781400694,
        2.0312865283892254e-09,
        -2.8377530667476632e-06,
        0.0010920041943663782,
        -0.07012595791104377,
    ]
    program = equation.flows(f, lambda x, q: -np.sin(x), np.array([q]), True)[0]
    cycles = fate.skeleton(taylor, program).cycles(fate.LIBRATIONS)
    one, two = cycles.table[:, rt.CYCLE_X]
    assert 0.24 < one < 0.3 and 0.36 < two < 0.4 and cycles.conclusive
