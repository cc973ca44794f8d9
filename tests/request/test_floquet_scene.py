"""A user's own linear periodic system goes through every command like a built-in scene; errors are
one line.
"""

import functools
import math

import numba
import numpy as np
import pytest
import xarray as xr

import survey
from survey.errors import BadInput
from survey.request import user_scene

SCENE = '''"""Two pendulums of my own, coupled, on a shaken table."""

from math import cos, pi

PARAMETERS = ("delta", "epsilon", "zeta")
STATES = ("x", "y")
PERIOD = pi


def K(t, p, out):
    out[0, 0] = p[0] + p[1] * cos(2 * t)
    out[1, 1] = 1.7 * p[0] + p[1] * cos(2 * t)
    out[0, 1] = out[1, 0] = 0.1


def C(t, p, out):
    out[0, 0] = out[1, 1] = 2 * p[2]
'''
WORKFLOW = """
scene = "mine.py"
[axes]
delta = { start = 0.5, stop = 3.0, num = 12 }
epsilon = { start = 0.0, stop = 1.5, num = 9 }
zeta = 0.02
[output]
figures = ["verdict", "spectral_radius"]
"""


def K(t, p, out):
    out[0, 0] = p[0] + p[1] * math.cos(2 * t)


def C(t, p, out):
    out[0, 0] = 2 * p[2]


def scene(**given):
    usual = {
        "K": K,
        "C": C,
        "period": math.pi,
        "parameters": ("delta", "epsilon", "zeta"),
        "states": "x",
    }
    return survey.floquet(**(usual | given))


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
    about = program("scenes", "mine.py").stdout
    assert "Two pendulums of my own" in about and "spectral_radius" in about
    ds = survey.open("mine.nc")
    assert ds.attrs["scene_text"] == SCENE and ds.attrs["states"] == "x, y, dx, dy"
    assert (
        ds.multiplier_re.dims == ("delta", "epsilon", "multiplier") and ds.sizes["multiplier"] == 4
    )
    assert set(np.unique(ds.verdict)) == {0, 1} and (ds.status == 0).all()
    motion = ds.survey.trajectory(delta=ds.delta.values[3], epsilon=ds.epsilon.values[4], time=4.0)
    assert motion.dx.shape == motion.t.shape and motion.sizes["multiplier"] == 4
    assert "certainly" in str(
        ds.survey.point(delta=ds.delta.values[3], epsilon=ds.epsilon.values[4])
    )
    finer = ds.survey.zoom(delta=(1.0, 1.5), epsilon=(0.5, 1.0), num=3)
    assert finer.verdict.shape == (3, 3)


def test_the_monodromy_matrix_is_given_when_it_is_named():
    ds = survey.evaluate(scene(), delta=1.0, epsilon=0.2, zeta=0.1, variables=["monodromy"])
    assert ds.monodromy.dims == ("row", "column") and set(ds.data_vars) == {
        "monodromy",
        "monodromy_error",
        "status",
    }
    assert "monodromy" not in survey.evaluate(scene(), delta=1.0, epsilon=0.2, zeta=0.1)
    # Liouville: det M = exp of the integral of tr A = exp(-2 zeta T)
    assert np.linalg.det(ds.monodromy.values) == pytest.approx(math.exp(-0.2 * math.pi), rel=1e-12)


def test_compiled_functions_closures_and_numpy_are_followed():
    shape = np.array([[2.0, -0.3], [-0.3, 1.0]])

    @numba.njit
    def wave(t, frequency):
        return math.sin(frequency * t) ** 2

    def stiffness(t, p, out):
        out[:] = p[0] * shape + p[1] * wave(t, 1.0) * np.eye(2)

    def by_hand(t, p, out):
        value = 0.5 - 0.5 * np.cos(2 * t)
        for i in range(2):
            for j in range(2):
                out[i, j] = p[0] * [[2.0, -0.3], [-0.3, 1.0]][i][j]
            out[i, i] = out[i, i] + p[1] * value

    ones, others = (
        survey.evaluate(
            survey.floquet(K=k, period=math.pi, parameters=("a", "b"), states=("x", "y")),
            a=[1.0, 2.0],
            b=[0.3, 0.9],
        )
        for k in (stiffness, by_hand)
    )
    off = abs(ones.spectral_radius - others.spectral_radius)
    assert (off <= ones.spectral_radius_error + others.spectral_radius_error).all()


