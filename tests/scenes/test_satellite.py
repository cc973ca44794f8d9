"""The satellite against 40-digit references, exact facts, and an independent mpmath integration."""

import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from hill_problems import BODY, cases, mp_factors, rotation, solve, truth
from mpmath import mp, mpf

import survey
from survey import status

METHODS = ["taylor16", "magnus6", "rk4", "dop853"]


def assert_within(out, known, i=0):
    for name, value in known.items():
        error, bar = abs(mpf(float(out[name].flat[i])) - value), out[f"{name}_error"].flat[i]
        assert error <= bar, (name, float(error), bar)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-6, 1e-10, 1e-13])
def test_references_lie_within_the_bars(method, rtol):
    for case in cases("libration", "nasty", "rotation"):
        k, rho = float.fromhex(case["k_hex"]), float.fromhex(case["rho_hex"])
        out = solve(BODY[case["fam"]], method, rtol, k=k, rho=rho)
        assert_within(out, truth(case))
        assert out["verdict"][0] == int(case["stable"])


@pytest.mark.parametrize(
    ("group", "accuracy"), [("libration", 1e-11), ("rotation", 1e-11), ("nasty", 1e-9)]
)
def test_references_to_the_promised_accuracy(group, accuracy):
    for case in cases(group):
        out = solve(
            BODY[case["fam"]], k=float.fromhex(case["k_hex"]), rho=float.fromhex(case["rho_hex"])
        )
        value = mpf(case["Delta"])
        assert abs(out["discriminant"][0] - value) < accuracy * (1 + abs(value))


def test_boundaries():
    """On an edge the named factor vanishes within its bar; 1e-9 to either side the verdicts differ
    and are right.
    """
    names = {"y1_half": "y1", "y2_half": "y2", "dy1_half": "dy1", "dy2_half": "dy2"}
    for case in cases("boundaries"):
        k, rho = float(case["k"]), float(case["rho_star"])
        out = solve(BODY[case["fam"]], k=k, rho=rho + np.array([0.0, -1e-9, 1e-9]))
        factor = names[case["factor_zero"]]
        assert abs(out[factor][0]) < out[f"{factor}_error"][0] + 1e-14
        assert sorted(out["verdict"][1:]) == [0, 1]


def test_rotation_boundary():
    case = cases("rotation_boundaries")[0]
    out = solve(
        "prolate", k=float(case["k_star"]) + np.array([0.0, -1e-9, 1e-9]), rho=np.full(3, 3**-0.5)
    )
    assert abs(out["dy1"][0]) < 1e-13
    assert sorted(out["verdict"][1:]) == [0, 1]


def random_points(count, seed):
    random = np.random.default_rng(seed)
    families = random.choice(["PL", "OL", "PR", "OR"], count)
    for family in families:
        near = random.random() < 0.4
        short = 10 ** random.uniform(-9, -1) if near else random.uniform(0.05, 1)
        k = 1 / (1 - min(short, 0.9)) if family in ("PR", "OR") else 1 - short
        yield family, k, random.uniform(-4, 4)


@pytest.mark.parametrize("rtol", [1e-6, pytest.param(1e-12, marks=pytest.mark.slow)])
def test_random_points_against_mpmath(rtol):
    sharp = []
    for family, k, rho in random_points(16, seed=int(-np.log10(rtol))):
        with mp.workdps(30):
            y1, dy1, y2, dy2, m, d = mp_factors(family, k, rho)
            discriminant = 2 * (2 * y1 * dy2 - 1)
            known = {"y1": y1, "y2": y2, "dy1": dy1, "dy2": dy2, "discriminant": discriminant,
                     "rotation_number": rotation(discriminant, m + d)}  # fmt: skip
            out = solve(BODY[family], rtol=rtol, k=k, rho=rho)
            assert_within(out, known)
            assert out["verdict"][0] == (abs(discriminant) < 2)
            sharp += [
                abs(out[n][0] - known[n]) / out[f"{n}_error"][0] for n in ("y1", "y2", "dy1", "dy2")
            ]
    assert np.median(np.array(sharp, dtype=float)) > 0.005


