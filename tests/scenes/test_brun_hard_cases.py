"""Hard cases of every kind against 60 digits: errors within the bars, and near what half-ulp
changes of inputs do.
"""

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf
from scipy import special

import survey
from survey.truth.brun_digits import (
    HALF_ULP,
    NAMES,
    OUTPUTS,
    draw,
    draw_scaled,
    scaled,
    truth,
    wells,
)

WIDEST = 1e4  # bars over floors: 5e3 at 1e-24 from separatrices


def evaluate(points, method="auto", **more):
    arrays = {
        name: xr.DataArray(np.array(column), dims="point")
        for name, column in zip(NAMES, points.T, strict=True)
    }
    return survey.evaluate("brun", method=method, **arrays, **more)


def misses(seed, number):
    """Complaints: an error outside its bar, or above 100 times the floor, of a rounded output at
    least; a wide bar.
    """
    random = np.random.default_rng(seed)
    kinds, points = zip(*(draw(random) for _ in range(number)), strict=True)
    ds, faults = evaluate(np.array(points)), []
    for i, (kind, point) in enumerate(zip(kinds, points, strict=True)):
        one = ds.isel(point=i)
        if (one.status != 0 or one.verdict == 0) and abs(one.separatrix_distance) < 1e-20:
            continue  # which says why there is no answer; a change of an input by 1e-16 is far more
        if one.status != 0 or one.verdict < 1:
            faults.append((kind, point.tolist(), int(one.status), int(one.verdict)))
            continue
        faults += [(kind, *complaint, point.tolist()) for complaint in compared(one, *truth(point))]
    return faults


def compared(one, exact, floor):
    """(name, error, bar, floor) of the outputs whose error or bar is too large."""
    for name, value, least in zip(OUTPUTS, exact, floor, strict=True):
        error, bar = abs(mpf(float(one[name])) - value), float(one[f"{name}_error"])
        least = max(least, HALF_ULP * abs(value))
        wide = bar > WIDEST * least > 0  # what is 0 at every state has a bar none the less
        if wide or not (error <= bar and error <= 100 * least):
            yield name, float(error), bar, float(least)


def scaled_misses(seed, number):
    """As `misses`, of every well at scaled integrals."""
    random, faults = np.random.default_rng(seed), []
    cases = [draw_scaled(random) for _ in range(number)]
    for sign in (1, -1):
        mine = [(kind, point) for kind, s, point in cases if s == sign]
        columns = zip(
            ("l", "alpha", "beta"), zip(*(point for _, point in mine), strict=True), strict=True
        )
        arrays = {name: xr.DataArray(np.array(column), dims="point") for name, column in columns}
        ds = survey.evaluate("brun", sign=str(sign), ratio=1.0, **arrays)
        for i, (kind, point) in enumerate(mine):
            one, found = ds.isel(point=i), wells(sign, [mpf(float(x)) for x in point])
            if one.verdict == 0 and abs(one.separatrix_distance) < 1e-20:
                continue
            if int(one.status) != (0 if found else 16) or int(one.wells) != len(found):
                faults.append((kind, sign, point, int(one.status), int(one.wells), len(found)))
                continue
            for j, ends in enumerate(found):
                exact = truth(point, scaled(sign), ends)
                faults += [
                    (kind, sign, *complaint, point)
                    for complaint in compared(one.isel(well=j), *exact)
                ]
    return faults


@pytest.mark.slow
def test_hard_cases():
    with mp.workdps(60):
        assert misses(1, 120) == []


@pytest.mark.slow
def test_hard_cases_of_scaled_integrals():
    with mp.workdps(60):
        assert scaled_misses(1, 90) == []


