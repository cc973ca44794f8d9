"""A user's own Hill equation goes through every command like a built-in scene; what is wrong is
said in one line.
"""

import math

import dask.array as da
import numpy as np
import pytest
import xarray as xr

import survey
from survey.errors import BadInput
from survey.file import blocks
from survey.request import user_scene, workflow
from survey.status import INVALID_PARAMETERS, OK
from survey.sweep import cost, engine, fingerprint, solve

SCENE = '''"""Mathieu's equation of my own.

z = a - 2 q cos 2u."""
from math import cos, pi

PARAMETERS = ("a", "q")
PERIOD = pi
EVEN = True


def z(u, p):
    return p[0] - 2 * p[1] * cos(2 * u)
'''
WORKFLOW = """
scene = "mine.py"
[axes]
a = { start = -1.0, stop = 10.0, num = 8 }
q = { start = 0.1, stop = 2.0, num = 6 }
[output]
figures = ["verdict"]
[boundaries]
axis = "a"
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the scene in a folder below it, beside its workflow; the current folder."""
    (tmp_path / "below").mkdir()
    (tmp_path / "below/mine.py").write_text(SCENE)
    (tmp_path / "below/mine.toml").write_text(WORKFLOW)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_every_command_takes_it(program, folder):
    run = program("run", "below/mine.toml", "-o", "mine.nc", "--workers", "1")
    assert run.returncode == 0, run.stderr
    assert (folder / "mine.png").exists()
    for words in (
        ("plan", "below/mine.toml"),
        ("info", "mine.nc"),
        ("verify", "mine.nc"),
        ("plot", "mine.nc"),
    ):
        done = program(*words)
        assert done.returncode == 0, done.stderr
    assert "Mathieu's equation of my own" in program("scenes", "below/mine.py").stdout
    ds = survey.open("mine.nc")
    assert ds.attrs["scene_text"] == SCENE and ds.attrs["title"] == "Mathieu's equation of my own"
    same = survey.evaluate("mathieu", a=ds.a.values, q=ds.q.values)
    assert (ds.verdict.values == same.verdict.values).all() and ds.edge_complete.values.all()
    (folder / "below/mine.py").write_text(SCENE + "\n")
    changed = program("verify", "mine.nc")
    assert changed.returncode == 2 and "its file has changed since" in changed.stderr
    (folder / "below/mine.py").unlink()
    gone = program("verify", "mine.nc")
    assert (
        gone.returncode == 2
        and "its file is missing" in gone.stderr
        and gone.stderr.count("\n") == 1
    )
    assert program("plot", "mine.nc").returncode == 0


def test_finished_blocks_are_not_used_again_after_the_file_has_changed(folder):
    first = workflow.read("below/mine.toml", output="o.nc")
    block = cost.regions_of(first)[1][0][1][0]
    with blocks.Blocks(first.path, fingerprint.fingerprint(first)) as kept:
        kept.save(0, solve.solve_block(first.scene, first.request, first.grid, block))
    (folder / "below/mine.py").write_text(SCENE.replace("- 2 *", "- 2.000001 *"))
    with pytest.raises(BadInput, match=r"a different z\(u, p\).*--fresh"):
        engine.run(workflow.read("below/mine.toml", output="o.nc"))
    (folder / "below/mine.py").write_text(SCENE)
    engine.run(workflow.read("below/mine.toml", output="o.nc"))


STRENGTH = 2.0


def helper(x):
    return STRENGTH * np.cos(2 * x)


def calls(u, p):
    return p[0] - p[1] * helper(u)


def mathieu(u, p):
    return p[0] - p[1] * (STRENGTH * np.cos(2 * u))


def scene(z=mathieu, **given):
    return survey.hill(z, **({"period": np.pi, "parameters": ("a", "q"), "even": True} | given))


def test_the_hash_tells_of_all_that_a_function_depends_on(monkeypatch):
    first = scene().HASH
    assert scene().HASH == first
    given = [{"period": 2 * np.pi}, {"even": False}, {"breaks": 1.0}, {"parameters": ("a", "b")}]
    others = [scene(**more).HASH for more in given] + [
        scene(z).HASH for z in (_times(2.0), _times(3.0), calls)
    ]
    monkeypatch.setitem(globals(), "STRENGTH", 3.0)
    others += [scene().HASH, scene(calls).HASH]
    assert len({first, *others}) == 10


