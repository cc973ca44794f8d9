"""A user's f(phi, p), g(phi, p) as a program of `kernels.cylinder.program`, one for each set of
parameters.

Each function is run as Python: phi is a record of operations, the parameters are numbers of 128
bits. So what depends on parameters alone may branch and loop; what depends on phi must be analytic:
+ - * / ** and the functions in `FUNCTIONS`. Numbers in the code are taken as exact binary64
numbers. Where the code takes the same path at other sets of parameters, its record serves them,
with their numbers (see `numbers`).
"""

from functools import lru_cache

import numpy as np

from survey.kernels.cylinder import bounds
from survey.kernels.cylinder import program as pg
from survey.kernels.cylinder.lockstep_program import grouped
from survey.kernels.math import chebyshev
from survey.measures.cylinder.numbers import Number, Steps
from survey.measures.hill import multiprecision
from survey.measures.hill.multiprecision import LOCK, Unsupported

FUNCTIONS = {name: getattr(pg, name.upper()) for name in (
    "sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh exp log sqrt erf"
).split()}  # fmt: skip
MOST = 2000  # operations
MOST_PATHS = 16  # through the code of f and g that are kept
HIGHEST = 64  # the largest exponent that is multiplied out
SAMPLES = np.pi * np.sin(np.arange(1.0, 17.0))  # angles at which periodicity is checked
# Of the circle: samples in which what f or g vary by is seen, whose coefficients count above RESOLVED,
# relative to the largest; and what a step may span of the angle in which they vary.
EVENLY, RESOLVED, SPAN = 512, 1e-12, 1.2
# Equal pieces of the circle from which `bounds.limit_to_shown` starts: for power series, and for steps that see f and
# g at a few angles alone, so that a spike must show in longer pieces.
PIECES, FEW_PIECES = 128, 16
TOGETHER = 128  # programs that are sampled together
SIMPLE = 4  # sines and cosines of lines, multiplied with each other, cannot hide a spike


class Angle:
    """A value that depends on phi: the index of its operation in the list of all."""

    __array_ufunc__ = None  # numpy's numbers leave operators to this class

    def __init__(self, record, index):
        self.record, self.index = record, index

    def __add__(self, other):
        return self.record.sum(self, other)

    def __mul__(self, other):
        return self.record.product(self, other)

    def __neg__(self):
        return self.record.product(self, -1)

    def __sub__(self, other):
        return self.record.difference(self, other)

    def __rsub__(self, other):
        return self.record.difference(other, self)

    def __truediv__(self, other):
        return self.record.quotient(self, other)

    def __rtruediv__(self, other):
        return self.record.quotient(other, self)

    def __pow__(self, exponent):
        return self.record.power(self, exponent)

    def __rpow__(self, base):
        return self.record.power(base, self)

    __radd__, __rmul__ = __add__, __mul__

    def __pos__(self):
        return self

    def _refused(self, *_others):
        raise Unsupported(
            "it compares phi, or an expression in phi, and a branch in phi is not analytic"
        )

    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __bool__ = _refused
    __hash__ = None

    def _rough(self, *_others):
        raise Unsupported(
            "it applies abs, int, float, // or % to an expression in phi, which is not analytic"
        )

    __abs__ = __int__ = __float__ = __floordiv__ = __mod__ = __rmod__ = __rfloordiv__ = (
        __index__
    ) = _rough


