"""Floquet's question: multipliers and verdicts against exact ones, and what their error bars promise."""

import json
import math
from importlib.resources import files

import mpmath
import numpy as np
import pytest
from floquet_truth import evaluated, hard, multipliers
from scipy.optimize import linear_sum_assignment

import survey
from survey.measures.floquet import monodromy
from survey.measures.floquet.multipliers import Discs, verdicts
from survey.measures.floquet.system import System

CASES = json.loads((files("survey.reference") / "floquet.json").read_text())["cases"]
each_case = pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])


def numbers(rows):
    return np.array([[float(x) for x in row] for row in rows])


def scene_of(case):
    """x' = (A0 + A1 cos wt + B1 sin wt) x, in which a parameter only scales a zero."""
    n, w = case["n"], float(case["w"])
    A0, A1, B1 = (numbers(case[name]) for name in ("A0", "A1", "B1"))

    def A(t, p, out):
        for i in range(n):
            for j in range(n):
                out[i, j] = A0[i, j] + A1[i, j] * math.cos(w * t) + B1[i, j] * np.sin(w * t)

    states = [f"x{i}" for i in range(n)]
    return survey.floquet(
        A, period=2 * math.pi / w, parameters="unused", states=states, structure=case["structure"]
    )


def matched(found, exact, bars):
    """Are the exact multipliers, in some order, within the bars of those found?"""
    off = np.array([[float(abs(mpmath.mpmathify(complex(x)) - y)) for y in exact] for x in found])
    rows, columns = linear_sum_assignment(np.minimum(off / np.maximum(bars, 1e-300)[:, None], 1e9))
    return (off[rows, columns] <= bars[rows]).all()


@pytest.mark.parametrize("method", ["auto", "dop853"])
@each_case
def test_reference_systems(case, method):
    names = ["monodromy", "multiplier_re", "multiplier_im", "spectral_radius", "verdict"]
    ds = survey.evaluate(scene_of(case), unused=1.0, method=method, variables=names)
    M, bars = numbers(case["M"]), ds.monodromy_error.values
    assert (abs(ds.monodromy.values - M) <= bars).all()
    assert (bars <= 1e-10 * (1 + abs(M))).all()
    exact = [mpmath.mpc(*pair) for pair in case["multipliers"]]
    found = ds.multiplier_re.values + 1j * ds.multiplier_im.values
    assert matched(found, exact, ds.multiplier_re_error.values)
    radius = mpmath.mpf(case["spectral_radius"])
    assert abs(radius - float(ds.spectral_radius)) <= float(ds.spectral_radius_error)
    on_circle = case["structure"] == "symplectic" and abs(radius - 1) < 1e-20
    assert int(ds.verdict) == (1 if radius < 1 or on_circle else 0)


@pytest.mark.parametrize("number", [1, 40], ids=["points", "map"])
def test_small_multipliers_beside_huge_ones_are_in_order(number):
    """e^p, e^-1 exp(+-2i) and e^-20, of a system in coordinates of its own."""

    def A(t, p, out):
        out[0, 0], out[3, 3] = p[0], -20.0
        out[1, 1] = out[2, 2] = -1.0
        out[1, 2], out[2, 1] = 2.0, -2.0
        out[0, 3] = p[1] * math.cos(2 * math.pi * t)

    scene = survey.floquet(A, period=1.0, parameters=("p", "q"), states=("a", "b", "c", "d"))
    p = np.linspace(20.0, 24.0, 5 * number)
    q = np.linspace(0.0, 1.0, number)
    ds = survey.evaluate(scene, p=p, q=q, variables=["multiplier_re", "multiplier_im"])
    found = ds.multiplier_re + 1j * ds.multiplier_im
    bars = ds.multiplier_re_error + ds.multiplier_im_error
    right = [np.exp(-1 - 2j), np.exp(-1 + 2j), np.exp(-20.0)]
    assert (abs(found[..., 1:] - right) <= bars[..., 1:]).all()
    assert (abs(found[..., 0] - np.exp(ds.p)) <= bars[..., 0]).all()
    assert (bars[..., 1:] < 1e-3).all()