def test_a_mass_matrix_and_momenta_give_the_same_multipliers():
    def M(t, p, out):
        out[0, 0], out[1, 1], out[0, 1], out[1, 0] = 2.0, 1.0 + p[0], 0.3, 0.3

    def G(t, p, out):
        out[0, 1], out[1, 0] = 0.7, -0.7

    def K2(t, p, out):
        out[0, 0], out[1, 1] = 1.5 + p[1] * math.cos(t), 2.5
        out[0, 1] = out[1, 0] = 0.2 * math.sin(t)

    given = {
        "M": M,
        "C": G,
        "K": K2,
        "period": 2 * math.pi,
        "parameters": ("m", "b"),
        "states": ("x", "y"),
    }
    free, canonical = (
        survey.evaluate(survey.floquet(**given, structure=kind), m=[0.0, 1.0], b=[0.1, 0.8])
        for kind in ("none", "symplectic")
    )
    bars = free.spectral_radius_error + canonical.spectral_radius_error
    assert (abs(free.spectral_radius - canonical.spectral_radius) <= bars).all()
    assert (canonical.verdict >= 0).all() and (canonical.verdict == 1).any()
    assert (free.verdict != 1).all()  # on the unit circle no velocity tells that it stays there


def test_branches_are_followed_where_points_take_them():
    def K2(t, p, out):
        out[0, 0] = (p[0] if p[0] > 1.0 else 2.0 - p[0]) + abs(p[1]) * math.cos(2 * t)

    def plain(t, p, out):
        out[0, 0] = p[0] + p[1] * math.cos(2 * t)

    ours = survey.evaluate(
        scene(K=K2, parameters=("a", "b"), C=lambda t, p, out: None),
        a=[0.3, 1.0, 1.4],
        b=[-0.2, 0.4],
    )
    same = survey.evaluate(
        scene(K=plain, parameters=("a", "b"), C=lambda t, p, out: None),
        a=[1.7, 1.0, 1.4],
        b=[0.2, 0.4],
    )
    assert (abs(ours.spectral_radius.values - same.spectral_radius.values) < 1e-7).all()
    assert (ours.multiplier_re.values == same.multiplier_re.values).all()


def test_the_hash_tells_of_all_that_the_functions_depend_on():
    first = scene().HASH
    assert scene().HASH == first
    others = [
        scene(K=lambda t, p, out: None), scene(C=lambda t, p, out: None), scene(period=2.0),
        scene(states="y"), scene(structure="reversible"), scene(breaks=1.0), scene(parameters=("a", "b", "c")),
    ]  # fmt: skip
    assert len({first, *(other.HASH for other in others)}) == 8


def test_functions_from_python_run_in_other_processes(tmp_path):
    given = {
        "scene": scene(),
        "axes": {"delta": {"values": [0.5, 1.0]}, "epsilon": {"values": [0.0, 1.0]}, "zeta": 0.1},
    }
    one = survey.run(given, output=tmp_path / "one.nc")
    two = survey.run(given, output=tmp_path / "two.nc", workers=1)
    xr.testing.assert_equal(one.drop_attrs(), two.drop_attrs())
    assert user_scene.of_dataset(one).HASH == one.attrs["scene_hash"]


def test_a_point_without_a_value_costs_itself_alone():
    def K2(t, p, out):
        out[0, 0] = np.sqrt(p[0]) + math.cos(2 * t)

    own = scene(K=K2, parameters="a", C=lambda t, p, out: None)
    ds = survey.evaluate(own, a=[1.0, -1.0, 4.0, np.nan])
    assert ds.status.values.tolist() == [0, 1, 0, 1]
    assert np.isnan(ds.spectral_radius.values).tolist() == [False, True, False, True]


