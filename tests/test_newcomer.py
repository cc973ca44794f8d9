"""Mistakes that a newcomer types, at the command line and in Python: one clear line each, which
says what to do.
"""

import numpy as np
import pytest
import xarray as xr

import survey
from survey.cli import main

WORKFLOW = """
scene = "satellite"
[axes]
k = { start = 0.0, stop = 0.9, num = 5 }
rho = { start = 0.6, stop = 4.0, num = 6 }
[output]
path = "map.nc"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("newcomer")
    (folder / "good.toml").write_text(WORKFLOW)
    (folder / "own.py").write_text(
        "PARAMETERS = ('a',)\nPERIOD = 1.0\n\n\ndef z(u, p):\n    return p[0]\n"
    )
    (folder / "twice.toml").write_text(WORKFLOW.replace("rho =", "k ="))
    (folder / "folder.html").mkdir()
    survey.run(folder / "good.toml", output=folder / "map.nc")
    return folder


@pytest.fixture
def here(folder, monkeypatch):
    monkeypatch.chdir(folder)
    monkeypatch.setenv("MPLBACKEND", "agg")
    return folder


SHELL = [
    ("run nothing.toml", "No such file or directory"),
    ("rum good.toml", "Did you mean 'run'?"),
    ("run map.nc", "survey info, plot and verify read it"),
    (
        "run good.toml --set boundaries=true",
        "boundaries = True: it must be a valid table, [boundaries] on a line of its own",
    ),
    ("run good.toml --set boundaries.surfaces='yes'", "it must be true or false, without quotes"),
    (
        "init floquet",
        "systems of your own are files, such as 'mine.py', or come from survey.floquet(...) in Python",
    ),
    ("run satellite", "this is a scene: survey init satellite writes a workflow for it"),
    ("run own.py", "this is a scene's file: survey init own.py writes a workflow for it"),
    ("run twice.toml", "this is not TOML (a key is given twice: "),
    (
        "run good.toml -o map.csv",
        "output.path = 'map.csv' must be a netCDF file; name one, such as 'map.nc'",
    ),
    ("run good.toml -o .", "output.path = '.' is a folder"),
    ("run good.toml --set axes.k.num=2.5", "axes.k.num = 2.5"),
    ("run good.toml --set axes.k.spacing=logarithmic", "should be 'linear' or 'log'"),
    ("run good.toml --set axes.k.step=0.1", "give num, the number of values from start to stop"),
    ("run good.toml --set axes.k.start=nan", "axes.k.start = nan"),
    ("run good.toml --set options.body=ball", "unknown value 'ball' (allowed: prolate, oblate)"),
    ("run good.toml --set solver.rtol=small", "solver.rtol = 'small'"),
    ("run good.toml --set output.variables=verdict", "it must be a list"),
    ("run good.toml --workers 0", "'--workers': 0 is below 1; see survey run --help"),
    ("run good.toml --block-timeout 0", "0.0 is not above 0"),
    ("run good.toml --scheduler nothing.json", "there is no such scheduler file"),
    ("plan map.nc", "survey info, plot and verify read it"),
    ("plan good.toml --set axes=3", "axes = 3"),
    ("verify map.nc --points many", "'many' is not a valid integer; see survey verify --help"),
    ("verify .", "is a folder; name a netCDF file"),
    ("plot map.nc -o .", "-o '.': name a .png, .pdf or .svg file"),
    ("plot map.nc -o picture", "-o 'picture': name a .png, .pdf or .svg file"),
    ("plot map.nc --at k", "k = '': give one number"),
    ("plot map.nc --at k=0.1 --at rho=1", "a figure needs at least one axis"),
    ("scenes good.toml", "'good.toml' (allowed: brun"),
    ("init mathieu -o .", "'.' is a folder; name a file that ends in .toml"),
    ("precision satelite", "unknown precision chart 'satelite'; did you mean 'satellite'?"),
    ("precision mathieu -o good.toml", "cannot make this folder"),
    ("failures satelite", "unknown failure chart 'satelite'; did you mean 'satellite'?"),
    ("merge map.nc", "Missing option '-o'"),
    ("bundle good.toml", "this is not a netCDF file of survey"),
    ("prove good.toml --set refine.width=-1", "refine.width = -1"),
    ("view map.nc --port 70000", "70000 is not from 0 to 65535"),
    ("view map.nc --link foo", "--link foo: this is not the address of a view"),
    ("run good.toml --set axes.k.number=3", "did you mean 'num'?"),
    ("run good.toml --set axes.k", "write it as KEY=VALUE"),
    ("run good.toml --set axes.k.num=0", "axes.k.num = 0"),
    ("run good.toml --set axes.roh=1", "did you mean 'rho'?"),
    ("run good.toml --set axes.k.stop=-0.5", "allowed: 0 <= k"),
    ("run good.toml --set scene=Satellite", "did you mean 'satellite'?"),
    ("run good.toml --set solver.method=rk45", "did you mean 'rk4'?"),
    ("run good.toml --set output.figures=['stability']", "did you mean 'verdict'?"),
    ("run good.toml -o nowhere/map.nc", "there is no folder 'nowhere'; create it first"),
    ("run good.toml --workers two", "'two' is not a valid integer"),
    ("run good.toml --set axes.k.num=6", "--fresh"),  # another map than the one in the file
    ("plot map.nc --var exponents", "did you mean 'exponent'?"),
    ("plot map.nc --at r=1", "did you mean 'rho'?"),
    ("plot good.toml", "this is not a netCDF file of survey"),
    ("plot map.nc -o map.docx", "name a .png, .pdf or .svg file"),
    ("info nothing.nc", "there is no such file; name a netCDF file"),
    ("scenes pendulum", "unknown scene 'pendulum' (allowed: brun, brun_triaxial, gyrostat"),
    ("init sattelite", "did you mean 'satellite'?"),
    ("merge map.nc map.nc -o both.nc", "they have the same points"),
    ("prove good.toml", "add [refine] with a width"),
    ("precision xyz", "xyz"),
    ("share map.nc -o map.nc", "this file ends in .html or .htm; name one, such as 'map.html'"),
    ("share map.nc -o map.png", "name one, such as 'map.html'"),
    ("share map.nc -o folder.html", "is a folder; name a file that ends in .html or .htm, with -o"),
    ("share map.nc --at r=1", "unknown axis 'r'"),
    ("model good.toml -o map.nc", "this file ends in .model; name one, such as 'map.model'"),
    (
        "model good.toml --set axes.k=0.5",
        "1 of the workflow's parameters vary; a model needs exactly two",
    ),
    ("model good.toml --proof nothing.nc", "there is no such file"),
    ("bundle map.nc -o map.tar", "a bundle is a .zip file or a folder; name one, such as map.zip"),
    ("bundle map.nc -o b.zip --license MIT", "give the address of the licence"),
    ("bundle map.nc --licence MIT", "Did you mean '--license'?"),
    ("failures good.toml", "true values are known only of Hill equations"),
    ("failures mathieu --share 2", "give a number above 0 and up to 1"),
    ("init mathieu -o nowhere/x.toml", "there is no folder 'nowhere'; create it first"),
    ("init mathieu -o folder.html", "is a folder; name a file that ends in .toml"),
]


@pytest.mark.parametrize(("line", "words"), SHELL)
def test_a_command_answers_in_one_line(line, words, here, capsys):
    before = sorted(path.name for path in here.iterdir())
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    said = capsys.readouterr().err
    assert (
        ended.value.code == 2
        and words in said
        and said.startswith("survey: ")
        and said.count("\n") == 1
    ), said
    assert sorted(path.name for path in here.iterdir()) == before


def z(u, p):
    return p[0] + np.cos(2 * u)


def fill(t, p, out):
    out[0, 1], out[1, 0] = 1.0, -p[0]


def ensemble():
    return survey.evaluate("satellite", k=xr.DataArray([0.1, 0.2], dims="draw"), rho=1.0)


PYTHON = [
    (lambda ds: survey.evaluate("satelite", k=0.1, rho=1.0), "did you mean 'satellite'?"),
    (
        lambda ds: survey.evaluate("satellite", k=0.1),
        "rho is missing: satellite needs orbital rate",
    ),
    (
        lambda ds: survey.evaluate("satellite", k=0.1, rho="1"),
        "rho = '1': it must be a real number",
    ),
    (
        lambda ds: survey.evaluate("satellite", k=2 + 1j, rho=1.0),
        "k = (2+1j): it must be a real number",
    ),
    (
        lambda ds: survey.evaluate("satellite", k=[[0.1, 0.2]], rho=1.0),
        "an array of 2 dimensions needs names",
    ),
    (
        lambda ds: survey.evaluate("satellite", k=0.1, rho=1.0, body="ball"),
        "body: unknown value 'ball' (allowed: prolate",
    ),
    (
        lambda ds: survey.evaluate("satellite", amplitude=45, inertia_ratio=0.5),
        "give amplitude_deg = 45",
    ),
    (lambda ds: survey.evaluate("satellite", k=0.5, rho=1.0, tol=1e-8), "did you mean 'rtol'?"),
    (lambda ds: survey.evaluate("satellite", k=0.5, rho=1.0, rtol=0), "must lie between 0 and 1"),
    (
        lambda ds: survey.evaluate("satellite", k=0.5, rho=1.0, variables=["disc"]),
        "did you mean 'discriminant'?",
    ),
    (lambda ds: survey.evaluate("mathieu", a=1.0, q=None), "q = None: it must be a real number"),
    (
        lambda ds: survey.evaluate("mathieu", a=1.0, q=0.1, k=3),
        "unknown parameter of scene mathieu 'k' (allowed: a, q)",
    ),
    (lambda ds: survey.evaluate("mathieu", a=[], q=1.0), "an empty array has no points"),
    (
        lambda ds: survey.evaluate(
            "satellite", k=[0.0, 0.5, 0.9], rho=xr.DataArray([1.0, 2.0], dims="k")
        ),
        "align them",
    ),
    (lambda ds: survey.evaluate(ds), "this is a dataset, not a scene"),
    (lambda ds: survey.open(ds), "give the path of a netCDF file"),
    (lambda ds: survey.run({"scene": "mathieu"}), "axes is missing"),
    (lambda ds: survey.run(None), "neither the path of a workflow file nor a mapping"),
    (lambda ds: survey.run("good.toml", workers=0), "must be a positive integer"),
    (lambda ds: ds.survey.point(k=0.1), "rho is missing: a point needs"),
    (lambda ds: ds.survey.point(q=0.1, rho=1.0), "unknown axis 'q' (allowed: k, rho)"),
    (lambda ds: ds.survey.trajectory(k=5, rho=1.0), "lies outside the map"),
    (lambda ds: ds.survey.map("exponents"), "did you mean 'exponent'?"),
    (lambda ds: ds.survey.map(cmap="virids"), "did you mean 'viridis'?"),
    (lambda ds: ds.survey.map("exponent", cmap=3), "cmap = 3: give the name of a colour map"),
    (lambda ds: ds.survey.map("exponent", vmin="a"), "vmin = 'a': it must be a finite number"),
    (lambda ds: ds.survey.map("exponent", vmin=3, vmax=1), "vmin = 3 is not below vmax = 1"),
    (lambda ds: ds.survey.map("exponent", robust="x"), "robust = 'x': it must be True or False"),
    (lambda ds: ds.survey.map(vmin=3), "vmin does not apply to verdict, whose values are names"),
    (lambda ds: ensemble().survey.zoom(draw=(0, 10)), "zoom: draw only counts points, of k"),
    (lambda ds: survey.describe(xr.Dataset()), "describe: this dataset was not written by survey"),
    (
        lambda ds: survey.evaluate("mathieu", a=1.0, q=0.1, damping=0.1),
        "survey.hill(damping=...) solves damped equations",
    ),
    (
        lambda ds: survey.run({"scene": "mathieu", "axes": {"a": 1.0}, "output": {"file": "x.nc"}}),
        "unknown key output.file; did you mean 'path'?",
    ),
    (lambda ds: ds.survey.map(x="q"), "x: unknown axis 'q'"),
    (lambda ds: ds.survey.zoom(k=0.3), "give two numbers, the lower one first"),
    (lambda ds: ds.survey.where("stabel"), "did you mean 'stable'?"),
    (lambda ds: ds.survey.compare("other.nc"), "give the dataset of another survey"),
    (lambda ds: xr.Dataset().survey.map(), "this dataset was not written by survey"),
    (lambda ds: survey.concat([ds, ds]), "they have the same points"),
    (
        lambda ds: survey.hill("cos(t)", period=1.0, parameters="a"),
        "z must be a function of two arguments, z(u, p)",
    ),
    (
        lambda ds: survey.hill(z, period=-1, parameters="a"),
        "period = -1: it must be a positive number",
    ),
    (
        lambda ds: survey.edge("satellite", along="amplitud", inertia_ratio=0.2),
        "did you mean 'amplitude'?",
    ),
    (lambda ds: survey.evaluate("libration", body="Earth-Mon"), "did you mean 'Earth-Moon'?"),
    (lambda ds: survey.evaluate("libration", m1=1.0), "m2 is missing: give all of m1, m2"),
    (
        lambda ds: survey.evaluate("satellite", amplitude=0.5, A=-1.0, B=-1.0, C=-0.5),
        "A = -1.0: a moment of inertia",
    ),
    (
        lambda ds: survey.evaluate("satellite", amplitude=0.5, A=0.0, B=0.0, C=1.0),
        "none may exceed the sum",
    ),
    (
        lambda ds: survey.evaluate("satellite", amplitude=0.5, A=1.0, B=2.0, C=2.5),
        "must be equal and positive",
    ),
    (
        lambda ds: survey.evaluate("satellite", amplitude=0.5, A=1.0, B=1.0),
        "C is missing: give all of A, B, C",
    ),
    (
        lambda ds: survey.evaluate("satellite", k=True, rho=1.0),
        "k = True: it must be a real number",
    ),
    (
        lambda ds: survey.evaluate("satellite", k=0.5, rho=1.0, rtol="1e-8"),
        "rtol = '1e-8': it must lie between 0 and 1",
    ),
    (
        lambda ds: survey.evaluate("gyrostat", question="Abel", phi=1.0, w0=1.0),
        "did you mean 'abel'?",
    ),
    (lambda ds: survey.evaluate("libration", body="Earth-Moon", mu=0.01), "mu is given twice"),
    (lambda ds: survey.run("good.toml", output=3), "output = 3: give the path of a netCDF file"),
    (lambda ds: survey.run("good.toml", scheduler=3), "scheduler = 3: give an address"),
    (lambda ds: survey.open("good.toml"), "this is not a netCDF file of survey"),
    (lambda ds: survey.describe("satelite"), "did you mean 'satellite'?"),
    (lambda ds: survey.concat([ds]), "give two or more surveys, not 1"),
    (lambda ds: survey.concat(ds), "give a list of surveys"),
    (lambda ds: ds.survey.map(ax=3), "ax = 3: give the Axes of a matplotlib figure"),
    (lambda ds: ds.survey.map(x="k", y="k"), "x and y are both 'k'"),
    (lambda ds: ds.survey.margin(k=0.1), "rho is missing: a point needs"),
    (lambda ds: ds.survey.margin(k=5, rho=1.0), "lies outside the map"),
    (
        lambda ds: survey.edge("satellite", along="amplitude", amplitude=1.0, inertia_ratio=0.2),
        "give a range (low, high)",
    ),
    (
        lambda ds: survey.edge("satellite", along="amplitude", inertia_ratio="thin"),
        "it must be one number in its domain or an array of them",
    ),
    (
        lambda ds: survey.edge("satellite", along="rho", k=["thin", "thick"], rho=(1, 2)),
        "it must be a real number or an array of real numbers",
    ),
    (
        lambda ds: survey.edge("brun", along="ratio", l=0.5, alpha=0.1, beta=0.2, sign="1"),
        "no boundaries are known along ratio",
    ),
    (
        lambda ds: survey.hill(z, period=1.0, parameters=("a", "a")),
        "give at least one name, each once",
    ),
    (
        lambda ds: survey.hill(z, period=1.0, parameters="a", even="yes"),
        "even = 'yes': it must be True or False",
    ),
    (
        lambda ds: survey.hill(z, period=1.0, parameters="a", damping=np.nan),
        "damping = nan: it must be a finite number",
    ),
    (
        lambda ds: survey.hill(z, period=1.0, parameters="a", breaks=(9.0,)),
        "breaks: 9 lies outside",
    ),
    (
        lambda ds: survey.floquet(fill, period=0, parameters="a", states=("x", "y")),
        "period = 0: it must be a positive number",
    ),
    (
        lambda ds: survey.floquet(fill, period=1, parameters="a", states=()),
        "give the names of the states",
    ),
    (
        lambda ds: survey.floquet(
            fill, period=1, parameters="a", states=("x", "y"), structure="even"
        ),
        "must be one of 'none'",
    ),
    (
        lambda ds: survey.floquet(period=1, parameters="a", states=("x", "y")),
        "give either A(t, p, out), or K(t, p, out)",
    ),
    (
        lambda ds: survey.abel(z, "g", parameters="a"),
        "g must be a function of two arguments, g(phi, p)",
    ),
]


def K(t, p, out):
    out[0, 0] = p[0] + p[1] * np.cos(2 * t)


def rebound(t, p, out):
    out = np.eye(2)  # noqa: F841


def reordered(p, t, out):
    out[0, 1], out[1, 0] = 1.0, -p[0]


def attribute(t, p, out):
    out[0, 1], out[1, 0] = 1.0, -p.a


def imaginary(t, p, out):
    out[0, 0] = 1j * p[0]


def driven(t, x, p, out):
    out[0], out[1] = x[1], p[0] * np.cos(t) - 0.1 * x[1] - x[0] - x[0] ** 3


def half_filled(t, x, p, out):
    out[0] = x[1]


def whole_state(t, x, p, out):
    out[0], out[1] = x[1], -x


def named_state(t, x, p, out):
    out[0], out[1] = x["v"], -x["x"]


def floquet(A=fill, **given):
    return survey.floquet(
        A, **({"period": np.pi, "parameters": ("a", "e"), "states": ("x", "v")} | given)
    )


def orbit(f=driven, **given):
    known = {"period": 2 * np.pi, "parameters": "F", "states": ("x", "v"), "start": (0.0, 0.0)}
    return survey.orbit(f, **(known | given))


def at(scene, **parameters):
    return survey.evaluate(scene, **parameters)


OWN = [
    (
        lambda: at(floquet(rebound), a=1.0, e=0.1),
        "A(t, p, out) leaves out all 0; fill its entries: out[0, 0] = ...",
    ),
    (
        lambda: at(floquet(None, K=K, C=rebound, states="x"), a=1.0, e=0.1),
        "C(t, p, out) leaves out all 0",
    ),
    (
        lambda: at(floquet(states=("x", "v", "w")), a=1.0, e=0.1),
        "states names w, but its row and column of A are all 0",
    ),
    (
        lambda: at(floquet(None, K=K), a=1.0, e=0.1),
        "leave it out of states, to which velocities are added",
    ),
    (lambda: floquet(reordered), "its arguments come in the order A(t, p, out)"),
    (lambda: survey.hill(lambda p, u: p[0], period=1.0, parameters="a"), "in the order z(u, p)"),
    (lambda: survey.abel(lambda p, phi: -p[0], z, parameters="a"), "in the order f(phi, p)"),
    (lambda: at(floquet(attribute), a=1.0, e=0.1), "p is an array; write p[0], p[1]"),
    (
        lambda: at(floquet(imaginary), a=1.0, e=0.1),
        "fills in a complex number; write real and imaginary parts",
    ),
    (
        lambda: floquet(period=lambda a, e: 1.0),
        "period must be a function of one argument, the array p",
    ),
    (lambda: floquet(breaks=90), "breaks: 90 lies outside 0 <= t <= T = 3.14159"),
    (
        lambda: floquet(conserved="x"),
        "conserved = 'x': there are 2 states, and each needs a number",
    ),
    (lambda: floquet(parameters="a, e"), "write ('a', 'e')"),
    (lambda: floquet(parameters=("a", "exponent")), "rename 'exponent', which is taken"),
    (lambda: floquet(states="x v"), "write ('x', 'v')"),
    (
        lambda: at(floquet(None, K=K, M=rebound, states="x"), a=1.0, e=0.1),
        "M(t, p, out) leaves out all 0",
    ),
    (
        lambda: at(orbit(half_filled), F=0.3),
        "leaves out[1] 0: v never changes; fill out[1] = dv/dt",
    ),
    (
        lambda: at(orbit(whole_state), F=0.3),
        "f(t, x, p, out) fills in an entry that is not a number",
    ),
    (lambda: at(orbit(named_state), F=0.3), "x and p hold numbers; write x[0], ..., p[0]"),
    (
        lambda: at(orbit(period=None, start=(1.0, 0.0, 6.0)), F=0.3),
        "depends on t, so period must be given; give the period of f in t",
    ),
    (
        lambda: orbit(period=None, start=(1.0, 0.0, -6.0)),
        "start ends in -6, the guess of the period",
    ),
    (lambda: orbit(start=lambda: (0.0, 0.0)), "start must be a function of one argument"),
    (
        lambda: at(orbit(start=lambda p: (0.0,)), F=0.3),
        "start(p) returns (1,) numbers, not 2: the states; correct it",
    ),
    (lambda: orbit(continuation=("G", 0, 1)), "give (name, least, greatest value) of one of F"),
    (lambda: at(orbit(continuation=("F", 0, 1)), F=0.3, branch=1.5), "branch != 0, a whole number"),
    (
        lambda: at(orbit(), F=0.3, question="fate"),
        "question: unknown parameter of scene orbit(driven) 'question'",
    ),
    (lambda: at(fill, a=1.0), "is a function; give survey.floquet(fill, period=...)"),
    (lambda: at(driven, F=1.0), "is a function; give survey.orbit(driven, period=...)"),
]


@pytest.mark.parametrize(("mistake", "words"), OWN)
def test_an_own_system_that_is_wrong_answers_in_one_line(mistake, words):
    with pytest.raises(survey.BadInput) as refused:
        mistake()
    said = str(refused.value)
    assert words in said and "\n" not in said and len(said) < 500, said


def test_a_system_that_may_stay_as_it_is():
    """No damping, a stiffness that is 0 at the point that is asked, and an equation that returns
    its array.
    """
    undamped = floquet(None, K=K, C=lambda t, p, out: None, states="x")
    assert at(undamped, a=0.0, e=0.0).status == 0
    returned = floquet(lambda t, p, out: np.array([[-0.1 - p[0], 0.0], [0.0, -0.2 - p[1]]]))
    assert at(returned, a=0.0, e=0.0).verdict == 1


def test_why_nothing_is_stable_without_a_structure():
    point = at(floquet(None, K=K, states="x"), a=0.5, e=0.1)
    assert (
        point.verdict == 2  # marginal
        and "their product is 1: state the structure if" in point.survey.point().why
    )
    damped = at(floquet(None, K=K, C=lambda t, p, out: out.fill(0.1), states="x"), a=0.5, e=0.1)
    assert damped.verdict == 1 and "product" not in damped.survey.point().why


@pytest.fixture(scope="module")
def damped():
    scene = survey.floquet(
        K=K, C=lambda t, p, out: out.fill(0.1), period=np.pi, parameters=("a", "e"), states="x"
    )  # fmt: skip
    return survey.evaluate(scene, a=[0.5, 1.0, 1.5], e=[0.0, 1.0]), scene


def labelled(scene):
    cases = xr.DataArray([0.5, 1.0], dims="case", coords={"case": ["soft", "hard"]})
    return survey.evaluate(scene, a=cases, e=0.1)


DATASET = [
    (
        lambda ds, scene: labelled(scene).survey.zoom(case=("soft", "hard")),
        "case = ('soft', 'hard'): an axis of names, and nothing lies between them",
    ),
    (
        lambda ds, scene: ds.survey.zoom(a=(0.5, 1.0), num={"e": 3}),
        "num: unknown axis with a range 'e' (allowed: a)",
    ),
    (lambda ds, scene: ds.survey.zoom(a=(0.5, np.inf)), "a = (0.5, inf): give two numbers"),
    (
        lambda ds, scene: ds.survey.trajectory(a=1.0, e=0.0, figure=True),
        "figure = True: give a matplotlib Figure",
    ),
    (
        lambda ds, scene: ds.survey.trajectory(a=1.0, e=0.0, time=1e9),
        "periods is too long to be drawn; give at most",
    ),
    (
        lambda ds, scene: ds.isel(e=1).survey.point(a=1.0, e=0.5),
        "e is 1 at all points of this survey, so it is not an axis",
    ),
    (
        lambda ds, scene: ds.isel(e=1).survey.zoom(e=(0.5, 1.0)),
        "e is 1 at all points of this survey",
    ),
    (
        lambda ds, scene: survey.edge(scene, along=["a"], e=1.0, a=(0, 1)),
        "along = ['a']: give the name of one parameter",
    ),
    (
        lambda ds, scene: survey.edge(scene, along="a", e=1.0, a=(0, np.inf)),
        "a = (0, inf): boundaries are searched for along it, so",
    ),
    (
        lambda ds, scene: survey.edge(scene, along="a", e=1.0, a=(0, 1), rtol=1e-8),
        "rtol does not apply here: edges are",
    ),
    (
        lambda ds, scene: survey.edge(
            "satellite", along="amplitude", inertia_ratio=0.2, amplitude=(0, 90)
        ),
        "allowed: 0 <= amplitude < 1.5708 (rad)",
    ),
    (
        lambda ds, scene: survey.edge(
            "brun_triaxial", along="Omega", A=1.0, B=0.5, C=0.3, Omega=(0, 2)
        ),
        "edge: there is none at Omega = 1, A = 1, B = 0.5, C = 0.3, epsilon = 1: the parameters lie outside the domain",
    ),
]


@pytest.mark.parametrize(("mistake", "words"), DATASET)
def test_a_question_to_a_dataset_or_an_edge_that_is_wrong_answers_in_one_line(
    mistake, words, damped
):
    with pytest.raises(survey.BadInput) as refused:
        mistake(*damped)
    said = str(refused.value)
    assert words in said and "\n" not in said and len(said) < 500, said


def test_a_range_without_boundaries_has_none(damped):
    assert survey.edge(damped[1], along="a", a=(2.0, 3.0), e=0.0).place.size == 0
    assert (
        survey.edge(
            "brun_triaxial", along="Omega", A=1.0, B=0.8, C=0.7, Omega=(5.0, 6.0)
        ).place.size
        == 0
    )
    assert (
        survey.evaluate("satellite_triaxial", yaw_ratio=0.5, roll_ratio=0.4, amplitude=0.5).status
        == 1
    )


FILE = """from math import cos, pi
PARAMETERS = ("delta", "epsilon")
STATES = ("x",)
PERIOD = pi
def K(t, p, out):
    out[0, 0] = p[0] + p[1] * cos(2 * t)
