"""Complete elliptic integrals by the arithmetic-geometric mean, their sums free of cancellation.

For x, y > 0 and M their mean: R_F(0, x^2, y^2) = pi / (2 M), R_J(0, x^2, y^2, p^2) = 3 pi R / (4 M
p^2).

Source: DLMF 19.8(i), 19.22(ii).
"""

from math import sqrt

from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd

MEANS = 60
SMALL = 1e-17
TINIEST = 1e-34
FAR = 2.0**40  # p^2 / (x y) from which the sum would take as many steps as p has binary digits more


@inline
def mean(x, y):
    """The mean of x and y, and the sum of 2^n c_n^2, n >= 1, with c_n = (a_(n-1) - b_(n-1))/2."""
    weight, total = 1.0, 0.0
    for _ in range(MEANS):
        c = 0.5 * (x - y)
        weight *= 2.0
        total += weight * c * c
        if abs(c) <= 1e-9 * x:
            break
        x, y = 0.5 * (x + y), sqrt(x * y)
    return 0.5 * (x + y), total


@inline
def third(x, y, square):
    """R = 1 + e_0/2 (1 + e_1/2 (1 + ..)), e = (p^2 - x y)/(p^2 + x y), p^2 = `square`, without
    cancellation.

    Where p^2 < x y the sum that is complementary, with p' = x y / p for p; where p' is large, what
    follows once x = y is in closed form: R = 2 p / (x + p), from R_J(0, x^2, x^2, p^2) = 3 pi / (2
    (x^2 p + x p^2)) (DLMF 19.20.8).
    """
    low = square < x * y
    if low:
        square = (x * y) * ((x * y) / square)
    p, weight, total = sqrt(square), 1.0, 0.0
    far = low and square > FAR * (x * y)
    for _ in range(MEANS):
        if far and abs(x - y) <= 1e-9 * x:
            return total + weight * (x + y) / (0.5 * (x + y) + p)
        xy = x * y
        size = p * p + xy
        e = (p - sqrt(xy)) * (p + sqrt(xy)) / size
        total += weight * (2.0 * xy / size if low else 1.0)
        weight *= 0.5 * e
        if abs(weight) <= SMALL * total:
            break
        p = 0.5 * size / p
        x, y = 0.5 * (x + y), sqrt(xy)
    return total


@kernel
def third_double(x, y, square):
    """R and the mean, as `third` and `mean`, of pairs in double-double."""
    xy = dd.mul(x, y)
    low = square[0] < xy[0]
    if low:
        square = dd.mul(xy, dd.div(xy, square))
    p, weight, total, going = dd.sqrt(square), (1.0, 0.0), (0.0, 0.0), True
    far = square[0] > FAR * xy[0]
    for _ in range(MEANS):
        if far and abs(x[0] - y[0]) <= SMALL * x[0]:
            middle = dd.times(dd.add(x, y), 0.5)
            rest = dd.div(dd.times(middle if low else p, 2.0), dd.add(middle, p))
            return dd.add(total, dd.mul(weight, rest)), middle
        if going:
            squared = dd.mul(p, p)
            size = dd.add(squared, xy)
            e = dd.div(dd.sub(squared, xy), size)
            total = dd.add(
                total, dd.mul(weight, dd.div(dd.times(xy, 2.0), size)) if low else weight
            )
            weight = dd.times(dd.mul(weight, e), 0.5)
            p = dd.div(size, dd.times(p, 2.0))
            going = abs(weight[0]) > TINIEST * total[0]
        near = abs(x[0] - y[0]) <= SMALL * x[0]
        x, y = dd.times(dd.add(x, y), 0.5), dd.sqrt(xy)
        if near and not going:
            break
        xy = dd.mul(x, y)
    return total, dd.times(dd.add(x, y), 0.5)
