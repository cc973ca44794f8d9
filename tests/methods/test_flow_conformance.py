"""What every method of steps for flows on the cylinder promises, for each one found in the folder."""

import inspect
import json
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest

from survey import methods, modules
from survey.kernels.cylinder import flow
from survey.kernels.math import runge_kutta
from survey.measures.cylinder import solution

FOUND = [modules.load(methods, name, "method") for name in modules.names(methods)]
FLOWS = [
    pytest.param(m, id=m.__name__.split(".")[-1])
    for m in FOUND
    if "cylinder" in m.SERVES and m.ORDER
]
STEPS = [m for m in FLOWS if hasattr(m.values[0], "flow_at")]  # those that step in (phi, w)
each, each_step = pytest.mark.parametrize("method", FLOWS), pytest.mark.parametrize("method", STEPS)
REFERENCE = json.loads((files("survey.reference") / "gyrostat.json").read_text())
SIX, START = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2), (1.5, 0.8)
TWELVE = "2.64039663976444473946427640236", "0.123820127598542062303541029890"  # A4, t = 12


def best_method():
    """The flow method of the highest order."""
    return max((m.values[0] for m in STEPS), key=lambda m: m.ORDER)


def test_there_is_a_choice():
    assert len(STEPS) >= 3


def widened(function, **names):
    """The same source in mpmath's arithmetic: binary64 leaves high orders no room between too
    coarse and rounding.
    """
    plain = getattr(function, "py_func", function)
    source = inspect.getsource(plain).replace("1.0 / (n + 1)", "mp.mpf(1) / (n + 1)")
    source = source.partition("\n")[2] if source.startswith("@") else source
    scope = {**plain.__globals__, "math": mp, "mp": mp, **names}
    exec(source, scope)
    return scope[function.__name__]


def wide_end(method, span, steps):
    """The state after equal steps of the widened method."""
    gyrostat = widened(flow.gyrostat)
    values = widened(flow.values, gyrostat=gyrostat)
    expansion = widened(flow._to_order, unroll=lambda expand: expand)
    orders = {"_to_full": expansion(flow.ORDER), "_to_low": expansion(flow.LOW)}
    series = widened(flow._series_of_gyrostat, **orders)
    inner = {"gyrostat": gyrostat, "values": values, "inside": widened(flow.inside)}
    if hasattr(method, "_flow_at"):
        inner["_flow_at"] = widened(method._flow_at)
    if hasattr(method, "_flow_classical"):
        slope = widened(method._flow_slope, values=values)
        step = widened(runge_kutta.classical)
        inner["_flow_classical"] = widened(
            method._flow_classical, classical=step, _flow_slope=slope
        )
    at, T = (
        widened(method.flow_at, **inner),
        np.full((flow.LAST + 1, flow.ROWS), mp.mpf(0), dtype=object),
    )
    p, (phi, w), h = (
        [mp.mpf(str(x)) for x in SIX],
        (mp.mpf("1.5"), mp.mpf("0.8")),
        mp.mpf(span) / steps,
    )
    for _ in range(steps):
        series(p, phi, w, T, flow.ORDER if method.ORDER > flow.LOW else flow.LOW)
        phi, w, _e, _y = at(p, T, h)
    return np.array([phi, w])


@each_step
def test_measured_order(method):
    """On a nonlinear orbit with turning points, by equal steps."""
    span, first, second = {4: (3, 40, 80), 8: (12, 128, 180), 20: (1, 50, 100)}[method.ORDER]
    with mp.workdps(60):
        end = (
            np.array([mp.mpf(x) for x in TWELVE])
            if span == 12
            else wide_end(best_method(), span, 200)
        )
        error = [mp.norm(list(wide_end(method, span, n) - end)) for n in (first, second)]
        order = mp.log(error[0] / error[1]) / mp.log(mp.mpf(second) / first)
    assert abs(order - method.ORDER) < 0.15


def marched(method, steps):
    """The state at t = 12 by equal steps in binary64, and the integrals of f and g."""
    p, T = flow.coefficients(*SIX), flow.table()
    state, total = np.array(START), np.zeros(2)
    h = 12.0 / steps
    for _ in range(steps):
        T[flow.LAST, :] = 0.0
        method.flow_begin(p, *state, 1e300 if method.ORDER != 4 else h, T)
        phi, w, e, y = method.flow_at(p, T, h)
        state, total = np.array([phi, w]), np.add(total, (e, y))
    return state, total


@each_step
def test_integral_of_g_is_the_change_of_w_minus_F(method):
    (phi, w), (_e, y) = marched(method, 2000)

    def F(phi):
        return SIX[0] * np.sin(phi) + SIX[1] * np.cos(phi)

    assert w - F(phi) == pytest.approx(START[1] - F(START[0]) + y, abs=1e-11)


@each
@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
def test_reference_trajectories_lie_within_their_bars(method, rtol):
    for group in ("abel_time", "elliptic", "multiple_root"):
        for case in REFERENCE[group]:
            if case.get("form", "time") != "time":
                continue
            row = np.array([[*map(float, case["p"]), float(case["phi0"]), float(case["w0"])]])
            floats, _n, status = solution.trajectories(
                method, row, np.array([[float(case["t"])]]), rtol
            )
            error = np.abs(floats[0, 0, :2] - [float(case["phi"]), float(case["w"])])
            assert status[0, 0] == 0
            assert (error <= floats[0, 0, 2:] + 1e-12 * (1 + np.abs(floats[0, 0, :2]))).all()
            assert (error <= rtol * (1 + np.abs(floats[0, 0, :2]))).all()


@each
def test_values_do_not_depend_on_the_other_times(method):
    row, times = np.array([[*SIX, *START]]), np.array([[5.0, -2.0, 0.0, 3.25, 7.5, -0.125]])
    together = solution.trajectories(method, row, times, 1e-9)
    for j in range(times.shape[1]):
        alone = solution.trajectories(method, row, times[:, j : j + 1], 1e-9)
        for one, all_of_them in zip(alone, together, strict=True):
            assert np.array_equal(one[:, 0], all_of_them[:, j])


@each
def test_methods_agree_within_their_bars(method):
    random = np.random.default_rng(8)
    rows = random.normal(size=(20, 8)) * [1, 1, 2, 2, 2, 2, 2, 3]
    times = np.tile([-2.0, 1.0, 5.0], (20, 1))
    mine, _n, ok = solution.trajectories(method, rows, times, 1e-8)
    best, _n, fine = solution.trajectories(best_method(), rows, times, 1e-13)
    both = (ok == 0) & (fine == 0)
    assert both.mean() > 0.9
    assert (np.abs(mine - best)[both][:, :2] <= mine[both][:, 2:] + best[both][:, 2:]).all()