@pytest.mark.parametrize(
    "n, number", [(2, 100), (3, 60), (4, 60), pytest.param(6, 25, marks=pytest.mark.slow)]
)
def test_random_systems_in_turning_coordinates(n, number):
    check_random(n, number, seed=n)


@pytest.mark.slow
@pytest.mark.parametrize(
    "n, number", [(1, 5_000), (2, 40_000), (3, 20_000), (4, 20_000), (6, 10_000), (12, 1_000)]
)
def test_very_many_random_systems(n, number):
    check_random(n, number, seed=100 + n)


def check_random(n, number, seed):
    B = hard(n, number, seed)
    ds = evaluated(n, B)
    found = ds.multiplier_re.values + 1j * ds.multiplier_im.values
    undecided = 0
    for k in range(number):
        exact = multipliers(B[k])
        radius = max(abs(value) for value in exact)
        verdict = int(ds.verdict[k])
        assert int(ds.status[k]) == 0
        assert verdict in (-1, int(radius < 1))
        assert abs(radius - float(ds.spectral_radius[k])) <= float(ds.spectral_radius_error[k])
        assert matched(found[k], exact, ds.multiplier_re_error[k].values)
        # next to the edge, and where multipliers are defective or very sensitive, float64 may leave
        # it open
        undecided += verdict < 0 and k % 5 in (0, 1) and abs(radius - 1) > 1e-7
    assert undecided == 0


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_of_conjugates_of_a_map_the_negative_angle_comes_first(rtol):
    """Of modulus 0.009 beside a multiplier of 500: their bars are wider than rounding."""

    def A(t, p, out):
        out[0, 0], out[0, 1] = p[0] + 0.3 * math.cos(t), 0.5 * math.sin(t)
        out[1, 0], out[1, 1], out[1, 2] = 0.2, -0.75, p[1]
        out[2, 1], out[2, 2] = -p[1] + 0.3 * math.cos(t), -0.75

    scene = survey.floquet(A, period=2 * math.pi, parameters=("g", "a"), states=("x", "y", "z"))
    names, g, a = (
        ["multiplier_re", "multiplier_im"],
        np.linspace(0.9, 1.1, 40),
        np.linspace(0.3, 2.3, 60),
    )
    ds = survey.evaluate(scene, g=g, a=a, rtol=rtol, variables=names)
    im = ds.multiplier_im.values
    assert (im[..., 1] != 0).sum() > 2000 and not ((im[..., 1] > 0) & (im[..., 2] < 0)).any()
    other = survey.evaluate(scene, g=g[::8], a=a[::6], rtol=1e-9, variables=names, method="dop853")
    some = ds.isel(g=slice(None, None, 8), a=slice(None, None, 6))
    for name in names:
        bars = some[f"{name}_error"].astype(float) + other[f"{name}_error"]
        assert (abs(some[name] - other[name]) <= bars).all(), name


@pytest.mark.parametrize("rtol", [1e-12, 1e-10, 1e-7, 1e-5])
def test_mirror_images_of_huge_multipliers_are_in_order(rtol):
    ds = survey.evaluate("satellite_triaxial", direction="-1", A=0.3384699246342947, B=1.2516617395988563,
                         C=0.998397894253457, k=0.9999503168487293, rtol=rtol)  # fmt: skip
    found, bars = ds.multiplier_re.values, ds.multiplier_re_error.values
    assert (ds.multiplier_im == 0).all() and (np.diff(abs(found)) < 0).all()
    assert abs(found[0] * found[3] - 1) <= bars[0] / found[0] + bars[3] * found[0] + 1e-15
    assert abs(found[1] * found[2] - 1) < 1e-3 and (found[1:3] < 0).all()


