"""What every scene promises, checked for each one that is found in its folder, under every value of
its options.
"""

import itertools

import numpy as np
import pytest
import xarray as xr

import survey
import survey.scenes
from survey import modules, status
from survey.file.labels import error_bars
from survey.request.checks import methods_of
from survey.scene import exists
from survey.sweep import cost


def questions():
    """(scene's name, option values) for every scene and every combination of its options."""
    for name in modules.names(survey.scenes):
        scene = modules.load(survey.scenes, name, "scene")
        choices = [
            [(option.name, choice) for choice in option.choices]
            for option in scene.OPTIONS
            if not option.only_with
        ]
        also = [
            [*_needed(scene, o), (o.name, choice)]
            for o in scene.OPTIONS
            if _is_primary(scene, o.only_with)
            for choice in o.choices
        ]
        whens, seen = {option.name: option for option in scene.OPTIONS}, []
        for combination in map(dict, [*itertools.product(*choices), *also]):
            options = {
                key: value for key, value in combination.items() if exists(whens[key], combination)
            }
            if options not in seen:
                seen.append(options)
                yield pytest.param(scene, options, id="-".join([name, *options.values()]))


def _needed(scene, option):
    """Values of other options with which the parameter of the option exists."""
    when = next(p.when for p in scene.PARAMETERS if p.name == option.only_with)
    return [
        (name, allowed[0]) for name, allowed in when.items() if name != option.name and allowed[0]
    ]


def _is_primary(scene, name):
    """Is there a parameter of that name which replaces no other?"""
    return any(p.name == name and not p.instead_of for p in scene.PARAMETERS)


def draw(scene, options, seed):
    """Random parameters: two of them as axes of 4 and 3 values, the others fixed, all inside the domain."""
    random = np.random.default_rng(seed)
    used = [p for p in scene.PARAMETERS if exists(p, options) and not p.instead_of]
    axes = [p.name for p in used if p.default is None] + [
        p.name for p in reversed(used) if p.default is not None
    ]
    point = {}
    for p in used:
        size = {name: n for name, n in zip(axes, (4, 3), strict=False)}.get(p.name)
        point[p.name] = random.uniform(max(p.minimum, -2.0), min(p.maximum, 2.0), size)
    return point


def evaluate(scene, options, point, **more):
    name = scene.__name__.rpartition(".")[2]
    return survey.evaluate(name, **options, **point, **more).load()


def agree(one, other):
    """Names of the outputs whose difference exceeds the sum of the error bars, or whose verdicts
    contradict.
    """
    wrong = []
    for name in error_bars(one):
        off = np.abs(one[name] - other[name])
        if (off > one[f"{name}_error"].astype(float) + other[f"{name}_error"].astype(float)).any():
            wrong.append(name)
    if "verdict" in one:
        decided = (one.verdict != -1) & (other.verdict != -1)
        if (one.verdict != other.verdict).where(decided, False).any():
            wrong.append("verdict")
    return wrong


each = pytest.mark.parametrize(("scene", "options"), list(questions()))


def each_but(*slow):
    """As `each`; these questions, whose kernels or points take long, are slow."""
    marked = [
        pytest.param(*q.values, id=q.id, marks=pytest.mark.slow) if q.id in slow else q
        for q in questions()
    ]
    return pytest.mark.parametrize(("scene", "options"), marked)


seeds = pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))]
)


@each
def test_a_scene_describes_itself(scene, options):
    assert (
        scene.TITLE
        and scene.REFERENCES
        and scene.FAMILY
        and scene.cost(options, {p.name: 1 for p in scene.PARAMETERS}) > 0
    )
    names = [p.name for p in scene.PARAMETERS]
    assert len(set(names)) == len(names) and all(p.long_name and p.symbol for p in scene.PARAMETERS)
    flags = {
        name
        for o in scene.OUTPUTS
        if o.name == "verdict" and exists(o, options)
        for name in o.flags
    }
    assert not flags & set(status.table(scene)), "counts and legends could not tell the two apart"
    for parameter in scene.PARAMETERS:
        assert parameter.name in scene.__doc__, f"the docstring does not tell of {parameter.name}"
        assert parameter.instead_of in (None, *names)
        assert parameter.default is None or parameter.holds(parameter.default)
    assert len(methods_of(scene, options)) >= 3


def extremes(scene, options, seed, points=60):
    """Random points of the ends of the domain, zeros, and numbers that are tiny or huge."""
    random, point = np.random.default_rng(seed), {}
    for p in scene.PARAMETERS:
        if exists(p, options) and not p.instead_of:
            values = np.array(
                [
                    p.minimum,
                    p.maximum,
                    -0.0,
                    5e-324,
                    1e-300,
                    -1e-200,
                    1e-17,
                    -1e-8,
                    0.5,
                    1.0,
                    -1.0,
                    3e4,
                ]
            )
            point[p.name] = xr.DataArray(
                random.choice(values[p.holds(values)], points), dims="point"
            )
    return point


