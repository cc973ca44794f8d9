"""Nutations that float64 leaves open: verdicts on lines of consecutive numbers, and values, against
100 digits.
"""

from fractions import Fraction

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey.measures.nutation import multiprecision
from survey.status import NO_CONVERGENCE, OK, OVERFLOW
from survey.truth.brun_digits import NAMES, OUTPUTS, draw, integrals, outputs, turning_points

NO_MOTION = 16
# Found by attack: beside saddles, cusps, upright rotations and regular precessions; advances that
# cancel.
STATES = [
    [0.5105908628011825, 0.5014138482093197, 5.947819473509641e-05, 1.7371774524674761, 0.0, 0.0004817598831429927,
     1.0511313730314697e-05],
    [0.46104323559134147, 0.04451801138137632, 0.033116891021111525, 1.5714720253083039, 0.0, 0.07974724071694135,
     9.840919051873344e-11],
    [1.3852035296403062, 1.0978195367743935, -1.309362056295757e-06, 3.1415926535893255, 0.0, -0.0012865551695521475,
     0.0012865551695521475],
    [2.7990210767561017, 3.6796214323912984, -2.8647780051267862e-06, 1.8775955663837038, 0.0, -0.0005979881823334424,
     -0.00149675711567415],
    [2.023185517383771, 2.5866210467330526, -1.5324695091906002e-06, 0.7633365354565222, 2.685413231764411e-19,
     -0.0031060910470333916, -0.002065573414895637],
    [0.9780601870916387, 1.4307016405976947, -9.626010668824865, 1.6044396644658991, 0.0, 2.0573259640969703,
     0.00031533672983052874],
    [0.36467317635221563, 0.5585012947430872, -0.33785952359738797, 1.4578566372017105, -5.664100857362574e-29,
     1.2746989107510511, 404.15505836540297],
]  # fmt: skip


def of_states(points, **more):
    arrays = {
        name: xr.DataArray(np.array(column), dims="point")
        for name, column in zip(NAMES, points, strict=True)
    }
    return survey.evaluate("brun", **arrays, **more)


def scaled(sign, l, alpha, beta):  # noqa: E741
    wide = np.broadcast_arrays(l, alpha, beta)
    arrays = {
        key: xr.DataArray(x.copy(), dims="point")
        for key, x in zip(("l", "alpha", "beta"), wide, strict=True)
    }
    return survey.evaluate("brun", sign=str(sign), ratio=0.5, **arrays)


def beside(x, number=12):
    """Consecutive float64 numbers about x."""
    found = [float(x)]
    for _ in range(number):
        found = [np.nextafter(found[0], -np.inf), *found, np.nextafter(found[-1], np.inf)]
    return np.array(found)


def discriminant(k, level, a, b):
    """Of P, exactly, over 256: its sign tells the roots' pattern (`brun.md`)."""
    k, level, a, b = (Fraction(float(x)) for x in (k, level, a, b))
    c = level - a * a - b * b
    g2 = (k - level) ** 2 / 12 - k * c
    g3 = -k * (k - level) * c / 6 - (k - level) ** 3 / 216 + k * a * a * b * b / 4
    return g2**3 - 27 * g3**2


def surface(y, z, sign):
    """(S18): l, alpha, beta of a regular precession."""
    return y * y + z * z - 3 * sign * y * y * z * z, z * (1 - sign * y * y), y * (1 - sign * z * z)


@pytest.mark.parametrize(
    ("y", "z"), [(0.3, 0.4), (-0.55, 0.31), (0.05, 0.6), (0.7, -0.2), (0.25, 0.0)]
)
def test_separatrices(y, z):
    """Two wells below, one above; on it where the discriminant is exactly 0, and there only."""
    level, alpha, beta = surface(y, z, 1)
    line = beside(level)
    ds = scaled(1, line, alpha, beta)
    exact = [discriminant(1, x, alpha, beta) for x in line]
    wells = [np.nan if x == 0 else 2 if x > 0 else 1 for x in exact]
    assert (
        np.array_equal(ds.wells, wells, equal_nan=True)
        and len({np.sign(float(x)) for x in exact}) > 1
    )
    assert (
        ds.verdict.values.tolist() == [0 if x == 0 else 1 for x in exact]
        and (ds.status == OK).all()
    )
    assert (np.sign(ds.separatrix_distance) == [-np.sign(float(x)) for x in exact]).all()
    assert (ds.period_error < 1e-10 * ds.period).sum() == np.nansum(wells)


