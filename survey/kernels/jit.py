"""The decorators of kernels, their flags, and a kernel cache that cannot go stale.

nogil: dask's threads run kernels side by side. error_model="numpy": a division by zero gives inf,
which is checked, and loops vectorise. No fastmath and no contraction (kernels ask for fused
multiply-adds by name, `unroll.fma`): compiled code and plain Python (NUMBA_DISABLE_JIT=1) give the
same bits, and NaN checks stay. No signatures: importing compiles nothing. Loops become vector code
but are not unrolled beyond that: it took a third of the compiler's time and made no kernel faster.

numba's own cache returns stale results when an imported module changes; here its directory is named
by a hash of every source that is compiled, of the versions and of the CPU, so that any edit starts
an empty one.
"""

import gc
import hashlib
import inspect
import os
from functools import cache
from pathlib import Path

import llvmlite
import llvmlite.binding as llvm
import numba
import platformdirs
from numba.core import event, imputils, types
from numba.core.registry import cpu_target
from numba.extending import intrinsic, overload

from survey.kernels import of_callers, quick_typing

# Fused multiply-adds: of today's processors only old and small ones of x86 have none.
HAS_FMA = not llvm.get_process_triple().startswith(
    ("x86", "i686")
) or llvm.get_host_cpu_features().get("fma", False)
# Intel's processors from Sapphire Rapids on: LLVM uses vectors of half their width, since older ones slow down
# with whole ones.
HAS_WIDE = llvm.get_host_cpu_features().get("avx512fp16", False)
WIDE = '"prefer-vector-width"="512"'
COMPILED = ("kernels", "methods", "measures", "scenes")  # the packages whose functions are compiled
# What decides no number of the output: all other sources do, those that are yet to be written
# included.
APART = ("__main__.py", "accessor.py", "analysis", "cli.py", "precision", "show", "viewer")


def source_hash(*names):
    """Hash (16 hex digits) of the compilers' versions and of these modules and packages of survey."""
    root = str(Path(__file__).parents[1])
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}".encode())
    for name in sorted(names):
        for file in sorted(_sources(os.path.join(root, name))):
            within = file[len(root) + 1 :].replace(os.sep, "/")
            with open(file, "rb", buffering=0) as source:  # every start of survey reads them all
                digest.update(f"{within}\0".encode() + source.readall() + b"\0")
    return digest.hexdigest()[:16]


def _sources(path):
    """The Python files in the folder `path` and below, or `path` itself where it is a file."""
    if not os.path.isdir(path):
        return [path]
    return [
        os.path.join(folder, file)
        for folder, _, files in os.walk(path)
        for file in files
        if file.endswith(".py")
    ]


def deciding():
    """The names of the modules and packages of survey that decide numbers of the output."""
    names = (
        path.name
        for path in Path(__file__).parents[1].iterdir()
        if path.suffix == ".py" or path.is_dir()
    )
    return [name for name in names if name not in APART and not name.startswith("__pycache__")]


@cache
def deciding_hash():
    """Hash (16 hex digits) of all that decides numbers of the output, read once: only runs that
    keep files need it.
    """
    return source_hash(*deciding())


def kernel_hash():
    """Hash (16 hex digits) of what is compiled and of the CPU that it is compiled for."""
    cpu = f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"
    return hashlib.sha256(f"{source_hash(*COMPILED)} {cpu}".encode()).hexdigest()[:16]


KERNEL_HASH = kernel_hash()


def _cache_directory():
    """A writable directory for compiled kernels, or None (a read-only home compiles again in each
    process).
    """
    try:
        path = (
            Path(os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("survey"))
            / KERNEL_HASH
        )
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # platformdirs raises RuntimeError for a user who has no home
        return None
    return path if os.access(path, os.W_OK) else None


class _Compiling(event.TimingListener):
    """Measures the time spent in compiling, has the garbage collector run seldom meanwhile, and sets
    options of LLVM and of numba for our kernels.

    What a compiler builds lives until it is done; looking through it again and again took 6 to 16 %
    of its time. numba compiles one function at a time in a process, and what it compiles for others
    keeps the options that it had.
    """

    SELDOM = (10_000, 20, 20)

    def on_start(self, start):
        if self._depth == 0:
            self._usual = gc.get_threshold()
            if self._usual[0]:  # 0: the collector is off
                gc.set_threshold(*map(max, self._usual, self.SELDOM))
            function = getattr((start.data or {}).get("dispatcher"), "py_func", None)
            self._ours = str(getattr(function, "__module__", "")).startswith("survey.")
            if self._ours:
                quick_typing.begin()
                _set_options(_NO_UNROLLING)
                cpu_target.target_context.get_preferred_array_alignment = _of_cache_lines
                cpu_target.target_context.declare_function = _declared
        super().on_start(start)

    def on_end(self, end):
        super().on_end(end)
        if self._depth == 0:
            gc.set_threshold(*self._usual)
            if self._ours:
                quick_typing.end()
                _set_options(_DEFAULT)
                del cpu_target.target_context.get_preferred_array_alignment
                del cpu_target.target_context.declare_function


