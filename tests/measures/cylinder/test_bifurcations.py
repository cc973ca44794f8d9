"""Bifurcations in closed form against discriminants and roots of the defining equations in multiprecision."""

import mpmath as mp
import numpy as np
import pytest

from survey.measures.cylinder import bifurcations, curves
from survey.measures.cylinder.separatrices import SYSTEM
from survey.measures.square import Square

BASE = {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2}
PLANES = [
    (("s2", "d"), {}), (("s2", "s3"), {}), (("c23", "d"), {}), (("s3", "c23"), {}), (("b12", "d"), {}),
    (("s3", "b12"), {}), (("b31", "s2"), {}), (("b12", "b31"), {}), (("s3", "d"), {"c23": 0.0, "s2": 0.0}),
    (("b31", "c23"), {"s2": 0.0, "s3": 0.0}), (("d", "c23"), {"s2": 0.0, "s3": 0.0}), (("s2", "b12"), {"b31": 0.0}),
]  # fmt: skip
SQUARE = Square(np.array([-2.1, -1.9]), np.array([2.0, 1.8]), np.array([False, False]))
NAMES = list(curves.CLASSES)
each = pytest.mark.parametrize(
    ("axes", "changes"),
    [pytest.param(*plane, marks=[pytest.mark.slow] * (i == 5)) for i, plane in enumerate(PLANES)],
    ids=str,
)


@pytest.fixture(autouse=True)
def closed_forms_alone(monkeypatch):
    monkeypatch.setattr(bifurcations.connections, "found", lambda plane: [])
    monkeypatch.setattr(bifurcations.cycle_folds, "found", lambda plane, segments=None: [])
    monkeypatch.setattr(bifurcations, "COUNTED", 0)
    monkeypatch.setattr(curves.cycle_counts, "LINES", 2)


def points(axes, changes, square=SQUARE):
    """[(class, {name: value} of the system, error, equilibrium_phi, its error)] of points of the curves."""
    found = curves.closed(
        square, list(axes), {k: v for k, v in (BASE | changes).items() if k not in axes}, {}
    )
    kinds = np.repeat(found.kind, found.count)
    angles = zip(*found.along["equilibrium_phi"], strict=True)
    for kind, xy, error, angle in zip(kinds, found.parameters, found.error, angles, strict=True):
        yield (
            NAMES[kind],
            BASE | changes | dict(zip(axes, map(mp.mpf, xy), strict=True)),
            error,
            *angle,
        )


def derivatives(system, phi):
    """f, g, g', g'' at phi."""
    b12, b31, d, c23, s2, s3 = (system[name] for name in SYSTEM)
    s, c = mp.sin(phi), mp.cos(phi)
    double_s, double_c = mp.sin(2 * phi), mp.cos(2 * phi)
    second = 2 * d * double_s + 4 * c23 * double_c - s2 * c + s3 * s
    force = -d * double_s / 2 - c23 * double_c + s2 * c - s3 * s
    return b12 * c - b31 * s, force, -d * double_c + 2 * c23 * double_s - s2 * s - s3 * c, second


def discriminant(system, shift=0.3):
    """Of g as a quartic in tan((phi - shift) / 2)."""
    _, _, d, c23, s2, s3 = (mp.mpf(system[name]) for name in SYSTEM)
    s, c, ds, dc = mp.sin(shift), mp.cos(shift), mp.sin(2 * shift), mp.cos(2 * shift)
    d, c23 = d * dc - 2 * c23 * ds, c23 * dc + d * ds / 2
    s2, s3 = s2 * c - s3 * s, s2 * s + s3 * c
    a4, a3, a2, a1, a0 = -c23 - s2, 2 * d - 2 * s3, 6 * c23, -2 * d - 2 * s3, -c23 + s2
    rows = [[0] * i + [a4, a3, a2, a1, a0] + [0] * (2 - i) for i in range(3)]
    rows += [[0] * i + [4 * a4, 3 * a3, 2 * a2, a1] + [0] * (3 - i) for i in range(4)]
    return mp.det(mp.matrix(rows)) / a4


def meets(function, system, axes, error, square=SQUARE):
    """Does the function change its sign within `error` of the system, on either axis?"""
    for i, name in enumerate(axes):
        step = mp.mpf(error) * float(square.high[i] - square.low[i]) * 1.5
        values = [function(system | {name: system[name] + side * step}) for side in (1, -1)]
        if values[0] * values[1] <= 0:
            return True
    return False


def turning(side):
    """g where f = 0."""
    return lambda system: derivatives(system, mp.atan2(system["b12"], system["b31"]) + side)[1]


def level(system):
    return system["b12"] * system["s3"] - system["b31"] * system["s2"]


def next_level(system):
    b12, b31, d, c23, *_ = (system[name] for name in SYSTEM)
    return c23 * (b12 * b12 - b31 * b31) - d * b12 * b31


