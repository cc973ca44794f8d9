"""survey.evaluate follows xarray's broadcasting and gives the command's bits."""

import dask.array as da
import numpy as np
import pytest
import xarray as xr

import survey
from survey.file import labels

SYSTEM = {
    "question": "trajectory",
    "b12": 0.7,
    "b31": -0.4,
    "d": 1.1,
    "s2": 0.5,
    "phi0": 1.5,
    "rtol": 1e-9,
}
W0, T = np.linspace(0.5, 2.0, 6), np.linspace(0.0, 3.0, 4)


def evaluate(**given):
    return survey.evaluate("gyrostat", **(SYSTEM | given))


def test_arrays_become_dimensions_and_equal_the_command(surveyed):
    ds, file = evaluate(w0=W0, t=T), survey.open(surveyed)
    assert ds.w.dims == ("w0", "t")
    for name in file.data_vars:
        xr.testing.assert_equal(ds[name].drop_attrs(), file[name].drop_attrs())


def test_numbers_become_scalar_coordinates(surveyed):
    ds = evaluate(w0=W0[2], t=T[3])
    assert ds.w.ndim == 0 and float(ds.w0) == W0[2] and float(ds.c23) == 0
    assert float(ds.w) == float(survey.open(surveyed).w[2, 3])


def test_arrays_that_share_a_dimension_go_point_by_point(surveyed):
    w0 = xr.DataArray(W0[:4], dims="point", coords={"point": list("abcd")})
    ds = evaluate(w0=w0, t=xr.DataArray(T, dims="point"))
    assert ds.w.dims == ("point",) and list(ds.point.values) == list("abcd")
    np.testing.assert_array_equal(ds.w, np.diag(survey.open(surveyed).w[:4]))


def test_dask_input_stays_lazy_and_gives_the_same_bits(surveyed):
    w0 = xr.DataArray(da.from_array(W0, chunks=2), dims="w0")
    ds = evaluate(w0=w0, t=T)
    assert ds.w.chunks
    file = survey.open(surveyed)
    for name in file.data_vars:
        np.testing.assert_array_equal(ds[name].compute(), file[name])


def test_variables_are_chosen():
    ds = evaluate(w0=W0, t=T, variables=["w"])
    assert set(ds.data_vars) == {"w", "w_error", "status"}


def test_integers_and_lists_are_taken():
    assert evaluate(w0=[1, 2], t=1).w.sizes == {"w0": 2}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"w0": np.nan}, "w0 = nan is outside"),
        ({"w0": "fast"}, "w0 .*real number"),
        ({"w0": np.ones((2, 2))}, "w0: .*DataArray"),
        ({"w0": []}, "w0: an empty array"),
        ({"w1": 1.0}, "'w1'; did you mean 'w0'"),
        ({"question": "fates"}, "'fates'; did you mean 'fate'"),
        ({"method": "tailor"}, "'tailor'; did you mean 'taylor"),
        ({"variables": ["phy"]}, "'phy'; did you mean 'phi'"),
        ({"rtol": 0.0}, "rtol = 0.0"),
        ({"variables": 3}, "unknown variable 3"),
        ({"w0": 10**400}, "w0 = 1000.*real number"),
        ({"w0": (x for x in (1.0, 2.0))}, "w0 = .*real number"),
        ({"w0": [[1.0], [2.0, 3.0]]}, "w0 = .*real number"),
        ({"w0": xr.DataArray(W0, dims="b12")}, "dimension 'b12' clashes with a parameter"),
    ],
)
def test_bad_input_is_refused_in_one_line(given, words):
    with pytest.raises(survey.BadInput, match=words) as refusal:
        evaluate(**({"w0": 1.0, "t": 1.0} | given))
    assert "\n" not in str(refusal.value)


def test_what_is_masked_costs_itself_alone_and_numbers_of_numpy_are_numbers():
    ds = evaluate(w0=np.ma.array([1.0, 2.0], mask=[False, True]), t=1.0, rtol=np.float32(1e-6))
    assert ds.status.values.tolist() == [0, 1]


@pytest.mark.parametrize("workers", [0, -1, "two"])
def test_a_number_of_workers_that_is_none_is_refused(workers, tmp_path):
    with pytest.raises(survey.BadInput, match="workers = "):
        survey.run(
            {"scene": "libration", "axes": {"mu": 0.01}},
            output=tmp_path / "map.nc",
            workers=workers,
        )


