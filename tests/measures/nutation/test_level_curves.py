"""The bifurcation set on maps of initial states against the quartic and its discriminant in
multiprecision.
"""

import numpy as np
import pytest
from measures.nutation.test_curves import discriminant, quartic, roots, runs
from mpmath import mp, mpf

import survey
from survey.measures.nutation import curves as nc
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
each = pytest.mark.parametrize(("axes", "fixed"), MAPS, ids=str)


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
        middle = 0.5 * (x[1:] + x[:-1])[signs[1:] != signs[:-1]]
        expected = [t for t in middle if at_saddle(rest | {across: value, along: t})]
        crossed = []
        for _, own in runs(ds, (nc.SADDLE,)):
            q, p = ds[f"curve_{across}"].values[own], ds[f"curve_{along}"].values[own]
            at = np.flatnonzero((q[1:] > value) != (q[:-1] > value))
            crossed += [*(p[at] + (value - q[at]) / (q[at + 1] - q[at]) * (p[at + 1] - p[at]))]
        np.testing.assert_allclose(np.sort(crossed), expected, atol=0.02)


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