def wrong(t, p, out):
    raise RuntimeError("no")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"K": 1.0}, "K must be a function of three arguments"),
        ({"C": lambda t, p: None}, "C must be a function of three arguments"),
        ({"A": K}, "give either A"),
        ({"K": None}, "give either A"),
        ({"states": ()}, "give the names of the states"),
        ({"states": ("x", "x")}, "give the names of the states"),
        (
            {"states": "abcd"},
            r"may be one name or several; write \('abcd',\), or \('a', 'b', 'c', 'd'\)",
        ),
        ({"states": "x1"}, r"states = 'x1' is a text.*write \('x1',\)"),
        ({"states": "x, y"}, r"write \('x', 'y'\)"),
        ({"structure": "hamiltonian"}, "must be one of 'none', 'symplectic', 'reversible'"),
        ({"period": 0.0}, "it must be a positive number"),
        ({"breaks": 9.0}, "lies outside"),
        ({"breaks": "1"}, r"breaks = '1': it must be number\(s\)"),
        ({"parameters": ("spectral_radius",)}, "neither an output"),
        ({"parameters": ("row",)}, "neither an output"),
    ],
)
def test_wrong_scenes_are_one_line(given, words):
    with pytest.raises(BadInput, match=words) as refusal:
        scene(**given)
    assert "\n" not in str(refusal.value)


def jumping(t, p, out):
    out[0, 0] = p[0] if t < 1.0 else p[1]


def larger(t, p, out):
    out[1, 1] = 1.0


def rooted(t, p, out):
    out[0, 0] = float(p[0])


def tabulated(t, p, out):
    out[0, 0] = np.interp(t, [0.0, 1.0], [1.0, 2.0])


def endless(t, p, out):
    out[0, 0] = math.log(-p[0])


def massless(t, p, out):
    out[0, 0] = p[1] - 0.3


class Modulated:
    """A system whose functions are methods, and need what the object knows."""

    def __init__(self, strength):
        self.strength = strength

    def K(self, t, p, out):
        out[0, 0] = p[0] + self.strength * math.cos(2 * t)

    def helped(self, t, p, out):
        self.K(t, p, out)


def modulated(strength, t, p, out):
    out[0, 0] = p[0] + strength * math.cos(2 * t)


def test_methods_and_partial_functions_are_functions():
    def ours(K):
        return survey.floquet(K=K, period=math.pi, parameters="delta", states="x")

    expected = survey.evaluate("mathieu", a=1.5, q=-0.2)  # delta + 0.4 cos 2 t
    for make in (lambda s: Modulated(s).K, lambda s: functools.partial(modulated, s)):
        found = survey.evaluate(ours(make(0.4)), delta=1.5)
        trace = float(found.multiplier_re.sum())
        bar = float(found.multiplier_re_error.sum() + expected.discriminant_error)
        assert abs(trace - float(expected.discriminant)) <= bar
        assert ours(make(0.4)).HASH == ours(make(0.4)).HASH != ours(make(0.5)).HASH
    with pytest.raises(
        BadInput, match="math in a method that another one calls, where numpy serves"
    ):
        survey.evaluate(ours(Modulated(0.4).helped), delta=1.5)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"K": wrong}, r"K\(t, p, out\) fails \(RuntimeError: no\)"),
        (
            {"K": lambda t, p, out: p[1], "parameters": "delta"},
            r"names 1 \('delta'; several are \('a', 'b'",
        ),
        ({"K": larger}, r"K\(t, p, out\) indexes beyond an array .*out is 1 x 1"),
        ({"K": lambda t, p, out: p["delta"]}, "accesses a parameter by name"),
        ({"K": lambda t, p, out: np.zeros((2, 2))}, r"returns an array of shape \(2, 2\)"),
        ({"K": jumping}, "name the times in breaks"),
        ({"K": rooted}, "needs the value of t or of a parameter"),
        ({"K": tabulated}, "use .* functions such as sin, exp, sqrt"),
        ({"K": endless}, "no finite value at delta = 1"),
        ({"period": 3.0}, r"K\(t \+ T\) differs from K\(t\) by"),
        ({"period": lambda p: -1.0}, "period is not a positive number"),
        ({"period": lambda p: 1 / 0}, r"period\(p\) fails \(ZeroDivisionError"),
        ({"structure": "symplectic"}, "J A is not symmetric"),
        ({"structure": "reversible"}, "no signs R"),
        ({"breaks": lambda p: None}, "breaks has no finite value at delta = 1"),
        (
            {"M": massless},
            r"M\(t, p, out\) is singular at delta = 1, epsilon = 0.3, zeta = 0.1; give every",
        ),
    ],
)
def test_wrong_functions_are_one_line(given, words):
    own = scene(**given)
    others = {"epsilon": 0.3, "zeta": 0.1} if len(own.own) > 1 else {}
    with pytest.raises(BadInput, match=words) as refusal:
        survey.evaluate(own, delta=[1.0, 2.0], **others)
    assert "\n" not in str(refusal.value)


