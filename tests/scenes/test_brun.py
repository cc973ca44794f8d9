"""Brun's problem: reference values, and what is known of the motion (`brun.md`)."""

import json
from importlib.resources import files

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey.errors import BadInput
from survey.status import INVALID_PARAMETERS

REFERENCE = json.loads((files("survey.reference") / "brun.json").read_text())
cases = pytest.mark.parametrize(
    "case", REFERENCE["cases"], ids=[case["id"] for case in REFERENCE["cases"]]
)
FREE = {
    "epsilon": 0.0,
    "A": 2.0,
    "C": 1.0,
    "theta0": 1.1,
    "p_theta0": 0.5,
    "p_psi": 1.3,
    "p_phi": 0.9,
}
VALUES = {"u_min": "u_min", "u_max": "u_max", "period": "nutation_period_T", "precession": "delta_psi_per_T",
          "spin": "delta_phi_per_T"}  # fmt: skip


def scaled(sign=1, variables=None, **parameters):
    """At scaled integrals that share one dimension."""
    wide = np.broadcast_arrays(*(np.atleast_1d(value) for value in parameters.values()))
    arrays = {
        key: xr.DataArray(value.copy(), dims="point")
        for key, value in zip(parameters, wide, strict=True)
    }
    return survey.evaluate("brun", sign=str(sign), variables=variables, **arrays)


def within(value, exact, bar):
    return abs(mpf(float(value)) - mpf(exact)) <= float(bar)


def state_of(case):
    point = {key: float.fromhex(value) for key, value in case["inputs_hex"].items()}
    return point | {"epsilon": point.pop("eps")}


@cases
@pytest.mark.parametrize("method", ["auto", "carlson", "chebyshev"])
def test_reference_periods(case, method):
    ds = survey.evaluate("brun", method=method, **state_of(case))
    if method == "chebyshev" and ds.status != 0:
        pytest.skip("too near a separatrix or a pole for so many nodes")
    with mp.workdps(40):
        for name, key in VALUES.items():
            assert within(ds[name], case[key], ds[f"{name}_error"]), name
    cond = case["conditioning_double"]
    assert int(ds.wells) == case["n_wells"] and int(ds.verdict) == 1
    if method == "auto":
        assert float(ds.period_error / ds.period) < 100 * max(float(cond["T_rel"]), 1e-15)
        assert float(ds.precession_error) < 100 * max(float(cond["delta_psi_abs"]), 1e-15)


@cases
def test_reference_states(case):
    times = np.array([float.fromhex(state["t_hex"]) for state in case["states"]])
    ds = survey.evaluate("brun", t=times, **state_of(case))
    with mp.workdps(40):
        for i, state in enumerate(case["states"]):
            now = ds.isel(t=i)
            for name, key in (("u", "u"), ("psi", "psi_unwrapped"), ("phi", "phi_unwrapped")):
                assert within(now[name], state[key], now[f"{name}_error"]), (name, i)
    assert float(ds.u_error.max()) < 100 * max(
        float(case["conditioning_double"]["u_at_first_t_abs"]), 1e-15
    )


@pytest.mark.parametrize("row", REFERENCE["bifurcation_points"], ids=lambda row: row["label"])
def test_regular_precessions(row):
    """(S8), (S9): T -> 2 pi / omega_n at a stable one, the separatrix at an unstable one."""
    k, L, a, b, square = (
        float(row[key]) for key in ("k", "L", "p_phi", "p_psi", "A2_omega_n_squared")
    )
    size = abs(k)
    ds = scaled(
        int(np.sign(k)),
        l=L / size + (1e-13 if square > 0 else 0.0),
        alpha=a / size**0.5,
        beta=b / size**0.5,
    )
    if square < 0:
        assert abs(float(ds.separatrix_distance[0])) < 1e-15
    else:
        well = int(np.nanargmin(abs(ds.u_min[0] - float(row["u0"]))))
        assert abs(float(ds.period[0, well]) / (2 * np.pi) * (square / size) ** 0.5 - 1) < 1e-6