@each
def test_each_point_lies_on_its_curve_within_its_error(axes, changes):
    # K = 0 all over the map
    flat = level(BASE | changes | dict(zip(axes, (0.1, 0.2), strict=True))) == 0
    with mp.workdps(40):
        for kind, system, error, phi, _ in list(points(axes, changes))[::5]:
            assert 0 < error < 1e-10
            if kind == "ends":
                assert meets(next_level if flat else level, system, axes, error)
                continue
            f, _, slope, _ = derivatives(system, phi)
            if kind == "fold":
                assert abs(slope) < 1e-9
                assert meets(discriminant, system, axes, error) or changes == {
                    "c23": 0.0,
                    "s2": 0.0,
                }
            elif kind.endswith("critical_hopf") and abs(system["b12"]) > 1e-12:
                assert abs(f) < 1e-11
                assert slope < 1e-12
                assert any(meets(turning(side), system, axes, error) for side in (0, mp.pi))
                assert (
                    (level(system) < 1e-15)
                    if kind == "supercritical_hopf"
                    else (level(system) > -1e-15)
                )


@each
def test_points_of_codimension_two_solve_their_equations(axes, changes):
    """Each is the root of its three equations in the two parameters and phi, to its error."""
    equations = {
        "cusp": lambda system, phi: derivatives(system, phi)[1:],
        "bogdanov_takens": lambda system, phi: derivatives(system, phi)[:3],
        "generalised_hopf": lambda system, phi: (*derivatives(system, phi)[:2], level(system)),
    }
    with mp.workdps(40):
        for kind, system, error, phi, phi_error in points(axes, changes):
            if kind not in equations:
                continue
            start = [system[axes[0]], system[axes[1]], mp.mpf(phi)]
            root = mp.findroot(
                lambda x, y, z, kind=kind, system=system: equations[kind](system | {axes[0]: x, axes[1]: y}, z), start,
                tol=1e-50,
            )  # fmt: skip
            off = [(root[i] - start[i]) / float(SQUARE.high[i] - SQUARE.low[i]) for i in range(2)]
            assert mp.hypot(*off) <= error < 1e-9
            assert abs(root[2] - start[2]) <= phi_error < 1e-9


def test_points_of_codimension_two_are_all_found():
    """On the plane of s2 and s3 the fold is an astroid: four cusps, and two Bogdanov-Takens points."""
    wide = Square(np.array([-9.0, -9.0]), np.array([9.0, 9.0]), SQUARE.log)
    kinds = [kind for kind, *_ in points(("s2", "s3"), {}, wide)]
    assert [kinds.count(name) for name in ("cusp", "bogdanov_takens", "generalised_hopf")] == [
        4,
        2,
        0,
    ]
    kinds = [
        kind
        for kind, *_ in points(
            ("s2", "d"), {}, Square(np.array([-9.0, -9.0]), np.array([9.0, 9.0]), SQUARE.log)
        )
    ]
    assert [kinds.count(name) for name in ("cusp", "bogdanov_takens", "generalised_hopf")] == [
        0,
        2,
        2,
    ]


def test_logarithmic_axes_and_planes_without_g_or_f():
    square = Square(np.array([0.1, 0.1]), np.array([3.0, 9.0]), np.array([True, True]))
    found = list(points(("s2", "d"), {}, square))
    assert {kind for kind, *_ in found} >= {"fold", "subcritical_hopf", "ends"}
    assert max(error for _, _, error, *_ in found) < 1e-10
    assert not list(points(("d", "c23"), {"b12": 0.0, "b31": 0.0, "s2": 0.0, "s3": 0.0}))


def test_the_hyperbola_of_the_ends_meets_the_border_of_a_narrow_map():
    """b12 s3 = b31 s2, where s3 and b31 are small: the curve is followed by log |b12|, whose
    rounding moved its end off the border.
    """
    rng = np.random.default_rng(5)
    for _ in range(300):
        b12, s2 = rng.uniform(0.1, 1.0, 2) * rng.choice([-1.0, 1.0], 2)
        b31 = 10.0 ** rng.uniform(-12.0, 0.0)
        square = Square(
            np.array([-1.5, b12]), np.array([1.5, b12 + 1e-3]), np.array([False, False]), 0.0
        )
        fixed = {"b31": b31, "d": 0.3, "c23": 0.2, "s2": s2}
        plane = bifurcations.ParameterPlane(square, ("s3", "b12"), fixed)
        exact = float(mp.mpf(b31) * mp.mpf(s2) / mp.mpf(b12))
        if abs(exact) > 1.4:
            continue
        ((_, xy, error, _),) = bifurcations._ends(plane)
        met = xy[:, 1] == b12
        assert met.any()
        assert (abs(xy[met, 0] - exact) <= 3.0 * error[met] + 1e-18).all()