def ends(*_):
    raise SystemExit(3)


def late(t, p, out):
    if t > 2.0:
        raise RuntimeError("too late")
    out[0, 0] = p[0]


@pytest.mark.parametrize("key", ["K", "C", "M", "period", "breaks", "conserved"])
def test_a_function_that_ends_python_is_one_line(key):
    with_A = {"K": None, "C": None, "A": lambda t, p, out: out.__setitem__((0, 1), 1.0)}
    own = {"states": ("x", "y"), **with_A} if key == "conserved" else {}
    given = {key: (lambda t, p, out: ends()) if key in "KCM" else lambda p: ends()}
    with pytest.raises(BadInput, match=r"fails \(SystemExit: 3\)") as refusal:
        survey.evaluate(scene(**own, **given), delta=[1.0, 2.0], epsilon=0.3, zeta=0.1)
    assert "\n" not in str(refusal.value)


def test_a_function_may_be_interrupted():
    def K2(t, p, out):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        survey.evaluate(scene(K=K2), delta=1.0, epsilon=0.3, zeta=0.1)


def test_a_function_that_fails_late_is_one_line():
    with pytest.raises(BadInput, match=r"K\(t, p, out\) fails at t = 2\..* \(RuntimeError: too"):
        survey.evaluate(scene(K=late), delta=1.0, epsilon=0.3, zeta=0.1)


@pytest.mark.parametrize("how", ["in A", "at once"])
def test_a_run_of_a_file_that_ends_python_says_so(program, tmp_path, monkeypatch, how):
    inside = {"in A": "    raise SystemExit(3)\n", "at once": "    pass\nraise SystemExit(3)\n"}
    (tmp_path / "mine.py").write_text(
        "PARAMETERS, STATES, PERIOD = ('delta', 'epsilon', 'zeta'), ('x', 'v'), 1.0\n"
        f"def A(t, p, out):\n{inside[how]}"
    )
    (tmp_path / "mine.toml").write_text(WORKFLOW)
    monkeypatch.chdir(tmp_path)
    run = program("run", "mine.toml", "-o", "mine.nc")
    assert run.returncode == 2 and "(SystemExit: 3)" in run.stderr
    assert "Traceback" not in run.stderr


def poled(t, p, out):
    out[0, 1], out[1, 0] = 1.0, -1 / (p[0] + math.cos(2 * t))


def poled_twice(t, p, out):
    out[0, 1], out[1, 0] = 1.0, -1 / (p[0] + math.cos(2 * t)) ** 2


def logarithmic(t, p, out):
    out[0, 1], out[1, 0] = 1.0, -math.log(0.5 + p[0] + math.cos(2 * t))


def narrow(t, p, out):
    out[0, 1], out[1, 0] = 1.0, -1 / (0.5 + p[0] + 1e-9 + math.cos(2 * t))


def vanishing(t, p, out):
    out[0, 0] = math.cos(2 * t)


