"""A user's own Abel equation goes through every command like a built-in scene; what is wrong is
said in one line.
"""

import math
from fractions import Fraction

import numpy as np
import pytest
import xarray as xr
from mpmath import mp
from scipy import special
from scipy.integrate import solve_ivp

import survey
from survey.errors import BadInput
from survey.request import user_scene

# (where, how wide, how high in f and g), (phi0, w0), phi, and w there by mpmath's odefun
WEAK = [
    ((-1.3733220339125074, 0.03183080124391897, 1.4072984489891925e-10, -0.00013614986357607695),
     (-2.5756311076490217, 76.07933131862355), 2.6773880321872925, 74.537339570643251128),
    ((1.2976326084382581, 0.3659114532848368, -8.114926344828097e-09, -1.975218906556532e-08),
     (-1.4475267886324334, 80.67259040083464), 1.2893107887369997, 79.870450055565215785),
]  # fmt: skip

SCENE = '''"""Van der Pol's oscillator of my own.

phi'' = mu (1 - phi^2) phi' - phi."""

PARAMETERS = ("mu",)


def f(phi, p):
    return p[0] * (1 - phi * phi)


def g(phi, p):
    return -phi
'''
WORKFLOW = """
scene = "mine.py"
[options]
question = "trajectory"
[axes]
mu = { start = 0.2, stop = 3.0, num = 6 }
t = { start = -1.0, stop = 6.0, num = 8 }
phi0 = 2.0
[output]
figures = ["phi"]
"""


def f(phi, p):
    return p[0] * (1 - phi**2)


def g(phi, p):
    return -phi


def scene(f=f, g=g, **given):
    return survey.abel(f, g, **({"parameters": "mu"} | given))


@pytest.mark.slow
def test_every_command_takes_it(program, tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(SCENE)
    (tmp_path / "mine.toml").write_text(WORKFLOW)
    monkeypatch.chdir(tmp_path)
    run = program("run", "mine.toml", "-o", "mine.nc", "--workers", "1")
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "mine.png").exists()
    for words in (
        ("plan", "mine.toml"),
        ("info", "mine.nc"),
        ("verify", "mine.nc"),
        ("plot", "mine.nc"),
    ):
        done = program(*words)
        assert done.returncode == 0, done.stderr
    assert "Van der Pol's oscillator of my own" in program("scenes", "mine.py").stdout
    ds = survey.open("mine.nc")
    assert (
        ds.attrs["scene_text"] == SCENE
        and ds.attrs["title"] == "Van der Pol's oscillator of my own"
    )
    same = survey.evaluate(scene(), mu=ds.mu.values, phi0=2.0, t=ds.t.values, question="trajectory")
    assert (ds.phi.values == same.phi.values).all() and (ds.status == 0).all()
    motion = ds.survey.trajectory(mu=ds.mu.values[2], t=0.0, time=5.0)
    assert motion.phi.shape == motion.t.shape
    (tmp_path / "mine.py").write_text(SCENE + "\n")
    changed = program("verify", "mine.nc")
    assert changed.returncode == 2 and "its file has changed since" in changed.stderr


def test_the_hash_tells_of_all_that_the_functions_depend_on():
    first = scene().HASH
    assert scene().HASH == first
    others = [
        scene(g=lambda phi, p: -2 * phi),
        scene(f=lambda phi, p: -p[0]),
        scene(parameters="nu"),
    ]
    assert len({first, *(other.HASH for other in others)}) == 4
    swapped = scene(g, f)
    assert swapped.HASH != first


@pytest.mark.slow
def test_functions_from_python_run_in_other_processes(tmp_path):
    given = {
        "scene": scene(),
        "axes": {"mu": {"values": [0.5, 1.0]}, "phi0": 2.0, "phi": {"values": [0.0, 1.0]}},
    }
    given["options"] = {"question": "abel"}
    one = survey.run(given, output=tmp_path / "one.nc")
    two = survey.run(given, output=tmp_path / "two.nc", workers=1)
    xr.testing.assert_equal(one.drop_attrs(), two.drop_attrs())
    assert user_scene.of_dataset(one).HASH == one.attrs["scene_hash"]