class AngleRecord:
    """The operations on phi: a context for `multiprecision.lift`, with mpmath's functions where phi
    does not enter.
    """

    def __init__(self, point):
        self.mp = multiprecision.context()
        self.steps = Steps(self.mp, point)
        self.numbers = {}
        self.raised = False
        self.operations = [(-1, 0, 0, 0.0)]
        self._places = {}
        self._slopes = {}
        self._begun = set()
        self.angle = Angle(self, 0)

    def __getattr__(self, name):
        plain = getattr(self.mp, name)
        if not callable(plain):
            return plain

        def called(*given):
            if any(isinstance(x, Angle) for x in given):
                return self._call(name, given)
            if any(isinstance(x, Number) for x in given):
                return self.steps.number(plain, *given)
            return plain(*given)

        return called

    def mpf(self, x):
        """A number with more digits; what depends on phi, or on the parameters, stays as it is."""
        return x if isinstance(x, (Angle, Number)) else self.mp.mpf(x)

    def _call(self, name, given):
        if name == "power":
            return self.power(*given)
        if name in FUNCTIONS and len(given) == 1:
            return self.function(FUNCTIONS[name], *given)
        if name in OTHERS:
            return OTHERS[name](self, *given)
        raise Unsupported(f"it applies {name} to an expression in phi")

    def index(self, code, first, second, number=0.0):
        """The value of this operation: the same for the same operation."""
        key = (code, first, second, number)
        if key not in self._places:
            if len(self.operations) == MOST:
                raise Unsupported(f"it has more than {MOST:,} operations")
            self._places[key] = len(self.operations)
            self.operations.append(key)
        return Angle(self, self._places[key])

    def with_number(self, code, number, at=None, first=None):
        """An operation with a number; the rest that binary64 does not hold stands where no operand does."""
        if isinstance(number, Number):
            made = self.index(code, first or 0, at or 0, ("of", number.at))
            self.numbers[made.index] = (number, pg.FIRST if first is None else pg.SECOND)
            return made
        number = self.mp.nan if isinstance(number, self.mp.mpc) else self.mp.mpf(number)
        rounded = float(number)
        missed = abs(float(number - rounded)) * (1 + 1e-15) if self.mp.isfinite(number) else 0.0
        if first is None:
            return self.index(code, missed, at or 0, rounded)
        return self.index(code, first, missed, rounded)

    def constant(self, x):
        """The number x as a value, or the value x."""
        return x if isinstance(x, Angle) else self.with_number(pg.CONSTANT, x)

    def sum(self, x, y):
        """x + y."""
        if not isinstance(x, Angle):
            x, y = y, x
        if isinstance(y, Angle):
            return self.index(pg.ADD, *sorted((x.index, y.index)))
        return x if y == 0 else self.with_number(pg.PLUS, y, first=x.index)

    def difference(self, x, y):
        """x - y."""
        if not isinstance(y, Angle):
            return self.sum(x, -self.mpf(y))
        if isinstance(x, (int, float, self.mp.mpf)) and x == 1:
            code, a, b, _number = self.operations[y.index]
            if code == pg.MULTIPLY and a == b and self.operations[a][0] == pg.TANH:
                return self.index(pg.SECH_SQUARED, self.operations[a][1], y.index)
        if not isinstance(x, Angle):
            return self.with_number(pg.FROM, x, first=y.index)
        return self.index(pg.SUBTRACT, x.index, y.index)

    def product(self, x, y):
        """x y."""
        if not isinstance(x, Angle):
            x, y = y, x
        if isinstance(y, Angle):
            return self.index(pg.MULTIPLY, *sorted((x.index, y.index)))
        return x if y == 1 else self.with_number(pg.TIMES, y, first=x.index)

    def quotient(self, x, y):
        """x / y."""
        if not isinstance(y, Angle):
            return self.product(x, 1 / self.mpf(y))
        if not isinstance(x, Angle):
            return self.with_number(pg.OVER, x, at=y.index)
        return self.index(pg.DIVIDE, x.index, y.index)

    def power(self, x, y):
        """x^y: products where y is a whole number up to HIGHEST."""
        if isinstance(y, Angle):
            log = self.function(pg.LOG, x) if isinstance(x, Angle) else self.log(self.mpf(x))
            return self.function(pg.EXP, self.product(y, log))
        y = self.mpf(y)
        if y == int(y) and abs(y) <= HIGHEST:
            return self._whole(x, int(y))
        if y == self.mp.mpf(0.5):
            return self.function(pg.SQRT, x)
        if y != float(y):
            return self.function(pg.EXP, self.product(self.function(pg.LOG, x), y))
        made = self.index(pg.POWER, x.index, None, float(y))
        return self._known(made, lambda: self.product(self.quotient(made, x), y))

    def _whole(self, x, n):
        if n <= 0:
            return self.quotient(1, self._whole(x, -n)) if n else self.constant(1)
        half = self._whole(x, n // 2) if n > 1 else None
        return x if n == 1 else half * half * x if n % 2 else half * half

    def function(self, code, x):
        """The function of this code at x, with its derivative, which its series needs."""
        made = self.index(code, x.index, None)
        return self._known(made, lambda: SLOPES[code](self, x, made))

    def _known(self, made, slope):
        """The value of a function; its derivative is recorded after it."""
        code, first, _second, number = self.operations[made.index]
        if made.index not in self._begun:  # sin and cos need each other
            self._begun.add(made.index)
            at = self.constant(slope()).index
            self.operations[made.index] = (code, first, at, number)
        return made

    def slope(self, index):
        """The derivative by phi of the value there, or None for 0."""
        if index not in self._slopes:
            self._slopes[index] = self._differentiated(index)
        return self._slopes[index]

    def _differentiated(self, index):
        code, first, second, number = self.operations[index]
        if index == 0:
            return self.constant(1)
        if code == pg.CONSTANT:
            return None
        if code == pg.SECH_SQUARED:
            inner = self.slope(second)
            return None if inner is None else -inner
        if code in (pg.PLUS, pg.FROM, pg.TIMES):
            inner = self.slope(first)
            number = self.numbers[index][0] if index in self.numbers else number
            factor = {pg.PLUS: 1, pg.FROM: -1, pg.TIMES: number}[code]
            return None if inner is None else self.product(inner, factor)
        if code in (pg.ADD, pg.SUBTRACT):
            one, two = self.slope(first), self.slope(second)
            if two is None:
                return one
            if one is None:
                return two if code == pg.ADD else -two
            return one + two if code == pg.ADD else one - two
        y = Angle(self, index)
        if code == pg.MULTIPLY:
            a, b = Angle(self, first), Angle(self, second)
            return self._total(
                self._times(self.slope(first), b), self._times(self.slope(second), a)
            )
        if code in (pg.DIVIDE, pg.OVER):
            b = Angle(self, second)
            upper = self.slope(first) if code == pg.DIVIDE else None
            lower = self._times(self.slope(second), -y)
            total = self._total(upper, lower)
            return None if total is None else total / b
        return self._times(self.slope(first), Angle(self, second))

    def _times(self, slope, factor):
        return None if slope is None else slope * factor

    def _total(self, one, two):
        return two if one is None else one if two is None else one + two


SLOPES = {
    pg.SIN: lambda r, x, y: r.function(pg.COS, x),
    pg.COS: lambda r, x, y: -r.function(pg.SIN, x),
    pg.TAN: lambda r, x, y: 1 + y * y,
    pg.ASIN: lambda r, x, y: 1 / r.function(pg.SQRT, 1 - x * x),
    pg.ACOS: lambda r, x, y: -1 / r.function(pg.SQRT, 1 - x * x),
    pg.ATAN: lambda r, x, y: 1 / (1 + x * x),
    pg.SINH: lambda r, x, y: r.function(pg.COSH, x),
    pg.COSH: lambda r, x, y: r.function(pg.SINH, x),
    pg.TANH: lambda r, x, y: 1 - y * y,
    pg.ASINH: lambda r, x, y: 1 / r.function(pg.SQRT, 1 + x * x),
    pg.ACOSH: lambda r, x, y: 1 / r.function(pg.SQRT, x * x - 1),
    pg.ATANH: lambda r, x, y: 1 / (1 - x * x),
    pg.EXP: lambda r, x, y: y,
    pg.LOG: lambda r, x, y: 1 / x,
    pg.SQRT: lambda r, x, y: 0.5 / y,
    pg.ERF: lambda r, x, y: r.function(pg.EXP, -(x * x)) * (2 / r.mp.sqrt(r.mp.pi)),
}
OTHERS = {
    "expm1": lambda r, x: r.function(pg.EXP, x) - 1,
    "log1p": lambda r, x: r.function(pg.LOG, 1 + x),
    "log10": lambda r, x: r.function(pg.LOG, x) / r.mp.log(10),
    "hypot": lambda r, x, y: r.function(pg.SQRT, x * x + y * y),
    "radians": lambda r, x: x * (r.mp.pi / 180),
    "degrees": lambda r, x: x * (180 / r.mp.pi),
}


class Raised(Exception):
    """f or g, as `name` says, raised the cause of this."""

    def __init__(self, name):
        super().__init__(name)
        self.name = name


def recorded(function, name, record, p):
    """The index of the function's value; None where it has none; raises Unsupported or Raised."""
    try:
        value = multiprecision.lift(function, record)(record.angle, p)
        if not isinstance(value, (bool, int, float, Angle, Number, record.mp.mpf, record.mp.mpc)):
            raise Unsupported(f"it returns {type(value).__name__}, which is not a real number")
        return record.constant(value).index
    except Unsupported as error:
        raise Unsupported(f"{name}(phi, p): {error}") from None
    except NameError as error:  # a builtin that numbers with more digits have not
        raise Unsupported(f"{name}(phi, p): it uses {error.name}") from None
    except ArithmeticError:
        record.raised = True
        return record.constant(np.nan).index
    except (Exception, SystemExit) as error:
        raise Raised(name) from error


class Template:
    """The programs of f and g on one path through their code, recorded at the parameters `point`."""

    def __init__(self, f, g, point, on_circle):
        record = AngleRecord(point)
        found = [
            recorded(h, name, record, record.steps.parameters) for h, name in ((f, "f"), (g, "g"))
        ]
        forces = len(record.operations)
        dg = record.slope(found[1])
        slope = record.constant(0 if dg is None else dg).index
        self._steps, self._numbers = record.steps, record.numbers
        # a function without a value has ended before all decisions were met
        self.shared = not record.raised
        table = np.array([(*rest, 0.0 if isinstance(number, tuple) else number) for *rest, number in record.operations],
                         dtype=float)  # fmt: skip
        self._row = np.zeros(pg.OPERATIONS + table.size)
        self._row[pg.OPERATIONS :] = table.ravel()
        self._row[[pg.REVERSED, pg.ON_CIRCLE, pg.MIRRORED]] = 1.0, on_circle, 1.0
        self._row[[pg.SLOTS, pg.FORCES, pg.F_AT, pg.G_AT, pg.DG_AT]] = (
            len(table),
            forces,
            *found,
            slope,
        )
        simple = on_circle and max(_degrees(table)[k] for k in found) <= SIMPLE
        self._row[pg.RADIUS] = pg.UNLIMITED if simple else 1.0

    def serve(self, points, which, found):
        """Add to `found` (which points, their rows of a flow, less the initial states) for those of
        `which` that take this path; returns the others.
        """
        wanted = [number for number, _column in self._numbers.values()]
        fits, values = self._steps.again(points[which], wanted)
        some = np.flatnonzero(fits)
        rows = np.tile(self._row, (some.size, 1))
        for (index, (_number, column)), own in zip(self._numbers.items(), values, strict=True):
            at = pg.OPERATIONS + pg.WIDTH * index
            rounded = [_rounded(own[i]) for i in some]
            rows[:, [at + pg.NUMBER, at + column]] = np.reshape(rounded, (-1, 2))
        if some.size:
            found.append((which[some], rows))
        return which[~np.array(fits, bool)]


def _rounded(x):
    """The number in binary64, and a bound of what that misses; NaN for complex numbers."""
    if type(x) is float:
        return x, 0.0
    if hasattr(x, "_mpc_"):
        return np.nan, np.nan
    rounded = float(x)
    return rounded, abs(float(x - rounded)) * (1 + 1e-15) if np.isfinite(rounded) else 0.0


def _degrees(table):
    """Of how many sines and cosines of lines each of the values of a program is a product, no sums
    counted; infinite where it is anything else.
    """
    degrees, lines = [0.0], [True]
    for code, first, second, _number in table[1:]:
        a, b = int(first), int(second)
        with_number = code in (pg.PLUS, pg.TIMES, pg.FROM)
        if code in (pg.ADD, pg.SUBTRACT):
            degree = max(degrees[a], degrees[b])
        elif code == pg.MULTIPLY:
            degree = degrees[a] + degrees[b]
        elif with_number:
            degree = degrees[a]
        elif code == pg.CONSTANT:
            degree = 0.0
        else:
            degree = 1.0 if code in (pg.SIN, pg.COS) and lines[a] else np.inf
        degrees.append(degree)
        lines.append(code == pg.CONSTANT or (with_number and lines[a]))
    return degrees


def limit(rows, pieces=PIECES):
    """Limit the steps of programs on the circle, whose f and g may have spikes that the series of other
    steps do not show: for those who take steps without bounds of their own. See
    `bounds.limit_to_shown` for `pieces`.
    """
    spiky = np.flatnonzero((rows[:, pg.ON_CIRCLE] > 0.0) & (rows[:, pg.RADIUS] < pg.UNLIMITED))
    leads = grouped(np.ascontiguousarray(rows[spiky])) if spiky.size else spiky
    for lead in np.unique(leads):
        own = spiky[leads == lead]
        some = rows[own]
        _limit(some)
        bounds.limit_to_shown(some, pieces)
        rows[own] = some


def _limit(rows):
    """As `limit`, of one program: by samples all round the circle."""
    for first in range(0, len(rows), TOGETHER):
        some = rows[first : first + TOGETHER]
        values = np.zeros((len(some), 2, EVENLY))
        pg.sampled(some, values)
        c = abs(np.fft.rfft(values.reshape(-1, EVENLY), axis=1)) / EVENLY
        with np.errstate(all="ignore"):
            share = c / c.max(axis=1, keepdims=True)
            rate = chebyshev.fastest(share, share > RESOLVED).reshape(-1, 2).max(axis=1)
        some[:, pg.RADIUS] = np.minimum(SPAN / np.maximum(rate, 1e-300), pg.UNLIMITED)


@lru_cache(maxsize=64)
def _templates(f, g, on_circle):
    """The Templates of f and g so far: a list."""
    return []


def program(f, g, point, on_circle):
    """The row of a flow, less its initial state, for the parameters `point` (n); see
    `kernels.cylinder.program`.

    NaN where f or g has no value, or not the period 2 pi although `on_circle`. Raises Unsupported
    or Raised.
    """
    return flows(f, g, np.array(point, dtype=float)[None], on_circle)[0]


def flows(f, g, points, on_circle):
    """The programs (N, n) of the parameters (N, m), padded to one length; NaN where there is none.
    Their steps have no limit yet: see `limit`.
    """
    own, where = np.unique(np.asarray(points, dtype=float), axis=0, return_inverse=True)
    left = np.flatnonzero(np.isfinite(own).all(axis=1))
    found = []
    with LOCK:
        known = _templates(f, g, on_circle)
        for template in known:
            left = template.serve(own, left, found)
        while left.size:
            template = Template(f, g, own[left[0]], on_circle)
            template.serve(own, left[:1], found)
            left = left[1:]
            if template.shared:
                known.append(template)
                del known[:-MOST_PATHS]
                left = template.serve(own, left, found)
    longest = max((rows.shape[1] for _, rows in found), default=pg.OPERATIONS)
    out = np.full((len(own), longest), np.nan)
    for served, rows in found:
        for i in np.flatnonzero(bounds.complete(rows, SAMPLES)):
            bounds.bound_finely(rows[i])
        out[served] = np.pad(rows, ((0, 0), (0, longest - rows.shape[1])))
    return out[where.reshape(-1)]
