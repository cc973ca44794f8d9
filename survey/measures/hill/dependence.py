"""How a user's function depends on some of its parameters: found by running its code on degrees
instead of numbers.

For each of these parameters a degree is 0 where a value does not depend on it, n where it is a
polynomial of degree n in it, ENTIRE where it is analytic for all its values, OPAQUE where nothing
is known. What is compared or rounded must not depend on them: then the code takes the same way for
all their values. u is a number, so branches may depend on it.
"""

import math
import operator

from survey.measures.hill import multiprecision

ENTIRE, OPAQUE = 10**6, math.inf
# Functions that are analytic everywhere; of others nothing is known.
ENTIRE_FUNCTIONS = frozenset({"sin", "cos", "sinh", "cosh", "exp", "expm1", "erf", "erfc"})
OTHER_NAMES = {
    "fabs": abs,
    "sign": lambda x: (x > 0) - (x < 0),
    "power": operator.pow,
    "mpf": float,
}


class Unknown(Exception):
    """The dependence cannot be found; says why."""


class StandIn:
    """What runs in a user's code instead of numbers and tells something of them in which signs do
    not matter; a subclass knows sums and products. Code that decides by it is refused.
    """

    __slots__ = ()

    def __radd__(self, other):
        return self + other

    __sub__ = __rsub__ = __radd__

    def __rmul__(self, other):
        return self * other

    def __neg__(self):
        return self

    __pos__ = __neg__

    def _refused(self, *_):
        raise Unknown("it branches on a parameter")

    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __bool__ = __int__ = __float__ = (
        __index__
    ) = _refused
    __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = __round__ = __floor__ = __ceil__ = _refused
    __hash__ = None


class Degrees(StandIn):
    """What stands for a value that depends on parameters: its degree in each."""

    __slots__ = ("of",)

    def __init__(self, of):
        self.of = tuple(of)

    def __add__(self, other):
        return Degrees(map(max, self.of, self._of(other)))

    def __mul__(self, other):
        return Degrees(map(_product, self.of, self._of(other)))

    def __truediv__(self, other):
        return self * Degrees(_at_most(self._of(other), OPAQUE))

    def __rtruediv__(self, other):
        return Degrees(_at_most(self.of, OPAQUE)) * other

    def __pow__(self, other):
        if isinstance(other, (int, float)) and other >= 0 and other == int(other):
            return Degrees(OPAQUE if d == OPAQUE else min(d * int(other), ENTIRE) for d in self.of)
        return Degrees(_at_most(map(max, self.of, self._of(other)), OPAQUE))

    def __rpow__(self, other):
        return Degrees(_at_most(self.of, ENTIRE if other > 0 else OPAQUE))

    def __abs__(self):
        return Degrees(_at_most(self.of, OPAQUE))

    def _of(self, other):
        return other.of if isinstance(other, Degrees) else (0,) * len(self.of)


def _product(a, b):
    return OPAQUE if OPAQUE in (a, b) else min(a + b, ENTIRE)


def _at_most(degrees, what):
    """The degrees of a function that is `what` of a value of these."""
    return (0 if d == 0 else max(d, what) for d in degrees)


class _Functions:
    """The functions that `multiprecision.lift` gives to the code: those of `math`, of numbers and
    of degrees.
    """

    def __getattr__(self, name):
        plain = OTHER_NAMES.get(name) or getattr(math, name)

        def call(*given):
            symbols = [x for x in given if isinstance(x, Degrees)]
            if not symbols:
                return plain(*given)
            if name in ("mpf", "degrees", "radians"):
                return symbols[0]
            if name == "power":
                return operator.pow(*given)
            if name in ("floor", "ceil", "sign", "fmod"):
                symbols[0]._refused()
            of = map(max, *(x.of for x in symbols)) if len(symbols) > 1 else symbols[0].of
            return Degrees(_at_most(of, ENTIRE if name in ENTIRE_FUNCTIONS else OPAQUE))

        return call


def degrees(function, fixed, at=()):
    """The highest degree of function(u, p) in each parameter over the u of `at`: 0 of those that
    are `fixed` (a number, else None). Without `at` the function takes p alone, and may return
    several numbers. Raises Unknown.
    """
    free = [k for k, value in enumerate(fixed) if value is None]
    p = [
        Degrees(int(k == i) for i in free) if value is None else value
        for k, value in enumerate(fixed)
    ]
    found = (0,) * len(free)
    try:
        made = multiprecision.lift(function, _Functions())
        for arguments in [(u, p) for u in at] or [(p,)]:
            value = made(*arguments)
            for part in value if isinstance(value, (tuple, list)) else [value]:
                if isinstance(part, Degrees):
                    found = tuple(map(max, found, part.of))
                elif not isinstance(part, (bool, int, float)):
                    raise Unknown("it returns something that is not a number")
    except Exception as error:  # a user's code may raise anything
        raise Unknown(f"{type(error).__name__}: {error}") from None
    known = dict(zip(free, found, strict=True))
    return [known.get(k, 0) for k in range(len(fixed))]
