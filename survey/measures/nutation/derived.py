"""Outputs of a nutation that are derived from its period and advances: frequencies, mean rates,
rotation numbers.

One entry of DERIVED is one output: `of` takes (value, error bound) of each of its `parts` and
returns its own.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation.lanes import NAMES

TURN = 2.0 * np.pi
FINITE = "off separatrices, where the period is infinite"


def branch(unit):
    """The convention for advances, in words."""
    return (
        f"{FINITE}; not reduced: jumps by {unit} where p_psi - p_phi (u = 1) or p_psi + p_phi (u = -1) changes its sign"
        " on motions that pass that pole, and is the mean of both limits there"
    )


@dataclass(frozen=True)
class Derived:
    """An output, the outputs that it is derived from, and how."""

    name: str
    long_name: str
    symbol: str
    applies: str
    parts: tuple[str, ...]
    of: Callable
    units: str = "1"


def _frequency(period):
    T, bar = period
    value = TURN / T
    return value, value * (bar / (T - bar) + 4.0 * ROUNDOFF)


def _rate(angle, period):
    (advance, rough), (T, bar) = angle, period
    value = advance / T
    return value, (rough + np.abs(value) * bar) / (T - bar) + 2.0 * ROUNDOFF * np.abs(value)


def _number(angle):
    advance, rough = angle
    value = advance / TURN
    return value, rough / TURN + 3.0 * ROUNDOFF * np.abs(value)


_BY_RATE, _BY_ONE = branch("2 pi / T"), branch("1")
DERIVED = (
    Derived("nutation_frequency", "frequency of the nutation", r"2\pi / T", FINITE, ("period",), _frequency),
    Derived("precession_rate", "mean rate of precession", r"\Delta\psi / T", _BY_RATE, ("precession", "period"),
            _rate),
    Derived("spin_rate", "mean rate of spin", r"\Delta\varphi / T", _BY_RATE, ("spin", "period"), _rate),
    Derived("precession_number", "rotation number of the precession", r"\Delta\psi / 2\pi", _BY_ONE, ("precession",),
            _number),
    Derived("spin_number", "rotation number of the spin", r"\Delta\varphi / 2\pi", _BY_ONE, ("spin",), _number),
)  # fmt: skip
PARTS = {one.name: set(one.parts) for one in DERIVED}


def needed(wanted):
    """The outputs that `wanted` takes: themselves, or what they are derived from; NAMES if it is empty."""
    return set().union(*(PARTS.get(name, {name}) for name in wanted or NAMES))


def solve(out, wanted):
    """{name: values, name_error: bars} of those `wanted`, from the nutations `out`."""
    found = {}
    with np.errstate(invalid="ignore"):
        for one in DERIVED:
            if one.name in wanted:
                parts = ((out[name], out[f"{name}_error"]) for name in one.parts)
                found[one.name], found[f"{one.name}_error"] = one.of(*parts)
    return found
