"""2x2 step matrices as four scalars: a step made of two half steps, with its local error bounds."""

from survey.kernels.jit import inline
from survey.kernels.math.roundoff import EPS


@inline
def samples_only(samples, h, coefficients):
    """The row function of methods that use z itself: the samples, then the largest (see `lanes.chain`)."""
    nodes = samples.shape[1]
    for c in range(2):
        first, size = c * (nodes + 1), coefficients[c * (nodes + 1) + nodes]
        size[:] = 0.0
        for k in range(nodes):
            for i in range(samples.shape[2]):
                coefficients[first + k, i] = samples[c, k, i]
                size[i] = max(size[i], abs(samples[c, k, i]))


@inline
def rounding(size, h):
    """Bounds D11, D12, D21 of the rounding of one step h; z itself is known to 4 EPS times `size` >= |z|.

    Where `size` is large on the step's scale, as it is beside larger values of z, that reaches y
    within the step.
    """
    excess = 0.125 * h * h * size - 0.5
    within = 2.0 * EPS * (1.0 + 4.0 * (excess + abs(excess)))
    return within, within * h, 4.0 * EPS * (h * size)


@inline
def doubled(first, second, full, order, size, h):
    """P of two half steps `first`, `second`, with Richardson's estimate against the `full` step."""
    a1, b1, c1, d1 = first
    a2, b2, c2, d2 = second
    a, b, c, d = a2 * a1 + b2 * c1, a2 * b1 + b2 * d1, c2 * a1 + d2 * c1, c2 * b1 + d2 * d1
    full_a, full_b, full_c, full_d = full
    r11, r12, r21 = rounding(size, h)
    safety = 2.0 / (2.0**order - 1.0)
    e11 = safety * (abs(a - full_a) + abs(d - full_d)) + r11
    return a, b, c, d, e11, safety * abs(b - full_b) + r12, safety * abs(c - full_c) + r21


@inline
def exponential(x, y, z):
    """exp of the traceless matrix (x, y; z, -x): branch-free, to rounding for |x^2 + y z| <= 16.

    cosh and sinh(r)/r of r = sqrt(delta) are entire in delta: series at delta/16, then twice the
    doubling rules, in e = cosh - 1 and s = sinh(r)/r, which lose no digits.
    """
    delta = x * x + y * z
    d = delta * 0.0625
    e = 1 + d * (1 / 90) * (1 + d * (1 / 132) * (1 + d * (1 / 182) * (1 + d * (1 / 240))))
    e = d * (1 / 2) * (1 + d * (1 / 12) * (1 + d * (1 / 30) * (1 + d * (1 / 56) * e)))
    s = 1 + d * (1 / 110) * (1 + d * (1 / 156) * (1 + d * (1 / 210) * (1 + d * (1 / 272))))
    s = 1 + d * (1 / 6) * (1 + d * (1 / 20) * (1 + d * (1 / 42) * (1 + d * (1 / 72) * s)))
    s, e = s * (1 + e), 2 * e * (e + 2)
    s, e = s * (1 + e), 2 * e * (e + 2)
    return 1 + e + s * x, s * y, s * z, 1 + e - s * x
