"""The whole gyrostat against mpmath: its place by the paper's conditions, what is beside its
limits, rests, motions.
"""

import json
from importlib.resources import files

import body_truth as truth
import mpmath as mp
import numpy as np
import pytest

import survey
from survey.measures.body import rests, system

(REFERENCE,) = json.loads((files("survey.reference") / "gyrostat.json").read_text())["sixd"]
SIX = ("b12", "b31", "d", "c23", "s2", "s3")
FREE = ("A22", "A23", "A33", "B22", "B23", "B33", "C11", "lambda1")
LARGEST, MIDDLE, SMALLEST = ({"A22": a, "A33": b} for a, b in ((0.5, 0.6), (0.6, 1.4), (1.7, 1.4)))
REST = {"A23": 0.07, "B22": 0.3, "B23": 0.07, "B33": -0.2, "C11": 0.1}
FLOW = {"B12": 0.7, "B31": -0.4, "C22": 1.1, "C23": 0.3, "s2": 0.5, "s3": -0.2}
# a rotation, m = 0.9475
CYCLES = {"B12": 0.4, "B31": 0.9, "C22": 1.0, "C23": 3.7, "s2": 0.3, "s3": -0.5}
ROTATION = (1, 2, 3, 4)


def reference():
    """The reference body in its aligned axes, at its initial state."""
    body = {key: float(value) for tensor in "ABC" for key, value in REFERENCE[tensor].items()}
    body |= {key: float(REFERENCE[key]) for key in ("lambda1", "s2", "s3")}
    return body | state(float(REFERENCE["phi0"]), float(REFERENCE["w0"]))


def state(phi, w, theta=None):
    sin, cos = (1.0, 0.0) if theta is None else (np.sin(theta), np.cos(theta))
    return {"omega1": w, "gamma1": cos, "gamma2": sin * np.sin(phi), "gamma3": sin * np.cos(phi)}


def turned(body, q=ROTATION):
    """The same body in other axes, rounded to float64."""
    with mp.workdps(40):
        return {
            name: float(value) for name, value in truth.turned(body, truth.rotation(*q)).items()
        }


def ask(body, question="fate", **more):
    return survey.evaluate("gyrostat_body", question=question, **body, **more)


def slopes(body):
    """A-11 times (w2', w3') at the initial state, in mpmath."""
    with mp.workdps(30):
        start = [
            mp.mpf(body.get(f"{name}{i}", 0)) for name in ("omega", "gamma") for i in (1, 2, 3)
        ]
        parts = truth.tensors(body)
        rows = truth._series(parts, parts[0] ** -1, start, 1)
        return max(abs(float(rows[1][1])), abs(float(rows[2][1])))


MOVED = {"A12": 0, "A31": 1, "B11": 2, "lambda2": 3, "lambda3": 4, "C12": 5, "C31": 6, "s1": 9}


@pytest.mark.parametrize("name", MOVED)
@pytest.mark.parametrize("turn", [False, True])
def test_a_broken_condition_is_named_and_measured(name, turn):
    """Section 6: each condition moved by 0.1, by what the six equations say too."""
    body = reference()
    body[name] = body.get(name, 0.0) + 0.1
    ds = ask(turned(body) if turn else body)
    assert ds.case == 0 and ds.status == 16 and ds.verdict == -1
    expected, residual = np.zeros(len(system.CONDITIONS)), np.abs(ds.residual.values)
    expected[MOVED[name]] = 0.1 / body["A11"]
    if turn:  # axes 2 and 3 are turned about axis 1
        for pair in ([0, 1], [3, 4], [5, 6]):
            expected[pair], residual[pair] = (np.hypot(*x[pair]) for x in (expected, residual))
    assert (np.abs(residual - expected) <= 1.5 * ds.residual_error.values).all()
    assert float(ds.miss) > 0.6 * expected.max() and slopes(body) > 0.02


def test_so_is_a_start_beside_the_plane():
    body = reference() | state(0.4, 2.0, np.pi / 2 + 0.1)
    ds = ask(body)
    assert ds.case == 0 and slopes(body) > 0.02 and abs(ds.theta - np.pi / 2 - 0.1) < 1e-14


@pytest.mark.parametrize("turn", [False, True])
def test_what_the_conditions_leave_free_does_not_matter(turn):
    body = reference()
    for name in FREE:
        body[name] = body.get(name, 0.0) + 0.1
    ds = ask(turned(body) if turn else body)
    assert ds.case == 3 and slopes(body) < 1e-16
    exact = [
        REFERENCE["B"]["B12"],
        REFERENCE["B"]["B31"],
        "1.2",
        "0.25",
        REFERENCE["s2"],
        REFERENCE["s3"],
    ]
    if not turn:
        for name, value in zip(SIX, exact, strict=True):
            off = abs(float(ds[f"reduced_{name}"]) - mp.mpf(value) / mp.mpf(body["A11"]))
            # the reference's decimals are rounded
            assert off <= 4e-16 + float(ds[f"reduced_{name}_error"]), name
        assert (ds.axis == [1, 0, 0]).all()