@pytest.mark.parametrize(
    ("y", "z", "sign"), [(1.1, 0.4, 1), (0.3, -0.7, -1), (1.5, 0.1, 1), (-2.0, 0.0, 1)]
)
def test_regular_precessions(y, z, sign):
    """No motion below, a nutation above, however small; a regular precession exactly between."""
    level, alpha, beta = surface(y, z, sign)
    line = beside(level)
    ds = scaled(sign, line, alpha, beta)
    # k < 0: a motion where the discriminant is positive; k > 0 with one well at most: where it is
    # negative
    exact = [-sign * discriminant(sign, x, alpha, beta) for x in line]
    assert ds.status.values.tolist() == [NO_MOTION if x < 0 else OK for x in exact]
    assert ds.verdict.values.tolist() == [-1 if x < 0 else 2 if x == 0 else 1 for x in exact]
    assert ds.status[0] == NO_MOTION and ds.verdict[-1] == 1


def test_cusps():
    """There is a separatrix where F = F' = 0 has been passed, decided at every one of the
    consecutive numbers.
    """
    for u in (0.1, -0.25, 0.32):
        minus, plus = np.sqrt((1 - u) ** 3 * (1 + 3 * u)), np.sqrt((1 + u) ** 3 * (1 - 3 * u))
        alpha, line = 0.5 * (plus - minus), beside(0.5 * (plus + minus))
        ds = scaled(1, 1 - 6 * u * u + 0.1, alpha, line)
        with mp.workdps(80):
            there = [saddles(mpf(float(alpha)), mpf(float(beta))) for beta in line]
        assert ds.separatrix_distance.notnull().values.tolist() == there and len({*there}) == 2
        assert (ds.verdict == 1).all()


def saddles(a, b):
    """Is there an increasing zero of F in |u| < 1/3, for k = 1? From the extremum of F, where F' = 0."""

    def slope(u):
        return 5 * u**4 - 6 * u * u + 2 * a * b * u + 1 - a * a - b * b

    u = -mp.sign(a * b) * (abs(a * b) / 4) ** (mpf(1) / 3)
    for side in (-1, 1):
        end = mp.findroot(slope, u + side * mpf("1e-3"))
        if abs(end - u) < 0.1 and abs(end) < 0.4:
            break
    value = (a - b * end) * (b - a * end) + end * (1 - end**2) ** 2
    bend = 20 * end**3 - 12 * end + 2 * a * b
    return bool(value * bend < 0)


@pytest.mark.parametrize(("sign", "p"), [(1, 1.3), (-1, 2.4), (-1, 1.1)])
def test_upright_rotations_and_passages(sign, p):
    """alpha = beta: above l = alpha^2 - k the pole is passed; below it nothing moves where W is
    least at the pole.
    """
    line = beside(p * p - sign)
    ds = scaled(sign, line, p, p)
    above = [Fraction(float(x)) + sign - Fraction(p) ** 2 for x in line]
    stable = p * p + 4 * sign > 0
    below = (NO_MOTION, -1) if stable else (OK, 1)
    expected = [below if x < 0 else (OK, 3) if x > 0 else (OK, 2 if stable else 0) for x in above]
    assert list(zip(ds.status.values.tolist(), ds.verdict.values.tolist(), strict=True)) == expected


def test_passages_of_poles():
    """Only where the momenta are equal to the last bit."""
    line = beside(0.5)
    assert scaled(1, 1.7, 0.5, line).verdict.values.tolist() == [3 if x == 0.5 else 1 for x in line]
    assert scaled(1, 1.7, -0.5, line).verdict.values.tolist() == [
        3 if x == 0.5 else 1 for x in line
    ]


