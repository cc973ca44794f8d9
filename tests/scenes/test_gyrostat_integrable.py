"""The integrable cases by the paper's constants: reference values, mpmath, exact separatrices."""

import json
import math
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest
from flow_truth import exact

import survey
from survey.status import INVALID_PARAMETERS

REFERENCE = json.loads((files("survey.reference") / "gyrostat.json").read_text())
REST, ROTATION, LIBRATION = 0, 1, 2
ROUNDING = 4e-15  # of decimal inputs


def solved(case, **given):
    return survey.evaluate("gyrostat_integrable", case=case, **given)


def holds(ds, name, value, extra=0.0):
    """Is the true value within the bar (and what the decimal inputs miss)?"""
    return abs(mp.mpf(float(ds[name])) - value) <= float(ds[f"{name}_error"]) + extra


@pytest.mark.parametrize("row", REFERENCE["closed50"], ids=lambda row: row["case"])
def test_reference_cases_of_50(row):
    ds = solved(
        "inclined",
        **{name: float(row[name]) for name in ("A11", "B12", "B31", "theta0", "n", "phi0", "t")},
    )
    assert all(holds(ds, name, mp.mpf(row[name]), ROUNDING) for name in ("phi", "w"))
    assert (
        ds.verdict == (ROTATION if row["case"].startswith("1") else REST) and ds.phi_error < 1e-12
    )


@pytest.mark.parametrize("row", REFERENCE["trig61"], ids=lambda row: f"mu={row['mu']}")
def test_reference_cases_of_61(row):
    root = "upper" if float(row["mu"]) >= 0.5 else "lower"
    names = {"B12": "b12", "B31": "b31", "C23": "c23", "S2": "s2"}
    given = {name: float(row[key]) for name, key in names.items()}
    ds = solved("trigonometric", root=root, phi0=float(row["phi0"]), t=float(row["t"]), **given)
    values = {"phi": "phi_t", "mu": "mu", "n_star": "n", "C22_minus_C33": "d", "S3": "s3"}
    assert all(holds(ds, name, mp.mpf(row[key]), 1e-14) for name, key in values.items())
    # where both roots are one, rounding moves them
    assert ds.phi_error < (1e-12 if row["mu"] != "0.5" else 1e-6)


@pytest.mark.parametrize(
    "row", REFERENCE["elliptic"] + REFERENCE["multiple_root"], ids=lambda row: row["t"]
)
def test_reference_cases_of_64(row):
    _b12, _b31, d, c23, s2, s3 = map(float, row["p"])
    ds = solved(
        "elliptic",
        C22=d,
        C23=c23,
        S2=s2,
        S3=s3,
        **{name: float(row[name]) for name in ("phi0", "w0", "t")},
    )
    assert holds(ds, "phi", mp.mpf(row["phi"]), 1e-11) and holds(ds, "w", mp.mpf(row["w"]), 1e-11)
    assert holds(ds, "energy", mp.mpf(row["n"]), ROUNDING)
    for name in ("g2", "g3", "G"):
        assert name not in row or holds(ds, name, mp.mpf(row[name]), 1e-14 * abs(float(row[name])))
    for i, value in enumerate(row.get("a", ())):
        assert abs(ds.a[i] - float(value)) <= ds.a_error[i] + ROUNDING


