"""Numbers that a user's code computes from the parameters, recorded at one set of parameters so that
they are known at others.

The code is run once, on Numbers. Each knows its value at that set, and how it was computed; what
the code asks of one, as whether it is positive, is a decision. At another set of parameters the
numbers are computed again, and if every decision is the same, so is the path through the code.
"""

import operator

_ARITHMETIC = ("add", "sub", "mul", "truediv", "pow", "mod", "floordiv")
_COMPARISONS = ("lt", "le", "gt", "ge", "eq", "ne")


class Number:
    """A number from the parameters: its `value` where the code runs, and which of all it is."""

    __array_ufunc__ = None  # numpy's numbers leave operators to this class

    def __init__(self, steps, value, at):
        self.steps, self.value, self.at = steps, value, at

    def __neg__(self):
        return self.steps.number(operator.neg, self)

    def __abs__(self):
        return self.steps.number(abs, self)

    def __pos__(self):
        return self

    def __bool__(self):
        return self.steps.decision(bool, self)

    def __int__(self):
        return self.steps.decision(int, self)

    def __float__(self):
        return self.steps.decision(float, self)

    __index__ = None
    __hash__ = object.__hash__


def _operator(name, turned=False):
    function = getattr(operator, name)

    def method(self, other):
        if not self.steps.is_number(other):
            return NotImplemented
        return self.steps.number(function, *((other, self) if turned else (self, other)))

    return method


def _comparison(name):
    function = getattr(operator, name)

    def method(self, other):
        if not self.steps.is_number(other):
            return NotImplemented
        return self.steps.decision(function, self, other)

    return method


for _name in _ARITHMETIC:
    setattr(Number, f"__{_name}__", _operator(_name))
    setattr(Number, f"__r{_name}__", _operator(_name, turned=True))
for _name in _COMPARISONS:
    setattr(Number, f"__{_name}__", _comparison(_name))


class Steps:
    """The Numbers of a run of the code at the set of parameters `point`, and its decisions."""

    def __init__(self, mp, point):
        self.mp = mp
        self.taken = []
        self.decided = []
        self._known = {}
        self.parameters = [self._next((k, None), mp.mpf(value)) for k, value in enumerate(point)]

    def is_number(self, x):
        return isinstance(x, (bool, int, float, self.mp.mpf, self.mp.mpc, Number))

    def number(self, function, *given):
        """The Number function(*given); the same for the same."""
        key = (function, *(("of", x.at) if isinstance(x, Number) else x for x in given))
        if key not in self._known:
            self._known[key] = self._next(
                (function, given),
                function(*(x.value if isinstance(x, Number) else x for x in given)),
            )
        return self._known[key]

    def decision(self, function, *given):
        """function(*given), which the path through the code depends on."""
        outcome = function(*(x.value if isinstance(x, Number) else x for x in given))
        self.decided.append((function, given, outcome))
        return outcome

    def _next(self, step, value):
        self.taken.append(step)
        return Number(self, value, len(self.taken) - 1)

    def again(self, points, wanted):
        """(which points (N, n) take the same path, a list; the values (N) of the Numbers `wanted`, one
        list for each).
        """
        columns, fits = {}, [True] * len(points)
        for function, given, outcome in self.decided:
            found = self._column(function, given, points, columns, fits)
            for i, value in enumerate(found):
                fits[i] = fits[i] and value == outcome
        return fits, [self._values(number, points, columns, fits) for number in wanted]

    def _values(self, number, points, columns, fits):
        """The number at the points, None where `fits` is False: floats for a parameter."""
        if number.at not in columns:
            function, given = self.taken[number.at]
            columns[number.at] = (
                points[:, function].tolist()
                if given is None
                else self._column(function, given, points, columns, fits)
            )
        return columns[number.at]

    def _column(self, function, given, points, columns, fits):
        """The function of these at the points; where it has no value, `fits` becomes False."""
        lists = [
            self._values(x, points, columns, fits) if isinstance(x, Number) else [x] * len(points)
            for x in given
        ]
        found = [None] * len(points)
        for i, own in enumerate(zip(*lists, strict=True)):
            if fits[i]:
                try:
                    found[i] = function(*(own if function in _OF_FLOATS else map(self._more, own)))
                except (ArithmeticError, TypeError, ValueError):
                    fits[i] = False
        return found

    def _more(self, x):
        """A parameter, which is a float, as a number with more digits."""
        return self.mp.mpf(x) if type(x) is float else x


# of floats the same as of numbers with more digits
_OF_FLOATS = frozenset(
    (bool, int, float, operator.neg, abs, *(getattr(operator, name) for name in _COMPARISONS))
)
