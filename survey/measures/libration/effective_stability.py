"""How far from an elliptic equilibrium motions stay for a stated time: the radius of effective
stability.

After normalisation to degree r the Hamiltonian is Z(r1, r2, r3) + R, R of degrees r + 1 and more, r_j = |z_j|^2; only R
changes the actions r_j. Where all |z_i| <= rho, |dr_j/dt| <= B(rho) = sum over d > r of A_d rho^d, A_d the largest over
j of the sum over the monomials of degree d of |k_j| |coefficient|. Motions with all |z_i| <= rho_0 at first therefore
keep r_i <= 2 rho_0^2 for the time

    T_r(rho_0) = integral from rho_0 to sqrt(2) rho_0 of 2 rho / B(rho) d rho,

and the radius is the largest rho_0, over the orders r that were computed, with T_r(rho_0) >= the
time asked. The z_j are the variables after r - 2 Lie transforms, normalised to {z_j, zbar_j} = i;
units as in the Hamiltonian.

An estimate, not a proof: R is known up to degree D = order + 1 only. Its tail is taken as
geometric, with the ratio of the last two terms, or, where three are known, the largest geometric
mean of two successive ratios (even and odd degrees differ); T_r = 0 where it is 1 or more at
sqrt(2) rho_0, as short times have it. So r goes up to D - 2. That the transforms exist on the
polydisk is not shown either. Where r is the last one, more orders would give a larger radius. Where
a generator's divisor is too small to divide by, r ends before it.

Sources: N. N. Nekhoroshev, Russ. Math. Surv. 32 (1977) 6, 1; A. Giorgilli, A. Delshams, E. Fontich,
L. Galgani, C. Simo, J. Diff. Eq. 77 (1989) 167; A. Giorgilli, C. Skokos, Astron. Astrophys. 317
(1997) 254.
"""

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)
LARGEST, SMALLEST = 0.0, -60.0  # of log(rho_0)
HALVINGS = 52  # of that interval
RESOLUTION = 1e-12  # relative: what the halvings, the rule and the roundings here leave


def radius(remainders, time):
    """(radius, bound, r) at each mu: the radius for `time`, how much less rounding may make it, and
    the order r.

    `remainders`: {(r, d): (values, bounds) (2, 3, N)}, as a method's function of that name gives
    them; `time` is a number, or one for each mu. NaN and r = -1 where no order is known.
    """
    top = max(d for _r, d in remainders)
    orders = np.arange(2, top - 1)
    norms = {
        r: np.moveaxis([remainders[r, d] for d in range(r + 1, top + 1)], 0, -1) for r in orders
    }
    safe = np.array(
        [_solve(r, (values + bars).max(axis=0), time) for r, (values, bars) in norms.items()]
    )
    known = np.isfinite(safe).any(axis=0)
    best = np.where(known, orders[np.argmax(np.where(np.isfinite(safe), safe, -1.0), axis=0)], -1)
    radius = np.full(known.shape, np.nan)
    least = safe.max(axis=0, initial=-1.0, where=np.isfinite(safe))
    for r in np.unique(best[known]):
        radius[best == r] = _solve(
            r, norms[r][0].max(axis=0)[best == r], np.broadcast_to(time, best.shape)[best == r]
        )
    return radius, np.maximum(radius - least, 0.0) + RESOLUTION * radius, best


def _solve(r, norms, time):
    """The root of T(rho_0) = time by bisection in log(rho_0); `norms` (N, degrees): A_d, d = r + 1,
    ..., D.
    """
    low, high = np.full(len(norms), SMALLEST), np.full(len(norms), LARGEST)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        enough = escape_time(r, norms, np.exp(middle)) >= time
        low, high = np.where(enough, middle, low), np.where(enough, high, middle)
    return np.where(np.isfinite(norms).all(axis=1), np.exp(low), np.nan)


def escape_time(r, norms, start):
    """T_r(rho_0) at rho_0 = `start` (N), by Gauss's rule in log(rho)."""
    width = 0.5 * np.log(2.0)
    rho = start[:, None] * np.exp(0.5 * width * (NODES + 1.0))
    time = (WEIGHTS * rho**2 / bound(r, norms, rho)).sum(axis=1) * width
    return np.where(np.sqrt(2.0) * start * tail_ratio(norms) < 1.0, time, 0.0)


def bound(r, norms, rho):
    """B(rho) (N, points): the known degrees and the geometric tail."""
    powers = np.cumprod(np.broadcast_to(rho[..., None], (*rho.shape, norms.shape[-1])), axis=-1)
    terms = norms[:, None] * (powers * rho[..., None] ** r)
    ratio = rho * tail_ratio(norms)[:, None]
    return terms.sum(axis=-1) + terms[..., -1] * ratio / (1.0 - ratio)


def tail_ratio(norms):
    """By how much A_d is taken to grow with each degree beyond D (N)."""
    if norms.shape[1] == 2:
        return norms[:, 1] / norms[:, 0]
    return np.sqrt((norms[:, 2:] / norms[:, :-2]).max(axis=1))
