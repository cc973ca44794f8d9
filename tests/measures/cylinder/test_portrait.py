"""Portraits: K, L and equilibria in multiprecision, cycles by another integrator, symmetries, laws,
exact strata.
"""

import math

import mpmath
import numpy as np
import pytest
from flow_truth import is_real, roots
from scipy.integrate import solve_ivp

import survey
from survey.kernels.cylinder import branches
from survey.kernels.cylinder import equilibria as eq
from survey.measures.cylinder import fate as cf
from survey.measures.cylinder import portrait as cp
from survey.methods import dop853, taylor

SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)
FLOATS = ("cycle_w", "cycle_multiplier", "cycle_period")


def portraits(rows, method=taylor, rtol=1e-10):
    return cp.solve(method, np.atleast_2d(np.asarray(rows, float)), rtol)


def random_systems(seed, count):
    """Systems of three kinds: of order 1, with strong potential, with weak Barnett-London effect."""
    random = np.random.default_rng(seed)
    rows = random.normal(size=(count, 6)) * [1, 1, 2, 2, 3, 3]
    rows[1::3] = np.column_stack([np.ones(len(rows[1::3])), rows[1::3, 1:] * [0, 1, 1, 2.7, 0.33]])
    rows[2::3] *= [0.3, 0.3, 0.5, 0.5, 0.33, 0.33]
    return rows


@pytest.fixture(scope="module")
def some():
    rows = random_systems(1, 60)
    return rows, portraits(rows)


def rates(six):
    b12, b31, d, c23, s2, s3 = six

    def right(_t, y):
        s, c = math.sin(y[0]), math.cos(y[0])
        f = b12 * c - b31 * s
        return [y[1], f * y[1] - d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s, f]

    return right


def test_K_and_L(some):
    rows, found = some
    for i, six in enumerate(rows):
        b12, b31, d, c23, s2, s3 = map(mpmath.mpf, six)
        with mpmath.workdps(50):
            exact = b12 * s3 - b31 * s2, mpmath.pi / 2 * (c23 * (b12**2 - b31**2) - d * b12 * b31)
            for name, value in zip(("K", "L"), exact, strict=True):
                assert abs(mpmath.mpf(float(found[name][i])) - value) <= mpmath.mpf(
                    float(found[name + "_error"][i])
                )
                assert found[name + "_error"][i] < 1e-14


def test_equilibria_are_the_roots_of_the_quartic(some):
    """g in z = exp(i phi): (i d/4 - c23/2) z^4 + (s2/2 + i s3/2) z^3 + conjugates; its roots on |z| = 1."""
    rows, found = some
    for i, (_b12, _b31, d, c23, s2, s3) in enumerate(rows):
        a, b = complex(-c23 / 2, d / 4), complex(s2 / 2, s3 / 2)
        roots = np.roots([a, b, 0, b.conjugate(), a.conjugate()])
        g = [mpmath.mpf(value) for value in (d, c23, s2, s3)]

        def exact(phi, g=g):
            s, c = mpmath.sin(phi), mpmath.cos(phi)
            return -g[0] * c * s - g[1] * mpmath.cos(2 * phi) + g[2] * c - g[3] * s

        with mpmath.workdps(30):
            angles = [mpmath.findroot(exact, np.angle(z)) for z in roots if abs(abs(z) - 1) < 1e-6]
            angles = sorted(angle % (2 * mpmath.pi) for angle in angles)
        assert found["equilibria"][i] == len(angles) == 2 * found["saddles"][i]
        for k, angle in enumerate(angles):
            assert (
                abs(found["equilibrium_phi"][i, k] - angle) <= found["equilibrium_phi_error"][i, k]
            )
        assert np.isnan(found["equilibrium_phi"][i, len(angles) :]).all()


def test_types_of_equilibria(some):
    rows, found = some
    for (b12, b31, d, c23, s2, s3), phis, types in zip(
        rows, found["equilibrium_phi"], found["equilibrium_type"], strict=True
    ):
        for phi, kind in zip(phis[np.isfinite(phis)], types, strict=False):
            s, c = math.sin(phi), math.cos(phi)
            slope = -d * (c * c - s * s) + 4 * c23 * s * c - s2 * s - s3 * c
            one, two = np.linalg.eigvals([[0.0, 1.0], [slope, b12 * c - b31 * s]])
            if one.imag == 0 and one.real * two.real < 0:
                assert kind == 1
            else:
                assert kind == 3 + np.sign(one.real) + 3 * (one.imag != 0)


