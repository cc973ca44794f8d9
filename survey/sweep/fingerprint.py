"""What must be unchanged for finished blocks to be used again, and by the workers."""

import hashlib
import json
import socket
from functools import cache
from importlib.metadata import version

import numpy as np

from survey.errors import Stopped
from survey.kernels import jit
from survey.sweep.cost import blocks_of


@cache
def code_version():
    """What names the code that solves blocks: it must be the same on every worker, the processor need not."""
    return {"survey": version("survey"), "sources": jit.SOURCE_HASH}


def compilers():
    """What else makes the code another one."""
    return {name: version(name) for name in ("numba", "llvmlite")}


def refuse_other_code(code):
    """Raise Stopped unless this process runs the code that the run was started with."""
    own = code_version()
    for what, value in code.items():
        if own[what] != value:
            raise Stopped(
                f"the worker on {socket.gethostname()} has other code ({what}: {own[what]}, this run: {value}); "
                "install the same survey, numba and llvmlite there and run the command again to go on"
            )


def fingerprint(workflow):
    """What must be unchanged for finished blocks to be used again."""
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
        "blocks": len(blocks_of(workflow)),
        "kernels": jit.SOURCE_HASH,
        "scene_hash": getattr(workflow.scene, "HASH", ""),
    }