@pytest.mark.parametrize("breaks", [(), math.pi / 3, (math.pi / 3, 2 * math.pi / 3)])
def test_a_pole_is_told_from_a_spike(breaks):
    """x'' = x / (1/2 + cos 2t): naming the poles in BREAKS does not help."""
    given = {"period": math.pi, "parameters": "a", "states": ("x", "v"), "breaks": breaks}
    words = (
        r"A seems to be infinite near t = (1\.0472|2\.0944) at a = 0\.5, where the system has no"
    )
    with pytest.raises(BadInput, match=words) as refusal:
        survey.evaluate(survey.floquet(poled, **given), a=0.5)
    assert "\n" not in str(refusal.value) and "breaks" not in str(refusal.value)


@pytest.mark.parametrize(
    ("A", "words"),
    [
        (poled_twice, r"A seems to be infinite near t = (1\.0472|2\.0944) at a = 0\.5"),
        (logarithmic, "A has a spike near t = 1.570.*name its position in breaks"),
        (narrow, "A has a spike near t = 1.570.*name its position in breaks"),
    ],
)
def test_what_is_less_than_a_pole_is_a_spike(A, words):
    given = {"period": math.pi, "parameters": "a", "states": ("x", "v")}
    with pytest.raises(BadInput, match=words):
        survey.evaluate(survey.floquet(A, **given), a=0.5)


def test_a_mass_that_vanishes_is_named():
    words = r"M seems to be singular near t = (0\.785398|2\.35619) at delta = 1, "
    with pytest.raises(BadInput, match=words):
        survey.evaluate(scene(M=vanishing), delta=1.0, epsilon=0.3, zeta=0.1)


def test_a_logarithm_of_negative_numbers_is_said_to_be_undefined_with_breaks_too():
    def A(t, p, out):
        out[0, 1], out[1, 0] = 1.0, -math.log(1 + p[0] * math.cos(2 * t))

    given = {"period": math.pi, "parameters": "a", "states": ("x", "v"), "breaks": math.pi / 3}
    with pytest.raises(BadInput, match=r"A has no finite value at a = 1\.5"):
        survey.evaluate(survey.floquet(A, **given), a=1.5)


def test_a_file_without_its_names_is_one_line(tmp_path):
    for name in ("STATES", "PERIOD", "PARAMETERS"):
        path = tmp_path / f"{name}.py"
        path.write_text("\n".join(line for line in SCENE.splitlines() if not line.startswith(name)))
        with pytest.raises(BadInput, match=f"{name} is missing; write {name} ="):
            survey.evaluate(str(path), delta=1.0, epsilon=0.3, zeta=0.1)


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ("def f(t, x, p, out):\n    out[0] = x[1]\n", "K, of a linear periodic system, and f, of"),
        ("START = (1.0, 0.0)\n", "K, of a linear periodic system, and START, of"),
        (
            "def f(t, x, p, out):\n    out[0] = x[1]\ndef START(p):\n    return 1.0, 0.0\n",
            "K, .* and f and START, of",
        ),
    ],
)
def test_a_file_of_two_systems_is_refused(tmp_path, more, named):
    path = tmp_path / "both.py"
    path.write_text(SCENE + more)
    with pytest.raises(
        BadInput, match=f"both.py: it holds {named}.*leave one of the two out"
    ) as refusal:
        survey.evaluate(str(path), delta=1.0, epsilon=0.3, zeta=0.1)
    assert "\n" not in str(refusal.value)