def period_by_dop853(six, section, w, kind, right):
    """Period, integral of f over it and w at the return, from the section (rotations) or the
    turning point.
    """
    if kind == 3:
        event = lambda t, y: y[1] if t > 0 else -1.0  # noqa: E731
        event.direction, start = -1, [right, 0.0, 0.0]
    else:
        goal = section + math.copysign(2 * math.pi, w)
        event, start = (lambda _t, y: y[0] - goal), [section, w, 0.0]
    event.terminal = True
    run = solve_ivp(
        rates(six), (0, 1e4), start, "DOP853", events=event, rtol=1e-13, atol=1e-13, max_step=0.5
    )
    end = run.y_events[0][0]
    return run.t_events[0][0], end[2], end[0 if kind == 3 else 1]


def test_cycles_close_with_their_periods_and_multipliers(some):
    rows, found = some
    checked = {1: 0, 2: 0, 3: 0}
    for i, six in enumerate(rows):
        s = cf.remembered(taylor, six)
        tables = {1: s.plus, 2: s.minus, 3: s.librations}
        place = 0
        for kind, table in tables.items():
            for row in table:
                assert found["cycle_kind"][i, place] == kind
                w, m, T = (found[name][i, place] for name in FLOATS)
                bars = [found[name + "_error"][i, place] for name in FLOATS]
                time, area, back = period_by_dop853(six, s.section, w, kind, row[0])
                noise = 1e-9 * max(m, 1 / m, abs(w) ** 2)
                assert abs(back - (row[0] if kind == 3 else w)) < noise + (1 + m) * bars[0]
                assert abs(time - T) <= bars[2] + noise * T
                assert abs(math.exp(area) - m) <= bars[1] + noise * m
                checked[kind], place = checked[kind] + 1, place + 1
        assert (
            np.isnan(found["cycle_w"][i, place:]).all()
            and (found["cycle_kind"][i, place:] == 0).all()
        )
    assert min(checked.values()) >= 2


@pytest.mark.parametrize("number", [4, pytest.param(12, marks=pytest.mark.slow)])
def test_bars_of_cycles_by_another_method(some, number):
    """DOP853 at another accuracy: the cycles differ by no more than both bars."""
    rows, found = some
    picked = np.flatnonzero(np.isfinite(found["cycle_w"][:, 0]))[:number]
    other = portraits(rows[picked], dop853, 1e-12)
    for name in FLOATS:
        gap = np.abs(found[name][picked] - other[name])
        assert not (gap > found[name + "_error"][picked] + other[name + "_error"]).any(), name


def cycle_lists(found, i, exchanged=False, power=1):
    """Sorted (kind, multiplier^power) of point i."""
    names = {1: 2, 2: 1, 3: 3} if exchanged else {1: 1, 2: 2, 3: 3}
    own = found["cycle_kind"][i] > 0
    kinds = [names[k] for k in found["cycle_kind"][i, own]]
    bars = (
        found["cycle_multiplier_error"][i, own]
        / np.minimum(found["cycle_multiplier"][i, own], 1) ** 2
    )
    return sorted(zip(kinds, found["cycle_multiplier"][i, own] ** power, bars, strict=True))


def images(six, angle, k):
    """(image, signs of K and L, factors of w, exchange of rotations, power of multipliers) under S1 to S5."""
    b12, b31, d, c23, s2, s3 = six
    c, s, c2, s2a = math.cos(angle), math.sin(angle), math.cos(2 * angle), math.sin(2 * angle)
    turned = [b12 * c - b31 * s, b12 * s + b31 * c, d * c2 - 2 * c23 * s2a, c23 * c2 + d / 2 * s2a]
    turned += [s2 * c - s3 * s, s2 * s + s3 * c]
    yield (-b12, -b31, d, c23, s2, s3), (-1, 1), True, -1
    yield (b12, -b31, d, -c23, -s2, s3), (1, -1), True, 1
    yield (-b12, -b31, d, c23, -s2, -s3), (1, 1), False, 1
    yield turned, (1, 1), False, 1
    yield (k * b12, k * b31, k * k * d, k * k * c23, k * k * s2, k * k * s3), (k**3, k**4), False, 1