def test_one_solution_serves_all_times_with_the_same_bits():
    t = np.array([3.0, -1.0, 0.5])
    whole = survey.evaluate(
        scene(), mu=[0.5, 2.0], phi0=[1.0, 2.0, 3.0], w0=0.3, t=t, question="trajectory"
    )
    for i, time in enumerate(t):
        one = survey.evaluate(
            scene(), mu=0.5, phi0=2.0, w0=0.3, t=float(time), question="trajectory"
        )
        for name in ("phi", "w", "phi_error", "turnings"):
            assert one[name] == whole[name][0, 1, i]


def test_a_point_without_a_value_costs_itself_alone():
    own = scene(lambda phi, p: math.log(p[0]), g)
    ds = survey.evaluate(own, mu=[1.0, -1.0, 2.0, np.nan], phi0=2.0, t=1.0, question="trajectory")
    assert ds.status.values.tolist() == [0, 1, 0, 1] and np.isnan(ds.phi.values).tolist() == [
        False,
        True,
        False,
        True,
    ]


def bad(phi, p):
    raise RuntimeError("no")


def ends(phi, p):
    raise SystemExit(3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"f": 1.0}, "f must be a function of two arguments"),
        ({"g": lambda phi: 0.0}, "g must be a function of two arguments"),
        ({"parameters": ()}, "give at least one name"),
        ({"parameters": ("phi0",)}, "neither an output"),
        ({"parameters": ("w",)}, "neither an output"),
        ({"period": 3.0}, "it must be 2 pi"),
        ({"period": True}, "it must be 2 pi"),
    ],
)
def test_wrong_scenes_are_one_line(given, words):
    with pytest.raises(BadInput, match=words) as refusal:
        scene(**given)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"f": bad}, r"f\(phi, p\) fails \(RuntimeError: no\)"),
        ({"g": ends}, r"g\(phi, p\) fails \(SystemExit: 3\)"),
        ({"g": lambda phi, p: p[3]}, r"g\(phi, p\) indexes beyond an array.*p\[0\] to p\[0\]"),
        ({"g": lambda phi, p: p["mu"]}, "write p"),
        ({"g": lambda phi, p: [phi]}, r"g\(phi, p\) returns \[0.25\]"),
        ({"g": lambda phi, p: abs(phi)}, r"g\(phi, p\): it applies abs.*must be analytic"),
        ({"f": lambda phi, p: 1.0 if phi > 0 else -1.0}, r"f\(phi, p\): it compares phi"),
        ({"f": lambda phi, p: math.log(-p[0])}, "is undefined at mu = 1"),
        (
            {"g": lambda phi, p: 1.0 / (p[0] - p[0]), "period": 2 * math.pi},
            "is undefined at mu = 1",
        ),
        ({"period": 2 * math.pi}, "does not have the period 2 pi at mu = 1, or has a pole"),
    ],
)
def test_wrong_functions_are_one_line(given, words):
    with pytest.raises(BadInput, match=words) as refusal:
        survey.evaluate(scene(**given), mu=1.0, phi0=2.0, t=1.0, question="trajectory")
    assert "\n" not in str(refusal.value)


def test_constants_may_stand_in_a_dict_or_be_fractions():
    table, third = {"g": 2.0}, Fraction(1, 3)
    given = {"parameters": "k", "period": 2 * math.pi}
    own, plain = (
        survey.evaluate(
            survey.abel(lambda phi, p: -p[0], g, **given),
            k=0.3, phi0=0.5, w0=0.2, t=1.0, question="trajectory",
        )
        for g in (
            lambda phi, p: -table["g"] * third * math.sin(phi),
            lambda phi, p: -2.0 * (1 / 3) * math.sin(phi),
        )
    )  # fmt: skip
    assert own.w.values == plain.w.values