@pytest.mark.parametrize("question", ["fate", "portrait"])
def test_the_frame_does_not_matter(question):
    """All that has a meaning without axes is the same for a body that is turned, within both bars."""
    body = FLOW | LARGEST | REST | {"lambda1": 1.0} | state(1.5, 0.8)
    one, other = ask(body, question), ask(turned(body), question)
    for name in ("fate", "reduced_stable", "observable", "verdict", "rests", "equilibria", "case"):
        assert name not in one or int(one[name]) == int(other[name]), name
    for name in ("growth", "miss", "theta", "limit_phi"):
        if name in one and not name.endswith("phi"):  # phi is counted from another axis 2
            assert abs(one[name] - other[name]) <= one[f"{name}_error"] + other[f"{name}_error"], (
                name
            )


def test_the_reduced_motion_is_that_of_the_body():
    """phi and w of the scene gyrostat by the reduced parameters, against the six equations in other axes."""
    body = turned(reference())
    ds = ask(body)
    six = {name: float(ds[f"reduced_{name}"]) for name in (*SIX, "phi0", "w0")}
    reduced = survey.evaluate("gyrostat", question="trajectory", t=[1.0, 5.0], **six)
    whole = ask(body, "trajectory", t=[1.0, 5.0])
    w = sum(float(ds.axis[i]) * whole[f"w{i + 1}"] for i in range(3))
    assert (abs(w - reduced.w) < 1e-12).all()


@pytest.mark.parametrize(
    ("t", "method"),
    [
        (-3.0, "auto"),
        (-3.0, "dop853"),
        (10.0, "auto"),
        pytest.param(10.0, "dop853", marks=pytest.mark.slow),
    ],
)
def test_motions_lie_within_their_bars(t, method):
    """Of no special body: nothing of the reduction holds."""
    random = np.random.default_rng(3)
    body = dict(zip(system.NAMES, random.normal(size=len(system.NAMES)), strict=True))
    body |= {"A11": 3.0, "A22": 2.5, "A33": 4.0, "gamma1": 1.0, "gamma2": 0.0, "gamma3": 0.0}
    ds = ask(body, "trajectory", t=t, method=method)
    exact = truth.motion(body, [body[f"{v}{i}"] for v in ("omega", "gamma") for i in (1, 2, 3)], t)
    for name, value in zip(("w1", "w2", "w3", "nu1", "nu2", "nu3"), exact, strict=True):
        assert abs(float(ds[name]) - value) <= float(ds[f"{name}_error"]) < 1e-8, name


def test_a_motion_in_a_sea_of_chaos_is_refused_or_true():
    body = reference() | {"lambda1": 0.0, "omega2": 0.3}
    ds = ask(body, "trajectory", t=[1.0, 30.0, 3000.0])
    assert ds.status[0] == 0 and ds.status[2] != 0


def cycles_of(body, kinds=(1, 2, 3)):
    """(index, kind, start, multipliers to 18 digits) of each cycle of the body's portrait."""
    ds = ask(body, "portrait")
    six = [float(ds[f"reduced_{name}"]) for name in SIX]
    from survey.measures.cylinder import fate
    from survey.methods import taylor

    s = fate.remembered(taylor, six)
    tables = {1: s.plus, 2: s.minus, 3: s.librations}
    count = dict.fromkeys(tables, 0)
    for j, kind in enumerate(int(k) for k in ds.cycle_kind if k):
        row = tables[kind][count[kind]]
        count[kind] += 1
        if kind in kinds:
            rotates = kind < 3
            start = (s.section, row[0] * (1 if kind == 1 else -1)) if rotates else (row[0], 0.0)
            with mp.workdps(30):
                exact = truth.cycle(six, *start, rotates, 30)
                found = truth.multipliers(body, truth.rotation(*ROTATION), None, *exact, 30)
            yield ds, j, sorted(found, key=lambda x: abs(x - 1))[1:]


