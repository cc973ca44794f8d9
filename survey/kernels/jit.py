"""The one decorator, its flags, and a kernel cache that cannot go stale.

nogil: dask's threads run kernels side by side. error_model="numpy": a division by zero gives inf, which is checked,
and loops vectorise. No fastmath and no contraction: compiled code and plain Python (NUMBA_DISABLE_JIT=1) give the
same bits, and NaN checks stay. No signatures: importing compiles nothing.

numba's own cache returns stale results when an imported module changes; here its directory is named by a hash of
every source that can reach a kernel, of the versions and of the CPU, so that any edit starts an empty one.
"""

import hashlib
import os
import subprocess
import time
from pathlib import Path

import llvmlite
import llvmlite.binding as llvm
import numba
import platformdirs
from numba.core import event

SOURCES = ("kernels", "methods", "measures", "scenes")
FILES = ("boundaries.py", "grid.py", "hill_scene.py", "own.py", "refine.py")  # what else makes numbers


def source_hash():
    """Hash of all sources that can reach a number of the output and of the compiler versions (16 hex digits)."""
    root = Path(__file__).parent.parent
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}".encode())
    paths = [root / name for name in FILES]
    for folder in SOURCES:
        paths += sorted((root / folder).glob("*.py"))
    for path in paths:
        digest.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def kernel_hash():
    """Hash of the sources and of the CPU that they are compiled for (16 hex digits)."""
    cpu = f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"
    return hashlib.sha256(f"{SOURCE_HASH} {cpu}".encode()).hexdigest()[:16]


SOURCE_HASH = source_hash()
KERNEL_HASH = kernel_hash()


def _cache_directory():
    """A writable directory for compiled kernels, or None (a read-only home compiles anew in each process)."""
    base = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("survey")
    path = Path(base) / KERNEL_HASH
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return path if os.access(path, os.W_OK) else None


_DIRECTORY = _cache_directory()
_COMPILING = event.TimingListener()
event.register("numba:compile", _COMPILING)


def is_new():
    """Has this machine compiled no kernel of these sources yet, and can it keep them?"""
    return _DIRECTORY is not None and not numba.config.DISABLE_JIT and next(_DIRECTORY.rglob("*.nbi"), None) is None


ahead: subprocess.Popen | None = None  # a process that compiles for this one, on a new machine
waited = 0.0


def wait_for_ahead():
    """Wait for the process that compiles ahead: it will be done sooner than if this one began now."""
    global waited
    process = ahead
    if process is not None and process.poll() is None:
        began = time.perf_counter()
        process.wait()
        waited = max(waited, time.perf_counter() - began)  # threads wait side by side


def compile_seconds():
    """Seconds in which this process has compiled kernels so far, or waited for another that does."""
    return waited + (_COMPILING.duration if _COMPILING.done else 0.0)


_FLAGS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def kernel(function):
    """Compile `function` on its first call and keep the result on disk; call it with contiguous float64 arrays."""
    if _DIRECTORY is None:
        return numba.njit(**_FLAGS)(function)
    previous, numba.config.CACHE_DIR = numba.config.CACHE_DIR, str(_DIRECTORY)
    try:
        return numba.njit(cache=True, **_FLAGS)(function)
    finally:
        numba.config.CACHE_DIR = previous


def fresh(function):
    """Compile `function`, which calls a user's, anew in each process: kept on disk it could go stale."""
    return numba.njit(**_FLAGS)(function)


def inline(function):
    """Compile `function` as part of the kernels that call it (always inlined by LLVM, never cached alone)."""
    return numba.njit(forceinline=True, **_FLAGS)(function)


def splice(function):
    """As `inline`, but copied into its callers before they are typed: compiled once, if it is called once."""
    return numba.njit(inline="always", **_FLAGS)(function)