@pytest.mark.parametrize("name", modules.names(survey.scenes))
def test_what_is_said_of_a_method_is_a_whole_sentence(name):
    for method, words in survey.describe(name)["methods"].items():
        assert method == "auto" or words.endswith(".") or "; only when " in words, words


@each_but("brun", "gyrostat-fate", "gyrostat_integrable-elliptic")
@seeds
def test_every_point_has_outputs_bars_and_a_status(scene, options, seed):
    has_outputs_bars_and_a_status(evaluate(scene, options, draw(scene, options, seed)))


def at_the_ends():
    """The questions whose domains have ends that are solved in seconds; three unequal moments are slow."""
    for q in questions():
        if "gyrostat" not in q.id and q.id != "brun_triaxial-trajectory":
            slow = [pytest.mark.slow] * q.id.startswith(("satellite_triaxial", "satellite-oblate"))
            yield pytest.param(*q.values, id=q.id, marks=slow)


@pytest.mark.parametrize(("scene", "options"), [*at_the_ends()])
def test_so_has_each_at_the_ends_of_the_domain(scene, options):
    """Those of the gyrostat and of `brun_triaxial` by time, which take seconds a point there, stand
    in their files.
    """
    points = 10 if scene.FAMILY == "floquet" else 60  # a point of these is a system of its own
    has_outputs_bars_and_a_status(evaluate(scene, options, extremes(scene, options, 1, points)))


def has_outputs_bars_and_a_status(ds):
    assert set(np.unique(ds.status)) <= set(ds.status.attrs["flag_values"])
    for name in error_bars(ds):
        value, bar = ds[name], ds[f"{name}_error"]
        assert (np.isfinite(value) == np.isfinite(bar)).all(), name
        assert not (bar < 0).any() and not np.isinf(value).any(), name
    if "verdict" in ds:
        assert set(np.unique(ds.verdict)) <= set(ds.verdict.attrs["flag_values"])
        assert (ds.verdict.where(ds.status != status.OK, -1) == -1).all()


@each
@seeds
def test_bits_do_not_depend_on_the_block(scene, options, seed, monkeypatch):
    point = draw(scene, options, seed)
    whole = evaluate(scene, options, point)
    monkeypatch.setattr(cost, "BLOCK_POINTS", 1)
    monkeypatch.setattr(cost, "IN_MEMORY", 1)
    xr.testing.assert_identical(whole.drop_attrs(), evaluate(scene, options, point).drop_attrs())


@each
def test_scattered_points_have_the_same_bits_as_a_grid(scene, options):
    point = draw(scene, options, 4)
    grid = evaluate(scene, options, point)
    axes = [name for name in point if np.ndim(point[name])]
    flat = grid.stack(point=grid.status.dims).reset_index("point").transpose("point", ...)
    given = point | {name: flat[name].drop_attrs().reset_coords(drop=True) for name in axes}
    scattered = evaluate(scene, options, given)
    for name in scattered.data_vars:
        np.testing.assert_array_equal(scattered[name].values, flat[name].values, err_msg=name)


@each
def test_one_bad_point_costs_one_point(scene, options):
    point = draw(scene, options, 5)
    axis = next(name for name in point if np.ndim(point[name]))
    spoiled = point | {axis: np.append(point[axis], np.nan)}
    good, bad = evaluate(scene, options, point), evaluate(scene, options, spoiled)
    last = bad.isel({axis: -1})
    assert (last.status == status.INVALID_PARAMETERS).all()
    assert all(last[name].isnull().all() for name in error_bars(bad))
    for name in good.data_vars:
        np.testing.assert_array_equal(
            good[name].values, bad.isel({axis: slice(0, -1)})[name].values
        )


@each_but("gyrostat-fate", "gyrostat-portrait", "brun_triaxial-trajectory")
@seeds
def test_the_methods_check_one_another(scene, options, seed):
    point = draw(scene, options, seed)
    if scene.cost(options, {name: np.size(values) for name, values in point.items()}) > 1e-3:
        # the slowest methods take seconds
        point = {name: np.ravel(values)[0] for name, values in point.items()}
    auto = evaluate(scene, options, point, rtol=1e-9)
    for method in methods_of(scene, options):
        assert agree(auto, evaluate(scene, options, point, rtol=1e-6, method=method)) == [], method


def test_the_agreement_check_can_fail():
    point = {"k": np.array([0.3, 0.6]), "rho": np.array([0.7, 1.0])}
    one = survey.evaluate("satellite", **point)
    other = one.copy(deep=True)
    other["y1"] += 1e-9
    other["verdict"][0, 0] = 1 - other.verdict[0, 0]
    assert agree(one, one) == [] and agree(one, other) == ["y1", "verdict"]
