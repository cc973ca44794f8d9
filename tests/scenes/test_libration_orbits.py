"""Coefficients against the full equations: periodic orbits about L4, their actions, periods and
Floquet exponents.

On the family of mode j with action r the frequencies are dH/dr_i at r_j = r: signed omega_i + c_ij
r + c_ijj r^2 + ..., twice and thrice the coefficient for i = j. No expansion of H is used here.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import survey

MU = 0.01
SIGNS = np.array([1.0, -1.0, 1.0])
HOME = np.array([0.5 - MU, np.sqrt(0.75), 0.0, -np.sqrt(0.75), 0.5 - MU, 0.0])  # L4: q, p
ROTATION = np.zeros((6, 6))  # the linear terms: q' = p + (y, -x, 0), p' = (p2, -p1, 0) + force
ROTATION[:3, 3:] = np.eye(3)
ROTATION[0, 1] = ROTATION[3, 4] = 1.0
ROTATION[1, 0] = ROTATION[4, 3] = -1.0


def force(q):
    """The attraction of both primaries and its Jacobian."""
    total, gradient = np.zeros(3), np.zeros((3, 3))
    for mass, x in ((1 - MU, -MU), (MU, 1 - MU)):
        d = q - np.array([x, 0.0, 0.0])
        square = d @ d
        cube = mass / (square * np.sqrt(square))
        total -= cube * d
        gradient += cube * (3.0 * np.outer(d, d) / square - np.eye(3))
    return total, gradient


def slope(t, state):
    """State, monodromy matrix and the integral of p dq."""
    z, matrix = state[:6], state[6:42].reshape(6, 6)
    pull, gradient = force(z[:3])
    ahead = ROTATION @ z
    ahead[3:] += pull
    jacobian = ROTATION.copy()
    jacobian[3:, :3] += gradient
    return np.concatenate([ahead, (jacobian @ matrix).ravel(), [z[3:] @ ahead[:3]]])


def turn(z, period):
    start = np.concatenate([z, np.eye(6).ravel(), [0.0]])
    end = solve_ivp(slope, (0.0, period), start, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    return end[:6], end[6:42].reshape(6, 6), end[42]


def modes():
    """Frequencies (positive) and directions of the three modes at L4."""
    jacobian = slope(0.0, np.concatenate([HOME, np.eye(6).ravel(), [0.0]]))[6:42].reshape(6, 6)
    values, columns = np.linalg.eig(jacobian)
    upper = np.flatnonzero(values.imag > 0)
    middle, low, high = upper[np.argsort(values[upper].imag)][[1, 0, 2]]
    picked = np.array([middle, low, high])  # omega1 < 1 = omega3
    return values[picked].imag, columns[:, picked]


def orbit(mode, size):
    """(action, signed frequencies) of the orbit of a family whose start lies `size` from L4 along
    the mode.
    """
    omega, columns = modes()
    along = columns[:, mode].real / np.linalg.norm(columns[:, mode].real)
    z, period = HOME + size * along, 2.0 * np.pi / omega[mode]
    for _ in range(12):
        end, matrix, area = turn(z, period)
        flow = slope(0.0, np.concatenate([z, np.eye(6).ravel(), [0.0]]))[:6]
        at_end = slope(0.0, np.concatenate([end, np.eye(6).ravel(), [0.0]]))[:6]
        # periodic, no shift in time, and as large as asked
        rows = np.vstack(
            [np.column_stack([matrix - np.eye(6), at_end]), [*flow, 0.0], [*along, 0.0]]
        )
        off = np.concatenate([end - z, [0.0], [(z - HOME) @ along - size]])
        step = np.linalg.lstsq(rows, -off, rcond=1e-12)[0]
        z, period = z + step[:6], period + step[6]
        if np.abs(step).max() < 1e-12:
            break
    frequencies = SIGNS * omega
    phases = np.angle(np.linalg.eigvals(matrix))
    for i in range(3):
        if i != mode:  # the multiplier that belongs to omega_i, and its full turns
            expected = frequencies[i] * period
            turned = phases + 2.0 * np.pi * np.rint((expected - phases) / (2.0 * np.pi))
            frequencies[i] = turned[np.argmin(abs(turned - expected))] / period
    frequencies[mode] = SIGNS[mode] * 2.0 * np.pi / period
    return SIGNS[mode] * area / (2.0 * np.pi), frequencies


@pytest.mark.parametrize(
    "mode", [*(pytest.param(mode, marks=pytest.mark.slow) for mode in (0, 1)), 2]
)
def test_frequencies_along_a_family_of_periodic_orbits(mode):
    ds = survey.evaluate("libration", mu=MU)
    sizes = {0: 0.02, 1: 0.02, 2: 0.06}[mode] * np.sqrt([1.0, 2.0, 3.0, 4.0])
    actions, frequencies = zip(*(orbit(mode, size) for size in sizes), strict=True)
    actions, moved = (
        np.array(actions),
        np.array(frequencies) - SIGNS * [float(ds.omega1), float(ds.omega2), 1.0],
    )
    assert (actions > 0).all()
    for i in range(3):
        fitted = np.linalg.solve(np.vander(actions, 4, increasing=True), moved[:, i] / actions)
        for power in (1, 2):
            exponents = np.eye(3, dtype=int)[mode] * power + np.eye(3, dtype=int)[i]
            label = "".join(map(str, exponents))
            known = (power + 1 if i == mode else 1) * float(ds.c.sel(monomial=label))
            assert fitted[power - 1] == pytest.approx(known, rel={1: 1e-6, 2: 1e-2}[power]), label