def test_states_on_a_line_through_a_saddle():
    """cos theta0 is no algebraic number, so that no state lies on the separatrix: each has its period."""
    y = np.sqrt(0.6 * (1 - 3 * 0.04))
    a, b = 0.2 * (y - 1.2 / y), y - 1.2 * 0.04 / y
    line = beside(np.arccos(0.2))
    point = [np.full(line.size, x) for x in (2.0, 1.0, 0.6, 0.0, 0.0, b, a)]
    point[3] = line
    ds = of_states(point)
    assert (
        (ds.verdict == 1).all()
        and (ds.status == OK).all()
        and (ds.period_error < 1e-10 * ds.period).all()
    )
    with mp.workdps(100):
        for i in range(line.size):
            assert not lies(ds.isel(point=i), [float(column[i]) for column in point])


def lies(one, point):
    """The outputs beyond their bars, by (S5), (S6), at a state."""
    state = [mpf(x) for x in point]
    exact = outputs(integrals(state), turning_points(state), library=False)
    return [
        (name, float(one[name]), mp.nstr(value, 20))
        for name, value in zip(OUTPUTS, exact, strict=True)
        if not abs(mpf(float(one[name])) - value) <= float(one[f"{name}_error"])
    ]


def test_ill_conditioned_states():
    """Where double-double leaves a bar too wide or a verdict open, the answer is right and as
    accurate as asked.
    """
    columns = np.array(STATES).T
    ds = of_states(columns, rtol=1e-13)
    assert (ds.status == OK).all() and (ds.verdict == 1).all()
    for name in OUTPUTS:
        assert (ds[f"{name}_error"] <= 1.01e-13 * (1 + abs(ds[name]))).all(), name
    with mp.workdps(100):
        assert [lies(ds.isel(point=i), point) for i, point in enumerate(STATES)] == [[]] * len(
            STATES
        )
        for method in ("agm", "carlson"):
            other = of_states(columns, method=method)
            for i in np.flatnonzero((other.status == OK) & (other.verdict > 0)):
                assert not lies(other.isel(point=i), STATES[i]), (method, STATES[i])


def test_more_digits_say_what_is_known():
    """At ordinary points the two arithmetics agree."""
    random = np.random.default_rng(7)
    points = np.array([draw(random)[1] for _ in range(30)])
    ds = of_states(points.T)
    for i in np.flatnonzero(ds.status == OK):
        _passes, _wells, (found,) = multiprecision.of_state(*points[i].tolist())
        for name in OUTPUTS:
            off = abs(found[name] - float(ds[name][i]))
            assert off <= found[f"{name}_error"] + float(ds[f"{name}_error"][i]), (
                name,
                points[i].tolist(),
            )


def test_angles_beside_a_separatrix():
    """At t = 0 the angles are 0, and both methods agree, where u hardly moves but the angles do."""
    random = np.random.default_rng(3)
    drawn = [draw(random) for _ in range(400)]
    points = np.array([point for kind, point in drawn if kind == "near a saddle"]).T
    one, other = (
        of_states(points, t=[-1.0, 0.0, 0.3, 30.0], method=method) for method in ("auto", "carlson")
    )
    start, known = one.sel(t=0.0), one.status == OK
    assert known.mean() > 0.9
    for name in ("psi", "phi"):
        assert (abs(start[name]) <= start[f"{name}_error"]).where(start.status == OK, True).all(), (
            name
        )
        fits = abs(one[name] - other[name]) <= one[f"{name}_error"] + other[f"{name}_error"]
        assert fits.where(known & (other.status == OK), True).all(), name


def test_what_leaves_the_range():
    """Next to a pole the body would turn too fast for a float64; that is not the fault of the domain."""
    point = {"A": 1.0, "C": 0.5, "epsilon": 1.0, "p_theta0": 0.1, "p_psi": 1.0, "p_phi": -1.0}
    ds = survey.evaluate("brun", **point, theta0=np.array([1e-300, 1e-160, 1e-30, 0.0]))
    assert ds.status.values.tolist()[:2] == [OVERFLOW, OVERFLOW]
    assert ds.status.values.tolist()[2:] == [OK, 1] and NO_CONVERGENCE not in ds.status
