"""What numba is given from memory is what it would find again."""

import itertools
import math
import operator

import numba
import numpy as np
import pytest
from numba import types
from numba.core import event
from numba.core.compiler import Flags, run_frontend
from numba.core.postproc import PostProcessor
from numba.core.registry import cpu_target
from numba.core.targetconfig import TargetConfig
from numba.core.types.functions import BaseFunction
from numba.core.typing.templates import (
    AbstractTemplate,
    _OverloadFunctionTemplate,
    infer_global,
    signature,
)

from survey.kernels import jit, quick_typing

pytestmark = pytest.mark.skipif(
    numba.config.DISABLE_JIT or not quick_typing._OURS, reason="numba compiles as usual, or nothing"
)


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
    return (
        TargetConfig.__eq__, BaseFunction.get_call_type, _OverloadFunctionTemplate._get_impl,
        PostProcessor.run, event.start_event,
    )  # fmt: skip


class Names(event.Listener):
    """The names of the functions that are compiled."""

    def __init__(self):
        self.names = []

    def on_start(self, start):
        self.names.append(start.data["dispatcher"].py_func.__qualname__)

    def on_end(self, end):
        pass


def test_what_numba_has_written_in_python_is_compiled_once():
    @jit.inline
    def shifted(x):
        a = np.empty(2, dtype=np.float32)  # a type that no kernel of ours has
        a[0], a[1] = x[0], x[1] + 1
        return max(a[0], a[1])

    def larger(x):
        b = np.empty(2, dtype=np.float32)
        b[0], b[1] = shifted(x), x[0]
        return max(b[0], b[1])

    def again(x):
        c = np.empty(2, dtype=np.float32)
        c[0], c[1] = x[0], x[1]
        return max(c[0], c[1])

    for function in (larger, again):
        function.__module__ = "survey.kernels.some"
    with event.install_listener("numba:compile", Names()) as compiled:
        assert jit.fresh(larger)(np.array([1.0, 4.0])) == 5.0
        assert jit.fresh(again)(np.array([1.0, 4.0])) == 4.0
    assert compiled.names.count("ol_np_empty.<locals>.impl") == 1


def test_variables_live_as_long_as_numba_says():
    def some(x):
        total = 0.0
        for i in range(3):
            part = x[i] * 2.0
            if part > 1.0:
                total += part
        return total

    def dels():
        function = run_frontend(some)
        PostProcessor(function).run(emit_dels=True)
        return [str(inst) for block in function.blocks.values() for inst in block.body]

    usual = dels()
    quick_typing.begin()
    try:
        assert dels() == usual and any(line.startswith("del ") for line in usual)
    finally:
        quick_typing.end()


def test_code_in_object_mode_is_worked_through_as_usual():
    @numba.njit
    def sinc(x):
        with numba.objmode(y="float64"):
            y = float(np.sinc(x))
        return y + 1.0

    def total(x):
        return sinc(x)

    total.__module__ = "survey.kernels.some"
    assert jit.fresh(total)(0.5) == 1.0 + np.sinc(0.5)


def test_a_generator_is_worked_through_as_usual():
    def squares(n):
        for i in range(n):
            yield i * i

    def total(n):
        found = 0
        for square in _squares(n):
            found += square
        return found

    _squares = numba.njit(squares)
    total.__module__ = "survey.kernels.some"
    assert jit.fresh(total)(4) == 14


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