@pytest.mark.parametrize(
    "short",
    [
        1e-12,
        -1e-10,
        *(pytest.param(short, marks=pytest.mark.slow) for short in (1e-3, 1e-6, 1e-9, -1e-6)),
    ],
)
@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_near_the_separatrix_from_one_minus_k(short, body):
    """No digit of 1 - k is lost: relative error of the discriminant below 1e-12."""
    family = ("P" if body == "prolate" else "O") + ("L" if short > 0 else "R")
    with mp.workdps(40):
        y1, _, _, dy2, _, _ = mp_factors(family, 1 - mpf(short), 0.7, digits=40)
        known = {"y1": y1, "dy2": dy2, "discriminant": 4 * y1 * dy2 - 2}
        out = solve(body, rtol=1e-13, one_minus_k=short, rho=0.7)
        assert_within(out, known)
        size = 1 + abs(known["discriminant"])
        assert abs(out["discriminant"][0] - known["discriminant"]) < 1e-12 * size


@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_no_amplitude_closed_form(body):
    rho = np.linspace(0.05, 9.0, 400)
    turns = np.sqrt(1 + rho**2) if body == "prolate" else rho
    out = solve(body, k=0.0, rho=rho)
    with mp.workdps(30):
        turned = [mp.sqrt(1 + mpf(r) ** 2) if body == "prolate" else mpf(r) for r in rho.tolist()]
        for i, turn in enumerate(turned):
            assert_within(
                out, {"discriminant": 2 * mp.cos(2 * mp.pi * turn), "rotation_number": turn}, i
            )
    assert np.all((out["verdict"] == 1) | (2 * turns == np.rint(2 * turns)))
    assert np.all(out["exponent"] == 0)


def test_marginal_by_exact_rules_only():
    rho = np.array([0.5, 1.0, 1.5, 1.5 + 2e-16 * 2, np.sqrt(5) / 2, 0.0])
    assert list(solve("oblate", k=0.0, rho=rho)["verdict"]) == [2, 2, 2, 1, 1, 2]
    assert list(solve("prolate", k=0.0, rho=rho)["verdict"]) == [1, 1, 1, 1, 1, 2]


@pytest.mark.parametrize(
    ("alpha", "direction"), [(4 / 3, "1"), (4 / 3, "-1"), (31 / 27, "1"), (31 / 27, "-1")]
)
def test_no_inertia_ratio_is_marginal_without_amplitude(alpha, direction):
    """rho^2 = 1 / (3 (alpha - 1)) = n^2 / 4 has no solution in binary fractions; rho itself rounds
    to 1 and 3/2.
    """
    ds = survey.evaluate("satellite", k=0.0, inertia_ratio=alpha, direction=direction)
    square = 1 / (3 * (Fraction(alpha) - 1))
    assert int(ds.verdict) == 1 and (4 * square).denominator > 1
    with mp.workdps(40):
        turns = mp.sqrt(mpf(square.numerator) / square.denominator)
        known = {"discriminant": 2 * mp.cos(2 * mp.pi * turns), "rotation_number": turns}
        assert turns != mpf(float(turns))
        for name, value in known.items():
            assert abs(mpf(float(ds[name])) - value) <= float(ds[f"{name}_error"]), name


@pytest.mark.parametrize(
    ("body", "k", "turns"),
    [("prolate", 0.6, 1), ("oblate", 0.6, 0), ("prolate", 1.7, 0.5), ("oblate", 1.7, 0.5)],
)
def test_lame_at_rho_0(body, k, turns):
    out = solve(body, k=k, rho=0.0)
    assert out["verdict"][0] == 2
    assert out["rotation_number"][0] == turns
    assert out["exponent"][0] == 0 and np.isnan(out["exponent_per_orbit"][0])
    assert abs(abs(out["discriminant"][0]) - 2) <= out["discriminant_error"][0]


@pytest.mark.parametrize("body", ["prolate", "oblate"])
@pytest.mark.parametrize("short", [0.3, 1e-9, -1e-9, -0.3])
def test_on_an_edge_the_discriminant_is_exact(body, short):
    """At rho = 0 w or its derivative solves the equation (Lame's): |D| = 2, whatever a factor's bar
    near k = 1.
    """
    out = solve(body, one_minus_k=short, rho=0.0)
    assert (
        abs(out["discriminant"][0]) == 2
        and out["discriminant_error"][0] == 0
        and out["verdict"][0] == 2
    )