def random_integrals(number, seed):
    random = np.random.default_rng(seed)
    return {
        "l": random.uniform(0.0, 4.0, number),
        "alpha": random.normal(size=number),
        "beta": random.normal(size=number),
    }


@pytest.mark.parametrize("sign", [1, -1])
def test_duality(sign):
    """p_psi <-> p_phi at the same L: T stays, the precession and the reduced spin change places."""
    given = random_integrals(300, 1)
    one = scaled(sign, ratio=1.0, **given)  # C = A: the spin is the reduced one
    other = scaled(sign, ratio=1.0, **given | {"alpha": given["beta"], "beta": given["alpha"]})
    for name, dual in (("period", "period"), ("precession", "spin")):
        off = abs(one[name] - other[dual])
        assert (
            (off <= one[f"{name}_error"] + other[f"{dual}_error"])
            .where(one[name].notnull(), True)
            .all()
        )
    assert int(one.period.notnull().sum()) > 100


def test_two_wells():
    """Both have the same period; the advances differ by multiples of pi."""
    random = np.random.default_rng(2)
    given = {
        "l": random.uniform(-1.0, 0.5, 4000),
        "alpha": random.normal(size=4000) / 4,
        "beta": random.normal(size=4000) / 4,
    }
    ds = scaled(1, ratio=1.0, **given)
    two = ds.where(ds.wells == 2, drop=True)
    assert two.sizes["point"] > 100 and (two.separatrix_distance < 0).all()
    assert (two.u_max[:, 0] < two.u_min[:, 1]).all()
    near, far = np.sign(two.beta - two.alpha), np.sign(two.beta + two.alpha)
    for name, exact in (
        ("period", 0.0),
        ("precession", np.pi * (near - far)),
        ("spin", -np.pi * (near + far)),
    ):
        off = abs(two[name][:, 1] - two[name][:, 0] - exact)
        assert (off <= two[f"{name}_error"].sum("well") + 1e-15).all(), name


def test_scaling():
    """The same motion from an initial state and from its scaled integrals."""
    point = FREE | {"epsilon": 0.6}
    k = 0.6 * 2.0 * 1.0
    x = (1.3 - 0.9 * np.cos(1.1)) / np.sin(1.1)
    L = 0.25 + x * x - k * np.cos(1.1) ** 2 + 0.81
    one = survey.evaluate("brun", **point)
    other = survey.evaluate("brun", l=L / k, alpha=0.9 / k**0.5, beta=1.3 / k**0.5, ratio=0.5).isel(
        well=0
    )
    for name, unit in (
        ("period", 2.0 / k**0.5),
        ("precession", 1.0),
        ("spin", 1.0),
        ("action", k**0.5),
        ("u_max", 1.0),
    ):
        assert abs(float(one[name]) - float(other[name]) * unit) < 1e-13, name


@pytest.mark.parametrize(
    ("sign", "l", "alpha", "beta"), [(1, 1.5, 0.7, 0.4), (1, 0.1, 0.1, 0.15), (-1, 2.5, -0.8, 1.1)]
)
def test_action_derivatives(sign, l, alpha, beta):  # noqa: E741
    """dJ/dL = T/(4 pi A), dJ/db = -Delta_psi/(2 pi), dJ/da = -Delta_phi/(2 pi) (at the same L: reduced)."""
    h, steps = 1e-3, np.array([-2, -1, 1, 2])
    centre = scaled(sign, ratio=1.0, l=l, alpha=alpha, beta=beta).isel(point=0, well=0)
    for name, exact in (("l", centre.period / (4 * np.pi)), ("beta", -centre.precession / (2 * np.pi)),
                        ("alpha", -centre.spin / (2 * np.pi))):  # fmt: skip
        point = {"l": np.full(4, l), "alpha": np.full(4, alpha), "beta": np.full(4, beta)}
        point[name] = point[name] + h * steps
        j = scaled(sign, **point).action[:, 0].values
        assert abs((8 * (j[2] - j[1]) - (j[3] - j[0])) / (12 * h) - float(exact)) < 1e-8, name