@pytest.mark.parametrize(
    ("question", "period"),
    [
        ("trajectory", None),
        ("abel", 2 * np.pi),
        pytest.param("trajectory", 2 * np.pi, marks=pytest.mark.slow),
        pytest.param("abel", None, marks=pytest.mark.slow),
    ],
    ids=["trajectory-line", "abel-circle", "trajectory-circle", "abel-line"],
)
def test_spikes_between_the_angles_of_a_step_are_seen(question, period):
    """Of random ones a quarter were passed in time, and one in 13 in the angle."""
    random = np.random.default_rng(8)
    n = 40
    names = ("at", "width", "steep", "high", "phi0", "w0")
    values = (
        random.uniform(-np.pi, np.pi, n),
        10 ** random.uniform(-2.0, -0.3, n),  # of sin((phi - at) / 2): T / 190 and more
        10 ** random.uniform(-6, 0, n) * random.choice([-1, 1], n),
        10 ** random.uniform(-6, 1, n) * random.choice([-1, 1], n),
        random.uniform(-3, 3, n),
        10 ** random.uniform(0.3, 1.3, n),
    )

    def spike(phi, at, width):
        chord = np.sin(0.5 * (phi - at)) if period else 0.5 * (phi - at)
        return np.exp(-((chord / width) ** 2))

    scene = survey.abel(
        lambda phi, p: -0.3 + p[2] * spike(phi, p[0], p[1]),
        lambda phi, p: 0.5 - np.sin(phi) + p[3] * spike(phi, p[0], p[1]),
        period=period,
        parameters=names[:4],
    )
    given = {k: xr.DataArray(v, dims="point") for k, v in zip(names, values, strict=True)}
    phi0 = values[4]
    goal = {"trajectory": {"t": 0.5}, "abel": {"phi": xr.DataArray(phi0 + 2.0, dims="point")}}
    ds = survey.evaluate(scene, question=question, **given, **goal[question])
    assert (ds.status == 0).mean() > 0.9
    for i in np.flatnonzero(ds.status.values == 0):
        at, width, steep, high, phi, w = (float(v[i]) for v in values)

        def force(x, w, of=(at, width, steep, high)):
            own = spike(x, *of[:2])
            return (-0.3 + of[2] * own) * w + 0.5 - np.sin(x) + of[3] * own

        if question == "trajectory":
            flow, end, start = (lambda t, y: [y[1], force(*y)]), (0.0, 0.5), [phi, w]
            longest = width / (4 * (w + 4))
        else:
            flow, end, start = (lambda x, y: [force(x, y[0]) / y[0]]), (phi, phi + 2.0), [w]
            longest = width / 4
        exact = solve_ivp(
            flow, end, start, method="DOP853", rtol=1e-12, atol=1e-13, max_step=longest
        )
        off = abs(float(ds.w[i]) - exact.y[-1, -1])
        assert off <= float(ds.w_error[i]) + 2e-10 * (1 + abs(exact.y[-1, -1])), i