@pytest.mark.parametrize("steps", [3, 7, 50])
def test_verdicts_do_not_depend_on_the_number_of_steps(steps):
    B = hard(4, 40, seed=1)
    fine = evaluated(4, B).verdict.values

    def A(t, p, out):
        out[:] = np.array(p, dtype=object).reshape(4, 4)

    points = monodromy.SystemPoints(System({"A": A}, 4, 2 * math.pi, (), False), B.reshape(40, 16))
    method = monodromy.method_of("auto")
    own = points.steps(method.floquet_reach(1e-10), np.ones(40), np.arange(40)).sum(axis=1)
    for sharp in (False, True):
        found = monodromy.solve(points, method, 1e-10, steps / own, np.arange(40), sharp)
        coarse = verdicts(Discs(found), found.M, found.E, False)
        assert ((coarse == fine) | (coarse < 0) | (fine < 0)).all()
    assert (coarse >= 0).any()


def mathieu(structure, **more):
    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = 2 * p[2]

    damped = {} if structure == "symplectic" else {"C": C}
    return survey.floquet(
        K=K,
        **damped,
        period=math.pi,
        parameters=("a", "q", "c"),
        states="x",
        structure=structure,
        **more,
    )


@pytest.mark.slow
def test_mathieus_map():
    axes = {"a": np.linspace(-0.507, 6.03, 60), "q": np.linspace(0.013, 4.1, 40)}
    ours = survey.evaluate(mathieu("symplectic"), **axes, c=0.0)
    known = survey.evaluate("mathieu", **axes)
    assert (ours.verdict == known.verdict).all()
    trace = ours.multiplier_re.sum("multiplier")
    bar = (
        ours.multiplier_re_error.sum("multiplier")
        + known.discriminant_error
        + 1e-12 * abs(known.discriminant)
    )
    assert (abs(trace - known.discriminant) <= bar).all()
    # l and 1 / conj(l), at every point
    product = ours.multiplier_re.prod("multiplier") - ours.multiplier_im.prod("multiplier")
    off = abs(product - 1)
    assert (off <= 1e-12 * abs(known.discriminant).clip(1)).all()
    stable = (ours.verdict == 1).values
    assert (np.sort(ours.krein.values[stable], axis=-1) == [-1, 1]).all()
    assert (ours.krein.values[~stable] == 0).all()
    sign = np.sign(known.discriminant)
    assert (ours.crossing.where(~stable) == xr_where(sign)).values[~stable].all()


def xr_where(sign):
    """The code of plus_one where D > 0, of minus_one where D < 0."""
    return (sign > 0) * 1 + (sign < 0) * 2


def test_damped_mathieu_from_mathieu():
    """y = exp(-c t) v turns y'' + 2 c y' + (a - 2 q cos 2t) y = 0 into Mathieu's equation at a - c^2."""
    a, q, c = np.linspace(0.0, 6.0, 50), np.linspace(0.0, 4.0, 30), 0.15
    ours = survey.evaluate(mathieu("none"), a=a, q=q, c=c)
    known = survey.evaluate("mathieu", a=a - c * c, q=q)
    exponent = known.exponent.values / math.pi - c  # known is the growth per period
    off = abs(ours.exponent.values - exponent)
    sure = known.verdict.values >= 0
    assert (off <= ours.exponent_error.values + known.exponent_error.values + 1e-13)[sure].all()
    agrees = (ours.verdict.values == (exponent < 0)) | (abs(exponent) < 1e-9)
    assert agrees.all()


