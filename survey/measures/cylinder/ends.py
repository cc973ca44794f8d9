"""The ends w -> +-inf of a user's flow, phi' = w, w' = f(phi) w + g(phi), with f, g of the period 2
pi.

With F' = f and y = w - F, y' = dy/dphi = g / (y + F): over a turn w grows by 2 pi mean(f), and
where that is 0 by

    2 pi mean(g) / w,  then  pi K / w^2, K = -(1/pi) int g F dphi,  then  L / w^3, L = int g F^2 dphi,

each where those before it vanish (then K does not depend on the constant of F, nor L). On w < 0 a
turn leads to smaller phi: so mean(f) and K let both ends attract where they are positive, mean(g)
and L w -> +inf alone. For the gyrostat, whose f and g have mean 0, K and L are those of
`gyrostat.md`.
"""

from dataclasses import dataclass

import numpy as np

from survey.kernels.cylinder import program as pg

FEWEST, MOST = 64, 65536  # samples of the circle
ROUNDING = 1e-15  # of a mean, relative to the size of its terms


@dataclass(frozen=True)
class Ends:
    """mean(f), mean(g), K, L with their error bounds; 0 where the bound reaches it."""

    mean_f: float
    mean_g: float
    K: float
    L: float
    bars: tuple[float, float, float, float]
    attract: np.ndarray  # w -> +inf, w -> -inf: 1, -1, or 0 where that is not decided

    @property
    def decides(self):
        """The number (from 0) of the first of the four that is not 0; 4 where all are."""
        return _first((self.mean_f, self.mean_g, self.K, self.L))


def _first(values):
    return next((i for i, value in enumerate(values) if value), len(values))


def of(row):
    """The Ends of the flow `row` of `equation.program`."""
    number = FEWEST
    before = None
    sizes = np.array([row[pg.BOUND_F], row[pg.BOUND_G]])
    while True:
        found = _integrals(row, number)
        if before is not None:
            missed = abs(found - before)
            scale = np.array([*sizes, 8 * sizes[0] * sizes[1], 64 * sizes[0] ** 2 * sizes[1]])
            bars = 2.0 * missed + ROUNDING * scale
            if (missed <= ROUNDING * scale).all() or number == MOST:
                break
        before, number = found, 2 * number
    values = [
        0.0 if abs(value) <= bar else float(value) for value, bar in zip(found, bars, strict=True)
    ]
    signs = np.sign(values)
    decides = _first(values)
    attract = (
        np.zeros(2)
        if decides == len(values)
        else signs[decides] * np.array([[1, 1], [1, -1]])[decides % 2]
    )
    return Ends(*values, tuple(bars.tolist()), attract)


def _integrals(row, number):
    """mean(f), mean(g), K and L by the trapezoidal rule, which converges geometrically, F by its
    Fourier series.
    """
    f, g = _sampled(row, number)
    k = np.fft.rfftfreq(number, 1 / number)
    series = np.fft.rfft(f)
    series[1:] /= 1j * k[1:]
    series[0] = series[-1] = 0.0
    F = np.fft.irfft(series, number)
    return np.array([f.mean(), g.mean(), -2 * (g * F).mean(), 2 * np.pi * (g * F * F).mean()])


def _sampled(row, number):
    """f and g at evenly spread angles, from 0 on."""
    values = np.full((1, 2, number), np.nan)
    pg.sampled(row[None], values)
    return values[0]


def potential(row, angles):
    """V = -int (g - mean g) at the angles, to a few digits: which saddle is the highest."""
    _f, g = _sampled(row, 1024)
    total = -np.cumsum(g - g.mean()) * (2 * np.pi / len(g))
    at = np.linspace(0.0, 2 * np.pi, len(g), endpoint=False)
    return np.interp(np.asarray(angles) % (2 * np.pi), at, total)
