"""The truth of anyone's own Hill equation, against the truths in double-double and in closed form."""

import numpy as np
import pytest
from mpmath import mp, mpf

import survey
from survey.truth import digits, user_equations
from survey.truth.hill import FACTOR_COLUMNS
from survey.truth.hill_flow import DOUBT

POINTS = {
    "harmonics": [3.0, 1.0, -2.0, 0.0, 0.5, 0.3, 0.0, -1.0, 0.2, 0.7],
    "harmonics even": [40.0, 4.0, -2.0, 0.7, 0.5, 0.0, 0.0, 0.0, 0.0, 0.9],
    "meissner": [200.0, -3.0, 0.3],
    "meissner even": [-2.0, 300.0, 0.2],
    "spike named": [5.0, 40.0, 0.3, 0.02],
}


@pytest.mark.parametrize("name", POINTS)
def test_it_agrees_with_the_other_truths(name):
    z, parameters, _kind, more = user_equations.OWN[name]
    scene = survey.hill(z, parameters=parameters, **more)
    p = np.array(POINTS[name])
    known, seen = user_equations.solved(name, p[None])[0], []
    original = digits._factors

    def watched(*arguments):
        seen.append(original(*arguments))
        return seen[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(digits, "_factors", watched)
        ds = survey.evaluate(scene, **dict(zip(parameters, p, strict=True)))
        answer = {key: np.atleast_1d(ds[key].values) for key in ds.data_vars}
        found = digits.own(scene)(dict(zip(parameters, p[:, None], strict=True)), answer)
    (row,) = seen
    with mp.workdps(40):
        for i in FACTOR_COLUMNS.values():
            off = abs(mpf(row[i]) + mpf(row[i + 1]) - mpf(known[i]) - mpf(known[i + 1]))
            assert off <= row[DOUBT] + known[DOUBT] and row[DOUBT] < 1e-18 * (1 + abs(known[i])), (
                i,
                off,
                row[DOUBT],
            )
    value, low, _doubt = found["discriminant"]
    assert abs(float(ds.discriminant) - value[0] - np.ravel(low)[0]) <= float(ds.discriminant_error)