def test_danbys_map():
    def A(t, p, out):
        mu, e = p
        s = math.sqrt(1 - 3 * mu * (1 - mu))
        r = 1 / (1 + e * math.cos(t))
        # canonical: X = xi' - eta, Y = eta' + xi
        out[0, 1], out[1, 0], out[0, 2], out[1, 3] = 1.0, -1.0, 1.0, 1.0
        out[2, 0], out[2, 3] = 1.5 * (1 + s) * r - 1.0, 1.0
        out[3, 1], out[3, 2] = 1.5 * (1 - s) * r - 1.0, -1.0

    scene = survey.floquet(
        A,
        period=2 * math.pi,
        parameters=("mu", "e"),
        states=("xi", "eta", "X", "Y"),
        structure="symplectic",
    )
    axes = {"mu": np.linspace(0.001, 0.0532, 41), "e": np.linspace(0.0, 0.7, 29)}
    ours, known = survey.evaluate(scene, **axes), survey.evaluate("libration_elliptic", **axes)
    decided = ours.verdict >= 0
    assert float(decided.mean()) > 0.99
    assert (ours.verdict == known.verdict).where(decided, True).all()
    # codes of minus_one and of collisions there, which asks for no others, and here
    same = {1: 2, 2: 4}
    stable = (known.verdict == 1).values & (ours.crossing > 1).values & (known.collision > 0).values
    assert stable.sum() > 50
    assert (
        np.vectorize(same.get)(known.collision.values[stable]) == ours.crossing.values[stable]
    ).all()


def test_sum_and_difference_resonances():
    """Yakubovich and Starzhinskii: symmetric coupling loses stability at w1 + w2, antisymmetric at
    w1 - w2.
    """
    w1, w2, eps = 1.3, 0.7, 0.05

    def scene(sign, period):
        def A(t, p, out):
            coupling = p[0] * math.cos(2 * math.pi / period * t)
            out[0, 2] = out[1, 3] = 1.0
            out[2, 0], out[3, 1] = -w1 * w1, -w2 * w2
            out[2, 1], out[3, 0] = coupling, sign * coupling

        structure = "symplectic" if sign > 0 else "reversible"
        return survey.floquet(
            A, period=period, parameters="eps", states=("x", "y", "u", "v"), structure=structure
        )

    sums, differences = 2 * math.pi / (w1 + w2), 2 * math.pi / (w1 - w2)
    verdicts = [
        int(survey.evaluate(scene(sign, period), eps=eps).verdict)
        for sign, period in ((1, sums), (1, differences), (-1, sums), (-1, differences))
    ]
    assert verdicts == [0, 1, 1, 0]


def test_meissner_with_breaks():
    """A square wave: its trace in closed form."""

    def K(t, p, out):
        out[0, 0] = p[0] + (p[1] if t < 1.0 else -p[1])

    scene = survey.floquet(
        K=K, period=2.5, parameters=("a", "b"), states="x", breaks=1.0, structure="symplectic"
    )
    a, b = np.linspace(1.0, 9.0, 23), np.linspace(0.0, 0.9, 11)
    ds = survey.evaluate(scene, a=a, b=b)
    p, q = np.sqrt(a[:, None] + b), np.sqrt(a[:, None] - b)
    trace = 2 * np.cos(p) * np.cos(1.5 * q) - (p / q + q / p) * np.sin(p) * np.sin(1.5 * q)
    found = ds.multiplier_re.sum("multiplier").values
    assert (abs(found - trace) <= ds.multiplier_re_error.sum("multiplier").values + 1e-13).all()
    assert ((ds.verdict.values == (abs(trace) < 2)) | (abs(abs(trace) - 2) < 1e-9)).all()


def test_constant_systems_and_one_state():
    def A(t, p, out):
        out[0, 0] = p[0] + p[1] * math.sin(t)

    ds = survey.evaluate(
        survey.floquet(A, period=2 * math.pi, parameters=("a", "b"), states="x"),
        a=[-0.2, 0.0, 0.1],
        b=[0.0, 3.0],
    )
    exact = np.exp(2 * math.pi * np.array([-0.2, 0.0, 0.1]))[:, None]
    assert (abs(ds.spectral_radius - exact) <= ds.spectral_radius_error + 1e-15 * exact).all()
    assert ds.verdict.values.tolist() == [[1, 1], [2, 2], [0, 0]]


def test_bits_do_not_depend_on_the_block():
    scene = mathieu("none")
    a, q = np.linspace(0, 5, 37), np.linspace(0, 3, 17)
    whole = survey.evaluate(scene, a=a, q=q, c=0.1)
    for i, k in ((0, 0), (36, 16), (17, 5)):
        one = survey.evaluate(scene, a=a[i], q=q[k], c=0.1)
        for name in whole.data_vars:
            assert np.array_equal(
                whole[name].isel(a=i, q=k).values, one[name].values, equal_nan=True
            )


