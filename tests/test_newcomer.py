"""Mistakes that a newcomer types, at the command line and in Python: one clear line each, which says what to do."""

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
    ("run map.nc", "cannot read this workflow file"),
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
    ("merge map.nc map.nc -o both.nc", "they are of the same points"),
    ("prove good.toml", "add [refine] with a width"),
    ("precision xyz", "xyz"),
    ("share map.nc -o map.nc", "this file ends in .html or .htm; name one, such as 'map.html'"),
    ("share map.nc -o map.png", "name one, such as 'map.html'"),
    ("share map.nc -o folder.html", "is a folder; name a file, with -o"),
    ("share map.nc --at r=1", "unknown axis 'r'"),
    ("model good.toml -o map.nc", "this file ends in .model; name one, such as 'map.model'"),
    ("model good.toml --set axes.k=0.5", "1 of the workflow's parameters vary; a model needs two"),
    ("model good.toml --proof nothing.nc", "there is no such file"),
    ("bundle map.nc -o map.tar", "a bundle is a .zip file or a folder; name one, such as map.zip"),
    ("bundle map.nc -o b.zip --license MIT", "give the address of the licence"),
    ("bundle map.nc --licence MIT", "Did you mean '--license'?"),
    ("failures good.toml", "true values are known only of Hill equations"),
    ("failures mathieu --share 2", "give a number above 0 and up to 1"),
    ("init mathieu -o nowhere/x.toml", "there is no folder 'nowhere'; create it first"),
    ("init mathieu -o folder.html", "this file ends in .toml"),
]


@pytest.mark.parametrize(("line", "words"), SHELL)
def test_a_command_answers_in_one_line(line, words, here, capsys):
    before = sorted(path.name for path in here.iterdir())
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    said = capsys.readouterr().err
    assert ended.value.code == 2 and words in said and said.startswith("survey: ") and said.count("\n") == 1, said
    assert sorted(path.name for path in here.iterdir()) == before


def z(u, p):
    return p[0] + np.cos(2 * u)


PYTHON = [
    (lambda ds: survey.evaluate("satelite", k=0.1, rho=1.0), "did you mean 'satellite'?"),
    (lambda ds: survey.evaluate("satellite", k=0.1), "rho is missing: satellite needs orbital rate"),
    (lambda ds: survey.evaluate("satellite", k=0.1, rho="1"), "rho = '1': it must be a real number"),
    (lambda ds: survey.evaluate("satellite", k=2 + 1j, rho=1.0), "k = (2+1j): it must be a real number"),
    (lambda ds: survey.evaluate("satellite", k=[[0.1, 0.2]], rho=1.0), "an array of 2 dimensions needs names"),
    (
        lambda ds: survey.evaluate("satellite", k=0.1, rho=1.0, body="ball"),
        "body: unknown value 'ball' (allowed: prolate",
    ),
    (lambda ds: survey.evaluate("satellite", amplitude=45, inertia_ratio=0.5), "give amplitude_deg = 45"),
    (lambda ds: survey.evaluate("satellite", k=0.5, rho=1.0, tol=1e-8), "did you mean 'rtol'?"),
    (lambda ds: survey.evaluate("satellite", k=0.5, rho=1.0, rtol=0), "must lie between 0 and 1"),
    (lambda ds: survey.evaluate("satellite", k=0.5, rho=1.0, variables=["disc"]), "did you mean 'discriminant'?"),
    (lambda ds: survey.evaluate("mathieu", a=1.0, q=None), "q = None: it must be a real number"),
    (
        lambda ds: survey.evaluate("mathieu", a=1.0, q=0.1, k=3),
        "unknown parameter of scene mathieu 'k' (allowed: a, q)",
    ),
    (lambda ds: survey.evaluate("mathieu", a=[], q=1.0), "an empty array has no points"),
    (lambda ds: survey.evaluate("satellite", k=[0.0, 0.5, 0.9], rho=xr.DataArray([1.0, 2.0], dims="k")), "align them"),
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
    (lambda ds: ds.survey.map(x="q"), "x: unknown axis 'q'"),
    (lambda ds: ds.survey.zoom(k=0.3), "give two numbers, the lower one first"),
    (lambda ds: ds.survey.where("stabel"), "did you mean 'stable'?"),
    (lambda ds: ds.survey.compare("other.nc"), "give the dataset of another survey"),
    (lambda ds: xr.Dataset().survey.map(), "this dataset was not written by survey"),
    (lambda ds: survey.concat([ds, ds]), "they are of the same points"),
    (lambda ds: survey.hill("cos(t)", period=1.0, parameters="a"), "z must be a function of two arguments, z(u, p)"),
    (lambda ds: survey.hill(z, period=-1, parameters="a"), "period = -1: it must be a positive number"),
    (lambda ds: survey.edge("satellite", along="amplitud", inertia_ratio=0.2), "did you mean 'amplitude'?"),
    (lambda ds: survey.evaluate("libration", body="Earth-Mon"), "did you mean 'Earth-Moon'?"),
    (lambda ds: survey.evaluate("libration", m1=1.0), "m2 is missing: give all of m1, m2"),
]


@pytest.mark.parametrize(("mistake", "words"), PYTHON)
def test_a_call_answers_in_one_line(mistake, words, here):
    with pytest.raises(survey.BadInput) as refused:
        mistake(survey.open("map.nc"))
    said = str(refused.value)
    assert words in said and "\n" not in said and len(said) < 500, said
