"""The columns of the rows that kernels and methods of the family "nutation" fill, and its measures
read.

Angles are in radians; a name with _BAR is the error bound of the value named before it. The columns
of a well are those of `wells` beside this file.
"""

# An initial state, in the order of the scene's parameters: A, C, epsilon, theta0, p_theta0, p_psi
# (b) and p_phi (a).
SIZE_A, SIZE_C, EPSILON, THETA, P_THETA, P_PSI, P_PHI = range(7)
STATE = 7
# Scaled integrals in the place of a state, P_PSI and P_PHI as there: l, the sign of k, -1 for the
# lower of two wells and 1 for the upper one, C/A.
LEVEL, SIGN, WELL, RATIO = range(4)
# Scaled integrals alone: l, alpha, beta.
ENERGY, ALPHA, BETA = range(3)
INTEGRALS = 3
# A nutation: T / A, the precession, the spin less a (1/C - 1/A) T, the action.
PERIOD, PRECESSION, SPIN, ACTION, PERIOD_BAR, PRECESSION_BAR, SPIN_BAR, ACTION_BAR = range(8)
PERIODS = 8
# A motion at a time: u, psi, phi less its drift.
U, PSI, PHI, U_BAR, PSI_BAR, PHI_BAR = range(6)
MOTION = 6
# Where a motion starts: (u0 - ul)/(uh - ul), 1 - that, the sign of u', the error of u0 in them.
DONE, LEFT, DIRECTION, START_BAR = range(4)
START = 4
# A point on the way: u, 1 - u, 1 + u, (u - ul)/(uh - ul), 1 - that, sqrt Q(u), X0 + s of (S16) from ul
# and from uh.
HERE, TO_PLUS, TO_MINUS, RISEN, TO_RISE, ROOT, FROM_LOW, FROM_HIGH = range(8)
LOCATED = 8
# A height: L above the separatrix, its bar, |k|.
ABOVE, ABOVE_BAR, FIELD = range(3)
HEIGHT = 3
