"""What becomes of a satellite's motions as k -> 1: each passage along the separatrix scatters waves
of the plateau.

With X = Re f f'* at 0 (`kernels.hill.scattering`) and the plateau's wave number q, sinh of the passage's rapidity is
|X|/q: |t| = 1/cosh, |r| = tanh. For librations the passages at rho and -rho alternate, for rotations all are alike.
Over the phase 2 K q the unstable share, the mean growth (Avila and Bochi: log of (|A| + 1/|A|)/2 each) and the largest
one are elementary. An oblate body with |rho| < 1 has an evanescent plateau, and passages amplify.

Source: derived in `scenes/satellite.md`; A. Avila, J. Bochi, Israel J. Math. 131 (2002) 125.
"""

import numpy as np

from survey.kernels.hill import scattering
from survey.kernels.math.roundoff import EPS

LARGEST_RHO = 1e3  # the wave is followed, step by step
_WAVES = "where waves pass: rho != 0, and |rho| > 1 if oblate; |rho| <= 1000"
_DECAY = "to an oblate body with |rho| < 1, whose plateau between the passages is evanescent"
_EACH = "of ln |y| per passage along the separatrix, as k -> 1"
NAMES = {
    "separatrix_transmission": (
        "transmission of a passage along the separatrix, w = sech u",
        r"t_+",
        _WAVES,
    ),
    "separatrix_transmission_back": (
        "transmission of a passage against it, w = -sech u",
        r"t_-",
        _WAVES,
    ),
    "separatrix_unstable_share": ("share of unstable K as k -> 1", r"S", _WAVES),
    "separatrix_growth": (f"mean growth {_EACH}", r"\bar\gamma", _WAVES),
    "separatrix_largest_growth": (f"largest growth {_EACH}", r"\hat\gamma", _WAVES),
    "separatrix_amplification": (
        "factor of the growing wave in a passage, w = sech u",
        r"a_+",
        _DECAY,
    ),
    "separatrix_amplification_back": (
        "factor of the growing wave in a passage, w = -sech u",
        r"a_-",
        _DECAY,
    ),
}


def solve(rho, rotates, oblate, wanted):
    """{name: (values, bars)} of those `wanted`, at rho (n, m), for rows that rotate or librate (n, 1)."""
    wanted = wanted & NAMES.keys()
    if not wanted:
        return {}
    square = (rho - 1.0) * (rho + 1.0) if oblate else rho * rho
    known = np.isfinite(rho) & (square != 0.0) & (np.abs(rho) <= LARGEST_RHO)
    distinct, where = np.unique(rho[known], return_inverse=True)
    m = (distinct - 1.0) * (distinct + 1.0) if oblate else distinct * distinct
    passages = []
    for side in (1.0, -1.0):
        out = np.empty((distinct.size, scattering.PASSAGE))
        scattering.jost(side * distinct, m, np.sqrt(np.abs(m)), m > 0, out)
        there = np.full((scattering.PASSAGE, *rho.shape), np.nan)
        there[:, known] = out[where].T
        passages.append(there)
    rate = np.sqrt(np.abs(square))
    with np.errstate(divide="ignore", invalid="ignore"):
        found = _decaying(passages, rate, square < 0) | _passing(
            passages, rate, square > 0, rotates
        )
    return {name: found[name] for name in wanted}


def _decaying(passages, rate, those):
    """Wronskian of f(u) and f(-u) over 2 nu: -f f'/nu."""
    found = {}
    for name, passage in zip(("amplification", "amplification_back"), passages, strict=True):
        product, bar = passage[scattering.PRODUCT], passage[scattering.PRODUCT_BAR]
        value = -product / rate
        found[f"separatrix_{name}"] = _kept(those, value, bar / rate + 4.0 * EPS * np.abs(value))
    return found


def _passing(passages, rate, those, rotates):
    """From the rapidities a of both passages: t = 1/cosh a."""
    rapidities = []
    for passage in passages:
        product, bar = passage[scattering.PRODUCT], passage[scattering.PRODUCT_BAR]
        sinh = np.abs(product) / rate
        rapidities.append(
            (np.arcsinh(sinh), (bar / rate + 4.0 * EPS * sinh) / np.hypot(1.0, sinh) + 4.0 * EPS)
        )
    (one, off), (two, other) = rapidities
    most = np.maximum(one, two)
    greatest, blur = np.where(rotates, one, most), np.where(rotates, off, np.maximum(off, other))
    # gd(a) = acos(1/cosh a)
    angle = 2.0 * np.arctan(np.tanh(0.5 * greatest))
    means = [
        (np.logaddexp(a, -a) - np.log(2.0), np.tanh(a) * bar + 4.0 * EPS * (1.0 + a))
        for a, bar in rapidities
    ]
    (mean, slack), (mean_back, slack_back) = means
    found = {
        "transmission": (1.0 / np.cosh(one), off / np.cosh(one) + 4.0 * EPS),
        "transmission_back": (1.0 / np.cosh(two), other / np.cosh(two) + 4.0 * EPS),
        "unstable_share": (2.0 / np.pi * angle, 2.0 / np.pi * blur + 4.0 * EPS),
        "growth": (
            np.where(rotates, mean, 0.5 * (mean + mean_back)),
            np.maximum(slack, slack_back),
        ),
        "largest_growth": (np.where(rotates, one, 0.5 * (one + two)), np.maximum(off, other)),
    }
    return {f"separatrix_{name}": _kept(those, *pair) for name, pair in found.items()}


def _kept(those, value, bar):
    return np.where(those, value, np.nan), np.where(those, bar, np.nan)
