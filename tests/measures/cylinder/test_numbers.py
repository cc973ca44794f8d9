"""One run of a user's code serves all parameters at which it takes the same path."""

import math

import numpy as np
import pytest

from survey.kernels.cylinder import program as pg
from survey.measures.cylinder import equation


def plain(x, p):
    return p[0] * math.sin(x) + p[2]


def branches(x, p):
    total = 0.0
    for k in range(int(abs(p[1]) * 3)):
        total = total + math.sin((k + 1) * x) / (k + p[0] ** 2 + 1)
    return total if p[0] > 0 else -math.sin(x) * math.sqrt(1 + p[2] ** 2)


def undefined(x, p):
    return math.cos(x) * math.log(p[0]) / p[1]


def powers(x, p):
    return (2 + math.cos(x)) ** p[1] + max(p[0], 0.3) * math.sin(x) * (p[2] - 1)


def points():
    found = np.random.default_rng(3).normal(size=(60, 3))
    found[::7, 0] = 0.0  # x 0 and x 1 are left out of a program
    found[::11, 1] = 0.0
    found[3, 2] = np.nan
    found[5], found[6, 1], found[7, 1] = 1.0, 2.0, 0.5
    return found


@pytest.fixture(autouse=True)
def afresh():
    equation._templates.cache_clear()
    yield
    equation._templates.cache_clear()


@pytest.mark.parametrize("g", [plain, branches, undefined, powers])
def test_programs_are_those_of_a_run_for_each_set(g):
    given = points()
    together = equation.flows(plain, g, given, True)
    for point, row in zip(given, together, strict=True):
        equation._templates.cache_clear()
        alone = equation.program(plain, g, tuple(point), True)
        assert np.isnan(alone[0]) == np.isnan(row[0])
        if not np.isnan(row[0]):
            assert (alone == row[: len(alone)]).all() and not row[len(alone) :].any()
            want = g(0.3, point)
            assert pg.values(row, 0.3)[1] == pytest.approx(want, rel=1e-14, abs=1e-15)


def test_the_code_runs_once_for_each_path(monkeypatch):
    made = []
    template = equation.Template
    monkeypatch.setattr(equation, "Template", lambda *given: made.append(0) or template(*given))
    given = np.abs(points()[[1, 2, 4, 8, 9, 10]]) + 0.1
    equation.flows(plain, plain, given, True)
    equation.flows(plain, plain, given + 0.5, True)
    assert len(made) == 1
    given[:, 1] = [0.4, 0.5, 0.6, 0.7, 0.8, 0.9]  # loops of 1 and of 2
    equation.flows(plain, branches, given, True)
    assert len(made) == 3