def test_case_A_against_its_formula():
    random, worst = np.random.default_rng(1), 0.0
    for _ in range(20):
        A11, theta0 = random.uniform(0.3, 3), random.uniform(0.1, 3.0)
        B12, B31, k, lambda1 = random.normal(size=4)
        phi0, t = random.uniform(-3, 3), random.uniform(0, 3)
        ds = solved(
            "inclined",
            A11=A11,
            theta0=theta0,
            B12=B12,
            B31=B31,
            k=k,
            lambda1=lambda1,
            phi0=phi0,
            t=t,
        )
        with mp.workdps(40):
            A11, theta0, B12, B31, k, lambda1, phi0 = map(
                mp.mpf, (A11, theta0, B12, B31, k, lambda1, phi0)
            )
            p, q = B12 * mp.sin(theta0) / A11, B31 * mp.sin(theta0) / A11
            n = (k / mp.cos(theta0) - lambda1) / A11
            true = exact(
                [p, q, 0, 0, 0, 0],
                phi0,
                p * mp.sin(phi0) + q * mp.cos(phi0) + n,
                t,
                40,
                float_out=False,
            )
            delta2 = n * n - p * p - q * q
            assert (
                holds(ds, "phi", true[0])
                and holds(ds, "w", true[1])
                and holds(ds, "delta2", delta2)
            )
            assert ds.verdict == (ROTATION if delta2 > 0 else REST)
            if delta2 > 0:
                assert holds(ds, "period", 2 * mp.pi / mp.sqrt(delta2))
            else:
                limit = mp.mpf(float(ds.phi_limit))
                assert abs(p * mp.sin(limit) + q * mp.cos(limit) + n) < 1e-13 * (
                    abs(p) + abs(q) + abs(n)
                )
                assert p * mp.cos(limit) - q * mp.sin(limit) < 0
        worst = max(worst, float(ds.phi_error) / (1 + abs(float(ds.phi))))
    assert worst < 1e-9


@pytest.mark.parametrize("root", [pytest.param("upper", marks=pytest.mark.slow), "lower"])
def test_61_solves_57(root):
    """Against Taylor series of (57) with the constants that (60) demands, in 40 digits."""
    random, seen = np.random.default_rng(2), 0
    for _ in range(40):
        A11 = random.uniform(0.3, 3)
        B12, B31, C23, S2 = random.normal(size=4)
        phi0, t = random.uniform(-3, 3), random.uniform(-1, 1)
        ds = solved(
            "trigonometric", root=root, A11=A11, B12=B12, B31=B31, C23=C23, S2=S2, phi0=phi0, t=t
        )
        with mp.workdps(40):
            A11, B12, B31, C23, S2, phi0 = map(mp.mpf, (A11, B12, B31, C23, S2, phi0))
            inner = mp.mpf(1) / 4 - A11 * C23 / (B12 * B31)
            if inner < 0:
                assert ds.status == INVALID_PARAMETERS and np.isnan(ds.phi)
                continue
            d, S3 = C23 * (B12**2 - B31**2) / (B12 * B31), S2 * B31 / B12
            mu = mp.mpf(1) / 2 + (1 if root == "upper" else -1) * mp.sqrt(inner)
            w0 = mu * (B31 * mp.cos(phi0) + B12 * mp.sin(phi0) - S2 * B31 / C23) / A11
            six = [B12 / A11, B31 / A11, d / A11, C23 / A11, S2 / A11, S3 / A11]
            phi, w = exact(six, phi0, w0, t, 40, float_out=False)
            assert holds(ds, "phi", phi) and holds(ds, "w", w) and holds(ds, "mu", mu)
            assert (
                holds(ds, "C22_minus_C33", d) and holds(ds, "S3", S3) and holds(ds, "w_start", w0)
            )
            seen += 1
    assert seen > 10


