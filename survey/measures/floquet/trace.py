"""A user's A(t, p) as a sum of few functions of t, found by running it once on symbols instead of
numbers.

    A_ij(t, p) = sum over terms of number(p) * basis(t, p)

A *number* depends on the parameters alone, and is computed for all points at once; a *basis*
function depends on t, and is a power series in each step: a `Graph` records how both follow from
the parameters and from t. What depends on t must be analytic: + - * / ** and FUNCTIONS. Branches
are followed as they go at one example point; each comparison that decided one becomes a *guard*,
and other points for which a guard decides otherwise are traced on their own.

The states x of a nonlinear system x' = f(t, x, p) are basis functions, too, whose series follow
from that of f; the derivatives of f by them are those of the recorded operations.

Numbers in the code are taken as exact binary64 numbers. With every value goes a bound of its
rounding error.
"""

import builtins
import math
import operator
from functools import cached_property, partial
from types import CellType, CodeType, FunctionType, MethodType, ModuleType

import numpy as np

from survey.kernels.floquet import program as pg
from survey.kernels.jit import fresh
from survey.kernels.math import chebyshev
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.measures.floquet.halves import Waves

HIGHEST = 64  # the largest exponent that is multiplied out
MOST = 4000  # numbers, or basis functions
EXPANDED = 9  # products of sums of more terms are not multiplied out
ONE, TIME = 0, 1  # the first two basis functions
# Where guards are tested, as shares of a piece, and the number of them.
TRIED = chebyshev.shares(33)
DISPATCHER = type(fresh(lambda: None))


class Unsupported(Exception):
    """The function cannot be traced; says why, and what to do."""

    def __init__(
        self, why, remedy="use + - * / ** and functions such as sin, exp, sqrt of math or numpy"
    ):
        super().__init__(why)
        self.remedy = remedy


def _power(x, y):
    with np.errstate(all="ignore"):
        return np.power(x, y)


# Of numbers: the function and its derivative, from which the rounding error follows.
FUNCTIONS = {
    "sin": (np.sin, np.cos),
    "cos": (np.cos, np.sin),
    "tan": (np.tan, lambda x: 1 / np.cos(x) ** 2),
    "asin": (np.arcsin, lambda x: 1 / np.sqrt(1 - x * x)),
    "acos": (np.arccos, lambda x: 1 / np.sqrt(1 - x * x)),
    "atan": (np.arctan, lambda x: 1 / (1 + x * x)),
    "sinh": (np.sinh, np.cosh),
    "cosh": (np.cosh, np.sinh),
    "tanh": (np.tanh, lambda x: 1 / np.cosh(x) ** 2),
    "asinh": (np.arcsinh, lambda x: 1 / np.sqrt(1 + x * x)),
    "acosh": (np.arccosh, lambda x: 1 / np.sqrt(x * x - 1)),
    "atanh": (np.arctanh, lambda x: 1 / (1 - x * x)),
    "exp": (np.exp, np.exp),
    "log": (np.log, lambda x: 1 / x),
    "sqrt": (np.sqrt, lambda x: 0.5 / np.sqrt(x)),
    "erf": (np.vectorize(math.erf, otypes=[float]), lambda x: 2 / np.sqrt(np.pi) * np.exp(-x * x)),
}
# The derivative of a function of the symbol x, y its value; sin and cos need each other.
SLOPES = {
    "tan": lambda x, y: 1 + y * y,
    "asin": lambda x, y: 1 / call("sqrt", 1 - x * x),
    "acos": lambda x, y: -1 / call("sqrt", 1 - x * x),
    "atan": lambda x, y: 1 / (1 + x * x),
    "tanh": lambda x, y: 1 - y * y,
    "asinh": lambda x, y: 1 / call("sqrt", 1 + x * x),
    "acosh": lambda x, y: 1 / call("sqrt", x * x - 1),
    "atanh": lambda x, y: 1 / (1 - x * x),
    "log": lambda x, y: 1 / x,
    "sqrt": lambda x, y: 0.5 / y,
    "erf": lambda x, y: call("exp", -(x * x)) * (2 / math.sqrt(math.pi)),
}
# Functions whose derivatives are each other's or their own, with the sign.
COUPLED = {
    "sin": ("cos", 1.0),
    "cos": ("sin", -1.0),
    "sinh": ("cosh", 1.0),
    "cosh": ("sinh", 1.0),
    "exp": ("exp", 1.0),
}
ACCURATE = ("sin", "cos", "exp", "log", "sqrt")  # rounded to 1 ulp
NUMPY = {
    np.arcsin: "asin", np.arccos: "acos", np.arctan: "atan", np.arcsinh: "asinh", np.arccosh: "acosh",
    np.arctanh: "atanh",
}  # fmt: skip
OTHERS = {
    "expm1": lambda x: call("exp", x) - 1,
    "log1p": lambda x: call("log", 1 + x),
    "log10": lambda x: call("log", x) / math.log(10),
    "log2": lambda x: call("log", x) / math.log(2),
    "hypot": lambda x, y: call("sqrt", x * x + y * y),
    "radians": lambda x: x * (math.pi / 180),
    "degrees": lambda x: x * (180 / math.pi),
    "pow": operator.pow,
    "fabs": abs,
    "floor": lambda x: x.__floor__(),
    "ceil": lambda x: -((-x).__floor__()),
    "fmod": lambda x, y: x - y * (1 if x * y > 0 else -1) * math.floor(abs(x / y)),
    "copysign": lambda x, y: abs(x) if y >= 0 else -abs(x),
    "atan2": lambda y, x: _atan2(y, x),
    "cbrt": lambda x: (
        call("exp", call("log", x) / 3) if x > 0 else -call("exp", call("log", -x) / 3)
    ),
}
UFUNCS = {
    "add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "divide": operator.truediv,
    "true_divide": operator.truediv, "power": operator.pow, "float_power": operator.pow, "negative": operator.neg,
    "positive": operator.pos, "absolute": abs, "square": lambda x: x * x, "reciprocal": lambda x: 1 / x,
    "maximum": lambda x, y: x if x > y else y, "minimum": lambda x, y: x if x < y else y, "less": operator.lt,
    "less_equal": operator.le, "greater": operator.gt, "greater_equal": operator.ge, "equal": operator.eq,
    "not_equal": operator.ne, "floor_divide": operator.floordiv, "remainder": operator.mod, "mod": operator.mod,
    "sign": lambda x: (x > 0) - (x < 0), "deg2rad": OTHERS["radians"], "rad2deg": OTHERS["degrees"],
}  # fmt: skip


