from types import SimpleNamespace

import numpy as np

from survey.kernels.hill.answers import UNTRIED, first_rungs, segments
from survey.measures.hill import pointwise
from survey.measures.hill.answers import Asked
from survey.measures.hill.pointwise import LONGEST, STEP_COUNTS
from survey.methods import taylor16

RNG = np.random.default_rng(3)


def test_rows_that_come_together_take_the_steps_of_their_fastest_point():
    p = RNG.normal(size=(300, 7)) * 10.0 ** RNG.uniform(-3, 12, (300, 1))
    p[::9, 3], p[4] = np.nan, np.inf
    scale = 10.0 ** RNG.uniform(-2, 2, 300)
    rows = {
        "bound": abs(RNG.normal(size=(300, 3))),
        "span": scale,
        "rate": abs(RNG.normal(size=300)),
    }
    rows["span"][::20] = np.nan
    phase, distance = taylor16.hill_density(1e-10)
    single = np.empty(p.shape, np.int64)
    first_rungs(
        p,
        rows["bound"],
        rows["span"],
        rows["rate"],
        max(phase, 1 / LONGEST),
        distance,
        STEP_COUNTS.rungs,
        single,
    )
    wanted = np.where(single == UNTRIED, UNTRIED, single.max(axis=1, keepdims=True))
    problem = SimpleNamespace(p=p, **rows)
    together = pointwise._first_steps(
        problem, taylor16, Asked(1e-10, np.ones(7, bool), together=True)
    )
    np.testing.assert_array_equal(together, wanted)
    assert (
        (wanted == UNTRIED).any()
        and (wanted == len(STEP_COUNTS.rungs)).any()
        and len(np.unique(wanted)) > 20
    )


def test_rows_with_the_same_steps_are_not_sorted_and_come_out_the_same():
    rung = np.repeat(RNG.integers(-1, len(STEP_COUNTS.rungs) + 1, (200, 1)), 5, axis=1)
    order, *parts = (np.empty(rung.size, np.int64) for _ in range(4))
    count = segments(rung, len(STEP_COUNTS.rungs) - 1, order, *parts)
    rows, on_rung, starts = (part[:count] for part in parts)
    found = pointwise._segments(rung)
    points = [found[0][first:last].tolist() for first, last in zip(*found[3:], strict=True)]
    assert points == [
        order[a:b].tolist() for a, b in zip(starts, parts[2][1 : count + 1], strict=True)
    ]
    np.testing.assert_array_equal(found[1], rows)
    np.testing.assert_array_equal(found[2], on_rung)