@pytest.mark.parametrize(
    ("inertia", "moment"),
    [
        (LARGEST, 0.0),
        (LARGEST, 2.0),
        (MIDDLE, 0.0),
        (SMALLEST, 2.0),
    ],
    ids=["largest", "largest-2", "middle", "smallest-2"],
)
@pytest.mark.slow
def test_multipliers_beside_cycles_are_those_of_the_six_equations(inertia, moment):
    """Of motions beside the cycle, in turned axes, in 30 digits: 1 for k, and two that the bars of
    ours hold.
    """
    body = CYCLES | inertia | REST | {"lambda1": moment} | state(1.5, 0.8)
    seen = 0
    for ds, j, exact in cycles_of(body):
        mine = ds.cycle_transversal_re[j].values + 1j * ds.cycle_transversal_im[j].values
        bars = np.hypot(ds.cycle_transversal_re_error[j], ds.cycle_transversal_im_error[j]).values
        exact = sorted((complex(x) for x in exact), key=lambda x: (-round(abs(x), 9), -x.imag))
        for x, bar in zip(mine[:2], bars[:2], strict=True):
            assert min(abs(x - value) for value in exact) <= bar < 1e-5 * max(1.0, abs(x))
        largest = max(abs(x) for x in exact)
        if ds.cycle_verdict[j] > 0:  # 1: unobservable, 2: observable
            assert (largest < 1.0) == (int(ds.cycle_verdict[j]) == 2)
        seen += 1
    assert seen


@pytest.mark.parametrize(
    "inertia", [LARGEST, MIDDLE, SMALLEST], ids=["largest", "middle", "smallest"]
)
def test_exponents_at_equilibria_are_those_of_the_six_equations(inertia):
    """All six eigenvalues of the linearised equations, in 30 digits: two of the set, two beside it,
    and 0 twice.
    """
    body = FLOW | inertia | REST | {"lambda1": 1.3} | state(1.5, 0.8)
    ds = ask(body, "portrait")
    assert int(ds.equilibria) >= 2
    with mp.workdps(30):
        A, B, C, moment, s = truth.tensors(body)
        for j in range(int(ds.equilibria)):
            phi = mp.mpf(float(ds.equilibrium_phi[j]))
            g = _force(body)
            phi = mp.findroot(g, phi)
            J = _jacobian(A, B, C, moment, s, [0, mp.sin(phi), mp.cos(phi)])
            exact = mp.eig(J, left=False, right=False)
            mine = ds.equilibrium_exponent_re[j].values + 1j * ds.equilibrium_exponent_im[j].values
            bars = ds.equilibrium_exponent_re_error[j].values
            left = list(exact)
            for x, bar in zip([*mine, 0.0, 0.0], [*bars, 1e-13, 1e-13], strict=True):
                nearest = min(left, key=lambda value: abs(value - mp.mpc(complex(x))))
                assert abs(nearest - mp.mpc(complex(x))) <= bar < 1e-9
                left.remove(nearest)


def _force(body):
    """g of the reduced flow, for A11 = 1."""
    d, c23, s2, s3 = (mp.mpf(body[name]) for name in ("C22", "C23", "s2", "s3"))
    return lambda x: (
        -d * mp.cos(x) * mp.sin(x) - c23 * mp.cos(2 * x) + s2 * mp.cos(x) - s3 * mp.sin(x)
    )


def _jacobian(A, B, C, moment, s, nu, w=(0, 0, 0)):
    """d(w', nu')/d(w, nu), by differences of the printed equations in mpmath."""
    start, h, inverse = [mp.mpf(x) for x in (*w, *nu)], mp.mpf(10) ** -12, A**-1

    def rates(x):
        rows = truth._series((A, B, C, moment, s), inverse, x, 1)
        return [row[1] for row in rows]

    out = mp.matrix(6, 6)
    for k in range(6):
        ahead, behind = (
            rates([x + sign * h * (i == k) for i, x in enumerate(start)]) for sign in (1, -1)
        )
        for i in range(6):
            out[i, k] = (ahead[i] - behind[i]) / (2 * h)
    return out


def test_of_a_symmetric_body_no_attracting_limit_is_observable():
    """A22 = A33, A23 = 0: the divergence beside the set is -(A11 / A22) f."""
    random = np.random.default_rng(11)
    for _ in range(20):
        flow = dict(zip(FLOW, random.normal(size=6) * [1, 1, 1.5, 1.5, 1, 1], strict=True))
        a = random.uniform(0.4, 2.0)
        body = (
            flow
            | {"A22": a, "A33": a, "lambda1": random.uniform(-9, 9), "C11": random.normal()}
            | state(1.5, 0.8)
        )
        ds = ask(body, "portrait")
        assert 2 not in ds.equilibrium_verdict.values and 2 not in ds.cycle_verdict.values


def test_rotation_about_the_vertical_is_that_of_a_top():
    """B = C = 0: steady rotation about the middle axis is unstable, and a fast gyroscopic moment
    makes it stable.
    """
    body = {"A11": 2.0, "A22": 1.0, "A33": 3.0, "omega1": 1.0, "gamma1": 1.0, "gamma3": 0.0}
    ds = ask(body)
    assert ds.case == 1 and ds.fate == 10 and ds.verdict == 1 and ds.observable == 0
    rate = np.sqrt((2.0 - 1.0) * (3.0 - 2.0) / (1.0 * 3.0))
    assert abs(ds.growth - rate) <= ds.growth_error + 1e-15
    tipped = ask(body | {"lambda2": 0.1})
    assert tipped.case == 0 and abs(tipped.residual[3] - 0.05) < 1e-15


