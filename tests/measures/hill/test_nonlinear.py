"""Twist of planar motions: the full rotation beside them, iterated; and 25 digits by another form
of the integral.
"""

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import survey
from survey.measures.hill import nonlinear

NAMES = ["twist", "twist_resonant", "verdict_nonlinear"]
LINEAR = ["rotation_number", "period", "y1", "y2", "dy1", "dy2", "discriminant", "verdict"]


def spread(ds):
    """B: tilt = sqrt(2 J B) cos phi where x = 0."""
    return np.sqrt(-float(ds.y2) * float(ds.dy2) / (float(ds.y1) * float(ds.dy1)))


class Body:
    """H = p_beta^2/2 + p^2/(2 cos^2 beta) - rho p + W cos^2 v cos^2 beta, no approximation."""

    def __init__(self, k, rho, oblate):
        self.k, self.rho, self.oblate = k, rho, oblate
        self.w = 0.5 if oblate else -0.5

    def field(self, x):
        """cos^2 of the angle from the vertical, and its derivative."""
        return (np.sin(x) ** 2, np.sin(2 * x)) if self.oblate else (np.cos(x) ** 2, -np.sin(2 * x))

    def slopes(self, _u, y):
        x, p, beta, q = y
        c, slope = self.field(x)
        cosine, sine = np.cos(beta), np.sin(beta)
        force = -p * p * sine / cosine**3 + 2 * self.w * c * cosine * sine
        return [p / cosine**2 - self.rho, -self.w * slope * cosine**2, q, force]

    def start(self, tilt):
        """At x = 0 with beta = tilt, at rest across the plane, at the energy of the planar motion."""
        c, _ = self.field(0.0)
        energy = 0.5 * (self.k**2 - self.rho**2) + self.w * c
        square = np.cos(tilt) ** 2
        p = square * (self.rho + np.sqrt(self.rho**2 + 2 * (energy - self.w * c * square) / square))
        return [0.0, p, tilt, 0.0]

    def returns(self, tilt, number, period):
        """(beta, p_beta) at each return to x = 0 (a rotation's: modulo pi), w > 0."""

        def event(_u, y):
            return np.sin(y[0])

        event.direction = 1 if self.k < 1 else 0
        end = (0.0, period * (number + 1))
        done = solve_ivp(
            self.slopes, end, self.start(tilt), "DOP853", rtol=2e-13, atol=1e-15, events=event
        )
        return done.y_events[0][1 : number + 1, 2:]


def angle_per_return(states, wide, near):
    """By a weighted Birkhoff average, which converges faster than any power."""
    phase = np.arctan2(-states[:, 1] * np.sqrt(wide), states[:, 0] / np.sqrt(wide))
    step = near + np.angle(np.exp(1j * (np.diff(phase) - near)))
    t = (np.arange(len(step)) + 1) / (len(step) + 1)
    weight = np.exp(-1 / (t * (1 - t)))
    return (weight * step).sum() / weight.sum()


CASES = [
    ("prolate", 1.6, 0.7),
    pytest.param("oblate", 0.3, 1.2, marks=pytest.mark.slow),
    pytest.param("prolate", 0.3, 0.9, marks=pytest.mark.slow),
    pytest.param("prolate", 0.85, 0.9, marks=pytest.mark.slow),
    pytest.param("oblate", 0.6, 2.2, marks=pytest.mark.slow),
    pytest.param("oblate", 2.5, -0.8, marks=pytest.mark.slow),
]


@pytest.mark.parametrize(("body", "k", "rho"), CASES)
@pytest.mark.slow
def test_the_twist_is_that_of_the_full_rotation(body, k, rho):
    """d(angle per return)/dJ at one energy, by tilts of 0.02 and 0.04 and the square of the tilt
    taken to 0.
    """
    ds = survey.evaluate("satellite", k=k, rho=rho, body=body, variables=[*NAMES, *LINEAR])
    assert int(ds.verdict_nonlinear) == 1
    exact = Body(k, rho, body == "oblate")
    linear, wide = 2 * np.pi * float(ds.rotation_number), spread(ds)
    slopes = []
    for tilt in (0.02, 0.04):
        angle = angle_per_return(exact.returns(tilt, 200, float(ds.period)), wide, linear)
        slopes.append((angle - linear) / (tilt**2 / (2 * wide)))
    known = (4 * slopes[0] - slopes[1]) / 3
    assert float(ds.twist) == pytest.approx(known, rel=3e-4)


