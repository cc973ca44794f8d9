"""Fates and skeletons: the reference, symmetries, integrable strata, long integration by an
independent code.
"""

import json
import math
from importlib.resources import files

import numpy as np
import pytest
from flow_truth import exact
from mpmath import mp
from scipy.integrate import solve_ivp

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import returns as rt
from survey.measures.cylinder import fate as cf
from survey.methods import dop853, taylor

REFERENCE = json.loads((files("survey.reference") / "gyrostat.json").read_text())
SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)
UNDECIDED, REST, SADDLE, PLUS, MINUS, LIBRATION, UP, DOWN, TURNS, SWINGS, START = (
    -1,
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
)


def fates(six, starts, method=taylor, rtol=1e-10):
    starts = np.atleast_2d(np.asarray(starts, float))
    result = cf.empty(len(starts), 0)
    cf.solve(method, six, starts, rtol, result, np.arange(len(starts)))
    return result


def random_system(random, i):
    """Systems of three kinds: of order 1, with strong potential, with weak Barnett-London effect."""
    if i % 3 == 0:
        return random.normal(size=6) * [1, 1, 2, 2, 3, 3]
    if i % 3 == 1:
        return np.array([1.0, 0.0, *random.normal(size=4) * [2, 2, 8, 1]])
    return random.normal(size=6) * [0.3, 0.3, 1, 1, 1, 1]


@pytest.mark.parametrize("case", REFERENCE["classification"], ids=lambda case: case["name"][:20])
def test_reference_skeletons(case):
    s = cf.skeleton(taylor, case["p"])
    assert s.K == pytest.approx(case["K"], rel=1e-8) and s.L == pytest.approx(case["L"], rel=1e-8)
    assert s.section % (2 * math.pi) == pytest.approx(case["section"], abs=1e-8)
    names = {
        (eq.SADDLE, 0): "S",
        (eq.NODE, -1): "n-",
        (eq.NODE, 1): "n+",
        (eq.FOCUS, -1): "f-",
        (eq.FOCUS, 1): "f+",
    }
    for row, wanted in zip(s.equilibria, case["equilibria"], strict=True):
        assert row[eq.ANGLE] == pytest.approx(wanted["phi"], abs=1e-8)
        kind = int(row[eq.KIND])
        assert names[kind, int(row[eq.STABLE]) if kind else 0] == wanted["type"]
    for sign, found, name in ((1, s.plus, "rotation_plus"), (-1, s.minus, "rotation_minus")):
        assert len(found) == len(case[name]["cycles"])
        for row, wanted in zip(found, case[name]["cycles"], strict=True):
            assert sign * row[rt.CYCLE_X] == pytest.approx(wanted["w"], rel=3e-9)
            assert row[rt.MULTIPLIER] == pytest.approx(wanted["multiplier"], rel=1e-8)
            assert row[rt.PERIOD] == pytest.approx(wanted["period"], rel=1e-8)
    for (threshold, _w_d), name in zip(
        s.thresholds, ("rotation_plus", "rotation_minus"), strict=True
    ):
        wanted = case[name]["w_c"]
        assert (
            math.isnan(threshold) if wanted == 0 else threshold == pytest.approx(wanted, abs=1e-8)
        )
    for row, wanted in zip(s.librations, case["libration"], strict=True):
        assert row[rt.CYCLE_X] == pytest.approx(wanted["phi_right"], abs=1e-8)
        assert row[rt.CYCLE_LEFT] == pytest.approx(wanted["phi_left"], abs=1e-8)
        assert row[rt.MULTIPLIER] == pytest.approx(wanted["multiplier"], rel=1e-8)
        assert row[rt.CYCLE_CLASS] == wanted["equilibria_inside"]