def _times(f):
    return lambda u, p: p[0] - f * p[1] * np.cos(2 * u)


def test_a_function_from_python_runs_in_other_processes(tmp_path, monkeypatch):
    axes = {"a": {"start": -1.0, "stop": 10.0, "num": 8}, "q": 1.0}
    given = {"scene": scene(_times(2.0)), "axes": axes}
    one = survey.run(given, output=tmp_path / "one.nc")
    two = survey.run(given, output=tmp_path / "two.nc", workers=1)
    xr.testing.assert_equal(one.drop_attrs(), two.drop_attrs())
    assert "return lambda u, p" in one.attrs["scene_text"]
    assert user_scene.of_dataset(one).HASH == one.attrs["scene_hash"]
    monkeypatch.setattr(user_scene, "_made", {})  # as in another session
    with pytest.raises(BadInput, match="was a function in Python"):
        user_scene.of_dataset(survey.open(tmp_path / "one.nc"))


@pytest.mark.parametrize("workers", [None, 1])  # each worker compiles z again
def test_what_z_raises_in_the_middle_of_a_run_is_one_line(workers, tmp_path):
    def z(u, p):
        if 0.2 < p[0] < 0.3:
            raise ValueError("no")
        return p[0]

    axes = {"a": {"start": 0.0, "stop": 1.0, "num": 50}, "q": 1.0}
    with pytest.raises(
        BadInput, match=r"hill\(z\): z\(u, p\) raises ValueError\('no'\); make it return nan"
    ) as refusal:
        survey.run({"scene": scene(z), "axes": axes}, output=tmp_path / "o.nc", workers=workers)
    assert "\n" not in str(refusal.value)


def test_dask_input_stays_lazy_and_gives_the_same_bits():
    a, q = np.linspace(0.0, 9.0, 6), np.array([0.5, 1.0])
    ds = survey.evaluate(scene(), a=xr.DataArray(da.from_array(a, chunks=4), dims="a"), q=q)
    assert ds.y1.chunks
    loaded = survey.evaluate(scene(), a=a, q=q)
    for name in loaded.data_vars:
        np.testing.assert_array_equal(ds[name].compute(), loaded[name])


def test_where_z_is_not_even_the_outputs_say_so():
    odd = scene(lambda u, p: p[0] + p[1] * np.sin(2 * u) ** 3, even=False)
    ds = survey.evaluate(odd, a=1.0, q=1.0)
    assert ds.y1.attrs["long_name"].startswith("y1(T),") and ds.dy2.attrs["symbol"] == "y_2'(T)"


BAD = [
    ("def z(u, p):", "def w(u, p):", "z is missing; write def z"),
    ("PERIOD = pi", "", "PERIOD is missing; write"),
    ("PERIOD = pi", "PERIOD = -pi", "PERIOD = -3.14.*positive number"),
    (
        "PERIOD = pi",
        "PERIOD = lambda p: -p[1]",
        "PERIOD is -0.5 at a = 1, q = 0.5; make it positive",
    ),
    ("PERIOD = pi", "PERIOD = lambda p: p[2]", r"PERIOD\(p\) fails"),
    (
        "PERIOD = pi",
        "def PERIOD(p):\n    raise SystemExit(3)",
        r"PERIOD\(p\) fails \(SystemExit: 3\)",
    ),
    ("return p[0]", "raise SystemExit(3)\n    p[0]", r"z\(u, p\) fails \(SystemExit: 3\)"),
    (
        "PERIOD = pi",
        "PERIOD = 3.0",
        r"EVEN = True, but z\(T - u\) is not z\(u\) at a = 1, q = 0.5, T = 3",
    ),
    ("PERIOD = pi\nEVEN = True", "PERIOD = 3.0", r"z\(T\) is not z\(0\)"),
    (
        "cos(2 * u)",
        "cos(2 * u - 0.3)",
        r"EVEN = True, but z\(T - u\) is not z\(u\).*set EVEN = False",
    ),
    ("EVEN = True", "EVEN = 'yes'", "EVEN = 'yes': it must be True or False"),
    ("cos(2 * u)", "abs(cos(2 * u))", "z is not smooth at a = 1, q = 0.5; name the positions"),
    ("p[0]", "(-p[0] - u) ** 0.5", "z has no finite value at a = 1, q = 0.5"),
    ("p[0]", "p[2]", r"PARAMETERS names 2: p\[0\] to p\[1\]"),
    ("p[0]", "unknown(u)", r"cannot compile z\(u, p\) \(name 'unknown' is not defined\)"),
    ("return p[0]", "return 'a'\n    p[0]", r"z\(u, p\) returns 'a'; it must return a real number"),
    (
        "return",
        "if p[0] > 0: raise ValueError('no')\n    return",
        r"z\(u, p\) raises ValueError\('no'\)",
    ),
    ("z(u, p)", "z(u, a, q)", "z must be a function of two arguments"),
    ("def z(u, p):", "def z(u, p)", "the scene file failed to run .SyntaxError"),
    ("from math", "from maths", "the scene file failed to run .ModuleNotFoundError"),
    ('"a", "q"', '"a", "a"', "PARAMETERS = .*each once"),
    ('"a", "q"', '"a", "y1"', "PARAMETERS = .*neither an output"),
    ("EVEN = True", "BREAKS = (1.0, 4.0)", "BREAKS: 4 lies outside 0 <= u <= T"),
    ("EVEN = True", "BREAKS = lambda p: 7.0", "BREAKS lie outside 0 <= u <= T at a = 1"),
]


