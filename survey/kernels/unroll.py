"""Straight code from a Python function with loops: `unroll` runs it on symbols while a kernel is
compiled.

LLVM makes no vector code of a loop over coefficients, and numba takes a second to type a page of
sums written out. A function of floats that is made of + - * /, abs, the functions below, Python's loops and
lists is therefore written as such, and run once for each kernel that calls it; every operation
writes one instruction, in the order in which Python does it, so compiled and plain code give the
same bits.

A number may also stand for several that follow each other in an array (`consecutive`), of which
every instruction then serves all.
"""

import inspect
import math
from fractions import Fraction

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable
from numba.np.arrayobj import make_array

from survey.kernels.jit import HAS_FMA

_ALIGNED = 8  # bytes: numbers that follow each other begin anywhere in an array


class _Number:
    """A float64 that a kernel will compute, or several, or of each whether something holds."""

    __slots__ = ("builder", "value")

    def __init__(self, builder, value):
        self.builder, self.value = builder, value

    def _with(self, name, left, right):
        emit = getattr(self.builder, name)
        return _Number(self.builder, emit(*_alike(self.builder, left, right)))

    def __add__(self, other):
        return self._with("fadd", self, other)

    def __radd__(self, other):
        return self._with("fadd", other, self)

    def __sub__(self, other):
        return self._with("fsub", self, other)

    def __rsub__(self, other):
        return self._with("fsub", other, self)

    def __mul__(self, other):
        return self._with("fmul", self, other)

    def __rmul__(self, other):
        return self._with("fmul", other, self)

    def __truediv__(self, other):
        return self._with("fdiv", self, other)

    def __rtruediv__(self, other):
        return self._with("fdiv", other, self)

    def __neg__(self):
        return _Number(self.builder, self.builder.fneg(self.value))

    def __abs__(self):
        return _called(self, "fabs")

    def __le__(self, other):
        emit = self.builder.fcmp_ordered("<=", *_alike(self.builder, self, other))
        return _Number(self.builder, emit)


def _called(x, name, *others):
    """What a function of LLVM makes of a number, and of others as values."""
    kind, values = x.value.type, [x.value, *others]
    several = f"v{kind.count}" if isinstance(kind, ir.VectorType) else ""
    function = x.builder.module.declare_intrinsic(
        f"llvm.{name}.{several}f64", fnty=ir.FunctionType(kind, [kind] * len(values))
    )
    return _Number(x.builder, x.builder.call(function, values))


class _Index:
    """An integer that a kernel will compute, of which others are made by adding."""

    __slots__ = ("builder", "value")

    def __init__(self, builder, value):
        self.builder, self.value = builder, value

    def __add__(self, other):
        return _Index(self.builder, self.builder.add(self.value, _whole(other)))

    __radd__ = __add__


class _Unknown:
    """Stands for every argument where only the number of results is needed."""

    def _same(self, *_):
        return self

    def __iter__(self):
        raise TypeError("an array has no length before a kernel runs")

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = (
        _same
    )
    __neg__ = __abs__ = __getitem__ = __setitem__ = __le__ = _same


class _Array:
    """An array of float64 or of integers; it is indexed by integers, or by integers that a kernel will compute."""

    def __init__(self, context, builder, kind, value):
        self.context, self.builder, self.kind = context, builder, kind
        self.array = make_array(kind)(context, builder, value)

    def _pointer(self, index):
        indices = index if isinstance(index, tuple) else (index,)
        indices = [_whole(i) for i in indices]
        return cgutils.get_item_pointer(self.context, self.builder, self.kind, self.array, indices)

    def __getitem__(self, index):
        whole = isinstance(self.kind.dtype, types.Integer)
        return (_Index if whole else _Number)(self.builder, self.builder.load(self._pointer(index)))

    def __setitem__(self, index, number):
        self.builder.store(_value(number), self._pointer(index))


def _value(x):
    return x.value if isinstance(x, _Number) else ir.Constant(ir.DoubleType(), float(x))


def _alike(builder, *numbers):
    """The values of numbers; where one of them stands for several, each does."""
    values = [_value(x) for x in numbers]
    counts = [v.type.count if isinstance(v.type, ir.VectorType) else 1 for v in values]
    most = max(counts)
    return [
        _repeated(builder, value, most) if count < most else value
        for value, count in zip(values, counts, strict=True)
    ]


def _repeated(builder, value, count):
    empty = ir.Constant(ir.VectorType(value.type, count), ir.Undefined)
    one = builder.insert_element(empty, value, ir.IntType(32)(0))
    firsts = ir.Constant(ir.VectorType(ir.IntType(32), count), [0] * count)
    return builder.shuffle_vector(one, empty, firsts)


def _whole(i):
    return i.value if isinstance(i, _Index) else ir.Constant(ir.IntType(64), i)


def largest(a, b):
    """max(a, b) of numbers or symbols."""
    return _chosen(
        lambda: max(a, b) if np.ndim(a) == 0 else np.where(b > a, b, a),
        lambda builder, x, y: builder.select(builder.fcmp_ordered(">", y, x), y, x),
        a,
        b,
    )


