"""The Maslov index of a symplectic system: how often a pair of multipliers has passed 1, or -1, on
the way to it.

The graph of X(t), x -> X(t) x, is a Lagrangian subspace, and meets that of c, c = 1 or -1, where c is an eigenvalue of
X(t). With X in blocks of coordinates q and momenta p, and Z = (i 1; X_qq + i X_pq  X_qp + i X_pp), the graph belongs to
the unitary and symmetric matrix W = Z conj(Z)^-1 (Souriau), of which the one relative to the graph of c, U^-1 W U^-T,
has the eigenvalue 1 as often as X has c. Its determinant turns by

    theta(t) = 2 arg det(X_qq + X_pp + i (X_pq - X_qp)),

followed from t = 0 on, step by step, and with a_j in (0, 2 pi) the angles of its eigenvalues at T,

    index = (sum_j a_j - theta(0) - the change of theta) / 2 pi,

an integer, from which m = n / 2 is taken for c = 1. All paths begin at the identity, so that the
indices of two systems differ by the signed number of passages of c between them, on whatever line
of parameters (homotopy). They grow with the Hamiltonian function; of Hill's equation y'' + (a +
...) y = 0 they count the edges of tongues below a.

Sources: J. Robbin, D. Salamon, Topology 32 (1993) 827; V. I. Arnold, Functional Analysis and Its
Applications 1 (1967) 1; M. A. de Gosson, Symplectic Methods in Harmonic Analysis (2011), 3.
"""

import numpy as np

from survey.measures.floquet import monodromy
from survey.measures.segments import UNKNOWN
from survey.scene import Output

OUTPUTS = tuple(
    Output(f"index_{name}", f"Maslov index relative to {goal}: it changes by 1 where a pair of multipliers passes it",
           integer=True, fill=UNKNOWN, on_request=True, applies=f"where no multiplier is {goal} within rounding")
    for name, goal in (("plus_one", "1"), ("minus_one", "-1"))
)  # fmt: skip
GOALS = (1.0, -1.0)
RTOL = 1e-6  # of the steps: that of a count
TURN = 2.0  # the most that theta / 2 may turn in a step, in radians
FINER = (1.0, 4.0, 16.0)  # steps, tried one after another, for each that keeps to that, as a rule
CLOSE = 1e-7  # radians: an eigenvalue of W so close to 1 may be on either side of it
UNITARY, WHOLE = 1e-3, 0.05  # how far W may be from unitary, and an index from an integer


def indices(system, points):
    """The index relative to each of GOALS (2, N) of a symplectic System at points (N, parameters);
    else UNKNOWN.
    """
    own = monodromy.SystemPoints(system, points, halves=True)
    method = monodromy.method_of("auto")
    found = np.full((2, len(points)), UNKNOWN, dtype=np.int32)
    left, m = np.flatnonzero(own.valid), system.n // 2
    for finer in FINER:
        turned = np.empty((2, left.size))
        rough = np.zeros(left.size, bool)

        def follow(some, *given, turned=turned, rough=rough):
            turned[:, some], rough[some] = _followed(*given)

        if left.size:
            factor = np.full(left.size, max(1.0, finer * m * method.floquet_reach(RTOL) / TURN))
            monodromy.solve(own, method, RTOL, factor, left, follow)
            found[:, left] = _integers(turned)
            left = left[rough]
    found[:, left] = UNKNOWN
    return found


def _followed(matrices, scale, F, _error, _doubt, first):
    """The indices (2, N), not rounded, and whether theta turned too far in a step, from the steps'
    propagators.
    """
    N, n = matrices.M.shape[:2]
    m = n // 2
    # in units that balance q with p, and are symplectic
    ratio = np.sqrt(scale[:, :m] / scale[:, m:])
    units = scale / np.concatenate([ratio, 1.0 / ratio], axis=1)
    to_units = units[:, :, None] / units[:, None, :]
    steps, X = np.diff(first), np.tile(np.eye(n), (N, 1, 1))
    turn = np.zeros(N)
    largest = np.zeros(N)
    before = np.full(N, 2.0**m, complex)
    with np.errstate(all="ignore"):
        for k in range(steps.max(initial=0)):
            live = np.flatnonzero(steps > k)
            X[live] = (to_units[live] * F[first[live] + k]) @ X[live]
            after = _rotation(X[live])
            angle = np.angle(after / before[live])
            before[live] = after / abs(after)
            turn[live] += angle
            largest[live] = np.maximum(largest[live], np.nan_to_num(abs(angle), nan=np.inf))
        found = np.array([_index(X, 2.0 * turn, goal) for goal in GOALS])
    return found, largest > TURN


def _rotation(X):
    """det(X_qq + X_pp + i (X_pq - X_qp)) of matrices X (N, n, n)."""
    m = X.shape[1] // 2
    return np.linalg.det(X[:, :m, :m] + X[:, m:, m:] + 1j * (X[:, m:, :m] - X[:, :m, m:]))


def _index(X, turn, goal):
    """The index (N) relative to `goal`, NaN where it is not certain, of X (N, n, n) after theta has
    turned by `turn`.
    """
    n = X.shape[1]
    angles, sure = _angles(X, goal)
    # for 1 that takes m from the index
    start = n * np.pi if goal > 0 else _angles(np.eye(n)[None], goal)[0].sum()
    return np.where(sure, (angles.sum(axis=1) - start - turn) / (2.0 * np.pi), np.nan)


def _angles(X, goal):
    """Angles (N, n) in [0, 2 pi) of the eigenvalues of W relative to the graph of `goal`, and
    whether they are certain.
    """
    N, n = X.shape[:2]
    angles = np.full((N, n), np.nan)
    sure = np.isfinite(X).all(axis=(1, 2))
    Z = _frame(X[sure])
    U = _frame(goal * np.eye(n)[None])[0] / np.sqrt(2.0)
    U = U.conj().T
    W = (
        U
        @ np.swapaxes(np.linalg.solve(np.swapaxes(Z.conj(), 1, 2), np.swapaxes(Z, 1, 2)), 1, 2)
        @ U.T
    )
    known = np.isfinite(W).all(axis=(1, 2))  # X may be finite, and overflow in Z
    sure[sure] = known
    value = np.linalg.eigvals(W[known])
    angles[sure] = np.angle(value) % (2.0 * np.pi)
    sure[sure] = (abs(abs(value) - 1.0) < UNITARY).all(axis=1) & (abs(value - 1.0) > CLOSE).all(
        axis=1
    )
    return angles, sure


def _frame(X):
    """Z (N, n, n)."""
    N, n = X.shape[:2]
    m = n // 2
    Z = np.empty((N, n, n), complex)
    Z[:, :m] = np.concatenate([1j * np.eye(m), np.eye(m)], axis=1)
    Z[:, m:] = X[:, :m] + 1j * X[:, m:]
    return Z


def _integers(found):
    """The numbers as integers, UNKNOWN where they are not."""
    with np.errstate(invalid="ignore"):
        near = np.rint(found)
        return np.where(abs(found - near) < WHOLE, near, UNKNOWN).astype(np.int32)
