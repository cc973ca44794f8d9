"""What a run would do, without a kernel call."""

import shutil

from rich import filesize

from survey.errors import BadInput
from survey.file import unfinished
from survey.file.labels import layout
from survey.kernels import jit
from survey.sweep.cost import _cost, blocks_of, bytes_per_point, seconds_per_point
from survey.sweep.dispatch import cpus
from survey.sweep.extras import parts_beside
from survey.wording import counted

# what a plan says of the kernels
NEW = "all kernels, once: this machine has none of them yet (up to a minute)"
KNOWN = "kernels that no run on this machine has needed yet, once"


def plan(workflow):
    """What a run would do: points, blocks, bytes, method, estimated seconds. No kernel is called."""
    scene, request, grid = workflow.scene, workflow.request, workflow.grid
    seconds = grid.points * seconds_per_point(scene, request, grid)
    beside = {}
    for name, part in parts_beside(workflow).items():
        beside[name], more = part.plan(workflow, _cost(scene, request, grid))
        seconds += more
    return {
        "scene": workflow.name,
        "options": ", ".join(f"{key}={value}" for key, value in request.options.items()),
        "axes": {name: counted(size, "value") for name, size in grid.sizes.items()},
        "points": grid.points,
        "blocks": len(blocks_of(workflow)),
        "bytes": grid.points * bytes_per_point(scene, request),
        "method": request.method,
        "rtol": request.rtol,
        "variables": ", ".join(name for name in layout(scene, request)),
        **beside,
        "output": str(workflow.path),
        "threads": cpus(),
        "estimated_seconds": float(f"{seconds / cpus():.2g}"),
        "not_estimated": f"writing the file; compiling {NEW if jit.is_new() else KNOWN}",
    }


def refuse_too_large(workflow):
    """Raise BadInput if the map's blocks and its file do not fit onto the disk of its output.

    What an interrupted run has written there already needs no more room.
    """
    grid = workflow.grid
    needed = 2 * grid.points * bytes_per_point(workflow.scene, workflow.request)
    room = shutil.disk_usage(workflow.path.parent).free
    if needed > room and needed > room + unfinished.size(workflow.path):
        raise BadInput(
            f"{counted(grid.points, 'point')} need {filesize.decimal(needed)}, and the disk of {workflow.path} has "
            f"{filesize.decimal(room)} free; take fewer points, or name fewer outputs in output.variables"
        )
