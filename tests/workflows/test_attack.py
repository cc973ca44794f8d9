"""The attack in short form finds nothing; with bars made too small and verdicts turned it must find that."""

import json

import numpy as np
import pytest
from attack import command, compare, floquet
from mpmath import mp, mpf

import survey
from survey.truth import brun, brun_sums, danby, gyrostat_flow, hill, user_equations
from survey.truth.brun_digits import truth as brun_in_full

FAULTS = compare.FAULTS


def found(family, seed, size, index=0):
    """(counts, faults) of a chunk."""
    part = command.solve(family, seed, index, size)
    faults = [fault for fault in part["faults"] if fault["kind"] in FAULTS]
    return sum((compare.Counter(row[3]) for row in part["rows"]), compare.Counter()), faults


@pytest.mark.slow
@pytest.mark.parametrize(("family", "size"), [
    ("satellite", 40), ("mathieu", 60), ("libration_elliptic", 40), ("libration", 60), ("own", 40), ("floquet", 60),
    ("orbit", 100), ("abel", 100),
    # compile for long
    *(pytest.param(*one, marks=pytest.mark.slow) for one in (("gyrostat", 150), ("brun", 150))),
])  # fmt: skip
def test_there_are_no_faults(family, size):
    counts, faults = found(family, 3, size)
    assert counts["points"] >= size
    assert not faults, "\n".join(
        f"{f['kind']} {f['what']} {f['said']}\n  {f['line']}" for f in faults
    )
    assert counts["unchecked"] < 0.5 * counts["points"]


@pytest.mark.slow
@pytest.mark.parametrize("family", command.FAMILIES)
def test_there_are_no_faults_at_length(family):
    """10^5 points in all."""
    share, size = command.FAMILIES[family]
    for index in range(max(1, round(1e5 * share / size))):
        _counts, faults = found(family, 5, size, index)
        assert not faults, faults[0]


def batch(**more):
    """A few points of a satellite, unstable and stable, far from every edge."""
    given = {"k": np.array([0.95, 0.5, 0.3, 0.9]), "rho": np.array([0.6, 1.3, 2.0, 0.8])}
    true = hill.satellite("k", False, 1, False)
    return compare.Batch(
        "satellite", "control", given, true, None, {"body": "prolate"}, "auto", 1e-8, **more
    )


def counted(monkeypatch, change):
    """The faults counted in answers that were changed."""
    honest = survey.evaluate
    monkeypatch.setattr(
        compare.survey,
        "evaluate",
        lambda *given, **named: change(honest(*given, **named).copy(deep=True)),
    )
    return compare.compare(batch())[0]


def test_the_honest_answers_pass():
    assert not any(compare.compare(batch())[0][kind] for kind in FAULTS)


def test_a_bar_too_small_is_a_lie(monkeypatch):
    def smaller(ds):
        ds["discriminant"] += 1e-9
        ds["discriminant_error"][:] = 1e-10
        return ds

    assert counted(monkeypatch, smaller)["lies"] >= 4


def test_a_turned_verdict_is_wrong(monkeypatch):
    def turned(ds):
        ds["verdict"] = 1 - ds.verdict
        return ds

    assert counted(monkeypatch, turned)["wrong"] >= 4


def test_a_nan_beside_ok_is_silent(monkeypatch):
    def emptied(ds):
        ds["y1"][1] = np.nan
        ds["y2_error"][2] = -1.0
        return ds

    assert counted(monkeypatch, emptied)["silent"] == 2


def test_an_exception_is_a_traceback(monkeypatch):
    def broken(ds):
        raise ZeroDivisionError

    assert counted(monkeypatch, broken)["tracebacks"] == 1


def in_full(out, column):
    """The number in this column and the next, high and low."""
    return mpf(out[column]) + mpf(out[column + 1])


