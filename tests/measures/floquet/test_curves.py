"""Curves of [boundaries] of Floquet systems: true curves lie within the position errors, and are found."""

import math

import numpy as np
import pytest
import xarray as xr
from danby_exact import factors
from floquet_truth import PERIOD
from mpmath import mp, mpf
from scipy import special
from scipy.special import mathieu_a, mathieu_b

import survey
from survey.errors import BadInput
from survey.measures.floquet.bifurcations import determinant, passing
from survey.measures.floquet.curves import CLASSES
from survey.measures.floquet.multipliers import COLLISION
from survey.request.workflow import check
from survey.sweep import boundaries


def found(scene, **axes):
    """The dataset of the curves; of a pair of numbers the ends of an axis."""
    table = {
        k: {"start": v[0], "stop": v[1], "num": 3} if np.ndim(v) else v for k, v in axes.items()
    }
    return boundaries.find(check({"scene": scene, "axes": table, "boundaries": {}}))


def curves(ds, kind, *axes):
    """[(parameters (m, 2), errors (m, 2) of either)] of each curve of a class, on axes (name, low, high)."""
    ends = np.cumsum(ds.curve_count.values)
    widths = [high - low for _name, low, high in axes]
    out = []
    for code, last, count in zip(ds.curve_class.values, ends, ds.curve_count.values, strict=True):
        if code == CLASSES[kind]:
            own = slice(last - count, last)
            x = np.stack([ds[f"curve_{name}"].values[own] for name, _low, _high in axes], axis=1)
            out.append((x, ds.curve_position_error.values[own, None] * widths))
    return out


def all_of(parts):
    return (np.concatenate(arrays) for arrays in zip(*parts, strict=True))


def assert_zero_within(function, x, errors):
    """function((m, 2)) takes both signs within the errors of the points x (m, 2): along one axis or
    the other.
    """
    values = np.array(
        [[function(x + side * errors * axis) for side in (-1, 1)] for axis in ([1, 0], [0, 1])]
    )
    assert ((values[:, 0] * values[:, 1] <= 0).any(axis=0)).all()


def mathieu(structure):
    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = 2 * p[2]

    more = (
        {"parameters": ("a", "q")}
        if structure == "symplectic"
        else {"parameters": ("a", "q", "c"), "C": C}
    )
    return survey.floquet(K=K, period=math.pi, states="x", structure=structure, **more)


@pytest.mark.slow
def test_mathieus_tongues():
    axes = {"a": (-1.5, 7.0), "q": (0.0, 4.0)}
    square = [(name, *ends) for name, ends in axes.items()]
    ds = found(mathieu("symplectic"), **axes)
    assert (ds.curve_outside.values == 0).all()
    for kind, known in (("plus_one", (0, 2)), ("minus_one", (1,))):
        x, errors = all_of(curves(ds, kind, *square))
        a, q = x.T
        values = np.array(
            [f(n, q) for n in known for f in (mathieu_a, mathieu_b) if n or f is mathieu_a]
        )
        off = abs(values - a).min(axis=0)
        # SciPy's values have 14 digits, near q = 0 12 (next test); near by the slope of a curve is
        # that of its neighbours on the map
        slope = abs(np.gradient(values, axis=1) / np.gradient(q)).max()
        assert np.median(off) < 1e-12
        assert (off <= errors[:, 0] + slope * errors[:, 1] + np.where(q < 0.01, 2e-12, 1e-13)).all()
        # each curve is drawn over the map, into the tip of its tongue, which for n = 2 is 1e-7 wide
        # there
        for row in values:
            near = abs(row - a) < 1e-9
            inside = q[near]
            assert inside.min() < 1e-3 and inside.max() > 1.9


def number_of(kind, a, q):
    """How many edges of the class are at `a` or below: characteristic values by scipy."""
    if kind == "plus_one":
        edges = [
            mathieu_a(0, q),
            *(f(n, q) for n in range(2, 12, 2) for f in (mathieu_a, mathieu_b)),
        ]
    else:
        edges = [f(n, q) for n in range(1, 12, 2) for f in (mathieu_a, mathieu_b)]
    return int((np.array(edges) <= a + 1e-6).sum())