@pytest.mark.slow
def test_b_0_against_the_quartic():
    """a_i, invariants, roots and period in 40 digits from the paper's formulas, and the motion by
    Taylor series.
    """
    random, kinds = np.random.default_rng(3), set()
    for _ in range(40):
        given = dict(
            zip(("C22", "C33", "C23", "S2", "S3", "w0"), random.normal(size=6), strict=True)
        )
        given |= {
            "A11": random.uniform(0.3, 3),
            "phi0": random.uniform(-3, 3),
            "t": random.uniform(-3, 3),
        }
        ds = solved("elliptic", **given)
        with mp.workdps(40):
            own = {name: mp.mpf(value) for name, value in given.items()}
            A11, phi0, w0 = own["A11"], own["phi0"], own["w0"]
            d, c, s2, s3 = (
                x / A11 for x in (own["C22"] - own["C33"], own["C23"], own["S2"], own["S3"])
            )
            n = (
                w0**2
                - d / 2 * mp.cos(2 * phi0)
                + c * mp.sin(2 * phi0)
                - 2 * s2 * mp.sin(phi0)
                - 2 * s3 * mp.cos(phi0)
            )
            a = [d / 2 + n - 2 * s3, s2 + c, (2 * n - 3 * d) / 6, s2 - c, d / 2 + n + 2 * s3]
            for i, value in enumerate(a):
                assert abs(mp.mpf(float(ds.a[i])) - value) <= float(ds.a_error[i])
            g2 = a[0] * a[4] - 4 * a[1] * a[3] + 3 * a[2] ** 2
            g3 = (
                a[0] * a[2] * a[4]
                + 2 * a[1] * a[2] * a[3]
                - a[2] ** 3
                - a[4] * a[1] ** 2
                - a[0] * a[3] ** 2
            )
            assert (
                holds(ds, "g2", g2) and holds(ds, "g3", g3) and holds(ds, "G", g2**3 - 27 * g3**2)
            )
            rows = [a[0], 4 * a[1], 6 * a[2], 4 * a[3], a[4]]
            for z in mp.polyroots(rows, 200, extraprec=200):
                gaps = [
                    abs(mp.mpc(float(x), float(y)) - z)
                    for x, y in zip(ds.root_re, ds.root_im, strict=True)
                ]
                assert min(gaps) <= float(ds.root_re_error[int(np.argmin(gaps))]) + float(
                    ds.root_im_error[int(np.argmin(gaps))]
                )
            phi, w = exact([0, 0, d, c, s2, s3], phi0, w0, own["t"], 40, float_out=False)
            assert holds(ds, "phi", phi) and holds(ds, "w", w)
            T = mp.mpf(float(ds.period))
            back = exact([0, 0, d, c, s2, s3], phi0, w0, T, 40, float_out=False)
            turn = 2 * mp.pi * mp.sign(w0) if ds.verdict == ROTATION else 0
            slope = abs(d) + 2 * abs(c) + abs(s2) + abs(s3)
            assert abs(back[0] - phi0 - turn) <= abs(w0) * float(ds.period_error) * 1.01 + 1e-30
            assert abs(back[1] - w0) <= slope * float(ds.period_error) + 1e-30
            kinds.add(int(ds.verdict))
    assert kinds == {ROTATION, LIBRATION}


def test_an_elliptic_motion_by_its_quartic():
    """The same motion by (62)-(63) and by its a_i."""
    one = solved("elliptic", C22=1.1, C23=0.3, S2=0.5, S3=-0.2, phi0=0.3, w0=2.0, t=1.5)
    given = dict(zip(("a0", "a1", "a2", "a3", "a4"), one.a.values, strict=True))
    two = solved("quartic", **given, phi0=0.3, t=1.5)
    for name in ("phi", "w", "period", "g2", "g3", "G", "w_start"):
        assert abs(one[name] - two[name]) <= one[f"{name}_error"] + two[f"{name}_error"], name
    back = solved("quartic", **given, phi0=0.3, t=-1.5, direction="-1")  # b = 0: reversible
    assert abs(back.w + two.w) <= 2 * two.w_error and abs(back.phi - two.phi) <= 2 * two.phi_error


U, R3 = np.linspace(-6.0, 6.0, 7), math.sqrt(3.0)
SEPARATRICES = {  # (a0 ... a4), u0, u(t): (66), all with u' > 0 at t = 0
    "two double roots": ((3.0, 0.0, -1.0, 0.0, 3.0), 0.25, lambda t, u: math.tanh(R3 * t / 2 + math.atanh(u))),
    "a double root, c > 0": ((1.0, 0.0, 0.25, 0.0, 0.0), 0.5, None),
    "a triple root": ((1.0, 1.0, 0.0, 0.0, 0.0), 0.5, None),
    "a quadruple root": ((1.0, 0.0, 0.0, 0.0, 0.0), 0.5, lambda t, u: 1.0 / (1.0 / u - t / 2)),
    "a double root at phi = pi": ((0.0, 0.0, 0.5, 0.0, 3.0), 0.5, lambda t, u: math.sinh(math.asinh(u) + R3 * t / 2)),
}  # fmt: skip


