"""The decorator of this folder's kernels: kept on disk under a hash of these sources, so that none
goes stale.
"""

import hashlib
import os
from pathlib import Path

import llvmlite
import llvmlite.binding as llvm
import numba
import platformdirs


def _folder(function):
    """Named by a hash of the function's file and of the arithmetic and the columns that are compiled
    into it.
    """
    digest = hashlib.sha256(
        f"{numba.__version__} {llvmlite.__version__} {llvm.get_host_cpu_name()}".encode()
    )
    here = Path(__file__)
    shared = here.with_name("double.py"), here.parents[1] / "kernels" / "nutation" / "records.py"
    for path in (function.__code__.co_filename, *shared, here):
        digest.update(Path(path).read_bytes())
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("survey"))
    return base / f"truth-{digest.hexdigest()[:16]}"


def kernel(function):
    """Compile on the first call, and keep it."""
    previous = numba.config.CACHE_DIR
    try:
        folder = _folder(function)
        folder.mkdir(parents=True, exist_ok=True)
        numba.config.CACHE_DIR = str(folder)
        return numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except (OSError, RuntimeError):  # no place to keep it, or no home
        return numba.njit(nogil=True, error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = previous


def inline(function):
    """Compile as a part of the kernels that call it."""
    return numba.njit(nogil=True, error_model="numpy", forceinline=True)(function)