def test_symmetries(some):
    rows, found = some
    random = np.random.default_rng(5)
    for i, six in enumerate(rows[:24]):
        for image, (on_K, on_L), exchanged, power in images(
            six, random.uniform(0, 6), math.exp(random.normal())
        ):
            other = portraits(image)
            for name, factor in (("K", on_K), ("L", on_L)):
                size = abs(factor) * np.prod(np.abs(six) + 1)
                assert abs(other[name][0] - factor * found[name][i]) < 1e-14 * size
            for name in ("stratum", "equilibria", "saddles", "librations"):
                assert other[name][0] == found[name][i]
            for name, twin in (
                ("rotations_plus", "rotations_minus"),
                ("rotations_minus", "rotations_plus"),
            ):
                assert other[name][0] == found[twin if exchanged else name][i]
            one, two = cycle_lists(found, i, exchanged, power), cycle_lists(other, 0)
            for (kind, m, bar), (kind_two, m_two, bar_two) in zip(one, two, strict=True):
                assert kind == kind_two and abs(m - m_two) <= bar + bar_two
            assert {int(other["verdict"][0]), int(found["verdict"][i])} in ({1}, {-1}, {-1, 1})


def test_parity_law_and_ends(some):
    """Section 5: sign(w_d - w_c) = sign(K) where the number of rotation cycles is even, else not."""
    rows, found = some
    checked = 0
    for i, six in enumerate(rows):
        assert found["end_plus"][i] == found["end_minus"][i] == 1 + np.sign(found["K"][i])
        if found["verdict"][i] != 1:
            continue
        s = cf.remembered(taylor, six)
        for name, (w_c, w_d) in zip(
            ("rotations_plus", "rotations_minus"), s.thresholds, strict=True
        ):
            same = np.sign(w_d - w_c) == np.sign(s.K) if w_c > 0 else s.K > 0
            assert found[name][i] % 2 == (not same)
            checked += 1
    assert checked > 100 and (found["verdict"] == 1).mean() > 0.9


def test_far_cycle():
    """Small K: one rotation cycle at w(0) ~ -L/(pi K) with period 2 pi/w and multiplier 1 + pi K/w^3."""
    K = np.array([-1e-3, -1e-5, -1e-8])
    found = portraits([(1.0, 0.0, 0.3, 1.0, 0.5, value) for value in K])
    w, T, m = found["cycle_w"][:, 0], found["cycle_period"][:, 0], found["cycle_multiplier"][:, 0]
    assert (found["rotations_plus"] == 1).all() and (found["rotations_minus"] == 0).all()
    assert (np.abs(w + found["L"] / (math.pi * K)) < 1 + found["cycle_w_error"][:, 0]).all()
    assert (np.abs(w * T / (2 * math.pi) - 1) < 2 / w).all()
    slope = math.pi * K / w**3
    assert (
        np.abs(m - 1 - slope) <= np.abs(slope) * 30 / w + found["cycle_multiplier_error"][:, 0]
    ).all()
    assert (found["verdict"] == 1).all()


def test_hopf():
    """Amplitude of the cycle born at f = 0: per turn ln(m) = 0 at a^2 = -8 f omega / (3 K) (gyrostat.md)."""
    # at phi = 0: f = b12, g' = -d - s3, K = b12 s3 - b31 s2 ~ -b31 s2; g = -c23 + s2 = 0
    for f in (1e-3, 1e-4):
        b31, s2, d, s3 = 0.5, 0.8, 0.3, 0.9
        found = portraits((f, b31, d, s2, s2, s3))
        omega2 = d + s3
        amplitude2 = -8 * f * omega2 / (3 * found["K"][0])
        assert found["librations"][0] == 1 and found["verdict"][0] == 1
        own = found["cycle_kind"][0] == 3
        assert found["cycle_w"][0, own][0] ** 2 == pytest.approx(
            omega2 * amplitude2, rel=30 * math.sqrt(f)
        )
        assert found["cycle_multiplier"][0, own][0] < 1
        assert found["cycle_period"][0, own][0] == pytest.approx(
            2 * math.pi / math.sqrt(omega2), rel=10 * f
        )