@pytest.mark.parametrize(
    ("k", "rho", "oblate"),
    [(0.3, 1.0, False), pytest.param(0.9, 2.2, True, marks=pytest.mark.slow), (1.3, -0.7, False)],
)
def test_truth_of_satellites(k, rho, oblate):
    """Against mpmath's Taylor series of the pendulum, 30 digits."""
    with mp.workdps(34):
        a, r = mpf(k), mpf(rho)

        def slope(u, x):
            s, c, w, y1, v1, y2, v2 = x
            z = 2 * w * w + 2 * r * w + r * r + (-a * a if oblate else 1 - a * a)
            return [c * w, -s * w, -s * c, v1, -z * y1, v2, -z * y2]

        half = 2 * mp.ellipk(a * a) if k < 1 else mp.ellipk(1 / (a * a)) / a
        y = mp.odefun(slope, 0, [0, 1, a, 1, 0, 0, 1], tol=mpf(10) ** -30)(half)
        out = hill.solved(hill.K, k, hill.RHO, rho, 1.0, oblate)[0]
        columns = (*hill.FACTOR_COLUMNS.values(), hill.END)
        for column, true in zip(columns, (y[3], y[5], y[4], y[6], half), strict=True):
            assert abs(in_full(out, column) - true) < 1e-28 * (1 + abs(true))


def floquet_rows(kind, number):
    """(rows of parameters, exact monodromy matrices) of a batch of this kind, as its truth has them."""
    seen = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            floquet, "_compared", lambda _answer, found, _period, **_more: seen.extend(found)
        )
        batch = getattr(floquet, f"_{kind}")(np.random.default_rng(4), number, "auto", 1e-10)
        batch.truth(batch.given, {})
    return np.column_stack(list(batch.given.values())), [found[2] for found in seen]


@pytest.mark.slow
def test_truth_of_linear_periodic_systems():
    """exp(G B) by mpmath, and damped Mathieu equations by its Taylor series, 30 digits."""
    with mp.workdps(50):
        for row, M in zip(*floquet_rows("scaled", 3), strict=True):
            n, (c, w, T) = len(M), map(mpf, row[-3:])
            B = mp.matrix(row[: n * n].reshape(n, n).tolist()) * (T + c * mp.sin(w * T) / w)
            exact = mp.expm(B, method="taylor")
            assert mp.norm(exact - mp.matrix(M)) < 1e-30 * mp.norm(exact)
    with mp.workdps(32):
        for (a, q, s, c, T), M in zip(*floquet_rows("damped", 1), strict=True):
            x = 2 * mpf(np.pi) / mpf(T)

            def slope(t, y, a=a, q=q, s=s, c=c, x=x):
                z = a + q * mp.cos(x * t) + s * mp.cos(2 * x * t)
                return [y[1], -z * y[0] - 2 * c * y[1], y[3], -z * y[2] - 2 * c * y[3]]

            y = mp.odefun(slope, 0, [1, 0, 0, 1], tol=mpf(10) ** -28)(mpf(T))
            for i, j, value in ((0, 0, y[0]), (1, 0, y[1]), (0, 1, y[2]), (1, 1, y[3])):
                assert abs(M[i][j] - value) < 1e-24 * (1 + abs(value))


def test_truth_of_danbys_map():
    """At e = 0 the circular problem, at the tip a = -4, b = 6 to the digits of the tip's float64."""
    mu = 0.01
    root = mp.sqrt(1 - 27 * mpf(mu) * (1 - mpf(mu)))
    true = 2 * mp.cos(2 * mp.pi * mp.sqrt((1 + root) / 2)) + 2 * mp.cos(
        2 * mp.pi * mp.sqrt((1 - root) / 2)
    )
    assert abs(danby.solved(mu, 0.0)[0, danby.A] - true) < 1e-15
    assert danby.solved(*(0.04699080701821065, 0.31450715975493514))[
        0, [danby.A, danby.B]
    ] == pytest.approx([-4, 6], abs=1e-13)


