import itertools
import math
import operator

import numba
import pytest
from numba import types
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from survey.kernels import quick_typing
from survey.kernels.jit import kernel

FLAGS = numba.core.compiler.Flags


@pytest.fixture
def remembering():
    quick_typing.begin()
    yield
    quick_typing.end()


def typed(function, *arguments):
    """The signature that numba gives, by what it uses at this moment."""
    context = cpu_target.typing_context
    context.refresh()
    return context.resolve_value_type(function).get_call_type(context, arguments, {})


ARRAY = types.Array(types.float64, 2, "C")
CALLS = [
    (operator.getitem, ARRAY, types.UniTuple(types.intp, 2)),
    (operator.getitem, ARRAY, types.intp),
    (operator.getitem, ARRAY, types.IntegerLiteral(3)),
    (operator.getitem, types.UniTuple(types.float64, 3), types.intp),
    (operator.add, types.float64, types.int64),
    (operator.add, ARRAY, types.float64),
    (operator.lt, types.int64, types.float64),
    (math.sqrt, types.float64),
    (math.sqrt, types.int64),
    (bool, types.int64),
    (max, types.float64, types.float64),
]


@pytest.mark.parametrize("call", CALLS, ids=str)
def test_the_types_are_those_of_numba(call, remembering):
    first, again = typed(*call), typed(*call)
    quick_typing.end()
    usual = typed(*call)
    assert first == again == usual and again.return_type == usual.return_type


def test_a_rule_that_is_added_is_heard(remembering):
    class Own(types.Type):
        def __init__(self):
            super().__init__("Own")

    with pytest.raises(numba.TypingError):
        typed(operator.matmul, Own(), types.float64)

    @infer_global(operator.matmul)
    class Rule(AbstractTemplate):
        def generic(self, args, kws):
            return signature(types.int8, *args) if isinstance(args[0], Own) else None

    assert typed(operator.matmul, Own(), types.float64).return_type == types.int8


def test_flags_are_equal_where_numba_says_so(remembering):
    def made(**options):
        flags = FLAGS()
        for name, value in options.items():
            setattr(flags, name, value)
        return flags

    several = [
        made(),
        made(release_gil=True),
        made(release_gil=False),  # the default, by name
        made(release_gil=True, forceinline=True),
        made(forceinline=True, release_gil=True),
        made(error_model="numpy"),
    ]
    mine = [(a == b, hash(a) == hash(b)) for a, b in itertools.product(several, repeat=2)]
    quick_typing.end()
    usual = [(a == b, hash(a) == hash(b)) for a, b in itertools.product(several, repeat=2)]
    assert mine == usual
    assert {equal for equal, _ in mine} == {True, False}
    assert (made() == 1) is False


def test_numba_does_as_usual_once_a_kernel_is_compiled():
    usual = (
        TargetConfig.__eq__,
        types.functions.BaseFunction.get_call_type,
        numba.core.event.start_event,
    )

    @kernel
    def _twice(x):
        return 2.0 * x

    _twice.py_func.__module__ = "survey.kernels.test"
    assert _twice(1.5) == 3.0
    assert usual == (
        TargetConfig.__eq__,
        types.functions.BaseFunction.get_call_type,
        numba.core.event.start_event,
    )

    @kernel
    def _wrong(x):
        return x.nothing

    _wrong.py_func.__module__ = "survey.kernels.test"
    with pytest.raises(numba.TypingError):
        _wrong(1.5)
    assert TargetConfig.__eq__ is usual[0]