def test_bars_next_to_the_largest_float_leave_the_verdict_open():
    """Where a thousand times the bars overflows, the eigenvalues of a matrix with infinities were
    asked for.
    """
    M, E = np.array([[[1.0, 0.5], [0.25, 1.0]]]), np.full((1, 2, 2), 1e306)
    assert verdicts(Discs(monodromy.Matrices.plain(M, E)), M, E, False).tolist() == [-1]


def test_even_and_odd_orders_of_a_series_may_differ():
    """A is small where its parts cancel, so that steps are long: with three of them the last bounds
    once alternated.
    """
    B = np.array([[[-4e-8, 1.00272], [-1.00272, -4e-8]]])
    ds = evaluated(2, B)
    assert int(ds.verdict[0]) == 1 and float(ds.spectral_radius_error[0]) < 1e-10


@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_satellites_map(body):
    """Librations in the angle am u, reversible and of period 2 pi: the same verdicts as the scene's."""

    def A(t, p, out):
        k, rho = p
        c = 1 - k * k if body == "prolate" else -k * k
        speed = 1 - k * k * math.sin(t) ** 2
        out[0, 1] = 1.0
        out[1, 0] = (
            -(2 * k * k * math.cos(t) ** 2 + 2 * rho * k * math.cos(t) + rho * rho + c) / speed
        )
        out[1, 1] = 0.5 * k * k * math.sin(2 * t) / speed

    names = {"parameters": ("k", "rho"), "states": ("y", "dy"), "structure": "reversible"}
    scene = survey.floquet(A, period=2 * math.pi, **names)
    axes = {"k": np.linspace(0.05, 0.93, 40), "rho": np.linspace(0.6, 3.1, 36)}
    ours, known = survey.evaluate(scene, **axes), survey.evaluate("satellite", **axes, body=body)
    assert (ours.verdict == known.verdict).all()
    trace = ours.multiplier_re.sum("multiplier")
    bar = ours.multiplier_re_error.sum("multiplier") + known.discriminant_error
    assert (abs(trace - known.discriminant) <= bar + 1e-13 * abs(known.discriminant)).all()


def two_oscillators(second, tilt=0.7):
    """Two Mathieu equations, the second's energy `second` (1, -1), in coordinates turned by a
    symplectic rotation.
    """
    c, s = math.cos(tilt), math.sin(tilt)
    turn = np.array([[c, s], [-s, c]])

    def A(t, p, out):
        k = [p[0] - 2 * p[1] * math.cos(2 * t), p[0] + p[2] - 2 * p[1] * math.cos(2 * t)]
        sign = (1, second)
        for i in range(2):
            for j in range(2):
                out[i, 2 + j] = sum(turn[m, i] * sign[m] * turn[m, j] for m in range(2))
                out[2 + i, j] = -sum(turn[m, i] * sign[m] * k[m] * turn[m, j] for m in range(2))

    names = {
        "parameters": ("a", "q", "off"),
        "states": ("x", "y", "u", "v"),
        "structure": "symplectic",
    }
    return survey.floquet(A, period=math.pi, **names)


@pytest.mark.parametrize("off", [0.0, 1e-15, 3e-13])
def test_multipliers_that_meet_with_one_krein_sign_are_stable(off):
    a, q = np.linspace(0.3, 3.3, 13), np.linspace(0.05, 0.5, 7)
    known = survey.evaluate("mathieu", a=a, q=q).verdict
    same = survey.evaluate(two_oscillators(1), a=a, q=q, off=off)
    assert (same.verdict == known).where(same.verdict >= 0, True).all()
    assert (same.verdict == 1).sum() > 0.9 * (known == 1).sum()
    stable = (same.verdict == 1).values
    assert (np.sort(same.krein.values[stable], axis=-1) == [-1, -1, 1, 1]).all()
    other = survey.evaluate(two_oscillators(-1), a=a, q=q, off=off)
    assert (known.where(other.verdict == 1, 1) == 1).all()
    # farther apart they are told from one another
    assert off > 1e-14 or not (other.verdict == 1).any()
    assert (other.verdict == -1).any()
    assert (other.krein.values[(other.verdict == -1).values] == 0).all()


