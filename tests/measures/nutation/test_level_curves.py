"""The bifurcation set on maps of initial states against the quartic and its discriminant in
multiprecision.
"""

import numpy as np
import pytest
from measures.nutation.test_curves import discriminant, quartic, roots, runs
from mpmath import mp, mpf

import survey
from survey.measures import contours
from survey.measures.nutation import curves as nc
from survey.measures.nutation import level_curves
from survey.request.workflow import check
from survey.sweep import boundaries

BODY = {
    "A": 1.3,
    "C": 0.6,
    "epsilon": 2.0,
    "theta0": 1.2,
    "p_theta0": 0.4,
    "p_psi": 0.2,
    "p_phi": 0.3,
}
MAPS = [
    ({"theta0": (0.05, 3.0), "p_psi": (-1.5, 1.6)}, {}),
    ({"theta0": (0.05, 3.0), "p_psi": (-1.5, 1.6)}, {"p_theta0": 0.0}),
    ({"p_psi": (-1.5, 1.6), "p_theta0": (-1.3, 1.2)}, {"p_phi": -0.25}),
    ({"p_phi": (-1.0, 0.8), "p_psi": (0.9, -1.0)}, {"p_theta0": 0.0}),
    ({"epsilon": (0.1, 10.0), "p_theta0": (-3.0, 3.0)}, {}),
    ({"theta0": (0.05, 3.0), "p_psi": (-1.5, 1.6)}, {"p_theta0": 0.0, "epsilon": -2.0}),
]
each = pytest.mark.parametrize(
    ("axes", "fixed"),
    [pytest.param(*m, marks=[pytest.mark.slow] * (i == 1)) for i, m in enumerate(MAPS)],
    ids=str,
)


def found(axes, fixed):
    table = {name: {"start": low, "stop": high, "num": 3} for name, (low, high) in axes.items()}
    if "epsilon" in table:
        table["epsilon"]["spacing"] = "log"
    rest = {name: value for name, value in (BODY | fixed).items() if name not in axes}
    return boundaries.find(check({"scene": "brun", "axes": table | rest, "boundaries": {}})), rest


def scaled(point):
    """sgn k, l, alpha, beta and u of an initial state, from the definitions (S1), (S2)."""
    size, c, epsilon, theta, p, b, a = (mpf(point[name]) for name in BODY)
    k, u, sine = epsilon * size * (size - c), mp.cos(theta), mp.sin(theta)
    level = p * p + ((b - a * u) / sine) ** 2 + a * a - k * u * u
    root = mp.sqrt(abs(k))
    return int(mp.sign(k)), level / abs(k), a / root, b / root, u


def steepness(point):
    """P'(u) over |k| at the state, which is 0 at regular precessions."""
    s, l, alpha, beta, u = scaled(point)  # noqa: E741
    return -2 * u * (l + s * u * u) + (1 - u * u) * 2 * s * u + 2 * alpha * beta


def meets(function, point, axes, error):
    """Does the function change its sign within `error` of the point, on either axis?"""
    for name, (low, high) in axes.items():
        step = mpf(error) * (
            abs(high - low) if name != "epsilon" else point[name] * mp.log(high / low)
        )
        sides = [function(point | {name: point[name] + s * step}) for s in (1, -1)]
        if sides[0] * sides[1] <= 0:
            return True
    return False


@each
def test_each_point_lies_on_its_curve_within_its_error(axes, fixed):
    ds, rest = found(axes, fixed)
    assert (
        0 < float(ds.curve_position_error.max()) < 1e-9
        and np.median(ds.curve_position_error) < 1e-13
    )
    with mp.workdps(60):
        for kind, own in runs(ds, (nc.STABLE, nc.SADDLE, nc.PASSAGE)):
            for i in range(own.start, own.stop, 17):
                point = rest | {name: mpf(float(ds[f"curve_{name}"][i])) for name in axes}
                still = kind == nc.STABLE or (kind == nc.SADDLE and rest.get("p_theta0") == 0.0)
                functions = {
                    nc.STABLE: [steepness],
                    nc.SADDLE: [
                        lambda p: discriminant(*scaled(p)[:4]),
                        *([steepness] if still else []),
                    ],
                    nc.PASSAGE: [lambda p: abs(p["p_psi"]) - abs(p["p_phi"])],
                }[kind]
                error = float(ds.curve_position_error[i])
                assert any(meets(f, point, axes, error) for f in functions), (kind, i)
                if kind == nc.STABLE:
                    assert abs(scaled(point)[4] - float(ds.curve_u[i])) <= float(
                        ds.curve_u_error[i]
                    )