@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_parity_of_librations(body):
    rho = np.linspace(0.1, 5, 40)
    plus, minus = (solve(body, k=0.83, rho=sign * rho) for sign in (1, -1))
    for name, other in {
        "y2": "y2",
        "dy1": "dy1",
        "y1": "dy2",
        "discriminant": "discriminant",
    }.items():
        assert np.all(
            abs(plus[name] - minus[other]) <= plus[f"{name}_error"] + minus[f"{other}_error"]
        )
    np.testing.assert_allclose(
        plus["discriminant"] + 2, 4 * plus["y1"] * minus["y1"], rtol=1e-10, atol=1e-11
    )
    assert np.all(plus["verdict"] == minus["verdict"])


def test_rotations_tell_prograde_from_retrograde():
    assert (
        solve(k=1.2, rho=0.69)["discriminant"][0] * solve(k=1.2, rho=-0.69)["discriminant"][0] < 0
    )


@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_lyapunov_never_certifies_an_unstable_point(body):
    k = np.concatenate([np.linspace(0, 0.99, 12), np.linspace(1.01, 8, 40)])[:, None]
    rho = np.linspace(-9, 4, 131)[None, :]
    out = solve(body, k=k, rho=rho)
    certified = out["lyapunov"] == 1
    assert certified.sum() > 30
    assert np.all(np.isin(out["verdict"][certified], [1, 2]))
    # No libration that is a body (rho >= 1/sqrt 3) is certified, whatever the paper says:
    # satellite.md: What is known.
    assert not np.any(certified & (k < 1) & (abs(rho) >= 3**-0.5))


@pytest.mark.parametrize(
    ("rho", "largest"), [pytest.param(0.57735, 3.224854, marks=pytest.mark.slow), (1.0, 2.144280)]
)
def test_largest_discriminant_near_the_separatrix(rho, largest):
    """Scattering by the separatrix predicts the maximum over K (satellite.md: What is known)."""
    out = solve(one_minus_k=np.geomspace(1e-9, 1e-7, 4000), rho=rho)
    assert abs(np.max(abs(out["discriminant"])) / largest - 1) < 1e-5


def edges(k, n, window, body):
    """Edges of tongue n: zeros in `window` of the two factors that vanish there, by bisection."""
    grid = np.linspace(*window, 4001)
    out = solve(body, k=k, rho=grid, rtol=1e-13)
    ends = []
    for name in ("y1", "dy2") if n % 2 else ("y2", "dy1"):
        at = np.nonzero(np.diff(np.sign(out[name])))[0]
        assert at.size == 1
        a, b, side = grid[at[0]], grid[at[0] + 1], np.sign(out[name][at[0]])
        for _ in range(45):
            middle = 0.5 * (a + b)
            same = np.sign(solve(body, k=k, rho=middle, rtol=1e-13)[name][0]) == side
            a, b = (middle, b) if same else (a, middle)
        ends.append(0.5 * (a + b))
    return sorted(ends)


@pytest.mark.parametrize(("body", "centre", "n", "factor"), [
    ("prolate", 1.25**0.5, 3, 1 / 8), pytest.param("prolate", 3**0.5, 4, 3**0.5 / 72, marks=pytest.mark.slow),
    ("oblate", 1.0, 2, 1 / 2), pytest.param("oblate", 1.5, 3, 1 / 8, marks=pytest.mark.slow),
])  # fmt: skip
def test_tongue_widths(body, centre, n, factor):
    low, high = edges(0.1, n, (centre - 0.02, centre + 0.02), body)
    assert (high - low) / (factor * 0.1**n) == pytest.approx(1, abs=0.03)