def test_motions_of_hard_cases():
    """Jacobi's functions, R_F inverted and Fourier series agree; at t = 0 the state is the given one."""
    random = np.random.default_rng(3)
    points = np.array([draw(random)[1] for _ in range(400)])
    times = np.array([-30.0, -1.0, 0.0, 0.3, 7.0, 100.0])
    one = evaluate(points, t=times)
    start = one.sel(t=0.0)
    off = abs(start.u - np.cos(one.theta0))
    assert (off <= start.u_error + 2.0**-52).where(start.status == 0, True).all()
    for method in ("carlson", "chebyshev"):
        other = evaluate(points, method, t=times)
        for name in ("u", "psi", "phi"):
            fits = abs(one[name] - other[name]) <= one[f"{name}_error"] + other[f"{name}_error"]
            known = one[name].notnull() & other[name].notnull()
            assert fits.where(known, True).all() and known.mean() > 0.4, (method, name)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_many_hard_cases(seed):
    with mp.workdps(60):
        assert misses(seed, 1000) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_many_hard_cases_of_scaled_integrals(seed):
    with mp.workdps(60):
        assert scaled_misses(seed, 1000) == []


ATTACKED = [
    # p_psi = +-p_phi but for an ulp, far from both poles: the integral of the third kind has a
    # parameter of 1e-34
    (0.7094687596845162, 1.291239726698599, 8.945842071118667, 2.1179917764009564, -0.6067452734098381,
     0.062437788306259165, 0.06243778830625917),
    (2.854856305072559, 3.358440474556878, 2.4878300007402845, 1.0976082748215041, 1.0052608801625322,
     -0.08021768497938961, -0.08021768497938962),
    (0.7094687596845162, 1.291239726698599, 8.945842071118667, 2.1179917764009564, -0.6067452734098381,
     1e-5, 1e-5 * (1 + 2**-52)),
    # a well of width 2e-8, in which the start lies where u cannot say
    (1.183232514547523, 0.9384292434143278, 1.72150855940458e-06, 1.8852089893650088, 3.4956725957385437e-13,
     0.0001379268097312102, 0.00042537750926646293),
    # narrow wells of fast spin, near the equator: their slow precession is as good as ul + uh is; the
    # first also with the method auto
    (1.7068041879854636, 0.28672785293752057, 0.00042798978841875393, 1.5708100925161548, 2.5990482072430895e-15,
     0.018860823378155585, -1370.129688452155),
    (0.5288223939858676, 1.0122722286755932, 2.6485649921945178e-05, 1.5699885819823776, 3.231776198478138e-16,
     -0.16618517980362194, -205.73972778614177),
    (0.5112908237469606, 0.6995656852510671, -8.850394860526695e-07, 1.573453709607638, -2.8679553084072482e-15,
     -1.3041679511345678, 490.772153646835),
    # a narrow well beside a wide one, which float32 on the way from the poles takes for it
    (2.913819726575612, 4.190975429041313, -3.89335363605696e-06, 1.9733656957886545, 1.8153970981329044e-12,
     0.0015295927522565962, 0.0013694394104398176),
]  # fmt: skip


@pytest.mark.parametrize("method", ["auto", "agm", "carlson", "chebyshev"])
@pytest.mark.parametrize("point", ATTACKED)
def test_what_an_attack_found_is_within_its_bars(point, method):
    ds = evaluate(np.array([point]), method=method).isel(point=0)
    with mp.workdps(80):
        for name, true in zip(OUTPUTS, truth(point)[0], strict=True):
            assert abs(mpf(float(ds[name])) - true) <= float(ds[f"{name}_error"]), name


@pytest.mark.parametrize("alpha, beta", [(0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0)])
def test_where_four_turning_points_meet_the_answer_says_so(alpha, beta):
    """u'^2 = -u^4 at l = 1; just above, u'^2 = d - u^4 but for terms of order d^(1/2), whose period is
    4 d^(-1/4) times the lemniscate's quarter.
    """
    here = survey.evaluate("brun", alpha=alpha, beta=beta, l=1.0).survey.point()
    assert here.status == "no_convergence" and "exactly a cusp" in here.why
    d = 2.0**-40
    above = survey.evaluate("brun", alpha=alpha, beta=beta, l=1.0 + d)
    known = 4.0 * d**-0.25 * special.gamma(0.25) ** 2 / (4.0 * np.sqrt(2.0 * np.pi))
    assert abs(above.period[0] / known - 1.0) < 1e-4
    assert f"{known * d**0.25:.4f}" == "5.2441"
