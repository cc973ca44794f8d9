"""Straight code from a Python function with loops: `unroll` runs it on symbols while a kernel is
compiled.

LLVM makes no vector code of a loop over coefficients, and numba takes a second to type a page of
sums written out. A function of floats that is made of + - * /, abs, `largest`, Python's loops and
lists is therefore written as such, and run once for each kernel that calls it; every operation
writes one instruction, in the order in which Python does it, so compiled and plain code give the
same bits.
"""

import inspect

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, type_callable
from numba.np.arrayobj import make_array

_FABS = "llvm.fabs"


class _Number:
    """A float64 that a kernel will compute."""

    __slots__ = ("builder", "value")

    def __init__(self, builder, value):
        self.builder, self.value = builder, value

    def _with(self, name, left, right):
        emit = getattr(self.builder, name)
        return _Number(self.builder, emit(_value(left), _value(right)))

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
        double = self.value.type
        fabs = self.builder.module.declare_intrinsic(_FABS, (double,))
        return _Number(self.builder, self.builder.call(fabs, [self.value]))


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
    __neg__ = __abs__ = __getitem__ = __setitem__ = _same


class _Array:
    """An array of float64; its indices are integers, or integers that a kernel will compute."""

    def __init__(self, context, builder, kind, value):
        self.context, self.builder, self.kind = context, builder, kind
        self.array = make_array(kind)(context, builder, value)

    def _pointer(self, index):
        indices = index if isinstance(index, tuple) else (index,)
        indices = [_whole(i) for i in indices]
        return cgutils.get_item_pointer(self.context, self.builder, self.kind, self.array, indices)

    def __getitem__(self, index):
        return _Number(self.builder, self.builder.load(self._pointer(index)))

    def __setitem__(self, index, number):
        self.builder.store(_value(number), self._pointer(index))


def _value(x):
    return x.value if isinstance(x, _Number) else ir.Constant(ir.DoubleType(), float(x))


def _whole(i):
    return i.value if isinstance(i, _Index) else ir.Constant(ir.IntType(64), i)


def largest(a, b):
    """max(a, b) of numbers or symbols."""
    return _chosen(
        lambda: max(a, b),
        lambda builder, x, y: builder.select(builder.fcmp_ordered(">", y, x), y, x),
        a,
        b,
    )


def summed(terms):
    """The sum of numbers or symbols, in their order; that of Python begins with 0."""
    first, *others = terms
    return sum(others, first)


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
    return _Number(builder, emit(builder, _value(a), _value(b)))


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