def test_critical_amplitudes_of_rod_and_disc():
    """Thin rod and disc, rho = 1/sqrt 3: the amplitudes of satellite.md: What is known, in degrees;
    rotations in k.
    """
    rod = solve("prolate", k=np.sin(np.radians([58.05, 58.07, 75.49, 75.51])), rho=3**-0.5)
    assert list(rod["verdict"]) == [1, 0, 0, 1]
    disc = solve("oblate", k=np.sin(np.radians([8.92, 8.94])), rho=3**-0.5)
    assert list(disc["verdict"]) == [1, 0]
    assert list(solve("prolate", k=np.array([1.0864, 1.0866]), rho=3**-0.5)["verdict"]) == [0, 1]
    assert list(solve("prolate", k=np.array([1.2765, 1.2767]), rho=-(3**-0.5))["verdict"]) == [0, 1]
    assert list(solve("oblate", k=np.array([1.0788, 1.0790]), rho=3**-0.5)["verdict"]) == [0, 1]
    assert list(solve("oblate", k=np.array([1.4691, 1.4693]), rho=-(3**-0.5))["verdict"]) == [0, 1]


def test_growth_per_orbit_of_the_rod():
    k = np.sin(np.radians(67.6))
    assert solve("prolate", k=k, rho=3**-0.5)["exponent_per_orbit"][0] == pytest.approx(
        0.987, abs=2e-3
    )


def test_a_narrow_tongue_defeats_the_trace_but_not_the_factors():
    """n = 7 at k = 0.15: inside, |D| - 2 is 3e-18, so the rule |trace| > 2 is a coin; the factors'
    signs are right.
    """
    low, high = edges(0.15, 7, (45**0.5 / 2 - 0.02, 45**0.5 / 2), "prolate")
    inside = np.linspace(low, high, 42)[1:-1]
    out = solve(k=0.15, rho=inside, rtol=1e-13)
    trace = 4 * (out["y1"] * out["dy2"]) - 2
    assert np.mean(abs(trace) > 2) < 0.9
    assert not np.any(out["verdict"] == 1)
    assert np.mean(out["verdict"] == 0) > 0.5


def test_invalid_points_cost_themselves_alone():
    out = solve(k=np.array([0.5, np.nan, 0.5]), rho=np.array([1.0, 1.0, np.nan]))
    assert list(out["status"]) == [status.OK, status.INVALID_PARAMETERS, status.INVALID_PARAMETERS]
    for name, values in out.items():
        assert np.all(np.isfinite(values)) or np.isnan(values[1:]).all(), name
    assert list(out["verdict"][1:]) == [-1, -1] and list(out["lyapunov"]) == [0, 0, 0]


def test_large_rho():
    out = solve(k=0.5, rho=np.array([1000.0, -1000.0, 1e7]))
    assert np.all(out["discriminant_error"][:2] < 1e-11 * 1000)
    assert abs(out["discriminant"][0] - out["discriminant"][1]) < np.sum(
        out["discriminant_error"][:2]
    )
    assert list(out["status"]) == [status.OK, status.OK, status.STEP_LIMIT]


def test_a_point_has_the_same_bits_in_any_block():
    random = np.random.default_rng(3)
    k, rho = np.array([0.0, 0.3, 0.97, 1.4]), random.uniform(-3, 3, 70)
    grid = solve("oblate", k=k[:, None], rho=rho[None, :])
    turned = solve("oblate", k=k[None, :], rho=rho[:, None])
    scattered = solve("oblate", k=np.repeat(k, 70), rho=np.tile(rho, 4))
    for name, values in grid.items():
        np.testing.assert_array_equal(values, turned[name].T, err_msg=name)
        np.testing.assert_array_equal(values.ravel(), scattered[name], err_msg=name)
        one = solve("oblate", k=k[2], rho=rho[5])[name][0]
        np.testing.assert_array_equal(values[2, 5], one, err_msg=name)


def test_scalars_and_three_dimensions():
    k = np.linspace(0.1, 0.9, 3)[:, None, None]
    rho = np.linspace(0.6, 2, 4)[None, :, None] + np.zeros((1, 1, 2))
    out = solve(k=k, rho=rho)
    assert all(values.shape == (3, 4, 2) for values in out.values())
    assert out["discriminant"][1, 2, 1] == solve(k=k[1, 0, 0], rho=rho[0, 2, 1])["discriminant"][0]


def test_a_block_without_a_valid_point():
    out = solve(k=np.full(3, np.nan), rho=np.arange(3.0))
    assert (
        np.all(out["status"] == status.INVALID_PARAMETERS) and np.isnan(out["discriminant"]).all()
    )