def test_a_file_may_call_its_own_helper_f(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(SCENE + "def f(t):\n    return cos(2 * t)\n")
    assert int(survey.evaluate(str(path), delta=1.0, epsilon=0.3, zeta=0.1).status) == 0


def test_equal_reversible_oscillators_are_told_what_decides():
    def equal(t, p, out):
        out[0, 0] = out[1, 1] = p[0] + p[1] * math.cos(2 * t)

    given = {"K": equal, "period": math.pi, "parameters": ("a", "q"), "states": ("x", "y")}
    ds = survey.evaluate(survey.floquet(structure="reversible", **given), a=1.7, q=0.3)
    assert int(ds.verdict) == -1
    assert 'state "symplectic" if the system is Hamiltonian' in ds.survey.point().why
    assert (
        int(survey.evaluate(survey.floquet(structure="symplectic", **given), a=1.7, q=0.3).verdict)
        == 1
    )


def test_reversible_systems_of_one_coordinate_are_stable_on_the_circle():
    ds = survey.evaluate(
        survey.floquet(K=K, period=math.pi, parameters=("delta", "epsilon"), states="x", structure="reversible"),
        delta=[0.5, 1.0], epsilon=0.4,
    )  # fmt: skip
    known = survey.evaluate("mathieu", a=[0.5, 1.0], q=-0.2)
    assert ds.verdict.values.tolist() == known.verdict.values.tolist() == [1, 0]


@pytest.mark.parametrize(
    ("matrices", "fitting"),
    [
        ({"K": K}, "'symplectic' or 'reversible'"),
        ({"K": lambda t, p, out: out.__setitem__((0, 0), p[0] + math.cos(2 * t) + 0.3 * math.sin(4 * t))},
         "'symplectic'"),
        ({"K": K, "C": C}, None),
    ],
)  # fmt: skip
def test_a_structure_that_fits_is_named_once(matrices, fitting, caplog):
    given = {name: matrices.get(name) for name in ("K", "C")}
    own = scene(**given)
    for a in (2.2, 2.5):
        ds = survey.evaluate(own, delta=a, epsilon=0.1, zeta=0.05)
        assert int(ds.verdict) == (2 if fitting else 1)  # marginal, not stable
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == bool(fitting)
    if fitting:
        assert f"set structure = {fitting}, which the system is" in said[0]


def test_a_file_may_name_what_is_conserved(tmp_path):
    """Two free masses, damped by their relative motion: s' = w - u, and u + w stays the same."""
    path = tmp_path / "free.py"
    path.write_text(
        "from math import cos, pi\n"
        "PARAMETERS, STATES, PERIOD, CONSERVED = ('k', 'c'), ('s', 'u', 'w'), 2 * pi, (0, 1, 1)\n"
        "def A(t, p, out):\n"
        "    out[0, 1], out[0, 2] = -1.0, 1.0\n"
        "    for row, sign in ((1, 1.0), (2, -1.0)):\n"
        "        out[row, 0] = sign * p[0] * (1 + 0.1 * cos(t))\n"
        "        out[row, 1], out[row, 2] = -sign * p[1], sign * p[1]\n"
    )
    ds = survey.evaluate(str(path), k=1.3, c=0.2)
    assert int(ds.verdict) == 1 and ds.sizes["multiplier"] == 2
    path.write_text(path.read_text().replace(", CONSERVED", "").replace(", (0, 1, 1)", ""))
    assert int(survey.evaluate(str(path), k=1.3, c=0.2).verdict) == -1


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (
            ((0, 1, 1), (1, 0, 0)),
            r"conserved = .*one combination of the states alone can be stated; give its coefficients, 3 numbers",
        ),
        (
            lambda p: ((0, 1, 1), (1, 0, 0)),
            r"conserved\(p\) returns 6 numbers, not 3: one combination of the states alone",
        ),
        ((0, 1), "there are 3 states, and each needs a number"),
    ],
)
def test_one_combination_alone_is_conserved(rows, words):
    def A(t, p, out):
        out[0, 1], out[0, 2] = -1.0, 1.0
        out[1, 0], out[2, 0] = p[0], -p[0]

    given = {"period": math.pi, "parameters": "k", "states": ("s", "u", "w")}
    with pytest.raises(BadInput, match=words) as refusal:
        survey.evaluate(survey.floquet(A, conserved=rows, **given), k=1.3)
    assert "\n" not in str(refusal.value)


def test_a_row_of_coefficients_is_one_combination_as_well():
    def A(t, p, out):
        out[0, 1], out[0, 2] = -1.0, 1.0
        out[1, 0], out[2, 0] = p[0], -p[0]

    given = {"period": math.pi, "parameters": "k", "states": ("s", "u", "w")}
    own = survey.floquet(A, conserved=[[0, 1, 1]], **given)
    assert own.conserved == (0.0, 1.0, 1.0)


def test_a_state_with_a_long_name_is_one_of_a_tuple():
    assert scene(states=("angle",)).states == ("angle", "dangle")