def test_reference_cycle():
    """C3: an outer rotation, multiplier within 1e-3 of 1, to 1e-10; its period too."""
    (case,) = (case for case in REFERENCE["abel_time"] if case["form"] == "cycle")
    s = cf.skeleton(taylor, case["p"])
    row = s.plus[-1]
    assert abs(row[rt.MULTIPLIER] - float(case["multiplier"])) < 1e-10
    assert abs(row[rt.MULTIPLIER] - float(case["multiplier"])) <= row[rt.MULTIPLIER_BAR] + 1e-12
    assert row[rt.PERIOD] == pytest.approx(float(case["period"]), abs=1e-10)


@pytest.mark.parametrize("method", [taylor, dop853], ids=["taylor", "dop853"])
@pytest.mark.parametrize(
    "case", REFERENCE["fate"], ids=lambda case: f"{case['fate']}-{case['phi0']}"
)
def test_reference_fates(case, method):
    found = fates(case["p"], [float(case["phi0"]), float(case["w0"])], method)
    verdict, detail = found["verdict"][0], case["detail"]
    if case["fate"] == "E":
        assert verdict == REST and abs(found["limit_phi"][0] - detail[0]) < 1e-4
    if case["fate"] == "U":
        assert verdict == (UP if detail[0] > 0 else DOWN)
    if case["fate"] == "R":
        assert verdict == (PLUS if detail[0] > 0 else MINUS)
        assert found["limit_w"][0] == pytest.approx(detail[0] * detail[1], rel=3e-8)
    if case["fate"] == "L":
        assert verdict == LIBRATION
        assert found["limit_phi"][0] == pytest.approx(detail[0], abs=1e-7)
    assert found["turnings"][0] == (-1 if case["turns"] == "inf" else case["turns"])
    assert found["status"][0] == 0


def images(six, starts, angle, factor):
    """Symmetric systems and starts: S2, S3, S4 (by `angle`), S5 (by `factor`), and whether signs
    are exchanged.
    """
    b12, b31, d, c23, s2, s3 = six
    phi, w = starts.T
    c, s = math.cos(angle), math.sin(angle)
    c2, s2a = math.cos(2 * angle), math.sin(2 * angle)
    k = factor
    turned = [
        b12 * c - b31 * s,
        b12 * s + b31 * c,
        d * c2 - 2 * c23 * s2a,
        c23 * c2 + d / 2 * s2a,
        s2 * c - s3 * s,
        s2 * s + s3 * c,
    ]
    yield [b12, -b31, d, -c23, -s2, s3], np.stack([-phi, -w], 1), True
    yield [-b12, -b31, d, c23, -s2, -s3], np.stack([phi + math.pi, w], 1), False
    yield turned, np.stack([phi - angle, w], 1), False
    yield (
        [b12 * k, b31 * k, d * k * k, c23 * k * k, s2 * k * k, s3 * k * k],
        np.stack([phi, w * k], 1),
        False,
    )


EXCHANGED = {-1: -1, 0: 0, 1: 1, 2: 3, 3: 2, 4: 4, 5: 6, 6: 5, 7: 7, 8: 8, 9: 9}


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_symmetries_carry_fates(seed):
    """Verdict, turning points, net turns and multipliers under S2-S5; the numbers differ, so all
    decisions do.
    """
    random, undecided, count = np.random.default_rng(seed), 0, 40 if seed == 1 else 400
    for i in range(count):
        six = random_system(random, i)
        starts = np.stack([random.uniform(-4, 4, 12), random.normal(size=12) * 4], 1)
        one = fates(six, starts)
        undecided += (one["verdict"] < 0).sum()
        for other_six, other_starts, exchanged in images(
            six, starts, random.uniform(0, 6), math.exp(random.normal())
        ):
            two = fates(other_six, other_starts)
            mine = np.array([EXCHANGED[v] for v in one["verdict"]]) if exchanged else one["verdict"]
            both = (mine >= 0) & (two["verdict"] >= 0)
            assert np.array_equal(mine[both], two["verdict"][both]), six.tolist()
            known = both & (one["turnings"] > -2) & (two["turnings"] > -2)
            assert np.array_equal(one["turnings"][known], two["turnings"][known])
            turns = both & (one["net_turns"] != cf.NO_TURNS)
            assert np.array_equal(
                (-1 if exchanged else 1) * one["net_turns"][turns], two["net_turns"][turns]
            )
            gap = np.abs(one["multiplier"] - two["multiplier"])
            assert not (gap > one["multiplier_error"] + two["multiplier_error"]).any()
    assert undecided <= 0.003 * 12 * count