@pytest.mark.parametrize(
    ("old", "new", "words"), BAD, ids=[new.split("\n")[0] for _, new, _ in BAD]
)
def test_what_is_wrong_with_a_scene_is_said_in_one_line(folder, old, new, words):
    assert old in SCENE
    (folder / "bad.py").write_text(SCENE.replace(old, new, 1))
    names = {"a": 1.0, "q": 0.5} if '"y1"' not in new else {"a": 1.0, "y1": 0.5}
    with pytest.raises(BadInput, match=words) as refusal:
        survey.evaluate("bad.py", **names)
    assert "\n" not in str(refusal.value) and str(refusal.value).startswith("bad.py: ")


def test_what_is_no_scene_is_refused(folder):
    with pytest.raises(
        BadInput, match=r"there is no file gone\.py or below/gone\.py; name the file"
    ):
        workflow.check({"scene": "gone.py", "axes": {"a": 1.0}}, near="below")
    with pytest.raises(BadInput, match=r"is a function; give survey\.hill\(mathieu"):
        survey.evaluate(mathieu, a=1.0, q=1.0)
    with pytest.raises(BadInput, match="scene = 5: input should be a valid string"):
        workflow.check({"scene": 5, "axes": {"a": 1.0}})
    with pytest.raises(
        BadInput,
        match=r"axes\.aa: unknown parameter of scene hill\(mathieu\) 'aa'; did you mean 'a'",
    ):
        workflow.check({"scene": scene(), "axes": {"aa": {"num": 3}, "q": 1.0}})
    with pytest.raises(BadInput, match="a is missing"):
        survey.evaluate(scene(), q=1.0)


def test_an_equation_without_a_force_is_answered():
    free = survey.hill(lambda u, p: p[0] + 0 * u, period=92.65606698476718, parameters="a")
    ds = survey.evaluate(free, a=[0.0, 1e-3])
    assert (ds.status == 0).all() and ds.verdict[0] != 0  # y = 1 and y = u: D = 2, on an edge
    assert abs(ds.discriminant[0] - 2) <= ds.discriminant_error[0]


def test_a_file_or_function_that_says_nothing_gives_its_name_to_the_title(tmp_path):
    def pendulum(u, p):
        return p[0] - 2 * p[1] * math.cos(2 * u)

    text = "from math import cos, pi\nPERIOD, PARAMETERS = pi, ('a', 'q')\n\n\n"
    text += "def z(u, p):\n    return p[0] - 2 * p[1] * cos(2 * u)\n"
    file = tmp_path / "my_pendulum.py"
    for docstring, title in (
        ("", "my_pendulum: y'' + z(u, p) y = 0"),
        ('""" """\n', "my_pendulum: y'' + z(u, p) y = 0"),
        ('"""My pendulum."""\n', "My pendulum"),
    ):
        file.write_text(docstring + text)
        assert survey.evaluate(str(file), a=1.0, q=0.5).attrs["title"] == title
    made = {"period": math.pi, "parameters": ("a", "q")}
    assert survey.hill(pendulum, **made).TITLE == "pendulum: y'' + z(u, p) y = 0"
    assert survey.hill(lambda u, p: p[0] + p[1], **made).TITLE == "y'' + z(u, p) y = 0"
    assert survey.hill(pendulum, title="Own", **made).TITLE == "Own"