@pytest.mark.parametrize(
    "change", [{}, {"epsilon": 0.7, "C": 2.0}, {"p_phi": 2.9}, {"p_phi": -0.3}, {"p_psi": -3.0}]
)
def test_without_field(change):
    """Delta_psi = pi [sgn(b-a) + sgn(b+a)], T = 2 pi A / sqrt L."""
    point = FREE | change
    ds = survey.evaluate("brun", **point)
    a, b = point["p_phi"], point["p_psi"]
    x = (b - a * np.cos(1.1)) / np.sin(1.1)
    turns = np.sign(b - a), np.sign(b + a)
    assert float(ds.precession) == np.pi * sum(turns)
    assert abs(float(ds.period) / (4 * np.pi) * np.sqrt(0.25 + x * x + a * a) - 1) < 1e-15
    drift = a * (1 / point["C"] - 0.5) * float(ds.period)
    assert abs(float(ds.spin) - drift - np.pi * (turns[1] - turns[0])) < 1e-14


def test_small_field():
    """Mean psi' = -(eps (A - C)/2) b (3 a^2 - G^2)/G^4 for |a| > |b|, however small: G = J + |a|."""
    ds = survey.evaluate("brun", **FREE | {"epsilon": 1e-16, "p_psi": 0.5, "p_phi": 1.5})
    g = float(ds.action) + 1.5
    rate = -0.5e-16 * 0.5 * (3 * 1.5**2 - g * g) / g**4
    assert abs(float(ds.precession / ds.period) / rate - 1) < 1e-13


def test_logarithmic_slopes():
    """T grows as ln(1/d)/Lambda within a well and twice that outside; Lambda = 1 at the saddle u =
    0 of a = b = 0.
    """
    for side, last, slope in ((-1, 250, 1), (1, 24, 2)):
        depth = 10.0 ** -np.arange(6, last, 3)
        ds = scaled(1, l=side * depth, alpha=0.0, beta=0.0)
        assert (ds.wells == (2 if side < 0 else 1)).all() and (
            ds.separatrix_distance == side * depth
        ).all()
        assert abs(np.diff(ds.period[:, 0]) / (3 * np.log(10)) - slope).max() < 1e-5


def test_jump_at_a_pole():
    """The advances jump by 2 pi where b - a changes its sign on motions that pass u = 1, and take
    the mean there.
    """
    beta = 0.5 * (1 + np.array([-1e-12, 0.0, 1e-12]))
    for sign in (1, -1):
        ds = scaled(sign, l=np.full(3, 1.7), alpha=np.full(3, 0.5), beta=beta, ratio=1.0).isel(
            well=0
        )
        assert ds.verdict.values.tolist() == [1, 3, 1] and float(ds.u_max[1]) == 1.0
        for name, jump in (("precession", 2 * np.pi), ("spin", -2 * np.pi)):
            low, middle, high = ds[name].values
            assert abs(high - low - jump) < 1e-10 and abs(middle - (low + high) / 2) < 1e-10


def test_monodromy():
    """Round the thread a = b = p, L = p^2 - k (k < 0, p^2 < 4 |k|) the precession comes back 2 pi off."""
    turn = np.linspace(0, 2 * np.pi, 4001) + 0.1
    p = 0.45
    alpha, beta = np.full(turn.size, p), p + 0.05 * np.cos(turn)
    ds = scaled(
        -1, l=alpha * beta + 1 + 0.05 * np.sin(turn), alpha=alpha, beta=beta, ratio=1.0
    ).isel(well=0)
    for name in ("precession", "spin"):
        steps = np.diff(ds[name].values)
        jumps = abs(steps) > np.pi
        assert (
            jumps.sum() == 1
            and abs(steps.sum()) < 1e-9
            and abs(abs(steps[jumps][0]) - 2 * np.pi) < 0.01
        ), name


