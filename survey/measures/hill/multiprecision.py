"""A user's function in more digits: its own Python code, with mpmath's functions instead of those
of math and numpy.

Numbers that stand in the code, or beside it, are the binary64 numbers that they are; what is
computed from them, the parameters and u is computed with PRECISION bits. What cannot be run so
raises Unsupported, whose text says why.

Source: F. Johansson and others, mpmath: a Python library for arbitrary-precision floating-point
arithmetic.
"""

import builtins
import math
import threading
from functools import cache
from itertools import pairwise
from numbers import Rational
from operator import mul
from types import CellType, CodeType, FunctionType, ModuleType

import numpy as np

from survey.kernels.jit import fresh

PRECISION = 128  # bits: a double-double number holds 106
BITS = 192  # after the point, of what is multiplied by values of z
# What numpy and mpmath call by different names.
NUMPY = {
    "arcsin": "asin", "arccos": "acos", "arctan": "atan", "arctan2": "atan2", "arcsinh": "asinh", "arccosh": "acosh",
    "arctanh": "atanh", "absolute": "fabs", "abs": "fabs", "pow": "power",
}  # fmt: skip
SAME = frozenset(
    "sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp expm1 log log1p log10 sqrt cbrt fabs hypot "
    "floor ceil gamma erf erfc degrees radians power sign".split()
)
BUILTINS = (
    "abs",
    "bool",
    "int",
    "len",
    "max",
    "min",
    "pow",
    "range",
    "sum",
    "ArithmeticError",
    "ValueError",
)
LOCK = threading.Lock()  # mpmath's numbers are not for two threads at a time
DISPATCHER = type(fresh(lambda: None))


class Unsupported(Exception):
    """The function cannot be run with more digits; says why."""


@cache
def context():
    """mpmath's functions and numbers at PRECISION, to be used under LOCK."""
    from mpmath.ctx_mp import MPContext

    own = MPContext()
    own.prec = PRECISION
    return own


def lifted(function):
    """The same function on numbers of `context`; raises Unsupported when it is made or called."""
    made, mp = lift(function, context()), context()

    def call(*arguments):
        try:
            value = made(*arguments)
            return (
                mp.mpf(value) if isinstance(value, (bool, int, float, mp.mpf)) else _numbers(value)
            )
        except Unsupported:
            raise
        except Exception as error:
            raise Unsupported(f"{type(error).__name__}: {error}") from None

    return call


def lift(function, mp):
    """The same function on the numbers that the context `mp` makes: with its functions, named as
    mpmath names them.
    """
    return _lift(function, {}, mp)


def _numbers(values):
    """A tuple or list of numbers as numbers of `context`."""
    mp = context()
    if isinstance(values, (list, tuple)) and all(
        isinstance(v, (int, float, mp.mpf)) for v in values
    ):
        return [mp.mpf(value) for value in values]
    raise Unsupported(f"it returns {type(values).__name__}, which is not a real number")


class _Refused:
    """Stands for what mpmath lacks; raises when it is used."""

    def __init__(self, words):
        self._words = words

    def __call__(self, *arguments):
        raise Unsupported(self._words)

    def __getattr__(self, name):
        raise Unsupported(self._words)

    __getitem__ = __bool__ = __float__ = __neg__ = __abs__ = __call__
    __add__ = __sub__ = __mul__ = __truediv__ = __pow__ = __lt__ = __le__ = __gt__ = __ge__ = (
        __call__
    )
    __radd__ = __rsub__ = __rmul__ = __rtruediv__ = __rpow__ = __call__


class _Module:
    """math or numpy, with mpmath's functions."""

    def __init__(self, module, mp):
        self._module, self._mp = module, mp

    def __getattr__(self, name):
        return _lift(getattr(self._module, name), {}, self._mp)


def _lift(value, seen, mp):
    """The value as code on numbers of `mp` may use it."""
    value = getattr(value, "py_func", value) if isinstance(value, DISPATCHER) else value
    if id(value) in seen:
        return seen[id(value)]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value.item() if isinstance(value, np.generic) else value
    if isinstance(value, (np.number, np.ndarray)):
        return value.item() if np.ndim(value) == 0 else value.tolist()
    if isinstance(value, (tuple, list)):
        return type(value)(_lift(item, seen, mp) for item in value)
    if isinstance(value, dict):
        return {key: _lift(item, seen, mp) for key, item in value.items()}
    if isinstance(value, Rational):
        return float(value)  # as Python takes it beside a float
    if isinstance(value, FunctionType):
        return _function(value, seen, mp)
    if value in (math, np):
        return _Module(value, mp)
    return _named(value, mp)


def _named(value, mp):
    """The function of `mp` instead of one of math, numpy or Python."""
    name = getattr(value, "__name__", type(value).__name__)
    if isinstance(value, ModuleType):
        return _Refused(f"it uses the module {name}")
    if value in (float, np.float64):
        return mp.mpf
    if any(value is getattr(builtins, own) for own in BUILTINS):
        return value
    named = NUMPY.get(name, name)
    if value in (getattr(math, name, None), getattr(np, name, None)):
        if named in SAME:
            return getattr(mp, named)
        if name in OTHERS:
            return OTHERS[name](mp)
    return _Refused(f"it uses {name}")