def test_case_a_has_three_multipliers():
    """Its periodic rotation against the six equations; k varies along the set, so none of them is trivial."""
    theta = 1.1
    cos = np.cos(theta)
    body = {
        "A22": 0.7,
        "A33": 1.2,
        "A23": 0.1,
        "B12": 0.3,
        "B31": -0.2,
        "B22": 0.2,
        "C11": 0.4,
        "C22": 0.9,
        "C33": 0.9,
    }
    body |= {"lambda1": 0.5, "lambda2": -0.3 * cos, "lambda3": 0.2 * cos, "s1": -0.5 * cos} | state(
        0.3, 1.7, theta
    )
    ds = ask(body)
    assert ds.case == 2 and ds.fate == 7 and ds.status == 0
    six = [float(ds[f"reduced_{name}"]) for name in SIX]
    with mp.workdps(40):
        t, _phi, _w = truth.returned(six, float(ds.reduced_phi0), 1.7, True)
        assert abs(t - float(ds.period)) <= float(ds.period_error) + 1e-14
    mine = ds.transversal_multiplier_re.values + 1j * ds.transversal_multiplier_im.values
    assert np.isfinite(mine[:3]).all() and np.isnan(mine[3])
    # the set of float64 numbers is off case A by their rounding: the neighbouring motions in
    # float64 then suffice
    h, ends = 1e-6, []
    names = ("w2", "w3", "nu1")
    for k in range(-1, 6):
        kick = np.zeros(3)
        if k >= 0:
            kick[k % 3] = h if k < 3 else -h
        sin, s, c, eta = np.sin(theta), np.sin(0.3), np.cos(0.3), kick[2]
        nu = np.array([cos + sin * eta, sin * s - cos * s * eta, sin * c - cos * c * eta])
        given = (
            body
            | {"omega2": kick[0], "omega3": kick[1]}
            | dict(zip(("gamma1", "gamma2", "gamma3"), nu, strict=True))
        )
        end = ask(given, "trajectory", t=float(ds.period), rtol=1e-13)
        ends.append([float(end[name]) for name in names])
    ends = np.array(ends[1:])
    columns = ((ends[:3] - ends[3:]) / (2 * h)).T / np.array([1.0, 1.0, np.sin(theta)])[:, None]
    for x in np.linalg.eigvals(columns):
        assert np.abs(mine[:3] - x).min() < 1e-6


def test_rests_are_all_that_a_search_finds():
    """Stationary points of nu.C nu/2 - s.nu on the sphere, from 200 starts each; and Euler's formula."""
    random = np.random.default_rng(5)
    for _ in range(12):
        C = random.normal(size=(3, 3))
        body = {f"C{key}": (C + C.T)[i, j] for key, (i, j) in system.ENTRIES.items()}
        body |= {
            f"s{i}": value
            for i, value in enumerate(random.normal(size=3) * random.choice([0.2, 1.0, 3.0]), 1)
        }
        body |= {"omega1": 1.0}
        ds = ask(body, "portrait")
        given = system.read(
            [
                {"A11": 1.0, "A22": 1.0, "A33": 1.0, "gamma3": 1.0, **body}.get(n, 0.0)
                for n in system.NAMES
            ]
        )
        found = set()
        for nu in random.normal(size=(200, 3)):
            polished, _bar = rests._polished(given, nu)
            force = given.C @ polished - given.s
            if np.abs(np.cross(force, polished)).max() < 1e-12:
                found.add(tuple(np.round(polished, 6) + 0.0))
        mine = {tuple(np.round(row, 6) + 0.0) for row in ds.rest_nu.values[: int(ds.rests)]}
        assert found <= mine and len(mine) == int(ds.rests)
        indices = 0
        for row in ds.rest_nu.values[: int(ds.rests)]:
            tangent = np.linalg.svd(row[None])[2][1:].T
            hessian = (
                tangent.T @ (given.C - (row @ (given.C @ row - given.s)) * np.eye(3)) @ tangent
            )
            indices += 1 if np.linalg.det(hessian) > 0 else -1
        assert indices == 2


def test_a_body_that_cannot_be_is_refused():
    for wrong in ({"A12": 2.0}, {"gamma3": 0.0}):
        assert ask({"A11": [1.0, 1.0], "omega1": 1.0} | wrong).status.values.tolist() == [1, 1]
