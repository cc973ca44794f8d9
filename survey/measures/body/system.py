"""A body and its initial state in numbers, turned into the frame of its axis of rotation, and its
case in the paper.

In that frame w = (w, 0, 0) and nu = (cos theta, sin theta sin phi, sin theta cos phi). The set w2 =
w3 = 0, nu1 = cos theta is invariant if and only if on it, for all phi and w,

    A12 w' = torque_2,  A31 w' = torque_3,  A11 w' = torque_1,

polynomials in w, sin phi and cos phi: each of their coefficients is one of CONDITIONS, (26)-(36).
"""

import math
from dataclasses import dataclass

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF

# 72 roundings: what turning a body into another frame may leave of a number that is 0
ROUNDING = 8e-15
OFF, VERTICAL, CASE_A, CASE_B = range(4)
# In units of A11 and of the body's times; each is 0 on the set. sin theta and cos theta are those
# of the initial state.
CONDITIONS = (
    "A12",
    "A31",
    "B11 sin theta",
    "lambda2 + B12 cos theta",
    "lambda3 + B31 cos theta",
    "C12 sin^2 theta",
    "C31 sin^2 theta",
    "C23 sin theta cos theta",
    "(C22 - C33) sin theta cos theta",
    "(s1 - (C11 - C33) cos theta) sin theta",
    "(s2 - C12 cos theta) cos theta",
    "(s3 - C31 cos theta) cos theta",
)
TENSORS = ("A", "B", "C")
ENTRIES = {"11": (0, 0), "22": (1, 1), "33": (2, 2), "12": (0, 1), "23": (1, 2), "31": (2, 0)}
NAMES = (
    *(f"{tensor}{entry}" for tensor in TENSORS for entry in ENTRIES),
    *(f"{vector}{i}" for vector in ("lambda", "s", "omega", "gamma") for i in (1, 2, 3)),
)


@dataclass(frozen=True)
class BodySystem:
    """A body in some axes: symmetric A, B, C (3, 3), lambda and s, and a state w, nu (3 each)."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    moment: np.ndarray
    s: np.ndarray
    w: np.ndarray
    nu: np.ndarray

    @property
    def table(self):
        """As `kernels.cylinder.gyrostat` takes it, (ROWS, 3)."""
        return np.vstack([self.A, np.linalg.inv(self.A), self.B, self.C, self.moment, self.s])

    def torque(self):
        """A w' (3)."""
        force = self.B @ self.w - self.C @ self.nu + self.s
        return np.cross(self.A @ self.w + self.moment, self.w) + np.cross(force, self.nu)

    def turned(self, Q):
        """The same in the axes that are the columns of Q."""
        tensors = (Q.T @ tensor @ Q for tensor in (self.A, self.B, self.C))
        return BodySystem(
            *(0.5 * (t + t.T) for t in tensors),
            *(Q.T @ v for v in (self.moment, self.s, self.w, self.nu)),
        )

    def jacobian(self, w, nu):
        """d(w', nu') / d(w, nu) at a state, (6, 6)."""
        force, momentum = self.B @ w - self.C @ nu + self.s, self.A @ w + self.moment
        out, inverse = np.zeros((6, 6)), np.linalg.inv(self.A)
        cross = _cross_matrix
        # d(a x b) = -[b] da + [a] db
        out[:3, :3] = inverse @ (-cross(w) @ self.A + cross(momentum) - cross(nu) @ self.B)
        out[:3, 3:] = inverse @ (cross(nu) @ self.C + cross(force))
        out[3:, :3], out[3:, 3:] = cross(nu), -cross(w)
        return out


def _cross_matrix(v):
    """[v] with [v] x = v cross x."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def read(numbers):
    """The BodySystem of one row of NAMES; None where A is not positive definite or gamma is 0."""
    entries = dict(zip(NAMES, numbers, strict=True))
    tensors = []
    for tensor in TENSORS:
        matrix = np.empty((3, 3))
        for entry, (i, j) in ENTRIES.items():
            matrix[i, j] = matrix[j, i] = entries[f"{tensor}{entry}"]
        tensors.append(matrix)
    vectors = [
        np.array([entries[f"{v}{i}"] for i in (1, 2, 3)]) for v in ("lambda", "s", "omega", "gamma")
    ]
    length = math.hypot(*vectors[3])
    if not 0.0 < length < math.inf or not _positive(tensors[0]):
        return None
    vectors[3] = vectors[3] / length
    return BodySystem(*tensors, *vectors)


def _positive(matrix):
    """Is the symmetric matrix positive definite, by more than its rounding?"""
    low, *_rest, high = np.linalg.eigvalsh(matrix)
    return low > 1e-12 * high


@dataclass(frozen=True)
class PlacedBody:
    """A BodySystem turned so that its axis of rotation is axis 1, and what the paper's conditions say
    of it.

    On the set (`case` not OFF) the numbers that vanish there are exactly 0 in `system`.
    """

    system: BodySystem
    turn: np.ndarray  # its axes in the body's own, by columns
    theta: float
    residuals: np.ndarray  # of CONDITIONS
    bars: np.ndarray
    case: int
    six: np.ndarray  # b12, b31, d, c23, s2, s3 of the reduced flow
    six_bars: np.ndarray
    phi0: float
    w0: float

    @property
    def axis(self):
        """Axis 1, in the body's own axes."""
        return self.turn[:, 0]

    @property
    def widening(self):
        """How much wider the bars of the reduced flow become, since its parameters are rounded too.

        Each step of the flow counts four roundings of |f| |w| + |g|.
        """
        b = np.hypot(*self.six[:2])
        c = np.hypot(0.5 * self.six[2], self.six[3]) + np.hypot(*self.six[4:])
        shares = [
            np.sum(bars) / size
            for bars, size in ((self.six_bars[:2], b), (self.six_bars[2:], c))
            if size > 0.0
        ]
        return 1.0 + max(shares, default=0.0) / (4.0 * ROUNDOFF)