def smallest(a, b):
    """min(a, b) of numbers or symbols."""
    return _chosen(
        lambda: min(a, b) if np.ndim(a) == 0 else np.where(b < a, b, a),
        lambda builder, x, y: builder.select(builder.fcmp_ordered("<", y, x), y, x),
        a,
        b,
    )


def root(x):
    """The square root of a number or symbol."""
    if isinstance(x, _Unknown):
        return x
    return _called(x, "sqrt") if isinstance(x, _Number) else np.sqrt(x)


def fma(a, b, c):
    """a b + c of numbers or symbols; rounded once where the processor can (`jit.HAS_FMA`), else twice."""
    given = (a, b, c)
    if any(isinstance(x, _Unknown) for x in given):
        return _Unknown()
    # numbers of other classes, as those that count operations, have no exact product
    known = all(isinstance(x, (float, int, np.ndarray, _Number)) for x in given)
    if not (HAS_FMA and known):
        return a * b + c
    symbols = [x for x in given if isinstance(x, _Number)]
    if not symbols:
        return (
            _rounded_once(a, b, c) if max(map(np.ndim, given)) == 0 else _each_rounded_once(*given)
        )
    first, *others = _alike(symbols[0].builder, *given)
    return _called(_Number(symbols[0].builder, first), "fma", *others)


def _rounded_once(a, b, c):
    if not (math.isfinite(a) and math.isfinite(b)):
        return a * b + c
    if not math.isfinite(c):
        return c  # also where the rounded product overflows
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    try:
        return np.float64(exact) if exact else a * b + c  # the zero that has the right sign
    except OverflowError:
        return np.float64(math.inf if exact > 0 else -math.inf)


_each_rounded_once = np.vectorize(_rounded_once, otypes=[float])


def summed(terms):
    """The sum of numbers or symbols, in their order; that of Python begins with 0."""
    first, *others = terms
    return sum(others, first)


def consecutive(array, index, count, where=None):
    """`count` numbers of an array, from `index` on along its last axis: all, or those for which `where`
    holds and 0 for the others, which are not read.
    """
    if isinstance(array, _Unknown):
        return array
    if not isinstance(array, _Array):
        if where is None:
            return array[(*index[:-1], slice(index[-1], index[-1] + count))].copy()
        here, numbers = np.flatnonzero(where), np.zeros(count)
        numbers[here] = array[(*index[:-1], index[-1] + here)]
        return numbers
    builder, kind = array.builder, ir.VectorType(ir.DoubleType(), count)
    place = _place(array, index, kind)
    if where is None:
        return _Number(builder, builder.load(place, align=_ALIGNED))
    none = _repeated(builder, _value(0.0), count)
    return _Number(builder, _masked(builder, "load", kind, [place, *_mask(where), none]))


def put(array, index, numbers, where=None):
    """Set numbers of an array, from `index` on along its last axis: all, or those for which `where` holds."""
    if isinstance(array, _Unknown):
        return
    if not isinstance(array, _Array):
        here = np.arange(len(numbers)) if where is None else np.flatnonzero(where)
        array[(*index[:-1], index[-1] + here)] = numbers[here]
        return
    builder, values = array.builder, numbers.value
    place = _place(array, index, values.type)
    if where is None:
        builder.store(values, place, align=_ALIGNED)
        return
    _masked(builder, "store", values.type, [values, place, *_mask(where)], ir.VoidType())


def _mask(where):
    return ir.IntType(32)(_ALIGNED), where.value


def _masked(builder, name, kind, given, result=None):
    """Load or store numbers where a mask says so."""
    function = builder.module.declare_intrinsic(
        f"llvm.masked.{name}.v{kind.count}f64.p0",
        fnty=ir.FunctionType(result or kind, [x.type for x in given]),
    )
    return builder.call(function, given)


def _place(array, index, kind):
    return array.builder.bitcast(array._pointer(index), kind.as_pointer())


def spread(number, like):
    """One number, for each of those that `like` stands for."""
    if isinstance(number, _Unknown):
        return number
    if not isinstance(like, _Number):
        return np.full(np.shape(like), number)
    return _Number(like.builder, _alike(like.builder, number, like)[0])


def element(numbers, i):
    """The number i of those that follow each other."""
    if isinstance(numbers, _Unknown):
        return numbers
    if not isinstance(numbers, _Number):
        return numbers[i]
    value = numbers.builder.extract_element(numbers.value, ir.IntType(32)(i))
    return _Number(numbers.builder, value)


def transposed(rows):
    """Of n times n numbers, given as n rows of those that follow each other, the columns; n is a power of 2."""
    if any(isinstance(x, _Unknown) for x in rows):
        return rows
    if not isinstance(rows[0], _Number):
        return list(np.transpose(rows))
    half = len(rows) // 2
    for _ in range(half.bit_length()):
        pairs = zip(rows[:half], rows[half:], strict=True)
        rows = [merged for pair in pairs for merged in _merged(*pair)]
    return rows


