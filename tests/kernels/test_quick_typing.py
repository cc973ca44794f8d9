"""What numba is given from memory is what it would find again."""

import itertools
import math
import operator

import numba
import numpy as np
import pytest
from numba import types
from numba.core import event
from numba.core.compiler import Flags
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from survey.kernels import jit, quick_typing

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


@pytest.fixture
def remembering(monkeypatch):
    monkeypatch.setattr(quick_typing, "_known", {})
    quick_typing.begin()
    yield
    quick_typing.end()


def function_type(function):
    cpu_target.typing_context.refresh()
    return cpu_target.typing_context.resolve_value_type(function)


def typed(function, *arguments):
    """The signature that numba gives, by what it uses at this moment."""
    return function_type(function).get_call_type(cpu_target.typing_context, arguments, {})


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
]


@pytest.mark.parametrize("call", CALLS, ids=str)
def test_signatures_are_those_of_numba_and_remembered(call, remembering):
    first = typed(*call)
    assert list(quick_typing._known.values()) == [first] and typed(*call) is first
    quick_typing.end()
    usual = typed(*call)
    assert first == usual and first.return_type == usual.return_type


def test_what_numba_compiles_for_a_call_is_not_remembered(remembering):
    assert typed(max, types.float64, types.float64).return_type == types.float64
    assert not quick_typing._known


def test_a_function_with_more_rules_is_asked_anew(remembering):
    typed(operator.lshift, types.int64, types.int64)
    before = function_type(operator.lshift)
    assert before in {function for function, *_ in quick_typing._known}

    @infer_global(operator.lshift)
    class Rule(AbstractTemplate):  # of no types
        def generic(self, args, kws):
            return signature(types.int8, *args) if args == () else None

    typed(operator.lshift, types.int64, types.int64)
    after = function_type(operator.lshift)
    assert before != after and after in {function for function, *_ in quick_typing._known}


def test_flags_are_equal_where_numba_says_so(remembering):
    def made(**options):
        flags = Flags()
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


def in_use():
    return TargetConfig.__eq__, BaseFunction.get_call_type, event.start_event


@pytest.mark.parametrize("module, ours", [("survey.kernels.some", True), ("other", False)])
@pytest.mark.parametrize("wrong", [False, True])
def test_numba_remembers_while_a_kernel_is_compiled_and_does_as_usual_afterwards(
    module, ours, wrong
):
    usual, seen = in_use(), []

    def asked(x):
        pass

    @numba.extending.overload(asked)
    def _asked(x):
        seen.append(in_use())
        return None if wrong else lambda x: x

    def called(x):
        return asked(x[0])

    called.__module__ = module
    kernel = jit.fresh(called)
    if wrong:
        with pytest.raises(numba.TypingError):
            kernel(np.zeros(1))
    else:
        assert kernel(np.ones(1)) == 1.0
    assert seen and all(
        (a is not b) == ours for now in seen for a, b in zip(now, usual, strict=True)
    )
    assert in_use() == usual