def _atan2(y, x):
    if abs(x) >= abs(y):
        return call("atan", y / x) + (0 if x > 0 else math.pi if y >= 0 else -math.pi)
    return (math.pi / 2 if y > 0 else -math.pi / 2) - call("atan", x / y)


def call(name, *given):
    """The function of this name of symbols or numbers."""
    if not any(isinstance(x, Symbol) for x in given):
        return getattr(math, name)(*given)
    if name in FUNCTIONS and len(given) == 1:
        return given[0].graph.function(name, given[0])
    if name in OTHERS:
        return OTHERS[name](*given)
    raise Unsupported(f"it uses {name} of t or of a parameter")


class Symbol:
    """A value that depends on t or on parameters: {basis: number} of a graph, and its value at the
    example.
    """

    def __init__(self, graph, terms, value):
        self.graph, self.terms, self.value = graph, terms, value

    @property
    def is_number(self):
        """Does it depend on parameters alone?"""
        return all(basis == ONE for basis in self.terms)

    def _with(self, operation, left, right):
        """The operation of the graph on both; numpy's arrays take it entry by entry."""
        if any(isinstance(x, np.ndarray) and x.ndim for x in (left, right)):
            return NotImplemented
        return operation(left, right)

    def __add__(self, other):
        return self._with(self.graph.sum, self, other)

    def __mul__(self, other):
        return self._with(self.graph.product, self, other)

    def __neg__(self):
        return self.graph.product(self, -1.0)

    def __sub__(self, other):
        return self._with(lambda x, y: self.graph.sum(x, -y), self, other)

    def __rsub__(self, other):
        return self._with(lambda x, y: self.graph.sum(x, -y), other, self)

    def __truediv__(self, other):
        return self._with(self.graph.quotient, self, other)

    def __rtruediv__(self, other):
        return self._with(self.graph.quotient, other, self)

    def __pow__(self, exponent):
        return self._with(self.graph.power, self, exponent)

    def __rpow__(self, base):
        return self._with(self.graph.power, base, self)

    __radd__, __rmul__ = __add__, __mul__

    def __pos__(self):
        return self

    def __abs__(self):
        return self if self >= 0 else -self

    def __floor__(self):
        floored = math.floor(self.value)
        self.graph.guard(self - floored, True)
        self.graph.guard(floored + 1 - self, True)
        return floored

    def __floordiv__(self, other):
        return (self / other).__floor__()

    def __rfloordiv__(self, other):
        return (other / self).__floor__()

    def __mod__(self, other):
        return self - other * (self / other).__floor__()

    def __rmod__(self, other):
        return other - self * (other / self).__floor__()

    def __lt__(self, other):
        return self.graph.guard(other - self, (_value(other) - self.value) > 0)

    def __gt__(self, other):
        return self.graph.guard(self - other, (self.value - _value(other)) > 0)

    def __le__(self, other):
        return not self > other

    def __ge__(self, other):
        return not self < other

    def __eq__(self, other):
        same = self.value == _value(other)
        self.graph.equalities.append((self - other, same))
        return same

    def __ne__(self, other):
        return not self == other

    def __bool__(self):
        return self != 0

    __hash__ = None

    def __float__(self):
        raise Unsupported(
            "it needs the value of t or of a parameter (float, int, an array without dtype=object, or math "
            "in a method that another one calls, where numpy serves)"
        )

    __int__ = __index__ = __complex__ = __float__

    def __array_ufunc__(self, ufunc, method, *given, **keywords):
        if any(isinstance(x, np.ndarray) for x in given):
            given = [np.array(x, dtype=object) if isinstance(x, Symbol) else x for x in given]
            return (
                getattr(ufunc, method)(*given, **keywords)
                if method == "__call__"
                else NotImplemented
            )
        given = [x.item() if isinstance(x, np.generic) else x for x in given]
        name = NUMPY.get(ufunc, ufunc.__name__)
        if method == "__call__" and name in UFUNCS:
            return UFUNCS[name](*given)
        return call(name, *given)

    def __getattr__(self, name):
        # numpy calls x.sin() of the objects in an array
        if (
            name in FUNCTIONS
            or name in OTHERS
            or name in UFUNCS
            or name in ("arcsin", "arccos", "arctan")
        ):
            ufunc = getattr(np, name, None)
            return lambda *more: (
                UFUNCS[name](self, *more)
                if name in UFUNCS
                else call(NUMPY.get(ufunc, name), self, *more)
            )
        raise AttributeError(name)