def test_degenerate_points():
    """Strata: never called structurally stable."""
    delta, sigma, b12, b31 = 0.8, 0.35, 0.5, 0.75
    I2 = (b12, b31, delta * (b12**2 - b31**2), delta * b12 * b31, sigma * b12, sigma * b31)
    found = portraits([(0.5, 0.3, 0, 0, 0, 0), (0, 0, 0, 0, 0, 1.0), I2])
    assert (
        found["stratum"].tolist() == [0, 1, 2]
        and (found["verdict"] == 0).all()
        and (found["status"] == 0).all()
    )
    assert found["equilibria"].tolist()[:2] == [-1, 2] and (found["end_plus"] == 1).all()


def test_where_K_is_zero_within_its_rounding_only_the_verdict_is_degenerate():
    """s3 = b31 s2 / b12, rounded: K is taken as 0, but the ends hang on the sign that it has."""
    b12, b31, s2 = 0.6668855208492106, -1.2732093048880717, -0.0540824846984024
    found = portraits((b12, b31, 0.9552966902164288, 0.36904143486989205, s2, 0.10325358790484557))
    assert found["K"][0] == 0.0 < found["K_error"][0] and found["verdict"][0] == 0


@pytest.mark.parametrize("off", [0.0, 1e-16, -1e-16, 1e-15, -1e-15])
@pytest.mark.parametrize(
    "six",
    [
        (0.7, -0.4, 1.0, 0.25, 0.25, -1.0),  # at phi = 0 a double root of g
        (0.7, -0.4, 1.0, 0.0, 0.0, -1.0),  # a triple one
        (0.0, 0.0, 1.0, 0.25, 0.25, -1.0),  # without Barnett-London effect
        (0.0, 0.5, 0.25, 0.75, 0.75, 1.0),  # f = g = 0: a Hopf point
    ],
)
def test_at_degenerate_equilibria_no_cycles_are_counted(six, off):
    """g = -c23 + s2, g' = -d - s3 and f = b12 at phi = 0; `off` splits or lifts the roots, by 1e-16
    to 1e-5 rad.
    """
    six = np.array(six)
    six[5 if six[5] < 0 else 0] += off
    found = portraits(six)
    assert found["status"][0] == cp.UNKNOWN_CYCLES and found["verdict"][0] == 0
    assert all(found[name][0] == -1 for name in cp.COUNTS[2:])
    assert np.isnan(found["cycle_w"]).all()
    size, bars = found["equilibria"][0], found["equilibrium_phi_error"][0]
    assert np.isfinite(bars).sum() == size
    inside = np.zeros(size)
    for angle in filter(is_real, roots(six)):
        slips = [
            abs(mpmath.expj(angle) - mpmath.expj(phi)) for phi in found["equilibrium_phi"][0, :size]
        ]
        home = np.flatnonzero(np.array(slips) <= bars[:size])
        assert len(home) == 1
        inside[home] += 1
    assert (inside >= 1).all() and (
        (inside > 1) == (found["equilibrium_type"][0, :size] == 8)
    ).all()
    assert found["K"][0] == pytest.approx(six[0] * six[5] - six[1] * six[4], abs=1e-15)
    assert found["stratum"][0] == (3 if six[1] else 1)