@pytest.mark.parametrize("width", [0.03, 1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
def test_spikes_of_any_width_on_the_circle_are_seen(width):
    """With g = 0, w - F(phi) is constant: F = A erf(sin(phi - a) / width) rises by 2 A within its
    width. Of widths below 1e-3 up to one in five were passed.
    """
    random, n = np.random.default_rng(8), 40
    A = 10 ** random.uniform(-9, 0, n) * random.choice([-1, 1], n)
    a, w0 = random.uniform(0.5, 2.0, n), random.uniform(2.5, 4.0, n)
    phi0 = random.uniform(-0.4, 0.4, n)
    scene = survey.abel(
        lambda phi, p: (
            p[0] * np.exp(-((np.sin(phi - p[1]) / width) ** 2)) * np.cos(phi - p[1])
            * (2 / math.sqrt(math.pi) / width)
        ),
        lambda phi, p: 0.0 * phi,
        period=2 * np.pi,
        parameters=("A", "a"),
    )  # fmt: skip
    given = {"A": A, "a": a, "phi0": phi0, "w0": w0}
    given = {name: xr.DataArray(values, dims="point") for name, values in given.items()}

    def rise(phi):
        return A * special.erf(np.sin(phi - a) / width)

    goal = phi0 + random.uniform(2, 12, n)
    there = survey.evaluate(scene, question="abel", phi=xr.DataArray(goal, dims="point"), **given)
    then = survey.evaluate(scene, question="trajectory", t=2.0, **given)
    rounding = 1e-14 + 2e-15 * abs(A) / width
    for ds, phi, off in ((there, goal, 0.0), (then, then.phi.values, then.phi_error.values)):
        known = ds.status.values == 0
        assert known.mean() > 0.75
        nearest = np.maximum(abs(np.sin(phi - a)) - off, 0.0) / width
        slope = 1.2 * abs(A) / width * np.exp(-(nearest**2))
        error = abs(ds.w.values - (w0 + rise(phi) - rise(phi0)))
        assert (error <= ds.w_error.values + slope * off + rounding)[known].all()


@pytest.mark.parametrize(("system", "start", "goal", "exact"), WEAK, ids=["narrow", "wide"])
def test_weak_features_count_in_the_error_bar(system, start, goal, exact):
    """Their series fall more slowly than the others', whose terms hide them."""

    def step(phi, at, width):
        return np.tanh((phi - at) / width)

    scene = survey.abel(
        lambda phi, p: -0.3 + p[2] * step(phi, p[0], p[1]),
        lambda phi, p: 0.5 - np.sin(phi) + p[3] * step(phi, p[0], p[1]),
        period=None,
        parameters=("at", "width", "steep", "high"),
    )
    given = dict(
        zip(("at", "width", "steep", "high", "phi0", "w0"), (*system, *start), strict=True)
    )
    ds = survey.evaluate(scene, question="abel", phi=goal, **given)
    assert abs(float(ds.w) - exact) <= float(ds.w_error) < 1e-10


def test_a_start_where_g_underflows_is_not_at_rest():
    """w = 4 exp(-800) (exp(t) - 1) until phi moves."""
    scene = survey.abel(
        lambda phi, p: p[0] + 0 * phi,
        lambda phi, p: 1 - np.tanh(400 * (phi - 1)) ** 2,
        period=None,
        parameters="growth",
    )
    ds = survey.evaluate(
        scene, question="trajectory", growth=1.0, phi0=0.0, w0=0.0, t=[10.0, 1000.0]
    )
    assert ds.status[0] == 0 and ds.w[0] == 0.0 and ds.status[1] != 0


@pytest.mark.parametrize("period", [2 * np.pi, None], ids=["circle", "line"])
@pytest.mark.parametrize(("method", "rtol", "n"), [("taylor", 1e-12, 1500), ("dop853", 1e-10, 60)])
def test_steps_that_a_wave_hides_count_in_the_error_bar(method, rtol, n, period):
    """F = c sin(phi) + A tanh(distance(phi, a) / s): far from a the slope of tanh, 1e-17 of the wave's and less,
    grows by exp(2) within each s. With g = 0, w - F(phi) is constant.
    """

    def distance(phi, a):
        return np.sin(phi - a) if period else phi - a

    scene = survey.abel(
        lambda phi, p: (
            p[0] * np.cos(phi)
            + p[1] / p[3] * (1 - np.tanh(distance(phi, p[2]) / p[3]) ** 2)
            * (np.cos(phi - p[2]) if period else 1.0)
        ),
        lambda phi, p: 0.0 * phi,
        period=period,
        parameters=("c", "A", "a", "s"),
    )  # fmt: skip
    random = np.random.default_rng(12)
    if method == "dop853":
        s, height = random.uniform(0.015, 0.04, n), 10 ** random.uniform(-9.0, -6.0, n)
    else:
        s, height = 10 ** random.uniform(-2.7, -1.3, n), 10 ** random.uniform(-7.0, 0.5, n)
    c, A = random.uniform(0.5, 2.0, (2, n)) * random.choice([-1, 1], (2, n))
    A, phi0, reach = A * height * s, random.uniform(-3, 3, n), random.uniform(0.3, 3.0, n)
    w0 = random.uniform(5.0, 12.0, n) * random.choice([-1, 1], n)
    a = phi0 + np.sign(w0) * reach * random.uniform(0.05, 1.0, n)
    given = {"c": c, "A": A, "a": a, "s": s, "phi0": phi0, "w0": w0, "t": reach / abs(w0)}
    ds = survey.evaluate(
        scene, question="trajectory", method=method, rtol=rtol,
        **{name: xr.DataArray(values, dims="point") for name, values in given.items()},
    )  # fmt: skip
    assert (ds.status == 0).all() and float(ds.w_error.median()) < 1e3 * rtol
    with mp.workdps(30):
        for i in range(n):
            c, A, a, s = (mp.mpf(given[name][i]) for name in ("c", "A", "a", "s"))

            def F(phi, c=c, A=A, a=a, s=s):
                return c * mp.sin(phi) + A * mp.tanh((mp.sin(phi - a) if period else phi - a) / s)

            phi, off = mp.mpf(ds.phi.values[i]), ds.phi_error.values[i]
            exact = w0[i] + F(phi) - F(mp.mpf(phi0[i]))
            doubt = 1.5 * (abs(c) + abs(A / s)) * off
            assert abs(exact - ds.w.values[i]) <= ds.w_error.values[i] + doubt


@pytest.mark.parametrize("period", [2 * np.pi, None], ids=["circle", "line"])
@pytest.mark.parametrize("question", ["trajectory", "abel"])
def test_sets_have_the_same_bits_alone_and_among_others(question, period):
    """More sets than lanes, so that each takes the place of another."""

    def chord(phi):
        return 2 * np.sin(0.5 * phi) if period else phi

    def g(phi, p):
        return 0.5 - np.tanh(np.sin(phi - 1.0) / p[1] if period else (phi - 1.0) / p[1])

    scene = survey.abel(
        lambda phi, p: -p[0] * np.exp(-(chord(phi) ** 2)),
        g,
        period=period,
        parameters=("a", "width"),
    )
    a, width = np.linspace(0.1, 2.0, 90), np.geomspace(0.01, 3.0, 90)
    goal = {"trajectory": {"t": 1.5}, "abel": {"phi": 2.0}}[question]

    def solved(of):
        given = {k: xr.DataArray(v[of], dims="point") for k, v in (("a", a), ("width", width))}
        return survey.evaluate(scene, question=question, phi0=-1.0, w0=4.0, **given, **goal)

    together = solved(slice(None))
    for i in range(0, 90, 7):
        alone = solved(slice(i, i + 1))
        for name in ("w", "w_error"):
            np.testing.assert_array_equal(alone[name].values[0], together[name].values[i])


def test_a_constant_force_and_a_resistance_that_hardly_acts_are_solved_to_rounding():
    """No rate bounds their steps on the circle, which last for ever, or for a very long time."""
    times = np.array([0.0, 0.5, 1.0, 10.0])
    scene = survey.abel(
        lambda phi, p: -p[1] + 0.0 * phi, lambda phi, p: p[0] + 0.0 * phi, parameters=("a", "b"), period=2 * np.pi
    )  # fmt: skip
    ds = survey.evaluate(
        scene, a=[0.3, 1.0], b=[0.0, 1e-12, 1e-8, 1e-4], phi0=0.1, w0=0.0, t=times, question="trajectory"
    )  # fmt: skip
    assert not ds.status.any() and (ds.phi_error <= 1e-14 * (1 + ds.t**2)).all()
    b = ds.b.where(ds.b > 0, 1e-30)
    fallen = ds.a * ds.t**2 * (0.5 - b * ds.t / 6 + (b * ds.t) ** 2 / 24 - (b * ds.t) ** 3 / 120)
    assert (abs(ds.phi - 0.1 - fallen) <= ds.phi_error + 1e-17 * ds.t**5).all()
