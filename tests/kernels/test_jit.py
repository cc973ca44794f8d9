"""What the decorators of kernels do to the process that compiles."""

import gc
import math

import llvmlite.binding
import numba
import numpy as np
import pytest
from numba.core.registry import cpu_target

from survey.kernels import jit


@pytest.fixture
def usual():
    before = gc.get_threshold()
    yield
    gc.set_threshold(*before)


def compiled(seen):
    """Compile a kernel that asks for the collector's thresholds while it is typed."""
    from numba.extending import overload

    def asked(x):
        raise NotImplementedError

    @overload(asked)
    def _asked(x):
        seen.append(gc.get_threshold())
        return lambda x: x

    return jit.fresh(lambda x: asked(x[0]))(np.zeros(1))


@pytest.mark.parametrize(
    "given, meanwhile", [((700, 10, 10), (10_000, 20, 20)), ((30_000, 5, 90), (30_000, 20, 90))]
)
def test_the_collector_runs_seldom_while_kernels_are_compiled_and_as_before_afterwards(
    usual, given, meanwhile
):
    seen = []
    gc.set_threshold(*given)
    compiled(seen)
    assert set(seen) == {meanwhile}
    assert gc.get_threshold() == given


def test_a_collector_that_is_off_stays_off(usual):
    seen = []
    gc.set_threshold(0, 10, 10)
    compiled(seen)
    assert {one[0] for one in seen} == {0} and gc.get_threshold()[0] == 0


def code_of(module):
    """The machine code of a loop that is compiled for `module`."""

    def doubled(x, out):
        for i in range(len(x)):
            out[i] = 2.0 * x[i]

    doubled.__module__ = module
    function = numba.njit(doubled)
    function(np.zeros(3), np.zeros(3))
    return next(iter(function.inspect_asm().values()))


@pytest.mark.skipif(
    llvmlite.binding.llvm_version_info[0] not in jit._KNOWN, reason="LLVM's options are not known"
)
def test_loops_of_kernels_are_not_unrolled_and_those_of_others_are_as_before():
    before = code_of("somebody.else")
    kernel = code_of("survey.kernels.some")
    assert len(kernel.splitlines()) < 0.8 * len(before.splitlines())
    assert len(code_of("somebody.else").splitlines()) == len(before.splitlines())


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
@pytest.mark.parametrize("decorator", [jit.fresh, jit.inline])
def test_what_kernels_call_is_compiled_once_for_all_constants(decorator):
    power = decorator(lambda x, n, doubled: (2.0 if doubled else 1.0) * x**n)
    caller = jit.fresh(
        lambda x: power(x, 2, True) + power(x, n=3, doubled=False) + power(x, 4, True)
    )
    assert caller(3.0) == 2 * 3.0**2 + 3.0**3 + 2 * 3.0**4
    assert len(power.signatures) == 1


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_arrays_that_kernels_make_begin_with_a_cache_line_and_those_of_others_as_before():
    before = cpu_target.target_context.get_preferred_array_alignment(numba.types.float64)

    def begins(n):
        return np.empty(n).ctypes.data

    begins.__module__ = "survey.kernels.some"
    kernel = jit.fresh(begins)
    assert {kernel(n) % 64 for n in range(1, 300, 7)} == {0}
    assert cpu_target.target_context.get_preferred_array_alignment(numba.types.float64) == before


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
@pytest.mark.parametrize("module, ours", [("survey.kernels.some", True), ("other", False)])
@pytest.mark.parametrize("wide", [True, False])
def test_kernels_have_an_aligned_stack_and_wide_vectors_and_functions_of_others_what_they_had(
    module, ours, wide, monkeypatch
):
    def half(x):
        return 0.5 * x

    monkeypatch.setattr(jit, "HAS_WIDE", wide)
    half.__module__ = module
    kernel = jit.fresh(half)
    assert kernel(3.0) == 1.5
    (code,) = kernel.inspect_llvm().values()
    assert ("alignstack=64" in code) == ours
    assert ('"prefer-vector-width"="512"' in code) == (ours and wide)


@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")
def test_what_is_inlined_serves_kernels_and_is_plain_python_otherwise():
    def root(x, n):
        for _ in range(n):
            x = math.sqrt(x) + x
        return x

    inlined = jit.inline(root)
    caller = jit.fresh(lambda x, n: inlined(x, n) + inlined(0.5 * x, 2))
    assert caller(3.0, 4) == root(3.0, 4) + root(1.5, 2)
    assert inlined(3.0, 4) == root(3.0, 4)  # after it was compiled for a kernel, and
    assert jit.inline(root)(3.0, 4) == root(3.0, 4)  # before
    result = inlined.overloads[numba.types.float64, numba.types.int64]
    assert result.entry_point is root
    # no machine code of its own: the engine knows no symbol of this name
    assert not result.library.codegen._engine.is_symbol_defined(result.fndesc.llvm_func_name)