@each
def test_saddles_are_double_roots(axes, fixed):
    """u, psi' and the reduced phi' give l, alpha and beta back by (S18), and the squared frequency
    is negative.
    """
    ds, rest = found(axes, fixed)
    for _, own in runs(ds, (nc.SADDLE,)):
        y, z, u, square = (ds[f"curve_{name}"].values[own] for name in ("precession_rate", "reduced_spin_rate", "u",
                                                                         "nutation_square"))  # fmt: skip
        points = [
            rest | {name: float(ds[f"curve_{name}"][i]) for name in axes}
            for i in range(own.start, own.stop)
        ]
        exact = np.array([[float(value) for value in scaled(point)[1:4]] for point in points])
        surface = np.stack(
            [y * y + z * z - 3 * y * y * z * z, z * (1 - y * y), y * (1 - z * z)], axis=1
        )
        np.testing.assert_allclose(surface, exact, rtol=1e-7, atol=1e-7)
        np.testing.assert_allclose(u, -y * z, atol=1e-9)
        assert (square < 1e-9).all()


def at_saddle(point):
    """Do two roots of the quartic P nearly coincide between the poles, where P is least?"""
    s, *lab, _ = scaled(point)
    c = quartic(s, *lab)
    u = roots(c)
    near = min(
        ((x, y) for i, x in enumerate(u) for y in u[:i]), key=lambda pair: abs(pair[0] - pair[1])
    )
    middle = ((near[0] + near[1]) / 2).real
    return abs(middle) < 1 and 12 * c[0] * middle**2 + 2 * c[2] > 0


@each
def test_no_crossing_of_a_row_is_missed(axes, fixed):
    """Along random rows the discriminant changes its sign where a separatrix is crossed, and nowhere else."""
    ds, rest = found(axes, fixed)
    (across, of), (along, ends) = axes.items()
    for value in np.random.default_rng(7).uniform(*sorted(of), 4):
        x = np.linspace(*sorted(ends), 700)
        signs = np.array(
            [np.sign(float(discriminant(*scaled(rest | {across: value, along: t})[:4]))) for t in x]
        )
        expected = []
        for i in np.flatnonzero(signs[1:] != signs[:-1]):
            low, high = mpf(x[i]), mpf(x[i + 1])
            for _ in range(
                40
            ):  # beside cusps the roots of the quartic are close in pairs elsewhere
                t = (low + high) / 2
                same = discriminant(*scaled(rest | {across: value, along: t})[:4]) * signs[i] > 0
                low, high = (t, high) if same else (low, t)
            if at_saddle(rest | {across: value, along: low}):
                expected.append(float(low))
        crossed = []
        for _, own in runs(ds, (nc.SADDLE,)):
            q, p = ds[f"curve_{across}"].values[own], ds[f"curve_{along}"].values[own]
            at = np.flatnonzero((q[1:] > value) != (q[:-1] > value))
            crossed += [*(p[at] + (value - q[at]) / (q[at + 1] - q[at]) * (p[at + 1] - p[at]))]
        np.testing.assert_allclose(np.sort(crossed), expected, atol=0.02)


def cusps_of(theta, p_phi, root):
    """(theta0, p_psi, p_phi) where the squared frequency of (S18) is 0, of one theta0 or one p_phi."""
    if p_phi is None:
        square = np.cos(theta) ** 2
        own = np.roots([1.0, 3.0 * square - 1.0, square])  # y^2: y^2 + z^2 = 1 - 3 u^2, u = -y z
    else:
        own = np.roots([-1.0, 3.0, -3.0 - 3.0 * (p_phi / root) ** 2, 1.0 - (p_phi / root) ** 2])
        own = own[abs(own.imag) < 1e-12].real
    own = own[(own > 0.0) & (own < 1.0)]
    y = np.append(np.sqrt(own), -np.sqrt(own))
    if p_phi is None:
        z = -np.cos(theta) / y
    else:
        z = np.sign(p_phi) * np.sqrt((1.0 - y * y) / (1.0 + 3.0 * y * y))
    return np.arccos(-y * z), y * (1.0 - z * z) * root, z * (1.0 - y * y) * root


def separatrices(axes, fixed):
    """(the square, [positions (m, 2)]) of the separatrices on the map."""
    square = boundaries.square_over([np.array(ends) for ends in axes.values()])
    rest = {name: value for name, value in (BODY | fixed).items() if name not in axes}
    traced = level_curves.traced(square, list(axes), rest)
    return square, [x for function, x, *_ in traced if function is level_curves.separatrix]