@pytest.mark.parametrize("name", SEPARATRICES)
def test_solutions_on_separatrices_are_exact(name):
    a, u0, truth = SEPARATRICES[name]
    phi0 = 2.0 * math.atan(u0)
    ds = solved(
        "quartic", **dict(zip(("a0", "a1", "a2", "a3", "a4"), a, strict=True)), phi0=phi0, t=U
    )
    assert (ds.status == 0).all() and (ds.verdict == REST).all() and ds.phi_error.max() < 1e-12
    assert abs(float(ds.G[0])) <= float(ds.G_error[0]) and np.isnan(ds.period).all()
    turn = 2 * np.pi
    if truth:
        gap = ds.phi.values - 2.0 * np.arctan([truth(t, math.tan(0.5 * phi0)) for t in U])
        assert (np.abs(gap - turn * np.round(gap / turn)) <= ds.phi_error + 1e-14).all()
    u = np.tan(0.5 * ds.phi.values)
    # w^2 = P4(u) / (1 + u^2)^2
    square = np.polyval(np.array(a) * [1, 4, 6, 4, 1], u) / (1 + u * u) ** 2
    assert (
        np.abs(ds.w**2 - square) <= 2 * np.abs(ds.w) * ds.w_error + 8 * ds.phi_error + 1e-14
    ).all()


@pytest.mark.parametrize("method", ["auto", "closed"])
def test_ordinary_starts_exactly_on_a_separatrix(method):
    """The pendulum from phi0 = 0 with w0 = 2; one bit beside it is a rotation or a libration."""
    t = np.linspace(-20.0, 20.0, 9)
    ds = survey.evaluate("gyrostat", question="trajectory", method=method, s3=1.0, w0=2.0, t=t)
    truth = [float(4 * mp.atan(mp.exp(x)) - mp.pi) for x in t]
    assert (
        (ds.status == 0).all()
        and (np.abs(ds.phi - truth) <= ds.phi_error + 4e-16).all()
        and ds.phi_error.max() < 1e-14
    )
    abel = survey.evaluate(
        "gyrostat", question="abel", method=method, s3=1.0, w0=-2.0, phi=[-3.0, 0.5, -3.5]
    )
    # runs into the saddle
    assert abel.status.values.tolist()[:2] == [0, 0] and abel.status.values[2] == 17
    assert (
        abs(abel.t[0] - float(mp.log(mp.tan((mp.mpf(3) + mp.pi) / 4)))) <= abel.t_error[0] + 1e-14
    )
    beside = [
        solved("elliptic", S3=1.0, w0=w0).verdict.item()
        for w0 in (np.nextafter(2, 0), 2.0, np.nextafter(2, 3))
    ]
    assert beside[1] == REST and REST not in beside[::2]


def test_what_is_no_solution_is_invalid():
    assert solved("trigonometric", B12=1.0, B31=1.0, C23=0.0, S2=1.0).status == INVALID_PARAMETERS
    assert solved("trigonometric", B12=1.0, B31=1.0, C23=1.0, S2=1.0).status == INVALID_PARAMETERS
    assert solved("quartic", a0=-1.0, a1=0.0, a2=0.0, a3=0.0, a4=-1.0).status == INVALID_PARAMETERS
    with pytest.raises(survey.BadInput, match="n and k specify the same"):
        solved("inclined", B12=1.0, B31=1.0, theta0=1.0, n=1.0, k=1.0)


def test_a_motion_can_be_drawn():
    ds = solved("elliptic", C22=1.1, S2=0.5, w0=1.0)
    motion = ds.survey.trajectory(figure=False)
    assert (
        float(motion.phi[0]) == 0.0
        and float(motion.w[0]) == 1.0
        and "period" in str(ds.survey.point())
    )


def test_the_root_is_refused_where_it_has_no_effect():
    given = {
        "A11": 2.0,
        "C22": 0.4,
        "C33": 0.1,
        "C23": 0.2,
        "S2": 0.1,
        "S3": 0.3,
        "w0": 0.5,
        "t": 1.0,
    }
    with pytest.raises(survey.BadInput, match="root exists only with case = trigonometric"):
        survey.evaluate("gyrostat_integrable", case="elliptic", root="lower", **given)
    assert survey.evaluate("gyrostat_integrable", case="elliptic", **given).status == 0
