"""The truth of linear systems of one's own, against multipliers that are known exactly."""

import math

import mpmath
import numpy as np
import pytest
from floquet_truth import PERIOD, hard

import survey
from survey.precision.cases import own_file
from survey.truth import own_systems

FILE = """from math import cos, pi

from survey.scene import Parameter

PARAMETERS = (
    Parameter("delta", "stiffness", "d", minimum=0.1, maximum=2.0),
    Parameter("epsilon", "its modulation", "e", minimum=0.1, maximum=1.0),
)
STATES = ("x", "v")
PERIOD = 2 * pi


def A(t, p, out):
    out[0, 1] = 1.0
    out[1, 0] = -p[0] - p[1] * cos(t)
    out[1, 1] = -0.2
"""


def turning(n):
    """The system of `floquet_truth.rotating`, without numpy, whose matrices mpmath's numbers do not fill."""

    def A(t, p, out):
        c, s = math.cos(t), math.sin(t)
        R = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
        for i in range(n):
            for j in range(n):
                total = 0.0
                for k in range(n):
                    for m in range(n):
                        total = total + R[i][k] * p[n * k + m] * R[j][m]
                out[i, j] = total
        out[0, 1] = out[0, 1] - 1.0
        out[1, 0] = out[1, 0] + 1.0

    names = [f"b{k}" for k in range(n * n)]
    return survey.floquet(A, period=PERIOD, parameters=names, states=[f"x{k}" for k in range(n)])


@pytest.mark.parametrize("n", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_radii_of_turning_systems(n):
    """Simple, defective and non-normal matrices: within the doubt, which is small where they are simple."""
    B = hard(n, 5, 7)
    given = {f"b{k}": B.reshape(len(B), -1)[:, k] for k in range(n * n)}
    value, low, doubt = own_systems.own(turning(n))(given, {"status": np.zeros(len(B))})[
        "spectral_radius"
    ]
    with mpmath.workdps(60):
        for i, matrix in enumerate(B):
            T, R = (
                mpmath.mpf(PERIOD),
                mpmath.eye(n),
            )  # which is not 2 pi: R has not quite turned once
            R[0, 0] = R[1, 1] = mpmath.cos(T)
            R[0, 1], R[1, 0] = -mpmath.sin(T), mpmath.sin(T)
            flow = R * mpmath.expm(T * mpmath.matrix(matrix.tolist()))
            exact = max(abs(x) for x in mpmath.eig(flow, left=False, right=False))
            off = abs(mpmath.mpf(value[i]) + mpmath.mpf(low[i]) - exact)
            assert off <= doubt[i] + 1e-30 * exact
    assert np.median(doubt) < 1e-18


def test_matrices_of_second_order_with_a_break():
    """Constant M, C, K on either side of a break: exponentials."""

    def M(t, p, out):
        out[0, 0], out[1, 1], out[0, 1], out[1, 0] = 2.0, 1.0, 0.3, 0.3

    def C(t, p, out):
        out[0, 0], out[1, 1] = 0.1, 0.2

    def K(t, p, out):
        out[0, 0], out[1, 1], out[0, 1], out[1, 0] = 1.0, p[0] if t < 0.4 else 3.0, -0.5, -0.5

    scene = survey.floquet(
        M=M, C=C, K=K, period=1.0, breaks=0.4, parameters=("k",), states=("x", "y")
    )
    value, low, doubt = own_systems.own(scene)({"k": np.array([1.7])}, {"status": np.zeros(1)})[
        "spectral_radius"
    ]
    with mpmath.workdps(40):
        mass = mpmath.matrix([[2.0, 0.3], [0.3, 1.0]])
        flow = mpmath.eye(4)
        for k, length in ((1.7, mpmath.mpf(0.4)), (3.0, 1 - mpmath.mpf(0.4))):
            A = mpmath.zeros(4)
            A[0, 2] = A[1, 3] = 1
            A[2:4, 0:2] = -(mpmath.inverse(mass) * mpmath.matrix([[1.0, -0.5], [-0.5, k]]))
            A[2:4, 2:4] = -(mpmath.inverse(mass) * mpmath.matrix([[0.1, 0], [0, 0.2]]))
            flow = mpmath.expm(A * length) * flow
        exact = max(abs(x) for x in mpmath.eig(flow, left=False, right=False))
        assert abs(mpmath.mpf(value[0]) + mpmath.mpf(low[0]) - exact) <= doubt[0]
    assert doubt[0] < 1e-18


def test_a_file_has_a_chart(tmp_path):
    """Its references lie within the bars of the survey."""
    path = tmp_path / "damped.py"
    path.write_text(FILE)
    case = own_file.case(path)
    assert case.ERROR == "spectral_radius" and set(case.works()) == {
        "row",
        "map 60x80",
        "scattered",
    }
    references = case.references("row")
    assert len(references) == own_file.POINTS
    for parameters, _options, exact, _verdict in references:
        ds = survey.evaluate(case.SCENE, **parameters)
        off = abs(float(ds.spectral_radius) - float(exact["spectral_radius"]))
        assert off <= float(ds.spectral_radius_error) + 2e-16