def multiprecision(k, rho, oblate):
    """(twist, resonant) at constant angle of the planar motion: T_h/T under the integral, T_h in
    closed form.

    The kernel has constant time, and T_h at the end.
    """
    k, rho = mpf(k), mpf(rho)
    c0 = 0 if oblate else 1
    if k < 1:
        first, second, rest = mp.ellipk(k * k), mp.ellipe(k * k), 1 - k * k
        period, slower = 4 * first, 4 * (second / (rest * k) - first / k) / k
    else:
        m = 1 / k**2
        first, second = mp.ellipk(m), mp.ellipe(m)
        period = 2 * first / k
        slower = -2 * second / ((1 - m) * k**2) / k

    def slopes(u, y):
        x, w, y1, d1, y2, d2, xi, eta = y[:8]
        p, sine = w + rho, mp.sin(x)
        g, twice = c0 - sine**2, mp.sin(2 * x)
        z, force = p * p + g, -twice / 2
        moved = 2 * p * eta - twice * xi + u * slower / period * (2 * p * force - twice * w)
        quartic = p * p / 3 - g / 6
        e = ((d1 * d1 + z * y1 * y1) / 2, (d1 * d2 + z * y1 * y2), (d2 * d2 + z * y2 * y2) / 2)
        b = (y1 * y1, 2 * y1 * y2, y2 * y2)

        def part(pairs):
            return sum(
                quartic * b[i] * b[j] - e[i] * b[j] * moved / 2 - slower / period * e[i] * e[j] / 2
                for i, j in pairs
            )

        forms = [part([(0, 0)]), part([(0, 2), (1, 1), (2, 0)]), part([(2, 2)])]
        return [w, force, d1, -z * y1, d2, -z * y2, eta, -mp.cos(2 * x) * xi, *forms]

    start = [mpf(0), k, mpf(1), mpf(0), mpf(0), mpf(1), mpf(0), 1 / k, mpf(0), mpf(0), mpf(0)]
    done = mp.odefun(slopes, 0, start, tol=mpf(10) ** -20)(period / 2)
    y1, d1, y2, d2 = done[2:6]
    square = -(y2 * d2) / (y1 * d1)
    first, middle, last = (2 * q for q in done[8:])
    return 3 * (first * square + last / square) + middle, first * square - middle + last / square


@pytest.mark.parametrize(
    ("body", "k", "rho"),
    [
        ("prolate", 0.3, 0.9),
        pytest.param("oblate", 0.6, 2.2, marks=pytest.mark.slow),
        pytest.param("prolate", 1.6, 0.7, marks=pytest.mark.slow),
    ],
)
def test_the_error_bars_hold(body, k, rho):
    ds = survey.evaluate("satellite", k=k, rho=rho, body=body, variables=NAMES)
    with mp.workdps(22):
        known = multiprecision(k, rho, body == "oblate")
    for name, value in zip(("twist", "twist_resonant"), known, strict=True):
        off, bar = abs(float(ds[name]) - float(value)), float(ds[f"{name}_error"])
        assert off <= bar < 1e-10, (name, off, bar)


def test_bars_cover_changes_of_an_ulp_in_a_crowd():
    """Over both families and bodies: a modulus of one ulp more moves nothing by more than the bars,
    near k = 1 too.
    """
    random = np.random.default_rng(4)
    for body in ("prolate", "oblate"):
        for k in (
            1 - 10.0 ** random.uniform(-5, -0.1, 40),
            1 + 10.0 ** random.uniform(-5, 0.5, 40),
        ):
            k, rho = np.sort(k), random.uniform(0.58, 4.0, 20)
            one, other = (
                survey.evaluate("satellite", k=x, rho=rho, body=body, variables=[*NAMES, "verdict"])
                for x in (k, np.nextafter(k, 2))
            )
            other = other.assign_coords(k=one.k)
            both = (one.verdict == 1) & (other.verdict == 1)
            assert float(both.mean()) > 0.2
            off = abs(one.twist - other.twist).where(both, 0.0)
            bar = (one.twist_error.astype(float) + other.twist_error).where(both, 0.0)
            assert (off <= bar).all()
            assert float((bar / (1 + abs(one.twist))).where(both).median()) < 1e-9