# no copies of a loop's body for more iterations at once, for several vectors at once, and for what they leave
_NO_UNROLLING = {
    "unroll-runtime": "false",
    "force-vector-interleave": "1",
    "enable-epilogue-vectorization": "false",
}
_DEFAULT = {
    "unroll-runtime": "true",
    "force-vector-interleave": "0",
    "enable-epilogue-vectorization": "true",
}
# Versions of LLVM that have these options: one that it does not know would end the process.
_KNOWN = range(15, 23)


def _of_cache_lines(_type):
    """Where arrays that kernels make begin: numba's 32 bytes had half of all runs go over two cache
    lines with every vector, which took up to a sixth of their time.
    """
    return 64


def _declared(module, fndesc):
    """Declare a function whose stack begins with a cache line, see `_of_cache_lines`, as what registers cannot
    hold is put there in whole vectors, and whose vectors are WIDE where most kernels gain by that.
    """
    context = cpu_target.target_context
    function = type(context).declare_function(context, module, fndesc)
    # changes nothing, but llvmlite does not write an alignstack that stands alone
    function.attributes.add("nonlazybind")
    function.attributes.alignstack = 64
    if HAS_WIDE:
        set.add(function.attributes, WIDE)  # past llvmlite's list of names, which has no such
    return function


def _set_options(options):
    if llvm.llvm_version_info[0] in _KNOWN:
        for name, value in options.items():
            llvm.set_option("survey", f"-{name}={value}")


_DIRECTORY = _cache_directory()
_BEGUN = set()  # works that this process has asked about
_COMPILING = _Compiling()
event.register("numba:compile", _COMPILING)


def is_first(work):
    """Is this machine's kernel cache asked about `work` (a file's name) for the first time?"""
    if _DIRECTORY is None or numba.config.DISABLE_JIT or work in _BEGUN:
        return False
    _BEGUN.add(work)
    try:
        (_DIRECTORY / f"{work}.begun").touch(exist_ok=False)
    except OSError:
        return False
    return True


def compile_seconds():
    """Seconds in which this process has compiled kernels so far."""
    return _COMPILING.duration if _COMPILING.done else 0.0


_FLAGS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function):
    """Compile `function` on its first call and keep the result on disk; call it with contiguous
    float64 arrays.
    """
    if _DIRECTORY is None:
        return _compiled(function)
    previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(_DIRECTORY)
    try:
        return _compiled(function, cache=True)
    finally:
        numba.config.CACHE_DIR = previous


def fresh(function):
    """Compile `function`, which calls a user's, again in each process: kept on disk it could go stale."""
    return _compiled(function)


def inline(function):
    """Compile `function` as part of the kernels that call it (always inlined by LLVM, never cached alone).

    Called from Python it is plain Python, which gives the same bits.
    """
    return _of_callers(function, forceinline=True)


def part(function):
    """As `inline`, but left to be called: for what a kernel calls in several places."""
    return _of_callers(function)


def _of_callers(function, **flags):
    return of_callers.kept(_compiled(function, **flags, pipeline_class=of_callers.Pipeline))


def _compiled(function, **flags):
    """numba.njit, but for kernels that call it with different constants compiled once, not for each of
    them: that took up to a sixth of the compiler's time.
    """
    dispatcher = numba.njit(**flags, **_FLAGS)(function)
    if not numba.config.DISABLE_JIT:
        resolve = dispatcher.get_call_template

        def get_call_template(args, kws):
            args, kws = map(types.unliteral, args), kws.items()
            return resolve(tuple(args), {key: types.unliteral(kind) for key, kind in kws})

        dispatcher.get_call_template = get_call_template
    return dispatcher


def splice(function):
    """As `inline`, but copied into its callers before they are typed: compiled once, if it is called once."""
    return numba.njit(inline="always", **_FLAGS)(function)


def for_constants(special):
    """Make kernels call the kernel `special` in place of the decorated function on a read-only
    array as first argument.

    Then they compile nothing that the decorated function alone needs. It must be right for any
    array: without the JIT it is the one that runs.
    """

    special = getattr(special, "py_func", special)

    def decorated(function):
        def chosen(*arguments):
            return function if arguments[0].mutable else special

        chosen.__signature__ = inspect.signature(function)
        overload(function, jit_options=_FLAGS)(chosen)
        return function

    return decorated


def constant(array):
    """The array, which is not written to from here on: kernels take it for a read-only one, see
    `for_constants`.
    """
    return array


@intrinsic
def _read_only(_context, array):
    def borrowed(context, builder, signature, arguments):
        return imputils.impl_ret_borrowed(context, builder, signature.return_type, arguments[0])

    return array.copy(readonly=True)(array), borrowed


@overload(constant)
def _constant(array):
    return lambda array: _read_only(array)
