"""Users' own equations: spikes of all widths, breaks beside the ends, stiff z, narrow gaps."""

import numpy as np

from survey.failures.plane import Plane, few, logarithmic, plain
from survey.request.user_scene import hill
from survey.truth import user_equations

ABOUT = """z is known only from its samples: a spike that is narrower than their spacing (T/128) can only be refused, or
found where its position is named as a break; a break beside an end leaves a piece of no length; a stiff z
takes thousands of steps. `auto` takes 16th-order Taylor steps, and double-double (z run once more with mpmath's
functions) where float64 leaves a verdict open."""


def planes(share):
    return [_spikes("spike", share), _spikes("spike named", share), _breaks(share), _stiff(share)]


def _scene(name):
    z, parameters, _kind, more = user_equations.OWN[name]
    return hill(z, parameters=parameters, **more)


def _spikes(name, share):
    """z = a + b / (1 + ((u - c) / d)^2), b d = 2."""
    width, a = np.linspace(-4.0, -0.7, few(share, 20)), np.linspace(0.0, 60.0, few(share, 16))
    d = 10.0 ** width[None]
    c = 0.37
    d = np.minimum(d, 0.24 * min(c, 1 - c)) if "named" in name else d
    words = "whose position is\na break" if "named" in name else "that is not\nnamed"
    return Plane(
        f"a spike {words}", logarithmic("half width of the spike, over $T$", width), plain("$a$", a), _scene(name),
        {"a": a[:, None], "b": 2.0 / d, "c": c, "d": d}, user_equations.true(name),
        "z = a + 2 / (d + (u - 0.37)^2 / d). Truth: Taylor series of order 30 in double-double.", slow=("rk4",),
    )  # fmt: skip


def _breaks(share):
    gap, b = np.linspace(-15.0, -0.31, few(share, 20)), np.linspace(-200.0, 1000.0, few(share, 16))
    return Plane(
        "a break beside\nthe start", logarithmic("position of the break, over $T$", gap), plain("$b$ behind it", b),
        _scene("meissner"), {"a": 3e4, "b": b[:, None], "c": 10.0 ** gap[None]}, user_equations.true("meissner"),
        "z = 3e4 before the break and b behind it. Truth: the closed form, 50 digits.",
    )  # fmt: skip


def _stiff(share):
    a, part = np.linspace(0.0, 7.0, few(share, 20)), np.linspace(-0.9, 1.1, few(share, 14))
    rate = 10.0 ** a[None]
    given = {name: 0.0 for name in user_equations.LONG_NAMES} | {
        "T": 1.0,
        "a": rate,
        "c1": rate * part[:, None],
        "c2": 0.3 * rate,
    }
    return Plane(
        "stiff z", logarithmic("size of $z$", a), plain("its first harmonic, over its mean", part),
        _scene("harmonics"), given, user_equations.true("harmonics"),
        "z = a (1 + c cos 2 pi u + 0.3 cos 4 pi u). Truth: Taylor series of order 30 in double-double.", slow=("rk4",),
    )  # fmt: skip