@pytest.mark.parametrize(
    ("axes", "fixed", "number"),
    [
        ({"theta0": (0.05, 3.0), "p_psi": (-1.5, 1.6)}, {"p_phi": 0.3}, 2),
        ({"theta0": (0.05, 3.0), "p_psi": (-1.5, 1.6)}, {"p_phi": -0.7}, 2),
        ({"p_phi": (-2.0, 1.8), "p_psi": (1.9, -2.1)}, {"theta0": 1.3}, 4),
        pytest.param(
            {"p_phi": (-2.0, 1.8), "p_psi": (1.9, -2.1)}, {"theta0": 1.9}, 4, marks=pytest.mark.slow
        ),
    ],
    ids=str,
)
def test_separatrices_end_at_the_cusps(axes, fixed, number):
    """Where the saddle meets the well (S18), which is in closed form."""
    square, curves = separatrices(axes, fixed | {"p_theta0": 0.0})
    root = np.sqrt(BODY["epsilon"] * BODY["A"] * (BODY["A"] - BODY["C"]))
    theta0, p_psi, p_phi = cusps_of(fixed.get("theta0"), fixed.get("p_phi"), root)
    first = theta0 if "theta0" in axes else p_phi
    cusps = square.positions(np.stack([first, p_psi], axis=1))
    assert len(cusps) == number
    ends = np.concatenate([x[[0, -1]] for x in curves])
    apart = np.hypot(*(ends[:, None] - cusps).T).T
    assert (apart.min(axis=0) < 2e-5).all()
    at_cusp = apart.min(axis=1) < 2e-5
    assert at_cusp.sum() == number  # one curve at each
    for x in curves:
        assert np.hypot(*np.diff(x, axis=0).T).max() < 2.0 / level_curves.LINES


def test_a_separatrix_beside_the_end_of_its_saddle_is_one_curve():
    """Along the discriminant, on which the saddle ends, it runs up to 1e-5 of the map beside it."""
    axes = {"p_phi": (-1.0, 0.8), "p_psi": (0.9, -1.0)}
    _, curves = separatrices(axes, {"p_theta0": 0.0})
    assert len(curves) == 2
    for x in curves:
        on_border = (x[[0, -1]] == 0.0) | (x[[0, -1]] == 1.0)
        assert on_border.any(axis=1).all()


def test_a_curve_less_than_a_cell_beside_the_end_of_its_function_is_one():
    """A parabola of which the nodes of the lattice behind it have no value; and the same up to a cusp."""
    square = boundaries.square_over([np.array([0.0, 1.0])] * 2)

    def function(x, cusp=False):
        q, p = x.T
        beyond = 0.1 * (q - 0.5003) ** 2 * ((q < 0.5003) | (not cusp))
        value = p - 0.2113 - 0.7 * q * q
        return np.where(value < beyond, value, np.nan), 1e-16 * np.ones(len(x))

    for cusp, ends in ((False, 1.0), (True, 0.5003)):

        def here(x, cusp=cusp):
            return function(x, cusp)

        found = contours.lines(here, square, 65, contours.continued(here, 65))
        ((x, error),) = [contours.to_the_end(here, square.grain, line, 65) for line in found]
        assert (abs(x[:, 1] - 0.2113 - 0.7 * x[:, 0] ** 2) <= 2.0 * error).all()
        assert sorted(x[[0, -1], 0]) == pytest.approx([0.0, ends], abs=3e-5)
        assert np.unique(x, axis=0).shape == x.shape


@pytest.mark.parametrize(
    ("along", "ends", "near", "state"),
    [
        ("A", (1.0, 2.0), (1.022, 1.0225), {"C": 1.1775, "epsilon": -1.96057, "theta0": 1.946753, "p_theta0": 0.0,
                                            "p_psi": -0.297336, "p_phi": -0.138831}),
        ("p_phi", (-1.3, 1.3), (-0.1342, -0.1338), {"A": 1.473651, "C": 1.263467, "epsilon": 2.39206,
                                                  "theta0": 1.928244, "p_theta0": 0.0, "p_psi": -0.56386}),
        ("epsilon", (-4.0, -0.1), (-0.1965, -0.1955), {"A": 1.300481, "C": 2.112953, "theta0": 2.367427,
                                                       "p_theta0": -0.353956, "p_psi": 0.124743, "p_phi": -0.226211}),
    ],
)  # fmt: skip
def test_separatrices_next_to_the_end_of_their_saddle_are_found(along, ends, near, state):
    """Where L on the separatrix is the potential's local maximum, in multiprecision."""
    ds = survey.edge("brun", along=along, **{along: ends}, **state)
    positions, errors = (one.values[ds.edge_class == nc.SADDLE] for one in (ds.edge, ds.edge_error))
    (position,), (error,) = positions, errors
    assert near[0] < position < near[1] and error < 1e-10
    with mp.workdps(30):
        sides = [
            above_the_saddle(state | {along: mpf(position) + side * mpf(error)}) for side in (-1, 1)
        ]
    assert sides[0] * sides[1] < 0


def above_the_saddle(point):
    """L less the local maximum of the potential, (b - a u)^2 / (1 - u^2) - k u^2."""
    size, c, epsilon, theta, p, b, a = (mpf(point[name]) for name in BODY)
    k = epsilon * size * (size - c)
    slope = [-k, 0, 2 * k, -a * b, a * a + b * b - k, -a * b]  # times (1 - u^2)^2 / 2
    found = mp.polyroots(slope, maxsteps=500, extraprec=300)
    _, u, _ = sorted(mp.re(u) for u in found if abs(mp.im(u)) < 1e-20 and abs(u) < 1)
    levels = [(b - a * x) ** 2 / (1 - x * x) - k * x * x for x in (mp.cos(theta), u)]
    return p * p + levels[0] - levels[1]