def test_the_reason_of_a_cluster_is_reported():
    ds = survey.evaluate(two_oscillators(1), a=[2.0], q=[0.1], off=0.0)
    assert "Krein signs are the same" in str(ds.survey.point(a=2.0, q=0.1))


def test_small_multipliers_beside_huge_ones():
    """Where Mathieu's solutions grow by 1e4 and more, M tells nothing of what decays; the
    determinant does.
    """
    a, q, c = np.linspace(-30.0, -4.0, 25), np.linspace(0.1, 8.0, 19), 0.3
    ours = survey.evaluate(mathieu("none"), a=a, q=q, c=c)
    known = survey.evaluate("mathieu", a=a - c * c, q=q)
    mu, doubt = known.exponent.values, known.exponent_error.values
    exact = np.exp(-c * math.pi - mu) * np.sign(known.discriminant.values)
    off = abs(ours.multiplier_re.values[..., 1] - exact)
    bar = ours.multiplier_re_error.values[..., 1]
    assert (off <= bar + abs(exact) * np.expm1(doubt + 1e-14)).all()
    assert (bar <= 1e-10 * abs(exact)).mean() > 0.95
    assert np.median(mu) > 6 and ours.attrs["accuracy_missed"] == 0


def chained(known):
    """Three masses on a line, damped by their relative motion alone: the momentum of all is conserved."""

    def A(t, p, out):
        k = [p[0] + p[1] * math.cos(t), 0.7 * p[0]]
        for i in (0, 1):  # strains, then velocities
            out[i, 2 + i], out[i, 3 + i] = -1.0, 1.0
            for j, sign in ((2 + i, 1.0), (3 + i, -1.0)):
                out[j, i] += sign * k[i]
                out[j, 2 + i] -= sign * p[2]
                out[j, 3 + i] += sign * p[2]

    names = {"parameters": ("k", "e", "c"), "states": ("s", "r", "u", "v", "w")}
    return survey.floquet(A, period=2 * math.pi, **names, conserved=known)


def test_a_conserved_quantity_is_not_judged():
    axes = {"k": np.linspace(0.4, 2.5, 9), "e": np.linspace(0.0, 1.0, 7), "c": 0.02}
    plain = survey.evaluate(chained(None), **axes)
    ours = survey.evaluate(
        chained((0, 0, 1, 1, 1)), **axes, variables=["multiplier_re", "verdict", "spectral_radius"]
    )
    assert not (plain.verdict == 1).any()  # the momentum's multiplier is 1
    assert set(np.unique(ours.verdict)) == {0, 1}
    assert (ours.verdict == 0).where(plain.verdict == 0, True).all()
    assert ours.sizes["multiplier"] == 4 and plain.sizes["multiplier"] == 5
    # the same masses seen from the middle one: relative velocities alone, nothing is conserved

    def relative(t, p, out):
        k = [p[0] + p[1] * math.cos(t), 0.7 * p[0]]
        out[0, 2] = out[1, 3] = 1.0
        for i, j in ((0, 1), (1, 0)):
            out[2 + i, i], out[2 + i, j] = -2.0 * k[i], k[j]
            out[2 + i, 2 + i], out[2 + i, 2 + j] = -2.0 * p[2], p[2]

    names = {"parameters": ("k", "e", "c"), "states": ("s", "r", "ds", "dr")}
    other = survey.evaluate(survey.floquet(relative, period=2 * math.pi, **names), **axes)
    assert (ours.verdict == other.verdict).all()
    off = abs(ours.spectral_radius - other.spectral_radius)
    assert (off <= ours.spectral_radius_error + other.spectral_radius_error).all()
    with pytest.raises(survey.BadInput, match="changes by"):
        survey.evaluate(chained((0, 0, 1, 1, 0)), **axes)
    with pytest.raises(survey.BadInput, match="there are 5 states"):
        chained((1, 1))