def test_curves_of_hamiltonian_systems_are_numbered():
    box = ("a", -1.0, 10.0), ("q", 0.5, 3.0)
    ds = found(mathieu("symplectic"), a=box[0][1:], q=box[1][1:])
    index = ds.curve_index.values
    assert (index > 0).all() and index.dtype == np.int32
    for kind, code in CLASSES.items():
        for (x, _errors), number in zip(
            curves(ds, kind, *box), index[ds.curve_class.values == code], strict=True
        ):
            assert {number_of(kind, *row) for row in x[1:-1]} == {number}
    kinds = {code: name for name, code in CLASSES.items()}
    line = survey.edge(mathieu("symplectic"), along="a", a=(-1.0, 10.0), q=1.5)
    assert line.place.size == 7
    for a, code, number in zip(
        *(line[v].values for v in ("edge", "edge_class", "edge_index")), strict=True
    ):
        assert number_of(kinds[int(code)], a, 1.5) == number
    assert "edge_index" not in survey.edge(mathieu("none"), along="a", a=(-1.0, 10.0), q=1.5, c=0.0)


@pytest.mark.slow
def test_both_edges_of_a_tip():
    """Points of Mathieu's tongues at small q, by the series of DLMF 28.6.1 to q^4, whose rest is
    below 1e-15 here.
    """
    ds = found(mathieu("symplectic"), a=(0.9, 4.1), q=(0.0, 0.3))
    square = [("a", 0.9, 4.1), ("q", 0.0, 0.3)]
    edges = {
        "minus_one": [
            lambda q, s=s: 1 + s * q - q**2 / 8 - s * q**3 / 64 - q**4 / 1536 for s in (1, -1)
        ],
        "plus_one": [
            lambda q: 4 + 5 * q**2 / 12 - 763 * q**4 / 13824,
            lambda q: 4 - q**2 / 12 + 5 * q**4 / 13824,
        ],
    }
    for kind, known in edges.items():
        x, errors = all_of(curves(ds, kind, *square))
        (a, q), tip = x.T, x[:, 1] < 2e-3
        off = np.array([abs(edge(q) - a) for edge in known])[:, tip]
        assert (off.min(axis=0) <= errors[tip].sum(axis=1) + 2e-15).all()
        # either edge
        assert (off.argmin(axis=0) == 0).sum() > 1 and (off.argmin(axis=0) == 1).sum() > 1
        # each is one curve, from the border to the tip, its points in order
        parts = [x for x, _errors in curves(ds, kind, *square)]
        steps = [np.diff(x[:, 1]) for x in parts]
        assert len(parts) == 2 and all(abs(np.sign(step).sum()) == step.size for step in steps)
        assert max(x[:, 1].min() for x in parts) < 2e-4


def test_damped_mathieus_tongues():
    """Multipliers exp(-c pi) times Mathieu's at a - c^2 are 1 or -1 where its discriminant is 2
    cosh(c pi).
    """
    axes, c = (("a", -0.5, 5.0), ("q", 0.0, 4.0)), 0.12
    ds = found(mathieu("none"), a=(-0.5, 5.0), q=(0.0, 4.0), c=c)
    assert set(ds.curve_class.values) == {CLASSES["plus_one"], CLASSES["minus_one"]}
    for kind, sign in (("plus_one", 1), ("minus_one", -1)):
        x, errors = all_of(curves(ds, kind, *axes))
        assert np.median(errors) < 1e-11

        def off(x, sign=sign):
            a, q = (xr.DataArray(v, dims="i") for v in x.T)
            known = survey.evaluate("mathieu", a=a - c * c, q=q, rtol=1e-13)
            return sign * known.discriminant.values - 2 * math.cosh(c * math.pi)

        assert_zero_within(off, x, 1.0001 * errors + 1e-14)  # rounding of the known values
    # the first tongue lies above q = 2 c, nearly, and its tip is drawn
    [(first, _)] = [part for part in curves(ds, "minus_one", *axes)]
    assert 2 * c < first[:, 1].min() < 2 * c + 0.005