def ended(six, phi, w, time):
    """Turning times and last state by scipy's DOP853."""
    b12, b31, d, c23, s2, s3 = six

    def rates(_t, y):
        s, c = math.sin(y[0]), math.cos(y[0])
        return [
            y[1],
            (b12 * c - b31 * s) * y[1] - d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s,
        ]

    options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-11, "max_step": 0.5}
    run = solve_ivp(rates, (0, time), [phi, w], events=lambda _t, y: y[1], **options)
    return run.t_events[0], run.y_events[0], run.y[:, -1]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 5])
def test_long_integration_agrees(seed):
    random, late = np.random.default_rng(seed), 0
    count, each = (8, 4) if seed == 1 else (60, 16)
    for i in range(count):
        six = random_system(random, i)
        starts = np.stack([random.uniform(-3, 3, each), random.normal(size=each) * 3], 1)
        found = fates(six, starts)
        for j, (phi, w) in enumerate(starts):
            times, places, end = ended(six, phi, w, 200.0)
            verdict, turnings = found["verdict"][j], found["turnings"][j]
            sign = 1 if verdict in (PLUS, UP) else -1
            if verdict == REST:
                gap = abs((end[0] - found["limit_phi"][j] + math.pi) % (2 * math.pi) - math.pi)
                late += gap > 1e-3
                if gap < 1e-3 and turnings >= 0:
                    assert (times < 100).sum() == turnings
                if gap < 1e-3:
                    assert found["net_turns"][j] == math.trunc((end[0] - phi) / (2 * math.pi))
            elif verdict in (PLUS, MINUS, UP, DOWN):
                if end[1] * sign < 0 or len(times) < turnings:  # slow: it has not turned yet
                    times, places, end = ended(six, phi, w, 5000.0)
                assert end[1] * sign > 0 and len(times) == turnings
            elif verdict == LIBRATION:
                x = max((place[0] for place in places[-2:]), default=math.nan)
                gap = abs((x - found["limit_phi"][j] + math.pi) % (2 * math.pi) - math.pi)
                late += not gap <= 1e-3
    assert late <= 0.15 * each * count


def test_equilibrium_starts():
    """Of binary64 angles only 0 is exactly an equilibrium; the fall from pi is not claimed to end
    anywhere.
    """
    pendulum = (0, 0, 0, 0, 0, 1.0)
    found = fates(pendulum, [[0, 0], [math.pi, 0], [-math.pi, 0], [7 * math.pi, 0], [1e-9, 0]])
    assert found["verdict"].tolist() == [START] + [UNDECIDED] * 3 + [SWINGS]
    for s3 in (1.0, -1.0):  # g(0) = s2 - c23 = 0: a focus, a saddle
        found = fates((0.3, 0.2, 0.5, 0.7, 0.7, s3), [[0.0, 0.0], [5e-324, 0.0], [0.0, 1e-300]])
        assert (
            found["verdict"].tolist() == [START, UNDECIDED, UNDECIDED]
            and found["limit_phi"][0] == 0.0
        )


def test_a_start_beside_an_equilibrium_is_not_at_it():
    """One ulp and less from a focus that attracts it is reached; a saddle is left to the side to
    which g points.
    """
    s = cf.skeleton(taylor, SIX)
    for row in s.equilibria:
        x = row[eq.ANGLE]
        starts = [np.nextafter(x, -9), x, np.nextafter(x, 9), x + 1e-12]
        found = fates(SIX, [[phi, 0] for phi in starts])
        if row[eq.KIND] != eq.SADDLE:
            assert (
                (found["verdict"] == REST).all()
                if row[eq.STABLE] < 0
                else (found["verdict"] >= 0).all()
            )
            assert (found["turnings"] == -1).all() or row[eq.STABLE] >= 0
            continue
        with mp.workdps(40):
            g = [force(SIX, mp.mpf(phi)) for phi in starts]
        aside = fates(SIX, [[x + 1e-5 * mp.sign(value), 0] for value in g])
        assert (
            found["verdict"].tolist() == aside["verdict"].tolist() and (aside["verdict"] >= 0).all()
        )


