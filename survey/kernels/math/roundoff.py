"""How float64 and double-doubles round, relative to what is rounded: the constants of every error
bound.

ROUNDOFF is exact, for bounds that count every rounding; EPS and ROUNDOFF_UP are 4 and 8 % larger
than what they are named for, which covers the second order, and the bound's own roundings, where
bounds count to first order.

Source: N. J. Higham, Accuracy and Stability of Numerical Algorithms (2002), 2.2.
"""

ROUNDOFF = 2.0**-53  # unit roundoff u: of one operation of float64, rounded to nearest
ROUNDOFF_UP = 1.2e-16  # u, rounded up
EPS = 2.3e-16  # machine epsilon, 2 u, rounded up
# of one operation of double-doubles, to a small factor (`kernels.math.double`)
PAIR_ROUNDOFF = 2.0**-104
# of a short sum of products of double-doubles, relative to the sum of |terms|; the rounding of its inputs included
PAIR_SUM_ROUNDOFF = 2.0**-98
