"""The decorator of this folder's kernels: kept on disk under a hash of these sources, so that none goes stale."""

import hashlib
import os
from pathlib import Path

import llvmlite
import numba
import platformdirs


def _folder():
    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}".encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        if "@kernel" in (text := path.read_text()) or "@inline" in text:
            digest.update(text.encode())
    base = Path(os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("survey"))
    return base / f"attack-{digest.hexdigest()[:16]}"


def kernel(function):
    """Compile on the first call, and keep it."""
    folder, previous = _folder(), numba.config.CACHE_DIR
    try:
        folder.mkdir(parents=True, exist_ok=True)
        numba.config.CACHE_DIR = str(folder)
        return numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except OSError:
        return numba.njit(nogil=True, error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = previous


def inline(function):
    """Compile as a part of the kernels that call it."""
    return numba.njit(nogil=True, error_model="numpy", forceinline=True)(function)
