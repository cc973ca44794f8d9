"""The rule of `auto`: closed forms hold within their bars, and what stays undecided is tried by DOP853."""

from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp, mpf

import survey
from survey.measures.hill import auto, monodromy
from survey.methods import dop853
from survey.scenes import mathieu


def test_closed_forms_hold_within_their_bars():
    span = np.pi / 2
    z = np.concatenate(
        [
            [0.0, 1e-300, 1e-12, -1e-12, 1.0, 4.0, 9.0],
            np.random.default_rng(1).uniform(-50, 500, 60),
        ]
    )
    results = auto.closed_form(z, np.full(z.size, span))
    with mp.workdps(40):
        for value, row in zip(z, results, strict=True):
            rate, length = mp.sqrt(mpf(value)), mpf(span)
            exact = [
                mp.cos(rate * length),
                -rate * mp.sin(rate * length),
                length * mp.sinc(rate * length),
            ]
            for i, number in enumerate([*map(mp.re, exact), mp.re(exact[0])]):
                assert abs(number - mpf(row[i])) <= row[4 + i], (value, i)
            phase = float(mp.re(rate * length) / mp.pi)
            assert row[8:].tolist() == [
                np.floor(phase + 0.5),
                max(0, np.ceil(phase) - 1),
            ] or value in (4.0, 9.0, 1.0)


def test_closed_forms_agree_with_integration():
    rho = np.random.default_rng(2).uniform(0.1, 5.0, 50)
    for body in ("prolate", "oblate"):
        exact = survey.evaluate("satellite", k=0.0, rho=rho, body=body)
        solved = survey.evaluate("satellite", k=0.0, rho=rho, body=body, method="taylor16")
        for name in monodromy.FLOATS:
            bars = exact[f"{name}_error"].astype(float) + solved[f"{name}_error"].astype(float)
            assert (abs(exact[name] - solved[name]) <= bars).all(), name


@pytest.mark.parametrize("exact", [False, True])
def test_undecided_points_are_tried_again(monkeypatch, exact):
    """With Taylor's bars made useless every verdict comes from double-double, or from DOP853, and
    is right.
    """
    tried = []
    problem_of = mathieu._problem
    if not exact:
        monkeypatch.setattr(
            mathieu, "_problem", lambda *given: replace(problem_of(*given), exact=None)
        )
    good = auto.pointwise.solve

    def spoiled(problem, method, asked, answers, where=None):
        good(problem, method, asked, answers, where)
        if method is dop853:
            tried.append(where.sum())
        else:
            answers.verdict[:] = -1

    monkeypatch.setattr(auto.pointwise, "solve", spoiled)
    ds = survey.evaluate("mathieu", a=[0.5, 1.0, 2.0], q=1.0)
    assert tried == ([] if exact else [3]) and ds.verdict.values.tolist() == [0, 0, 1]