def test_cusps():
    """On the curve of triple roots the saddle is born: inside there is a separatrix, outside there
    is none.
    """
    u = np.linspace(-0.33, 0.33, 41)
    minus, plus = np.sqrt((1 - u) ** 3 * (1 + 3 * u)), np.sqrt((1 + u) ** 3 * (1 - 3 * u))
    a, b = (plus - minus) / 2, (plus + minus) / 2
    inside, outside = (
        scaled(1, l=1 - 6 * u * u, alpha=f * a, beta=f * b) for f in (1 - 1e-6, 1 + 1e-6)
    )
    assert inside.separatrix_distance.notnull().all() and outside.separatrix_distance.isnull().all()


@pytest.mark.parametrize(
    ("sign", "l", "alpha", "beta", "verdict", "status", "u"),
    [
        (1, 0.0, 0.0, 0.0, 0, 0, None),  # the saddle on the equator
        (1, 0.25, 0.5, 0.0, 0, 0, None),  # the unstable regular precession there
        (-1, 1.25, 0.5, 0.5, 0, 0, None),  # the unstable upright rotation
        (1, 4.0, 2.0, 0.0, 2, 0, 0.0),  # the stable regular precession on the equator
        (1, 3.0, 2.0, 2.0, 2, 0, 1.0),  # the upright rotation
        (1, 3.0, 2.0, -2.0, 2, 0, -1.0),
        (1, 3.5, 2.0, 2.0, 3, 0, None),
        (1, 1.0, 1.5, 0.2, -1, 16, None),  # below the least effective potential
    ],
)
def test_exact_cases(sign, l, alpha, beta, verdict, status, u):  # noqa: E741
    ds = scaled(sign, l=l, alpha=alpha, beta=beta).isel(point=0)
    assert (int(ds.verdict), int(ds.status)) == (verdict, status)
    if u is not None:
        assert (
            float(ds.u_min[0]) == float(ds.u_max[0]) == u
            and float(ds.action[0]) == 0.0
            and ds.period[0] > 0
        )
    if verdict <= 0:
        assert ds.period.isnull().all()


def test_more_periods_than_an_integer_holds():
    """Beside a pole the body turns over 2e15 times in a unit of time: bars are wide, not negative."""
    state = FREE | {"epsilon": -1.0, "theta0": np.pi, "p_psi": 1.0, "p_phi": 1.0}
    for method in ("agm", "carlson"):
        ds = survey.evaluate("brun", **state, t=[1e3, 1e9, 1e12, 1e15], method=method)
        assert (ds.status == 0).all() and (np.diff(abs(ds.psi)) > 0).all()
        for name in ("psi", "phi"):
            assert (ds[f"{name}_error"] > 1).all(), (method, name)


def test_next_to_no_field_all_else_is_known():
    ds = survey.evaluate("brun", **FREE | {"epsilon": 1e-60, "p_psi": 0.1, "p_phi": 0.0})
    assert ds.status == 0 and np.isnan(ds.separatrix_distance) and ds.period_error < 1e-13


def test_what_is_no_state():
    heavy = survey.evaluate("brun", **FREE | {"C": np.array([1.0, 4.1])})
    pole = survey.evaluate("brun", **FREE | {"theta0": 0.0, "p_psi": np.array([0.9, 1.3])})
    assert heavy.status.values.tolist() == [0, INVALID_PARAMETERS] == pole.status.values.tolist()


@pytest.mark.parametrize("wrong", [{"l": 1.0}, {"sign": "1"}, {"t": -1.0, "ratio": 0.3}])
def test_two_ways_at_once_are_refused(wrong):
    with pytest.raises(BadInput) as refused:
        survey.evaluate("brun", **FREE | wrong)
    assert "\n" not in str(refused.value)