"""
ORBIT = """from math import cos, pi
PARAMETERS = ("F",)
STATES = ("x", "v")
PERIOD = 2 * pi
START = (0.0, 0.0)
def f(t, x, p, out):
    out[0], out[1] = x[1], p[0] * cos(t) - 0.1 * x[1] - x[0]
"""
FILES = [
    (
        FILE.replace("def K", "def k"),
        "z is missing; write def z(u, p) for a Hill equation, or f(phi, p)",
    ),
    (
        FILE.replace("PERIOD = pi", ""),
        "PERIOD is missing; write PERIOD = 2 * pi (its length), or a function of p",
    ),
    (FILE.replace("PERIOD", "Period"), "unknown name Period; did you mean PERIOD?"),
    (FILE + 'STRUCTUR = "symplectic"\n', "unknown name STRUCTUR; did you mean STRUCTURE?"),
    (FILE + 'structure = "symplectic"\n', "unknown name structure; did you mean STRUCTURE?"),
    (FILE + "raise SystemExit(3)\n", "the scene file failed to run (SystemExit: 3)"),
    (FILE.replace("out[0, 0] =", "out ="), "K(t, p, out) leaves out all 0"),
    (ORBIT.replace('STATES = ("x", "v")', ""), 'STATES is missing; write STATES = ("x", "v")'),
    (ORBIT.replace("PERIOD = 2 * pi", ""), "or a function of p, or None if f does not depend on t"),
    (ORBIT + "def JACOBIAN(t, x, p, out): pass\n", "unknown name JACOBIAN; did you mean jacobian?"),
    (
        ORBIT.replace("(t, x, p, out)", "(phi, p)"),
        "f must be a function of four arguments, f(t, x, p, out)",
    ),
]


@pytest.mark.parametrize(("text", "words"), FILES)
def test_a_scene_file_that_is_wrong_answers_in_one_line(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my own.py").write_text(text)
    axes = {"F": 0.3} if "def f(" in text else {"delta": 1.0, "epsilon": 0.1}
    with pytest.raises(survey.BadInput) as refused:
        survey.run({"scene": "my own.py", "axes": axes}, output="map.nc")
    said = str(refused.value)
    assert (
        said.startswith("my own.py: ") and words in said and "\n" not in said and len(said) < 500
    ), said
    assert [path.name for path in tmp_path.iterdir()] == ["my own.py"]


def test_a_constant_of_a_scene_file_is_no_slip(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.py").write_text(FILE + "DAMPING, STATE, delta, HELD = 0.1, 1, 2, 3\n")
    assert at("own.py", delta=1.0, epsilon=0.1).status == 0
    with pytest.raises(
        survey.BadInput, match=r"unknown scene 'own'; did you mean the file 'own\.py'\?"
    ):
        at("own", delta=1.0, epsilon=0.1)


def test_a_model_that_is_missing_is_said_in_one_line(here):
    with pytest.raises(FileNotFoundError) as refused:
        survey.Model("nothing.model")
    assert (
        str(refused.value)
        == "nothing.model: there is no such file; name one that survey model has made"
    )


@pytest.mark.parametrize(("mistake", "words"), PYTHON)
def test_a_call_answers_in_one_line(mistake, words, here):
    with pytest.raises(survey.BadInput) as refused:
        mistake(survey.open("map.nc"))
    said = str(refused.value)
    assert words in said and "\n" not in said and len(said) < 500, said