@pytest.mark.slow
def test_truth_of_a_gyrostat():
    p = [0.7, -0.4, 1.1, 0.3, 0.5, -0.2, 1.5, 0.8, 4.0]
    with mp.workdps(34):
        b12, b31, d, c23, s2, s3 = (mpf(x) for x in p[:6])

        def slope(t, x):
            c, s = mp.cos(x[0]), mp.sin(x[0])
            f, g = b12 * c - b31 * s, -d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s
            return [x[1], f * x[1] + g]

        y = mp.odefun(slope, 0, [mpf(p[6]), mpf(p[7])], tol=mpf(10) ** -30)(4)
        out = np.empty((1, gyrostat_flow.COLUMNS))
        gyrostat_flow.flow(np.array([p]), gyrostat_flow.TINY, out)
        for column, true in zip((gyrostat_flow.END_PHI, gyrostat_flow.END_W), y, strict=True):
            assert abs(in_full(out[0], column) - true) < 1e-27
        # along phi to where it was: the same w, at that time
        there = np.array([[*p[:8], 1.9]])
        along, back = np.empty((2, 1, gyrostat_flow.COLUMNS))
        gyrostat_flow.along(there, gyrostat_flow.TINY, along)
        time = along[0, gyrostat_flow.TIME]
        gyrostat_flow.flow(np.array([[*p[:8], time]]), gyrostat_flow.TINY, back)
        assert abs(back[0, gyrostat_flow.END_PHI] - 1.9) < 1e-15
        assert abs(back[0, gyrostat_flow.END_W] - along[0, gyrostat_flow.VALUE]) < 1e-15


@pytest.mark.slow
def test_truth_of_bruns_problem():
    """Against elliptic integrals at 60 digits."""
    state = np.array([2.0, 1.0, 0.6, 1.1, 0.5, 1.3, 0.9])
    out = np.empty((1, brun_sums.COLUMNS))
    brun_sums.states(state[None], 1024, out)
    with mp.workdps(60):
        true, _floor = brun_in_full(state)
        for column, value in zip(brun.COLUMNS, true, strict=True):
            assert abs(in_full(out[0], column) - value) < 1e-27 * (1 + abs(value))


# L - L_sep is 2e-27: the double-double truth of T is off by 3.75e-6, its last digits are mpmath's
# with 120 digits
SADDLE = [2.2392854657601977, 2.129834011504694, 1.9042235387022515, 1.6708645190597524, 3.202817341372608e-14,
          -0.5746061869076509, -0.021826613975397063]  # fmt: skip
SADDLE_PERIOD = "836.306482278309586125838774447"


@pytest.mark.slow
def test_truth_of_a_motion_that_turns_just_before_a_pole():
    """P(1) = 0 exactly, P < 0 next to it: it turns at 1 - u = 3.5e-17, and takes as long as our
    scene says.
    """
    point = [2.0, 4.0, 0.5, np.pi / 2, -1.0, -1.0, -1.0]
    brun_sums.states(np.array([point]), brun.NODES, out := np.empty((1, brun_sums.COLUMNS)))
    with mp.workdps(60):
        cosine = mp.cos(mpf(point[3]))
        energy = 1 + (1 - cosine) / (1 + cosine)
        level, five = energy - 2 * (1 - cosine**2), energy + 2 * cosine**2 + 1 - 10
        short = mp.findroot(lambda v: 2 * level - five * v - 8 * v**2 + 2 * v**3, 2 * level / five)
        assert abs(1 - in_full(out[0], brun_sums.U_MAX) - short) < 1e-30
    ds = survey.evaluate("brun", **dict(zip(brun.NAMES, point, strict=True)))
    assert abs(float(ds.period) - out[0, brun_sums.PERIOD]) < float(ds.period_error)


@pytest.mark.slow
def test_truth_beside_a_saddle_of_bruns_problem():
    out = np.empty((1, brun_sums.COLUMNS))
    brun_sums.states(np.array([SADDLE]), brun.NODES, out)
    value, low, doubt = (x[0] for x in brun._rows(out, None)["period"])
    off = abs(mpf(value) + mpf(low) - mpf(SADDLE_PERIOD))
    assert 1e-7 < off < doubt < 1
    full = brun._in_full(np.array(SADDLE), out[0])
    with mp.workdps(40):
        assert abs(in_full(full, brun_sums.PERIOD) - mpf(SADDLE_PERIOD)) < 1e-24
    given = dict(zip(brun.NAMES, np.array([SADDLE]).T, strict=True))
    one = compare.Batch("brun states", "saddle", given, brun.states, "brun")
    counts, worst, faults = compare.compare(one)
    assert not faults and counts["unchecked"] == 0 and worst < 1