@pytest.mark.slow
def test_meissners_tongues():
    def K(t, p, out):
        out[0, 0] = p[0] + (p[1] if t < 1.0 else -p[1])

    scene = survey.floquet(
        K=K, period=2.5, parameters=("a", "b"), states="x", breaks=1.0, structure="symplectic"
    )
    ds = found(scene, a=(1.0, 9.0), b=(0.0, 0.9))
    for kind, goal in (("plus_one", 2), ("minus_one", -2)):
        x, errors = all_of(curves(ds, kind, ("a", 1.0, 9.0), ("b", 0.0, 0.9)))

        def off(x, goal=goal):
            p, q = np.sqrt(x[:, 0] + x[:, 1]), np.sqrt(x[:, 0] - x[:, 1])
            return (
                2 * np.cos(p) * np.cos(1.5 * q)
                - (p / q + q / p) * np.sin(p) * np.sin(1.5 * q)
                - goal
            )

        assert len(x) > 20 and np.median(errors) < 1e-11
        assert_zero_within(off, x, errors + 1e-14)


@pytest.mark.slow
def test_mass_filter():
    """x'' + (a - 2 q cos 2t) x = 0 and y'' - (a - 2 q cos 2t) y = 0: the first region and its tips."""

    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)
        out[1, 1] = -out[0, 0]

    scene = survey.floquet(
        K=K, period=math.pi, parameters=("a", "q"), states=("x", "y"), structure="symplectic"
    )
    ds = found(scene, a=(-0.3, 0.31), q=(0.3, 1.0))
    # the s meet, but never collide
    assert set(ds.curve_class.values) == {CLASSES["plus_one"], CLASSES["minus_one"]}
    x, errors = all_of(curves(ds, "minus_one", ("a", -0.3, 0.31), ("q", 0.3, 1.0)))
    known = mathieu_b(1, x[:, 1])
    off = np.minimum(abs(x[:, 0] - known), abs(x[:, 0] + known))
    assert (off <= errors.sum(axis=1) * 2 + 1e-13).all()
    edge = ds.curve_outside.values == 0
    a, q = ds.curve_a.values[edge], ds.curve_q.values[edge]
    assert q.max() < 0.908047 and q.max() > 0.9
    assert a.max() < 0.23700 and a.max() > 0.232  # the tip (0.23699, 0.70600)
    near = np.argsort(abs(x[:, 0]))[:2]  # both lines through (0, 0.908046)
    assert abs(x[near, 1] - 0.908046 - abs(x[near, 0]) / -1.2).max() < 0.01


def danby():
    def A(t, p, out):
        mu, e = p
        s = math.sqrt(1 - 3 * mu * (1 - mu))
        r = 1 / (1 + e * math.cos(t))
        out[0, 1], out[1, 0], out[0, 2], out[1, 3] = 1.0, -1.0, 1.0, 1.0
        out[2, 0], out[2, 3] = 1.5 * (1 + s) * r - 1.0, 1.0
        out[3, 1], out[3, 2] = 1.5 * (1 - s) * r - 1.0, -1.0

    states = ("xi", "eta", "X", "Y")
    return survey.floquet(
        A, period=2 * math.pi, parameters=("mu", "e"), states=states, structure="symplectic"
    )


