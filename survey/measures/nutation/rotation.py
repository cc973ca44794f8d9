"""The rotation of a body that nutates, at given times: p_theta, p, q, r and gamma of (3) and (6).

And what the paper's (8) to (11), corrected, keep constant: alpha1 = 2 h, alpha2 = F2, alpha3 =
p_psi; beta1, beta2, beta3, with the integrals from the lower turning point that is next to t = 0.

Source: `scenes/brun.md`, (3), (10) and (11) corrected, for any A = B.
"""

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import rotation as rt
from survey.kernels.nutation import wells as nu
from survey.measures.nutation import resting

ENERGIES = {
    "alpha1": ("constant of (8), twice the energy", r"\alpha_1"),
    "alpha2": ("constant of (8), the integral F2", r"\alpha_2"),
    "alpha3": ("constant of (8), p_psi", r"\alpha_3"),
}
PHASES = {
    "beta1": ("constant of (10), as corrected, of dW/d alpha1 = (t + beta1)/2", r"\beta_1"),
    "beta2": ("constant of (10), dW/d alpha2", r"\beta_2"),
    "beta3": ("constant of (10), dW/d alpha3", r"\beta_3"),
}
AT_T = {
    "p_theta": ("momentum conjugate to theta at t", r"p_\theta"),
    "omega1": ("angular velocity about the first axis of the body at t", "p"),
    "omega2": ("angular velocity about the second axis of the body at t", "q"),
    "omega3": ("angular velocity about the axis of symmetry", "r"),
    "gamma1": ("first component in the body of the direction of the centre at t", r"\gamma"),
    "gamma2": ("second component in the body of the direction of the centre at t", r"\gamma'"),
    "gamma3": ("third component in the body of the direction of the centre at t, u", r"\gamma''"),
}


def constants(rows, kinds, starts, periods, points):
    """{name: (values, bars)} of alpha1 to beta3, each (n), of initial states `points` (n, STATE)."""
    size_a, size_c, epsilon = points[:, rc.SIZE_A], points[:, rc.SIZE_C], points[:, rc.EPSILON]
    b, a = points[:, rc.P_PSI], points[:, rc.P_PHI]
    level = rows[:, nu.L]
    found = np.full((len(rows), 2, rt.PLACE), np.nan)
    turning = (kinds >= nu.NUTATION) & np.isfinite(periods).all(axis=1)
    some = np.empty((np.count_nonzero(turning), 2, rt.PLACE))
    rt.origins(rows[turning], starts[turning], periods[turning], some)
    found[turning] = some
    since, psi, phi = found[:, rt.VALUES].T
    delay, psi_bar, phi_bar = found[:, rt.BARS].T
    twice, field = (level - a * a) / size_a + a * a / size_c, epsilon * size_a
    sizes = (abs(level) + a * a) / size_a + a * a / size_c + abs(field)
    second = level - field * size_c
    with np.errstate(divide="ignore", invalid="ignore"):
        share = size_c / (2.0 * a * (size_a - size_c))
        moved = np.abs(share) * phi_bar
        return {
            "alpha1": (twice + field, 8.0 * ROUNDOFF * sizes),
            "alpha2": (second, 4.0 * ROUNDOFF * (np.abs(level) + np.abs(field * size_c))),
            "alpha3": (b, 0.0 * b),
            "beta1": _where(share, -2.0 * size_a * share * phi, 2.0 * size_a * moved, 8.0),
            "beta2": _where(
                share,
                share * phi + 0.5 * since,
                moved + 0.5 * delay,
                8.0,
                abs(share * phi) + abs(since),
            ),
            "beta3": (-psi, psi_bar),
        }


def _where(share, value, bar, roundings, size=None):
    """(value, bar with roundings of `size`), NaN where `share` is infinite: p_phi = 0, or A = C."""
    size = np.abs(value) if size is None else size
    good = np.isfinite(share)
    return np.where(good, value, np.nan), np.where(good, bar + roundings * ROUNDOFF * size, np.nan)


def at_times(rows, kinds, starts, periods, times, points, motion):
    """{name: (values, bars)} of AT_T, each (n, m) at `times` (n, m), of initial states `points` (n,
    STATE).

    motion: u, psi and phi there, and their bars.
    """
    found = np.full((*times.shape, 2, rt.PLACE), np.nan)
    turning = (kinds >= nu.NUTATION) & np.isfinite(periods).all(axis=1)
    size_a, size_c, a = (points[:, i, None] for i in (rc.SIZE_A, rc.SIZE_C, rc.P_PHI))
    some = np.empty((np.count_nonzero(turning), times.shape[1], 2, rt.PLACE))
    inside = np.ascontiguousarray((times / size_a)[turning])
    rt.fill_angles(rows[turning], starts[turning], periods[turning], inside, some)
    found[turning] = some
    still = kinds == nu.SEPARATRIX
    found[still] = resting.rotations(
        points[still], motion["u"][still], motion["u_error"][still]
    ).transpose(2, 3, 0, 1)
    sine, p_theta, across = np.moveaxis(found[:, :, rt.VALUES], -1, 0)
    sine_bar, p_theta_bar, across_bar = np.moveaxis(found[:, :, rt.BARS], -1, 0)
    phi, off = motion["phi"], motion["phi_error"] + 4.0 * ROUNDOFF
    s, c = np.sin(phi), np.cos(phi)
    turned = off * np.hypot(p_theta, across)
    first, second = across * s + p_theta * c, across * c - p_theta * s
    bar = across_bar * np.abs(s) + p_theta_bar * np.abs(c) + turned
    other = across_bar * np.abs(c) + p_theta_bar * np.abs(s) + turned
    spin = np.broadcast_to(a / size_c, times.shape)
    tilted = off * np.abs(sine)
    return {
        "p_theta": (p_theta, p_theta_bar),
        "omega1": (first / size_a, bar / size_a + 4.0 * ROUNDOFF * np.abs(first / size_a)),
        "omega2": (second / size_a, other / size_a + 4.0 * ROUNDOFF * np.abs(second / size_a)),
        "omega3": (spin, ROUNDOFF * np.abs(spin)),
        "gamma1": (sine * s, sine_bar * np.abs(s) + tilted + 2.0 * ROUNDOFF * np.abs(sine * s)),
        "gamma2": (sine * c, sine_bar * np.abs(c) + tilted + 2.0 * ROUNDOFF * np.abs(sine * c)),
        "gamma3": (motion["u"], motion["u_error"]),
    }