def force(six, phi):
    """g at phi, with mpmath."""
    d, c23, s2, s3 = map(mp.mpf, six[2:])
    return -d * mp.sin(2 * phi) / 2 - c23 * mp.cos(2 * phi) + s2 * mp.cos(phi) - s3 * mp.sin(phi)


@pytest.mark.parametrize("ulps", [9, 18, 45, 450, 1e10])
def test_a_small_K_is_not_taken_as_none(ulps):
    """Beside the stratum I2: nothing periodic, and no cycles out of the rounding of D: spin-up, or
    undecided.
    """
    for side in (1, -1):
        six = (0.7, -0.4, 0.0, 0.0, 0.7, -0.4 * (1 + side * ulps * 2.0**-52))
        assert cf.stratum_of(*six) == cf.G
        s = cf.skeleton(taylor, six)
        assert np.sign(s.K) == -side and all(row[rt.CYCLE_CLASS] < 0 for row in (*s.plus, *s.minus))
        found = fates(six, [[1.0, 3.0], [1.0, -3.0], [1.0, 20.0], [1.0, 80.0]])
        sure = [UNDECIDED] if side > 0 else [UNDECIDED, UP, DOWN]
        assert np.isin(found["verdict"], sure).all()


def test_stratum_I0():
    """g = 0: w - F is conserved; below max|F| the state stops at a root of F = -(w - F)."""
    b12, b31, phi, w = 0.5, 0.3, 2.0, 0.1
    found = fates((b12, b31, 0, 0, 0, 0), [[phi, w], [phi, 2.0], [phi, 0.0]])
    assert found["verdict"].tolist() == [REST, TURNS, START]
    y = w - b12 * math.sin(phi) - b31 * math.cos(phi)
    x = found["limit_phi"][0]
    assert (
        abs(y + b12 * math.sin(x) + b31 * math.cos(x)) < 1e-15
        and b12 * math.cos(x) - b31 * math.sin(x) < 0
    )


def test_stratum_I1():
    """A pendulum with H = 1 is the separatrix: nothing is claimed there."""
    found = fates((0, 0, 0, 0, 0, 1.0), [[0, 2 - 1e-12], [0, 2.0], [0, 2 + 1e-12]])
    assert found["verdict"].tolist() == [SWINGS, UNDECIDED, TURNS]
    assert found["status"][1] != 0


def test_stratum_I2():
    """K = L = 0: fast rotations are periodic; w has the same value a turn later, which
    `trajectories` confirms.
    """
    delta, sigma, b12, b31 = 0.8, 0.35, 0.5, 0.8
    six = (b12, b31, delta * (b12**2 - b31**2), delta * b12 * b31, sigma * b12, sigma * b31)
    assert cf.stratum_of(*six) == cf.I2
    found = fates(six, [[0.4, 3.7], [1.0, -1.0], [2.0, 0.1]])
    assert found["verdict"].tolist() == [TURNS, TURNS, REST]
    delta, sigma = 0.2, -1.0  # a centre: f = 0, g' < 0 in the middle of librations
    six = (b12, b31, delta * (b12**2 - b31**2), delta * b12 * b31, sigma * b12, sigma * b31)
    axis = math.atan2(b12, b31)
    centre = axis if (sigma - delta * math.hypot(b12, b31)) > 0 else axis + math.pi
    assert fates(six, [[centre + 0.1, 0.0]])["verdict"][0] == SWINGS