def test_the_resonance_of_order_4():
    """At D = 0 it is the resonant term that decides; there the twist outweighs it, so that nothing
    is lost.
    """
    edge = survey.evaluate(
        "satellite", k=0.4, rho=np.linspace(0.6, 3, 400), variables=["discriminant"]
    )
    crossing = np.flatnonzero(np.diff(np.sign(edge.discriminant)))
    assert len(crossing) > 2
    low, high = edge.rho.values[crossing], edge.rho.values[crossing + 1]
    before = np.sign(edge.discriminant.values[crossing])
    for _ in range(60):
        middle = 0.5 * (low + high)
        here = survey.evaluate("satellite", k=0.4, rho=middle, variables=["discriminant", *NAMES])
        same = np.sign(here.discriminant.values) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    assert (abs(here.discriminant) <= 10 * here.discriminant_error).all()
    assert (abs(here.twist) > abs(here.twist_resonant)).all() and (
        here.verdict_nonlinear == 1
    ).all()


def resonant_rotation():
    """A retrograde rotation of a prolate body (alpha = 0.871) with D = 0 where the twist is next to 0."""
    low, high = -1.62, -1.60
    for _ in range(60):
        middle = 0.5 * (low + high)
        here = survey.evaluate(
            "satellite", k=2.92, rho=middle, variables=["discriminant", "period", *NAMES]
        )
        low, high = (middle, high) if float(here.discriminant) > 0 else (low, middle)
    return here


def test_a_rotation_in_resonance():
    here = resonant_rotation()
    assert abs(here.discriminant) <= here.discriminant_error
    assert abs(here.twist_resonant) > 10 * abs(here.twist) and int(here.verdict_nonlinear) == 2
    beside = survey.evaluate("satellite", k=2.92, rho=float(here.rho) + 1e-6, variables=NAMES)
    assert int(beside.verdict_nonlinear) == 1


@pytest.mark.slow
def test_there_tilts_grow_and_beside_it_they_do_not():
    here = resonant_rotation()
    for away, least, most in ((0.0, 5.0, 10.0), (0.1, 1.0, 1.5), (-0.1, 1.0, 1.5)):
        states = Body(2.92, float(here.rho) + away, oblate=False).returns(
            0.2, 600, float(here.period)
        )
        assert least < np.hypot(*states.T).max() / 0.2 < most


@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_small_librations(body):
    """Birkhoff's normal form of the equilibrium, by hand: H = I1 + O I2 + (a I1^2 + 2 b I1 I2 + c I2^2)/2."""
    rho = np.array([0.7, 1.2, 1.534, 1.536, 2.3])
    ds = survey.evaluate("satellite", k=3e-4, rho=rho, body=body, variables=NAMES)
    square = rho**2 + (body == "prolate")
    a, b = -0.5, 2 * rho**2 / np.sqrt(square) / (1 - 4 * square)
    c = -(rho**2) / square / (1 - 4 * square) / 2 - (body == "prolate") / square / 2
    known = 2 * np.pi * (c - 2 * b * np.sqrt(square) + a * square)
    np.testing.assert_allclose(ds.twist, known, rtol=2e-5, atol=2e-6)
    assert (np.sign(ds.twist[2:4]) == ([-1, -1] if body == "prolate" else [1, -1])).all()


def test_verdicts_by_the_rule():
    """On made-up numbers: far from resonance and in it, with enough twist; instability, and nothing
    decided.
    """

    class Row:
        oblate = False
        k = np.array([0.3])
        half = (np.array([3.2]),)

    rho = np.full((1, 4), 0.9)
    bars = np.full((1, 4), 1e-9)
    found = {"verdict": np.array([[1, 1, 0, -1]]), "discriminant": np.array([[0.5, 0.0, 2.5, 2.0]])}
    found["discriminant_error"] = bars
    out = nonlinear.solve(Row, rho, found)
    assert out["verdict_nonlinear"].tolist() == [[1, 1, 0, -1]]
    assert np.isfinite(out["twist"][0, :2]).all() and np.isnan(out["twist"][0, 2:]).all()


def test_where_it_does_not_apply():
    ds = survey.evaluate(
        "satellite", k=[0.0, 0.3], rho=[0.9, 5000.0], variables=[*NAMES, "verdict"]
    )
    assert ds.twist.isel(k=0).isnull().all() and ds.twist.isel(rho=1).isnull().all()
    assert (ds.verdict_nonlinear.isel(rho=1).where(ds.verdict.isel(rho=1) == 1, -1) == -1).all()
    assert int(ds.verdict_nonlinear.isel(k=1, rho=0)) == 1
