"""Blocks in memory: filled by the scene itself where it can, with the bits of a survey that is kept."""

import numpy as np
import pytest
import xarray as xr

import survey
from survey.sweep import solve

OWN = """
TITLE = "An equation of one's own."
PARAMETERS = {"a": dict(low=-20, high=20), "q": dict(low=-20, high=20)}
PERIOD = 3.141592653589793
EVEN = True
def z(t, p):
    return p[0] - 2 * p[1] * np.cos(2 * t) + 0.01 * p[1] ** 2
"""


def kept(scene, request, grid, block, out):
    """Solved as for a file, where arrays are made anew."""
    for name, values in found(scene, request, grid, block).items():
        out[name][...] = values


found = solve.solve_block


def column(low, high, size, seed):
    return xr.DataArray(np.random.default_rng(seed).uniform(low, high, size), dims="point")


K, RHO = np.linspace(0.0, 0.99, 90), np.linspace(-0.5, 4.0, 331)
SCATTERED = {"k": column(0.01, 0.99, 9000, 1), "rho": column(0.6, 4.0, 9000, 2)}
MAP = {"q": np.linspace(-6.0, 6.0, 121), "a": np.linspace(-3.0, 12.0, 200)}
TURNED = {"a": MAP["a"], "q": MAP["q"]}  # rows are no rows of the map


@pytest.mark.parametrize(
    ("scene", "given", "variables"),
    [
        ("satellite", {"k": K, "rho": RHO}, None),
        ("satellite", {"k": K, "rho": RHO}, ("discriminant", "verdict")),
        ("satellite", {"k": K, "rho": RHO}, ("verdict",)),
        ("satellite", {"k": K, "rho": RHO}, ("exponent", "exponent_per_orbit")),
        ("satellite", {"k": K[5:], "rho": RHO}, ("discriminant", "twist")),
        ("satellite", {"rho": RHO, "k": K}, ("y1", "rotation_number", "verdict")),
        ("satellite", {"k": 0.5, "rho": RHO}, None),
        ("satellite", {"k": 0.5, "rho": 1.3}, None),
        ("satellite", {"k": K, "inertia_ratio": np.linspace(0.3, 1.7, 120)}, None),
        ("satellite", SCATTERED, None),
        ("satellite", SCATTERED, ("discriminant", "verdict")),
        ("mathieu", MAP, None),
        ("mathieu", MAP, ("discriminant",)),
        ("mathieu", MAP, ("exponent", "discriminant")),
        ("mathieu", TURNED, None),
        ("own", MAP, None),
        ("own", MAP, ("discriminant", "verdict")),
        ("own", TURNED, ("discriminant", "verdict")),
    ],
)
@pytest.mark.parametrize("rtol", [1e-10, 1e-13])
def test_the_bits_are_those_of_a_survey_that_is_kept(
    scene, given, variables, rtol, monkeypatch, tmp_path
):
    if scene == "own":
        scene = tmp_path / "own.py"
        scene.write_text("import numpy as np\n" + OWN)
    one = survey.evaluate(scene, **given, variables=variables, rtol=rtol)
    monkeypatch.setattr(solve, "solve_block", kept)
    other = survey.evaluate(scene, **given, variables=variables, rtol=rtol)
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)
        assert one[name].dtype == other[name].dtype
    assert (
        one.attrs["verdict_counts" if "verdict" in one else "status_counts"]
        == other.attrs["verdict_counts" if "verdict" in one else "status_counts"]
    )


def test_no_bar_is_infinite(monkeypatch):
    """|D| is 1e51: bars of its series are beyond the range of float32, those of some points too."""
    given = {"q": np.linspace(-3.0, 3.0, 60), "a": np.linspace(-1440.0, -1410.0, 100)}
    for _ in range(2):
        ds = survey.evaluate("mathieu", **given, variables=("discriminant", "verdict"))
        known = (ds.status == 0).values
        assert ds.attrs["status_counts"] == f"ok: {known.sum()}, overflow: {(~known).sum()}"
        assert 0 < known.sum() < known.size
        assert np.isfinite(ds.discriminant_error.values[known]).all()
        assert np.isnan(ds.discriminant_error.values[~known]).all()
        monkeypatch.setattr(solve, "solve_block", kept)


def test_bars_that_are_the_same_along_an_axis_are_rounded_once():
    column = np.array([[1.0 + 2**-40], [2.0], [np.nan]])
    out = np.empty((3, 4), np.float32)
    assert not solve._round_up(np.broadcast_to(column, (3, 4)), out)
    np.testing.assert_array_equal(
        out, np.tile([[np.nextafter(np.float32(1), 2)], [2.0], [np.nan]], 4)
    )
    assert solve._round_up(np.array([[1.0, 1e300]]), np.empty((1, 2), np.float32))
    across = np.empty((4, 3), np.float32).T  # not in C's order
    assert not solve._round_up(np.full((3, 4), 0.1), across)
    assert (across.astype(float) >= 0.1).all() and (across < 0.10000001).all()