def test_beside_degenerate_equilibria_roots_are_counted_right():
    """Double and triple roots taken apart by 1e-18 to 1e-6 of a parameter: counted as mpmath does."""
    random = np.random.default_rng(5)
    rows = []
    for i in range(200):
        six = random.integers(-8, 9, 6) / 4.0
        six[5] = -six[2]  # g' = 0
        six[4] = six[3] = six[3] * (i % 2)  # g = 0, of g'' too
        six[4 + i // 2 % 2] += random.choice([-1, 1]) * 10.0 ** random.uniform(-16, -6)
        # without Barnett-London effect there are no maps to follow
        rows.append([0.0, 0.0, *six[2:]])
    found = portraits(rows)
    told = found["equilibria"] >= 0
    for i in np.flatnonzero(told & ~(found["equilibrium_type"] == 8).any(axis=1)):
        assert found["equilibria"][i] == sum(map(is_real, roots(rows[i])))
    assert told.sum() > 180


def test_beside_a_saddle_connection_nothing_is_claimed():
    """Bisection in s2 between portraits with and without a rotation: the last bits are undecided or
    degenerate.
    """

    def rotations(s2):
        return portraits((0.7, -0.4, 1.1, 0.3, s2, -0.2))

    low, high = 0.5, 1.5
    assert rotations(low)["rotations_minus"][0] == 1 and rotations(high)["rotations_minus"][0] == 0
    while high - low > 1e-15:
        middle = 0.5 * (low + high)
        if rotations(middle)["rotations_minus"][0] == 1:
            low = middle
        else:
            high = middle
        if middle in (low, high) and high - low < 5e-16:
            break
    assert rotations(low)["verdict"][0] != 1 and rotations(high)["verdict"][0] != 1
    assert rotations(low - 1e-6)["verdict"][0] == 1 and rotations(high + 1e-6)["verdict"][0] == 1


def test_unstable_branches_satisfy_the_flow():
    """Backward in time, by DOP853, the start of each branch runs into its saddle."""
    s = cf.remembered(taylor, SIX)
    starts = np.zeros((8, 4))
    assert branches.of_saddles(s.p, s.equilibria, starts) == 4
    saddles = s.equilibria[s.equilibria[:, eq.KIND] == eq.SADDLE, eq.ANGLE]
    for phi, w, bar_phi, bar_w in starts[:4]:
        nearest = saddles[np.argmin(np.abs(saddles - phi))]
        run = solve_ivp(rates(SIX), (0, -8), [phi, w, 0], "DOP853", rtol=1e-13, atol=1e-16)
        assert abs(run.y[0, -1] - nearest) + abs(run.y[1, -1]) < 0.02 * abs(phi - nearest)
        assert 0 < bar_phi < 1e-14 and 0 < bar_w < 1e-14


@pytest.mark.slow
def test_portraits_of_many_systems():
    """600 systems: 0 to 2 cycles of each kind, almost all decided."""
    found = portraits(random_systems(7, 600))
    assert (found["verdict"] == 1).mean() > 0.98 and (found["status"] == 0).all()
    for name in ("rotations_plus", "rotations_minus", "librations"):
        assert found[name].max() <= 2


def test_beside_a_connection_a_repelling_cycle_may_be_lost_and_then_the_verdict_is_open():
    """A junction in reversed time (a < 0): its stable branch is what the unstable one is in the
    mirror image.
    """
    junction = survey.abel(
        lambda phi, p: -p[0],
        lambda phi, p: p[1] - np.sin(phi),
        parameters=("a", "I"),
        period=2 * np.pi,
    )
    one, other = (survey.evaluate(junction, a=a, I=0.965, question="portrait") for a in (1.0, -1.0))
    assert int(one.verdict) == 1 and int(one.rotations_plus) == 1
    assert int(other.verdict) == -1 or (int(other.verdict) == 1 and int(other.rotations_minus) == 1)
    system = {"b12": 0.26, "b31": 1.02, "c23": -0.4, "s2": -0.15, "s3": -0.4}
    for distance in (1e-6, 1e-7):  # one libration, whose multiplier 2e5 is not near 1
        ds = survey.evaluate(
            "gyrostat", question="portrait", d=1.996611983589767 - distance, **system
        )
        assert int(ds.verdict) == -1 or (int(ds.verdict) == 1 and int(ds.librations) == 1)
    far = survey.evaluate("gyrostat", question="portrait", d=1.996611983589767 - 1e-4, **system)
    assert int(far.verdict) == 1 and int(far.librations) == 1


def test_a_cycle_that_float64_does_not_resolve_is_counted_and_left_open():
    """Its multiplier is above 1e12: from one number to the next the return map leaps over the identity.
    Of librations that begin 0.01 apart one comes to rest, and the other goes beyond the saddle.
    """
    system = {"b12": 1.134521, "b31": -0.557416, "d": -0.577292, "c23": -0.185902, "s2": -0.2289,
              "s3": 0.362648}  # fmt: skip
    ds = survey.evaluate("gyrostat", question="portrait", **system)
    assert ds.librations == 1 and ds.verdict == -1
    fates = survey.evaluate("gyrostat", phi0=[7.38, 7.39], w0=0.0, question="fate", **system)
    assert fates.survey.names().values.tolist() == ["focus_or_node", "spin_up_plus"]