def nearest(system):
    """The PlacedBody of a BodySystem: of its possible axes of rotation, the one on which it misses the set
    by least.
    """
    return min(
        (_placed(system, axis) for axis in _axes(system)),
        key=lambda p: (p.case == OFF, p.residuals @ p.residuals),
    )


def _axes(system):
    """The axis of rotation: the direction of w, of w' if w = 0, or at rest every principal axis of A."""
    if system.w.any():
        return [system.w]
    spin = np.linalg.solve(system.A, system.torque())
    scale = np.abs(system.C).max() + np.abs(system.s).max()
    if np.abs(system.torque()).max() > ROUNDING * scale:
        return [spin]
    return list(np.linalg.eigh(system.A)[1].T)


def frame(axis):
    """An orthogonal matrix whose first column is the axis, its sign such that the largest component
    is positive.

    An axis of the body's own frame leaves its tensors as they are, but for a cyclic change of their
    indices.
    """
    n = axis / np.abs(axis).max()
    n = n / math.sqrt(n @ n)
    i = int(np.argmax(np.abs(n)))
    n, first = n * np.sign(n[i]), np.eye(3)[i]
    v = _cross_matrix(np.cross(first, n))
    return (np.eye(3) + v + v @ v / (1.0 + n[i])) @ np.roll(np.eye(3), i, axis=0)


def _placed(system, axis):
    Q = frame(axis)
    b = system.turned(Q)
    a = b.A[0, 0]
    norms = [np.abs(x).max() for x in (b.A, b.B, b.C, b.moment, b.s)]
    cos, sin, phi0 = b.nu[0], math.hypot(b.nu[1], b.nu[2]), math.atan2(b.nu[1], b.nu[2])
    if abs(cos) <= ROUNDING:
        cos, sin = 0.0, 1.0
    if sin <= ROUNDING:
        cos, sin, phi0 = math.copysign(1.0, cos), 0.0, 0.0
    B, C, moment, s = b.B, b.C, b.moment, b.s
    residuals = np.array([
        b.A[0, 1], b.A[2, 0],
        B[0, 0] * sin,
        moment[1] + B[0, 1] * cos, moment[2] + B[2, 0] * cos,
        C[0, 1] * sin * sin, C[2, 0] * sin * sin,
        C[1, 2] * sin * cos, (C[1, 1] - C[2, 2]) * sin * cos,
        (s[0] - (C[0, 0] - C[2, 2]) * cos) * sin,
        (s[1] - C[0, 1] * cos) * cos, (s[2] - C[2, 0] * cos) * cos,
    ]) / a  # fmt: skip
    A_norm, B_norm, C_norm, moment_norm, s_norm = norms
    torque = moment_norm + B_norm * abs(cos)
    couple = (s_norm + 2.0 * C_norm * abs(cos)) * abs(cos)
    sizes = (
        np.array(
            [
                A_norm,
                A_norm,
                B_norm,
                torque,
                torque,
                *[C_norm] * 4,
                s_norm + 2.0 * C_norm,
                couple,
                couple,
            ]
        )
        / a
    )
    bars = ROUNDING * sizes
    case = OFF
    if (np.abs(residuals) <= bars).all():
        case = VERTICAL if sin == 0.0 else CASE_B if cos == 0.0 else CASE_A
        b = _exact(b, case, cos, sin, phi0)
    six = np.array([b.B[0, 1], b.B[2, 0], (b.C[1, 1] - b.C[2, 2]) * sin, b.C[1, 2] * sin,
                    b.s[1] - b.C[0, 1] * cos, b.s[2] - b.C[2, 0] * cos]) * sin / a  # fmt: skip
    turned = np.count_nonzero(Q) > 3  # else nothing but the division by A11 is rounded
    rounding = ROUNDING if turned else 4.0 * ROUNDOFF
    scales = (
        np.array(
            [
                B_norm,
                B_norm,
                2.0 * C_norm,
                C_norm,
                s_norm + C_norm * abs(cos),
                s_norm + C_norm * abs(cos),
            ]
        )
        / a
    )
    six_bars = rounding * (scales if turned else np.abs(six))
    six[np.abs(six) <= six_bars] = 0.0
    if case == CASE_A:  # n = k / cos theta - lambda1 decides; g = 0
        six[2:] = 0.0
    return PlacedBody(
        b, Q, math.atan2(sin, cos), residuals, bars, case, six, six_bars, phi0, b.w[0]
    )


def _exact(b, case, cos, sin, phi0):
    """The body on the set, with the conditions met exactly."""
    A, B, C, moment, s = b.A.copy(), b.B.copy(), b.C.copy(), b.moment.copy(), b.s.copy()
    A[0, 1:] = A[1:, 0] = 0.0
    nu = np.array([cos, sin * math.sin(phi0), sin * math.cos(phi0)])
    moment[1:] = -B[0, 1:] * cos
    if case != VERTICAL:
        B[0, 0] = 0.0
        C[0, 1:] = C[1:, 0] = 0.0
        s[0] = 0.0
    if case == CASE_A:
        C[1, 2] = C[2, 1] = s[1] = s[2] = 0.0
        C[1, 1] = C[2, 2]
        s[0] = (C[0, 0] - C[2, 2]) * cos
    if case == VERTICAL:
        s[1:] = C[0, 1:] * cos
    return BodySystem(A, B, C, moment, s, np.array([b.w[0], 0.0, 0.0]), nu)
