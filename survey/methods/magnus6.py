"""Magnus expansion, order 6, three Gauss points a step, exponential of sl(2) in closed form.

Each step is two half steps, checked by one full step (difference / (2^6 - 1)). det P = 1 to
rounding. Domain: smooth z, phase per step below about 4; cheapest at 1e-6 and looser.

Source: S. Blanes, F. Casas, J. A. Oteo, J. Ros, Physics Reports 470 (2009) 151-238 (section 5,
numerical integrators).
"""

from math import sqrt

from survey.kernels.hill.matrix import doubled, exponential, samples_only
from survey.kernels.jit import inline, kernel
from survey.kernels.lanes import chain, scatter

ORDER = 6
SERVES = ("hill",)
COST = {"hill": 2.0}  # time, relative to the default method
_SIDE = 0.5 - sqrt(15.0) / 10.0
_GAUSS = (_SIDE, 0.5, 1.0 - _SIDE)
NODES = tuple(0.5 * x for x in _GAUSS) + tuple(0.5 + 0.5 * x for x in _GAUSS) + _GAUSS
WIDTH = len(NODES) + 1
_SLOPE = sqrt(15.0) / 3.0


def hill_density(rtol):
    """Steps per radian of the fastest phase, and per distance to the nearest singularity of z, for
    accuracy rtol.
    """
    scale = max(rtol, 1e-13) ** (-1 / ORDER)
    return 0.19 * scale, 0.69 * scale


@inline
def _bracket(x1, y1, z1, x2, y2, z2):
    """Commutator of (x1, y1; z1, -x1) and (x2, y2; z2, -x2)."""
    return y1 * z2 - z1 * y2, 2.0 * (x1 * y2 - y1 * x2), 2.0 * (z1 * x2 - x1 * z2)


@inline
def _matrix(z1, z2, z3, h):
    # alpha_1 = (0, h; a, 0), alpha_2 = (0, 0; b, 0), alpha_3 = (0, 0; c, 0)
    a = -h * z2
    b = -h * _SLOPE * (z3 - z1)
    c = -(10.0 / 3.0) * h * (z3 - 2.0 * z2 + z1)
    # C1 = [alpha_1, alpha_2];  C2 = -[alpha_1, 2 alpha_3 + C1] / 60
    x1, y1, w1 = _bracket(0.0, h, a, 0.0, 0.0, b)
    x2, y2, w2 = _bracket(0.0, h, a, x1, y1, 2.0 * c + w1)
    # Omega = alpha_1 + alpha_3 / 12 + [-20 alpha_1 - alpha_3 + C1, alpha_2 + C2] / 240
    x, y, w = _bracket(
        x1, y1 - 20.0 * h, w1 - 20.0 * a - c, -x2 * (1 / 60), -y2 * (1 / 60), b - w2 * (1 / 60)
    )
    return exponential(x * (1 / 240), h + y * (1 / 240), a + c * (1 / 12) + w * (1 / 240))


@inline
def hill_step(f, c2, p, h):
    """P over two half steps, and its local error bounds."""
    base = p * p * c2
    z1 = f[0] + p * f[WIDTH + 0] + base
    z2 = f[1] + p * f[WIDTH + 1] + base
    z3 = f[2] + p * f[WIDTH + 2] + base
    z4 = f[3] + p * f[WIDTH + 3] + base
    z5 = f[4] + p * f[WIDTH + 4] + base
    z6 = f[5] + p * f[WIDTH + 5] + base
    left = f[6] + p * f[WIDTH + 6] + base
    middle = f[7] + p * f[WIDTH + 7] + base
    right = f[8] + p * f[WIDTH + 8] + base
    size = f[9] + abs(p) * f[WIDTH + 9] + abs(base)
    half = 0.5 * h
    return doubled(
        _matrix(z1, z2, z3, half),
        _matrix(z4, z5, z6, half),
        _matrix(left, middle, right, h),
        ORDER,
        size,
        h,
    )


@kernel
def hill_chain(samples, c2, h, p, order, starts, ends, out):
    chain(samples_only, hill_step, WIDTH, samples, c2, h, p, order, starts, ends, out)


@kernel
def hill_scatter(samples, c2, h, p, order, starts, out):
    scatter(samples_only, hill_step, WIDTH, samples, c2, h, p, order, starts, out)