@pytest.mark.slow
def test_danbys_curves():
    axes = {"mu": (0.001, 0.0532), "e": (0.0, 0.5)}
    square = [(name, *ends) for name, ends in axes.items()]
    ds = found(danby(), **axes)
    assert (ds.curve_outside.values[ds.curve_e.values < 0.31] == 0).all()
    [(collision, errors)] = curves(ds, "collision", *square)
    # from Routh's mass ratio to the tip, mu = 0.046990807, e = 0.3143
    assert abs(collision[:, 0].min() - 0.0385208965) < 2e-4 and collision[:, 1].min() == 0.0
    assert 0.310 < collision[:, 1].max() < 0.3144
    x, bars = all_of(curves(ds, "minus_one", *square))

    def product(name, points):
        with mp.workdps(25):
            known = [factors(mpf(mu), mpf(e), 10, 36) for mu, e in points]
        return np.array([int(mp.sign(mp.fprod(f[part] for part in name))) for f in known])

    some = np.array([3, len(collision) // 2])
    assert_zero_within(lambda p: product(["KC"], p), collision[some], errors[some])
    assert np.median(errors) < 1e-10
    some = np.array([len(x) // 7, len(x) // 2])
    assert_zero_within(lambda p: product(["A", "B"], p), x[some], bars[some])


def circle(t, p, out):
    """A complex pair of growth x^2 + y^2 - 1/4, real multipliers with (x - 0.2) / 2 and -0.1, in
    turning axes.
    """
    x, y = p
    B = np.zeros((4, 4), dtype=object)
    B[0, 0] = B[1, 1] = x * x + y * y - 0.25
    B[0, 1], B[1, 0] = 0.3, -0.3
    B[2, 2], B[3, 3], B[2, 3] = 0.5 * (x - 0.2), -0.1, 0.7
    mixed = np.array(
        [[2.0, 1.0, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0], [1.0, 0.0, 2.0, 0.0], [0.0, 1.0, 0.0, 1.0]]
    )
    R = np.zeros((4, 4), dtype=object)
    for k in (0, 2):
        R[k, k] = R[k + 1, k + 1] = math.cos(t)
        R[k, k + 1], R[k + 1, k] = -math.sin(t), math.sin(t)
    out[:] = R @ mixed @ B @ np.linalg.inv(mixed) @ R.T
    for k in (0, 2):
        out[k, k + 1] -= 1.0
        out[k + 1, k] += 1.0


@pytest.mark.slow
def test_neimark_sacker():
    scene = survey.floquet(circle, period=PERIOD, parameters=("x", "y"), states=tuple("abcd"))
    axes = (("x", -0.7, 0.8), ("y", -0.6, 0.7))
    ds = found(scene, x=axes[0][1:], y=axes[1][1:])
    parts = curves(ds, "neimark_sacker", *axes)
    x, errors = all_of(parts)
    assert_zero_within(lambda p: (p * p).sum(axis=1) - 0.25, x, errors + 1e-16)
    assert np.median(errors) < 1e-8
    angle = np.arctan2(*x.T[::-1])
    assert np.diff(np.sort(angle)).max() < 0.1  # all the way round
    own = ds.curve_class.values == CLASSES["neimark_sacker"]
    points = np.repeat(own, ds.curve_count.values)
    assert (ds.curve_outside.values[points] == (x[:, 0] > 0.2)).all()
    off = abs(ds.curve_angle.values[points] - 0.3 * PERIOD)
    assert (off <= ds.curve_angle_error.values[points]).all()
    # the line x = 0.2, where a real multiplier is 1; at x = 0.4 two are l and 1 / l, and nothing
    # passes
    line, errors = all_of(curves(ds, "plus_one", *axes))
    assert (abs(line[:, 0] - 0.2) <= errors[:, 0]).all()
    assert line[:, 1].min() == -0.6 and line[:, 1].max() == 0.7
    assert not curves(ds, "minus_one", *axes) and not curves(ds, "collision", *axes)


@pytest.mark.slow
def test_gyroscopic_stabilisation():
    """x'' - 2 g y' - a x = 0, y'' + 2 g x' - b y = 0: frequencies meet at 2 g = sqrt(a) + sqrt(b); and z."""
    b, period = 0.4, 1.1

    def K(t, p, out):
        out[0, 0], out[1, 1], out[2, 2] = -p[1], -b, 2.9

    def C(t, p, out):
        out[0, 1], out[1, 0] = -2 * p[0], 2 * p[0]

    parameters, states = ("g", "a"), ("x", "y", "z")
    scene = survey.floquet(
        K=K, C=C, period=period, parameters=parameters, states=states, structure="symplectic"
    )
    axes = (("g", 0.2, 1.2), ("a", -0.3, 0.9))
    ds = found(scene, g=axes[0][1:], a=axes[1][1:])
    [(x, errors)] = curves(ds, "collision", *axes)
    assert_zero_within(
        lambda p: 2 * p[:, 0] - np.sqrt(abs(p[:, 1])) - math.sqrt(b), x, errors + 1e-16
    )
    assert x[:, 1].min() < 0.03 and x[:, 1].max() == 0.9
    points = np.repeat(ds.curve_class.values == CLASSES["collision"], ds.curve_count.values)
    assert (ds.curve_outside.values[points] == 0).all()
    angle = (x[:, 1] * b) ** 0.25 * period
    off, bars = abs(ds.curve_angle.values[points] - angle), ds.curve_angle_error.values[points]
    assert (off <= bars + 1e-9).all() and np.median(bars) < 1e-3
    line, errors = all_of(curves(ds, "plus_one", *axes))
    assert (abs(line[:, 1]) <= errors[:, 1]).all()
    assert not curves(ds, "minus_one", *axes)


@pytest.mark.parametrize(
    "n, rank", [(1, 1), (2, 1), (4, 3), pytest.param(6, 5, marks=pytest.mark.slow), (6, 6)]
)
def test_bounds_of_determinants(n, rank):
    """Of the exact determinants of matrices within E, next to singular ones."""
    rng = np.random.default_rng(10 * n + rank)
    low = rng.normal(size=(200, n, rank)) @ rng.normal(size=(200, rank, n))
    A = low + 10.0 ** rng.uniform(-15, -1, (200, 1, 1)) * rng.normal(size=(200, n, n))
    E = 10.0 ** rng.uniform(-14, -6, (200, n, n))
    near = A + E * rng.choice([-1.0, 1.0], A.shape)
    value, bar = determinant(A, E)
    for k in range(200):
        with mp.workdps(60):
            size = mp.sqrt(
                mp.det(mp.eye(n) + mp.matrix(A[k].T.tolist()) * mp.matrix(A[k].tolist()))
            )
            exact, other = (mp.det(mp.matrix(X[k].tolist())) / size for X in (A, near))
            assert max(abs(exact - value[k]), abs(other - value[k])) <= bar[k] * (1 + 1e-9)
    assert np.median(bar) < 1e-5


@pytest.mark.parametrize(
    "size, angle, passes", [(1 + 1e-6, 1.0, True), (4.1, 1e-4, False), (1.004, 1e-5, False)]
)
@pytest.mark.parametrize("structure", ["symplectic", "reversible"])
def test_multipliers_that_meet_off_the_circle_do_not_pass_it(size, angle, passes, structure):
    """Four complex ones next to where they meet in two points: of the circle, or of the real axis."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    M = np.block([[size * turn, np.zeros((2, 2))], [np.zeros((2, 2)), turn / size]])[None]
    assert passing(M, np.full((1, 4, 4), 1e-14), COLLISION, structure)[0].tolist() == [passes]


def test_conserved_quantities_and_three_axes():
    """A multiplier that is 1 everywhere makes no curve; each plane of a third axis has its own."""

    def A(t, p, out):
        out[0, 1], out[1, 0] = 1.0, -(p[0] + p[1] * math.cos(2 * t))
        out[1, 1] = -2 * p[2]
        out[2, 0] = 1.0  # z' = x

    scene = survey.floquet(A, period=math.pi, parameters=("a", "q", "c"), states=("x", "v", "z"))
    ds = found(scene, a=(0.2, 2.5), q=(0.0, 1.5), c=(0.1, 0.3))
    assert set(ds.curve_class.values) == {CLASSES["minus_one"]}
    tips = [float(ds.curve_q.values[ds.curve_c.values == c].min()) for c in (0.1, 0.2, 0.3)]
    assert tips == pytest.approx([0.4, 0.8, 1.2], rel=0.03)
    # a multiplier at 1 is neither outside nor inside
    assert np.isnan(ds.curve_outside.values).all()


def test_on_one_axis_there_are_edges():
    """The ends b_1 and a_1 of the first tongue."""
    ds = found(mathieu("symplectic"), a=(0.0, 1.6), q=0.3)
    known = [special.mathieu_b(1, 0.3), special.mathieu_a(1, 0.3)]
    assert (abs(ds.edge_position - known) <= ds.edge_position_error + 1e-14).all()


def test_refusals():
    with pytest.raises(BadInput, match=r"boundaries\.axis"):
        table = {name: {"start": 0.0, "stop": 1.0, "num": 3} for name in ("a", "q")}
        check({"scene": mathieu("symplectic"), "axes": table, "boundaries": {"axis": "a"}})