def test_far_cycle():
    """Small K: a rotation cycle at w ~ -L/(pi K), resolved or not."""
    for K in (-4e-3, -1e-3, -1e-5, -1e-8):
        s = cf.skeleton(taylor, (1.0, 0.0, 0.3, 1.0, 0.5, K))
        assert len(s.plus) == 1 and len(s.minus) == 0
        assert abs(s.plus[0, rt.CYCLE_X] + s.L / (math.pi * s.K)) < 1 + s.plus[0, rt.CYCLE_BAR]


def test_parity_law():
    """The number of rotation cycles is even where sign(w_d - w_c) = sign(K), odd where not."""
    random, checked = np.random.default_rng(9), 0
    for i in range(60):
        s = cf.skeleton(taylor, random_system(random, i))
        for cycles, (w_c, w_d) in zip((s.plus, s.minus), s.thresholds, strict=True):
            if s.K == 0.0 or math.isnan(w_c):
                continue
            checked += 1
            assert len(cycles) % 2 == (np.sign(w_d - w_c) != np.sign(s.K))
    assert checked > 40


def test_cycles_are_searched_where_fates_need_them():
    """Fates by equilibria, and by the cycles above a motion that grows, are those by all cycles;
    most need none.
    """
    random, searched = np.random.default_rng(17), []
    for i in range(60):
        system, starts = random_system(random, i), random.normal(size=(3, 2)) * [1, 2]
        few, whole = cf.skeleton(taylor, system), cf.skeleton(taylor, system)
        assert len(whole.plus) + len(whole.minus) + len(whole.librations) < 20  # all are known
        assert np.array_equal(
            cf.fates(taylor, few, starts, 1e-9), cf.fates(taylor, whole, starts, 1e-9)
        )
        searched.append(len(few.found))
    assert 20 < searched.count(0) < 60 and max(searched) > 1


def test_beside_a_separatrix_fates_are_those_of_its_sides():
    """N1: double-double tells on which side of the stable branch of a saddle the doubles next to it start."""
    phi, nearest, saddle = 3.5, 1.85414457907569906, 4.65094863594827606
    starts = [
        nearest - 1e-9,
        *(nearest + i * np.spacing(nearest) for i in (-1, 0, 1)),
        nearest + 1e-9,
    ]
    found = fates(SIX, [[phi, w] for w in starts])
    assert (found["verdict"] >= 0).all() and (found["status"] == 0).all()
    known = list(
        zip(*(found[name].tolist() for name in ("verdict", "turnings", "net_turns")), strict=True)
    )
    passed = [exact(SIX, phi, w, 25.0, 40)[0] > saddle for w in starts]
    assert known[0] != known[-1] and passed[-1] and not passed[0]
    assert known == [known[-1] if beyond else known[0] for beyond in passed]


def test_beside_separatrices_without_barnett_london_effect():
    """H = w^2/2 - cos phi is 1 on the separatrix of the pendulum: doubles next to it are distinguished."""
    phi = np.array([0.1, 1.0, -2.0, 3.0])
    starts = [[x, w] for x in phi for w in 2 * math.cos(x / 2) * (1 + np.arange(-2, 3) * 2e-16)]
    found = fates((0, 0, 0, 0, 0, 1.0), starts)
    with mp.workdps(50):
        above = [mp.mpf(w) ** 2 / 2 - mp.cos(mp.mpf(x)) > 1 for x, w in starts]
    assert found["verdict"].tolist() == [TURNS if side else SWINGS for side in above]


def test_sides_of_cycles_are_consistent():
    """Stable cycles attract on both sides, and D keeps its sign from one rotation cycle to the next."""
    random = np.random.default_rng(31)
    for i in range(40):
        s = cf.skeleton(taylor, random_system(random, 3 * i + 1))
        for row in (*s.librations, *s.plus, *s.minus):
            assert (row[rt.MULTIPLIER] < 1) == (row[rt.BELOW] > 0 > row[rt.ABOVE])
        for cycles in (s.plus, s.minus):
            assert np.array_equal(cycles[:-1, rt.ABOVE], cycles[1:, rt.BELOW])