def test_further_arguments_have_defaults():
    """As those of functions made in a loop: each keeps its own number."""

    def value(z):
        scene = survey.hill(z, period=2 * np.pi, parameters=("a", "q"))
        return float(survey.evaluate(scene, a=1.3, q=0.4).discriminant)

    one, two = (
        value(lambda u, p, rate=rate: p[0] + p[1] * np.cos(rate * u)) for rate in (1.0, 2.0)
    )
    assert abs(one - value(lambda u, p: p[0] + p[1] * np.cos(u))) < 1e-11
    assert abs(two - value(lambda u, p: p[0] + p[1] * np.cos(2 * u))) < 1e-11
    assert abs(one - two) > 1e-3


def test_z_that_is_finite_in_the_middle_of_an_axis_alone_is_answered():
    z = survey.hill(
        lambda u, p: p[0] * (1e308 + math.cos(u)), period=math.tau, parameters="a", even=True
    )
    ds = survey.evaluate(z, a=[-2.0, 0.0, 2.0])
    assert (ds.status.values == [INVALID_PARAMETERS, OK, INVALID_PARAMETERS]).all()


@pytest.mark.parametrize(
    ("z", "given", "words"),
    [
        (lambda u, p: p[0] + 1e-6 * math.sin(2 * u), {"even": True}, r"z\(T - u\) is not z\(u\)"),
        (lambda u, p: p[0] + 1e-6 * abs(math.cos(2 * u) - 0.3), {"even": True}, "not smooth"),
        (lambda u, p: p[0] + 1e-6 * math.sin(u), {"even": False}, r"z\(T\) is not z\(0\)"),
    ],
)
def test_what_is_wrong_where_z_is_small_is_refused(z, given, words):
    """Between two values of a parameter z is a mean of both, and may be far smaller."""
    scene = survey.hill(z, period=math.pi / (1 if given["even"] else 1.5), parameters="a", **given)
    with pytest.raises(BadInput, match=words + ".* at a = 0"):
        survey.evaluate(scene, a=[-1000.0, 0.0, 1000.0])


def test_branches_on_u_are_seen_over_the_longest_period():
    """A degree in p found in one branch does not hold in the other: rows would be wrong."""

    def z(u, p):
        wave = math.cos(math.tau * u / p[1])
        return p[0] ** 2 + wave if u > 5.0 else p[0] + wave

    given = {"period": lambda p: p[1], "breaks": (0.0, 5.0), "parameters": ("a", "T")}
    scene = survey.hill(z, **given)
    a, T = np.linspace(0.1, 2.0, 20), [6.0, 7.0]
    ds = survey.evaluate(scene, a=a, T=T)
    alone = survey.evaluate(scene, a=a, T=T, method="taylor16")
    off = abs(ds.discriminant - alone.discriminant)
    assert (off <= ds.discriminant_error.astype(float) + alone.discriminant_error).all()
    assert (ds.verdict == alone.verdict).all()


def test_what_z_raises_at_the_ends_of_its_period_is_one_line():
    def z(u, p):
        if u == 0.0:
            raise ValueError("not at 0")
        return p[0]

    scene = survey.hill(z, period=math.pi, parameters="a", breaks=0.0)
    with pytest.raises(BadInput, match=r"z\(u, p\) raises ValueError"):
        survey.evaluate(scene, a=1.0)


def test_a_kink_is_refused_where_z_is_linear_in_its_parameters():
    z = survey.hill(
        lambda u, p: p[0] + p[1] * abs(math.cos(u) - 0.3),
        period=math.tau,
        parameters=("a", "b"),
        even=True,
    )
    with pytest.raises(BadInput, match="not smooth at a = 0, b = 1;"):
        survey.evaluate(z, a=[0.0, 1.0, 2.0], b=[1.0, 0.0, -1.0])