OWN = {
    "harmonics": [3.0, 1.0, -2.0, 0.0, 0.5, 0.3, 0.0, -1.0, 0.2, 0.7],
    "harmonics even": [-1.0, 4.0, -2.0, 0.7, 0.5, 0.0, 0.0, 0.0, 0.0, 0.9],
    "meissner": [20.0, -3.0, 0.3],
    "meissner even": [-2.0, 30.0, 0.2],
    "bent": [5.0, -20.0, 7.0, 3.0, 0.4],
    "spike": [5.0, 40.0, 0.3, 0.25],
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name == "harmonics")) for name in OWN]
)
def test_truth_of_own_equations(name):
    """Against mpmath's Taylor series, piece by piece."""
    p = np.array(OWN[name])
    length = p[9] if name.startswith("harmonics") else 1.0
    end = length / 2 if "even" in name else length
    place = p[-1] if name in ("meissner", "meissner even", "bent") else end
    with mp.workdps(15):
        exact = [mpf(x) for x in p]

        def z(u, piece):
            if name.startswith("harmonics"):
                x = mpf(user_equations.TWO_PI) * u / exact[9]
                waves = (
                    exact[n] * mp.cos(n * x) + exact[4 + n] * mp.sin(n * x) for n in range(1, 5)
                )
                return exact[0] + sum(waves)
            if name == "spike":
                return exact[0] + exact[1] / (1 + ((u - exact[2]) / exact[3]) ** 2)
            if name == "bent":
                return exact[2] + exact[3] * mp.cos(6 * u) if piece else exact[0] + exact[1] * u
            return exact[piece]

        x = [mpf(1), mpf(0), mpf(0), mpf(1)]
        for piece, (start, stop) in enumerate([(0, place), (place, end)]):
            if start < stop:
                x = mp.odefun(lambda u, x, n=piece: [x[1], -z(u, n) * x[0], x[3], -z(u, n) * x[2]], mpf(start), x,
                              tol=mpf(10) ** -13)(mpf(stop))  # fmt: skip
        out = user_equations.solved(name, p[None])[0]
        for name, true in zip(("y1", "dy1", "y2", "dy2"), x, strict=True):
            assert abs(in_full(out, hill.FACTOR_COLUMNS[name]) - true) < 1e-11 * (1 + abs(true))


def test_the_command(tmp_path, capsys):
    """It writes its page and table, refuses another attack, and a resumed one has the same numbers."""
    page = tmp_path / "attack.md"
    assert command.run(20, ["libration"], 1, page, 1, None, False) == 0, page.read_text()
    first, table = page.read_text(), page.with_suffix(".csv").read_text()
    assert "no faults" in capsys.readouterr().err
    assert "| libration |" in first and table.startswith("scene,method,region,points")
    assert command.run(20, ["libration"], 1, page, 1, None, False) == 0
    assert page.with_suffix(".csv").read_text() == table
    assert command.run(21, ["libration"], 1, page, 1, None, False) == 2
    assert json.loads((tmp_path / "attack.md.chunks" / "attack.json").read_text())["points"] == 20


def test_truth_of_a_spike():
    """A weak spike changes y1(T) by its first-order term (Picard), which mpmath integrates."""
    weak, at, wide, rate = 1e-9, 0.3, 1e-3, 5.0
    out, rest = (
        user_equations.solved("spike", np.array([[rate, b, at, wide]]))[0] for b in (weak, 0.0)
    )
    root = mp.sqrt(mpf(rate))

    def term(u):
        shape = 1 / (1 + ((u - at) / wide) ** 2)
        return -weak * shape * mp.sin(root * (1 - u)) / root * mp.cos(root * u)

    true = mp.quad(term, [0, at - 20 * wide, at - 3 * wide, at, at + 3 * wide, at + 20 * wide, 1])
    with mp.workdps(40):
        change = in_full(out, hill.Y1) - in_full(rest, hill.Y1)
    assert abs(change - true) < 1e-5 * abs(true)
