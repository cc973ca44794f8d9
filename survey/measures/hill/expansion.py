"""A factor F of Hill's problem near positions on a map: value and derivatives, and what follows for
the curve F = 0.

Positions are those of `survey.measures.square`.
"""

from dataclasses import dataclass

import numpy as np

from survey.measures.hill.edges import COUNTS, FACTORS, of_kind, on_rows

SPACING, LEAST = 1e-3, 1e-7  # between the nine points: as a fraction of a step, and at least
STENCIL = np.array([-1.0, 0.0, 1.0])


@dataclass
class Expansion:
    """F at positions (n, 2): value (n), gradient (n, 2), second derivatives (n, 2, 2).

    `turns` (n) is twice the rotation number there.
    """

    value: np.ndarray
    gradient: np.ndarray
    second: np.ndarray
    turns: np.ndarray

    def moved(self, shift):
        """The same, `shift` (n, 2) further on."""
        bent = np.einsum("nij,nj->ni", self.second, shift)
        value = self.value + ((self.gradient + 0.5 * bent) * shift).sum(axis=1)
        return Expansion(value, self.gradient + bent, self.second, self.turns)

    def zero(self, line):
        """How far along unit vectors (n, 2) the nearest zero lies (Halley)."""
        slope = (self.gradient * line).sum(axis=1)
        bend = np.einsum("nij,ni,nj->n", self.second, line, line)
        return -2 * self.value * slope / (2 * slope**2 - self.value * bend)

    def course(self, side):
        """Unit tangent with F > 0 on its right (side 1) or left (-1), unit normal, curvature towards it."""
        steepness = np.hypot(*self.gradient.T)
        normal = self.gradient / steepness[:, None]
        along = side[:, None] * np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        bend = np.einsum("nij,ni,nj->n", self.second, along, along)
        return along, normal, -bend / steepness


def expander(solve, square):
    """The function that expands F (see `curves.trace` for `solve`)."""

    def expansion(x, kind, length, low, high, count=True):
        """The Expansion at positions x, from nine points that are close against a step of `length`,
        in low ... high.
        """
        wanted = FACTORS + COUNTS[:count]
        f, out, middle, (h, k) = _near(solve, square, x, kind, length, low, high, STENCIL, wanted)
        gradient = np.stack(
            [(f[:, 2, 1] - f[:, 0, 1]) / (2 * h), (f[:, 1, 2] - f[:, 1, 0]) / (2 * k)], axis=1
        )
        qq = (f[:, 2, 1] - 2 * f[:, 1, 1] + f[:, 0, 1]) / h**2
        pp = (f[:, 1, 2] - 2 * f[:, 1, 1] + f[:, 1, 0]) / k**2
        qp = (f[:, 2, 2] - f[:, 2, 0] - f[:, 0, 2] + f[:, 0, 0]) / (4 * h * k)
        second = np.stack([qq, qp, qp, pp], axis=1).reshape(-1, 2, 2)
        turns = (
            2 * out["rotation_number"].reshape(f.shape)[:, 1, 1]
            if count
            else np.full(kind.size, np.nan)
        )
        return Expansion(f[:, 1, 1], gradient, second, turns).moved(x - middle)

    return expansion


def tangents(solve, square, x, kind, length, low, high):
    """Unit tangents (n, 2) at positions x of the curve F = 0, F > 0 on their right, from the four corners."""
    f, _, _, (h, k) = _near(solve, square, x, kind, length, low, high, STENCIL[::2], FACTORS)
    right, up = f[:, 1] - f[:, 0], f[:, :, 1] - f[:, :, 0]
    gradient = np.stack([right.sum(axis=1) / h, up.sum(axis=1) / k], axis=1)
    return np.stack([-gradient[:, 1], gradient[:, 0]], axis=1) / np.hypot(*gradient.T)[:, None]


def _near(solve, square, x, kind, length, low, high, stencil, wanted):
    """F (n, s, s) on a lattice of s by s points about positions near x, with all outputs, those
    positions and the spacings (2, n).
    """
    spacing = np.minimum(np.maximum(SPACING * length, LEAST)[:, None], 0.2 * (high - low))
    middle = np.clip(x, low + spacing, high - spacing)
    size = stencil.size
    lattice = square.parameters(middle[:, None] + spacing[:, None] * stencil[:, None])
    q, row = np.unique(lattice[..., 0], return_inverse=True)  # seeds on one row share its values
    p = np.repeat(lattice[..., 1], size, axis=0)
    out = on_rows(lambda own, x, names: solve(q[own, None], x, names), row.ravel(), p, wanted)
    f, _ = of_kind({name: values.reshape(-1, size, size) for name, values in out.items()}, kind)
    return f, out, middle, spacing.T
