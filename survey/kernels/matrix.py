"""2x2 step matrices as four scalars: a step made of two half steps, with its local error bounds."""

from survey.kernels.jit import inline

ROUNDING = 2.2e-16


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
    """Bounds D11, D12, D21 of the rounding of one step h where |z| <= size; z itself known to a few ulp."""
    return 2.0 * ROUNDING, 2.0 * ROUNDING * h, 2.0 * ROUNDING * (h * size)


@inline
def doubled(first, second, whole, order, size, h):
    """P of two half steps `first`, `second`, with Richardson's estimate against the `whole` step."""
    a1, b1, c1, d1 = first
    a2, b2, c2, d2 = second
    a, b, c, d = a2 * a1 + b2 * c1, a2 * b1 + b2 * d1, c2 * a1 + d2 * c1, c2 * b1 + d2 * d1
    whole_a, whole_b, whole_c, whole_d = whole
    r11, r12, r21 = rounding(size, h)
    safety = 2.0 / (2.0**order - 1.0)
    e11 = safety * (abs(a - whole_a) + abs(d - whole_d)) + r11
    return a, b, c, d, e11, safety * abs(b - whole_b) + r12, safety * abs(c - whole_c) + r21