def test_a_missing_parameter_and_unequal_dimensions_are_named():
    with pytest.raises(ValueError, match="t is missing"):
        evaluate(w0=1.0)
    with pytest.raises(ValueError, match="dimension 'point'"):
        evaluate(w0=xr.DataArray(W0, dims="point"), t=xr.DataArray(T, dims="point"))
    with pytest.raises(ValueError, match="'gyrostatt'; did you mean 'gyrostat'"):
        survey.evaluate("gyrostatt", t=1.0)


def test_a_point_outside_the_domain_costs_itself_alone():
    good, mixed = evaluate(w0=[1.0, 2.0], t=1.0), evaluate(w0=[1.0, np.nan, 2.0], t=1.0)
    assert mixed.status.values.tolist() == [0, 1, 0]
    assert np.isnan(mixed.w[1])
    np.testing.assert_array_equal(mixed.w[[0, 2]], good.w)


@pytest.mark.parametrize(
    ("scene", "given"),
    [
        ("satellite", {"k": 0.3, "rho": 1.5}),
        # counts, cycles
        ("gyrostat", {"question": "portrait", "b12": 0.1, "b31": 0.2, "d": 0.3, "s2": 0.1}),
        ("gyrostat", SYSTEM | {"w0": 1.0, "t": 1.0}),
        ("libration", {"mu": 0.01}),
    ],
)
def test_a_lone_point_is_labelled_as_one_of_an_array_and_shares_nothing_with_the_next(scene, given):
    options = {key: value for key, value in given.items() if key in ("question", "rtol")}
    arrays = {
        key: xr.DataArray([value], dims="point")
        for key, value in given.items()
        if key not in options
    }
    wanted = survey.evaluate(scene, **arrays, **options).isel(point=0)
    for _ in range(2):
        ds = survey.evaluate(scene, **given)
        xr.testing.assert_identical(ds, wanted)
        for name, variable in ds.variables.items():
            assert (variable.encoding, variable.dtype) == (
                wanted[name].encoding,
                wanted[name].dtype,
            )
        ds.status.attrs["flag_values"][:] = 7
        ds.status.attrs["long_name"] = ds.attrs["title"] = "changed"
        ds.status.encoding["dtype"] = "int16"


@pytest.mark.parametrize("mu", [0.01, [0.01, 0.02]])
def test_what_a_caller_does_to_a_dataset_is_not_in_the_next(mu):
    def text(ds):
        return ds.to_dict(data="list", encoding=True)

    ds = survey.evaluate("libration", mu=mu)  # with coordinates of its own
    before = str(text(ds))
    for variable in ds.variables.values():
        variable.attrs["spoiled"] = variable.encoding["spoiled"] = 1
    ds.status.attrs["flag_values"][:] = 9
    ds.attrs["spoiled"] = 1
    ds.status.values[...] = 9
    ds.attrs.pop("title")
    assert str(text(survey.evaluate("libration", mu=mu))) == before


def test_a_lazy_survey_takes_no_memory_however_often_it_is_asked_for():
    times, starts = (
        xr.DataArray(da.linspace(0.1, 0.9, 200_000, chunks=50_000), dims=dim) for dim in ("t", "w0")
    )
    system = {"b12": 0.7, "b31": -0.4, "d": 1.1, "s2": 0.5}
    for _ in range(3):  # with an output that is an integer, NaN where it does not apply
        ds = survey.evaluate(
            "gyrostat", question="trajectory", phi0=0.0, w0=starts, t=times, **system
        )
        assert ds.turnings.shape == (200_000, 200_000)


@pytest.mark.parametrize("scene", ["libration", "satellite"])
def test_a_dataset_asked_for_again_is_like_the_first(scene):
    """Of other values, one of a kind that was made before is a copy without values, filled."""

    def ask(shift):
        if scene == "libration":
            return survey.evaluate("libration", mu=[0.01 + shift, 0.02, np.nan])
        k = xr.DataArray([0.1 + shift, 0.5], dims="point", coords={"point": ["a", "b"]})
        return survey.evaluate("satellite", k=k, rho=[1.0, 2.0 + shift, 3.0])

    labels._kept.cache_clear()
    first = ask(0.0)
    ask(0.1), ask(0.2)
    again = ask(0.0)
    xr.testing.assert_identical(again, first)
    for name, variable in first.variables.items():
        assert type(again.variables[name]) is type(variable)
        assert again.variables[name].encoding == variable.encoding
    assert [*again.xindexes] == [*first.xindexes]
    shared = [n for n in again.variables if np.shares_memory(again[n].values, ask(0.0)[n].values)]
    assert not shared
