"""A user's z(u, p) as a formula that `survey-check` reads: its Python code, run on symbols instead
of numbers.

Decimal constants in the code are taken as the decimals that Python prints for them; constants that
are simple multiples of pi to the last bit are taken as these.
"""

import ast
import math
from fractions import Fraction

from survey.measures.hill.multiprecision import Unsupported, lift

FUNCTIONS = {  # in those that `survey-check` has
    "sin": "sin({0})", "cos": "cos({0})", "tan": "(sin({0})/cos({0}))", "exp": "exp({0})",
    "sinh": "((exp({0}) - exp(-{0}))/2)", "cosh": "((exp({0}) + exp(-{0}))/2)",
    "tanh": "(1 - 2/(exp(2*{0}) + 1))", "log": "log({0})", "sqrt": "sqrt({0})",
}  # fmt: skip
TRIED = 33  # positions within a piece at which a comparison must turn out alike
LARGEST_DENOMINATOR = 12


def formula(z, names, piece):
    """z(u, p) as text, in u and the `names` of p (or their decimals); raises Unsupported.

    `piece`: the ends of the piece of u to which the formula applies: comparisons of u alone must
    turn out alike in it.
    """
    low, high = piece
    samples = tuple(low + (high - low) * (i + 0.5) / TRIED for i in range(TRIED))
    try:
        found = lift(z, _Functions())(
            FormulaText("u", samples), [FormulaText(name) for name in names]
        )
    except Unsupported:
        raise
    except Exception as error:
        raise Unsupported(f"{type(error).__name__}: {error}") from None
    return ast.unparse(
        ast.parse(found.text if isinstance(found, FormulaText) else number(found), mode="eval")
    )


def number(value):
    """A real number as it stands in a formula."""
    if not isinstance(value, (bool, int, float)) or not math.isfinite(value):
        raise Unsupported(f"it returns {value!r}, which is not a real number")
    turns = Fraction(float(value) / math.pi).limit_denominator(LARGEST_DENOMINATOR)
    if turns and abs(float(turns) * math.pi - value) <= 2 * math.ulp(value):
        times = "" if abs(turns.numerator) == 1 else f"{abs(turns.numerator)}*"
        over = "" if turns.denominator == 1 else f"/{turns.denominator}"
        text = f"{'-' if turns < 0 else ''}{times}pi{over}"
        return text if text == "pi" else f"({text})"
    return repr(value + 0) if value >= 0 else f"({value + 0!r})"


class FormulaText:
    """A formula; `samples`: its values at some u, where it depends on u alone."""

    def __init__(self, text, samples=None):
        self.text, self.samples = text, samples

    def _with(self, other, operator, own, swapped=False):
        if not isinstance(other, (FormulaText, bool, int, float)):
            return NotImplemented
        text = other.text if isinstance(other, FormulaText) else number(other)
        first, second = (text, self.text) if swapped else (self.text, text)
        values = other.samples if isinstance(other, FormulaText) else (float(other),) * TRIED
        samples = None
        if self.samples and values:
            pairs = zip(
                *((values, self.samples) if swapped else (self.samples, values)), strict=True
            )
            samples = tuple(own(x, y) for x, y in pairs)
        return FormulaText(f"({first} {operator} {second})", samples)

    def __add__(self, other):
        return self._with(other, "+", lambda x, y: x + y)

    def __radd__(self, other):
        return self._with(other, "+", lambda x, y: x + y, True)

    def __sub__(self, other):
        return self._with(other, "-", lambda x, y: x - y)

    def __rsub__(self, other):
        return self._with(other, "-", lambda x, y: x - y, True)

    def __mul__(self, other):
        return self._with(other, "*", lambda x, y: x * y)

    def __rmul__(self, other):
        return self._with(other, "*", lambda x, y: x * y, True)

    def __truediv__(self, other):
        return self._with(other, "/", _quotient)

    def __rtruediv__(self, other):
        return self._with(other, "/", _quotient, True)

    def __neg__(self):
        return FormulaText(f"(-{self.text})", self.samples and tuple(-x for x in self.samples))

    def __pos__(self):
        return self

    def __pow__(self, exponent):
        if not isinstance(exponent, FormulaText) and exponent == 0.5:
            return _Functions().sqrt(self)
        if isinstance(exponent, FormulaText) or exponent != int(exponent) or abs(exponent) > 64:
            raise Unsupported("it raises to a power that is not a whole number of at most 64")
        text = f"({self.text})**{abs(int(exponent))}"
        samples = self.samples and tuple(_quotient(1, x ** -int(exponent)) if exponent < 0 else x ** int(exponent)
                                         for x in self.samples)  # fmt: skip
        return FormulaText(f"(1/{text})" if exponent < 0 else text, samples)

    def __rpow__(self, base):
        return _Functions().exp(self * math.log(base))

    def _compared(self, other, holds):
        difference = self - other
        found = {holds(x) for x in difference.samples or ()}
        if len(found) != 1:
            raise Unsupported(
                "it branches within a piece: name each position in BREAKS"
                if found
                else "it branches on a parameter"
            )
        return found.pop()

    def __lt__(self, other):
        return self._compared(other, lambda x: x < 0)

    def __le__(self, other):
        return self._compared(other, lambda x: x <= 0)

    def __gt__(self, other):
        return self._compared(other, lambda x: x > 0)

    def __ge__(self, other):
        return self._compared(other, lambda x: x >= 0)

    def __abs__(self):
        return self if self >= 0 else -self

    def __bool__(self):
        raise Unsupported("it tests whether an unknown number is zero")

    def __eq__(self, other):
        raise Unsupported("it tests whether unknown numbers are equal")

    __hash__ = None


def _quotient(x, y):
    return x / y if y else math.nan


class _Functions:
    """What stands for a context of mpmath: its functions on symbols."""

    @staticmethod
    def mpf(x):
        """A number as it is."""
        return x

    def __getattr__(self, name):
        if name in FUNCTIONS:
            return lambda x: _call(name, x)
        if name == "fabs":
            return abs
        if name == "power":
            return lambda x, y: x**y
        raise Unsupported(f"it uses {name}, which formulas do not have: use {', '.join(FUNCTIONS)}")


def _call(name, x):
    own = getattr(math, name)
    if not isinstance(x, FormulaText):
        return own(x)
    text = f"({x.text})" if "-{0}" in FUNCTIONS[name] or "*{0}" in FUNCTIONS[name] else x.text
    return FormulaText(
        FUNCTIONS[name].format(text), x.samples and tuple(own(value) for value in x.samples)
    )
