"""What must be unchanged for finished blocks to be reused, and the same on every worker."""

import hashlib
import json
import socket
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from survey import __version__
from survey.errors import Stopped
from survey.file.unfinished import FUSED
from survey.kernels import jit
from survey.sweep.cost import block_geometry


@cache
def code_version():
    """What identifies the code that solves blocks: it must be the same on every worker, of the processor
    this alone.
    """
    return {"survey": __version__, "sources": jit.deciding_hash(), FUSED: jit.HAS_FMA}


def compilers():
    """Versions of the compilers, on which the bits depend too."""
    return {name: version(name) for name in ("numba", "llvmlite")}


def refuse_other_code(code):
    """Raise Stopped unless this process runs the code that the run was started with."""
    own = code_version()
    if own[FUSED] != code.get(FUSED, own[FUSED]):
        has, other = ("has", "has none") if own[FUSED] else ("has no", "has them")
        raise Stopped(
            f"the processor of the worker on {socket.gethostname()} {has} fused multiply-adds, which decide last bits, "
            f"and the one that the run was started on {other}; run the command again to resume without this worker"
        )
    for what, value in code.items():
        if own[what] != value:
            raise Stopped(
                f"the worker on {socket.gethostname()} runs different code ({what}: {own[what]}, this run: {value}); "
                "install the same survey, numba and llvmlite there and run the command again to resume"
            )


def fingerprint(workflow):
    """What must be unchanged for finished blocks to be reused: {key: plain data}."""
    digest = hashlib.sha256()
    for name, (dims, values) in workflow.grid.parameters.items():
        digest.update(f"{name}{dims}{np.shape(values)}".encode() + np.asarray(values).tobytes())
    request = workflow.request
    return {
        "scene": workflow.name,
        "options": json.dumps(dict(request.options)),
        "axes": digest.hexdigest(),
        "method": request.method,
        "rtol": request.rtol,
        "variables": sorted(request.variables),
        "block_geometry": block_geometry(workflow),
        "kernels": jit.deciding_hash(),
        FUSED: jit.HAS_FMA,
        "scene_hash": getattr(workflow.scene, "HASH", "") or _hash_of_plugin(workflow.scene),
    } | ({"proves": True} if workflow.proves else {})


def _hash_of_plugin(scene):
    """Hash of the source of a scene that another package brings; "" for those here, which `kernels`
    covers.
    """
    file = getattr(scene, "__file__", None)
    if file is None or scene.__name__.startswith("survey."):
        return ""
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()