def _truncated(mp):
    def fmod(x, y):
        rest = mp.fmod(abs(x), abs(y))
        return rest if x >= 0 else -rest

    return fmod


OTHERS = {  # of a context
    "pow": lambda mp: mp.power,
    "fmod": _truncated,
    "copysign": lambda mp: lambda x, y: abs(x) if y >= 0 else -abs(x),
    "maximum": lambda mp: max,
    "minimum": lambda mp: min,
    "square": lambda mp: lambda x: x * x,
    "where": lambda mp: lambda condition, x, y: x if condition else y,
}


def _function(function, seen, mp):
    """A copy of a Python function whose names mean lifted values."""
    code = function.__code__
    scope = {"__builtins__": {name: getattr(builtins, name) for name in BUILTINS}}
    scope["__builtins__"]["float"] = mp.mpf
    cells = tuple(CellType() for _ in function.__closure__ or ())
    made = FunctionType(code, scope, function.__name__, None, cells)
    seen[id(function)] = made
    for name in _names(code):
        if name in function.__globals__:
            scope[name] = _lift(function.__globals__[name], seen, mp)
    for cell, own in zip(cells, function.__closure__ or (), strict=True):
        cell.cell_contents = _lift(own.cell_contents, seen, mp)
    made.__defaults__ = _lift(function.__defaults__, seen, mp)
    made.__kwdefaults__ = function.__kwdefaults__
    return made


def _names(code):
    """Names that the code, or a function inside it, looks up."""
    inner = [const for const in code.co_consts if isinstance(const, CodeType)]
    return {*code.co_names, *(name for own in inner for name in _names(own))}


def series(z, edges, start, nodes):
    """What `sampled_double` needs of z(u), steps beginning at `start`, ends of pieces at `edges`,
    numbers of `context`.

    Power series (steps, nodes, 2) and lengths (steps, 2) as double-doubles, the sizes of the last
    four Chebyshev coefficients pair by pair and of z (3, steps), and u and z at the nodes (steps,
    nodes). None where z cannot be run.
    """
    mp = context()
    ends = [mp.mpf(float(u)) for u in start] + [edges[-1]]
    for edge in edges[1:-1]:
        ends[int(abs(start - float(edge)).argmin())] = edge
    lengths = [high - low for low, high in pairwise(ends)]
    points = [
        [low + h * x for x in _nodes(nodes)] for low, h in zip(ends[:-1], lengths, strict=True)
    ]
    try:
        values = [[z(u) for u in step] for step in points]
    except Unsupported:
        return None
    if not all(mp.isfinite(value) for step in values for value in step):
        return None
    found, sizes = zip(*(_polynomial(step) for step in values), strict=True)
    lengths = np.array([_two(h) for h in lengths])
    return (
        np.array(found),
        lengths,
        np.array(sizes).T,
        np.array(points, float),
        np.array(values, float),
    )


def _polynomial(values):
    """The power series of the polynomial through the values, and the sizes; in integers, so exactly."""
    from mpmath.libmp import to_fixed

    mp = context()
    nodes = len(values)
    power, last = _transforms(nodes)
    size = max(abs(value) for value in values)
    shift = PRECISION - (int(mp.mag(size)) if size else 0)
    integers = [to_fixed(value._mpf_, shift) for value in values]
    coefficients = [_ratio(sum(map(mul, row, integers)), shift + BITS) for row in power]
    tail = [abs(_ratio(sum(map(mul, row, integers)), shift + BITS)[0]) for row in last]
    return coefficients, (tail[0] + tail[1], tail[2] + tail[3], float(size))


def _ratio(number, bits):
    """An integer / 2^bits as a double-double."""
    high = float(number)
    return math.ldexp(high, -bits), math.ldexp(float(number - int(high)), -bits)


def _two(x):
    """A number of `context` as a double-double."""
    high = float(x)
    return high, float(x - high)


@cache
def _nodes(number):
    """Chebyshev points of the first kind on [0, 1]."""
    mp = context()
    return [(1 - mp.cos(mp.pi * (i + 0.5) / number)) / 2 for i in range(number)]


@cache
def _transforms(number):
    """From values at `_nodes`: rows that give the power series, and the last four Chebyshev
    coefficients, 2^BITS times.

    T_j(2 x - 1) has integer coefficients (of x^n, below 6^j): the digits that they cost are among
    BITS.
    """
    from mpmath.libmp import to_fixed

    mp = type(context())()
    mp.prec = BITS + 64
    cosines = [
        [
            (1 + (j > 0)) * mp.cos(mp.pi * j * (number - i - 0.5) / number) / number
            for i in range(number)
        ]
        for j in range(number)
    ]
    shifted = [[1], [-1, 2]]
    for _ in range(2, number):
        one = shifted[-1]
        before = [*shifted[-2], 0, 0]
        up, same = [0, *one], [*one, 0]
        shifted.append([4 * u - 2 * s - b for u, s, b in zip(up, same, before, strict=True)])
    power = [
        [sum(shifted[j][n] * cosines[j][i] for j in range(n, number)) for i in range(number)]
        for n in range(number)
    ]
    return tuple(
        [[to_fixed(x._mpf_, BITS) for x in row] for row in rows] for rows in (power, cosines[-4:])
    )