def _value(x):
    return x.value if isinstance(x, Symbol) else float(x)


class Graph:
    """How numbers follow from the parameters, and basis functions from t.

    `numbers` are tuples (operation, operands ...), `series` too; `guards` are (symbol, is it
    positive?).
    """

    def __init__(self, point, time):
        self.numbers = []
        self.series = [("one",), ("time",)]
        self.guards = []
        self.equalities = []
        self._number_places, self._series_places = {}, {}
        self.values = []  # of the numbers at the example
        self.shared = [True, True]  # does the basis function depend on t alone?
        self.flow = {}  # the symbol of f for the basis function that is its state
        self._slopes = {}
        self.parameters = [
            self.symbol(self.number("parameter", k), value) for k, value in enumerate(point)
        ]
        self.time = Symbol(self, {TIME: self.constant(1.0)}, time)

    def state(self, number, value):
        """A state of a nonlinear system as a symbol; the number at this node is where its series begins."""
        return Symbol(self, {self.basis("state", number): self.constant(1.0)}, value)

    def symbol(self, number, value):
        """The number at this node as a symbol."""
        return Symbol(self, {ONE: number}, value)

    def constant(self, value):
        """The node of a constant."""
        return self.number("constant", float(value))

    def is_constant(self, node):
        """Is the number the same for all parameters?"""
        return self.numbers[node][0] == "constant"

    def number(self, operation, *operands):
        """The node of this number: the same for the same operation; constants are folded."""
        key = (operation, *operands)
        if operation not in ("constant", "parameter") and all(
            self.is_constant(k) for k in operands
        ):
            folded = self._folded(operation, [self.numbers[k][1] for k in operands])
            if folded is not None:
                return folded
        if key not in self._number_places:
            if len(self.numbers) >= MOST:
                raise Unsupported(f"it needs more than {MOST:,} operations")
            self._number_places[key] = len(self.numbers)
            self.numbers.append(key)
        return self._number_places[key]

    def _folded(self, operation, values):
        """The constant of an operation on constants, where it is exact."""
        exact = {
            "add": lambda x, y: x + y if x + y - x == y and x + y - y == x else None,
            "multiply": lambda x, y: (
                x * y if abs(x) in (0.0, 1.0) or abs(y) in (0.0, 1.0, 2.0, 0.5) else None
            ),
        }
        value = exact[operation](*values) if operation in exact else None
        return None if value is None or not math.isfinite(value) else self.constant(value)

    def basis(self, operation, *operands):
        """The node of this basis function."""
        key = (operation, *operands)
        if key not in self._series_places:
            if len(self.series) >= MOST:
                raise Unsupported(f"it needs more than {MOST:,} operations on t")
            self._series_places[key] = len(self.series)
            self.series.append(key)
            if operation == "combination":
                self.shared.append(
                    all(self.shared[b] and self.is_constant(c) for b, c in operands[0])
                )
            elif operation == "state":
                self.shared.append(False)
            else:
                self.shared.append(all(self.shared[b] for b in operands[:2] if isinstance(b, int)))
        return self._series_places[key]

    def guard(self, symbol, positive):
        """Note that the symbol's sign decides a branch; returns `positive`."""
        if isinstance(symbol, Symbol):
            self.guards.append((symbol, positive))
        return positive

    def lift(self, x):
        """A number of Python as a symbol."""
        if isinstance(x, Symbol):
            return x
        if isinstance(x, (bool, int, float, np.integer, np.floating, np.bool_)):
            return self.symbol(self.constant(x), float(x))
        if isinstance(x, np.ndarray) and x.ndim == 0:
            return self.lift(x.item())
        raise Unsupported(f"{type(x).__name__} is not a real number")

    def entry(self, x, call):
        """What a function, written as `call`, put into its array, as a symbol."""
        try:
            return self.lift(x)
        except Unsupported as error:
            raise Unsupported(
                f"{call} fills in an entry that is not a number: {error}", "give one number each"
            ) from None

    def sum(self, x, y):
        """x + y."""
        x, y = self.lift(x), self.lift(y)
        terms = dict(x.terms)
        for basis, number in y.terms.items():
            terms[basis] = (
                self.number("add", *sorted((terms[basis], number))) if basis in terms else number
            )
        return Symbol(self, self._without_zeros(terms), x.value + y.value)

    def _without_zeros(self, terms):
        kept = {b: c for b, c in terms.items() if self.numbers[c] != ("constant", 0.0)}
        return kept or {ONE: self.constant(0.0)}

    def _scaled(self, terms, number):
        return self._without_zeros({b: self._times(c, number) for b, c in terms.items()})

    def _times(self, a, b):
        if self.numbers[a] == ("constant", 1.0):
            return b
        if self.numbers[b] == ("constant", 1.0):
            return a
        if ("constant", 0.0) in (self.numbers[a], self.numbers[b]):
            return self.constant(0.0)
        return self.number("multiply", *sorted((a, b)))

    def product(self, x, y):
        """x y: multiplied out where only functions of t alone come of it."""
        x, y = self.lift(x), self.lift(y)
        value = x.value * y.value
        if x.is_number or y.is_number:
            if x.is_number:
                x, y = y, x
            return Symbol(self, self._scaled(x.terms, y.terms[ONE]), value)
        shared = all(self.shared[b] for b in (*x.terms, *y.terms))
        if (shared and len(x.terms) * len(y.terms) <= EXPANDED) or len(x.terms) * len(y.terms) == 1:
            terms = {}
            for a, c in x.terms.items():
                for b, d in y.terms.items():
                    at = (
                        b if a == ONE else a if b == ONE else self.basis("product", *sorted((a, b)))
                    )
                    number = self._times(c, d)
                    terms[at] = (
                        self.number("add", *sorted((terms[at], number))) if at in terms else number
                    )
            return Symbol(self, self._without_zeros(terms), value)
        at = self.basis("product", *sorted((self.single(x), self.single(y))))
        return Symbol(self, {at: self.constant(1.0)}, value)

    def single(self, x):
        """The node of the basis function that the symbol is."""
        if len(x.terms) == 1:
            ((basis, number),) = x.terms.items()
            if self.numbers[number] == ("constant", 1.0):
                return basis
        return self.basis("combination", tuple(sorted(x.terms.items())))

    def quotient(self, x, y):
        """x / y."""
        x, y = self.lift(x), self.lift(y)
        if y.value == 0.0 and y.is_number and self.is_constant(y.terms[ONE]):
            raise ZeroDivisionError
        value = x.value / y.value if y.value else math.nan
        if y.is_number:
            divisor = y.terms[ONE]
            if x.is_number:
                return self.symbol(self.number("divide", x.terms[ONE], divisor), value)
            inverse = self.number("divide", self.constant(1.0), divisor)
            return Symbol(self, self._scaled(x.terms, inverse), value)
        over = self.single(y)
        terms = {}
        for basis, number in x.terms.items():
            terms[self.basis("quotient", basis, over)] = number
        return Symbol(self, terms, value)

    def power(self, x, y):
        """x^y: products where y is a whole number up to HIGHEST."""
        if not isinstance(y, Symbol) and float(y) == int(y) and abs(y) <= HIGHEST:
            return self._whole(self.lift(x), int(y))
        x, y = self.lift(x), self.lift(y)
        if x.is_number and y.is_number:
            value = float(_power(x.value, y.value))
            return self.symbol(self.number("power", x.terms[ONE], y.terms[ONE]), value)
        if y.is_number and self.numbers[y.terms[ONE]] == ("constant", 0.5):
            return self.function("sqrt", x)
        return self.function("exp", y * self.function("log", x))

    def _whole(self, x, n):
        if n <= 0:
            return self.quotient(1.0, self._whole(x, -n)) if n else self.lift(1.0)
        half = self._whole(x, n // 2) if n > 1 else None
        return x if n == 1 else half * half * x if n % 2 else half * half

    def function(self, name, x):
        """The function at x."""
        x = self.lift(x)
        with np.errstate(all="ignore"):
            value = float(FUNCTIONS[name][0](x.value))
        if x.is_number:
            return self.symbol(self.number(name, x.terms[ONE]), value)
        inside = self.single(x)
        at = self.basis(name, inside)
        made = Symbol(self, {at: self.constant(1.0)}, value)
        if len(self.series[at]) == 2 and self.series[at][0] == name:
            if name in COUPLED:
                other, sign = COUPLED[name]
                slope = at if other == name else self.basis(other, inside)
                self.series[at] = (name, inside, slope, sign)
                if other != name and len(self.series[slope]) == 2:
                    self.series[slope] = (other, inside, at, COUPLED[other][1])
            else:
                self.series[at] = (name, inside, self.single(self.lift(SLOPES[name](x, made))), 1.0)
        return made

    def slope(self, x, state):
        """The derivative of the symbol x by the state, a basis function; None where it is 0."""
        total = None
        for basis, number in x.terms.items():
            own = self._slope_of(basis, state)
            if own is not None:
                own = self.product(self.symbol(number, 0.0), own)
                total = own if total is None else self.sum(total, own)
        return total

    def _slope_of(self, basis, state):
        key = basis, state
        if key not in self._slopes:
            self._slopes[key] = self._new_slope(basis, state)
        return self._slopes[key]

    def _new_slope(self, basis, state):
        operation, *o = self.series[basis]
        if operation in ("one", "time", "state"):
            return self.lift(1.0) if basis == state else None
        if operation == "combination":
            return self.slope(Symbol(self, dict(o[0]), 0.0), state)
        one = self._slope_of(o[0], state)
        if operation not in ("product", "quotient"):
            return None if one is None else self.product(self._alone(o[1]), one) * o[2]
        two = self._slope_of(o[1], state)
        if operation == "product":
            parts = [
                None if two is None else self._alone(o[0]) * two,
                None if one is None else one * self._alone(o[1]),
            ]
        else:
            parts = [one, None if two is None else -(self._alone(basis) * two)]
        parts = [part for part in parts if part is not None]
        if not parts:
            return None
        total = self.sum(parts[0], parts[1]) if len(parts) == 2 else parts[0]
        return total if operation == "product" else self.quotient(total, self._alone(o[1]))

    def _alone(self, basis):
        """The basis function as a symbol; its value is not needed, as nothing branches any more."""
        return Symbol(self, {basis: self.constant(1.0)}, math.nan)

    def compiled(self, entries):
        """A Program of the entries, {(i, j): symbol}."""
        return Program(self, entries)


class Program:
    """The entries of a matrix as arrays for `kernels.floquet.program`, and as functions of points
    and times.
    """

    def __init__(self, graph, entries):
        self.graph, self.states = graph, list(graph.flow)
        terms = [
            (basis, i, j, number)
            for (i, j), symbol in sorted(entries.items())
            for basis, number in symbol.terms.items()
            if graph.numbers[number] != ("constant", 0.0)
        ]
        terms.sort(key=lambda term: (term[pg.ROW], *term))  # as the kernels ask for
        self.terms = np.array(terms, dtype=np.int64).reshape(-1, pg.TERM)
        self.used = np.unique(np.concatenate([[ONE], self.terms[:, pg.BASIS]])).astype(np.int64)
        rows, inside, weights = [], [], []
        for k, (operation, *operands) in enumerate(graph.series):
            code, a, b, first, last, sign = pg.CODES[operation], 0, 0, 0, 0, 1.0
            if operation == "combination":
                first = len(inside)
                inside += operands[0]
                last = len(inside)
            elif operation in ("product", "quotient"):
                a, b = operands
            elif operation == "state":
                a = operands[0]
                first = len(inside)
                inside += [
                    pair
                    for pair in graph.flow[k].terms.items()
                    if graph.numbers[pair[1]] != ("constant", 0.0)
                ]
                last = len(inside)
            elif operands:
                a, b, sign = operands
                if self.is_line(a):
                    code += pg.OF_LINE
            rows.append((code, a, b, first, last))
            weights.append(sign)
        self.operations = np.array(rows, dtype=np.int64).reshape(-1, pg.OPERATION)
        self.signs = np.array(weights)
        self.inside = np.array(inside, dtype=np.int64).reshape(-1, 2)
        self.order = self._order()

    @cached_property
    def read(self):
        """Which numbers the kernel reads: those of the parameters on which nothing depends are not
        among them.
        """
        return np.unique(np.concatenate([self.terms[:, pg.NUMBER], self.inside[:, pg.FACTOR]]))

    @property
    def analytic(self):
        """Is A analytic in the parameters too, as no branch depends on them?"""
        return all(self._decided(s) for s, _yes in (*self.graph.guards, *self.graph.equalities))

    @cached_property
    def waves(self):
        """What tells the symmetries of A in t."""
        return Waves(self)

    def is_line(self, node):
        """Is the basis function linear in t?"""
        operation, *operands = self.graph.series[node]
        return node == TIME or (
            operation == "combination" and all(b in (ONE, TIME) for b, _c in operands[0])
        )

    def _order(self):
        """Nodes of the basis functions that the entries need, each after those that it is made of.

        States need lower orders alone, and so do functions of their derivatives, which come last: a
        derivative may be made of what is being visited, as that of y = sqrt x is of 1 / y.
        """
        flow = self.graph.flow
        found = list(flow)
        begun = set(flow)
        later = []

        def visit(node):
            if node in begun:
                return
            begun.add(node)
            operation, *operands = self.graph.series[node]
            before = [b for b, _c in operands[0]] if operation == "combination" else operands[:2]
            function = operation in FUNCTIONS
            for k, b in enumerate(before):
                if not (function and k == 1):
                    visit(b)
            found.append(node)
            if function:
                later.append(before[1])

        for node in (*self.used, *(basis for symbol in flow.values() for basis in symbol.terms)):
            visit(int(node))
        while later:
            visit(later.pop())
        return np.array(found, dtype=np.int64)

    def numbers(self, points):
        """Values and error bounds of all numbers at the points (N, parameters): (N, count) each."""
        N = len(points)
        values, errors = np.empty((2, N, len(self.graph.numbers)))
        u = ROUNDOFF_UP
        with np.errstate(all="ignore"):
            for k, (operation, *o) in enumerate(self.graph.numbers):
                e = 0.0
                if operation == "constant":
                    v = np.full(N, o[0])
                elif operation == "parameter":
                    v = np.ascontiguousarray(points[:, o[0]])
                elif operation == "add":
                    v = values[:, o[0]] + values[:, o[1]]
                    e = errors[:, o[0]] + errors[:, o[1]] + u * abs(v)
                elif operation == "multiply":
                    x, y = values[:, o[0]], values[:, o[1]]
                    v = x * y
                    e = abs(x) * errors[:, o[1]] + abs(y) * errors[:, o[0]] + u * abs(v)
                elif operation == "divide":
                    x, y = values[:, o[0]], values[:, o[1]]
                    v = x / y
                    e = (errors[:, o[0]] + abs(v) * errors[:, o[1]]) / abs(y) + u * abs(v)
                elif operation == "power":
                    x, y = values[:, o[0]], values[:, o[1]]
                    v = np.power(x, y)
                    e = (
                        _carried(y * v / x, errors[:, o[0]])
                        + _carried(v * np.log(abs(x)), errors[:, o[1]])
                        + 8 * u * abs(v)
                    )
                else:
                    x = np.ascontiguousarray(values[:, o[0]])
                    function, slope = FUNCTIONS[operation]
                    v = function(x)
                    e = _carried(slope(x), errors[:, o[0]]) + (
                        1 if operation == "sqrt" else 8
                    ) * u * abs(v)
                values[:, k], errors[:, k] = v, e
        return values, errors

    def series(self, numbers, t, nodes, states=None, phase_bars=None):
        """{node: (values, error bounds)} (N or 1, m) of these basis functions at times t (N or 1,
        m).

        `states` are values and error bounds (n, N, m) of the states, to first order in their
        errors; `phase_bars`, of waves {node: (N or 1, 1)}, bounds of further errors of their phases.
        The bounds hold for the kernels, whose functions are those of the C library, rounded to 1 or 2 ulp.
        """
        values, errors = numbers
        u = ROUNDOFF_UP
        found = {}
        needed = self.needed(nodes)
        with np.errstate(all="ignore"):
            for k in needed:
                operation, *o = self.graph.series[k]
                if operation == "one":
                    v, e = np.ones((1, 1)), 0.0
                elif operation == "time":
                    v, e = t, 0.0
                elif operation == "state":
                    at = self.states.index(k)
                    v, e = states[0][at], states[1][at]
                elif operation == "combination":
                    v = e = 0.0
                    for b, c in o[0]:
                        x, dx = found[b]
                        y, dy = values[:, c, None], errors[:, c, None]
                        if self.graph.is_constant(c):
                            y, dy = y[:1], 0.0
                        v = v + x * y
                        e = e + abs(x) * dy + abs(y) * dx + u * (abs(x * y) + abs(v))
                elif operation == "product":
                    (x, dx), (y, dy) = found[o[0]], found[o[1]]
                    v = x * y
                    e = abs(x) * dy + abs(y) * dx + u * abs(v)
                elif operation == "quotient":
                    (x, dx), (y, dy) = found[o[0]], found[o[1]]
                    v = x / y
                    e = (dx + abs(v) * dy) / abs(y) + u * abs(v)
                else:
                    x, dx = found[o[0]]
                    if phase_bars and k in phase_bars:
                        dx = dx + phase_bars[k]
                    function, slope = FUNCTIONS[operation]
                    v = function(x)
                    e = (
                        abs(slope(x)) * dx
                        + 0.5 * dx * dx
                        + (2 if operation in ACCURATE else 6) * u * abs(v)
                    )
                found[k] = v, e
        return {k: found[k] for k in nodes}

    def needed(self, nodes):
        """Nodes of what these basis functions are made of, in order."""
        found = []
        begun = set()

        def visit(node):
            if node in begun:
                return
            begun.add(node)
            operation, *operands = self.graph.series[node]
            if operation == "combination":
                before = [b for b, _c in operands[0]]
            elif operation == "state":
                before = []
            else:
                before = operands[: 2 if operation in ("product", "quotient") else 1]
            for b in before:
                visit(b)
            found.append(node)

        for node in nodes:
            visit(int(node))
        return found

    def at(self, points, t, size, numbers=None, states=None):
        """A (N, m, n, n) at times t (N or 1, m), and bounds of the errors of its terms.

        Their sums round besides; with `states`, see `series`, this is included.
        """
        numbers = self.numbers(points) if numbers is None else numbers
        basis = self.series(numbers, t, self.used, states)
        A, E = np.zeros((2, len(points), t.shape[1], size, size))
        with np.errstate(all="ignore"):
            for b, i, j, c in self.terms:
                x, dx = basis[b]
                y, dy = numbers[0][:, c, None], numbers[1][:, c, None]
                A[:, :, i, j] += x * y
                E[:, :, i, j] += abs(x) * dy + abs(y) * dx
                if states is not None:
                    E[:, :, i, j] += len(self.terms) * ROUNDOFF_UP * abs(x * y)
        return A, E

    def trace(self, numbers):
        """The sum of the diagonal entries (N) and its error bound; None where it depends on t."""
        diagonal = self.terms[self.terms[:, pg.ROW] == self.terms[:, pg.COLUMN]]
        if (diagonal[:, pg.BASIS] != ONE).any():
            return None
        values, errors = numbers
        own = values[:, diagonal[:, pg.NUMBER]]
        rounding = len(diagonal) * ROUNDOFF_UP * abs(own).sum(axis=1)
        return own.sum(axis=1), errors[:, diagonal[:, pg.NUMBER]].sum(axis=1) + rounding

    def sampled(self, numbers, t, phase_bars=None):
        """(terms, values, error bounds): the terms with their basis functions numbered from 0, and
        these functions (B, N, m) at times t (N, m); where they depend on t alone t may be (1, m),
        and N is 1. `phase_bars` as in `series`.
        """
        found = self.series(numbers, t, self.used, phase_bars=phase_bars)
        wide = max((len(values) for values, _bars in found.values()), default=1)
        out = np.empty((2, len(self.used), wide, t.shape[1]))
        for k, node in enumerate(self.used):
            out[0, k], out[1, k] = found[node]
        terms = self.terms.copy()
        terms[:, pg.BASIS] = np.searchsorted(self.used, terms[:, pg.BASIS])
        return terms, *out

    def holds(self, points, low, high):
        """Do the guards decide for the points (N) as they did for the example? 1 yes, 0 no, -1: not
        within (low, high).

        `low` and `high` (N) are the ends of the piece of the period.
        """
        out = np.ones(len(points), dtype=np.int8)
        guards = [(s, yes) for s, yes in self.graph.guards if not self._decided(s)]
        equal = [(s, yes) for s, yes in self.graph.equalities if not self._decided(s)]
        if not guards and not equal:
            return out
        numbers = self.numbers(points)
        t = low[:, None] + (high - low)[:, None] * TRIED
        for symbol, yes in guards:
            value = self._of(symbol, numbers, t)
            agrees = (value > 0) == yes
            mixed = agrees.any(axis=1) & ~agrees.all(axis=1)
            out = np.where(mixed, -1, np.where(agrees.all(axis=1), out, np.minimum(out, 0))).astype(
                np.int8
            )
        for symbol, yes in equal:
            value = self._of(symbol, numbers, t)
            agrees = (value == 0) == yes if symbol.is_number else np.full(t.shape, not yes)
            out = np.where(agrees.all(axis=1), out, np.minimum(out, 0)).astype(np.int8)
        return out

    def _of(self, symbol, numbers, t):
        basis = self.series(numbers, t, list(symbol.terms))
        total = np.zeros(t.shape)
        for b, c in symbol.terms.items():
            total = total + basis[b][0] * numbers[0][:, c, None]
        return total

    def _decided(self, symbol):
        return symbol.is_number and self.graph.is_constant(symbol.terms[ONE])


def _carried(slope, error):
    """What errors (N) become by a function of these slopes (N), which are infinite at sqrt 0."""
    return np.where(error == 0.0, 0.0, abs(slope) * error)


class _Math:
    """The module math, for symbols too."""

    def __getattr__(self, name):
        value = getattr(math, name)
        return value if not callable(value) else _Call(name)


class _Call:
    """A function of math, for symbols too."""

    def __init__(self, name):
        self._name = name

    def __call__(self, *given):
        return call(self._name, *given)


def lifted(value, seen=None):
    """The value as code on symbols may use it: functions of math take symbols, compiled functions
    are Python again.
    """
    seen = {} if seen is None else seen
    value = getattr(value, "py_func", value) if isinstance(value, DISPATCHER) else value
    if id(value) in seen:
        return seen[id(value)]
    if value is math:
        return _Math()
    if isinstance(value, FunctionType):
        return _lifted_function(value, seen)
    if isinstance(value, MethodType):
        return MethodType(lifted(value.__func__, seen), value.__self__)
    if isinstance(value, partial):
        return partial(lifted(value.func, seen), *value.args, **value.keywords)
    if isinstance(vars(type(value)).get("__call__"), FunctionType):  # an object that is called
        return lifted(value.__call__, seen)
    name = getattr(value, "__name__", "")
    if callable(value) and value is getattr(math, name, None):
        return _Call(name)
    if (
        isinstance(value, ModuleType)
        and value not in (np,)
        and value.__name__.partition(".")[0] not in ("numpy",)
    ):
        return _Refused(value.__name__)
    return value


class _Refused:
    """Stands for a module that symbols cannot pass through."""

    def __init__(self, name):
        self._name = name

    def __getattr__(self, name):
        raise Unsupported(f"it uses {self._name}.{name}")


def _lifted_function(function, seen):
    scope = {"__builtins__": builtins.__dict__}
    cells = tuple(CellType() for _ in function.__closure__ or ())
    made = FunctionType(function.__code__, scope, function.__name__, None, cells)
    seen[id(function)] = made
    for name in _names(function.__code__):
        if name in function.__globals__:
            scope[name] = lifted(function.__globals__[name], seen)
    for cell, own in zip(cells, function.__closure__ or (), strict=True):
        cell.cell_contents = lifted(own.cell_contents, seen)
    made.__defaults__ = (
        None
        if function.__defaults__ is None
        else tuple(lifted(x, seen) for x in function.__defaults__)
    )
    made.__kwdefaults__ = function.__kwdefaults__
    return made


def _names(code):
    """Names that the code, or a function inside it, looks up."""
    inner = [const for const in code.co_consts if isinstance(const, CodeType)]
    return {*code.co_names, *(name for own in inner for name in _names(own))}