def _merged(a, b):
    """a and b interleaved, a0 b0 a1 b1 ..., as two vectors: the first half, then the second."""
    builder, count = a.builder, a.value.type.count
    kind, half = ir.VectorType(ir.IntType(32), count), count // 2
    for first in (0, half):
        order = [i + side for i in range(first, first + half) for side in (0, count)]
        yield _Number(builder, builder.shuffle_vector(a.value, b.value, ir.Constant(kind, order)))


def permuted(numbers, order, factors):
    """The numbers in another order, each times a constant."""
    if isinstance(numbers, _Unknown):
        return numbers
    if not isinstance(numbers, _Number):
        return numbers[list(order)] * np.array(factors)
    builder, value = numbers.builder, numbers.value
    places = ir.Constant(ir.VectorType(ir.IntType(32), len(order)), list(order))
    moved = builder.shuffle_vector(value, ir.Constant(value.type, ir.Undefined), places)
    return _Number(builder, builder.fmul(moved, ir.Constant(value.type, list(factors))))


def selected(where, numbers, other=0.0):
    """The numbers for which `where` holds, and a constant for the others."""
    if isinstance(where, _Unknown):
        return where
    if not isinstance(where, _Number):
        return np.where(where, numbers, other)
    nothing = _repeated(where.builder, _value(other), numbers.value.type.count)
    return _Number(where.builder, where.builder.select(where.value, numbers.value, nothing))


def both(where, also):
    """Where both hold."""
    if isinstance(where, _Unknown):
        return where
    if not isinstance(where, _Number):
        return np.logical_and(where, also)
    return _Number(where.builder, where.builder.and_(where.value, also.value))


def counted(where):
    """For how many numbers `where` holds, as a float."""
    if isinstance(where, _Unknown):
        return where
    if not isinstance(where, _Number):
        return float(np.count_nonzero(where))
    bits = where.builder.bitcast(where.value, ir.IntType(where.value.type.count))
    number = where.builder.ctpop(bits)
    return _Number(where.builder, where.builder.uitofp(number, ir.DoubleType()))


def first_of(count, number):
    """Of each of `count` numbers that follow each other, whether it is one of the first `number`."""
    if isinstance(number, _Unknown):
        return number
    if not isinstance(number, _Number):
        return np.arange(1.0, count + 1.0) <= number
    ranks = ir.Constant(ir.VectorType(ir.DoubleType(), count), np.arange(1.0, count + 1.0).tolist())
    return _Number(number.builder, ranks) <= number


def changes_sign(a, b):
    """1.0 where one of two numbers or symbols is negative and the other is not, else 0.0."""

    def emit(builder, x, y):
        zero = _value(0.0)
        differ = builder.xor(builder.fcmp_ordered("<", x, zero), builder.fcmp_ordered("<", y, zero))
        return builder.select(differ, _value(1.0), zero)

    return _chosen(lambda: 1.0 if (a < 0.0) != (b < 0.0) else 0.0, emit, a, b)


def _chosen(plain, emit, a, b):
    if isinstance(a, _Unknown) or isinstance(b, _Unknown):
        return _Unknown()
    if not (isinstance(a, _Number) or isinstance(b, _Number)):
        return plain()
    builder = a.builder if isinstance(a, _Number) else b.builder
    return _Number(builder, emit(builder, *_alike(builder, a, b)))


def unroll(function):
    """Make `function` of floats, integers, arrays and tuples of floats callable by kernels (see
    above).

    It returns a float, a tuple of floats, or nothing, and may call other such functions.
    """

    @type_callable(function)
    def typing(context):
        def typed(*given):
            kinds = [_kind(kind) for kind in given]
            results = function(*(_unknown(kind) for kind in kinds))
            result = types.none if results is None else types.float64
            if isinstance(results, tuple):
                result = types.UniTuple(types.float64, len(results))
            return result(*kinds)

        typed.__signature__ = inspect.signature(function)
        return typed

    @lower_builtin(function, types.VarArg(types.Any))
    def emit(context, builder, signature, values):
        kinds = signature.args
        results = function(
            *(_symbol(context, builder, *pair) for pair in zip(kinds, values, strict=True))
        )
        if results is None:
            return context.get_dummy_value()
        if not isinstance(results, tuple):
            return _value(results)
        return context.make_tuple(builder, signature.return_type, [_value(x) for x in results])

    return function


def _kind(kind):
    """The type that an argument is taken as: numbers as float64 or as indices."""
    if isinstance(kind, types.Float):
        return types.float64
    if isinstance(kind, types.Integer):
        return types.intp
    return kind


def _unknown(kind):
    return (_Unknown(),) * len(kind) if isinstance(kind, types.BaseTuple) else _Unknown()


def _symbol(context, builder, kind, value):
    if isinstance(kind, types.Array):
        return _Array(context, builder, kind, value)
    if isinstance(kind, types.BaseTuple):
        return tuple(_Number(builder, each) for each in cgutils.unpack_tuple(builder, value))
    if isinstance(kind, types.Integer):
        return _Index(builder, value)
    return _Number(builder, value)
