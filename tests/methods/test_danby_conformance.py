"""What every method promises of Danby's problem: its order, and bars that hold the error."""

import json
from importlib import resources

import numpy as np
import pytest

import survey.methods
from survey import modules
from survey.kernels.jit import kernel, splice
from survey.kernels.libration import danby as lanes
from survey.measures.libration import danby
from survey.methods import rk4, taylor16

METHODS = [modules.load(survey.methods, name, "method") for name in modules.names(survey.methods)]
CHAINS = [m for m in METHODS if "danby" in m.SERVES and not getattr(m, "ADAPTIVE", False)]
POINTS = json.loads(
    resources.files("survey.reference").joinpath("libration_elliptic.json").read_text()
)["points"]
POINTS = [row for row in POINTS if row["e"] < 0.7]
EXACT = np.array([[float(row[name]) for name in ("A", "B", "C", "D", "t")] for row in POINTS])
E = np.array([row["e"] for row in POINTS])
D1, D2 = danby.rates(np.array([row["mu"] for row in POINTS]))
NAMES = [m.__name__.rpartition(".")[2] for m in CHAINS]


def errors(nodes, chain, steps):
    """(true errors, bars) of A to t at the reference points with so many even steps in f."""
    out = np.empty((E.size, 10))
    chain(*danby.mesh(steps, 0, tuple(nodes)), E, D1, D2, out)
    return abs(out[:, :5] - EXACT), out[:, 5:]


def slope(nodes, chain, numbers):
    """Of the logarithm of the error (the sum over the points) against that of the step."""
    error = np.array([errors(nodes, chain, n)[0].sum() for n in numbers])
    return np.polyfit(np.log(1 / np.array(numbers)), np.log(error), 1)[0]


def test_the_order_of_rk4():
    assert abs(slope(rk4.NODES, rk4.danby_chain, (100, 150, 225, 340)) - rk4.ORDER) < 0.15


def one_step(f, h, parts=1):
    """A to t of one step from f by midpoint Taylor, in `parts` steps."""
    ends, out = f + h * np.arange(parts) / parts, np.empty((1, 10))
    v = 1 + np.cos(ends[:, None] + np.array(taylor16.NODES) * h / parts)
    taylor16.danby_chain(
        v, np.full(parts, h / parts), np.full(1, 0.3), *danby.rates(np.full(1, 0.02)), out
    )
    return out[0, :5]


def test_the_order_of_midpoint_taylor():
    """Of one step, over 16 places: the determinants see some of its errors one order later, so it
    is a lower bound.
    """
    sizes, places = np.geomspace(0.2, 3.0, 40), np.linspace(0.0, 3.0, 16)
    error = np.array(
        [sum(abs(one_step(f, h) - one_step(f, h, 24)).sum() for f in places) for h in sizes]
    )
    window = (error > 3e-12) & (error < 1e-3)
    assert window.sum() >= 8
    measured = np.polyfit(np.log(sizes[window]), np.log(error[window]), 1)[0] - 1
    assert -0.15 < measured - taylor16.ORDER < 1.15


def bars_hold(nodes, chain):
    held = []
    for steps in (2, 3, 4, 6, 8, 12, 24, 60, 200, 800):
        error, bar = errors(nodes, chain, steps)
        held.append((error <= bar + 4 * np.spacing(abs(EXACT))).all())
    return all(held)


@pytest.mark.parametrize("method", CHAINS, ids=NAMES)
def test_bars_hold_on_every_rung(method):
    assert bars_hold(method.NODES, method.danby_chain)


@splice
def wrong_columns(v, h, work, count):
    rk4.danby_columns(v, h, work, count)
    for i in range(count):
        work[lanes.COLUMNS, i] += 1e-3 * h * h * h


@kernel
def wrong_chain(v, h, e, d1, d2, out):
    lanes.chain(wrong_columns, len(rk4.NODES) + 5, v, h, e, d1, d2, out)


@pytest.mark.slow
def test_the_checks_see_a_broken_method():
    """A Runge-Kutta step with an error of h^3 in one entry claims order 4 and bars that do not hold."""
    assert not bars_hold(rk4.NODES, wrong_chain)
    assert abs(slope(rk4.NODES, wrong_chain, (100, 150, 225, 340)) - rk4.ORDER) > 0.15


def test_a_lane_has_the_same_bits_whatever_its_neighbours():
    mesh = danby.mesh(5, 1, tuple(taylor16.NODES))
    e, d1, d2 = (np.tile(values, 7) for values in (E, D1, D2))
    whole, alone = np.empty((e.size, 10)), np.empty((1, 10))
    taylor16.danby_chain(*mesh, e, d1, d2, whole)
    for i in (0, 63, 64, 100, e.size - 1):
        taylor16.danby_chain(*mesh, e[i : i + 1], d1[i : i + 1], d2[i : i + 1], alone)
        np.testing.assert_array_equal(alone[0], whole[i])
