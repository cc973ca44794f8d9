"""The classical Runge-Kutta method, order 4: the yardstick. Each step is two half steps, checked by one full step.

Domain: any continuous z; thousands of steps for 1e-10. The error of the two half steps is estimated as their
difference from the full step divided by 2^4 - 1 (Richardson).

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.1 and II.4.
"""

from survey.kernels.jit import inline, kernel
from survey.kernels.lanes import chain
from survey.kernels.matrix import doubled, samples_only

ORDER = 4
SERVES = ("hill",)
NODES = (0.0, 0.25, 0.5, 0.75, 1.0)
WIDTH = len(NODES) + 1


def hill_density(rtol):
    """Steps per radian of the fastest phase, and per distance to the nearest singularity of z, for accuracy rtol."""
    scale = max(rtol, 1e-13) ** (-1 / ORDER)
    return 0.35 * scale, 0.35 * scale


@inline
def _column(z0, z1, z2, h, y, v):
    """One classical step of y' = v, v' = -z y."""
    half = 0.5 * h
    y2, v2 = y + half * v, v - half * z0 * y
    y3, v3 = y + half * v2, v - half * z1 * y2
    y4, v4 = y + h * v3, v - h * z1 * y3
    sixth = h / 6.0
    return y + sixth * (v + 2.0 * (v2 + v3) + v4), v - sixth * (z0 * y + 2.0 * z1 * (y2 + y3) + z2 * y4)


@inline
def _matrix(z0, z1, z2, h):
    a, c = _column(z0, z1, z2, h, 1.0, 0.0)
    b, d = _column(z0, z1, z2, h, 0.0, 1.0)
    return a, b, c, d


@inline
def hill_step(f, c2, p, h):
    """P over two half steps, and its local error bounds."""
    base = p * p * c2
    z0 = f[0, 0] + p * f[1, 0] + base
    z1 = f[0, 1] + p * f[1, 1] + base
    z2 = f[0, 2] + p * f[1, 2] + base
    z3 = f[0, 3] + p * f[1, 3] + base
    z4 = f[0, 4] + p * f[1, 4] + base
    size = f[0, 5] + abs(p) * f[1, 5] + abs(base)
    half = 0.5 * h
    return doubled(_matrix(z0, z1, z2, half), _matrix(z2, z3, z4, half), _matrix(z0, z2, z4, h), ORDER, size, h)


@kernel
def hill_chain(samples, c2, h, p, ends, out):
    chain(samples_only, hill_step, WIDTH, samples, c2, h, p, ends, out)