TINY = """
import sys

import numpy as np
from survey.scene import Request
from survey.scenes import satellite
point = {"k": np.array([[0.3], [0.95], [1.3]]), "rho": np.array([[0.7, 1.9]])}
for method in ("taylor16", "magnus6", "rk4"):
    out = satellite.solve(point, Request({"body": "oblate"}, method, 1e-6))
    sys.stdout.write(" ".join(v.tobytes().hex() for v in (out["discriminant"], out["verdict"], out["y1_error"])))
point = {"k": np.array([0.3]), "rho": np.array([0.7])}
out = satellite.solve(point, Request({"body": "oblate"}, "dop853", 1e-3))
sys.stdout.write(f" {float(out['discriminant'][0]):.13g} {out['verdict'][0]}")
"""


def test_plain_python_gives_the_same_bits():
    """The readable twin of every kernel is its own source with the JIT off (dop853: math's sin and
    cos may differ).
    """
    said = []
    for off in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": off}
        run = subprocess.run(
            [sys.executable, "-c", TINY],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        said.append(run.stdout)
    assert said[0] == said[1]


def test_inertia_ratio_and_amplitude_are_other_words_for_rho_and_k():
    """alpha = 1/2 and 3/2 give rho^2 = 2/3; critical amplitudes of the rod and the disc."""
    amplitude = np.array([0.1, 0.8, 1.5])
    named = survey.evaluate("satellite", inertia_ratio=[0.5, 1.5], amplitude=amplitude)
    for place, body in enumerate(("prolate", "oblate")):
        plain = survey.evaluate("satellite", k=np.sin(amplitude), rho=np.sqrt(2 / 3), body=body)
        for name in ("discriminant", "exponent_per_orbit", "rotation_number"):
            np.testing.assert_allclose(named[name][place], plain[name], rtol=1e-11, atol=1e-11)
        np.testing.assert_array_equal(named.verdict[place], plain.verdict)
    degrees = np.array([8.92, 8.94, 58.05, 58.07, 75.49, 75.51])
    ends = survey.evaluate("satellite", inertia_ratio=[0.0, 2.0], amplitude=np.deg2rad(degrees))
    assert ends.verdict.values.tolist() == [[1, 1, 1, 0, 0, 1], [1, 0, 0, 0, 0, 0]]


@pytest.mark.parametrize(("direction", "rod", "disc"), [(1, 1.0865, 1.0789), (-1, 1.2766, 1.4692)])
def test_rotations_are_stable_beyond_a_speed(direction, rod, disc):
    for alpha, edge in ((0.0, rod), (2.0, disc)):
        k = edge + np.array([-2e-4, 2e-4, 1.0])
        ds = survey.evaluate("satellite", inertia_ratio=alpha, k=k, direction=direction)
        assert ds.verdict.values.tolist() == [0, 1, 1]


def test_bars_hold_the_rounding_of_the_inertia_ratio():
    rng = np.random.default_rng(5)
    for alpha, amplitude in zip(rng.uniform(0, 2, 6), rng.uniform(0.1, 1.5, 6), strict=True):
        ds = survey.evaluate("satellite", inertia_ratio=alpha, amplitude=amplitude, rtol=1e-13)
        with mp.workdps(30):
            rho, k = 1 / mp.sqrt(3 * abs(1 - mpf(alpha))), mp.sin(mpf(amplitude))
        exact = mp_factors("PL" if alpha < 1 else "OL", k, rho)
        for name, value in zip(("y1", "dy1", "y2", "dy2"), exact[:4], strict=True):
            assert abs(value - mpf(float(ds[name]))) <= float(ds[f"{name}_error"]), (
                alpha,
                amplitude,
                name,
            )


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"inertia_ratio": 0.5, "body": "prolate"}, "body and inertia_ratio specify the same"),
        ({"inertia_ratio": 0.5, "rho": 1.0}, "inertia_ratio and rho specify the same"),
        ({"rho": 0.5, "direction": -1}, "direction requires the parameter inertia_ratio"),
        ({"inertia_ratio": 1.0}, "inertia_ratio != 1"),
    ],
)
def test_saying_the_same_twice_is_refused(given, words):
    with pytest.raises(survey.BadInput, match=words):
        survey.evaluate("satellite", k=0.5, **given)