@pytest.mark.parametrize("power", [-0.5, -1.5])
def test_a_root_in_a_denominator_has_its_series(power):
    """The derivative of y = sqrt x is made of 1 / y, which needs y: y'' + a x^power y = 0."""

    def A(t, p, out):
        x = 1.2 + math.cos(t) ** 2
        out[0, 1] = 1.0
        out[1, 0] = -p[0] / (math.sqrt(x) if power == -0.5 else math.sqrt(x) * x)

    own = survey.floquet(
        A, period=math.pi, parameters=("a",), states=("x", "v"), structure="symplectic"
    )
    a = np.linspace(0.5, 3.0, 5)
    one, other = (
        survey.evaluate(own, a=a, method=method, variables=["monodromy"])
        for method in ("taylor16", "dop853")
    )
    bars = one.monodromy_error + other.monodromy_error
    assert (abs(one.monodromy - other.monodromy) <= bars).all() and bars.max() < 1e-8


@pytest.mark.parametrize("structure", ["symplectic", "reversible"])
def test_a_structure_that_fails_between_the_points_that_are_checked_proves_nothing(structure):
    """Damping that vanishes at the ends and in the middle of the axis: there alone is A what it is
    said to be.
    """

    def A(t, p, out):
        out[0, 1], out[1, 0] = 1.0, -1.0 - p[0] - 0.3 * np.cos(2 * t)
        out[1, 1] = -p[1] * p[0] * (2.0 - p[0]) * (1.0 - p[0])

    scene = survey.floquet(
        A, period=np.pi, parameters=("a", "c"), states=("x", "v"), structure=structure
    )
    for number in (5, 101):  # points for themselves, and series
        ds = survey.evaluate(scene, a=np.linspace(0.0, 2.0, number), c=np.linspace(0.0, 0.2, 41))
        true = (ds.a * (2.0 - ds.a) * (1.0 - ds.a) * ds.c == 0.0).transpose(*ds.status.dims)
        assert ((ds.status == 1) == ~true).all() and (ds.verdict.where(~true, -1) == -1).all()
        assert (ds.verdict.where(true, 1) != -1).all()


def test_a_hamiltonian_matrix_that_is_none_and_what_is_not_conserved_are_found_by_the_monodromy():
    def A(t, p, out):  # the trace is 0
        out[0, 2] = out[1, 3] = 1.0
        out[2, 0], out[3, 1], out[3, 0] = -1.0 - 0.2 * np.cos(t), -2.3, 0.3
        out[2, 1] = 0.3 + 0.2 * p[0] * (2.0 - p[0]) * (1.0 - p[0])

    own = survey.floquet(
        A, period=2 * np.pi, parameters="a", states=("x", "y", "u", "v"), structure="symplectic"
    )
    for number in (7, 301):
        ds = survey.evaluate(own, a=np.linspace(0.0, 2.0, number))
        assert ds.a.values[ds.status.values == 0].tolist() == [0.0, 1.0, 2.0]

    def B(t, p, out):
        out[0, 1], out[1, 0], out[1, 1] = 1.0, -1.0 - 0.5 * np.cos(t), -0.1
        out[2, 2] = 0.1 * p[0] * (2.0 - p[0]) * (1.0 - p[0])

    own = survey.floquet(
        B, period=2 * np.pi, parameters="a", states=("x", "v", "w"), conserved=(0, 0, 1)
    )
    ds = survey.evaluate(own, a=np.linspace(0.0, 2.0, 9))
    assert (
        ds.status.values.tolist() == [0, 1, 1, 1, 0, 1, 1, 1, 0]
        and (ds.verdict == ds.status.where(ds.status == 0, -2) + 1).all()
    )
