"""The family of Abel solutions: true to the equation solved by SciPy in time, and cut by
separatrices at saddles.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from snippets import ROOT

from survey import api
from survey.request import workflow
from survey.sweep import engine

SMALL = ("axes.w0.num=25", "axes.d.num=3", "axes.phi.num=33")
OK, TURNING = 0, 16


@pytest.fixture(scope="module")
def family(tmp_path_factory):
    """A small copy of the survey, with its pictures."""
    folder = tmp_path_factory.mktemp("abel")
    checked = workflow.read(
        ROOT / "workflows/gyrostat_abel.toml", list(SMALL), folder / "gyrostat_abel.nc"
    )
    engine.run(checked)
    ds = api.open(checked.path)
    return ds, api.draw(ds, checked)


def g(phi, row):
    quadratic = -row.d * np.cos(phi) * np.sin(phi) - row.c23 * np.cos(2 * phi)
    return float(quadratic + row.s2 * np.cos(phi) - row.s3 * np.sin(phi))


def motion(row, until):
    """(times, angles, velocities) at which the motion passes phi = until or w = 0, whichever is first."""

    def slope(_, state):
        return [
            state[1],
            float(row.b12 * np.cos(state[0]) - row.b31 * np.sin(state[0])) * state[1]
            + g(state[0], row),
        ]

    def reaches(_, state):
        return state[0] - until

    def turns(_, state):
        return state[1]

    reaches.terminal = turns.terminal = True
    start = [float(row.phi0), float(row.w0)]
    span = (0.0, np.copysign(60.0, (until - start[0]) * start[1]))
    solved = solve_ivp(
        slope, span, start, "DOP853", events=(reaches, turns), rtol=1e-12, atol=1e-13
    )
    return solved.t[-1], *solved.y[:, -1]


def test_the_survey_has_its_three_pictures(family):
    _, paths = family
    assert [path.name for path in paths] == [
        f"gyrostat_abel{part}.png" for part in ("", "_t", "_phi_turning")
    ]
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in paths)


@pytest.mark.slow
@pytest.mark.parametrize("end", [0, -1])
def test_solutions_and_turning_points_are_those_of_the_motion_in_time(family, end):
    ds, _ = family
    for i, j in ((2, 0), (7, 1), (10, 0), (15, 1), (18, 0), (21, 2), (24, 1)):
        row = ds.isel(w0=i, d=j, phi=end)
        time, angle, velocity = motion(row, float(row.phi))
        names = ("t", "w") if int(row.status) == OK else ("t_turning", "phi_turning")
        expected = (time, velocity if int(row.status) == OK else angle)
        assert int(row.status) in (OK, TURNING)
        for name, value in zip(names, expected, strict=True):
            assert float(row[name]) == pytest.approx(
                value, abs=1e-9 + float(row[f"{name}_error"])
            ), (i, j, name)


def test_the_turning_point_jumps_over_a_saddle(family):
    ds, _ = family
    row = ds.isel(d=0, phi=-1)
    upwards = row.where((row.w0 > 0) & (row.status == TURNING), drop=True)
    points = upwards.phi_turning.values
    assert (np.diff(points) > 0).all()
    i = np.argmax(np.diff(points))
    values = np.array([g(phi, row) for phi in np.linspace(points[i], points[i + 1], 200)])
    assert np.diff(points)[i] > 1.0
    assert ((values[:-1] < 0) & (values[1:] >= 0)).sum() == 1  # g rises through 0: a saddle
