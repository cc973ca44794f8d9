"""A map of two parameters as the unit square: positions in it, logarithmic along a logarithmic axis."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Square:
    """Ends of both axes (2), ascending, and which of them are logarithmic.

    `across`: the position on the second axis, 0 or 1, of the border that alone is asked for; None:
    the whole square is.
    """

    low: np.ndarray
    high: np.ndarray
    log: np.ndarray
    across: float | None = None

    def parameters(self, x):
        """Parameters (..., 2) at positions (..., 2); exact at the border."""
        low, high = self._scaled(self.low), self._scaled(self.high)
        value = low + x * (high - low)
        value = np.where(self.log, np.exp(np.where(self.log, value, 0.0)), value)
        return np.where(x == 0, self.low, np.where(x == 1, self.high, value))

    def positions(self, parameters):
        """Positions (..., 2) of parameters (..., 2)."""
        low, high = self._scaled(self.low), self._scaled(self.high)
        return (self._scaled(parameters) - low) / (high - low)

    @property
    def grain(self):
        """The rounding of a position."""
        ends = abs(self._scaled(np.stack([self.low, self.high]))).max(axis=0) + self.log
        return float((np.spacing(ends) / (self._scaled(self.high) - self._scaled(self.low))).max())

    def _scaled(self, values):
        return np.where(self.log, np.log(np.where(self.log, values, 1.0)), values)
